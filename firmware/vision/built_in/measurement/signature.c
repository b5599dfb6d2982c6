#include "vision/built_in/measurement/signature.h"
#include "base/scalar.h"

#include <string.h>

// A pixel's three values, whole numbers from here to the end: light is the sum of its channels divided by the
// wall's, red-green and yellow-blue are differences of them.
enum { LIGHT, RED_GREEN, YELLOW_BLUE, VALUES };
enum { LIGHT_BINS = 3, COLOUR_BINS = 4, BINS = LIGHT_BINS * COLOUR_BINS * COLOUR_BINS, BANDS = 6 };
// Between the centres of two neighbouring bins a pixel is shared in this many steps.
enum { BIN_STEPS = 16 };
enum { PIXELS_MIN = 12, PIXELS_MAX = 400 };
enum { ROWS_MAX = BSLAM_IMAGE_HEIGHT_MAX / 2 };

static const float WALL_MIN = 4.0f;
// A channel of WALL is the wall's; at most CHANNEL_MAX, four walls, so that sums of squares fit in 32 bits.
enum { WALL = 256, CHANNEL_MAX = 1023 };
// The wall's light as a part of the histogram's range, so that brighter things fit in it too.
static const float WALL_LEVEL = 0.65f;
// Red-green and yellow-blue as parts of the histogram's range: gains on the differences of channels.
static const float RED_GREEN_GAIN = 1.2f;
static const float YELLOW_BLUE_GAIN = 1.0f;
// Weights of the histogram, of the aspect and of the texture's deviations and changes against the bands.
static const float COLOUR_GAIN = 1.4f;
static const float ASPECT_GAIN = 0.5f;
static const float DEVIATION_GAIN = 1.5f;
static const float CHANGE_GAIN = 3.0f;
// Added to the light that something is divided by: keeps what is almost black from looking rich in contrast.
static const float LIGHT_MARGIN = 0.1f;

/// What each value of a channel of RGB565 becomes, divided by the wall's: the 32 of red, then the 64 of
/// green, then the 32 of blue.
enum { RED_AT = 0, GREEN_AT = 32, BLUE_AT = 96, LEVELS = 128 };

/// A value's place among its bins: (gain value + offset) / 65536, in 1 / BIN_STEPS of a bin.
typedef struct axis {
    int32_t gain;
    int32_t offset;
    int32_t bins;
} axis_t;

typedef struct band {
    int32_t sums[VALUES];
    int32_t pixels;
} band_t;

typedef struct work {
    uint16_t levels[LEVELS];
    axis_t axes[VALUES];
    uint32_t bins[BINS];
    band_t bands[BANDS];
    uint32_t light_squares;  ///< in 1/16
    uint32_t colour_squares;
    uint32_t changes_across;
    uint32_t changes_down;
    int32_t pairs_across;
    int32_t pairs_down;
} work_t;

static float at_most(float x, float most)
{
    return x < most ? x : most;
}

static float within_one(float x)
{
    return x < -1.0f ? -1.0f : at_most(x, 1.0f);
}

static void fill_levels(work_t *work, int32_t at, int32_t count, float wall)
{
    for (int32_t i = 0; i < count; i++) {
        const float ratio = (float)i * (255.0f / (float)(count - 1)) / wall;
        work->levels[at + i] = (uint16_t)at_most(ratio * (float)WALL + 0.5f, (float)CHANNEL_MAX);
    }
}

/// The axis on which `unit` of a value is the whole range of bins and 0 lies at `zero` of it.
static axis_t axis_of(float unit, float zero, int32_t bins)
{
    const float steps = 65536.0f * (float)(bins * BIN_STEPS);
    return (axis_t){.gain = (int32_t)(steps / unit),
                    .offset = (int32_t)(steps * zero - 32768.0f * (float)BIN_STEPS) + 32768,
                    .bins = bins};
}

static void begin(work_t *work, const bslam_rgb_t *wall)
{
    memset(work, 0, sizeof *work);
    fill_levels(work, RED_AT, 32, wall->red);
    fill_levels(work, GREEN_AT, 64, wall->green);
    fill_levels(work, BLUE_AT, 32, wall->blue);
    const float range = (float)WALL / WALL_LEVEL;
    work->axes[LIGHT] = axis_of(3.0f * range, 0.0f, LIGHT_BINS);
    work->axes[RED_GREEN] = axis_of(range / RED_GREEN_GAIN, 0.5f, COLOUR_BINS);
    work->axes[YELLOW_BLUE] = axis_of(2.0f * range / YELLOW_BLUE_GAIN, 0.5f, COLOUR_BINS);
}

/// The lower of the two bins around a value, and the upper one's share.
static uint32_t bin_of(const axis_t *axis, int32_t value, uint32_t *share)
{
    const int32_t scaled = value * axis->gain + axis->offset;
    const int32_t top = (axis->bins - 1) * BIN_STEPS;
    const int32_t place = scaled < 0 ? 0 : scaled >> 16 < top ? scaled >> 16 : top;
    const int32_t lower = place / BIN_STEPS < axis->bins - 1 ? place / BIN_STEPS : axis->bins - 2;
    *share = (uint32_t)(place - lower * BIN_STEPS);
    return (uint32_t)lower;
}

/// Shares a pixel among the eight bins around its colour.
static void add_to_bins(work_t *work, const int32_t values[VALUES])
{
    uint32_t light;
    uint32_t red;
    uint32_t yellow;
    uint32_t *bin = work->bins;
    bin += bin_of(&work->axes[LIGHT], values[LIGHT], &light) * (COLOUR_BINS * COLOUR_BINS);
    bin += bin_of(&work->axes[RED_GREEN], values[RED_GREEN], &red) * COLOUR_BINS;
    bin += bin_of(&work->axes[YELLOW_BLUE], values[YELLOW_BLUE], &yellow);
    for (uint32_t upper = 0; upper < 2; upper++) {
        const uint32_t by_light = upper == 1 ? light : BIN_STEPS - light;
        const uint32_t low = by_light * (BIN_STEPS - red);
        const uint32_t high = by_light * red;
        bin[0] += low * (BIN_STEPS - yellow);
        bin[1] += low * yellow;
        bin[COLOUR_BINS] += high * (BIN_STEPS - yellow);
        bin[COLOUR_BINS + 1] += high * yellow;
        bin += COLOUR_BINS * COLOUR_BINS;
    }
}

static uint32_t square(int32_t x)
{
    return (uint32_t)(x * x);
}

static uint32_t difference(int32_t a, int32_t b)
{
    return (uint32_t)(a > b ? a - b : b - a);
}

/// Adds a pixel to all but the changes; returns its light.
static int32_t add_pixel(work_t *work, band_t *band, uint16_t pixel)
{
    const int32_t red = work->levels[RED_AT + (pixel >> 11)];
    const int32_t green = work->levels[GREEN_AT + ((pixel >> 5) & 63)];
    const int32_t blue = work->levels[BLUE_AT + (pixel & 31)];
    const int32_t values[VALUES] = {red + green + blue, red - green, red + green - 2 * blue};
    add_to_bins(work, values);
    for (int32_t v = 0; v < VALUES; v++) {
        band->sums[v] += values[v];
    }
    band->pixels++;
    work->light_squares += square(values[LIGHT]) / 16;
    work->colour_squares += (square(values[RED_GREEN]) + square(values[YELLOW_BLUE])) / 16;
    return values[LIGHT];
}

/// The light of the column before, by row; -1 where it has none inside.
typedef struct column {
    int16_t light[ROWS_MAX];
} column_t;

/// One column of the quad, from row `top` to before `end`.
static void add_column(work_t *work, const uint16_t *pixels, int32_t stride, int32_t top, int32_t end,
                       int32_t step, column_t *before)
{
    int32_t above = -1;
    for (int32_t y = top; y < end; y += step) {
        band_t *band = &work->bands[(y - top) * BANDS / (end - top)];
        const int32_t light = add_pixel(work, band, pixels[y * stride]);
        if (above >= 0) {
            work->changes_down += difference(light, above);
            work->pairs_down++;
        }
        if (before->light[y] >= 0) {
            work->changes_across += difference(light, before->light[y]);
            work->pairs_across++;
        }
        before->light[y] = (int16_t)light;
        above = light;
    }
}

/// First pixel of the half-resolution copy whose centre lies beyond an edge of the whole frame; the copy has
/// `size`.
static int32_t first_beyond(bslam_real_t edge_px, int32_t size)
{
    const bslam_real_t place = edge_px / 2 + BSLAM_R(0.75);  // of its centre at 2 i + 0.5, rounded up below
    return place <= 0 ? 0 : place < (bslam_real_t)size ? (int32_t)place : size;
}

/// Smallest step, the same both ways, that takes no more than PIXELS_MAX pixels.
static int32_t step_of(bslam_real_t width_px, bslam_real_t height_px)
{
    const bslam_real_t pixels = width_px * height_px / 4;
    int32_t step = 1;
    while (pixels > (bslam_real_t)(step * step * PIXELS_MAX)) {
        step++;
    }
    return step;
}

static void add_quad(work_t *work, const bslam_frame_t *frame, const bslam_quad_t *quad, int32_t step)
{
    const int32_t stride = frame->width_px / 2;
    const int32_t rows = frame->height_px / 2;
    const int32_t end = first_beyond(quad->right_px, stride);
    const bslam_real_t width = quad->right_px - quad->left_px;
    column_t before;
    memset(&before, 0xFF, sizeof before);
    for (int32_t x = first_beyond(quad->left_px, stride); x < end; x += step) {
        const bslam_real_t part = (2 * (bslam_real_t)x + BSLAM_R(0.5) - quad->left_px) / width;
        const bslam_real_t top = quad->top_left_px + part * (quad->top_right_px - quad->top_left_px);
        const bslam_real_t bottom =
            quad->bottom_left_px + part * (quad->bottom_right_px - quad->bottom_left_px);
        const int32_t first =
            (first_beyond(top, rows) + step - 1) / step * step;  // the same rows in each column
        add_column(work, frame->half + x, stride, first, first_beyond(bottom, rows), step, &before);
    }
}

/// Standard deviation from a sum of squares in 1/16, a sum, and their count.
static float deviation(float squares, float sum, float count)
{
    const float mean = sum / count;
    const float variance = 16.0f * squares / count - mean * mean;
    return variance > 0.0f ? sqrtf(variance) : 0.0f;
}

/// Sums over all bands.
static band_t total_of(const work_t *work)
{
    band_t total = {.pixels = 0};
    for (int32_t b = 0; b < BANDS; b++) {
        total.pixels += work->bands[b].pixels;
        for (int32_t v = 0; v < VALUES; v++) {
            total.sums[v] += work->bands[b].sums[v];
        }
    }
    return total;
}

/// Means of the bands; one without pixels has the whole object's.
static void finish_bands(const work_t *work, const band_t *total, float *bands)
{
    static const float UNIT[VALUES] = {3.0f * (float)WALL, (float)WALL, 2.0f * (float)WALL};
    for (int32_t b = 0; b < BANDS; b++) {
        const band_t *band = work->bands[b].pixels > 0 ? &work->bands[b] : total;
        for (int32_t v = 0; v < VALUES; v++) {
            const float mean = (float)band->sums[v] / (float)band->pixels;
            bands[b * VALUES + v] = within_one(WALL_LEVEL * mean / UNIT[v]);
        }
    }
}

static float mean_of(uint32_t sum, int32_t count)
{
    return count > 0 ? (float)sum / (float)count : 0.0f;
}

static void finish(const work_t *work, const band_t *total, float *signature)
{
    const float count = (float)total->pixels;
    const float whole = count * (float)(BIN_STEPS * BIN_STEPS * BIN_STEPS);
    for (int32_t i = 0; i < BINS; i++) {
        const float share = (float)work->bins[i] / whole;
        signature[BSLAM_SIGNATURE_COLOURS + i] = within_one(COLOUR_GAIN * sqrtf(share));
    }
    finish_bands(work, total, signature + BSLAM_SIGNATURE_BANDS);
    const float light = (float)total->sums[LIGHT] / count + 3.0f * (float)WALL * LIGHT_MARGIN / WALL_LEVEL;
    const float colour = deviation((float)work->colour_squares, 0.0f, count);
    float *texture = signature + BSLAM_SIGNATURE_TEXTURE;
    const float contrast = deviation((float)work->light_squares, (float)total->sums[LIGHT], count);
    texture[0] = within_one(DEVIATION_GAIN * contrast / light);
    texture[1] = within_one(DEVIATION_GAIN * colour / light);
    texture[2] = within_one(CHANGE_GAIN * mean_of(work->changes_across, work->pairs_across) / light);
    texture[3] = within_one(CHANGE_GAIN * mean_of(work->changes_down, work->pairs_down) / light);
}

bslam_status_t bslam_signature(const bslam_frame_t *frame, const bslam_quad_t *quad,
                               float signature[BSLAM_SIGNATURE_SIZE])
{
    const bslam_rgb_t *wall = &frame->surroundings->wall;
    const bslam_real_t width = quad->right_px - quad->left_px;
    const bslam_real_t height =
        (quad->bottom_left_px - quad->top_left_px + quad->bottom_right_px - quad->top_right_px) / 2;
    if (!(wall->red >= WALL_MIN) || !(wall->green >= WALL_MIN) || !(wall->blue >= WALL_MIN) ||
        !bslam_in_range(width, 1, BSLAM_IMAGE_WIDTH_MAX) ||
        !bslam_in_range(height, 1, BSLAM_IMAGE_HEIGHT_MAX)) {
        return BSLAM_E_RANGE;
    }
    work_t work;
    begin(&work, wall);
    add_quad(&work, frame, quad, step_of(width, height));
    const band_t total = total_of(&work);
    if (total.pixels < PIXELS_MIN) {
        return BSLAM_E_RANGE;
    }
    finish(&work, &total, signature);
    signature[BSLAM_SIGNATURE_ASPECT] = ASPECT_GAIN * (float)((height - width) / (height + width));
    return BSLAM_OK;
}
