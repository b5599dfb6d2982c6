// A driver gives NaN or infinity for a wheel, a distance, a direction and its noise. Each is refused, and the
// estimate stays finite. Bits are looked at, so that no compiler's flag can say that there is no NaN.
#include <stdio.h>
#include <string.h>

#include "bslam/bslam.h"

enum { STEPS = 200, FIRST_BAD = 50 };

static const uint32_t BAD[] = {0x7fc00000u, 0xffc00000u, 0x7f800000u, 0xff800000u};

static bslam_real_t bad_number(int which)
{
    float value;
    memcpy(&value, &BAD[which], sizeof value);
    return (bslam_real_t)value;
}

static int is_finite(bslam_real_t x)
{
    const float value = (float)x;
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (bits & 0x7f800000u) != 0x7f800000u;
}

int main(void)
{
    static bslam_t robot;
    bslam_settings_t settings;
    int bad_setting;
    int taken = 0;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    if (bslam_init(&robot, &settings, &bad_setting) != BSLAM_OK) {
        return 2;
    }
    for (int step = 0; step < STEPS; step++) {
        bslam_odometry_reading_t reading = {.time_us = (int64_t)step * 40000,
                                            .source = BSLAM_ODOMETRY_WHEELS,
                                            .left_m = BSLAM_R(0.01),
                                            .right_m = BSLAM_R(0.01)};
        bslam_sighting_t seen = {.bearing_rad = BSLAM_R(0.2), .range_m = 3, .has_range = true, .label = 7};
        const int bad = step - FIRST_BAD;
        if (bad >= 0 && bad < 16) {
            bslam_real_t *fields[] = {&reading.left_m, &seen.range_m, &seen.bearing_rad, &seen.range_sd_m};
            *fields[bad / 4] = bad_number(bad % 4);
        }
        const bslam_status_t odometry = bslam_odometry(&robot, &reading);
        const bslam_status_t frame = bslam_sightings(&robot, reading.time_us, &seen, 1);
        taken += bad >= 0 && bad < 4 && odometry == BSLAM_OK;
        taken += bad >= 4 && bad < 16 && frame == BSLAM_OK;
    }
    const bslam_pose_t pose = bslam_pose(&robot);
    bslam_real_t lower[6];
    bslam_pose_covariance(&robot, lower);
    const bslam_counters_t counters = bslam_counters(&robot);
    printf("%d taken, %u + %u refused, insane %u\n", taken, (unsigned)counters.slam.odometry_refused,
           (unsigned)counters.slam.frames_refused, (unsigned)counters.slam.insane);
    const int finite =
        is_finite(pose.x_m) && is_finite(pose.y_m) && is_finite(pose.theta_rad) && is_finite(lower[0]);
    return taken == 0 && finite && counters.slam.odometry_refused == 4 && counters.slam.insane == 0 ? 0 : 1;
}
