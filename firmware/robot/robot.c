#include "robot/robot.h"

#include <stddef.h>
#include <string.h>

#include "link/crc16.h"
#include "robot/param_store.h"
#if ROBOT_VISION && BSLAM_APPEARANCE && !defined(ROBOT_KINDS)
#define HAS_SEEDS 1
#include "models/seeds.h"
#else
#define HAS_SEEDS 0
#endif

/// No reset takes longer.
static const bslam_real_t RESTART_S = 1;
/// bslam_restart takes no larger ones.
static const bslam_real_t POSITION_SD_MAX_M = 30;
static const bslam_real_t HEADING_SD_MAX_RAD = 3;

// ---- what outlasts a reset --------------------------------------------------------------------------------

static uint16_t add_bytes(uint16_t crc, const void *bytes, size_t count)
{
    const uint8_t *from = bytes;
    for (size_t i = 0; i < count; i++) {
        crc = bslam_crc16_add(crc, from[i]);
    }
    return crc;
}

/// Over what the estimator does not guard itself.
static uint16_t crc_of(const robot_t *robot)
{
    uint16_t crc = add_bytes(BSLAM_CRC16_START, &robot->in_force, sizeof robot->in_force);
#if BSLAM_APPEARANCE
    crc = add_bytes(crc, robot->seeds, sizeof robot->seeds);
#endif
    return bslam_crc16_end(crc);
}

void robot_seal_seeds(robot_t *robot)
{
    robot->crc = crc_of(robot);
}

static bool is_kept(const robot_t *robot)
{
    return memcmp(robot->image, port_build_id(), PORT_BUILD_ID_BYTES) == 0 && robot->crc == crc_of(robot);
}

static bslam_real_t at_most(bslam_real_t value, bslam_real_t most)
{
    return value < most ? value : most;
}

/// With the state that a reset left, if it is good. Time stamps and the counters of wheels begin anew, and
/// the robot may have rolled on meanwhile.
static bool goes_on(robot_t *robot)
{
    const bslam_settings_t *settings = &robot->in_force;
    if (!is_kept(robot) ||
        bslam_restart(&robot->slam, at_most(settings->gap_speed_sd_mps * RESTART_S, POSITION_SD_MAX_M),
                      at_most(settings->gap_turn_sd_radps * RESTART_S, HEADING_SD_MAX_RAD)) != BSLAM_OK) {
        return false;
    }
    robot->settings = robot->in_force;
    health_look(&robot->health, &robot->slam, port_time_us());
    health_note(&robot->health, HEALTH_RESTARTED, port_time_us());
    return true;
}

// ---- starting ---------------------------------------------------------------------------------------------

/// Starts over with these settings, which may be those in force. bslam_init's statuses.
static bslam_status_t begin(robot_t *robot, const bslam_settings_t *settings, int *bad_setting)
{
    const bslam_status_t status = bslam_init(&robot->slam, settings, bad_setting);
    if (status == BSLAM_OK) {
        robot->in_force = *settings;
        memcpy(robot->image, port_build_id(), PORT_BUILD_ID_BYTES);
        robot_seal_seeds(robot);
        health_begin(&robot->health);
    }
    return status;
}

bslam_status_t robot_start_over(robot_t *robot, int *bad_setting)
{
    return begin(robot, &robot->settings, bad_setting);
}

/// False: there is none.
static bool enter_saved_map(robot_t *robot)
{
    const bslam_flash_t *flash = port_map_flash();
    bslam_map_fault_t fault;
    return flash != NULL && bslam_load_from_flash(&robot->slam, flash, &fault) == BSLAM_OK;
}

/// The robot's own cameras; false: it has none, or the front end refuses one.
static bool open_cameras(robot_t *robot)
{
    int count = 0;
#if ROBOT_VISION
    const bslam_camera_t *cameras = port_cameras(&count);
    for (int i = 0; i < count; i++) {
        if (robot_set_camera(robot, i, &cameras[i]) != BSLAM_OK) {
            return false;
        }
    }
#else
    (void)robot;
#endif
    return count > 0;
}

/// What a camera sees has no label, and what it measures has its own noise.
static void set_for_cameras(bslam_settings_t *settings)
{
    settings->association = BSLAM_APPEARANCE ? BSLAM_ASSOCIATION_BOTH : BSLAM_ASSOCIATION_MAHALANOBIS;
    settings->recovery = BSLAM_RECOVERY;
    bslam_settings_preset(settings, BSLAM_PRESET_CAMERA);
}

/// What classifiers of a robot with cameras start from; of a user's own kinds there is nothing.
static void name_seeds(bslam_settings_t *settings)
{
#if HAS_SEEDS
    settings->seeds = bslam_rendered_seeds;
    settings->seed_count = BSLAM_RENDERED_SEEDS;
#else
    (void)settings;
#endif
}

/// With what was stored, else with the board's own settings.
static bslam_status_t start_with_settings(robot_t *robot, bool has_cameras)
{
    bslam_settings_t *settings = &robot->settings;
    int bad_setting;
    if (param_store_load(settings)) {
        if (has_cameras) {
            name_seeds(settings);
        }
        if (robot_start_over(robot, &bad_setting) == BSLAM_OK) {
            return BSLAM_OK;
        }
    }
    bslam_settings_preset(settings, BSLAM_PRESET_REAL_WHEELS);
    if (has_cameras) {
        set_for_cameras(settings);
        name_seeds(settings);
    }
    return robot_start_over(robot, &bad_setting);
}

/// In the saved map, with what finds the robot there. False: there is none, and the estimator is to be begun.
static bool starts_in_map(robot_t *robot)
{
    const int32_t asked[2] = {robot->settings.recovery, robot->settings.guard};
    int bad_setting;
    robot->settings.recovery = BSLAM_RECOVERY;
    robot->settings.guard = BSLAM_GUARD > 0 ? 1 : 0;
    if (BSLAM_RECOVERY && robot_start_over(robot, &bad_setting) == BSLAM_OK && enter_saved_map(robot)) {
        return true;
    }
    robot->settings.recovery = asked[0];
    robot->settings.guard = asked[1];
    return false;
}

static bslam_status_t start_cold(robot_t *robot, bool has_cameras, robot_start_t *start)
{
    bslam_status_t status = start_with_settings(robot, has_cameras);
    int bad_setting;
    *start = ROBOT_STARTED_EMPTY;
    if (status == BSLAM_OK && port_map_flash() != NULL) {
        if (starts_in_map(robot)) {
            *start = ROBOT_STARTED_IN_MAP;
        } else {
            status = robot_start_over(robot, &bad_setting);
        }
    }
    health_init(&robot->health, &robot->slam);
    return status;
}

bslam_status_t robot_start(robot_t *robot, robot_start_t *start)
{
    const size_t kept = offsetof(robot_t, settings);
    memset((uint8_t *)robot + kept, 0, sizeof *robot - kept);
    const bool has_cameras = open_cameras(robot);
    if (goes_on(robot)) {
        *start = ROBOT_WENT_ON;
        return BSLAM_OK;
    }
    memset(robot, 0, kept);
    return start_cold(robot, has_cameras, start);
}

// ---- steps ------------------------------------------------------------------------------------------------

void robot_end_call(robot_t *robot, bslam_status_t status, int64_t time_us)
{
    health_look(&robot->health, &robot->slam, time_us);
    if (status != BSLAM_E_STATE) {
        return;
    }
    health_note(&robot->health, HEALTH_CORRUPT, time_us);
    const bool is_whole = robot->crc == crc_of(robot);
    int bad_setting;
    if (begin(robot, is_whole ? &robot->in_force : &robot->settings, &bad_setting) == BSLAM_OK &&
        robot->in_force.recovery != 0) {
        (void)enter_saved_map(robot);
    }
}

bslam_status_t robot_odometry(robot_t *robot, const bslam_odometry_reading_t *reading)
{
    const bslam_status_t status = bslam_odometry(&robot->slam, reading);
    robot_end_call(robot, status, reading->time_us);
    return status;
}

bslam_status_t robot_sightings(robot_t *robot, int64_t time_us, const bslam_sighting_t *sightings, int count)
{
    const bslam_status_t status = bslam_sightings(&robot->slam, time_us, sightings, count);
    robot_end_call(robot, status, time_us);
    return status;
}

// ---- what the robot measures itself -----------------------------------------------------------------------

bool robot_lets_wait(robot_t *robot, const bslam_odometry_reading_t *reading)
{
    if (reading->left_ticks != robot->left_ticks || reading->right_ticks != robot->right_ticks) {
        robot->moves++;
    }
    robot->left_ticks = reading->left_ticks;
    robot->right_ticks = reading->right_ticks;
#if ROBOT_VISION && BSLAM_VISION_TURNS
    return !reading->has_gyro && robot->camera.camera_count > 0 &&
           gyro_wait_begin(&robot->gyro_wait, &robot->camera, &robot->in_force, reading);
#else
    return false;
#endif
}

bool robot_end_wait(robot_t *robot, bslam_odometry_reading_t *reading)
{
#if ROBOT_VISION && BSLAM_VISION_TURNS
    return gyro_wait_end(&robot->gyro_wait, reading);
#else
    (void)robot;
    (void)reading;
    return false;
#endif
}

#if ROBOT_VISION

bslam_status_t robot_set_camera(robot_t *robot, int index, const bslam_camera_t *camera)
{
    const bslam_status_t status = camera_input_set_camera(&robot->camera, index, camera);
#if ROBOT_VISION && BSLAM_VISION_TURNS
    gyro_wait_start(&robot->gyro_wait, &robot->camera);
#endif
    return status;
}

bslam_status_t robot_look(robot_t *robot, int camera, int64_t time_us)
{
    const bslam_status_t status =
        camera_input_look(&robot->camera, robot->moves != robot->moves_seen[camera]);
    robot->moves_seen[camera] = robot->moves;
#if ROBOT_VISION && BSLAM_VISION_TURNS
    if (status == BSLAM_OK) {
        gyro_wait_see(&robot->gyro_wait, &robot->camera, camera, time_us);
    }
#else
    (void)time_us;
#endif
    return status;
}

#endif
