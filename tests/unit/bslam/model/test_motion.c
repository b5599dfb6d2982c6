#include "support.h"

#include <math.h>

#include "bslam/model/motion.h"

/// Arguments of the model in a test: x, y, theta, forward, turn.
enum { X, Y, THETA, FORWARD, TURN, ARGUMENTS };

// ---- the model again, in double, from its definition ------------------------------------------------------

/// Equation (2) of the paper.
static void euler(const double *in, double *out, const void *context)
{
    (void)context;
    out[X] = in[X] + in[FORWARD] * cos(in[THETA]);
    out[Y] = in[Y] + in[FORWARD] * sin(in[THETA]);
    out[THETA] = in[THETA] + in[TURN];
}

/// The way in the mean direction over the turn.
static void arc(const double *in, double *out, const void *context)
{
    (void)context;
    double c;
    double s;
    unit_mean_direction(in[THETA], in[TURN], &c, &s);
    out[X] = in[X] + in[FORWARD] * c;
    out[Y] = in[Y] + in[FORWARD] * s;
    out[THETA] = in[THETA] + in[TURN];
}

static const unit_function_t models[] = {[BSLAM_MOTION_EULER] = euler, [BSLAM_MOTION_ARC] = arc};

// ---- comparison -------------------------------------------------------------------------------------------

static bslam_pose_t step(bslam_motion_kind_t kind, const double *in, bslam_motion_jacobian_t *jacobian)
{
    const bslam_pose_t pose = {real(in[X]), real(in[Y]), real(in[THETA])};
    return bslam_motion_step(kind, &pose, real(in[FORWARD]), real(in[TURN]), jacobian);
}

/// Makes the inputs what the C function gets: numbers of the scalar type.
static void round_inputs(double *in)
{
    for (int i = 0; i < ARGUMENTS; i++) {
        in[i] = (double)real(in[i]);
    }
}

static void assert_step_is_the_model(bslam_motion_kind_t kind, double *in)
{
    round_inputs(in);
    bslam_motion_jacobian_t jacobian;
    const bslam_pose_t after = step(kind, in, &jacobian);
    double expected[3];
    models[kind](in, expected, NULL);
    // Roundings of the position and of the way; the model's quadrature.
    const double tolerance = 1e-12 + 8 * UNIT_ROUNDING * (10 + fabs(in[FORWARD]));
    assert_near(after.x_m, expected[X], tolerance);
    assert_near(after.y_m, expected[Y], tolerance);
    assert_near(unit_angle_between((double)after.theta_rad, expected[THETA]), 0, 16 * UNIT_ROUNDING);
    assert_true(fabs((double)after.theta_rad) < 3.14160);
}

static void assert_jacobian_is_the_models(bslam_motion_kind_t kind, double *in)
{
    round_inputs(in);
    bslam_motion_jacobian_t jacobian;
    (void)step(kind, in, &jacobian);
    const struct {
        double value;
        int row;
        int column;
    } cases[] = {
        {(double)jacobian.x_theta, X, THETA},     {(double)jacobian.y_theta, Y, THETA},
        {(double)jacobian.x_forward, X, FORWARD}, {(double)jacobian.y_forward, Y, FORWARD},
        {(double)jacobian.x_turn, X, TURN},       {(double)jacobian.y_turn, Y, TURN},
    };
    // The finite differences; sinc's slope loses a digit to cancellation where its series ends.
    const double tolerance = 1e-9 + 40 * UNIT_ROUNDING * (1 + fabs(in[FORWARD]));
    for (int i = 0; i < COUNT_OF(cases); i++) {
        assert_near(cases[i].value,
                    unit_derivative(models[kind], in, ARGUMENTS, cases[i].row, cases[i].column, NULL),
                    tolerance);
    }
}

/// Calls `check` with random poses and ways, and with turns of every size up to 3 rad.
static void for_many_motions(bslam_motion_kind_t kind, void (*check)(bslam_motion_kind_t, double *))
{
    // sinc's series ends at turn / 2 = 0.2.
    static const double turns[] = {0, 1e-9, 1e-4, 0.01, 0.3, 0.39999, 0.4, 0.40001, 1, 2, 3};
    unit_random_t random = {1};
    for (int i = 0; i < COUNT_OF(turns); i++) {
        for (int k = 0; k < 40; k++) {
            const double sign = k % 2 == 0 ? 1 : -1;
            double in[ARGUMENTS] = {unit_random(&random, -10, 10), unit_random(&random, -10, 10),
                                    unit_random(&random, -3.14159, 3.14159), unit_random(&random, -2, 2),
                                    sign * turns[i]};
            check(kind, in);
        }
    }
}

static void test_step_euler_is_equation_2(void **state)
{
    for_many_motions(BSLAM_MOTION_EULER, assert_step_is_the_model);
}

static void test_step_arc_is_the_integral_over_the_turn(void **state)
{
    for_many_motions(BSLAM_MOTION_ARC, assert_step_is_the_model);
}

static void test_step_euler_jacobian_is_that_of_finite_differences(void **state)
{
    for_many_motions(BSLAM_MOTION_EULER, assert_jacobian_is_the_models);
}

static void test_step_arc_jacobian_is_that_of_finite_differences(void **state)
{
    for_many_motions(BSLAM_MOTION_ARC, assert_jacobian_is_the_models);
}

// ---- properties -------------------------------------------------------------------------------------------

static void test_step_arc_is_the_limit_of_many_euler_steps(void **state)
{
    static const double turns[] = {-2.5, -0.3, 0, 0.05, 1.5};
    const double forward = 1.5;
    const int steps = 20000;
    for (int i = 0; i < COUNT_OF(turns); i++) {
        double in[ARGUMENTS] = {1, 2, 0.7, forward, turns[i]};
        bslam_motion_jacobian_t jacobian;
        const bslam_pose_t after = step(BSLAM_MOTION_ARC, in, &jacobian);
        double pose[ARGUMENTS] = {1, 2, 0.7, forward / steps, turns[i] / steps};
        for (int k = 0; k < steps; k++) {
            double next[3];
            euler(pose, next, NULL);
            memcpy(pose, next, sizeof next);
        }
        // Euler lags by half a step's turn: forward * |turn| / (2 steps); and some roundings of 3 m.
        const double tolerance = forward * fabs(turns[i]) / (2 * steps) * 1.01 + 1e-10 + 40 * UNIT_ROUNDING;
        assert_near(after.x_m, pose[X], tolerance);
        assert_near(after.y_m, pose[Y], tolerance);
    }
}

static void test_step_arc_straight_ahead_is_euler_to_the_bit(void **state)
{
    const double in[ARGUMENTS] = {1, -2, 0.3, 0.7, 0};
    bslam_motion_jacobian_t arc_jacobian;
    bslam_motion_jacobian_t euler_jacobian;
    const bslam_pose_t by_arc = step(BSLAM_MOTION_ARC, in, &arc_jacobian);
    const bslam_pose_t by_euler = step(BSLAM_MOTION_EULER, in, &euler_jacobian);
    assert_memory_equal(&by_arc, &by_euler, sizeof by_arc);
}

static void test_step_without_motion_changes_no_bit(void **state)
{
    const double in[ARGUMENTS] = {1, -2, 0.3, 0, 0};
    for (int kind = 0; kind < COUNT_OF(models); kind++) {
        bslam_motion_jacobian_t jacobian;
        const bslam_pose_t after = step((bslam_motion_kind_t)kind, in, &jacobian);
        assert_true(after.x_m == real(in[X]) && after.y_m == real(in[Y]) &&
                    after.theta_rad == real(in[THETA]));
    }
}

static void test_step_arc_and_back_returns(void **state)
{
    unit_random_t random = {2};
    for (int i = 0; i < 500; i++) {
        const bslam_pose_t start = {1, 2, real(unit_random(&random, -3, 3))};
        const bslam_real_t forward = real(unit_random(&random, -2, 2));
        const bslam_real_t turn = real(unit_random(&random, -3, 3));
        bslam_motion_jacobian_t jacobian;
        const bslam_pose_t there = bslam_motion_step(BSLAM_MOTION_ARC, &start, forward, turn, &jacobian);
        const bslam_pose_t back = bslam_motion_step(BSLAM_MOTION_ARC, &there, -forward, -turn, &jacobian);
        assert_near(back.x_m, start.x_m, 100 * UNIT_ROUNDING);
        assert_near(back.y_m, start.y_m, 100 * UNIT_ROUNDING);
        assert_near(unit_angle_between((double)back.theta_rad, (double)start.theta_rad), 0,
                    50 * UNIT_ROUNDING);
    }
}

static void test_step_heading_beyond_pi_is_wrapped(void **state)
{
    for (int kind = 0; kind < COUNT_OF(models); kind++) {
        const double in[ARGUMENTS] = {0, 0, 3, 0.1, 0.5};
        bslam_motion_jacobian_t jacobian;
        const bslam_pose_t after = step((bslam_motion_kind_t)kind, in, &jacobian);
        assert_near(after.theta_rad, 3.5 - 6.283185307179586, 16 * UNIT_ROUNDING);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_step_euler_is_equation_2),
        cmocka_unit_test(test_step_arc_is_the_integral_over_the_turn),
        cmocka_unit_test(test_step_euler_jacobian_is_that_of_finite_differences),
        cmocka_unit_test(test_step_arc_jacobian_is_that_of_finite_differences),
        cmocka_unit_test(test_step_arc_is_the_limit_of_many_euler_steps),
        cmocka_unit_test(test_step_arc_straight_ahead_is_euler_to_the_bit),
        cmocka_unit_test(test_step_without_motion_changes_no_bit),
        cmocka_unit_test(test_step_arc_and_back_returns),
        cmocka_unit_test(test_step_heading_beyond_pi_is_wrapped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
