/// What the files of this directory call of each other: motion.c, check.c, trust.c, scale.c, frame.c, slam.c.
/// Not for users.
#ifndef BSLAM_SLAM_SLAM_INTERNAL_H
#define BSLAM_SLAM_SLAM_INTERNAL_H

#include "bslam/slam/slam.h"

// ---- motion.c: odometry waits in the history until a frame shows what comes after it ----------------------

/// The filter goes on to the moment until_us before the newest odometry.
void bslam_slam_predict_until(bslam_slam_t *slam, int64_t until_us);

/// How long before the newest odometry a moment is; 0 while no clock has started.
int64_t bslam_slam_behind_us(const bslam_slam_t *slam, int64_t time_us);

/// The robot of a moment that the filter has not passed, as it goes there from where it is known.
bslam_robot_t bslam_slam_robot_at(const bslam_slam_t *slam, int64_t behind_us, bslam_pose_t *pose);

// ---- check.c ----------------------------------------------------------------------------------------------

/// Checks a frame, and says how long before the newest odometry it was taken. The statuses of
/// bslam_slam_sightings; bad_sighting is noted, nothing else changes.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_check_frame(bslam_slam_t *slam, int64_t time_us,
                                                       const bslam_sighting_t *sightings, int count,
                                                       int64_t *behind_us);

// ---- trust.c: whether what is seen is a beacon. MATH "Position and appearance"
// ---------------------------------

/// A beacon that a sighting has just started: what that says for it.
void bslam_slam_confirm_new(bslam_slam_t *slam, bslam_beacon_t *beacon, const bslam_sighting_t *sighting);

/// A sighting was matched with it, at this squared Mahalanobis distance: it may be confirmed by that.
void bslam_slam_confirm_match(bslam_slam_t *slam, bslam_beacon_t *beacon, const bslam_sighting_t *sighting,
                              bslam_real_t distance2);

/// Notes whether the sensor measures distances, and turns matches with beacons of which nobody knows yet
/// whether they are any, and new ones that would be refuted at once, into BSLAM_VERDICT_TENTATIVE. Before
/// anything of the frame is used: its order does not matter.
void bslam_slam_mark_tentative(bslam_slam_t *slam, int count);

// ---- scale.c: what a beacon is taken for, and how much too long its distances are by that -----------------

/// A beacon whose place came of directions has a scale from its first sighting with a distance on. Before the
/// innovations of a frame are taken. True: the distance is used up, it says where on a ray the beacon is.
/// O(n²).
bool bslam_slam_begin_scale(bslam_slam_t *slam, const bslam_pose_t *mount, int index,
                            const bslam_sighting_t *sighting);

/// Whether a matched sighting's distance counts. One that does not fit where the direction does counts no
/// longer, but against the beacon's size; where most of late did not fit, that is forgotten, and this one
/// counts. Before the innovations of a frame are taken. O(1), O(n²) where it is forgotten.
bool bslam_slam_vote_distance(bslam_slam_t *slam, const bslam_pose_t *mount, int index,
                              const bslam_sighting_t *sighting);

/// What a fused sighting says for the beacon's class, which is what its sightings with a distance call it
/// most often. With another class goes another scale. After the correction. O(n²).
void bslam_slam_vote_class(bslam_slam_t *slam, int index, const bslam_sighting_t *sighting);

// ---- frame.c: the two halves of bslam_slam_sightings, for what looks at a frame before it is used ---------

/// Checks a frame and takes the filter to its moment; *mount is where its sensor is on the robot. The
/// statuses of bslam_slam_sightings; after BSLAM_OK bslam_slam_close_frame must follow with the same frame.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_open_frame(bslam_slam_t *slam, int64_t time_us,
                                                      const bslam_sighting_t *sightings, int count,
                                                      bslam_pose_t *mount);

/// Works the frame off. If it is not to be used, it leaves what one without sightings does, but for the
/// accounts; where the robot is lost, the map stays as it is.
void bslam_slam_close_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings, int count,
                            const bslam_pose_t *mount, bool use);

// ---- slam.c -----------------------------------------------------------------------------------------------

/// Where a beacon is in the map, or -1.
int bslam_slam_find_beacon(const bslam_slam_t *slam, uint32_t uid);

/// Takes a beacon out of the map, and what is known of its looks with it.
void bslam_slam_drop_beacon(bslam_slam_t *slam, int index);

/// The filter's state was changed from outside: what the smoother knows of the past no longer leads to it.
void bslam_slam_restart_smoother(bslam_slam_t *slam);

#endif
