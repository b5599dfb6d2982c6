#include "support.h"

#include <math.h>

#include "vision/vision.h"

static bslam_candidate_t seen(bool has_range)
{
    return (bslam_candidate_t){.bearing_rad = BSLAM_R(0.3),
                               .bearing_sd_rad = BSLAM_R(0.003),
                               .range_m = 5,
                               .range_sd_m = BSLAM_R(0.5),
                               .range_noise_sd_m = BSLAM_R(0.3),
                               .range_scale_sd = BSLAM_R(0.08),
                               .has_bearing = true,
                               .has_range = has_range,
                               .beacon_class = 3,
                               .score = 1.25f};
}

static void test_sighting_of_a_whole_thing_has_its_noise_and_what_all_its_distances_share(void **state)
{
    const bslam_candidate_t candidate = seen(true);
    const bslam_sighting_t told = bslam_sighting_of(&candidate);
    assert_true(told.has_range);
    assert_near(told.bearing_rad, candidate.bearing_rad, 0);
    assert_near(told.bearing_sd_rad, 0.005, 1e-8);  // 3 and 4 mrad
    assert_near(told.range_m, 5, 0);
    assert_near(told.range_sd_m, sqrt(0.3 * 0.3 + 0.05 * 0.05), 1e-6);  // 1 % of 5 m besides
    assert_near(told.range_scale_sd, candidate.range_scale_sd, 0);
    assert_int_equal(told.beacon_class, 3);
    assert_near(told.score, 1.25, 0);
    assert_int_equal(told.label, BSLAM_LABEL_NONE);
    assert_ptr_equal(told.signature, candidate.signature);
}

static void test_sighting_without_a_distance_says_nothing_of_one(void **state)
{
    const bslam_candidate_t candidate = seen(false);
    const bslam_sighting_t told = bslam_sighting_of(&candidate);
    assert_false(told.has_range);
    assert_near(told.range_m, 0, 0);
    assert_near(told.range_sd_m, 0, 0);
    assert_near(told.range_scale_sd, 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sighting_of_a_whole_thing_has_its_noise_and_what_all_its_distances_share),
        cmocka_unit_test(test_sighting_without_a_distance_says_nothing_of_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
