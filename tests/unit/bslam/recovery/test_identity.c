// Who is seen, by labels or by appearance, in a map of three beacons.
#include "known_map.h"
#include "support.h"

#include <math.h>

#include "bslam/recovery/identity.h"
#include "plain_settings.h"

enum { BEACONS = 3, GROWN = 16, YOUNG = 11 };

static const double places[BEACONS][2] = {{4, 0}, {0, 4}, {-4, 0}};
static const float alike[BSLAM_SAMPLE_FEATURES] = {1.0f};
static bslam_slam_t slam;
static bslam_appearance_t appearance;

/// All confirmed, with the labels 10, 11, 12; without appearance.
static int setup(void **state)
{
    bslam_settings_t settings = unit_settings();
    int bad_id;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    assert_int_equal(bslam_appearance_init(&appearance, NULL, 0), BSLAM_OK);
    slam.ekf = unit_map_of(&settings, places, BEACONS);
    for (int b = 0; b < BEACONS; b++) {
        slam.ekf.beacons[b].label = 10 + b;
        slam.ekf.beacons[b].confirmed = true;
    }
    return 0;
}

/// The same by appearance: the classifier of beacon 0 says 1 of `alike`, that of beacon 1 says -1, beacon 2
/// has none.
static int setup_looks(void **state)
{
    setup(state);
    slam.settings.association = BSLAM_ASSOCIATION_SVM;
    bslam_slam_attach_appearance(&slam, &appearance);
    unit_give_machine(&appearance, 0, 1, GROWN);
    unit_give_machine(&appearance, 1, -1, GROWN);
    return 0;
}

static int identify(bslam_sighting_t sighting)
{
    int who;
    bslam_identify(&slam, &sighting, 1, &who);
    return who;
}

static int identify_looks(const float *signature)
{
    bslam_sighting_t sighting = unit_polar(0, 4, 10);  // whose label nobody looks at
    sighting.signature = signature;
    return identify(sighting);
}

// ---- by labels --------------------------------------------------------------------------------------------

static void test_label_tells_who_it_is(void **state)
{
    assert_int_equal(identify(unit_polar(0, 4, 12)), 2);
    assert_int_equal(identify(unit_polar(0, 4, 13)), BSLAM_NOBODY);
    assert_int_equal(identify(unit_polar(0, 4, BSLAM_LABEL_NONE)), BSLAM_NOBODY);
}

static void test_label_of_an_unconfirmed_competitor_is_passed_over(void **state)
{
    slam.ekf.beacons[0].label = 12;
    slam.ekf.beacons[0].confirmed = false;
    assert_int_equal(identify(unit_polar(0, 4, 12)), 2);
}

static void test_what_is_not_to_be_mapped_is_nobody(void **state)
{
    bslam_sighting_t sighting = unit_polar(0, 4, 12);
    sighting.beacon_class = BSLAM_CLASS_NOT_MAPPABLE;
    assert_int_equal(identify(sighting), BSLAM_NOBODY);
}

static void test_of_two_that_claim_to_be_the_same_neither_is_believed(void **state)
{
    const bslam_sighting_t seen[] = {unit_polar(0, 4, 12), unit_polar(1, 4, 11), unit_polar(2, 4, 12)};
    int who[3];
    bslam_identify(&slam, seen, 3, who);
    assert_int_equal(who[0], BSLAM_NOBODY);
    assert_int_equal(who[1], 1);
    assert_int_equal(who[2], BSLAM_NOBODY);
}

static void test_label_may_be_that_beacon_alone(void **state)
{
    bslam_slam_attach_appearance(&slam, &appearance);  // an appearance that nobody goes by
    assert_true(bslam_may_be(&slam, 1, 1));
    assert_false(bslam_may_be(&slam, 1, 2));
}

static void test_two_confirmed_beacons_are_findable_by_label(void **state)
{
    slam.ekf.beacons[0].confirmed = false;
    assert_true(bslam_is_findable(&slam));
    slam.ekf.beacons[1].confirmed = false;
    assert_false(bslam_is_findable(&slam));
}

// ---- by appearance
// ---------------------------------------------------------------------------------------------

static void test_appearance_identifies(void **state)
{
    const float opposite[BSLAM_SAMPLE_FEATURES] = {-1.0f};
    assert_int_equal(identify_looks(alike), 0);
    assert_int_equal(identify_looks(opposite), 1);
}

static void test_without_appearance_nobody_is_identified(void **state)
{
    const float broken[BSLAM_SAMPLE_FEATURES] = {1.0f, NAN};
    assert_int_equal(identify_looks(NULL), BSLAM_NOBODY);
    assert_int_equal(identify_looks(broken), BSLAM_NOBODY);
    bslam_slam_attach_appearance(&slam, NULL);
    assert_int_equal(identify_looks(alike), BSLAM_NOBODY);
}

static void test_appearance_that_is_not_sure_identifies_nobody(void **state)
{
    const float faint[BSLAM_SAMPLE_FEATURES] = {0.25f};
    assert_int_equal(identify_looks(faint), BSLAM_NOBODY);
    appearance.learner.classifiers[0].samples = YOUNG;
    assert_int_equal(identify_looks(alike), BSLAM_NOBODY);
}

static void test_appearance_that_two_classifiers_claim_identifies_nobody(void **state)
{
    unit_give_machine(&appearance, 2, 0.75, GROWN);
    assert_int_equal(identify_looks(alike), BSLAM_NOBODY);
    appearance.learner.classifiers[2].samples = YOUNG;  // whose opinion does not count
    assert_int_equal(identify_looks(alike), 0);
}

static void test_a_shared_classifier_is_no_negative_of_itself(void **state)
{
    appearance.of[2].classifier = appearance.of[0].classifier;
    assert_int_equal(identify_looks(alike), 0);
}

static void test_of_a_shared_classifier_it_is_the_first_that_is_confirmed(void **state)
{
    appearance.of[2].classifier = appearance.of[0].classifier;
    slam.ekf.beacons[0].confirmed = false;
    assert_int_equal(identify_looks(alike), 2);
    slam.ekf.beacons[2].confirmed = false;
    assert_int_equal(identify_looks(alike), BSLAM_NOBODY);
}

static void test_appearance_may_be_any_confirmed_beacon_of_the_classifier(void **state)
{
    appearance.of[2].classifier = appearance.of[0].classifier;
    assert_true(bslam_may_be(&slam, 0, 0));
    assert_true(bslam_may_be(&slam, 0, 2));
    assert_false(bslam_may_be(&slam, 0, 1));
    slam.ekf.beacons[2].confirmed = false;
    assert_false(bslam_may_be(&slam, 0, 2));
    slam.ekf.beacons[2].confirmed = true;
    bslam_slam_attach_appearance(&slam, NULL);
    assert_false(bslam_may_be(&slam, 0, 2));
}

static void test_two_grown_classifiers_are_findable(void **state)
{
    assert_true(bslam_is_findable(&slam));
    appearance.learner.classifiers[1].samples = YOUNG;
    assert_false(bslam_is_findable(&slam));
    appearance.learner.classifiers[1].samples = GROWN;
    bslam_slam_attach_appearance(&slam, NULL);
    assert_false(bslam_is_findable(&slam));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_label_tells_who_it_is, setup),
        cmocka_unit_test_setup(test_label_of_an_unconfirmed_competitor_is_passed_over, setup),
        cmocka_unit_test_setup(test_what_is_not_to_be_mapped_is_nobody, setup),
        cmocka_unit_test_setup(test_of_two_that_claim_to_be_the_same_neither_is_believed, setup),
        cmocka_unit_test_setup(test_label_may_be_that_beacon_alone, setup),
        cmocka_unit_test_setup(test_two_confirmed_beacons_are_findable_by_label, setup),
        cmocka_unit_test_setup(test_appearance_identifies, setup_looks),
        cmocka_unit_test_setup(test_without_appearance_nobody_is_identified, setup_looks),
        cmocka_unit_test_setup(test_appearance_that_is_not_sure_identifies_nobody, setup_looks),
        cmocka_unit_test_setup(test_appearance_that_two_classifiers_claim_identifies_nobody, setup_looks),
        cmocka_unit_test_setup(test_a_shared_classifier_is_no_negative_of_itself, setup_looks),
        cmocka_unit_test_setup(test_of_a_shared_classifier_it_is_the_first_that_is_confirmed, setup_looks),
        cmocka_unit_test_setup(test_appearance_may_be_any_confirmed_beacon_of_the_classifier, setup_looks),
        cmocka_unit_test_setup(test_two_grown_classifiers_are_findable, setup_looks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
