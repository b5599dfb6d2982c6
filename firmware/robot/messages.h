/// What the host may send: how each message is applied, and how it is answered.
#ifndef ROBOT_MESSAGES_H
#define ROBOT_MESSAGES_H

#include "robot/session.h"

typedef struct message {
    uint8_t type;
    void (*apply)(session_t *session, bslam_link_reader_t *reader);
    void (*answer)(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out);
} message_t;

/// NULL: there is no such message.
const message_t *message_find(uint8_t type);

/// False: a message of this kind only asks, or greets: it leaves the estimator as it is, also one with a
/// reading that waits.
bool message_changes(const message_t *message);

/// STEP: where the robot stands after the last one.
void message_put_step(const session_t *session, bslam_link_writer_t *out);

#endif
