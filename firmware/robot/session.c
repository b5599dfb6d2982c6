#include "robot/session.h"

#include <string.h>

#include "port/port.h"
#include "robot/messages.h"
#include "robot/records.h"

// ---- frames out -------------------------------------------------------------------------------------------

static void send(session_t *session, bslam_link_writer_t *out)
{
    const size_t length = bslam_link_end(out);
    port_write(session->out, length);
}

/// Its frame stands in session->out.
static void begin(session_t *session, bslam_link_writer_t *out, uint8_t type, uint16_t sequence,
                  int64_t time_us)
{
    const bslam_link_header_t header = {.type = type, .sequence = sequence, .time_us = time_us};
    bslam_link_begin(out, session->out, sizeof session->out, &header);
}

/// A report of the robot's own.
static void begin_report(session_t *session, bslam_link_writer_t *out, uint8_t type, int64_t time_us)
{
    session->report_sequence++;
    begin(session, out, type, session->report_sequence, time_us);
}

/// Every answer says first what became of its message.
static void answer(session_t *session, const message_t *message)
{
    const bslam_link_header_t *asked = &session->parser.header;
    bslam_link_writer_t out;
    begin(session, &out, asked->type | SESSION_ANSWER, asked->sequence, asked->time_us);
    bslam_link_put_u8(&out, session->last_status);
    bslam_link_put_u8(&out, session->detail);
    if (message != NULL && session->last_status < SESSION_E_NO_SESSION) {
        bslam_link_reader_t reader = bslam_link_payload(&session->parser);
        message->answer(session, &reader, &out);
    }
    send(session, &out);
}

// ---- what the robot's own sensors did ---------------------------------------------------------------------

/// After whatever may have changed the estimator's state: its fingerprint, if the host takes any.
static void end_step(session_t *session, uint8_t status)
{
    if (status == BSLAM_E_STATE) {
        session->fingerprint = BSLAM_FINGERPRINT_START;  // it started over
    }
    if (session->takes_fingerprints) {
        session->fingerprint = bslam_fingerprint(&session->robot->slam, session->fingerprint);
    }
}

void session_use_reading(session_t *session, const bslam_odometry_reading_t *reading)
{
    const uint32_t began = port_ticks();
    const bslam_status_t status = robot_odometry(session->robot, reading);
    session->ticks = port_ticks() - began;
    end_step(session, (uint8_t)status);
    bslam_link_writer_t out;
    begin_report(session, &out, SESSION_POSE, reading->time_us);
    bslam_link_put_u8(&out, (uint8_t)status);
    bslam_link_put_u32(&out, reading->left_ticks);
    bslam_link_put_u32(&out, reading->right_ticks);
    bslam_link_put_u8(&out, reading->has_gyro ? SESSION_HAS_GYRO : 0);
    bslam_link_put_real(&out, reading->gyro_radps);
    bslam_link_put_real(&out, reading->gyro_sd_radps);
    message_put_step(session, &out);
    send(session, &out);
}

void session_end_wait(session_t *session)
{
    bslam_odometry_reading_t reading;
    if (robot_end_wait(session->robot, &reading)) {
        session_use_reading(session, &reading);
    }
}

#if ROBOT_VISION

static void report_sighting(session_t *session, int64_t time_us, int number)
{
    const robot_t *robot = session->robot;
    bslam_link_writer_t out;
    begin_report(session, &out, SESSION_SIGHTED, time_us);
    bslam_link_put_u8(&out, (uint8_t)number);
    record_put_sighting(&out, &robot->camera.sightings[number],
                        robot->in_force.association >= BSLAM_ASSOCIATION_SVM);
    send(session, &out);
}

void session_report_picture(session_t *session, int camera, int64_t time_us, bslam_status_t status,
                            uint32_t ticks)
{
    const camera_input_t *input = &session->robot->camera;
    session->ticks = ticks;
    end_step(session, (uint8_t)status);
    for (int i = 0; i < input->count; i++) {
        report_sighting(session, time_us, i);
    }
    bslam_link_writer_t out;
    begin_report(session, &out, SESSION_LOOKED, time_us);
    bslam_link_put_u8(&out, (uint8_t)status);
    bslam_link_put_u8(&out, (uint8_t)camera);
    bslam_link_put_u8(&out, (uint8_t)bslam_vision_reason(&input->vision));
    bslam_link_put_u8(&out, (uint8_t)input->count);
    message_put_step(session, &out);
    record_put_accounts(&out, &session->robot->slam);
    send(session, &out);
}

#endif

// ---- messages ---------------------------------------------------------------------------------------------

static bool takes_step(uint8_t type)
{
    return type == SESSION_ODOMETRY || type == SESSION_SIGHTINGS || type == SESSION_LOOK;
}

static void apply(session_t *session, const message_t *message)
{
    const uint8_t type = session->parser.header.type;
    session->last_sequence = session->parser.header.sequence;
    session->detail = SESSION_NO_DETAIL;
    if (type != SESSION_PIXELS && type != SESSION_LOOK) {
        session->ticks = 0;
    }
    if (!session->open && type != SESSION_HELLO) {
        session->last_status = SESSION_E_NO_SESSION;
        return;
    }
    if (message == NULL) {
        session->last_status = SESSION_E_TYPE;
        return;
    }
    bslam_link_reader_t reader = bslam_link_payload(&session->parser);
    message->apply(session, &reader);
    if (takes_step(type) || session->last_status == BSLAM_E_STATE) {
        end_step(session, session->last_status);
    }
}

/// How far a sequence number is ahead of the last one: 0 the same again, negative an older one.
static int16_t ahead(const session_t *session)
{
    return (int16_t)(uint16_t)(session->parser.header.sequence - session->last_sequence);
}

/// A greeting is taken with any number, but that of the present session only once: a replayed one would let
/// in all of the session's older messages.
static bool starts_session(const session_t *session)
{
    bslam_link_reader_t reader = bslam_link_payload(&session->parser);
    return !session->open ||
           (session->parser.header.type == SESSION_HELLO && bslam_link_get_u32(&reader) != session->id);
}

static void take_message(session_t *session)
{
    const message_t *message = message_find(session->parser.header.type);
    const bool starts = starts_session(session);
    if (!starts && ahead(session) < 0) {
        session->replayed++;
        return;
    }
    if (!starts && ahead(session) == 0) {
        session->repeated++;
    } else {
        if (message != NULL && message_changes(message)) {
            session_end_wait(session);  // what comes is to find the estimator after it
        }
        apply(session, message);
    }
    answer(session, message);
}

void session_take(session_t *session, uint8_t byte)
{
    if (bslam_link_push(&session->parser, byte)) {
        take_message(session);
    }
}

void session_listen(session_t *session)
{
    int byte = port_read();
    while (byte >= 0) {
        session_take(session, (uint8_t)byte);
        byte = port_read();
    }
}

void session_start(session_t *session, robot_t *robot)
{
    robot_start_t start;
    const bslam_status_t status = robot_start(robot, &start);
    memset(session, 0, sizeof *session);
    session->robot = robot;
    session->fingerprint = BSLAM_FINGERPRINT_START;
    bslam_link_writer_t out;
    // A delimiter first: whatever the line had before the start is no part of this frame.
    const uint8_t delimiter = 0;
    port_write(&delimiter, 1);
    begin(session, &out, SESSION_READY, 0, port_time_us());
    bslam_link_put_u8(&out, (uint8_t)status);
    bslam_link_put_u8(&out, (uint8_t)start);
    send(session, &out);
}
