#include "support.h"

#include <math.h>

#include "made_view.h"

#include "vision/built_in/detection/features.h"
#include "vision/built_in/detection/prefilter.h"

#define WALL_M 3.0f

/// Numbers by place in the vector; behind them all stand their squares.
enum {
    LOG_WIDTH,
    LOG_HEIGHT,
    BOTTOM_M,
    TOP_M,
    LOG_ASPECT,
    PER_METRE = 7,
    SIDE_STEP = 11,
    SIDE_SHARE,
    STEP_DIFFERENCE,
    LIGHT = 19,
    VALUE,
    BESIDE_VALUE,
    BESIDE_DIFFERENCE,
    ABOVE_VALUE,
    BELOW_VALUE,
    BESIDE_LIGHT,
    ABOVE_LIGHT,
    BELOW_LIGHT,
    NUMBERS = BSLAM_GLANCE_FEATURES / 2
};

static made_view_t made, mirrored;
static float x[BSLAM_GLANCE_FEATURES], y[BSLAM_GLANCE_FEATURES];

static bslam_proposal_t box(int16_t left, int16_t top, int16_t right, int16_t bottom)
{
    const bslam_proposal_t proposal = {
        .left = left,
        .top = top,
        .right = right,
        .bottom = bottom,
        .cells = (uint16_t)((right - left) * (bottom - top)),
        .box = {left * BSLAM_CELL_PX - BSLAM_R(0.5), top * BSLAM_CELL_PX - BSLAM_R(0.5),
                right * BSLAM_CELL_PX - BSLAM_R(0.5), bottom * BSLAM_CELL_PX - BSLAM_R(0.5)},
    };
    return proposal;
}

/// Cells of a rectangle get this light and value.
static void paint(made_view_t *view, bslam_proposal_t area, uint8_t light, int8_t value)
{
    for (int row = area.top; row < area.bottom; row++) {
        for (int column = area.left; column < area.right; column++) {
            view->tones.light[row * MADE_COLUMNS + column] = light;
            view->values[row * MADE_COLUMNS + column] = value;
        }
    }
}

static void test_glance_sizes_are_metres_at_the_wall(void **state)
{
    unit_made_view(&made, WALL_M);
    const bslam_proposal_t proposal = box(35, 20, 45, 32);
    bslam_box_prefilter(&made.view, &proposal, x);
    const double per_px = (double)WALL_M / (double)MADE_FOCAL_PX;
    const double top_m = (double)MADE_CAMERA_M + per_px * ((double)MADE_HORIZON_PX - (4 * 20 - 0.5));
    assert_near(x[LOG_WIDTH], log(40 * per_px), 0.03);
    assert_near(x[LOG_HEIGHT], log(48 * per_px), 0.03);
    assert_near(x[TOP_M], top_m, 1e-3);
    assert_near(x[BOTTOM_M], top_m - 48 * per_px, 1e-3);
    assert_near(x[LOG_ASPECT], log(48.0 / 40.0), 0.02);
    assert_near(x[PER_METRE], 1.0 / 3.0, 1e-5);
}

static void test_glance_looks_at_the_box_and_beside_it(void **state)
{
    unit_made_view(&made, WALL_M);
    const bslam_proposal_t all = box(0, 0, MADE_COLUMNS, MADE_ROWS), proposal = box(33, 20, 46, 33);
    paint(&made, all, 100, -20);
    const bslam_proposal_t sides[] = {box(20, 20, 33, 33), box(46, 20, 60, 33), box(33, 10, 46, 20),
                                      box(33, 33, 46, 50)};
    paint(&made, sides[0], 110, 10);
    paint(&made, sides[1], 90, 40);
    paint(&made, sides[2], 60, -60);
    paint(&made, sides[3], 170, -100);
    paint(&made, proposal, 130, 77);
    bslam_box_prefilter(&made.view, &proposal, x);
    const double wall = made.view.background->tone[BSLAM_ZONE_WALL].light;
    assert_near(x[LIGHT], 130 - wall, 1e-4);
    assert_near(x[VALUE], 77, 1e-4);
    assert_near(x[BESIDE_VALUE], 25, 1e-4);
    assert_near(x[BESIDE_DIFFERENCE], 30, 1e-4);
    assert_near(x[ABOVE_VALUE], -60, 1e-4);
    assert_near(x[BELOW_VALUE], -100, 1e-4);
    assert_near(x[BESIDE_LIGHT], 30, 1e-4);
    assert_near(x[ABOVE_LIGHT], 70, 1e-4);
    assert_near(x[BELOW_LIGHT], 40, 1e-4);
}

static void test_glance_sides_are_their_steps_and_count_so_much_at_most(void **state)
{
    unit_made_view(&made, WALL_M);
    const bslam_proposal_t proposal = box(30, 20, 40, 40);
    memset(made.step_x, 0, sizeof made.step_x);
    for (int row = 20; row < 40; row++) {
        made.step_x[row * MADE_COLUMNS + 30] = 200;
        made.step_x[row * MADE_COLUMNS + 39] = row < 30 ? 20 : 0;
    }
    bslam_box_prefilter(&made.view, &proposal, x);
    assert_near(x[SIDE_STEP], 0.5 * (BSLAM_EDGE_STEP_MAX + 10), 1e-4);
    assert_near(x[SIDE_SHARE], 0.75, 1e-6);
    assert_near(x[STEP_DIFFERENCE], BSLAM_EDGE_STEP_MAX - 10, 1e-4);
}

static void test_glance_ends_with_the_squares(void **state)
{
    unit_made_view(&made, WALL_M);
    const bslam_proposal_t proposal = box(10, 10, 21, 30);
    bslam_box_prefilter(&made.view, &proposal, x);
    for (int i = 0; i < NUMBERS; i++) {
        assert_true(x[NUMBERS + i] == x[i] * x[i]);
    }
}

/// A room has no left and right. The width is a multiple of six, so that the columns looked at mirror too.
static void test_glance_of_the_mirrored_picture_is_the_same(void **state)
{
    for (unsigned seed = 1; seed <= 20; seed++) {
        unit_random_t random = {seed};
        unit_made_view(&made, WALL_M);
        unit_made_view(&mirrored, WALL_M);
        for (int i = 0; i < MADE_CELLS; i++) {
            const int k = i - i % MADE_COLUMNS + MADE_COLUMNS - 1 - i % MADE_COLUMNS;
            mirrored.tones.light[k] = made.tones.light[i] = (uint8_t)unit_random(&random, 0, 192);
            mirrored.step_x[k] = made.step_x[i] = (uint8_t)unit_random(&random, 0, 100);
            mirrored.step_y[k] = made.step_y[i] = (uint8_t)unit_random(&random, 0, 100);
            mirrored.values[k] = made.values[i] = (int8_t)unit_random(&random, -100, 100);
        }
        const bslam_proposal_t left = box(10, 20, 22, 35);
        const bslam_proposal_t right = box(MADE_COLUMNS - 22, 20, MADE_COLUMNS - 10, 35);
        bslam_box_prefilter(&made.view, &left, x);
        bslam_box_prefilter(&mirrored.view, &right, y);
        for (int k = 0; k < BSLAM_GLANCE_FEATURES; k++) {
            assert_near(x[k], (double)y[k], 1e-3 * (1 + fabs((double)y[k])));
        }
    }
}

/// At the frame's edges it reads no cell outside, and has numbers where nothing is known.
static void test_glance_is_finite_at_the_edges(void **state)
{
    unit_made_view(&made, 0);
    const bslam_proposal_t boxes[] = {box(0, 0, MADE_COLUMNS, MADE_ROWS), box(0, 0, 1, 1),
                                      box(MADE_COLUMNS - 1, MADE_ROWS - 1, MADE_COLUMNS, MADE_ROWS)};
    for (int i = 0; i < COUNT_OF(boxes); i++) {
        bslam_box_prefilter(&made.view, &boxes[i], x);
        for (int k = 0; k < BSLAM_GLANCE_FEATURES; k++) {
            assert_true(isfinite((double)x[k]));
        }
        assert_near(x[PER_METRE], 0, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_glance_sizes_are_metres_at_the_wall),
        cmocka_unit_test(test_glance_looks_at_the_box_and_beside_it),
        cmocka_unit_test(test_glance_sides_are_their_steps_and_count_so_much_at_most),
        cmocka_unit_test(test_glance_ends_with_the_squares),
        cmocka_unit_test(test_glance_of_the_mirrored_picture_is_the_same),
        cmocka_unit_test(test_glance_is_finite_at_the_edges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
