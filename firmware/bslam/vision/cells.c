#include "bslam/vision/cells.h"

#include <stddef.h>

/// Limits of the features: beyond them a difference says no more.
#define LIGHT_MAX 96
#define CHROMA_MAX 64
#define DISTANCE_MAX 128
#define OFTEN BSLAM_FREQUENT_MAX
#define SELDOM 6
#define STEP BSLAM_CELL_STEP

static int32_t least(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static int32_t most(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

static int32_t clamp(int32_t value, int32_t low, int32_t high)
{
    return most(low, least(value, high));
}

static int32_t magnitude(int32_t value)
{
    return value < 0 ? -value : value;
}

bslam_cell_machine_t bslam_cell_machine(const bslam_svm_t *svm)
{
    bslam_cell_machine_t machine = {0};
    const float scale = (float)(BSLAM_CELL_VALUE_ONE << BSLAM_CELL_WEIGHT_SHIFT);
    for (int32_t i = 0; i < BSLAM_CELL_FEATURES; i++) {
        const float weight = svm->bytes != NULL ? (float)svm->bytes[i] * svm->byte_scale[0] : svm->weights[i];
        machine.weights[i] = (int16_t)clamp((int32_t)(weight * scale), -32767, 32767);
    }
    machine.bias = (int32_t)(svm->bias[0] * scale);
    return machine;
}

static uint8_t difference(uint8_t a, uint8_t b)
{
    return (uint8_t)((a > b ? a : b) - (a < b ? a : b));
}

/// Differences of the colours of cells `a` and `b` and those that follow, for at least `count` cells from
/// `into` on; green counts twice. Whole steps: what is beyond is written over later, or lies in the tables'
/// room.
static void fill_steps(const bslam_cells_t *cells, int32_t a, int32_t b, int32_t count,
                       uint8_t *restrict into)
{
    for (int32_t i = 0; i < count; i += STEP) {
        const uint8_t *red_a = cells->red + a + i, *red_b = cells->red + b + i;
        const uint8_t *green_a = cells->green + a + i, *green_b = cells->green + b + i;
        const uint8_t *blue_a = cells->blue + a + i, *blue_b = cells->blue + b + i;
        for (int32_t k = 0; k < STEP; k++) {
            const uint8_t red = difference(red_a[k], red_b[k]);
            const uint8_t green = difference(green_a[k], green_b[k]);
            const uint8_t blue = difference(blue_a[k], blue_b[k]);
            const uint16_t step = (uint16_t)(red + 2 * green + blue);
            into[i + k] = (uint8_t)(step < 255 ? step : 255);
        }
    }
}

static uint8_t colour_step(const bslam_cells_t *cells, int32_t a, int32_t b)
{
    const int32_t step = difference(cells->red[a], cells->red[b]) +
                         2 * difference(cells->green[a], cells->green[b]) +
                         difference(cells->blue[a], cells->blue[b]);
    return (uint8_t)least(step, 255);
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

    *x++ = (int16_t)clamp(tone.light - wall.light, -96, 96);
    *x++ = (int16_t)clamp(magnitude(tone.light - wall.light), 0, 96);
    *x++ = (int16_t)clamp(magnitude(tone.reddish - wall.reddish), 0, 64);
    *x++ = (int16_t)clamp(magnitude(tone.bluish - wall.bluish), 0, 64);
    *x++ = (int16_t)clamp(floor_distance, 0, 128);
    *x++ = (int16_t)clamp(ceiling_distance, 0, 128);
    *x++ = (int16_t)clamp(least(wall_distance, least(floor_distance, ceiling_distance)), 0, 128);
    *x++ = (int16_t)least(background->counts[BSLAM_ZONE_WALL][bin], 32);
    *x++ = (int16_t)least(background->counts[BSLAM_ZONE_WALL][bin], 6);
    *x++ = (int16_t)least(background->counts[BSLAM_ZONE_FLOOR][bin], 32);
    *x++ = (int16_t)least(background->counts[BSLAM_ZONE_FLOOR][bin], 6);
    *x++ = (int16_t)least(background->counts[BSLAM_ZONE_CEILING][bin], 32);
    *x++ = (int16_t)clamp(tone.spread, 0, 64);
    *x++ = (int16_t)least(view->step_x[i], 128);
    *x++ = (int16_t)least(view->step_y[i], 128);
    *x++ = (int16_t)least(magnitude(tone.reddish) + magnitude(tone.bluish), 128);
    *x++ = (int16_t)clamp(above_floor, -8, 40);
    *x++ = (int16_t)clamp(above_floor, -3, 3);
    *x++ = (int16_t)clamp(above_horizon, -30, 30);
    *x++ = (int16_t)most(clamp(above_horizon, -30, 30), 0);
    *x++ = (int16_t)(above_floor >= 0 ? least(wall_distance, 128) : 0);
    *x++ = (int16_t)(above_floor >= 0 ? clamp(tone.light - wall.light, -96, 0) : 0);
}

static void fill_tables(const bslam_background_t *background, const int16_t *weights,
                        bslam_cell_tables_t *tables)
{
    for (int32_t bin = 0; bin < BSLAM_TONE_BINS; bin++) {
        const int32_t wall = background->counts[BSLAM_ZONE_WALL][bin];
        const int32_t floor = background->counts[BSLAM_ZONE_FLOOR][bin];
        const int32_t ceiling = background->counts[BSLAM_ZONE_CEILING][bin];
        tables->sums[bin] = weights[7] * least(wall, OFTEN) + weights[8] * least(wall, SELDOM) +
                            weights[9] * least(floor, OFTEN) + weights[10] * least(floor, SELDOM) +
                            weights[11] * least(ceiling, OFTEN);
        tables->frequent[bin] = (uint16_t)(least(wall, OFTEN) | least(floor, OFTEN) << 8);
    }
}

/// All that follows takes STEP cells of a row at a time, in 16 bits where that suffices, so that a compiler
/// can use vector instructions.
typedef struct cells_in {
    const uint8_t *light;
    const int8_t *reddish, *bluish;
    const uint8_t *spread, *step_x, *step_y;
    const int16_t *floor_row;
} cells_in_t;

static int16_t least16(int16_t a, int16_t b)
{
    return a < b ? a : b;
}

static int16_t most16(int16_t a, int16_t b)
{
    return a > b ? a : b;
}

static int16_t apart(int16_t a, int16_t b)
{
    return (int16_t)(most16(a, b) - least16(a, b));
}

/// Bin of a chroma, as bslam_tone_bin has it: division by 8 rounds towards 0.
static int16_t chroma_bin(int16_t chroma)
{
    const int16_t eighth = (int16_t)((int16_t)(chroma + (chroma < 0 ? 7 : 0)) >> 3);
    return (int16_t)(least16(most16(eighth, -4), 3) + 4);
}

static void fill_bins(const cells_in_t *in, uint16_t bins[STEP])
{
    for (int32_t k = 0; k < STEP; k++) {
        const uint16_t twelfth = (uint16_t)((uint16_t)(in->light[k] * 171) >> 11);
        const uint16_t light = twelfth < 15 ? twelfth : 15;
        bins[k] = (uint16_t)(light << 6 | chroma_bin(in->reddish[k]) << 3 | chroma_bin(in->bluish[k]));
    }
}

/// Adds what distances from the room's tones say.
static void add_tones(const cells_in_t *in, const bslam_background_t *background, const int16_t *w,
                      int16_t row, int32_t sums[STEP])
{
    const bslam_tone_t wall = background->tone[BSLAM_ZONE_WALL];
    const bslam_tone_t floor = background->tone[BSLAM_ZONE_FLOOR];
    const bslam_tone_t ceiling = background->tone[BSLAM_ZONE_CEILING];
    int16_t walls[STEP], floors[STEP], ceilings[STEP];
    for (int32_t k = 0; k < STEP; k++) {
        const int16_t light = in->light[k], reddish = (int16_t)in->reddish[k],
                      bluish = (int16_t)in->bluish[k];
        const int16_t brighter = (int16_t)(light - wall.light);
        const int16_t red_off = apart(reddish, wall.reddish), blue_off = apart(bluish, wall.bluish);
        const int16_t to_wall = (int16_t)(apart(light, wall.light) + 2 * (red_off + blue_off));
        const int16_t to_floor = (int16_t)(apart(light, floor.light) +
                                           2 * (apart(reddish, floor.reddish) + apart(bluish, floor.bluish)));
        const int16_t to_ceiling =
            (int16_t)(apart(light, ceiling.light) +
                      2 * (apart(reddish, ceiling.reddish) + apart(bluish, ceiling.bluish)));
        walls[k] = least16(to_wall, DISTANCE_MAX);
        floors[k] = least16(to_floor, DISTANCE_MAX);
        ceilings[k] = least16(to_ceiling, DISTANCE_MAX);
        sums[k] += w[0] * most16(least16(brighter, LIGHT_MAX), -LIGHT_MAX) +
                   w[1] * least16(apart(light, wall.light), LIGHT_MAX) + w[2] * least16(red_off, CHROMA_MAX) +
                   w[3] * least16(blue_off, CHROMA_MAX);
    }
    for (int32_t k = 0; k < STEP; k++) {
        const int16_t nearest = least16(walls[k], least16(floors[k], ceilings[k]));
        const int16_t colour = (int16_t)(apart(in->reddish[k], 0) + apart(in->bluish[k], 0));
        sums[k] +=
            w[4] * floors[k] + w[5] * ceilings[k] + w[6] * nearest + w[15] * least16(colour, DISTANCE_MAX);
    }
    for (int32_t k = 0; k < STEP; k++) {
        const int16_t brighter = (int16_t)(in->light[k] - wall.light);
        const int16_t darker = least16(most16(brighter, -LIGHT_MAX), 0);
        const int16_t is_above = in->floor_row[k] >= row ? -1 : 0;
        sums[k] += w[20] * (int16_t)(walls[k] & is_above) + w[21] * (int16_t)(darker & is_above);
    }
}

/// Adds what texture and the place above the floor say.
static void add_place(const cells_in_t *in, const int16_t *w, int16_t row, int32_t sums[STEP])
{
    for (int32_t k = 0; k < STEP; k++) {
        const int16_t above = (int16_t)(in->floor_row[k] - row);
        sums[k] += w[12] * least16(in->spread[k], CHROMA_MAX) + w[13] * least16(in->step_x[k], DISTANCE_MAX) +
                   w[14] * least16(in->step_y[k], DISTANCE_MAX) + w[16] * least16(most16(above, -8), 40) +
                   w[17] * least16(most16(above, -3), 3);
    }
}

static void finish(const int32_t *restrict sums, int8_t *restrict values)
{
    int16_t whole[STEP];
    for (int32_t k = 0; k < STEP; k++) {
        whole[k] = (int16_t)clamp(sums[k] / (1 << BSLAM_CELL_WEIGHT_SHIFT), -127, 127);
    }
    for (int32_t k = 0; k < STEP; k++) {
        values[k] = (int8_t)whole[k];
    }
}

void bslam_cells_decide(const bslam_view_t *view, const bslam_cell_machine_t *machine,
                        bslam_cell_tables_t *tables, uint16_t *frequent, int8_t *values)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    const int32_t horizon = bslam_horizon_row(view->camera);
    const int16_t *w = machine->weights;
    fill_tables(view->background, w, tables);
    for (int32_t row = 0; row < rows; row++) {
        const int32_t up = clamp(horizon - row, -30, 30);
        const int32_t of_row = machine->bias + w[18] * up + w[19] * most(up, 0);
        for (int32_t column = 0; column < columns; column += STEP) {
            const int32_t i = row * columns + column;  // a step may end in the next row, which comes later
            const cells_in_t in = {
                view->tones->light + i,        view->tones->reddish + i, view->tones->bluish + i,
                view->tones->spread + i,       view->step_x + i,         view->step_y + i,
                view->floor_line->row + column};
            uint16_t bins[STEP];
            int32_t sums[STEP];
            fill_bins(&in, bins);
            for (int32_t k = 0; k < STEP; k++) {
                sums[k] = of_row + tables->sums[bins[k]];
                frequent[i + k] = tables->frequent[bins[k]];
            }
            add_tones(&in, view->background, w, (int16_t)row, sums);
            add_place(&in, w, (int16_t)row, sums);
            finish(sums, values + i);
        }
    }
}
