// Whether what is seen is a beacon: existence evidence. MATH "Which beacon is it".
#include "bslam/settings_internal.h"
#include "bslam/slam/slam_internal.h"

static const bslam_real_t MICROMETRES_PER_M = BSLAM_R(1e6);
// What one sighting says at most: the next frame shows the same, and may be wrong the same way. One that is
// surer than that and has a distance says as much as a few.
static const bslam_real_t SCORE_LOW = -1, SCORE_HIGH = BSLAM_R(1.5), SURE = 4;
// And one without a distance, of a sensor that measures some.
static const bslam_real_t BLIND_HIGH = BSLAM_R(0.05);

// Where identity is not told, a beacon that was seen for less may be one that was not recognised for a
// moment.
enum { LASTING_US = 1000000 };

/// Whether a sighting's score counts: where appearance decides, of a detector that gives scores.
static bool has_score(const bslam_slam_t *slam, const bslam_sighting_t *sighting)
{
    return bslam_weighs_likelihood(&slam->settings) && sighting->score != 0;
}

/// What a sighting's score says for a beacon. What has no distance, of a sensor that measures some, is of
/// another size than it is taken for: however sure the detector is of it, that says next to nothing.
static bslam_real_t evidence(const bslam_slam_t *slam, const bslam_sighting_t *sighting)
{
    const bslam_real_t above = sighting->score - slam->settings.existence_score;
    if (above < SCORE_LOW) {
        return SCORE_LOW;
    }
    const bool is_blind = slam->measures_distance && !sighting->has_range;
    const bslam_real_t high = is_blind ? BLIND_HIGH : SCORE_HIGH;
    if (above <= high) {
        return above;
    }
    return sighting->has_range ? SURE : high;
}

static void add_score(const bslam_slam_t *slam, bslam_beacon_t *beacon, const bslam_sighting_t *sighting)
{
    if (has_score(slam, sighting)) {
        beacon->score_sum += evidence(slam, sighting);
        beacon->has_scores = true;
    }
}

/// A sighting counts if the robot has gone far enough since the last that did, and against the beacon if it
/// is too far off: what is not of the size that it is taken for is not, seen from the next place, where it
/// was.
static void count_view(const bslam_slam_t *slam, bslam_beacon_t *beacon, bslam_real_t distance2)
{
    const bslam_settings_t *settings = &slam->settings;
    const uint32_t least_um = (uint32_t)(settings->confirm_travel_m * MICROMETRES_PER_M);
    if (!beacon->confirmed && slam->travelled_um - beacon->view_um >= least_um) {
        const bool is_enough = beacon->views >= settings->confirm_sightings;  // scores may be missing
        beacon->view_um = slam->travelled_um;
        beacon->views = (uint16_t)(distance2 > settings->confirm_d2 ? beacon->views - 1
                                   : is_enough                      ? beacon->views
                                                                    : beacon->views + 1);
    }
}

/// Whether it was seen for long enough to be no mistake.
static bool lasts(const bslam_slam_t *slam, const bslam_beacon_t *beacon)
{
    return !bslam_weighs_likelihood(&slam->settings) || slam->settings.confirm_sightings == 1 ||
           beacon->last_seen_us - beacon->first_seen_us >= LASTING_US;
}

static void decide(bslam_slam_t *slam, bslam_beacon_t *beacon)
{
    const bool is_sure = !beacon->has_scores || beacon->score_sum >= slam->settings.existence_sum;
    if (!beacon->confirmed && is_sure && beacon->views >= slam->settings.confirm_sightings &&
        lasts(slam, beacon)) {
        beacon->confirmed = true;
        slam->confirmed_now = true;
    }
}

void bslam_slam_confirm_new(bslam_slam_t *slam, bslam_beacon_t *beacon, const bslam_sighting_t *sighting)
{
    beacon->view_um = slam->travelled_um;
    beacon->views = 1;
    add_score(slam, beacon, sighting);
    decide(slam, beacon);
}

bool bslam_slam_confirm_again(const bslam_slam_t *slam, bslam_beacon_t *beacon, int64_t time_us)
{
    const bslam_settings_t *settings = &slam->settings;
    const bool was_glimpsed =
        !beacon->confirmed && !beacon->has_scores && beacon->views >= settings->confirm_sightings;
    if (!was_glimpsed || settings->confirm_window_us == 0 ||
        time_us - beacon->last_seen_us <= settings->confirm_window_us) {
        return false;
    }
    beacon->first_seen_us = time_us;
    beacon->view_um = slam->travelled_um;
    beacon->views = 1;
    return true;
}

void bslam_slam_confirm_match(bslam_slam_t *slam, bslam_beacon_t *beacon, const bslam_sighting_t *sighting,
                              bslam_real_t distance2)
{
    add_score(slam, beacon, sighting);
    count_view(slam, beacon, distance2);
    decide(slam, beacon);
}

static bool is_tentative(const bslam_slam_t *slam, const bslam_beacon_t *beacon)
{
    return !beacon->confirmed && beacon->has_scores && beacon->score_sum < slam->settings.existence_sum;
}

void bslam_slam_mark_tentative(bslam_slam_t *slam, int count)
{
    for (int i = 0; i < count; i++) {
        const bslam_sighting_t *sighting = slam->records[i].sighting;
        bslam_match_t *match = &slam->records[i].match;
        slam->measures_distance = slam->measures_distance || sighting->has_range;
        const bool is_unproven =
            match->verdict == BSLAM_VERDICT_MATCH && is_tentative(slam, &slam->ekf.beacons[match->beacon]);
        const bool is_refuted = match->verdict == BSLAM_VERDICT_NEW && has_score(slam, sighting) &&
                                sighting->score < slam->settings.existence_score;
        match->verdict = is_unproven || is_refuted ? BSLAM_VERDICT_TENTATIVE : match->verdict;
    }
}
