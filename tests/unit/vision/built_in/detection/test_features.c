#include "support.h"

#include <math.h>

#include "made_view.h"

#include "vision/built_in/detection/features.h"

#define WALL_M 3.0f

/// Features by place in the vector.
enum { LOG_WIDTH = 0, BOTTOM_M = 2, TOP_M = 3, LOG_ASPECT = 4, RELATIVE_HEIGHT = 80, LOG_FOOT_WIDTH = 81 };

static made_view_t made, mirrored;
static float x[BSLAM_BLOB_FEATURES], y[BSLAM_BLOB_FEATURES];

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

/// Heights above the floor, at the wall, of the edge above a row of cells.
static double height_m(int row)
{
    return (double)MADE_CAMERA_M +
           (double)WALL_M * ((double)MADE_HORIZON_PX - (4 * row - 0.5)) / (double)MADE_FOCAL_PX;
}

static void test_features_sizes_are_metres_at_the_wall(void **state)
{
    unit_made_view(&made, WALL_M);
    const bslam_proposal_t proposal = box(35, 20, 45, 32);  // its middle is the camera's axis
    bslam_blob_features(&made.view, &proposal, x);
    const double top_m = height_m(20), bottom_m = height_m(32), width_m = 40 * 3.0 / 280.0;
    assert_near(x[BSLAM_BLOB_LOG_HEIGHT], log(top_m - bottom_m), 0.015);
    assert_near(x[LOG_WIDTH], log(width_m), 0.02);
    assert_near(x[BOTTOM_M], bottom_m, 1e-3);
    assert_near(x[TOP_M], top_m, 1e-3);
    assert_near(x[LOG_ASPECT], log(48.0 / 40.0), 0.015);
    assert_near(x[BSLAM_BLOB_PER_METRE], 1.0 / 3.0, 1e-5);
    assert_near(x[RELATIVE_HEIGHT], ((top_m + bottom_m) / 2 - (double)MADE_CAMERA_M) / (top_m - bottom_m),
                1e-3);
}

static void test_features_by_horizon_and_foot_need_no_floor_line(void **state)
{
    const bslam_proposal_t proposal = box(35, 20, 45, 41);  // stands 0.5 * 280 / 44 = 3.18 m away
    unit_made_view(&made, WALL_M);
    bslam_blob_features(&made.view, &proposal, x);
    unit_made_view(&mirrored, 1.0f);
    bslam_blob_features(&mirrored.view, &proposal, y);
    assert_true(x[RELATIVE_HEIGHT] == y[RELATIVE_HEIGHT]);
    assert_true(x[LOG_FOOT_WIDTH] == y[LOG_FOOT_WIDTH]);
    assert_true(x[BSLAM_BLOB_LOG_HEIGHT] > y[BSLAM_BLOB_LOG_HEIGHT]);
    const double foot_m = (double)MADE_CAMERA_M * 280 / (4 * 41 - 0.5 - 119.5);
    assert_near(x[LOG_FOOT_WIDTH], log(foot_m * 40 / 280), 0.02);
}

/// A room has no left and right.
static void test_features_of_the_mirrored_picture_are_the_same(void **state)
{
    for (unsigned seed = 1; seed <= 20; seed++) {
        unit_random_t random = {seed};
        unit_made_view(&made, WALL_M);
        unit_made_view(&mirrored, WALL_M);
        for (int i = 0; i < MADE_CELLS; i++) {
            const int k = i - i % MADE_COLUMNS + MADE_COLUMNS - 1 - i % MADE_COLUMNS;
            made.tones.light[i] = (uint8_t)unit_random(&random, 0, 192);
            made.tones.reddish[i] = (int8_t)unit_random(&random, -60, 60);
            made.tones.bluish[i] = (int8_t)unit_random(&random, -60, 60);
            made.step_x[i] = (uint8_t)unit_random(&random, 0, 100);
            made.step_y[i] = (uint8_t)unit_random(&random, 0, 100);
            made.values[i] = (int8_t)unit_random(&random, -100, 100);
            mirrored.tones.light[k] = made.tones.light[i];
            mirrored.tones.reddish[k] = made.tones.reddish[i];
            mirrored.tones.bluish[k] = made.tones.bluish[i];
            mirrored.step_x[k] = made.step_x[i];
            mirrored.step_y[k] = made.step_y[i];
            mirrored.values[k] = made.values[i];
        }
        const bslam_proposal_t left = box(10, 20, 22, 35);
        const bslam_proposal_t right = box(MADE_COLUMNS - 22, 20, MADE_COLUMNS - 10, 35);
        bslam_blob_features(&made.view, &left, x);
        bslam_blob_features(&mirrored.view, &right, y);
        for (int k = 0; k < BSLAM_BLOB_FEATURES; k++) {
            assert_near(x[k], (double)y[k], 1e-3 * (1 + fabs((double)y[k])));
        }
    }
}

static void test_features_are_finite_without_anything_known(void **state)
{
    unit_made_view(&made, 0);
    const bslam_proposal_t boxes[] = {box(0, 0, 80, 60), box(0, 0, 2, 2), box(78, 58, 80, 60)};
    for (int i = 0; i < 3; i++) {
        bslam_blob_features(&made.view, &boxes[i], x);
        for (int k = 0; k < BSLAM_BLOB_FEATURES; k++) {
            assert_true(isfinite((double)x[k]));
        }
        assert_near(x[BSLAM_BLOB_PER_METRE], 0, 0);
    }
}

static void test_features_logarithm_is_one_to_a_hundredth(void **state)
{
    for (double value = 1e-4; value < 1e4; value *= 1.003) {
        assert_near(bslam_log((float)value), log(value), 0.01);
    }
    assert_near(bslam_log(0), log(1e-4), 0.01);
    assert_near(bslam_log(1e9f), log(1e4), 0.01);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_features_logarithm_is_one_to_a_hundredth),
        cmocka_unit_test(test_features_sizes_are_metres_at_the_wall),
        cmocka_unit_test(test_features_by_horizon_and_foot_need_no_floor_line),
        cmocka_unit_test(test_features_of_the_mirrored_picture_are_the_same),
        cmocka_unit_test(test_features_are_finite_without_anything_known),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
