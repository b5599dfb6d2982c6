/// Two beacons of the map in one place, of which one is a mistake or no longer there; and two in one
/// direction, of which one was hardly ever seen. MATH "Position and appearance".
#ifndef BSLAM_ASSOCIATION_DUPLICATES_H
#define BSLAM_ASSOCIATION_DUPLICATES_H

#include "bslam/appearance/appearance.h"
#include "bslam/ekf/ekf.h"

#define BSLAM_NO_DUPLICATE (-1)

/// Which beacon is to leave because it was in another's place, or direction, for long enough without being
/// seen beside it; BSLAM_NO_DUPLICATE: none. O(beacons seen * beacons).
int bslam_duplicates_settle(bslam_appearance_t *appearance, const bslam_ekf_t *ekf,
                            const bslam_settings_t *settings, int64_t time_us);

#endif
