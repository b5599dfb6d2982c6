#include "covariance.h"
#include "known_map.h"
#include "support.h"

#include <math.h>

#include "bslam/association/association.h"
#include "bslam/model/noise.h"
#include "plain_settings.h"

enum { SIGHTINGS_MAX = 4 };

static const bslam_pose_t on_axle = {0, 0, 0};
static const float ALIKE[BSLAM_SAMPLE_FEATURES] = {1.0f}, UNLIKE[BSLAM_SAMPLE_FEATURES] = {-1.0f};
static const double AGAIN_ODDS = 4.2, TWO_PI = 6.283185307179586;
static const double SLIP_VAR_M2 = 1, SLIP_VAR_RAD2 = 0.25, SLIP_NATS = 5;
static const double ahead[1][2] = {{4, 0}}, pair[2][2] = {{4, 0}, {4, 0.4}};

static bslam_appearance_t appearance;
static bslam_settings_t settings;
static bslam_ekf_t ekf;
static bslam_sighting_frame_t frame;
static bslam_record_t records[SIGHTINGS_MAX];

static void begin(const double (*places)[2], int count)
{
    ekf = unit_map_of(&settings, places, count);
    frame = (bslam_sighting_frame_t){
        .ekf = &ekf, .settings = &settings, .appearance = &appearance, .mount = &on_axle};
}

/// A beacon 4 m ahead, of which nothing but its place is known.
static int setup(void **state)
{
    settings = unit_settings();
    settings.association = BSLAM_ASSOCIATION_SVM;
    settings.candidate_d2 = 30;
    settings.new_per_m2 = BSLAM_R(0.02);
    settings.new_per_rad = BSLAM_R(0.3);
    begin(ahead, 1);
    return bslam_appearance_init(&appearance, NULL, 0) == BSLAM_OK ? 0 : -1;
}

/// By position alone.
static int setup_position(void **state)
{
    setup(state);
    settings.association = BSLAM_ASSOCIATION_POSITION;
    frame.appearance = NULL;
    return 0;
}

static bslam_sighting_t seen_with(bslam_sighting_t sighting, const float *signature)
{
    sighting.signature = signature;
    return sighting;
}

static bslam_sighting_t seen_as(bslam_sighting_t sighting, uint8_t beacon_class)
{
    sighting.beacon_class = beacon_class;
    return sighting;
}

/// What becomes of the first of some sightings; the others' matches are in `records`.
static const bslam_match_t *decide(const bslam_sighting_t *seen, int count)
{
    frame.sightings = seen;
    frame.count = count;
    memset(records, 0x77, sizeof records);
    bslam_associate_likely(&frame, records);
    return &records[0].match;
}

static double score_of(bslam_sighting_t seen)
{
    return (double)decide(&seen, 1)->score;
}

static void assert_match(int i, int beacon)
{
    unit_assert_decided(&records[i].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, beacon);
}

static void assert_new(int i)
{
    unit_assert_decided(&records[i].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
}

static void assert_goes_to(bslam_sighting_t seen, int beacon)
{
    (void)decide(&seen, 1);
    if (beacon == BSLAM_CHOICE_NEW) {
        assert_new(0);
    } else {
        assert_match(0, beacon);
    }
}

/// Variances of the distance and the direction of a beacon straight ahead at (4, 0): the map's and the
/// sensor's.
static double range_var_ahead(void)
{
    const bslam_sighting_t plain = unit_polar(0, 4, -1);
    return 0.01 + (double)bslam_range_variance_m2(&settings, &plain, 4);
}

static double bearing_var_ahead(void)
{
    const bslam_sighting_t plain = unit_polar(0, 4, -1);
    return 0.01 / 16 + (double)bslam_bearing_variance_rad2(&settings, &plain);
}

static double distance2_ahead(double range_m, double bearing_rad)
{
    const double range = range_m - 4;
    return range * range / range_var_ahead() + bearing_rad * bearing_rad / bearing_var_ahead();
}

/// Log density of what is seen so, for that beacon, with so much more variance.
static double density_vague(double range_m, double bearing_rad, double more_m2, double more_rad2)
{
    const double range_var = range_var_ahead() + more_m2, bearing_var = bearing_var_ahead() + more_rad2;
    const double range = range_m - 4;
    const double distance2 = range * range / range_var + bearing_rad * bearing_rad / bearing_var;
    return -0.5 * distance2 - log(TWO_PI * sqrt(range_var * bearing_var));
}

static double density_ahead(double range_m, double bearing_rad)
{
    return density_vague(range_m, bearing_rad, 0, 0);
}

/// If the wheels have slipped.
static double density_slipped(double range_m, double bearing_rad)
{
    return density_vague(range_m, bearing_rad, SLIP_VAR_M2,
                         SLIP_VAR_RAD2 + SLIP_VAR_M2 / (range_m * range_m));
}

static double density_new(double range_m)
{
    return log((double)settings.new_per_m2 * range_m);
}

static double position_score(double range_m, double bearing_rad)
{
    return density_ahead(range_m, bearing_rad) - density_new(range_m);
}

static double odds_of_alike(void)
{
    bslam_sample_t sample;
    assert_int_equal(bslam_sample_encode(ALIKE, &sample), BSLAM_OK);
    return (double)bslam_appearance_odds(&appearance, &settings, 0, &sample);
}

// ---- the score --------------------------------------------------------------------------------------------

static void test_score_is_the_log_odds_of_the_place(void **state)
{
    const bslam_sighting_t seen = unit_polar(0.01, 4.1, -1);
    const bslam_match_t *match = decide(&seen, 1);
    assert_match(0, 0);
    assert_near(match->score, position_score(4.1, 0.01), 1e-4);
    assert_near(match->log_density, density_ahead(4.1, 0.01), 1e-4);
    assert_near(match->looks, 0, 0);
    assert_near(match->lead, match->score, 0);  // against a new one
}

static void test_score_of_a_direction_has_its_own_density_of_new_ones(void **state)
{
    const bslam_sighting_t seen = unit_direction(0.01, -1);
    bslam_innovation_t innovation;
    assert_int_equal(bslam_ekf_innovation(&ekf, &settings, &on_axle, &seen, 0, &innovation), BSLAM_OK);
    const double variance = 0.01 / 16 + (double)innovation.bearing_var_rad2;
    const double expected = -0.5 * 0.01 * 0.01 / variance - 0.5 * log(TWO_PI * variance) - log(0.3);
    assert_near(score_of(seen), expected, 1e-4);
    assert_match(0, 0);
}

static void test_score_has_the_odds_of_what_was_just_seen(void **state)
{
    ekf.beacons[0].last_seen_us = 1000000;
    const int64_t times_us[] = {1000000, 1000001, 1200000, 1200001};
    const double odds[] = {0, AGAIN_ODDS, AGAIN_ODDS, 0};
    for (int i = 0; i < COUNT_OF(times_us); i++) {
        frame.time_us = times_us[i];
        assert_near(score_of(unit_polar(0.01, 4.1, -1)), position_score(4.1, 0.01) + odds[i], 1e-4);
    }
    // Called something else it is not seen again.
    frame.time_us = 1000001;
    ekf.beacons[0].beacon_class = 3;
    assert_near(score_of(seen_as(unit_polar(0, 4, -1), 3)), position_score(4, 0) + AGAIN_ODDS, 1e-4);
    assert_near(score_of(seen_as(unit_polar(0, 4, -1), 4)), position_score(4, 0), 1e-4);
}

static void test_score_has_what_its_sample_says(void **state)
{
    const double values[] = {-0.25, 0.25, 0.75};
    for (int i = 0; i < COUNT_OF(values); i++) {
        unit_give_machine(&appearance, 0, values[i], 3);
        const double odds = odds_of_alike();
        assert_true(odds > 1 && odds < 7.5);  // of each another, and none of them clipped
        assert_near(score_of(seen_with(unit_polar(0, 4, -1), ALIKE)), position_score(4, 0) + odds, 1e-4);
        assert_near(records[0].match.looks, odds, 1e-6);
        assert_near(records[0].match.log_density, density_ahead(4, 0), 1e-4);
    }
    const float broken[BSLAM_SAMPLE_FEATURES] = {1.0f, NAN};
    assert_near(score_of(seen_with(unit_polar(0, 4, -1), broken)), position_score(4, 0), 1e-4);
}

static void test_score_has_the_log_odds_of_the_class(void **state)
{
    appearance.of[0].seen_as[2] = 10;
    const double odds[] = {log(8 * 10.1 / 10.8), log(8 * 0.1 / 10.8)};
    for (int k = 0; k < 2; k++) {
        assert_near(score_of(seen_as(unit_polar(0, 4, -1), (uint8_t)(3 + k))), position_score(4, 0) + odds[k],
                    1e-3);
        assert_near(records[0].match.looks, odds[k], 1e-5);
    }
}

/// How much too long a beacon's distances are goes with its class: taken for another, a sighting has but a
/// direction, and a distance that may be anything from a third to three times of what it is.
static void test_a_distance_by_another_class_is_not_held_against_it(void **state)
{
    assert_true(bslam_ekf_give_scale(&ekf, 0, BSLAM_R(0.0036)));
    ekf.beacons[0].beacon_class = 3;
    const double of_direction = score_of(seen_as(unit_direction(0.01, -1), 4));
    const double of_distance = log(0.3) - density_new(2) - log(2 * log(9));
    assert_near(score_of(seen_as(unit_polar(0.01, 2, -1), 4)), of_direction + of_distance, 1e-3);
    assert_match(0, 0);
    assert_goes_to(seen_as(unit_polar(0.01, 2, -1), 3), BSLAM_CHOICE_NEW);
}

// ---- one sighting -----------------------------------------------------------------------------------------

static void test_a_score_below_0_is_a_new_beacons(void **state)
{
    assert_true(position_score(4.6, 0) > 0 && position_score(4.75, 0) < 0);
    assert_goes_to(unit_polar(0, 4.6, -1), 0);
    assert_near(score_of(unit_polar(0, 4.75, -1)), position_score(4.75, 0), 1e-4);
    assert_new(0);
    assert_near(records[0].match.lead, -position_score(4.75, 0), 1e-4);
    assert_near(records[0].match.log_density, density_new(4.75), 1e-5);
}

static void test_looks_make_what_is_in_the_gate_new(void **state)
{
    unit_give_machine(&appearance, 0, 3, 16);
    const bslam_sighting_t seen = unit_polar(0.06, 4.45, -1);
    assert_goes_to(seen_with(seen, ALIKE), 0);
    assert_goes_to(seen_with(seen, UNLIKE), BSLAM_CHOICE_NEW);
    assert_near(records[0].match.looks, 0, 0);  // nobody knows a new one's
}

/// Beyond candidate_d2 nothing is weighed.
static void test_what_is_far_off_is_new(void **state)
{
    const bslam_sighting_t seen = unit_polar(0.2, 4, -1);
    assert_true(score_of(seen) < -1e6);
    assert_new(0);
    settings.candidate_d2 = 50;
    assert_true(score_of(seen) > -1e6);
}

static void test_in_an_empty_map_all_is_new(void **state)
{
    begin(NULL, 0);
    const bslam_sighting_t seen[] = {unit_polar(0, 4, -1), unit_direction(1, -1)};
    assert_true((double)decide(seen, 2)->lead > 1e6);
    assert_new(0);
    assert_new(1);
}

static void test_an_unmappable_sighting_is_rejected(void **state)
{
    const bslam_sighting_t seen = seen_as(unit_polar(0, 4, -1), BSLAM_CLASS_NOT_MAPPABLE);
    (void)decide(&seen, 1);
    unit_assert_decided(&records[0].match, BSLAM_VERDICT_REJECT, BSLAM_REASON_CLASS, -1);
}

/// Near its place and ahead of any other choice.
static void test_sure_enough_to_learn_from(void **state)
{
    const bslam_sighting_t seen[] = {unit_polar(0, 4, -1), unit_polar(0.09, 4, -1)};
    settings.new_per_m2 = BSLAM_R(1e-4);
    assert_true(decide(&seen[0], 1)->sure);
    settings.new_per_m2 = BSLAM_R(0.2);
    assert_true((double)decide(&seen[0], 1)->lead < 4 && !records[0].match.sure);
    settings.new_per_m2 = BSLAM_R(1e-5);
    settings.bearing_sd_rad = BSLAM_R(0.015);
    assert_true((double)decide(&seen[1], 1)->lead > 4);
    assert_true(records[0].match.distance2 > 9 && !records[0].match.sure);
}

// ---- a slip of the wheels ---------------------------------------------------------------------------------

/// A confirmed beacon 4 m ahead, to whose appearance ALIKE is alike.
static int setup_alike(void **state)
{
    setup(state);
    ekf.beacons[0].confirmed = true;
    unit_give_machine(&appearance, 0, 3, 16);
    return 0;
}

/// Far off, but no farther than a slip may have turned and moved the robot.
static bslam_sighting_t far_off(const float *signature)
{
    return seen_with(unit_polar(0.3, 4.3, -1), signature);
}

static void test_where_nothing_holds_the_wheels_may_have_slipped(void **state)
{
    const double odds = odds_of_alike(), density = density_slipped(4.3, 0.3);
    assert_goes_to(far_off(ALIKE), 0);
    assert_true(records[0].match.slipped);
    assert_near(records[0].match.looks, odds, 1e-5);
    assert_near(records[0].match.log_density, density, 1e-4);
    assert_near(records[0].match.score, density - density_new(4.3) + odds - SLIP_NATS, 1e-4);
    assert_near(records[0].match.lead, records[0].match.score, 0);
    assert_goes_to(far_off(UNLIKE), BSLAM_CHOICE_NEW);
    assert_goes_to(seen_with(unit_polar(0, 4, -1), ALIKE), 0);
    assert_false(records[0].match.slipped);
}

/// However clear it is: the filter knows of no slip, and nothing is learned from it.
static void test_after_a_slip_a_beacon_is_as_far_off_as_it_is_seen(void **state)
{
    settings.new_per_m2 = BSLAM_R(1e-5);
    assert_goes_to(far_off(ALIKE), 0);
    assert_near(records[0].match.distance2, distance2_ahead(4.3, 0.3), 1e-3);
    assert_true(records[0].match.lead > 10);
    assert_false(records[0].match.sure);
}

/// A place that may be taken for right is weighed as ever, where a slip would make it the better choice, too.
static void test_what_may_be_in_its_place_has_not_slipped(void **state)
{
    const double odds = odds_of_alike(), off_rad = 0.16;
    const bslam_sighting_t seen = seen_with(unit_polar(off_rad, 4, -1), ALIKE);
    assert_true(distance2_ahead(4, off_rad) > 9 && distance2_ahead(4, off_rad) < 29);
    settings.new_per_m2 = BSLAM_R(0.2);
    assert_near(score_of(seen), position_score(4, off_rad) + odds, 1e-3);
    assert_new(0);
    settings.candidate_d2 = real(distance2_ahead(4, off_rad) - 1);
    const double slipped = density_slipped(4, off_rad) - density_new(4) + odds - SLIP_NATS;
    assert_true(slipped > 1);
    assert_near(score_of(seen), slipped, 1e-3);
    assert_match(0, 0);
}

static void test_a_slip_moves_directions_as_if_from_afar(void **state)
{
    const bslam_sighting_t seen = unit_direction(0.3, -1);
    bslam_innovation_t innovation;
    assert_int_equal(bslam_ekf_innovation(&ekf, &settings, &on_axle, &seen, 0, &innovation), BSLAM_OK);
    const double per_m = (double)settings.ray_inverse_distance_per_m;
    const double variance =
        0.01 / 16 + (double)innovation.bearing_var_rad2 + SLIP_VAR_RAD2 + SLIP_VAR_M2 * per_m * per_m;
    assert_goes_to(seen_with(seen, ALIKE), 0);
    assert_true(records[0].match.slipped);
    assert_near(records[0].match.log_density, -0.5 * 0.3 * 0.3 / variance - 0.5 * log(TWO_PI * variance),
                1e-4);
}

/// Where nothing is known of its appearance it would have to be seen where new ones are rare.
static void test_a_slip_has_its_price(void **state)
{
    const double density = density_slipped(4.3, 0.3);
    assert_goes_to(far_off(NULL), BSLAM_CHOICE_NEW);
    settings.new_per_m2 = real(exp(density - SLIP_NATS + 0.05) / 4.3);
    assert_goes_to(far_off(NULL), BSLAM_CHOICE_NEW);
    settings.new_per_m2 = real(exp(density - SLIP_NATS - 0.05) / 4.3);
    assert_goes_to(far_off(NULL), 0);
}

static void test_a_slip_goes_no_farther_than_a_candidate(void **state)
{
    const bslam_sighting_t seen = seen_with(unit_polar(3, 4, -1), ALIKE);
    settings.candidate_d2 = 20;
    assert_true(score_of(seen) < -1e6);
    assert_new(0);
    settings.candidate_d2 = 50;
    assert_true(score_of(seen) > -1e6);
}

/// One beacon that is where it should be, and counts, is enough.
static void test_where_a_beacon_holds_nothing_has_slipped(void **state)
{
    static const double places[2][2] = {{4, 0}, {0, 4}};
    begin(places, 2);
    ekf.beacons[0].confirmed = true;
    settings.new_per_m2 = BSLAM_R(1e-4);
    const double off_rad[] = {0, 0, 0.11};
    for (int i = 0; i < 2 * COUNT_OF(off_rad); i++) {
        const int at = i % 2, other = 1 - at, holds = i / 2;  // in either order
        ekf.beacons[1].confirmed = holds != 1;
        bslam_sighting_t seen[2];
        seen[at] = far_off(ALIKE);
        seen[other] = unit_polar(TWO_PI / 4 + off_rad[holds], 4, -1);
        (void)decide(seen, 2);
        assert_match(other, 1);
        assert_true((records[other].match.distance2 > 9) == (holds == 2));
        assert_false(records[other].match.slipped);
        if (holds == 0) {
            assert_new(at);
        } else {
            assert_match(at, 0);
            assert_true(records[at].match.slipped);
        }
    }
}

/// Two that resemble one beacon: it is the clearer one's, whichever comes first.
static void test_after_a_slip_the_clearest_choice_comes_first(void **state)
{
    const bslam_sighting_t near = far_off(ALIKE), farther = seen_with(unit_polar(0.6, 4.3, -1), ALIKE);
    assert_goes_to(farther, 0);
    for (int at = 0; at < 2; at++) {
        bslam_sighting_t seen[2];
        seen[at] = near;
        seen[1 - at] = farther;
        (void)decide(seen, 2);
        assert_match(at, 0);
        assert_new(1 - at);
    }
}

/// What has slipped holds nothing: the wheels have slipped for all that is seen, in either order.
static void test_after_a_slip_all_may_be_elsewhere(void **state)
{
    static const double places[2][2] = {{4, 0}, {0, 4}};
    begin(places, 2);
    unit_give_machine(&appearance, 1, -3, 16);
    ekf.beacons[0].confirmed = ekf.beacons[1].confirmed = true;
    covariance_forget(&ekf, BSLAM_STATE_THETA, 0.0026);  // so that one match says something of the other
    settings.new_per_m2 = BSLAM_R(0.2);                  // and neither is clear
    bslam_match_t alike[2], unlike[2];
    for (int at = 0; at < 2; at++) {
        bslam_sighting_t seen[2];
        seen[at] = seen_with(unit_polar(0.5, 4.3, -1), ALIKE);
        seen[1 - at] = seen_with(unit_polar(TWO_PI / 4 + 0.7, 4, -1), UNLIKE);
        (void)decide(seen, 2);
        assert_match(at, 0);
        assert_match(1 - at, 1);
        alike[at] = records[at].match;
        unlike[at] = records[1 - at].match;
        assert_true(alike[at].slipped && unlike[at].slipped);
        assert_true(alike[at].lead < 4 && unlike[at].lead < 4);
    }
    assert_near(alike[0].score, alike[1].score, 1e-6);
    assert_near(unlike[0].score, unlike[1].score, 1e-6);
    assert_near(alike[0].distance2, alike[1].distance2, 1e-6);
    assert_near(unlike[0].distance2, unlike[1].distance2, 1e-6);
}

/// A beacon that counts for nothing yet holds nothing, but its match says where the robot looks. Of two
/// directions that share the heading's variance b, S = [[a, b], [b, a]].
static void test_a_slip_is_weighed_given_the_matches_before(void **state)
{
    static const double places[2][2] = {{4, 0}, {0, 4}};
    begin(places, 2);
    ekf.beacons[0].confirmed = true;
    covariance_forget(&ekf, BSLAM_STATE_THETA, 0.0026);
    const double b = 0.0026, a = b + bearing_var_ahead(), first = 0.1, off = 0.5;
    const bslam_sighting_t seen[] = {seen_with(unit_polar(off, 4, -1), ALIKE),
                                     unit_polar(TWO_PI / 4 + first, 4, -1)};
    (void)decide(seen, 2);
    assert_match(1, 1);
    assert_match(0, 0);
    assert_true(records[0].match.slipped);
    const double left = off - b / a * first, variance = a - b * b / a;
    assert_near(records[0].match.distance2, left * left / variance, 0.02);
    const double more = variance + SLIP_VAR_RAD2 + SLIP_VAR_M2 / 16;
    assert_near(records[0].match.log_density,
                -0.5 * left * left / more - log(TWO_PI * sqrt(more * (range_var_ahead() + SLIP_VAR_M2))),
                1e-3);
}

static void test_what_is_barred_is_not_taken_after_a_slip(void **state)
{
    const bslam_bar_t bar = {0, 1, {0}};
    frame.bar = &bar;
    assert_goes_to(far_off(ALIKE), BSLAM_CHOICE_NEW);
}

/// What may be no beacon says nothing of the wheels.
static void test_only_what_is_confirmed_tells_of_a_slip(void **state)
{
    assert_goes_to(far_off(ALIKE), 0);
    ekf.beacons[0].confirmed = false;
    assert_goes_to(far_off(ALIKE), BSLAM_CHOICE_NEW);
    assert_goes_to(seen_with(unit_polar(0, 4, -1), ALIKE), 0);
}

/// However rare new ones are: by position alone anything in view might be meant.
static void test_without_an_appearance_nothing_has_slipped(void **state)
{
    settings.new_per_m2 = BSLAM_R(1e-5);
    assert_goes_to(far_off(NULL), 0);
    frame.appearance = NULL;
    assert_goes_to(far_off(NULL), BSLAM_CHOICE_NEW);
}

// ---- without appearance -----------------------------------------------------------------------------------

static void test_by_position_looks_say_nothing(void **state)
{
    unit_give_machine(&appearance, 0, 3, 16);
    assert_near(score_of(seen_with(unit_polar(0, 4, -1), UNLIKE)), position_score(4, 0), 1e-4);
    assert_match(0, 0);
}

/// Nobody counts how often a beacon is called what: another class is another beacon.
static void test_by_position_another_class_is_another_beacon(void **state)
{
    ekf.beacons[0].beacon_class = 3;
    assert_goes_to(seen_as(unit_polar(0, 4, -1), 4), BSLAM_CHOICE_NEW);
    assert_goes_to(seen_as(unit_polar(0, 4, -1), 3), 0);
    assert_goes_to(unit_polar(0, 4, -1), 0);
}

// ---- two beacons ------------------------------------------------------------------------------------------

static void test_lead_is_against_the_next_beacon(void **state)
{
    begin(pair, 2);
    bslam_sighting_t seen = unit_polar(0.03, 4, -1);
    assert_goes_to(seen, 0);
    const double lead = (double)records[0].match.lead;
    assert_true(lead < (double)records[0].match.score - 0.5);
    seen.bearing_rad = real(atan2(0.4, 4) - 0.03);
    assert_goes_to(seen, 1);
    assert_near(records[0].match.lead, lead, 0.2);
}

/// Two that share a classifier, of which one has the better place.
static void test_lookalikes_are_told_apart_by_their_places(void **state)
{
    begin(pair, 2);
    unit_give_machine(&appearance, 0, 1.5, 16);
    appearance.of[1].classifier = appearance.of[0].classifier;
    assert_goes_to(seen_with(unit_polar(0.02, 4, -1), ALIKE), 0);
    assert_goes_to(seen_with(unit_polar(0.08, 4, -1), ALIKE), 1);
}

static void test_looks_decide_between_two_in_the_gate(void **state)
{
    begin(pair, 2);
    unit_give_machine(&appearance, 0, -1.5, 16);
    unit_give_machine(&appearance, 1, 1.5, 16);
    // Half way between them, a little nearer to the first.
    assert_goes_to(seen_with(unit_polar(0.045, 4, -1), ALIKE), 1);
    assert_goes_to(unit_polar(0.045, 4, -1), 0);
}

// ---- what a hypothesis may not choose ---------------------------------------------------------------------

static void test_a_barred_beacon_leaves_the_next_best(void **state)
{
    begin(pair, 2);
    const bslam_bar_t first = {0, 1, {0}}, second = {0, 1, {1}};
    const bslam_sighting_t seen = unit_polar(0.04, 4, -1);
    frame.bar = &second;
    assert_goes_to(seen, 0);
    frame.bar = &first;
    assert_goes_to(seen, 1);
    begin(ahead, 1);
    frame.bar = &first;
    assert_goes_to(seen, BSLAM_CHOICE_NEW);
}

static void test_several_choices_may_be_barred(void **state)
{
    begin(pair, 2);
    const bslam_bar_t both = {0, 2, {0, 1}}, counted = {0, 1, {1, 0}},
                      first_and_new = {0, 2, {0, BSLAM_CHOICE_NEW}};
    const bslam_sighting_t seen = unit_polar(0, 4, -1);
    settings.new_per_m2 = BSLAM_R(0.2);
    frame.bar = &counted;
    assert_goes_to(seen, 0);
    frame.bar = &both;
    assert_goes_to(seen, BSLAM_CHOICE_NEW);
    frame.bar = &first_and_new;
    assert_goes_to(seen, 1);
    assert_true(records[0].match.score < 0);  // new, if that was allowed
}

static void test_where_new_ones_are_barred_the_best_beacon_is_taken(void **state)
{
    const bslam_bar_t bar = {0, 1, {BSLAM_CHOICE_NEW}};
    const bslam_sighting_t seen = unit_polar(0, 4.8, -1);
    assert_goes_to(seen, BSLAM_CHOICE_NEW);
    frame.bar = &bar;
    assert_near(decide(&seen, 1)->score, position_score(4.8, 0), 1e-4);
    assert_match(0, 0);
    settings.candidate_d2 = 20;
    assert_goes_to(unit_polar(3, 4, -1), BSLAM_CHOICE_NEW);  // where there is none
}

static void test_another_sightings_choices_are_not_barred(void **state)
{
    const bslam_bar_t bar = {1, 1, {0}};
    const bslam_sighting_t seen = unit_polar(0.01, 4, -1);
    frame.bar = &bar;
    assert_goes_to(seen, 0);
}

// ---- several sightings ------------------------------------------------------------------------------------

static void test_one_to_one_the_clearest_choice_first(void **state)
{
    begin(pair, 2);
    const bslam_sighting_t seen[] = {unit_polar(0.1, 4.02, -1), unit_polar(0, 4, -1)};
    (void)decide(seen, 2);
    assert_match(0, 1);
    assert_match(1, 0);
}

/// Two of a frame are two things, however well one place fits both.
static void test_a_worse_sighting_of_a_taken_beacon_is_a_new_one(void **state)
{
    const bslam_sighting_t seen[] = {unit_polar(0.05, 4.2, -1), unit_polar(0, 4, -1)};
    settings.new_per_m2 = BSLAM_R(1e-6);
    assert_true(position_score(4.2, 0.05) > 10);
    (void)decide(seen, 2);
    assert_new(0);
    assert_match(1, 0);
}

/// A heading that is 0.1 rad off displaces all alike: given one, the other is where it should be.
static void test_what_is_not_clear_is_weighed_given_the_matches_before(void **state)
{
    static const double places[3][2] = {{4, 0}, {0, 4}, {-0.8, 4}};
    begin(places, 3);
    covariance_forget(&ekf, BSLAM_STATE_THETA, 0.0026);  // as sure as no distance is bent by it
    settings.new_per_m2 = BSLAM_R(1e-5);
    const bslam_sighting_t seen[] = {unit_polar(TWO_PI / 4 + 0.1, 4.04, -1), unit_polar(0.1, 4, -1)};
    assert_true((double)decide(seen, 1)->lead < 2);  // half way between two
    (void)decide(seen, 2);
    assert_match(0, 1);
    assert_match(1, 0);
    assert_true((double)records[0].match.lead > 2);
}

/// Where hypotheses are compared, a density is that of the frame: of a clear choice, too. Of two directions
/// that share the heading's variance b, S = [[a, b], [b, a]].
static void test_exact_densities_are_given_all_matches_before(void **state)
{
    static const double places[2][2] = {{4, 0}, {0, 4}};
    begin(places, 2);
    covariance_forget(&ekf, BSLAM_STATE_THETA, 0.0026);
    settings.new_per_m2 = BSLAM_R(1e-5);
    const bslam_sighting_t seen[] = {unit_polar(0, 4, -1), unit_polar(TWO_PI / 4, 4.1, -1)};
    const double b = 0.0026, a = b + 0.01 / 16 + 0.02 * 0.02;
    (void)decide(seen, 2);
    const double alone = (double)records[1].match.log_density;
    frame.is_exact = true;
    (void)decide(seen, 2);
    assert_match(1, 1);
    assert_near(records[1].match.log_density - alone, -0.5 * log(1 - b / a * b / a), 1e-4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_score_is_the_log_odds_of_the_place, setup),
        cmocka_unit_test_setup(test_score_of_a_direction_has_its_own_density_of_new_ones, setup),
        cmocka_unit_test_setup(test_score_has_the_odds_of_what_was_just_seen, setup),
        cmocka_unit_test_setup(test_score_has_what_its_sample_says, setup),
        cmocka_unit_test_setup(test_score_has_the_log_odds_of_the_class, setup),
        cmocka_unit_test_setup(test_a_distance_by_another_class_is_not_held_against_it, setup),
        cmocka_unit_test_setup(test_a_score_below_0_is_a_new_beacons, setup_position),
        cmocka_unit_test_setup(test_looks_make_what_is_in_the_gate_new, setup),
        cmocka_unit_test_setup(test_what_is_far_off_is_new, setup_position),
        cmocka_unit_test_setup(test_in_an_empty_map_all_is_new, setup),
        cmocka_unit_test_setup(test_an_unmappable_sighting_is_rejected, setup),
        cmocka_unit_test_setup(test_sure_enough_to_learn_from, setup),
        cmocka_unit_test_setup(test_where_nothing_holds_the_wheels_may_have_slipped, setup_alike),
        cmocka_unit_test_setup(test_after_a_slip_a_beacon_is_as_far_off_as_it_is_seen, setup_alike),
        cmocka_unit_test_setup(test_what_may_be_in_its_place_has_not_slipped, setup_alike),
        cmocka_unit_test_setup(test_a_slip_moves_directions_as_if_from_afar, setup_alike),
        cmocka_unit_test_setup(test_a_slip_has_its_price, setup_alike),
        cmocka_unit_test_setup(test_a_slip_goes_no_farther_than_a_candidate, setup_alike),
        cmocka_unit_test_setup(test_where_a_beacon_holds_nothing_has_slipped, setup_alike),
        cmocka_unit_test_setup(test_after_a_slip_the_clearest_choice_comes_first, setup_alike),
        cmocka_unit_test_setup(test_after_a_slip_all_may_be_elsewhere, setup_alike),
        cmocka_unit_test_setup(test_a_slip_is_weighed_given_the_matches_before, setup_alike),
        cmocka_unit_test_setup(test_what_is_barred_is_not_taken_after_a_slip, setup_alike),
        cmocka_unit_test_setup(test_only_what_is_confirmed_tells_of_a_slip, setup_alike),
        cmocka_unit_test_setup(test_without_an_appearance_nothing_has_slipped, setup_alike),
        cmocka_unit_test_setup(test_by_position_looks_say_nothing, setup_position),
        cmocka_unit_test_setup(test_by_position_another_class_is_another_beacon, setup_position),
        cmocka_unit_test_setup(test_lead_is_against_the_next_beacon, setup),
        cmocka_unit_test_setup(test_lookalikes_are_told_apart_by_their_places, setup),
        cmocka_unit_test_setup(test_looks_decide_between_two_in_the_gate, setup),
        cmocka_unit_test_setup(test_a_barred_beacon_leaves_the_next_best, setup),
        cmocka_unit_test_setup(test_several_choices_may_be_barred, setup),
        cmocka_unit_test_setup(test_where_new_ones_are_barred_the_best_beacon_is_taken, setup),
        cmocka_unit_test_setup(test_another_sightings_choices_are_not_barred, setup),
        cmocka_unit_test_setup(test_one_to_one_the_clearest_choice_first, setup),
        cmocka_unit_test_setup(test_a_worse_sighting_of_a_taken_beacon_is_a_new_one, setup),
        cmocka_unit_test_setup(test_what_is_not_clear_is_weighed_given_the_matches_before, setup),
        cmocka_unit_test_setup(test_exact_densities_are_given_all_matches_before, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
