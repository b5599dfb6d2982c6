#include "support.h"

#include <math.h>

#include "bslam/model/odometry_history.h"
#include "plain_settings.h"

#define STEP_US 40000
#define FORWARD_M 0.02
#define TURN_RAD 0.05

/// A few roundings of a way of less than 2 m.
#define WAY_ERROR (64 * UNIT_ROUNDING)

/// What odometry says of one step.
static const bslam_motion_t step = {
    .dt_s = BSLAM_R(0.04),
    .forward_m = BSLAM_R(0.02),
    .turn_rad = BSLAM_R(0.05),
    .forward_var_m2 = BSLAM_R(4e-4),
    .turn_var_rad2 = BSLAM_R(9e-4),
    .forward_turn_cov_mrad = BSLAM_R(2e-4),
};

/// Steps of one arc, all of which wait.
static bslam_history_t waiting_arc(int steps)
{
    bslam_history_t history = {0};
    for (int i = 0; i < steps; i++) {
        bslam_history_add(&history, BSLAM_HISTORY_MAX, STEP_US, &step);
    }
    return history;
}

/// The filter goes on to until_us before the newest end, and takes each motion as odometry has it.
static void take_until(bslam_history_t *history, int64_t until_us)
{
    while (history->filter.behind_us > until_us) {
        bslam_history_place_t place = history->filter;
        const bslam_motion_t motion = bslam_history_walk(history, &place, until_us);
        bslam_history_take(history, &place, &motion);
    }
}

static bslam_settings_t arc_params(void)
{
    bslam_settings_t settings = unit_settings();
    settings.motion = 1;
    return settings;
}

/// A point `steps` along the circle that the arc drives, behind (negative) or ahead of the robot.
static void assert_on_circle(const bslam_pose_t *pose, double steps)
{
    const double radius_m = FORWARD_M / TURN_RAD;
    const double angle_rad = steps * TURN_RAD;
    assert_near(pose->x_m, radius_m * sin(angle_rad), WAY_ERROR);
    assert_near(pose->y_m, radius_m * (1 - cos(angle_rad)), WAY_ERROR);
    assert_near(pose->theta_rad, angle_rad, WAY_ERROR);
}

static void assert_share(const bslam_motion_t *motion, double share)
{
    assert_near(motion->dt_s, 0.04 * share, UNIT_ROUNDING);
    assert_near(motion->forward_m, FORWARD_M * share, UNIT_ROUNDING);
    assert_near(motion->turn_rad, TURN_RAD * share, UNIT_ROUNDING);
    assert_near(motion->forward_var_m2, 4e-4 * share, UNIT_ROUNDING * 1e-2);
    assert_near(motion->turn_var_rad2, 9e-4 * share, UNIT_ROUNDING * 1e-2);
    assert_near(motion->forward_turn_cov_mrad, 2e-4 * share, UNIT_ROUNDING * 1e-2);
}

static void test_walk_gives_whole_steps_to_the_bit(void **state)
{
    const bslam_history_t history = waiting_arc(3);
    bslam_history_place_t place = history.filter;
    assert_int_equal(place.behind_us, 3 * STEP_US);
    for (int left = 2; left >= 0; left--) {
        const bslam_motion_t motion = bslam_history_walk(&history, &place, 0);
        assert_true(motion.forward_m == step.forward_m && motion.turn_rad == step.turn_rad);
        assert_true(motion.forward_var_m2 == step.forward_var_m2);
        assert_true(motion.dt_s == (bslam_real_t)STEP_US * BSLAM_R(1e-6));
        assert_int_equal(place.waiting, left);
        assert_int_equal(place.behind_us, (int64_t)left * STEP_US);
    }
}

static void test_walk_to_a_moment_within_a_step_splits_it(void **state)
{
    const bslam_history_t history = waiting_arc(2);
    bslam_history_place_t place = history.filter;
    bslam_motion_t motion = bslam_history_walk(&history, &place, STEP_US + 30000);
    assert_share(&motion, 0.25);
    assert_int_equal(place.behind_us, STEP_US + 30000);
    motion = bslam_history_walk(&history, &place, STEP_US + 10000);
    assert_share(&motion, 0.5);
    // The rest of the step, and no more, however far on the moment is.
    motion = bslam_history_walk(&history, &place, 0);
    assert_share(&motion, 0.25);
    assert_int_equal(place.behind_us, STEP_US);
    assert_int_equal(place.gone_us, 0);
    motion = bslam_history_walk(&history, &place, 1);
    assert_int_equal(place.behind_us, 1);
    motion = bslam_history_walk(&history, &place, 0);
    assert_share(&motion, 1.0 / STEP_US);
    assert_int_equal(place.waiting, 0);
}

static void test_is_full_when_no_more_may_wait(void **state)
{
    bslam_history_t history = waiting_arc(BSLAM_HISTORY_MAX - 1);
    assert_false(history.filter.waiting >= BSLAM_HISTORY_MAX);
    bslam_history_add(&history, BSLAM_HISTORY_MAX, STEP_US, &step);
    assert_true(history.filter.waiting >= BSLAM_HISTORY_MAX);
    // Half of the oldest gone makes no room; all of it does.
    take_until(&history, (int64_t)BSLAM_HISTORY_MAX * STEP_US - STEP_US / 2);
    assert_true(history.filter.waiting >= BSLAM_HISTORY_MAX);
    take_until(&history, (int64_t)(BSLAM_HISTORY_MAX - 1) * STEP_US);
    assert_false(history.filter.waiting >= BSLAM_HISTORY_MAX);
}

static void test_look_back_from_the_filter_is_on_the_arc(void **state)
{
    const int steps = BSLAM_HISTORY_MAX;
    const bslam_settings_t settings = arc_params();
    // The filter at the newest end, and within a step.
    static const int64_t untils_us[] = {0, STEP_US / 4, 2 * STEP_US};
    for (int i = 0; i < COUNT_OF(untils_us); i++) {
        bslam_history_t history = waiting_arc(steps);
        take_until(&history, untils_us[i]);
        const int64_t reach_us = (int64_t)steps * STEP_US - untils_us[i];
        for (int64_t back_us = STEP_US / 8; back_us <= reach_us; back_us += STEP_US / 8) {
            bslam_history_view_t view;
            assert_int_equal(bslam_history_look_back(&history, &settings, back_us, &view), BSLAM_OK);
            assert_on_circle(&view.robot, -(double)back_us / STEP_US);
            // And as doubtful as so much of that many steps.
            const double share = (double)back_us / STEP_US;
            assert_near(view.forward_var_m2, share * (double)step.forward_var_m2, 1e-6 * share);
            assert_near(view.turn_var_rad2, share * (double)step.turn_var_rad2, 1e-6 * share);
        }
        bslam_history_view_t view = {{1, 2, 3}, 4, 5};
        assert_int_equal(bslam_history_look_back(&history, &settings, reach_us + 1, &view), BSLAM_E_TIME);
        assert_true(view.robot.x_m == 1 && view.robot.theta_rad == 3 && view.turn_var_rad2 == 5);
    }
}

static void test_look_back_follows_the_path_that_the_filter_took(void **state)
{
    const bslam_settings_t settings = arc_params();
    bslam_history_t history = waiting_arc(2);
    // Odometry says 2 cm; the filter took 1 cm for the first quarter, 5 cm for the rest, straight on.
    const bslam_motion_t quarter = {.dt_s = BSLAM_R(0.01), .forward_m = BSLAM_R(0.01)};
    const bslam_motion_t rest = {.dt_s = BSLAM_R(0.03), .forward_m = BSLAM_R(0.05)};
    bslam_history_place_t place = history.filter;
    (void)bslam_history_walk(&history, &place, STEP_US + 30000);
    bslam_history_take(&history, &place, &quarter);
    bslam_history_view_t view;
    assert_int_equal(bslam_history_look_back(&history, &settings, 5000, &view), BSLAM_OK);
    assert_near(view.robot.x_m, -0.005, WAY_ERROR);
    (void)bslam_history_walk(&history, &place, 0);
    bslam_history_take(&history, &place, &rest);
    assert_int_equal(bslam_history_look_back(&history, &settings, STEP_US, &view), BSLAM_OK);
    assert_near(view.robot.x_m, -0.06, WAY_ERROR);
    assert_near(view.robot.theta_rad, 0, WAY_ERROR);
}

static void test_look_back_before_the_history_is_refused(void **state)
{
    // One more than fits: the first is forgotten.
    bslam_history_t history = waiting_arc(BSLAM_HISTORY_MAX);
    take_until(&history, 0);
    bslam_history_add(&history, BSLAM_HISTORY_MAX, STEP_US, &step);
    const bslam_settings_t settings = arc_params();
    const int64_t reach_us = (int64_t)(BSLAM_HISTORY_MAX - 1) * STEP_US;
    bslam_history_view_t view;
    assert_int_equal(bslam_history_look_back(&history, &settings, reach_us + 1, &view), BSLAM_E_TIME);
    if (reach_us > 0) {
        assert_int_equal(bslam_history_look_back(&history, &settings, reach_us, &view), BSLAM_OK);
    }
}

static void test_look_ahead_goes_on_as_in_the_newest_motion(void **state)
{
    const bslam_settings_t settings = arc_params();
    bslam_history_t history = waiting_arc(2);
    take_until(&history, 0);
    const bslam_motion_t last = bslam_history_newest(&history);
    const bslam_pose_t pose = bslam_history_look_ahead(&settings, &last, STEP_US / 2);
    assert_on_circle(&pose, 0.5);
    // Nothing is known of a robot that has not moved yet.
    bslam_history_clear(&history);
    const bslam_motion_t none = bslam_history_newest(&history);
    const bslam_pose_t still = bslam_history_look_ahead(&settings, &none, STEP_US / 2);
    assert_true(still.x_m == 0 && still.y_m == 0 && still.theta_rad == 0);
}

static void test_clear_forgets_all(void **state)
{
    bslam_history_t history = waiting_arc(3);
    take_until(&history, STEP_US / 2);
    bslam_history_clear(&history);
    const bslam_settings_t settings = arc_params();
    bslam_history_view_t view;
    assert_int_equal(history.filter.behind_us, 0);
    assert_int_equal(bslam_history_look_back(&history, &settings, 1, &view), BSLAM_E_TIME);
    // Nothing of the step that was cut short is left in the next one.
    bslam_history_add(&history, BSLAM_HISTORY_MAX, STEP_US, &step);
    take_until(&history, 0);
    assert_int_equal(bslam_history_look_back(&history, &settings, STEP_US, &view), BSLAM_OK);
    assert_on_circle(&view.robot, -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_walk_gives_whole_steps_to_the_bit),
        cmocka_unit_test(test_walk_to_a_moment_within_a_step_splits_it),
        cmocka_unit_test(test_is_full_when_no_more_may_wait),
        cmocka_unit_test(test_look_back_from_the_filter_is_on_the_arc),
        cmocka_unit_test(test_look_back_follows_the_path_that_the_filter_took),
        cmocka_unit_test(test_look_back_before_the_history_is_refused),
        cmocka_unit_test(test_look_ahead_goes_on_as_in_the_newest_motion),
        cmocka_unit_test(test_clear_forgets_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
