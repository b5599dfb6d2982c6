/// Notices that the robot is not where the filter has it, and finds it again in the same map. MATH
/// "Recovery".
///
/// It lives on identities that do not come from position: labels, or appearance. A sighting contradicts if it
/// shows a beacon that is clearly elsewhere by the present pose. A frame in which more contradict than agree
/// is not used, but remembered; after some of them the robot is lost. Then no sighting is fused until two
/// beacons or more agree on a pose, and a third, or time, confirms it.
///
/// In a map that still grows, what is new may look like a beacon of the map. Until nothing has begun for
/// `settled_us`, every frame is used. Only another pose, which explains much more of what is recognised, says
/// that the robot is elsewhere; it is set there. Without labels and appearance nothing can contradict.
#ifndef BSLAM_RECOVERY_RECOVERY_H
#define BSLAM_RECOVERY_RECOVERY_H

#include "bslam/bslam.h"
#include "bslam/recovery/resection.h"
#include "bslam/slam/slam.h"

/// A recognised beacon, when and from where it was seen last, with a distance or without.
typedef struct bslam_memory {
    uint32_t uid;
    int64_t time_us;
    bslam_sighting_t sighting;
    bslam_pose_t mount;
    bslam_pose_t robot;  ///< as the filter had it, in the frame of odometry since it got lost
    bslam_real_t heading_var_rad2;
} bslam_memory_t;

/// All zero: nothing is known against the pose.
typedef struct bslam_recovery {
    bslam_recovery_counters_t counters;
    int32_t evidence;
    int64_t doubted_us;       ///< the first frame that contradicted, of this doubt,
    uint32_t doubted_uid;     ///< and the beacon that it showed
    bool several;             ///< others have contradicted, too
    int32_t undecided;        ///< frames since then that said neither
    int32_t silent;           ///< frames since one contradicted in which nothing was recognised
    uint32_t added;           ///< beacons begun in the map, as of the last frame
    bool has_grown;           ///< something has begun in it,
    int64_t grew_us;          ///< the last time then
    bool has_contradicted;    ///< one did while the map grew, of this doubt,
    int64_t contradicted_us;  ///< the last one
    bslam_memory_t memories[BSLAM_CLUES_MAX];
    int32_t memory_count;
    bslam_pose_t last_fix;
    int32_t confirmed;  ///< frames whose fix was the one before, carried on
    bool has_fix;
    int64_t fix_us;
} bslam_recovery_t;

/// The filter starts over: what is known against its pose is forgotten, counts stay.
void bslam_recovery_restart(bslam_recovery_t *recovery);

/// bslam_slam_sightings with a look at whether the robot is where the filter has it. O(count classifiers)
/// more, and while lost or contradicted O(clues³).
BSLAM_MUST_CHECK bslam_status_t bslam_recovery_sightings(bslam_recovery_t *recovery, bslam_slam_t *slam,
                                                         int64_t time_us, const bslam_sighting_t *sightings,
                                                         int count);

bslam_recovery_state_t bslam_recovery_state(const bslam_recovery_t *recovery, const bslam_slam_t *slam);

#endif
