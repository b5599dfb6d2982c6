#include "support.h"

#include <math.h>

#include "bslam/slam/history.h"

#define STEP_US 40000
#define FORWARD_M 0.02
#define TURN_RAD 0.05

/// A few roundings of a way of less than 2 m.
#define WAY_ERROR (64 * UNIT_ROUNDING)

/// Steps of one arc, the last of which ends at steps * STEP_US.
static bslam_history_t arc(int steps)
{
    bslam_history_t history = {0};
    const bslam_motion_t moved = {
        .dt_s = real(STEP_US * 1e-6), .forward_m = real(FORWARD_M), .turn_rad = real(TURN_RAD)};
    for (int i = 1; i <= steps; i++) {
        bslam_history_add(&history, (int64_t)i * STEP_US, &moved);
    }
    return history;
}

static bslam_params_t arc_params(void)
{
    bslam_params_t params = unit_params();
    params.motion = 1;
    return params;
}

/// A point `steps` along the circle that arc() drives, behind (negative) or ahead of the robot.
static void assert_on_circle(const bslam_pose_t *pose, double steps)
{
    const double radius_m = FORWARD_M / TURN_RAD;
    const double angle_rad = steps * TURN_RAD;
    assert_near(pose->x_m, radius_m * sin(angle_rad), WAY_ERROR);
    assert_near(pose->y_m, radius_m * (1 - cos(angle_rad)), WAY_ERROR);
    assert_near(pose->theta_rad, angle_rad, WAY_ERROR);
}

static void test_relative_pose_now_is_the_identity(void **state)
{
    const bslam_history_t history = arc(3);
    const bslam_params_t params = arc_params();
    bslam_pose_t pose;
    assert_int_equal(bslam_history_relative_pose(&history, &params, 3 * STEP_US, 3 * STEP_US, &pose),
                     BSLAM_OK);
    assert_true(pose.x_m == 0 && pose.y_m == 0 && pose.theta_rad == 0);
}

static void test_relative_pose_within_the_history_is_on_the_arc(void **state)
{
    const int steps = BSLAM_HISTORY_MAX;
    const bslam_history_t history = arc(steps);
    const bslam_params_t params = arc_params();
    const int64_t now_us = (int64_t)steps * STEP_US;
    for (int quarter = 1; quarter <= 4 * steps; quarter++) {
        bslam_pose_t pose;
        const int64_t time_us = now_us - (int64_t)quarter * STEP_US / 4;
        assert_int_equal(bslam_history_relative_pose(&history, &params, now_us, time_us, &pose), BSLAM_OK);
        assert_on_circle(&pose, -quarter / 4.0);
    }
}

static void test_relative_pose_ahead_goes_on_up_to_its_limit(void **state)
{
    const bslam_history_t history = arc(2);
    bslam_params_t params = arc_params();
    params.ahead_max_us = STEP_US / 2;
    bslam_pose_t pose;
    const int64_t now_us = 2 * STEP_US;
    assert_int_equal(bslam_history_relative_pose(&history, &params, now_us, now_us + STEP_US / 2, &pose),
                     BSLAM_OK);
    assert_on_circle(&pose, 0.5);
    const bslam_pose_t before = pose;
    assert_int_equal(bslam_history_relative_pose(&history, &params, now_us, now_us + STEP_US / 2 + 1, &pose),
                     BSLAM_E_TIME);
    assert_memory_equal(&pose, &before, sizeof pose);
}

static void test_relative_pose_before_the_history_is_refused(void **state)
{
    // One more than fits: the first is forgotten.
    const int steps = BSLAM_HISTORY_MAX + 1;
    const bslam_history_t history = arc(steps);
    const bslam_params_t params = arc_params();
    const int64_t now_us = (int64_t)steps * STEP_US;
    bslam_pose_t pose = {1, 2, 3};
    assert_int_equal(bslam_history_relative_pose(&history, &params, now_us, STEP_US - 1, &pose),
                     BSLAM_E_TIME);
    assert_true(pose.x_m == 1 && pose.y_m == 2 && pose.theta_rad == 3);
    assert_int_equal(bslam_history_relative_pose(&history, &params, now_us, STEP_US, &pose), BSLAM_OK);
}

static void test_clear_forgets_all(void **state)
{
    bslam_history_t history = arc(3);
    const bslam_params_t params = arc_params();
    bslam_history_clear(&history);
    bslam_pose_t pose;
    assert_int_equal(bslam_history_relative_pose(&history, &params, 3 * STEP_US, 3 * STEP_US - 1, &pose),
                     BSLAM_E_TIME);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_relative_pose_now_is_the_identity),
        cmocka_unit_test(test_relative_pose_within_the_history_is_on_the_arc),
        cmocka_unit_test(test_relative_pose_ahead_goes_on_up_to_its_limit),
        cmocka_unit_test(test_relative_pose_before_the_history_is_refused),
        cmocka_unit_test(test_clear_forgets_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
