#include "support.h"

#include <math.h>

#include "bslam/recovery/conversion.h"

#define PI 3.14159265358979323846

/// How a beacon of 0.5 x 0.3 m appears from `range` at `angle` beside its normal, the robot looking past it.
static bslam_appearance_t seen_from(double range, double angle, double bearing)
{
    return (bslam_appearance_t){.height_m = real(0.5),
                                .width_m = real(0.3),
                                .height_rad = real(2 * atan(0.25 / range)),
                                .width_rad = real(2 * atan(0.15 * cos(angle) / range)),
                                .bearing_rad = real(bearing),
                                .size_sd_rad = real(0.001),
                                .bearing_sd_rad = real(0.01),
                                .from_left = angle > 0};
}

static void test_pose_in_beacon_frame_is_where_the_robot_stands(void **state)
{
    for (double angle = -1.2; angle < 1.3; angle += 0.3) {
        const bslam_appearance_t seen = seen_from(3, angle, 0.4);
        bslam_doubtful_pose_t in_beacon;
        assert_int_equal(bslam_pose_in_beacon_frame(&seen, &in_beacon), BSLAM_OK);
        assert_near(in_beacon.pose.x_m, 3 * cos(angle), 0.01);
        assert_near(in_beacon.pose.y_m, 3 * sin(angle), 0.03);
        // It looks at the beacon, whose direction from it is the normal's opposite, turned by the angle.
        assert_near(unit_angle_between((double)in_beacon.pose.theta_rad, angle + PI - 0.4), 0, 0.01);
    }
}

/// The pose as a function of height, width, bearing, for finite differences.
static void pose_of(const double *in, double *out, const void *context)
{
    bslam_appearance_t seen = *(const bslam_appearance_t *)context;
    seen.height_rad = real(in[0]);
    seen.width_rad = real(in[1]);
    seen.bearing_rad = real(in[2]);
    bslam_doubtful_pose_t in_beacon;
    assert_int_equal(bslam_pose_in_beacon_frame(&seen, &in_beacon), BSLAM_OK);
    out[0] = (double)in_beacon.pose.x_m;
    out[1] = (double)in_beacon.pose.y_m;
    out[2] = (double)in_beacon.pose.theta_rad;
}

static void test_pose_in_beacon_frame_covariance_is_that_of_its_derivatives(void **state)
{
    // Differences of float over 5e-5 rad are good to a hundredth; the smallest variance here is 3e-6 rad².
    const double tolerance = BSLAM_REAL_DOUBLE ? 1e-7 : 1e-6;
    const bslam_appearance_t seen = seen_from(2, 0.8, -0.3);
    const double in[] = {(double)seen.height_rad, (double)seen.width_rad, (double)seen.bearing_rad};
    const double sd[] = {0.001, 0.001, 0.01};
    bslam_doubtful_pose_t in_beacon;
    assert_int_equal(bslam_pose_in_beacon_frame(&seen, &in_beacon), BSLAM_OK);
    int k = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            double expected = 0;
            for (int c = 0; c < 3; c++) {
                expected += unit_derivative(pose_of, in, 3, i, c, &seen) *
                            unit_derivative(pose_of, in, 3, j, c, &seen) * sd[c] * sd[c];
            }
            assert_near(in_beacon.covariance[k], expected, tolerance);
            k++;
        }
    }
}

static void test_pose_in_beacon_frame_refuses_what_cannot_be_seen(void **state)
{
    bslam_doubtful_pose_t in_beacon;
    bslam_appearance_t seen = seen_from(2, 0.8, 0);
    seen.width_rad = 0;
    assert_int_equal(bslam_pose_in_beacon_frame(&seen, &in_beacon), BSLAM_E_RANGE);
    seen = seen_from(2, 0.8, 0);
    seen.height_rad = real(1.6);
    assert_int_equal(bslam_pose_in_beacon_frame(&seen, &in_beacon), BSLAM_E_RANGE);
    seen = seen_from(2, 0.8, 0);
    seen.width_rad = real(1.6);
    seen.height_rad = real(1.5);
    assert_int_equal(bslam_pose_in_beacon_frame(&seen, &in_beacon), BSLAM_E_RANGE);
}

static void test_pose_in_beacon_frame_refuses_each_number_that_is_not_finite(void **state)
{
    bslam_appearance_t seen = seen_from(2, 0.8, 0);
    bslam_real_t *const numbers[] = {&seen.height_m,      &seen.width_m,     &seen.height_rad,
                                     &seen.width_rad,     &seen.bearing_rad, &seen.size_sd_rad,
                                     &seen.bearing_sd_rad};
    bslam_doubtful_pose_t in_beacon = {{0, 0, 0}, {0}};
    const bslam_doubtful_pose_t before = in_beacon;
    for (int i = 0; i < COUNT_OF(numbers); i++) {
        seen = seen_from(2, 0.8, 0);
        *numbers[i] = real(i % 2 == 0 ? NAN : INFINITY);
        assert_int_equal(bslam_pose_in_beacon_frame(&seen, &in_beacon), BSLAM_E_NOT_FINITE);
        assert_memory_equal(&in_beacon, &before, sizeof before);
    }
}

static void test_pose_to_global_of_a_beacon_that_is_turned_and_doubtful(void **state)
{
    const bslam_doubtful_pose_t beacon = {{2, 3, real(PI / 2)}, {0, 0, 0, 0, 0, real(0.04)}};
    const bslam_doubtful_pose_t in_beacon = {{2, 0, real(PI)}, {real(0.01), 0, 0, 0, 0, 0}};
    bslam_doubtful_pose_t global;
    bslam_pose_to_global(&beacon, &in_beacon, &global);
    assert_near(global.pose.x_m, 2, 1e-6);
    assert_near(global.pose.y_m, 5, 1e-6);
    assert_near(unit_angle_between((double)global.pose.theta_rad, -PI / 2), 0, 1e-6);
    assert_near(global.covariance[0], 0.16, 1e-6);  // the beacon's direction, 2 m away
    assert_near(global.covariance[2], 0.01, 1e-6);  // the distance, now along y
    assert_near(global.covariance[3], -0.08, 1e-6);
    assert_near(global.covariance[5], 0.04, 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pose_in_beacon_frame_is_where_the_robot_stands),
        cmocka_unit_test(test_pose_in_beacon_frame_covariance_is_that_of_its_derivatives),
        cmocka_unit_test(test_pose_in_beacon_frame_refuses_what_cannot_be_seen),
        cmocka_unit_test(test_pose_in_beacon_frame_refuses_each_number_that_is_not_finite),
        cmocka_unit_test(test_pose_to_global_of_a_beacon_that_is_turned_and_doubtful),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
