#include "kept_map.h"

#include "bslam/slam/fingerprint.h"
#include "plain_settings.h"

static bslam_slam_t slam;

/// A robot that has seen two beacons.
static int start(void **state)
{
    const bslam_settings_t settings = unit_settings();
    int bad_id = -1;
    const bslam_sighting_t seen[] = {unit_polar(0.3, 2, 1), unit_polar(-0.4, 3, 2)};
    if (bslam_slam_init(&slam, &settings, &bad_id) != BSLAM_OK) {
        return 1;
    }
    return bslam_slam_sightings(&slam, 1000, seen, 2) == BSLAM_OK ? 0 : 1;
}

static void assert_counts(bslam_real_t *value, uint64_t whole)
{
    const bslam_real_t kept = *value;
    uint8_t *lowest = (uint8_t *)value;
    *lowest ^= 1u;
    assert_true(bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START) != whole);
    *value = kept;
}

static void test_fingerprint_the_lowest_bit_of_any_state_value_changes_it(void **state)
{
    const uint64_t whole = bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START);
    assert_int_equal(slam.ekf.dim, 7);
    for (int i = 0; i < slam.ekf.dim; i++) {
        const int place = bslam_ekf_place(&slam.ekf, i);
        assert_counts(&slam.ekf.mean[i], whole);
        assert_counts(&slam.ekf.factor.d[place], whole);
        for (int j = 0; j < i; j++) {
            const int other = bslam_ekf_place(&slam.ekf, j);
            assert_counts(bslam_factor_element(&slam.ekf.factor, place > other ? place : other,
                                               place > other ? other : place),
                          whole);
        }
    }
    assert_true(bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START) == whole);
}

static void test_fingerprint_what_is_not_the_state_does_not_count(void **state)
{
    const uint64_t whole = bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START);
    slam.ekf.mean[slam.ekf.dim] += 1;  // the fill
    slam.ekf.v[0][0] += 1;             // scratch
    slam.counters.frames++;
    assert_true(bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START) == whole);
}

static void test_fingerprint_a_chain_that_differed_stays_different(void **state)
{
    uint64_t a = bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START);
    uint64_t b = bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START + 1);
    for (int i = 0; i < 1000; i++) {
        assert_true(a != b);
        a = bslam_slam_fingerprint(&slam, a);
        b = bslam_slam_fingerprint(&slam, b);
    }
}

/// With appearance: every classifier that has been trained counts, and no other.
static void test_fingerprint_has_the_weights_of_trained_classifiers(void **state)
{
    static bslam_appearance_t appearance;
    kept_make(&slam, &appearance, 3);
    const uint64_t whole = bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START);
    int trained = 0;
    for (int m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        bslam_classifier_t *classifier = &appearance.learner.classifiers[m];
        const bool counts = classifier->used && classifier->trained;
        trained += counts ? 1 : 0;
        const bslam_stored_weight_t kept = classifier->weights.w[0];
        classifier->weights.w[0] = (bslam_stored_weight_t)(kept + 1);
        assert_int_equal(bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START) != whole, counts);
        classifier->weights.w[0] = kept;
    }
    assert_int_equal(trained, 3);
    appearance.learner.classifiers[0].trained = false;
    assert_true(bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START) != whole);
    slam.appearance = NULL;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_fingerprint_the_lowest_bit_of_any_state_value_changes_it, start),
        cmocka_unit_test(test_fingerprint_has_the_weights_of_trained_classifiers),
        cmocka_unit_test_setup(test_fingerprint_what_is_not_the_state_does_not_count, start),
        cmocka_unit_test_setup(test_fingerprint_a_chain_that_differed_stays_different, start),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
