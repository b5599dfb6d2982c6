#include "bslam/vision/thumbnail.h"

#include <string.h>

/// Where the channels of an RGB565 pixel stand in a word once spread: blue in bits 0-4, red in 11-15, green
/// in 21-26. Above each are 5 free bits or more, so that up to 32 pixels add up.
#define SPREAD_MASK 0x07E0F81FU
#define RED_SHIFT 11
#define GREEN_SHIFT 21
/// 2 in each channel: makes a quarter of a sum of four round to nearest.
#define HALF_OF_FOUR (2U | 2U << RED_SHIFT | 2U << GREEN_SHIFT)
/// Pixel pairs in a step of the loop over a row; a constant, so that a compiler can use vector instructions.
#define PAIRS_A_STEP (BSLAM_IMAGE_WIDTH_STEP / 2)

static bool size_is_allowed(int32_t size_px, int32_t size_max_px, int32_t step_px)
{
    return size_px >= BSLAM_IMAGE_SIDE_MIN && size_px <= size_max_px && size_px % step_px == 0;
}

bslam_status_t bslam_thumbnail_begin(bslam_thumbnail_t *thumbnail, bslam_pixel_format_t format,
                                     int32_t width_px, int32_t height_px)
{
    if ((format != BSLAM_PIXELS_RGB565 && format != BSLAM_PIXELS_RGB888) ||
        !size_is_allowed(width_px, BSLAM_IMAGE_WIDTH_MAX, BSLAM_IMAGE_WIDTH_STEP) ||
        !size_is_allowed(height_px, BSLAM_IMAGE_HEIGHT_MAX, BSLAM_CELL_PX)) {
        return BSLAM_E_RANGE;
    }
    thumbnail->format = format;
    thumbnail->width_px = width_px;
    thumbnail->height_px = height_px;
    thumbnail->rows_seen = 0;
    return BSLAM_OK;
}

/// Adds up the pixels of each pair. The word of two RGB565 pixels, and the same turned by half, hold between
/// them each channel of each pixel in its spread place; which of the two came first does not matter.
static void sum_pairs_565(uint32_t *restrict sums, const uint8_t *restrict pixels, int32_t pairs)
{
    for (int32_t i = 0; i < pairs; i += PAIRS_A_STEP) {
        uint32_t words[PAIRS_A_STEP];
        memcpy(words, pixels + 4 * i, sizeof words);
        for (int32_t k = 0; k < PAIRS_A_STEP; k++) {
            const uint32_t turned = words[k] >> 16 | words[k] << 16;
            sums[i + k] = (words[k] & SPREAD_MASK) + (turned & SPREAD_MASK);
        }
    }
}

static uint32_t spread_888(const uint8_t *pixel)
{
    return (uint32_t)(pixel[0] >> 3) << RED_SHIFT | (uint32_t)(pixel[1] >> 2) << GREEN_SHIFT |
           (uint32_t)(pixel[2] >> 3);
}

static void sum_pairs_888(uint32_t *restrict sums, const uint8_t *restrict pixels, int32_t pairs)
{
    for (int32_t i = 0; i < pairs; i++) {
        sums[i] = spread_888(pixels + 6 * i) + spread_888(pixels + 6 * i + 3);
    }
}

/// Steps of the loops over sums, which have room for whole ones beyond a row's end. What they write there is
/// written over later.
#define SUMS_A_STEP BSLAM_CELL_STEP

/// Turns the pair sums of two rows into their 2x2 sums, in `quads`, and a row of the half-resolution copy.
static void reduce_rows(uint32_t *restrict quads, const uint32_t *restrict upper, uint16_t *restrict half,
                        int32_t pairs)
{
    for (int32_t i = 0; i < pairs; i += SUMS_A_STEP) {
        for (int32_t k = i; k < i + SUMS_A_STEP; k++) {
            quads[k] += upper[k];
            const uint32_t mean = ((quads[k] + HALF_OF_FOUR) >> 2) & SPREAD_MASK;
            half[k] = (uint16_t)(mean | mean >> 16);
        }
    }
}

/// Brightness of a 2x2 sum, 0 to 376: green counts twice as much as red, because it has a bit more.
static int16_t luma(uint32_t quad)
{
    return (int16_t)(((quad >> RED_SHIFT) & 127) + (quad >> GREEN_SHIFT));
}

static int16_t darker(int16_t a, int16_t b)
{
    return a < b ? a : b;
}

static int16_t brighter(int16_t a, int16_t b)
{
    return a > b ? a : b;
}

/// Keeps the upper 2x2 sums of a row of cells.
static void begin_cells(bslam_row_sums_t *sums, int32_t pairs)
{
    memcpy(sums->upper_quads, sums->quads, (size_t)pairs * sizeof sums->quads[0]);
}

/// Joins them with the lower ones: sums of halves of cells, the darkest and the brightest of their quarters.
static void join_quads(uint32_t *restrict quads, const uint32_t *restrict upper, int16_t *restrict darkest,
                       int16_t *restrict brightest, int32_t pairs)
{
    for (int32_t i = 0; i < pairs; i += SUMS_A_STEP) {
        for (int32_t k = i; k < i + SUMS_A_STEP; k++) {
            const int16_t above = luma(upper[k]), below = luma(quads[k]);
            quads[k] += upper[k];
            darkest[k] = darker(above, below);
            brightest[k] = brighter(above, below);
        }
    }
}

/// Sums and ranges of SUMS_A_STEP cells from those of their halves.
static void join_halves(uint32_t *restrict sums, int16_t *restrict ranges, const uint32_t *restrict halves,
                        const int16_t *restrict darkest, const int16_t *restrict brightest)
{
    for (int32_t k = 0; k < SUMS_A_STEP; k++) {
        sums[k] = halves[2 * k] + halves[2 * k + 1];
    }
    for (int32_t k = 0; k < SUMS_A_STEP; k++) {
        const int16_t low = darker(darkest[2 * k], darkest[2 * k + 1]);
        const int16_t high = brighter(brightest[2 * k], brightest[2 * k + 1]);
        ranges[k] = (int16_t)(high - low);
    }
}

/// SUMS_A_STEP cells, from `first` on.
static void fill_cells(bslam_cells_t *restrict cells, int32_t first, const uint32_t *restrict sums,
                       const int16_t *restrict ranges)
{
    for (int32_t k = 0; k < SUMS_A_STEP; k++) {
        cells->red[first + k] = (uint8_t)(sums[k] >> (RED_SHIFT + 1));
        cells->green[first + k] = (uint8_t)(sums[k] >> (GREEN_SHIFT + 2));
        cells->blue[first + k] = (uint8_t)((sums[k] & 511) >> 1);
    }
    for (int32_t k = 0; k < SUMS_A_STEP; k++) {
        cells->spread[first + k] = (uint8_t)darker(ranges[k], 255);
    }
}

/// The cells of a row, from `first` on.
static void finish_cells(bslam_cells_t *cells, const bslam_row_sums_t *row, int32_t first, int32_t columns)
{
    for (int32_t i = 0; i < columns; i += SUMS_A_STEP) {
        uint32_t sums[SUMS_A_STEP];
        int16_t ranges[SUMS_A_STEP];
        join_halves(sums, ranges, row->quads + 2 * i, row->darkest + 2 * i, row->brightest + 2 * i);
        fill_cells(cells, first + i, sums, ranges);
    }
}

/// Turns two summed rows into a row of the half-resolution copy and the upper or lower half of a row of
/// cells.
static void reduce_two_rows(bslam_thumbnail_t *t, bslam_row_sums_t *sums)
{
    const int32_t columns = t->width_px / BSLAM_CELL_PX, pairs = t->width_px / 2;
    reduce_rows(sums->quads, sums->pairs, t->half + t->rows_seen / 2 * pairs, pairs);
    if (t->rows_seen % BSLAM_CELL_PX == 3) {
        join_quads(sums->quads, sums->upper_quads, sums->darkest, sums->brightest, pairs);
        finish_cells(&t->cells, sums, t->rows_seen / BSLAM_CELL_PX * columns, columns);
    } else {
        begin_cells(sums, pairs);
    }
}

bslam_status_t bslam_thumbnail_row(bslam_thumbnail_t *thumbnail, bslam_row_sums_t *sums, const void *pixels)
{
    bslam_thumbnail_t *t = thumbnail;
    if (t->rows_seen >= t->height_px) {
        return BSLAM_E_COUNT;
    }
    const int32_t pairs = t->width_px / 2;
    uint32_t *into = t->rows_seen % 2 == 0 ? sums->pairs : sums->quads;
    if (t->format == BSLAM_PIXELS_RGB565) {
        sum_pairs_565(into, pixels, pairs);
    } else {
        sum_pairs_888(into, pixels, pairs);
    }
    if (t->rows_seen % 2 == 1) {
        reduce_two_rows(t, sums);
    }
    t->rows_seen++;
    return BSLAM_OK;
}
