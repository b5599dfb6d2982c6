/// One robot's side of the link: messages in, calls of the library, answers out. docs/LINK.md has every
/// message.
///
/// The host leads: it opens a session, and each of its messages is applied once and answered once. A message
/// that comes again, because its answer was lost, is answered again and not applied again; an older one is
/// dropped and counted.
#ifndef ROBOT_SESSION_H
#define ROBOT_SESSION_H

#include "robot/camera_input.h"
#include "robot/map_transfer.h"
#include "robot/health.h"
#include "bslam/bslam.h"
#include "port/port.h"

/// 0: the robot learns no looks, which saves bslam_appearance_t, the largest part of its memory.
#ifndef SESSION_APPEARANCE
#define SESSION_APPEARANCE 1
#endif
/// 1: where the parameter `filter` asks for the smoother, it has one, which takes bslam_smoother_t.
#ifndef SESSION_SMOOTHER
#define SESSION_SMOOTHER 0
#endif

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
    SESSION_CAMERA = 0x11,      ///< what a camera is; this and the next four: only with SESSION_VISION
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

/// What a robot has after start-up, as SESSION_READY says.
typedef enum session_start {
    SESSION_STARTED_EMPTY = 0,
    SESSION_STARTED_IN_MAP,  ///< in the saved map, where it does not know its place yet
    SESSION_WENT_ON          ///< its memory outlasted the reset: all that it knew
} session_start_t;

/// Statuses of the link itself; those of the library are below, from 0 up.
typedef enum session_status {
    SESSION_E_NO_SESSION = 0x40,  ///< no SESSION_HELLO came since the robot started
    SESSION_E_TYPE = 0x41,        ///< no such message
    SESSION_E_LENGTH = 0x42,      ///< the payload is not as long as its message is
    SESSION_E_STORE = 0x43,       ///< the board keeps nothing, or failed to
    SESSION_E_APPEARANCE = 0x44,  ///< the image learns no looks
    SESSION_E_SMOOTHER = 0x45     ///< the image has no smoother
} session_status_t;

/// All members are the session's own. In memory that outlasts a reset (PORT_KEPT) the filter does so, too.
typedef struct session {
    bslam_slam_t slam;
#if SESSION_APPEARANCE
    bslam_appearance_t appearance;
#endif
#if SESSION_SMOOTHER
    bslam_smoother_t smoother;
#endif
    health_t watch;
    uint32_t mark;  ///< that the members above are this image's; those below start anew with the program
    map_transfer_t carried;
#if SESSION_APPEARANCE
    float signatures[BSLAM_SIGHTINGS_MAX][BSLAM_SAMPLE_FEATURES];
    bslam_sample_t seeds[BSLAM_SEEDS_MAX];
    int32_t seed_count;
#endif
#if SESSION_VISION
    camera_input_t seeing;
#endif
    bslam_settings_t settings;  ///< as set, for the next reset
    bslam_link_parser_t parser;
    uint32_t id;  ///< the host's number of this session
    bool open;
    bool takes_fingerprints;
    bool uses_appearance;
    uint32_t left_ticks;  ///< of the robot's own encoders, when they were last read
    uint32_t right_ticks;
    uint32_t moves;  ///< readings that showed a movement
#if SESSION_VISION
    uint32_t moves_seen[BSLAM_CAMERAS_MAX];  ///< when each camera's last picture was looked at
    uint32_t row_ticks;                      ///< that the picture which streams in took so far
#endif
    uint16_t last_sequence;
    uint16_t report_sequence;
    uint8_t last_status;
    uint8_t detail;     ///< of the last status: the parameter or sighting at fault, 255: none
    uint32_t repeated;  ///< messages that came again
    uint32_t replayed;  ///< older messages, which were dropped
    uint32_t ticks;     ///< that the last message took to apply; a look with all of its pixels
    uint64_t fingerprint;
    bslam_sighting_t sightings[BSLAM_SIGHTINGS_MAX];
    uint8_t out[BSLAM_LINK_FRAME_MAX];
} session_t;

/// Goes on after a reset where the filter's memory is guarded and as it was when it was last sealed: the map
/// and the pose, this one as doubtful as a second without odometry makes it. Otherwise starts with the
/// parameters that were saved or else the defaults, in the map that was saved or else an empty one; in a
/// saved map with recovery and guard. Reports that the robot is ready, and with what.
///
/// *session: all zero, or what a reset left of it, which may be anything.
void session_init(session_t *session);

/// Takes a byte that came over the link; applies and answers the message that it completes.
void session_take(session_t *session, uint8_t byte);

/// A reading of the robot's own encoders, and of its gyro; reports it, and the pose. Without a gyro, and with
/// SESSION_TURNS, it waits until the picture of its moment has been looked at, but not beyond the next
/// reading, or message that changes anything.
void session_take_reading(session_t *session, const bslam_odometry_reading_t *reading);

/// The reading that port_encoders and port_gyro have, if one is due.
bool session_read_body(bslam_odometry_reading_t *reading);

#if SESSION_VISION
/// A row of a picture of the robot's own camera. The last one puts what the picture shows into the filter,
/// and reports it; of a picture whose first rows did not come nothing is used.
void session_take_row(session_t *session, const port_row_t *row);
#endif

#endif
