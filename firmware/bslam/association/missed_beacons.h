/// Beacons that are there no longer, with nothing in their place. The core knows no walls and no field of
/// view; it knows from where each beacon was seen, and misses it where it stands there again. MATH "Which
/// beacon is it".
#ifndef BSLAM_ASSOCIATION_MISSED_BEACONS_H
#define BSLAM_ASSOCIATION_MISSED_BEACONS_H

#include "bslam/appearance/appearance.h"
#include "bslam/ekf/ekf.h"

#define BSLAM_NO_MISSED_BEACON (-1)

/// Notes from where the beacons of the frame of time_us were seen, and, if it `judges` because every sighting
/// found its beacon, which others are missed. Answers the beacon that was missed from missed_views of its
/// viewpoints since it was seen last; BSLAM_NO_MISSED_BEACON: none. A wall's corner hides one from few: each
/// speaks but once. O(beacons).
int bslam_missed_beacons_find(bslam_appearance_t *appearance, const bslam_ekf_t *ekf,
                              const bslam_settings_t *settings, int64_t time_us, uint32_t travelled_um,
                              bool judges);

#endif
