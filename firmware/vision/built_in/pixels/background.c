#include "vision/built_in/pixels/background.h"

#include <string.h>

#include "base/bounds.h"
#include "vision/pixels/spread.h"
#include "vision/pixels/bytes.h"
#include "base/scalar.h"

/// 32 log2((v + 4) / 4), rounded: the 4 keeps the noise of dark pixels from growing without bound.
static const uint8_t tone_log[256] = {
    0,   10,  19,  26,  32,  37,  42,  47,  51,  54,  58,  61,  64,  67,  69,  72,  74,  77,  79,  81,
    83,  85,  86,  88,  90,  91,  93,  95,  96,  97,  99,  100, 101, 103, 104, 105, 106, 107, 109, 110,
    111, 112, 113, 114, 115, 116, 117, 118, 118, 119, 120, 121, 122, 123, 123, 124, 125, 126, 127, 127,
    128, 129, 129, 130, 131, 131, 132, 133, 133, 134, 135, 135, 136, 137, 137, 138, 138, 139, 139, 140,
    141, 141, 142, 142, 143, 143, 144, 144, 145, 145, 146, 146, 147, 147, 148, 148, 149, 149, 150, 150,
    150, 151, 151, 152, 152, 153, 153, 153, 154, 154, 155, 155, 155, 156, 156, 157, 157, 157, 158, 158,
    159, 159, 159, 160, 160, 160, 161, 161, 161, 162, 162, 162, 163, 163, 163, 164, 164, 164, 165, 165,
    165, 166, 166, 166, 167, 167, 167, 168, 168, 168, 169, 169, 169, 169, 170, 170, 170, 171, 171, 171,
    171, 172, 172, 172, 173, 173, 173, 173, 174, 174, 174, 174, 175, 175, 175, 175, 176, 176, 176, 177,
    177, 177, 177, 178, 178, 178, 178, 178, 179, 179, 179, 179, 180, 180, 180, 180, 181, 181, 181, 181,
    182, 182, 182, 182, 182, 183, 183, 183, 183, 184, 184, 184, 184, 184, 185, 185, 185, 185, 185, 186,
    186, 186, 186, 186, 187, 187, 187, 187, 187, 188, 188, 188, 188, 188, 189, 189, 189, 189, 189, 190,
    190, 190, 190, 190, 191, 191, 191, 191, 191, 191, 192, 192, 192, 192, 192, 193,
};

const uint8_t bslam_light_bins[256] = {
    0,  0,  0,  0,  0,  0,  0,  0,  0,  0,  0,  0,  1,  1,  1,  1,  1,  1,  1,  1,  1,  1,  1,  1,  2,  2,
    2,  2,  2,  2,  2,  2,  2,  2,  2,  2,  3,  3,  3,  3,  3,  3,  3,  3,  3,  3,  3,  3,  4,  4,  4,  4,
    4,  4,  4,  4,  4,  4,  4,  4,  5,  5,  5,  5,  5,  5,  5,  5,  5,  5,  5,  5,  6,  6,  6,  6,  6,  6,
    6,  6,  6,  6,  6,  6,  7,  7,  7,  7,  7,  7,  7,  7,  7,  7,  7,  7,  8,  8,  8,  8,  8,  8,  8,  8,
    8,  8,  8,  8,  9,  9,  9,  9,  9,  9,  9,  9,  9,  9,  9,  9,  10, 10, 10, 10, 10, 10, 10, 10, 10, 10,
    10, 10, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12,
    13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 14, 14, 14, 14, 14, 14, 14, 14, 14, 14, 14, 14, 15, 15,
    15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15,
    15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15,
    15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15,
};

const uint8_t bslam_chroma_bins[256] = {
    4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 5, 5, 5, 5, 5, 6, 6, 6, 6, 6, 6, 6, 6, 7, 7, 7, 7, 7, 7, 7, 7,
    7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7,
    7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7,
    7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    0, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4,
};

/// Angles between which the zones lie where the camera looks straight: the floor is surely within 2 m there.
#define FLOOR_BELOW_RAD BSLAM_R(0.24)
#define WALL_ABOVE_RAD BSLAM_R(0.20)
#define WALL_BELOW_RAD BSLAM_R(0.04)
#define CEILING_ABOVE_RAD BSLAM_R(0.28)

/// A frame counts one, the first one as many as history would hold; history fades by an eighth a frame.
#define FIRST_WEIGHT 8
#define FADE_SHIFT 3
#define FADE_MASK 0x1F1F1F1FU  // what the shift leaves of each byte of a word
/// The running colours take a quarter of a new frame's.
#define COLOUR_RATE 0.25f

void bslam_background_init(bslam_background_t *background)
{
    memset(background, 0, sizeof *background);
}

static uint32_t logs_of(const uint8_t *channel)
{
    const uint32_t upper = (uint32_t)tone_log[channel[3]] << 8 | tone_log[channel[2]];
    return (upper << 8 | tone_log[channel[1]]) << 8 | tone_log[channel[0]];
}

/// Light and chroma of the frame's cells; tables have room for a whole word beyond them.
static void fill_colours(const bslam_cells_t *cells, int32_t count, bslam_tones_t *tones)
{
    for (int32_t i = 0; i < count; i += BSLAM_WORD_BYTES) {
        const uint32_t red = logs_of(cells->red + i), green = logs_of(cells->green + i);
        const uint32_t blue = logs_of(cells->blue + i);
        bslam_word_put(tones->light + i, bslam_bytes_mean(bslam_bytes_mean(red, blue), green));
        bslam_word_put(tones->reddish + i, bslam_bytes_difference(red, green));
        bslam_word_put(tones->bluish + i, bslam_bytes_difference(blue, green));
    }
}

/// Two numbers in halves of words over two others, at most 255.
static inline uint32_t quotients(uint32_t numbers, uint32_t by)
{
    const uint32_t low = (numbers & 0xFFFFU) / (by & 0xFFFFU), high = (numbers >> 16) / (by >> 16);
    return bslam_halves_least(low | high << 16, BSLAM_EVEN_BYTES);
}

/// 128 times the spread as a part of luma + 8.
static void fill_spreads(const bslam_cells_t *cells, int32_t count, uint8_t *spreads)
{
    const uint32_t eights = 8U | 8U << 16, whole = BSLAM_EVEN_BYTES << 7;
    for (int32_t i = 0; i < count; i += BSLAM_WORD_BYTES) {
        const uint32_t spread = bslam_word_at(cells->spread + i), green = bslam_word_at(cells->green + i);
        // As thumbnail.c weighs them for the spread.
        const uint32_t red = bslam_word_at(cells->red + i) >> 1 & ~BSLAM_TOP_BITS;
        const uint32_t even = bslam_bytes_add_even(bslam_bytes_add_even(eights, green), red);
        const uint32_t odd = bslam_bytes_add_odd(bslam_bytes_add_odd(eights, green), red);
        bslam_word_put(spreads + i, quotients(spread << 7 & whole, even) | quotients(spread >> 1 & whole, odd)
                                                                               << 8);
    }
}

void bslam_background_tones(const bslam_frame_t *frame, bslam_tones_t *tones)
{
    const int32_t count = frame->rows * frame->columns;
    fill_colours(frame->cells, count, tones);
    fill_spreads(frame->cells, count, tones->spread);
}

/// Index of the row that looks `up_rad` above the horizontal in the middle of the frame.
static int32_t row_looking(const bslam_camera_t *camera, bslam_real_t up_rad)
{
    const bslam_real_t from_axis_rad = up_rad + camera->pitch_rad;
    const bslam_real_t v_px = camera->cy_px - camera->fy_px * from_axis_rad;
    return (int32_t)(v_px / BSLAM_CELL_PX);
}

bslam_real_t bslam_horizon_px(const bslam_camera_t *camera)
{
    return camera->cy_px - camera->fy_px * camera->pitch_rad;
}

int32_t bslam_horizon_row(const bslam_camera_t *camera)
{
    return row_looking(camera, 0);
}

static bslam_zone_rows_t zone_rows(const bslam_camera_t *camera, int32_t rows, bslam_zone_t zone)
{
    bslam_zone_rows_t span = {0, rows};
    if (zone == BSLAM_ZONE_FLOOR) {
        span.first = bslam_clamp(row_looking(camera, -FLOOR_BELOW_RAD), 0, rows - 1);
    } else if (zone == BSLAM_ZONE_CEILING) {
        span.end = bslam_clamp(row_looking(camera, CEILING_ABOVE_RAD), 1, rows);
    } else {
        span.first = bslam_clamp(row_looking(camera, WALL_ABOVE_RAD), 0, rows - 1);
        span.end = bslam_clamp(row_looking(camera, -WALL_BELOW_RAD), span.first + 1, rows);
    }
    return span;
}

static void count_tones(uint8_t *counts, bslam_zone_rows_t span, int32_t columns, const bslam_tones_t *tones,
                        int32_t weight)
{
    for (int32_t row = span.first; row < span.end; row += 2) {
        for (int32_t column = row / 2 % 2; column < columns; column += 2) {
            uint8_t *count = &counts[bslam_tone_bin(bslam_tone_at(tones, row * columns + column))];
            *count = bslam_byte_at_most((uint32_t)(*count + weight));
        }
    }
}

/// Sums of a zone's colour and tone, each cell weighed by how frequent its tone is there.
typedef struct zone_sums {
    float weight;
    bslam_rgb_t colour;
    float light, reddish, bluish;
} zone_sums_t;

static zone_sums_t sum_zone(const uint8_t *counts, bslam_zone_rows_t span, const bslam_frame_t *frame,
                            const bslam_tones_t *tones)
{
    zone_sums_t sums = {0};
    for (int32_t row = span.first; row < span.end; row += 2) {
        for (int32_t column = row / 2 % 2; column < frame->columns; column += 2) {
            const int32_t i = row * frame->columns + column;
            const bslam_tone_t tone = bslam_tone_at(tones, i);
            const float share = (float)counts[bslam_tone_bin(tone)];
            const float weight = share * share;
            sums.weight += weight;
            sums.colour.red += weight * (float)frame->cells->red[i];
            sums.colour.green += weight * (float)frame->cells->green[i];
            sums.colour.blue += weight * (float)frame->cells->blue[i];
            sums.light += weight * (float)tone.light;
            sums.reddish += weight * (float)tone.reddish;
            sums.bluish += weight * (float)tone.bluish;
        }
    }
    return sums;
}

static void mix(bslam_rgb_t *colour, const zone_sums_t *sums, float rate)
{
    colour->red += rate * (sums->colour.red / sums->weight - colour->red);
    colour->green += rate * (sums->colour.green / sums->weight - colour->green);
    colour->blue += rate * (sums->colour.blue / sums->weight - colour->blue);
}

/// Nearly all bins are empty, mostly eight in two words.
static void fade(uint8_t counts[BSLAM_TONE_BINS])
{
    for (uint8_t *at = counts; at != counts + BSLAM_TONE_BINS; at += 2 * BSLAM_WORD_BYTES) {
        const uint32_t four = bslam_word_at(at), next = bslam_word_at(at + BSLAM_WORD_BYTES);
        if ((four | next) != 0) {
            bslam_word_put(at, four - (four >> FADE_SHIFT & FADE_MASK));
            bslam_word_put(at + BSLAM_WORD_BYTES, next - (next >> FADE_SHIFT & FADE_MASK));
        }
    }
}

void bslam_background_learn(bslam_background_t *background, const bslam_frame_t *frame,
                            const bslam_camera_t *camera, const bslam_tones_t *tones)
{
    bslam_surroundings_t *known = &background->surroundings;
    bslam_rgb_t *colours[BSLAM_ZONE_COUNT] = {&known->wall, &known->floor, &known->ceiling};
    for (int32_t z = 0; z < BSLAM_ZONE_COUNT; z++) {
        uint8_t *counts = background->counts[z];
        const bslam_zone_rows_t span = zone_rows(camera, frame->rows, (bslam_zone_t)z);
        fade(counts);
        count_tones(counts, span, frame->columns, tones, known->known ? 1 : FIRST_WEIGHT);
        const zone_sums_t sums = sum_zone(counts, span, frame, tones);
        mix(colours[z], &sums, known->known ? COLOUR_RATE : 1.0f);
        background->tone[z].light = (uint8_t)(sums.light / sums.weight + 0.5f);
        background->tone[z].reddish = (int8_t)(sums.reddish / sums.weight);
        background->tone[z].bluish = (int8_t)(sums.bluish / sums.weight);
    }
    known->known = true;
}

/// So many rows may be no floor before it ends.
#define ROWS_BETWEEN 2

/// A tone in a word, its chromas moved above 0; and where these stand: constants that fit an instruction.
static uint32_t word_of_tone(bslam_tone_t tone)
{
    return ((uint8_t)tone.reddish | (uint32_t)tone.light << 8 | (uint32_t)(uint8_t)tone.bluish << 16) ^
           0x800080U;
}

#define CHROMAS BSLAM_EVEN_BYTES

/// bslam_tone_distance() of two such words.
static int32_t word_distance(uint32_t a, uint32_t b)
{
    return (int32_t)bslam_bytes_apart_add(a & CHROMAS, b & CHROMAS, bslam_bytes_apart_sum(a, b));
}

/// How much more a cell looks like floor than like wall, whose tones are given as words.
static int32_t floor_evidence(const bslam_background_t *background, bslam_tone_t tone, uint32_t wall,
                              uint32_t floor)
{
    const int32_t bin = bslam_tone_bin(tone);
    const int32_t frequent = tone_log[background->counts[BSLAM_ZONE_FLOOR][bin]] -
                             tone_log[background->counts[BSLAM_ZONE_WALL][bin]];
    const uint32_t word = word_of_tone(tone);
    return frequent + bslam_clamp(word_distance(word, wall) - word_distance(word, floor), -64, 64);
}

/// The row of cells below which all of a column is floor.
static int32_t floor_end(const bslam_background_t *background, const bslam_frame_t *frame,
                         const bslam_tones_t *tones, int32_t column, int32_t stop)
{
    const uint32_t wall = word_of_tone(background->tone[BSLAM_ZONE_WALL]);
    const uint32_t floor = word_of_tone(background->tone[BSLAM_ZONE_FLOOR]);
    int32_t end = frame->rows;
    int32_t i = (end - 1) * frame->columns + column;
    for (int32_t row = end - 1; row >= stop && row >= end - ROWS_BETWEEN; row--, i -= frame->columns) {
        if (floor_evidence(background, bslam_tone_at(tones, i), wall, floor) > 0) {
            end = row;
        }
    }
    return end;
}

static void fill_ends(const bslam_background_t *background, const bslam_frame_t *frame,
                      const bslam_tones_t *tones, int32_t stop, int16_t *ends)
{
    for (int32_t column = 0; column < frame->columns; column++) {
        ends[column] = (int16_t)floor_end(background, frame, tones, column, stop);
    }
}

/// Horizontal distance of the floor at a pixel, 0 where it does not look down at it.
static bslam_real_t floor_distance_m(const bslam_camera_t *camera, const bslam_mounting_t *mounting,
                                     bslam_real_t u_px, bslam_real_t v_px)
{
    bslam_direction_t ray = {0};
    if (bslam_camera_unproject_as(camera, mounting, u_px, v_px, &ray) != BSLAM_OK || ray.z > BSLAM_R(-1e-3)) {
        return 0;
    }
    return camera->z_m * bslam_sqrt(ray.x * ray.x + ray.y * ray.y) / -ray.z;
}

// A skirting board is no floor, but often more like it than like the wall. It is looked for up to this
// height, metres. A boundary has this part of the contrast of the sharpest near it, and that one so much:
// sums over the channels, 1/126 of their range.
#define SKIRTING_MAX_M BSLAM_R(0.13)
#define BOUNDARY_PERCENT 35
#define BOUNDARY_MIN 16
#define LASTING_PERCENT 70

enum {
    FINE_ROWS = 24,  // of the half-resolution copy that are looked at, at most
    SHARP = 2,       // rows to either side that a boundary's contrast is taken of,
    WIDE = 5         // and those that must differ as well, or it is only a line on the floor
};

/// A column of cells in the half-resolution copy: two pixels a row, their channels' sums spread.
typedef struct strip {
    int32_t rows;
    int32_t first;  ///< row of the copy
    uint32_t pairs[FINE_ROWS];
} strip_t;

/// The mean of two rows, whose pairs add up to this, times SHARP: a byte a channel.
static uint32_t mean_of_two(uint32_t pairs)
{
    return (pairs & 127) | (pairs >> BSLAM_SPREAD_RED & 127) << 8 | pairs >> (BSLAM_SPREAD_GREEN + 1) << 16;
}

/// Fills a strip, and, for each boundary that has SHARP rows above and below, how much their means differ,
/// times SHARP; 0 before the first and after the last of these. Returns the largest.
static int32_t fill_strip(const bslam_frame_t *frame, int32_t column, int32_t first, int32_t end,
                          strip_t *strip, int32_t contrasts[FINE_ROWS + 2])
{
    _Static_assert(SHARP == 2, "rows whose means are kept");
    const int32_t width = frame->width_px / 2;
    const uint16_t *at = frame->half + first * width + 2 * column;
    uint32_t before = 0, above = 0, next_above = 0;
    int32_t sharpest = 0;
    strip->first = first;
    strip->rows = end - first < FINE_ROWS ? end - first : FINE_ROWS;
    for (int32_t i = 0; i < strip->rows; i++, at += width) {
        const uint32_t pair = bslam_spread_pair(bslam_word_at(at)), mean = mean_of_two(before + pair);
        strip->pairs[i] = before = pair;
        if (i > SHARP) {
            contrasts[i - 1] = (int32_t)bslam_bytes_apart_sum(above, mean);
            sharpest = bslam_most(contrasts[i - 1], sharpest);
        }
        above = next_above;
        next_above = mean;
    }
    contrasts[SHARP - 1] = contrasts[bslam_most(strip->rows - SHARP + 1, SHARP)] = 0;
    return sharpest;
}

/// Sums of rows [first, end): green, which has a bit more than red and blue, counts half as much.
static void sum_rows(const strip_t *strip, int32_t first, int32_t end, int32_t sums[3])
{
    memset(sums, 0, 3 * sizeof sums[0]);
    for (int32_t i = first; i < end; i++) {
        const uint32_t pair = strip->pairs[i];
        sums[0] += 2 * (int32_t)(pair >> BSLAM_SPREAD_RED & 63);
        sums[1] += (int32_t)(pair >> BSLAM_SPREAD_GREEN);
        sums[2] += 2 * (int32_t)(pair & 63);
    }
}

/// How much the means of the rows [first, at) and [at, end) differ.
static int32_t difference(const strip_t *strip, int32_t first, int32_t at, int32_t end)
{
    int32_t above[3], below[3], sum = 0;
    sum_rows(strip, first, at, above);
    sum_rows(strip, at, end, below);
    for (int32_t k = 0; k < 3; k++) {
        const int32_t apart = above[k] / (at - first) - below[k] / (end - at);
        sum += apart < 0 ? -apart : apart;
    }
    return sum;
}

/// True if it is sharp, and what lies between it and the coarse end differs from what lies below it: a line
/// on the floor has floor on both sides.
static bool is_boundary(const strip_t *strip, const int32_t *contrasts, int32_t i, int32_t coarse,
                        int32_t sharpest)
{
    const int32_t contrast = contrasts[i];
    const int32_t end = i + WIDE < strip->rows ? i + WIDE : strip->rows;
    const int32_t first = coarse < i - SHARP ? coarse : i - SHARP;
    return 100 * contrast >= BOUNDARY_PERCENT * sharpest && contrast >= contrasts[i + 1] &&
           contrast >= contrasts[i - 1] &&
           100 * difference(strip, first, i, end) >= LASTING_PERCENT * contrast;
}

/// The floor's end near a coarse one, rows of the half-resolution copy: the lowest sharp boundary between
/// what is floor and what is not, down to `lowest`; the coarse one where there is none.
static int32_t fine_end(const bslam_frame_t *frame, int32_t column, int32_t coarse, int32_t lowest)
{
    strip_t strip;
    int32_t contrasts[FINE_ROWS + 2];
    const int32_t half_rows = frame->height_px / 2;
    const int32_t first = coarse > WIDE ? coarse - WIDE : 0;
    const int32_t end = lowest + WIDE < half_rows ? lowest + WIDE : half_rows;
    const int32_t sharpest = fill_strip(frame, column, first, end, &strip, contrasts);
    for (int32_t i = strip.rows - SHARP; i >= SHARP && sharpest >= BOUNDARY_MIN; i--) {
        if (is_boundary(&strip, contrasts, i, coarse - first, sharpest)) {
            return first + i;
        }
    }
    return coarse;
}

void bslam_background_floor_line(const bslam_background_t *background, const bslam_frame_t *frame,
                                 const bslam_camera_t *camera, const bslam_tones_t *tones,
                                 bslam_floor_line_t *line)
{
    const int32_t stop = bslam_clamp(bslam_horizon_row(camera) + 1, 1, frame->rows);
    const bslam_mounting_t mounting = bslam_camera_mounting(camera);
    fill_ends(background, frame, tones, stop, line->row);
    for (int32_t column = 0; column < frame->columns; column++) {
        const int32_t row = line->row[column];
        int32_t edge_px = row * BSLAM_CELL_PX;
        if (row < frame->rows) {
            const bslam_real_t below_px = (bslam_real_t)edge_px - bslam_horizon_px(camera);
            const bslam_real_t skirting_px = below_px * SKIRTING_MAX_M / (camera->z_m - SKIRTING_MAX_M);
            edge_px = 2 * fine_end(frame, column, edge_px / 2, (edge_px + (int32_t)skirting_px) / 2 + 1);
        }
        line->edge_px[column] = (int16_t)edge_px;
        line->row[column] = (int16_t)((edge_px + BSLAM_CELL_PX / 2) / BSLAM_CELL_PX - 1);
        const bslam_real_t u_px = (bslam_real_t)(column * BSLAM_CELL_PX) + BSLAM_R(1.5);
        const bslam_real_t v_px = (bslam_real_t)edge_px - BSLAM_R(0.5);
        line->distance_m[column] = row < frame->rows ? floor_distance_m(camera, &mounting, u_px, v_px) : 0;
    }
}
