// A gate takes the pose for right. If few sightings pass it, the pose is wrong: wheels slipped, somebody
// pushed the robot, or it was blind for long. MATH "Sightings that do not fit".
#include "bslam/slam/slam_internal.h"

/// So many sightings the mean of how well they fit goes back.
static const bslam_real_t MEMORY = BSLAM_R(16.0);
/// Where the noise is right the misfit is 0.15, where one sighting in ten means nothing 0.25.
static const bslam_real_t DOUBTFUL = BSLAM_R(0.35);
static const bslam_real_t WRONG = BSLAM_R(0.5);
/// Times the misfit beyond DOUBTFUL, what a second adds to the variances of a motion: of its way, m², and of
/// its turn, rad². A wheel that spins errs by half a metre in a second.
static const bslam_real_t SLIP_VAR_PER_S = BSLAM_R(2.0);
/// Where nothing is seen the misfit says no more of what the wheels do.
static const bslam_real_t UNSEEN_MAX_S = BSLAM_R(2.0);
/// A beacon is believed until it was rejected this much more often than matched.
enum { REJECTED_MORE = 4 };

/// A beacon that contradicts the others for long is in the wrong place itself.
static bool is_believed(const bslam_beacon_t *beacon)
{
    return beacon->kind == BSLAM_BEACON_KNOWN || beacon->gated < beacon->sightings + REJECTED_MORE;
}

void bslam_slam_note_misfit(bslam_slam_t *slam, int count)
{
    bslam_real_t sum = 0, weight = 0;
    for (int i = 0; i < count; i++) {
        const bslam_record_t *record = &slam->records[i];
        const bslam_real_t ratio = record->account->test_ratio;
        if (record->match.verdict == BSLAM_VERDICT_MATCH && ratio >= 0 &&
            is_believed(&slam->ekf.beacons[record->match.beacon])) {
            sum += ratio < 1 ? ratio : 1;
            weight++;
        }
    }
    slam->unseen_s = weight > 0 ? 0 : slam->unseen_s;
    slam->misfit += (sum - weight * slam->misfit) / (MEMORY + weight);
}

bool bslam_slam_opens_gate(const bslam_slam_t *slam, const bslam_beacon_t *beacon)
{
    return slam->misfit > WRONG && is_believed(beacon);
}

void bslam_slam_doubt_motion(bslam_real_t misfit, bslam_real_t unseen_s, bslam_motion_t *motion)
{
    if (misfit > DOUBTFUL && unseen_s < UNSEEN_MAX_S) {
        const bslam_real_t more = SLIP_VAR_PER_S * (misfit - DOUBTFUL) * motion->dt_s;
        motion->forward_var_m2 += more;
        motion->turn_var_rad2 += more;
    }
}
