// The base about other points: a place that is turned and stretched about the robot, or shifted.
#include <math.h>

#include "support.h"

#include "bslam/smoother/smoother_internal.h"
#include "plain_settings.h"

static const double PI = 3.14159265358979;

static bslam_smoother_t smoother;

/// A robot that is surely at (0, 0), and one beacon, each axis of it this doubtful.
static void start(double x_m, double y_m, double sd_m)
{
    static bslam_ekf_t filter;
    bslam_settings_t settings = unit_settings();
    int index;
    settings.filter = BSLAM_FILTER_SMOOTHER;
    settings.velocity_states = 1;
    bslam_ekf_init(&filter, &settings);
    assert_int_equal(bslam_ekf_add_guess(&filter, real(x_m), real(y_m), real(sd_m), &index), BSLAM_OK);
    memset(&smoother, 0, sizeof smoother);
    bslam_smoother_restart(&smoother, &settings, &filter);
}

/// What the base holds of the beacon, about another place.
static void assert_about(double x_m, double y_m, double correction_x_m, double correction_y_m,
                         double variance_m2)
{
    const bslam_ekf_t *base = &smoother.base;
    const int at = base->beacons[0].at;
    const double tolerance = BSLAM_REAL_DOUBLE ? 1e-12 : 2e-5;
    smoother.place[at] = real(x_m);
    smoother.place[at + 1] = real(y_m);
    bslam_smoother_linearise_base(&smoother);
    assert_true(base->mean[at] == real(x_m) && base->mean[at + 1] == real(y_m));
    assert_near((double)base->correction[at], correction_x_m, tolerance);
    assert_near((double)base->correction[at + 1], correction_y_m, tolerance);
    assert_near((double)bslam_ekf_covariance(base, at, at), variance_m2, tolerance * variance_m2);
    assert_near((double)bslam_ekf_covariance(base, at + 1, at + 1), variance_m2, tolerance * variance_m2);
    assert_near((double)bslam_ekf_covariance(base, at + 1, at), 0, tolerance * variance_m2);
}

static void test_place_is_stretched_and_turned_by_the_logarithm(void **state)
{
    start(2, 0, 1);
    assert_about(6, 0, -6 * log(3), 0, 9);
    start(2, 0, 1);
    assert_about(2.0 / 3, 0, 2.0 / 3 * log(3), 0, 1.0 / 9);
    start(2, 0, 1);
    assert_about(0, 2, PI, 0, 1);  // a quarter turn: back along the circle as far as its arc is long
}

static void test_place_and_back_is_what_it_was(void **state)
{
    start(2, 0, 1);
    smoother.base.correction[smoother.base.beacons[0].at] = BSLAM_R(0.25);
    assert_about(4, 0, 2 * 0.25 - 4 * log(2), 0, 4);
    assert_about(2, 0, 0.25, 0, 1);
}

static void test_place_that_is_far_off_in_any_coordinates_is_shifted(void **state)
{
    // By a factor of more than 4, farther or nearer.
    start(2, 0, 1);
    assert_about(10, 0, 2 - 10, 0, 1);
    start(2, 0, 1);
    assert_about(0.4, 0, 2 - 0.4, 0, 1);
    // From nearer to the robot than half a metre; of which nothing is known.
    start(0.4, 0, 1);
    assert_about(0.8, 0, 0.4 - 0.8, 0, 1);
    start(2, 0, 20);
    assert_about(4, 0, 2 - 4, 0, 400);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_place_is_stretched_and_turned_by_the_logarithm),
        cmocka_unit_test(test_place_and_back_is_what_it_was),
        cmocka_unit_test(test_place_that_is_far_off_in_any_coordinates_is_shifted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
