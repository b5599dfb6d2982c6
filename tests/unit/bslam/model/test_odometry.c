#include "support.h"

#include <math.h>

#include "bslam/model/odometry.h"
#include "plain_settings.h"

#define TURN 6.283185307179586
#define START_US 1000000
#define STEP_US 40000
#define STEP_S 0.04

/// A few roundings, relative to the magnitude of what is compared.
static double rounding_of(double magnitude)
{
    return 16 * UNIT_ROUNDING * magnitude;
}

// ---- readings ---------------------------------------------------------------------------------------------

static bslam_odometry_reading_t wheels(int64_t time_us, double left_m, double right_m)
{
    return (bslam_odometry_reading_t){.time_us = time_us,
                                      .source = BSLAM_ODOMETRY_WHEELS,
                                      .left_m = real(left_m),
                                      .right_m = real(right_m)};
}

static bslam_odometry_reading_t ticks(int64_t time_us, uint32_t left, uint32_t right)
{
    return (bslam_odometry_reading_t){
        .time_us = time_us, .source = BSLAM_ODOMETRY_TICKS, .left_ticks = left, .right_ticks = right};
}

static bslam_odometry_reading_t velocity(int64_t time_us, double v_mps, double omega_radps)
{
    return (bslam_odometry_reading_t){.time_us = time_us,
                                      .source = BSLAM_ODOMETRY_VELOCITY,
                                      .v_mps = real(v_mps),
                                      .omega_radps = real(omega_radps)};
}

static bslam_odometry_reading_t with_gyro(bslam_odometry_reading_t reading, double rate_radps)
{
    reading.has_gyro = true;
    reading.gyro_radps = real(rate_radps);
    return reading;
}

// ---- the unit under test, with its clock started ----------------------------------------------------------

/// An odometry whose clock stands at START_US.
static bslam_odometry_t started(void)
{
    bslam_odometry_t odometry;
    odometry = (bslam_odometry_t){0};
    bslam_odometry_start(&odometry, START_US);
    return odometry;
}

/// One whose tick reference is set too, at START_US.
static bslam_odometry_t started_at_ticks(const bslam_settings_t *settings, uint32_t left, uint32_t right)
{
    bslam_odometry_t odometry;
    odometry = (bslam_odometry_t){0};
    const bslam_odometry_reading_t first = ticks(START_US, left, right);
    bslam_motion_t motion;
    assert_int_equal(bslam_odometry_read(&odometry, settings, &first, &motion), BSLAM_OK);
    return odometry;
}

static bslam_motion_t read_ok(bslam_odometry_t *odometry, const bslam_settings_t *settings,
                              bslam_odometry_reading_t reading)
{
    bslam_motion_t motion;
    assert_int_equal(bslam_odometry_read(odometry, settings, &reading, &motion), BSLAM_OK);
    return motion;
}

/// The reading is refused with this status, and neither the instance nor the output changes.
static void assert_refused(const bslam_odometry_t *odometry, const bslam_settings_t *settings,
                           bslam_odometry_reading_t reading, bslam_status_t expected)
{
    bslam_odometry_t after;
    memcpy(&after, odometry, sizeof after);
    bslam_motion_t motion = {1, 2, 3, 4, 5, 6};
    const bslam_motion_t before = motion;
    assert_int_equal(bslam_odometry_read(&after, settings, &reading, &motion), expected);
    assert_memory_equal(&after, odometry, sizeof after);
    assert_memory_equal(&motion, &before, sizeof motion);
}

// ---- tick differences -------------------------------------------------------------------------------------

static void test_tick_difference_every_step_of_a_small_modulus_is_found(void **state)
{
    for (int32_t modulus = 3; modulus <= 130; modulus++) {
        for (int32_t before = 0; before < modulus; before++) {
            for (int32_t step = -modulus / 2; 2 * step < modulus; step++) {
                const uint32_t after = (uint32_t)((before + step + modulus) % modulus);
                assert_int_equal(bslam_odometry_tick_difference((uint32_t)before, after, (uint32_t)modulus),
                                 step);
            }
        }
    }
}

static void test_tick_difference_any_step_of_any_modulus_is_found(void **state)
{
    unit_random_t random = {1};
    for (int i = 0; i < 20000; i++) {
        const double largest = i % 40 == 0 ? 4294967296.0 : floor(pow(2, unit_random(&random, 2, 32)));
        const int64_t modulus = (int64_t)largest;
        const int64_t before = (int64_t)floor(unit_random(&random, 0, largest));
        const int64_t half = modulus / 2;
        const int64_t step = (int64_t)floor(unit_random(&random, (double)-half, (double)(modulus - half)));
        const int64_t after = (before + step + modulus) % modulus;
        assert_int_equal(bslam_odometry_tick_difference((uint32_t)before, (uint32_t)after, (uint32_t)modulus),
                         step);
    }
}

static void test_tick_difference_of_32_bits_at_its_extremes_is_exact(void **state)
{
    assert_int_equal(bslam_odometry_tick_difference(7, 7, 0), 0);
    assert_int_equal(bslam_odometry_tick_difference(0, 0x7fffffffu, 0), INT32_MAX);
    assert_int_equal(bslam_odometry_tick_difference(0, 0x80000000u, 0), INT32_MIN);
    assert_int_equal(bslam_odometry_tick_difference(0x80000000u, 0, 0), INT32_MIN);
    assert_int_equal(bslam_odometry_tick_difference(0xffffffffu, 0, 0), 1);
    assert_int_equal(bslam_odometry_tick_difference(0, 0xffffffffu, 0), -1);
}

// ---- clock ------------------------------------------------------------------------------------------------

static void test_read_first_reading_without_a_clock_has_no_interval(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_odometry_reading_t first[] = {wheels(START_US, 5, 7), ticks(START_US, 10, 20),
                                              velocity(START_US, 3, 4), wheels(0, 1, 1)};
    for (int i = 0; i < COUNT_OF(first); i++) {
        bslam_odometry_t odometry;
        odometry = (bslam_odometry_t){0};
        const bslam_motion_t motion = read_ok(&odometry, &settings, first[i]);
        const bslam_motion_t nothing = {0};
        assert_memory_equal(&motion, &nothing, sizeof motion);
        assert_true(odometry.has_time && odometry.time_us == first[i].time_us);
    }
}

static void test_start_clock_counts_from_there_and_starts_once(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_odometry_t odometry = started();
    bslam_odometry_start(&odometry, START_US + 7);
    const bslam_motion_t motion = read_ok(&odometry, &settings, wheels(START_US + STEP_US, 0.01, 0.01));
    assert_near(motion.dt_s, STEP_S, rounding_of(STEP_S));
}

static void test_read_interval_is_exact_however_late_the_clock(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const int64_t late_us = INT64_MAX / 2 - 1;
    bslam_odometry_t odometry;
    odometry = (bslam_odometry_t){0};
    (void)read_ok(&odometry, &settings, wheels(late_us, 0, 0));
    const bslam_motion_t motion = read_ok(&odometry, &settings, wheels(late_us + 1, 0, 0));
    assert_near(motion.dt_s, 1e-6, rounding_of(1e-6));
}

static void test_read_time_that_does_not_advance_is_refused(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_odometry_t odometry = started();
    static const int64_t times[] = {START_US, START_US - 1, 0, -1, INT64_MIN, INT64_MIN / 2};
    for (int i = 0; i < COUNT_OF(times); i++) {
        assert_refused(&odometry, &settings, wheels(times[i], 0, 0), BSLAM_E_TIME);
    }
}

static void test_read_time_too_far_ahead_is_refused(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_odometry_t odometry = started();
    const int64_t limit_us = INT64_C(4000000);
    static const int64_t beyond_us[] = {1, 1000, INT64_MAX / 4};
    for (int i = 0; i < COUNT_OF(beyond_us); i++) {
        assert_refused(&odometry, &settings, wheels(START_US + limit_us + beyond_us[i], 0, 0), BSLAM_E_TIME);
    }
    assert_refused(&odometry, &settings, wheels(INT64_MAX, 0, 0), BSLAM_E_TIME);
    bslam_odometry_t copy = odometry;
    (void)read_ok(&copy, &settings, wheels(START_US + limit_us, 0, 0));
}

static void test_read_first_time_out_of_range_is_refused(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_odometry_t odometry;
    memset(&odometry, 0, sizeof odometry);
    odometry = (bslam_odometry_t){0};
    static const int64_t times[] = {-1, INT64_MIN, INT64_MAX, INT64_MAX / 2 + 1};
    for (int i = 0; i < COUNT_OF(times); i++) {
        assert_refused(&odometry, &settings, wheels(times[i], 0, 0), BSLAM_E_TIME);
    }
}

// ---- sources ----------------------------------------------------------------------------------------------

static void test_read_wheels_motion_and_noise_are_the_closed_form(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.travel_sd_per_sqrt_m = BSLAM_R(0.1);
    bslam_odometry_t odometry = started();
    const double left = 0.02;
    const double right = -0.01;
    const bslam_motion_t motion = read_ok(&odometry, &settings, wheels(START_US + STEP_US, left, right));
    const double base = 0.4;
    const double left_var = 0.3 * STEP_S * 0.3 * STEP_S + 0.01 * 0.02;
    const double right_var = 0.2 * STEP_S * 0.2 * STEP_S + 0.01 * 0.01;
    assert_near(motion.dt_s, STEP_S, rounding_of(STEP_S));
    assert_near(motion.forward_m, (left + right) / 2, rounding_of(0.02));
    assert_near(motion.turn_rad, (right - left) / base, rounding_of(0.1));
    assert_near(motion.forward_var_m2, (left_var + right_var) / 4, rounding_of(left_var));
    assert_near(motion.turn_var_rad2, (left_var + right_var) / (base * base), rounding_of(left_var / 0.16));
    // forward = (l + r) / 2 and turn = (r - l) / b share the wheels' errors.
    assert_near(motion.forward_turn_cov_mrad, (right_var - left_var) / (2 * base), rounding_of(left_var));
}

static void test_read_noise_of_the_body_grows_with_time_travel_and_turn(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.left_speed_sd_mps = 0;
    settings.right_speed_sd_mps = 0;
    settings.forward_sd_per_sqrt_s = BSLAM_R(0.1);
    settings.forward_sd_per_sqrt_m = BSLAM_R(0.2);
    settings.turn_sd_per_sqrt_s = BSLAM_R(0.3);
    settings.turn_sd_per_sqrt_m = BSLAM_R(0.4);
    settings.turn_sd_per_sqrt_rad = BSLAM_R(0.5);
    bslam_odometry_t odometry = started();
    // 3 m/s backwards and 2.5 rad/s to the right: signs must not matter.
    const bslam_motion_t moving = read_ok(&odometry, &settings, velocity(START_US + STEP_US, -3, -2.5));
    const double way = 3 * STEP_S;
    const double turn = 2.5 * STEP_S;
    assert_near(moving.forward_var_m2, 0.01 * STEP_S + 0.04 * way, rounding_of(0.01));
    assert_near(moving.turn_var_rad2, 0.09 * STEP_S + 0.16 * way + 0.25 * turn, rounding_of(0.1));
    assert_near(moving.forward_turn_cov_mrad, 0, 0);
    const bslam_motion_t standing = read_ok(&odometry, &settings, velocity(START_US + 2 * STEP_US, 0, 0));
    assert_near(standing.forward_var_m2, 0, 0);
    assert_near(standing.turn_var_rad2, 0, 0);
}

static void test_read_velocity_is_the_motion_of_its_wheels(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_odometry_t by_velocity = started();
    bslam_odometry_t by_wheels = started();
    const double v = 0.7;
    const double omega = -1.3;
    const bslam_motion_t a = read_ok(&by_velocity, &settings, velocity(START_US + STEP_US, v, omega));
    const bslam_motion_t b =
        read_ok(&by_wheels, &settings,
                wheels(START_US + STEP_US, (v - omega * 0.4 / 2) * STEP_S, (v + omega * 0.4 / 2) * STEP_S));
    assert_near(a.forward_m, v * STEP_S, rounding_of(0.04));
    assert_near(a.turn_rad, omega * STEP_S, rounding_of(0.1));
    assert_near(a.forward_m, b.forward_m, rounding_of(0.04));
    assert_near(a.turn_rad, b.turn_rad, rounding_of(0.1));
    assert_near(a.forward_var_m2, b.forward_var_m2, rounding_of(1e-3));
    assert_near(a.turn_var_rad2, b.turn_var_rad2, rounding_of(1e-3));
}

static void test_read_ticks_motion_is_that_of_the_wheels(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.left_radius_m = BSLAM_R(0.05);
    settings.right_radius_m = BSLAM_R(0.06);
    bslam_odometry_t odometry = started_at_ticks(&settings, 500, 600);
    const bslam_motion_t motion = read_ok(&odometry, &settings, ticks(START_US + STEP_US, 540, 590));
    const double left = 40 * TURN / 1000 * 0.05;
    const double right = -10 * TURN / 1000 * 0.06;
    assert_near(motion.forward_m, (left + right) / 2, rounding_of(0.01));
    assert_near(motion.turn_rad, (right - left) / 0.4, rounding_of(0.1));
}

static void test_read_ticks_across_the_roll_over_at_any_width_go_on(void **state)
{
    static const int widths[] = {2, 8, 16, 24, 32};
    for (int i = 0; i < COUNT_OF(widths); i++) {
        bslam_settings_t settings = unit_settings();
        settings.counter_bits = widths[i];
        const uint32_t top = UINT32_MAX >> (32 - widths[i]);
        bslam_odometry_t odometry = started_at_ticks(&settings, top, 0);
        // One tick up across the top on the left, one down across zero on the right, and back.
        const double per_tick = TURN / 1000 * 0.05;
        const bslam_motion_t there = read_ok(&odometry, &settings, ticks(START_US + STEP_US, 0, top));
        assert_near(there.forward_m, 0, 0);
        assert_near(there.turn_rad, -2 * per_tick / 0.4, rounding_of(per_tick));
        const bslam_motion_t back = read_ok(&odometry, &settings, ticks(START_US + 2 * STEP_US, top, 0));
        assert_near(back.turn_rad, 2 * per_tick / 0.4, rounding_of(per_tick));
    }
}

static void test_read_ticks_beyond_the_counters_width_are_refused(void **state)
{
    static const int widths[] = {2, 8, 16, 31};
    for (int i = 0; i < COUNT_OF(widths); i++) {
        bslam_settings_t settings = unit_settings();
        settings.counter_bits = widths[i];
        const bslam_odometry_t odometry = started_at_ticks(&settings, 1, 1);
        const uint32_t beyond[] = {1u << widths[i], UINT32_MAX};
        for (int k = 0; k < COUNT_OF(beyond); k++) {
            assert_refused(&odometry, &settings, ticks(START_US + STEP_US, beyond[k], 1), BSLAM_E_RANGE);
            assert_refused(&odometry, &settings, ticks(START_US + STEP_US, 1, beyond[k]), BSLAM_E_RANGE);
        }
    }
}

/// A counter that counts one turn of the wheel, whatever its width, driven both ways.
static void test_read_ticks_across_any_modulus_go_on_both_ways(void **state)
{
    static const int32_t moduli[] = {7, 1000, 2400, 4096, 16000000};
    for (int i = 0; i < COUNT_OF(moduli); i++) {
        bslam_settings_t settings = unit_settings();
        settings.counter_modulus = moduli[i];
        settings.counter_bits = 2;  // which says nothing then
        settings.ticks_per_revolution = moduli[i] < 10000000 ? moduli[i] : 10000000;
        const uint32_t top = (uint32_t)moduli[i] - 1;
        bslam_odometry_t odometry = started_at_ticks(&settings, top, 0);
        const double per_tick = TURN / settings.ticks_per_revolution * 0.05;
        const bslam_motion_t there = read_ok(&odometry, &settings, ticks(START_US + STEP_US, 1, top - 1));
        assert_near(there.forward_m, 0, rounding_of(per_tick));
        assert_near(there.turn_rad, -4 * per_tick / 0.4, rounding_of(10 * per_tick));
        const bslam_motion_t back = read_ok(&odometry, &settings, ticks(START_US + 2 * STEP_US, top, 0));
        assert_near(back.turn_rad, 4 * per_tick / 0.4, rounding_of(10 * per_tick));
        const bslam_odometry_t before = odometry;
        assert_refused(&before, &settings, ticks(START_US + 3 * STEP_US, top + 1, 0), BSLAM_E_RANGE);
        assert_refused(&before, &settings, ticks(START_US + 3 * STEP_US, 0, top + 1), BSLAM_E_RANGE);
    }
}

static void test_read_unknown_source_is_refused(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_odometry_t odometry = started();
    bslam_odometry_reading_t reading = wheels(START_US + STEP_US, 0, 0);
    const int unknown = 17;
    memcpy(&reading.source, &unknown, sizeof reading.source);
    assert_refused(&odometry, &settings, reading, BSLAM_E_RANGE);
}

static void test_read_value_that_is_no_number_is_refused(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_odometry_t odometry = started();
    static const double bad[] = {NAN, INFINITY, -INFINITY, 1e13, -1e13};
    const int64_t time_us = START_US + STEP_US;
    for (int i = 0; i < COUNT_OF(bad); i++) {
        assert_refused(&odometry, &settings, wheels(time_us, bad[i], 0), BSLAM_E_NOT_FINITE);
        assert_refused(&odometry, &settings, wheels(time_us, 0, bad[i]), BSLAM_E_NOT_FINITE);
        assert_refused(&odometry, &settings, with_gyro(wheels(time_us, 0, 0), bad[i]), BSLAM_E_NOT_FINITE);
    }
    // Velocities count times the interval, so that 1e13 m/s is a jump; what is not finite stays so.
    for (int i = 0; i < 3; i++) {
        assert_refused(&odometry, &settings, velocity(time_us, bad[i], 0), BSLAM_E_NOT_FINITE);
        assert_refused(&odometry, &settings, velocity(time_us, 0, bad[i]), BSLAM_E_NOT_FINITE);
    }
}

static void test_read_reads_only_its_sources_fields(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_odometry_t odometry = started();
    bslam_odometry_reading_t reading = wheels(START_US + STEP_US, 0.01, 0.01);
    reading.v_mps = reading.omega_radps = reading.gyro_radps = (bslam_real_t)NAN;
    reading.left_ticks = reading.right_ticks = UINT32_MAX;
    (void)read_ok(&odometry, &settings, reading);
}

static void test_read_denormal_travel_is_a_motion_like_any_other(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_odometry_t odometry = started();
    const double tiny = BSLAM_REAL_DOUBLE ? 1e-310 : 1e-40;
    const bslam_motion_t motion = read_ok(&odometry, &settings, wheels(START_US + STEP_US, tiny, tiny));
    assert_near(motion.forward_m, tiny, tiny / 100);
    assert_near(motion.turn_rad, 0, 0);
}

// ---- jumps ------------------------------------------------------------------------------------------------

static void test_read_wheel_faster_than_possible_is_a_jump(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.speed_max_mps = 2;
    const bslam_odometry_t odometry = started();
    const double limit = 2 * STEP_S;
    static const double factors[] = {1.001, -1.001, 1e3, -1e9};
    for (int i = 0; i < COUNT_OF(factors); i++) {
        const double far = limit * factors[i];
        assert_refused(&odometry, &settings, wheels(START_US + STEP_US, far, 0), BSLAM_E_JUMP);
        assert_refused(&odometry, &settings, wheels(START_US + STEP_US, 0, far), BSLAM_E_JUMP);
        assert_refused(&odometry, &settings, velocity(START_US + STEP_US, 2 * factors[i], 0), BSLAM_E_JUMP);
    }
    bslam_odometry_t copy = odometry;
    (void)read_ok(&copy, &settings, wheels(START_US + STEP_US, limit * 0.999, -limit * 0.999));
}

static void test_read_turn_of_many_revolutions_is_a_jump(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.speed_max_mps = 1000;
    settings.wheelbase_m = BSLAM_R(1e-3);
    const bslam_odometry_t odometry = started();
    // Four seconds at 750 m/s with opposite wheels: 6e6 rad, beyond any angle function.
    assert_refused(&odometry, &settings, wheels(START_US + INT64_C(4000000), -3e3, 3e3), BSLAM_E_JUMP);
}

static void test_read_gyro_turn_of_many_revolutions_is_refused(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_odometry_t odometry = started();
    assert_refused(&odometry, &settings, with_gyro(wheels(START_US + STEP_US, 0, 0), 1e12), BSLAM_E_RANGE);
    assert_refused(&odometry, &settings, with_gyro(wheels(START_US + STEP_US, 0, 0), -1e12), BSLAM_E_RANGE);
}

static void test_read_gyro_noise_that_is_none_is_refused(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_odometry_t odometry = started();
    static const struct {
        double sd_radps;
        bslam_status_t expected;
    } bad[] = {{NAN, BSLAM_E_NOT_FINITE},
               {INFINITY, BSLAM_E_NOT_FINITE},
               {-0.1, BSLAM_E_RANGE},
               {1e-7, BSLAM_E_RANGE},
               {101, BSLAM_E_RANGE}};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        bslam_odometry_reading_t reading = with_gyro(wheels(START_US + STEP_US, 0, 0), 0.1);
        reading.gyro_sd_radps = real(bad[i].sd_radps);
        assert_refused(&odometry, &settings, reading, bad[i].expected);
        reading.has_gyro = false;
        bslam_odometry_t fine = odometry;
        (void)read_ok(&fine, &settings, reading);  // nobody reads it
    }
}

/// The statuses of tick readings, one a step from START_US on, and the sum of the way they were taken for.
static double way_of(bslam_odometry_t *odometry, const bslam_settings_t *settings,
                     const uint32_t (*counts)[2], const bslam_status_t *expected, int count)
{
    double way_m = 0;
    for (int i = 0; i < count; i++) {
        const bslam_odometry_reading_t reading =
            ticks(START_US + (i + 1) * STEP_US, counts[i][0], counts[i][1]);
        bslam_motion_t motion;
        assert_int_equal(bslam_odometry_read(odometry, settings, &reading, &motion), expected[i]);
        way_m += expected[i] == BSLAM_OK ? (double)motion.forward_m : 0;
    }
    return way_m;
}

#define WAY_OF(odometry, settings, counts, expected) \
    way_of(odometry, settings, counts, expected, COUNT_OF(counts))

/// Of 10 ticks each.
static double steps_m(int steps)
{
    return steps * 10 * TURN / 1000 * 0.05;
}

static bslam_settings_t slow_settings(void)
{
    bslam_settings_t settings = unit_settings();
    settings.speed_max_mps = 2;
    return settings;
}

static void test_read_one_odd_count_costs_no_way(void **state)
{
    const bslam_settings_t settings = slow_settings();
    static const bslam_status_t expected[] = {BSLAM_OK, BSLAM_E_JUMP, BSLAM_OK, BSLAM_OK};
    // Of the left wheel, of the right one, of both; far up, far down, and 0.
    static const uint32_t odd[][2] = {{65535, 1020}, {1020, 30000}, {0, 0}, {1020, 0}, {65535, 65535}};
    for (int i = 0; i < COUNT_OF(odd); i++) {
        bslam_odometry_t odometry = started_at_ticks(&settings, 1000, 1000);
        const uint32_t counts[][2] = {{1010, 1010}, {odd[i][0], odd[i][1]}, {1030, 1030}, {1040, 1040}};
        assert_near(WAY_OF(&odometry, &settings, counts, expected), steps_m(4), rounding_of(0.1));
    }
}

static void test_read_two_odd_counts_in_a_row_cost_no_way(void **state)
{
    const bslam_settings_t settings = slow_settings();
    static const bslam_status_t expected[] = {BSLAM_OK, BSLAM_E_JUMP, BSLAM_E_JUMP, BSLAM_OK, BSLAM_OK};
    static const uint32_t odd[][2] = {{65535, 65535}, {65535, 20000}, {20000, 65535}, {0, 65535}};
    for (int i = 0; i < COUNT_OF(odd); i++) {  // the same twice, or another
        bslam_odometry_t odometry = started_at_ticks(&settings, 1000, 1000);
        const uint32_t counts[][2] = {
            {1010, 1010}, {odd[i][0], 1020}, {odd[i][1], 1030}, {1040, 1040}, {1050, 1050}};
        assert_near(WAY_OF(&odometry, &settings, counts, expected), steps_m(5), rounding_of(0.1));
    }
}

/// A rate that a gyro tells beside it is that of the last interval only.
static void test_read_gyro_after_an_odd_count_is_left_out(void **state)
{
    const bslam_settings_t settings = slow_settings();
    bslam_odometry_t odometry = started_at_ticks(&settings, 1000, 1000);
    const bslam_odometry_reading_t odd = with_gyro(ticks(START_US + STEP_US, 65535, 65535), 3);
    bslam_motion_t motion;
    assert_int_equal(bslam_odometry_read(&odometry, &settings, &odd, &motion), BSLAM_E_JUMP);
    motion = read_ok(&odometry, &settings, with_gyro(ticks(START_US + 2 * STEP_US, 1020, 1020), 3));
    assert_near(motion.turn_rad, 0, 0);
    motion = read_ok(&odometry, &settings, with_gyro(ticks(START_US + 3 * STEP_US, 1030, 1030), 3));
    assert_true(motion.turn_rad > BSLAM_R(0.05));
}

static void test_read_after_an_encoder_reset_three_readings_are_the_reference(void **state)
{
    const bslam_settings_t settings = slow_settings();
    bslam_odometry_t odometry = started_at_ticks(&settings, 20000, 20000);
    static const uint32_t reset[][2] = {{0, 0}, {10, 10}};
    static const bslam_status_t refused[] = {BSLAM_E_JUMP, BSLAM_E_JUMP};
    assert_near(WAY_OF(&odometry, &settings, reset, refused), 0, 0);
    // The jump is not waited out: what the new counts tell is taken, and the time before them is a gap.
    const bslam_motion_t third = read_ok(&odometry, &settings, ticks(START_US + 3 * STEP_US, 20, 20));
    assert_near(third.forward_m, steps_m(2), rounding_of(0.01));
    const double dt = 3 * STEP_S;
    const double noise = (0.09 + 0.04) * dt * dt / 4 + 0.04 * STEP_S * STEP_S;
    assert_near(third.forward_var_m2, noise, rounding_of(0.01));
    const bslam_motion_t after = read_ok(&odometry, &settings, ticks(START_US + 4 * STEP_US, 30, 30));
    assert_near(after.forward_m, steps_m(1), rounding_of(0.01));
    assert_near(after.forward_var_m2, (0.09 + 0.04) * STEP_S * STEP_S / 4, rounding_of(0.01));
}

/// The more time goes by, the farther may a wheel have gone: a small reset must not become motion by that.
static void test_read_reset_that_time_would_make_a_motion_is_none(void **state)
{
    const bslam_settings_t settings = slow_settings();
    bslam_odometry_t odometry = started_at_ticks(&settings, 1000, 1000);
    // 0.1 m back in 0.04 s is a jump; in 0.08 s and more it would not be one.
    static const uint32_t counts[][2] = {{700, 700}, {710, 710}, {720, 720}, {730, 730}};
    static const bslam_status_t expected[] = {BSLAM_E_JUMP, BSLAM_E_JUMP, BSLAM_OK, BSLAM_OK};
    assert_near(WAY_OF(&odometry, &settings, counts, expected), steps_m(3), rounding_of(0.1));
}

static void test_read_jump_of_another_source_leaves_the_tick_reference(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.speed_max_mps = 2;
    bslam_odometry_t odometry = started_at_ticks(&settings, 20000, 20000);
    const bslam_odometry_reading_t jump = wheels(START_US + STEP_US, 5, 5);
    bslam_motion_t motion;
    assert_int_equal(bslam_odometry_read(&odometry, &settings, &jump, &motion), BSLAM_E_JUMP);
    motion = read_ok(&odometry, &settings, ticks(START_US + 2 * STEP_US, 20010, 20010));
    assert_near(motion.forward_m, 10 * TURN / 1000 * 0.05, rounding_of(0.01));
}

static void test_restart_starts_clock_and_ticks_anew(void **state)
{
    bslam_settings_t settings = unit_settings();
    bslam_odometry_t odometry = started_at_ticks(&settings, 20000, 20000);
    bslam_odometry_restart(&odometry);
    const bslam_motion_t first = read_ok(&odometry, &settings, ticks(START_US + 2 * STEP_US, 0, 0));
    assert_near(first.dt_s, 0, 0);

    const bslam_motion_t next = read_ok(&odometry, &settings, ticks(START_US + 3 * STEP_US, 10, 10));
    assert_near(next.forward_m, 10 * TURN / 1000 * 0.05, rounding_of(0.01));
    assert_near(next.forward_var_m2, (0.09 + 0.04) * STEP_S * STEP_S / 4, rounding_of(1e-4));
}

static void test_read_first_ticks_after_the_clock_started_leave_the_interval_open(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_odometry_t odometry = started();
    const double dt = 2 * STEP_S;
    const bslam_motion_t motion = read_ok(&odometry, &settings, ticks(START_US + 2 * STEP_US, 70, 80));
    assert_near(motion.forward_m, 0, 0);
    assert_near(motion.turn_rad, 0, 0);
    // The robot may have moved unseen for the whole interval: the wheels' noise, and the gap's.
    const double wheels_var = (0.09 + 0.04) * dt * dt;
    assert_near(motion.forward_var_m2, wheels_var / 4 + 0.04 * dt * dt, rounding_of(0.01));
    assert_near(motion.turn_var_rad2, wheels_var / 0.16 + 0.25 * dt * dt, rounding_of(0.1));
}

static void test_read_ticks_after_another_source_start_afresh(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_odometry_t odometry = started_at_ticks(&settings, 100, 100);
    (void)read_ok(&odometry, &settings, wheels(START_US + STEP_US, 0.01, 0.01));
    // The counters saw the same way: counting it twice would be wrong.
    const bslam_motion_t motion = read_ok(&odometry, &settings, ticks(START_US + 2 * STEP_US, 132, 132));
    assert_near(motion.forward_m, 0, 0);
}

// ---- gaps -------------------------------------------------------------------------------------------------

static void test_read_gap_inflates_by_the_part_beyond_its_limit(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.left_speed_sd_mps = 0;
    settings.right_speed_sd_mps = 0;
    static const double gaps_s[] = {0, 0.5, 2};
    for (int i = 0; i < COUNT_OF(gaps_s); i++) {
        bslam_odometry_t odometry = started();
        const int64_t dt_us = 2000000 + (int64_t)(gaps_s[i] * 1e6);
        const bslam_motion_t motion = read_ok(&odometry, &settings, wheels(START_US + dt_us, 0.1, 0.1));
        const double gap2 = gaps_s[i] * gaps_s[i];
        // dt - gap_us loses digits where they are close.
        const double tolerance = rounding_of(1 + 4 * gap2);
        assert_near(motion.forward_var_m2, 0.2 * 0.2 * gap2, tolerance);
        assert_near(motion.turn_var_rad2, 0.5 * 0.5 * gap2, tolerance);
    }
}

// ---- gyro -------------------------------------------------------------------------------------------------

/// Fusion of (forward, turn) with a measurement of turn in information form, for comparison: P' = (P⁻¹ + e eᵀ
/// / r)⁻¹.
static bslam_motion_t fused_by_information(const bslam_motion_t *wheels_only, double gyro_turn,
                                           double gyro_var)
{
    const double pff = (double)wheels_only->forward_var_m2;
    const double pft = (double)wheels_only->forward_turn_cov_mrad;
    const double ptt = (double)wheels_only->turn_var_rad2;
    const double det = pff * ptt - pft * pft;
    const double iff = ptt / det;
    const double ift = -pft / det;
    const double itt = pff / det + 1 / gyro_var;
    const double f = (double)wheels_only->forward_m;
    const double t = (double)wheels_only->turn_rad;
    const double vector_f = iff * f + ift * t;
    const double vector_t = ift * f + pff / det * t + gyro_turn / gyro_var;
    const double fused_det = iff * itt - ift * ift;
    return (bslam_motion_t){
        .forward_m = real((itt * vector_f - ift * vector_t) / fused_det),
        .turn_rad = real((iff * vector_t - ift * vector_f) / fused_det),
        .forward_var_m2 = real(itt / fused_det),
        .forward_turn_cov_mrad = real(-ift / fused_det),
        .turn_var_rad2 = real(iff / fused_det),
    };
}

static void test_read_gyro_is_fused_as_the_information_form_has_it(void **state)
{
    static const double sds[] = {0.001, 0.02, 1, 50};
    for (int i = 0; i < COUNT_OF(sds); i++) {
        bslam_settings_t settings = unit_settings();
        settings.gyro_sd_radps = real(sds[i]);
        bslam_odometry_t without = started();
        bslam_odometry_t with = started();
        const bslam_odometry_reading_t reading = wheels(START_US + STEP_US, 0.01, 0.03);
        const bslam_motion_t wheels_only = read_ok(&without, &settings, reading);
        const bslam_motion_t fused = read_ok(&with, &settings, with_gyro(reading, 0.8));
        const bslam_motion_t expected =
            fused_by_information(&wheels_only, 0.8 * STEP_S, sds[i] * sds[i] * STEP_S * STEP_S);
        assert_near(fused.forward_m, expected.forward_m, rounding_of(0.05));
        assert_near(fused.turn_rad, expected.turn_rad, rounding_of(0.1));
        // What is left after a good gyro comes from a difference of larger numbers.
        assert_near(fused.forward_var_m2, expected.forward_var_m2, rounding_of(1e-4));
        assert_near(fused.forward_turn_cov_mrad, expected.forward_turn_cov_mrad, rounding_of(1e-4));
        assert_near(fused.turn_var_rad2, expected.turn_var_rad2, rounding_of(1e-3));
        assert_true(fused.turn_var_rad2 > 0);
        settings.gyro_sd_radps = 7;  // a reading's own noise goes before
        bslam_odometry_t own = started();
        bslam_odometry_reading_t with_noise = with_gyro(reading, 0.8);
        with_noise.gyro_sd_radps = real(sds[i]);
        const bslam_motion_t same = read_ok(&own, &settings, with_noise);
        assert_memory_equal(&same, &fused, sizeof same);
    }
}

static void test_read_gyro_beside_noiseless_wheels_changes_nothing(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.left_speed_sd_mps = 0;
    settings.right_speed_sd_mps = 0;
    bslam_odometry_t odometry = started();
    const bslam_motion_t motion =
        read_ok(&odometry, &settings, with_gyro(wheels(START_US + STEP_US, 0.01, 0.03), 5));
    assert_near(motion.turn_rad, 0.02 / 0.4, rounding_of(0.1));
    assert_near(motion.turn_var_rad2, 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tick_difference_every_step_of_a_small_modulus_is_found),
        cmocka_unit_test(test_tick_difference_any_step_of_any_modulus_is_found),
        cmocka_unit_test(test_tick_difference_of_32_bits_at_its_extremes_is_exact),

        cmocka_unit_test(test_read_first_reading_without_a_clock_has_no_interval),
        cmocka_unit_test(test_start_clock_counts_from_there_and_starts_once),
        cmocka_unit_test(test_read_interval_is_exact_however_late_the_clock),
        cmocka_unit_test(test_read_time_that_does_not_advance_is_refused),
        cmocka_unit_test(test_read_time_too_far_ahead_is_refused),
        cmocka_unit_test(test_read_first_time_out_of_range_is_refused),

        cmocka_unit_test(test_read_wheels_motion_and_noise_are_the_closed_form),
        cmocka_unit_test(test_read_noise_of_the_body_grows_with_time_travel_and_turn),
        cmocka_unit_test(test_read_velocity_is_the_motion_of_its_wheels),
        cmocka_unit_test(test_read_ticks_motion_is_that_of_the_wheels),
        cmocka_unit_test(test_read_ticks_across_the_roll_over_at_any_width_go_on),
        cmocka_unit_test(test_read_ticks_beyond_the_counters_width_are_refused),
        cmocka_unit_test(test_read_ticks_across_any_modulus_go_on_both_ways),
        cmocka_unit_test(test_read_unknown_source_is_refused),
        cmocka_unit_test(test_read_value_that_is_no_number_is_refused),
        cmocka_unit_test(test_read_reads_only_its_sources_fields),
        cmocka_unit_test(test_read_denormal_travel_is_a_motion_like_any_other),

        cmocka_unit_test(test_read_wheel_faster_than_possible_is_a_jump),
        cmocka_unit_test(test_read_turn_of_many_revolutions_is_a_jump),
        cmocka_unit_test(test_read_gyro_turn_of_many_revolutions_is_refused),
        cmocka_unit_test(test_read_gyro_noise_that_is_none_is_refused),
        cmocka_unit_test(test_read_one_odd_count_costs_no_way),
        cmocka_unit_test(test_read_two_odd_counts_in_a_row_cost_no_way),
        cmocka_unit_test(test_read_gyro_after_an_odd_count_is_left_out),
        cmocka_unit_test(test_read_after_an_encoder_reset_three_readings_are_the_reference),
        cmocka_unit_test(test_read_reset_that_time_would_make_a_motion_is_none),
        cmocka_unit_test(test_read_jump_of_another_source_leaves_the_tick_reference),
        cmocka_unit_test(test_restart_starts_clock_and_ticks_anew),
        cmocka_unit_test(test_read_first_ticks_after_the_clock_started_leave_the_interval_open),
        cmocka_unit_test(test_read_ticks_after_another_source_start_afresh),

        cmocka_unit_test(test_read_gap_inflates_by_the_part_beyond_its_limit),

        cmocka_unit_test(test_read_gyro_is_fused_as_the_information_form_has_it),
        cmocka_unit_test(test_read_gyro_beside_noiseless_wheels_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
