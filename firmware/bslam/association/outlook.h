/// How a beacon of the map and the robot stand to each other. MATH "Position and appearance".
#ifndef BSLAM_ASSOCIATION_OUTLOOK_H
#define BSLAM_ASSOCIATION_OUTLOOK_H

#include "bslam/association/looks.h"
#include "bslam/ekf/ekf.h"

typedef struct bslam_outlook {
    bslam_real_t range_m;
    bslam_real_t bearing_rad;  ///< of the beacon from the robot
    int sector;                ///< of the robot around the beacon
    bool is_sure;              ///< the robot knows its place well enough for range and sector
} bslam_outlook_t;

/// Of the sectors around a beacon the one in which the robot stands that sees it in this direction, which is
/// the map's: 0 to BSLAM_LOOKS_SECTORS - 1.
int bslam_outlook_sector(bslam_real_t direction_rad);

/// Whether a beacon has a place of its own in the map, so that it has an outlook.
bool bslam_has_outlook(const bslam_beacon_t *beacon);

/// Of beacon `index`, which has one. O(1).
bslam_outlook_t bslam_outlook_of(const bslam_ekf_t *ekf, int index);

#endif
