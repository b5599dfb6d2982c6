// What a beacon is taken for, and the scale that its distances have by that. MATH "Beacon scale states".
#include "bslam/model/noise.h"
#include "bslam/slam/slam_internal.h"

/// What was taken for two things, or measured as two sizes, may be neither: by so much its scale is in doubt
/// then.
static const bslam_real_t CONFUSED_VAR = BSLAM_R(0.01);

/// Its variance as a sighting with a distance tells it; 0: no beacon has a scale, or the smoother leads the
/// filter, whose beacons have none.
static bslam_real_t scale_variance(const bslam_slam_t *slam, const bslam_sighting_t *sighting)
{
    return sighting->has_range && !bslam_slam_smooths(slam)
               ? bslam_unknown_scale_var(&slam->settings, sighting)
               : 0;
}

/// Whether a sighting, or its direction alone, passes a beacon's gate.
static bool fits(const bslam_slam_t *slam, const bslam_pose_t *mount, int index,
                 const bslam_sighting_t *sighting, bool with_range)
{
    bslam_sighting_t looked_at = *sighting;
    looked_at.has_range = looked_at.has_range && with_range;
    const bslam_real_t distance2 =
        bslam_ekf_sighting_distance2(&slam->ekf, &slam->settings, mount, &looked_at, index);
    return distance2 >= 0 && (!(slam->settings.gate_d2 > 0) || distance2 <= slam->settings.gate_d2);
}

bool bslam_slam_begin_scale(bslam_slam_t *slam, const bslam_pose_t *mount, int index,
                            const bslam_sighting_t *sighting)
{
    bslam_beacon_t *beacon = &slam->ekf.beacons[index];
    const bool is_ray = beacon->kind == BSLAM_BEACON_RAY;
    const bslam_real_t variance = scale_variance(slam, sighting);
    if (!(variance > 0) || (is_ray && !fits(slam, mount, index, sighting, false))) {
        return false;
    }
    const bool begins =
        is_ray ? bslam_ekf_measure_ray(&slam->ekf, &slam->settings, mount, sighting, index, variance)
               : bslam_ekf_give_scale(&slam->ekf, index, variance);
    if (begins) {
        beacon->beacon_class = sighting->beacon_class;
        beacon->class_lead = 0;
    }
    return begins && is_ray;
}

static uint8_t one_more(uint8_t lead)
{
    return (uint8_t)(lead < BSLAM_LEAD_MAX ? lead + 1 : BSLAM_LEAD_MAX);
}

bool bslam_slam_vote_distance(bslam_slam_t *slam, const bslam_pose_t *mount, int index,
                              const bslam_sighting_t *sighting)
{
    bslam_beacon_t *beacon = &slam->ekf.beacons[index];
    const bslam_sighting_t taken = bslam_ekf_taken_as(beacon, sighting);
    if (beacon->kind != BSLAM_BEACON_SIZED || !taken.has_range) {
        return true;
    }
    if (fits(slam, mount, index, &taken, true)) {
        beacon->distance_lead = one_more(beacon->distance_lead);
        return true;
    }
    if (!fits(slam, mount, index, &taken, false)) {
        return true;  // nothing of it fits, which the gate will find
    }
    if (beacon->distance_lead > 0) {
        beacon->distance_lead--;
        return false;
    }
    const bslam_real_t variance = scale_variance(slam, sighting);
    bslam_ekf_renew_scale(&slam->ekf, index, variance, CONFUSED_VAR);
    return true;
}

void bslam_slam_vote_class(bslam_slam_t *slam, int index, const bslam_sighting_t *sighting)
{
    bslam_beacon_t *beacon = &slam->ekf.beacons[index];
    const bool votes = sighting->has_range && sighting->beacon_class != BSLAM_CLASS_NONE;
    if (!votes || beacon->kind == BSLAM_BEACON_KNOWN) {
        return;
    }
    // Boyer and Moore's majority vote.
    if (!bslam_ekf_classes_differ(beacon, sighting)) {
        beacon->beacon_class = sighting->beacon_class;
        beacon->class_lead = one_more(beacon->class_lead);
    } else if (beacon->class_lead > 0) {
        beacon->class_lead--;
    } else {
        const bslam_real_t variance = scale_variance(slam, sighting);
        beacon->beacon_class = sighting->beacon_class;
        beacon->class_lead = 1;
        if (variance > 0) {
            bslam_ekf_renew_scale(&slam->ekf, index, variance, CONFUSED_VAR);
        }
    }
}
