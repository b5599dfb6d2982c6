// Whether what is seen is a beacon, by the scores of a detector.
#include "support.h"

#include <math.h>

#include "bslam/slam/slam.h"
#include "plain_settings.h"

enum { LASTING_US = 1000000, STEP_US = LASTING_US / 2 };  // three sightings last for long enough

static bslam_slam_t slam;
static int64_t now_us;

static void start(int32_t association)
{
    bslam_settings_t settings = unit_settings();
    settings.association = association;
    settings.existence_score = BSLAM_R(0.5);
    settings.existence_sum = 4;
    settings.confirm_sightings = 3;
    settings.confirm_window_us = 0;
    // A heading stays known over a step well enough for a match.
    settings.left_speed_sd_mps = BSLAM_R(0.18);
    settings.right_speed_sd_mps = BSLAM_R(0.12);
    int bad_id;
    memset(&slam, 0, sizeof slam);
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    now_us = 0;
}

static int setup(void **state)
{
    start(BSLAM_ASSOCIATION_SVM);
    return 0;
}

/// The robot stands, and sees one thing with this score, so long after the frame before; what became of it.
static bslam_account_t see_after(int64_t us, double bearing_rad, double score)
{
    now_us += us;
    const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us};
    bslam_sighting_t seen =
        unit_polar(bearing_rad, 4, slam.settings.association == BSLAM_ASSOCIATION_KNOWN ? 1 : -1);
    seen.score = real(score);
    assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
    assert_int_equal(bslam_slam_sightings(&slam, now_us, &seen, 1), BSLAM_OK);
    return slam.accounts[0];
}

static bslam_account_t see_at(double bearing_rad, double score)
{
    return see_after(STEP_US, bearing_rad, score);
}

/// Where the next frame would leave the filter if it showed nothing.
static void look_at_nothing(bslam_ekf_t *left)
{
    static bslam_slam_t now;
    now = slam;
    const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us + STEP_US};
    assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
    assert_int_equal(bslam_slam_sightings(&slam, now_us + STEP_US, NULL, 0), BSLAM_OK);
    *left = slam.ekf;
    slam = now;
}

static bslam_account_t see(double score)
{
    return see_at(0.2, score);
}

static bool is_confirmed(int index)
{
    bslam_beacon_view_t view;
    assert_int_equal(bslam_slam_beacon(&slam, index, &view), BSLAM_OK);
    return view.confirmed;
}

/// Each speaks for it by 1: with four it is believed.
static void test_until_a_beacon_is_believed_its_sightings_move_nothing(void **state)
{
    assert_int_equal(see(1.5).outcome, BSLAM_OUTCOME_NEW);
    const uint32_t uid = slam.accounts[0].beacon_uid;
    static bslam_ekf_t unmoved;
    for (int i = 0; i < 3; i++) {
        look_at_nothing(&unmoved);
        // Off to the side: it would move if it was used.
        const bslam_account_t account = see_at(0.21, 1.5);
        assert_int_equal(account.outcome, BSLAM_OUTCOME_DEFERRED);
        assert_int_equal(account.reason, BSLAM_REASON_TENTATIVE);
        assert_true(account.has_beacon);
        assert_int_equal(account.beacon_uid, uid);
        assert_memory_equal(slam.ekf.mean, unmoved.mean, sizeof unmoved.mean);
        assert_memory_equal(&slam.ekf.factor, &unmoved.factor, sizeof unmoved.factor);
        assert_int_equal(is_confirmed(0), i == 2);
    }
    assert_int_equal(slam.counters.deferred, 3);
    assert_int_equal(see_at(0.21, 1.5).outcome, BSLAM_OUTCOME_MATCHED);
    assert_memory_not_equal(slam.ekf.mean, unmoved.mean, sizeof unmoved.mean);
}

/// Up to 1.5 above the score of what may be either, as it is; beyond that as much as a few.
static void test_one_sighting_says_so_much_at_most(void **state)
{
    (void)see(2);
    assert_near(slam.ekf.beacons[0].score_sum, 1.5, 1e-6);
    (void)see(2.001);
    assert_near(slam.ekf.beacons[0].score_sum, 5.5, 1e-6);
    (void)see(1000);
    assert_near(slam.ekf.beacons[0].score_sum, 9.5, 1e-6);
    (void)see(-1000);
    assert_near(slam.ekf.beacons[0].score_sum, 8.5, 1e-6);
}

/// It has to be seen from places as any other.
static void test_one_sure_sighting_is_believed_but_does_not_confirm(void **state)
{
    assert_int_equal(see(3).outcome, BSLAM_OUTCOME_NEW);
    assert_int_equal(see(1).outcome, BSLAM_OUTCOME_MATCHED);
    assert_false(is_confirmed(0));
    assert_int_equal(see(1).outcome, BSLAM_OUTCOME_MATCHED);
    assert_true(is_confirmed(0));
}

static void test_what_more_speaks_against_than_for_leaves(void **state)
{
    (void)see(1.0);  // 0.5
    (void)see(0.1);  // 0.1
    assert_int_equal(slam.ekf.beacon_count, 1);
    (void)see(0.1);
    assert_int_equal(slam.ekf.beacon_count, 0);
    assert_int_equal(slam.counters.removed, 1);
}

static void test_a_confirmed_beacon_stays_whatever_it_scores(void **state)
{
    for (int i = 0; i < 8; i++) {
        (void)see(2);
    }
    for (int i = 0; i < 40; i++) {
        assert_int_equal(see(-100).outcome, BSLAM_OUTCOME_MATCHED);
    }
    assert_int_equal(slam.ekf.beacon_count, 1);
}

static void test_without_scores_a_beacon_is_believed_at_once(void **state)
{
    assert_int_equal(see(0).outcome, BSLAM_OUTCOME_NEW);
    assert_int_equal(see(0).outcome, BSLAM_OUTCOME_MATCHED);
    assert_false(is_confirmed(0));
    assert_int_equal(see(0).outcome, BSLAM_OUTCOME_MATCHED);
    assert_true(is_confirmed(0));
}

static void test_a_score_that_speaks_against_it_starts_no_beacon(void **state)
{
    const bslam_account_t account = see(0.4);
    assert_int_equal(account.outcome, BSLAM_OUTCOME_DEFERRED);
    assert_int_equal(account.reason, BSLAM_REASON_TENTATIVE);
    assert_false(account.has_beacon);
    assert_int_equal(slam.ekf.beacon_count, 0);
    assert_int_equal(slam.counters.added, 0);
}

/// Whether there are scores is asked of the beacon.
static void test_a_sighting_without_a_score_leaves_a_beacon_tentative(void **state)
{
    (void)see(1.5);
    for (int i = 0; i < 5; i++) {
        assert_int_equal(see(0).reason, BSLAM_REASON_TENTATIVE);
    }
    assert_false(is_confirmed(0));
}

static void test_a_tentative_beacon_has_no_time_to_be_confirmed_in(void **state)
{
    slam.settings.confirm_window_us = STEP_US;
    (void)see(1.0);
    for (int i = 0; i < 4; i++) {
        assert_int_equal(see(0.6).reason, BSLAM_REASON_TENTATIVE);
    }
    start(BSLAM_ASSOCIATION_SVM);
    slam.settings.confirm_window_us = STEP_US;
    (void)see(0);
    (void)see_at(1.5, 0);
    (void)see_at(1.5, 0);
    assert_int_equal(slam.ekf.beacon_count, 1);
}

static void test_a_sighting_beyond_the_gate_does_not_speak_for_it(void **state)
{
    slam.settings.gate_d2 = BSLAM_R(0.5);
    (void)see(1.5);
    const bslam_account_t account = see_at(0.4, 1.5);
    assert_int_equal(account.outcome, BSLAM_OUTCOME_REJECTED);
    assert_int_equal(account.reason, BSLAM_REASON_GATE);
    assert_true(account.test_ratio > 1);
    assert_near(slam.ekf.beacons[0].score_sum, 1, 1e-6);
}

/// The robot stands, and sees two things, of which one, sighting `surer` of the frame, has the better score.
static void see_both(int surer)
{
    const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us + STEP_US};
    bslam_sighting_t seen[2];
    seen[surer] = unit_polar(0.2, 4, -1);
    seen[surer].score = BSLAM_R(1.5);
    seen[1 - surer] = unit_polar(-0.8, 4, -1);
    seen[1 - surer].score = BSLAM_R(1.25);
    now_us += STEP_US;
    assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
    assert_int_equal(bslam_slam_sightings(&slam, now_us, seen, 2), BSLAM_OK);
}

/// One that becomes confirmed in a frame is not used in it yet, nor does it change what becomes of the other.
static void test_the_order_of_a_frame_does_not_matter(void **state)
{
    for (int surer = 0; surer < 2; surer++) {
        start(BSLAM_ASSOCIATION_SVM);
        for (int i = 0; i < 3; i++) {
            see_both(surer);
        }
        assert_false(is_confirmed(surer));
        see_both(surer);
        assert_true(is_confirmed(surer));
        assert_false(is_confirmed(1 - surer));
        assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_TENTATIVE);
        assert_int_equal(slam.accounts[1].reason, BSLAM_REASON_TENTATIVE);
        see_both(surer);
        assert_int_equal(slam.accounts[surer].outcome, BSLAM_OUTCOME_MATCHED);
        assert_int_equal(slam.accounts[1 - surer].reason, BSLAM_REASON_TENTATIVE);
    }
}

static void test_views_do_not_run_over_while_scores_are_missing(void **state)
{
    (void)see(0.6);
    slam.ekf.beacons[0].views = 3;
    for (int i = 0; i < 3; i++) {
        (void)see(0.5001);
    }
    assert_int_equal(slam.ekf.beacons[0].views, 3);
}

static void test_what_is_seen_surely_from_few_places_is_not_confirmed(void **state)
{
    slam.settings.confirm_sightings = 9;
    for (int i = 0; i < 8; i++) {
        (void)see(3);
        assert_false(is_confirmed(0));
    }
    assert_int_equal(see(3).outcome, BSLAM_OUTCOME_MATCHED);
    assert_true(is_confirmed(0));
}

/// What was not recognised for a moment is no beacon; where one sighting is enough, or identity is told, none
/// is waited for.
static void test_by_likelihood_a_beacon_is_seen_for_a_second(void **state)
{
    slam.settings.confirm_sightings = 2;
    (void)see(0);
    (void)see_after(LASTING_US - 1, 0.2, 0);
    assert_false(is_confirmed(0));
    (void)see_after(1, 0.2, 0);
    assert_true(is_confirmed(0));
    start(BSLAM_ASSOCIATION_SVM);
    slam.settings.confirm_sightings = 1;
    (void)see(0);
    assert_true(is_confirmed(0));
    start(BSLAM_ASSOCIATION_KNOWN);
    slam.settings.confirm_sightings = 2;
    (void)see(0);
    (void)see_after(1, 0.2, 0);
    assert_true(is_confirmed(0));
}

static void see_nothing_after(int64_t us)
{
    now_us += us;
    const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us};
    assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
    assert_int_equal(bslam_slam_sightings(&slam, now_us, NULL, 0), BSLAM_OK);
}

/// Fails unless the beacon is there after so long without a sighting, and no longer a moment later.
static void assert_leaves_after(int64_t us)
{
    see_nothing_after(us);
    assert_int_equal(slam.ekf.beacon_count, 1);
    see_nothing_after(1);
    assert_int_equal(slam.ekf.beacon_count, 0);
    assert_int_equal(slam.counters.removed, 1);
}

/// Seen too rarely it has a window from the first sighting on. Glimpsed, it stays; but it is no accident a
/// while later that confirms it: that begins another window.
static void test_by_likelihood_what_was_glimpsed_has_all_to_prove_anew(void **state)
{
    enum { WINDOW_US = LASTING_US };
    start(BSLAM_ASSOCIATION_SVM);
    slam.settings.confirm_window_us = WINDOW_US;
    (void)see(0);
    (void)see_after(1000, 0.2, 0);
    assert_leaves_after(WINDOW_US - 1000);
    for (int late = 0; late <= 1; late++) {
        start(BSLAM_ASSOCIATION_SVM);
        slam.settings.confirm_window_us = WINDOW_US;
        for (int i = 0; i < 3; i++) {
            (void)see_after(1000, 0.2, 0);
        }
        see_nothing_after(WINDOW_US / 2);
        assert_int_equal(slam.ekf.beacon_count, 1);
        (void)see_after(WINDOW_US - WINDOW_US / 2 + late, 0.2, 0);
        assert_int_equal(is_confirmed(0), late == 0);
        assert_int_equal(slam.ekf.beacons[0].views, late == 0 ? 3 : 1);
        if (late == 1) {
            assert_leaves_after(WINDOW_US);
        }
    }
}

/// The robot stands, and sees one thing in this direction without a distance.
static void see_direction(double score)
{
    const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us + STEP_US};
    bslam_sighting_t seen = unit_polar(0.2, 4, -1);
    seen.has_range = false;
    seen.score = real(score);
    now_us += STEP_US;
    assert_int_equal(bslam_slam_odometry(&slam, &still), BSLAM_OK);
    assert_int_equal(bslam_slam_sightings(&slam, now_us, &seen, 1), BSLAM_OK);
}

static void test_without_the_distance_that_others_have_a_score_says_little_for_it(void **state)
{
    (void)see(1.5);
    for (int i = 0; i < 5; i++) {
        see_direction(3);
        assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_TENTATIVE);
    }
    assert_near(slam.ekf.beacons[0].score_sum, 1.25, 1e-6);
    see_direction(0.25);  // against it, as ever
    assert_near(slam.ekf.beacons[0].score_sum, 1, 1e-6);
}

/// The first frame with a distance says that there are some, whichever of its sightings has it.
static void test_a_distance_later_in_the_frame_counts_as_much(void **state)
{
    bslam_sighting_t seen[] = {unit_polar(0.2, 4, -1), unit_polar(-0.8, 4, -1)};
    seen[0].score = seen[1].score = BSLAM_R(1.5);
    seen[0].has_range = false;
    assert_int_equal(bslam_slam_sightings(&slam, 1, seen, 2), BSLAM_OK);
    assert_near(slam.ekf.beacons[slam.ekf.beacons[0].kind == BSLAM_BEACON_RAY ? 0 : 1].score_sum, 0.05, 1e-6);
}

static void test_a_new_start_knows_of_no_distances(void **state)
{
    const bslam_settings_t settings = slam.settings;
    int bad_id;
    (void)see(1.5);
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    now_us = 0;
    see_direction(1.5);
    assert_near(slam.ekf.beacons[0].score_sum, 1, 1e-6);
}

static void test_where_there_are_no_distances_scores_say_as_much(void **state)
{
    for (int i = 0; i < 4; i++) {
        see_direction(1.5);
    }
    assert_near(slam.ekf.beacons[0].score_sum, 4, 1e-6);
    assert_true(is_confirmed(0));
    see_direction(1000);  // but no more
    assert_near(slam.ekf.beacons[0].score_sum, 5.5, 1e-6);
}

static void test_other_methods_do_not_ask_for_scores(void **state)
{
    static const int32_t methods[] = {BSLAM_ASSOCIATION_KNOWN, BSLAM_ASSOCIATION_NEAREST,
                                      BSLAM_ASSOCIATION_MAHALANOBIS, BSLAM_ASSOCIATION_JOINT};
    for (int i = 0; i < COUNT_OF(methods); i++) {
        start(methods[i]);
        assert_int_equal(see(0.1).outcome, BSLAM_OUTCOME_NEW);
        assert_int_equal(see(0.1).outcome, BSLAM_OUTCOME_MATCHED);
        assert_int_equal(see(0.1).outcome, BSLAM_OUTCOME_MATCHED);
        assert_true(is_confirmed(0));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_until_a_beacon_is_believed_its_sightings_move_nothing, setup),
        cmocka_unit_test_setup(test_one_sighting_says_so_much_at_most, setup),
        cmocka_unit_test_setup(test_one_sure_sighting_is_believed_but_does_not_confirm, setup),
        cmocka_unit_test_setup(test_what_more_speaks_against_than_for_leaves, setup),
        cmocka_unit_test_setup(test_a_confirmed_beacon_stays_whatever_it_scores, setup),
        cmocka_unit_test_setup(test_without_scores_a_beacon_is_believed_at_once, setup),
        cmocka_unit_test_setup(test_what_is_seen_surely_from_few_places_is_not_confirmed, setup),
        cmocka_unit_test_setup(test_a_score_that_speaks_against_it_starts_no_beacon, setup),
        cmocka_unit_test_setup(test_a_sighting_without_a_score_leaves_a_beacon_tentative, setup),
        cmocka_unit_test_setup(test_a_tentative_beacon_has_no_time_to_be_confirmed_in, setup),
        cmocka_unit_test_setup(test_a_sighting_beyond_the_gate_does_not_speak_for_it, setup),
        cmocka_unit_test_setup(test_the_order_of_a_frame_does_not_matter, setup),
        cmocka_unit_test_setup(test_views_do_not_run_over_while_scores_are_missing, setup),
        cmocka_unit_test_setup(test_by_likelihood_a_beacon_is_seen_for_a_second, setup),
        cmocka_unit_test_setup(test_by_likelihood_what_was_glimpsed_has_all_to_prove_anew, setup),
        cmocka_unit_test_setup(test_without_the_distance_that_others_have_a_score_says_little_for_it, setup),
        cmocka_unit_test_setup(test_a_distance_later_in_the_frame_counts_as_much, setup),
        cmocka_unit_test_setup(test_a_new_start_knows_of_no_distances, setup),
        cmocka_unit_test_setup(test_where_there_are_no_distances_scores_say_as_much, setup),
        cmocka_unit_test_setup(test_other_methods_do_not_ask_for_scores, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
