// Bits that flip where the guard does not look: appearance, smoother, recovery. The estimator may judge worse
// then; it never reads or writes beyond its memory, and what is guarded stays as it is.
#include "support.h"

#include <math.h>
#include <string.h>

#include "bslam/internal.h"

enum { BEACONS = 3, FLIPS = 300, STEP_US = 40000 };

static bslam_t robot;
static bslam_t good;
static bslam_settings_t settings;
static bslam_sample_t seeds[40];
static float signatures[BEACONS][BSLAM_SAMPLE_FEATURES];
static int64_t now_us;
static int64_t good_us;

static bslam_instance_t *inside(void)
{
    return bslam_instance(&robot);
}

static void drive(int steps)
{
    for (; steps > 0; steps--) {
        now_us += STEP_US;
        const bslam_odometry_reading_t reading = {.time_us = now_us,
                                                  .source = BSLAM_ODOMETRY_WHEELS,
                                                  .left_m = BSLAM_R(0.009),
                                                  .right_m = BSLAM_R(0.011)};
        bslam_sighting_t seen[BEACONS];
        for (int i = 0; i < BEACONS; i++) {
            const bslam_pose_t pose = bslam_pose(&robot);
            const double dx = 3 * cos(2.1 * i) - (double)pose.x_m;
            const double dy = 3 * sin(2.1 * i) - (double)pose.y_m;
            seen[i] = (bslam_sighting_t){
                .bearing_rad = (bslam_real_t)remainder(atan2(dy, dx) - (double)pose.theta_rad, 6.283185307),
                .range_m = (bslam_real_t)hypot(dx, dy),
                .has_range = now_us / STEP_US % 2 == 0 && settings.filter != BSLAM_FILTER_SMOOTHER,
                .beacon_class = (uint8_t)(i + 1),
                .label = settings.association == BSLAM_ASSOCIATION_KNOWN ? i : BSLAM_LABEL_NONE,
                .signature = signatures[i]};
        }
        assert_int_equal(bslam_odometry(&robot, &reading), BSLAM_OK);
        assert_int_equal(bslam_sightings(&robot, now_us, seen, BEACONS), BSLAM_OK);
    }
}

static void begin(int32_t association, int32_t filter)
{
    unit_random_t random = {5};
    int bad;
    for (size_t i = 0; i < sizeof seeds / sizeof seeds[0]; i++) {
        float signature[BSLAM_SAMPLE_FEATURES];
        for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
            signature[k] = (float)unit_random(&random, -1, 1);
        }
        assert_int_equal(bslam_sample_encode(signature, &seeds[i]), BSLAM_OK);
    }
    for (int b = 0; b < BEACONS; b++) {
        for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
            signatures[b][k] = (float)unit_random(&random, -1, 1);
        }
    }
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    settings.association = association;
    settings.filter = filter;
    settings.guard = 1;
    settings.recovery = 1;
    settings.learn_budget = 40;
    settings.seeds = seeds;
    settings.seed_count = (int32_t)(sizeof seeds / sizeof seeds[0]);
    assert_int_equal(bslam_init(&robot, &settings, &bad), BSLAM_OK);
    now_us = 0;
}

static bool swallow(void *context, const void *bytes, uint32_t count)
{
    (void)context;
    (void)bytes;
    (void)count;
    return true;
}

/// All that reads what may be damaged.
static void use_all(void)
{
    const bslam_map_sink_t sink = {swallow, NULL};
    uint32_t size;
    bslam_beacon_view_t view;
    assert_int_equal(bslam_save_map(&robot, &sink, &size), BSLAM_OK);
    drive(4);
    if (bslam_beacon(&robot, 0, &view) == BSLAM_OK) {
        assert_int_equal(bslam_remove_beacon(&robot, view.uid), BSLAM_OK);
    }
    drive(2);
    assert_int_equal(bslam_remove_beacon(&robot, BSLAM_ALL_BEACONS), BSLAM_OK);
    drive(1);
}

/// Flips bits of one member, one at a time, where it stands after `steps` steps and some.
static void flip_in(void *member, size_t bytes, int steps, uint64_t seed)
{
    unit_random_t random = {seed};
    memcpy(&good, &robot, sizeof good);
    good_us = now_us;
    for (int flip = 0; flip < FLIPS; flip++) {
        memcpy(&robot, &good, sizeof robot);
        now_us = good_us;
        drive(flip % steps);
        const size_t at = (size_t)unit_random(&random, 0, (double)bytes);
        ((unsigned char *)member)[at < bytes ? at : 0] ^= (unsigned char)(1u << flip % 8);
        if (flip % 3 == 0) {
            assert_int_equal(bslam_restart(&robot, BSLAM_R(0.1), BSLAM_R(0.1)), BSLAM_OK);
        }
        use_all();
        assert_int_equal(bslam_counters(&robot).guard.corrupt, bslam_counters(&good).guard.corrupt + 1);
    }
    memcpy(&robot, &good, sizeof robot);
    now_us = good_us;
}

static void test_a_flipped_bit_in_what_was_learned_is_no_index(void **state)
{
    begin(BSLAM_ASSOCIATION_SVM, BSLAM_FILTER_INVARIANT);
    drive(30);
    assert_true(bslam_counters(&robot).learner.updates > 0);
    bslam_appearance_t *appearance = &inside()->appearance;
    flip_in(appearance->of, sizeof appearance->of, 3, 1);
    flip_in(appearance->learner.classifiers, BEACONS * sizeof appearance->learner.classifiers[0], 3, 2);
}

static void test_a_flipped_bit_in_a_training_is_no_index(void **state)
{
    begin(BSLAM_ASSOCIATION_SVM, BSLAM_FILTER_INVARIANT);
    drive(30);
    bslam_learner_t *learner = &inside()->appearance.learner;
    flip_in(&learner->training, sizeof learner->training, 12, 3);
    flip_in(&learner->seeds, offsetof(bslam_learner_t, classifiers) - offsetof(bslam_learner_t, seeds), 3, 4);
}

static void test_a_flipped_bit_in_the_recovery_is_no_index(void **state)
{
    begin(BSLAM_ASSOCIATION_KNOWN, BSLAM_FILTER_INVARIANT);
    drive(30);
    flip_in(&inside()->recovery, sizeof(bslam_recovery_t), 3, 5);
}

static void test_a_flipped_bit_in_the_smoother_is_no_index(void **state)
{
    begin(BSLAM_ASSOCIATION_KNOWN, BSLAM_FILTER_SMOOTHER);
    drive(120);
    bslam_smoother_t *smoother = &inside()->smoother;
    assert_true(smoother->cycles > 0);
    flip_in(&smoother->first_node, offsetof(bslam_smoother_t, marks) - offsetof(bslam_smoother_t, first_node),
            9, 6);
    flip_in(smoother->nodes, 40 * sizeof smoother->nodes[0], 9, 7);
    flip_in(smoother->seen, 100 * sizeof smoother->seen[0], 9, 8);
    flip_in(smoother->lines, BEACONS * sizeof smoother->lines[0], 9, 9);
    flip_in(&smoother->base.dim, sizeof smoother->base - offsetof(bslam_ekf_t, dim), 9, 10);
    flip_in(&smoother->run.dim, sizeof smoother->run - offsetof(bslam_ekf_t, dim), 9, 11);
    flip_in(smoother, sizeof *smoother, 9, 12);
}

static void test_a_flipped_bit_in_the_doubts_is_no_index(void **state)
{
    begin(BSLAM_ASSOCIATION_SVM, BSLAM_FILTER_INVARIANT);
    drive(30);
    bslam_doubts_t *doubts = &inside()->doubts;
    flip_in(&doubts->count, sizeof doubts->count, 3, 13);
}

static void test_a_flag_of_the_guard_that_flips_does_not_switch_it_off(void **state)
{
    int bad;
    begin(BSLAM_ASSOCIATION_KNOWN, BSLAM_FILTER_INVARIANT);
    drive(5);
    inside()->slam.settings.guard = 0;
    assert_int_equal(bslam_sightings(&robot, now_us + 1, NULL, 0), BSLAM_E_STATE);
    assert_int_equal(bslam_init(&robot, &settings, &bad), BSLAM_OK);
    inside()->guard.seal ^= 1;
    assert_int_equal(bslam_sightings(&robot, 0, NULL, 0), BSLAM_E_STATE);
}

static void test_no_damaged_map_is_saved(void **state)
{
    static const bslam_flash_t no_flash;
    bslam_map_fault_t fault;
    uint32_t size;
    begin(BSLAM_ASSOCIATION_KNOWN, BSLAM_FILTER_INVARIANT);
    drive(30);
    inside()->slam.ekf.mean[6] += 1;
    assert_int_equal(bslam_save_map(&robot, NULL, &size), BSLAM_E_STATE);
    assert_int_equal(bslam_save_to_flash(&robot, &no_flash, &fault), BSLAM_E_STATE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_flipped_bit_in_what_was_learned_is_no_index),
        cmocka_unit_test(test_a_flipped_bit_in_a_training_is_no_index),
        cmocka_unit_test(test_a_flipped_bit_in_the_recovery_is_no_index),
        cmocka_unit_test(test_a_flipped_bit_in_the_smoother_is_no_index),
        cmocka_unit_test(test_a_flag_of_the_guard_that_flips_does_not_switch_it_off),
        cmocka_unit_test(test_no_damaged_map_is_saved),
        cmocka_unit_test(test_a_flipped_bit_in_the_doubts_is_no_index),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
