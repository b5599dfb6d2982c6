/// Whether what a filter holds is a covariance: looked at in double, with no code of the filter's.
#ifndef SOAK_DEFINITE_H
#define SOAK_DEFINITE_H

#include "bslam/ekf/ekf.h"

/// Least eigenvalue of the correlations of L D Lᵀ, by Jacobi's rotations. NaN unless all of L and D is finite
/// and no D is negative; else below 0 by double's rounding at most. 1: no value varies. O(n³).
double definite_least_eigenvalue(const bslam_factor_t *factor);

/// The covariance of state values i and j, in double. O(n).
double definite_covariance(const bslam_ekf_t *ekf, int i, int j);

#endif
