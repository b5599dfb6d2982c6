/// From where the robot sees a beacon of the map. MATH "Which beacon is it".
#ifndef BSLAM_ASSOCIATION_VIEWPOINT_H
#define BSLAM_ASSOCIATION_VIEWPOINT_H

#include "bslam/appearance/appearance.h"
#include "bslam/ekf/ekf.h"

typedef struct bslam_viewpoint {
    bslam_real_t range_m;
    bslam_real_t bearing_rad;  ///< of the beacon from the robot
    int sector;                ///< of the robot around the beacon
    bool is_sure;              ///< the robot knows its place well enough for range and sector
} bslam_viewpoint_t;

/// The sector around a beacon in which a robot stands that sees it in this direction of the map.
int bslam_viewpoint_sector(bslam_real_t direction_rad);

/// Whether a beacon has a place of its own in the map, its first two state values.
bool bslam_has_viewpoint(const bslam_beacon_t *beacon);

/// Of beacon `index`, which has one. O(1).
bslam_viewpoint_t bslam_viewpoint_of(const bslam_ekf_t *ekf, int index);

#endif
