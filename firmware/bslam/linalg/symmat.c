#include "bslam/linalg/symmat.h"
#include "base/scalar.h"

#include <string.h>

extern inline size_t bslam_symmat_row(int i);
extern inline size_t bslam_symmat_at(int i, int j);
extern inline bslam_real_t bslam_symmat_get(const bslam_real_t *m, int i, int j);
extern inline void bslam_symmat_set(bslam_real_t *m, int i, int j, bslam_real_t value);
extern inline size_t bslam_symmat_filled(int i);

/// A function whose callers name constants: where speed is asked for, each has a copy without tests of them.
#ifdef __OPTIMIZE_SIZE__
#define COPIED static
#else
#define COPIED __attribute__((always_inline)) static inline
#endif

// ---- products ---------------------------------------------------------------------------------------------

/// One row or two that look at the same places, and where what they make of a line goes.
typedef struct lanes {
    bslam_row_t a, b;
    bslam_real_t *out_a, *out_b;
} lanes_t;

/// What stands behind the n-th value, up to a multiple of four.
static inline void clear_tails(const lanes_t *lanes, const bool two, int n)
{
    for (int i = n; i % 4 != 0; i++) {
        lanes->out_a[i] = 0;
        if (two) {
            lanes->out_b[i] = 0;
        }
    }
}

#if defined(__GNUC__) && !defined(__OPTIMIZE_SIZE__) && !BSLAM_REAL_DOUBLE && \
    (defined(__SSE2__) || defined(__ARM_NEON))
#define FOUR_WIDE 1
#else
#define FOUR_WIDE 0
#endif
#if FOUR_WIDE

/// Of four lines a value each, on processors that take four at once. Compilers do not see by themselves that
/// this is worth the gathering of columns. The same bits as below: each element has the same sum.
typedef bslam_real_t four_t __attribute__((vector_size(4 * sizeof(bslam_real_t))));

/// What four lines, one behind the other and of the same length, have in a column.
static inline four_t column_of(const bslam_real_t *line, size_t length)
{
    return (four_t){line[0], line[length], line[2 * length], line[3 * length]};
}

/// The same where the diagonal crosses: the first `above` of them, 1 to 3, have it in the column's own row,
/// by symmetry.
static inline four_t column_across(const bslam_real_t *line, size_t length, const bslam_real_t *row,
                                   int above)
{
    const bslam_real_t *second = above > 1 ? row + 1 : line + length;
    const bslam_real_t *third = above > 2 ? row + 2 : line + 2 * length;
    return (four_t){row[0], *second, *third, line[3 * length]};
}

static inline four_t read_four(const bslam_real_t *from)
{
    four_t found;
    memcpy(&found, from, sizeof found);
    return found;
}

/// row · each of the lines; out has four.
static inline void put_four(const bslam_row_t *row, const int count, const four_t base[3],
                            const four_t others[BSLAM_ROW_OTHERS_MAX], bslam_real_t *out)
{
    four_t sum = row->base[0] * base[0] + row->base[1] * base[1] + row->base[2] * base[2];
    if (count > 0) {
        four_t rest = row->other[0] * others[0];
        for (int k = 1; k < count; k++) {
            rest += row->other[k] * others[k];
        }
        sum += rest;
    }
    memcpy(out, &sum, sizeof sum);
}

/// One pass over what one row or two look at. Whether there are two, and their count of others, the compiler
/// knows.
COPIED void times(const bslam_real_t *m, int n, const lanes_t *conditional, const bool two, const int count)
{
    const lanes_t lanes = *conditional;
    const bslam_real_t *line = m;
    for (int i = 0; i < n; i += 4) {
        const size_t length = bslam_symmat_filled(i);
        four_t base[3] = {column_of(line, length), column_of(line + 1, length), column_of(line + 2, length)};
        if (i == 0) {
            base[1][0] = m[4];
            base[2][0] = m[8];
            base[2][1] = m[9];
        }
        four_t others[BSLAM_ROW_OTHERS_MAX];
        for (int k = 0; k < count; k++) {
            const int column = lanes.a.at + k;
            const bslam_real_t *row = m + bslam_symmat_row(column);
            if (i + 3 <= column) {
                others[k] = read_four(row + i);
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
    clear_tails(&lanes, two, n);
}

#else

/// row · a line of the matrix: its columns 0 to 2, and those where the row's others stand. The compiler knows
/// their count: no test is left.
static inline bslam_real_t product(const bslam_row_t *row, const int count, const bslam_real_t base[3],
                                   const bslam_real_t others[BSLAM_ROW_OTHERS_MAX])
{
    const bslam_real_t sum = row->base[0] * base[0] + row->base[1] * base[1] + row->base[2] * base[2];
    if (count == 0) {
        return sum;
    }
    bslam_real_t rest = row->other[0] * others[0];
    if (count > 1) {
        rest += row->other[1] * others[1];
    }
    if (count > 2) {
        rest += row->other[2] * others[2];
    }
    if (count > 3) {
        rest += row->other[3] * others[3];
    }
    return sum + rest;
}

/// others[k] = *from[k], of which the first `count` exist.
static inline void read_others(const bslam_real_t *const from[BSLAM_ROW_OTHERS_MAX], const int count, int i,
                               bslam_real_t others[BSLAM_ROW_OTHERS_MAX])
{
    others[0] = count > 0 ? from[0][i] : 0;
    others[1] = count > 1 ? from[1][i] : 0;
    others[2] = count > 2 ? from[2][i] : 0;
    others[3] = count > 3 ? from[3][i] : 0;
}

/// Whether there are two, and their count of others, the compiler knows.
COPIED void put(const lanes_t *lanes, const bool two, const int count, int i, const bslam_real_t *line,
                const bslam_real_t *others)
{
    // Both sums before anything is written: what they look at is read once.
    const bslam_real_t a = product(&lanes->a, count, line, others);
    if (two) {
        const bslam_real_t b = product(&lanes->b, count, line, others);
        lanes->out_b[i] = b;
    }
    lanes->out_a[i] = a;
}

/// One pass over what one row or two look at.
COPIED void times(const bslam_real_t *m, int n, const lanes_t *conditional, const bool two, const int count)
{
    const lanes_t lanes = *conditional;
    const int first = count > 0 ? lanes.a.at : n;
    // Above the others' own rows their columns are read as rows, by symmetry; below, as neighbours.
    const bslam_real_t *rows[BSLAM_ROW_OTHERS_MAX];
    bslam_real_t others[BSLAM_ROW_OTHERS_MAX];
    for (int k = 0; k < BSLAM_ROW_OTHERS_MAX; k++) {
        rows[k] = m + bslam_symmat_row(k < count ? first + k : 0);
    }
    // The first rows lie four apart.
    const bslam_real_t head[3][3] = {{m[0], m[4], m[8]}, {m[4], m[5], m[9]}, {m[8], m[9], m[10]}};
    for (int i = 0; i < 3; i++) {
        read_others(rows, count, i, others);
        put(&lanes, two, count, i, head[i], others);
    }
    const bslam_real_t *line = m + bslam_symmat_row(3);
    for (int i = 3; i < first; i++) {
        read_others(rows, count, i, others);
        put(&lanes, two, count, i, line, others);
        line += bslam_symmat_filled(i);
    }
    for (int i = first; i < first + count; i++) {
        for (int k = 0; k < count; k++) {
            others[k] = first + k <= i ? line[first + k] : rows[k][i];
        }
        put(&lanes, two, count, i, line, others);
        line += bslam_symmat_filled(i);
    }
    for (int i = first + count; i < n; i++) {
        put(&lanes, two, count, i, line, line + first);
        line += bslam_symmat_filled(i);
    }
    clear_tails(&lanes, two, n);
}

#endif

/// As times, for any count.
COPIED void times_any(const bslam_real_t *m, int n, const lanes_t *lanes, const bool two)
{
#ifdef __OPTIMIZE_SIZE__
    times(m, n, lanes, two, lanes->a.dim);
#else
    switch (lanes->a.dim) {
    case 0:
        times(m, n, lanes, two, 0);
        break;
    case 1:
        times(m, n, lanes, two, 1);
        break;
    case 2:
        times(m, n, lanes, two, 2);
        break;
    case 3:
        times(m, n, lanes, two, 3);
        break;
    default:
        times(m, n, lanes, two, BSLAM_ROW_OTHERS_MAX);
        break;
    }
#endif
}

void bslam_symmat_times(const bslam_real_t *m, int n, const bslam_row_t *row, bslam_real_t *out)
{
    const lanes_t lanes = {*row, *row, out, out};
    times_any(m, n, &lanes, false);
}

void bslam_symmat_times_two(const bslam_real_t *m, int n, const bslam_row_t *a, const bslam_row_t *b,
                            bslam_real_t *out_a, bslam_real_t *out_b)
{
    const lanes_t lanes = {*a, *b, out_a, out_b};
    times_any(m, n, &lanes, true);
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

void bslam_symmat_multiply(const bslam_real_t *m, int n, const bslam_real_t *vector, bslam_real_t *out)
{
    const bslam_real_t *line = m;
    for (int i = 0; i < n; i++) {
        out[i] = 0;
        for (int j = 0; j < i; j++) {
            out[i] += line[j] * vector[j];
            out[j] += line[j] * vector[i];
        }
        out[i] += line[i] * vector[i];
        line += bslam_symmat_filled(i);
    }
}

// ---- the sum of terms -------------------------------------------------------------------------------------

#if FOUR_WIDE

/// row_factors[i] of a term, four times.
static inline four_t factor_of(const bslam_symmat_term_t *term, int i)
{
    const bslam_real_t factor = term->scale * term->row_factors[i];
    return (four_t){factor, factor, factor, factor};
}

static inline void add_to(bslam_real_t *row, four_t sum)
{
    sum = read_four(row) + sum;
    memcpy(row, &sum, sizeof sum);
}

/// Rows i and i + 1, of the same length: what the terms have in a column is read once for both.
COPIED void add_two_rows(bslam_real_t *restrict row, size_t length, int i, const bslam_symmat_term_t terms[4],
                         const int count)
{
    const bslam_real_t *restrict c0 = terms[0].columns, *restrict c1 = terms[1].columns;
    const bslam_real_t *restrict c2 = terms[2].columns, *restrict c3 = terms[3].columns;
    const four_t f0 = factor_of(&terms[0], i), g0 = factor_of(&terms[0], i + 1);
    const four_t f1 = factor_of(&terms[1], i), g1 = factor_of(&terms[1], i + 1);
    if (count == 2) {
        for (size_t j = 0; j < length; j += 4) {
            const four_t a = read_four(c0 + j), b = read_four(c1 + j);
            add_to(row + j, f0 * a + f1 * b);
            add_to(row + length + j, g0 * a + g1 * b);
        }
        return;
    }
    const four_t f2 = factor_of(&terms[2], i), g2 = factor_of(&terms[2], i + 1);
    const four_t f3 = factor_of(&terms[3], i), g3 = factor_of(&terms[3], i + 1);
    for (size_t j = 0; j < length; j += 4) {
        const four_t a = read_four(c0 + j), b = read_four(c1 + j);
        const four_t c = read_four(c2 + j), d = read_four(c3 + j);
        add_to(row + j, f0 * a + f1 * b + f2 * c + f3 * d);
        add_to(row + length + j, g0 * a + g1 * b + g2 * c + g3 * d);
    }
}

/// Four rows from i on, a multiple of four, so that all are filled up to the same length.
COPIED void add_four_rows(bslam_real_t *row, int i, const bslam_symmat_term_t terms[4], const int count)
{
    const size_t length = bslam_symmat_filled(i);
    add_two_rows(row, length, i, terms, count);
    add_two_rows(row + 2 * length, length, i + 2, terms, count);
}

#elif defined(__OPTIMIZE_SIZE__)

/// The same in few bytes.
COPIED void add_four_rows(bslam_real_t *restrict row, int i, const bslam_symmat_term_t terms[4],
                          const int count)
{
    const bslam_real_t *restrict c0 = terms[0].columns;
    const bslam_real_t *restrict c1 = terms[1].columns;
    const bslam_real_t *restrict c2 = terms[2].columns;
    const bslam_real_t *restrict c3 = terms[3].columns;
    const size_t filled = (size_t)i + 4;
    for (size_t k = (size_t)i; k < filled; k++, row += filled) {
        const bslam_real_t f0 = terms[0].scale * terms[0].row_factors[k];
        const bslam_real_t f1 = terms[1].scale * terms[1].row_factors[k];
        if (count == 2) {
            for (size_t j = 0; j < filled; j += 4) {
                row[j] += f0 * c0[j] + f1 * c1[j];
                row[j + 1] += f0 * c0[j + 1] + f1 * c1[j + 1];
                row[j + 2] += f0 * c0[j + 2] + f1 * c1[j + 2];
                row[j + 3] += f0 * c0[j + 3] + f1 * c1[j + 3];
            }
            continue;
        }
        const bslam_real_t f2 = terms[2].scale * terms[2].row_factors[k];
        const bslam_real_t f3 = terms[3].scale * terms[3].row_factors[k];
        for (size_t j = 0; j < filled; j += 4) {
            row[j] += f0 * c0[j] + f1 * c1[j] + f2 * c2[j] + f3 * c3[j];
            row[j + 1] += f0 * c0[j + 1] + f1 * c1[j + 1] + f2 * c2[j + 1] + f3 * c3[j + 1];
            row[j + 2] += f0 * c0[j + 2] + f1 * c1[j + 2] + f2 * c2[j + 2] + f3 * c3[j + 2];
            row[j + 3] += f0 * c0[j + 3] + f1 * c1[j + 3] + f2 * c2[j + 3] + f3 * c3[j + 3];
        }
    }
}

#else

/// The factors of four rows, by row and term.
typedef struct factors {
    bslam_real_t by[4][4];
} factors_t;

static inline void fill_factors(const bslam_symmat_term_t *term, int k, int i, factors_t *factors)
{
    const bslam_real_t *row_factors = term->row_factors + i;
    factors->by[0][k] = term->scale * row_factors[0];
    factors->by[1][k] = term->scale * row_factors[1];
    factors->by[2][k] = term->scale * row_factors[2];
    factors->by[3][k] = term->scale * row_factors[3];
}

/// What the four terms have in one column.
typedef struct column {
    bslam_real_t a, b, c, d;
} column_t;

static inline void add_element(const bslam_real_t by[4], column_t column, const int count,
                               bslam_real_t *element)
{
    bslam_real_t sum = by[0] * column.a + by[1] * column.b;
    if (count > 2) {
        sum = sum + by[2] * column.c + by[3] * column.d;
    }
    *element += sum;
}

/// One column of the rows from `k` on of four of the same length: what the terms have there is read once.
static inline void add_column(const factors_t *f, const int count, const int k, column_t column,
                              bslam_real_t *r0, bslam_real_t *r1, bslam_real_t *r2, bslam_real_t *r3)
{
    if (k < 1) {
        add_element(f->by[0], column, count, r0);
    }
    if (k < 2) {
        add_element(f->by[1], column, count, r1);
    }
    if (k < 3) {
        add_element(f->by[2], column, count, r2);
    }
    add_element(f->by[3], column, count, r3);
}

/// Four rows from i on, a multiple of four, so that all are filled up to the same length. On a Cortex-M4F the
/// factors stay in registers.
COPIED void add_four_rows(bslam_real_t *restrict r0, int i, const bslam_symmat_term_t terms[4],
                          const int count)
{
    const int filled = i + 4;
    bslam_real_t *restrict r1 = r0 + filled;
    bslam_real_t *restrict r2 = r1 + filled;
    bslam_real_t *restrict r3 = r2 + filled;
    const bslam_real_t *restrict c0 = terms[0].columns;
    const bslam_real_t *restrict c1 = terms[1].columns;
    const bslam_real_t *restrict c2 = terms[2].columns;
    const bslam_real_t *restrict c3 = terms[3].columns;
    factors_t f;
    fill_factors(&terms[0], 0, i, &f);
    fill_factors(&terms[1], 1, i, &f);
    fill_factors(&terms[2], 2, i, &f);
    fill_factors(&terms[3], 3, i, &f);
    for (const bslam_real_t *end = c0 + i; c0 != end; c0 += 4, c1 += 4, c2 += 4, c3 += 4) {
        add_column(&f, count, 0, (column_t){c0[0], c1[0], c2[0], c3[0]}, r0, r1, r2, r3);
        add_column(&f, count, 0, (column_t){c0[1], c1[1], c2[1], c3[1]}, r0 + 1, r1 + 1, r2 + 1, r3 + 1);
        add_column(&f, count, 0, (column_t){c0[2], c1[2], c2[2], c3[2]}, r0 + 2, r1 + 2, r2 + 2, r3 + 2);
        add_column(&f, count, 0, (column_t){c0[3], c1[3], c2[3], c3[3]}, r0 + 3, r1 + 3, r2 + 3, r3 + 3);
        r0 += 4;
        r1 += 4;
        r2 += 4;
        r3 += 4;
    }
    // On the diagonal what is above it is no part of the matrix.
    add_column(&f, count, 0, (column_t){c0[0], c1[0], c2[0], c3[0]}, r0, r1, r2, r3);
    add_column(&f, count, 1, (column_t){c0[1], c1[1], c2[1], c3[1]}, r0 + 1, r1 + 1, r2 + 1, r3 + 1);
    add_column(&f, count, 2, (column_t){c0[2], c1[2], c2[2], c3[2]}, r0 + 2, r1 + 2, r2 + 2, r3 + 2);
    add_column(&f, count, 3, (column_t){c0[3], c1[3], c2[3], c3[3]}, r0 + 3, r1 + 3, r2 + 3, r3 + 3);
}

#endif

COPIED void add_rows(bslam_real_t *restrict m, int n, const bslam_symmat_term_t terms[4], const int count)
{
    bslam_real_t *row = m;
    for (int i = 0; i < n; i += 4) {
        add_four_rows(row, i, terms, count);
        row += 4 * (i + 4);
    }
}

void bslam_symmat_add_rank4(bslam_real_t *restrict m, int n, const bslam_symmat_term_t terms[4], int count)
{
#ifndef __OPTIMIZE_SIZE__
    if (count <= 2) {
        add_rows(m, n, terms, 2);
        return;
    }
#endif
    (void)count;
    add_rows(m, n, terms, 4);
}

// ---- the rest
// -----------------------------------------------------------------------------------------------

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

bool bslam_symmat_is_positive(const bslam_real_t *m, int n, bslam_real_t *scratch)
{
#if BSLAM_REAL_DOUBLE
    const bslam_real_t tolerance = 1e-14;
#else
    const bslam_real_t tolerance = 1e-7f;
#endif
    memcpy(scratch, m, bslam_symmat_row(n) * sizeof *m);
    for (int i = 0; i < n; i++) {
        // Rounding leaves it a little short where it is singular, as it is while a new beacon's anchor still
        // equals the robot's position.
        if (!bslam_symmat_factor_row(scratch, i, tolerance * (bslam_real_t)n)) {
            return false;
        }
    }
    return true;
}
