// What a program that is timed beside bslam offers: four functions, of which drive.c measures one. All
// programs read the same drive (peers/drives.py writes it), so that they differ in nothing but these.
#ifndef BENCH_PEER_H
#define BENCH_PEER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// Noise of the drive, which everybody is told.
typedef struct bench_model {
    double wheelbase_m;
    double wheel_sd_m;  // of a wheel's travel in one step
    double bearing_sd_rad;
    double range_sd_floor_m;  // the sd of a distance r is the root of floor² + (fraction r)² + (r² per_m)²
    double range_sd_fraction;
    double range_sd_per_m;
} bench_model_t;

typedef struct bench_sighting {
    int label;  // -1: nobody says
    double bearing_rad;
    double range_m;
} bench_sighting_t;

typedef struct bench_step {
    int64_t time_us;
    double left_m;  // since the step before
    double right_m;
    int count;
    const bench_sighting_t *sightings;
} bench_step_t;

// Variance of a measured distance.
static inline double bench_range_variance_m2(const bench_model_t *model, double range_m)
{
    const double of_range_m = model->range_sd_fraction * range_m;
    const double of_square_m = model->range_sd_per_m * range_m * range_m;
    return model->range_sd_floor_m * model->range_sd_floor_m + of_range_m * of_range_m +
           of_square_m * of_square_m;
}

// Not measured: makes the filter; brings all steps into the peer's own types. words: of the command line.
void peer_begin(const bench_model_t *model, const bench_step_t *steps, int count, int words, char **word);

// Measured: odometry, then the sightings, of a step by its number. The first one only sees.
void peer_step(const bench_step_t *step, int number);

// Where the robot is: x, y, theta.
void peer_pose(double pose[3]);

// Landmarks that it has made.
int peer_landmarks(void);

// Bytes that it keeps outside of the heap.
size_t peer_static_bytes(void);

#ifdef __cplusplus
}
#endif

#endif
