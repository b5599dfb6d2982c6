/// What the files of a session call of each other: session.c has the protocol, exchange.c the messages,
/// sensors.c the robot's own encoders and cameras.
#ifndef ROBOT_MESSAGES_H
#define ROBOT_MESSAGES_H

#include "robot/session.h"

#define NO_DETAIL 255  // of a status that is about no parameter and no sighting

// ---- exchange.c -------------------------------------------------------------------------------------------

/// A message that the host may send: how it is applied, and how it is answered.
typedef struct exchange {
    uint8_t type;
    void (*apply)(session_t *session, bslam_link_reader_t *reader);
    void (*answer)(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out);
} message_t;

/// NULL: there is no such message.
const message_t *message_find(uint8_t type);

/// False: a message of this kind only asks, or greets: it leaves the filter as it is, also one with a reading
/// that waits.
bool message_changes(const message_t *exchange);

/// Starts over with the parameters as they were set and an empty map. The status of the library or the link,
/// and which parameter it is about.
uint8_t session_start_over(session_t *session, int *bad_id);

/// Where the robot stands after a step.
void session_put_step(session_t *session, bslam_link_writer_t *out);

// ---- session.c --------------------------------------------------------------------------------------------

/// A message of the robot's: begin, put, send. Its frame stands in session->out.
void session_begin(session_t *session, bslam_link_writer_t *out, uint8_t type, uint16_t sequence,
                   int64_t time_us);
void session_send(session_t *session, bslam_link_writer_t *out);

/// Before anything is done with the filter. False: its memory is no longer what it was, and it has started
/// over with an empty map.
bool session_is_good(session_t *session, int64_t time_us);

/// If a reading of the robot's own waits for a picture: it waits no longer (sensors.c).
void session_end_wait(session_t *session);

/// After whatever may have changed the filter: its fingerprint, if the host takes any.
void session_end_step(session_t *session);

#endif
