#include "vision/scan/box_signature.h"

#include <string.h>

#include "base/bounds.h"

_Static_assert(BSLAM_BOX_SIGNATURE <= BSLAM_SIGNATURE_SIZE, "there is room for it");

enum { GRID = BSLAM_BOX_GRID, POINTS = BSLAM_BOX_POINTS };
/// The ring is so many points away from the box.
enum { OUT = 3 };
/// Tones are logarithms, 32 a doubling. A point as far from all of the ring, of four times that, is the
/// wall's at NEAR, the thing's at FAR.
enum { NEAR = 12, FAR = 52, FULL = 255, LEAST = 3 };
/// Bins that share a value stand STEP apart, from FIRST on; shares are sixteenths.
enum { LIGHT_BINS = 2, LIGHT_FIRST = -16, LIGHT_STEP = 20 };
enum { WARMTH_BINS = 3, WARMTH_FIRST = -20, WARMTH_STEP = 20 };
enum { GREEN_BINS = 6, GREEN_FIRST = -36, GREEN_STEP = 12, SHARES = 16 };
/// What 1 is in each part, and what stands for 1 at last.
enum { COLOUR_GAIN = 93, SHAPE_GAIN = 13, LIGHT_GAIN = 18, EDGE_GAIN = 53, ASPECT_GAIN = 140 };
static const float UNIT = 80;

/// 32 times the binary logarithm of (n + 8) / 8.
static const uint8_t TONE[256] = {
    0,   5,   10,  15,  19,  22,  26,  29,  32,  35,  37,  40,  42,  45,  47,  49,  51,  53,  54,  56,
    58,  59,  61,  63,  64,  65,  67,  68,  69,  71,  72,  73,  74,  75,  77,  78,  79,  80,  81,  82,
    83,  84,  85,  86,  86,  87,  88,  89,  90,  91,  91,  92,  93,  94,  95,  95,  96,  97,  97,  98,
    99,  99,  100, 101, 101, 102, 103, 103, 104, 105, 105, 106, 106, 107, 107, 108, 109, 109, 110, 110,
    111, 111, 112, 112, 113, 113, 114, 114, 115, 115, 116, 116, 117, 117, 118, 118, 118, 119, 119, 120,
    120, 121, 121, 121, 122, 122, 123, 123, 123, 124, 124, 125, 125, 125, 126, 126, 127, 127, 127, 128,
    128, 128, 129, 129, 129, 130, 130, 130, 131, 131, 131, 132, 132, 132, 133, 133, 133, 134, 134, 134,
    135, 135, 135, 136, 136, 136, 137, 137, 137, 137, 138, 138, 138, 139, 139, 139, 139, 140, 140, 140,
    141, 141, 141, 141, 142, 142, 142, 142, 143, 143, 143, 143, 144, 144, 144, 145, 145, 145, 145, 146,
    146, 146, 146, 146, 147, 147, 147, 147, 148, 148, 148, 148, 149, 149, 149, 149, 150, 150, 150, 150,
    150, 151, 151, 151, 151, 152, 152, 152, 152, 152, 153, 153, 153, 153, 153, 154, 154, 154, 154, 154,
    155, 155, 155, 155, 155, 156, 156, 156, 156, 156, 157, 157, 157, 157, 157, 158, 158, 158, 158, 158,
    159, 159, 159, 159, 159, 159, 160, 160, 160, 160, 160, 161, 161, 161, 161, 161};
/// A normal curve over the grid, 64 in its middle.
static const uint8_t CENTRE[GRID] = {14, 21, 28, 37, 46, 54, 60, 64, 64, 60, 54, 46, 37, 28, 21, 14};

typedef bslam_box_tone_t tone_t;
typedef bslam_box_points_t points_t;

static int32_t apart(int32_t a, int32_t b)
{
    return a < b ? b - a : a - b;
}

/// The largest number whose square is no larger.
static int32_t root_of(int64_t square)
{
    int32_t root = 0;
    for (int32_t bit = 1 << 15; bit > 0; bit /= 2) {
        const int64_t tried = root + bit;
        root += tried * tried <= square ? bit : 0;
    }
    return root;
}

static int32_t tone_of(int32_t value)
{
    return TONE[bslam_clamp(value, 0, UINT8_MAX)];
}

/// Red, green and blue of a cell, whose colours are differences of them, as tones.
static tone_t tone_at(const uint8_t *cell)
{
    enum { BELOW = 1 << 16 };  // so that nothing below 0 is shifted
    const int32_t u = cell[1] - 128, v = cell[2] - 128;
    const int32_t green = ((270 * cell[0] - 180 * u + 65 * v + BELOW) >> 8) - (BELOW >> 8);
    const int32_t r = tone_of(green + 2 * u), g = tone_of(green), b = tone_of(green + u - 2 * v);
    return (tone_t){(int16_t)(r + 2 * g + b), (int16_t)(r - g), (int16_t)(b - g)};
}

// ---- points -----------------------------------------------------------------------------------------------

/// The coarsest octave in which the box is as large as the grid; else the finest.
static int32_t octave_for(const bslam_channels_t *channels, int32_t width, int32_t height)
{
    int32_t o = channels->octave_count - 1;
    for (; o > 0; o--) {
        const int32_t side = GRID * 16 * (BSLAM_CELL_PX << o);
        if ((int64_t)width * height >= (int64_t)side * side) {
            break;
        }
    }
    return o;
}

/// The cell of a point along a side: of all points -OUT is first, and GRID - 1 + OUT last.
static int32_t cell_at(int32_t point, int32_t first, int32_t length, int32_t cell_px, int32_t count)
{
    const int32_t k = point == 0 ? -OUT : point == POINTS - 1 ? GRID - 1 + OUT : point - 1;
    return bslam_clamp((first * 32 + (2 * k + 1) * length) / (512 * cell_px), 0, count - 1);
}

static int32_t sixteenths(bslam_real_t px)
{
    return (int32_t)((px + BSLAM_R(0.5)) * 16 + BSLAM_R(0.5));
}

static void read_points(points_t *points, const bslam_channels_t *channels, const bslam_box_t *box)
{
    const int32_t left = sixteenths(box->left_px), top = sixteenths(box->top_px);
    points->width = sixteenths(box->right_px) - left;
    points->height = sixteenths(box->bottom_px) - top;
    const int32_t o = octave_for(channels, points->width, points->height);
    const bslam_octave_t *octave = &channels->octaves[o];
    const int32_t cell_px = BSLAM_CELL_PX << o;
    for (int32_t y = 0; y < POINTS; y++) {
        const int32_t row = cell_at(y, top, points->height, cell_px, octave->rows);
        for (int32_t x = 0; x < POINTS; x++) {
            const int32_t column = cell_at(x, left, points->width, cell_px, octave->columns);
            const uint8_t *cell = octave->cells + (row * octave->columns + column) * BSLAM_CHANNELS;
            points->tones[y][x] = tone_at(cell);
            const bool is_inside = x > 0 && y > 0 && x < POINTS - 1 && y < POINTS - 1;
            for (int32_t k = 0; is_inside && k < BSLAM_EDGE_DIRECTIONS; k++) {
                points->edges[k] += cell[BSLAM_EDGES + k];
            }
        }
    }
}

static int32_t distance(tone_t a, tone_t b)
{
    return apart(a.light, b.light) + 4 * (apart(a.red, b.red) + apart(a.blue, b.blue));
}

/// What is unlike the ring on all four sides is the thing.
static void fill_mask(points_t *points)
{
    for (int32_t y = 0; y < GRID; y++) {
        for (int32_t x = 0; x < GRID; x++) {
            const tone_t its = points->tones[y + 1][x + 1];
            const tone_t around[] = {points->tones[y + 1][0], points->tones[y + 1][POINTS - 1],
                                     points->tones[0][x + 1], points->tones[POINTS - 1][x + 1]};
            int32_t least = INT32_MAX;
            for (int32_t i = 0; i < 4; i++) {
                const int32_t away = distance(its, around[i]);
                least = away < least ? away : least;
            }
            points->mask[y][x] = (uint8_t)bslam_clamp((least - NEAR) * FULL / (FAR - NEAR), 0, FULL);
        }
    }
}

/// The least of the mask around a point: cells at the thing's rim mix with the wall.
static int32_t eroded(const points_t *points, int32_t y, int32_t x)
{
    int32_t least = FULL;
    for (int32_t i = y - 1; i <= y + 1; i++) {
        for (int32_t k = x - 1; k <= x + 1; k++) {
            if (i >= 0 && i < GRID && k >= 0 && k < GRID && points->mask[i][k] < least) {
                least = points->mask[i][k];
            }
        }
    }
    return least;
}

static void weigh(points_t *points)
{
    int64_t light = 0, warmth = 0;
    for (int32_t y = 0; y < GRID; y++) {
        for (int32_t x = 0; x < GRID; x++) {
            const tone_t its = points->tones[y + 1][x + 1];
            const int32_t weight = (eroded(points, y, x) + LEAST) * (CENTRE[y] * CENTRE[x] >> 6);
            points->weights[y][x] = (uint16_t)weight;
            points->weight += weight;
            light += (int64_t)weight * its.light;
            warmth += (int64_t)weight * (its.red - its.blue);
        }
    }
    points->light = (int32_t)(light / points->weight);
    points->warmth = (int32_t)(warmth / points->weight);
}

// ---- what is made of them ---------------------------------------------------------------------------------

/// The lower of the two bins around a value, and what is the upper one's, of SHARES.
typedef struct bin {
    int32_t low, upper;
} bin_t;

static bin_t bin_of(int32_t value, int32_t first, int32_t step, int32_t count)
{
    const int32_t at = bslam_clamp((value - first) * SHARES / step, 0, SHARES * (count - 1));
    const int32_t low = at / SHARES < count - 2 ? at / SHARES : count - 2;
    return (bin_t){low, at - low * SHARES};
}

static int32_t share_of(bin_t bin, int32_t upper)
{
    return upper != 0 ? bin.upper : SHARES - bin.upper;
}

/// A point's weight, shared among the eight bins around its colour.
static void count_colour(int32_t counts[BSLAM_BOX_SHAPE], const points_t *points, int32_t y, int32_t x)
{
    enum { BELOW = 1 << 12 };
    const tone_t its = points->tones[y + 1][x + 1];
    const int32_t lightness = ((its.light - points->light + BELOW) >> 2) - (BELOW >> 2);
    const bin_t light = bin_of(lightness, LIGHT_FIRST, LIGHT_STEP, LIGHT_BINS);
    const bin_t warmth = bin_of(its.red - its.blue - points->warmth, WARMTH_FIRST, WARMTH_STEP, WARMTH_BINS);
    const bin_t green = bin_of(its.red + its.blue, GREEN_FIRST, GREEN_STEP, GREEN_BINS);
    for (int32_t i = 0; i < 8; i++) {
        const int32_t a = i / 4, b = i / 2 % 2, c = i % 2;
        const int32_t share = share_of(light, a) * share_of(warmth, b) * share_of(green, c);
        const int32_t at = ((light.low + a) * WARMTH_BINS + warmth.low + b) * GREEN_BINS + green.low + c;
        counts[at] += points->weights[y][x] * share >> 8;
    }
}

static void tell_colours(const points_t *points, int32_t *values)
{
    int32_t counts[BSLAM_BOX_SHAPE] = {0};
    for (int32_t y = 0; y < GRID; y++) {
        for (int32_t x = 0; x < GRID; x++) {
            count_colour(counts, points, y, x);
        }
    }
    int64_t sum = 0;
    for (int32_t i = 0; i < BSLAM_BOX_SHAPE; i++) {
        sum += counts[i];
    }
    for (int32_t i = 0; i < BSLAM_BOX_SHAPE && sum > 0; i++) {
        values[i] = root_of((int64_t)counts[i] * COLOUR_GAIN * COLOUR_GAIN / sum);
    }
}

static void tell_shape(const points_t *points, int32_t *values)
{
    enum { PARTS = 4, SIDE = GRID / PARTS, MOST = FULL * SIDE * SIDE };
    for (int32_t i = 0; i < PARTS * PARTS; i++) {
        int32_t sum = 0;
        for (int32_t k = 0; k < SIDE * SIDE; k++) {
            sum += points->mask[i / PARTS * SIDE + k / SIDE][i % PARTS * SIDE + k % SIDE];
        }
        values[i] = (sum * SHAPE_GAIN + MOST / 2) / MOST;
    }
}

static int32_t light_deviation(const points_t *points)
{
    enum { LEAST_SQUARE = 164 };  // a tenth of a doubling
    int64_t squares = 0;
    for (int32_t y = 0; y < GRID; y++) {
        for (int32_t x = 0; x < GRID; x++) {
            const int32_t light = points->tones[y + 1][x + 1].light - points->light;
            squares += (int64_t)points->weights[y][x] * light * light;
        }
    }
    return root_of(squares / points->weight + LEAST_SQUARE);
}

/// Windows overlap by a point. What is no thing's counts little, and makes the value small.
static void tell_light(const points_t *points, int32_t *values)
{
    enum { PARTS = 3, SIDE = 6, STEP = 5, MORE = 13 };
    const int32_t deviation = light_deviation(points);
    for (int32_t i = 0; i < PARTS * PARTS; i++) {
        int32_t mask = 0, sum = 0;
        for (int32_t k = 0; k < SIDE * SIDE; k++) {
            const int32_t y = i / PARTS * STEP + k / SIDE, x = i % PARTS * STEP + k % SIDE;
            mask += points->mask[y][x];
            sum += (points->mask[y][x] + MORE) * (points->tones[y + 1][x + 1].light - points->light);
        }
        const int32_t mean = sum / (mask + MORE * SIDE * SIDE);
        values[i] = mean * (mask * LIGHT_GAIN / (SIDE * SIDE)) / (deviation * FULL);
    }
}

static void tell_edges(const points_t *points, int32_t *values)
{
    enum { SHIFT = 5, LEAST_SQUARE = 10500 };
    int64_t squares = LEAST_SQUARE;
    for (int32_t k = 0; k < BSLAM_EDGE_DIRECTIONS; k++) {
        const int32_t edges = points->edges[k] >> SHIFT;
        squares += (int64_t)edges * edges;
    }
    const int32_t length = root_of(squares) << SHIFT;
    for (int32_t k = 0; k < BSLAM_EDGE_DIRECTIONS; k++) {
        values[k] = points->edges[k] * EDGE_GAIN / length;
    }
}

void bslam_box_signature(const bslam_channels_t *channels, const bslam_box_t *box, points_t *points,
                         float signature[BSLAM_SIGNATURE_SIZE])
{
    memset(points, 0, sizeof *points);
    int32_t values[BSLAM_SIGNATURE_SIZE] = {0};
    read_points(points, channels, box);
    fill_mask(points);
    weigh(points);
    tell_colours(points, values + BSLAM_BOX_COLOURS);
    tell_shape(points, values + BSLAM_BOX_SHAPE);
    tell_light(points, values + BSLAM_BOX_LIGHT);
    tell_edges(points, values + BSLAM_BOX_EDGES);
    const int32_t sides = points->height + points->width;
    values[BSLAM_BOX_ASPECT] = sides > 0 ? ASPECT_GAIN * (points->height - points->width) / sides : 0;
    for (int32_t i = 0; i < BSLAM_SIGNATURE_SIZE; i++) {
        signature[i] = bslam_clampf((float)values[i] / UNIT, -1, 1);
    }
}
