/// What the board measures itself: encoders, gyro and cameras of the port feed the robot, and the session
/// reports it.
#ifndef ROBOT_OWN_SENSORS_H
#define ROBOT_OWN_SENSORS_H

#include "robot/session.h"

/// The reading that port_encoders and port_gyro have, if one is due.
bool own_sensors_read(bslam_odometry_reading_t *reading);

/// A reading that was due. Without a gyro, and with BSLAM_VISION_TURNS, it waits until the picture of its
/// moment has been looked at, but not beyond the next reading, or message that changes anything.
void own_sensors_take_reading(robot_t *robot, session_t *session, const bslam_odometry_reading_t *reading);

#if ROBOT_VISION
/// A row of a picture. The last one puts what the picture shows into the filter; of a picture whose first
/// rows did not come nothing is used.
void own_sensors_take_row(robot_t *robot, session_t *session, const port_row_t *row);
#endif

/// A row of the port's cameras, if one has come.
void own_sensors_take_camera(robot_t *robot, session_t *session);

/// All that is due.
void own_sensors_take(robot_t *robot, session_t *session);

#endif
