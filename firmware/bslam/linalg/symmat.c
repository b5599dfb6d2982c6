#include "bslam/linalg/symmat.h"
#include "bslam/linalg/four.h"
#include "base/scalar.h"

#include <string.h>

/// A function whose callers name constants: each has a copy without tests of them.
#define COPIED __attribute__((always_inline)) static inline

// ---- products ---------------------------------------------------------------------------------------------

/// One row or two that look at the same places, and where what they make of a line goes.
typedef struct lanes {
    bslam_row_t a, b;
    bslam_real_t *out_a, *out_b;
} lanes_t;

/// What four lines, one behind the other and of the same length, have in a column.
static inline bslam_four_t column_of(const bslam_real_t *line, size_t length)
{
    return (bslam_four_t){line[0], line[length], line[2 * length], line[3 * length]};
}

/// The same where the diagonal crosses: the first `above` of them, 1 to 3, have it in the column's own row,
/// by symmetry.
static inline bslam_four_t column_across(const bslam_real_t *line, size_t length, const bslam_real_t *row,
                                         int above)
{
    const bslam_real_t *second = above > 1 ? row + 1 : line + length;
    const bslam_real_t *third = above > 2 ? row + 2 : line + 2 * length;
    return (bslam_four_t){row[0], *second, *third, line[3 * length]};
}

/// row · each of the lines; out has four.
static inline void put_four(const bslam_row_t *row, const int count, const bslam_four_t base[3],
                            const bslam_four_t others[BSLAM_ROW_OTHERS_MAX], bslam_real_t *out)
{
    bslam_four_t sum = row->base[0] * base[0] + row->base[1] * base[1] + row->base[2] * base[2];
    if (count > 0) {
        bslam_four_t rest = row->other[0] * others[0];
        for (int k = 1; k < count; k++) {
            rest += row->other[k] * others[k];
        }
        sum += rest;
    }
    *(bslam_four_at_t *)out = sum;
}

/// One pass over what one row or two look at. Whether there are two, and their count of others, the compiler
/// knows.
COPIED void times(const bslam_real_t *m, int n, const lanes_t *given, const bool two, const int count)
{
    const lanes_t lanes = *given;
    const bslam_real_t *line = m;
    for (int i = 0; i < n; i += 4) {
        const size_t length = bslam_symmat_filled(i);
        bslam_four_t base[3] = {column_of(line, length), column_of(line + 1, length),
                                column_of(line + 2, length)};
        if (i == 0) {
            base[1][0] = m[4];
            base[2][0] = m[8];
            base[2][1] = m[9];
        }
        bslam_four_t others[BSLAM_ROW_OTHERS_MAX];
        for (int k = 0; k < count; k++) {
            const int column = lanes.a.at + k;
            const bslam_real_t *row = m + bslam_symmat_row(column);
            if (i + 3 <= column) {
                others[k] = bslam_four(row + i);
            } else if (i > column) {
                others[k] = column_of(line + column, length);
            } else {
                others[k] = column_across(line + column, length, row + i, column - i + 1);
            }
        }
        put_four(&lanes.a, count, base, others, lanes.out_a + i);
        if (two) {
            put_four(&lanes.b, count, base, others, lanes.out_b + i);
        }
        line += 4 * length;
    }
    // What stands behind the n-th value.
    for (int i = n; i % 4 != 0; i++) {
        lanes.out_a[i] = 0;
        if (two) {
            lanes.out_b[i] = 0;
        }
    }
}

void bslam_symmat_times(const bslam_real_t *m, int n, const bslam_row_t *row, bslam_real_t *out)
{
    const lanes_t lanes = {*row, *row, out, out};
    times(m, n, &lanes, false, row->dim);
}

void bslam_symmat_times_two(const bslam_real_t *m, int n, const bslam_row_t *a, const bslam_row_t *b,
                            bslam_real_t *out_a, bslam_real_t *out_b)
{
    const lanes_t lanes = {*a, *b, out_a, out_b};
    times(m, n, &lanes, true, a->dim);
}

void bslam_symmat_column(const bslam_real_t *m, int n, int j, bslam_real_t *out)
{
    // Up to its own row the column is read as a row, by symmetry.
    const bslam_real_t *row = m + bslam_symmat_row(j);
    for (int i = 0; i <= j; i++) {
        out[i] = row[i];
    }
    const bslam_real_t *element = row + j;
    for (int i = j + 1; i < n; i++) {
        element += bslam_symmat_filled(i - 1);
        out[i] = *element;
    }
    for (int i = n; i % 4 != 0; i++) {
        out[i] = 0;
    }
}

// ---- the sum of terms -------------------------------------------------------------------------------------

/// row_factors[i] of a term, four times.
static inline bslam_four_t factor_of(const bslam_symmat_term_t *term, int i)
{
    const bslam_real_t factor = term->scale * term->row_factors[i];
    return (bslam_four_t){factor, factor, factor, factor};
}

/// Rows i and i + 1, of the same length: what the terms have in a column is read once for both.
COPIED void add_two_rows(bslam_real_t *restrict row, size_t length, int i, const bslam_symmat_term_t terms[4],
                         const int count)
{
    const bslam_real_t *restrict c0 = terms[0].columns, *restrict c1 = terms[1].columns;
    const bslam_real_t *restrict c2 = terms[2].columns, *restrict c3 = terms[3].columns;
    const bslam_four_t f0 = factor_of(&terms[0], i), g0 = factor_of(&terms[0], i + 1);
    const bslam_four_t f1 = factor_of(&terms[1], i), g1 = factor_of(&terms[1], i + 1);
    if (count <= 2) {
        for (size_t j = 0; j < length; j += 4) {
            const bslam_four_t a = bslam_four(c0 + j), b = bslam_four(c1 + j);
            *(bslam_four_at_t *)(row + j) += f0 * a + f1 * b;
            *(bslam_four_at_t *)(row + length + j) += g0 * a + g1 * b;
        }
        return;
    }
    const bslam_four_t f2 = factor_of(&terms[2], i), g2 = factor_of(&terms[2], i + 1);
    const bslam_four_t f3 = factor_of(&terms[3], i), g3 = factor_of(&terms[3], i + 1);
    for (size_t j = 0; j < length; j += 4) {
        const bslam_four_t a = bslam_four(c0 + j), b = bslam_four(c1 + j);
        const bslam_four_t c = bslam_four(c2 + j), d = bslam_four(c3 + j);
        *(bslam_four_at_t *)(row + j) += f0 * a + f1 * b + f2 * c + f3 * d;
        *(bslam_four_at_t *)(row + length + j) += g0 * a + g1 * b + g2 * c + g3 * d;
    }
}

/// Four rows from i on, a multiple of four, so that all are filled up to the same length.
COPIED void add_four_rows(bslam_real_t *row, int i, const bslam_symmat_term_t terms[4], const int count)
{
    const size_t length = bslam_symmat_filled(i);
    add_two_rows(row, length, i, terms, count);
    add_two_rows(row + 2 * length, length, i + 2, terms, count);
}

void bslam_symmat_add_rank4(bslam_real_t *restrict m, int n, const bslam_symmat_term_t terms[4], int count)
{
    bslam_real_t *row = m;
    for (int i = 0; i < n; i += 4) {
        add_four_rows(row, i, terms, count);
        row += 4 * (i + 4);
    }
}

// ---- the rest ---------------------------------------------------------------------------------------------

void bslam_symmat_remove(bslam_real_t *m, int n, int first, int count)
{
    // Every element moves to a place at or before its own, so ascending order never overwrites what is still
    // to be read.
    for (int i = first + count; i < n; i++) {
        const bslam_real_t *from = m + bslam_symmat_row(i);
        bslam_real_t *to = m + bslam_symmat_row(i - count);
        for (int j = 0; j <= i - count; j++) {
            to[j] = from[j < first ? j : j + count];
        }
    }
}

void bslam_symmat_insert(bslam_real_t *m, int n, int at)
{
    // Every element moves to a place behind its own, so descending order never overwrites what is still to be
    // read.
    for (int i = n; i > at; i--) {
        const bslam_real_t *from = m + bslam_symmat_row(i - 1);
        bslam_real_t *to = m + bslam_symmat_row(i);
        for (int j = i; j > at; j--) {
            to[j] = from[j - 1];
        }
        to[at] = 0;
        memcpy(to, from, (size_t)at * sizeof *to);
    }
    memset(m + bslam_symmat_row(at), 0, (size_t)(at + 1) * sizeof *m);
}

bool bslam_symmat_factor_row(bslam_real_t *factor, int i, bslam_real_t raise)
{
    bslam_real_t *own = factor + bslam_symmat_row(i);
    const bslam_real_t variance = own[i];
    bslam_real_t pivot = variance + raise * variance;
    const bslam_real_t *other = factor;
    for (int j = 0; j < i; j++) {
        bslam_real_t sum = own[j];
        for (int k = 0; k < j; k++) {
            sum -= own[k] * other[k];
        }
        if (other[j] > 0) {
            own[j] = sum / other[j];
            pivot -= own[j] * own[j];
        } else if (sum != 0) {  // with what has no variance
            return false;
        }
        other += bslam_symmat_filled(j);
    }
    const bool is_zero = variance == 0 && pivot == 0;
    const bool goes = pivot > 0 || is_zero;
    if (!goes || !bslam_in_range(variance, 0, BSLAM_R(1e30))) {
        return false;
    }
    own[i] = bslam_sqrt(pivot);
    return true;
}
