#include "bslam/vision/signature.h"

#include <string.h>

enum { CHANNELS = 3, BINS = 4, BIN_STEPS = 16, PIXELS_MIN = 12, PIXELS_MAX = 1024 };

static const float WALL_MIN = 4.0f;
// Where the wall's own colour falls in the histogram's range, so that brighter things fit in it too.
static const float WALL_LEVEL = 0.65f;
// A colour of VALUE_ONE is the wall's; VALUE_MAX keeps sums of squares in 32 bits.
static const float VALUE_ONE = 256.0f;
static const float VALUE_MAX = 1023.0f;
// Added to a mean that something is divided by: keeps what is almost black from looking rich in contrast.
static const float MEAN_MARGIN = 0.1f;
static const float EDGE_GAIN = 4.0f;

/// What each value of a channel of RGB565 becomes, divided by the wall's: the 32 of red, then the 64 of
/// green, then the 32 of blue.
enum { RED_AT = 0, GREEN_AT = 32, BLUE_AT = 96, LEVELS = 128 };
typedef struct levels {
    uint16_t value[LEVELS];  ///< in VALUE_ONE
    uint8_t place[LEVELS];   ///< BIN_STEPS times (lower bin + share of the one above)
} levels_t;

typedef struct sums {
    uint32_t bins[BINS * BINS * BINS];
    uint32_t value[CHANNELS];
    uint32_t square[CHANNELS];
    uint32_t change[CHANNELS];
    int32_t pixels;
} sums_t;

static float at_most(float x, float most)
{
    return x < most ? x : most;
}

static void fill_levels(levels_t *levels, int32_t at, int32_t count, float wall)
{
    const float top = (float)((BINS - 1) * BIN_STEPS);
    for (int32_t i = 0; i < count; i++) {
        const float ratio = (float)i * (255.0f / (float)(count - 1)) / wall;
        const float place = (ratio * WALL_LEVEL * (float)BINS - 0.5f) * (float)BIN_STEPS + 0.5f;
        levels->value[at + i] = (uint16_t)at_most(ratio * VALUE_ONE + 0.5f, VALUE_MAX);
        levels->place[at + i] = (uint8_t)(place < 0.0f ? 0.0f : at_most(place, top));
    }
}

/// Shares a pixel among the eight bins around its colour.
static void add_to_bins(uint32_t *bins, uint32_t red, uint32_t green, uint32_t blue)
{
    const uint32_t place[CHANNELS] = {red, green, blue};
    uint32_t lower[CHANNELS];
    uint32_t share[CHANNELS];
    for (int32_t c = 0; c < CHANNELS; c++) {
        lower[c] = place[c] / BIN_STEPS < BINS - 1 ? place[c] / BIN_STEPS : BINS - 2;
        share[c] = place[c] - lower[c] * BIN_STEPS;
    }
    uint32_t *corner = bins + (lower[0] * BINS + lower[1]) * BINS + lower[2];
    for (uint32_t r = 0; r < 2; r++) {
        const uint32_t by_red = r == 1 ? share[0] : BIN_STEPS - share[0];
        for (uint32_t g = 0; g < 2; g++) {
            const uint32_t by_green = by_red * (g == 1 ? share[1] : BIN_STEPS - share[1]);
            uint32_t *pair = corner + (r * BINS + g) * BINS;
            pair[0] += by_green * (BIN_STEPS - share[2]);
            pair[1] += by_green * share[2];
        }
    }
}

static uint32_t difference(uint32_t a, uint32_t b)
{
    return a > b ? a - b : b - a;
}

typedef struct colour {
    uint32_t value[CHANNELS];
} colour_t;

static colour_t colour_of(const uint16_t value[LEVELS], uint16_t pixel)
{
    return (colour_t){{value[RED_AT + (pixel >> 11)], value[GREEN_AT + ((pixel >> 5) & 63)],
                       value[BLUE_AT + (pixel & 31)]}};
}

static void add_pixel(sums_t *sums, const levels_t *levels, const uint16_t *at, int32_t stride)
{
    const uint16_t pixel = at[0];
    const colour_t here = colour_of(levels->value, pixel);
    const colour_t right = colour_of(levels->value, at[1]);
    const colour_t below = colour_of(levels->value, at[stride]);
    add_to_bins(sums->bins, levels->place[RED_AT + (pixel >> 11)],
                levels->place[GREEN_AT + ((pixel >> 5) & 63)], levels->place[BLUE_AT + (pixel & 31)]);
    for (int32_t c = 0; c < CHANNELS; c++) {
        sums->value[c] += here.value[c];
        sums->square[c] += here.value[c] * here.value[c];
        sums->change[c] +=
            difference(here.value[c], right.value[c]) + difference(here.value[c], below.value[c]);
    }
    sums->pixels++;
}

/// First whole pixel of the half-resolution copy at or beyond an edge of the whole frame.
static int32_t first_inside(bslam_real_t edge_px)
{
    const bslam_real_t half = (edge_px + BSLAM_R(0.5)) / 2;
    const int32_t below = (int32_t)half;
    return below + (half > (bslam_real_t)below ? 1 : 0);
}

/// One past the last whole pixel before an edge.
static int32_t end_inside(bslam_real_t edge_px)
{
    return (int32_t)((edge_px + BSLAM_R(0.5)) / 2);
}

/// Adds up every step-th pixel, both ways, of what the quad encloses, but for its last column and row: those
/// are the neighbours of the others.
static void add_quad(sums_t *sums, const levels_t *levels, const bslam_frame_t *frame,
                     const bslam_quad_t *quad, int32_t step)
{
    const int32_t stride = frame->width_px / 2;
    const int32_t end = end_inside(quad->right_px) - 1;
    const bslam_real_t width = quad->right_px - quad->left_px;
    for (int32_t x = first_inside(quad->left_px); x < end; x += step) {
        const bslam_real_t right = (2 * (bslam_real_t)x + BSLAM_R(0.5) - quad->left_px) / width;
        const bslam_real_t top = quad->top_left_px + right * (quad->top_right_px - quad->top_left_px);
        const bslam_real_t bottom =
            quad->bottom_left_px + right * (quad->bottom_right_px - quad->bottom_left_px);
        const int32_t bottom_end = end_inside(bottom) - 1;
        for (int32_t y = first_inside(top); y < bottom_end; y += step) {
            add_pixel(sums, levels, frame->half + y * stride + x, stride);
        }
    }
}

static void finish(const sums_t *sums, const bslam_quad_t *quad, float *signature)
{
    const float count = (float)sums->pixels;
    const float whole = count * (float)(BIN_STEPS * BIN_STEPS * BIN_STEPS);
    for (int32_t i = 0; i < BINS * BINS * BINS; i++) {
        signature[BSLAM_SIGNATURE_COLOURS + i] = sqrtf((float)sums->bins[i] / whole);
    }
    const bslam_real_t width = quad->right_px - quad->left_px;
    const bslam_real_t height =
        (quad->bottom_left_px - quad->top_left_px + quad->bottom_right_px - quad->top_right_px) / 2;
    signature[BSLAM_SIGNATURE_ASPECT] = (float)((height - width) / (height + width));
    for (int32_t c = 0; c < CHANNELS; c++) {
        const float mean = (float)sums->value[c] / (count * VALUE_ONE);
        const float square = (float)sums->square[c] / (count * VALUE_ONE * VALUE_ONE) - mean * mean;
        const float edge = (float)sums->change[c] / (2.0f * count * VALUE_ONE);
        signature[BSLAM_SIGNATURE_CONTRAST + c] = sqrtf(square > 0.0f ? square : 0.0f) / (mean + MEAN_MARGIN);
        signature[BSLAM_SIGNATURE_EDGES + c] = at_most(EDGE_GAIN * edge / (mean + MEAN_MARGIN), 1.0f);
    }
}

/// Smallest step that leaves no more than PIXELS_MAX pixels of the quad's box.
static int32_t step_of(const bslam_quad_t *quad)
{
    const bslam_real_t height =
        (quad->bottom_left_px - quad->top_left_px + quad->bottom_right_px - quad->top_right_px) / 2;
    const bslam_real_t pixels = (quad->right_px - quad->left_px) * height / 4;
    int32_t step = 1;
    while (pixels > (bslam_real_t)(step * step * PIXELS_MAX)) {
        step++;
    }
    return step;
}

bslam_status_t bslam_signature(const bslam_frame_t *frame, const bslam_quad_t *quad,
                               float signature[BSLAM_SIGNATURE_SIZE])
{
    const bslam_rgb_t *wall = &frame->surroundings->wall;
    if (!(wall->red >= WALL_MIN && wall->green >= WALL_MIN && wall->blue >= WALL_MIN)) {
        return BSLAM_E_RANGE;
    }
    levels_t levels;
    sums_t sums;
    memset(&sums, 0, sizeof sums);
    fill_levels(&levels, RED_AT, 32, wall->red);
    fill_levels(&levels, GREEN_AT, 64, wall->green);
    fill_levels(&levels, BLUE_AT, 32, wall->blue);
    add_quad(&sums, &levels, frame, quad, step_of(quad));
    if (sums.pixels < PIXELS_MIN) {
        return BSLAM_E_RANGE;
    }
    finish(&sums, quad, signature);
    return BSLAM_OK;
}
