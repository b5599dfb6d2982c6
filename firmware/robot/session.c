#include "robot/session.h"

#include "robot/messages.h"
#include "robot/param_store.h"
#include "base/crc32.h"
#include "port/port.h"

#include <stddef.h>
#include <string.h>

/// No reset takes longer.
static const bslam_real_t RESTART_S = 1;

void session_send(session_t *session, bslam_link_writer_t *out)
{
    const size_t length = bslam_link_end(out);
    port_write(session->out, length);
}

void session_begin(session_t *session, bslam_link_writer_t *out, uint8_t type, uint16_t sequence,
                   int64_t time_us)
{
    const bslam_link_header_t header = {.type = type, .sequence = sequence, .time_us = time_us};
    bslam_link_begin(out, session->out, sizeof session->out, &header);
}

/// Every answer says first what became of its message.
static void answer(session_t *session, const message_t *exchange)
{
    const bslam_link_header_t *asked = &session->parser.header;
    bslam_link_writer_t out;
    session_begin(session, &out, asked->type | SESSION_ANSWER, asked->sequence, asked->time_us);
    bslam_link_put_u8(&out, session->last_status);
    bslam_link_put_u8(&out, session->detail);
    if (exchange != NULL && session->last_status < SESSION_E_NO_SESSION) {
        bslam_link_reader_t reader = bslam_link_payload(&session->parser);
        exchange->answer(session, &reader, &out);
    }
    session_send(session, &out);
}

/// In the map that was saved; false: there is none, or nothing that would find the robot in it.
static bool enter_saved_map(session_t *session)
{
    const bslam_flash_t *flash = port_map_flash();
    bslam_map_fault_t fault;
    return flash != NULL && session->watch.recovers &&
           bslam_slots_load(flash, &session->slam, BSLAM_MAP_LIVING, &fault) == BSLAM_OK;
}

bool session_is_good(session_t *session, int64_t time_us)
{
    if (health_is_good(&session->watch, &session->slam, time_us)) {
        return true;
    }
    int bad_id;
    const uint8_t status = session_start_over(session, &bad_id);
    (void)status;  // the parameters were good before
    (void)enter_saved_map(session);
    health_end_step(&session->watch, &session->slam, time_us);
    return false;
}

void session_end_step(session_t *session)
{
    if (session->takes_fingerprints) {
        session->fingerprint = bslam_slam_fingerprint(&session->slam, session->fingerprint);
    }
}

static void apply(session_t *session, const message_t *exchange)
{
    session->last_sequence = session->parser.header.sequence;
    session->detail = NO_DETAIL;
    if (session->parser.header.type != SESSION_PIXELS && session->parser.header.type != SESSION_LOOK) {
        session->ticks = 0;
    }
    if (!session->open && session->parser.header.type != SESSION_HELLO) {
        session->last_status = SESSION_E_NO_SESSION;
        return;
    }
    if (exchange == NULL) {
        session->last_status = SESSION_E_TYPE;
        return;
    }
    const int64_t time_us = session->parser.header.time_us;
    const bool is_of_filter = exchange->type != SESSION_PIXELS;  // of which there are too many to check each
    if (is_of_filter && exchange->type != SESSION_HELLO && !session_is_good(session, time_us)) {
        session->last_status = BSLAM_E_STATE;
        return;
    }
    bslam_link_reader_t reader = bslam_link_payload(&session->parser);
    exchange->apply(session, &reader);
    if (is_of_filter) {
        health_end_step(&session->watch, &session->slam, time_us);
    }
    if (exchange->type == SESSION_ODOMETRY || exchange->type == SESSION_SIGHTINGS ||
        exchange->type == SESSION_LOOK) {
        session_end_step(session);
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
    const message_t *exchange = message_find(session->parser.header.type);
    const bool starts = starts_session(session);
    if (!starts && ahead(session) < 0) {
        session->replayed++;
        return;
    }
    if (!starts && ahead(session) == 0) {
        session->repeated++;
    } else {
        if (exchange != NULL && message_changes(exchange)) {
            session_end_wait(session);
        }
        apply(session, exchange);
    }
    answer(session, exchange);
}

void session_take(session_t *session, uint8_t byte)
{
    if (bslam_link_push(&session->parser, byte)) {
        take_message(session);
    }
}

/// The robot's own cameras, if it has any; their number, 0 if the front end refuses one.
static int open_eyes(session_t *session)
{
#if SESSION_VISION
    int count = 0;
    const bslam_camera_t *cameras = port_cameras(&count);
    for (int i = 0; i < count; i++) {
        if (camera_input_set_camera(&session->seeing, i, &cameras[i]) != BSLAM_OK) {
            return 0;
        }
    }
    return count;
#else
    (void)session;
    return 0;
#endif
}

/// What was stored; else the defaults, but that what a camera sees has no label.
static uint8_t start_with_params(session_t *session, bool has_eyes)
{
    int bad_id = NO_DETAIL;
    if (param_store_params_load(&session->settings)) {
        const uint8_t status = session_start_over(session, &bad_id);
        if (status == BSLAM_OK) {
            return status;
        }
        bslam_settings_preset(&session->settings, BSLAM_PRESET_PAPER);  // they contradict each other
    }
    if (has_eyes) {
        session->settings.association =
            SESSION_APPEARANCE ? BSLAM_ASSOCIATION_SVM : BSLAM_ASSOCIATION_MAHALANOBIS;
    }
    return session_start_over(session, &bad_id);
}

/// Of this image and no other: what is kept has its addresses.
static uint32_t image_mark(void)
{
    return ~bslam_crc32_add(BSLAM_CRC32_START, port_build_id(), PORT_BUILD_ID_BYTES);
}

static bool is_kept(session_t *session)
{
    return session->mark == image_mark() && health_is_kept(&session->watch, &session->slam);
}

/// Time stamps and the counters of wheels begin anew, and the robot may have rolled on meanwhile.
static uint8_t go_on(session_t *session)
{
    const bslam_settings_t *settings = &session->slam.settings;
    const bslam_real_t way_sd_m = settings->gap_speed_sd_mps * RESTART_S;
    const bslam_real_t turn_sd_rad = settings->gap_turn_sd_radps * RESTART_S;
    session->settings = *settings;
    session->uses_appearance = session->slam.appearance != NULL;
    health_go_on(&session->watch, port_time_us());
    return (uint8_t)bslam_slam_resume_odometry(&session->slam, way_sd_m < 30 ? way_sd_m : 30,
                                               turn_sd_rad < 3 ? turn_sd_rad : 3);
}

static session_start_t start_cold(session_t *session, bool has_eyes, uint8_t *status)
{
    *status = start_with_params(session, has_eyes);
    health_init(&session->watch, true, true);
    if (*status == BSLAM_OK && enter_saved_map(session)) {
        return SESSION_STARTED_IN_MAP;
    }
    health_init(&session->watch, false, false);
    return SESSION_STARTED_EMPTY;
}

void session_init(session_t *session)
{
    const bool kept = is_kept(session);
    const size_t keeps = kept ? offsetof(session_t, carried) : 0;
    memset((uint8_t *)session + keeps, 0, sizeof *session - keeps);
    const bool has_eyes = open_eyes(session) > 0;
    uint8_t status = BSLAM_OK;
    session_start_t start = SESSION_WENT_ON;
    if (kept) {
        status = go_on(session);
    } else {
        start = start_cold(session, has_eyes, &status);
    }
    session->mark = image_mark();
    health_end_step(&session->watch, &session->slam, port_time_us());
    bslam_link_writer_t out;
    // A delimiter first: whatever the line had before the start is no part of this frame.
    const uint8_t delimiter = 0;
    port_write(&delimiter, 1);
    session_begin(session, &out, SESSION_READY, 0, port_time_us());
    bslam_link_put_u8(&out, status);
    bslam_link_put_u8(&out, (uint8_t)start);
    session_send(session, &out);
}
