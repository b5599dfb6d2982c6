#include "vision/built_in/detection/cells.h"

#include <stddef.h>
#include <string.h>

#include "base/bounds.h"
#include "vision/pixels/bytes.h"

/// Limits of the features: beyond them a difference says no more.
#define LIGHT_MAX 96
#define CHROMA_MAX 64
#define DISTANCE_MAX 128
#define OFTEN BSLAM_FREQUENT_MAX
#define SELDOM 6
/// A byte in all four of a word.
#define FOUR 0x01010101U
/// The sum of all weights times features stays below 2^31 with it.
#define BIAS_MAX 1.0e9f

/// A weight of a model as a whole number: a model may have any finite one.
static int32_t whole(float value, float limit)
{
    const float low = value < limit ? value : limit;
    return (int32_t)(low > -limit ? low : -limit);
}

bslam_cell_machine_t bslam_cell_machine(const bslam_svm_t *svm)
{
    bslam_cell_machine_t machine = {0};
    const float scale = (float)(BSLAM_CELL_VALUE_ONE << BSLAM_CELL_WEIGHT_SHIFT);
    for (int32_t i = 0; i < BSLAM_CELL_FEATURES; i++) {
        const float weight = svm->bytes != NULL ? (float)svm->bytes[i] * svm->byte_scale[0] : svm->weights[i];
        machine.weights[i] = (int16_t)whole(weight * scale, 32767.0f);
    }
    machine.bias = whole(svm->bias[0] * scale, BIAS_MAX);
    return machine;
}

static uint8_t difference(uint8_t a, uint8_t b)
{
    return (uint8_t)((a > b ? a : b) - (a < b ? a : b));
}

/// How far four bytes of a channel and those `apart` bytes on are apart; steps on, which costs nothing where
/// the word that is stepped over is loaded last.
static inline uint32_t step_of(const uint8_t **channel, int32_t apart)
{
    const uint32_t there = bslam_word_at(*channel + apart), here = bslam_word_at(*channel);
    *channel += BSLAM_WORD_BYTES;
    return bslam_bytes_apart(there, here);
}

/// Not to be inlined: tables so far apart would be addressed from one base, with a sum for each access.
__attribute__((noinline)) static void fill_words(const uint8_t *red, const uint8_t *green,
                                                 const uint8_t *blue, int32_t apart, int32_t count,
                                                 uint8_t *restrict into)
{
    const uint8_t *end = into + count;
    for (; into < end; into += BSLAM_WORD_BYTES) {
        const uint32_t of_red = step_of(&red, apart), of_green = step_of(&green, apart);
        const uint32_t of_blue = step_of(&blue, apart);
        bslam_word_put(
            into, bslam_bytes_plus(bslam_bytes_plus(of_red, of_green), bslam_bytes_plus(of_green, of_blue)));
    }
}

/// Differences of the colours of cells `a` and `b` and those that follow, for at least `count` cells from
/// `into` on; green counts twice. Whole steps: what is beyond is written over later, or lies in the tables'
/// room.
static void fill_steps(const bslam_cells_t *cells, int32_t a, int32_t b, int32_t count,
                       uint8_t *restrict into)
{
    fill_words(cells->red + a, cells->green + a, cells->blue + a, b - a, count, into);
}

static uint8_t colour_step(const bslam_cells_t *cells, int32_t a, int32_t b)
{
    const int32_t step = difference(cells->red[a], cells->red[b]) +
                         2 * difference(cells->green[a], cells->green[b]) +
                         difference(cells->blue[a], cells->blue[b]);
    return (uint8_t)bslam_least(step, 255);
}

void bslam_cells_step(const bslam_view_t *view, uint8_t *step_x, uint8_t *step_y)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows, count = columns * rows;
    const bslam_cells_t *cells = view->frame->cells;
    fill_steps(cells, 0, 2, count - 2, step_x + 1);
    for (int32_t first = 0; first < count; first += columns) {
        const int32_t last = first + columns - 1;
        step_x[first] = colour_step(cells, first, first + 1);
        step_x[last] = colour_step(cells, last - 1, last);
    }
    // Rows from the uppermost on, since each writes beyond its end.
    fill_steps(cells, 0, columns, columns, step_y);
    fill_steps(cells, 0, 2 * columns, count - 2 * columns, step_y + columns);
    fill_steps(cells, count - 2 * columns, count - columns, columns, step_y + count - columns);
}

void bslam_cell_features(const bslam_view_t *view, int32_t row, int32_t column,
                         int16_t features[BSLAM_CELL_FEATURES])
{
    const int32_t columns = view->frame->columns;
    const int32_t i = row * columns + column;
    const bslam_tone_t tone = bslam_tone_at(view->tones, i);
    const bslam_background_t *background = view->background;
    const bslam_tone_t wall = background->tone[BSLAM_ZONE_WALL];
    const bslam_tone_t floor = background->tone[BSLAM_ZONE_FLOOR];
    const bslam_tone_t ceiling = background->tone[BSLAM_ZONE_CEILING];
    const int32_t bin = bslam_tone_bin(tone);
    const int32_t wall_distance = bslam_tone_distance(tone, wall);
    const int32_t floor_distance = bslam_tone_distance(tone, floor);
    const int32_t ceiling_distance = bslam_tone_distance(tone, ceiling);
    const int32_t above_floor = view->floor_line->row[column] - row;
    const int32_t above_horizon = bslam_horizon_row(view->camera) - row;
    int16_t *x = features;

    *x++ = (int16_t)bslam_clamp(tone.light - wall.light, -96, 96);
    *x++ = (int16_t)bslam_clamp(bslam_magnitude(tone.light - wall.light), 0, 96);
    *x++ = (int16_t)bslam_clamp(bslam_magnitude(tone.reddish - wall.reddish), 0, 64);
    *x++ = (int16_t)bslam_clamp(bslam_magnitude(tone.bluish - wall.bluish), 0, 64);
    *x++ = (int16_t)bslam_clamp(floor_distance, 0, 128);
    *x++ = (int16_t)bslam_clamp(ceiling_distance, 0, 128);
    *x++ = (int16_t)bslam_clamp(bslam_least(wall_distance, bslam_least(floor_distance, ceiling_distance)), 0,
                                128);
    *x++ = (int16_t)bslam_least(background->counts[BSLAM_ZONE_WALL][bin], 32);
    *x++ = (int16_t)bslam_least(background->counts[BSLAM_ZONE_WALL][bin], 6);
    *x++ = (int16_t)bslam_least(background->counts[BSLAM_ZONE_FLOOR][bin], 32);
    *x++ = (int16_t)bslam_least(background->counts[BSLAM_ZONE_FLOOR][bin], 6);
    *x++ = (int16_t)bslam_least(background->counts[BSLAM_ZONE_CEILING][bin], 32);
    *x++ = (int16_t)bslam_clamp(tone.spread, 0, 64);
    *x++ = (int16_t)bslam_least(view->step_x[i], 128);
    *x++ = (int16_t)bslam_least(view->step_y[i], 128);
    *x++ = (int16_t)bslam_least(bslam_magnitude(tone.reddish) + bslam_magnitude(tone.bluish), 128);
    *x++ = (int16_t)bslam_clamp(above_floor, -8, 40);
    *x++ = (int16_t)bslam_clamp(above_floor, -3, 3);
    *x++ = (int16_t)bslam_clamp(above_horizon, -30, 30);
    *x++ = (int16_t)bslam_most(bslam_clamp(above_horizon, -30, 30), 0);
    *x++ = (int16_t)(above_floor >= 0 ? bslam_least(wall_distance, 128) : 0);
    *x++ = (int16_t)(above_floor >= 0 ? bslam_clamp(tone.light - wall.light, -96, 0) : 0);
}

static void fill_bin(const bslam_background_t *background, const int16_t *weights, int32_t bin,
                     bslam_cell_tables_t *tables)
{
    const int32_t wall = background->counts[BSLAM_ZONE_WALL][bin];
    const int32_t floor = background->counts[BSLAM_ZONE_FLOOR][bin];
    const int32_t ceiling = background->counts[BSLAM_ZONE_CEILING][bin];
    tables->sums[bin] = weights[7] * bslam_least(wall, OFTEN) + weights[8] * bslam_least(wall, SELDOM) +
                        weights[9] * bslam_least(floor, OFTEN) + weights[10] * bslam_least(floor, SELDOM) +
                        weights[11] * bslam_least(ceiling, OFTEN);
    tables->frequent[bin] = (uint16_t)(bslam_least(wall, OFTEN) | bslam_least(floor, OFTEN) << 8);
}

/// Tables of the tones' bins; nearly all bins are empty, mostly four in a word.
static void fill_bins(const bslam_background_t *background, const int16_t *weights,
                      bslam_cell_tables_t *tables)
{
    const uint8_t *walls = background->counts[BSLAM_ZONE_WALL],
                  *floors = background->counts[BSLAM_ZONE_FLOOR];
    const uint8_t *ceilings = background->counts[BSLAM_ZONE_CEILING];
    for (int32_t first = 0; first < BSLAM_TONE_BINS; first += BSLAM_WORD_BYTES) {
        const int32_t end = first + BSLAM_WORD_BYTES;
        if ((bslam_word_at(walls + first) | bslam_word_at(floors + first) |
             bslam_word_at(ceilings + first)) == 0) {
            _Pragma("GCC unroll 4") for (int32_t bin = first; bin < end; bin++)
            {
                tables->sums[bin] = 0;
                tables->frequent[bin] = 0;
            }
            continue;
        }
        for (int32_t bin = first; bin < end; bin++) {
            fill_bin(background, weights, bin, tables);
        }
    }
}

// Distances from the tones of the floor, the wall, the ceiling and from grey are the bytes of a word, the
// first lowest. Those of the three channels add up by an addition that stops at 255, and begin with
// DISTANCE_ZERO: so it stops at DISTANCE_MAX.
#define DISTANCE_ZERO (255 - DISTANCE_MAX)
#define ALL_BUT_GREY 0x00FFFFFFU
#define ROWS_MAX (BSLAM_IMAGE_HEIGHT_MAX / BSLAM_CELL_PX)
enum { TO_WALL = 1 };

static uint32_t word_of(int32_t floor, int32_t wall, int32_t ceiling, int32_t grey)
{
    return (uint8_t)floor | (uint32_t)(uint8_t)wall << 8 | (uint32_t)(uint8_t)ceiling << 16 |
           (uint32_t)(uint8_t)grey << 24;
}

static void fill_lights(const bslam_background_t *background, const int16_t *w, bslam_light_terms_t *terms)
{
    const int32_t wall = background->tone[BSLAM_ZONE_WALL].light;
    const uint32_t tones = word_of(background->tone[BSLAM_ZONE_FLOOR].light, wall,
                                   background->tone[BSLAM_ZONE_CEILING].light, 0);
    for (int32_t light = 0; light < BSLAM_LIGHTS; light++) {
        const uint32_t apart = bslam_bytes_apart((uint32_t)light * FOUR, tones) & ALL_BUT_GREY;
        const int32_t brighter = bslam_clamp(light - wall, -LIGHT_MAX, LIGHT_MAX);
        terms[light] = (bslam_light_terms_t){
            .value = w[0] * brighter + w[1] * bslam_magnitude(brighter),
            .distances = bslam_bytes_least(apart, FOUR * DISTANCE_MAX) + FOUR * DISTANCE_ZERO,
            .above_floor = w[21] * bslam_least(brighter, 0) - w[20] * DISTANCE_ZERO,
        };
    }
}

/// The same for a chroma: `tones` are those of floor, wall and ceiling and grey, 128 more than the chroma;
/// weight that of the distance from the wall's.
static void fill_chromas(uint32_t tones, int32_t weight, bslam_chroma_terms_t *terms)
{
    for (int32_t chroma = -128; chroma < 128; chroma++) {
        const uint32_t apart = bslam_bytes_apart((uint32_t)(chroma + 128) * FOUR, tones);
        const uint32_t twice = bslam_bytes_plus(apart, apart & ALL_BUT_GREY);
        terms[(uint8_t)chroma] = (bslam_chroma_terms_t){
            .value = weight * bslam_least(bslam_byte_of(apart, TO_WALL), CHROMA_MAX),
            .distances = bslam_bytes_least(twice, FOUR * DISTANCE_MAX),
        };
    }
}

#define NO_TONE 0xFFFFFFFFU

/// Tables of all that depends on one channel of a tone; no tone's sum is kept.
static void fill_channels(const bslam_background_t *background, const int16_t *w,
                          bslam_channel_tables_t *tables)
{
    const bslam_tone_t wall = background->tone[BSLAM_ZONE_WALL];
    const bslam_tone_t floor = background->tone[BSLAM_ZONE_FLOOR];
    const bslam_tone_t ceiling = background->tone[BSLAM_ZONE_CEILING];
    fill_lights(background, w, tables->light);
    fill_chromas(word_of(floor.reddish, wall.reddish, ceiling.reddish, 0) ^ FOUR * 128, w[2],
                 tables->reddish);
    fill_chromas(word_of(floor.bluish, wall.bluish, ceiling.bluish, 0) ^ FOUR * 128, w[3], tables->bluish);
    for (int32_t i = 0; i < BSLAM_TONES_KEPT; i++) {
        tables->kept[i].tone = NO_TONE;
    }
}

/// What textures weigh.
typedef struct texture {
    int32_t by_spread, by_step_x, by_step_y;
} texture_t;

/// The textures of a row of cells, and the row where the floor begins below each.
typedef struct cell_row {
    const uint8_t *spread, *step_x, *step_y;
    const int16_t *floor_row;
} cell_row_t;

/// Adds to the sums of two cells, the first and the third of some, what their textures count, which come in
/// the halves of words.
static inline void add_textures(uint32_t spread, uint32_t step_x, uint32_t step_y, const texture_t *by,
                                int32_t sums[3])
{
    const int32_t first = bslam_low_half_times(spread, by->by_spread, sums[0]);
    const int32_t third = bslam_high_half_times(spread, by->by_spread, sums[2]);
    sums[0] = bslam_low_half_times(step_y, by->by_step_y, bslam_low_half_times(step_x, by->by_step_x, first));
    sums[2] =
        bslam_high_half_times(step_y, by->by_step_y, bslam_high_half_times(step_x, by->by_step_x, third));
}

/// What each of `count` cells adds up to by texture and place: `places` by where the floor begins, `of_row`
/// of all. Not to be inlined, for the registers' sake.
__attribute__((noinline)) static void sum_row(cell_row_t row, const texture_t *by, const int32_t *places,
                                              int32_t of_row, int32_t count, int32_t *restrict sums)
{
    const texture_t weights = *by;
    const int32_t *end = sums + count;
    for (; sums < end; sums += BSLAM_WORD_BYTES) {
        const uint32_t spread = bslam_bytes_least(bslam_word_at(row.spread), FOUR * CHROMA_MAX);
        const uint32_t step_x = bslam_bytes_least(bslam_word_at(row.step_x), FOUR * DISTANCE_MAX);
        const uint32_t step_y = bslam_bytes_least(bslam_word_at(row.step_y), FOUR * DISTANCE_MAX);
        row.spread += BSLAM_WORD_BYTES;
        row.step_x += BSLAM_WORD_BYTES;
        row.step_y += BSLAM_WORD_BYTES;
        _Pragma("GCC unroll 4") for (int32_t k = 0; k < BSLAM_WORD_BYTES; k++)
        {
            sums[k] = of_row + places[row.floor_row[k]];
        }
        add_textures(bslam_bytes_even(spread), bslam_bytes_even(step_x), bslam_bytes_even(step_y), &weights,
                     sums);
        add_textures(bslam_bytes_odd(spread), bslam_bytes_odd(step_x), bslam_bytes_odd(step_y), &weights,
                     sums + 1);
        row.floor_row += BSLAM_WORD_BYTES;
    }
}

/// What the machine looks at tones with.
typedef struct tone_machine {
    const bslam_cell_tables_t *bins;
    const int16_t *weights;
    bslam_channel_tables_t *channels;
} tone_machine_t;

/// Not to be inlined: most tones are kept, and the loop over the cells has the registers then.
__attribute__((noinline)) static bslam_tone_sum_t *sum_tone(bslam_tone_sum_t *sum, uint32_t tone,
                                                            const tone_machine_t *machine)
{
    const int16_t *w = machine->weights;
    const int32_t light = bslam_byte_of(tone, 0), reddish = bslam_byte_of(tone, 1);
    const int32_t bluish = bslam_byte_of(tone, 2);
    const bslam_light_terms_t *a = &machine->channels->light[light];
    const bslam_chroma_terms_t *b = &machine->channels->reddish[reddish];
    const bslam_chroma_terms_t *c = &machine->channels->bluish[bluish];
    const uint32_t distances = bslam_bytes_plus(a->distances, bslam_bytes_plus(b->distances, c->distances));
    const uint32_t nearer = bslam_bytes_least(distances, distances >> 8);
    const int32_t nearest = bslam_byte_of(bslam_bytes_least(nearer, nearer >> 8), 0);
    const int32_t bin = bslam_tone_bin((bslam_tone_t){(uint8_t)light, (int8_t)reddish, (int8_t)bluish, 0});
    const int32_t values = a->value + b->value + c->value + machine->bins->sums[bin];
    sum->tone = tone;
    sum->sum = bslam_halves_dot(bslam_bytes_even(distances), bslam_halves(w[4], w[5]), values) +
               w[6] * nearest + w[15] * bslam_byte_of(distances, 3);
    sum->sum_above_floor = sum->sum + a->above_floor + w[20] * bslam_byte_of(distances, TO_WALL);
    sum->frequent = machine->bins->frequent[bin];
    return sum;
}

/// A sum as a cell's value, rounded towards 0 and within +-127.
static inline int32_t value_of(int32_t sum)
{
    const uint32_t if_below_zero = (uint32_t)(sum >> 31) >> (32 - BSLAM_CELL_WEIGHT_SHIFT);
    const int32_t value =
        bslam_signed_byte_nearest((sum + (int32_t)if_below_zero) >> BSLAM_CELL_WEIGHT_SHIFT);
    return value + (int32_t)((uint32_t)(value + 127) >> 31);
}

/// Values of a row's cells: by their tones, and the sums of the rest.
static void decide_row(const bslam_view_t *view, const tone_machine_t *machine, int32_t row,
                       const int32_t *restrict sums, uint16_t *restrict frequent, int8_t *restrict values)
{
    const int32_t first = row * view->frame->columns;
    const uint8_t *lights = view->tones->light + first;
    const uint8_t *reddish = (const uint8_t *)view->tones->reddish + first;
    const uint8_t *bluish = (const uint8_t *)view->tones->bluish + first;
    const int16_t *floor_row = view->floor_line->row;
    bslam_tone_sum_t *kept = machine->channels->kept;
    const int32_t columns = view->frame->columns;
    for (int32_t i = 0; i < columns; i++) {
        const uint32_t tone = lights[i] | (uint32_t)reddish[i] << 8 | (uint32_t)bluish[i] << 16;
        // One place serves few of a room's tones: all channels' bits are mixed.
        _Static_assert(BSLAM_TONES_KEPT == 1 << 8, "8 bits tell the place");
        bslam_tone_sum_t *known = &kept[tone * 0x10042108U >> 24];
        if (known->tone != tone) {
            known = sum_tone(known, tone, machine);
        }
        frequent[i] = (uint16_t)known->frequent;
        values[i] = (int8_t)value_of(sums[i] + (floor_row[i] >= row ? known->sum_above_floor : known->sum));
    }
}

void bslam_cells_decide(const bslam_view_t *view, const bslam_cell_machine_t *machine,
                        bslam_cell_tables_t *tables, bslam_channel_tables_t *channels, uint16_t *frequent,
                        int8_t *values)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    const int32_t horizon = bslam_horizon_row(view->camera);
    const int16_t *w = machine->weights;
    const int32_t bias = machine->bias - DISTANCE_ZERO * (w[4] + w[5] + w[6] + w[15]);
    int32_t places[2 * ROWS_MAX + 1];  // what the place above the floor adds, from -ROWS_MAX rows on
    int32_t sums[BSLAM_COLUMNS_MAX + BSLAM_WORD_BYTES];
    const tone_machine_t tones = {.bins = tables, .weights = w, .channels = channels};
    const texture_t texture = {.by_spread = w[12], .by_step_x = w[13], .by_step_y = w[14]};
    fill_bins(view->background, w, tables);
    fill_channels(view->background, w, channels);
    for (int32_t above = -ROWS_MAX; above <= ROWS_MAX; above++) {
        places[ROWS_MAX + above] = w[16] * bslam_clamp(above, -8, 40) + w[17] * bslam_clamp(above, -3, 3);
    }
    for (int32_t row = 0; row < rows; row++) {
        const int32_t up = bslam_clamp(horizon - row, -30, 30);
        const int32_t of_row = bias + w[18] * up + w[19] * bslam_most(up, 0);
        const int32_t first = row * columns;
        const cell_row_t cells = {view->tones->spread + first, view->step_x + first, view->step_y + first,
                                  view->floor_line->row};
        sum_row(cells, &texture, places + ROWS_MAX - row, of_row, columns, sums);
        decide_row(view, &tones, row, sums, frequent + first, values + first);
    }
}
