// What the methods share.
#include "bslam/association/association_internal.h"

bool bslam_is_mappable(const bslam_sighting_t *sighting, bslam_match_t *match)
{
    const bool mappable = sighting->beacon_class != BSLAM_CLASS_NOT_MAPPABLE;
    *match = (bslam_match_t){.verdict = BSLAM_VERDICT_REJECT,
                             .reason = mappable ? BSLAM_REASON_NONE : BSLAM_REASON_CLASS,
                             .beacon = -1,
                             .distance2 = -1};
    return mappable;
}

bool bslam_is_placed(const bslam_ekf_t *ekf, int64_t within_us, int other_than, int64_t time_us)
{
    for (int b = 0; b < ekf->beacon_count; b++) {
        if (b != other_than && ekf->beacons[b].confirmed &&
            time_us - ekf->beacons[b].last_seen_us <= within_us) {
            return true;
        }
    }
    return false;
}
