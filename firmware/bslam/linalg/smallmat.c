#include "bslam/linalg/smallmat.h"
#include "base/scalar.h"

bslam_status_t bslam_sym2_cholesky(const bslam_sym2_t *m, bslam_lower2_t *l)
{
    if (!(m->xx > 0)) {
        return BSLAM_E_SINGULAR;
    }
    const bslam_real_t ratio = m->xy / m->xx;
    const bslam_real_t rest = m->yy - ratio * m->xy;
    if (!(rest > 0)) {
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
    if (!(m->xx > 0)) {
        return BSLAM_E_SINGULAR;
    }
    // L D Lᵀ: no square root, and definite by construction where both pivots are positive.
    const bslam_real_t ratio = m->xy / m->xx;
    const bslam_real_t rest = m->yy - ratio * m->xy;
    if (!(rest > 0)) {
        return BSLAM_E_SINGULAR;
    }
    const bslam_real_t y_given_x = y - ratio * x;
    *distance2 = x * x / m->xx + y_given_x * y_given_x / rest;
    return BSLAM_OK;
}
