// The core. Words of the command line set parameters: association=2.
#include "peer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bslam/internal.h"

typedef struct step {
    bslam_odometry_reading_t wheels;
    int count;
    const bslam_sighting_t *sightings;
} step_t;

static bslam_slam_t slam;
static step_t *own_steps;

static void fail(const char *what)
{
    (void)fprintf(stderr, "bench: bslam: %s\n", what);
    exit(1);
}

static void set(bslam_settings_t *settings, const char *name, size_t length, double value)
{
    for (int id = 0; id < bslam_settings_count(); id++) {
        const char *its = bslam_settings_info(id)->name;
        if (strlen(its) == length && strncmp(its, name, length) == 0 &&
            bslam_settings_set(settings, id, (bslam_real_t)value) == BSLAM_OK) {
            return;
        }
    }
    fail(name);
}

static void *room(size_t count, size_t size)
{
    void *memory = calloc(count > 0 ? count : 1, size);
    if (memory == NULL) {
        fail("no memory for the drive");
    }
    return memory;
}

static step_t step_of(const bench_step_t *from)
{
    if (from->count > BSLAM_SIGHTINGS_MAX) {
        fail("more sightings in a step than it takes");
    }
    bslam_sighting_t *sightings = room((size_t)from->count, sizeof *sightings);
    step_t step = {.wheels = {.time_us = from->time_us,
                              .source = BSLAM_ODOMETRY_WHEELS,
                              .left_m = (bslam_real_t)from->left_m,
                              .right_m = (bslam_real_t)from->right_m},
                   .count = from->count,
                   .sightings = sightings};
    for (int i = 0; i < from->count; i++) {
        sightings[i] = (bslam_sighting_t){.bearing_rad = (bslam_real_t)from->sightings[i].bearing_rad,
                                          .range_m = (bslam_real_t)from->sightings[i].range_m,
                                          .has_range = true,
                                          .label = from->sightings[i].label};
    }
    return step;
}

void peer_begin(const bench_model_t *model, const bench_step_t *steps, int count, int words, char **word)
{
    bslam_settings_t settings;
    int bad_id = -1;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    const double step_s = (double)(steps[count - 1].time_us) * 1e-6 / (count - 1);
    settings.wheelbase_m = (bslam_real_t)model->wheelbase_m;
    settings.left_speed_sd_mps = settings.right_speed_sd_mps = (bslam_real_t)(model->wheel_sd_m / step_s);
    settings.bearing_sd_rad = (bslam_real_t)model->bearing_sd_rad;
    settings.range_sd_floor_m = (bslam_real_t)model->range_sd_floor_m;
    settings.range_sd_fraction = (bslam_real_t)model->range_sd_fraction;
    settings.range_sd_per_m = (bslam_real_t)model->range_sd_per_m;
    for (int i = 1; i < words; i++) {
        const char *equals = strchr(word[i], '=');
        if (equals == NULL) {
            fail(word[i]);
        }
        set(&settings, word[i], (size_t)(equals - word[i]), atof(equals + 1));
    }
    if (bslam_slam_init(&slam, &settings, &bad_id) != BSLAM_OK) {
        fail("a parameter is refused");
    }
    own_steps = room((size_t)count, sizeof *own_steps);
    for (int number = 0; number < count; number++) {
        own_steps[number] = step_of(&steps[number]);
    }
}

void peer_step(const bench_step_t *unused, int number)
{
    (void)unused;
    const step_t *step = &own_steps[number];
    if ((number > 0 && bslam_slam_odometry(&slam, &step->wheels) != BSLAM_OK) ||
        bslam_slam_sightings(&slam, step->wheels.time_us, step->sightings, step->count) != BSLAM_OK) {
        fail("a step is refused");
    }
}

void peer_pose(double pose[3])
{
    const bslam_pose_t here = bslam_slam_pose(&slam);
    pose[0] = (double)here.x_m;
    pose[1] = (double)here.y_m;
    pose[2] = (double)here.theta_rad;
}

int peer_landmarks(void)
{
    return slam.ekf.beacon_count;
}

size_t peer_static_bytes(void)
{
    return sizeof slam;
}
