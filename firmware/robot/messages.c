#include "robot/messages.h"

#include "port/port.h"
#include "robot/param_store.h"
#include "robot/records.h"

#define BEACON_BYTES 43
#define BEACONS_A_FRAME ((BSLAM_LINK_PAYLOAD_MAX - 16) / BEACON_BYTES)
#define FLAG_FINGERPRINT 1u
#define FLAG_AS_IT_IS 4u
#define FLAG_MOVED 1u

// ---- applied: the payload in, a status out ---------------------------------------------------------------

/// A payload that is read and is as long as it should be.
static bool is_whole(session_t *session, const bslam_link_reader_t *reader)
{
    if (bslam_link_is_read(reader)) {
        return true;
    }
    session->last_status = SESSION_E_LENGTH;
    return false;
}

static void keep(session_t *session, bslam_status_t status)
{
    session->last_status = (uint8_t)status;
}

/// After a call of the estimator itself.
static void end_call(session_t *session, bslam_status_t status)
{
    keep(session, status);
    robot_end_call(session->robot, status, session->parser.header.time_us);
}

static void apply_hello(session_t *session, bslam_link_reader_t *reader)
{
    robot_t *robot = session->robot;
    const uint32_t id = bslam_link_get_u32(reader);
    const uint8_t flags = bslam_link_get_u8(reader);
    if (is_whole(session, reader)) {
        session->id = id;
        session->open = true;
        session->takes_fingerprints = (flags & FLAG_FINGERPRINT) != 0;
        if ((flags & FLAG_AS_IT_IS) != 0) {
            robot->settings = robot->in_force;
        } else {
            health_init(&robot->health, &robot->slam);
            bslam_settings_preset(&robot->settings, BSLAM_PRESET_REAL_WHEELS);
        }
        keep(session, BSLAM_OK);
    }
}

static void apply_reset(session_t *session, bslam_link_reader_t *reader)
{
    if (is_whole(session, reader)) {
        int bad_setting = SESSION_NO_DETAIL;
        keep(session, robot_start_over(session->robot, &bad_setting));
        session->detail = (uint8_t)bad_setting;
        session->fingerprint = BSLAM_FINGERPRINT_START;
    }
}

static void apply_odometry(session_t *session, bslam_link_reader_t *reader)
{
    bslam_odometry_reading_t reading = {.time_us = session->parser.header.time_us};
    reading.source = (bslam_odometry_source_t)bslam_link_get_u8(reader);
    reading.has_gyro = (bslam_link_get_u8(reader) & SESSION_HAS_GYRO) != 0;
    if (reading.source == BSLAM_ODOMETRY_TICKS) {
        reading.left_ticks = bslam_link_get_u32(reader);
        reading.right_ticks = bslam_link_get_u32(reader);
    } else {
        const bslam_real_t a = bslam_link_get_real(reader);
        const bslam_real_t b = bslam_link_get_real(reader);
        const bool is_wheels = reading.source == BSLAM_ODOMETRY_WHEELS;
        reading.left_m = is_wheels ? a : 0;
        reading.right_m = is_wheels ? b : 0;
        reading.v_mps = is_wheels ? 0 : a;
        reading.omega_radps = is_wheels ? 0 : b;
    }
    reading.gyro_radps = bslam_link_get_real(reader);
    reading.gyro_sd_radps = bslam_link_get_real(reader);
    if (is_whole(session, reader)) {
        const uint32_t began = port_ticks();
        keep(session, robot_odometry(session->robot, &reading));
        session->ticks = port_ticks() - began;
    }
}

#if BSLAM_APPEARANCE

static void read_signature(bslam_link_reader_t *reader, float signature[BSLAM_SAMPLE_FEATURES])
{
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        signature[k] = (float)bslam_link_get_real(reader);
    }
}

/// Whether so many signatures are what is left of a payload: asked before the first is taken.
static bool holds_signatures(session_t *session, const bslam_link_reader_t *reader, int count)
{
    const size_t bytes = (size_t)count * BSLAM_SAMPLE_FEATURES * sizeof(float);
    if (!reader->failed && reader->left == bytes) {
        return true;
    }
    session->last_status = SESSION_E_LENGTH;
    return false;
}

static void apply_signatures(session_t *session, bslam_link_reader_t *reader)
{
    const int first = bslam_link_get_u8(reader);
    const int count = bslam_link_get_u8(reader);
    if (first + count > BSLAM_SIGHTINGS_MAX) {
        keep(session, BSLAM_E_COUNT);
    } else if (holds_signatures(session, reader, count)) {
        for (int i = first; i < first + count; i++) {
            read_signature(reader, session->signatures[i]);
        }
        keep(session, BSLAM_OK);
    }
}

/// A signature as classifiers keep it. False: not finite.
static bool encode(const float signature[BSLAM_SAMPLE_FEATURES], bslam_sample_t *sample)
{
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        const float x = signature[k];
        if (!(x >= -1e12f && x <= 1e12f)) {
            return false;
        }
        const float limited = x < -1.0f ? -1.0f : x > 1.0f ? 1.0f : x;
        sample->q[k] = (bslam_stored_t)(limited / BSLAM_SAMPLE_UNIT + (x < 0.0f ? -0.5f : 0.5f));
    }
    sample->q[BSLAM_SAMPLE_FEATURES] = (bslam_stored_t)(1.0f / BSLAM_SAMPLE_UNIT + 0.5f);
    return true;
}

/// Encodes signatures into samples, all into the same one where `step` is 0. False: one is not finite.
static bool read_seeds(bslam_link_reader_t reader, int count, bslam_sample_t *samples, int step)
{
    bool good = true;
    for (int i = 0; i < count && good; i++) {
        float signature[BSLAM_SAMPLE_FEATURES];
        read_signature(&reader, signature);
        good = encode(signature, &samples[i * step]);
    }
    return good;
}

/// Classifiers that run may already learn from the seeds: none is written unless all are good.
static void apply_seeds(session_t *session, bslam_link_reader_t *reader)
{
    robot_t *robot = session->robot;
    const int first = bslam_link_get_u8(reader);
    const int count = bslam_link_get_u8(reader);
    bslam_sample_t tried;
    if (first + count > BSLAM_SEEDS_MAX) {
        keep(session, BSLAM_E_COUNT);
    } else if (holds_signatures(session, reader, count)) {
        const bool good = read_seeds(*reader, count, &tried, 0);
        if (good) {
            (void)read_seeds(*reader, count, &robot->seeds[first], 1);
            robot_seal_seeds(robot);
            robot->settings.seeds = robot->seeds;
            robot->settings.seed_count = first + count;
        }
        keep(session, good ? BSLAM_OK : BSLAM_E_NOT_FINITE);
    }
}

static const float *signature_of(const session_t *session, int sighting)
{
    return session->signatures[sighting];
}

#else

static const float *signature_of(const session_t *session, int sighting)
{
    (void)session;
    (void)sighting;
    return NULL;
}

#endif

static void apply_sightings(session_t *session, bslam_link_reader_t *reader)
{
    const int count = bslam_link_get_u8(reader);
    for (int i = 0; i < count && i < BSLAM_SIGHTINGS_MAX; i++) {
        record_get_sighting(reader, signature_of(session, i), &session->sightings[i]);
    }
    // Of too many, which the library refuses, there is no room to read all.
    if (count > BSLAM_SIGHTINGS_MAX || is_whole(session, reader)) {
        const uint32_t began = port_ticks();
        const int64_t time_us = session->parser.header.time_us;
        keep(session, robot_sightings(session->robot, time_us, session->sightings, count));
        session->ticks = port_ticks() - began;
        session->detail = (uint8_t)bslam_health(&session->robot->slam).bad_sighting;
    }
}

static void apply_resume(session_t *session, bslam_link_reader_t *reader)
{
    const bslam_real_t position_sd_m = bslam_link_get_real(reader);
    const bslam_real_t heading_sd_rad = bslam_link_get_real(reader);
    if (is_whole(session, reader)) {
        end_call(session, bslam_resume_odometry(&session->robot->slam, position_sd_m, heading_sd_rad));
    }
}

static void apply_set_pose(session_t *session, bslam_link_reader_t *reader)
{
    bslam_pose_t pose;
    pose.x_m = bslam_link_get_real(reader);
    pose.y_m = bslam_link_get_real(reader);
    pose.theta_rad = bslam_link_get_real(reader);
    const bslam_real_t position_sd_m = bslam_link_get_real(reader);
    const bslam_real_t heading_sd_rad = bslam_link_get_real(reader);
    if (is_whole(session, reader)) {
        end_call(session, bslam_set_pose(&session->robot->slam, &pose, position_sd_m, heading_sd_rad));
    }
}

static void apply_known_beacon(session_t *session, bslam_link_reader_t *reader)
{
    const int32_t label = bslam_link_get_i32(reader);
    const bslam_real_t x_m = bslam_link_get_real(reader);
    const bslam_real_t y_m = bslam_link_get_real(reader);
    if (is_whole(session, reader)) {
        end_call(session, bslam_add_known_beacon(&session->robot->slam, label, x_m, y_m));
    }
}

static void apply_remove_beacon(session_t *session, bslam_link_reader_t *reader)
{
    const uint32_t uid = bslam_link_get_u32(reader);
    if (is_whole(session, reader)) {
        end_call(session, bslam_remove_beacon(&session->robot->slam, uid));
    }
}

static void apply_param_set(session_t *session, bslam_link_reader_t *reader)
{
    const int id = bslam_link_get_u16(reader);
    const bslam_real_t value = bslam_link_get_real(reader);
    if (is_whole(session, reader)) {
        keep(session, bslam_settings_set(&session->robot->settings, id, value));
    }
}

static void apply_param_save(session_t *session, bslam_link_reader_t *reader)
{
    if (is_whole(session, reader)) {
        const bool saved = param_store_save(&session->robot->settings);
        session->last_status = saved ? (uint8_t)BSLAM_OK : (uint8_t)SESSION_E_STORE;
    }
}

static void apply_map_save(session_t *session, bslam_link_reader_t *reader)
{
    if (is_whole(session, reader)) {
        const bslam_flash_t *flash = port_map_flash();
        bslam_map_fault_t fault;
        const bool saved =
            flash != NULL && bslam_save_to_flash(&session->robot->slam, flash, &fault) == BSLAM_OK;
        session->last_status = saved ? (uint8_t)BSLAM_OK : (uint8_t)SESSION_E_STORE;
    }
}

static void apply_map_write(session_t *session, bslam_link_reader_t *reader)
{
    const uint32_t at = bslam_link_get_u32(reader);
    const bool taken = !reader->failed && map_transfer_take(&session->map, at, reader);
    session->last_status = taken ? (uint8_t)BSLAM_OK : (uint8_t)SESSION_E_STORE;
}

static void apply_map_load(session_t *session, bslam_link_reader_t *reader)
{
    bslam_t *slam = &session->robot->slam;
    const uint32_t size = bslam_link_get_u32(reader);
    const bool freezes = bslam_link_get_u8(reader) != 0;
    if (is_whole(session, reader)) {
        const bool was_frozen = bslam_health(slam).is_frozen;
        bslam_freeze_map(slam, freezes);
        const bslam_status_t status = map_transfer_load(&session->map, slam, size);
        if (status != BSLAM_OK) {
            bslam_freeze_map(slam, was_frozen);
        }
        end_call(session, status);
    }
}

/// A question changes nothing: it is read when it is answered.
static void apply_nothing(session_t *session, bslam_link_reader_t *reader)
{
    (void)reader;
    keep(session, BSLAM_OK);
}

#if ROBOT_VISION

static void apply_camera(session_t *session, bslam_link_reader_t *reader)
{
    const int index = bslam_link_get_u8(reader);
    bslam_camera_t camera = {.lens = (bslam_lens_kind_t)bslam_link_get_u8(reader)};
    camera.width_px = bslam_link_get_u16(reader);
    camera.height_px = bslam_link_get_u16(reader);
    bslam_real_t *const values[] = {&camera.fx_px,   &camera.fy_px,     &camera.cx_px,
                                    &camera.cy_px,   &camera.k1,        &camera.k2,
                                    &camera.yaw_rad, &camera.pitch_rad, &camera.z_m};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        *values[i] = bslam_link_get_real(reader);
    }
    camera.zoom = bslam_link_get_u8(reader);
    if (is_whole(session, reader)) {
        keep(session, robot_set_camera(session->robot, index, &camera));
    }
}

static void apply_image(session_t *session, bslam_link_reader_t *reader)
{
    const int camera = bslam_link_get_u8(reader);
    const bslam_pixel_format_t format = (bslam_pixel_format_t)bslam_link_get_u8(reader);
    if (is_whole(session, reader)) {
        session->ticks = 0;
        keep(session, camera_input_begin(&session->robot->camera, camera, format));
    }
}

static void apply_pixels(session_t *session, bslam_link_reader_t *reader)
{
    const uint32_t began = port_ticks();
    bslam_status_t status = BSLAM_OK;
    while (reader->left > 0 && status == BSLAM_OK) {
        status = camera_input_take(&session->robot->camera, bslam_link_get_u8(reader));
    }
    keep(session, status);
    session->ticks += port_ticks() - began;
}

static void apply_look(session_t *session, bslam_link_reader_t *reader)
{
    const bool moved = (bslam_link_get_u8(reader) & FLAG_MOVED) != 0;
    if (is_whole(session, reader)) {
        const uint32_t began = port_ticks();
        camera_input_t *input = &session->robot->camera;
        bslam_status_t status = camera_input_look(input, moved);
        if (status == BSLAM_OK) {
            status = robot_sightings(session->robot, session->parser.header.time_us, input->sightings,
                                     input->count);
        }
        keep(session, status);
        session->ticks += port_ticks() - began;
    }
}

#endif

// ---- answered: from the state as it stands, so that one that was lost can be given again -----------------

void message_put_step(const session_t *session, bslam_link_writer_t *out)
{
    record_put_step(out, &session->robot->slam, session->fingerprint, session->ticks);
}

static void answer_hello(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    (void)reader;
    bslam_link_put_u32(out, session->id);
    bslam_link_put_u8(out, BSLAM_VERSION_MAJOR);
    bslam_link_put_u8(out, BSLAM_VERSION_MINOR);
    bslam_link_put_u8(out, BSLAM_VERSION_PATCH);
    bslam_link_put_u16(out, BSLAM_BEACONS_MAX);
    bslam_link_put_u16(out, BSLAM_RAYS_MAX);
    bslam_link_put_u16(out, BSLAM_SIGHTINGS_MAX);
    bslam_link_put_u16(out, BSLAM_HISTORY_MAX);
    bslam_link_put_u16(out, (uint16_t)param_store_count());
    bslam_link_put_u16(out, param_store_names_crc());
    bslam_link_put_u32(out, port_ticks_hz());
    const uint8_t *build_id = port_build_id();
    for (int i = 0; i < PORT_BUILD_ID_BYTES; i++) {
        bslam_link_put_u8(out, build_id[i]);
    }
}

static void answer_step(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    (void)reader;
    message_put_step(session, out);
}

static void answer_sightings(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    (void)reader;
    message_put_step(session, out);
    record_put_accounts(out, &session->robot->slam);
}

static void answer_nothing(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    (void)session;
    (void)reader;
    (void)out;
}

static void answer_param(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    const int id = bslam_link_get_u16(reader);
    bslam_link_put_real(out, param_store_get(&session->robot->settings, id));
}

static void answer_pose_at(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    (void)reader;
    bslam_pose_t pose = {0, 0, 0};
    const bslam_status_t status = bslam_pose_at(&session->robot->slam, session->parser.header.time_us, &pose);
    bslam_link_put_u8(out, (uint8_t)status);
    bslam_link_put_real(out, pose.x_m);
    bslam_link_put_real(out, pose.y_m);
    bslam_link_put_real(out, pose.theta_rad);
}

static void answer_map(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    const int total = (int)bslam_health(&session->robot->slam).beacons;
    const int first = bslam_link_get_u8(reader);
    const int rest = first < total ? total - first : 0;
    const int count = rest < BEACONS_A_FRAME ? rest : BEACONS_A_FRAME;
    bslam_link_put_u8(out, (uint8_t)total);
    bslam_link_put_u8(out, (uint8_t)count);
    for (int i = 0; i < count; i++) {
        bslam_beacon_view_t view;
        if (bslam_beacon(&session->robot->slam, first + i, &view) == BSLAM_OK) {
            record_put_beacon(out, &view);
        }
    }
}

_Static_assert(2 + sizeof(bslam_slam_counters_t) + sizeof(bslam_appearance_counters_t) +
                       sizeof(bslam_learner_counters_t) + sizeof(bslam_link_counters_t) + 8 <=
                   BSLAM_LINK_PAYLOAD_MAX,
               "the counters are one answer");

static void answer_map_read(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    map_transfer_put(&session->robot->slam, bslam_link_get_u32(reader), out);
}

static void answer_map_load(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    (void)reader;
    bslam_link_put_u8(out, (uint8_t)session->map.fault);
}

static void answer_counters(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    (void)reader;
    const bslam_counters_t counters = bslam_counters(&session->robot->slam);
    record_put_counters(out, &counters.slam, sizeof counters.slam);
    record_put_counters(out, &counters.appearance, sizeof counters.appearance);
    record_put_counters(out, &counters.learner, sizeof counters.learner);
    record_put_counters(out, &session->parser.counters, sizeof session->parser.counters);
    bslam_link_put_u32(out, session->repeated);
    bslam_link_put_u32(out, session->replayed);
}

static void answer_health(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    (void)reader;
    const robot_t *robot = session->robot;
    record_put_health(out, &robot->health, &robot->in_force, bslam_health(&robot->slam).state);
}

#if ROBOT_VISION

static void answer_look(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    answer_sightings(session, reader, out);
    bslam_link_put_u8(out, (uint8_t)bslam_vision_reason(&session->robot->camera.vision));
    bslam_link_put_u8(out, (uint8_t)session->robot->camera.count);
}

/// One a message: a frame of default size has no room for two.
static void answer_seen(session_t *session, bslam_link_reader_t *reader, bslam_link_writer_t *out)
{
    const int index = bslam_link_get_u8(reader);
    const bool there = index < session->robot->camera.count;
    bslam_link_put_u8(out, there ? 1 : 0);
    if (there) {
        record_put_sighting(out, &session->robot->camera.sightings[index], true);
    }
}

#endif

static const message_t messages[] = {
    {SESSION_HELLO, apply_hello, answer_hello},
    {SESSION_RESET, apply_reset, answer_nothing},
    {SESSION_ODOMETRY, apply_odometry, answer_step},
    {SESSION_SIGHTINGS, apply_sightings, answer_sightings},
    {SESSION_RESUME, apply_resume, answer_step},
    {SESSION_KNOWN_BEACON, apply_known_beacon, answer_nothing},
    {SESSION_REMOVE_BEACON, apply_remove_beacon, answer_nothing},
    {SESSION_PARAM_SET, apply_param_set, answer_nothing},
    {SESSION_PARAM_GET, apply_nothing, answer_param},
    {SESSION_POSE_AT, apply_nothing, answer_pose_at},
    {SESSION_MAP, apply_nothing, answer_map},
    {SESSION_COUNTERS, apply_nothing, answer_counters},
#if BSLAM_APPEARANCE
    {SESSION_SIGNATURES, apply_signatures, answer_nothing},
    {SESSION_SEEDS, apply_seeds, answer_nothing},
#endif
    {SESSION_STATE, apply_nothing, answer_step},
    {SESSION_PARAM_SAVE, apply_param_save, answer_nothing},
    {SESSION_SET_POSE, apply_set_pose, answer_step},
    {SESSION_HEALTH, apply_nothing, answer_health},
    {SESSION_MAP_READ, apply_nothing, answer_map_read},
    {SESSION_MAP_WRITE, apply_map_write, answer_nothing},
    {SESSION_MAP_LOAD, apply_map_load, answer_map_load},
    {SESSION_MAP_SAVE, apply_map_save, answer_nothing},
#if ROBOT_VISION
    {SESSION_CAMERA, apply_camera, answer_nothing},
    {SESSION_IMAGE, apply_image, answer_nothing},
    {SESSION_PIXELS, apply_pixels, answer_nothing},
    {SESSION_LOOK, apply_look, answer_look},
    {SESSION_SEEN, apply_nothing, answer_seen},
#endif
};

bool message_changes(const message_t *message)
{
    return message->apply != apply_nothing && message->type != SESSION_HELLO;
}

const message_t *message_find(uint8_t type)
{
    for (size_t i = 0; i < sizeof messages / sizeof messages[0]; i++) {
        if (messages[i].type == type) {
            return &messages[i];
        }
    }
    return NULL;
}
