#include "bslam/math/symmat.h"

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

void bslam_symmat_first_columns(const bslam_real_t *restrict m, int n, const bslam_real_t factors[3],
                                bslam_real_t *restrict out)
{
    const bslam_real_t a = factors[0];
    const bslam_real_t b = factors[1];
    const bslam_real_t c = factors[2];
    for (int i = 0; i < 3; i++) {
        out[i] =
            a * bslam_symmat_get(m, i, 0) + b * bslam_symmat_get(m, i, 1) + c * bslam_symmat_get(m, i, 2);
    }
    const bslam_real_t *row = m + bslam_symmat_row(3);
    out[3] = a * row[0] + b * row[1] + c * row[2];
    row += 4;
    // Blocks of four rows of one filled length; what is behind n is overwritten.
    for (int i = 4; i < n; i += 4) {
        const bslam_real_t *second = row + i + 4, *third = second + i + 4, *fourth = third + i + 4;
        out[i] = a * row[0] + b * row[1] + c * row[2];
        out[i + 1] = a * second[0] + b * second[1] + c * second[2];
        out[i + 2] = a * third[0] + b * third[1] + c * third[2];
        out[i + 3] = a * fourth[0] + b * fourth[1] + c * fourth[2];
        row = fourth + i + 4;
    }
    // The last block's rows behind n. At most three.
    for (int i = n; i % 4 != 0; i++) {
        out[i] = 0;
    }
}

#if defined(__SSE2__) || defined(__ARM_NEON)

/// Four rows from i on, a multiple of four, so that all are filled up to the same length. With vector
/// instructions four columns of a row are one step. The same bits as below: each element has the same sum.
static void add_four_rows(bslam_real_t *restrict row, int i, const bslam_symmat_term_t terms[4])
{
    const bslam_real_t *restrict c0 = terms[0].columns;
    const bslam_real_t *restrict c1 = terms[1].columns;
    const bslam_real_t *restrict c2 = terms[2].columns;
    const bslam_real_t *restrict c3 = terms[3].columns;
    const int filled = i + 4;
    for (int k = i; k < filled; k++, row += filled) {
        const bslam_real_t f0 = terms[0].scale * terms[0].row_factors[k];
        const bslam_real_t f1 = terms[1].scale * terms[1].row_factors[k];
        const bslam_real_t f2 = terms[2].scale * terms[2].row_factors[k];
        const bslam_real_t f3 = terms[3].scale * terms[3].row_factors[k];
        for (int j = 0; j < filled; j += 4) {
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

/// One column of four rows of the same length: what the four terms have there is read once for all.
static inline void add_column(const factors_t *f, bslam_real_t a, bslam_real_t b, bslam_real_t c,
                              bslam_real_t d, bslam_real_t *r0, bslam_real_t *r1, bslam_real_t *r2,
                              bslam_real_t *r3)
{
    *r0 += f->by[0][0] * a + f->by[0][1] * b + f->by[0][2] * c + f->by[0][3] * d;
    *r1 += f->by[1][0] * a + f->by[1][1] * b + f->by[1][2] * c + f->by[1][3] * d;
    *r2 += f->by[2][0] * a + f->by[2][1] * b + f->by[2][2] * c + f->by[2][3] * d;
    *r3 += f->by[3][0] * a + f->by[3][1] * b + f->by[3][2] * c + f->by[3][3] * d;
}

/// Four rows from i on, a multiple of four, so that all are filled up to the same length. On a Cortex-M4F the
/// factors stay in registers.
static void add_four_rows(bslam_real_t *restrict r0, int i, const bslam_symmat_term_t terms[4])
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
    for (const bslam_real_t *end = c0 + filled; c0 != end; c0 += 4, c1 += 4, c2 += 4, c3 += 4) {
        add_column(&f, c0[0], c1[0], c2[0], c3[0], r0, r1, r2, r3);
        add_column(&f, c0[1], c1[1], c2[1], c3[1], r0 + 1, r1 + 1, r2 + 1, r3 + 1);
        add_column(&f, c0[2], c1[2], c2[2], c3[2], r0 + 2, r1 + 2, r2 + 2, r3 + 2);
        add_column(&f, c0[3], c1[3], c2[3], c3[3], r0 + 3, r1 + 3, r2 + 3, r3 + 3);
        r0 += 4;
        r1 += 4;
        r2 += 4;
        r3 += 4;
    }
}

#endif

void bslam_symmat_add_rank4(bslam_real_t *restrict m, int n, const bslam_symmat_term_t terms[4])
{
    bslam_real_t *row = m;
    for (int i = 0; i < n; i += 4) {
        add_four_rows(row, i, terms);
        row += 4 * (i + 4);
    }
}

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
