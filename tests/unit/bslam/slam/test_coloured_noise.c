// What sightings tell whose errors hang together in time.
#include <math.h>

#include "support.h"

#include "bslam/internal.h"
#include "bslam/slam/slam_internal.h"

enum { BEACONS = 3, FRAMES = 3000 };

static const double SD_RAD = 0.02, SD_M = 0.1;

static bslam_slam_t slam;
static unit_random_t noise;

static double normal(void)
{
    const double u = unit_random(&noise, 1e-12, 1);
    return sqrt(-2 * log(u)) * cos(unit_random(&noise, 0, 6.283185307));
}

static int setup(void **state)
{
    memset(&slam, 0, sizeof slam);
    slam.settings.correlation_m = -1;
    noise.state = 3;
    return 0;
}

/// One frame, in which beacon `first` comes first.
static void frame_of(const double bearings[BEACONS], const double ranges[BEACONS], int first)
{
    for (int i = 0; i < BEACONS; i++) {
        const int b = (first + i) % BEACONS;
        slam.records[i].match = (bslam_match_t){.verdict = BSLAM_VERDICT_MATCH, .beacon = b};
        slam.records[i].innovation = (bslam_innovation_t){
            .has_range = ranges != NULL,
            .bearing_rad = real(SD_RAD * bearings[b]),
            .range_m = ranges != NULL ? real(SD_M * ranges[b]) : 0,
            .bearing_var_rad2 = real(SD_RAD * SD_RAD),
            .range_var_m2 = real(SD_M * SD_M),
        };
    }
    bslam_slam_doubt_sightings(&slam, BEACONS);
}

/// The same after many frames whose noise has these correlations from one frame to the next: how many times
/// its variances are larger now.
static void factors_after(double of_bearings, double of_ranges, double *by_bearing, double *by_range)
{
    double bearings[BEACONS] = {0}, ranges[BEACONS] = {0};
    for (int k = 0; k < FRAMES; k++) {
        for (int b = 0; b < BEACONS; b++) {
            bearings[b] = of_bearings * bearings[b] + sqrt(1 - of_bearings * of_bearings) * normal();
            ranges[b] = of_ranges * ranges[b] + sqrt(1 - of_ranges * of_ranges) * normal();
        }
        frame_of(bearings, ranges, k % BEACONS);
    }
    *by_bearing = (double)slam.records[0].innovation.bearing_var_rad2 / (SD_RAD * SD_RAD);
    *by_range = (double)slam.records[0].innovation.range_var_m2 / (SD_M * SD_M);
}

static void test_white_noise_stays_as_it_is_told(void **state)
{
    double by_bearing, by_range;
    factors_after(0, 0, &by_bearing, &by_range);
    assert_near(by_bearing, 1, 0.1);
    assert_near(by_range, 1, 0.1);
}

static void test_noise_that_hangs_together_tells_as_little_as_its_mean_does(void **state)
{
    double by_bearing, by_range;
    factors_after(0.9, 0.5, &by_bearing, &by_range);
    assert_near(by_bearing / (1.9 / 0.1), 1, 0.25);
    assert_near(by_range / (1.5 / 0.5), 1, 0.25);
}

static void test_noise_that_alternates_is_trusted_no_more_than_it_is_told(void **state)
{
    double by_bearing, by_range;
    factors_after(-0.9, -0.5, &by_bearing, &by_range);
    assert_near(by_bearing, 1, 1e-6);
    assert_near(by_range, 1, 1e-6);
}

static void test_what_never_changes_tells_a_hundredth(void **state)
{
    const double off[BEACONS] = {1, -1, 0.5};
    for (int k = 0; k < FRAMES; k++) {
        frame_of(off, NULL, 0);
    }
    assert_near((double)slam.records[0].innovation.bearing_var_rad2 / (SD_RAD * SD_RAD), 99, 0.1);
}

static void test_order_within_a_frame_does_not_matter(void **state)
{
    const double bearings[BEACONS] = {1, -2, 0.5};
    bslam_autocorrelation_t sums[BEACONS];
    for (int first = 0; first < BEACONS; first++) {
        setup(NULL);
        frame_of(bearings, bearings, first);
        frame_of(bearings, bearings, first);
        sums[first] = slam.bearing_noise;
        assert_near(sums[first].product, sums[0].product, 8 * UNIT_ROUNDING * 5.25);
        assert_near(sums[first].square, sums[0].square, 16 * UNIT_ROUNDING * 5.25);
    }
}

/// It is noted all the same: hypotheses are compared by what it leaves of a sighting's evidence.
static void test_correlation_that_is_told_widens_nothing(void **state)
{
    const double off[BEACONS] = {1, -1, 0.5};
    slam.settings.correlation_m = BSLAM_R(0.5);
    for (int k = 0; k < FRAMES; k++) {
        frame_of(off, off, 0);
    }
    assert_near((double)slam.records[0].innovation.bearing_var_rad2 / (SD_RAD * SD_RAD), 1, 1e-6);
    assert_near(bslam_slam_evidence_share(&slam), 1 / 99.0, 1e-5);
}

static void test_what_a_sighting_tells_is_what_the_worse_of_its_noises_leaves(void **state)
{
    double by_bearing, by_range;
    assert_near(bslam_slam_evidence_share(&slam), 1, 0);
    factors_after(0.9, 0.5, &by_bearing, &by_range);
    assert_near(bslam_slam_evidence_share(&slam) * by_bearing, 1, 0.01);
    setup(NULL);
    factors_after(0, 0.8, &by_bearing, &by_range);
    assert_near(bslam_slam_evidence_share(&slam) * by_range, 1, 0.01);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_white_noise_stays_as_it_is_told, setup),
        cmocka_unit_test_setup(test_noise_that_hangs_together_tells_as_little_as_its_mean_does, setup),
        cmocka_unit_test_setup(test_noise_that_alternates_is_trusted_no_more_than_it_is_told, setup),
        cmocka_unit_test_setup(test_what_never_changes_tells_a_hundredth, setup),
        cmocka_unit_test_setup(test_order_within_a_frame_does_not_matter, setup),
        cmocka_unit_test_setup(test_correlation_that_is_told_widens_nothing, setup),
        cmocka_unit_test_setup(test_what_a_sighting_tells_is_what_the_worse_of_its_noises_leaves, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
