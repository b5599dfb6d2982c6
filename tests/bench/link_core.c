// A robot without a camera, for sizes_doc.py to link: what of the library the calls of its loop take.
// WITH_LOOKS 1: it learns what beacons look like, too.
#include "bslam/internal.h"

int main(void);

static bslam_slam_t slam;
static bslam_settings_t settings;
#if WITH_LOOKS
static bslam_appearance_t appearance;
#endif
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
    bslam_status_t status = bslam_slam_odometry(&slam, &reading);
    if (status == BSLAM_OK) {
        status = bslam_slam_sightings(&slam, now_us, sightings, BSLAM_SIGHTINGS_MAX);
    }
    if (status == BSLAM_OK) {
        status = bslam_slam_beacon(&slam, bslam_slam_beacon_count(&slam) - 1, &view);
    }
    bslam_slam_pose_covariance(&slam, covariance);
    answer = bslam_slam_pose(&slam).x_m + covariance[0] + view.x_m +
             (bslam_real_t)bslam_slam_accounts(&slam, &count)->outcome +
             (bslam_real_t)bslam_slam_counters(&slam)->frames;
    return status;
}

int main(void)
{
    int bad_id;
    bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
    bslam_status_t status = bslam_slam_init(&slam, &settings, &bad_id);
#if WITH_LOOKS
    if (status == BSLAM_OK) {
        status = bslam_appearance_init(&appearance, NULL, 0);
    }
    bslam_slam_attach_appearance(&slam, &appearance);
#endif
    while (status == BSLAM_OK) {
        status = robot_step();
    }
    return 1;
}
