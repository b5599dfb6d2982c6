#include "covariance.h"
#include "known_map.h"
#include "support.h"

#include <math.h>

#include "bslam/association/association.h"
#include "bslam/association/conditional.h"
#include "bslam/association/viewpoint.h"
#include "bslam/model/noise.h"
#include "plain_settings.h"

static const bslam_pose_t on_axle = {0, 0, 0};
static const float PLAIN[BSLAM_SAMPLE_FEATURES] = {0.0f};

static bslam_appearance_t appearance;

static void give_classifier(int index, double value, int samples)
{
    unit_give_machine(&appearance, index, value, samples);
}

static bslam_sighting_t seen_with(bslam_sighting_t sighting, const float *signature)
{
    sighting.signature = signature;
    return sighting;
}

static bslam_settings_t svm_params(void)
{
    bslam_settings_t settings = unit_settings();
    settings.association = BSLAM_ASSOCIATION_SVM;
    settings.candidate_d2 = 30;
    settings.new_per_m2 = BSLAM_R(0.02);
    settings.new_per_rad = BSLAM_R(0.3);
    settings.defer_score = 4;
    settings.competitor_lead = 2;
    settings.appearance_weight = 1;
    settings.appearance_samples = 3;
    settings.appearance_slope = 4;
    settings.appearance_offset = BSLAM_R(-0.5);
    settings.appearance_low = 8;
    settings.appearance_high = 4;
    settings.far_d2 = 300;
    settings.class_doubt = BSLAM_R(0.1);
    settings.learn_d2 = 9;
    settings.learn_lead = 4;
    settings.learn_margin = 0;
    settings.decision_delay_us = 1000000;
    return settings;
}

typedef struct decision {
    bslam_record_t records[8];
} decision_t;

static decision_t decide_at(int64_t time_us, const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                            const bslam_sighting_t *seen, int count)
{
    const bslam_sighting_frame_t frame = {ekf, settings, &appearance, &on_axle, seen, count, time_us};
    decision_t decision;
    memset(&decision, 0x77, sizeof decision);
    bslam_associate_svm(&frame, decision.records);
    return decision;
}

static decision_t decide(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                         const bslam_sighting_t *seen, int count)
{
    return decide_at(0, ekf, settings, seen, count);
}

static int setup(void **state)
{
    return bslam_appearance_init(&appearance, NULL, 0) == BSLAM_OK ? 0 : -1;
}

/// Equation (47) without appearance, for a beacon straight ahead at (4, 0).
static double position_score(const bslam_settings_t *settings, double range_m, double bearing_rad)
{
    const bslam_sighting_t plain = unit_polar(0, 4, -1);
    const double range_var = 0.01 + (double)bslam_range_variance_m2(settings, &plain, 4);
    const double bearing_var = 0.01 / 16 + (double)bslam_bearing_variance_rad2(settings, &plain);
    const double range = range_m - 4;
    const double distance2 = range * range / range_var + bearing_rad * bearing_rad / bearing_var;
    const double two_pi = 6.283185307179586;
    return -0.5 * distance2 - log(two_pi * sqrt(range_var * bearing_var)) -
           log((double)settings->new_per_m2 * range_m);
}

static const double ahead[1][2] = {{4, 0}};

static void test_score_is_equation_47_without_appearance(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const bslam_sighting_t seen = unit_polar(0.01, 4.1, -1);
    const decision_t d = decide(&ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, 0);
    assert_near(d.records[0].match.score, position_score(&settings, 4.1, 0.01), 1e-4);
}

static bslam_settings_t again_params(void)
{
    bslam_settings_t settings = svm_params();
    settings.again_odds = BSLAM_R(4.2);
    settings.again_us = 200000;
    return settings;
}

static void test_score_adds_the_odds_of_being_seen_again(void **state)
{
    const bslam_settings_t settings = again_params();
    bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const bslam_sighting_t seen = unit_polar(0.01, 4.1, -1);
    ekf.beacons[0].last_seen_us = 1000000;
    appearance.of[0].view_score = BSLAM_R(2.1);  // enough for all of them
    const int64_t times_us[] = {1000000, 1000001, 1200000, 1200001};
    const double odds[] = {0, 4.2, 4.2, 0};
    for (int i = 0; i < 4; i++) {
        const decision_t d = decide_at(times_us[i], &ekf, &settings, &seen, 1);
        assert_near(d.records[0].match.score, position_score(&settings, 4.1, 0.01) + odds[i], 1e-4);
    }
}

/// That something was in view is no surer than the best that spoke for it.
static void test_what_was_matched_with_little_is_hardly_held(void **state)
{
    const bslam_settings_t settings = again_params();
    bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const bslam_sighting_t seen = unit_polar(0.01, 4.1, -1);
    const double alone = position_score(&settings, 4.1, 0.01);
    ekf.beacons[0].last_seen_us = 1000000;
    const double views[] = {-3, 0, 0.5, 2, 50}, odds[] = {0, 0, 1, 4, 4.2};
    for (int i = 0; i < 5; i++) {
        appearance.of[0].view_score = real(views[i]);
        const bslam_match_t just = decide_at(1100000, &ekf, &settings, &seen, 1).records[0].match;
        assert_near(just.score, alone + odds[i], 1e-4);
        assert_near(just.view_score, views[i] > alone ? views[i] : alone, 1e-4);
    }
    // Out of view for longer than `decision_delay_us` it comes into view anew.
    assert_near(decide_at(2000000, &ekf, &settings, &seen, 1).records[0].match.view_score, 50, 1e-4);
    assert_near(decide_at(2000001, &ekf, &settings, &seen, 1).records[0].match.view_score, alone, 1e-4);
}

/// Called something else it is not seen again.
static void test_another_class_has_no_odds_of_being_seen_again(void **state)
{
    const bslam_settings_t settings = again_params();
    bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    ekf.beacons[0].last_seen_us = 1000000;
    ekf.beacons[0].beacon_class = 3;
    appearance.of[0].view_score = settings.again_odds;
    bslam_sighting_t seen = unit_polar(0.01, 4.1, -1);
    seen.beacon_class = 3;
    assert_near(decide_at(1000001, &ekf, &settings, &seen, 1).records[0].match.score,
                position_score(&settings, 4.1, 0.01) + 4.2, 1e-4);
    seen.beacon_class = 4;
    assert_near(decide_at(1000001, &ekf, &settings, &seen, 1).records[0].match.score,
                position_score(&settings, 4.1, 0.01), 1e-4);
}

/// From afar position says little, and a beacon that is delayed each time is never learned.
static void test_a_distant_beacon_seen_again_is_no_newcomer(void **state)
{
    const bslam_settings_t settings = again_params();
    const double far_away[1][2] = {{20, 0}};
    bslam_ekf_t ekf = unit_map_of(&settings, far_away, 1);
    ekf.beacons[0].last_seen_us = 1000000;
    ekf.beacons[0].confirmed = true;
    appearance.of[0].view_score = settings.again_odds;
    float signature[BSLAM_SAMPLE_FEATURES] = {-1.0f};
    give_classifier(0, 3.0, 1);
    bslam_sighting_t seen = seen_with(unit_polar(0, 20, -1), signature);
    seen.range_sd_m = 4;
    const decision_t after_long = decide_at(9000000, &ekf, &settings, &seen, 1);
    unit_assert_decided(&after_long.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_AMBIGUOUS, -1);
    const decision_t again = decide_at(1040000, &ekf, &settings, &seen, 1);
    unit_assert_decided(&again.records[0].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, 0);
}

static void test_score_adds_what_appearance_says_as_samples_come(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    float signature[BSLAM_SAMPLE_FEATURES] = {1.0f};
    const bslam_sighting_t seen = seen_with(unit_polar(0, 4, -1), signature);
    give_classifier(0, 0.75, 3);
    // 3 of 3 + 3 samples: half of 4 * 0.75 - 0.5.
    assert_near(decide(&ekf, &settings, &seen, 1).records[0].match.score,
                position_score(&settings, 4, 0) + 1.25, 0.01);
    appearance.learner.classifiers[0].samples = 12;
    assert_near(decide(&ekf, &settings, &seen, 1).records[0].match.score,
                position_score(&settings, 4, 0) + 2.0, 0.01);
    signature[0] = -1.0f;  // 4 * -0.75 - 0.5 = -3.5
    assert_near(decide(&ekf, &settings, &seen, 1).records[0].match.score,
                position_score(&settings, 4, 0) - 2.8, 0.01);
}

static void test_score_of_appearance_is_clipped(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    float signature[BSLAM_SAMPLE_FEATURES] = {1.0f};
    const bslam_sighting_t seen = seen_with(unit_polar(0, 4, -1), signature);
    give_classifier(0, 5, 3);
    assert_near(decide(&ekf, &settings, &seen, 1).records[0].match.score, position_score(&settings, 4, 0) + 2,
                1e-3);
    signature[0] = -1.0f;
    assert_near(decide(&ekf, &settings, &seen, 1).records[0].match.score, position_score(&settings, 4, 0) - 4,
                1e-3);
}

/// bslam_slam_sightings refuses it; whoever associates by himself gets a decision by position.
static void test_a_signature_that_is_no_number_is_as_none(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const float signature[BSLAM_SAMPLE_FEATURES] = {1.0f, NAN};
    const bslam_sighting_t seen = seen_with(unit_polar(0, 4, -1), signature);
    give_classifier(0, 5, 3);
    assert_near(decide(&ekf, &settings, &seen, 1).records[0].match.score, position_score(&settings, 4, 0),
                1e-4);
}

static void test_a_classifier_without_competitors_says_nothing(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const float signature[BSLAM_SAMPLE_FEATURES] = {1.0f};
    const bslam_sighting_t seen = seen_with(unit_polar(0, 4, -1), signature);
    give_classifier(0, 5, 3);
    appearance.learner.classifiers[0].negatives = 0;
    assert_near(decide(&ekf, &settings, &seen, 1).records[0].match.score, position_score(&settings, 4, 0),
                1e-4);
}

static void test_between_match_and_new_a_sighting_is_deferred(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const double waits_m = 4.72;
    const double is_new_m = 4.98;
    assert_true(position_score(&settings, waits_m, 0) < 0 && position_score(&settings, waits_m, 0) > -4);
    assert_true(position_score(&settings, is_new_m, 0) < -4);
    const bslam_sighting_t seen[] = {unit_polar(0, waits_m, -1)};
    const bslam_sighting_t other[] = {unit_polar(0, is_new_m, -1)};
    decision_t d = decide(&ekf, &settings, seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_AMBIGUOUS, -1);
    d = decide(&ekf, &settings, other, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
}

/// A beacon that the map hardly knows is nearly everything: where a sighting has a place of its own it is
/// new.
static void test_what_is_nearly_an_old_beacon_that_does_not_count_is_new(void **state)
{
    const bslam_settings_t settings = svm_params();
    bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    ekf.beacons[0].confirmed = false;
    bslam_sighting_t seen = unit_polar(0, 4.72, -1);
    decision_t d = decide_at(settings.decision_delay_us, &ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_AMBIGUOUS, -1);
    d = decide_at(settings.decision_delay_us + 1, &ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
    ekf.beacons[0].confirmed = true;
    d = decide_at(settings.decision_delay_us + 1, &ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_AMBIGUOUS, -1);
    ekf.beacons[0].confirmed = false;
    seen = unit_polar(0.11, 4, -1);
    seen.has_range = false;
    d = decide_at(settings.decision_delay_us + 1, &ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_AMBIGUOUS, -1);
}

/// Nor is it what has a place and is called something else, however well the place fits.
static void test_what_is_called_otherwise_than_an_old_beacon_that_does_not_count_is_new(void **state)
{
    const bslam_settings_t settings = svm_params();
    bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    ekf.beacons[0].beacon_class = 2;
    bslam_sighting_t seen = unit_polar(0, 4, -1);
    seen.beacon_class = 6;
    for (int k = 0; k < 8; k++) {
        const bool is_long_ago = (k & 1) != 0, is_unconfirmed = (k & 2) != 0;
        seen.has_range = (k & 4) != 0;
        ekf.beacons[0].confirmed = !is_unconfirmed;
        const decision_t d =
            decide_at(settings.decision_delay_us + (is_long_ago ? 1 : 0), &ekf, &settings, &seen, 1);
        const bool is_new = is_long_ago && is_unconfirmed && seen.has_range;
        unit_assert_decided(&d.records[0].match, is_new ? BSLAM_VERDICT_NEW : BSLAM_VERDICT_MATCH,
                            BSLAM_REASON_NONE, is_new ? -1 : 0);
    }
}

static void test_appearance_that_differs_makes_a_sighting_in_the_gate_new(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const float signature[BSLAM_SAMPLE_FEATURES] = {-1.0f};
    give_classifier(0, 3, 16);
    const bslam_sighting_t seen = seen_with(unit_polar(0.06, 4.45, -1), signature);
    const decision_t d = decide(&ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
}

static void test_a_class_counts_as_its_log_odds_say(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    appearance.of[0].seen_as[2] = 10;
    bslam_sighting_t seen = unit_polar(0, 4, -1);
    seen.beacon_class = 3;
    assert_near(decide(&ekf, &settings, &seen, 1).records[0].match.score,
                position_score(&settings, 4, 0) + log(8 * 10.1 / 10.8), 1e-3);
    seen.beacon_class = 4;
    const decision_t d = decide(&ekf, &settings, &seen, 1);
    assert_near(d.records[0].match.score, position_score(&settings, 4, 0) + log(8 * 0.1 / 10.8), 1e-3);
}

/// What the side adds to the score of a beacon at (4, 0) that was seen from the origin and a little aside.
static double side_score(bslam_ekf_t *ekf, const bslam_pose_t *mount, double bearing_rad)
{
    bslam_settings_t settings = svm_params();
    settings.candidate_d2 = 1000;
    settings.viewpoint_low = 3;
    settings.viewpoint_high = 1;
    const int ahead_of_origin = bslam_viewpoint_sector(0);
    appearance.of[0].seen_from[ahead_of_origin] = 40;
    appearance.of[0].seen_from[ahead_of_origin - 1] = 40;
    const bslam_sighting_t seen = unit_polar(bearing_rad, 4, -1);
    bslam_appearance_t *const known[] = {NULL, &appearance};
    double scores[2];
    for (int i = 0; i < 2; i++) {
        const bslam_sighting_frame_t frame = {ekf, &settings, known[i], mount, &seen, 1, 0};
        bslam_record_t record;
        bslam_associate_svm(&frame, &record);
        scores[i] = (double)record.match.score;
    }
    return scores[1] - scores[0];
}

/// The side from which a beacon is seen is one of the map, however the robot and its sensor are turned.
static void test_score_adds_the_odds_of_the_side(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_pose_t poses[] = {{0, 0, 0}, {0, 0, 1.5}, {8, 0, 3}};
    const bslam_pose_t mounts[] = {{0, 0, 0}, {0, 0, -1}};
    const double odds[] = {1, 1, -3};
    for (int k = 0; k < 6; k++) {
        const bslam_pose_t *pose = &poses[k / 2], *mount = &mounts[k % 2];
        bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
        bslam_ekf_set_pose(&ekf, pose, BSLAM_R(1e-6), BSLAM_R(1e-6));
        const double direction = pose->x_m > 4 ? 3.14159265 : 0;
        const double bearing = direction - (double)pose->theta_rad - (double)mount->theta_rad;
        assert_near(side_score(&ekf, mount, bearing), odds[k / 2], 1e-3);
    }
}

/// A robot whose wheels have spun takes its place for another, and doubts it: by half a metre at four.
static void test_in_doubt_of_its_place_a_robot_knows_no_side(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_pose_t behind = {8, 0, BSLAM_R(3.14159265)};
    bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    bslam_ekf_set_pose(&ekf, &behind, BSLAM_R(0.12), BSLAM_R(1e-6));
    assert_near(side_score(&ekf, &on_axle, 0), -3, 1e-3);
    bslam_ekf_set_pose(&ekf, &behind, BSLAM_R(0.13), BSLAM_R(1e-6));
    assert_near(side_score(&ekf, &on_axle, 0), 0, 1e-3);
}

/// A beacon that was given stands in no state, and a ray in another one than a point.
static void test_only_what_has_a_place_in_the_map_has_sides(void **state)
{
    const bslam_settings_t settings = svm_params();
    bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    bslam_beacon_t *beacon = &ekf.beacons[0];
    assert_near(side_score(&ekf, &on_axle, 0), 1, 1e-3);
    beacon->kind = BSLAM_BEACON_KNOWN;
    beacon->known_x_m = 4;
    beacon->known_y_m = 0;
    assert_near(side_score(&ekf, &on_axle, 0), 0, 0);
    beacon->kind = BSLAM_BEACON_RAY;
    assert_false(bslam_has_viewpoint(beacon));
    beacon->kind = BSLAM_BEACON_SIZED;
    assert_true(bslam_has_viewpoint(beacon));
}

/// How much too long a beacon's distances are goes with its class: taken for another, a sighting has but a
/// direction, and a distance that may be anything from a third to three times of what it is.
static void test_a_distance_by_another_class_is_not_held_against_it(void **state)
{
    const bslam_settings_t settings = svm_params();
    bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    assert_true(bslam_ekf_give_scale(&ekf, 0, BSLAM_R(0.0036)));
    ekf.beacons[0].beacon_class = 3;
    bslam_sighting_t seen = unit_polar(0.01, 2, -1), direction = unit_direction(0.01, -1);
    seen.beacon_class = direction.beacon_class = 4;
    const double score = (double)decide(&ekf, &settings, &direction, 1).records[0].match.score;
    const double of_distance = log((double)settings.new_per_rad) - log((double)settings.new_per_m2 * 2);
    assert_near(decide(&ekf, &settings, &seen, 1).records[0].match.score,
                score + of_distance - log(2 * log(9)), 1e-3);
    unit_assert_decided(&decide(&ekf, &settings, &seen, 1).records[0].match, BSLAM_VERDICT_MATCH,
                        BSLAM_REASON_NONE, 0);
    seen.beacon_class = 3;
    unit_assert_decided(&decide(&ekf, &settings, &seen, 1).records[0].match, BSLAM_VERDICT_NEW,
                        BSLAM_REASON_NONE, -1);
}

static void test_far_but_clearly_alike_is_not_new(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const float alike[BSLAM_SAMPLE_FEATURES] = {1.0f};
    give_classifier(0, 2, 16);
    const bslam_sighting_t seen = seen_with(unit_polar(0.2, 4.4, -1), alike);
    const bslam_sighting_t plain = seen_with(unit_polar(0.2, 4.4, -1), PLAIN);
    const bslam_sighting_t farther = seen_with(unit_polar(1.5, 4.4, -1), alike);
    decision_t d = decide(&ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_APPEARANCE, -1);
    d = decide(&ekf, &settings, &plain, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
    d = decide(&ekf, &settings, &farther, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
}

static void test_far_and_alike_is_new_where_classifiers_are_young_or_the_class_is_another(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const float alike[BSLAM_SAMPLE_FEATURES] = {1.0f};
    bslam_sighting_t seen = seen_with(unit_polar(0.2, 4.4, -1), alike);
    give_classifier(0, 2, 2);
    decision_t d = decide(&ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
    appearance.learner.classifiers[0].samples = 16;
    appearance.of[0].seen_as[2] = 10;
    seen.beacon_class = 3;
    d = decide(&ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_APPEARANCE, -1);
    seen.beacon_class = 4;
    d = decide(&ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
}

/// Waited for as long as is waited for anything, it is new, if the robot is where it thinks: another beacon
/// was seen where it should be.
static void test_far_but_clearly_alike_is_new_after_a_while(void **state)
{
    const bslam_settings_t settings = svm_params();
    const double two[2][2] = {{4, 0}, {0, 4}};
    bslam_ekf_t ekf = unit_map_of(&settings, two, 2);
    const float alike[BSLAM_SAMPLE_FEATURES] = {1.0f};
    give_classifier(0, 2, 16);
    const bslam_sighting_t seen = seen_with(unit_polar(0.2, 4.4, -1), alike);
    ekf.beacons[1].confirmed = true;
    ekf.beacons[1].last_seen_us = 9500000;
    bslam_appearance_note_delay(&appearance, &settings, 0, 9000000);
    decision_t d = decide_at(9999998, &ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_APPEARANCE, -1);
    assert_int_equal(d.records[0].match.delayed_for, 0);
    d = decide_at(10000000, &ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
    assert_int_equal(d.records[0].match.delayed_for, -1);
    ekf.beacons[1].last_seen_us = 8900000;
    d = decide_at(10000000, &ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_APPEARANCE, -1);
    ekf.beacons[0].confirmed = true;  // that one itself is no witness
    ekf.beacons[0].last_seen_us = 9500000;
    d = decide_at(10000000, &ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_APPEARANCE, -1);
    ekf.beacons[1].last_seen_us = 9500000;
    ekf.beacons[1].confirmed = false;
    d = decide_at(10000000, &ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_APPEARANCE, -1);
}

/// From where the sensor is it has no direction.
static void test_alike_but_where_the_robot_stands_is_new(void **state)
{
    const bslam_settings_t settings = svm_params();
    const double here[1][2] = {{0, 0}};
    const bslam_ekf_t ekf = unit_map_of(&settings, here, 1);
    const float alike[BSLAM_SAMPLE_FEATURES] = {1.0f};
    give_classifier(0, 2, 16);
    const bslam_sighting_t seen = seen_with(unit_polar(0.2, 4.4, -1), alike);
    const decision_t d = decide(&ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
}

// ---- waiting ----------------------------------------------------------------------------------------------

static const float ALIKE[BSLAM_SAMPLE_FEATURES] = {1.0f};

/// A sighting a little off the beacon's place: that position is for it does not settle it.
static bslam_sighting_t seen_aside(void)
{
    return seen_with(unit_polar(0.06, 4, -1), ALIKE);
}

/// Where a match is delayed, and where nothing like it is: a sighting in the beacon's place, or a
/// little off it, 9 s after that was seen last, when a classifier of so many samples has such a value.
static void assert_waits(double value, int samples, int32_t decision_delay_us, bslam_sighting_t seen,
                         bool is_delayed)
{
    bslam_settings_t settings = svm_params();
    settings.decision_delay_us = decision_delay_us;
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    give_classifier(0, value, samples);
    const decision_t d = decide_at(9000000, &ekf, &settings, &seen, 1);
    assert_int_equal(d.records[0].match.delayed_for, is_delayed ? 0 : -1);
    if (is_delayed) {
        unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_AMBIGUOUS, -1);
    } else {
        unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, 0);
    }
    bslam_appearance_forget(&appearance, 0, 1);
}

static void test_a_match_is_delayed_where_a_young_classifier_is_against_it(void **state)
{
    assert_waits(0.1, 2, 1000000, seen_aside(), true);
    assert_waits(0.15, 2, 1000000, seen_aside(), false);  // for it: 4 * 0.15 - 0.5 > 0
    assert_waits(-0.1, 3, 1000000, seen_aside(), false);  // old enough to be weighed
    assert_waits(-0.1, 2, 0, seen_aside(), false);
    assert_waits(-0.1, 2, 1000000, seen_with(unit_polar(0, 4, -1), ALIKE), false);  // position is enough
}

static void test_a_match_does_not_wait_for_what_is_in_view(void **state)
{
    const bslam_settings_t settings = svm_params();
    bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    give_classifier(0, -0.1, 2);
    const bslam_sighting_t seen = seen_aside();
    ekf.beacons[0].last_seen_us = 5000000;
    const int64_t times_us[] = {4900000, 5000000, 6000000, 6000001};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(decide_at(times_us[i], &ekf, &settings, &seen, 1).records[0].match.delayed_for,
                         i < 3 ? -1 : 0);
    }
}

static void test_a_match_that_has_waited_is_made(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    give_classifier(0, -0.1, 2);
    const bslam_sighting_t seen = seen_aside();
    bslam_appearance_note_delay(&appearance, &settings, 0, 9000000);
    unit_assert_decided(&decide_at(9999998, &ekf, &settings, &seen, 1).records[0].match, BSLAM_VERDICT_DEFER,
                        BSLAM_REASON_AMBIGUOUS, -1);
    unit_assert_decided(&decide_at(10000000, &ekf, &settings, &seen, 1).records[0].match, BSLAM_VERDICT_MATCH,
                        BSLAM_REASON_NONE, 0);
}

static void test_what_matches_no_beacon_is_delayed_for_none(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    give_classifier(0, -0.1, 2);
    const bslam_sighting_t near = seen_with(unit_polar(0.1, 4.4, -1), ALIKE);
    assert_true(position_score(&settings, 4.4, 0.1) < 0.0);
    assert_int_equal(decide_at(9000000, &ekf, &settings, &near, 1).records[0].match.delayed_for, -1);
}

/// A beacon that was not seen for long, and one elsewhere that was seen so long ago: whether a sighting waits
/// for the first.
static bool waits_beside(const bslam_settings_t *settings, int64_t other_ago_us, bool other_counts)
{
    static const double places[2][2] = {{4, 0}, {-4, 3}};
    const int64_t time_us = 9000000;
    bslam_ekf_t ekf = unit_map_of(settings, places, 2);
    ekf.beacons[1].confirmed = other_counts;
    ekf.beacons[1].last_seen_us = time_us - other_ago_us;
    const bslam_sighting_t seen = unit_polar(0.06, 4, -1);
    return decide_at(time_us, &ekf, settings, &seen, 1).records[0].match.delayed_for == 0;
}

/// A robot that another beacon holds in its place loses nothing by waiting.
static void test_a_match_that_little_speaks_for_is_delayed_while_another_is_in_view(void **state)
{
    bslam_settings_t settings = svm_params();
    settings.again_us = 200000;
    const double score = position_score(&settings, 4, 0.06);
    assert_true(score > 0.1 && score < settings.learn_lead);
    settings.decision_delay_score = real(score + 0.01);
    assert_true(waits_beside(&settings, 200000, true));
    assert_false(waits_beside(&settings, 200001, true));
    assert_false(waits_beside(&settings, 200000, false));
    settings.decision_delay_score = real(score - 0.01);
    assert_false(waits_beside(&settings, 200000, true));
    settings.decision_delay_score = real(score + 0.01);
    bslam_appearance_note_delay(&appearance, &settings, 0, 9000000 - settings.decision_delay_us / 2);
    assert_true(waits_beside(&settings, 200000, true));
    bslam_appearance_note_delay(&appearance, &settings, 0, 9000000 - 1);
    settings.decision_delay_us /= 2;  // it has waited
    assert_false(waits_beside(&settings, 200000, true));
}

/// What is delayed holds no beacon for itself.
static void test_a_beacon_that_one_sighting_is_delayed_for_goes_to_another(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const float other[BSLAM_SAMPLE_FEATURES] = {-1.0f};
    give_classifier(0, -1.5, 2);
    const bslam_sighting_t seen[] = {seen_with(unit_polar(0, 4, -1), ALIKE),
                                     seen_with(unit_polar(0.01, 4, -1), other)};
    const decision_t d = decide_at(9000000, &ekf, &settings, seen, 2);
    assert_int_not_equal(d.records[0].match.verdict, BSLAM_VERDICT_MATCH);
    assert_int_equal(d.records[0].match.delayed_for, -1);
    unit_assert_decided(&d.records[1].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, 0);
}

// ---- several ----------------------------------------------------------------------------------------------

static const double pair[2][2] = {{4, 0}, {4, 0.4}};

static void test_one_to_one_the_clearest_choice_first(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, pair, 2);
    const bslam_sighting_t seen[] = {unit_polar(0.1, 4.02, -1), unit_polar(0, 4, -1)};
    const decision_t d = decide(&ekf, &settings, seen, 2);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, 1);
    unit_assert_decided(&d.records[1].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, 0);
}

static void test_a_worse_sighting_of_a_taken_beacon_is_a_duplicate(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const bslam_sighting_t seen[] = {unit_polar(0.05, 4.4, -1), unit_polar(0, 4, -1)};
    assert_true(position_score(&settings, 4.4, 0.05) > 0);
    const decision_t d = decide(&ekf, &settings, seen, 2);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_REJECT, BSLAM_REASON_DUPLICATE, -1);
    unit_assert_decided(&d.records[1].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, 0);
}

static void test_two_sightings_that_want_a_beacon_alike_both_wait(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const bslam_sighting_t seen[] = {unit_polar(0.02, 4, -1), unit_polar(-0.02, 4, -1)};
    const decision_t d = decide(&ekf, &settings, seen, 2);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_AMBIGUOUS, -1);
    unit_assert_decided(&d.records[1].match, BSLAM_VERDICT_DEFER, BSLAM_REASON_AMBIGUOUS, -1);
}

static void test_appearance_decides_between_two_in_the_gate(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, pair, 2);
    const float signature[BSLAM_SAMPLE_FEATURES] = {1.0f};
    give_classifier(0, -1.5, 16);
    give_classifier(1, 1.5, 16);
    // Half way between them, a little nearer to the first.
    const bslam_sighting_t seen = seen_with(unit_polar(0.045, 4, -1), signature);
    const decision_t d = decide(&ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, 1);
    bslam_sighting_t blind = seen;
    blind.signature = NULL;
    assert_int_equal(decide(&ekf, &settings, &blind, 1).records[0].match.beacon, 0);
}

static void test_sure_enough_to_learn_from(void **state)
{
    bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const float signature[BSLAM_SAMPLE_FEATURES] = {1.0f};
    const bslam_sighting_t near = seen_with(unit_polar(0, 4, -1), signature);
    const bslam_sighting_t far = seen_with(unit_polar(0.05, 4.4, -1), signature);
    // Young: position alone says so. The farther one does not lead enough.
    assert_true(decide(&ekf, &settings, &near, 1).records[0].match.sure ==
                (position_score(&settings, 4, 0) >= 4));
    assert_false(decide(&ekf, &settings, &far, 1).records[0].match.sure);
    give_classifier(0, 1, 16);
    assert_true(decide(&ekf, &settings, &near, 1).records[0].match.sure);
    // Grown up, and its classifier says no.
    appearance.learner.classifiers[0].weights.unit = -appearance.learner.classifiers[0].weights.unit;
    assert_false(decide(&ekf, &settings, &near, 1).records[0].match.sure);
    // Or says yes, but not enough, however much the beacon leads by what else is known of it.
    settings.learn_margin = BSLAM_R(0.5);
    settings.learn_lead = BSLAM_R(-20.0);
    assert_false(decide(&ekf, &settings, &near, 1).records[0].match.sure);
    settings.learn_margin = BSLAM_R(-1.5);
    assert_true(decide(&ekf, &settings, &near, 1).records[0].match.sure);
}

static void test_directions_alone_have_their_own_density_of_new(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const bslam_sighting_t seen = unit_direction(0.01, -1);
    bslam_innovation_t innovation;
    assert_int_equal(bslam_ekf_innovation(&ekf, &settings, &on_axle, &seen, 0, &innovation), BSLAM_OK);
    const double variance = 0.01 / 16 + (double)innovation.bearing_var_rad2;
    const double expected =
        -0.5 * 0.01 * 0.01 / variance - 0.5 * log(6.283185307179586 * variance) - log(0.3);
    const decision_t d = decide(&ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, 0);
    assert_near(d.records[0].match.score, expected, 1e-4);
}

static void test_an_unmappable_sighting_is_rejected(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    bslam_sighting_t seen = unit_polar(0, 4, -1);
    seen.beacon_class = BSLAM_CLASS_NOT_MAPPABLE;
    const decision_t d = decide(&ekf, &settings, &seen, 1);
    unit_assert_decided(&d.records[0].match, BSLAM_VERDICT_REJECT, BSLAM_REASON_CLASS, -1);
}

/// A heading that is 0.1 rad off displaces all sightings alike: given one, the other is where it should be.
static void test_conditional_on_a_match_the_others_are_surer(void **state)
{
    const bslam_settings_t settings = svm_params();
    static const double places[2][2] = {{4, 0}, {0, 4}};
    bslam_ekf_t ekf = unit_map_of(&settings, places, 2);
    covariance_forget(&ekf, BSLAM_STATE_THETA, 0.01);
    const bslam_sighting_t seen[] = {unit_polar(0.1, 4, -1), unit_polar(1.570796 + 0.1, 4, -1)};
    bslam_innovation_t innovations[2];
    for (int i = 0; i < 2; i++) {
        assert_int_equal(bslam_ekf_innovation(&ekf, &settings, &on_axle, &seen[i], i, &innovations[i]),
                         BSLAM_OK);
    }
    static bslam_conditional_t conditional;
    bslam_conditional_init(&conditional);
    bslam_weight_t alone;
    bslam_weight_t after;
    assert_int_equal(bslam_conditional_weigh(&ekf, &conditional, &innovations[1], &alone), BSLAM_OK);
    assert_true(bslam_conditional_add(&ekf, &conditional, &innovations[0]));
    assert_int_equal(bslam_conditional_weigh(&ekf, &conditional, &innovations[1], &after), BSLAM_OK);
    // By hand: S = [[a, b], [b, a]] of the two directions, b the variance of the heading.
    const double b = 0.01;
    const double a = b + 0.01 / 16 + (double)innovations[1].bearing_var_rad2;
    const double left = a - b * b / a;
    const double y = 0.1 - b / a * 0.1;
    const double range_var = 0.01 + (double)innovations[1].range_var_m2;
    assert_near(alone.distance2, 0.01 / a, 1e-4);
    assert_near(after.distance2, y * y / left, 1e-4);
    assert_near(after.log_density, -0.5 * y * y / left - log(6.283185307179586 * sqrt(left * range_var)),
                1e-3);
}

static void test_conditional_takes_no_more_than_it_has_room_for(void **state)
{
    const bslam_settings_t settings = svm_params();
    const bslam_ekf_t ekf = unit_map_of(&settings, ahead, 1);
    const bslam_sighting_t seen = unit_polar(0, 4, -1);
    bslam_innovation_t innovation;
    assert_int_equal(bslam_ekf_innovation(&ekf, &settings, &on_axle, &seen, 0, &innovation), BSLAM_OK);
    static bslam_conditional_t conditional;
    bslam_conditional_init(&conditional);
    for (int i = 0; i < BSLAM_CONDITIONAL_MAX; i++) {
        assert_true(bslam_conditional_add(&ekf, &conditional, &innovation));
    }
    assert_false(bslam_conditional_add(&ekf, &conditional, &innovation));
    assert_int_equal(conditional.count, 2 * BSLAM_CONDITIONAL_MAX);
    bslam_weight_t weight;
    assert_int_equal(bslam_conditional_weigh(&ekf, &conditional, &innovation, &weight), BSLAM_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_a_class_counts_as_its_log_odds_say, setup),
        cmocka_unit_test_setup(test_a_distance_by_another_class_is_not_held_against_it, setup),
        cmocka_unit_test_setup(test_score_is_equation_47_without_appearance, setup),
        cmocka_unit_test_setup(test_score_adds_the_odds_of_being_seen_again, setup),
        cmocka_unit_test_setup(test_what_was_matched_with_little_is_hardly_held, setup),
        cmocka_unit_test_setup(test_another_class_has_no_odds_of_being_seen_again, setup),
        cmocka_unit_test_setup(test_a_distant_beacon_seen_again_is_no_newcomer, setup),
        cmocka_unit_test_setup(test_score_adds_what_appearance_says_as_samples_come, setup),
        cmocka_unit_test_setup(test_score_of_appearance_is_clipped, setup),
        cmocka_unit_test_setup(test_a_signature_that_is_no_number_is_as_none, setup),
        cmocka_unit_test_setup(test_a_classifier_without_competitors_says_nothing, setup),
        cmocka_unit_test_setup(test_between_match_and_new_a_sighting_is_deferred, setup),
        cmocka_unit_test_setup(test_what_is_nearly_an_old_beacon_that_does_not_count_is_new, setup),
        cmocka_unit_test_setup(test_what_is_called_otherwise_than_an_old_beacon_that_does_not_count_is_new,
                               setup),
        cmocka_unit_test_setup(test_appearance_that_differs_makes_a_sighting_in_the_gate_new, setup),
        cmocka_unit_test_setup(test_far_but_clearly_alike_is_not_new, setup),
        cmocka_unit_test_setup(test_far_but_clearly_alike_is_new_after_a_while, setup),
        cmocka_unit_test_setup(test_far_and_alike_is_new_where_classifiers_are_young_or_the_class_is_another,
                               setup),
        cmocka_unit_test_setup(test_alike_but_where_the_robot_stands_is_new, setup),
        cmocka_unit_test_setup(test_a_match_is_delayed_where_a_young_classifier_is_against_it, setup),
        cmocka_unit_test_setup(test_a_match_does_not_wait_for_what_is_in_view, setup),
        cmocka_unit_test_setup(test_a_match_that_has_waited_is_made, setup),
        cmocka_unit_test_setup(test_what_matches_no_beacon_is_delayed_for_none, setup),
        cmocka_unit_test_setup(test_a_match_that_little_speaks_for_is_delayed_while_another_is_in_view,
                               setup),
        cmocka_unit_test_setup(test_a_beacon_that_one_sighting_is_delayed_for_goes_to_another, setup),
        cmocka_unit_test_setup(test_one_to_one_the_clearest_choice_first, setup),
        cmocka_unit_test_setup(test_a_worse_sighting_of_a_taken_beacon_is_a_duplicate, setup),
        cmocka_unit_test_setup(test_two_sightings_that_want_a_beacon_alike_both_wait, setup),
        cmocka_unit_test_setup(test_appearance_decides_between_two_in_the_gate, setup),
        cmocka_unit_test_setup(test_score_adds_the_odds_of_the_side, setup),
        cmocka_unit_test_setup(test_in_doubt_of_its_place_a_robot_knows_no_side, setup),
        cmocka_unit_test_setup(test_only_what_has_a_place_in_the_map_has_sides, setup),
        cmocka_unit_test_setup(test_sure_enough_to_learn_from, setup),
        cmocka_unit_test_setup(test_directions_alone_have_their_own_density_of_new, setup),
        cmocka_unit_test_setup(test_an_unmappable_sighting_is_rejected, setup),
        cmocka_unit_test_setup(test_conditional_on_a_match_the_others_are_surer, setup),
        cmocka_unit_test_setup(test_conditional_takes_no_more_than_it_has_room_for, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
