/// Whether a covariance is one.
#ifndef UNIT_DEFINITE_H
#define UNIT_DEFINITE_H

#include <stdbool.h>

#include "base/real.h"

/// True if the n x n matrix, as bslam/linalg/symmat.h holds it, is positive semidefinite to working
/// precision.
bool is_semidefinite(const bslam_real_t *m, int n);

#endif
