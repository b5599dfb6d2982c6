#include "bslam/vision/thumbnail.h"

#include <string.h>

#include "bslam/math/bytes.h"

/// Where the channels of an RGB565 pixel stand in a word once spread: blue in bits 0-4, red in 11-15, green
/// in 21-26. Above each are 5 free bits or more, so that up to 32 pixels add up.
#define SPREAD_MASK 0x07E0F81FU
#define RED_SHIFT 11
#define GREEN_SHIFT 21
/// 2 in each channel: makes a quarter of a sum of four round to nearest.
#define HALF_OF_FOUR (2U | 2U << RED_SHIFT | 2U << GREEN_SHIFT)
/// Pixel pairs in a step of the loop over a row.
#define PAIRS_A_STEP (BSLAM_IMAGE_WIDTH_STEP / 2)
/// Before the loop over a step: a core without vectors takes its pairs one after the other, without a loop;
/// any other takes them at once, which a compiler sees in a loop alone.
#if BSLAM_HAS_BYTES
#define A_STEP_IN_LINE _Pragma("GCC unroll 4")
#else
#define A_STEP_IN_LINE
#endif

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

/// A row of 8 bits a channel as one of RGB565.
static void pack_888(uint16_t *restrict packed, const uint8_t *restrict pixels, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        const uint8_t *rgb = pixels + 3 * i;
        packed[i] = (uint16_t)(rgb[0] >> 3 << 11 | rgb[1] >> 2 << 5 | rgb[2] >> 3);
    }
}

/// The sum of a pair of pixels. The word of two, and the same turned by half, hold between them each channel
/// of each pixel in its spread place; which of the two came first does not matter.
static inline uint32_t pair_sum(const uint8_t *pair)
{
    const uint32_t word = bslam_word_at(pair);
    return (word & SPREAD_MASK) + ((word >> 16 | word << 16) & SPREAD_MASK);
}

/// The mean of 2x2 pixels in RGB565 from their sum.
static inline uint16_t mean_565(uint32_t quad)
{
    const uint32_t mean = ((quad + HALF_OF_FOUR) >> 2) & SPREAD_MASK;
    return (uint16_t)(mean | mean >> 16);
}

/// The upper row of two: sums of its pairs.
static void sum_pairs(uint32_t *restrict sums, const uint8_t *restrict pixels, int32_t pairs)
{
    for (int32_t i = 0; i < pairs; i += PAIRS_A_STEP) {
        A_STEP_IN_LINE
        for (int32_t k = 0; k < PAIRS_A_STEP; k++) {
            sums[i + k] = pair_sum(pixels + 4 * (i + k));
        }
    }
}

/// The lower row of two: to the sums of the upper row's pairs, which become those of 2x2 pixels; their means.
static void sum_quads(uint32_t *restrict sums, uint16_t *restrict half, const uint8_t *restrict pixels,
                      int32_t pairs)
{
    for (int32_t i = 0; i < pairs; i += PAIRS_A_STEP) {
        A_STEP_IN_LINE
        for (int32_t k = 0; k < PAIRS_A_STEP; k++) {
            sums[i + k] += pair_sum(pixels + 4 * (i + k));
        }
        A_STEP_IN_LINE
        for (int32_t k = 0; k < PAIRS_A_STEP; k++) {
            half[i + k] = mean_565(sums[i + k]);
        }
    }
}

/// Brightness of a 2x2 sum, 0 to 376: green counts twice as much as red, because it has a bit more.
static inline uint32_t luma(uint32_t quad)
{
    return (quad >> RED_SHIFT & 127) + (quad >> GREEN_SHIFT);
}

/// The largest luma of four quarters less the smallest, at most 255: of two at a time, in halves of a word.
static inline uint8_t spread_of(const uint32_t above[2], const uint32_t below[2])
{
    const uint32_t uppers = luma(above[0]) | luma(above[1]) << 16;
    const uint32_t lowers = luma(below[0]) | luma(below[1]) << 16;
    const uint32_t less = bslam_halves_less(uppers, lowers);
    const uint32_t highs = lowers + less, lows = uppers - less;
    const uint32_t other_high = bslam_halves_turned(highs), other_low = bslam_halves_turned(lows);
    const uint32_t high = other_high + bslam_halves_less(highs, other_high);
    const uint32_t low = lows - bslam_halves_less(lows, other_low);
    const int32_t spread = (int32_t)((high - low) & 0xFFFFU);
    return (uint8_t)(spread < 0 ? 0 : spread < 255 ? spread : 255);
}

static inline void fill_cell(bslam_cells_t *cells, int32_t i, const uint32_t *above, const uint32_t *below)
{
    const uint32_t sum = above[0] + above[1] + below[0] + below[1];
    cells->red[i] = (uint8_t)(sum >> (RED_SHIFT + 1));
    cells->green[i] = (uint8_t)(sum >> (GREEN_SHIFT + 2));
    cells->blue[i] = (uint8_t)(sum >> 1);
    cells->spread[i] = spread_of(above, below);
}

#if !BSLAM_HAS_BYTES
#define CELLS_AT_ONCE 4

static inline int32_t most(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

static inline int32_t least(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

/// fill_cell() for several in a row.
static void fill_four(bslam_cells_t *cells, int32_t i, const uint32_t *restrict above,
                      const uint32_t *restrict below)
{
    uint32_t sum[CELLS_AT_ONCE];
    int32_t spread[CELLS_AT_ONCE];
    for (int32_t k = 0; k < CELLS_AT_ONCE; k++) {
        const uint32_t a = above[2 * k], b = above[2 * k + 1], c = below[2 * k], d = below[2 * k + 1];
        const int32_t of_a = (int32_t)luma(a), of_b = (int32_t)luma(b), of_c = (int32_t)luma(c);
        const int32_t of_d = (int32_t)luma(d);
        sum[k] = a + b + c + d;
        spread[k] = least(
            most(most(of_a, of_b), most(of_c, of_d)) - least(least(of_a, of_b), least(of_c, of_d)), 255);
    }
    for (int32_t k = 0; k < CELLS_AT_ONCE; k++) {
        cells->red[i + k] = (uint8_t)(sum[k] >> (RED_SHIFT + 1));
        cells->green[i + k] = (uint8_t)(sum[k] >> (GREEN_SHIFT + 2));
        cells->blue[i + k] = (uint8_t)(sum[k] >> 1);
        cells->spread[i + k] = (uint8_t)spread[k];
    }
}
#endif

/// A row of cells, from cell `first` on, from the sums of their quarters.
static void fill_cells(bslam_cells_t *cells, int32_t first, const bslam_row_sums_t *sums, int32_t pairs)
{
    const uint32_t *above = sums->upper, *below = sums->lower;
    const int32_t end = first + pairs / 2;
    int32_t i = first;
#if !BSLAM_HAS_BYTES
    for (; i + CELLS_AT_ONCE <= end; i += CELLS_AT_ONCE) {
        fill_four(cells, i, above, below);
        above += 2 * CELLS_AT_ONCE;
        below += 2 * CELLS_AT_ONCE;
    }
#endif
    for (; i < end; i++, above += 2, below += 2) {
        fill_cell(cells, i, above, below);
    }
}

bslam_status_t bslam_thumbnail_row(bslam_thumbnail_t *thumbnail, bslam_row_sums_t *sums, const void *pixels)
{
    bslam_thumbnail_t *t = thumbnail;
    const int32_t row = t->rows_seen;
    if (row >= t->height_px) {
        return BSLAM_E_COUNT;
    }
    const int32_t pairs = t->width_px / 2;
    const uint8_t *packed = pixels;
    if (t->format == BSLAM_PIXELS_RGB888) {
        pack_888(sums->packed, pixels, t->width_px);
        packed = (const uint8_t *)sums->packed;
    }
    uint16_t *half = t->half + row / 2 * pairs;
    uint32_t *quads = row % BSLAM_CELL_PX < 2 ? sums->upper : sums->lower;
    if (row % 2 == 0) {
        sum_pairs(quads, packed, pairs);
    } else {
        sum_quads(quads, half, packed, pairs);
    }
    if (row % BSLAM_CELL_PX == BSLAM_CELL_PX - 1) {
        fill_cells(&t->cells, row / BSLAM_CELL_PX * (pairs / 2), sums, pairs);
    }
    t->rows_seen++;
    return BSLAM_OK;
}

void bslam_thumbnail_stretch(bslam_row_sums_t *sums, bslam_pixel_format_t format, const void *pixels,
                             int32_t count)
{
    if (format == BSLAM_PIXELS_RGB888) {
        pack_888(sums->packed, pixels, count);
    } else {
        memcpy(sums->packed, pixels, (size_t)count * sizeof sums->packed[0]);
    }
    for (int32_t i = count - 1; i >= 0; i--) {  // from behind: none is written over before it is read
        sums->packed[2 * i] = sums->packed[2 * i + 1] = sums->packed[i];
    }
}
