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
            sums[i + k] += (words[k] & SPREAD_MASK) + (turned & SPREAD_MASK);
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
        sums[i] += spread_888(pixels + 6 * i) + spread_888(pixels + 6 * i + 3);
    }
}

/// A 2x2 sum as an RGB565 pixel of its mean.
static uint16_t mean_565(uint32_t quad)
{
    const uint32_t mean = ((quad + HALF_OF_FOUR) >> 2) & SPREAD_MASK;
    return (uint16_t)(mean | mean >> 16);
}

/// Brightness of a 2x2 sum, 0 to 376: green counts twice as much as red, because it has a bit more.
static uint32_t luma(uint32_t quad)
{
    return ((quad >> RED_SHIFT) & 127) + (quad >> GREEN_SHIFT);
}

/// A cell from the sum of its 16 pixels.
static bslam_cell_t cell_of_sum(uint32_t sum, uint32_t spread)
{
    const bslam_cell_t cell = {
        .red = (uint8_t)((sum >> (RED_SHIFT + 1)) & 255),
        .green = (uint8_t)(sum >> (GREEN_SHIFT + 2)),
        .blue = (uint8_t)((sum & 511) >> 1),
        .spread = (uint8_t)(spread > 255 ? 255 : spread),
    };
    return cell;
}

/// A row of the half-resolution copy, and the brightness of its pixels.
static void reduce_quads(const uint32_t *restrict sums, uint16_t *restrict half, uint16_t *restrict lumas,
                         int32_t pairs)
{
    for (int32_t i = 0; i < pairs; i += PAIRS_A_STEP) {
        for (int32_t k = i; k < i + PAIRS_A_STEP; k++) {
            half[k] = mean_565(sums[k]);
            lumas[k] = (uint16_t)luma(sums[k]);
        }
    }
}

static uint16_t darker(uint16_t a, uint16_t b)
{
    return a < b ? a : b;
}

static uint16_t brighter(uint16_t a, uint16_t b)
{
    return a > b ? a : b;
}

/// Keeps the upper half of a row of cells.
static void begin_cells(bslam_thumbnail_t *t, int32_t columns)
{
    for (int32_t c = 0; c < columns; c++) {
        t->cell_sums[c] = t->pair_sums[2 * c] + t->pair_sums[2 * c + 1];
        t->darkest[c] = darker(t->lumas[2 * c], t->lumas[2 * c + 1]);
        t->brightest[c] = brighter(t->lumas[2 * c], t->lumas[2 * c + 1]);
    }
}

/// Adds the lower half to it.
static void finish_cells(bslam_thumbnail_t *t, int32_t columns, int32_t first)
{
    for (int32_t c = 0; c < columns; c++) {
        const uint32_t sum = t->cell_sums[c] + t->pair_sums[2 * c] + t->pair_sums[2 * c + 1];
        const uint16_t low = darker(t->darkest[c], darker(t->lumas[2 * c], t->lumas[2 * c + 1]));
        const uint16_t high = brighter(t->brightest[c], brighter(t->lumas[2 * c], t->lumas[2 * c + 1]));
        const bslam_cell_t cell = cell_of_sum(sum, (uint32_t)(high - low));
        t->cells.red[first + c] = cell.red;
        t->cells.green[first + c] = cell.green;
        t->cells.blue[first + c] = cell.blue;
        t->cells.spread[first + c] = cell.spread;
    }
}

/// Turns two summed rows into a row of the half-resolution copy and the upper or lower half of a row of
/// cells.
static void reduce_two_rows(bslam_thumbnail_t *t)
{
    const int32_t columns = t->width_px / BSLAM_CELL_PX, pairs = t->width_px / 2;
    reduce_quads(t->pair_sums, t->half + t->rows_seen / 2 * pairs, t->lumas, pairs);
    if (t->rows_seen % BSLAM_CELL_PX == 3) {
        finish_cells(t, columns, t->rows_seen / BSLAM_CELL_PX * columns);
    } else {
        begin_cells(t, columns);
    }
}

bslam_status_t bslam_thumbnail_row(bslam_thumbnail_t *thumbnail, const void *pixels)
{
    bslam_thumbnail_t *t = thumbnail;
    if (t->rows_seen >= t->height_px) {
        return BSLAM_E_COUNT;
    }
    const int32_t pairs = t->width_px / 2;
    if (t->rows_seen % 2 == 0) {
        memset(t->pair_sums, 0, (size_t)pairs * sizeof t->pair_sums[0]);
    }
    if (t->format == BSLAM_PIXELS_RGB565) {
        sum_pairs_565(t->pair_sums, pixels, pairs);
    } else {
        sum_pairs_888(t->pair_sums, pixels, pairs);
    }
    if (t->rows_seen % 2 == 1) {
        reduce_two_rows(t);
    }
    t->rows_seen++;
    return BSLAM_OK;
}
