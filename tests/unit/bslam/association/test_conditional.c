#include "support.h"

#include <math.h>

#include "bslam/association/conditional.h"
#include "bslam/slam/slam.h"
#include "plain_settings.h"

static bslam_slam_t slam;
static bslam_conditional_t conditional;

/// A robot with two beacons, and doubt about its pose.
static int setup(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_sighting_t seen[] = {unit_polar(0.3, 2, 1), unit_polar(-0.4, 3, 2)};
    const bslam_pose_t origin = {0, 0, 0};
    int bad_id;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    assert_int_equal(bslam_slam_sightings(&slam, 1000, seen, 2), BSLAM_OK);
    assert_int_equal(bslam_slam_set_pose(&slam, &origin, BSLAM_R(0.3), BSLAM_R(0.1)), BSLAM_OK);
    bslam_conditional_init(&conditional);
    return 0;
}

static bslam_innovation_t innovation_of(bslam_sighting_t sighting, int beacon)
{
    const bslam_pose_t mount = {0, 0, 0};
    bslam_innovation_t innovation;
    assert_int_equal(bslam_ekf_innovation(&slam.ekf, &slam.settings, &mount, &sighting, beacon, &innovation),
                     BSLAM_OK);
    return innovation;
}

static double distance2_of(const bslam_innovation_t *innovation)
{
    bslam_real_t distance2;
    assert_int_equal(bslam_ekf_distance2(&slam.ekf, innovation, &distance2), BSLAM_OK);
    return (double)distance2;
}

static void test_conditional_on_nothing_an_innovation_weighs_as_the_filter_has_it(void **state)
{
    const bslam_innovation_t whole = innovation_of(unit_polar(0.35, 2.2, 1), 0);
    const bslam_innovation_t direction = innovation_of(unit_direction(-0.3, 2), 1);
    bslam_weight_t weight;
    assert_int_equal(bslam_conditional_weigh(&slam.ekf, &conditional, &whole, &weight), BSLAM_OK);
    assert_near(weight.distance2, distance2_of(&whole), 1e-4);
    assert_int_equal(bslam_conditional_weigh(&slam.ekf, &conditional, &direction, &weight), BSLAM_OK);
    assert_near(weight.distance2, distance2_of(&direction), 1e-4);
    assert_int_equal(conditional.count, 0);
}

/// p(a, b) = p(a) p(b given a) = p(b) p(a given b).
static void test_conditional_in_either_order_the_distance_of_both_is_the_same(void **state)
{
    const bslam_innovation_t a = innovation_of(unit_polar(0.35, 2.2, 1), 0);
    const bslam_innovation_t b = innovation_of(unit_direction(-0.3, 2), 1);
    bslam_weight_t alone;
    bslam_weight_t after;
    assert_int_equal(bslam_conditional_weigh(&slam.ekf, &conditional, &a, &alone), BSLAM_OK);
    assert_true(bslam_conditional_add(&slam.ekf, &conditional, &a));
    assert_near(bslam_conditional_distance2(&conditional), alone.distance2, 1e-5);
    assert_int_equal(bslam_conditional_weigh(&slam.ekf, &conditional, &b, &after), BSLAM_OK);
    assert_true(bslam_conditional_add(&slam.ekf, &conditional, &b));
    const double both = (double)bslam_conditional_distance2(&conditional);
    assert_near(both, alone.distance2 + after.distance2, 1e-4);
    bslam_conditional_init(&conditional);
    assert_true(bslam_conditional_add(&slam.ekf, &conditional, &b));
    assert_true(bslam_conditional_add(&slam.ekf, &conditional, &a));
    assert_near(bslam_conditional_distance2(&conditional), both, 1e-3);
}

static void test_conditional_singular_innovation_is_refused_and_nothing_changes(void **state)
{
    const bslam_innovation_t good = innovation_of(unit_polar(0.35, 2.2, 1), 0);
    bslam_innovation_t cases[] = {good, good, good};
    cases[0].bearing_var_rad2 = -1;
    cases[1].range_var_m2 = -100;
    cases[2].bearing_var_rad2 = real(NAN);
    for (int i = 0; i < COUNT_OF(cases); i++) {
        bslam_weight_t weight = {77, 78};
        assert_int_equal(bslam_conditional_weigh(&slam.ekf, &conditional, &cases[i], &weight),
                         BSLAM_E_SINGULAR);
        assert_near(weight.distance2, 77, 0);
        assert_false(bslam_conditional_add(&slam.ekf, &conditional, &cases[i]));
        assert_int_equal(conditional.count, 0);
    }
    cases[1].has_range = false;  // then its noise is not looked at
    assert_true(bslam_conditional_add(&slam.ekf, &conditional, &cases[1]));
    assert_int_equal(conditional.count, 1);
}

static void test_conditional_has_room_for_so_many_and_one_to_weigh(void **state)
{
    const bslam_innovation_t one = innovation_of(unit_polar(0.35, 2.2, 1), 0);
    for (int i = 0; i < BSLAM_CONDITIONAL_MAX; i++) {
        assert_true(bslam_conditional_add(&slam.ekf, &conditional, &one));
    }
    bslam_weight_t weight;
    assert_false(bslam_conditional_add(&slam.ekf, &conditional, &one));
    assert_int_equal(conditional.count, 2 * BSLAM_CONDITIONAL_MAX);
    assert_int_equal(bslam_conditional_weigh(&slam.ekf, &conditional, &one, &weight), BSLAM_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_conditional_on_nothing_an_innovation_weighs_as_the_filter_has_it, setup),
        cmocka_unit_test_setup(test_conditional_in_either_order_the_distance_of_both_is_the_same, setup),
        cmocka_unit_test_setup(test_conditional_singular_innovation_is_refused_and_nothing_changes, setup),
        cmocka_unit_test_setup(test_conditional_has_room_for_so_many_and_one_to_weigh, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
