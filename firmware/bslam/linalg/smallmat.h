/// 2 x 2 symmetric matrices: the innovation covariance of a sighting, the noise of a motion, a beacon's
/// ellipse.
#ifndef BSLAM_LINALG_SMALLMAT_H
#define BSLAM_LINALG_SMALLMAT_H

#include "base/status.h"
#include "base/types.h"

/// [[xx, 0], [yx, yy]].
typedef struct bslam_lower2 {
    bslam_real_t xx, yx, yy;
} bslam_lower2_t;

/// Lower triangle L with L Lᵀ = m. BSLAM_E_SINGULAR if m is not positive definite; then *l is unchanged.
BSLAM_MUST_CHECK bslam_status_t bslam_sym2_cholesky(const bslam_sym2_t *m, bslam_lower2_t *l);

/// vᵀ m⁻¹ v for v = (x, y): the squared Mahalanobis distance. BSLAM_E_SINGULAR if m is not positive definite;
/// then *distance2 is unchanged.
BSLAM_MUST_CHECK bslam_status_t bslam_sym2_mahalanobis(const bslam_sym2_t *m, bslam_real_t x, bslam_real_t y,
                                                       bslam_real_t *distance2);

#endif
