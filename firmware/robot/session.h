/// The robot's side of the link: messages in, calls of the robot, answers out. docs/LINK.md has every
/// message.
///
/// The host leads: it opens a session, and each of its messages is applied once and answered once. A message
/// that comes again, because its answer was lost, is answered again and not applied again; an older one is
/// dropped and counted. What the robot's own sensors did is reported to the host besides.
#ifndef ROBOT_SESSION_H
#define ROBOT_SESSION_H

#include "link/parser.h"
#include "robot/map_transfer.h"
#include "robot/robot.h"

/// What the host may send. The answer to message m has type m | SESSION_ANSWER and the same sequence number.
typedef enum session_message {
    SESSION_HELLO = 0x01,         ///< opens a session; the answer says what the image is
    SESSION_RESET = 0x02,         ///< starts over, with the parameters as they were set
    SESSION_ODOMETRY = 0x03,      ///< a reading
    SESSION_SIGHTINGS = 0x04,     ///< what an image shows; the answer has the account of each sighting
    SESSION_RESUME = 0x05,        ///< after an interruption of odometry
    SESSION_KNOWN_BEACON = 0x06,  ///< a beacon whose place is given
    SESSION_REMOVE_BEACON = 0x07,
    SESSION_PARAM_SET = 0x08,  ///< takes effect at the next SESSION_RESET
    SESSION_PARAM_GET = 0x09,
    SESSION_POSE_AT = 0x0a,
    SESSION_MAP = 0x0b,  ///< asks for a part of the map
    SESSION_COUNTERS = 0x0c,
    SESSION_SIGNATURES = 0x0d,  ///< how some of the next frame's sightings look
    SESSION_SEEDS = 0x0e,       ///< signatures of things that are no beacon, for the next SESSION_RESET
    SESSION_STATE = 0x0f,       ///< asks where the robot stands
    SESSION_PARAM_SAVE = 0x10,  ///< keeps the parameters as set over a restart
    SESSION_SET_POSE = 0x16,    ///< the robot is told where it is
    SESSION_HEALTH = 0x17,      ///< asks what went wrong so far, and what the robot knows of it
    SESSION_MAP_READ = 0x18,    ///< asks for bytes of the map as a blob
    SESSION_MAP_WRITE = 0x19,   ///< bytes of a map
    SESSION_MAP_LOAD = 0x1a,    ///< takes the map that was written in place of its own
    SESSION_MAP_SAVE = 0x1b,    ///< keeps the map over a restart
    SESSION_CAMERA = 0x11,      ///< what a camera is; this and the next four: only with ROBOT_VISION
    SESSION_IMAGE = 0x12,       ///< starts a picture
    SESSION_PIXELS = 0x13,      ///< the next bytes of it
    SESSION_LOOK = 0x14,        ///< ends it: what it shows goes into the filter
    SESSION_SEEN = 0x15,        ///< asks what it showed
    SESSION_ANSWER = 0x80
} session_message_t;

/// What the robot sends of itself.
typedef enum session_report {
    SESSION_READY = 0x40,    ///< once after start-up
    SESSION_POSE = 0x41,     ///< after a reading of the robot's own encoders
    SESSION_SIGHTED = 0x42,  ///< each thing that a picture of the robot's own camera shows, then
    SESSION_LOOKED = 0x43    ///< what became of them
} session_report_t;

/// A flag of SESSION_ODOMETRY and SESSION_POSE: a gyro's rate goes with the reading.
#define SESSION_HAS_GYRO 1u

/// Statuses of the link itself; those of the library are below, from 0 up.
typedef enum session_status {
    SESSION_E_NO_SESSION = 0x40,  ///< no SESSION_HELLO came since the robot started
    SESSION_E_TYPE = 0x41,        ///< no such message
    SESSION_E_LENGTH = 0x42,      ///< the payload is not as long as its message is
    SESSION_E_STORE = 0x43        ///< the board keeps nothing, or failed to
} session_status_t;

/// In place of the setting or sighting that a status is about: it is about none.
#define SESSION_NO_DETAIL 255

/// All members are the session's own.
typedef struct session {
    robot_t *robot;
    map_transfer_t map;
#if BSLAM_APPEARANCE
    float signatures[BSLAM_SIGHTINGS_MAX][BSLAM_SAMPLE_FEATURES];
#endif
    bslam_link_parser_t parser;
    uint32_t id;  ///< the host's number of this session
    bool open;
    bool takes_fingerprints;
    uint16_t last_sequence;
    uint16_t report_sequence;
    uint8_t last_status;
    uint8_t detail;     ///< of the last status: the setting or sighting at fault, or SESSION_NO_DETAIL
    uint32_t repeated;  ///< messages that came again
    uint32_t replayed;  ///< older messages, which were dropped
    uint32_t ticks;     ///< that the last message took to apply; a look with all of its pixels
    uint64_t fingerprint;
    union {
        bslam_sighting_t sightings[BSLAM_SIGHTINGS_MAX];  ///< while a message is applied
        uint8_t out[BSLAM_LINK_FRAME_MAX];                ///< while a frame is sent
    };
} session_t;

/// Starts a session over a robot, whose memory stays where it is, and reports that it is ready, and with
/// what.
void session_start(session_t *session, robot_t *robot);

/// Takes a byte that came over the link; applies and answers the message that it completes.
void session_take(session_t *session, uint8_t byte);

/// Takes all that have come.
void session_listen(session_t *session);

/// A reading of the robot's own encoders goes into the estimator, and out as a report.
void session_use_reading(session_t *session, const bslam_odometry_reading_t *reading);

/// The same of the reading that waits for its picture, if one does.
void session_end_wait(session_t *session);

#if ROBOT_VISION
/// What a picture of the robot's own camera shows stands in robot->camera; it went into the estimator with
/// this status, and took so many ticks.
void session_report_picture(session_t *session, int camera, int64_t time_us, bslam_status_t status,
                            uint32_t ticks);
#endif

#endif
