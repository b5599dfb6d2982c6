/// A factored covariance as a dense matrix in double, and back.
#ifndef UNIT_COVARIANCE_H
#define UNIT_COVARIANCE_H

#include <stdbool.h>

#include "dense.h"

#include "bslam/ekf/ekf.h"

/// Where the n-th value of a factor stands: the body's, then the tail's.
static inline int covariance_place(const bslam_factor_t *factor, int n)
{
    return n < factor->body_count ? n : bslam_factor_tail_at(factor) + n - factor->body_count;
}

/// L D Lᵀ of a factor by its values, and the factor of such a matrix, positive semidefinite.
dense_t covariance_of_factor(const bslam_factor_t *factor);
void covariance_factor(const dense_t *p, int tail_count, bslam_factor_t *factor);

/// Fails unless L has 1 on the diagonal, and 0 above it and in rows that do not exist; D is finite and >= 0;
/// and the least eigenvalue of the correlations is not below 0 by more than rounding.
void covariance_assert_sound(const bslam_factor_t *factor);

/// A filter's covariance in the order of its state.
dense_t covariance_of(const bslam_ekf_t *ekf);
void covariance_set(bslam_ekf_t *ekf, const dense_t *p);

/// State value `at` goes with no other one from now on, and has this variance.
void covariance_forget(bslam_ekf_t *ekf, int at, double variance);

/// What only damaged memory holds: `count` state values from `first` on have a D below 0, and go with no
/// other.
void covariance_break(bslam_ekf_t *ekf, int first, int count);

#endif
