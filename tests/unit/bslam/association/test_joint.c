#include "covariance.h"
#include "known_map.h"
#include "support.h"

#include <math.h>

#include "bslam/association/association.h"
#include "bslam/association/conditional.h"
#include "plain_settings.h"

static const bslam_pose_t on_axle = {0, 0, 0};

enum { BEACONS = 4, SIGHTINGS = 4 };

static bslam_settings_t joint_params(void)
{
    bslam_settings_t settings = unit_settings();
    settings.association = BSLAM_ASSOCIATION_JOINT;
    settings.joint_sd = BSLAM_R(3.09);
    settings.joint_nodes = 100000;
    return settings;
}

/// Robot at the origin with a doubtful heading.
static bslam_ekf_t map_of(const bslam_settings_t *settings, const double (*places)[2], int count)
{
    bslam_ekf_t ekf = unit_map_of(settings, places, count);
    covariance_forget(&ekf, BSLAM_STATE_THETA, 0.01);
    return ekf;
}

static bslam_sighting_frame_t frame_of(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                       const bslam_sighting_t *seen, int count)
{
    return (bslam_sighting_frame_t){
        .ekf = ekf, .settings = settings, .mount = &on_axle, .sightings = seen, .count = count};
}

typedef struct pairing {
    int beacon[SIGHTINGS];
    int pairs;
    double distance2;
} pairing_t;

/// Chi squared at 0.999 for an even number of freedoms, from its closed distribution function by bisection.
static double chi2_limit(int freedoms)
{
    double low = 0;
    double high = 100;
    for (int step = 0; step < 60; step++) {
        const double x = (low + high) / 2;
        double term = exp(-x / 2);
        double above = 0;
        for (int k = 0; k < freedoms / 2; k++) {
            above += term;
            term *= x / 2 / (k + 1);
        }
        if (above > 0.001) {
            low = x;
        } else {
            high = x;
        }
    }
    return low;
}

/// Tries every pairing, by counting in base BEACONS + 1. *close: a limit was missed or met by a hair.
static pairing_t best_of_all(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                             const bslam_sighting_t *seen, bool *close)
{
    pairing_t best = {{-1, -1, -1, -1}, 0, 0};
    for (int code = 0; code < 625; code++) {
        pairing_t one = {{-1, -1, -1, -1}, 0, 0};
        static bslam_conditional_t conditional;
        bslam_conditional_init(&conditional);
        bool fits = true;
        unsigned taken = 0;
        int left = code;
        for (int i = 0; i < SIGHTINGS && fits; i++, left /= BEACONS + 1) {
            const int b = left % (BEACONS + 1) - 1;
            bslam_innovation_t innovation;
            bslam_real_t alone;
            if (b < 0) {
                continue;
            }
            fits = (taken & 1u << b) == 0;
            taken |= 1u << b;
            assert_int_equal(bslam_ekf_innovation(ekf, settings, &on_axle, &seen[i], b, &innovation),
                             BSLAM_OK);
            assert_int_equal(bslam_ekf_distance2(ekf, &innovation, &alone), BSLAM_OK);
            fits =
                fits && alone <= settings->match_d2 && bslam_conditional_add(ekf, &conditional, &innovation);
            one.beacon[i] = b;
            one.pairs++;
            if (fits) {
                const double limit = chi2_limit(2 * one.pairs);
                one.distance2 = (double)bslam_conditional_distance2(&conditional);
                *close = *close || fabs(one.distance2 - limit) < 0.03 * limit;
                fits = one.distance2 <= limit;
            }
        }
        if (fits && (one.pairs > best.pairs || (one.pairs == best.pairs && one.distance2 < best.distance2))) {
            best = one;
        }
    }
    return best;
}

static void test_joint_finds_what_trying_all_pairings_finds(void **state)
{
    const bslam_settings_t settings = joint_params();
    unit_random_t random = {77};
    int compared = 0;
    int pairs = 0;
    for (int run = 0; run < 60; run++) {
        double places[BEACONS][2];
        bslam_sighting_t seen[SIGHTINGS];
        for (int b = 0; b < BEACONS; b++) {
            places[b][0] = unit_random(&random, 3, 4);
            places[b][1] = unit_random(&random, -1, 1);
        }
        const bslam_ekf_t ekf = map_of(&settings, places, BEACONS);
        const double heading = unit_random(&random, -0.15, 0.15);
        for (int i = 0; i < SIGHTINGS; i++) {
            const double x = places[i][0] + unit_random(&random, -0.2, 0.2);
            const double y = places[i][1] + unit_random(&random, -0.2, 0.2);
            seen[i] = unit_polar(atan2(y, x) + heading, hypot(x, y), -1);
        }
        bool close = false;
        const pairing_t expected = best_of_all(&ekf, &settings, seen, &close);
        if (close) {
            continue;
        }
        bslam_record_t records[SIGHTINGS];
        const bslam_sighting_frame_t frame = frame_of(&ekf, &settings, seen, SIGHTINGS);
        bslam_associate_joint(&frame, records);
        for (int i = 0; i < SIGHTINGS; i++) {
            assert_int_equal(records[i].match.beacon, expected.beacon[i]);
        }
        compared++;
        pairs += expected.pairs;
    }
    assert_true(compared > 15);
    assert_true(pairs > 2 * compared);
}

/// Turned by 0.2 rad, each sighting is nearest to the wrong beacon; only together they fit.
static void test_joint_sees_through_a_wrong_heading(void **state)
{
    const bslam_settings_t settings = joint_params();
    static const double places[3][2] = {{4, 0}, {3.92, 0.8}, {3.67, 1.6}};
    const bslam_ekf_t ekf = map_of(&settings, places, 3);
    bslam_sighting_t seen[3];
    for (int i = 0; i < 3; i++) {
        seen[i] = unit_polar(atan2(places[i][1], places[i][0]) + 0.15, hypot(places[i][0], places[i][1]), -1);
    }
    bslam_record_t records[3];
    const bslam_sighting_frame_t frame = frame_of(&ekf, &settings, seen, 3);
    bslam_associate_mahalanobis(&frame, records);
    assert_int_not_equal(records[0].match.beacon, 0);
    bslam_associate_joint(&frame, records);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(records[i].match.verdict, BSLAM_VERDICT_MATCH);
        assert_int_equal(records[i].match.beacon, i);
    }
}

/// A variance below zero: what is seen of that beacon cannot be weighed, so it is in no pair, and near
/// nobody.
static void test_joint_beacon_of_indefinite_covariance_is_passed_over(void **state)
{
    const bslam_settings_t settings = joint_params();
    const double places[2][2] = {{4, 0}, {0, 4}};
    bslam_ekf_t ekf = map_of(&settings, places, 2);
    covariance_break(&ekf, ekf.beacons[0].at, 2);
    const bslam_sighting_t seen[] = {unit_polar(0, 4, -1), unit_polar(1.5708, 4, -1)};
    const bslam_sighting_frame_t frame = frame_of(&ekf, &settings, seen, 2);
    bslam_record_t records[2];
    bslam_associate_joint(&frame, records);
    unit_assert_decided(&records[0].match, BSLAM_VERDICT_NEW, BSLAM_REASON_NONE, -1);
    unit_assert_decided(&records[1].match, BSLAM_VERDICT_MATCH, BSLAM_REASON_NONE, 1);
}

static void test_joint_out_of_nodes_still_decides_all(void **state)
{
    bslam_settings_t settings = joint_params();
    settings.joint_nodes = 1;
    static const double places[1][2] = {{4, 0}};
    const bslam_ekf_t ekf = map_of(&settings, places, 1);
    const bslam_sighting_t seen[] = {unit_polar(0, 4, -1), unit_polar(2, 4, -1)};
    bslam_record_t records[2];
    const bslam_sighting_frame_t frame = frame_of(&ekf, &settings, seen, 2);
    bslam_associate_joint(&frame, records);
    assert_int_equal(records[0].match.verdict, BSLAM_VERDICT_REJECT);
    assert_int_equal(records[0].match.reason, BSLAM_REASON_AMBIGUOUS);
    assert_int_equal(records[1].match.verdict, BSLAM_VERDICT_NEW);
}

static void test_joint_more_sightings_than_are_paired_together(void **state)
{
    const bslam_settings_t settings = joint_params();
    double places[8][2];
    bslam_sighting_t seen[8];
    for (int i = 0; i < 8; i++) {
        places[i][0] = 4 * cos(0.7 * i);
        places[i][1] = 4 * sin(0.7 * i);
        seen[i] = unit_polar(remainder(0.7 * i, 6.283185307179586), 4, -1);
    }
    seen[6] = seen[2];  // the same beacon again, in the second group
    const bslam_ekf_t ekf = map_of(&settings, places, 8);
    bslam_record_t records[8];
    const bslam_sighting_frame_t frame = frame_of(&ekf, &settings, seen, 8);
    bslam_associate_joint(&frame, records);
    for (int i = 0; i < 8; i++) {
        assert_int_equal(records[i].match.beacon, i == 6 ? -1 : i);
    }
    assert_int_equal(records[6].match.verdict, BSLAM_VERDICT_REJECT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_joint_finds_what_trying_all_pairings_finds),
        cmocka_unit_test(test_joint_sees_through_a_wrong_heading),
        cmocka_unit_test(test_joint_beacon_of_indefinite_covariance_is_passed_over),
        cmocka_unit_test(test_joint_out_of_nodes_still_decides_all),
        cmocka_unit_test(test_joint_more_sightings_than_are_paired_together),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
