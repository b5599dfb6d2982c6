#include "bslam/association/missed_beacons.h"

#include "bslam/association/viewpoint.h"
#include "base/scalar.h"

static const bslam_real_t MICROMETRES_PER_M = BSLAM_R(1e6);
static const bslam_real_t STEPS_PER_M = BSLAM_R(10.0);  // of a kept distance
// A view is from the same place if its distance differs by no more than this share.
static const bslam_real_t SAME_PLACE = BSLAM_R(0.25);
// Of the field of view: what is nearer to the edge may be cut off.
static const bslam_real_t INSIDE = BSLAM_R(0.8);
static const bslam_real_t HEADING_VAR_MAX_RAD2 = BSLAM_R(0.01);
// Missed all along so much travel: more than a few frames without a hit, or than what walks past hides it.
static const bslam_real_t MISSED_M = BSLAM_R(0.3);

enum { STEPS_MAX = UINT8_MAX };

static void note_seen(bslam_appearance_t *appearance, int index, const bslam_viewpoint_t *viewpoint)
{
    bslam_beacon_appearance_t *known = &appearance->of[index];
    const bslam_real_t steps = viewpoint->range_m * STEPS_PER_M + 1;
    known->seen_from[viewpoint->sector] = (uint8_t)(steps < STEPS_MAX ? steps : STEPS_MAX);
    known->missed = 0;
    appearance->left_rad =
        viewpoint->bearing_rad > appearance->left_rad ? viewpoint->bearing_rad : appearance->left_rad;
    appearance->right_rad =
        viewpoint->bearing_rad < appearance->right_rad ? viewpoint->bearing_rad : appearance->right_rad;
}

/// Whether a beacon that stands where the map has it would be seen.
static bool is_expected(const bslam_appearance_t *appearance, const bslam_ekf_t *ekf, int index,
                        const bslam_viewpoint_t *viewpoint)
{
    const bslam_real_t seen_m =
        (bslam_real_t)appearance->of[index].seen_from[viewpoint->sector] / STEPS_PER_M;
    const bslam_real_t off_m = bslam_abs(viewpoint->range_m - seen_m);
    return off_m <= SAME_PLACE * seen_m && viewpoint->bearing_rad < INSIDE * appearance->left_rad &&
           viewpoint->bearing_rad > INSIDE * appearance->right_rad &&
           bslam_ekf_covariance(ekf, 2, 2) <= HEADING_VAR_MAX_RAD2 && viewpoint->is_sure;
}

int bslam_missed_beacons_find(bslam_appearance_t *appearance, const bslam_ekf_t *ekf,
                              const bslam_settings_t *settings, int64_t time_us, uint32_t travelled_um,
                              bool judges)
{
    const uint32_t least_um = (uint32_t)(MISSED_M * MICROMETRES_PER_M);
    int missed = BSLAM_NO_MISSED_BEACON;
    for (int b = 0; b < ekf->beacon_count && settings->missed_views > 0; b++) {
        bslam_beacon_appearance_t *known = &appearance->of[b];
        if (!bslam_has_viewpoint(&ekf->beacons[b])) {
            continue;
        }
        const bslam_viewpoint_t viewpoint = bslam_viewpoint_of(ekf, b);
        const bool is_seen = ekf->beacons[b].last_seen_us == time_us;
        if (is_seen) {
            note_seen(appearance, b, &viewpoint);
        }
        if (is_seen || !is_expected(appearance, ekf, b, &viewpoint)) {
            known->missed_um = travelled_um;
        } else if (judges && travelled_um - known->missed_um >= least_um) {
            known->missed_um = travelled_um;
            known->seen_from[viewpoint.sector] = 0;
            known->missed++;
            missed = known->missed >= settings->missed_views ? b : missed;
        }
    }
    appearance->counters.missed += missed != BSLAM_NO_MISSED_BEACON ? 1u : 0u;
    return missed;
}
