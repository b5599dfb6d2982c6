#include "support.h"

#include <math.h>

#include "bslam/appearance/calibration.h"
#include "bslam/association/viewpoint.h"
#include "known_map.h"
#include "plain_settings.h"

static bslam_appearance_t appearance;
static uint32_t travelled_um;

/// So often a beacon resembles another one before it shares that one's classifier.
enum { SHARE = 12 };

static int setup(void **state)
{
    travelled_um = 0;
    return bslam_appearance_init(&appearance, NULL, 0) == BSLAM_OK ? 0 : -1;
}

/// The n-th view of an object: two colours of its own, and a little of others.
static void view_of(int object, int view, float *signature)
{
    unit_random_t random = {(uint64_t)(1 + 997 * object + 31 * view)};
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        signature[k] = (float)unit_random(&random, 0, 0.1);
    }
    signature[3 * object] += 0.7f;
    signature[3 * object + 1] += 0.6f;
}

static void train(void)
{
    while (bslam_learner_work(&appearance.learner, 1000)) {
    }
}

static void show(int index, int count, const float *signature)
{
    bslam_sighting_t sighting = unit_polar(0, 4, -1);
    sighting.signature = signature;
    bslam_appearance_train(&appearance, index, count, travelled_um, &sighting);
}

/// A sure sighting of beacon `index` of `count`, which looks like an object, a good way after the last.
static void teach(int index, int count, int object, int view)
{
    float signature[BSLAM_SAMPLE_FEATURES];
    view_of(object, view, signature);
    travelled_um += 150000;
    show(index, count, signature);
    train();
}

static double value_of(int index, int object, int view)
{
    float signature[BSLAM_SAMPLE_FEATURES];
    bslam_sample_t sample;
    view_of(object, view, signature);
    assert_int_equal(bslam_sample_encode(signature, &sample), BSLAM_OK);
    return (double)bslam_appearance_ask(&appearance, index, &sample).value;
}

static void test_each_beacon_learns_its_own_look(void **state)
{
    for (int view = 0; view < 8; view++) {
        for (int b = 0; b < 3; b++) {
            teach(b, 3, b, view);
        }
    }
    for (int b = 0; b < 3; b++) {
        for (int other = 0; other < 3; other++) {
            assert_true((value_of(b, other, 50) > 0) == (b == other));
        }
    }
    assert_int_equal(appearance.counters.trained, 24);
    assert_int_equal(appearance.counters.shared, 0);
}

static void test_nothing_is_known_of_a_beacon_without_a_classifier(void **state)
{
    bslam_sample_t sample = {{0}};
    const bslam_opinion_t opinion = bslam_appearance_ask(&appearance, 0, &sample);
    assert_true(opinion.weight == 0.0f && opinion.value == 0.0f);
}

static void test_weight_grows_with_the_samples(void **state)
{
    for (int view = 0; view < 3; view++) {
        teach(0, 2, 0, view);
        teach(1, 2, 1, view);
    }
    bslam_sample_t sample = {{0}};
    assert_near(bslam_appearance_ask(&appearance, 0, &sample).weight, 0.5, 1e-6);
}

static void test_a_robot_that_stands_still_teaches_once(void **state)
{
    float signature[BSLAM_SAMPLE_FEATURES];
    view_of(0, 0, signature);
    for (int i = 0; i < 5; i++) {
        show(0, 1, signature);
    }
    assert_int_equal(appearance.counters.trained, 1);
    // The way counts modulo 2^32 micrometres.
    travelled_um--;
    show(0, 1, signature);
    assert_int_equal(appearance.counters.trained, 2);
}

static void learn_two(int views)
{
    for (int view = 0; view < views; view++) {
        teach(0, 3, 0, view);
        teach(1, 3, 1, view);
    }
}

static void test_a_new_beacon_that_resembles_another_shares_its_classifier(void **state)
{
    learn_two(8);
    for (int view = 20; view < 20 + SHARE; view++) {
        assert_int_equal(appearance.of[2].classifier,
                         BSLAM_NO_CLASSIFIER);  // while that is open it learns nothing
        teach(2, 3, 0, view);
    }
    assert_int_equal(appearance.of[2].classifier, appearance.of[0].classifier);
    assert_int_equal(appearance.counters.shared, 1);
    assert_true(value_of(2, 0, 70) > 0);
}

static void test_a_beacon_that_only_once_looked_like_another_gets_its_own(void **state)
{
    learn_two(8);
    teach(2, 3, 0, 20);
    teach(2, 3, 2, 21);
    assert_true(appearance.of[2].classifier >= 0);
    assert_int_not_equal(appearance.of[2].classifier, appearance.of[0].classifier);
    assert_int_equal(appearance.counters.shared, 0);
}

static void test_a_beacon_that_resembles_one_and_then_another_gets_its_own(void **state)
{
    learn_two(8);
    teach(2, 3, 0, 20);
    teach(2, 3, 1, 21);  // whom it looked like first is not there again
    assert_int_equal(appearance.counters.shared, 0);
    assert_true(appearance.of[2].classifier >= 0);
    assert_int_not_equal(appearance.of[2].classifier, appearance.of[0].classifier);
    assert_int_not_equal(appearance.of[2].classifier, appearance.of[1].classifier);
}

static void test_a_shared_classifier_is_kept_while_it_knows_its_beacons(void **state)
{
    learn_two(8);
    appearance.of[2].classifier = appearance.of[0].classifier;
    for (int view = 0; view < 3 * SHARE; view++) {
        teach(2, 3, 0, 30 + view);
    }
    assert_int_equal(appearance.of[2].classifier, appearance.of[0].classifier);
    assert_int_equal(appearance.counters.parted, 0);
}

/// It has nothing to tell its beacons from, and so refuses nobody.
static void test_a_shared_classifier_without_competitors_is_kept(void **state)
{
    teach(0, 2, 0, 0);
    appearance.of[1].classifier = appearance.of[0].classifier;
    for (int view = 0; view < 3 * SHARE; view++) {
        teach(1, 2, 1, 30 + view);
    }
    assert_int_equal(appearance.of[1].classifier, appearance.of[0].classifier);
    assert_int_equal(appearance.counters.parted, 0);
}

static void test_a_shared_classifier_that_refuses_a_beacon_is_left(void **state)
{
    learn_two(8);
    appearance.of[2].classifier = appearance.of[0].classifier;  // shared by mistake: beacon 2 looks otherwise
    for (int view = 0; view < SHARE; view++) {
        assert_int_equal(appearance.counters.parted, 0);
        float signature[BSLAM_SAMPLE_FEATURES];
        view_of(1, 30 + view, signature);
        travelled_um += 150000;
        show(2, 3, signature);  // sooner than it could be trained to take that, too
    }
    assert_int_equal(appearance.counters.parted, 1);
    assert_int_not_equal(appearance.of[2].classifier, appearance.of[0].classifier);
}

static void test_forget_frees_a_classifier_unless_another_beacon_has_it(void **state)
{
    learn_two(8);
    appearance.of[2].classifier = appearance.of[0].classifier;
    const int16_t shared = appearance.of[0].classifier;
    const int16_t second = appearance.of[1].classifier;
    bslam_appearance_forget(&appearance, 0, 3);
    assert_int_equal(appearance.of[0].classifier, second);
    assert_int_equal(appearance.of[1].classifier, shared);
    assert_int_equal(appearance.of[2].classifier, BSLAM_NO_CLASSIFIER);
    assert_true(bslam_learner_knows(&appearance.learner, shared));
    bslam_appearance_forget(&appearance, 1, 2);
    assert_int_equal(bslam_learner_samples(&appearance.learner, shared), 0);
    assert_true(bslam_learner_samples(&appearance.learner, second) > 0);
}

static void test_forget_while_the_classifier_is_in_training(void **state)
{
    for (int view = 0; view < 4; view++) {
        for (int b = 0; b < 3; b++) {
            teach(b, 3, b, view);
        }
    }
    float signature[BSLAM_SAMPLE_FEATURES];
    view_of(0, 90, signature);
    travelled_um += 150000;
    show(0, 3, signature);
    (void)bslam_learner_work(&appearance.learner, 5);
    bslam_appearance_forget(&appearance, 0, 3);
    train();
    assert_true(value_of(0, 1, 60) > 0);  // what was beacon 1
}

static void see_class(uint8_t beacon_class, int times)
{
    bslam_sighting_t sighting = unit_polar(0, 4, -1);
    sighting.beacon_class = beacon_class;
    for (int i = 0; i < times; i++) {
        travelled_um += 150000;
        bslam_appearance_train(&appearance, 0, 1, travelled_um, &sighting);
    }
}

static void test_class_odds_are_of_counts_with_a_little_doubt(void **state)
{
    assert_near(bslam_appearance_class_odds(&appearance, 0, 3), 0, 1e-6);
    see_class(3, 6);
    see_class(7, 2);
    assert_near(bslam_appearance_class_odds(&appearance, 0, 3), log(8 * 6.1 / 8.8), 1e-5);
    assert_near(bslam_appearance_class_odds(&appearance, 0, 7), log(8 * 2.1 / 8.8), 1e-5);
    assert_near(bslam_appearance_class_odds(&appearance, 0, 1), log(8 * 0.1 / 8.8), 1e-5);
    see_class(BSLAM_CLASS_NONE, 3);
    see_class(BSLAM_APPEARANCE_CLASSES + 1, 3);
    assert_near(bslam_appearance_class_odds(&appearance, 0, 3), log(8 * 6.1 / 8.8), 1e-5);
    assert_near(bslam_appearance_class_odds(&appearance, 0, BSLAM_CLASS_NONE), 0, 0);
    assert_near(bslam_appearance_class_odds(&appearance, 0, BSLAM_APPEARANCE_CLASSES + 1), 0, 0);
}

static void test_a_class_seen_for_long_is_unlearned_again(void **state)
{
    see_class(3, 300);
    assert_true(bslam_appearance_class_odds(&appearance, 0, 5) < -2);
    see_class(5, 40);
    assert_true(bslam_appearance_class_odds(&appearance, 0, 5) > 1);
}

/// As a map may have it that another build wrote.
static void test_a_class_count_beyond_the_limit_comes_down_and_never_wraps(void **state)
{
    for (int count = 0; count <= UINT8_MAX; count++) {
        appearance.of[0].seen_as[2] = (uint8_t)count;
        for (int view = 0; view < 20; view++) {
            see_class(3, 1);
            assert_true(bslam_appearance_class_odds(&appearance, 0, 3) > 0);
            assert_int_equal(bslam_appearance_class(&appearance, 0), 3);
        }
        assert_true(appearance.of[0].seen_as[2] <= 33);
    }
}

// ---- log odds ---------------------------------------------------------------------------------------------

static const int32_t METHODS[] = {BSLAM_ASSOCIATION_SVM, BSLAM_ASSOCIATION_NEAREST_SAMPLE,
                                  BSLAM_ASSOCIATION_CENTROID, BSLAM_ASSOCIATION_BOTH};

/// What a method says of a sample whose first feature is this, the others 0.
static double odds_by(int32_t association, double first)
{
    bslam_settings_t settings = unit_settings();
    settings.association = association;
    const float signature[BSLAM_SAMPLE_FEATURES] = {(float)first};
    bslam_sample_t sample;
    assert_int_equal(bslam_sample_encode(signature, &sample), BSLAM_OK);
    return (double)bslam_appearance_odds(&appearance, &settings, 0, &sample);
}

/// Beacon 0 has a classifier whose value is so many times the first feature, and that keeps two samples: 0.4
/// and 0.8 in the first feature.
static void know_two_samples(double value)
{
    unit_give_machine(&appearance, 0, value, 2);
    const float kept[] = {0.4f, 0.8f};
    for (int i = 0; i < 2; i++) {
        const float signature[BSLAM_SAMPLE_FEATURES] = {kept[i]};
        assert_int_equal(bslam_sample_encode(signature, &appearance.learner.samples[i]), BSLAM_OK);
    }
}

static void test_odds_are_by_the_methods_coefficients(void **state)
{
    know_two_samples(0.5);
    for (int k = 0; k < COUNT_OF(METHODS); k++) {
        const bslam_calibration_t *by = bslam_calibration_of(METHODS[k]);
        const double distance = by->to_middle ? 0.3 : 0.1, value = 0.45, more = log(2);
        const double expected =
            (double)by->offset + (double)by->distance * distance + (double)by->value * value +
            more * ((double)by->more + (double)by->more_distance * distance + (double)by->more_value * value);
        assert_true(fabs(expected) < 8);
        assert_near(odds_by(METHODS[k], 0.9), expected, 0.1);  // features are stored in eight bits
    }
}

static void test_odds_are_for_what_looks_alike_and_against_what_does_not(void **state)
{
    know_two_samples(2);
    for (int k = 0; k < COUNT_OF(METHODS); k++) {
        assert_true(odds_by(METHODS[k], 0.6) > 0);
        assert_true(odds_by(METHODS[k], -0.6) < 0);
    }
}

static void test_odds_are_clipped(void **state)
{
    unit_give_machine(&appearance, 0, 10, 3);
    assert_near(odds_by(BSLAM_ASSOCIATION_SVM, 1), 8, 1e-6);
    assert_near(odds_by(BSLAM_ASSOCIATION_SVM, -1), -8, 1e-6);
}

static void test_a_classifier_that_knows_nothing_says_nothing(void **state)
{
    assert_near(odds_by(BSLAM_ASSOCIATION_SVM, 1), 0, 0);  // it has none
    unit_give_machine(&appearance, 0, 10, 3);
    appearance.learner.classifiers[0].negatives = 0;  // nothing to tell the beacon from
    for (int k = 0; k < COUNT_OF(METHODS); k++) {
        assert_near(odds_by(METHODS[k], 1), 0, 0);
    }
}

// ---- hypotheses -------------------------------------------------------------------------------------------

static void test_while_hypotheses_share_the_classifiers_none_leaves(void **state)
{
    learn_two(4);
    const int16_t first = appearance.of[0].classifier, second = appearance.of[1].classifier;
    bslam_appearance_share(&appearance, true);
    bslam_appearance_forget(&appearance, 0, 2);
    assert_true(bslam_learner_samples(&appearance.learner, first) > 0);
    bslam_appearance_share(&appearance, false);
    assert_int_equal(bslam_learner_samples(&appearance.learner, first), 0);
    assert_true(bslam_learner_samples(&appearance.learner, second) > 0);
    assert_int_equal(appearance.of[0].classifier, second);
}

/// It is nobody's twin any more, so that no beacon comes to share what is not there.
static void test_a_classifier_that_leaves_late_is_no_twin_either(void **state)
{
    learn_two(8);
    const int16_t first = appearance.of[0].classifier;
    teach(2, 3, 0, 20);
    assert_int_equal(appearance.of[2].twin, first);
    bslam_appearance_share(&appearance, true);
    bslam_appearance_forget(&appearance, 0, 3);
    assert_int_equal(appearance.of[1].twin, first);
    bslam_appearance_share(&appearance, false);
    assert_int_equal(appearance.of[1].twin, BSLAM_NO_CLASSIFIER);
    assert_int_equal(appearance.of[1].twin_count, 0);
}

// ---- viewpoints -------------------------------------------------------------------------------------------

static const double TURN_RAD = 6.283185307179586;

static int sector_at(double turns)
{
    return bslam_viewpoint_sector((bslam_real_t)(turns * TURN_RAD));
}

static void test_sectors_are_equal_parts_of_a_turn(void **state)
{
    for (int k = -40; k < 40; k++) {
        const int sector = sector_at((k + 0.5) / BSLAM_APPEARANCE_SECTORS);
        assert_int_equal(sector_at((k + 0.02) / BSLAM_APPEARANCE_SECTORS), sector);
        assert_int_equal(sector_at((k + 0.98) / BSLAM_APPEARANCE_SECTORS), sector);
        const int next = sector_at((k + 1.5) / BSLAM_APPEARANCE_SECTORS);
        assert_int_equal(next, (sector + 1) % BSLAM_APPEARANCE_SECTORS);
    }
    assert_in_range(sector_at(0.5), 0, BSLAM_APPEARANCE_SECTORS - 1);
    assert_in_range(sector_at(-0.5), 0, BSLAM_APPEARANCE_SECTORS - 1);
}

static void test_all_beacons_alike_end_with_one_classifier(void **state)
{
    for (int view = 0; view < 40; view++) {
        for (int b = 0; b < 4; b++) {
            teach(b, 4, 0, 4 * view + b);
        }
    }
    // Whoever came first keeps its classifier; the rest, which it takes for its own, share it, or have one
    // that says nothing sure.
    for (int b = 0; b < 4; b++) {
        assert_true(appearance.of[b].classifier == appearance.of[0].classifier || value_of(b, 0, 777) < 1);
    }
}

static void test_a_signature_that_is_no_number_teaches_nothing(void **state)
{
    float signature[BSLAM_SAMPLE_FEATURES];
    view_of(0, 0, signature);
    signature[5] = NAN;
    show(0, 1, signature);
    assert_int_equal(appearance.of[0].classifier, BSLAM_NO_CLASSIFIER);
    assert_int_equal(appearance.counters.trained, 0);
}

static void test_without_a_free_slot_a_beacon_goes_without(void **state)
{
    int32_t classifier;
    while (bslam_learner_add(&appearance.learner, &classifier) == BSLAM_OK) {
    }
    teach(0, 1, 0, 0);
    assert_int_equal(appearance.of[0].classifier, BSLAM_NO_CLASSIFIER);
    assert_int_equal(appearance.counters.no_slot, 1);
    assert_int_equal(appearance.counters.trained, 0);
}

static void test_init_refuses_too_many_seeds_and_changes_nothing(void **state)
{
    static bslam_appearance_t before;
    memset(&appearance, 0x5a, sizeof appearance);
    memcpy(&before, &appearance, sizeof appearance);
    assert_int_equal(bslam_appearance_init(&appearance, NULL, BSLAM_SEEDS_MAX + 1), BSLAM_E_COUNT);
    assert_memory_equal(&appearance, &before, sizeof appearance);
}

static void test_clear_forgets_all(void **state)
{
    learn_two(4);
    bslam_appearance_clear(&appearance);
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        assert_int_equal(appearance.of[b].classifier, BSLAM_NO_CLASSIFIER);
    }
    int32_t classifier;
    assert_int_equal(bslam_learner_add(&appearance.learner, &classifier), BSLAM_OK);
    assert_int_equal(classifier, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_class_odds_are_of_counts_with_a_little_doubt, setup),
        cmocka_unit_test_setup(test_a_class_seen_for_long_is_unlearned_again, setup),
        cmocka_unit_test_setup(test_a_class_count_beyond_the_limit_comes_down_and_never_wraps, setup),
        cmocka_unit_test_setup(test_odds_are_by_the_methods_coefficients, setup),
        cmocka_unit_test_setup(test_odds_are_for_what_looks_alike_and_against_what_does_not, setup),
        cmocka_unit_test_setup(test_odds_are_clipped, setup),
        cmocka_unit_test_setup(test_a_classifier_that_knows_nothing_says_nothing, setup),
        cmocka_unit_test_setup(test_while_hypotheses_share_the_classifiers_none_leaves, setup),
        cmocka_unit_test_setup(test_a_classifier_that_leaves_late_is_no_twin_either, setup),
        cmocka_unit_test_setup(test_sectors_are_equal_parts_of_a_turn, setup),
        cmocka_unit_test_setup(test_each_beacon_learns_its_own_look, setup),
        cmocka_unit_test_setup(test_nothing_is_known_of_a_beacon_without_a_classifier, setup),
        cmocka_unit_test_setup(test_weight_grows_with_the_samples, setup),
        cmocka_unit_test_setup(test_a_robot_that_stands_still_teaches_once, setup),
        cmocka_unit_test_setup(test_a_new_beacon_that_resembles_another_shares_its_classifier, setup),
        cmocka_unit_test_setup(test_a_beacon_that_only_once_looked_like_another_gets_its_own, setup),
        cmocka_unit_test_setup(test_a_beacon_that_resembles_one_and_then_another_gets_its_own, setup),
        cmocka_unit_test_setup(test_a_shared_classifier_is_kept_while_it_knows_its_beacons, setup),
        cmocka_unit_test_setup(test_a_shared_classifier_without_competitors_is_kept, setup),
        cmocka_unit_test_setup(test_a_shared_classifier_that_refuses_a_beacon_is_left, setup),
        cmocka_unit_test_setup(test_forget_frees_a_classifier_unless_another_beacon_has_it, setup),
        cmocka_unit_test_setup(test_forget_while_the_classifier_is_in_training, setup),
        cmocka_unit_test_setup(test_all_beacons_alike_end_with_one_classifier, setup),
        cmocka_unit_test_setup(test_a_signature_that_is_no_number_teaches_nothing, setup),
        cmocka_unit_test_setup(test_without_a_free_slot_a_beacon_goes_without, setup),
        cmocka_unit_test_setup(test_init_refuses_too_many_seeds_and_changes_nothing, setup),
        cmocka_unit_test_setup(test_clear_forgets_all, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
