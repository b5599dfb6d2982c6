#include "robot/messages.h"
#include "robot/records.h"
#include "port/port.h"

/// A report of the robot's own, whose frame stands in session->out.
static void begin_report(session_t *session, bslam_link_writer_t *out, uint8_t type, int64_t time_us)
{
    session->report_sequence++;
    session_begin(session, out, type, session->report_sequence, time_us);
}

bool session_read_body(bslam_odometry_reading_t *reading)
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

/// Into the filter, and out as a report.
static void use_reading(session_t *session, const bslam_odometry_reading_t *reading)
{
    const uint32_t began = port_ticks();
    const bool good = session_is_good(session, reading->time_us);
    const bslam_status_t status = good ? bslam_slam_odometry(&session->slam, reading) : BSLAM_E_STATE;
    health_end_step(&session->watch, &session->slam, reading->time_us);
    session->ticks = port_ticks() - began;
    session_end_step(session);
    bslam_link_writer_t out;
    begin_report(session, &out, SESSION_POSE, reading->time_us);
    bslam_link_put_u8(&out, (uint8_t)status);
    bslam_link_put_u32(&out, reading->left_ticks);
    bslam_link_put_u32(&out, reading->right_ticks);
    bslam_link_put_u8(&out, reading->has_gyro ? SESSION_HAS_GYRO : 0);
    bslam_link_put_real(&out, reading->gyro_radps);
    bslam_link_put_real(&out, reading->gyro_sd_radps);
    session_put_step(session, &out);
    session_send(session, &out);
}

void session_end_wait(session_t *session)
{
#if SESSION_TURNS
    bslam_odometry_reading_t reading;
    if (gyro_wait_end_wait(&session->seeing.turning, &reading)) {
        use_reading(session, &reading);
    }
#else
    (void)session;
#endif
}

/// Whether a picture of the robot's own may tell what this reading does not.
static bool waits(session_t *session, const bslam_odometry_reading_t *reading)
{
#if SESSION_TURNS
    camera_input_t *seeing = &session->seeing;
    return !reading->has_gyro && seeing->vision.camera_count > 0 &&
           gyro_wait_wait(&seeing->turning, &seeing->vision, &session->slam.settings, reading);
#else
    (void)session;
    (void)reading;
    return false;
#endif
}

void session_take_reading(session_t *session, const bslam_odometry_reading_t *reading)
{
    session_end_wait(session);
    if (reading->left_ticks != session->left_ticks || reading->right_ticks != session->right_ticks) {
        session->moves++;
    }
    session->left_ticks = reading->left_ticks;
    session->right_ticks = reading->right_ticks;
    if (!waits(session, reading)) {
        use_reading(session, reading);
    }
}

#if SESSION_VISION

static void report_sighting(session_t *session, int64_t time_us, int number)
{
    bslam_link_writer_t out;
    begin_report(session, &out, SESSION_SIGHTED, time_us);
    bslam_link_put_u8(&out, (uint8_t)number);
    record_put_sighting(&out, &session->seeing.sightings[number], session->uses_appearance);
    session_send(session, &out);
}

/// Looks at the picture whose last row has come.
static void look(session_t *session, const port_row_t *row)
{
    camera_input_t *seeing = &session->seeing;
    const uint32_t began = port_ticks();
    bslam_status_t status = camera_input_look(seeing, session->moves != session->moves_seen[row->camera]);
    status = session_is_good(session, row->time_us) ? status : BSLAM_E_STATE;
    session->moves_seen[row->camera] = session->moves;
#if SESSION_TURNS
    if (status == BSLAM_OK) {
        gyro_wait_see(&seeing->turning, &seeing->vision, row->camera, row->time_us);
    }
#endif
    session->row_ticks += port_ticks() - began;
    session_end_wait(session);
    const uint32_t again = port_ticks();
    if (status == BSLAM_OK) {
        status =
            health_sightings(&session->watch, &session->slam, row->time_us, seeing->sightings, seeing->count);
    }
    health_end_step(&session->watch, &session->slam, row->time_us);
    session->ticks = session->row_ticks + (port_ticks() - again);
    session_end_step(session);
    for (int i = 0; i < seeing->count; i++) {
        report_sighting(session, row->time_us, i);
    }
    bslam_link_writer_t out;
    begin_report(session, &out, SESSION_LOOKED, row->time_us);
    bslam_link_put_u8(&out, (uint8_t)status);
    bslam_link_put_u8(&out, (uint8_t)row->camera);
    bslam_link_put_u8(&out, (uint8_t)bslam_vision_reason(&seeing->vision));
    bslam_link_put_u8(&out, (uint8_t)seeing->count);
    session_put_step(session, &out);
    record_put_accounts(&out, &session->slam);
    session_send(session, &out);
}

void session_take_row(session_t *session, const port_row_t *row)
{
    const uint32_t began = port_ticks();
    bslam_status_t status = BSLAM_OK;
    if (row->is_first) {
        session->row_ticks = 0;
        status = camera_input_begin_rows(&session->seeing, row->camera);
    }
    if (status == BSLAM_OK) {
        status = camera_input_take_row(&session->seeing, row->pixels);
    }
    session->row_ticks += port_ticks() - began;
    if (row->is_last && status == BSLAM_OK) {
        look(session, row);
    }
}

#endif
