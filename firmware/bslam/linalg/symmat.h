/// A symmetric matrix of changing size, held as one triangle in the caller's array.
///
/// Row i holds columns 0 to i and is filled up to a multiple of four, so that inner loops run in blocks of
/// four. What stands in the fill is no part of the matrix. The same array serves every size up to
/// BSLAM_SYMMAT_LENGTH's argument.
#ifndef BSLAM_LINALG_SYMMAT_H
#define BSLAM_LINALG_SYMMAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/real.h"

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

/// How long row i is with its fill: from its beginning to the next one's.
static inline size_t bslam_symmat_filled(int i)
{
    return ((size_t)i / 4 + 1) * 4;
}

// ---- products ---------------------------------------------------------------------------------------------

/// Places of a sparse row apart from the first three.
#define BSLAM_ROW_OTHERS_MAX 4

/// A sparse row: not zero only at 0, 1, 2 and at `dim` neighbouring places from `at` on, at >= 3.
typedef struct bslam_row {
    bslam_real_t base[3], other[BSLAM_ROW_OTHERS_MAX];
    uint16_t at;
    uint16_t dim;
} bslam_row_t;

/// out[0..n) = the n x n matrix times rowᵀ, n >= 3; out is 0 from there up to BSLAM_SYMMAT_PADDED(n).
/// O((3 + dim) n).
void bslam_symmat_times(const bslam_real_t *m, int n, const bslam_row_t *row, bslam_real_t *out);

/// The same of two rows that look at the same places: what they look at is read once for both.
void bslam_symmat_times_two(const bslam_real_t *m, int n, const bslam_row_t *a, const bslam_row_t *b,
                            bslam_real_t *out_a, bslam_real_t *out_b);

/// out[0..n) = column j; out is 0 from there up to BSLAM_SYMMAT_PADDED(n). O(n).
void bslam_symmat_column(const bslam_real_t *m, int n, int j, bslam_real_t *out);

// ---- the sum of terms -------------------------------------------------------------------------------------

/// One symmetric term of a sum: row i of the matrix gets row_factors[i] * columns[0..i].
typedef struct bslam_symmat_term {
    const bslam_real_t *row_factors;  ///< [BSLAM_SYMMAT_PADDED(n)], what stands behind n finite
    bslam_real_t scale;               ///< multiplies row_factors
    const bslam_real_t *columns;      ///< [BSLAM_SYMMAT_PADDED(n)]
} bslam_symmat_term_t;

/// m += the sum of four terms, of which those behind the first `count` have scale 0, in one pass over the
/// triangle. The sum must be symmetric. This is where a filter step spends its time. The rows behind n up to
/// a multiple of four, which are no part of the matrix, change too. O(4 n^2 / 2).
void bslam_symmat_add_rank4(bslam_real_t *m, int n, const bslam_symmat_term_t terms[4], int count);

/// Takes rows and columns first to first + count - 1 out; those behind move up. O(n^2).
void bslam_symmat_remove(bslam_real_t *m, int n, int first, int count);

/// Puts a row and a column of zeros in at place `at`; those from there on move down by one. O(n^2).
void bslam_symmat_insert(bslam_real_t *m, int n, int at);

/// One row of a Cholesky factorisation in place: row i of a covariance becomes row i of the factor. raise:
/// variances count as larger by this part, so that a singular matrix passes in spite of rounding. False:
/// raised so, it is not positive semidefinite; the row then holds nothing. O(i^2 / 2).
bool bslam_symmat_factor_row(bslam_real_t *factor, int i, bslam_real_t raise);

#endif
