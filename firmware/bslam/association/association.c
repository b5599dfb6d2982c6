#include "bslam/association/association.h"

#include "bslam/association/association_internal.h"
#include "base/logarithm.h"
#include "base/scalar.h"
#include "base/trig.h"
#include "bslam/model/noise.h"

/// A measure of how far a sighting is from a beacon, squared; negative: it cannot be that beacon.
typedef bslam_real_t (*distance2_fn)(const bslam_sighting_frame_t *frame, const bslam_sighting_t *sighting,
                                     int beacon);

/// Leaves each beacon to the nearest of the sightings that chose it, the first of equals.
static void keep_one_to_one(const bslam_sighting_frame_t *frame, bslam_record_t *records)
{
    for (int i = 1; i < frame->count; i++) {
        for (int j = 0; j < i && records[i].match.verdict == BSLAM_VERDICT_MATCH; j++) {
            if (records[j].match.verdict == BSLAM_VERDICT_MATCH &&
                records[j].match.beacon == records[i].match.beacon) {
                bslam_match_t *loser = records[i].match.distance2 < records[j].match.distance2
                                           ? &records[j].match
                                           : &records[i].match;
                loser->verdict = BSLAM_VERDICT_REJECT;
                loser->reason = BSLAM_REASON_DUPLICATE;
                loser->beacon = -1;
            }
        }
    }
}

// ---- known identity ---------------------------------------------------------------------------------------

// Tentative beacons of one label: more than a few in a second are false sightings.
enum { COMPETITORS_MAX = 8 };

static bslam_real_t mahalanobis2(const bslam_sighting_frame_t *frame, const bslam_sighting_t *sighting,
                                 int beacon)
{
    return bslam_ekf_sighting_distance2(frame->ekf, frame->settings, frame->mount, sighting, beacon);
}

/// Squared distance in units of the threshold: in the map, or of the directions where there is no distance.
static bslam_real_t euclidean2(const bslam_sighting_frame_t *frame, const bslam_sighting_t *sighting,
                               int beacon)
{
    const bslam_pose_t pose = bslam_ekf_pose(frame->ekf);
    bslam_real_t x, y;
    bslam_ekf_beacon_position(frame->ekf, beacon, &x, &y);
    if (sighting->has_range) {
        const bslam_sighted_point_t seen =
            bslam_locate_point(&pose, frame->mount, sighting->range_m, sighting->bearing_rad);
        const bslam_real_t limit = frame->settings->nearest_threshold_m;
        const bslam_real_t dx = (seen.x_m - x) / limit, dy = (seen.y_m - y) / limit;
        return dx * dx + dy * dy;
    }
    const bslam_sensor_t sensor = bslam_sensor_at(&pose, frame->mount);
    const bslam_real_t direction = bslam_atan2(y - sensor.pose.y_m, x - sensor.pose.x_m);
    const bslam_real_t difference =
        bslam_angle_wrap(direction - sensor.pose.theta_rad - bslam_angle_wrap(sighting->bearing_rad)) /
        frame->settings->nearest_threshold_rad;
    return difference * difference;
}

/// The beacon of a label. Until it is confirmed any sighting may be the false one, the first as well as those
/// that contradict it: each of these starts a competitor of the same label, and the first that is confirmed
/// stays. So the nearest, and a new one if the gate has that one out and it is not even near.
static void match_label(const bslam_sighting_frame_t *frame, const bslam_sighting_t *sighting,
                        bslam_match_t *match)
{
    int competitors = 0;
    for (int b = 0; b < frame->ekf->beacon_count; b++) {
        const bslam_beacon_t *beacon = &frame->ekf->beacons[b];
        if (beacon->label != sighting->label) {
            continue;
        }
        match->verdict = BSLAM_VERDICT_MATCH;
        if (beacon->confirmed) {
            match->beacon = b;
            return;
        }
        const bslam_real_t d2 = mahalanobis2(frame, sighting, b);
        if (competitors == 0 || (d2 >= 0 && d2 < match->distance2)) {
            match->beacon = b;
            match->distance2 = d2;
        }
        competitors++;
    }
    const bslam_real_t gate_d2 = frame->settings->gate_d2;
    const bool is_out = gate_d2 > 0 && match->distance2 > gate_d2;
    const bool may_compete = is_out && sighting->has_range && competitors < COMPETITORS_MAX;
    if (competitors == 0 || (may_compete && euclidean2(frame, sighting, match->beacon) > 1)) {
        match->verdict = BSLAM_VERDICT_NEW;
        match->beacon = -1;
    }
}

/// How well a sighting fits what it was taken for: of two that claim one beacon the lesser is used.
typedef struct claim {
    int32_t rank;
    bslam_real_t cost;
} claim_t;

/// The rank: what fits, with a distance and without; what is new; what does not fit. The cost of one that
/// fits is the likelihood's: how far it is off in its own noise, and how much of that there is.
static claim_t claim_of(const bslam_sighting_frame_t *frame, const bslam_record_t *record, int i)
{
    const bslam_sighting_t *sighting = &frame->sightings[i];
    const bslam_settings_t *settings = frame->settings;
    const bslam_match_t *match = &record->match;
    const int32_t rank = sighting->has_range ? 0 : 1;
    const bslam_real_t bearing_cost = bslam_ln(bslam_bearing_variance_rad2(settings, sighting));
    const bslam_real_t noise_cost =
        sighting->has_range
            ? bearing_cost + bslam_ln(bslam_range_variance_m2(settings, sighting, sighting->range_m))
            : bearing_cost;
    if (match->verdict == BSLAM_VERDICT_NEW) {
        return (claim_t){2 + rank, noise_cost};
    }
    const bslam_sighting_t taken = bslam_ekf_taken_as(&frame->ekf->beacons[match->beacon], sighting);
    const bslam_real_t distance2 = mahalanobis2(frame, &taken, match->beacon);
    const bslam_real_t limit = settings->gate_d2 > 0 ? settings->gate_d2 : settings->match_d2;
    if (!bslam_in_range(distance2, 0, limit)) {
        return (claim_t){4, distance2 < 0 ? BSLAM_R(1e30) : distance2};
    }
    return (claim_t){rank, distance2 + noise_cost};
}

/// Whichever comes first: so that it does not matter which comes first in the frame.
static bool is_less(const bslam_sighting_t *a, const bslam_sighting_t *b)
{
    if (a->has_range && a->range_m != b->range_m) {
        return a->range_m < b->range_m;
    }
    return a->bearing_rad < b->bearing_rad;
}

/// Whether sighting j of a label is to be used and not sighting i.
static bool is_better(const bslam_sighting_frame_t *frame, const bslam_record_t *records, int j, int i)
{
    const claim_t a = claim_of(frame, &records[j], j), b = claim_of(frame, &records[i], i);
    if (a.rank != b.rank) {
        return a.rank < b.rank;
    }
    return a.cost != b.cost ? a.cost < b.cost : is_less(&frame->sightings[j], &frame->sightings[i]);
}

/// Of several sightings with one label, as of a tag and its mirror image, the best is used.
static void keep_one_of_each_label(const bslam_sighting_frame_t *frame, bslam_record_t *records)
{
    for (int i = 1; i < frame->count; i++) {
        for (int j = 0; j < i && records[i].match.verdict != BSLAM_VERDICT_REJECT; j++) {
            if (records[j].match.verdict != BSLAM_VERDICT_REJECT &&
                frame->sightings[j].label == frame->sightings[i].label) {
                bslam_match_t *loser =
                    is_better(frame, records, i, j) ? &records[j].match : &records[i].match;
                loser->verdict = BSLAM_VERDICT_REJECT;
                loser->reason = BSLAM_REASON_DUPLICATE;
                loser->beacon = -1;
            }
        }
    }
}

void bslam_associate_known(const bslam_sighting_frame_t *frame, bslam_record_t *records)
{
    for (int i = 0; i < frame->count; i++) {
        const bslam_sighting_t *sighting = &frame->sightings[i];
        bslam_match_t *match = &records[i].match;
        if (!bslam_is_mappable(sighting, match)) {
            continue;
        }
        if (sighting->label == BSLAM_LABEL_NONE) {
            match->reason = BSLAM_REASON_NO_IDENTITY;
        } else {
            match_label(frame, sighting, match);
        }
    }
    keep_one_of_each_label(frame, records);
}

// ---- by distance ------------------------------------------------------------------------------------------

/// Nearest neighbour: at most match2 away is a match, beyond new2 is new, between is left alone.
static void associate_by_distance(const bslam_sighting_frame_t *frame, distance2_fn distance2,
                                  bslam_real_t match2, bslam_real_t new2, bslam_record_t *records)
{
    for (int i = 0; i < frame->count; i++) {
        const bslam_sighting_t *sighting = &frame->sightings[i];
        bslam_match_t *match = &records[i].match;
        if (!bslam_is_mappable(sighting, match)) {
            continue;
        }
        for (int b = 0; b < frame->ekf->beacon_count; b++) {
            if (bslam_ekf_classes_differ(&frame->ekf->beacons[b], sighting)) {
                continue;
            }
            const bslam_real_t d2 = distance2(frame, sighting, b);
            if (d2 >= 0 && (match->beacon < 0 || d2 < match->distance2)) {
                match->beacon = b;
                match->distance2 = d2;
            }
        }
        if (match->beacon >= 0 && match->distance2 <= match2) {
            match->verdict = BSLAM_VERDICT_MATCH;
        } else if (match->beacon < 0 || match->distance2 > new2) {
            match->verdict = BSLAM_VERDICT_NEW;
            match->beacon = -1;
        } else {
            match->reason = BSLAM_REASON_AMBIGUOUS;
            match->beacon = -1;
        }
    }
    keep_one_to_one(frame, records);
}

void bslam_associate_nearest(const bslam_sighting_frame_t *frame, bslam_record_t *records)
{
    associate_by_distance(frame, euclidean2, 1, 1, records);
}

void bslam_associate_mahalanobis(const bslam_sighting_frame_t *frame, bslam_record_t *records)
{
    associate_by_distance(frame, mahalanobis2, frame->settings->match_d2, frame->settings->new_d2, records);
}

bslam_associate_fn bslam_associate_method(const bslam_settings_t *settings)
{
    static const bslam_associate_fn methods[] = {
        [BSLAM_ASSOCIATION_KNOWN] = bslam_associate_known,
        [BSLAM_ASSOCIATION_NEAREST] = bslam_associate_nearest,
        [BSLAM_ASSOCIATION_MAHALANOBIS] = bslam_associate_mahalanobis,
        [BSLAM_ASSOCIATION_SVM] = bslam_associate_likely,
        [BSLAM_ASSOCIATION_JOINT] = bslam_associate_joint,
        [BSLAM_ASSOCIATION_POSITION] = bslam_associate_likely,
        [BSLAM_ASSOCIATION_NEAREST_SAMPLE] = bslam_associate_likely,
        [BSLAM_ASSOCIATION_CENTROID] = bslam_associate_likely,
        [BSLAM_ASSOCIATION_BOTH] = bslam_associate_likely,
    };
    return methods[settings->association];
}
