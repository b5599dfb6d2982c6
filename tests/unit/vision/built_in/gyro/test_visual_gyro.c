#include "support.h"

#include <math.h>

#include "vision/built_in/gyro/visual_gyro.h"

#define CAMERAS 3
#define STEP_US 40000
#define STEP_S 0.04

static const bslam_real_t LEAST_SD = BSLAM_R(0.05);
static bslam_visual_gyro_t gyro;
static bslam_real_t sd_radps;  // of the last rate

static int start(void **state)
{
    assert_int_equal(bslam_visual_gyro_init(&gyro, LEAST_SD), BSLAM_OK);
    return 0;
}

static double thought_radps(void)
{
    return (double)bslam_gyro_filter(&gyro)->state[0];
}

static void advance(int step, double speed_mps)
{
    assert_int_equal(bslam_visual_gyro_advance(&gyro, (int64_t)step * STEP_US, real(speed_mps), BSLAM_R(0.3)),
                     BSLAM_OK);
}

static double turn_rate_radps(int step)
{
    return 0.8 * sin(0.05 * step);
}

/// Drives with three cameras in turn that look left, ahead and right, of which the outer ones pass things at
/// a distance other than the floor line's from step 60 to 100; the sum of what the rates are wrong by, rad.
static double error_after(int steps, double speed_mps, const double nearness_per_m[CAMERAS],
                          double *worst_radps)
{
    double heading_rad = 0, at_frame_rad[CAMERAS] = {0}, sum_rad = 0;
    *worst_radps = 0;
    for (int step = 0; step < steps; step++) {
        const int camera = step % CAMERAS;
        const double rate_radps = step == 0 ? 0 : turn_rate_radps(step);
        heading_rad += rate_radps * STEP_S;
        advance(step, speed_mps);
        const double sideways = camera == 0 ? 0.85 : camera == 1 ? 0 : -0.85;
        const double travelled_m = CAMERAS * STEP_S * speed_mps;
        const bool passing = step >= 60 && step < 100;
        const bslam_turn_t turn = {
            .turn_rad = real(heading_rad - at_frame_rad[camera] -
                             travelled_m * sideways * (0.25 + (passing ? nearness_per_m[camera] : 0))),
            .variance_rad2 = BSLAM_R(1e-6),
            .parallax_rad_per_m = real(sideways * 0.25),
            .parallax_sd_rad_per_m = real(sideways * 0.1),
        };
        assert_int_equal(bslam_visual_gyro_take(&gyro, camera, step < CAMERAS ? NULL : &turn), BSLAM_OK);
        at_frame_rad[camera] = heading_rad;
        bslam_real_t told_radps = 0;
        if (step > 25) {
            assert_true(bslam_visual_gyro_rate(&gyro, &told_radps, &sd_radps));
            const double error_radps = (double)told_radps - rate_radps;
            sum_rad += error_radps * STEP_S;
            *worst_radps = fmax(*worst_radps, fabs(error_radps));
        }
    }
    return sum_rad;
}

static void test_rate_follows_turns_that_span_three_steps(void **state)
{
    static const double where_the_floor_ends[CAMERAS] = {0};
    double worst_radps;
    assert_near(error_after(500, 0.4, where_the_floor_ends, &worst_radps), 0, 0.02);
    assert_true(worst_radps < 0.1);
}

/// The robot turns faster and slower by 3 rad/s². What a rate is late to tell the next ones make up for:
/// their sum stays right, where the sum of what was thought of each step at the time is off by several times
/// as much.
static void test_rates_sum_up_to_the_turn(void **state)
{
    double heading_rad = 0, told_rad = 0, thought_rad = 0, at_frame_rad[CAMERAS] = {0}, worst[2] = {0};
    for (int step = 0; step < 600; step++) {
        const int camera = step % CAMERAS;
        heading_rad += step == 0 ? 0 : 0.12 * (fabs((double)(step % 30) - 15) - 7.5) * STEP_S;
        advance(step, 0);
        const bslam_turn_t turn = {.turn_rad = real(heading_rad - at_frame_rad[camera]),
                                   .variance_rad2 = BSLAM_R(1e-6)};
        assert_int_equal(bslam_visual_gyro_take(&gyro, camera, step < CAMERAS ? NULL : &turn), BSLAM_OK);
        at_frame_rad[camera] = heading_rad;
        bslam_real_t rate_radps = 0;
        const bool told = bslam_visual_gyro_rate(&gyro, &rate_radps, &sd_radps);
        if (step < 25) {
            told_rad = thought_rad = heading_rad;
            continue;
        }
        assert_true(told);
        told_rad += (double)rate_radps * STEP_S;
        thought_rad += thought_radps() * STEP_S;
        worst[0] = fmax(worst[0], fabs(told_rad - heading_rad));
        worst[1] = fmax(worst[1], fabs(thought_rad - heading_rad));
    }
    assert_true(worst[0] < 0.002);
    assert_true(worst[1] > 4 * worst[0]);
}

/// Where little is seen a rate is told, but with a noise that grows; the least is what it was made with.
static void test_noise_grows_while_little_is_seen(void **state)
{
    double worst_radps;
    static const double where_the_floor_ends[CAMERAS] = {0};
    (void)error_after(200, 0, where_the_floor_ends, &worst_radps);
    const double seen_sd_radps = (double)sd_radps;
    assert_true(seen_sd_radps >= 0.05 && seen_sd_radps < 0.1);
    bslam_real_t rate_radps = 0;
    for (int step = 200; step < 205; step++) {
        advance(step, 0);
        const bslam_real_t before = sd_radps;
        assert_true(bslam_visual_gyro_rate(&gyro, &rate_radps, &sd_radps));
        assert_true(step == 200 || sd_radps > before);
    }
    assert_true(sd_radps > 2 * seen_sd_radps);
}

/// A step of which no rate was asked is the wheels': nothing of it comes with the next one.
static void test_step_that_was_not_told_is_not_made_up_for(void **state)
{
    double worst_radps;
    static const double where_the_floor_ends[CAMERAS] = {0};
    (void)error_after(100, 0, where_the_floor_ends, &worst_radps);
    for (int step = 100; step < 104; step++) {
        advance(step, 0);
    }
    bslam_real_t rate_radps = 0;
    assert_true(bslam_visual_gyro_rate(&gyro, &rate_radps, &sd_radps));
    assert_near((double)rate_radps, thought_radps(), 1e-3);
    const bslam_real_t first = rate_radps;
    assert_true(bslam_visual_gyro_rate(&gyro, &rate_radps, &sd_radps));  // may be asked again
    assert_near((double)rate_radps, (double)first, 0);
}

static void test_rate_is_not_led_astray_by_something_near_on_one_side(void **state)
{
    static const double passing_a_chair[CAMERAS] = {1.5, 0, 0};
    double worst_radps;
    assert_near(error_after(200, 0.4, passing_a_chair, &worst_radps), 0, 0.06);
}

/// Two cameras contradict each other, and one of them sees the floor.
static void test_rate_is_that_of_the_camera_that_knows_how_far_things_are(void **state)
{
    for (int step = 0; step < 60; step++) {
        advance(step, 0.4);
        const double sideways = step % 2 == 0 ? 0.9 : -0.9, travelled_m = 2 * STEP_S * 0.4;
        const double true_per_m = step % 2 == 0 ? 0.2 : 1.0;
        const bslam_turn_t turn = {
            .turn_rad = real(-travelled_m * sideways * true_per_m),
            .variance_rad2 = BSLAM_R(1e-6),
            .parallax_rad_per_m = real(sideways * (step % 2 == 0 ? 0.2 : 0.75)),
            .parallax_sd_rad_per_m = real(sideways * (step % 2 == 0 ? 0.1 : 0.25)),
        };
        assert_int_equal(bslam_visual_gyro_take(&gyro, step % 2, step < 2 ? NULL : &turn), BSLAM_OK);
    }
    bslam_real_t rate_radps = 7;
    assert_true(bslam_visual_gyro_rate(&gyro, &rate_radps, &sd_radps));
    assert_near((double)rate_radps, 0, 0.03);  // halfway between the two would be 0.045
}

static void test_rate_is_not_told_before_and_long_after_anything_was_seen(void **state)
{
    bslam_real_t rate_radps = 7;
    assert_false(bslam_visual_gyro_rate(&gyro, &rate_radps, &sd_radps));
    double worst_radps;
    static const double where_the_floor_ends[CAMERAS] = {0};
    (void)error_after(100, 0.4, where_the_floor_ends, &worst_radps);
    assert_true(bslam_visual_gyro_rate(&gyro, &rate_radps, &sd_radps));
    for (int step = 100; step < 125; step++) {
        advance(step, 0.4);
    }
    rate_radps = sd_radps = 7;
    assert_false(bslam_visual_gyro_rate(&gyro, &rate_radps, &sd_radps));
    assert_near((double)rate_radps, 7, 0);
    assert_near((double)sd_radps, 7, 0);
}

static void test_a_lasting_contradiction_is_believed_in_the_end(void **state)
{
    double worst_radps;
    static const double where_the_floor_ends[CAMERAS] = {0};
    (void)error_after(100, 0, where_the_floor_ends, &worst_radps);
    const bslam_turn_t turn = {.turn_rad = BSLAM_R(0.5), .variance_rad2 = BSLAM_R(1e-6)};
    bslam_real_t rate_radps = 0;
    for (int step = 100; step < 115; step++) {  // pushed around: 0.5 rad in three steps
        advance(step, 0);
        assert_int_equal(bslam_visual_gyro_take(&gyro, step % CAMERAS, &turn), BSLAM_OK);
    }
    assert_true(bslam_visual_gyro_rate(&gyro, &rate_radps, &sd_radps));
    assert_near((double)rate_radps, 0.5 / (CAMERAS * STEP_S), 0.3);
}

static void test_bad_input_is_refused_and_nothing_changes(void **state)
{
    const bslam_turn_t good = {.variance_rad2 = BSLAM_R(1e-6)};
    assert_int_equal(bslam_visual_gyro_take(&gyro, 0, NULL), BSLAM_E_TIME);
    advance(5, 0.1);
    assert_int_equal(bslam_visual_gyro_take(&gyro, 1, &good), BSLAM_E_TIME);  // no frame before
    assert_int_equal(bslam_visual_gyro_take(&gyro, 0, NULL), BSLAM_OK);
    static bslam_visual_gyro_t before;
    before = gyro;
    const int64_t time_us = 5 * STEP_US;
    assert_int_equal(bslam_visual_gyro_advance(&gyro, time_us, 0, 1), BSLAM_E_TIME);
    assert_int_equal(bslam_visual_gyro_advance(&gyro, time_us + 4000001, 0, 1), BSLAM_E_TIME);
    assert_int_equal(bslam_visual_gyro_advance(&gyro, time_us + 1, real(NAN), 1), BSLAM_E_NOT_FINITE);
    assert_int_equal(bslam_visual_gyro_advance(&gyro, time_us + 1, 0, 0), BSLAM_E_RANGE);
    assert_int_equal(bslam_visual_gyro_advance(&gyro, time_us + 1, 0, real(NAN)), BSLAM_E_RANGE);
    assert_int_equal(bslam_visual_gyro_take(&gyro, -1, NULL), BSLAM_E_RANGE);
    assert_int_equal(bslam_visual_gyro_take(&gyro, BSLAM_CAMERAS_MAX, NULL), BSLAM_E_RANGE);
    bslam_turn_t turn = good;
    turn.variance_rad2 = 0;
    assert_int_equal(bslam_visual_gyro_take(&gyro, 0, &turn), BSLAM_E_RANGE);
    for (int i = 0; i < 5; i++) {
        turn = good;
        *(bslam_real_t *[]){&turn.turn_rad, &turn.variance_rad2, &turn.mismatch, &turn.parallax_rad_per_m,
                            &turn.parallax_sd_rad_per_m}[i] = real(INFINITY);
        assert_int_equal(bslam_visual_gyro_take(&gyro, 0, &turn), BSLAM_E_NOT_FINITE);
    }
    assert_memory_equal(&gyro, &before, sizeof before);
}

static void test_init_other_sizes_are_refused_and_nothing_is_written(void **state)
{
    static bslam_visual_gyro_t before;
    advance(5, 0.1);
    before = gyro;
    assert_int_equal(bslam_visual_gyro_init_sized(&gyro, sizeof gyro + 8, BSLAM_VISION_HASH, 1),
                     BSLAM_E_SIZE);
    assert_int_equal(bslam_visual_gyro_init_sized(&gyro, sizeof gyro, BSLAM_VISION_HASH + 1, 1),
                     BSLAM_E_SIZE);
    assert_memory_equal(&gyro, &before, sizeof before);
    assert_true(sizeof gyro <= sizeof(bslam_gyro_filter_t) * 51 / 50);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_rate_follows_turns_that_span_three_steps, start),
        cmocka_unit_test_setup(test_rates_sum_up_to_the_turn, start),
        cmocka_unit_test_setup(test_noise_grows_while_little_is_seen, start),
        cmocka_unit_test_setup(test_step_that_was_not_told_is_not_made_up_for, start),
        cmocka_unit_test_setup(test_rate_is_not_led_astray_by_something_near_on_one_side, start),
        cmocka_unit_test_setup(test_rate_is_that_of_the_camera_that_knows_how_far_things_are, start),
        cmocka_unit_test_setup(test_rate_is_not_told_before_and_long_after_anything_was_seen, start),
        cmocka_unit_test_setup(test_a_lasting_contradiction_is_believed_in_the_end, start),
        cmocka_unit_test_setup(test_init_other_sizes_are_refused_and_nothing_is_written, start),
        cmocka_unit_test_setup(test_bad_input_is_refused_and_nothing_changes, start),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
