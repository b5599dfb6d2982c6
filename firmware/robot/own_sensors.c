#include "robot/own_sensors.h"

#include "port/port.h"

bool own_sensors_read(bslam_odometry_reading_t *reading)
{
    *reading = (bslam_odometry_reading_t){.source = BSLAM_ODOMETRY_TICKS};
    if (!port_encoders(&reading->time_us, &reading->left_ticks, &reading->right_ticks)) {
        return false;
    }
    float rate_radps = 0;
    reading->has_gyro = port_gyro(&rate_radps);
    reading->gyro_radps = (bslam_real_t)rate_radps;
    return true;
}

void own_sensors_take_reading(robot_t *robot, session_t *session, const bslam_odometry_reading_t *reading)
{
    session_end_wait(session);
    if (!robot_lets_wait(robot, reading)) {
        session_use_reading(session, reading);
    }
}

#if ROBOT_VISION

/// The last row of a picture has come.
static void use_picture(robot_t *robot, session_t *session, const port_row_t *row)
{
    const uint32_t began = port_ticks();
    bslam_status_t status = robot_look(robot, row->camera, row->time_us);
    const uint32_t looked = port_ticks();
    session_end_wait(session);
    const uint32_t again = port_ticks();
    if (status == BSLAM_OK) {
        const camera_input_t *input = &robot->camera;
        status = robot_sightings(robot, row->time_us, input->sightings, input->count);
    }
    const uint32_t ticks = robot->picture_ticks + (looked - began) + (port_ticks() - again);
    session_report_picture(session, row->camera, row->time_us, status, ticks);
}

void own_sensors_take_row(robot_t *robot, session_t *session, const port_row_t *row)
{
    const uint32_t began = port_ticks();
    bslam_status_t status = BSLAM_OK;
    if (row->is_first) {
        robot->picture_ticks = 0;
        status = camera_input_begin_rows(&robot->camera, row->camera);
    }
    if (status == BSLAM_OK) {
        status = camera_input_take_row(&robot->camera, row->pixels);
    }
    robot->picture_ticks += port_ticks() - began;
    if (row->is_last && status == BSLAM_OK) {
        use_picture(robot, session, row);
    }
}

#endif

void own_sensors_take_camera(robot_t *robot, session_t *session)
{
#if ROBOT_VISION
    port_row_t row;
    if (port_camera_row(&row)) {
        own_sensors_take_row(robot, session, &row);
    }
#else
    (void)robot;
    (void)session;
#endif
}

void own_sensors_take(robot_t *robot, session_t *session)
{
    bslam_odometry_reading_t reading;
    if (own_sensors_read(&reading)) {
        own_sensors_take_reading(robot, session, &reading);
    }
    own_sensors_take_camera(robot, session);
}
