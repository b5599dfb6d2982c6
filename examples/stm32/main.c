// A robot with wheel encoders and a tag camera on an STM32, without an operating system: 25 readings of the
// wheels a second, and a line of text from the detector for each tag it sees.
#include <stdio.h>

#include "board.h"
#include "bslam/bslam.h"

static bslam_t robot;  // all the memory that the filter has
static int refused;    // readings and sightings that it did not take: bslam_status_name says why

/// "AGE_MS TAG BEARING_MRAD RANGE_MM": a tag, left positive. It counts from when the picture was taken.
static void take_sighting(const char *line, int64_t now_us)
{
    int age_ms = 0, tag = 0, mrad = 0, mm = 0;
    char more;
    const int count = sscanf(line, "%d %d %d %d %c", &age_ms, &tag, &mrad, &mm, &more);
    const bslam_sighting_t seen = {
        .label = tag, .bearing_rad = 1e-3f * mrad, .range_m = 1e-3f * mm, .has_range = true};
    // EOF: a blank line, which is nothing. What is not four numbers is noise.
    refused += count != EOF && (count != 4 || bslam_sightings(&robot, now_us - 1000LL * age_ms, &seen, 1));
}

static void listen_to_detector(void)
{
    static char line[64];
    static uint8_t length, taken;
    while (taken != received_count) {
        line[length] = received[taken++];
        length += length < sizeof line - 1;
        if (received[(uint8_t)(taken - 1)] == '\n') {
            line[length] = '\0';  // what is too long is noise, whatever it begins with
            take_sighting(length < sizeof line - 1 ? line : "too long", board_time_us());
            length = 0;
        }
    }
}

int main(void)
{
    bslam_settings_t settings;
    int bad_setting = -1;
    char text[80];
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    settings.wheelbase_m = 0.2f;  // your robot's measures: docs/TUNING.md says how to find them
    settings.left_radius_m = settings.right_radius_m = 0.033f;
    settings.ticks_per_revolution = 1440;
    settings.counter_bits = 16;
    settings.mount_x_m = 0.05f;  // the camera, ahead of the axle
    board_init();
    for (bslam_status_t status; (status = bslam_init(&robot, &settings, &bad_setting)) != BSLAM_OK;) {
        snprintf(text, sizeof text, "%s %s\n", bslam_status_name(status),  // one status names a setting
                 status == BSLAM_E_PARAMETER ? bslam_settings_info(bad_setting)->name : "");
        board_write(text);
    }
    for (int64_t step_us = 40000;; step_us += 40000) {  // 25 times a second
        do {
            listen_to_detector();
        } while (board_time_us() < step_us);
        const bslam_odometry_reading_t wheels = {.time_us = board_time_us(),
                                                 .source = BSLAM_ODOMETRY_TICKS,
                                                 .left_ticks = left_ticks(),
                                                 .right_ticks = right_ticks()};
        refused += bslam_odometry(&robot, &wheels) != BSLAM_OK;
        const bslam_pose_t pose = bslam_pose(&robot);  // what your robot steers by
        snprintf(text, sizeof text, "%d mm, %d mm, %d mrad, %d beacons, %d refused\n", (int)(1e3f * pose.x_m),
                 (int)(1e3f * pose.y_m), (int)(1e3f * pose.theta_rad), (int)bslam_health(&robot).beacons,
                 refused);
        board_write(text);
    }
}
