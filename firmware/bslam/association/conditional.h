/// Innovations conditional on others of the same frame: where the robot errs, all of a frame err together, so
/// one match makes the rest much surer. A growing Cholesky factor of their joint covariance. MATH "Which
/// beacon is it".
#ifndef BSLAM_ASSOCIATION_CONDITIONAL_H
#define BSLAM_ASSOCIATION_CONDITIONAL_H

#include "bslam/ekf/ekf.h"

/// Sightings that may be conditioned on.
#define BSLAM_CONDITIONAL_MAX 5
#define BSLAM_CONDITIONAL_SCALARS (2 * BSLAM_CONDITIONAL_MAX + 2)

/// What the next innovation is conditional on.
typedef struct bslam_conditional {
    int32_t count;  ///< scalars
    bslam_row_t rows[BSLAM_CONDITIONAL_SCALARS];
    bslam_real_t
        factor[BSLAM_CONDITIONAL_SCALARS * (BSLAM_CONDITIONAL_SCALARS + 1) / 2];  ///< L, L Lᵀ = S, row by row
    bslam_real_t white[BSLAM_CONDITIONAL_SCALARS];                                ///< L⁻¹ y
} bslam_conditional_t;

/// How well an innovation fits.
typedef struct bslam_weight {
    bslam_real_t distance2;    ///< squared Mahalanobis distance
    bslam_real_t log_density;  ///< ln N(y; 0, S), of 1/(m rad), or of 1/rad without a distance
} bslam_weight_t;

/// Nothing. Touches no more than it must.
static inline void bslam_conditional_init(bslam_conditional_t *conditional)
{
    conditional->count = 0;
}

/// Weighs an innovation; *conditional is scratch meanwhile and comes back as it was. BSLAM_E_SINGULAR: S is
/// not positive definite; *weight is unchanged then. O(count² + n count), n the state.
BSLAM_MUST_CHECK bslam_status_t bslam_conditional_weigh(const bslam_ekf_t *ekf,
                                                        bslam_conditional_t *conditional,
                                                        const bslam_innovation_t *innovation,
                                                        bslam_weight_t *weight);

/// Adds an innovation. False, and no change, if there is no room or S is singular.
bool bslam_conditional_add(const bslam_ekf_t *ekf, bslam_conditional_t *conditional,
                           const bslam_innovation_t *innovation);

/// Squared Mahalanobis distance of all together. O(count).
bslam_real_t bslam_conditional_distance2(const bslam_conditional_t *conditional);

#endif
