/// A symmetric matrix of changing size, held as one triangle in the caller's array.
///
/// Row i holds columns 0 to i and is filled up to a multiple of four, so that the one inner loop that costs
/// anything (bslam_symmat_add_rank4) runs in blocks of four without a remainder. What stands in the fill is
/// no part of the matrix. The same array serves every size up to BSLAM_SYMMAT_LENGTH's argument: growing is
/// writing the new rows.
#ifndef BSLAM_MATH_SYMMAT_H
#define BSLAM_MATH_SYMMAT_H

#include <stdbool.h>
#include <stddef.h>

#include "bslam/base/real.h"

/// n filled up to a multiple of four: the length of a vector that goes with a matrix of size n. Its tail must
/// be finite.
#define BSLAM_SYMMAT_PADDED(n) (((n) + 3) / 4 * 4)
/// Elements of the array that holds a matrix of size n.
#define BSLAM_SYMMAT_LENGTH(n) (BSLAM_SYMMAT_PADDED(n) * (BSLAM_SYMMAT_PADDED(n) + 4) / 2)

/// Where row i begins.
static inline size_t bslam_symmat_row(int i)
{
    const size_t block = (size_t)i / 4;
    return 4 * (block + 1) * (2 * block + (size_t)i % 4);
}

/// Where element (i, j) stands, for any order of i and j.
static inline size_t bslam_symmat_at(int i, int j)
{
    return i >= j ? bslam_symmat_row(i) + (size_t)j : bslam_symmat_row(j) + (size_t)i;
}

/// Element (i, j).
static inline bslam_real_t bslam_symmat_get(const bslam_real_t *m, int i, int j)
{
    return m[bslam_symmat_at(i, j)];
}

/// Sets element (i, j), and so (j, i).
static inline void bslam_symmat_set(bslam_real_t *m, int i, int j, bslam_real_t value)
{
    m[bslam_symmat_at(i, j)] = value;
}

/// Columns that bslam_symmat_add_columns takes at once.
#define BSLAM_SYMMAT_COLUMNS_MAX 4

/// out[0..n) += the sum of factors[k] * column first + k of the n x n matrix, 1 <= count <=
/// BSLAM_SYMMAT_COLUMNS_MAX. O(count n).
void bslam_symmat_add_columns(const bslam_real_t *m, int n, int first, int count, const bslam_real_t *factors,
                              bslam_real_t *out);

/// out[0..n) = the sum of factors[k] * column k of the n x n matrix, k < 3 <= n; out is 0 from there up to
/// BSLAM_SYMMAT_PADDED(n). O(n).
void bslam_symmat_first_columns(const bslam_real_t *m, int n, const bslam_real_t factors[3],
                                bslam_real_t *out);

/// One symmetric term of a sum: row i of the matrix gets row_factors[i] * columns[0..i].
typedef struct bslam_symmat_term {
    const bslam_real_t *row_factors;  ///< [BSLAM_SYMMAT_PADDED(n)], what stands behind n finite
    bslam_real_t scale;               ///< multiplies row_factors
    const bslam_real_t *columns;      ///< [BSLAM_SYMMAT_PADDED(n)]
} bslam_symmat_term_t;

/// m += the sum of four terms, in one pass over the triangle. The sum must be symmetric (pairs of terms may
/// be each other's mirror image). This is where a filter step spends its time: 4 multiply-adds an element.
/// The rows behind n up to a multiple of four, which are no part of the matrix, change too. O(4 n^2 / 2).
void bslam_symmat_add_rank4(bslam_real_t *m, int n, const bslam_symmat_term_t terms[4]);

/// Takes rows and columns first to first + count - 1 out; those behind move up. O(n^2).
void bslam_symmat_remove(bslam_real_t *m, int n, int first, int count);

/// True if the n x n matrix is positive definite to working precision: Cholesky with a relative pivot
/// tolerance. scratch has BSLAM_SYMMAT_LENGTH(n) elements. O(n^3 / 6): for tests and health checks, not for
/// the control loop.
bool bslam_symmat_is_positive(const bslam_real_t *m, int n, bslam_real_t *scratch);

#endif
