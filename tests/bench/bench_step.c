// One filter step on a map of BSLAM_BEACONS_MAX beacons: an odometry reading and a frame of 2, 3 and 4
// sightings in turn, identity known, all beacons mapped beforehand. bench.py counts the instructions of
// measured_step.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bslam/bslam.h"
#include "base/scalar.h"
#include "base/trig.h"

#define STEP_US 40000
#define MEASURED_STEPS 60

static bslam_t slam;
static bslam_real_t beacon_x_m[BSLAM_BEACONS_MAX];
static bslam_real_t beacon_y_m[BSLAM_BEACONS_MAX];

void measured_step(const bslam_odometry_reading_t *reading, const bslam_sighting_t *sightings, int count);

__attribute__((noinline)) void measured_step(const bslam_odometry_reading_t *reading,
                                             const bslam_sighting_t *sightings, int count)
{
    if (bslam_odometry(&slam, reading) != BSLAM_OK ||
        bslam_sightings(&slam, reading->time_us, sightings, count) != BSLAM_OK) {
        (void)fprintf(stderr, "bench: a step was refused\n");
        exit(1);
    }
}

/// The exact sighting of a beacon from a robot that stands at the estimate.
static bslam_sighting_t see(int beacon)
{
    const bslam_pose_t pose = bslam_pose(&slam);
    const bslam_real_t dx = beacon_x_m[beacon] - pose.x_m;
    const bslam_real_t dy = beacon_y_m[beacon] - pose.y_m;
    const bslam_sighting_t sighting = {
        .bearing_rad = bslam_angle_wrap(bslam_atan2(dy, dx) - pose.theta_rad),
        .range_m = bslam_sqrt(dx * dx + dy * dy),
        .has_range = true,
        .label = beacon,
    };
    return sighting;
}

static void place_beacons(void)
{
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        beacon_x_m[b] = 2 + (bslam_real_t)(b % 10);
        beacon_y_m[b] = (bslam_real_t)(b / 10) - 5;
    }
}

int main(int argc, char **argv)
{
    bslam_settings_t settings;
    int bad_id = -1;
    const bool with_speeds = argc > 1 && strcmp(argv[1], "velocity") == 0;
    bslam_settings_preset(&settings, with_speeds ? BSLAM_PRESET_PAPER : BSLAM_PRESET_REAL_WHEELS);
    if (bslam_init(&slam, &settings, &bad_id) != BSLAM_OK) {
        return 1;
    }
    place_beacons();
    int64_t time_us = 0;
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        const bslam_sighting_t sighting = see(b);
        if (bslam_sightings(&slam, time_us, &sighting, 1) != BSLAM_OK) {
            return 1;
        }
        time_us += 1000;
    }
    int seen = 0;
    for (int step = 0; step < MEASURED_STEPS; step++) {
        time_us += STEP_US;
        const bslam_odometry_reading_t reading = {
            .time_us = time_us, .source = BSLAM_ODOMETRY_WHEELS, .left_m = 0, .right_m = 0};
        bslam_sighting_t sightings[4];
        const int count = 2 + step % 3;
        for (int i = 0; i < count; i++) {
            sightings[i] = see(seen % BSLAM_BEACONS_MAX);
            seen++;
        }
        measured_step(&reading, sightings, count);
    }
    const bslam_slam_counters_t counters = bslam_counters(&slam).slam;
    const bool good = counters.matched == (uint32_t)seen && counters.insane == 0;
    printf("%d\n", MEASURED_STEPS);
    return good ? 0 : 1;
}
