// A robot without a camera, for sizes_doc.py to link: what of the library the calls of its loop take.
// KEEPS_MAP 1: it keeps its map in flash.
#include "bslam/bslam.h"

int main(void);

static bslam_t robot;
static bslam_settings_t settings;
static bslam_odometry_reading_t reading;
static bslam_sighting_t sightings[BSLAM_SIGHTINGS_MAX];
#if KEEPS_MAP
static bslam_flash_t flash;
#endif
static volatile int64_t now_us;
static volatile bslam_real_t answer;

#if KEEPS_MAP
static void load(void)
{
    bslam_map_fault_t fault;
    if (bslam_load_from_flash(&robot, &flash, &fault) == BSLAM_OK) {
        bslam_freeze_map(&robot, true);
    }
}

static bslam_status_t save(void)
{
    bslam_map_fault_t fault;
    return bslam_save_to_flash(&robot, &flash, &fault);
}
#endif

static bslam_status_t robot_step(void)
{
    bslam_beacon_view_t view;
    bslam_real_t covariance[6];
    int count;
    reading.time_us = now_us;
    bslam_status_t status = bslam_odometry(&robot, &reading);
    if (status == BSLAM_OK) {
        status = bslam_sightings(&robot, now_us, sightings, BSLAM_SIGHTINGS_MAX);
    }
    if (status == BSLAM_OK) {
        status = bslam_beacon(&robot, bslam_health(&robot).beacons - 1, &view);
    }
    if (status == BSLAM_E_STATE) {
        status = bslam_restart(&robot, 1, 1);
    }
#if KEEPS_MAP
    if (status == BSLAM_OK) {
        status = save();
    }
#endif
    bslam_pose_covariance(&robot, covariance);
    answer = bslam_pose(&robot).x_m + covariance[0] + view.x_m +
             (bslam_real_t)bslam_results(&robot, &count)->outcome +
             (bslam_real_t)bslam_counters(&robot).slam.frames;
    return status;
}

int main(void)
{
    int bad_setting;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    bslam_status_t status = bslam_init(&robot, &settings, &bad_setting);
#if KEEPS_MAP
    load();
#endif
    while (status == BSLAM_OK) {
        status = robot_step();
    }
    return 1;
}
