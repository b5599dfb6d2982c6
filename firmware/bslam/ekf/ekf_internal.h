/// What the files of the filter share.
#ifndef BSLAM_EKF_EKF_INTERNAL_H
#define BSLAM_EKF_EKF_INTERNAL_H

#include "bslam/ekf/ekf.h"
#include "bslam/linalg/four.h"

#define POSE_DIM 3

/// A ray is taken for a point no farther off than this, 1 km.
#define BSLAM_FAR_INVERSE_PER_M BSLAM_R(1e-3)

/// y[0..n) += factor x; up to the next multiple of four, what stands behind n is written, too.
static inline void bslam_ekf_add_scaled(bslam_real_t *restrict y, bslam_real_t factor,
                                        const bslam_real_t *restrict x, int n)
{
    for (int i = 0; i < n; i += 4) {
        *(bslam_four_at_t *)(y + i) += factor * bslam_four(x + i);
    }
}

/// out[0..dim) = P rowᵀ, the covariance with all pending down-dates; the tail up to the padding is 0.
/// Returns by how much less row P rowᵀ is for the pending ones.
bslam_real_t bslam_ekf_project(const bslam_ekf_t *ekf, const bslam_row_t *row, bslam_real_t *out);

/// row · vector.
bslam_real_t bslam_ekf_dot(const bslam_row_t *row, const bslam_real_t *vector);

/// Fuses one scalar measurement whose innovation, at the mean before the frame, and variance are given.
void bslam_ekf_apply_scalar(bslam_ekf_t *ekf, const bslam_row_t *row, bslam_real_t innovation,
                            bslam_real_t variance);

#endif
