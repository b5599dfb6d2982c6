/// What the parts of a step cost on this board, in ticks of port_ticks: one line each, "name size ticks", the
/// mean of several calls. tools/checks/sizes_doc.py runs it and knows what a tick is.
#include "bench/measure.h"
#include "bslam/internal.h"
#include "base/trig.h"
#include "port/port.h"
#include "base/scalar.h"

#define STEP_US 40000
#define STEPS 8
#define SEEN 3
/// Sightings shown to each machine.
#define VIEWS 6

static bslam_slam_t slam;
static bslam_appearance_t appearance;
static bslam_settings_t settings;
static int64_t time_us;
static float signatures[BSLAM_BEACONS_MAX][BSLAM_SAMPLE_FEATURES];
static uint32_t random_state = 1;

// ---- the world: beacons on a grid, the robot at rest at the origin
// ------------------------------------------

static bslam_sighting_t see(int beacon)
{
    const float x_m = 2.0f + (float)(beacon % 10);
    const float y_m = (float)(beacon / 10) - 2.4f;
    return (bslam_sighting_t){.bearing_rad = bslam_atan2(y_m, x_m),
                              .range_m = bslam_sqrt(x_m * x_m + y_m * y_m),
                              .has_range = true,
                              .label = beacon,
                              .signature = signatures[beacon]};
}

static void stand_still(void)
{
    time_us += STEP_US;
    const bslam_odometry_reading_t reading = {.time_us = time_us, .source = BSLAM_ODOMETRY_WHEELS};
    measure_need(bslam_slam_odometry(&slam, &reading) == BSLAM_OK);
}

static void look_at(int first, int count)
{
    bslam_sighting_t seen[SEEN];
    for (int i = 0; i < count; i++) {
        seen[i] = see(first + i);
    }
    measure_need(bslam_slam_sightings(&slam, time_us, seen, count) == BSLAM_OK);
}

/// A map of so many beacons, each seen once.
static void start(int beacons, int association)
{
    int bad_id = 0;
    settings.association = association;
    measure_need(bslam_slam_init(&slam, &settings, &bad_id) == BSLAM_OK);
    time_us = 0;
    settings.association = 0;
    for (int b = 0; b < beacons; b++) {
        const bslam_sighting_t sighting = see(b);
        slam.settings.association = 0;
        measure_need(bslam_slam_sightings(&slam, time_us, &sighting, 1) == BSLAM_OK);
        time_us++;
    }
    slam.settings.association = association;
    measure_need(slam.ekf.beacon_count == beacons);
}

// ---- what is measured -------------------------------------------------------------------------------------

/// An odometry reading, and a frame of `count` sightings that the filter goes there for.
static uint32_t step_ticks(int beacons, int count)
{
    uint32_t ticks = 0;
    for (int k = 0; k < STEPS; k++) {
        const uint32_t began = port_ticks();
        stand_still();
        look_at(k * SEEN % (beacons - SEEN + 1), count);
        ticks += port_ticks() - began;
    }
    return ticks / STEPS;
}

/// The filter's own functions alone: a prediction, SEEN sightings with distance, the correction.
static uint32_t filter_ticks(int beacons)
{
    const bslam_motion_t motion = {.dt_s = 0.04f, .forward_var_m2 = 1e-4f, .turn_var_rad2 = 1e-3f};
    const bslam_pose_t mount = {0, 0, 0};
    uint32_t ticks = 0;
    for (int k = 0; k < STEPS; k++) {
        const int first = k * SEEN % (beacons - SEEN + 1);
        bslam_sighting_t seen[SEEN];
        bslam_innovation_t innovations[SEEN];
        bslam_fusion_t fusion;
        bslam_motion_t moved;
        for (int i = 0; i < SEEN; i++) {
            seen[i] = see(first + i);
        }
        bool good = true;
        const uint32_t began = port_ticks();
        bslam_ekf_predict(&slam.ekf, &slam.settings, &motion, &moved);
        for (int i = 0; i < SEEN; i++) {
            good = bslam_ekf_innovation(&slam.ekf, &slam.settings, &mount, &seen[i], first + i,
                                        &innovations[i]) == BSLAM_OK &&
                   good;
        }
        for (int i = 0; i < SEEN; i++) {
            good = bslam_ekf_fuse(&slam.ekf, &slam.settings, &innovations[i], &fusion) == BSLAM_OK && good;
        }
        bslam_ekf_correct(&slam.ekf, &slam.settings);
        ticks += port_ticks() - began;
        measure_need(good);
    }
    return ticks / STEPS;
}

/// Starting a beacon, in a frame of its own.
static uint32_t augment_ticks(int beacons)
{
    uint32_t ticks = 0;
    for (int k = 0; k < STEPS; k++) {
        stand_still();
        look_at(0, 0);
        time_us++;
        const uint32_t began = port_ticks();
        look_at(beacons, 1);
        ticks += port_ticks() - began;
        bslam_beacon_view_t view;
        measure_need(bslam_slam_beacon(&slam, beacons, &view) == BSLAM_OK);
        measure_need(bslam_slam_remove_beacon(&slam, view.uid) == BSLAM_OK);
    }
    return ticks / STEPS;
}

static uint32_t associate_ticks(int beacons, bslam_associate_fn associate)
{
    const bslam_pose_t mount = {0, 0, 0};
    bslam_record_t records[SEEN];
    bslam_sighting_t seen[SEEN];
    uint32_t ticks = 0;
    for (int k = 0; k < STEPS; k++) {
        for (int i = 0; i < SEEN; i++) {
            seen[i] = see((k * SEEN + i) % beacons);
        }
        const bslam_sighting_frame_t frame = {.ekf = &slam.ekf,
                                              .settings = &slam.settings,
                                              .appearance = &appearance,
                                              .mount = &mount,
                                              .sightings = seen,
                                              .count = SEEN};
        const uint32_t began = port_ticks();
        associate(&frame, records);
        ticks += port_ticks() - began;
    }
    return ticks / STEPS;
}

/// Every machine is shown views of its beacon, as different from each other as random numbers make them; the
/// mean of a training.
static uint32_t train_ticks(int classifiers)
{
    bslam_learner_t *learner = &appearance.learner;
    uint64_t ticks = 0;
    for (int b = 0; b < classifiers; b++) {
        int32_t classifier;
        measure_need(bslam_learner_add(learner, &classifier) == BSLAM_OK);
    }
    for (int view = 0; view < VIEWS * classifiers; view++) {
        float signature[BSLAM_SAMPLE_FEATURES];
        const int classifier = view % classifiers;
        for (int i = 0; i < BSLAM_SAMPLE_FEATURES; i++) {
            signature[i] = 0.5f * signatures[classifier][i] + 0.5f * measure_random(&random_state);
        }
        measure_need(bslam_learner_show(learner, classifier, signature) == BSLAM_OK);
        bool left = true;
        while (left) {
            const uint32_t began = port_ticks();
            left = bslam_learner_work(learner, 1);
            ticks += port_ticks() - began;
        }
    }
    measure_need(learner->counters.updates > 0);
    return (uint32_t)(ticks / learner->counters.updates);
}

static void measure_filter(int beacons, int velocity_states)
{
    bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
    settings.velocity_states = velocity_states;
    settings.confirm_window_us = 0;
    start(beacons, 0);
    (void)step_ticks(beacons, SEEN);  // until the covariance has no zeros left
    measure_report(velocity_states != 0 ? "predict_velocity" : "predict", beacons, step_ticks(beacons, 0));
    measure_report(velocity_states != 0 ? "step_velocity" : "step", beacons, step_ticks(beacons, SEEN));
    measure_report(velocity_states != 0 ? "filter_velocity" : "filter", beacons, filter_ticks(beacons));
    if (velocity_states == 0) {
        measure_report("augment", beacons, augment_ticks(beacons));
        measure_report("associate_mahalanobis", beacons,
                       associate_ticks(beacons, bslam_associate_mahalanobis));
    }
}

static void measure_learning(int beacons)
{
    measure_need(bslam_appearance_init(&appearance, NULL, 0) == BSLAM_OK);
    measure_report("train", beacons, train_ticks(beacons));
}

int main(void)
{
    static const int sizes[] = {6, 20, 50};
    port_init();
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        for (int i = 0; i < BSLAM_SAMPLE_FEATURES; i++) {
            signatures[b][i] = measure_random(&random_state);
        }
    }
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        measure_filter(sizes[i], 0);
        measure_filter(sizes[i], 1);
    }
    measure_learning(6);
    measure_learning(20);
    text_put("end\n");
    port_exit(0);
}
