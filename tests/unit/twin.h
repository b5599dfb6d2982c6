/// A filter in a random state, and the same state as dense matrices in double: what a textbook makes of the
/// dense one is what the filter must arrive at.
#ifndef UNIT_TWIN_H
#define UNIT_TWIN_H

#include "dense.h"
#include "support.h"

#include "bslam/ekf/ekf.h"

/// What the filter holds: mean (n x 1) and covariance (n x n).
typedef struct twin {
    dense_t mean;
    dense_t covariance;
} twin_t;

/// A filter with this many points and rays (points first), 2 to 8 m from the robot. Standard deviations
/// between 0.05 and 0.5 m or rad, all correlated; those of inverse distances a tenth of that.
void twin_randomise(bslam_ekf_t *ekf, const bslam_settings_t *settings, unit_random_t *random, int points,
                    int rays);

twin_t twin_of(const bslam_ekf_t *ekf);

/// The mean as an array of DENSE_MAX numbers, for functions of one.
void twin_values(const bslam_ekf_t *ekf, double *values);

/// Fails unless mean and covariance agree within the tolerance; angles agree as directions.
void twin_assert(const bslam_ekf_t *ekf, const twin_t *expected, double tolerance);

/// Which state values are angles.
bool twin_is_angle(const bslam_ekf_t *ekf, int at);

/// Where the sensor is in the map, {x, y, direction}, and by how much its distances are too long, for a state
/// given in double.
void twin_sensor(const bslam_ekf_t *ekf, const bslam_pose_t *mount, const double *state, double pose[3],
                 double *scale);

/// Writes the distance and the direction in which the sensor sees a beacon, for a state given in double.
void twin_observe(const bslam_ekf_t *ekf, const bslam_pose_t *mount, int beacon, const double *state,
                  double *range_m, double *bearing_rad);

/// Rows of H for the same, by finite differences: range in row 0, bearing in row 1.
dense_t twin_rows(const bslam_ekf_t *ekf, const bslam_pose_t *mount, int beacon);

/// mean and covariance after measurements z with rows h, innovation y and noise r: equations (8)-(11), with
/// the gain applied to the mean by `filter`: 0 added, 1 by the exponential map in the invariant error's
/// coordinates.
void twin_update(const bslam_ekf_t *ekf, int filter, const dense_t *h, const dense_t *y, const dense_t *r,
                 twin_t *twin);

#endif
