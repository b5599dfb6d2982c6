/// Who is seen, by what does not come from where the robot is: labels, or appearance. MATH "Recovery".
#ifndef BSLAM_RECOVERY_IDENTITY_H
#define BSLAM_RECOVERY_IDENTITY_H

#include "bslam/slam/slam.h"

#define BSLAM_NOBODY (-1)

/// Which confirmed beacon each of `count` sightings shows, by its place in the map; BSLAM_NOBODY: nobody
/// knows. Of beacons that share a classifier it is the first: bslam_may_be has the others. O(count beacons).
void bslam_identify(const bslam_slam_t *slam, const bslam_sighting_t *sightings, int count, int *who);

/// Whether a sighting that was recognised as beacon `who` may show `beacon`: that one, or one that shares its
/// classifier. O(1).
bool bslam_may_be(const bslam_slam_t *slam, int who, int beacon);

/// Whether so many beacons would be recognised that a pose could be had from them: else nobody is lost.
/// O(beacons).
bool bslam_is_findable(const bslam_slam_t *slam);

#endif
