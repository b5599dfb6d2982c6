#include "support.h"

#include <math.h>

#include "bslam/association/viewpoint.h"
#include "plain_settings.h"

static bslam_appearance_t appearance;
static bslam_settings_t settings;
static uint32_t travelled_um;

enum { SHARE = 3 };

static int setup(void **state)
{
    settings = unit_settings();
    settings.appearance_samples = 3;
    settings.learn_travel_m = BSLAM_R(0.1);
    settings.share_value = BSLAM_R(0.3);
    settings.share_sightings = SHARE;
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
    bslam_appearance_train(&appearance, &settings, index, count, travelled_um, &sighting);
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
    return (double)bslam_appearance_ask(&appearance, &settings, index, &sample).value;
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
    const bslam_opinion_t opinion = bslam_appearance_ask(&appearance, &settings, 0, &sample);
    assert_true(opinion.weight == 0.0f && opinion.value == 0.0f);
}

static void test_weight_grows_with_the_samples(void **state)
{
    for (int view = 0; view < 3; view++) {
        teach(0, 2, 0, view);
        teach(1, 2, 1, view);
    }
    bslam_sample_t sample = {{0}};
    assert_near(bslam_appearance_ask(&appearance, &settings, 0, &sample).weight, 0.5, 1e-6);
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
        teach(2, 3, 1, 30 + view);
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
        bslam_appearance_train(&appearance, &settings, 0, 1, travelled_um, &sighting);
    }
}

static void test_class_odds_are_of_counts_with_a_little_doubt(void **state)
{
    settings.class_doubt = BSLAM_R(0.5);
    assert_near(bslam_appearance_class_odds(&appearance, &settings, 0, 3), 0, 1e-6);
    see_class(3, 6);
    see_class(7, 2);
    assert_near(bslam_appearance_class_odds(&appearance, &settings, 0, 3), log(8 * 6.5 / 12), 1e-5);
    assert_near(bslam_appearance_class_odds(&appearance, &settings, 0, 7), log(8 * 2.5 / 12), 1e-5);
    assert_near(bslam_appearance_class_odds(&appearance, &settings, 0, 1), log(8 * 0.5 / 12), 1e-5);
    see_class(BSLAM_CLASS_NONE, 3);
    see_class(BSLAM_APPEARANCE_CLASSES + 1, 3);
    assert_near(bslam_appearance_class_odds(&appearance, &settings, 0, 3), log(8 * 6.5 / 12), 1e-5);
    assert_near(bslam_appearance_class_odds(&appearance, &settings, 0, BSLAM_CLASS_NONE), 0, 0);
    assert_near(bslam_appearance_class_odds(&appearance, &settings, 0, BSLAM_APPEARANCE_CLASSES + 1), 0, 0);
}

static void test_a_class_seen_for_long_is_unlearned_again(void **state)
{
    see_class(3, 300);
    assert_true(bslam_appearance_class_odds(&appearance, &settings, 0, 5) < -2);
    see_class(5, 40);
    assert_true(bslam_appearance_class_odds(&appearance, &settings, 0, 5) > 1);
}

/// As a map may have it that another build wrote.
static void test_a_class_count_beyond_the_limit_comes_down_and_never_wraps(void **state)
{
    for (int count = 0; count <= UINT8_MAX; count++) {
        appearance.of[0].seen_as[2] = (uint8_t)count;
        for (int view = 0; view < 20; view++) {
            see_class(3, 1);
            assert_true(bslam_appearance_class_odds(&appearance, &settings, 0, 3) > 0);
            assert_int_equal(bslam_appearance_class(&appearance, 0), 3);
        }
        assert_true(appearance.of[0].seen_as[2] <= 33);
    }
}

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

static double viewpoint_odds(int sectors_on)
{
    return (double)bslam_appearance_viewpoint_odds(&appearance, &settings, 0,
                                                   sector_at((7.5 + sectors_on) / BSLAM_APPEARANCE_SECTORS));
}

/// A wall's beacon has a back; one that stands free is seen from all sides in time.
static void test_side_odds_fall_with_the_angle_to_where_it_was_seen_from(void **state)
{
    settings.viewpoint_low = 3;
    settings.viewpoint_high = 1;
    for (int k = -8; k <= 8; k++) {
        assert_near(viewpoint_odds(k), 0, 0);  // from nowhere yet
    }
    const int here = sector_at(7.5 / BSLAM_APPEARANCE_SECTORS);  // the last, beside the first
    appearance.of[0].seen_from[here] = 40;
    const double passing[] = {0, 0, -1, -2, -3, -3, -3, -3, -3};
    for (int k = -8; k <= 8; k++) {
        assert_near(viewpoint_odds(k), passing[abs(k)], 1e-6);
    }
    appearance.of[0].seen_from[(here + 1) % BSLAM_APPEARANCE_SECTORS] = 1;
    const double two_sides[] = {-3, -3, -2, -1, 0, 1, 1, 0, -1, -2, -3};
    for (int k = -5; k <= 5; k++) {
        assert_near(viewpoint_odds(k), two_sides[k + 5], 1e-6);
    }
    memset(appearance.of[0].seen_from, 1, sizeof appearance.of[0].seen_from);
    for (int k = -8; k <= 8; k++) {
        assert_near(viewpoint_odds(k), 1, 0);
    }
    assert_near(bslam_appearance_viewpoint_odds(&appearance, &settings, 1, 0), 0,
                0);  // each beacon has its own
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

static void test_a_wait_lasts_from_its_first_moment_unless_it_paused_too_long(void **state)
{
    settings.decision_delay_us = 1000000;
    const int64_t start_us = ((int64_t)1 << 32) - 500000;  // the clock of the wait turns over within it
    assert_false(bslam_appearance_is_due(&appearance, &settings, 2, 0));
    assert_false(bslam_appearance_is_due(&appearance, &settings, 2, start_us));
    for (int64_t ago_us = 0; ago_us < 900000; ago_us += 300000) {
        bslam_appearance_note_delay(&appearance, &settings, 2, start_us + ago_us);
        assert_false(bslam_appearance_is_due(&appearance, &settings, 2, start_us + ago_us));
    }
    assert_false(bslam_appearance_is_due(&appearance, &settings, 2, start_us + 999998));
    assert_true(bslam_appearance_is_due(&appearance, &settings, 2, start_us + 1000000));
    assert_true(bslam_appearance_is_due(&appearance, &settings, 2, start_us + 1600000));
    assert_false(bslam_appearance_is_due(&appearance, &settings, 1, start_us + 1000000));
    bslam_appearance_note_delay(&appearance, &settings, 2,
                                start_us + 1600001);  // the last was over a second before
    assert_false(bslam_appearance_is_due(&appearance, &settings, 2, start_us + 1600001));
    assert_true(bslam_appearance_is_due(&appearance, &settings, 2, start_us + 2600001));
    bslam_appearance_forget(&appearance, 2, 3);
    assert_false(bslam_appearance_is_due(&appearance, &settings, 2, start_us + 2600001));
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
        cmocka_unit_test_setup(test_sectors_are_equal_parts_of_a_turn, setup),
        cmocka_unit_test_setup(test_side_odds_fall_with_the_angle_to_where_it_was_seen_from, setup),
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
        cmocka_unit_test_setup(test_a_wait_lasts_from_its_first_moment_unless_it_paused_too_long, setup),
        cmocka_unit_test_setup(test_clear_forgets_all, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
