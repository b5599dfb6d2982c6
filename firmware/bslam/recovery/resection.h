/// Where a robot is that knows nothing but which beacons it sees: a pose from clues. MATH "Relocalisation".
///
/// Two beacons with distance give a pose, three directions if fewer have one. Every such choice of the clues
/// is tried; the pose that most beacons agree with is refined by all that do. Pure: nothing is kept.
#ifndef BSLAM_RECOVERY_RESECTION_H
#define BSLAM_RECOVERY_RESECTION_H

#include "base/types.h"

/// Clues that are looked at; a pose is tried for each two, or three, of them.
#define BSLAM_CLUES_MAX 10

/// A beacon that was recognised, as seen from where the robot is now. A sighting that shows one of several
/// beacons is a clue for each of them, one behind the other.
typedef struct bslam_clue {
    int32_t beacon;    ///< its place in the map: who was seen more than once is one beacon
    bslam_real_t x_m;  ///< where it is in the map
    bslam_real_t y_m;
    bslam_pose_t sensor;  ///< where the sensor was, in the robot's present frame
    bslam_real_t bearing_rad, range_m;
    bslam_real_t bearing_var_rad2;  ///< of the sighting, of the beacon's place, and of the way since
    bslam_real_t range_var_m2;
    bool has_range;
    bool is_other;  ///< of the same sighting as the clue before, taken for another beacon
} bslam_clue_t;

/// A pose, and what speaks for it.
typedef struct bslam_fix {
    bslam_pose_t pose;
    bslam_real_t position_sd_m;  ///< along the longer axis
    bslam_real_t heading_sd_rad;
    int32_t agreeing;    ///< sightings that fit it
    int32_t beacons;     ///< that they show
    int32_t with_range;  ///< of these with a distance
    int32_t dissenting;  ///< sightings that do not
} bslam_fix_t;

/// The pose that most beacons of `count` <= BSLAM_CLUES_MAX clues agree with. False, and *fix unchanged:
/// fewer than two with distance agree on any, nor three without, or it is ambiguous. O(count³), O(count⁴)
/// without distances.
bool bslam_relocate(const bslam_clue_t *clues, int count, bslam_fix_t *fix);

/// How many beacons of the clues, at most BSLAM_CLUES_MAX of them, are where this pose has them. O(count²).
int32_t bslam_relocate_agreeing(const bslam_clue_t *clues, int count, const bslam_pose_t *pose);

#endif
