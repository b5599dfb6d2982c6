// A robot without a camera, for sizes_doc.py to link: what of the library the calls of its loop take.
#include "bslam/bslam.h"

int main(void);

static bslam_t robot;
static bslam_settings_t settings;
static bslam_odometry_reading_t reading;
static bslam_sighting_t sightings[BSLAM_SIGHTINGS_MAX];
static volatile int64_t now_us;
static volatile bslam_real_t answer;

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
    bslam_pose_covariance(&robot, covariance);
    answer = bslam_pose(&robot).x_m + covariance[0] + view.x_m +
             (bslam_real_t)bslam_results(&robot, &count)->outcome +
             (bslam_real_t)bslam_counters(&robot).slam.frames;
    return status;
}

int main(void)
{
    int bad_setting;
    bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
    bslam_status_t status = bslam_init(&robot, &settings, &bad_setting);
    while (status == BSLAM_OK) {
        status = robot_step();
    }
    return 1;
}
