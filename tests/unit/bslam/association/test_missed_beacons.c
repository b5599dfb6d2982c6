#include "known_map.h"
#include "support.h"

#include <math.h>

#include "bslam/association/missed_beacons.h"
#include "base/trig.h"
#include "plain_settings.h"

static bslam_appearance_t appearance;
static bslam_settings_t settings;
static bslam_ekf_t ekf;
static int64_t now_us;
static uint32_t travelled_um;

static const double places[2][2] = {{0, 0}, {0, 6}};

static int setup(void **state)
{
    settings = unit_settings();
    settings.missed_views = 3;
    ekf = unit_map_of(&settings, places, 2);
    now_us = 0;
    travelled_um = 0;
    return bslam_appearance_init(&appearance, NULL, 0) == BSLAM_OK ? 0 : -1;
}

/// The robot goes a decimetre along a circle of radius 4 m round beacon 0, which it has to its left; a frame
/// shows the beacons that are named. Answers what has missed.
static int go(double angle_rad, double radius_m, bool sees_first, bool judges)
{
    const bslam_pose_t pose = {(bslam_real_t)(radius_m * cos(angle_rad)),
                               (bslam_real_t)(radius_m * sin(angle_rad)),
                               bslam_angle_wrap((bslam_real_t)(angle_rad + 1.5707963))};
    now_us += 40000;
    travelled_um += 100000;
    bslam_ekf_set_pose(&ekf, &pose, BSLAM_R(1e-4), BSLAM_R(1e-4));
    ekf.beacons[1].last_seen_us = now_us;
    if (sees_first) {
        ekf.beacons[0].last_seen_us = now_us;
    }
    return bslam_missed_beacons_find(&appearance, &ekf, &settings, now_us, travelled_um, judges);
}

/// Once round; how many frames said that beacon 0 has missed.
static int go_round(double radius_m, bool sees_first, bool judges)
{
    int missed = 0;
    for (int k = 0; k < 252; k++) {
        const int found = go(0.0249 * k, radius_m, sees_first, judges);
        assert_true(found == BSLAM_NO_MISSED_BEACON || found == 0);
        missed += found == 0 ? 1 : 0;
    }
    return missed;
}

static void test_one_that_is_missed_from_where_it_was_seen_is_removed(void **state)
{
    assert_int_equal(go_round(4, true, true), 0);
    assert_true(go_round(4.5, false, true) > 0);
    assert_true(appearance.counters.missed > 0);
}

static void test_from_elsewhere_nothing_is_missed(void **state)
{
    assert_int_equal(go_round(4, true, true), 0);
    assert_int_equal(go_round(5.5, false, true), 0);
    assert_int_equal(appearance.of[0].missed, 0);
}

static void test_an_unclear_frame_says_nothing(void **state)
{
    assert_int_equal(go_round(4, true, true), 0);
    assert_int_equal(go_round(4, false, false), 0);
}

static void test_a_doubtful_heading_says_nothing(void **state)
{
    assert_int_equal(go_round(4, true, true), 0);
    for (int k = 0; k < 252; k++) {
        (void)go(0.0249 * k, 4, true, true);
        const bslam_pose_t pose = bslam_ekf_pose(&ekf);
        bslam_ekf_set_pose(&ekf, &pose, BSLAM_R(1e-4), BSLAM_R(0.04));
        now_us += 40000;
        assert_int_equal(
            bslam_missed_beacons_find(&appearance, &ekf, &settings, now_us, travelled_um + 900000, true),
            BSLAM_NO_MISSED_BEACON);
    }
}

static void test_a_direction_that_a_corner_hides_speaks_once(void **state)
{
    assert_int_equal(go_round(4, true, true), 0);
    for (int round = 0; round < 20; round++) {
        for (int k = 0; k < 12; k++) {  // to and fro in one sector, where it was seen, and is hidden now
            assert_int_equal(go(0.02 + 0.025 * k, 4, false, true), BSLAM_NO_MISSED_BEACON);
        }
    }
    assert_true(appearance.of[0].missed >= 1);
    assert_int_equal(go(1.0, 4, true, true), BSLAM_NO_MISSED_BEACON);
    assert_int_equal(appearance.of[0].missed, 0);
}

static void test_switched_off_it_finds_nothing(void **state)
{
    settings.missed_views = 0;
    assert_int_equal(go_round(4, true, true), 0);
    assert_int_equal(go_round(4, false, true), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_one_that_is_missed_from_where_it_was_seen_is_removed, setup),
        cmocka_unit_test_setup(test_from_elsewhere_nothing_is_missed, setup),
        cmocka_unit_test_setup(test_an_unclear_frame_says_nothing, setup),
        cmocka_unit_test_setup(test_a_doubtful_heading_says_nothing, setup),
        cmocka_unit_test_setup(test_a_direction_that_a_corner_hides_speaks_once, setup),
        cmocka_unit_test_setup(test_switched_off_it_finds_nothing, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
