// The pipeline with appearance attached: what it refuses, learns and takes out.
#include "support.h"

#include <math.h>

#include "bslam/slam/slam.h"
#include "plain_settings.h"

enum { STEP_US = 40000 };

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
    settings.learn_travel_m = 0;
    settings.learn_budget = 2000;
    settings.doubt_sightings = 5;
    settings.duplicate_m = 1;
    settings.duplicate_sd_m = BSLAM_R(0.2);
    settings.duplicate_d2 = 9;
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

static void test_other_methods_leave_appearance_alone(void **state)
{
    bslam_settings_t settings = svm_params();
    settings.association = BSLAM_ASSOCIATION_MAHALANOBIS;
    start(settings);
    see_two(10);
    assert_int_equal(appearance.counters.trained + appearance.counters.unsure, 0);
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

/// Object 2 where beacon 0 is, as well as its distance tells, until so many are retired.
static void see_another_in_its_place(uint32_t retired)
{
    for (int view = 0; appearance.counters.retired < retired && view < 200; view++) {
        see_object(2, view, 0.1);
    }
    assert_int_equal(appearance.counters.retired, retired);
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
    see_two(20);
    drive_on(slam.settings.decision_delay_us);
    see_another_in_its_place(1);
    assert_int_equal(slam.ekf.beacon_count, 2);
    assert_int_equal(appearance.of[0].ousted, 1);
}

static void test_what_keeps_being_replaced_is_gone_itself(void **state)
{
    see_two(20);
    const uint32_t first_uid = slam.ekf.beacons[0].uid;
    drive_on(slam.settings.decision_delay_us);
    see_another_in_its_place(3);
    assert_false(is_in_map(first_uid));
}

/// What begins beside a beacon that is seen all the while has not replaced it.
static void test_what_is_seen_between_is_not_gone(void **state)
{
    see_two(20);
    const uint32_t first_uid = slam.ekf.beacons[0].uid;
    for (uint32_t retired = 1; retired <= 4; retired++) {
        see_another_in_its_place(retired);
        see_object(0, 100 + (int)retired, 0);
    }
    assert_true(is_in_map(first_uid));
    assert_int_equal(appearance.of[0].ousted, 0);
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
    assert_int_equal(appearance.counters.retired, 0);
}

static void see_away(int object, int view, double bearing_rad, double range_m)
{
    float signature[BSLAM_SAMPLE_FEATURES];
    bslam_sighting_t seen = unit_polar(bearing_rad, range_m, -1);
    seen.signature = signature_of(object, view, signature);
    see(&seen, 1);
}

/// A thing measured at 4 m so many times, then, in such a direction, at so many metres until it is a beacon
/// of its own and for ten frames more; how many beacons there are then.
static int beacons_of_two_distances(int times, double bearing_rad, double range_m)
{
    start(svm_params());
    for (int view = 0; view < times; view++) {
        see_away(2, view, 0, 4);
    }
    for (int view = 0; view < 10; view++) {
        see_away(3, view, bearing_rad, range_m);
    }
    return slam.ekf.beacon_count;
}

/// One distance in a thousand is measured much too short, and begins a beacon before the thing itself.
static void test_what_was_seen_a_few_times_in_front_of_another_is_retired(void **state)
{
    assert_int_equal(beacons_of_two_distances(3, 0.01, 7), 1);
    assert_int_equal(appearance.counters.retired, 1);
    assert_int_equal(appearance.of[0].ousted, 0);
    bslam_beacon_view_t left;
    assert_int_equal(bslam_slam_beacon(&slam, 0, &left), BSLAM_OK);
    assert_near(left.x_m, 7, 0.5);
}

static void test_what_is_distant_or_was_seen_often_is_not_retired(void **state)
{
    assert_int_equal(beacons_of_two_distances(3, 0.2, 7), 2);  // beside it
    assert_int_equal(beacons_of_two_distances(3, 0, 8.5), 2);  // more than twice as far
    assert_int_equal(beacons_of_two_distances(5, 0, 7), 2);    // as often as doubt_sightings
    assert_int_equal(appearance.counters.retired, 0);
}

/// Two directions alone have begun a beacon each, and one of the two is all that is seen from then on.
static void test_a_ray_in_the_direction_of_another_is_retired(void **state)
{
    bslam_settings_t settings = svm_params();
    settings.again_odds = 0;
    start(settings);
    float signatures[2][BSLAM_SAMPLE_FEATURES];
    bslam_sighting_t seen[] = {unit_polar(0.5, 4, -1), unit_polar(0.55, 4, -1)};
    for (int k = 0; k < 2; k++) {
        seen[k].has_range = false;
        seen[k].signature = signature_of(2 + k, 0, signatures[k]);
    }
    see(seen, 2);
    assert_int_equal(slam.ekf.beacon_count, 2);
    assert_int_equal(slam.ekf.beacons[0].kind, BSLAM_BEACON_RAY);
    const uint32_t seen_uid = slam.ekf.beacons[1].uid;
    for (int view = 0; view < slam.settings.doubt_sightings; view++) {
        assert_int_equal(appearance.counters.retired, 0);
        see_away(3, view, 0.55, 4);
    }
    assert_int_equal(appearance.counters.retired, 1);
    assert_int_equal(slam.ekf.beacon_count, 1);
    assert_int_equal(slam.ekf.beacons[0].uid, seen_uid);
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
    assert_int_equal(appearance.counters.retired, 0);
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
    while (appearance.counters.retired == 0 && view < 1000) {
        assert_true(view < 10 || slam.ekf.beacon_count == 2);
        see_as(2, view, view < 10 ? 0.1 : 0.02, 6);
        view++;
    }
    assert_true(view > 10);
    assert_int_equal(appearance.counters.retired, 1);
    assert_int_equal(slam.ekf.beacon_count, 1);
}

/// Object 1, where beacon 0 of object 0 has not been seen for long, in this many frames; how many were kept
/// from that beacon.
static uint32_t waits_of_another(int frames)
{
    const uint32_t before = slam.counters.deferred;
    for (int view = 0; view < frames; view++) {
        see_object(1, view, 0);
    }
    return slam.counters.deferred - before;
}

/// Two beacons are known and out of view for long, their classifiers of few samples. However well a place
/// fits, it does not settle which of them is seen.
static void start_to_wait(void)
{
    bslam_settings_t settings = svm_params();
    settings.appearance_samples = 10;
    settings.decision_delay_us = 1000000;
    start(settings);
    see_two(6);
    slam.settings.learn_lead = 100;
    for (int i = 0; i < 50; i++) {
        see(NULL, 0);
    }
}

static void test_a_match_that_a_young_classifier_is_against_is_delayed_for_a_second(void **state)
{
    start_to_wait();
    const uint32_t matched = slam.counters.matched;
    assert_int_equal(waits_of_another(40), 1000000 / STEP_US);
    assert_int_equal(slam.counters.matched - matched, 40 - 1000000 / STEP_US);
}

static void test_in_a_frozen_map_it_is_delayed_no_longer(void **state)
{
    start_to_wait();
    slam.is_frozen = true;
    assert_int_equal(waits_of_another(40), 1000000 / STEP_US);
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
    settings.existence_beacons = 0;
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
    settings.decision_delay_score = 0;
    start(settings);
    see_two(40);
    const double off_rad = 0.085;
    see_object(0, 50, off_rad);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_REJECTED);
    assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_GATE);
    const double distance2 = 9 * (double)slam.accounts[0].test_ratio;
    assert_true(distance2 > 12 && distance2 < 25);
    drive_on(settings.decision_delay_us - 2 * STEP_US);
    see_object(0, 51, off_rad);
    assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_GATE);
    see_object(0, 52, off_rad);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_MATCHED);
    assert_true(slam.accounts[0].test_ratio < 1);
    slam.bearing_noise = (bslam_autocorrelation_t){0, 0};  // which these few have widened
    see_object(1, 53, 1 - off_rad);                        // and is closed again
    assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_GATE);
}

/// Two beacons that were seen with distances, out of view for so long, and a heading of so much doubt: what
/// becomes of the first as it is seen then.
static bslam_account_t see_after(int64_t us, double heading_var_rad2, bool has_range,
                                 double decision_delay_score)
{
    bslam_settings_t settings = svm_params();
    settings.decision_delay_score = real(decision_delay_score);
    start(settings);
    see_two(20);
    drive_on(us);
    const bslam_pose_t pose = bslam_ekf_pose(&slam.ekf);
    bslam_ekf_set_pose(&slam.ekf, &pose, BSLAM_R(1e-4), real(heading_var_rad2));
    float signature[BSLAM_SAMPLE_FEATURES];
    bslam_sighting_t seen = unit_polar(0.02, 4, -1);
    seen.has_range = has_range;
    seen.signature = signature_of(0, 60, signature);
    see(&seen, 1);
    return slam.accounts[0];
}

/// A direction alone turns the robot to whatever it is taken for.
static void test_where_the_heading_is_in_doubt_a_bearing_alone_is_deferred(void **state)
{
    const int64_t long_us = svm_params().decision_delay_us;
    const double score = (double)svm_params().decision_delay_score;
    const bslam_account_t account = see_after(long_us, 0.011, false, score);
    assert_int_equal(account.outcome, BSLAM_OUTCOME_DEFERRED);
    assert_int_equal(account.reason, BSLAM_REASON_AMBIGUOUS);
    assert_int_equal(see_after(long_us, 0.011, true, score).outcome, BSLAM_OUTCOME_MATCHED);
    assert_int_equal(see_after(long_us, 0.009, false, score).outcome, BSLAM_OUTCOME_MATCHED);
    assert_int_equal(see_after(long_us - STEP_US, 0.011, false, score).outcome, BSLAM_OUTCOME_MATCHED);
}

/// And where it is nearly as well another beacon, or a new one, however sure the heading is.
static void test_where_little_speaks_for_its_beacon_a_bearing_alone_is_deferred(void **state)
{
    const int64_t long_us = svm_params().decision_delay_us;
    assert_int_equal(see_after(long_us, 0.009, false, 0).outcome, BSLAM_OUTCOME_MATCHED);
    const double lead = (double)slam.records[0].match.lead;
    assert_true(lead > 0);
    assert_int_equal(see_after(long_us, 0.009, false, lead - 0.01).outcome, BSLAM_OUTCOME_MATCHED);
    const bslam_account_t account = see_after(long_us, 0.009, false, lead + 0.01);
    assert_int_equal(account.outcome, BSLAM_OUTCOME_DEFERRED);
    assert_int_equal(account.reason, BSLAM_REASON_AMBIGUOUS);
    assert_int_equal(see_after(long_us, 0.009, true, lead + 0.01).outcome, BSLAM_OUTCOME_MATCHED);
}

/// What has just begun is itself; what comes into view again is what its match says.
static void test_how_well_a_match_fits_is_kept_while_its_beacon_is_in_view(void **state)
{
    const bslam_settings_t settings = svm_params();
    see_two(6);
    assert_true(appearance.of[0].view_score >= settings.again_odds);
    see_object(0, 6, 0.06);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_MATCHED);
    assert_true(appearance.of[0].view_score >= settings.again_odds);
    drive_on(settings.decision_delay_us);
    see_object(0, 7, 0.06);
    const bslam_real_t anew = slam.records[0].match.score;
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_MATCHED);
    assert_near(appearance.of[0].view_score, anew, 1e-6);
    see_object(0, 8, 0.3);
    assert_int_equal(slam.accounts[0].has_beacon, false);
    assert_near(appearance.of[0].view_score, anew, 1e-6);  // it was not this one's
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_how_well_a_match_fits_is_kept_while_its_beacon_is_in_view, setup),
        cmocka_unit_test_setup(test_the_gate_opens_where_nothing_was_where_it_should_be_for_a_while, setup),
        cmocka_unit_test_setup(test_where_the_heading_is_in_doubt_a_bearing_alone_is_deferred, setup),
        cmocka_unit_test_setup(test_where_little_speaks_for_its_beacon_a_bearing_alone_is_deferred, setup),
        cmocka_unit_test_setup(test_a_signature_that_is_not_finite_is_refused_and_changes_nothing, setup),
        cmocka_unit_test_setup(test_a_signature_of_large_and_small_numbers_is_taken, setup),
        cmocka_unit_test_setup(test_what_is_surely_matched_is_learned, setup),
        cmocka_unit_test_setup(test_other_methods_leave_appearance_alone, setup),
        cmocka_unit_test_setup(test_without_appearance_position_decides, setup),
        cmocka_unit_test_setup(test_attaching_again_forgets, setup),
        cmocka_unit_test_setup(test_a_beacon_removed_while_its_classifier_trains_is_forgotten, setup),
        cmocka_unit_test_setup(test_a_beacon_in_anothers_place_never_seen_with_it_is_retired, setup),
        cmocka_unit_test_setup(test_what_was_seen_a_few_times_in_front_of_another_is_retired, setup),
        cmocka_unit_test_setup(test_a_ray_in_the_direction_of_another_is_retired, setup),
        cmocka_unit_test_setup(test_what_is_distant_or_was_seen_often_is_not_retired, setup),
        cmocka_unit_test_setup(test_what_keeps_being_replaced_is_gone_itself, setup),
        cmocka_unit_test_setup(test_what_is_seen_between_is_not_gone, setup),
        cmocka_unit_test_setup(test_a_neighbour_seen_with_the_other_stays, setup),
        cmocka_unit_test_setup(test_a_neighbour_of_another_class_stays_if_never_seen_with_it, setup),
        cmocka_unit_test_setup(test_what_is_called_of_two_classes_in_one_place_is_one, setup),
        cmocka_unit_test_setup(test_a_match_that_a_young_classifier_is_against_is_delayed_for_a_second,
                               setup),
        cmocka_unit_test_setup(test_in_a_frozen_map_it_is_delayed_no_longer, setup),
        cmocka_unit_test_setup(test_what_is_missed_is_noticed_while_another_is_tentative, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
