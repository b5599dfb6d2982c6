// What a robot's sensors do besides what they should: clocks, cameras, labels, counters, places, by the
// public calls alone.
#include "bslam/bslam.h"
#include "base/crc32.h"
#include "map_memory.h"
#include "support.h"

#include <math.h>

#define PI 3.14159265358979323846

enum { STEP_US = 40000, MAP_BYTES_MAX = 65536 };

static bslam_t robot;
static bslam_settings_t settings;

static int setup(void **state)
{
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    return 0;
}

static void start(void)
{
    int bad_setting;
    assert_int_equal(bslam_init(&robot, &settings, &bad_setting), BSLAM_OK);
}

static bslam_slam_counters_t counted(void)
{
    return bslam_counters(&robot).slam;
}

static bslam_status_t roll(int64_t time_us, double left_m, double right_m)
{
    const bslam_odometry_reading_t wheels = {.time_us = time_us,
                                             .source = BSLAM_ODOMETRY_WHEELS,
                                             .left_m = real(left_m),
                                             .right_m = real(right_m)};
    return bslam_odometry(&robot, &wheels);
}

/// What stands at (x, y), seen from (way, 0) by a robot that looks ahead.
static bslam_sighting_t seen_at(double x_m, double y_m, double way_m, int32_t label)
{
    return unit_polar(atan2(y_m, x_m - way_m), hypot(x_m - way_m, y_m), label);
}

/// The way that it has gone along x is what it thinks, to `sds` of its own deviations.
static void assert_way(double way_m, double sds)
{
    const bslam_pose_t pose = bslam_pose(&robot);
    bslam_real_t lower[6];
    bslam_pose_covariance(&robot, lower);
    assert_near(pose.x_m, way_m, sds * sqrt((double)lower[0]));
    assert_near(pose.y_m, 0, sds * sqrt((double)lower[2]) + 1e-9);
    assert_int_equal(counted().insane, 0);
}

// ---- the clock --------------------------------------------------------------------------------------------

static const double posts[2][2] = {{4, 1}, {3, -2}};

/// 4 s at the old clock, told or not that it begins anew, and 12 s at the new one. Just before, something is
/// seen twice where nothing stands.
static void drive_over_a_new_clock(int64_t old_us, int64_t new_us, bool is_told, bool has_labels)
{
    for (int k = 0; k < 400; k++) {
        if (k == 100 && is_told) {
            assert_int_equal(bslam_resume_odometry(&robot, BSLAM_R(0.02), BSLAM_R(0.02)), BSLAM_OK);
        }
        const int64_t time_us =
            k < 100 ? old_us + (int64_t)k * STEP_US : new_us + (int64_t)(k - 100) * STEP_US;
        const double way_m = 0.005 * k;
        bslam_sighting_t seen[3];
        int count = 0;
        for (int b = 0; b < 2; b++) {
            seen[count++] = seen_at(posts[b][0], posts[b][1], way_m, has_labels ? b : BSLAM_LABEL_NONE);
        }
        if (k == 98 || k == 99) {
            seen[count++] = unit_polar(-0.1, 1.5, BSLAM_LABEL_NONE);
        }
        const bslam_status_t status = roll(time_us, k > 0 ? 0.005 : 0, k > 0 ? 0.005 : 0);
        const bool may_be_refused = !is_told && k >= 100 && k < 126;
        assert_int_equal(status, may_be_refused && status != BSLAM_OK ? BSLAM_E_TIME : BSLAM_OK);
        assert_int_equal(bslam_sightings(&robot, time_us, seen, count), status);
    }
}

static const int64_t clocks_us[][2] = {{1000000000, 0},
                                       {1000000000, 1004000000},
                                       {5, 0},
                                       {0, INT64_C(86400000000)},
                                       {INT64_C(1700000000000000), 1}};

static void test_clock_that_begins_again_keeps_nothing_waiting(void **state)
{
    static const int32_t methods[] = {BSLAM_ASSOCIATION_NEAREST, BSLAM_ASSOCIATION_MAHALANOBIS,
                                      BSLAM_ASSOCIATION_SVM, BSLAM_ASSOCIATION_JOINT};
    for (int i = 0; i < COUNT_OF(clocks_us); i++) {
        for (int m = 0; m < COUNT_OF(methods); m++) {
            settings.association = methods[m];
            start();
            drive_over_a_new_clock(clocks_us[i][0], clocks_us[i][1], true, false);
            assert_int_equal(bslam_health(&robot).beacons, 2);  // what stands nowhere has left
            assert_int_equal(counted().clock_restarts, 0);
            assert_way(0.005 * 399, 3);
        }
    }
}

static void test_clock_that_begins_again_with_recovery_is_as_any(void **state)
{
    settings.recovery = 1;
    for (int i = 0; i < COUNT_OF(clocks_us); i++) {
        start();
        drive_over_a_new_clock(clocks_us[i][0], clocks_us[i][1], true, true);
        assert_int_equal(bslam_health(&robot).state, BSLAM_RECOVERY_FOLLOWING);
        assert_way(0.005 * 399, 3);
    }
}

/// Nobody says so: readings are refused for a second, and then go on.
static void test_clock_that_begins_again_untold_goes_on_after_a_second(void **state)
{
    static const int64_t untold_us[][2] = {{1000000000, 0},
                                           {0, INT64_C(86400000000)},
                                           {INT64_C(1700000000000000), 1},
                                           {INT64_C(4294967296), 20000}};
    for (int i = 0; i < COUNT_OF(untold_us); i++) {
        start();
        drive_over_a_new_clock(untold_us[i][0], untold_us[i][1], false, true);
        assert_int_equal(counted().clock_restarts, 1);
        assert_int_equal(counted().odometry_refused, 25);
        assert_int_equal(bslam_health(&robot).beacons, 2);
        assert_way(0.005 * 399, 3);
    }
}

/// Readings wait when the clock begins again: they are gone through first.
static void test_clock_that_begins_again_while_readings_wait_loses_none_of_them(void **state)
{
    start();
    for (int k = 1; k <= 10; k++) {
        assert_int_equal(roll(1000000000 + (int64_t)k * STEP_US, 0.01, 0.01), BSLAM_OK);
    }
    for (int k = 0; k < 26; k++) {
        assert_int_equal(roll((int64_t)k * STEP_US, 0, 0), k < 25 ? BSLAM_E_TIME : BSLAM_OK);
    }
    assert_near(bslam_pose(&robot).x_m, 0.09, 1e-5);  // the first of all had no interval
    const bslam_sighting_t post = seen_at(3, 1, 0.09, 5);
    assert_int_equal(bslam_sightings(&robot, 25 * STEP_US, &post, 1), BSLAM_OK);
    assert_int_equal(bslam_results(&robot, &(int){0})->outcome, BSLAM_OUTCOME_NEW);
}

/// Single stamps that are wrong, or old readings that come again, are no clock that begins again.
static void test_clock_stays_where_single_stamps_are_wrong(void **state)
{
    static const int64_t wrong_us[] = {0, 1000000, INT64_C(86400000000), 1000000000};
    for (int i = 0; i < COUNT_OF(wrong_us); i++) {
        start();
        for (int k = 0; k < 1000; k++) {
            const int64_t time_us = 1000000000 + (int64_t)k * STEP_US;
            assert_int_equal(roll(time_us, 0.005, 0.005), BSLAM_OK);
            const int64_t odd_us =
                wrong_us[i] < 1000000000 ? wrong_us[i] + (int64_t)k * STEP_US : wrong_us[i];
            if (k % 2 == 0 && odd_us != time_us) {
                assert_int_equal(roll(odd_us, 1, 1), BSLAM_E_TIME);
            }
        }
        assert_int_equal(counted().clock_restarts, 0);
        assert_near(bslam_pose(&robot).x_m, 0.005 * 999, 1e-3);
    }
}

static void test_clock_does_not_begin_again_with_a_reading_that_is_refused(void **state)
{
    start();
    assert_int_equal(roll(1000000000, 0, 0), BSLAM_OK);
    for (int k = 0; k < 60; k++) {
        assert_int_equal(roll((int64_t)k * STEP_US, NAN, 0), k < 25 ? BSLAM_E_TIME : BSLAM_E_NOT_FINITE);
    }
    assert_int_equal(counted().clock_restarts, 0);
    assert_int_equal(roll(60 * STEP_US, 0, 0), BSLAM_OK);
    assert_int_equal(counted().clock_restarts, 1);
}

// ---- cameras ----------------------------------------------------------------------------------------------

typedef struct camera {
    int every, late;  ///< a frame in so many steps, handed over so many steps after it was taken
    double x_m, y_m;  ///< of the one beacon that it sees
} camera_t;

/// 12 s at 0.25 m/s, and what the cameras see. Every frame is taken, and its sighting used.
static void drive_with(const camera_t *cameras, int count)
{
    int frames = 0;
    for (int k = 0; k < 300; k++) {
        assert_int_equal(roll((int64_t)k * STEP_US, k > 0 ? 0.01 : 0, k > 0 ? 0.01 : 0), BSLAM_OK);
        for (int c = 0; c < count; c++) {
            const int taken = k - cameras[c].late;
            if (taken < 0 || taken % cameras[c].every != 0) {
                continue;
            }
            const bslam_sighting_t seen = seen_at(cameras[c].x_m, cameras[c].y_m, 0.01 * taken, c);
            assert_int_equal(bslam_sightings(&robot, (int64_t)taken * STEP_US, &seen, 1), BSLAM_OK);
            const bslam_account_t *account = bslam_results(&robot, &(int){0});
            assert_int_equal(account->outcome, taken == 0 ? BSLAM_OUTCOME_NEW : BSLAM_OUTCOME_MATCHED);
            frames++;
        }
    }
    assert_int_equal(counted().frames, frames);
    assert_int_equal(counted().frames_refused, 0);
    assert_int_equal(bslam_health(&robot).beacons, count);
    assert_way(2.99, 3);
    for (int c = 0; c < count; c++) {
        bslam_beacon_view_t view;
        assert_int_equal(bslam_beacon(&robot, c, &view), BSLAM_OK);
        assert_near(view.x_m, cameras[view.label].x_m, 0.1);
        assert_near(view.y_m, cameras[view.label].y_m, 0.1);
    }
}

static void test_cameras_of_other_delays_are_all_used_in_any_order(void **state)
{
    static const int lates[][3] = {{0, 0, 0}, {0, 1, 2}, {5, 0, 3}, {2, 2, 9}, {0, 12, 6}, {1, 0, 0}};
    for (int filter = BSLAM_FILTER_STANDARD; filter <= BSLAM_FILTER_SMOOTHER; filter++) {
        for (int speeds = 0; speeds < 2; speeds++) {
            for (int i = 0; i < COUNT_OF(lates); i++) {
                const camera_t cameras[3] = {
                    {3, lates[i][0], 5, 1}, {3, lates[i][1], -3, 1}, {2, lates[i][2], 1, 4}};
                settings.filter = filter;
                settings.velocity_states = speeds;
                start();
                drive_with(cameras, 3);
            }
        }
    }
}

/// A frame that is late by less than another camera's says as much as if it had come in time, but for the
/// noise of the way since.
static void test_cameras_late_frame_is_as_good_as_one_in_time(void **state)
{
    double sds_m[2];
    settings.left_speed_sd_mps = settings.right_speed_sd_mps = BSLAM_R(0.01);
    for (int late = 0; late < 2; late++) {
        const camera_t cameras[2] = {{3, 0, 5, 1}, {3, late ? 4 : 0, -3, 1}};
        start();
        drive_with(cameras, 2);
        bslam_real_t lower[6];
        bslam_pose_covariance(&robot, lower);
        sds_m[late] = sqrt((double)(lower[0] + lower[2]));
    }
    assert_true(sds_m[1] < 1.1 * sds_m[0]);
}

static void test_cameras_frame_that_comes_again_is_refused(void **state)
{
    start();
    for (int k = 0; k < 60; k++) {
        const int64_t time_us = (int64_t)k * STEP_US;
        assert_int_equal(roll(time_us, 0, 0), BSLAM_OK);
        const bslam_sighting_t seen[2] = {seen_at(5, 1 + 1e-3 * k, 0, 3), seen_at(-3, 1, 0, 4)};
        assert_int_equal(bslam_sightings(&robot, time_us, &seen[0], 1), BSLAM_OK);
        assert_int_equal(bslam_sightings(&robot, time_us, &seen[1], 1), BSLAM_OK);
        const uint64_t before = bslam_fingerprint(&robot, 0);
        assert_int_equal(bslam_sightings(&robot, time_us, &seen[0], 1), BSLAM_E_TIME);
        if (k >= 3) {
            const bslam_sighting_t old = seen_at(5, 1 + 1e-3 * (k - 3), 0, 3);
            assert_int_equal(bslam_sightings(&robot, time_us - 3 * STEP_US, &old, 1), BSLAM_E_TIME);
        }
        assert_true(bslam_fingerprint(&robot, 0) == before);
    }
}

static void test_cameras_frame_older_than_odometry_is_remembered_is_refused(void **state)
{
    start();
    const bslam_sighting_t seen = seen_at(5, 1, 0, 3);
    for (int k = 0; k < 60; k++) {
        assert_int_equal(roll((int64_t)k * STEP_US, 0, 0), BSLAM_OK);
        assert_int_equal(bslam_sightings(&robot, (int64_t)k * STEP_US, &seen, 1), BSLAM_OK);
    }
    const int64_t oldest_us = (int64_t)(59 - BSLAM_HISTORY_MAX) * STEP_US;
    assert_int_equal(bslam_sightings(&robot, oldest_us - 1, &seen, 1), BSLAM_E_TIME);
    assert_int_equal(bslam_sightings(&robot, oldest_us + 1, &seen, 1), BSLAM_OK);
}

// ---- labels -----------------------------------------------------------------------------------------------

typedef struct mirrored {
    uint32_t matched, duplicates;
    bslam_pose_t pose;
} mirrored_t;

/// Tag 3 is seen for `from` steps, then its mirror image as well.
static mirrored_t drive_by_a_mirror(bool mirror_first, bool has_range, int from)
{
    start();
    for (int k = 0; k < 400; k++) {
        const double way_m = 0.01 * k;
        bslam_sighting_t real_one = seen_at(6, 1, way_m, 3);
        bslam_sighting_t mirror =
            unit_polar((double)real_one.bearing_rad + 0.9, (double)real_one.range_m / 2, 3);
        mirror.has_range = has_range;
        const bool is_double = k >= from;
        const bslam_sighting_t seen[2] = {is_double && mirror_first ? mirror : real_one,
                                          mirror_first ? real_one : mirror};
        assert_int_equal(roll((int64_t)k * STEP_US, k > 0 ? 0.01 : 0, k > 0 ? 0.01 : 0), BSLAM_OK);
        assert_int_equal(bslam_sightings(&robot, (int64_t)k * STEP_US, seen, is_double ? 2 : 1), BSLAM_OK);
    }
    return (mirrored_t){counted().matched, counted().duplicates, bslam_pose(&robot)};
}

static void test_label_twice_in_a_frame_is_used_once_in_either_order(void **state)
{
    static const int from[] = {0, 1, 25, 100};
    for (int i = 0; i < COUNT_OF(from); i++) {
        for (int has_range = 0; has_range < 2; has_range++) {
            const mirrored_t last = drive_by_a_mirror(false, has_range != 0, from[i]);
            const mirrored_t first = drive_by_a_mirror(true, has_range != 0, from[i]);
            assert_int_equal(first.matched, last.matched);
            assert_int_equal(first.duplicates, 400 - from[i]);
            assert_int_equal(last.duplicates, 400 - from[i]);
            assert_near(first.pose.x_m, last.pose.x_m, 1e-5);
            assert_near(first.pose.y_m, last.pose.y_m, 1e-5);
            if (from[i] >= 25) {  // the map knows by then where it stands
                assert_int_equal(first.matched, 399);
                assert_near(first.pose.x_m, 3.99, 0.02);
                assert_near(first.pose.y_m, 0, 0.02);
            }
        }
    }
}

// ---- counters ---------------------------------------------------------------------------------------------

static bslam_status_t tick(int64_t time_us, uint32_t left, uint32_t right)
{
    const bslam_odometry_reading_t ticks = {
        .time_us = time_us, .source = BSLAM_ODOMETRY_TICKS, .left_ticks = left, .right_ticks = right};
    return bslam_odometry(&robot, &ticks);
}

static void set_encoders(void)
{
    settings.left_speed_sd_mps = settings.right_speed_sd_mps = 0;
    settings.travel_sd_per_sqrt_m = BSLAM_R(0.02);
    settings.speed_max_mps = 2;
}

static void test_one_odd_count_in_twenty_costs_no_way(void **state)
{
    const double m_per_tick = 2 * PI * 0.05 / 1024;
    static const uint32_t odd[] = {65535, 0, 0x8000};
    static const int everies[] = {3, 7, 20};
    set_encoders();
    for (int i = 0; i < COUNT_OF(odd) * COUNT_OF(everies); i++) {
        const int every = everies[i % COUNT_OF(everies)];
        uint32_t odd_ones = 0;
        start();
        for (int k = 0; k <= 1000; k++) {
            const uint32_t count = (uint32_t)(0.02 * k / m_per_tick) & 0xffffu;
            // What is nearer might be motion, which the next count takes back.
            const bool is_odd =
                k < 1000 && k % every == every / 2 && abs((int16_t)(odd[i / 3] - count)) > 600;
            odd_ones += is_odd ? 1 : 0;
            assert_int_equal(tick((int64_t)k * STEP_US, is_odd ? odd[i / 3] : count, count),
                             is_odd ? BSLAM_E_JUMP : BSLAM_OK);
        }
        assert_int_equal(counted().jumps, odd_ones);
        assert_near(bslam_pose(&robot).x_m, 20, 0.005);  // of ticks cut off
        assert_way(20, 3);
    }
}

/// The counters count one turn, or any other number; forward, back, and turning.
static void test_counters_of_any_modulus_tell_the_way(void **state)
{
    static const int32_t moduli[] = {2400, 1000, 4096, 65536, 40000};
    set_encoders();
    for (int i = 0; i < COUNT_OF(moduli); i++) {
        for (int back = 0; back < 2; back++) {
            settings.counter_modulus = moduli[i];
            settings.ticks_per_revolution = 2400;
            settings.left_radius_m = settings.right_radius_m = BSLAM_R(0.033);
            start();
            const double ticks_per_m = 2400 / (2 * PI * 0.033);
            for (int k = 0; k <= 500; k++) {
                const double way_m = (back ? -0.01 : 0.01) * k;
                uint32_t counts[2];
                for (int side = 0; side < 2; side++) {
                    const int64_t ticks = (int64_t)floor((way_m + 0.07 * side) * ticks_per_m) + 1000 * 65536;
                    counts[side] = (uint32_t)(ticks % moduli[i]);
                }
                assert_int_equal(tick((int64_t)k * 20000, counts[0], counts[1]), BSLAM_OK);
            }
            assert_near(bslam_pose(&robot).x_m, back ? -5 : 5, 0.005);
            assert_near(bslam_pose(&robot).y_m, 0, 0.02);
            assert_int_equal(tick(501 * 20000, (uint32_t)moduli[i], 0), BSLAM_E_RANGE);
        }
    }
}

// ---- places far from the origin ---------------------------------------------------------------------------

static void test_places_that_float_does_not_hold_are_refused(void **state)
{
    static const double far_m[] = {1000.1, 1e4, 448000, 5411000, 1e11};
    start();
    for (int i = 0; i < COUNT_OF(far_m); i++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            const bslam_real_t x = real(sign * far_m[i]);
            const bslam_pose_t poses[2] = {{x, 0, 0}, {0, x, 0}};
            const uint64_t before = bslam_fingerprint(&robot, 0);
            for (int axis = 0; axis < 2; axis++) {
                assert_int_equal(bslam_set_pose(&robot, &poses[axis], 0, 0), BSLAM_E_RANGE);
                if (far_m[i] > 1e4) {
                    assert_int_equal(bslam_add_known_beacon(&robot, 1, poses[axis].x_m, poses[axis].y_m),
                                     BSLAM_E_RANGE);
                }
            }
            assert_true(bslam_fingerprint(&robot, 0) == before);
        }
    }
    const bslam_pose_t turned = {0, 0, 1000};
    assert_int_equal(bslam_set_pose(&robot, &turned, 0, 0), BSLAM_E_RANGE);
    assert_int_equal(bslam_health(&robot).beacons, 0);
}

/// A plant at the end of what is allowed, its beacons known.
static void test_places_as_far_as_allowed_are_right(void **state)
{
    static const double stands[3][2] = {{8, 1}, {5, -3}, {-2, 2}};
    static const double corners[][2] = {{990, 990}, {-1000, 500}, {0, -1000}};
    for (int i = 0; i < COUNT_OF(corners); i++) {
        const double x0_m = corners[i][0];
        const double y0_m = corners[i][1];
        const bslam_pose_t at = {real(x0_m), real(y0_m), 0};
        start();
        assert_int_equal(bslam_set_pose(&robot, &at, BSLAM_R(0.01), BSLAM_R(0.01)), BSLAM_OK);
        for (int b = 0; b < 3; b++) {
            assert_int_equal(
                bslam_add_known_beacon(&robot, b, real(x0_m + stands[b][0]), real(y0_m + stands[b][1])),
                BSLAM_OK);
        }
        for (int k = 0; k < 250; k++) {
            bslam_sighting_t seen[3];
            for (int b = 0; b < 3; b++) {
                seen[b] = seen_at(stands[b][0], stands[b][1], 0.02 * k, b);
            }
            assert_int_equal(roll((int64_t)k * STEP_US, 0.02, 0.02), BSLAM_OK);
            assert_int_equal(bslam_sightings(&robot, (int64_t)k * STEP_US, seen, 3), BSLAM_OK);
        }
        const bslam_pose_t pose = bslam_pose(&robot);
        bslam_real_t lower[6];
        bslam_pose_covariance(&robot, lower);
        assert_near((double)pose.x_m - x0_m, 0.02 * 249, 3 * sqrt((double)lower[0]));
        assert_near((double)pose.y_m - y0_m, 0, 3 * sqrt((double)lower[2]));
        assert_int_equal(counted().gated, 0);
    }
}

/// 40 m without a sighting that helps: rounding is less than what the wheels err.
static void test_way_by_odometry_as_far_as_allowed_is_right(void **state)
{
    static const double from_m[] = {-1000, 0, 700, 1000};
    static const double steps_m[] = {0.016, 0.0061, 0.0333};
    for (int i = 0; i < COUNT_OF(from_m) * COUNT_OF(steps_m); i++) {
        const double step_m = steps_m[i / COUNT_OF(from_m)];
        const bslam_pose_t at = {real(from_m[i % COUNT_OF(from_m)]), 0, 0};
        start();
        assert_int_equal(bslam_set_pose(&robot, &at, BSLAM_R(0.1), BSLAM_R(0.05)), BSLAM_OK);
        for (int k = 0; k <= 2500; k++) {
            assert_int_equal(roll((int64_t)k * STEP_US, step_m, step_m), BSLAM_OK);
        }
        bslam_real_t lower[6];
        bslam_pose_covariance(&robot, lower);
        assert_near((double)bslam_pose(&robot).x_m - (double)at.x_m, 2500 * step_m, sqrt((double)lower[0]));
    }
}

/// A robot that has driven out of the map goes on, but begins no beacon there.
static void test_beacon_beyond_the_map_is_not_begun(void **state)
{
    start();
    const bslam_sighting_t seen[] = {unit_polar(0, 9999, 1), unit_polar(PI, 9999, 2),
                                     unit_polar(0, 10000, 3)};
    const bslam_pose_t at = {10, 0, 0};
    assert_int_equal(bslam_set_pose(&robot, &at, 0, 0), BSLAM_OK);
    assert_int_equal(bslam_sightings(&robot, 0, seen, 3), BSLAM_OK);
    const bslam_account_t *accounts = bslam_results(&robot, &(int){0});
    assert_int_equal(accounts[0].reason, BSLAM_REASON_MAP_FULL);
    assert_int_equal(accounts[1].outcome, BSLAM_OUTCOME_NEW);
    assert_int_equal(accounts[2].reason, BSLAM_REASON_MAP_FULL);
    assert_int_equal(counted().map_full, 2);
}

// ---- numbers of beacons -----------------------------------------------------------------------------------

static uint8_t blob[MAP_BYTES_MAX];

static uint32_t save(void)
{
    map_memory_t memory = {blob, sizeof blob, 0};
    const bslam_map_sink_t sink = map_to_memory(&memory);
    uint32_t bytes;
    assert_int_equal(bslam_save_map(&robot, &sink, &bytes), BSLAM_OK);
    return bytes;
}

static void load(uint32_t bytes)
{
    const bslam_map_source_t source = map_from_memory(blob, bytes);
    const bslam_pose_t origin = {0, 0, 0};
    bslam_map_fault_t fault;
    assert_int_equal(bslam_load_map(&robot, &source, &fault), BSLAM_OK);
    assert_int_equal(bslam_set_pose(&robot, &origin, BSLAM_R(0.1), BSLAM_R(0.05)), BSLAM_OK);
}

static void put_u32(uint32_t at, uint32_t value)
{
    for (uint32_t i = 0; i < 4; i++) {
        blob[at + i] = (uint8_t)(value >> 8 * i);
    }
}

/// Looks at beacons of these labels for 20 steps.
static void stand_before(int64_t *now_us, const int32_t *labels, int count)
{
    for (int k = 0; k < 20; k++) {
        bslam_sighting_t seen[4];
        for (int i = 0; i < count; i++) {
            seen[i] = unit_polar(0.4 * labels[i] - 2, 2 + 0.2 * labels[i], labels[i]);
        }
        *now_us += STEP_US;
        assert_int_equal(roll(*now_us, 1e-3, 1e-3), BSLAM_OK);
        assert_int_equal(bslam_sightings(&robot, *now_us, seen, count), BSLAM_OK);
    }
}

static uint32_t uid_of(int32_t label)
{
    bslam_beacon_view_t view;
    for (int i = 0; bslam_beacon(&robot, i, &view) == BSLAM_OK; i++) {
        if (view.label == label) {
            return view.uid;
        }
    }
    fail_msg("no beacon of label %d", (int)label);
    return 0;
}

static void test_uid_is_not_given_again_after_a_load(void **state)
{
    int64_t now_us = 0;
    start();
    stand_before(&now_us, (int32_t[]){1, 2}, 2);
    const uint32_t bytes = save();
    assert_int_equal(bslam_remove_beacon(&robot, uid_of(2)), BSLAM_OK);
    stand_before(&now_us, (int32_t[]){1, 5, 6}, 3);
    const uint32_t last = uid_of(6) > uid_of(5) ? uid_of(6) : uid_of(5);
    load(bytes);
    stand_before(&now_us, (int32_t[]){1, 2, 7}, 3);
    assert_true(uid_of(7) > last);
    load(save());
    assert_int_equal(bslam_remove_beacon(&robot, BSLAM_ALL_BEACONS), BSLAM_OK);
    const uint32_t newest = last + 1;
    stand_before(&now_us, (int32_t[]){8}, 1);
    assert_true(uid_of(8) > newest);
}

/// The last uids are given, none a second time, and the map that says so is one that loads.
static void test_uids_come_to_an_end_and_the_map_is_full(void **state)
{
    int64_t now_us = 0;
    start();
    stand_before(&now_us, (int32_t[]){1, 2}, 2);
    const uint32_t bytes = save();
    for (uint32_t left = 0; left < 3; left++) {
        put_u32(20, UINT32_MAX - left);
        put_u32(bytes - 4, ~bslam_crc32_add(BSLAM_CRC32_START, blob, bytes - 4));
        start();
        load(bytes);
        stand_before(&now_us, (int32_t[]){1, 2, 5, 6}, 4);
        assert_int_equal(bslam_health(&robot).beacons, 2 + (int)left);
        for (uint32_t i = 0; i < left; i++) {
            assert_true(uid_of(5 + (int32_t)i) == UINT32_MAX - left + i);
        }
        assert_true(left == 2 || counted().map_full > 0);
        assert_int_equal(bslam_add_known_beacon(&robot, 77, 1, 1), BSLAM_E_MAP_FULL);
        load(save());
        assert_int_equal(bslam_health(&robot).beacons, 2 + (int)left);
        start();
        stand_before(&now_us, (int32_t[]){1, 2}, 2);
        assert_int_equal(save(), bytes);
    }
}

// ---- noise ------------------------------------------------------------------------------------------------

static void test_noise_of_zero_is_refused_by_name(void **state)
{
    int bad_setting = -1;
    settings.range_sd_floor_m = settings.range_sd_fraction = settings.range_sd_per_m = 0;
    assert_int_equal(bslam_init(&robot, &settings, &bad_setting), BSLAM_E_PARAMETER);
    assert_string_equal(bslam_settings_info(bad_setting)->name, "range_sd_floor_m");
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    static const double none[] = {0, -1, NAN};
    for (int i = 0; i < COUNT_OF(none); i++) {
        settings.bearing_sd_rad = real(none[i]);
        assert_int_equal(bslam_init(&robot, &settings, &bad_setting), BSLAM_E_PARAMETER);
        assert_string_equal(bslam_settings_info(bad_setting)->name, "bearing_sd_rad");
    }
}

/// A sighting's own noise: 0 says "as the settings", less than the least is refused.
static void test_noise_of_a_sighting_that_is_none_is_refused(void **state)
{
    static const double none[] = {-1e-3, 1e-9, 1e-40, NAN, INFINITY};
    start();
    for (int i = 0; i < COUNT_OF(none); i++) {
        bslam_sighting_t seen[2] = {seen_at(5, 1, 0, 1), seen_at(3, 1, 0, 2)};
        seen[1].range_sd_m = real(none[i]);
        assert_int_not_equal(bslam_sightings(&robot, STEP_US, seen, 2), BSLAM_OK);
        assert_int_equal(bslam_health(&robot).bad_sighting, 1);
        seen[1].range_sd_m = 0;
        seen[0].bearing_sd_rad = real(none[i]);
        assert_int_not_equal(bslam_sightings(&robot, STEP_US, seen, 2), BSLAM_OK);
        assert_int_equal(bslam_health(&robot).bad_sighting, 0);
    }
    assert_int_equal(counted().frames_refused, 2 * COUNT_OF(none));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_clock_that_begins_again_keeps_nothing_waiting, setup),
        cmocka_unit_test_setup(test_clock_that_begins_again_with_recovery_is_as_any, setup),
        cmocka_unit_test_setup(test_clock_that_begins_again_untold_goes_on_after_a_second, setup),
        cmocka_unit_test_setup(test_clock_that_begins_again_while_readings_wait_loses_none_of_them, setup),
        cmocka_unit_test_setup(test_clock_stays_where_single_stamps_are_wrong, setup),
        cmocka_unit_test_setup(test_clock_does_not_begin_again_with_a_reading_that_is_refused, setup),

        cmocka_unit_test_setup(test_cameras_of_other_delays_are_all_used_in_any_order, setup),
        cmocka_unit_test_setup(test_cameras_late_frame_is_as_good_as_one_in_time, setup),
        cmocka_unit_test_setup(test_cameras_frame_that_comes_again_is_refused, setup),
        cmocka_unit_test_setup(test_cameras_frame_older_than_odometry_is_remembered_is_refused, setup),

        cmocka_unit_test_setup(test_label_twice_in_a_frame_is_used_once_in_either_order, setup),

        cmocka_unit_test_setup(test_one_odd_count_in_twenty_costs_no_way, setup),
        cmocka_unit_test_setup(test_counters_of_any_modulus_tell_the_way, setup),

        cmocka_unit_test_setup(test_places_that_float_does_not_hold_are_refused, setup),
        cmocka_unit_test_setup(test_places_as_far_as_allowed_are_right, setup),
        cmocka_unit_test_setup(test_way_by_odometry_as_far_as_allowed_is_right, setup),
        cmocka_unit_test_setup(test_beacon_beyond_the_map_is_not_begun, setup),

        cmocka_unit_test_setup(test_uid_is_not_given_again_after_a_load, setup),
        cmocka_unit_test_setup(test_uids_come_to_an_end_and_the_map_is_full, setup),

        cmocka_unit_test_setup(test_noise_of_zero_is_refused_by_name, setup),
        cmocka_unit_test_setup(test_noise_of_a_sighting_that_is_none_is_refused, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
