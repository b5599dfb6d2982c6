#include "app/session.h"

#include "app/exchange.h"
#include "app/stored.h"
#include "port/port.h"

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
static void answer(session_t *session, const exchange_t *exchange)
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

bool session_is_good(session_t *session, int64_t time_us)
{
    if (watch_is_good(&session->watch, &session->slam, time_us)) {
        return true;
    }
    int bad_id;
    const uint8_t status = session_start_over(session, &bad_id);
    (void)status;  // the parameters were good before
    watch_end_step(&session->watch, &session->slam, time_us);
    return false;
}

void session_end_step(session_t *session)
{
    if (session->takes_fingerprints) {
        session->fingerprint = bslam_slam_fingerprint(&session->slam, session->fingerprint);
    }
}

static void apply(session_t *session, const exchange_t *exchange)
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
        watch_end_step(&session->watch, &session->slam, time_us);
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

static void take_message(session_t *session)
{
    const exchange_t *exchange = exchange_find(session->parser.header.type);
    const bool starts = session->parser.header.type == SESSION_HELLO;
    if (session->open && !starts && ahead(session) < 0) {
        session->replayed++;
        return;
    }
    if (session->open && !starts && ahead(session) == 0) {
        session->repeated++;
    } else {
        if (exchange != NULL && exchange_changes(exchange)) {
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
        if (seeing_set_camera(&session->seeing, i, &cameras[i]) != BSLAM_OK) {
            return 0;
        }
    }
    return count;
#else
    (void)session;
    return 0;
#endif
}

/// What was stored; else the defaults, but that what a camera sees has no label, and that its turn rates are
/// rough.
static uint8_t start_with_params(session_t *session, bool has_eyes)
{
    int bad_id = NO_DETAIL;
    if (stored_params_load(&session->params)) {
        const uint8_t status = session_start_over(session, &bad_id);
        if (status == BSLAM_OK) {
            return status;
        }
        bslam_params_default(&session->params);  // they contradict each other
    }
    if (has_eyes) {
        session->params.association = SESSION_LOOKS ? BSLAM_ASSOCIATION_SVM : BSLAM_ASSOCIATION_MAHALANOBIS;
#if SESSION_TURNS
        session->params.gyro_sd_radps = turning_sd_radps(&session->seeing.vision);
#endif
    }
    return session_start_over(session, &bad_id);
}

void session_init(session_t *session)
{
    *session = (session_t){0};
    const bool has_eyes = open_eyes(session) > 0;
    const uint8_t status = start_with_params(session, has_eyes);
    bslam_link_writer_t out;
    // A delimiter first: whatever the line had before the start is no part of this frame.
    const uint8_t delimiter = 0;
    port_write(&delimiter, 1);
    session_begin(session, &out, SESSION_READY, 0, port_time_us());
    bslam_link_put_u8(&out, status);
    session_send(session, &out);
}
