// A sketch as a board's C++ core runs it: setup() once, then loop() for ever. A robot drives past a beacon.
#include <stdio.h>

#include "bslam/bslam.h"

static const float STEP_M = 0.01F;
static const float BEACON_X_M = 3.0F;

static bslam_t robot;
static int64_t time_us = 0;
static float driven_m = 0.0F;
static bool failed = false;

static void check(bslam_status_t status)
{
    if (status != BSLAM_OK) {
        printf("%s\n", bslam_status_name(status));
        failed = true;
    }
}

static void setup()
{
    bslam_settings_t settings;
    int bad_setting = -1;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    settings.wheelbase_m = 0.3F;
    check(bslam_init(&robot, &settings, &bad_setting));
    check(bslam_add_known_beacon(&robot, 7, BEACON_X_M, 0.0F));
}

static void loop()
{
    bslam_odometry_reading_t reading = {};
    reading.time_us = time_us;
    reading.source = BSLAM_ODOMETRY_WHEELS;
    if (time_us > 0) {
        driven_m += STEP_M;
        reading.left_m = reading.right_m = 1.05F * STEP_M;  // slip, which the beacon tells
    }
    check(bslam_odometry(&robot, &reading));

    bslam_sighting_t seen = {};
    seen.range_m = BEACON_X_M - driven_m;
    seen.has_range = true;
    seen.label = 7;
    check(bslam_sightings(&robot, time_us, &seen, 1));
    time_us += 40000;
}

int main()
{
    setup();
    for (int step = 0; step <= 200; step++) {
        loop();
    }
    const bslam_pose_t pose = bslam_pose(&robot);
    const float error_m = pose.x_m - driven_m;
    printf("driven %.2f m, estimated %.2f m\n", static_cast<double>(driven_m), static_cast<double>(pose.x_m));
    return failed || !(error_m < 0.02F && error_m > -0.02F) || bslam_counters(&robot).slam.matched < 200;
}
