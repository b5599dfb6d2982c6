/// The two halves of bslam_slam_sightings, for what looks at a frame before it is used. Not for users.
#ifndef BSLAM_SLAM_INTERNAL_H
#define BSLAM_SLAM_INTERNAL_H

#include "bslam/slam/slam.h"

/// Checks a frame and takes the filter to its moment; *mount is where its sensor is on the robot. The
/// statuses of bslam_slam_sightings; after BSLAM_OK bslam_slam_close_frame must follow with the same frame.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_open_frame(bslam_slam_t *slam, int64_t time_us,
                                                      const bslam_sighting_t *sightings, int count,
                                                      bslam_pose_t *mount);

/// Works the frame off, or, if it is not to be used or the robot is lost, accounts for its sightings only.
void bslam_slam_close_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings, int count,
                            const bslam_pose_t *mount, bool use);

/// The filter's state was changed from outside: what the smoother knows of the past no longer leads to it.
void bslam_slam_restart_smoother(bslam_slam_t *slam);

#endif
