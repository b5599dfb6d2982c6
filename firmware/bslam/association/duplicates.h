/// Two beacons of the map in one place, of which one is a mistake or no longer there. MATH "Which beacon is
/// it".
#ifndef BSLAM_ASSOCIATION_DUPLICATES_H
#define BSLAM_ASSOCIATION_DUPLICATES_H

#include "bslam/ekf/ekf.h"

#define BSLAM_NO_DUPLICATE (-1)

/// Which beacon is to leave because it was in another's place for long enough without being seen beside it;
/// BSLAM_NO_DUPLICATE: none. Once a frame. O(beacons seen * beacons).
int bslam_duplicates_settle(bslam_ekf_t *ekf, const bslam_settings_t *settings, int64_t time_us);

#endif
