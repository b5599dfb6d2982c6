#include "covariance.h"
#include "known_map.h"
#include "support.h"

#include <math.h>

#include "bslam/association/association.h"
#include "plain_settings.h"

static const bslam_pose_t on_axle = {0, 0, 0};

/// What a method decided of each sighting of a frame.
typedef struct decision {
    bslam_record_t records[8];
} decision_t;

static decision_t decide(bslam_associate_fn method, const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                         const bslam_pose_t *mount, const bslam_sighting_t *sightings, int count)
{
    const bslam_sighting_frame_t frame = {
        .ekf = ekf, .settings = settings, .mount = mount, .sightings = sightings, .count = count};
    decision_t decision;
    memset(&decision, 0x77, sizeof decision);
    method(&frame, decision.records);
    return decision;
}

static void assert_match(const bslam_match_t *match, int beacon)
{
    unit_assert_decided(match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, beacon);
}

static void assert_new(const bslam_match_t *match)
{
    unit_assert_decided(match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
}

static void assert_rejected(const bslam_match_t *match, bslam_reason_t reason)
{
    unit_assert_decided(match, BSLAM_VERDICT_REJECT, reason, -1);
}

static bslam_sighting_t of_class(bslam_sighting_t sighting, uint8_t beacon_class)
{
    sighting.beacon_class = beacon_class;
    return sighting;
}

/// Robot at the origin, looking along x; beacons at (4, 0), (0, 3) and (4, 1), labelled 10, 11, 12, with
/// deviations of 0.1 m in each coordinate.
static bslam_ekf_t three_beacons(const bslam_settings_t *settings)
{
    static const double places[3][2] = {{4, 0}, {0, 3}, {4, 1}};
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, settings);
    for (int i = 0; i < 3; i++) {
        const bslam_sighting_t sighting = unit_polar(0, 1, 0);
        int index;
        assert_int_equal(bslam_ekf_add(&ekf, settings, &on_axle, &sighting, &index), BSLAM_OK);
        bslam_beacon_t *beacon = &ekf.beacons[index];
        beacon->label = 10 + i;
        for (int k = 0; k < 2; k++) {
            ekf.mean[beacon->at + k] = real(places[i][k]);
            covariance_forget(&ekf, beacon->at + k, 0.01);
        }
    }
    return ekf;
}

// ---- known identity ---------------------------------------------------------------------------------------

static void test_known_label_of_the_map_is_a_match_and_another_is_new(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    // Where it is seen plays no part.
    const bslam_sighting_t seen[] = {unit_polar(2, 9, 11), unit_polar(0, 4, 7), unit_direction(1, 10),
                                     unit_polar(0, 4, INT32_MAX)};
    const decision_t d = decide(bslam_associate_known, &ekf, &settings, &on_axle, seen, COUNT_OF(seen));
    assert_match(&d.records[0].match, 1);
    assert_new(&d.records[1].match);
    assert_match(&d.records[2].match, 0);
    assert_new(&d.records[3].match);
}

static void test_known_sighting_without_a_label_is_rejected(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    const bslam_sighting_t seen[] = {unit_polar(0, 4, BSLAM_LABEL_NONE)};
    const decision_t d = decide(bslam_associate_known, &ekf, &settings, &on_axle, seen, 1);
    assert_rejected(&d.records[0].match, BSLAM_REASON_NO_IDENTITY);
}

static bslam_sighting_t with_sd(bslam_sighting_t sighting, double bearing_sd_rad, double range_sd_m)
{
    sighting.bearing_sd_rad = real(bearing_sd_rad);
    sighting.range_sd_m = real(range_sd_m);
    return sighting;
}

/// Sightings of one label, the one to be used first: it is, wherever in the frame it comes.
static void assert_first_is_used(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                 const bslam_sighting_t *twins, int count, bslam_verdict_t expected)
{
    for (int turn = 0; turn < count; turn++) {
        for (int back = 0; back < 2; back++) {
            bslam_sighting_t seen[3];
            for (int i = 0; i < count; i++) {
                seen[(turn + (back ? count - i : i)) % count] = twins[i];
            }
            const decision_t d = decide(bslam_associate_known, ekf, settings, &on_axle, seen, count);
            for (int i = 0; i < count; i++) {
                const bool is_first = memcmp(&seen[i], &twins[0], sizeof seen[i]) == 0;
                assert_int_equal(d.records[i].match.verdict, is_first ? expected : BSLAM_VERDICT_REJECT);
                assert_int_equal(d.records[i].match.reason,
                                 is_first ? BSLAM_REASON_NONE : BSLAM_REASON_DUPLICATE);
            }
        }
    }
}

/// Beacon 10 of the map stands 4 m ahead.
static void test_known_repeated_label_leaves_the_best_in_any_order(void **state)
{
    static const double gates[] = {13.8, 0};
    for (int g = 0; g < COUNT_OF(gates); g++) {
        bslam_settings_t settings = unit_settings();
        settings.gate_d2 = real(gates[g]);
        bslam_ekf_t ekf = three_beacons(&settings);
        ekf.beacons[0].confirmed = true;
        const bslam_sighting_t twins[][3] = {
            // In its mirror image, and a little off.
            {unit_polar(0.01, 4.02, 10), unit_polar(0.9, 2, 10), unit_polar(0.05, 4.2, 10)},
            // Without a distance it is as good where it fits, and less than one that has it.
            {unit_direction(0.01, 10), unit_polar(0.9, 2, 10), unit_direction(1.2, 10)},
            {unit_polar(0.03, 4.1, 10), unit_direction(0, 10), unit_direction(0.01, 10)},
            // As near, and surer; nothing fits.
            {with_sd(unit_polar(0.01, 4.02, 10), 0.01, 0.02), with_sd(unit_polar(0.01, 4.02, 10), 0.05, 0.5),
             with_sd(unit_polar(0.01, 4.02, 10), 0.01, 0.3)},
            {unit_polar(0.9, 2, 10), unit_polar(1.2, 1.5, 10), unit_polar(2, 6, 10)},
        };
        for (int i = 0; i < COUNT_OF(twins); i++) {
            assert_first_is_used(&ekf, &settings, twins[i], 3, BSLAM_VERDICT_MATCH);
        }
    }
}

static void test_known_repeated_label_that_is_new_begins_with_the_surest_in_any_order(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    const bslam_sighting_t twins[][3] = {
        {unit_polar(0.3, 4, 7), unit_polar(0.3, 5, 7), unit_direction(0.3, 7)},
        {with_sd(unit_polar(0.3, 5, 7), 0.01, 0.01), unit_polar(0.3, 4, 7), unit_direction(1, 7)},
        {unit_polar(-0.3, 4, 7), unit_polar(0.3, 4, 7),
         unit_polar(1.3, 4, 7)},  // the same, but for the place
        {with_sd(unit_direction(0.3, 7), 0.001, 0), unit_direction(-0.3, 7), unit_direction(0.1, 7)},
    };
    for (int i = 0; i < COUNT_OF(twins); i++) {
        assert_first_is_used(&ekf, &settings, twins[i], 3, BSLAM_VERDICT_NEW);
    }
}

/// Until one of its beacons is confirmed: what fits one of them before what starts another.
static void test_known_repeated_label_of_tentative_beacons_goes_on_with_what_fits(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.gate_d2 = BSLAM_R(13.8);
    static const double places[2][2] = {{4, 0}, {0, 3}};
    bslam_ekf_t ekf = unit_map_of(&settings, places, 2);
    for (int b = 0; b < 2; b++) {
        ekf.beacons[b].label = 10;
        ekf.beacons[b].confirmed = false;
    }
    const bslam_sighting_t twins[3] = {unit_polar(0.01, 4.02, 10), unit_polar(-1.5, 2, 10),
                                       unit_polar(1.6, 3.2, 10)};
    assert_first_is_used(&ekf, &settings, twins, 3, BSLAM_VERDICT_MATCH);
}

/// A sighting far from all that a label may be starts another competitor, but not without end.
static void test_known_label_has_so_many_competitors_and_no_more(void **state)
{
    enum { NEGATIVES = 8 };
    bslam_settings_t settings = unit_settings();
    settings.gate_d2 = BSLAM_R(13.8);
    static double places[NEGATIVES][2];
    for (int i = 0; i < NEGATIVES; i++) {
        places[i][0] = -4;
        places[i][1] = i;
    }
    for (int negatives = 1; negatives <= NEGATIVES; negatives++) {
        bslam_ekf_t ekf = unit_map_of(&settings, places, negatives);
        for (int b = 0; b < negatives; b++) {
            ekf.beacons[b].label = 10;
            ekf.beacons[b].confirmed = false;
        }
        const bslam_sighting_t far = unit_polar(0, 4, 10);
        const decision_t d = decide(bslam_associate_known, &ekf, &settings, &on_axle, &far, 1);
        assert_int_equal(d.records[0].match.verdict,
                         negatives < NEGATIVES ? BSLAM_VERDICT_NEW : BSLAM_VERDICT_MATCH);
    }
}

/// A competitor where the robot stands has no direction, and so no distance to compare.
static void test_known_competitor_that_cannot_be_weighed_is_not_the_nearest(void **state)
{
    const bslam_settings_t settings = unit_settings();
    static const double places[2][2] = {{4, 0}, {0, 0}};
    bslam_ekf_t ekf = unit_map_of(&settings, places, 2);
    for (int b = 0; b < 2; b++) {
        ekf.beacons[b].label = 10;
        ekf.beacons[b].confirmed = false;
    }
    const bslam_sighting_t seen = unit_polar(0, 4.1, 10);
    const decision_t d = decide(bslam_associate_known, &ekf, &settings, &on_axle, &seen, 1);
    assert_match(&d.records[0].match, 0);
}

static void test_known_not_mappable_sighting_does_not_use_its_label_up(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    const bslam_sighting_t seen[] = {of_class(unit_polar(0, 4, 10), BSLAM_CLASS_NOT_MAPPABLE),
                                     unit_polar(0, 4, 10)};
    const decision_t d = decide(bslam_associate_known, &ekf, &settings, &on_axle, seen, COUNT_OF(seen));
    assert_rejected(&d.records[0].match, BSLAM_REASON_CLASS);
    assert_match(&d.records[1].match, 0);
}

// ---- what both methods by distance share ------------------------------------------------------------------

static const bslam_associate_fn by_distance[] = {bslam_associate_nearest, bslam_associate_mahalanobis};

static void test_by_distance_empty_map_makes_everything_new(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    const bslam_sighting_t seen[] = {unit_polar(0, 4, -1), unit_direction(0, -1)};
    for (int m = 0; m < COUNT_OF(by_distance); m++) {
        const decision_t d = decide(by_distance[m], &ekf, &settings, &on_axle, seen, COUNT_OF(seen));
        assert_new(&d.records[0].match);
        assert_new(&d.records[1].match);
    }
}

static void test_by_distance_not_mappable_sighting_is_rejected(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    const bslam_sighting_t seen[] = {of_class(unit_polar(0, 4, -1), BSLAM_CLASS_NOT_MAPPABLE)};
    for (int m = 0; m < COUNT_OF(by_distance); m++) {
        const decision_t d = decide(by_distance[m], &ekf, &settings, &on_axle, seen, 1);
        assert_rejected(&d.records[0].match, BSLAM_REASON_CLASS);
        assert_true(d.records[0].match.distance2 < 0);
    }
}

static void test_by_distance_nearest_of_two_is_the_match(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    // Beacons 0 and 2 are 14 degrees apart.
    const bslam_sighting_t seen[] = {unit_polar(0.02, 4.02, -1), unit_polar(0.23, 4.1, -1)};
    for (int m = 0; m < COUNT_OF(by_distance); m++) {
        const decision_t d = decide(by_distance[m], &ekf, &settings, &on_axle, seen, COUNT_OF(seen));
        assert_match(&d.records[0].match, 0);
        assert_match(&d.records[1].match, 2);
    }
}

static void test_by_distance_of_several_sightings_the_nearest_keeps_the_beacon(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    const bslam_sighting_t seen[] = {unit_polar(1.60, 3, -1), unit_polar(1.571, 3, -1),
                                     unit_polar(1.58, 3, -1)};
    for (int m = 0; m < COUNT_OF(by_distance); m++) {
        const decision_t d = decide(by_distance[m], &ekf, &settings, &on_axle, seen, COUNT_OF(seen));
        assert_rejected(&d.records[0].match, BSLAM_REASON_DUPLICATE);
        assert_match(&d.records[1].match, 1);
        assert_rejected(&d.records[2].match, BSLAM_REASON_DUPLICATE);
    }
}

static void test_by_distance_of_equally_near_sightings_the_first_keeps_the_beacon(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    const bslam_sighting_t seen[] = {unit_polar(1.6, 3, -1), unit_polar(1.6, 3, -1)};
    for (int m = 0; m < COUNT_OF(by_distance); m++) {
        const decision_t d = decide(by_distance[m], &ekf, &settings, &on_axle, seen, COUNT_OF(seen));
        assert_match(&d.records[0].match, 1);
        assert_rejected(&d.records[1].match, BSLAM_REASON_DUPLICATE);
    }
}

static void test_by_distance_other_class_is_never_the_match(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_ekf_t ekf = three_beacons(&settings);
    ekf.beacons[1].beacon_class = 3;
    const bslam_sighting_t here = unit_polar(1.5708, 3, -1);
    const bslam_sighting_t seen[] = {of_class(here, 4)};
    const bslam_sighting_t same[] = {of_class(here, 3)};
    const bslam_sighting_t unknown[] = {of_class(here, BSLAM_CLASS_NONE)};
    for (int m = 0; m < COUNT_OF(by_distance); m++) {
        const decision_t other = decide(by_distance[m], &ekf, &settings, &on_axle, seen, 1);
        assert_new(&other.records[0].match);
        const decision_t match = decide(by_distance[m], &ekf, &settings, &on_axle, same, 1);
        assert_match(&match.records[0].match, 1);
        const decision_t none = decide(by_distance[m], &ekf, &settings, &on_axle, unknown, 1);
        assert_match(&none.records[0].match, 1);
    }
}

static void test_by_distance_sensor_is_where_its_mount_says(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    // The sensor stands at (2, 1) and looks backwards: beacon 1, at (0, 3), is ahead to its right.
    const bslam_pose_t mount = {2, 1, real(3.14159265358979)};
    const bslam_sighting_t seen[] = {unit_polar(-0.785398, 2.828427, -1)};
    for (int m = 0; m < COUNT_OF(by_distance); m++) {
        const decision_t d = decide(by_distance[m], &ekf, &settings, &mount, seen, 1);
        assert_match(&d.records[0].match, 1);
        // A few roundings of 3 m, squared, in units of a threshold or deviation of 0.02 at least.
        assert_near(d.records[0].match.distance2, 0, 1e-6);
    }
}

// ---- nearest ----------------------------------------------------------------------------------------------

static void test_nearest_on_either_side_of_the_threshold(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.nearest_threshold_m = BSLAM_R(0.5);
    const bslam_ekf_t ekf = three_beacons(&settings);
    // Beyond beacon 1, straight on: 3 m + this much.
    const bslam_sighting_t near[] = {unit_polar(1.570796, 3.499, -1)};
    const bslam_sighting_t far[] = {unit_polar(1.570796, 3.501, -1)};
    const decision_t d_near = decide(bslam_associate_nearest, &ekf, &settings, &on_axle, near, 1);
    assert_match(&d_near.records[0].match, 1);
    assert_near(d_near.records[0].match.distance2, 0.499 * 0.499 / 0.25, 1e-4);
    const decision_t d_far = decide(bslam_associate_nearest, &ekf, &settings, &on_axle, far, 1);
    assert_new(&d_far.records[0].match);
}

static void test_nearest_direction_on_either_side_of_the_threshold(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.nearest_threshold_rad = BSLAM_R(0.1);
    const bslam_ekf_t ekf = three_beacons(&settings);
    const bslam_sighting_t near[] = {unit_direction(-0.099, -1)};
    const bslam_sighting_t far[] = {unit_direction(-0.101, -1)};
    const decision_t d_near = decide(bslam_associate_nearest, &ekf, &settings, &on_axle, near, 1);
    assert_match(&d_near.records[0].match, 0);
    const decision_t d_far = decide(bslam_associate_nearest, &ekf, &settings, &on_axle, far, 1);
    assert_new(&d_far.records[0].match);
}

static void test_nearest_direction_a_turn_further_is_the_same(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    const bslam_sighting_t seen[] = {unit_direction(1.57 - 6.2831853, -1)};
    const decision_t d = decide(bslam_associate_nearest, &ekf, &settings, &on_axle, seen, 1);
    assert_match(&d.records[0].match, 1);
}

static void test_nearest_known_beacon_is_one_of_the_map(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_ekf_t ekf = three_beacons(&settings);
    int index;
    assert_int_equal(bslam_ekf_add_known(&ekf, -5, 0, &index), BSLAM_OK);
    const bslam_sighting_t seen[] = {unit_polar(3.1415, 5, -1)};
    for (int m = 0; m < COUNT_OF(by_distance); m++) {
        const decision_t d = decide(by_distance[m], &ekf, &settings, &on_axle, seen, 1);
        assert_match(&d.records[0].match, index);
    }
}

// ---- Mahalanobis ------------------------------------------------------------------------------------------

/// The squared distance of a sighting from a beacon, in the filter's own measure.
static double distance2_to(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                           const bslam_sighting_t *sighting, int beacon)
{
    bslam_innovation_t innovation;
    bslam_real_t distance2;
    assert_int_equal(bslam_ekf_innovation(ekf, settings, &on_axle, sighting, beacon, &innovation), BSLAM_OK);
    assert_int_equal(bslam_ekf_distance2(ekf, &innovation, &distance2), BSLAM_OK);
    return (double)distance2;
}

static void test_mahalanobis_match_ambiguous_and_new_by_the_two_thresholds(void **state)
{
    bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    const bslam_sighting_t seen[] = {unit_polar(1.5708, 3.5, -1)};
    const double d2 = distance2_to(&ekf, &settings, &seen[0], 1);

    settings.match_d2 = real(d2 * 1.001);
    settings.new_d2 = real(d2 * 2);
    const decision_t match = decide(bslam_associate_mahalanobis, &ekf, &settings, &on_axle, seen, 1);
    assert_match(&match.records[0].match, 1);
    assert_near(match.records[0].match.distance2, d2, 0);

    settings.match_d2 = real(d2 * 0.999);
    const decision_t between = decide(bslam_associate_mahalanobis, &ekf, &settings, &on_axle, seen, 1);
    assert_rejected(&between.records[0].match, BSLAM_REASON_AMBIGUOUS);

    settings.new_d2 = real(d2 * 0.9995);
    const decision_t new = decide(bslam_associate_mahalanobis, &ekf, &settings, &on_axle, seen, 1);
    assert_new(&new.records[0].match);
}

static void test_mahalanobis_prefers_the_uncertain_beacon_to_the_merely_near_one(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_ekf_t ekf = three_beacons(&settings);
    for (int k = 0; k < 2; k++) {
        covariance_forget(&ekf, ekf.beacons[2].at + k, 4);
    }
    // 0.4 m from beacon 0, which is known to 0.1 m, and 0.6 m from beacon 2, known to 2 m.
    const bslam_sighting_t seen[] = {unit_polar(0.1, 4, -1)};
    const decision_t nearest = decide(bslam_associate_nearest, &ekf, &settings, &on_axle, seen, 1);
    assert_match(&nearest.records[0].match, 0);
    const decision_t mahalanobis = decide(bslam_associate_mahalanobis, &ekf, &settings, &on_axle, seen, 1);
    assert_match(&mahalanobis.records[0].match, 2);
}

static void test_mahalanobis_beacon_without_an_innovation_is_passed_over(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    int index;
    // A beacon at the very sensor has no direction.
    assert_int_equal(bslam_ekf_add_known(&ekf, 0, 0, &index), BSLAM_OK);
    const bslam_sighting_t seen[] = {unit_polar(0, 1, -1)};
    const decision_t d = decide(bslam_associate_mahalanobis, &ekf, &settings, &on_axle, seen, 1);
    assert_new(&d.records[0].match);
}

static void test_mahalanobis_beacon_of_indefinite_covariance_is_passed_over(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_ekf_t ekf = three_beacons(&settings);
    covariance_break(&ekf, ekf.beacons[1].at, 2);
    const bslam_sighting_t seen[] = {unit_polar(1.5708, 3, -1)};
    const decision_t d = decide(bslam_associate_mahalanobis, &ekf, &settings, &on_axle, seen, 1);
    assert_true(d.records[0].match.beacon != 1);
}

// ---- which method -----------------------------------------------------------------------------------------

static void test_method_is_the_one_that_the_parameter_names(void **state)
{
    static const bslam_associate_fn methods[] = {bslam_associate_known, bslam_associate_nearest,
                                                 bslam_associate_mahalanobis};
    bslam_settings_t settings = unit_settings();
    for (int i = 0; i < COUNT_OF(methods); i++) {
        settings.association = i;
        assert_true(bslam_associate_method(&settings) == methods[i]);
    }
}

static void test_every_method_takes_an_empty_frame(void **state)
{
    bslam_settings_t settings = unit_settings();
    const bslam_ekf_t ekf = three_beacons(&settings);
    for (settings.association = 0; settings.association <= 2; settings.association++) {
        (void)decide(bslam_associate_method(&settings), &ekf, &settings, &on_axle, NULL, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_label_of_the_map_is_a_match_and_another_is_new),
        cmocka_unit_test(test_known_sighting_without_a_label_is_rejected),
        cmocka_unit_test(test_known_repeated_label_leaves_the_best_in_any_order),
        cmocka_unit_test(test_known_repeated_label_that_is_new_begins_with_the_surest_in_any_order),
        cmocka_unit_test(test_known_repeated_label_of_tentative_beacons_goes_on_with_what_fits),
        cmocka_unit_test(test_known_label_has_so_many_competitors_and_no_more),
        cmocka_unit_test(test_known_competitor_that_cannot_be_weighed_is_not_the_nearest),
        cmocka_unit_test(test_known_not_mappable_sighting_does_not_use_its_label_up),

        cmocka_unit_test(test_by_distance_empty_map_makes_everything_new),
        cmocka_unit_test(test_by_distance_not_mappable_sighting_is_rejected),
        cmocka_unit_test(test_by_distance_nearest_of_two_is_the_match),
        cmocka_unit_test(test_by_distance_of_several_sightings_the_nearest_keeps_the_beacon),
        cmocka_unit_test(test_by_distance_of_equally_near_sightings_the_first_keeps_the_beacon),
        cmocka_unit_test(test_by_distance_other_class_is_never_the_match),
        cmocka_unit_test(test_by_distance_sensor_is_where_its_mount_says),

        cmocka_unit_test(test_nearest_on_either_side_of_the_threshold),
        cmocka_unit_test(test_nearest_direction_on_either_side_of_the_threshold),
        cmocka_unit_test(test_nearest_direction_a_turn_further_is_the_same),
        cmocka_unit_test(test_nearest_known_beacon_is_one_of_the_map),

        cmocka_unit_test(test_mahalanobis_match_ambiguous_and_new_by_the_two_thresholds),
        cmocka_unit_test(test_mahalanobis_prefers_the_uncertain_beacon_to_the_merely_near_one),
        cmocka_unit_test(test_mahalanobis_beacon_without_an_innovation_is_passed_over),
        cmocka_unit_test(test_mahalanobis_beacon_of_indefinite_covariance_is_passed_over),

        cmocka_unit_test(test_method_is_the_one_that_the_parameter_names),
        cmocka_unit_test(test_every_method_takes_an_empty_frame),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
