/// Two beacons of the map in one place, of which one is a mistake, or no longer there; and two in one
/// direction from the robot, of which one was hardly ever seen. MATH "Position and appearance".
#ifndef BSLAM_ASSOCIATION_DOUBLES_H
#define BSLAM_ASSOCIATION_DOUBLES_H

#include "bslam/association/looks.h"
#include "bslam/ekf/ekf.h"

#define BSLAM_NO_DOUBLE (-1)

/// Goes through the beacons that the frame of time_us showed. Answers which beacon is to leave, because it
/// has been in another's place, or direction, for long enough without being seen beside it; BSLAM_NO_DOUBLE:
/// none. O(beacons seen * beacons).
int bslam_doubles_settle(bslam_looks_t *looks, const bslam_ekf_t *ekf, const bslam_params_t *params,
                         int64_t time_us);

#endif
