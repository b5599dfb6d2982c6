// A gate that would lock the robot out opens; one that keeps out what means nothing does not.
#include <math.h>

#include "support.h"

#include "bslam/internal.h"
#include "bslam/slam/slam_internal.h"

enum { BEACONS = 4, STEP_US = 40000 };

static const double places[BEACONS][2] = {{3, 1}, {2.5, -1.5}, {-2, 2}, {-1.5, -2.5}};
static const double SD_RAD = 0.0136;

static bslam_t robot;
static unit_random_t noise;
static double pose[3];
static int64_t now_us;

static double normal(void)
{
    const double u = unit_random(&noise, 1e-12, 1);
    return sqrt(-2 * log(u)) * cos(unit_random(&noise, 0, 6.283185307));
}

/// The robot stands for a while; of all beacons so many, and this share means nothing. A moved one is seen
/// where beacon 0 would be if it stood 1 m farther.
static void stand(int frames, int beacons, double outliers, bool moved)
{
    for (int k = 0; k < frames; k++) {
        bslam_sighting_t seen[BEACONS];
        const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us};
        assert_int_equal(bslam_odometry(&robot, &still), BSLAM_OK);
        for (int b = 0; b < beacons; b++) {
            const double dx = places[b][0] + (moved && b == 0 ? 1 : 0) - pose[0], dy = places[b][1] - pose[1];
            const bool means_nothing = unit_random(&noise, 0, 1) < outliers;
            const double bearing_rad =
                means_nothing ? unit_random(&noise, -3, 3) : unit_angle_between(atan2(dy, dx), pose[2]);
            const double range_m = hypot(dx, dy);
            seen[b] = unit_polar(unit_angle_between(bearing_rad + SD_RAD * normal(), 0),
                                 range_m + 0.02 * range_m * normal(), b);
        }
        assert_int_equal(bslam_sightings(&robot, now_us, seen, beacons), BSLAM_OK);
        now_us += STEP_US;
    }
}

static int setup(void **state)
{
    bslam_settings_t settings;
    int bad;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    settings.association = BSLAM_ASSOCIATION_KNOWN;
    assert_int_equal(bslam_init(&robot, &settings, &bad), BSLAM_OK);
    memset(pose, 0, sizeof pose);
    now_us = 0;
    noise.state = 5;
    stand(50, BEACONS, 0, false);
    return 0;
}

static double error_m(void)
{
    const bslam_pose_t at = bslam_pose(&robot);
    return hypot((double)at.x_m - pose[0], (double)at.y_m - pose[1]);
}

static void test_pushed_robot_is_where_it_was_pushed_to_within_two_seconds(void **state)
{
    static const double pushes[][3] = {{0.5, 0, 0}, {0, 1, 0.3}, {-1, 0.5, -0.8}, {0, 0, 1.5}};
    for (int i = 0; i < COUNT_OF(pushes); i++) {
        setup(NULL);
        memcpy(pose, pushes[i], sizeof pose);
        stand(50, BEACONS, 0, false);
        assert_true(error_m() < 0.3);
        assert_near(bslam_pose(&robot).theta_rad, pose[2], 0.1);
        assert_true(bslam_counters(&robot).slam.gated > 0);
    }
}

static void test_what_means_nothing_stays_behind_the_gate(void **state)
{
    stand(500, BEACONS, 0.1, false);
    assert_true(error_m() < 0.1);
    // All but those that by chance are where a beacon is.
    assert_true(bslam_counters(&robot).slam.gated > 150);
}

static void test_beacon_that_was_moved_does_not_move_the_robot(void **state)
{
    stand(500, BEACONS, 0, true);
    assert_true(error_m() < 0.1);
}

static void test_gate_opens_for_half_of_what_is_seen_and_closes_again(void **state)
{
    bslam_slam_t *slam = &bslam_instance(&robot)->slam;
    assert_false(bslam_slam_opens_gate(slam, &slam->ekf.beacons[0]));
    slam->misfit = BSLAM_R(0.6);
    assert_true(bslam_slam_opens_gate(slam, &slam->ekf.beacons[0]));
    slam->ekf.beacons[0].gated = slam->ekf.beacons[0].sightings + 10;
    assert_false(bslam_slam_opens_gate(slam, &slam->ekf.beacons[0]));
    stand(50, BEACONS, 0, false);
    assert_false(bslam_slam_opens_gate(slam, &slam->ekf.beacons[1]));
}

static void test_motion_is_doubted_as_much_as_sightings_do_not_fit(void **state)
{
    static const double misfits[] = {0.2, 0.35, 0.45, 0.8}, more[] = {0, 0, 0.008, 0.036};
    for (int i = 0; i < COUNT_OF(misfits); i++) {
        bslam_motion_t motion = {.dt_s = BSLAM_R(0.04), .forward_var_m2 = 1, .turn_var_rad2 = 2};
        bslam_slam_doubt_motion(real(misfits[i]), BSLAM_R(1.9), &motion);
        assert_near(motion.forward_var_m2, 1 + more[i], 1e-5);
        assert_near(motion.turn_var_rad2, 2 + more[i], 1e-5);
    }
}

/// Where nothing is seen for long, what did not fit then says nothing of the wheels now.
static void test_motion_that_nobody_has_watched_for_long_is_not_doubted(void **state)
{
    bslam_motion_t motion = {.dt_s = BSLAM_R(0.04), .forward_var_m2 = 1, .turn_var_rad2 = 2};
    bslam_slam_doubt_motion(BSLAM_R(0.8), BSLAM_R(2.0), &motion);
    assert_near(motion.forward_var_m2, 1, 0);
    assert_near(motion.turn_var_rad2, 2, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_pushed_robot_is_where_it_was_pushed_to_within_two_seconds, setup),
        cmocka_unit_test_setup(test_what_means_nothing_stays_behind_the_gate, setup),
        cmocka_unit_test_setup(test_beacon_that_was_moved_does_not_move_the_robot, setup),
        cmocka_unit_test_setup(test_gate_opens_for_half_of_what_is_seen_and_closes_again, setup),
        cmocka_unit_test_setup(test_motion_is_doubted_as_much_as_sightings_do_not_fit, setup),
        cmocka_unit_test_setup(test_motion_that_nobody_has_watched_for_long_is_not_doubted, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
