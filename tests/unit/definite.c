#include "definite.h"

#include <stdlib.h>
#include <string.h>

#include "bslam/linalg/symmat.h"
#include "support.h"

bool is_semidefinite(const bslam_real_t *m, int n)
{
    // Rounding leaves it a little short where it is singular, as it is while a new beacon's anchor still
    // equals the robot's position.
    const bslam_real_t raise = (bslam_real_t)n * (BSLAM_REAL_DOUBLE ? real(1e-14) : real(1e-7));
    bslam_real_t *factor = calloc((size_t)BSLAM_SYMMAT_LENGTH(n), sizeof *factor);
    assert_non_null(factor);
    memcpy(factor, m, bslam_symmat_row(n) * sizeof *m);
    bool is_one = true;
    for (int i = 0; i < n && is_one; i++) {
        is_one = bslam_symmat_factor_row(factor, i, raise);
    }
    free(factor);
    return is_one;
}
