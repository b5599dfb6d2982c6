// What a beacon is taken for, and the scale that its distances have by that.
#include "support.h"

#include <math.h>

#include "bslam/slam/slam.h"
#include "bslam/smoother/smoother.h"
#include "plain_settings.h"

enum { STEP_US = 40000, DOOR = 3, CABINET = 7 };

static bslam_slam_t slam;
static int64_t now_us;

static int setup(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.gate_d2 = BSLAM_R(13.8);
    settings.ray_linear_limit = BSLAM_R(1e-4);  // rays stay rays
    settings.left_speed_sd_mps = 0;
    settings.right_speed_sd_mps = 0;
    int bad_id;
    memset(&slam, 0, sizeof slam);
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    now_us = 0;
    return 0;
}

/// The robot stands, and sees one thing.
static void see(bslam_sighting_t seen)
{
    const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us + STEP_US};
    now_us += STEP_US;
    assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
    assert_int_equal(bslam_slam_sightings(&slam, now_us, &seen, 1), BSLAM_OK);
}

/// A thing 4 m ahead, called this, with a distance that is `factor` times as long.
static bslam_sighting_t called(uint8_t beacon_class, double factor)
{
    bslam_sighting_t seen = unit_polar(0, 4 * factor, 1);
    seen.range_sd_m = BSLAM_R(0.05);
    seen.range_scale_sd = BSLAM_R(0.05);
    seen.beacon_class = beacon_class;
    return seen;
}

static bslam_sighting_t cut_off(uint8_t beacon_class)
{
    bslam_sighting_t seen = unit_direction(0, 1);
    seen.beacon_class = beacon_class;
    return seen;
}

static const bslam_beacon_t *beacon(void)
{
    assert_int_equal(slam.ekf.beacon_count, 1);
    return &slam.ekf.beacons[0];
}

static double scale(void)
{
    assert_int_equal(beacon()->kind, BSLAM_BEACON_SIZED);
    return (double)slam.ekf.mean[beacon()->at + 2];
}

static double variance(int value)
{
    return (double)bslam_ekf_covariance(&slam.ekf, beacon()->at + value, beacon()->at + value);
}

static void test_distance_of_something_else_is_not_used(void **state)
{
    for (int i = 0; i < 5; i++) {
        see(called(DOOR, 1));
    }
    for (int i = 0; i < 5; i++) {
        see(called(CABINET, 1.02));
        assert_int_equal(beacon()->beacon_class, DOOR);
        assert_near(slam.ekf.mean[beacon()->at], 4, 1e-5);
    }
    see(called(DOOR, 1.02));
    assert_true(slam.ekf.mean[beacon()->at] > 4.005);
}

static void test_class_is_what_its_distances_call_it_most_often(void **state)
{
    for (int i = 0; i < 3; i++) {
        see(called(DOOR, 1));
        assert_int_equal(beacon()->beacon_class, DOOR);
    }
    for (int i = 0; i < 3; i++) {  // undoes one each
        see(called(CABINET, 1.1));
        assert_int_equal(beacon()->beacon_class, DOOR);
    }
    see(called(CABINET, 1.1));
    assert_int_equal(beacon()->beacon_class, CABINET);
    see(called(DOOR, 1));
    see(called(DOOR, 1));
    assert_int_equal(beacon()->beacon_class, DOOR);
}

static void test_class_changes_after_so_many_sightings_however_long_it_was_another(void **state)
{
    for (int i = 0; i < 3 * BSLAM_LEAD_MAX; i++) {
        see(called(DOOR, 1));
    }
    for (int i = 0; i < BSLAM_LEAD_MAX; i++) {
        see(called(CABINET, 1));
        assert_int_equal(beacon()->beacon_class, DOOR);
    }
    see(called(CABINET, 1));
    assert_int_equal(beacon()->beacon_class, CABINET);
}

static void test_class_is_not_voted_for_by_directions_nor_by_what_has_none(void **state)
{
    see(called(DOOR, 1));
    for (int i = 0; i < 5; i++) {
        see(cut_off(CABINET));
        see(called(BSLAM_CLASS_NONE, 1));
    }
    assert_int_equal(beacon()->beacon_class, DOOR);
    see(called(CABINET, 1));
    assert_int_equal(beacon()->beacon_class, DOOR);
    see(called(CABINET, 1));
    assert_int_equal(beacon()->beacon_class, CABINET);
}

/// A gated sighting is none of the beacon's.
static void test_class_is_not_voted_for_by_what_is_gated_out(void **state)
{
    see(called(DOOR, 1));
    see(called(DOOR, 1));
    const bslam_beacon_t *door = &slam.ekf.beacons[0];
    assert_int_equal(door->class_lead, 2);
    bslam_sighting_t aside = called(CABINET, 1);
    aside.bearing_rad = 1;
    see(aside);
    assert_int_equal(door->sightings, 2);
    assert_int_equal(door->class_lead, 2);
}

/// What counts in a frame is what was fused in it, not what the frame before had at its place.
static void test_class_is_not_voted_for_by_what_starts_a_beacon(void **state)
{
    see(called(DOOR, 1));
    see(called(DOOR, 1));
    bslam_sighting_t other = called(CABINET, 1);
    other.label = 2;
    other.bearing_rad = 1;
    see(other);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_NEW);
    assert_int_equal(slam.ekf.beacons[0].class_lead, 2);
    assert_int_equal(slam.ekf.beacons[1].class_lead, 1);
}

static void test_another_class_has_another_scale_in_more_doubt(void **state)
{
    for (int i = 0; i < 2 * BSLAM_LEAD_MAX; i++) {
        see(called(DOOR, 1));
    }
    slam.ekf.mean[beacon()->at + 2] = BSLAM_R(1.05);  // as if it had been learned
    for (int i = 0; i < BSLAM_LEAD_MAX; i++) {
        see(called(CABINET, 1.1));
        assert_near(scale(), 1.05, 1e-5);
    }
    see(called(CABINET, 1.1));
    assert_near(scale(), 1, 0);
    assert_near(variance(2), 0.0025 + 0.01, 1e-6);
    see(called(CABINET, 1.1));  // its distances count from now on
    assert_true(scale() > 1.01);
}

static bool passes(double factor)
{
    const double before_m = (double)slam.ekf.mean[beacon()->at];
    see(called(DOOR, factor));
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_MATCHED);  // its direction is right
    return fabs((double)slam.ekf.mean[beacon()->at] - before_m) > 1e-4 || fabs(scale() - 1) > 1e-4;
}

/// Two sizes take turns: its distances are those of the one that is measured more often.
static void test_distances_that_do_not_fit_are_not_used_while_they_are_fewer(void **state)
{
    for (int i = 0; i < 5; i++) {
        see(called(DOOR, 1));
    }
    assert_int_equal(beacon()->distance_lead, 4);  // the first one has nothing to fit
    for (int i = 0; i < 4; i++) {
        assert_false(passes(1.4));
    }
    assert_int_equal(beacon()->distance_lead, 0);
    see(called(DOOR, 1));
    assert_near(scale(), 1, 1e-5);
    assert_false(passes(1.4));
    assert_true(passes(1.4));  // and now it is the other
    assert_true(slam.ekf.mean[beacon()->at] * slam.ekf.mean[beacon()->at + 2] > 4 * 1.2);
}

/// However long it was of one size.
static void test_another_size_is_believed_after_so_many_distances(void **state)
{
    for (int i = 0; i < 3 * BSLAM_LEAD_MAX; i++) {
        see(called(DOOR, 1));
    }
    for (int i = 0; i < BSLAM_LEAD_MAX; i++) {
        assert_false(passes(1.4));
    }
    const double place_var_m2 = variance(0);
    assert_true(passes(1.4));
    assert_true(variance(0) > 1.5 * place_var_m2);  // what the old size said of the place is doubted
}

/// As much is known of place and scale as if the distance had been there at first: a direction from the same
/// place adds to that only across.
static void test_ray_that_is_seen_with_a_distance_is_sized_from_then_on(void **state)
{
    see(cut_off(DOOR));
    assert_int_equal(beacon()->kind, BSLAM_BEACON_RAY);
    see(cut_off(CABINET));
    assert_int_equal(beacon()->kind, BSLAM_BEACON_RAY);
    see(called(CABINET, 0.5));  // 2 m: far from where a ray is thought to end
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_MATCHED);
    assert_int_equal(beacon()->beacon_class, CABINET);
    assert_near(slam.ekf.mean[beacon()->at], 2, 1e-5);
    assert_near(scale(), 1, 1e-6);
    const double along = variance(0), common = 0.05 * 2;
    assert_near(along, 0.05 * 0.05 + common * common, 1e-5);
    assert_near(variance(2), 0.0025, 1e-6);
    assert_near(bslam_ekf_covariance(&slam.ekf, beacon()->at, beacon()->at + 2), -0.0025 * 2, 1e-6);
}

static void test_ray_that_a_distance_from_elsewhere_is_taken_for_stays(void **state)
{
    see(cut_off(DOOR));
    bslam_sighting_t elsewhere = called(DOOR, 1);
    elsewhere.bearing_rad = BSLAM_R(0.5);
    see(elsewhere);
    assert_int_not_equal(slam.accounts[0].beacon_uid, slam.ekf.beacons[0].uid);
    assert_int_equal(slam.ekf.beacons[0].kind, BSLAM_BEACON_RAY);
}

static void test_ray_without_any_scale_is_as_ever(void **state)
{
    see(cut_off(DOOR));
    bslam_sighting_t seen = called(DOOR, 1);
    seen.range_scale_sd = 0;
    see(seen);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_MATCHED);
    assert_int_equal(beacon()->kind, BSLAM_BEACON_RAY);
}

static void test_point_that_is_seen_with_a_distance_is_sized_from_then_on(void **state)
{
    bslam_sighting_t first = called(DOOR, 1);
    first.range_scale_sd = 0;
    see(first);
    assert_int_equal(beacon()->kind, BSLAM_BEACON_POINT);
    see(called(CABINET, 1.1));
    assert_int_equal(beacon()->beacon_class, CABINET);
    assert_true(scale() > 1.01);  // which place and scale share
    assert_true(slam.ekf.mean[beacon()->at] > 4);
}

/// Its class is voted for as any other's.
static void test_point_without_room_for_a_scale_stays_one(void **state)
{
    bslam_sighting_t first = called(DOOR, 1);
    first.range_scale_sd = 0;
    see(first);
    see(first);
    slam.ekf.sized_count = 2 * BSLAM_RAYS_MAX;  // as if others had it all
    see(called(CABINET, 1));
    assert_int_equal(beacon()->kind, BSLAM_BEACON_POINT);
    assert_int_equal(beacon()->beacon_class, DOOR);
    assert_int_equal(beacon()->class_lead, 1);
}

static void test_known_beacon_is_what_it_was_given_as(void **state)
{
    assert_int_equal(bslam_slam_add_known_beacon(&slam, 1, 4, 0), BSLAM_OK);
    see(called(DOOR, 1));
    assert_int_equal(beacon()->kind, BSLAM_BEACON_KNOWN);
    assert_int_equal(beacon()->beacon_class, BSLAM_CLASS_NONE);
}

/// Its beacons are points: a scale would move their values.
static void test_with_a_smoother_no_beacon_changes_its_kind(void **state)
{
    static bslam_smoother_t smoother;
    bslam_settings_t settings = slam.settings;
    settings.filter = BSLAM_FILTER_SMOOTHER;
    int bad_id;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    bslam_slam_attach_smoother(&slam, &smoother);
    see(cut_off(DOOR));
    const bslam_beacon_kind_t kind = beacon()->kind;
    for (int i = 0; i < 5; i++) {
        see(called(DOOR, 1));
        assert_int_equal(beacon()->kind, kind);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_distance_of_something_else_is_not_used, setup),
        cmocka_unit_test_setup(test_class_is_what_its_distances_call_it_most_often, setup),
        cmocka_unit_test_setup(test_class_changes_after_so_many_sightings_however_long_it_was_another, setup),
        cmocka_unit_test_setup(test_distances_that_do_not_fit_are_not_used_while_they_are_fewer, setup),
        cmocka_unit_test_setup(test_another_size_is_believed_after_so_many_distances, setup),
        cmocka_unit_test_setup(test_class_is_not_voted_for_by_directions_nor_by_what_has_none, setup),
        cmocka_unit_test_setup(test_class_is_not_voted_for_by_what_is_gated_out, setup),
        cmocka_unit_test_setup(test_class_is_not_voted_for_by_what_starts_a_beacon, setup),
        cmocka_unit_test_setup(test_another_class_has_another_scale_in_more_doubt, setup),
        cmocka_unit_test_setup(test_ray_that_is_seen_with_a_distance_is_sized_from_then_on, setup),
        cmocka_unit_test_setup(test_ray_that_a_distance_from_elsewhere_is_taken_for_stays, setup),
        cmocka_unit_test_setup(test_ray_without_any_scale_is_as_ever, setup),
        cmocka_unit_test_setup(test_point_that_is_seen_with_a_distance_is_sized_from_then_on, setup),
        cmocka_unit_test_setup(test_point_without_room_for_a_scale_stays_one, setup),
        cmocka_unit_test_setup(test_known_beacon_is_what_it_was_given_as, setup),
        cmocka_unit_test_setup(test_with_a_smoother_no_beacon_changes_its_kind, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
