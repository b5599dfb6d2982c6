// It is in doubt which of two beacons is seen: what comes next says who was right.
#include <math.h>

#include "known_map.h"
#include "plain_settings.h"
#include "support.h"

#include "bslam/slam/doubt.h"
#include "bslam/slam/fingerprint.h"
#include "bslam/slam/slam_internal.h"

enum { STEP_US = 40000 };

/// Two beacons, 4 m ahead; a heading that is off by as much makes one the other.
static const double LEFT_RAD = 0.1, RIGHT_RAD = -0.1, RANGE_M = 4.02, DOUBTFUL_RAD = 0.02;
static const double NEARLY_LEFT_RAD = 0.06, BESIDE_RAD = 0.095;
/// The heading if it is the left one that is seen at DOUBTFUL_RAD, or the right one.
static const double IF_LEFT_RAD = 0.08, IF_RIGHT_RAD = -0.12;

static bslam_slam_t slam;
static bslam_doubts_t doubts;
static bslam_appearance_t appearance;
static int64_t now_us;
static bslam_real_t step_m;
static const float *signature;  // of all that is seen

static void start(int32_t association, int32_t hypotheses)
{
    bslam_settings_t settings = unit_settings();
    int bad_id;
    settings.association = association;
    settings.hypotheses = hypotheses;
    settings.doubt_us = 5000000;
    settings.doubt_nats = 6;
    settings.candidate_d2 = 30;
    settings.new_per_m2 = BSLAM_R(0.005);
    settings.left_speed_sd_mps = settings.right_speed_sd_mps = BSLAM_R(1e-3);
    memset(&doubts, 0x55, sizeof doubts);
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    bslam_slam_attach_doubts(&slam, &doubts);
    now_us = 0;
    step_m = 0;
    signature = NULL;
}

static int setup(void **state)
{
    start(BSLAM_ASSOCIATION_POSITION, 2);
    return 0;
}

/// Frames of a robot that goes step_m in each, and what it sees.
static void see(int frames, const double *bearings_rad, int count)
{
    bslam_sighting_t seen[4];
    for (int i = 0; i < count; i++) {
        seen[i] = unit_polar(bearings_rad[i], RANGE_M, -1);
        seen[i].signature = signature;
    }
    for (int k = 0; k < frames; k++) {
        now_us += STEP_US;
        const bslam_odometry_reading_t reading = {
            .source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us, .left_m = step_m, .right_m = step_m};
        assert_int_equal(bslam_slam_odometry(&slam, &reading), BSLAM_OK);
        assert_int_equal(bslam_slam_sightings(&slam, now_us, seen, count), BSLAM_OK);
    }
}

/// Both, as they are seen if this is the heading.
static void see_both_from(double heading_rad, int frames)
{
    const double both[] = {LEFT_RAD - heading_rad, RIGHT_RAD - heading_rad};
    see(frames, both, 2);
}

/// Somebody has turned the robot a little.
static void doubt_heading(void)
{
    const bslam_pose_t origin = {0, 0, 0};
    assert_int_equal(bslam_slam_set_pose(&slam, &origin, BSLAM_R(0.01), BSLAM_R(0.15)), BSLAM_OK);
}

/// Both beacons are known and out of view, and the robot knows where it is.
static void know_places(void)
{
    see_both_from(0, 10);
    assert_int_equal(slam.ekf.beacon_count, 2);
    see(30, NULL, 0);
}

/// Both beacons are known and out of view.
static void know_two(void)
{
    know_places();
    doubt_heading();
}

/// What is seen then may be either, and is the left one rather than the right one.
static int setup_doubt(void **state)
{
    setup(state);
    know_two();
    see(1, &DOUBTFUL_RAD, 1);
    assert_int_equal(bslam_slam_doubts(&slam), 1);
    return 0;
}

static double heading_of(const bslam_ekf_t *ekf)
{
    return (double)bslam_ekf_pose(ekf).theta_rad;
}

static void test_doubts_are_of_likelihood_without_a_smoother(void **state)
{
    static bslam_smoother_t smoother;
    for (int32_t association = 0; association <= BSLAM_ASSOCIATION_BOTH; association++) {
        const bool is_likely =
            association == BSLAM_ASSOCIATION_SVM || association >= BSLAM_ASSOCIATION_POSITION;
        start(association, 2);
        assert_true(slam.doubts == (is_likely ? &doubts : NULL));
        bslam_slam_attach_doubts(&slam, NULL);
        assert_null(slam.doubts);
        start(association, 1);
        assert_null(slam.doubts);
        assert_int_equal(bslam_slam_doubts(&slam), 0);
        assert_near(bslam_slam_lead(&slam), 0, 0);
    }
    setup(NULL);
    slam.settings.filter = BSLAM_FILTER_SMOOTHER;
    bslam_slam_attach_smoother(&slam, &smoother);
    bslam_slam_attach_doubts(&slam, &doubts);
    assert_null(slam.doubts);
}

/// Fingerprints of frames in which things come into view, perhaps after one of which it is in doubt.
static uint64_t run(int32_t hypotheses, bool is_attached, bool is_doubtful)
{
    const double four[] = {LEFT_RAD, RIGHT_RAD, 1.5, -1.5};
    uint64_t chain = BSLAM_FINGERPRINT_START;
    start(BSLAM_ASSOCIATION_POSITION, hypotheses);
    bslam_slam_attach_doubts(&slam, is_attached ? &doubts : NULL);
    if (is_doubtful) {
        know_two();
        see(1, &DOUBTFUL_RAD, 1);
    }
    for (int k = 0; k < 60; k++) {
        see(1, four, k < 20 ? 2 : k < 50 ? 0 : 4);
        chain = bslam_slam_fingerprint(&slam, chain);
    }
    return chain;
}

static void test_one_hypothesis_and_nothing_in_doubt_are_as_without(void **state)
{
    const uint64_t with = run(2, true, false);
    assert_int_equal(bslam_slam_doubts(&slam), 0);
    assert_true(with == run(1, true, false));
    assert_true(with == run(2, false, false));
    assert_true(run(1, true, true) == run(2, false, true));
}

static void test_a_doubtful_sighting_begins_another_hypothesis(void **state)
{
    assert_near(heading_of(&slam.ekf), IF_LEFT_RAD, 0.01);
    assert_near(heading_of(&doubts.others[0].ekf), IF_RIGHT_RAD, 0.01);
    assert_near(bslam_slam_lead(&slam), 0, 2);
    assert_true(doubts.others[0].behind > 0);
    assert_int_equal(slam.counters.matched, 8 * 2 + 2 + 1);  // the other one's turn does not count
}

static void test_what_is_clear_or_was_just_in_view_begins_none(void **state)
{
    know_two();
    slam.settings.doubt_nats = BSLAM_R(0.01);
    see(1, &DOUBTFUL_RAD, 1);
    assert_int_equal(bslam_slam_doubts(&slam), 0);
    slam.settings.doubt_nats = 6;
    doubt_heading();
    see(1, &DOUBTFUL_RAD, 1);
    assert_true(slam.records[0].match.lead < 6);
    assert_int_equal(bslam_slam_doubts(&slam), 0);
}

// ---- how many hypotheses ----------------------------------------------------------------------------------

/// How many a robot follows that may follow so many: of the left one, the right one and a new one.
static int follow(int32_t hypotheses, double doubt_nats)
{
    start(BSLAM_ASSOCIATION_POSITION, hypotheses);
    know_two();
    slam.settings.new_per_m2 = BSLAM_R(0.1);
    slam.settings.doubt_nats = real(doubt_nats);
    see(1, &NEARLY_LEFT_RAD, 1);
    return bslam_slam_doubts(&slam) + 1;
}

/// In as much room as there is.
static int at_most(int hypotheses)
{
    return hypotheses < BSLAM_HYPOTHESES_MAX ? hypotheses : BSLAM_HYPOTHESES_MAX;
}

static void test_each_choice_begins_a_hypothesis_while_there_is_room(void **state)
{
    for (int32_t hypotheses = 2; hypotheses <= 8; hypotheses++) {
        assert_int_equal(follow(hypotheses, 100), at_most(hypotheses < 3 ? hypotheses : 3));
        assert_near(heading_of(&slam.ekf), LEFT_RAD - NEARLY_LEFT_RAD, 0.01);
        for (int k = 0; k < doubts.count; k++) {
            const bslam_ekf_t *other = &doubts.others[k].ekf;
            assert_near(heading_of(other), k == 0 ? RIGHT_RAD - NEARLY_LEFT_RAD : 0, 0.01);
            assert_int_equal(other->beacon_count, k == 0 ? 2 : 3);
        }
    }
}

/// The right one is behind the left one by its lead, a new one by its score.
static void test_a_choice_that_is_clearly_behind_begins_no_hypothesis(void **state)
{
    (void)follow(3, 100);
    const double lead = (double)slam.records[0].match.lead, score = (double)slam.records[0].match.score;
    assert_true(lead > 0.1 && score > 2 * lead);
    assert_int_equal(follow(3, lead - 0.01), 1);
    assert_int_equal(follow(3, lead + 0.01), 2);
    assert_int_equal(follow(3, score - 0.01), 2);
    assert_int_equal(follow(3, score + 0.01), at_most(3));
}

// ---- what waits -------------------------------------------------------------------------------------------

/// What is seen beside a beacon may be a new one, or that one, seen badly.
static int setup_places(void **state)
{
    setup(state);
    know_places();
    return 0;
}

static void assert_waits(int i)
{
    assert_int_equal(slam.accounts[i].outcome, BSLAM_OUTCOME_DEFERRED);
    assert_int_equal(slam.accounts[i].reason, BSLAM_REASON_APPEARANCE);
}

/// What the two hypotheses have in their maps.
static void assert_beacons(int in_force, int other)
{
    assert_int_equal(bslam_slam_doubts(&slam), 1);
    assert_int_equal(slam.ekf.beacon_count, in_force);
    assert_int_equal(doubts.others[0].ekf.beacon_count, other);
}

static void test_a_new_beacon_in_doubt_waits_while_there_is_no_room(void **state)
{
    const double left = LEFT_RAD + BESIDE_RAD, right = RIGHT_RAD - BESIDE_RAD, clear = 1.5;
    see(1, &left, 1);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_NEW);
    assert_beacons(3, 2);
    doubts.others[0].behind = BSLAM_R(0.1);  // less than what would begin now
    const double behind = (double)doubts.others[0].behind;
    see(1, &right, 1);
    assert_waits(0);
    assert_true(slam.records[0].match.lead > BSLAM_R(0.1));
    assert_beacons(3, 2);
    assert_near(doubts.others[0].behind, behind, 0);  // and says nothing
    see(1, &clear, 1);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_NEW);
    assert_beacons(4, 3);
    bslam_slam_end_doubt(&slam);
    see(1, &right, 1);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_NEW);
    assert_beacons(5, 4);
}

/// The one that is less sure begins a hypothesis.
static void test_of_two_new_beacons_in_doubt_one_waits(void **state)
{
    const double beside[] = {RIGHT_RAD - BESIDE_RAD - 0.005, LEFT_RAD + BESIDE_RAD};
    see(1, beside, 2);
    assert_waits(0);
    assert_int_equal(slam.accounts[1].outcome, BSLAM_OUTCOME_NEW);
    assert_beacons(3, 2);
}

/// In the other hypothesis it is a known one, or the other way round.
static void test_what_waits_says_nothing_between_two_hypotheses(void **state)
{
    const double beside[] = {DOUBTFUL_RAD + 0.14, DOUBTFUL_RAD - 0.14};
    for (int i = 0; i < COUNT_OF(beside); i++) {
        setup_doubt(NULL);
        see(10, NULL, 0);
        const double behind = (double)doubts.others[0].behind;
        see(1, &beside[i], 1);
        if (i == 0) {
            assert_waits(0);
        } else {
            assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_MATCHED);
        }
        assert_beacons(2, 2);
        assert_int_equal(doubts.others[0].ekf.beacons[0].sightings, i == 0 ? 11 : 10);
        assert_int_equal(doubts.others[0].ekf.beacons[1].sightings, 11);
        assert_near(doubts.others[0].behind, behind, 0);
    }
}

/// It is there to find out whether there is a new one.
static void test_the_hypothesis_of_a_new_beacon_begins_it(void **state)
{
    const double between = 0.01;
    slam.settings.new_per_m2 = BSLAM_R(1e-3);
    see(1, &between, 1);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_MATCHED);
    assert_beacons(2, 3);
}

static void test_where_there_is_but_one_hypothesis_nothing_waits(void **state)
{
    const double left = LEFT_RAD + BESIDE_RAD;
    start(BSLAM_ASSOCIATION_POSITION, 1);
    know_places();
    see(1, &left, 1);
    assert_true(slam.records[0].match.lead < slam.settings.doubt_nats);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_NEW);
}

// ---- who makes room ---------------------------------------------------------------------------------------

static void test_of_those_farther_behind_the_farthest_is_forgotten(void **state)
{
    static const double behind[] = {1, 5, 3}, than[] = {0, 4, 5, 6};
    for (int i = 0; i < COUNT_OF(than); i++) {
        bool is_left[COUNT_OF(behind)] = {false};
        start(BSLAM_ASSOCIATION_POSITION, 4);
        doubts.count = COUNT_OF(behind);
        for (int k = 0; k < COUNT_OF(behind); k++) {
            doubts.others[k].behind = real(behind[k]);
            doubts.others[k].since_us = k;
        }
        bslam_slam_forget_worst(&slam, real(than[i]));
        assert_int_equal(doubts.count, than[i] < 5 ? 2 : 3);
        for (int k = 0; k < doubts.count; k++) {
            const int was = (int)doubts.others[k].since_us;
            assert_near(doubts.others[k].behind, behind[was], 0);
            is_left[was] = true;
        }
        assert_true(is_left[0] && is_left[2]);
        assert_int_equal(is_left[1], than[i] >= 5);
    }
}

/// There is another one, so much behind, and room for no more; then a sighting is in doubt. Whether another
/// one is there after that; by how much the sighting's choice leads.
static bool is_replaced(double behind, double *lead)
{
    const double beside = DOUBTFUL_RAD + 0.14;
    setup_doubt(NULL);
    const int64_t since_us = doubts.others[0].since_us;
    see(10, NULL, 0);
    assert_int_equal(doubts.others[0].since_us, since_us);
    doubts.others[0].behind = real(behind);
    see(1, &beside, 1);
    assert_int_equal(bslam_slam_doubts(&slam), 1);
    assert_true(doubts.others[0].since_us == since_us || doubts.others[0].since_us == slam.moment_us);
    *lead = (double)slam.records[0].match.lead;
    return doubts.others[0].since_us != since_us;
}

static void test_a_hypothesis_farther_behind_than_a_new_doubt_makes_room_for_it(void **state)
{
    double lead, same;
    assert_true(is_replaced(8.9, &lead));
    assert_true(lead > 0.1 && lead < 6);
    assert_int_equal(slam.accounts[0].outcome, BSLAM_OUTCOME_NEW);
    assert_beacons(3, 2);
    assert_true(is_replaced(lead + 0.01, &same));
    assert_false(is_replaced(lead - 0.01, &same));
    assert_waits(0);
    assert_beacons(2, 2);
}

static void test_where_there_is_room_for_another_no_hypothesis_is_forgotten(void **state)
{
    const double beside = DOUBTFUL_RAD + 0.14;
    const int64_t since_us = doubts.others[0].since_us;
    see(10, NULL, 0);
    slam.settings.hypotheses = 3;
    doubts.others[0].behind = BSLAM_R(8.9);
    see(1, &beside, 1);
    assert_int_equal(bslam_slam_doubts(&slam), 2);
    assert_int_equal(doubts.others[0].since_us, since_us);
    assert_int_equal(doubts.others[1].since_us, slam.moment_us);
}

// ---- what comes next --------------------------------------------------------------------------------------

static void test_all_hypotheses_go_through_a_motion(void **state)
{
    step_m = BSLAM_R(0.05);
    see(10, NULL, 0);
    const bslam_pose_t left = bslam_ekf_pose(&slam.ekf), right = bslam_ekf_pose(&doubts.others[0].ekf);
    assert_near(left.y_m, 0.5 * sin(IF_LEFT_RAD), 0.01);
    assert_near(right.y_m, 0.5 * sin(IF_RIGHT_RAD), 0.01);
}

static void test_a_hypothesis_that_explains_much_less_is_forgotten(void **state)
{
    see_both_from(IF_LEFT_RAD, 20);
    assert_int_equal(bslam_slam_doubts(&slam), 0);
    assert_near(heading_of(&slam.ekf), IF_LEFT_RAD, 0.01);
    assert_int_equal(slam.ekf.beacon_count, 2);
}

/// Before the next frame; the map is the other one's, too, in which what was seen last is nothing new.
static void test_a_hypothesis_that_explains_more_is_put_in_force(void **state)
{
    see_both_from(IF_RIGHT_RAD, 1);
    assert_near(heading_of(&slam.ekf), IF_LEFT_RAD, 0.02);
    assert_int_equal(slam.ekf.beacon_count, 3);
    const uint32_t mistaken = slam.ekf.beacons[2].uid;
    assert_true(bslam_slam_lead(&slam) < -2);
    see(1, NULL, 0);
    assert_near(heading_of(&slam.ekf), IF_RIGHT_RAD, 0.01);
    assert_int_equal(slam.ekf.beacon_count, 2);
    see(1, (const double[]){1.5}, 1);
    assert_true(slam.ekf.beacons[2].uid > mistaken);  // which is given once, whoever gives it
    see_both_from(IF_RIGHT_RAD, 20);
    assert_int_equal(bslam_slam_doubts(&slam), 0);
    assert_near(heading_of(&slam.ekf), IF_RIGHT_RAD, 0.01);
    assert_int_equal(slam.ekf.beacon_count, 3);
}

/// Where nothing tells the two apart it is decided by what little does.
static void test_a_doubt_that_lasts_is_decided(void **state)
{
    for (int is_behind = 0; is_behind < 2; is_behind++) {
        setup_doubt(NULL);
        see(slam.settings.doubt_us / STEP_US, &DOUBTFUL_RAD, 1);
        assert_int_equal(bslam_slam_doubts(&slam), 1);
        doubts.others[0].behind = is_behind != 0 ? BSLAM_R(0.5) : BSLAM_R(-0.5);
        see(1, &DOUBTFUL_RAD, 1);
        assert_int_equal(bslam_slam_doubts(&slam), 0);
        assert_near(heading_of(&slam.ekf), is_behind != 0 ? IF_LEFT_RAD : IF_RIGHT_RAD, 0.01);
    }
}

static void assert_ended_by(bslam_status_t status)
{
    assert_int_equal(status, BSLAM_OK);
    assert_int_equal(bslam_slam_doubts(&slam), 0);
    setup_doubt(NULL);
}

static void test_what_changes_pose_or_map_ends_the_doubt(void **state)
{
    const bslam_pose_t pose = {1, 1, 1}, nowhere = {real(NAN), 0, 0};
    assert_ended_by(bslam_slam_set_pose(&slam, &pose, 0, 0));
    assert_ended_by((bslam_slam_lose_pose(&slam), BSLAM_OK));
    assert_ended_by((bslam_slam_forget_map(&slam), BSLAM_OK));
    assert_ended_by(bslam_slam_remove_beacon(&slam, slam.ekf.beacons[0].uid));
    assert_ended_by(bslam_slam_add_known_beacon(&slam, 5, 1, 1));
    // What is refused changes nothing.
    assert_int_equal(bslam_slam_set_pose(&slam, &nowhere, 0, 0), BSLAM_E_NOT_FINITE);
    assert_int_equal(bslam_slam_remove_beacon(&slam, 77), BSLAM_E_NO_BEACON);
    assert_int_equal(bslam_slam_add_known_beacon(&slam, -1, 1, 1), BSLAM_E_RANGE);
    assert_int_equal(bslam_slam_doubts(&slam), 1);
}

/// Whoever is right, the robot may have been carried meanwhile.
static void test_a_gap_of_odometry_is_one_for_all_hypotheses(void **state)
{
    assert_int_equal(bslam_slam_resume_odometry(&slam, BSLAM_R(0.5), BSLAM_R(0.3)), BSLAM_OK);
    assert_true(bslam_slam_doubts(&slam) == 0 ||
                bslam_ekf_covariance(&doubts.others[0].ekf, BSLAM_STATE_THETA, BSLAM_STATE_THETA) > 0.08);
}

static void start_looking(void)
{
    start(BSLAM_ASSOCIATION_SVM, 2);
    assert_int_equal(bslam_appearance_init(&appearance, NULL, 0), BSLAM_OK);
    bslam_slam_attach_appearance(&slam, &appearance);
    know_two();
    unit_give_machine(&appearance, 0, 1, 3);
    unit_give_machine(&appearance, 1, 1, 3);
    see(1, &DOUBTFUL_RAD, 1);
    assert_int_equal(bslam_slam_doubts(&slam), 1);
}

/// What beacons look like is each hypothesis' own, and goes with it.
static void test_looks_go_with_the_hypothesis_that_is_put_in_force(void **state)
{
    start_looking();
    doubts.others[0].of[1].classifier = BSLAM_NO_CLASSIFIER;
    doubts.others[0].behind = -3;
    see(1, NULL, 0);
    assert_int_equal(appearance.of[1].classifier, BSLAM_NO_CLASSIFIER);
    assert_int_equal(doubts.others[0].of[1].classifier, 1);
    assert_true(appearance.learner.classifiers[1].used);
    bslam_slam_end_doubt(&slam);
    assert_false(appearance.learner.classifiers[1].used);
}

/// Frames of a view, of which each says something else, and the last ones much more; and two views of it.
enum { VIEW = 8, COUNTED = 5, FRAMES = 2 * VIEW };
static const float FIRSTS[VIEW] = {-0.4f, -0.3f, -0.6f, -0.4f, -0.5f, 0.1f, 0.1f, 0.1f};

/// By how much the other hypothesis is behind after each frame; only the left one's appearance is known, and
/// perhaps told. said: what it says.
static void view_twice(bool is_told, double behind[FRAMES], double said[FRAMES])
{
    float features[BSLAM_SAMPLE_FEATURES] = {0};
    start(BSLAM_ASSOCIATION_SVM, 2);
    assert_int_equal(bslam_appearance_init(&appearance, NULL, 0), BSLAM_OK);
    bslam_slam_attach_appearance(&slam, &appearance);
    know_two();
    unit_give_machine(&appearance, 0, 1, 3);
    signature = is_told ? features : NULL;
    for (int n = 0; n < FRAMES; n++) {
        see(n == VIEW ? 30 : 0, NULL, 0);
        features[0] = FIRSTS[n % VIEW];
        slam.bearing_noise = slam.range_noise = (bslam_autocorrelation_t){0, 0};  // all that is said counts
        see(1, &DOUBTFUL_RAD, 1);
        assert_int_equal(bslam_slam_doubts(&slam), 1);
        behind[n] = (double)doubts.others[0].behind;
        said[n] = (double)slam.records[0].match.looks;
    }
    signature = NULL;
}

static void test_appearance_counts_by_the_mean_of_a_views_first_frames(void **state)
{
    double without[FRAMES], with[FRAMES], said[FRAMES], before = 0, sum = 0;
    view_twice(false, without, said);
    view_twice(true, with, said);
    for (int n = 0; n < FRAMES; n++) {
        const int k = n % VIEW, counted = k < COUNTED ? k + 1 : COUNTED;
        before += n == VIEW ? sum / COUNTED : 0;
        sum = (k == 0 ? 0 : sum) + (k < COUNTED ? said[n] : 0);
        assert_near(with[n] - without[n], before + sum / counted, 1e-4);
    }
    assert_true(said[COUNTED] > 1.5 * sum / COUNTED);
}

/// A slip is paid for in the first frame of a view: those after it show the same one. The last view is of
/// none.
static void test_a_slip_is_paid_for_once_in_a_view(void **state)
{
    enum { SEEN = 3, VIEWS = 3 };
    const double slip_nats = 5;
    const float alike[BSLAM_SAMPLE_FEATURES] = {1};
    start(BSLAM_ASSOCIATION_SVM, 2);
    assert_int_equal(bslam_appearance_init(&appearance, NULL, 0), BSLAM_OK);
    bslam_slam_attach_appearance(&slam, &appearance);
    know_two();
    unit_give_machine(&appearance, 0, 2, 16);
    unit_give_machine(&appearance, 1, -2, 16);
    see(1, &DOUBTFUL_RAD, 1);
    for (int n = 0; n < VIEWS * SEEN; n++) {
        const bool is_first = n % SEEN == 0, slips = n < (VIEWS - 1) * SEEN;
        signature = NULL;
        see(is_first ? 30 : 0, NULL, 0);
        signature = alike;
        assert_int_equal(bslam_slam_doubts(&slam), 1);
        doubts.others[0].behind = 0;
        slam.bearing_noise = slam.range_noise = (bslam_autocorrelation_t){0, 0};  // all that is said counts
        const double bearing_rad = LEFT_RAD - heading_of(&slam.ekf) + (slips ? 0.4 : 0);
        see(1, &bearing_rad, 1);
        const bslam_match_t *match = &slam.records[0].match;
        assert_int_equal(match->beacon, 0);
        assert_true(match->slipped == slips);
        assert_true(match->looks > 5);
        const double others = (double)doubts.others[0].cost[0];
        const double paid = others - (double)doubts.others[0].behind + (double)match->log_density;
        assert_true(fabs(others) < 100);  // it compares
        assert_near(paid, is_first ? (slips ? slip_nats : 0) - (double)match->looks : 0, 1e-4);
    }
    signature = NULL;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_doubts_are_of_likelihood_without_a_smoother, setup),
        cmocka_unit_test_setup(test_one_hypothesis_and_nothing_in_doubt_are_as_without, setup),
        cmocka_unit_test_setup(test_a_doubtful_sighting_begins_another_hypothesis, setup_doubt),
        cmocka_unit_test_setup(test_what_is_clear_or_was_just_in_view_begins_none, setup),
        cmocka_unit_test_setup(test_each_choice_begins_a_hypothesis_while_there_is_room, setup),
        cmocka_unit_test_setup(test_a_choice_that_is_clearly_behind_begins_no_hypothesis, setup),
        cmocka_unit_test_setup(test_a_new_beacon_in_doubt_waits_while_there_is_no_room, setup_places),
        cmocka_unit_test_setup(test_of_two_new_beacons_in_doubt_one_waits, setup_places),
        cmocka_unit_test_setup(test_what_waits_says_nothing_between_two_hypotheses, setup),
        cmocka_unit_test_setup(test_the_hypothesis_of_a_new_beacon_begins_it, setup_places),
        cmocka_unit_test_setup(test_where_there_is_but_one_hypothesis_nothing_waits, setup),
        cmocka_unit_test_setup(test_of_those_farther_behind_the_farthest_is_forgotten, setup),
        cmocka_unit_test_setup(test_a_hypothesis_farther_behind_than_a_new_doubt_makes_room_for_it, setup),
        cmocka_unit_test_setup(test_where_there_is_room_for_another_no_hypothesis_is_forgotten, setup_doubt),
        cmocka_unit_test_setup(test_all_hypotheses_go_through_a_motion, setup_doubt),
        cmocka_unit_test_setup(test_a_hypothesis_that_explains_much_less_is_forgotten, setup_doubt),
        cmocka_unit_test_setup(test_a_hypothesis_that_explains_more_is_put_in_force, setup_doubt),
        cmocka_unit_test_setup(test_a_doubt_that_lasts_is_decided, setup_doubt),
        cmocka_unit_test_setup(test_what_changes_pose_or_map_ends_the_doubt, setup_doubt),
        cmocka_unit_test_setup(test_a_gap_of_odometry_is_one_for_all_hypotheses, setup_doubt),
        cmocka_unit_test_setup(test_looks_go_with_the_hypothesis_that_is_put_in_force, setup),
        cmocka_unit_test_setup(test_appearance_counts_by_the_mean_of_a_views_first_frames, setup),
        cmocka_unit_test_setup(test_a_slip_is_paid_for_once_in_a_view, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
