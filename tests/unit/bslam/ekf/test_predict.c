#include "covariance.h"
#include "support.h"
#include "twin.h"

#include <math.h>

#include "bslam/model/motion.h"
#include "plain_settings.h"

/// In double the finite differences of the expected Jacobians limit the comparison; in float some hundred
/// roundings of numbers of order 1 (positions up to 10 m).
#define TOLERANCE (BSLAM_REAL_DOUBLE ? 1e-9 : 3e-5)

/// An increment with correlated noise.
static const bslam_motion_t motion = {
    .dt_s = BSLAM_R(0.04),
    .forward_m = BSLAM_R(0.05),
    .turn_rad = BSLAM_R(-0.08),
    .forward_var_m2 = BSLAM_R(4e-4),
    .turn_var_rad2 = BSLAM_R(9e-4),
    .forward_turn_cov_mrad = BSLAM_R(2e-4),
};

// ---- the motion again, in double, from its definition -----------------------------------------------------

/// What a step depends on: pose, two further states, and the errors of the increment.
enum { X, Y, THETA, FORWARD, TURN, FORWARD_ERROR, TURN_ERROR, ARGUMENTS };

typedef struct step {
    const bslam_settings_t *settings;
    double forward_m;
    double turn_rad;
    double dt_s;
} step_t;

static void move(const double *in, double *out, const void *context)
{
    const step_t *step = context;
    double forward = step->forward_m * (double)step->settings->forward_scale;
    double turn = step->turn_rad * (double)step->settings->turn_scale;
    if (step->settings->velocity_states != 0) {
        forward = in[FORWARD] * step->dt_s;
        turn = in[TURN] * step->dt_s;
    } else if (step->settings->scale_states != 0) {
        forward = in[FORWARD] * step->forward_m;
        turn = in[TURN] * step->turn_rad;
    }
    forward += in[FORWARD_ERROR];
    turn += in[TURN_ERROR];
    double c = cos(in[THETA]);
    double s = sin(in[THETA]);
    if (step->settings->motion == BSLAM_MOTION_ARC) {
        unit_mean_direction(in[THETA], turn, &c, &s);
    }
    out[X] = in[X] + forward * c;
    out[Y] = in[Y] + forward * s;
    out[THETA] = in[THETA] + turn;
}

/// Where the filter should arrive by equations (4) and (5), with Jacobians by finite differences. extra_var:
/// what the two further states walk by before the step; keep: what they keep of themselves.
static twin_t moved_by_textbook(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                const double keep[2], const double extra_var[2])
{
    twin_t twin = twin_of(ekf);
    dense_t f = dense_identity(ekf->dim);
    dense_t g = dense_zero(ekf->dim, 2);
    if (ekf->base_dim > 3) {
        for (int k = 0; k < 2; k++) {
            dense_t forget = dense_identity(ekf->dim);
            forget.at[FORWARD + k][FORWARD + k] = keep[k];
            twin.mean.at[FORWARD + k][0] *= keep[k];
            twin.covariance = dense_sandwich(&forget, &twin.covariance);
            twin.covariance.at[FORWARD + k][FORWARD + k] += extra_var[k];
        }
    }
    const step_t step = {settings, (double)motion.forward_m, (double)motion.turn_rad, (double)motion.dt_s};
    double in[ARGUMENTS] = {0};
    for (int i = 0; i < ekf->base_dim; i++) {
        in[i] = twin.mean.at[i][0];
    }
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < ekf->base_dim; column++) {
            f.at[row][column] = unit_derivative(move, in, ARGUMENTS, row, column, &step);
        }
        g.at[row][0] = unit_derivative(move, in, ARGUMENTS, row, FORWARD_ERROR, &step);
        g.at[row][1] = unit_derivative(move, in, ARGUMENTS, row, TURN_ERROR, &step);
    }
    double pose[3];
    move(in, pose, &step);
    for (int i = 0; i < 3; i++) {
        twin.mean.at[i][0] = pose[i];
    }
    twin.covariance = dense_sandwich(&f, &twin.covariance);
    if (settings->velocity_states == 0) {
        dense_t q = dense_zero(2, 2);
        q.at[0][0] = (double)motion.forward_var_m2;
        q.at[1][1] = (double)motion.turn_var_rad2;
        q.at[0][1] = q.at[1][0] = (double)motion.forward_turn_cov_mrad;
        const dense_t noise = dense_sandwich(&g, &q);
        twin.covariance = dense_sum(&twin.covariance, &noise);
    }
    return twin;
}

/// The speedometers as measurements of the two further states.
static void measure_velocity(const bslam_ekf_t *ekf, const bslam_settings_t *settings, twin_t *twin)
{
    const double dt = (double)motion.dt_s;
    dense_t h = dense_zero(2, ekf->dim);
    dense_t y = dense_zero(2, 1);
    dense_t r = dense_zero(2, 2);
    h.at[0][FORWARD] = h.at[1][TURN] = 1;
    const double v = (double)motion.forward_m * (double)settings->forward_scale / dt;
    const double omega = (double)motion.turn_rad * (double)settings->turn_scale / dt;
    y.at[0][0] = v - twin->mean.at[FORWARD][0];
    y.at[1][0] = omega - twin->mean.at[TURN][0];
    r.at[0][0] = (double)motion.forward_var_m2 / (dt * dt);
    r.at[1][1] = (double)motion.turn_var_rad2 / (dt * dt);
    r.at[0][1] = r.at[1][0] = (double)motion.forward_turn_cov_mrad / (dt * dt);
    twin_update(ekf, settings->filter, &h, &y, &r, twin);
}

static bslam_ekf_t random_filter(const bslam_settings_t *settings, unit_random_t *random)
{
    bslam_ekf_t ekf;
    twin_randomise(&ekf, settings, random, 3, 2);
    return ekf;
}

/// Both motion models and both filters, from several random states, `steps` in a row.
static void for_every_kind(bslam_settings_t settings, void (*check)(bslam_ekf_t *, const bslam_settings_t *))
{
    unit_random_t random = {1};
    for (settings.motion = 0; settings.motion <= 1; settings.motion++) {
        for (settings.filter = 0; settings.filter <= 1; settings.filter++) {
            for (int round = 0; round < 5; round++) {
                bslam_ekf_t ekf = random_filter(&settings, &random);
                for (int i = 0; i < 3; i++) {
                    check(&ekf, &settings);
                }
            }
        }
    }
}

/// Predicts, and the robot alone too: it must arrive where it does with the map.
static bslam_motion_t predict(bslam_ekf_t *ekf, const bslam_settings_t *settings)
{
    bslam_robot_t robot = bslam_ekf_robot(ekf);
    bslam_motion_t moved;
    bslam_motion_t moved_alone;
    bslam_ekf_predict(ekf, settings, &motion, &moved);
    bslam_robot_predict(&robot, settings, &motion, &moved_alone);
    const double rounding = 64 * UNIT_ROUNDING;
    assert_int_equal(robot.dim, ekf->base_dim);
    for (int i = 0; i < robot.dim; i++) {
        assert_near(robot.mean[i], ekf->mean[i], 10 * rounding);
        for (int j = 0; j <= i; j++) {
            assert_near(robot.covariance[i][j], bslam_ekf_covariance(ekf, i, j), rounding);
        }
    }
    const bslam_pose_t pose = bslam_pose_of(robot.mean);
    assert_true(pose.x_m == robot.mean[X] && pose.y_m == robot.mean[Y] &&
                pose.theta_rad == robot.mean[THETA]);
    assert_near(moved_alone.forward_m, moved.forward_m, rounding);
    assert_near(moved_alone.turn_rad, moved.turn_rad, rounding);
    assert_true(moved_alone.dt_s == moved.dt_s);
    return moved;
}

// ---- plain ------------------------------------------------------------------------------------------------

static void check_plain(bslam_ekf_t *ekf, const bslam_settings_t *settings)
{
    const double none[2] = {1, 0};
    const twin_t expected = moved_by_textbook(ekf, settings, none, none);
    const bslam_motion_t moved = predict(ekf, settings);
    twin_assert(ekf, &expected, TOLERANCE);
    assert_near(moved.forward_m, (double)motion.forward_m * (double)settings->forward_scale, UNIT_ROUNDING);
    assert_near(moved.turn_rad, (double)motion.turn_rad * (double)settings->turn_scale, UNIT_ROUNDING);
    assert_true(moved.dt_s == motion.dt_s);
}

static void test_predict_is_the_textbook_prediction(void **state)
{
    for_every_kind(unit_settings(), check_plain);
}

static void test_predict_with_constant_scales_is_the_textbook_prediction(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.forward_scale = BSLAM_R(1.1);
    settings.turn_scale = BSLAM_R(0.8);
    for_every_kind(settings, check_plain);
}

static void test_speeds_that_are_no_states_are_not_measured(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 0;
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    const bslam_ekf_t before = ekf;
    bslam_ekf_measure_speeds(&ekf, &settings, &motion);
    assert_memory_equal(&ekf, &before, sizeof ekf);
}

static void test_predict_moves_no_beacon(void **state)
{
    const bslam_settings_t settings = unit_settings();
    unit_random_t random = {2};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    const bslam_ekf_t before = ekf;
    (void)predict(&ekf, &settings);
    for (int i = 3; i < ekf.dim; i++) {
        assert_true(ekf.mean[i] == before.mean[i]);
        for (int j = 3; j <= i; j++) {
            assert_near(bslam_ekf_covariance(&ekf, i, j), bslam_ekf_covariance(&before, i, j),
                        8 * UNIT_ROUNDING);
        }
    }
}

static void test_predict_without_motion_and_noise_changes_no_value(void **state)
{
    const bslam_motion_t rest = {.dt_s = BSLAM_R(0.04)};
    const bslam_settings_t settings = unit_settings();
    unit_random_t random = {3};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    const twin_t expected = twin_of(&ekf);
    bslam_motion_t moved;
    bslam_ekf_predict(&ekf, &settings, &rest, &moved);
    twin_assert(&ekf, &expected, 0);
}

// ---- scale states -----------------------------------------------------------------------------------------

static void check_scales(bslam_ekf_t *ekf, const bslam_settings_t *settings)
{
    const double keep[2] = {1, 1};
    const double walk = 0.002 * 0.002 * (double)motion.dt_s;
    const double extra_var[2] = {walk, walk};
    const twin_t expected = moved_by_textbook(ekf, settings, keep, extra_var);
    const double forward_scale = (double)ekf->mean[FORWARD];
    const double turn_scale = (double)ekf->mean[TURN];
    const bslam_motion_t moved = predict(ekf, settings);
    twin_assert(ekf, &expected, TOLERANCE);
    assert_near(moved.forward_m, (double)motion.forward_m * forward_scale, UNIT_ROUNDING);
    assert_near(moved.turn_rad, (double)motion.turn_rad * turn_scale, UNIT_ROUNDING);
}

static void test_predict_with_scale_states_is_the_textbook_prediction(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.scale_states = 1;
    for_every_kind(settings, check_scales);
}

// ---- velocity states --------------------------------------------------------------------------------------

static void check_velocity(bslam_ekf_t *ekf, const bslam_settings_t *settings)
{
    const double dt = (double)motion.dt_s;
    const double keep[2] = {1 / (1 + dt / (double)settings->velocity_decay_s),
                            1 / (1 + dt / (double)settings->turn_rate_decay_s)};
    const double extra_var[2] = {0.2 * 0.2 * dt, 0.7 * 0.7 * dt};
    twin_t expected = moved_by_textbook(ekf, settings, keep, extra_var);
    measure_velocity(ekf, settings, &expected);
    const bslam_motion_t moved = predict(ekf, settings);
    twin_assert(ekf, &expected, TOLERANCE);
    assert_near(moved.forward_m, expected.mean.at[FORWARD][0] * dt, TOLERANCE);
    assert_near(moved.turn_rad, expected.mean.at[TURN][0] * dt, TOLERANCE);
}

static void test_predict_with_velocity_states_predicts_then_measures(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 1;
    for_every_kind(settings, check_velocity);
}

static void test_predict_with_velocity_states_and_constant_scales_measures_the_scaled_reading(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 1;
    settings.forward_scale = BSLAM_R(1.1);
    settings.turn_scale = BSLAM_R(0.8);
    for_every_kind(settings, check_velocity);
}

static void test_predict_with_velocity_states_that_never_decay_keeps_them(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 1;
    settings.velocity_decay_s = BSLAM_R(1e6);
    settings.turn_rate_decay_s = BSLAM_R(1e6);
    for_every_kind(settings, check_velocity);
}

static void
test_predict_with_velocity_states_and_indefinite_noise_is_refused_or_measures_nothing(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 1;
    unit_random_t random = {4};
    bslam_motion_t bad[3] = {motion, motion, motion};
    bad[0].forward_var_m2 = 0;
    bad[1].turn_var_rad2 = 0;
    bad[2].forward_turn_cov_mrad = 1;
    assert_int_equal(bslam_ekf_check_motion(&settings, &motion), BSLAM_OK);
    const double dt = (double)motion.dt_s;
    const double keep[2] = {1 / (1 + dt / (double)settings.velocity_decay_s),
                            1 / (1 + dt / (double)settings.turn_rate_decay_s)};
    const double extra_var[2] = {0.2 * 0.2 * dt, 0.7 * 0.7 * dt};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        assert_int_equal(bslam_ekf_check_motion(&settings, &bad[i]), BSLAM_E_SINGULAR);
        bslam_ekf_t ekf = random_filter(&settings, &random);
        bslam_robot_t robot = bslam_ekf_robot(&ekf);
        const twin_t expected = moved_by_textbook(&ekf, &settings, keep, extra_var);
        bslam_motion_t moved;
        bslam_ekf_predict(&ekf, &settings, &bad[i], &moved);
        twin_assert(&ekf, &expected, TOLERANCE);
        assert_near(moved.forward_m, expected.mean.at[FORWARD][0] * dt, TOLERANCE);
        bslam_robot_predict(&robot, &settings, &bad[i], &moved);
        assert_true(robot.mean[X] == ekf.mean[X] && robot.mean[FORWARD] == ekf.mean[FORWARD]);
    }
    settings.velocity_states = 0;
    assert_int_equal(bslam_ekf_check_motion(&settings, &bad[0]), BSLAM_OK);
}

// ---- interruptions ----------------------------------------------------------------------------------------

static void test_resume_adds_the_doubt_to_the_pose_alone(void **state)
{
    const bslam_settings_t settings = unit_settings();
    unit_random_t random = {5};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    twin_t expected = twin_of(&ekf);
    expected.covariance.at[X][X] += 4;
    expected.covariance.at[Y][Y] += 4;
    expected.covariance.at[THETA][THETA] += 0.25;
    bslam_ekf_resume(&ekf, &settings, 4, BSLAM_R(0.25));
    twin_assert(&ekf, &expected, 8 * UNIT_ROUNDING * 4);
}

static void test_resume_time_and_again_does_not_add_up_beyond_lost(void **state)
{
    const bslam_settings_t settings = unit_settings();
    unit_random_t random = {6};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    twin_t expected = twin_of(&ekf);
    for (int i = 0; i < 1000; i++) {
        bslam_ekf_resume(&ekf, &settings, 900, 10);
    }
    expected.covariance.at[X][X] = expected.covariance.at[Y][Y] = 30 * 30;
    expected.covariance.at[THETA][THETA] = 3.2 * 3.2;
    twin_assert(&ekf, &expected, 8 * UNIT_ROUNDING * 900);
    // What is more doubtful than that already stays so.
    covariance_forget(&ekf, X, 1000);
    bslam_ekf_resume(&ekf, &settings, 900, 10);
    assert_true(bslam_ekf_covariance(&ekf, X, X) == 1000);
}

static void test_resume_with_velocity_states_stands_still_as_at_the_start(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 1;
    unit_random_t random = {7};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    twin_t expected = twin_of(&ekf);
    for (int k = FORWARD; k <= TURN; k++) {
        expected.mean.at[k][0] = 0;
        for (int i = 0; i < ekf.dim; i++) {
            expected.covariance.at[i][k] = expected.covariance.at[k][i] = 0;
        }
    }
    expected.covariance.at[FORWARD][FORWARD] = 0.4 * 0.4;
    expected.covariance.at[TURN][TURN] = 0.5 * 0.5;
    bslam_ekf_resume(&ekf, &settings, 0, 0);
    twin_assert(&ekf, &expected, 4 * UNIT_ROUNDING);
}

static void test_resume_with_scale_states_keeps_them(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.scale_states = 1;
    unit_random_t random = {8};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    const twin_t expected = twin_of(&ekf);
    bslam_ekf_resume(&ekf, &settings, 0, 0);
    twin_assert(&ekf, &expected, 0);
}

// ---- start ------------------------------------------------------------------------------------------------

static void test_init_knows_its_pose_exactly_and_has_no_beacons(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_ekf_t ekf;
    memset(&ekf, 0xff, sizeof ekf);
    bslam_ekf_init(&ekf, &settings);
    const twin_t expected = {.mean = dense_zero(3, 1), .covariance = dense_zero(3, 3)};
    twin_assert(&ekf, &expected, 0);
    assert_int_equal(ekf.beacon_count, 0);
    assert_true(bslam_ekf_is_sane(&ekf));
}

static void test_init_with_velocity_states_stands_still_within_their_deviations(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 1;
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    twin_t expected = {.mean = dense_zero(5, 1), .covariance = dense_zero(5, 5)};
    expected.covariance.at[FORWARD][FORWARD] = 0.4 * 0.4;
    expected.covariance.at[TURN][TURN] = 0.5 * 0.5;
    twin_assert(&ekf, &expected, 4 * UNIT_ROUNDING);
}

static void test_init_with_scale_states_starts_at_the_given_scales(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.scale_states = 1;
    settings.forward_scale = BSLAM_R(1.5);
    settings.turn_scale = BSLAM_R(0.75);
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    twin_t expected = {.mean = dense_zero(5, 1), .covariance = dense_zero(5, 5)};
    expected.mean.at[FORWARD][0] = 1.5;
    expected.mean.at[TURN][0] = 0.75;
    expected.covariance.at[FORWARD][FORWARD] = expected.covariance.at[TURN][TURN] = 0.2 * 0.2;
    twin_assert(&ekf, &expected, 4 * UNIT_ROUNDING);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_predict_is_the_textbook_prediction),
        cmocka_unit_test(test_predict_with_constant_scales_is_the_textbook_prediction),
        cmocka_unit_test(test_speeds_that_are_no_states_are_not_measured),
        cmocka_unit_test(test_predict_moves_no_beacon),
        cmocka_unit_test(test_predict_without_motion_and_noise_changes_no_value),

        cmocka_unit_test(test_predict_with_scale_states_is_the_textbook_prediction),

        cmocka_unit_test(test_predict_with_velocity_states_predicts_then_measures),
        cmocka_unit_test(test_predict_with_velocity_states_and_constant_scales_measures_the_scaled_reading),
        cmocka_unit_test(test_predict_with_velocity_states_that_never_decay_keeps_them),
        cmocka_unit_test(
            test_predict_with_velocity_states_and_indefinite_noise_is_refused_or_measures_nothing),

        cmocka_unit_test(test_resume_adds_the_doubt_to_the_pose_alone),
        cmocka_unit_test(test_resume_time_and_again_does_not_add_up_beyond_lost),
        cmocka_unit_test(test_resume_with_velocity_states_stands_still_as_at_the_start),
        cmocka_unit_test(test_resume_with_scale_states_keeps_them),

        cmocka_unit_test(test_init_knows_its_pose_exactly_and_has_no_beacons),
        cmocka_unit_test(test_init_with_velocity_states_stands_still_within_their_deviations),
        cmocka_unit_test(test_init_with_scale_states_starts_at_the_given_scales),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
