#include "bslam/linalg/smallmat.h"
#include "base/scalar.h"

/// L D Lᵀ: no square root, and definite by construction where both pivots are positive; false: one is not.
static bool factor(const bslam_sym2_t *m, bslam_real_t *ratio, bslam_real_t *rest)
{
    if (!(m->xx > 0)) {
        return false;
    }
    *ratio = m->xy / m->xx;
    *rest = m->yy - *ratio * m->xy;
    return *rest > 0;
}

bslam_status_t bslam_sym2_cholesky(const bslam_sym2_t *m, bslam_lower2_t *l)
{
    bslam_real_t ratio, rest;
    if (!factor(m, &ratio, &rest)) {
        return BSLAM_E_SINGULAR;
    }
    l->xx = bslam_sqrt(m->xx);
    l->yx = ratio * l->xx;
    l->yy = bslam_sqrt(rest);
    return BSLAM_OK;
}

bslam_status_t bslam_sym2_mahalanobis(const bslam_sym2_t *m, bslam_real_t x, bslam_real_t y,
                                      bslam_real_t *distance2)
{
    bslam_real_t ratio, rest;
    if (!factor(m, &ratio, &rest)) {
        return BSLAM_E_SINGULAR;
    }
    const bslam_real_t y_given_x = y - ratio * x;
    *distance2 = x * x / m->xx + y_given_x * y_given_x / rest;
    return BSLAM_OK;
}
