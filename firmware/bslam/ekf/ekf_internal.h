/// What the files of the filter share.
#ifndef BSLAM_EKF_EKF_INTERNAL_H
#define BSLAM_EKF_EKF_INTERNAL_H

#include "bslam/ekf/ekf.h"

#define POSE_DIM 3

/// A ray is taken for a point no farther off than this, 1 km.
#define BSLAM_FAR_INVERSE_PER_M BSLAM_R(1e-3)

/// f = rowᵀ L of the stored factor, in the columns from `from` up to `to`, whose first one is f[0].
void bslam_ekf_look(const bslam_ekf_t *ekf, const bslam_row_t *row, int from, int to, bslam_real_t *f);

/// row · vector.
bslam_real_t bslam_ekf_dot(const bslam_row_t *row, const bslam_real_t *vector);

/// Fuses one scalar measurement whose innovation, at the mean before the frame, and variance are given.
void bslam_ekf_apply_scalar(bslam_ekf_t *ekf, const bslam_row_t *row, bslam_real_t innovation,
                            bslam_real_t variance);

#endif
