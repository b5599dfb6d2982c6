#include "support.h"

#include "vision/built_in/detection/cells.h"

#define COLUMNS 20
#define ROWS 12
#define CELLS (COLUMNS * ROWS)

static bslam_cells_t cells;
static uint16_t half[4 * CELLS];
static bslam_tones_t tones;
static uint16_t frequent[BSLAM_CELLS_ROOM];
static uint8_t step_x[BSLAM_CELLS_ROOM];
static uint8_t step_y[BSLAM_CELLS_ROOM];
static int8_t values[BSLAM_CELLS_ROOM];
static bslam_background_t background;
static bslam_floor_line_t floor_line;
static bslam_cell_tables_t tables;
static bslam_channel_tables_t channels;

static const bslam_camera_t camera = {
    .lens = BSLAM_LENS_PINHOLE,
    .width_px = 4 * COLUMNS,
    .height_px = 4 * ROWS,
    .fx_px = 50,
    .fy_px = 50,
    .cx_px = 2 * COLUMNS,
    .cy_px = 20,
    .z_m = 1,
};
static const bslam_frame_t frame = {
    .width_px = 4 * COLUMNS,
    .height_px = 4 * ROWS,
    .columns = COLUMNS,
    .rows = ROWS,
    .cells = &cells,
    .half = half,
    .surroundings = &background.surroundings,
};
static const bslam_view_t view = {
    .frame = &frame,
    .camera = &camera,
    .background = &background,
    .floor_line = &floor_line,
    .tones = &tones,
    .frequent = frequent,
    .step_x = step_x,
    .step_y = step_y,
    .values = values,
};

static void set_cell(int i, bslam_cell_t cell)
{
    cells.red[i] = cell.red;
    cells.green[i] = cell.green;
    cells.blue[i] = cell.blue;
    cells.spread[i] = cell.spread;
}

/// Cells of any colour, a background that learned another such picture.
static void fill(unsigned seed)
{
    unit_random_t random = {seed};
    bslam_background_init(&background);
    for (int frames = 0; frames < 2; frames++) {
        for (int i = 0; i < CELLS; i++) {
            cells.red[i] = (uint8_t)unit_random(&random, 0, 249);
            cells.green[i] = (uint8_t)unit_random(&random, 0, 253);
            cells.blue[i] = (uint8_t)unit_random(&random, 0, 249);
            cells.spread[i] = (uint8_t)unit_random(&random, 0, 256);
        }
        bslam_background_tones(&frame, &tones);
        bslam_background_learn(&background, &frame, &camera, &tones);
    }
    bslam_background_floor_line(&background, &frame, &camera, &tones, &floor_line);
    bslam_cells_step(&view, step_x, step_y);
}

static void test_cells_decide_is_the_machine_on_the_features(void **state)
{
    for (unsigned seed = 1; seed <= 5; seed++) {
        unit_random_t random = {seed + 100};
        bslam_cell_machine_t machine;
        for (int k = 0; k < BSLAM_CELL_FEATURES; k++) {
            machine.weights[k] = (int16_t)unit_random(&random, -120, 120);
        }
        machine.bias = (int32_t)unit_random(&random, -20000, 20000);
        fill(seed);
        bslam_cells_decide(&view, &machine, &tables, &channels, frequent, values);
        int inner = 0;
        for (int i = 0; i < CELLS; i++) {
            int16_t x[BSLAM_CELL_FEATURES];
            int32_t sum = machine.bias;
            bslam_cell_features(&view, i / COLUMNS, i % COLUMNS, x);
            for (int k = 0; k < BSLAM_CELL_FEATURES; k++) {
                sum += machine.weights[k] * x[k];
            }
            const int32_t value = sum / (1 << BSLAM_CELL_WEIGHT_SHIFT);
            const int32_t expected = value < -127 ? -127 : value > 127 ? 127 : value;
            assert_int_equal(values[i], expected);
            inner += expected > -127 && expected < 127 ? 1 : 0;
        }
        assert_true(inner > CELLS / 2);
    }
}

static void test_cell_machine_takes_bytes_as_it_takes_floats(void **state)
{
    static const int8_t bytes[BSLAM_CELL_FEATURES] = {127, -127, 3, 0, -1};
    static const float scale = 0.002f, bias = -0.25f;
    float weights[BSLAM_CELL_FEATURES];
    for (int k = 0; k < BSLAM_CELL_FEATURES; k++) {
        weights[k] = (float)bytes[k] * scale;
    }
    const bslam_svm_t small = {
        .rows = 1, .features = BSLAM_CELL_FEATURES, .bytes = bytes, .byte_scale = &scale, .bias = &bias};
    const bslam_svm_t whole = {.rows = 1, .features = BSLAM_CELL_FEATURES, .weights = weights, .bias = &bias};
    const bslam_cell_machine_t a = bslam_cell_machine(&small), b = bslam_cell_machine(&whole);
    assert_memory_equal(a.weights, b.weights, sizeof a.weights);
    assert_int_equal(a.bias, b.bias);
    assert_int_equal(a.weights[0],
                     (int)(127 * 0.002 * BSLAM_CELL_VALUE_ONE * (1 << BSLAM_CELL_WEIGHT_SHIFT)));
    assert_int_equal(a.bias, -BSLAM_CELL_VALUE_ONE * (1 << BSLAM_CELL_WEIGHT_SHIFT) / 4);
}

static void test_cell_machine_of_any_finite_weights_is_bounded(void **state)
{
    float weights[BSLAM_CELL_FEATURES] = {1e12f, -1e12f};
    const float high = 1e12f, low = -1e12f;
    const bslam_svm_t up = {.rows = 1, .features = BSLAM_CELL_FEATURES, .weights = weights, .bias = &high};
    const bslam_svm_t down = {.rows = 1, .features = BSLAM_CELL_FEATURES, .weights = weights, .bias = &low};
    const bslam_cell_machine_t a = bslam_cell_machine(&up), b = bslam_cell_machine(&down);
    assert_int_equal(a.weights[0], 32767);
    assert_int_equal(a.weights[1], -32767);
    assert_int_equal(a.bias, -b.bias);
    // With it the sum over the largest features stays a whole number of 32 bits.
    assert_true((int64_t)a.bias + INT64_C(32767) * 255 * BSLAM_CELL_FEATURES < INT32_MAX);
}

static void test_cells_step_is_the_difference_of_the_neighbours(void **state)
{
    memset(&cells, 0, sizeof cells);
    set_cell(5 * COLUMNS + 7, (bslam_cell_t){.red = 10, .green = 20, .blue = 5});
    set_cell(2 * COLUMNS + 2, (bslam_cell_t){.red = 200, .green = 200, .blue = 200});
    bslam_cells_step(&view, step_x, step_y);
    assert_int_equal(step_x[5 * COLUMNS + 7], 0);
    assert_int_equal(step_x[5 * COLUMNS + 6], 10 + 2 * 20 + 5);
    assert_int_equal(step_x[5 * COLUMNS + 8], 55);
    assert_int_equal(step_y[4 * COLUMNS + 7], 55);
    assert_int_equal(step_y[6 * COLUMNS + 7], 55);
    assert_int_equal(step_y[2 * COLUMNS + 3], 0);
    assert_int_equal(step_x[2 * COLUMNS + 3], 255);
}

static void test_tone_more_light_shifts_light_and_leaves_chroma(void **state)
{
    set_cell(0, (bslam_cell_t){.red = 60, .green = 48, .blue = 36, .spread = 20});
    set_cell(1, (bslam_cell_t){.red = 124, .green = 100, .blue = 76, .spread = 42});  // v + 4 is doubled
    bslam_background_tones(&frame, &tones);
    assert_int_equal(tones.light[1] - tones.light[0], BSLAM_TONE_OCTAVE);
    assert_in_range(tones.reddish[1] - tones.reddish[0] + 1, 0, 2);
    assert_in_range(tones.bluish[1] - tones.bluish[0] + 1, 0, 2);
    assert_in_range(tones.spread[1] - tones.spread[0] + 3, 0, 6);
}

static void test_tone_bin_covers_every_tone_once(void **state)
{
    bslam_tone_t tone = {0};
    int last = -1;
    for (int light = 0; light < 256; light++) {
        tone.light = (uint8_t)light;
        const int bin = (int)bslam_tone_bin(tone) >> 6;
        assert_true(bin == (light < 192 ? light / 12 : 15) && bin >= last);
        last = bin;
    }
    for (int chroma = -128; chroma < 128; chroma++) {
        tone.reddish = (int8_t)chroma;
        tone.bluish = (int8_t)-chroma;
        const int reddish = chroma <= -32 ? 0 : chroma >= 24 ? 7 : chroma / 8 + 4;
        const int bluish = -tone.reddish >= 24 ? 7 : -tone.reddish <= -32 ? 0 : -tone.reddish / 8 + 4;
        assert_int_equal(bslam_tone_bin(tone) & 63, reddish << 3 | (chroma == -128 ? 0 : bluish));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cells_decide_is_the_machine_on_the_features),
        cmocka_unit_test(test_cell_machine_takes_bytes_as_it_takes_floats),
        cmocka_unit_test(test_cell_machine_of_any_finite_weights_is_bounded),
        cmocka_unit_test(test_cells_step_is_the_difference_of_the_neighbours),
        cmocka_unit_test(test_tone_more_light_shifts_light_and_leaves_chroma),
        cmocka_unit_test(test_tone_bin_covers_every_tone_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
