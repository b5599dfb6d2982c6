// The pipeline with appearance attached: what it refuses, learns and takes out.
#include "known_map.h"
#include "support.h"

#include <math.h>

#include "bslam/internal.h"
#include "bslam/slam/slam_internal.h"
#include "plain_settings.h"

/// OFTEN: more often than what is taken for a duplicate of it is seen.
enum { STEP_US = 40000, OFTEN = 40 };

static bslam_slam_t slam;
static bslam_appearance_t appearance;
static int64_t now_us;

static void start(bslam_settings_t settings)
{
    int bad_id;
    memset(&slam, 0, sizeof slam);
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    assert_int_equal(bslam_appearance_init(&appearance, NULL, 0), BSLAM_OK);
    bslam_slam_attach_appearance(&slam, &appearance);
    now_us = 0;
}

static bslam_settings_t svm_params(void)
{
    bslam_settings_t settings = unit_settings();
    settings.association = BSLAM_ASSOCIATION_SVM;
    settings.left_speed_sd_mps = BSLAM_R(1e-3);
    settings.right_speed_sd_mps = BSLAM_R(1e-3);
    settings.learn_budget = 2000;
    settings.duplicate_sd_m = BSLAM_R(0.2);
    return settings;
}

static int setup(void **state)
{
    start(svm_params());
    return 0;
}

/// An object's signature, a little different each time.
static const float *signature_of(int object, int view, float *signature)
{
    unit_random_t random = {(uint64_t)(1 + 997 * object + 31 * view)};
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        signature[k] = (float)unit_random(&random, 0, 0.1);
    }
    signature[3 * object] += 0.7f;
    signature[3 * object + 1] += 0.6f;
    return signature;
}

static void see(const bslam_sighting_t *sightings, int count)
{
    const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us + STEP_US};
    now_us += STEP_US;
    assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
    slam.travelled_um += 100000;  // as far as a classifier wants to learn again
    assert_int_equal(bslam_slam_sightings(&slam, now_us, sightings, count), BSLAM_OK);
}

static void drive_on(int64_t us)
{
    for (const int64_t end_us = now_us + us; now_us < end_us; now_us += STEP_US) {
        const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us + STEP_US};
        assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
    }
}

/// Two beacons 4 m away, of objects 0 and 1, for so many frames.
static void see_two(int frames)
{
    for (int view = 0; view < frames; view++) {
        float a[BSLAM_SAMPLE_FEATURES];
        float b[BSLAM_SAMPLE_FEATURES];
        bslam_sighting_t seen[] = {unit_polar(0, 4, -1), unit_polar(1, 4, -1)};
        seen[0].signature = signature_of(0, view, a);
        seen[1].signature = signature_of(1, view, b);
        see(seen, 2);
    }
}

static void see_as(int object, int view, double bearing_rad, uint8_t beacon_class)
{
    float signature[BSLAM_SAMPLE_FEATURES];
    bslam_sighting_t seen = unit_polar(bearing_rad, 4, -1);
    seen.signature = signature_of(object, view, signature);
    seen.beacon_class = beacon_class;
    see(&seen, 1);
}

static void see_object(int object, int view, double bearing_rad)
{
    see_as(object, view, bearing_rad, BSLAM_CLASS_NONE);
}

static void test_a_signature_that_is_not_finite_is_refused_and_changes_nothing(void **state)
{
    see_two(6);
    static const float bad[] = {NAN, INFINITY, -INFINITY, 2e12f};
    for (int k = 0; k < COUNT_OF(bad); k++) {
        float a[BSLAM_SAMPLE_FEATURES];
        float b[BSLAM_SAMPLE_FEATURES];
        bslam_sighting_t seen[] = {unit_polar(0, 4, -1), unit_polar(1, 4, -1)};
        seen[0].signature = signature_of(0, 99, a);
        seen[1].signature = signature_of(1, 99, b);
        b[(k * 23) % BSLAM_SAMPLE_FEATURES] = bad[k];
        static bslam_slam_t before;
        static bslam_appearance_t looks_before;
        memcpy(&before, &slam, sizeof slam);
        memcpy(&looks_before, &appearance, sizeof appearance);
        assert_int_equal(bslam_slam_sightings(&slam, now_us + STEP_US, seen, 2), BSLAM_E_NOT_FINITE);
        assert_int_equal(slam.bad_sighting, 1);
        before.bad_sighting = 1;
        before.counters.frames_refused++;
        assert_memory_equal(&slam, &before, sizeof slam);
        assert_memory_equal(&appearance, &looks_before, sizeof appearance);
    }
}

/// Numbers whose bits together look like those of an infinity are numbers all the same.
static void test_a_signature_of_large_and_small_numbers_is_taken(void **state)
{
    float signature[BSLAM_SAMPLE_FEATURES] = {1.5f, 2.0f};
    bslam_sighting_t seen = unit_polar(0, 4, -1);
    seen.signature = signature;
    see_two(1);
    see(&seen, 1);
    assert_int_equal(slam.counters.frames_refused, 0);
}

static void test_what_is_surely_matched_is_learned(void **state)
{
    see_two(10);
    assert_int_equal(slam.ekf.beacon_count, 2);
    assert_int_equal(slam.counters.matched, 18);
    assert_true(appearance.counters.trained > 10);
    assert_true(bslam_learner_knows(&appearance.learner, appearance.of[0].classifier));
}

static void test_only_methods_that_weigh_looks_learn_them(void **state)
{
    static bslam_t robot;
    for (int32_t association = 0; association <= BSLAM_ASSOCIATION_BOTH; association++) {
        bslam_settings_t settings = svm_params();
        int bad_id;
        settings.association = association;
        assert_int_equal(bslam_init(&robot, &settings, &bad_id), BSLAM_OK);
        const bool weighs = association == BSLAM_ASSOCIATION_SVM || association > BSLAM_ASSOCIATION_POSITION;
        assert_int_equal(bslam_slam_learns(&bslam_instance(&robot)->slam), weighs);
    }
}

static void test_without_appearance_position_decides(void **state)
{
    bslam_slam_attach_appearance(&slam, NULL);
    see_two(10);
    assert_int_equal(slam.ekf.beacon_count, 2);
    assert_int_equal(slam.counters.matched, 18);
}

static void test_attaching_again_forgets(void **state)
{
    see_two(10);
    bslam_slam_attach_appearance(&slam, &appearance);
    assert_int_equal(appearance.of[0].classifier, BSLAM_NO_CLASSIFIER);
    see_two(10);
    assert_true(appearance.of[0].classifier >= 0);
}

static void test_a_beacon_removed_while_its_classifier_trains_is_forgotten(void **state)
{
    slam.settings.learn_budget = 3;  // training is always under way
    see_two(8);
    bslam_beacon_view_t view;
    assert_int_equal(bslam_slam_beacon(&slam, 0, &view), BSLAM_OK);
    const int16_t other = appearance.of[1].classifier;
    assert_int_equal(bslam_slam_remove_beacon(&slam, view.uid), BSLAM_OK);
    assert_int_equal(appearance.of[0].classifier, other);
    assert_int_equal(appearance.of[1].classifier, BSLAM_NO_CLASSIFIER);
    see_two(8);
    assert_int_equal(slam.ekf.beacon_count, 2);
    assert_int_equal(bslam_slam_remove_beacon(&slam, view.uid), BSLAM_E_NO_BEACON);
}

/// An object with a distance of 4 m, and object 1 where it is: the wheels have not slipped.
static void see_beside_1(int object, int view, double bearing_rad)
{
    float a[BSLAM_SAMPLE_FEATURES];
    float b[BSLAM_SAMPLE_FEATURES];
    bslam_sighting_t seen[] = {unit_polar(bearing_rad, 4, -1), unit_polar(1, 4, -1)};
    seen[0].signature = signature_of(object, view, a);
    seen[1].signature = signature_of(1, OFTEN + view, b);
    see(seen, 2);
}

/// Object 2 where beacon 0 is, as well as its distance tells, until so many are retired.
static void see_another_in_its_place(uint32_t retired)
{
    for (int view = 0; slam.counters.retired < retired && view < 200; view++) {
        see_beside_1(2, view, 0.1);
    }
    assert_int_equal(slam.counters.retired, retired);
}

static bool is_in_map(uint32_t uid)
{
    for (int b = 0; b < slam.ekf.beacon_count; b++) {
        bslam_beacon_view_t beacon;
        assert_int_equal(bslam_slam_beacon(&slam, b, &beacon), BSLAM_OK);
        if (beacon.uid == uid) {
            return true;
        }
    }
    return false;
}

static void test_a_beacon_in_anothers_place_never_seen_with_it_is_retired(void **state)
{
    see_two(OFTEN);
    drive_on(BSLAM_VIEW_US);
    see_another_in_its_place(1);
    assert_int_equal(slam.ekf.beacon_count, 2);
    assert_int_equal(slam.ekf.beacons[0].ousted, 1);
}

static void test_what_keeps_being_replaced_is_gone_itself(void **state)
{
    see_two(OFTEN);
    const uint32_t first_uid = slam.ekf.beacons[0].uid;
    drive_on(BSLAM_VIEW_US);
    see_another_in_its_place(3);
    assert_false(is_in_map(first_uid));
}

/// What begins beside a beacon that is seen all the while has not replaced it.
static void test_what_is_seen_between_is_not_gone(void **state)
{
    see_two(OFTEN);
    const uint32_t first_uid = slam.ekf.beacons[0].uid;
    drive_on(BSLAM_VIEW_US);
    for (int view = 0; slam.counters.retired < 4 && view < 400; view++) {
        const bool is_first = view % 10 == 9;
        see_beside_1(is_first ? 0 : 2, view, is_first ? 0 : 0.1);
    }
    assert_int_equal(slam.counters.retired, 4);
    assert_true(is_in_map(first_uid));
    assert_int_equal(slam.ekf.beacons[0].ousted, 0);
}

static void test_a_neighbour_seen_with_the_other_stays(void **state)
{
    see_two(20);
    for (int view = 0; view < 30; view++) {
        float a[BSLAM_SAMPLE_FEATURES];
        float c[BSLAM_SAMPLE_FEATURES];
        bslam_sighting_t seen[] = {unit_polar(0, 4, -1), unit_polar(0.1, 4, -1)};
        seen[0].signature = signature_of(0, 40 + view, a);
        seen[1].signature = signature_of(2, view, c);
        see(seen, 2);
    }
    assert_int_equal(slam.ekf.beacon_count, 3);
    assert_int_equal(slam.counters.retired, 0);
}

/// As in test_a_beacon_in_anothers_place_never_seen_with_it_is_retired, but the detector tells them apart.
static void test_a_neighbour_of_another_class_stays_if_never_seen_with_it(void **state)
{
    for (int view = 0; view < 20; view++) {
        see_as(0, view, 0, 1);
    }
    for (int view = 0; view < 60; view++) {
        see_as(2, view, 0.1, 6);
    }
    assert_int_equal(slam.counters.retired, 0);
    assert_int_equal(slam.ekf.beacon_count, 2);
}

/// What was first seen beside a beacon turns out to be so near to it that no two things hang or stand so: it
/// is one, taken for two classes.
static void test_what_is_called_of_two_classes_in_one_place_is_one(void **state)
{
    for (int view = 0; view < 20; view++) {
        see_as(0, view, 0, 1);
    }
    int view = 0;
    while (slam.counters.retired == 0 && view < 1000) {
        assert_true(view < 10 || slam.ekf.beacon_count == 2);
        see_as(2, view, view < 10 ? 0.1 : 0.02, 6);
        view++;
    }
    assert_true(view > 10);
    assert_int_equal(slam.counters.retired, 1);
    assert_int_equal(slam.ekf.beacon_count, 1);
}

enum { GONE, TO_THE_LEFT, TO_THE_RIGHT, ON_TRIAL, THINGS };

static const double THINGS_M[THINGS][2] = {{2, 2}, {-6, 0.5}, {-6, -0.5}, {2, -3}};

/// The robot goes 4 m, a decimetre a frame, forwards or back on its line, and sees all things but perhaps
/// one.
static void pass_by(double from_m, double step_m, bool sees_the_gone, double trial_score)
{
    for (int k = 1; k <= 40; k++) {
        const bslam_odometry_reading_t went = {.source = BSLAM_ODOMETRY_WHEELS,
                                               .time_us = now_us + STEP_US,
                                               .left_m = real(step_m),
                                               .right_m = real(step_m)};
        now_us += STEP_US;
        assert_int_equal(bslam_slam_odometry(&slam, &went), BSLAM_OK);
        bslam_sighting_t seen[THINGS];
        float signatures[THINGS][BSLAM_SAMPLE_FEATURES];
        int count = 0;
        for (int thing = sees_the_gone ? 0 : 1; thing < THINGS; thing++) {
            const double x_m = THINGS_M[thing][0] - (from_m + step_m * k), y_m = THINGS_M[thing][1];
            seen[count] = unit_polar(atan2(y_m, x_m), hypot(x_m, y_m), -1);
            seen[count].score = real(thing == ON_TRIAL ? trial_score : 0);
            seen[count].signature = signature_of(thing, k, signatures[count]);
            count++;
        }
        assert_int_equal(bslam_slam_sightings(&slam, now_us, seen, count), BSLAM_OK);
    }
}

/// A frame with something tentative in it is as clear as one without.
static void test_what_is_missed_is_noticed_while_another_is_tentative(void **state)
{
    bslam_settings_t settings = svm_params();
    settings.missed_views = 3;
    settings.existence_sum = 1000;
    start(settings);
    pass_by(0, 0.1, true, 1.0);
    pass_by(4, -0.1, true, 1.0);
    assert_int_equal(slam.ekf.beacon_count, THINGS);
    assert_int_equal(appearance.counters.missed, 0);
    const uint32_t deferred = slam.counters.deferred;
    pass_by(0, 0.1, false, 1.0);
    assert_int_equal(slam.counters.deferred - deferred, 40);
    assert_int_equal(appearance.counters.missed, 1);
    assert_int_equal(slam.ekf.beacon_count, THINGS - 1);
}

/// A robot that has turned unseen finds nothing where it should be: its gate must not keep it from all that
/// it knows.
static void test_the_gate_opens_where_nothing_was_where_it_should_be_for_a_while(void **state)
{
    bslam_settings_t settings = svm_params();
    settings.gate_d2 = 9;
    start(settings);
    see_two(40);
    const double off_rad = 0.085;
    see_object(0, 50, off_rad);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_REJECTED);
    assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_GATE);
    const double distance2 = 9 * (double)slam.accounts[0].test_ratio;
    assert_true(distance2 > 12 && distance2 < 25);
    drive_on(BSLAM_VIEW_US - 2 * STEP_US);
    see_object(0, 51, off_rad);
    assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_GATE);
    see_object(0, 52, off_rad);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_MATCHED);
    assert_true(slam.accounts[0].test_ratio < 1);
    slam.bearing_noise = (bslam_autocorrelation_t){0, 0};  // which these few have widened
    see_object(1, 53, 1 - off_rad);                        // and is closed again
    assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_GATE);
}

/// It is taken for the beacon that it resembles, as if the wheels had slipped; the filter knows of no slip.
static void test_what_a_slip_would_explain_is_neither_used_nor_new(void **state)
{
    bslam_settings_t settings = svm_params();
    settings.gate_d2 = 9;
    start(settings);
    see_two(40);
    see_object(0, 50, 0.4);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_REJECTED);
    assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_GATE);
    assert_int_equal(slam.accounts[0].beacon_uid, slam.ekf.beacons[0].uid);
    assert_int_equal(slam.ekf.beacon_count, 2);
}

/// The mean of what the first five frames of a view say; what was out of view is looked at anew.
static void test_appearance_of_a_view_is_the_mean_of_its_first_frames(void **state)
{
    enum { COUNTED = 5 };
    slam.settings.learn_budget = 0;
    see_two(10);
    unit_give_machine(&appearance, 0, 1, 3);
    for (int view = 0; view < 2; view++) {
        double sum = 0;
        drive_on(BSLAM_VIEW_US);
        for (int k = 0; k < 8; k++) {
            const float features[BSLAM_SAMPLE_FEATURES] = {k < COUNTED ? 0.1f * (float)(k % 3 - view) : 0.9f};
            bslam_sighting_t seen = unit_polar(0, 4, -1);
            seen.signature = features;
            see(&seen, 1);
            const int counted = k < COUNTED ? k + 1 : COUNTED;
            sum += k < COUNTED ? (double)slam.records[0].match.looks : 0;
            assert_near(appearance.of[0].view_looks, sum / counted, 1e-5);
            assert_int_equal(appearance.of[0].view_frames, counted);
        }
        assert_true((double)slam.records[0].match.looks > sum / COUNTED + 1);
    }
}

/// What does not pass the gate is looked at as well, in its place or after a slip.
static void test_a_view_counts_frames_that_are_not_used(void **state)
{
    static const double off_rad[] = {0, 0.085, 0.4, 0.4, 0, 0.4};
    bslam_settings_t settings = svm_params();
    settings.gate_d2 = 9;
    settings.learn_budget = 0;
    start(settings);
    see_two(40);
    unit_give_machine(&appearance, 0, 1, 3);
    drive_on(BSLAM_VIEW_US);
    double sum = 0;
    for (int k = 0; k < COUNT_OF(off_rad); k++) {
        const float features[BSLAM_SAMPLE_FEATURES] = {0.8f - 0.1f * (float)(k % 3)};
        const int counted = k < 5 ? k + 1 : 5;
        bslam_sighting_t seen = unit_polar(off_rad[k], 4, -1);
        seen.signature = features;
        see(&seen, 1);
        assert_int_equal(slam.accounts[0].reason, off_rad[k] > 0 ? BSLAM_REASON_GATE : BSLAM_REASON_NONE);
        assert_int_equal(slam.records[0].match.beacon, 0);
        assert_true(slam.records[0].match.slipped == (off_rad[k] > 0.1));
        sum += k < 5 ? (double)slam.records[0].match.looks : 0;
        assert_int_equal(appearance.of[0].view_frames, counted);
        assert_near(appearance.of[0].view_looks, sum / counted, 1e-5);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_the_gate_opens_where_nothing_was_where_it_should_be_for_a_while, setup),
        cmocka_unit_test_setup(test_what_a_slip_would_explain_is_neither_used_nor_new, setup),
        cmocka_unit_test_setup(test_appearance_of_a_view_is_the_mean_of_its_first_frames, setup),
        cmocka_unit_test_setup(test_a_view_counts_frames_that_are_not_used, setup),
        cmocka_unit_test_setup(test_a_signature_that_is_not_finite_is_refused_and_changes_nothing, setup),
        cmocka_unit_test_setup(test_a_signature_of_large_and_small_numbers_is_taken, setup),
        cmocka_unit_test_setup(test_what_is_surely_matched_is_learned, setup),
        cmocka_unit_test_setup(test_only_methods_that_weigh_looks_learn_them, setup),
        cmocka_unit_test_setup(test_without_appearance_position_decides, setup),
        cmocka_unit_test_setup(test_attaching_again_forgets, setup),
        cmocka_unit_test_setup(test_a_beacon_removed_while_its_classifier_trains_is_forgotten, setup),
        cmocka_unit_test_setup(test_a_beacon_in_anothers_place_never_seen_with_it_is_retired, setup),
        cmocka_unit_test_setup(test_what_keeps_being_replaced_is_gone_itself, setup),
        cmocka_unit_test_setup(test_what_is_seen_between_is_not_gone, setup),
        cmocka_unit_test_setup(test_a_neighbour_seen_with_the_other_stays, setup),
        cmocka_unit_test_setup(test_a_neighbour_of_another_class_stays_if_never_seen_with_it, setup),
        cmocka_unit_test_setup(test_what_is_called_of_two_classes_in_one_place_is_one, setup),
        cmocka_unit_test_setup(test_what_is_missed_is_noticed_while_another_is_tentative, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
