#include "bslam/math/symmat.h"

#include <string.h>

/// factors · (a, b, c, d), of which the first `count` exist. The compiler knows the count: no test is left.
static inline bslam_real_t weigh(const bslam_real_t *factors, const int count, const bslam_real_t *a,
                                 const bslam_real_t *b, const bslam_real_t *c, const bslam_real_t *d)
{
    bslam_real_t sum = factors[0] * *a;
    if (count > 1) {
        sum += factors[1] * *b;
    }
    if (count > 2) {
        sum += factors[2] * *c;
    }
    if (count > 3) {
        sum += factors[3] * *d;
    }
    return sum;
}

/// bslam_symmat_add_columns for a count that the compiler knows.
static inline void add_columns(const bslam_real_t *restrict m, int n, int first, const int count,
                               const bslam_real_t *restrict factors, bslam_real_t *restrict out)
{
    // Above the columns' own rows they are read as rows, by symmetry; below, as `count` neighbours of each
    // row.
    const bslam_real_t *rows[BSLAM_SYMMAT_COLUMNS_MAX] = {m, m, m, m};
    for (int k = 0; k < count; k++) {
        rows[k] = m + bslam_symmat_row(first + k);
    }
    for (int i = 0; i < first; i++) {
        out[i] += weigh(factors, count, rows[0] + i, rows[1] + i, rows[2] + i, rows[3] + i);
    }
    for (int i = first; i < first + count; i++) {
        for (int k = 0; k < count; k++) {
            out[i] += factors[k] * bslam_symmat_get(m, i, first + k);
        }
    }
    const bslam_real_t *element = m + bslam_symmat_row(first + count) + first;
    for (int i = first + count; i < n; i++) {
        out[i] += weigh(factors, count, element, element + (count > 1 ? 1 : 0), element + (count > 2 ? 2 : 0),
                        element + (count > 3 ? 3 : 0));
        // To the next row: the filled length of this one.
        element += ((size_t)i / 4 + 1) * 4;
    }
}

void bslam_symmat_add_columns(const bslam_real_t *m, int n, int first, int count, const bslam_real_t *factors,
                              bslam_real_t *out)
{
    switch (count) {
    case 1:
        add_columns(m, n, first, 1, factors, out);
        break;
    case 2:
        add_columns(m, n, first, 2, factors, out);
        break;
    case 3:
        add_columns(m, n, first, 3, factors, out);
        break;
    default:
        add_columns(m, n, first, BSLAM_SYMMAT_COLUMNS_MAX, factors, out);
        break;
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
