/// What runs on a board: the estimator and all that it needs to live there. Its settings, what a reset leaves
/// of it, cameras, a reading that waits for its picture, what went wrong.
///
///     robot_start(&robot, &start);
///     robot_odometry(&robot, &reading);
///     robot_sightings(&robot, time_us, sightings, count);
///
/// Whoever calls the estimator itself ends each call with robot_end_call.
#ifndef ROBOT_ROBOT_H
#define ROBOT_ROBOT_H

#include "bslam/bslam.h"
#include "port/port.h"
#include "robot/camera_input.h"
#include "robot/gyro_wait.h"
#include "robot/health.h"

/// What a robot has after start-up.
typedef enum robot_start {
    ROBOT_STARTED_EMPTY = 0,
    ROBOT_STARTED_IN_MAP,  ///< in the saved map, where it does not know its place yet
    ROBOT_WENT_ON          ///< its memory outlasted the reset: all that it knew
} robot_start_t;

/// For reading, but for `settings` and `seeds`. In memory that outlasts a reset (PORT_KEPT) the first part
/// does so, too; all that the estimator points to is in it, or constant.
typedef struct robot {
    bslam_t slam;
    bslam_settings_t in_force;
#if BSLAM_APPEARANCE
    bslam_sample_t seeds[BSLAM_SEEDS_MAX];  ///< room for those that `settings` may name
#endif
    health_t health;
    uint8_t image[PORT_BUILD_ID_BYTES];  ///< whose the members above are
    uint16_t crc;                        ///< over in_force and seeds
    // What follows begins anew with the program.
    bslam_settings_t settings;  ///< for the next robot_start_over
    uint32_t left_ticks;        ///< of the robot's own encoders, when they were last read
    uint32_t right_ticks;
    uint32_t moves;  ///< readings that showed a movement
#if ROBOT_VISION
    camera_input_t camera;
    uint32_t moves_seen[BSLAM_CAMERAS_MAX];  ///< when each camera's last picture was looked at
    uint32_t picture_ticks;                  ///< that the robot's own picture which streams in took so far
#endif
#if ROBOT_VISION && BSLAM_VISION_TURNS
    gyro_wait_t gyro_wait;
#endif
} robot_t;

/// Goes on after a reset where the estimator's memory is guarded and as the last call left it: the pose as
/// doubtful as a second without odometry makes it. Otherwise starts with the settings that were saved or else
/// the board's own, in the map that was saved or else an empty one; in a saved map with recovery and guard.
/// The status is that of beginning.
///
/// *robot: all zero, or what a reset left of it, which may be anything.
BSLAM_MUST_CHECK bslam_status_t robot_start(robot_t *robot, robot_start_t *start);

/// Starts over with robot->settings and an empty map. bslam_init's statuses; then the old one goes on.
BSLAM_MUST_CHECK bslam_status_t robot_start_over(robot_t *robot, int *bad_setting);

/// The seeds that robot->settings names have changed.
void robot_seal_seeds(robot_t *robot);

/// After a call of the estimator that had this status: notes what it showed. Where the memory was no longer
/// what it was, starts over: in the saved map if there is one and it recovers, else in an empty one.
void robot_end_call(robot_t *robot, bslam_status_t status, int64_t time_us);

/// bslam_odometry and bslam_sightings, and the end of the call.
BSLAM_MUST_CHECK bslam_status_t robot_odometry(robot_t *robot, const bslam_odometry_reading_t *reading);
BSLAM_MUST_CHECK bslam_status_t robot_sightings(robot_t *robot, int64_t time_us,
                                                const bslam_sighting_t *sightings, int count);

// ---- what the robot measures itself -----------------------------------------------------------------------

/// First of all with a reading of the robot's own encoders: notes whether it moved. True: the reading waits
/// for the picture of its moment, until robot_end_wait.
bool robot_lets_wait(robot_t *robot, const bslam_odometry_reading_t *reading);

/// The reading that waits, which waits no longer and is to be used now. False: none does.
bool robot_end_wait(robot_t *robot, bslam_odometry_reading_t *reading);

#if ROBOT_VISION

/// camera_input_set_camera.
BSLAM_MUST_CHECK bslam_status_t robot_set_camera(robot_t *robot, int index, const bslam_camera_t *camera);

/// Looks at a picture of the robot's own camera that has come: what it shows stands in robot->camera, how
/// fast the robot turned in the reading that waits. bslam_vision_end's statuses.
BSLAM_MUST_CHECK bslam_status_t robot_look(robot_t *robot, int camera, int64_t time_us);

#endif

#endif
