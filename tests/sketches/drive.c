// Drives a robot among beacons that have no names, with noise and a
// kidnapping, and prints the fingerprint of every state: two builds of one library print the same.
//
//   drive [ASSOCIATION [FILTER]]     as numbers
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include BSLAM_HEADER

enum { BEACONS = 8, STEPS = 400 };

static bslam_t robot;
static uint32_t noise_state = 1;

/// Even noise between -1 and 1.
static double noise(void)
{
    noise_state = noise_state * 1664525u + 1013904223u;
    return (double)(noise_state >> 8) / 8388608.0 - 1.0;
}

static int look(bslam_sighting_t *seen, double x_m, double y_m, double heading_rad)
{
    int count = 0;
    for (int i = 0; i < BEACONS; i++) {
        const double across_m = 4.0 * cos(i * 0.785) - x_m;
        const double up_m = 3.0 * sin(i * 0.785) - y_m;
        const double bearing_rad = remainder(atan2(up_m, across_m) - heading_rad, 6.283185307179586);
        if (fabs(bearing_rad) < 1.0) {
            seen[count].bearing_rad = (bslam_real_t)(bearing_rad + 0.01 * noise());
            seen[count].range_m = (bslam_real_t)(hypot(across_m, up_m) + 0.03 * noise());
            seen[count].has_range = true;
            seen[count].label = -1;
            count++;
        }
    }
    return count;
}

int main(int argc, char **argv)
{
    bslam_settings_t settings;
    int bad_setting = -1;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    settings.wheelbase_m = BSLAM_R(0.3);
    settings.association = argc > 1 ? atoi(argv[1]) : BSLAM_ASSOCIATION_POSITION;
    settings.filter = argc > 2 ? atoi(argv[2]) : BSLAM_FILTER_INVARIANT;
    settings.recovery = 1;
    const bslam_status_t status = bslam_init(&robot, &settings, &bad_setting);
    if (status != BSLAM_OK) {
        printf("%s\n", status == BSLAM_E_PARAMETER ? bslam_settings_info(bad_setting)->name
                                                   : bslam_status_name(status));
        return 1;
    }
    double x_m = 0;
    double y_m = 0;
    double heading_rad = 0;
    uint64_t fingerprint = BSLAM_FINGERPRINT_START;
    for (int step = 0; step < STEPS; step++) {
        bslam_odometry_reading_t reading = {.time_us = step * INT64_C(40000),
                                            .source = BSLAM_ODOMETRY_WHEELS};
        const double turn_rad = step % 100 < 60 ? 0.04 : -0.01;
        const double ahead_m = 0.03;
        x_m += ahead_m * cos(heading_rad);
        y_m += ahead_m * sin(heading_rad);
        heading_rad += turn_rad;
        reading.left_m = (bslam_real_t)(ahead_m - 0.15 * turn_rad + 0.001 * noise());
        reading.right_m = (bslam_real_t)(ahead_m + 0.15 * turn_rad + 0.001 * noise());
        if (step == 250) {
            x_m += 1.5;  // carried away
        }
        bslam_sighting_t seen[BEACONS] = {0};
        const int count = look(seen, x_m, y_m, heading_rad);
        const bslam_status_t heard = bslam_odometry(&robot, &reading);
        const bslam_status_t saw = bslam_sightings(&robot, reading.time_us, seen, count);
        fingerprint = bslam_fingerprint(&robot, fingerprint);
        printf("%d %d %016" PRIx64 "\n", (int)heard, (int)saw, fingerprint);
    }
    return bslam_health(&robot).beacons >= BEACONS - 2 ? 0 : 1;
}
