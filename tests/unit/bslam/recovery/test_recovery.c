#include "covariance.h"
#include "known_map.h"
#include "support.h"

#include <math.h>

#include "bslam/recovery/recovery.h"
#include "plain_settings.h"

#define PI 3.14159265358979323846

enum { STEP_US = 40000, BEACONS = 4 };

static const double beacons[BEACONS][2] = {{3, 1}, {4, -2}, {6, 2}, {5, 4}};
static bslam_slam_t slam;
static bslam_recovery_t recovery;
static int64_t now_us;
static double stretch = 1;  // by which all distances are measured too long
static int cut = -1;        // the beacon that is seen bearing-only

static int setup(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.left_speed_sd_mps = BSLAM_R(0.01);
    settings.right_speed_sd_mps = BSLAM_R(0.01);
    int bad_id;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    recovery = (bslam_recovery_t){0};
    now_us = 0;
    return 0;
}

static bslam_sighting_t seen_from(double x, double y, double theta, int beacon)
{
    const double dx = beacons[beacon][0] - x;
    const double dy = beacons[beacon][1] - y;
    bslam_sighting_t seen =
        unit_polar(remainder(atan2(dy, dx) - theta, 2 * PI), stretch * hypot(dx, dy), beacon);
    seen.has_range = beacon != cut;
    return seen;
}

static void show(const bslam_sighting_t *seen, int count)
{
    now_us += STEP_US;
    assert_int_equal(bslam_recovery_sightings(&recovery, &slam, now_us, seen, count), BSLAM_OK);
}

/// A frame of a robot that stands at (x, y, theta) and says so by its wheels, with the first `count` beacons.
static void look_from(double x, double y, double theta, int count)
{
    bslam_sighting_t seen[BEACONS];
    for (int i = 0; i < count; i++) {
        seen[i] = seen_from(x, y, theta, i);
    }
    now_us += STEP_US;
    const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us};
    assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
    assert_int_equal(bslam_recovery_sightings(&recovery, &slam, now_us, seen, count), BSLAM_OK);
}

static void look_on(int frames, double x, double y, double theta, int count)
{
    for (int k = 0; k < frames; k++) {
        look_from(x, y, theta, count);
    }
}

static void assert_at(double x, double y, double theta)
{
    const bslam_pose_t pose = bslam_slam_pose(&slam);
    assert_near(pose.x_m, x, 0.05);
    assert_near(pose.y_m, y, 0.05);
    assert_near(unit_angle_between((double)pose.theta_rad, theta), 0, 0.02);
}

static void test_recovery_of_a_robot_that_stays_changes_nothing(void **state)
{
    static bslam_slam_t alone;
    look_on(50, 0, 0, 0, BEACONS);
    alone = slam;
    setup(NULL);
    for (int k = 0; k < 50; k++) {
        bslam_sighting_t seen[BEACONS];
        for (int i = 0; i < BEACONS; i++) {
            seen[i] = unit_polar(atan2(beacons[i][1], beacons[i][0]), hypot(beacons[i][0], beacons[i][1]), i);
        }
        now_us += STEP_US;
        const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us};
        assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
        assert_int_equal(bslam_slam_sightings(&slam, now_us, seen, BEACONS), BSLAM_OK);
    }
    assert_memory_equal(alone.ekf.mean, slam.ekf.mean, sizeof slam.ekf.mean);
    assert_memory_equal(&alone.ekf.factor, &slam.ekf.factor, sizeof slam.ekf.factor);
    assert_int_equal(recovery.counters.withheld, 0);
}

static void test_recovery_of_a_carried_robot_notices_and_finds_it_with_the_map_kept(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    const bslam_ekf_t before = slam.ekf;
    look_from(1, 2, 2.5, BEACONS);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_DOUBTING);
    assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_LOST);
    look_on(7, 1, 2, 2.5, BEACONS);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_LOST);
    bslam_real_t lower[6];
    bslam_slam_pose_covariance(&slam, lower);
    assert_true(lower[0] >= 900 && lower[5] >= BSLAM_R(10.2));
    look_on(2, 1, 2, 2.5, BEACONS);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_FOLLOWING);
    assert_int_equal(recovery.counters.lost, 1);
    assert_int_equal(recovery.counters.found, 1);
    for (int i = 3; i < slam.ekf.dim; i++) {
        assert_true(slam.ekf.mean[i] == before.mean[i]);
    }
    look_on(20, 1, 2, 2.5, BEACONS);
    assert_at(1, 2, 2.5);
    assert_int_equal(slam.ekf.beacon_count, BEACONS);
}

static void test_recovery_goes_by_the_beacons_own_scales(void **state)
{
    slam.settings.range_scale_sd = BSLAM_R(0.1);
    look_on(50, 0, 0, 0, BEACONS);
    for (int b = 0; b < BEACONS; b++) {
        assert_int_equal(slam.ekf.beacons[b].kind, BSLAM_BEACON_SIZED);
        const int at = slam.ekf.beacons[b].at + BSLAM_POINT_DIM;
        slam.ekf.mean[at] = BSLAM_R(1.2);
        covariance_forget(&slam.ekf, at, 1e-4);
    }
    stretch = 1.2;
    look_on(10, 1, 2, 2.5, BEACONS);
    stretch = 1;
    assert_int_equal(recovery.counters.found, 1);
    assert_at(1, 2, 2.5);
}

static void test_recovery_by_two_beacons_takes_time(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    look_on(8, 1, 2, -1, 2);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_LOST);
    look_on(2, 1, 2, -1, 2);  // the frames of the doubt count
    assert_int_equal(recovery.counters.found, 1);
    assert_at(1, 2, -1);
}

/// By turns one of two beacons is seen bearing-only, as at the edge of a frame.
static void test_recovery_by_two_beacons_that_are_never_seen_whole_together(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    for (int k = 0; k < 40; k++) {
        cut = k % 2;
        look_from(1, 2, -1, 2);
    }
    cut = -1;
    assert_int_equal(recovery.counters.found, 1);
    assert_at(1, 2, -1);
}

static void test_recovery_counts_no_clue_from_before_a_frame_that_was_used(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    look_on(5, 1, 2, -1, 2);
    look_on(1, 0, 0, 0, BEACONS);
    assert_int_equal(recovery.memory_count, 0);
    look_on(4, 1, 2, -1, 2);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_LOST);
    look_on(3, 1, 2, -1, 2);
    assert_int_equal(recovery.counters.found, 0);
    look_on(2, 1, 2, -1, 2);
    assert_int_equal(recovery.counters.found, 1);
}

static void
test_recovery_by_one_beacon_that_is_elsewhere_gets_lost_in_a_second_and_learns_nothing(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    const bslam_ekf_t before = slam.ekf;
    look_on(24, 1, 2, -1, 1);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_DOUBTING);
    assert_memory_equal(before.mean, slam.ekf.mean, sizeof before.mean);
    look_on(1, 1, 2, -1, 1);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_LOST);
}

static void test_recovery_of_one_odd_beacon_ends_where_another_agrees(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    look_on(20, 1, 2, -1, 1);
    look_on(1, 0, 0, 0, 1);
    look_on(24, 1, 2, -1, 1);
    assert_int_equal(recovery.counters.lost, 1);  // 19 are left, and 6 more are enough
    setup(NULL);
    look_on(50, 0, 0, 0, BEACONS);
    look_on(20, 1, 2, -1, 1);
    look_on(8, 1, 2, -1, 0);  // nothing is seen
    look_on(24, 1, 2, -1, 1);
    assert_int_equal(recovery.counters.lost, 0);
}

static void test_recovery_of_one_odd_beacon_ends_where_another_agrees_beside_it(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    look_on(20, 1, 2, -1, 1);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_DOUBTING);
    const bslam_sighting_t seen[] = {seen_from(1, 2, -1, 0), seen_from(0, 0, 0, 1)};
    const uint32_t before = recovery.counters.contradicting;
    show(seen, 2);
    assert_int_equal(recovery.counters.contradicting, before + 1);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_FOLLOWING);
    assert_int_equal(recovery.counters.lost, 0);
}

/// Where as many beacons contradict as agree the robot is in doubt only if all of them are right elsewhere:
/// here from a place on a circle around beacon 0, which is seen alike from there.
static void test_recovery_of_as_many_that_agree_doubts_if_all_fit_elsewhere(void **state)
{
    const double turn = 0.5;
    const double x = beacons[0][0] - cos(turn) * beacons[0][0] + sin(turn) * beacons[0][1];
    const double y = beacons[0][1] - sin(turn) * beacons[0][0] - cos(turn) * beacons[0][1];
    const bslam_sighting_t all[] = {seen_from(x, y, turn, 0), seen_from(x, y, turn, 2)};
    const bslam_sighting_t three_of_four[] = {all[0], seen_from(0, 0, 0, 1), all[1],
                                              seen_from(x, y, turn, 3)};
    look_on(50, 0, 0, 0, BEACONS);
    show(three_of_four, BEACONS);
    assert_int_equal(recovery.counters.contradicting, 2);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_FOLLOWING);
    setup(NULL);
    look_on(50, 0, 0, 0, BEACONS);
    show(all, 2);
    assert_int_equal(recovery.counters.contradicting, 1);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_DOUBTING);
}

static void test_recovery_in_a_map_of_one_beacon_is_never_lost(void **state)
{
    look_on(50, 0, 0, 0, 1);
    look_on(100, 1, 2, -1, 1);
    assert_int_equal(recovery.counters.contradicting, 0);
    assert_int_equal(recovery.counters.lost, 0);
}

static void test_recovery_by_one_beacon_is_never_a_guess(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    look_on(200, 1, 2, -1, 1);
    assert_int_equal(recovery.counters.lost, 1);
    assert_int_equal(recovery.counters.found, 0);
    assert_int_equal(slam.ekf.beacon_count, BEACONS);
}

static void test_recovery_of_a_short_glitch_does_not_get_lost(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    look_on(4, 1, 2, 2.5, BEACONS);
    look_on(10, 0, 0, 0, BEACONS);
    assert_int_equal(recovery.counters.lost, 0);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_FOLLOWING);
    assert_at(0, 0, 0);
}

/// The beacon is tentative, and its time is up with the next frame.
static void end_time_of(bslam_beacon_t *beacon)
{
    slam.settings.confirm_window_us = (int32_t)now_us;
    beacon->first_seen_us = 0;
    beacon->confirmed = false;
    beacon->views = 1;
    beacon->gated = 1;
}

/// What time alone does goes on: a tentative beacon whose time is up leaves, upon which the smoother begins
/// its cycle anew.
static void test_recovery_withholds_a_frame_as_if_nothing_was_seen(void **state)
{
    static bslam_smoother_t smoother;
    static bslam_slam_t unseeing;
    static bslam_smoother_t its_smoother;
    slam.settings.filter = BSLAM_FILTER_SMOOTHER;
    bslam_slam_attach_smoother(&slam, &smoother);
    look_on(40, 0, 0, 0, BEACONS);
    end_time_of(&slam.ekf.beacons[2]);
    unseeing = slam;
    its_smoother = smoother;
    unseeing.smoother = &its_smoother;
    for (int k = 0; k < 24; k++) {
        look_from(1, 2, -1, 1);
        const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us};
        assert_int_equal(bslam_slam_odometry(&unseeing, &still), BSLAM_OK);
        assert_int_equal(bslam_slam_sightings(&unseeing, now_us, NULL, 0), BSLAM_OK);
        assert_memory_equal(unseeing.ekf.mean, slam.ekf.mean, sizeof slam.ekf.mean);
        assert_memory_equal(&unseeing.ekf.factor, &slam.ekf.factor, sizeof slam.ekf.factor);
    }
    assert_int_equal(recovery.counters.withheld, 24);
    assert_int_equal(slam.ekf.beacon_count, BEACONS - 1);
}

/// A tentative beacon's time may be over when the robot is found again: it leaves with the frame after.
static void test_recovery_of_a_robot_that_is_found_leaves_the_map_as_it_was(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    look_on(8, 1, 2, 2.5, BEACONS);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_LOST);
    end_time_of(&slam.ekf.beacons[3]);
    while (recovery.counters.found == 0) {
        look_on(1, 1, 2, 2.5, 3);
        assert_int_equal(slam.ekf.beacon_count, BEACONS);
    }
    look_on(1, 1, 2, 2.5, 3);
    assert_int_equal(slam.ekf.beacon_count, BEACONS - 1);
}

// ---- by appearance
// ---------------------------------------------------------------------------------------------

static bslam_appearance_t appearance;

/// From here on appearance tells who is seen: beacon 1 has a classifier of its own, 0 and 3 share one.
static void go_by_looks(void)
{
    look_on(50, 0, 0, 0, BEACONS);
    assert_int_equal(bslam_appearance_init(&appearance, NULL, 0), BSLAM_OK);
    slam.settings.association = BSLAM_ASSOCIATION_SVM;
    bslam_slam_attach_appearance(&slam, &appearance);
    unit_give_machine(&appearance, 0, 1, 16);
    unit_give_machine(&appearance, 1, -1, 16);
    appearance.of[3].classifier = appearance.of[0].classifier;
}

/// What a frame contradicts in which beacon 1 is seen where it is, and at (x, y) something that looks as
/// beacons 0 and 3 do.
static uint32_t contradicting(double x, double y)
{
    const float one[BSLAM_SAMPLE_FEATURES] = {-1.0f};
    const float shared[BSLAM_SAMPLE_FEATURES] = {1.0f};
    bslam_sighting_t seen[] = {
        unit_polar(atan2(beacons[1][1], beacons[1][0]), hypot(beacons[1][0], beacons[1][1]), -1),
        unit_polar(atan2(y, x), hypot(x, y), -1)};
    seen[0].signature = one;
    seen[1].signature = shared;
    now_us += STEP_US;
    const uint32_t before = recovery.counters.contradicting;
    assert_int_equal(bslam_recovery_sightings(&recovery, &slam, now_us, seen, 2), BSLAM_OK);
    return recovery.counters.contradicting - before;
}

static void test_recovery_of_beacons_that_look_alike_either_may_be_seen(void **state)
{
    go_by_looks();
    assert_int_equal(contradicting(beacons[0][0], beacons[0][1]), 0);
    assert_int_equal(contradicting(beacons[3][0], beacons[3][1]), 0);
    assert_int_equal(contradicting(-3, 3), 1);
}

/// A beacon where the robot stands, or one whose variance is negative, has no distance from what is seen: it
/// says nothing, and the other one that looks like it is asked.
static void test_recovery_of_beacons_that_look_alike_one_without_a_distance_is_passed_over(void **state)
{
    go_by_looks();
    bslam_beacon_t *other = &slam.ekf.beacons[3];
    slam.ekf.mean[other->at] = slam.ekf.mean[0];
    slam.ekf.mean[other->at + 1] = slam.ekf.mean[1];
    assert_int_equal(contradicting(beacons[0][0], beacons[0][1]), 0);
    setup(NULL);
    go_by_looks();
    covariance_break(&slam.ekf, other->at, 2);
    assert_int_equal(contradicting(beacons[0][0], beacons[0][1]), 0);
}

// ---- a map that grows -------------------------------------------------------------------------------------

/// From here on appearance tells who is seen: beacon b by feature b.
static void go_by_own_looks(void)
{
    look_on(50, 0, 0, 0, BEACONS);
    assert_int_equal(bslam_appearance_init(&appearance, NULL, 0), BSLAM_OK);
    slam.settings.association = BSLAM_ASSOCIATION_SVM;
    slam.settings.learn_budget = 0;
    slam.settings.gate_d2 = 9;  // a slip may explain what is seen, but the filter knows of none
    bslam_slam_attach_appearance(&slam, &appearance);
    for (int b = 0; b < BEACONS; b++) {
        float weights[BSLAM_SAMPLE_SIZE] = {0};
        weights[b] = BSLAM_SAMPLE_UNIT;
        unit_give_machine(&appearance, b, 0, 16);
        bslam_weights_round(weights, &appearance.learner.classifiers[appearance.of[b].classifier].weights);
    }
}

/// A frame of a robot that has not moved by its wheels, and sees the first `count` beacons, by their
/// appearance, as from (x, y, theta).
static void look_alike_from(double x, double y, double theta, int count)
{
    float signatures[BEACONS][BSLAM_SAMPLE_FEATURES] = {{0}};
    bslam_sighting_t seen[BEACONS];
    for (int i = 0; i < count; i++) {
        signatures[i][i] = 1;
        seen[i] = seen_from(x, y, theta, i);
        seen[i].label = BSLAM_LABEL_NONE;
        seen[i].signature = signatures[i];
    }
    now_us += STEP_US;
    const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us};
    assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
    assert_int_equal(bslam_recovery_sightings(&recovery, &slam, now_us, seen, count), BSLAM_OK);
}

static void test_recovery_in_a_map_that_grows_sets_the_robot_where_four_beacons_fit(void **state)
{
    go_by_own_looks();
    const bslam_ekf_t before = slam.ekf;
    for (int k = 0; k < 2; k++) {
        look_alike_from(1, 2, 2.5, BEACONS);
        assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_FOLLOWING);
    }
    assert_int_equal(recovery.counters.lost, 0);
    assert_int_equal(recovery.counters.withheld, 0);
    assert_true(slam.ekf.beacon_count > BEACONS);  // taken for new ones meanwhile
    look_alike_from(1, 2, 2.5, BEACONS);
    assert_int_equal(recovery.counters.lost, 1);
    assert_int_equal(recovery.counters.found, 1);
    assert_int_equal(recovery.counters.withheld, 1);
    assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_FOLLOWING);
    assert_at(1, 2, 2.5);
    assert_int_equal(slam.ekf.beacon_count, BEACONS);
    for (int b = 0; b < BEACONS; b++) {
        const int at = before.beacons[b].at;
        assert_near(slam.ekf.mean[at], before.mean[at], 1e-3);
        assert_near(slam.ekf.mean[at + 1], before.mean[at + 1], 1e-3);
    }
}

/// What is new may look like a beacon of the map, so that a few that fit elsewhere prove nothing.
static void test_recovery_in_a_map_that_grows_is_not_lost_by_three_beacons(void **state)
{
    go_by_own_looks();
    for (int k = 0; k < 40; k++) {
        look_alike_from(1, 2, 2.5, 3);
    }
    assert_int_equal(recovery.counters.lost, 0);
    assert_int_equal(recovery.counters.withheld, 0);
    assert_at(0, 0, 0);
}

static void test_recovery_in_a_map_that_grows_counts_what_fits_where_the_robot_is_held_to_be(void **state)
{
    go_by_own_looks();
    cut = 0;
    look_alike_from(0, 0, 0, 1);
    cut = -1;
    for (int k = 0; k < 10; k++) {
        look_alike_from(1, 2, 2.5, BEACONS);
    }
    assert_int_equal(recovery.counters.lost, 0);
    assert_true(recovery.counters.contradicting > 0);
}

/// What began once the robot was found again was there before the next doubt.
static void test_recovery_in_a_map_that_grows_a_doubt_ends_where_the_robot_is_found(void **state)
{
    go_by_own_looks();
    for (int k = 0; k < 3; k++) {
        look_alike_from(1, 2, 2.5, BEACONS);
    }
    const float none[BSLAM_SAMPLE_FEATURES] = {0};
    bslam_sighting_t seen = unit_polar(0, 2, -1);
    seen.signature = none;
    show(&seen, 1);
    assert_int_equal(slam.ekf.beacon_count, BEACONS + 1);
    for (int k = 0; k < 3; k++) {
        look_alike_from(0, 0, 0, BEACONS);
    }
    assert_int_equal(recovery.counters.found, 2);
    assert_at(0, 0, 0);
    assert_int_equal(slam.ekf.beacon_count, BEACONS + 1);
}

static void test_recovery_in_a_map_that_has_settled_one_beacon_is_enough(void **state)
{
    go_by_own_looks();
    slam.settings.settled_us = 0;
    for (int k = 0; k < 25; k++) {
        assert_int_equal(recovery.counters.lost, 0);
        look_alike_from(1, 2, 2.5, 1);
    }
    assert_int_equal(recovery.counters.lost, 1);
    assert_int_equal(recovery.counters.withheld, 25);
}

/// A kept map does not grow by what it was loaded with, nor a frozen one by anything.
static void test_recovery_takes_a_kept_map_for_settled(void **state)
{
    for (int frozen = 0; frozen < 2; frozen++) {
        setup(NULL);
        go_by_own_looks();
        slam.is_frozen = frozen != 0;
        if (!slam.is_frozen) {
            recovery = (bslam_recovery_t){0};
            slam.counters.added = 0;
        }
        look_alike_from(1, 2, 2.5, 1);
        assert_int_equal(bslam_recovery_state(&recovery, &slam), BSLAM_RECOVERY_DOUBTING);
        assert_int_equal(recovery.counters.withheld, 1);
    }
}

// ---- what is refused --------------------------------------------------------------------------------------

static void test_recovery_refuses_as_the_pipeline_does(void **state)
{
    look_on(50, 0, 0, 0, BEACONS);
    static bslam_slam_t before;
    static bslam_recovery_t recovery_before;
    memcpy(&before, &slam, sizeof slam);
    memcpy(&recovery_before, &recovery, sizeof recovery);
    bslam_sighting_t seen = unit_polar(0, NAN, 0);
    assert_int_equal(bslam_recovery_sightings(&recovery, &slam, now_us + 1, &seen, 1), BSLAM_E_NOT_FINITE);
    before.counters.frames_refused++;
    before.bad_sighting = 0;
    assert_memory_equal(&before, &slam, sizeof slam);
    assert_memory_equal(&recovery_before, &recovery, sizeof recovery);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_recovery_of_a_robot_that_stays_changes_nothing, setup),
        cmocka_unit_test_setup(test_recovery_of_a_carried_robot_notices_and_finds_it_with_the_map_kept,
                               setup),
        cmocka_unit_test_setup(test_recovery_goes_by_the_beacons_own_scales, setup),
        cmocka_unit_test_setup(test_recovery_by_two_beacons_takes_time, setup),
        cmocka_unit_test_setup(test_recovery_by_two_beacons_that_are_never_seen_whole_together, setup),
        cmocka_unit_test_setup(test_recovery_counts_no_clue_from_before_a_frame_that_was_used, setup),
        cmocka_unit_test_setup(
            test_recovery_by_one_beacon_that_is_elsewhere_gets_lost_in_a_second_and_learns_nothing, setup),
        cmocka_unit_test_setup(test_recovery_of_one_odd_beacon_ends_where_another_agrees, setup),
        cmocka_unit_test_setup(test_recovery_of_one_odd_beacon_ends_where_another_agrees_beside_it, setup),
        cmocka_unit_test_setup(test_recovery_of_as_many_that_agree_doubts_if_all_fit_elsewhere, setup),
        cmocka_unit_test_setup(test_recovery_in_a_map_of_one_beacon_is_never_lost, setup),
        cmocka_unit_test_setup(test_recovery_by_one_beacon_is_never_a_guess, setup),
        cmocka_unit_test_setup(test_recovery_of_a_short_glitch_does_not_get_lost, setup),
        cmocka_unit_test_setup(test_recovery_withholds_a_frame_as_if_nothing_was_seen, setup),
        cmocka_unit_test_setup(test_recovery_of_a_robot_that_is_found_leaves_the_map_as_it_was, setup),
        cmocka_unit_test_setup(test_recovery_of_beacons_that_look_alike_either_may_be_seen, setup),
        cmocka_unit_test_setup(test_recovery_of_beacons_that_look_alike_one_without_a_distance_is_passed_over,
                               setup),
        cmocka_unit_test_setup(test_recovery_in_a_map_that_grows_sets_the_robot_where_four_beacons_fit,
                               setup),
        cmocka_unit_test_setup(test_recovery_in_a_map_that_grows_is_not_lost_by_three_beacons, setup),
        cmocka_unit_test_setup(
            test_recovery_in_a_map_that_grows_counts_what_fits_where_the_robot_is_held_to_be, setup),
        cmocka_unit_test_setup(test_recovery_in_a_map_that_grows_a_doubt_ends_where_the_robot_is_found,
                               setup),
        cmocka_unit_test_setup(test_recovery_in_a_map_that_has_settled_one_beacon_is_enough, setup),
        cmocka_unit_test_setup(test_recovery_takes_a_kept_map_for_settled, setup),
        cmocka_unit_test_setup(test_recovery_refuses_as_the_pipeline_does, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
