#include "vision/built_in/thumbnail.h"

#include <string.h>

#include "vision/pixels/spread.h"

/// 2 in each channel: makes a quarter of a sum of four round to nearest.
#define HALF_OF_FOUR (2U | 2U << BSLAM_SPREAD_RED | 2U << BSLAM_SPREAD_GREEN)

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

/// Pixel pairs that are copied at once.
#define PAIRS_A_STEP (BSLAM_IMAGE_WIDTH_STEP / 2)
/// Bytes that a core copies by loading and storing several words each time.
#define COPIED_AT_ONCE 64
/// Pixel pairs that are summed at once, and cells that are made of them.
enum { PAIRS_AT_ONCE = 2, CELLS_AT_ONCE = 2 };

/// Four bytes' boundaries let a core move several words at once.
static inline const uint8_t *words_at(const void *bytes)
{
    return __builtin_assume_aligned(bytes, sizeof(uint32_t));
}

/// The upper row of two as it comes: words of two pixels, until the lower one makes sums of them.
static void keep_row(uint32_t *restrict words, const uint8_t *restrict pixels, int32_t pairs)
{
    uint8_t *kept = __builtin_assume_aligned(words, sizeof(uint32_t));
    const uint8_t *end = pixels + 4 * pairs;
    for (; end - pixels >= COPIED_AT_ONCE; pixels += COPIED_AT_ONCE, kept += COPIED_AT_ONCE) {
        memcpy(kept, words_at(pixels), COPIED_AT_ONCE);
    }
    for (; pixels != end; pixels += 4 * PAIRS_A_STEP, kept += 4 * PAIRS_A_STEP) {
        memcpy(kept, words_at(pixels), 4 * PAIRS_A_STEP);
    }
}

/// The sum of two pixels above two.
static inline uint32_t quad_sum(uint32_t above, uint32_t below)
{
    return bslam_spread_pair(above) + bslam_spread_pair(below);
}

/// The mean of 2x2 pixels in RGB565 from their sum.
static inline uint16_t mean_565(uint32_t quad)
{
    const uint32_t mean = ((quad + HALF_OF_FOUR) >> 2) & BSLAM_SPREAD_MASK;
    return (uint16_t)(mean | mean >> 16);
}

/// Makes some words of the upper row the sums of 2x2 pixels; their means.
static inline void sum_some(uint32_t *restrict words, uint16_t *restrict half, const uint8_t *restrict pixels)
{
    const uint32_t above = words[0], next_above = words[1];
    const uint32_t below = bslam_word_at(pixels), next_below = bslam_word_at(pixels + sizeof below);
    const uint32_t sum = quad_sum(above, below), next_sum = quad_sum(next_above, next_below);
    words[0] = sum;
    words[1] = next_sum;
    half[0] = mean_565(sum);
    half[1] = mean_565(next_sum);
}

/// The same of the pairs of a step.
static inline void sum_step(uint32_t *restrict words, uint16_t *restrict half, const uint8_t *restrict pixels)
{
    _Static_assert(PAIRS_A_STEP == 2 * PAIRS_AT_ONCE, "a step is two of these");
    sum_some(words, half, words_at(pixels));
    sum_some(words + PAIRS_AT_ONCE, half + PAIRS_AT_ONCE, words_at(pixels + 4 * PAIRS_AT_ONCE));
}

/// The lower row of two: makes the words of the upper one the sums of 2x2 pixels; their means. Two steps
/// before it is asked whether the row ends.
static void sum_quads(uint32_t *restrict words, uint16_t *restrict half, const uint8_t *restrict pixels,
                      int32_t pairs)
{
    const uint32_t *end = words + pairs;
    if (pairs % (2 * PAIRS_A_STEP) != 0) {
        sum_step(words, half, pixels);
        words += PAIRS_A_STEP;
        half += PAIRS_A_STEP;
        pixels += 4 * PAIRS_A_STEP;
    }
    while (words != end) {
        sum_step(words, half, pixels);
        sum_step(words + PAIRS_A_STEP, half + PAIRS_A_STEP, pixels + 4 * PAIRS_A_STEP);
        words += 2 * PAIRS_A_STEP;
        half += 2 * PAIRS_A_STEP;
        pixels += 8 * PAIRS_A_STEP;
    }
}

/// Sums of 2x2 pixels that are the same.
static void sum_fours(uint32_t *restrict words, const uint16_t *restrict pixels, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        const uint32_t pixel = pixels[i];
        words[i] = ((pixel | pixel << 16) & BSLAM_SPREAD_MASK) << 2;
    }
}

/// Brightness of a 2x2 sum, 0 to 376: green counts twice as much as red, because it has a bit more.
static inline uint32_t luma(uint32_t quad)
{
    return (quad >> BSLAM_SPREAD_RED & 127) + (quad >> BSLAM_SPREAD_GREEN);
}

/// Of two quarters, in halves of a word.
static inline uint32_t two_lumas(uint32_t first, uint32_t second)
{
    return luma(first) | luma(second) << 16;
}

/// Bytes 0 and 1 of a word.
static inline void put_two(uint8_t *bytes, uint32_t word)
{
    const uint16_t both = (uint16_t)word;
    memcpy(bytes, &both, sizeof both);
}

/// A channel of two neighbours, from bit `shift` of their sums on.
static inline void put_channel(uint8_t *bytes, uint32_t sum, uint32_t next_sum, int32_t shift)
{
    put_two(bytes, (sum >> shift & 255) | next_sum >> shift << 8);
}

/// Some cells of a row, from their quarters.
static inline void fill_some(bslam_cells_t *restrict cells, int32_t i, const uint32_t *restrict above,
                             const uint32_t *restrict below)
{
    const uint32_t a = two_lumas(above[0], above[2]), b = two_lumas(above[1], above[3]);
    const uint32_t a_more = bslam_halves_less(a, b), low = a - a_more, high = b + a_more;
    const uint32_t c = two_lumas(below[0], below[2]), d = two_lumas(below[1], below[3]);
    const uint32_t c_more = bslam_halves_less(c, d), other_low = c - c_more, other_high = d + c_more;
    const uint32_t highest = other_high + bslam_halves_less(high, other_high);
    const uint32_t lowest = low - bslam_halves_less(low, other_low);
    const uint32_t spreads = bslam_halves_least(highest - lowest, BSLAM_EVEN_BYTES);
    const uint32_t sum = above[0] + above[1] + below[0] + below[1];
    const uint32_t next_sum = above[2] + above[3] + below[2] + below[3];
    put_two(cells->spread + i, spreads | spreads >> 8);
    put_channel(cells->red + i, sum, next_sum, BSLAM_SPREAD_RED + 1);
    put_channel(cells->green + i, sum, next_sum, BSLAM_SPREAD_GREEN + 2);
    put_channel(cells->blue + i, sum, next_sum, 1);
}

/// A row of cells, from cell `first` on, from the sums of their quarters. Not to be inlined twice: then what
/// fills some would not be.
__attribute__((noinline)) static void fill_cells(bslam_cells_t *cells, int32_t first,
                                                 const bslam_row_sums_t *sums, int32_t pairs)
{
    for (int32_t i = 0; i < pairs / 2; i += CELLS_AT_ONCE) {
        fill_some(cells, first + i, sums->upper + 2 * i, sums->lower + 2 * i);
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
    } else if ((uintptr_t)pixels % sizeof(uint32_t) != 0) {
        memcpy(sums->packed, pixels, (size_t)t->width_px * sizeof sums->packed[0]);
        packed = (const uint8_t *)sums->packed;
    }
    uint16_t *half = t->half + row / 2 * pairs;
    uint32_t *quads = row % BSLAM_CELL_PX < 2 ? sums->upper : sums->lower;
    if (row % 2 == 0) {
        keep_row(quads, packed, pairs);
    } else {
        sum_quads(quads, half, packed, pairs);
    }
    if (row % BSLAM_CELL_PX == BSLAM_CELL_PX - 1) {
        fill_cells(&t->cells, row / BSLAM_CELL_PX * (pairs / 2), sums, pairs);
    }
    t->rows_seen++;
    return BSLAM_OK;
}

bslam_status_t bslam_thumbnail_row_doubled(bslam_thumbnail_t *thumbnail, bslam_row_sums_t *sums,
                                           const void *pixels)
{
    bslam_thumbnail_t *t = thumbnail;
    const int32_t row = t->rows_seen, count = t->width_px / 2;
    if (row >= t->height_px) {
        return BSLAM_E_COUNT;
    }
    // What is four times the same pixel has that as its mean.
    uint16_t *half = t->half + row / 2 * count;
    if (t->format == BSLAM_PIXELS_RGB888) {
        pack_888(half, pixels, count);
    } else {
        memcpy(half, pixels, (size_t)count * sizeof half[0]);
    }
    sum_fours(row % BSLAM_CELL_PX == 0 ? sums->upper : sums->lower, half, count);
    if (row % BSLAM_CELL_PX != 0) {
        fill_cells(&t->cells, row / BSLAM_CELL_PX * (count / 2), sums, count);
    }
    t->rows_seen += 2;
    return BSLAM_OK;
}
