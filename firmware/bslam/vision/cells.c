#include "bslam/vision/cells.h"

#include <stddef.h>

/// Limits of the features: beyond them a difference says no more.
#define LIGHT_MAX 96
#define CHROMA_MAX 64
#define DISTANCE_MAX 128
#define OFTEN 32
#define SELDOM 6

/// Three distances in a word, ten bits each; none of the three parts of one is above 255, so no sum runs
/// over.
#define DISTANCE_BITS 10
#define DISTANCE_MASK 1023

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

/// Difference of two cells' colours; green counts twice.
static uint8_t colour_step(bslam_cell_t a, bslam_cell_t b)
{
    const int32_t step =
        magnitude(a.red - b.red) + 2 * magnitude(a.green - b.green) + magnitude(a.blue - b.blue);
    return (uint8_t)least(step, 255);
}

void bslam_cells_step(const bslam_view_t *view, uint8_t *step_x, uint8_t *step_y)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    const bslam_cell_t *cells = view->frame->cells;
    for (int32_t row = 0; row < rows; row++) {
        const int32_t up = row > 0 ? columns : 0, down = row + 1 < rows ? columns : 0;
        for (int32_t column = 0; column < columns; column++) {
            const int32_t i = row * columns + column;
            const int32_t left = column > 0 ? 1 : 0, right = column + 1 < columns ? 1 : 0;
            step_x[i] = colour_step(cells[i - left], cells[i + right]);
            step_y[i] = colour_step(cells[i - up], cells[i + down]);
        }
    }
}

void bslam_cell_features(const bslam_view_t *view, int32_t row, int32_t column,
                         int16_t features[BSLAM_CELL_FEATURES])
{
    const int32_t columns = view->frame->columns;
    const int32_t i = row * columns + column;
    const bslam_tone_t tone = view->tones[i];
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

/// What the rows above floor and horizon add.
static int32_t place_sum(const int16_t *weights, int32_t above_floor, int32_t above_horizon)
{
    const int32_t up = clamp(above_horizon, -30, 30);
    return weights[16] * clamp(above_floor, -8, 40) + weights[17] * clamp(above_floor, -3, 3) +
           weights[18] * up + weights[19] * most(up, 0);
}

/// Packs how far a value is from wall's, floor's and ceiling's.
static uint32_t pack_distances(int32_t wall, int32_t floor, int32_t ceiling)
{
    return (uint32_t)least(wall, 255) | (uint32_t)least(floor, 255) << DISTANCE_BITS |
           (uint32_t)least(ceiling, 255) << 2 * DISTANCE_BITS;
}

static void fill_bins(const bslam_background_t *background, const int16_t *weights, int32_t *bins)
{
    for (int32_t bin = 0; bin < BSLAM_TONE_BINS; bin++) {
        const int32_t wall = background->counts[BSLAM_ZONE_WALL][bin];
        const int32_t floor = background->counts[BSLAM_ZONE_FLOOR][bin];
        const int32_t ceiling = background->counts[BSLAM_ZONE_CEILING][bin];
        bins[bin] = weights[7] * least(wall, OFTEN) + weights[8] * least(wall, SELDOM) +
                    weights[9] * least(floor, OFTEN) + weights[10] * least(floor, SELDOM) +
                    weights[11] * least(ceiling, OFTEN);
    }
}

static void fill_tables(const bslam_view_t *view, const int16_t *weights, bslam_cell_tables_t *tables)
{
    const bslam_tone_t wall = view->background->tone[BSLAM_ZONE_WALL];
    const bslam_tone_t floor = view->background->tone[BSLAM_ZONE_FLOOR];
    const bslam_tone_t ceiling = view->background->tone[BSLAM_ZONE_CEILING];
    for (int32_t i = 0; i < 256; i++) {
        const int32_t chroma = i < 128 ? i : i - 256;  // reddish and bluish are signed bytes
        const int32_t light = i - wall.light;
        const bslam_tone_t of_light = {.light = (uint8_t)i};
        const bslam_tone_t of_red = {.reddish = (int8_t)chroma}, of_blue = {.bluish = (int8_t)chroma};
        const bslam_tone_t none = {0};
        tables->light[i] = (bslam_tone_part_t){
            .distances =
                pack_distances(magnitude(light), magnitude(i - floor.light), magnitude(i - ceiling.light)),
            .sum = weights[0] * clamp(light, -LIGHT_MAX, LIGHT_MAX) +
                   weights[1] * least(magnitude(light), LIGHT_MAX),
            .sum_above_floor = weights[21] * clamp(light, -LIGHT_MAX, 0),
            .bin = (uint16_t)(bslam_tone_bin(of_light) - bslam_tone_bin(none)),
        };
        tables->reddish[i] = (bslam_tone_part_t){
            .distances =
                pack_distances(2 * magnitude(chroma - wall.reddish), 2 * magnitude(chroma - floor.reddish),
                               2 * magnitude(chroma - ceiling.reddish)),
            .sum = weights[2] * least(magnitude(chroma - wall.reddish), CHROMA_MAX),
            .bin = (uint16_t)bslam_tone_bin(of_red),
        };
        tables->bluish[i] = (bslam_tone_part_t){
            .distances =
                pack_distances(2 * magnitude(chroma - wall.bluish), 2 * magnitude(chroma - floor.bluish),
                               2 * magnitude(chroma - ceiling.bluish)),
            .sum = weights[3] * least(magnitude(chroma - wall.bluish), CHROMA_MAX),
            .bin = (uint16_t)(bslam_tone_bin(of_blue) - bslam_tone_bin(none)),
        };
    }
    fill_bins(view->background, weights, tables->bins);
}

/// What a cell's tone adds; the bins of its parts add up to its own.
static int32_t tone_sum(const bslam_cell_tables_t *tables, const int16_t *weights, bslam_tone_t tone,
                        bool is_above_floor)
{
    const bslam_tone_part_t *light = &tables->light[tone.light];
    const bslam_tone_part_t *reddish = &tables->reddish[(uint8_t)tone.reddish];
    const bslam_tone_part_t *bluish = &tables->bluish[(uint8_t)tone.bluish];
    const uint32_t distances = light->distances + reddish->distances + bluish->distances;
    const int32_t wall = least((int32_t)(distances & DISTANCE_MASK), DISTANCE_MAX);
    const int32_t floor = least((int32_t)(distances >> DISTANCE_BITS & DISTANCE_MASK), DISTANCE_MAX);
    const int32_t ceiling = least((int32_t)(distances >> 2 * DISTANCE_BITS), DISTANCE_MAX);
    const uint16_t bin = (uint16_t)(light->bin + reddish->bin + bluish->bin);
    int32_t sum = light->sum + reddish->sum + bluish->sum + tables->bins[bin];
    sum += weights[4] * floor + weights[5] * ceiling + weights[6] * least(wall, least(floor, ceiling));
    sum += weights[15] * least(magnitude(tone.reddish) + magnitude(tone.bluish), DISTANCE_MAX);
    return is_above_floor ? sum + weights[20] * wall + light->sum_above_floor : sum;
}

void bslam_cells_decide(const bslam_view_t *view, const bslam_cell_machine_t *machine,
                        bslam_cell_tables_t *tables, int8_t *values)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    const int32_t horizon = bslam_horizon_row(view->camera);
    const int16_t *weights = machine->weights;
    fill_tables(view, weights, tables);
    for (int32_t row = 0; row < rows; row++) {
        for (int32_t column = 0; column < columns; column++) {
            const int32_t i = row * columns + column;
            const bslam_tone_t tone = view->tones[i];
            const int32_t above_floor = view->floor_line->row[column] - row;
            int32_t sum = machine->bias + place_sum(weights, above_floor, horizon - row);
            sum += tone_sum(tables, weights, tone, above_floor >= 0);
            sum += weights[12] * least(tone.spread, CHROMA_MAX) +
                   weights[13] * least(view->step_x[i], DISTANCE_MAX) +
                   weights[14] * least(view->step_y[i], DISTANCE_MAX);
            values[i] = (int8_t)clamp(sum / (1 << BSLAM_CELL_WEIGHT_SHIFT), -127, 127);
        }
    }
}
