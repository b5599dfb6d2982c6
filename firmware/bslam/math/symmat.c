#include "bslam/math/symmat.h"

#include <string.h>

void bslam_symmat_add_column(const bslam_real_t *m, int n, int k, bslam_real_t factor, bslam_real_t *out)
{
    const bslam_real_t *row = m + bslam_symmat_row(k);
    for (int j = 0; j <= k; j++) {
        out[j] += factor * row[j];
    }
    const bslam_real_t *element = m + bslam_symmat_row(k) + k;
    for (int i = k + 1; i < n; i++) {
        // From row i - 1 to row i: the filled length of row i - 1.
        element += (size_t)((i - 1) / 4 + 1) * 4;
        out[i] += factor * *element;
    }
}

void bslam_symmat_add_rank4(bslam_real_t *restrict m, int n, const bslam_symmat_term_t terms[4])
{
    const bslam_real_t *restrict c0 = terms[0].columns;
    const bslam_real_t *restrict c1 = terms[1].columns;
    const bslam_real_t *restrict c2 = terms[2].columns;
    const bslam_real_t *restrict c3 = terms[3].columns;
    bslam_real_t *restrict row = m;
    for (int i = 0; i < n; i++) {
        const bslam_real_t f0 = terms[0].scale * terms[0].row_factors[i];
        const bslam_real_t f1 = terms[1].scale * terms[1].row_factors[i];
        const bslam_real_t f2 = terms[2].scale * terms[2].row_factors[i];
        const bslam_real_t f3 = terms[3].scale * terms[3].row_factors[i];
        const int filled = (i / 4 + 1) * 4;
        for (int j = 0; j < filled; j += 4) {
            row[j] += f0 * c0[j] + f1 * c1[j] + f2 * c2[j] + f3 * c3[j];
            row[j + 1] += f0 * c0[j + 1] + f1 * c1[j + 1] + f2 * c2[j + 1] + f3 * c3[j + 1];
            row[j + 2] += f0 * c0[j + 2] + f1 * c1[j + 2] + f2 * c2[j + 2] + f3 * c3[j + 2];
            row[j + 3] += f0 * c0[j + 3] + f1 * c1[j + 3] + f2 * c2[j + 3] + f3 * c3[j + 3];
        }
        row += filled;
    }
}

void bslam_symmat_remove(bslam_real_t *m, int n, int first, int count)
{
    // Every element moves to a place at or before its own, so ascending order never overwrites what is still
    // to be read.
    for (int i = first + count; i < n; i++) {
        const bslam_real_t *from = m + bslam_symmat_row(i);
        bslam_real_t *to = m + bslam_symmat_row(i - count);
        memmove(to, from, (size_t)first * sizeof *m);
        memmove(to + first, from + first + count, (size_t)(i - first - count + 1) * sizeof *m);
    }
}

bool bslam_symmat_is_positive(const bslam_real_t *m, int n, bslam_real_t *scratch)
{
#if BSLAM_REAL_DOUBLE
    const bslam_real_t tolerance = 1e-14;
#else
    const bslam_real_t tolerance = 1e-7f;
#endif
    for (int i = 0; i < n; i++) {
        bslam_real_t *li = scratch + bslam_symmat_row(i);
        for (int j = 0; j <= i; j++) {
            const bslam_real_t *lj = scratch + bslam_symmat_row(j);
            bslam_real_t sum = bslam_symmat_get(m, i, j);
            for (int k = 0; k < j; k++) {
                sum -= li[k] * lj[k];
            }
            if (i == j) {
                const bslam_real_t diagonal = bslam_symmat_get(m, i, i);
                // Rounding leaves a pivot within the tolerance of zero where the matrix is singular, as it is
                // while a new beacon's anchor still equals the robot's position.
                if (!bslam_in_range(diagonal, 0, BSLAM_R(1e30)) ||
                    !(sum >= -tolerance * (bslam_real_t)n * diagonal)) {
                    return false;
                }
                li[i] = sum > tolerance * diagonal ? bslam_sqrt(sum) : 0;
            } else {
                li[j] = lj[j] > 0 ? sum / lj[j] : 0;
            }
        }
    }
    return true;
}
