/// What a step in direction only costs on this board with the smoother, in ticks of port_ticks, once its
/// window is full: "mean beacons ticks" and "worst beacons ticks", over some seconds. And "state beacons
/// number", by which the estimate after all of it may be compared with another machine's.
#include "bench/measure.h"
#include "bslam/internal.h"
#include "base/trig.h"
#include "bslam/slam/fingerprint.h"

#define STEP_US 40000
#define STEP_S 0.04f
/// Until the window is full, of nodes of all lengths, and what is measured then.
#define STEPS_BEFORE \
    ((BSLAM_SMOOTHER_NODES_MAX << BSLAM_SMOOTHER_LEVELS) / BSLAM_SMOOTHER_LEVELS * BSLAM_SMOOTHER_FRAMES + \
     100)
#define STEPS 300
#define WHEELBASE_M 0.4f
#define SEEN_MAX 5

static bslam_slam_t slam;
static bslam_smoother_t smoother;
static bslam_pose_t pose;
static int64_t time_us;
static uint32_t random_state;

// ---- the world: a circle of 2 m at 0.4 m/s in a ring of beacons, half of which are in view ----------------

static void start(void)
{
    bslam_settings_t settings;
    int bad_id = 0;
    bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
    settings.filter = BSLAM_FILTER_SMOOTHER;
    settings.velocity_walk_mps_sqrt_s = 30;
    settings.turn_rate_walk_radps_sqrt_s = 1;
    settings.turn_rate_decay_s = 1;
    settings.confirm_window_us = 0;
    measure_need(bslam_slam_init(&slam, &settings, &bad_id) == BSLAM_OK);
    bslam_slam_attach_smoother(&slam, &smoother);
    pose = (bslam_pose_t){0, 0, 0};
    time_us = 0;
    random_state = 1;
}

static void drive(void)
{
    const float travelled_m[2] = {0.9f * 0.4f * STEP_S, 1.1f * 0.4f * STEP_S};
    float sine, cosine;
    bslam_sin_cos(pose.theta_rad, &sine, &cosine);
    pose.x_m += 0.4f * STEP_S * cosine;
    pose.y_m += 0.4f * STEP_S * sine;
    pose.theta_rad = bslam_angle_wrap(pose.theta_rad + (travelled_m[1] - travelled_m[0]) / WHEELBASE_M);
    time_us += STEP_US;
    const bslam_odometry_reading_t reading = {
        .time_us = time_us,
        .source = BSLAM_ODOMETRY_WHEELS,
        .left_m = travelled_m[0] + 0.5f * STEP_S * measure_random(&random_state),
        .right_m = travelled_m[1] + 0.5f * STEP_S * measure_random(&random_state),
    };
    measure_need(bslam_slam_odometry(&slam, &reading) == BSLAM_OK);
}

/// At most `most` of the beacons ahead, in each second others first.
static void look(int beacons, int most)
{
    bslam_sighting_t seen[SEEN_MAX];
    int count = 0;
    const int first = (int)(time_us / 1000000);
    for (int k = 0; k < beacons && count < most; k++) {
        const int b = (first + k) % beacons;
        float sine, cosine;
        bslam_sin_cos(6.2831853f * (float)b / (float)beacons, &sine, &cosine);
        const float distance_m = 4.0f + (float)(b % 3);
        const float x_m = distance_m * cosine - pose.x_m;
        const float y_m = 2.0f + distance_m * sine - pose.y_m;
        const float bearing_rad = bslam_angle_wrap(bslam_atan2(y_m, x_m) - pose.theta_rad);
        if (bearing_rad > -1.5f && bearing_rad < 1.5f) {
            seen[count] = (bslam_sighting_t){
                .bearing_rad = bearing_rad + 0.02f * measure_random(&random_state), .label = b};
            count++;
        }
    }
    measure_need(bslam_slam_sightings(&slam, time_us, seen, count) == BSLAM_OK);
}

// ---- what is measured -------------------------------------------------------------------------------------

static void measure(int beacons, int most)
{
    uint64_t sum = 0;
    uint32_t worst = 0;
    start();
    for (int step = 0; step < STEPS_BEFORE + STEPS; step++) {
        const uint32_t began = port_ticks();
        drive();
        look(beacons, most);
        const uint32_t ticks = port_ticks() - began;
        worst = ticks > worst ? ticks : worst;
        sum += step >= STEPS_BEFORE ? ticks : 0;
    }
    measure_need(slam.ekf.beacon_count == beacons && smoother.cycles > 10 && smoother.insane == 0);
    measure_report("mean", beacons, (uint32_t)(sum / STEPS));
    measure_report("worst", beacons, worst);
    measure_report("state", beacons, (uint32_t)bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START));
}

int main(void)
{
    port_init();
    measure(6, 3);
    measure(20, SEEN_MAX);  // as many as the room of the window is meant for
    text_put("end\n");
    port_exit(0);
}
