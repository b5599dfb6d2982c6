// Machines that learn online, on made-up signatures: an object is a few strong colours, a view of it adds
// noise.
#include "support.h"

#include <math.h>

#include "bslam/appearance/learner.h"

enum {
    OBJECTS = 8,
    SEEDS = 40,
    FULL = BSLAM_SAMPLES_PER_CLASSIFIER,
    // A training looks at every block once or twice, makes each row once, and then solves.
    BLOCKS = BSLAM_LEARNER_SLOTS +
             (BSLAM_SEEDS_MAX + BSLAM_SAMPLES_PER_CLASSIFIER - 1) / BSLAM_SAMPLES_PER_CLASSIFIER,
    PIECES_MAX = 2 * BLOCKS + BSLAM_SOLVER_ROWS_MAX + 220 + 4,
};

static bslam_learner_t learner;
static bslam_learner_t before;
static bslam_sample_t seeds[SEEDS];

/// A view of an object: colours of its own, and noise that differs from view to view.
static void view_of(int object, int view, float *signature)
{
    unit_random_t look = {(uint64_t)(1000 + object)};
    unit_random_t noise = {(uint64_t)(77000 + 977 * object + 31 * view + 1)};
    double colours[64] = {0};
    double sum = 0;
    for (int k = 0; k < 6; k++) {
        const int bin = (int)unit_random(&look, 0, 64);
        colours[bin] += unit_random(&look, 0.1, 1) * unit_random(&noise, 0.5, 1.5);
    }
    for (int k = 0; k < 64; k++) {
        colours[k] += unit_random(&noise, 0, 0.01);
        sum += colours[k];
    }
    for (int k = 0; k < 64; k++) {
        signature[k] = (float)sqrt(colours[k] / sum);
    }
    for (int k = 64; k < BSLAM_SAMPLE_FEATURES; k++) {
        signature[k] = (float)(unit_random(&look, 0, 0.5) + unit_random(&noise, -0.05, 0.05));
    }
}

static void begin(void)
{
    float signature[BSLAM_SAMPLE_FEATURES];
    for (int i = 0; i < SEEDS; i++) {
        view_of(500 + i, 0, signature);
        assert_int_equal(bslam_sample_encode(signature, &seeds[i]), BSLAM_OK);
    }
    assert_int_equal(bslam_learner_init(&learner, seeds, SEEDS), BSLAM_OK);
}

static int32_t add(void)
{
    int32_t classifier = -1;
    assert_int_equal(bslam_learner_add(&learner, &classifier), BSLAM_OK);
    return classifier;
}

static void show(int32_t classifier, int object, int view)
{
    float signature[BSLAM_SAMPLE_FEATURES];
    view_of(object, view, signature);
    assert_int_equal(bslam_learner_show(&learner, classifier, signature), BSLAM_OK);
}

static void train(void)
{
    while (bslam_learner_work(&learner, 100)) {
    }
}

static double value_of(int32_t classifier, int object, int view)
{
    float signature[BSLAM_SAMPLE_FEATURES];
    bslam_sample_t sample;
    view_of(object, view, signature);
    assert_int_equal(bslam_sample_encode(signature, &sample), BSLAM_OK);
    const float value = bslam_sample_decide(&learner.classifiers[classifier].weights, &sample);
    assert_true(isfinite(value));
    return (double)value;
}

/// Machine m learns object m, from `views` views each, one after the other.
static void learn_objects(int objects, int views)
{
    begin();
    for (int m = 0; m < objects; m++) {
        assert_int_equal(add(), m);
    }
    for (int view = 0; view < views; view++) {
        for (int m = 0; m < objects; m++) {
            show(m, m, view);
            train();
        }
    }
}

static void remember(void)
{
    memcpy(&before, &learner, sizeof learner);
}

/// All bytes but the counters are as remembered.
static void assert_unchanged(void)
{
    before.counters = learner.counters;
    assert_memory_equal(&before, &learner, sizeof learner);
}

// ---- what it learns
// ---------------------------------------------------------------------------------------------

static void test_one_sample_makes_a_classifier_useful(void **state)
{
    learn_objects(1, 1);
    assert_true(value_of(0, 0, 0) > 0.5);
    int right = 0;
    for (int view = 1; view <= 20; view++) {
        right += value_of(0, 0, view) > value_of(0, 1 + view, view) ? 1 : 0;
    }
    assert_true(right >= 19);
    for (int i = 0; i < SEEDS; i++) {
        assert_true(value_of(0, 500 + i, 0) < 0);
    }
}

static void test_several_classifiers_tell_their_objects_apart(void **state)
{
    learn_objects(OBJECTS, 6);
    for (int object = 0; object < OBJECTS; object++) {
        for (int view = 100; view < 110; view++) {
            const double own = value_of(object, object, view);
            for (int m = 0; m < OBJECTS; m++) {
                assert_true(m == object || own > value_of(m, object, view));
            }
        }
    }
}

static void test_decide_before_the_first_training_is_0(void **state)
{
    begin();
    const int32_t classifier = add();
    assert_near(value_of(classifier, 0, 0), 0, 0);
    show(classifier, 0, 0);
    assert_near(value_of(classifier, 0, 0), 0, 0);
}

static void test_show_trains_a_classifier_that_takes_it_for_its_own(void **state)
{
    learn_objects(1, 3);
    const double fooled = value_of(0, 0, 50);
    assert_true(fooled > 0);
    // A second beacon that looks like the first: the first classifier learns it without being shown anything.
    const int32_t other = add();
    show(other, 0, 50);
    train();
    assert_true(value_of(0, 0, 50) < fooled - 0.2);
    assert_int_equal(bslam_learner_samples(&learner, 0), 3);
}

static void test_contradictory_labels_end_undecided(void **state)
{
    begin();
    const int32_t a = add();
    const int32_t b = add();
    for (int k = 0; k < 4; k++) {
        show(a, 0, 0);
        train();
        show(b, 0, 0);
        train();
    }
    assert_near(value_of(a, 0, 0), 0, 0.5);
    assert_near(value_of(b, 0, 0), 0, 0.5);
}

static void test_all_beacons_alike_stays_bounded(void **state)
{
    begin();
    for (int m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        const int32_t classifier = add();
        for (int k = 0; k < FULL + 2; k++) {
            show(classifier, 0, 0);
            train();
        }
    }
    for (int m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        assert_true(fabs(value_of(m, 0, 0)) < 2);
    }
    // And tells what is no beacon from them all.
    assert_true(value_of(0, 0, 0) > value_of(0, 500, 0));
}

static bool is_on_list(int32_t classifier, int32_t sample)
{
    bool found = false;
    for (int i = 0; i < learner.classifiers[classifier].negatives; i++) {
        found = found || learner.classifiers[classifier].negative[i] == sample;
    }
    return found;
}

static void test_show_a_negative_gets_on_a_full_list(void **state)
{
    begin();
    for (int m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        (void)add();
    }
    show(0, 0, 0);
    train();
    // Untrained and so without a voice: their samples only fill the first classifier's list.
    for (int k = 0; k < BSLAM_NEGATIVES_MAX; k++) {
        show(1 + k / FULL, 0, 0);
    }
    assert_int_equal(learner.classifiers[0].negatives, BSLAM_NEGATIVES_MAX);
    const int32_t last = BSLAM_LEARNER_SLOTS - 1;
    show(last, 0, 0);
    assert_int_equal(learner.classifiers[0].negatives, BSLAM_NEGATIVES_MAX);
    assert_true(is_on_list(0, last * FULL));
}

// ---- the store
// --------------------------------------------------------------------------------------------------

static void test_show_full_store_keeps_its_size(void **state)
{
    learn_objects(2, FULL);
    assert_int_equal(bslam_learner_samples(&learner, 0), FULL);
    for (int view = FULL; view < 4 * FULL; view++) {
        show(0, 0, view);
        train();
        assert_int_equal(bslam_learner_samples(&learner, 0), FULL);
    }
    assert_int_equal(learner.counters.kept + learner.counters.dropped, 5 * FULL);
    assert_true(learner.counters.dropped > 0);
}

static void test_show_beyond_the_margin_of_a_full_store_changes_nothing(void **state)
{
    learn_objects(2, FULL);
    int view = FULL;
    while (value_of(0, 0, view) < 1) {
        view++;
    }
    remember();
    show(0, 0, view);
    assert_unchanged();
    assert_int_equal(learner.counters.dropped, 1);
}

/// Without a training nothing says that a sample is known well enough to be left out.
static void test_show_to_a_full_store_before_any_training_keeps_the_sample(void **state)
{
    begin();
    (void)add();
    for (int view = 0; view < FULL; view++) {
        show(0, 0, view);
    }
    remember();
    show(0, 1, 0);
    assert_int_equal(learner.classifiers[0].samples, FULL);
    assert_int_equal(learner.counters.dropped, 0);
    assert_memory_not_equal(before.samples, learner.samples, FULL * sizeof learner.samples[0]);
}

static void test_show_inside_the_margin_replaces_what_matters_least(void **state)
{
    learn_objects(2, FULL);
    uint16_t least = UINT16_MAX;
    for (int i = 0; i < FULL; i++) {
        const uint16_t alpha = learner.classifiers[0].own_alpha[i];
        least = alpha < least ? alpha : least;
    }
    remember();
    show(0, 1, 70);
    int replaced = 0;
    for (int i = 0; i < FULL; i++) {
        if (memcmp(&before.samples[i], &learner.samples[i], sizeof learner.samples[i]) != 0) {
            replaced++;
            assert_int_equal(before.classifiers[0].own_alpha[i], least);
        }
    }
    assert_int_equal(replaced, 1);
}

// ---- work in pieces
// -----------------------------------------------------------------------------------------------

static void test_work_in_pieces_is_the_same_to_the_bit(void **state)
{
    learn_objects(OBJECTS, 3);
    remember();
    while (bslam_learner_work(&learner, 1)) {
    }
    assert_memory_equal(&before, &learner, sizeof learner);
    begin();
    for (int m = 0; m < OBJECTS; m++) {
        (void)add();
    }
    for (int view = 0; view < 3; view++) {
        for (int m = 0; m < OBJECTS; m++) {
            show(m, m, view);
            while (bslam_learner_work(&learner, 1)) {
            }
        }
    }
    assert_memory_equal(&before, &learner, sizeof learner);
}

static void test_work_an_update_takes_a_bounded_number_of_pieces(void **state)
{
    begin();
    for (int m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        (void)add();
    }
    for (int k = 0; k < 2 * FULL * BSLAM_LEARNER_SLOTS; k++) {
        // All alike: as many competitors as there can be, and no end of conflict.
        show(k % BSLAM_LEARNER_SLOTS, k % 2, 0);
        const uint32_t updates = learner.counters.updates;
        (void)bslam_learner_work(&learner, PIECES_MAX);
        assert_true(learner.counters.updates > updates || learner.counters.dropped > 0);
    }
    assert_true(learner.counters.capped > 0);
}

static void test_work_goes_on_where_one_training_did_not_suffice(void **state)
{
    begin();
    for (int m = 0; m < OBJECTS; m++) {
        (void)add();
    }
    for (int view = 0; view < 4; view++) {
        for (int m = 0; m < OBJECTS; m++) {
            // Two objects a classifier, each shared with another one: hard to tell, but not for ever.
            show(m, (m + view % 2) % OBJECTS, view);
        }
    }
    train();
    assert_true(learner.counters.capped > 0);
    assert_true(learner.counters.updates > OBJECTS);
    assert_true(learner.counters.updates <= 21 * OBJECTS);
}

static void test_work_nothing_to_do_changes_nothing(void **state)
{
    learn_objects(2, 2);
    remember();
    assert_false(bslam_learner_work(&learner, 1000));
    assert_memory_equal(&before, &learner, sizeof learner);
    show(0, 0, 9);
    remember();
    assert_true(bslam_learner_work(&learner, 0));
    assert_memory_equal(&before, &learner, sizeof learner);
}

static void test_show_a_sample_in_use_puts_the_training_off(void **state)
{
    learn_objects(2, FULL);
    show(0, 1, 70);
    assert_true(bslam_learner_work(&learner, BLOCKS + BSLAM_SOLVER_ROWS_MAX));
    assert_int_equal(learner.training.classifier, 0);
    show(0, 1, 71);
    assert_int_equal(learner.counters.interrupted, 1);
    train();
    assert_false(learner.classifiers[0].waiting);
}

static void test_show_at_any_moment_of_a_training_is_defined(void **state)
{
    for (int pieces = 0; pieces < BLOCKS + 60; pieces++) {
        learn_objects(3, 2);
        show(0, 0, 7);
        (void)bslam_learner_work(&learner, pieces);
        show(0, 0, 8);
        show(1, 1, 8);
        train();
        for (int m = 0; m < 3; m++) {
            assert_int_equal(bslam_learner_samples(&learner, m), m == 0 ? 4 : m == 1 ? 3 : 2);
            assert_true(value_of(m, m, 60) > 0);
        }
    }
}

// ---- removal
// ----------------------------------------------------------------------------------------------------

static void test_remove_at_any_moment_of_a_training_is_defined(void **state)
{
    for (int pieces = 0; pieces < BLOCKS + 60; pieces++) {
        learn_objects(3, 2);
        show(0, 0, 7);
        (void)bslam_learner_work(&learner, pieces);
        const int32_t removed = pieces % 3;
        assert_int_equal(bslam_learner_remove(&learner, removed), BSLAM_OK);
        train();
        assert_int_equal(bslam_learner_samples(&learner, removed), 0);
        for (int m = 0; m < 3; m++) {
            assert_true(m == removed || value_of(m, m, 60) > 0);
        }
        // Its handle comes back, and knows nothing of what was there.
        assert_int_equal(add(), removed);
        assert_near(value_of(removed, removed, 0), 0, 0);
    }
}

static void test_remove_frees_others_of_its_samples(void **state)
{
    learn_objects(3, 4);
    assert_int_equal(bslam_learner_remove(&learner, 1), BSLAM_OK);
    for (int m = 0; m < 3; m++) {
        for (int i = 0; i < learner.classifiers[m].negatives; i++) {
            assert_true(learner.classifiers[m].negative[i] / FULL != 1);
        }
    }
}

// ---- what is refused
// ----------------------------------------------------------------------------------------------

static void test_init_count_of_seeds_out_of_range_is_refused(void **state)
{
    learn_objects(1, 1);
    remember();
    assert_int_equal(bslam_learner_init(&learner, seeds, -1), BSLAM_E_COUNT);
    assert_int_equal(bslam_learner_init(&learner, seeds, BSLAM_SEEDS_MAX + 1), BSLAM_E_COUNT);
    assert_memory_equal(&before, &learner, sizeof learner);
    assert_int_equal(bslam_learner_init(&learner, NULL, 0), BSLAM_OK);
}

static void test_add_without_a_free_slot_is_refused(void **state)
{
    begin();
    for (int m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        assert_int_equal(add(), m);
    }
    remember();
    int32_t classifier = 77;
    assert_int_equal(bslam_learner_add(&learner, &classifier), BSLAM_E_MAP_FULL);
    assert_int_equal(classifier, 77);
    assert_int_equal(learner.counters.refused_full, 1);
    assert_unchanged();
}

static void test_wrong_handle_is_refused(void **state)
{
    static const int32_t wrong[] = {-1, 2, BSLAM_LEARNER_SLOTS, INT32_MAX, INT32_MIN};
    float signature[BSLAM_SAMPLE_FEATURES];
    learn_objects(2, 2);
    view_of(0, 0, signature);
    for (int i = 0; i < COUNT_OF(wrong); i++) {
        remember();
        assert_int_equal(bslam_learner_show(&learner, wrong[i], signature), BSLAM_E_NO_BEACON);
        assert_int_equal(bslam_learner_remove(&learner, wrong[i]), BSLAM_E_NO_BEACON);
        assert_int_equal(bslam_learner_samples(&learner, wrong[i]), 0);
        assert_int_equal(learner.counters.refused_no_machine, 2 * (i + 1));
        assert_unchanged();
    }
}

static void test_show_no_number_is_refused(void **state)
{
    static const float bad[] = {NAN, INFINITY, -INFINITY, 2e12f};
    float signature[BSLAM_SAMPLE_FEATURES];
    learn_objects(2, FULL);
    for (int i = 0; i < COUNT_OF(bad); i++) {
        view_of(0, 0, signature);
        signature[i * 23] = bad[i];
        remember();
        assert_int_equal(bslam_learner_show(&learner, 0, signature), BSLAM_E_NOT_FINITE);
        assert_int_equal(learner.counters.refused_not_finite, i + 1);
        assert_unchanged();
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_sample_makes_a_classifier_useful),
        cmocka_unit_test(test_several_classifiers_tell_their_objects_apart),
        cmocka_unit_test(test_decide_before_the_first_training_is_0),
        cmocka_unit_test(test_show_trains_a_classifier_that_takes_it_for_its_own),
        cmocka_unit_test(test_contradictory_labels_end_undecided),
        cmocka_unit_test(test_all_beacons_alike_stays_bounded),
        cmocka_unit_test(test_show_a_negative_gets_on_a_full_list),
        cmocka_unit_test(test_show_full_store_keeps_its_size),
        cmocka_unit_test(test_show_beyond_the_margin_of_a_full_store_changes_nothing),
        cmocka_unit_test(test_show_to_a_full_store_before_any_training_keeps_the_sample),
        cmocka_unit_test(test_show_inside_the_margin_replaces_what_matters_least),
        cmocka_unit_test(test_work_in_pieces_is_the_same_to_the_bit),
        cmocka_unit_test(test_work_an_update_takes_a_bounded_number_of_pieces),
        cmocka_unit_test(test_work_goes_on_where_one_training_did_not_suffice),
        cmocka_unit_test(test_work_nothing_to_do_changes_nothing),
        cmocka_unit_test(test_show_a_sample_in_use_puts_the_training_off),
        cmocka_unit_test(test_show_at_any_moment_of_a_training_is_defined),
        cmocka_unit_test(test_remove_at_any_moment_of_a_training_is_defined),
        cmocka_unit_test(test_remove_frees_others_of_its_samples),
        cmocka_unit_test(test_init_count_of_seeds_out_of_range_is_refused),
        cmocka_unit_test(test_add_without_a_free_slot_is_refused),
        cmocka_unit_test(test_wrong_handle_is_refused),
        cmocka_unit_test(test_show_no_number_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
