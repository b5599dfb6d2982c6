#include "covariance.h"
#include "support.h"

#include <math.h>

#include "bslam/internal.h"
#include "plain_settings.h"

#define STEP_US 40000
#define STEP_S 0.04
#define PI 3.141592653589793

/// Some dozen roundings of positions up to 10 m.
#define POSITION_ERROR (BSLAM_REAL_DOUBLE ? 1e-12 : 2e-5)

// ---- the unit under test ----------------------------------------------------------------------------------

static bslam_slam_t started(bslam_settings_t settings)
{
    bslam_slam_t slam;
    int bad_id = -1;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    return slam;
}

static bslam_odometry_reading_t wheels(int64_t time_us, double left_m, double right_m)
{
    return (bslam_odometry_reading_t){.time_us = time_us,
                                      .source = BSLAM_ODOMETRY_WHEELS,
                                      .left_m = real(left_m),
                                      .right_m = real(right_m)};
}

static void drive(bslam_slam_t *slam, int64_t time_us, double left_m, double right_m)
{
    const bslam_odometry_reading_t reading = wheels(time_us, left_m, right_m);
    assert_int_equal(bslam_slam_odometry(slam, &reading), BSLAM_OK);
}

/// Drives `steps` steps on a circle from start_us on: 0.5 m/s, 1 rad/s to the left.
static void drive_circle(bslam_slam_t *slam, int64_t start_us, int steps)
{
    for (int i = 0; i < steps; i++) {
        drive(slam, start_us + (int64_t)i * STEP_US, 0.3 * STEP_S, 0.7 * STEP_S);
    }
}

static void see(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings, int count)
{
    assert_int_equal(bslam_slam_sightings(slam, time_us, sightings, count), BSLAM_OK);
}

static void see_one(bslam_slam_t *slam, int64_t time_us, bslam_sighting_t sighting)
{
    see(slam, time_us, &sighting, 1);
}

static const bslam_account_t *account(const bslam_slam_t *slam, int i)
{
    assert_true(i < slam->account_count);
    return &slam->accounts[i];
}

static bslam_beacon_view_t beacon(const bslam_slam_t *slam, int index)
{
    bslam_beacon_view_t view;
    assert_int_equal(bslam_slam_beacon(slam, index, &view), BSLAM_OK);
    return view;
}

static void assert_account(const bslam_slam_t *slam, int i, bslam_outcome_t outcome, bslam_reason_t reason)
{
    assert_int_equal(account(slam, i)->outcome, outcome);
    assert_int_equal(account(slam, i)->reason, reason);
}

/// How a beacon at (x_m, y_m) of the map looks from a pose.
static bslam_sighting_t look(const bslam_pose_t *pose, double x_m, double y_m, int32_t label)
{
    const double dx = x_m - (double)pose->x_m;
    const double dy = y_m - (double)pose->y_m;
    return unit_polar(unit_angle_between(atan2(dy, dx), (double)pose->theta_rad), hypot(dx, dy), label);
}

static void assert_pose(bslam_pose_t actual, bslam_pose_t expected)
{
    assert_near(actual.x_m, expected.x_m, POSITION_ERROR);
    assert_near(actual.y_m, expected.y_m, POSITION_ERROR);
    assert_near(unit_angle_between((double)actual.theta_rad, (double)expected.theta_rad), 0, POSITION_ERROR);
}

// ---- refusals: every byte but the counters stays ----------------------------------------------------------

/// Fails unless `after` is `before` to the byte, counters and the place of the bad sighting apart.
static void assert_unchanged(bslam_slam_t *after, const bslam_slam_t *before)
{
    after->counters = before->counters;
    after->bad_sighting = before->bad_sighting;
    after->watch = before->watch;  // of stamps that were refused
    assert_memory_equal(after, before, sizeof *after);
}

static void assert_frame_refused(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings,
                                 int count, bslam_status_t expected, int bad_sighting)
{
    bslam_slam_t before;
    memcpy(&before, slam, sizeof before);
    assert_int_equal(bslam_slam_sightings(slam, time_us, sightings, count), expected);
    assert_int_equal(slam->bad_sighting, bad_sighting);
    assert_int_equal(slam->counters.frames_refused, before.counters.frames_refused + 1);
    assert_unchanged(slam, &before);
}

static void assert_odometry_refused(bslam_slam_t *slam, bslam_odometry_reading_t reading,
                                    bslam_status_t expected)
{
    bslam_slam_t before;
    memcpy(&before, slam, sizeof before);
    assert_int_equal(bslam_slam_odometry(slam, &reading), expected);
    const uint32_t jumps = expected == BSLAM_E_JUMP ? 1 : 0;
    assert_int_equal(slam->counters.odometry_refused, before.counters.odometry_refused + 1);
    assert_int_equal(slam->counters.jumps, before.counters.jumps + jumps);
    assert_unchanged(slam, &before);
}

/// Settings of a refusal's test: of the filter that its state names, or of the one that needs none.
static bslam_settings_t refusing_params(void **state)
{
    bslam_settings_t settings = unit_settings();
    if (*state != NULL) {
        settings.filter = *(const int32_t *)*state;
        settings.velocity_states = 1;
    }
    return settings;
}

/// A robot that has driven and mapped a little, at 400 ms.
static bslam_slam_t running(bslam_settings_t settings)
{
    bslam_slam_t slam = started(settings);
    const bslam_sighting_t seen[] = {unit_polar(0.3, 4, 1), unit_polar(-0.8, 3, 2), unit_direction(1.2, 3)};
    see(&slam, 0, seen, COUNT_OF(seen));
    drive_circle(&slam, STEP_US, 10);
    see(&slam, 10 * STEP_US, seen, COUNT_OF(seen));
    return slam;
}

static void test_init_bad_parameter_is_refused_and_changes_nothing(void **state)
{
    bslam_slam_t slam;
    bslam_slam_t before;
    memset(&slam, 0x33, sizeof slam);
    memcpy(&before, &slam, sizeof slam);
    bslam_settings_t settings = unit_settings();
    settings.wheelbase_m = -1;
    int bad_id = -1;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_E_PARAMETER);
    assert_string_equal(bslam_settings_info(bad_id)->name, "wheelbase_m");
    assert_memory_equal(&slam, &before, sizeof slam);
}

static void test_odometry_every_refusal_changes_nothing(void **state)
{
    bslam_slam_t slam = running(refusing_params(state));
    const int64_t next_us = 11 * STEP_US;
    assert_odometry_refused(&slam, wheels(10 * STEP_US, 0, 0), BSLAM_E_TIME);
    assert_odometry_refused(&slam, wheels(0, 0, 0), BSLAM_E_TIME);
    assert_odometry_refused(&slam, wheels(-1, 0, 0), BSLAM_E_TIME);
    assert_odometry_refused(&slam, wheels(INT64_MAX, 0, 0), BSLAM_E_TIME);
    assert_odometry_refused(&slam, wheels(INT64_MIN, 0, 0), BSLAM_E_TIME);
    assert_odometry_refused(&slam, wheels(next_us, NAN, 0), BSLAM_E_NOT_FINITE);
    assert_odometry_refused(&slam, wheels(next_us, 0, INFINITY), BSLAM_E_NOT_FINITE);
    assert_odometry_refused(&slam, wheels(next_us, 100, 0), BSLAM_E_JUMP);
    const bslam_odometry_reading_t wide = {
        .time_us = next_us, .source = BSLAM_ODOMETRY_TICKS, .left_ticks = UINT32_MAX};
    assert_odometry_refused(&slam, wide, BSLAM_E_RANGE);
    drive(&slam, next_us, 0.01, 0.01);
    // And where no more may wait, so that the next reading makes the filter go on.
    drive_circle(&slam, 12 * STEP_US, BSLAM_HISTORY_MAX);
    assert_odometry_refused(&slam, wheels(next_us, 0, 0), BSLAM_E_TIME);
    assert_odometry_refused(&slam, wheels((int64_t)(12 + BSLAM_HISTORY_MAX) * STEP_US, 100, 0), BSLAM_E_JUMP);
}

static void test_odometry_without_noise_for_velocity_states_is_refused_and_changes_nothing(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 1;
    // Positive, so it passes the check; its square is zero.
    settings.left_speed_sd_mps = settings.right_speed_sd_mps = real(BSLAM_REAL_DOUBLE ? 1e-200 : 1e-30);
    bslam_slam_t slam = started(settings);
    drive(&slam, 0, 0, 0);
    assert_odometry_refused(&slam, wheels(STEP_US, 0.01, 0.01), BSLAM_E_SINGULAR);
}

static void test_sightings_wrong_count_is_refused_and_changes_nothing(void **state)
{
    bslam_slam_t slam = running(refusing_params(state));
    bslam_sighting_t many[BSLAM_SIGHTINGS_MAX + 1];
    for (int i = 0; i < COUNT_OF(many); i++) {
        many[i] = unit_polar(0.1 * i, 3, i);
    }
    const int64_t next_us = 11 * STEP_US;
    assert_frame_refused(&slam, next_us, many, BSLAM_SIGHTINGS_MAX + 1, BSLAM_E_COUNT, -1);
    assert_frame_refused(&slam, next_us, many, -1, BSLAM_E_COUNT, -1);
    assert_frame_refused(&slam, next_us, many, INT32_MAX, BSLAM_E_COUNT, -1);
    assert_frame_refused(&slam, next_us, many, INT32_MIN, BSLAM_E_COUNT, -1);
    see(&slam, next_us, many, BSLAM_SIGHTINGS_MAX);
}

static void test_sightings_wrong_time_is_refused_and_changes_nothing(void **state)
{
    bslam_settings_t settings = refusing_params(state);
    settings.ahead_max_us = 200000;
    bslam_slam_t slam = running(settings);
    const bslam_sighting_t seen = unit_polar(0.3, 4, 1);
    const int64_t now_us = 10 * STEP_US;
    static const int64_t outside_us[] = {-1, INT64_MIN, INT64_MAX, INT64_MAX / 2 + 1};
    for (int i = 0; i < COUNT_OF(outside_us); i++) {
        assert_frame_refused(&slam, outside_us[i], &seen, 1, BSLAM_E_TIME, -1);
    }
    // Too far ahead of the odometry.
    assert_frame_refused(&slam, now_us + 200001, &seen, 1, BSLAM_E_TIME, -1);
    see_one(&slam, now_us + 200000, seen);
}

static void test_sightings_older_than_the_history_are_refused_and_change_nothing(void **state)
{
    bslam_slam_t slam = started(refusing_params(state));
    const bslam_sighting_t seen = unit_polar(0.3, 4, 1);
    drive_circle(&slam, 0, BSLAM_HISTORY_MAX + 5);
    const int64_t newest_us = (int64_t)(BSLAM_HISTORY_MAX + 4) * STEP_US;
    const int64_t oldest_us = newest_us - (int64_t)BSLAM_HISTORY_MAX * STEP_US;
    assert_frame_refused(&slam, oldest_us - 1, &seen, 1, BSLAM_E_TIME, -1);
    see_one(&slam, oldest_us, seen);
}

static void test_sightings_bad_sighting_is_named_and_changes_nothing(void **state)
{
    static const struct {
        double bearing_rad;
        double range_m;
        int32_t label;
        bslam_status_t expected;
    } cases[] = {
        {NAN, 3, 1, BSLAM_E_NOT_FINITE},
        {INFINITY, 3, 1, BSLAM_E_NOT_FINITE},
        {-INFINITY, 3, 1, BSLAM_E_NOT_FINITE},
        {1e13, 3, 1, BSLAM_E_NOT_FINITE},
        {0, NAN, 1, BSLAM_E_NOT_FINITE},
        {0, INFINITY, 1, BSLAM_E_NOT_FINITE},
        {0, 0, 1, BSLAM_E_RANGE},
        {0, -1, 1, BSLAM_E_RANGE},
        {0, 0.0009, 1, BSLAM_E_RANGE},
        {0, 10001, 1, BSLAM_E_RANGE},
        {6.2832, 3, 1, BSLAM_E_RANGE},
        {-6.2832, 3, 1, BSLAM_E_RANGE},
        {100, 3, 1, BSLAM_E_RANGE},
        {0, 3, -2, BSLAM_E_RANGE},
        {0, 3, INT32_MIN, BSLAM_E_RANGE},
    };
    bslam_slam_t slam = running(refusing_params(state));
    for (int i = 0; i < COUNT_OF(cases); i++) {
        bslam_sighting_t seen[] = {unit_polar(0.3, 4, 1), unit_polar(-0.8, 3, 2), unit_polar(0, 5, 9)};
        seen[2] = unit_polar(cases[i].bearing_rad, cases[i].range_m, cases[i].label);
        assert_frame_refused(&slam, 11 * STEP_US, seen, 3, cases[i].expected, 2);
        seen[0] = seen[2];
        assert_frame_refused(&slam, 11 * STEP_US, seen, 3, cases[i].expected, 0);
    }
    // The detector's noise: not below the least, not beyond the largest, not without a value.
    const struct {
        double bearing_sd_rad;
        double range_sd_m;
        double range_scale_sd;
        bslam_status_t expected;
    } noises[] = {
        {NAN, 0, 0, BSLAM_E_NOT_FINITE},      {0, NAN, 0, BSLAM_E_NOT_FINITE},
        {INFINITY, 0, 0, BSLAM_E_NOT_FINITE}, {-0.01, 0, 0, BSLAM_E_RANGE},
        {9e-6, 0, 0, BSLAM_E_RANGE},          {3.2, 0, 0, BSLAM_E_RANGE},
        {0, -0.01, 0, BSLAM_E_RANGE},         {0, 9e-4, 0, BSLAM_E_RANGE},
        {0, 10001, 0, BSLAM_E_RANGE},         {0, 0, NAN, BSLAM_E_NOT_FINITE},
        {0, 0, -0.01, BSLAM_E_RANGE},         {0, 0, 1.01, BSLAM_E_RANGE},
    };
    for (int i = 0; i < COUNT_OF(noises); i++) {
        bslam_sighting_t seen[] = {unit_polar(0.3, 4, 1), unit_polar(-0.8, 3, 2)};
        seen[1].bearing_sd_rad = (bslam_real_t)noises[i].bearing_sd_rad;
        seen[1].range_sd_m = (bslam_real_t)noises[i].range_sd_m;
        seen[1].range_scale_sd = (bslam_real_t)noises[i].range_scale_sd;
        assert_frame_refused(&slam, 11 * STEP_US, seen, 2, noises[i].expected, 1);
    }
    static const double scores[] = {NAN, INFINITY, 1.1e6, -1.1e6};
    for (int i = 0; i < COUNT_OF(scores); i++) {
        bslam_sighting_t seen[] = {unit_polar(0.3, 4, 1), unit_polar(-0.8, 3, 2)};
        seen[1].score = (bslam_real_t)scores[i];
        assert_frame_refused(&slam, 11 * STEP_US, seen, 2, i < 2 ? BSLAM_E_NOT_FINITE : BSLAM_E_RANGE, 1);
    }
    // A good frame forgets which sighting was bad.
    see_one(&slam, 11 * STEP_US, unit_polar(0.3, 4, 1));
    assert_int_equal(slam.bad_sighting, -1);
}

static void test_sightings_at_the_limits_of_their_fields_are_taken(void **state)
{
    bslam_slam_t slam = running(unit_settings());
    bslam_sighting_t seen[] = {unit_polar(6.283, 3, INT32_MAX), unit_polar(-6.283, 0.0011, 0),
                               unit_direction(0.5, 77), unit_polar(1, 10000, 5)};
    // Not read where there is none.
    seen[2].range_m = (bslam_real_t)NAN;
    see(&slam, 11 * STEP_US, seen, COUNT_OF(seen));
    for (int i = 0; i < COUNT_OF(seen); i++) {
        assert_account(&slam, i, BSLAM_OUTCOME_NEW, BSLAM_REASON_NONE);
    }
    assert_int_equal(slam.counters.insane, 0);
}

static void test_sightings_distance_that_a_direction_does_not_have_is_not_what_is_wrong(void **state)
{
    bslam_slam_t slam = running(refusing_params(state));
    bslam_sighting_t seen = unit_direction(100, 3);
    seen.range_m = real(NAN);
    assert_frame_refused(&slam, 11 * STEP_US, &seen, 1, BSLAM_E_RANGE, 0);
    seen.has_range = true;
    assert_frame_refused(&slam, 11 * STEP_US, &seen, 1, BSLAM_E_NOT_FINITE, 0);
}

static void test_add_known_beacon_every_refusal_changes_nothing(void **state)
{
    bslam_slam_t slam = running(refusing_params(state));
    const struct {
        int32_t label;
        double x_m;
        double y_m;
        bslam_status_t expected;
    } cases[] = {
        {9, NAN, 0, BSLAM_E_NOT_FINITE},  {9, 0, INFINITY, BSLAM_E_NOT_FINITE},
        {9, 1e13, 0, BSLAM_E_NOT_FINITE}, {-1, 0, 0, BSLAM_E_RANGE},
        {INT32_MIN, 0, 0, BSLAM_E_RANGE}, {2, 1, 1, BSLAM_E_DUPLICATE},
        {9, 10001, 0, BSLAM_E_RANGE},     {9, 0, -10001, BSLAM_E_RANGE},
        {9, 448000, 5e6, BSLAM_E_RANGE},
    };
    for (int i = 0; i < COUNT_OF(cases); i++) {
        bslam_slam_t before;
        memcpy(&before, &slam, sizeof before);
        assert_int_equal(
            bslam_slam_add_known_beacon(&slam, cases[i].label, real(cases[i].x_m), real(cases[i].y_m)),
            cases[i].expected);
        assert_memory_equal(&slam, &before, sizeof slam);
    }
}

static void test_add_known_beacon_to_a_full_map_is_refused_and_changes_nothing(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    for (int i = 0; i < BSLAM_BEACONS_MAX; i++) {
        assert_int_equal(bslam_slam_add_known_beacon(&slam, i, real(i + 1), 0), BSLAM_OK);
    }
    bslam_slam_t before;
    memcpy(&before, &slam, sizeof before);
    assert_int_equal(bslam_slam_add_known_beacon(&slam, BSLAM_BEACONS_MAX, 0, 0), BSLAM_E_MAP_FULL);
    assert_memory_equal(&slam, &before, sizeof slam);
}

static void test_remove_and_view_of_no_such_beacon_are_refused_and_change_nothing(void **state)
{
    bslam_slam_t slam = running(refusing_params(state));
    bslam_slam_t before;
    memcpy(&before, &slam, sizeof before);
    assert_int_equal(bslam_slam_remove_beacon(&slam, 3), BSLAM_E_NO_BEACON);
    assert_int_equal(bslam_slam_remove_beacon(&slam, UINT32_MAX), BSLAM_E_NO_BEACON);
    bslam_beacon_view_t view;
    memset(&view, 0x11, sizeof view);
    const bslam_beacon_view_t view_before = view;
    static const int outside[] = {-1, 3, INT32_MAX, INT32_MIN};
    for (int i = 0; i < COUNT_OF(outside); i++) {
        assert_int_equal(bslam_slam_beacon(&slam, outside[i], &view), BSLAM_E_NO_BEACON);
    }
    assert_memory_equal(&view, &view_before, sizeof view);
    assert_memory_equal(&slam, &before, sizeof slam);
}

// ---- accounts ---------------------------------------------------------------------------------------------

static void test_sightings_new_and_matched_are_accounted_for(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.gate_d2 = 25;
    bslam_slam_t slam = started(settings);
    const bslam_sighting_t seen[] = {unit_polar(0.3, 4, 7), unit_polar(-0.8, 3, 8)};
    see(&slam, 0, seen, 2);
    for (int i = 0; i < 2; i++) {
        assert_account(&slam, i, BSLAM_OUTCOME_NEW, BSLAM_REASON_NONE);
        assert_true(account(&slam, i)->has_beacon && account(&slam, i)->weight == 1);
        assert_int_equal(account(&slam, i)->beacon_uid, i);
        assert_true(account(&slam, i)->test_ratio < 0);
    }
    drive(&slam, STEP_US, 0, 0);
    const bslam_sighting_t again[] = {seen[1], unit_polar(1, 5, 9)};
    see(&slam, STEP_US, again, 2);
    assert_account(&slam, 0, BSLAM_OUTCOME_MATCHED, BSLAM_REASON_NONE);
    assert_int_equal(account(&slam, 0)->beacon_uid, 1);
    assert_true(account(&slam, 0)->weight == 1);
    assert_near(account(&slam, 0)->test_ratio, 0, 1e-6);
    assert_account(&slam, 1, BSLAM_OUTCOME_NEW, BSLAM_REASON_NONE);
    assert_int_equal(account(&slam, 1)->beacon_uid, 2);

    const bslam_slam_counters_t *counters = &slam.counters;
    assert_int_equal(counters->frames, 2);
    assert_int_equal(counters->sightings, 4);
    assert_int_equal(counters->added, 3);
    assert_int_equal(counters->matched, 1);
    assert_int_equal(counters->rejected, 0);
}

static void test_sightings_rejected_say_why(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    assert_int_equal(bslam_slam_add_known_beacon(&slam, 5, 0, 0), BSLAM_OK);
    bslam_sighting_t seen[] = {unit_polar(0.3, 4, 1), unit_polar(0.3, 4, 1),
                               unit_polar(0.3, 4, BSLAM_LABEL_NONE), unit_polar(0.3, 4, 2),
                               unit_polar(0, 1, 5)};
    seen[3].beacon_class = BSLAM_CLASS_NOT_MAPPABLE;
    see(&slam, 0, seen, COUNT_OF(seen));
    assert_account(&slam, 0, BSLAM_OUTCOME_NEW, BSLAM_REASON_NONE);
    assert_account(&slam, 1, BSLAM_OUTCOME_REJECTED, BSLAM_REASON_DUPLICATE);
    assert_account(&slam, 2, BSLAM_OUTCOME_REJECTED, BSLAM_REASON_NO_IDENTITY);
    assert_account(&slam, 3, BSLAM_OUTCOME_REJECTED, BSLAM_REASON_CLASS);
    const bslam_slam_counters_t *counters = &slam.counters;
    assert_int_equal(counters->duplicates, 1);
    assert_int_equal(counters->unidentified, 1);
    assert_int_equal(counters->unmappable, 1);
    // Beacon 5 stands at the sensor: it has no direction.
    assert_account(&slam, 4, BSLAM_OUTCOME_REJECTED, BSLAM_REASON_SINGULAR);
    assert_true(account(&slam, 4)->has_beacon && account(&slam, 4)->beacon_uid == 0);
    for (int i = 1; i < 4; i++) {
        assert_true(!account(&slam, i)->has_beacon && account(&slam, i)->weight == 0);
    }
    assert_int_equal(slam.counters.rejected, 4);
    assert_int_equal(slam.ekf.beacon_count, 2);
}

static void test_sightings_matched_to_an_indefinite_state_are_rejected(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    see_one(&slam, 0, unit_polar(0.3, 4, 1));
    covariance_break(&slam.ekf, 0, slam.ekf.dim);
    see_one(&slam, 1, unit_polar(0.3, 4, 1));
    assert_account(&slam, 0, BSLAM_OUTCOME_REJECTED, BSLAM_REASON_SINGULAR);
    assert_true(account(&slam, 0)->has_beacon && account(&slam, 0)->weight == 0);
    assert_int_equal(slam.counters.gated, 0);
    assert_int_equal(slam.counters.insane, 1);
}

static void test_sightings_ambiguous_are_rejected(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.association = 2;
    settings.match_d2 = BSLAM_R(1e-3);
    settings.new_d2 = BSLAM_R(1e6);
    bslam_slam_t slam = started(settings);
    see_one(&slam, 0, unit_polar(0.3, 4, -1));
    drive(&slam, STEP_US, 0, 0);
    see_one(&slam, STEP_US, unit_polar(0.3, 5, -1));
    assert_account(&slam, 0, BSLAM_OUTCOME_REJECTED, BSLAM_REASON_AMBIGUOUS);
    assert_int_equal(slam.ekf.beacon_count, 1);
}

static void test_sightings_outside_the_gate_are_rejected_with_their_beacon_and_ratio(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.gate_d2 = 9;
    settings.confirm_sightings = 1;
    bslam_slam_t slam = started(settings);
    see_one(&slam, 0, unit_polar(0.3, 4, 1));
    drive(&slam, STEP_US, 0, 0);
    const bslam_pose_t before = bslam_slam_pose(&slam);
    see_one(&slam, STEP_US, unit_polar(0.3, 9, 1));
    assert_account(&slam, 0, BSLAM_OUTCOME_REJECTED, BSLAM_REASON_GATE);
    assert_true(account(&slam, 0)->has_beacon && account(&slam, 0)->beacon_uid == 0);
    assert_true(account(&slam, 0)->test_ratio > 1);
    assert_true(account(&slam, 0)->weight == 0);
    assert_int_equal(slam.counters.gated, 1);
    assert_int_equal(beacon(&slam, 0).sightings, 1);
    const bslam_pose_t after = bslam_slam_pose(&slam);
    assert_memory_equal(&before, &after, sizeof before);
}

static void test_sightings_beyond_huber_are_counted_and_weighted(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.huber_d = 1;
    bslam_slam_t slam = started(settings);
    see_one(&slam, 0, unit_polar(0.3, 4, 1));
    drive(&slam, STEP_US, 0, 0);
    see_one(&slam, STEP_US, unit_polar(0.3, 5, 1));
    assert_account(&slam, 0, BSLAM_OUTCOME_MATCHED, BSLAM_REASON_NONE);
    assert_true(account(&slam, 0)->weight > 0 && account(&slam, 0)->weight < 1);
    assert_int_equal(slam.counters.down_weighted, 1);
}

static void test_sightings_distance_of_a_sized_beacon_taken_for_another_class_is_not_used(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.range_scale_sd = BSLAM_R(0.1);
    bslam_sighting_t as_first = unit_polar(0.3, 4, 9);
    as_first.beacon_class = 3;
    bslam_slam_t with_distance = running(settings);
    see_one(&with_distance, 11 * STEP_US, as_first);
    drive(&with_distance, 11 * STEP_US, 0.02, 0.03);
    bslam_slam_t direction_only = with_distance;
    bslam_slam_t same_class = with_distance;
    bslam_sighting_t again = unit_polar(0.29, 4.4, 9);
    again.beacon_class = 7;
    see_one(&with_distance, 12 * STEP_US, again);
    again.beacon_class = 3;
    see_one(&same_class, 12 * STEP_US, again);
    again.has_range = false;
    see_one(&direction_only, 12 * STEP_US, again);
    assert_account(&with_distance, 0, BSLAM_OUTCOME_MATCHED, BSLAM_REASON_NONE);
    assert_memory_equal(with_distance.ekf.mean, direction_only.ekf.mean, sizeof direction_only.ekf.mean);
    assert_memory_equal(&with_distance.ekf.factor, &direction_only.ekf.factor,
                        sizeof direction_only.ekf.factor);
    assert_memory_not_equal(with_distance.ekf.mean, same_class.ekf.mean, sizeof same_class.ekf.mean);
}

static void test_sightings_beyond_the_maps_room_are_rejected_and_the_first_are_added(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    const int room = 3;
    for (int i = 0; i < BSLAM_BEACONS_MAX - room; i++) {
        assert_int_equal(bslam_slam_add_known_beacon(&slam, 1000 + i, real(i + 1), 5), BSLAM_OK);
    }
    bslam_sighting_t seen[6];
    for (int i = 0; i < COUNT_OF(seen); i++) {
        seen[i] = unit_polar(0.3 * i, 3, i);
    }
    see(&slam, 0, seen, COUNT_OF(seen));
    for (int i = 0; i < COUNT_OF(seen); i++) {
        const bool fits = i < room;
        assert_account(&slam, i, fits ? BSLAM_OUTCOME_NEW : BSLAM_OUTCOME_REJECTED,
                       fits ? BSLAM_REASON_NONE : BSLAM_REASON_MAP_FULL);
    }
    assert_int_equal(slam.counters.map_full, COUNT_OF(seen) - room);
    assert_int_equal(slam.ekf.beacon_count, BSLAM_BEACONS_MAX);
}

static void test_sightings_more_rays_than_room_are_rejected_but_points_are_not(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    bslam_sighting_t seen[BSLAM_RAYS_MAX + 2];
    for (int i = 0; i < BSLAM_RAYS_MAX + 1; i++) {
        seen[i] = unit_direction(0.2 * i, i);
    }
    seen[BSLAM_RAYS_MAX + 1] = unit_polar(0.5, 4, 99);
    see(&slam, 0, seen, COUNT_OF(seen));
    assert_account(&slam, BSLAM_RAYS_MAX - 1, BSLAM_OUTCOME_NEW, BSLAM_REASON_NONE);
    assert_account(&slam, BSLAM_RAYS_MAX, BSLAM_OUTCOME_REJECTED, BSLAM_REASON_MAP_FULL);
    assert_account(&slam, BSLAM_RAYS_MAX + 1, BSLAM_OUTCOME_NEW, BSLAM_REASON_NONE);
}

static void test_sightings_empty_frame_is_a_frame(void **state)
{
    bslam_slam_t slam = running(unit_settings());
    see(&slam, 11 * STEP_US, NULL, 0);
    assert_int_equal(slam.account_count, 0);
    assert_int_equal(slam.counters.frames, 3);
}

static void test_sightings_order_within_a_frame_does_not_matter(void **state)
{
    // Directions whose variance depends on the state, so that it shows if the state has moved on in between.
    bslam_settings_t settings = unit_settings();
    settings.filter = 1;
    settings.bearing_only_curvature_factor = 50;
    bslam_slam_t forwards = started(settings);
    bslam_slam_t backwards = started(settings);
    bslam_sighting_t seen[6];
    bslam_sighting_t reversed[6];
    for (int frame = 0; frame < 30; frame++) {
        for (int i = 0; i < 6; i++) {
            seen[i] = i < 3 ? unit_polar(0.9 * i - 1 - 0.04 * frame, 3 + 0.01 * frame * i, i)
                            : unit_direction(0.5 * i - 2 - 0.04 * frame, i);
        }
        for (int i = 0; i < 6; i++) {
            // The first frame in the same order, so that the maps are.
            reversed[i] = seen[frame == 0 ? i : 5 - i];
        }
        see(&forwards, (int64_t)frame * STEP_US, seen, 6);
        see(&backwards, (int64_t)frame * STEP_US, reversed, 6);
        drive(&forwards, (int64_t)(frame + 1) * STEP_US, 0.012, 0.028);
        drive(&backwards, (int64_t)(frame + 1) * STEP_US, 0.012, 0.028);
    }
    const bslam_pose_t a = bslam_slam_pose(&forwards);
    const bslam_pose_t b = bslam_slam_pose(&backwards);
    // Rounding, amplified by thirty updates.
    const double tolerance = BSLAM_REAL_DOUBLE ? 1e-11 : 1e-3;
    assert_near(a.x_m, b.x_m, tolerance);
    assert_near(a.y_m, b.y_m, tolerance);
    assert_near(a.theta_rad, b.theta_rad, tolerance);
}

// ---- tentative and confirmed ----------------------------------------------------------------------------

static void test_sightings_beacon_is_confirmed_by_its_number_of_sightings(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.confirm_sightings = 3;
    bslam_slam_t slam = started(settings);
    for (int i = 0; i < 4; i++) {
        see_one(&slam, (int64_t)i * STEP_US, unit_polar(0.3, 4, 1));
        assert_int_equal(beacon(&slam, 0).sightings, i + 1);
        assert_int_equal(beacon(&slam, 0).confirmed, i + 1 >= 3);
        drive(&slam, (int64_t)(i + 1) * STEP_US, 0, 0);
    }
}

static void test_sightings_a_robot_that_stands_still_confirms_nothing_where_travel_counts(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.confirm_sightings = 3;
    settings.confirm_travel_m = BSLAM_R(0.1);
    bslam_slam_t slam = started(settings);
    const bslam_sighting_t seen = unit_polar(0, 4, 0);
    int64_t time_us = 0;
    for (int i = 0; i < 10; i++, time_us += STEP_US) {
        see(&slam, time_us, &seen, 1);
        drive(&slam, time_us + STEP_US, 0, 0);
    }
    assert_false(beacon(&slam, 0).confirmed);
    for (int i = 0; i < 2; i++, time_us += STEP_US) {
        drive(&slam, time_us + STEP_US, 0.06, 0.06);  // too little for one more, enough for two
        assert_false(beacon(&slam, 0).confirmed);
        see(&slam, time_us + STEP_US, &seen, 1);
    }
    assert_false(beacon(&slam, 0).confirmed);
    for (int i = 0; i < 2; i++, time_us += STEP_US) {
        drive(&slam, time_us + STEP_US, 0.06, 0.06);
        see(&slam, time_us + STEP_US, &seen, 1);
    }
    assert_true(beacon(&slam, 0).confirmed);
}

static void test_sightings_what_is_seen_elsewhere_speaks_against_a_tentative_beacon(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.confirm_sightings = 3;
    settings.confirm_d2 = 1;
    bslam_slam_t slam = started(settings);
    const bslam_real_t seen_m[] = {4, 4, BSLAM_R(4.5), BSLAM_R(4.1)};
    int64_t time_us = 0;
    for (int i = 0; i < 4; i++, time_us += STEP_US) {  // for, for, against, for: two
        see_one(&slam, time_us, unit_polar(0, seen_m[i], 1));
        assert_false(beacon(&slam, 0).confirmed);
        drive(&slam, time_us + STEP_US, 0, 0);
    }
    see_one(&slam, time_us, unit_polar(0, BSLAM_R(4.1), 1));
    assert_true(beacon(&slam, 0).confirmed);
    drive(&slam, time_us + STEP_US, 0, 0);
    see_one(&slam, time_us + STEP_US, unit_polar(0, BSLAM_R(4.5), 1));
    assert_true(beacon(&slam, 0).confirmed);
    assert_int_equal(slam.counters.gated, 0);
}

static void test_sightings_beacon_leaves_with_as_many_sightings_against_it_as_for_it(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.confirm_d2 = 1;
    bslam_slam_t slam = started(settings);
    see_one(&slam, 0, unit_polar(0, 4, 1));
    drive(&slam, STEP_US, 0, 0);
    see_one(&slam, STEP_US, unit_polar(0, BSLAM_R(4.5), 1));
    assert_int_equal(slam.ekf.beacon_count, 0);
    assert_int_equal(slam.counters.removed, 1);
    drive(&slam, 2 * STEP_US, 0, 0);
    see_one(&slam, 2 * STEP_US, unit_polar(0, BSLAM_R(4.5), 1));
    assert_int_equal(beacon(&slam, 0).uid, 1);
}

static void test_sightings_one_sighting_confirms_where_that_is_asked(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.confirm_sightings = 1;
    bslam_slam_t slam = started(settings);
    see_one(&slam, 0, unit_polar(0.3, 4, 1));
    assert_true(beacon(&slam, 0).confirmed);
}

static void test_sightings_beacon_not_confirmed_in_time_is_removed(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.association = 2;
    settings.confirm_sightings = 2;
    settings.confirm_window_us = 10 * STEP_US;
    bslam_slam_t slam = started(settings);
    // The first once, the second twice; far apart, so that neither is taken for the other.
    const bslam_sighting_t seen[] = {unit_polar(1.3, 4, BSLAM_LABEL_NONE),
                                     unit_polar(-1.3, 4, BSLAM_LABEL_NONE)};
    see(&slam, 0, seen, 2);
    drive(&slam, STEP_US, 0, 0);
    see(&slam, STEP_US, &seen[1], 1);
    for (int i = 2; i <= 10; i++) {
        drive(&slam, (int64_t)i * STEP_US, 0, 0);
        see(&slam, (int64_t)i * STEP_US, NULL, 0);
    }
    // The window's last moment is within it.
    assert_int_equal(slam.ekf.beacon_count, 2);
    see(&slam, 10 * STEP_US + 1, NULL, 0);
    assert_int_equal(slam.ekf.beacon_count, 1);
    assert_int_equal(slam.counters.removed, 1);
    assert_int_equal(beacon(&slam, 0).uid, 1);
    // It may come back, under a number of its own.
    drive(&slam, 11 * STEP_US, 0, 0);
    see(&slam, 11 * STEP_US, seen, 1);
    assert_int_equal(beacon(&slam, 1).uid, 2);
}

static void test_sightings_known_association_beacon_is_removed_only_if_contradicted(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.confirm_window_us = 2 * STEP_US;
    settings.gate_d2 = 9;
    bslam_slam_t slam = started(settings);
    // Beacons 0 and 1 once; then label 1 shows where no beacon 1 can be.
    const bslam_sighting_t seen[] = {unit_polar(1.3, 4, 0), unit_polar(-1.3, 4, 1)};
    see(&slam, 0, seen, 2);
    for (int i = 1; i <= 5; i++) {
        drive(&slam, (int64_t)i * STEP_US, 0, 0);
        see(&slam, (int64_t)i * STEP_US, NULL, 0);
    }
    assert_int_equal(slam.ekf.beacon_count, 2);
    drive(&slam, 6 * STEP_US, 0, 0);
    see_one(&slam, 6 * STEP_US, unit_polar(1.3, 9, 1));
    // The other place starts a beacon anew, and the one that it contradicts leaves: its time is up.
    assert_int_equal(slam.counters.removed, 1);
    assert_int_equal(slam.ekf.beacon_count, 2);
    assert_int_equal(beacon(&slam, 0).uid, 0);
    assert_int_equal(beacon(&slam, 1).uid, 2);
}

static void
test_sightings_known_association_beacon_that_began_false_gives_way_to_the_first_confirmed(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.confirm_sightings = 4;
    settings.gate_d2 = 9;
    bslam_slam_t slam = started(settings);
    // Every other sighting is a false one, and no two of these agree.
    for (int i = 0; i < 8; i++) {
        drive(&slam, i * (int64_t)STEP_US, 0, 0);
        see_one(&slam, i * (int64_t)STEP_US,
                i % 2 == 0 ? unit_polar(-1.5 + 0.25 * i, 3, 1) : unit_polar(0.5, 4, 1));
        assert_int_equal(account(&slam, 0)->outcome,
                         i % 2 == 0 || i == 1 ? BSLAM_OUTCOME_NEW : BSLAM_OUTCOME_MATCHED);
    }
    // Of the five of that label the right one is left, and what contradicts it from now on is rejected.
    assert_int_equal(slam.ekf.beacon_count, 1);
    assert_true(beacon(&slam, 0).confirmed);
    assert_int_equal(beacon(&slam, 0).sightings, 4);
    assert_near(beacon(&slam, 0).x_m, 4 * cos(0.5), 0.05);
    assert_int_equal(slam.counters.removed, 4);
    drive(&slam, 8 * (int64_t)STEP_US, 0, 0);
    see_one(&slam, 8 * (int64_t)STEP_US, unit_polar(-1, 9, 1));
    assert_account(&slam, 0, BSLAM_OUTCOME_REJECTED, BSLAM_REASON_GATE);
}

static void test_sightings_known_beacon_is_never_removed_but_a_ray_is(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.association = 2;
    settings.confirm_window_us = 2 * STEP_US;
    bslam_slam_t slam = started(settings);
    assert_int_equal(bslam_slam_add_known_beacon(&slam, 9, -5, 0), BSLAM_OK);
    see_one(&slam, 0, unit_direction(0.5, BSLAM_LABEL_NONE));
    assert_int_equal(beacon(&slam, 1).kind, BSLAM_BEACON_RAY);
    drive(&slam, 3 * STEP_US, 0, 0);
    see(&slam, 3 * STEP_US, NULL, 0);
    assert_int_equal(slam.ekf.beacon_count, 1);
    assert_int_equal(beacon(&slam, 0).label, 9);
    assert_int_equal(slam.ekf.dim, 3);
    // There is room for as many rays as before.
    see_one(&slam, 3 * STEP_US + 1, unit_direction(0.5, BSLAM_LABEL_NONE));
    assert_int_equal(slam.ekf.ray_count, 1);
}

static void test_remove_beacon_then_its_label_is_new_again(void **state)
{
    bslam_slam_t slam = running(unit_settings());
    const uint32_t uid = beacon(&slam, 1).uid;
    assert_int_equal(bslam_slam_remove_beacon(&slam, uid), BSLAM_OK);
    assert_int_equal(slam.ekf.beacon_count, 2);
    assert_int_equal(bslam_slam_remove_beacon(&slam, uid), BSLAM_E_NO_BEACON);
    see_one(&slam, 11 * STEP_US, unit_polar(-0.8, 3, 2));
    assert_account(&slam, 0, BSLAM_OUTCOME_NEW, BSLAM_REASON_NONE);
    assert_int_equal(beacon(&slam, 2).uid, 3);
}

static void test_sightings_ray_seen_from_aside_settles_into_a_point(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.motion = 1;
    settings.left_speed_sd_mps = BSLAM_R(0.001);
    settings.right_speed_sd_mps = BSLAM_R(0.001);
    bslam_slam_t slam = started(settings);
    const double x_m = 2;
    const double y_m = 3;
    for (int i = 0; i < 200; i++) {
        const bslam_pose_t pose = {real(0.02 * i), 0, 0};
        bslam_sighting_t seen = look(&pose, x_m, y_m, 1);
        seen.has_range = false;
        see_one(&slam, (int64_t)i * STEP_US, seen);
        drive(&slam, (int64_t)(i + 1) * STEP_US, 0.02, 0.02);
    }
    assert_int_equal(slam.counters.settled, 1);
    const bslam_beacon_view_t view = beacon(&slam, 0);
    assert_int_equal(view.kind, BSLAM_BEACON_POINT);
    // Odometry and directions are exact here; what is left is the start value's pull.
    assert_near(view.x_m, x_m, 0.2);
    assert_near(view.y_m, y_m, 0.3);
}

// ---- time: delays, the past, ahead ------------------------------------------------------------------------

static void test_sightings_before_any_odometry_start_the_clock(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    see_one(&slam, 0, unit_polar(0.3, 4, 1));
    drive(&slam, STEP_US, 0.01, 0.01);
    assert_near(bslam_slam_pose(&slam).x_m, 0.01, 1e-8);
    // The interval counts from the frame: noise has grown.
    bslam_real_t lower[6];
    bslam_slam_pose_covariance(&slam, lower);
    assert_true(lower[0] > 0);
}

static void test_sightings_ahead_of_a_clock_without_odometry_are_seen_from_the_start(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    see_one(&slam, 0, unit_polar(0.3, 4, 1));
    see_one(&slam, 100000, unit_polar(0, 2, 2));
    assert_near(beacon(&slam, 1).x_m, 2, POSITION_ERROR);
    assert_near(beacon(&slam, 1).y_m, 0, POSITION_ERROR);
    const bslam_sighting_t late = unit_polar(0, 3, 3);
    assert_frame_refused(&slam, 200001, &late, 1, BSLAM_E_TIME, -1);
}

static void test_pose_at_a_past_time_is_where_the_robot_was(void **state)
{
    for (int motion = 0; motion <= 1; motion++) {
        bslam_settings_t settings = unit_settings();
        settings.motion = motion;
        bslam_slam_t slam = started(settings);
        const int steps = BSLAM_HISTORY_MAX + 7;
        bslam_pose_t poses[BSLAM_HISTORY_MAX + 7];
        for (int i = 0; i < steps; i++) {
            // Now fast, now slow, now still, with uneven turns.
            drive(&slam, (int64_t)i * STEP_US, 0.01 * (i % 3), 0.02 * (i % 4));
            poses[i] = bslam_slam_pose(&slam);
        }
        for (int i = steps - 1 - BSLAM_HISTORY_MAX; i < steps; i++) {
            bslam_pose_t pose;
            assert_int_equal(bslam_slam_pose_at(&slam, (int64_t)i * STEP_US, &pose), BSLAM_OK);
            assert_pose(pose, poses[i]);
        }
        bslam_pose_t pose = {7, 7, 7};
        const int64_t oldest_us = (int64_t)(steps - 1 - BSLAM_HISTORY_MAX) * STEP_US;
        assert_int_equal(bslam_slam_pose_at(&slam, oldest_us - 1, &pose), BSLAM_E_TIME);
        assert_true(pose.x_m == 7 && pose.y_m == 7 && pose.theta_rad == 7);
    }
}

static void test_pose_at_within_a_step_is_on_the_arc(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.motion = 1;
    bslam_slam_t slam = started(settings);
    drive_circle(&slam, 0, 10);
    // Radius 0.5 m, 1 rad/s, from the origin along x.
    for (int k = 0; k <= 90; k++) {
        const int64_t time_us = (int64_t)k * STEP_US / 10;
        const double angle = (double)time_us * 1e-6;
        bslam_pose_t pose;
        assert_int_equal(bslam_slam_pose_at(&slam, time_us, &pose), BSLAM_OK);
        const bslam_pose_t expected = {real(0.5 * sin(angle)), real(0.5 * (1 - cos(angle))), real(angle)};
        assert_pose(pose, expected);
    }
}

static void test_pose_at_ahead_goes_on_as_before_up_to_its_limit(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.motion = 1;
    settings.ahead_max_us = 100000;
    bslam_slam_t slam = started(settings);
    drive_circle(&slam, 0, 10);
    const double angle = 9 * STEP_S + 0.1;
    bslam_pose_t pose;
    assert_int_equal(bslam_slam_pose_at(&slam, 9 * STEP_US + 100000, &pose), BSLAM_OK);
    const bslam_pose_t expected = {real(0.5 * sin(angle)), real(0.5 * (1 - cos(angle))), real(angle)};
    assert_pose(pose, expected);
    assert_int_equal(bslam_slam_pose_at(&slam, 9 * STEP_US + 100001, &pose), BSLAM_E_TIME);
    static const int64_t outside_us[] = {-1, INT64_MIN, INT64_MAX, INT64_MAX / 2 + 1};
    for (int i = 0; i < COUNT_OF(outside_us); i++) {
        assert_int_equal(bslam_slam_pose_at(&slam, outside_us[i], &pose), BSLAM_E_TIME);
    }
}

/// A frame stamped time_us, taken by a sensor that is off the axle: its new beacon must stand where the robot
/// at shown_us saw it.
static void assert_beacon_is_placed_from(bslam_settings_t settings, int64_t time_us, int64_t shown_us)
{
    settings.motion = 1;
    settings.mount_x_m = BSLAM_R(0.2);
    settings.mount_y_m = BSLAM_R(0.1);
    settings.mount_yaw_rad = BSLAM_R(0.5);
    bslam_slam_t slam = started(settings);
    drive_circle(&slam, 0, 10);
    bslam_pose_t pose;
    assert_int_equal(bslam_slam_pose_at(&slam, shown_us, &pose), BSLAM_OK);
    see_one(&slam, time_us, unit_polar(0.4, 3, 1));
    const double theta = (double)pose.theta_rad;
    const double x_m = (double)pose.x_m + 0.2 * cos(theta) - 0.1 * sin(theta) + 3 * cos(theta + 0.9);
    const double y_m = (double)pose.y_m + 0.2 * sin(theta) + 0.1 * cos(theta) + 3 * sin(theta + 0.9);
    assert_near(beacon(&slam, 0).x_m, x_m, POSITION_ERROR);
    assert_near(beacon(&slam, 0).y_m, y_m, POSITION_ERROR);
}

static void test_sightings_are_placed_from_where_the_robot_was(void **state)
{
    bslam_settings_t settings = unit_settings();
    static const int64_t times_us[] = {0,           3 * STEP_US,        200000, 9 * STEP_US - 1,
                                       9 * STEP_US, 9 * STEP_US + 50000};
    for (int i = 0; i < COUNT_OF(times_us); i++) {
        assert_beacon_is_placed_from(settings, times_us[i], times_us[i]);
    }
}

static void test_sightings_delay_shifts_where_they_are_placed_from(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.sighting_delay_us = 150000;
    assert_beacon_is_placed_from(settings, 9 * STEP_US, 9 * STEP_US - 150000);
    assert_beacon_is_placed_from(settings, 9 * STEP_US + 120000, 9 * STEP_US - 30000);
    settings.sighting_delay_us = -150000;
    assert_beacon_is_placed_from(settings, 3 * STEP_US, 3 * STEP_US + 150000);
    assert_beacon_is_placed_from(settings, 9 * STEP_US - 100000, 9 * STEP_US + 50000);
}

static void test_sightings_of_a_delayed_frame_before_the_clock_are_refused(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.sighting_delay_us = 10000000;
    bslam_slam_t slam = started(settings);
    drive_circle(&slam, 0, 5);
    const bslam_sighting_t seen = unit_polar(0.3, 4, 1);
    assert_frame_refused(&slam, 0, &seen, 1, BSLAM_E_TIME, -1);
}

/// Every form of the filter: 0 to 5.
static bslam_settings_t form(int kind)
{
    bslam_settings_t settings = unit_settings();
    settings.motion = 1;
    settings.filter = kind % 2;
    settings.velocity_states = kind / 2 == 1;
    settings.scale_states = kind / 2 == 2;
    return settings;
}

static void assert_same_estimate(const bslam_slam_t *a, const bslam_slam_t *b)
{
    assert_memory_equal(a->ekf.mean, b->ekf.mean, sizeof a->ekf.mean);
    assert_memory_equal(&a->ekf.factor, &b->ekf.factor, sizeof a->ekf.factor);
    const bslam_pose_t pose_a = bslam_slam_pose(a);
    const bslam_pose_t pose_b = bslam_slam_pose(b);
    assert_memory_equal(&pose_a, &pose_b, sizeof pose_a);
}

static void test_sightings_that_come_late_count_as_if_they_had_come_in_time(void **state)
{
    // Taken at the end of a step and within one. To the bit, and whatever odometry's noise.
    static const int64_t taken_us[] = {5 * STEP_US, 4 * STEP_US + 7000};
    for (int i = 0; i < COUNT_OF(taken_us); i++) {
        for (int kind = 0; kind < 6; kind++) {
            bslam_slam_t in_time = started(form(kind));
            bslam_slam_t late = started(form(kind));
            bslam_slam_t with_delay = started(form(kind));
            with_delay.settings.sighting_delay_us = 100000;
            const bslam_sighting_t first = unit_polar(0.5, 4, 1);
            const bslam_sighting_t second[] = {unit_polar(0.2, 3.8, 1), unit_direction(1, 2)};
            see_one(&in_time, 0, first);
            see_one(&late, 0, first);
            see_one(&with_delay, 0, first);
            drive_circle(&in_time, STEP_US, 5);
            see(&in_time, taken_us[i], second, 2);
            drive_circle(&in_time, 6 * STEP_US, 4);
            drive_circle(&late, STEP_US, 9);
            see(&late, taken_us[i], second, 2);
            drive_circle(&with_delay, STEP_US, 9);
            see(&with_delay, taken_us[i] + 100000, second, 2);
            assert_same_estimate(&late, &in_time);
            assert_same_estimate(&with_delay, &in_time);
        }
    }
}

static void test_pose_and_covariance_between_frames_are_what_the_filter_arrives_at(void **state)
{
    for (int kind = 0; kind < 6; kind++) {
        bslam_slam_t slam = running(form(kind));
        drive_circle(&slam, 11 * STEP_US, 7);
        // A frame within a step, so that the rest of one waits.
        see_one(&slam, 13 * STEP_US + 9000, unit_polar(0.1, 4, 1));
        const bslam_pose_t pose = bslam_slam_pose(&slam);
        bslam_real_t before[6];
        bslam_real_t after[6];
        bslam_slam_pose_covariance(&slam, before);
        see(&slam, 17 * STEP_US, NULL, 0);
        bslam_slam_pose_covariance(&slam, after);
        assert_pose(bslam_slam_pose(&slam), pose);
        for (int k = 0; k < 6; k++) {
            assert_near(before[k], after[k], 64 * UNIT_ROUNDING);
        }
    }
}

static void test_odometry_beyond_the_room_to_wait_is_predicted_in_order(void **state)
{
    // Empty frames at each step, or none: the same predictions in the same order.
    for (int kind = 0; kind < 6; kind++) {
        bslam_slam_t often = running(form(kind));
        bslam_slam_t never = running(form(kind));
        const int steps = 2 * BSLAM_HISTORY_MAX + 3;
        for (int i = 11; i < 11 + steps; i++) {
            drive_circle(&often, (int64_t)i * STEP_US, 1);
            see(&often, (int64_t)i * STEP_US, NULL, 0);
            drive_circle(&never, (int64_t)i * STEP_US, 1);
            assert_pose(bslam_slam_pose(&never), bslam_slam_pose(&often));
        }
        see(&never, (int64_t)(10 + steps) * STEP_US, NULL, 0);
        assert_same_estimate(&never, &often);
    }
}

// ---- interruptions ----------------------------------------------------------------------------------------

/// The way that errors stay alike over is kept in a 32-bit counter: under the sanitizers, the largest
/// motions.
static void test_odometry_largest_motion_does_not_overflow_the_distance_travelled(void **state)
{
    for (int kind = 0; kind < 6; kind++) {
        bslam_settings_t settings = form(kind);
        settings.speed_max_mps = 1000;
        bslam_slam_t slam = running(settings);
        for (int i = 1; i <= 4; i++) {
            const int64_t time_us = 10 * STEP_US + (int64_t)i * 4000000;
            const bslam_odometry_reading_t reading = {
                .time_us = time_us, .source = BSLAM_ODOMETRY_VELOCITY, .v_mps = i % 2 == 0 ? -999 : 999};
            assert_int_equal(bslam_slam_odometry(&slam, &reading), BSLAM_OK);
            see(&slam, time_us, NULL, 0);
        }
    }
}

static void test_resume_odometry_adds_the_doubt_and_starts_the_clock_anew(void **state)
{
    bslam_slam_t slam = running(unit_settings());
    bslam_real_t before[6];
    bslam_real_t after[6];
    const bslam_pose_t pose = bslam_slam_pose(&slam);
    bslam_slam_pose_covariance(&slam, before);
    assert_odometry_refused(&slam, wheels(INT64_C(3600000000), 0.01, 0.01), BSLAM_E_TIME);
    assert_int_equal(bslam_slam_resume_odometry(&slam, 2, BSLAM_R(0.5)), BSLAM_OK);
    bslam_slam_pose_covariance(&slam, after);
    static const double added[6] = {4, 0, 4, 0, 0, 0.25};
    for (int k = 0; k < 6; k++) {
        assert_near(after[k], (double)before[k] + added[k], 8 * UNIT_ROUNDING * 4);
    }
    assert_pose(bslam_slam_pose(&slam), pose);
    // The first reading has no interval; the next one is a step like any other.
    drive(&slam, INT64_C(3600000000), 5, 5);
    assert_pose(bslam_slam_pose(&slam), pose);
    drive(&slam, INT64_C(3600000000) + STEP_US, 0.01, 0.01);
    const double way = hypot((double)bslam_slam_pose(&slam).x_m - (double)pose.x_m,
                             (double)bslam_slam_pose(&slam).y_m - (double)pose.y_m);
    assert_near(way, 0.01, POSITION_ERROR);
}

static void test_resume_odometry_after_an_encoder_reset_takes_the_new_ticks(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    const bslam_odometry_reading_t first = {
        .time_us = 0, .source = BSLAM_ODOMETRY_TICKS, .left_ticks = 30000, .right_ticks = 30000};
    bslam_odometry_reading_t reset = first;
    reset.time_us = STEP_US;
    reset.left_ticks = reset.right_ticks = 5;
    assert_int_equal(bslam_slam_odometry(&slam, &first), BSLAM_OK);
    assert_int_equal(bslam_slam_odometry(&slam, &reset), BSLAM_E_JUMP);
    assert_int_equal(bslam_slam_resume_odometry(&slam, 0, 0), BSLAM_OK);
    assert_int_equal(bslam_slam_odometry(&slam, &reset), BSLAM_OK);
    assert_true(bslam_slam_pose(&slam).x_m == 0);
}

static void test_resume_odometry_forgets_the_past_before_it(void **state)
{
    bslam_slam_t slam = running(unit_settings());
    assert_int_equal(bslam_slam_resume_odometry(&slam, 1, 1), BSLAM_OK);
    drive(&slam, 100 * STEP_US, 0, 0);
    drive(&slam, 101 * STEP_US, 0.01, 0.01);
    bslam_pose_t pose;
    assert_int_equal(bslam_slam_pose_at(&slam, 100 * STEP_US, &pose), BSLAM_OK);
    assert_int_equal(bslam_slam_pose_at(&slam, 100 * STEP_US - 1, &pose), BSLAM_E_TIME);
    assert_int_equal(bslam_slam_pose_at(&slam, 10 * STEP_US, &pose), BSLAM_E_TIME);
}

static void test_resume_odometry_with_a_clock_that_starts_over_goes_on(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    const bslam_sighting_t seen = unit_polar(0.3, 4, 1);
    drive_circle(&slam, INT64_C(5000000000), 5);
    see_one(&slam, INT64_C(5000000000) + 4 * STEP_US, seen);
    assert_int_equal(bslam_slam_resume_odometry(&slam, 1, 1), BSLAM_OK);
    see_one(&slam, 0, seen);
    assert_account(&slam, 0, BSLAM_OUTCOME_MATCHED, BSLAM_REASON_NONE);
    drive(&slam, STEP_US, 0.01, 0.01);
    see_one(&slam, STEP_US, seen);
}

static void test_resume_odometry_robot_carried_elsewhere_finds_itself_in_its_map(void **state)
{
    static const double places[3][2] = {{4, 1}, {-2, 3}, {1, -4}};
    for (int filter = 0; filter <= 1; filter++) {
        bslam_settings_t settings = unit_settings();
        settings.filter = filter;
        settings.gate_d2 = 25;
        bslam_slam_t slam = started(settings);
        bslam_pose_t truth = {0, 0, 0};
        for (int step = 0; step < 100; step++) {
            if (step == 50) {
                // Half a metre aside and turned by 0.4 rad.
                truth = (bslam_pose_t){BSLAM_R(0.3), BSLAM_R(0.4), BSLAM_R(0.4)};
                assert_int_equal(bslam_slam_resume_odometry(&slam, 1, 1), BSLAM_OK);
            }
            drive(&slam, (int64_t)step * STEP_US, 0, 0);
            bslam_sighting_t seen[3];
            for (int i = 0; i < 3; i++) {
                seen[i] = look(&truth, places[i][0], places[i][1], i);
            }
            see(&slam, (int64_t)step * STEP_US, seen, 3);
            assert_int_equal(slam.counters.gated, 0);
        }
        // Exact sightings of a map that was made from the origin: what is left is the first linearisation's
        // error.
        assert_near(bslam_slam_pose(&slam).x_m, truth.x_m, 0.05);
        assert_near(bslam_slam_pose(&slam).y_m, truth.y_m, 0.05);
        assert_near(bslam_slam_pose(&slam).theta_rad, truth.theta_rad, 0.02);
    }
}

/// A robot that stands at the origin to 0.3 m and heads along x to so much, with one beacon in its map, known
/// to a centimetre; distances are good to 5 cm.
static bslam_slam_t turned(int32_t filter, double heading_sd_rad)
{
    bslam_settings_t settings = unit_settings();
    settings.filter = filter;
    settings.range_sd_floor_m = BSLAM_R(0.05);
    settings.range_sd_fraction = settings.range_sd_per_m = 0;
    bslam_slam_t slam = started(settings);
    const bslam_pose_t origin = {0, 0, 0};
    int index;
    assert_int_equal(bslam_slam_set_pose(&slam, &origin, BSLAM_R(0.3), real(heading_sd_rad)), BSLAM_OK);
    assert_int_equal(bslam_ekf_add_guess(&slam.ekf, 4, 1, BSLAM_R(0.01), &index), BSLAM_OK);
    slam.ekf.beacons[index].label = 7;
    slam.ekf.beacons[index].confirmed = true;
    return slam;
}

/// By the invariant filter: half of its noise is left of the sighting, and the truth within three deviations.
static void test_sightings_heading_far_in_doubt_is_found_in_one_frame(void **state)
{
    static const double turns_deg[] = {-140, -90, -30, 30, 90, 140};
    for (int i = 0; i < COUNT_OF(turns_deg); i++) {
        const bslam_pose_t truth = {BSLAM_R(0.2), BSLAM_R(-0.1), real(turns_deg[i] * PI / 180)};
        bslam_slam_t slam = turned(BSLAM_FILTER_INVARIANT, 50 * PI / 180);
        const bslam_sighting_t seen = look(&truth, 4, 1, 7);
        see_one(&slam, 0, seen);
        assert_account(&slam, 0, BSLAM_OUTCOME_MATCHED, BSLAM_REASON_NONE);
        const bslam_pose_t pose = bslam_slam_pose(&slam);
        bslam_real_t x_m, y_m;
        bslam_ekf_beacon_position(&slam.ekf, 0, &x_m, &y_m);
        const bslam_sighting_t predicted = look(&pose, (double)x_m, (double)y_m, 7);
        assert_near(unit_angle_between((double)predicted.bearing_rad, (double)seen.bearing_rad), 0, 0.01);
        assert_near(predicted.range_m, seen.range_m, 0.025);
        const double off[] = {(double)(pose.x_m - truth.x_m), (double)(pose.y_m - truth.y_m),
                              unit_angle_between((double)pose.theta_rad, (double)truth.theta_rad)};
        for (int k = 0; k < 3; k++) {
            assert_near(off[k], 0, 3 * sqrt((double)bslam_ekf_covariance(&slam.ekf, k, k)));
        }
    }
}

/// Whether a frame is one step of the filter, to the bit.
static bool is_one_step(int32_t filter, double heading_sd_rad, bool has_range)
{
    const bslam_pose_t on_axle = {0, 0, 0}, truth = {BSLAM_R(0.2), BSLAM_R(-0.1), BSLAM_R(0.1)};
    bslam_slam_t slam = turned(filter, heading_sd_rad);
    bslam_ekf_t ekf = slam.ekf;
    bslam_sighting_t seen = look(&truth, 4, 1, 7);
    seen.has_range = has_range;
    bslam_innovation_t innovation;
    bslam_fusion_t fusion;
    assert_int_equal(bslam_ekf_innovation(&ekf, &slam.settings, &on_axle, &seen, 0, &innovation), BSLAM_OK);
    assert_int_equal(bslam_ekf_fuse(&ekf, &slam.settings, &innovation, &fusion), BSLAM_OK);
    bslam_ekf_correct(&ekf, &slam.settings);
    see_one(&slam, 0, seen);
    assert_account(&slam, 0, BSLAM_OUTCOME_MATCHED, BSLAM_REASON_NONE);
    return memcmp(ekf.mean, slam.ekf.mean, sizeof ekf.mean) == 0 &&
           memcmp(&ekf.factor, &slam.ekf.factor, sizeof ekf.factor) == 0;
}

/// Up to a variance of 0.03 rad².
static void test_sightings_heading_that_is_known_is_corrected_in_one_step(void **state)
{
    assert_true(is_one_step(BSLAM_FILTER_INVARIANT, 2 * PI / 180, true));
    assert_true(is_one_step(BSLAM_FILTER_INVARIANT, 0.173, true));
    assert_false(is_one_step(BSLAM_FILTER_INVARIANT, 0.1735, true));
    assert_true(is_one_step(BSLAM_FILTER_INVARIANT, 50 * PI / 180, false));
    assert_true(is_one_step(BSLAM_FILTER_STANDARD, 50 * PI / 180, true));
}

static void test_resume_odometry_impossible_doubt_is_refused_and_changes_nothing(void **state)
{
    bslam_slam_t slam = running(unit_settings());
    bslam_slam_t before;
    memcpy(&before, &slam, sizeof before);
    static const double bad[][2] = {{-1, 0}, {31, 0}, {0, -1}, {0, 3.3}, {NAN, 0}, {0, NAN}, {INFINITY, 0}};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        assert_int_equal(bslam_slam_resume_odometry(&slam, real(bad[i][0]), real(bad[i][1])), BSLAM_E_RANGE);
        assert_memory_equal(&slam, &before, sizeof slam);
    }
}

static void test_resume_odometry_with_velocity_states_forgets_the_speed(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 1;
    // A ponderous robot: were the speed from before still believed, it would take seconds to learn otherwise.
    settings.velocity_walk_mps_sqrt_s = BSLAM_R(0.02);
    settings.velocity_decay_s = BSLAM_R(1e6);
    settings.right_speed_sd_mps = settings.left_speed_sd_mps;
    bslam_slam_t slam = started(settings);
    for (int i = 0; i < 100; i++) {
        drive(&slam, (int64_t)i * STEP_US, 0.5 * STEP_S, 0.5 * STEP_S);
    }
    assert_int_equal(bslam_slam_resume_odometry(&slam, 0, 0), BSLAM_OK);
    const bslam_pose_t before = bslam_slam_pose(&slam);
    bslam_real_t lower_before[6];
    bslam_slam_pose_covariance(&slam, lower_before);
    // It stands still now, and says so.
    for (int i = 0; i < 25; i++) {
        drive(&slam, (int64_t)(1000 + i) * STEP_US, 0, 0);
    }
    bslam_real_t lower[6];
    bslam_slam_pose_covariance(&slam, lower);
    const double grown_sd = sqrt((double)lower[0] - (double)lower_before[0]);
    assert_near(bslam_slam_pose(&slam).x_m, before.x_m, 3 * grown_sd);
}

// ---- known map --------------------------------------------------------------------------------------------

static void test_sightings_of_known_beacons_localise_and_never_move_them(void **state)
{
    static const double places[3][2] = {{4, 1}, {-2, 3}, {1, -4}};
    for (int filter = 0; filter <= 1; filter++) {
        bslam_settings_t settings = unit_settings();
        settings.filter = filter;
        settings.motion = 1;
        bslam_slam_t slam = started(settings);
        for (int i = 0; i < 3; i++) {
            assert_int_equal(bslam_slam_add_known_beacon(&slam, i, real(places[i][0]), real(places[i][1])),
                             BSLAM_OK);
        }
        // Odometry claims to go straight on; the robot drives on a circle of 1 m.
        for (int step = 1; step <= 100; step++) {
            const double angle = 0.02 * step;
            const bslam_pose_t truth = {real(sin(angle)), real(1 - cos(angle)), real(angle)};
            drive(&slam, (int64_t)step * STEP_US, 0.02, 0.02);
            bslam_sighting_t seen[3];
            for (int i = 0; i < 3; i++) {
                seen[i] = look(&truth, places[i][0], places[i][1], i);
            }
            see(&slam, (int64_t)step * STEP_US, seen, 3);
            // The filter lags behind a bias of 0.02 rad a step by about that, over its gain.
            assert_near(bslam_slam_pose(&slam).x_m, truth.x_m, 0.1);
            assert_near(bslam_slam_pose(&slam).y_m, truth.y_m, 0.1);
            assert_near(bslam_slam_pose(&slam).theta_rad, truth.theta_rad, 0.05);
        }
        for (int i = 0; i < 3; i++) {
            const bslam_beacon_view_t view = beacon(&slam, i);
            assert_true(view.x_m == real(places[i][0]) && view.y_m == real(places[i][1]));
            assert_true(view.covariance_m2.xx == 0 && view.covariance_m2.yy == 0);
            assert_int_equal(view.kind, BSLAM_BEACON_KNOWN);
            assert_int_equal(view.sightings, 100);
            assert_true(view.confirmed);
        }
    }
}

// ---- results ----------------------------------------------------------------------------------------------

static void test_beacon_view_has_the_papers_polar_coordinates(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    assert_int_equal(bslam_slam_add_known_beacon(&slam, 1, -3, 4), BSLAM_OK);
    assert_int_equal(bslam_slam_add_known_beacon(&slam, 2, -3, real(-1e-30)), BSLAM_OK);
    assert_near(beacon(&slam, 0).range_m, 5, 8 * UNIT_ROUNDING);
    assert_near(beacon(&slam, 0).phi_rad, atan2(4, -3), 8 * UNIT_ROUNDING);
    // A hair below the axis is half a turn, not minus half a turn.
    assert_near(beacon(&slam, 1).phi_rad, PI, 8 * UNIT_ROUNDING);
}

static void test_init_starts_at_the_origin_with_an_empty_map(void **state)
{
    bslam_slam_t slam;
    memset(&slam, 0xee, sizeof slam);
    bslam_settings_t settings = unit_settings();
    int bad_id = -1;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    const bslam_pose_t origin = {0, 0, 0};
    const bslam_pose_t pose = bslam_slam_pose(&slam);
    assert_memory_equal(&pose, &origin, sizeof pose);
    assert_int_equal(slam.ekf.beacon_count, 0);
    assert_int_equal(slam.bad_sighting, -1);
    assert_int_equal(slam.account_count, 0);
    const bslam_slam_counters_t none = {0};
    assert_memory_equal(&slam.counters, &none, sizeof none);
    bslam_pose_t at;
    assert_int_equal(bslam_slam_pose_at(&slam, 123, &at), BSLAM_OK);
    assert_memory_equal(&at, &origin, sizeof at);
}

static void test_pose_covariance_is_the_lower_triangle_of_the_states(void **state)
{
    bslam_slam_t slam = running(unit_settings());
    bslam_real_t lower[6];
    bslam_slam_pose_covariance(&slam, lower);
    static const int places[6][2] = {{0, 0}, {1, 0}, {1, 1}, {2, 0}, {2, 1}, {2, 2}};
    for (int k = 0; k < 6; k++) {
        assert_true(lower[k] == bslam_ekf_covariance(&slam.ekf, places[k][0], places[k][1]));
    }
}

static void test_counters_a_state_that_is_not_finite_is_counted(void **state)
{
    bslam_slam_t slam = running(unit_settings());
    assert_int_equal(slam.counters.insane, 0);
    slam.ekf.mean[BSLAM_STATE_X] = (bslam_real_t)NAN;
    see(&slam, 11 * STEP_US, NULL, 0);
    assert_int_equal(slam.counters.insane, 1);
}

static void test_set_pose_refuses_each_number_that_is_not_finite_and_changes_nothing(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    drive_circle(&slam, STEP_US, 10);
    const bslam_slam_t before = slam;
    for (int i = 0; i < 3; i++) {
        bslam_pose_t pose = {1, 2, 3};
        bslam_real_t *const numbers[] = {&pose.x_m, &pose.y_m, &pose.theta_rad};
        *numbers[i] = real(i == 1 ? INFINITY : NAN);
        assert_int_equal(bslam_slam_set_pose(&slam, &pose, 0, 0), BSLAM_E_NOT_FINITE);
    }
    const bslam_pose_t pose = {1, 2, 3};
    assert_int_equal(bslam_slam_set_pose(&slam, &pose, BSLAM_R(30.1), 0), BSLAM_E_RANGE);
    assert_int_equal(bslam_slam_set_pose(&slam, &pose, 0, BSLAM_R(3.3)), BSLAM_E_RANGE);
    assert_memory_equal(&slam, &before, sizeof slam);
}

/// Of a robot that is lost a frame is accounted for, and used for nothing.
static void test_sightings_of_a_lost_robot_are_deferred_until_it_has_a_pose(void **state)
{
    bslam_slam_t slam = started(unit_settings());
    drive_circle(&slam, STEP_US, 1);
    see_one(&slam, STEP_US, unit_polar(0.2, 3, 1));
    bslam_slam_lose_pose(&slam);
    const uint32_t seen = slam.ekf.beacons[0].sightings;
    drive(&slam, 2 * STEP_US, 0.01, 0.01);
    see_one(&slam, 2 * STEP_US, unit_polar(0.2, 3, 1));
    assert_int_equal(account(&slam, 0)->outcome, BSLAM_OUTCOME_DEFERRED);
    assert_int_equal(account(&slam, 0)->reason, BSLAM_REASON_LOST);
    assert_int_equal(slam.ekf.beacons[0].sightings, seen);
    const bslam_pose_t pose = {0, 0, 0};
    assert_int_equal(bslam_slam_set_pose(&slam, &pose, BSLAM_R(0.5), BSLAM_R(0.2)), BSLAM_OK);
    drive(&slam, 3 * STEP_US, 0.01, 0.01);
    see_one(&slam, 3 * STEP_US, unit_polar(0.2, 3, 1));
    assert_int_equal(account(&slam, 0)->outcome, BSLAM_OUTCOME_MATCHED);
    assert_int_equal(slam.ekf.beacons[0].sightings, seen + 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_init_bad_parameter_is_refused_and_changes_nothing),
        cmocka_unit_test(test_odometry_every_refusal_changes_nothing),
        cmocka_unit_test(test_odometry_without_noise_for_velocity_states_is_refused_and_changes_nothing),
        cmocka_unit_test(test_sightings_wrong_count_is_refused_and_changes_nothing),
        cmocka_unit_test(test_sightings_wrong_time_is_refused_and_changes_nothing),
        cmocka_unit_test(test_sightings_older_than_the_history_are_refused_and_change_nothing),
        cmocka_unit_test(test_sightings_bad_sighting_is_named_and_changes_nothing),
        cmocka_unit_test(test_sightings_at_the_limits_of_their_fields_are_taken),
        cmocka_unit_test(test_sightings_distance_that_a_direction_does_not_have_is_not_what_is_wrong),
        cmocka_unit_test(test_add_known_beacon_every_refusal_changes_nothing),
        cmocka_unit_test(test_add_known_beacon_to_a_full_map_is_refused_and_changes_nothing),
        cmocka_unit_test(test_remove_and_view_of_no_such_beacon_are_refused_and_change_nothing),

        cmocka_unit_test(test_sightings_new_and_matched_are_accounted_for),
        cmocka_unit_test(test_sightings_rejected_say_why),
        cmocka_unit_test(test_sightings_matched_to_an_indefinite_state_are_rejected),
        cmocka_unit_test(test_sightings_ambiguous_are_rejected),
        cmocka_unit_test(test_sightings_outside_the_gate_are_rejected_with_their_beacon_and_ratio),
        cmocka_unit_test(test_sightings_beyond_huber_are_counted_and_weighted),
        cmocka_unit_test(test_sightings_distance_of_a_sized_beacon_taken_for_another_class_is_not_used),
        cmocka_unit_test(test_sightings_beyond_the_maps_room_are_rejected_and_the_first_are_added),
        cmocka_unit_test(test_sightings_more_rays_than_room_are_rejected_but_points_are_not),
        cmocka_unit_test(test_sightings_empty_frame_is_a_frame),
        cmocka_unit_test(test_sightings_order_within_a_frame_does_not_matter),

        cmocka_unit_test(test_sightings_beacon_is_confirmed_by_its_number_of_sightings),
        cmocka_unit_test(test_sightings_a_robot_that_stands_still_confirms_nothing_where_travel_counts),
        cmocka_unit_test(test_sightings_what_is_seen_elsewhere_speaks_against_a_tentative_beacon),
        cmocka_unit_test(test_sightings_beacon_leaves_with_as_many_sightings_against_it_as_for_it),
        cmocka_unit_test(test_sightings_one_sighting_confirms_where_that_is_asked),
        cmocka_unit_test(test_sightings_beacon_not_confirmed_in_time_is_removed),
        cmocka_unit_test(test_sightings_known_association_beacon_is_removed_only_if_contradicted),
        cmocka_unit_test(
            test_sightings_known_association_beacon_that_began_false_gives_way_to_the_first_confirmed),
        cmocka_unit_test(test_sightings_known_beacon_is_never_removed_but_a_ray_is),
        cmocka_unit_test(test_remove_beacon_then_its_label_is_new_again),
        cmocka_unit_test(test_sightings_ray_seen_from_aside_settles_into_a_point),

        cmocka_unit_test(test_sightings_before_any_odometry_start_the_clock),
        cmocka_unit_test(test_sightings_ahead_of_a_clock_without_odometry_are_seen_from_the_start),
        cmocka_unit_test(test_pose_at_a_past_time_is_where_the_robot_was),
        cmocka_unit_test(test_pose_at_within_a_step_is_on_the_arc),
        cmocka_unit_test(test_pose_at_ahead_goes_on_as_before_up_to_its_limit),
        cmocka_unit_test(test_sightings_are_placed_from_where_the_robot_was),
        cmocka_unit_test(test_sightings_delay_shifts_where_they_are_placed_from),
        cmocka_unit_test(test_sightings_of_a_delayed_frame_before_the_clock_are_refused),
        cmocka_unit_test(test_sightings_that_come_late_count_as_if_they_had_come_in_time),
        cmocka_unit_test(test_pose_and_covariance_between_frames_are_what_the_filter_arrives_at),
        cmocka_unit_test(test_odometry_beyond_the_room_to_wait_is_predicted_in_order),

        cmocka_unit_test(test_odometry_largest_motion_does_not_overflow_the_distance_travelled),
        cmocka_unit_test(test_resume_odometry_adds_the_doubt_and_starts_the_clock_anew),
        cmocka_unit_test(test_resume_odometry_after_an_encoder_reset_takes_the_new_ticks),
        cmocka_unit_test(test_resume_odometry_forgets_the_past_before_it),
        cmocka_unit_test(test_resume_odometry_with_a_clock_that_starts_over_goes_on),
        cmocka_unit_test(test_resume_odometry_robot_carried_elsewhere_finds_itself_in_its_map),
        cmocka_unit_test(test_sightings_heading_far_in_doubt_is_found_in_one_frame),
        cmocka_unit_test(test_sightings_heading_that_is_known_is_corrected_in_one_step),
        cmocka_unit_test(test_resume_odometry_impossible_doubt_is_refused_and_changes_nothing),
        cmocka_unit_test(test_resume_odometry_with_velocity_states_forgets_the_speed),

        cmocka_unit_test(test_sightings_of_known_beacons_localise_and_never_move_them),

        cmocka_unit_test(test_beacon_view_has_the_papers_polar_coordinates),
        cmocka_unit_test(test_init_starts_at_the_origin_with_an_empty_map),
        cmocka_unit_test(test_pose_covariance_is_the_lower_triangle_of_the_states),
        cmocka_unit_test(test_set_pose_refuses_each_number_that_is_not_finite_and_changes_nothing),
        cmocka_unit_test(test_sightings_of_a_lost_robot_are_deferred_until_it_has_a_pose),
        cmocka_unit_test(test_counters_a_state_that_is_not_finite_is_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
