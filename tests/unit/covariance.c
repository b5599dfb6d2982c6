#include "covariance.h"

#include <math.h>

#include "support.h"

// ---- factors ----------------------------------------------------------------------------------------------

static int value_count(const bslam_factor_t *factor)
{
    return factor->body_count + factor->tail_count;
}

static double element(const bslam_factor_t *factor, int i, int j)
{
    return (double)bslam_factor_row(factor, covariance_place(factor, i))[4 * covariance_place(factor, j)];
}

dense_t covariance_of_factor(const bslam_factor_t *factor)
{
    const int n = value_count(factor);
    dense_t p = dense_zero(n, n);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            for (int k = 0; k <= (i < j ? i : j); k++) {
                const double d = (double)factor->d[covariance_place(factor, k)];
                p.at[i][j] += d * element(factor, i, k) * element(factor, j, k);
            }
        }
    }
    return p;
}

/// p - l d lᵀ of the columns before `column`, at (row, column).
static double what_is_left(const dense_t *p, const dense_t *l, const double *d, int row, int column)
{
    double left = p->at[row][column];
    for (int k = 0; k < column; k++) {
        left -= l->at[row][k] * d[k] * l->at[column][k];
    }
    return left;
}

void covariance_factor(const dense_t *p, int tail_count, bslam_factor_t *factor)
{
    const int n = p->rows;
    dense_t l = dense_identity(n);
    double d[DENSE_MAX];
    bslam_factor_begin(factor, n - tail_count, tail_count);
    for (int j = 0; j < n; j++) {
        d[j] = what_is_left(p, &l, d, j, j);
        assert_true(d[j] >= -1e-9 * p->at[j][j]);  // a covariance, but for the rounding of double
        if (d[j] <= 1e-12 * p->at[j][j]) {
            d[j] = 0;
        }
        for (int i = j + 1; d[j] > 0 && i < n; i++) {
            l.at[i][j] = what_is_left(p, &l, d, i, j) / d[j];
        }
        factor->d[covariance_place(factor, j)] = real(d[j]);
        for (int k = 0; k < j; k++) {
            *bslam_factor_element(factor, covariance_place(factor, j), covariance_place(factor, k)) =
                real(l.at[j][k]);
        }
    }
}

/// Which value stands at a place; -1: none.
static int value_at(const bslam_factor_t *factor, int place)
{
    const int tail = place - bslam_factor_tail_at(factor);
    if (tail >= 0) {
        return tail < factor->tail_count ? factor->body_count + tail : -1;
    }
    return place < factor->body_count ? place : -1;
}

/// The four rows from place `at` on.
static const bslam_real_t *block_of(const bslam_factor_t *factor, int at)
{
    return at < bslam_factor_tail_at(factor) ? factor->body + bslam_factor_block_at(at) : factor->tail;
}

static void assert_triangle(const bslam_factor_t *factor)
{
    for (int i = 0; i < bslam_factor_places(factor); i++) {
        const bslam_real_t *row = block_of(factor, i / 4 * 4) + i % 4;
        const bool is_value = value_at(factor, i) >= 0;
        for (int j = 0; j < i / 4 * 4 + 4; j++) {
            if (j >= i || !is_value || value_at(factor, j) < 0) {
                assert_true(row[4 * j] == (j == i && is_value ? 1 : 0));
            }
        }
        assert_true(is_value || factor->d[i] == 0);
        assert_true(factor->d[i] >= 0 && isfinite((double)factor->d[i]));
    }
}

void covariance_assert_sound(const bslam_factor_t *factor)
{
    const int n = value_count(factor);
    assert_triangle(factor);
    dense_t p = dense_zero(n, n);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            const int a = covariance_place(factor, i), b = covariance_place(factor, j);
            const double scale =
                sqrt((double)bslam_factor_get(factor, a, a)) * sqrt((double)bslam_factor_get(factor, b, b));
            p.at[i][j] = scale > 0 ? (double)bslam_factor_get(factor, a, b) / scale : i == j;
        }
    }
    // Each correlation is a sum of n terms.
    assert_true(dense_least_eigenvalue(&p) >= -4 * n * n * UNIT_ROUNDING);
}

// ---- filters ----------------------------------------------------------------------------------------------

/// Which value of the factor state value i is.
static int value_of(const bslam_ekf_t *ekf, int i)
{
    return value_at(&ekf->factor, bslam_ekf_place(ekf, i));
}

dense_t covariance_of(const bslam_ekf_t *ekf)
{
    const dense_t factored = covariance_of_factor(&ekf->factor);
    dense_t p = dense_zero(ekf->dim, ekf->dim);
    for (int i = 0; i < ekf->dim; i++) {
        for (int j = 0; j < ekf->dim; j++) {
            p.at[i][j] = factored.at[value_of(ekf, i)][value_of(ekf, j)];
        }
    }
    return p;
}

void covariance_set(bslam_ekf_t *ekf, const dense_t *p)
{
    assert_int_equal(p->rows, ekf->dim);
    dense_t factored = dense_zero(ekf->dim, ekf->dim);
    for (int i = 0; i < ekf->dim; i++) {
        for (int j = 0; j < ekf->dim; j++) {
            factored.at[value_of(ekf, i)][value_of(ekf, j)] = p->at[i][j];
        }
    }
    covariance_factor(&factored, ekf->factor.tail_count, &ekf->factor);
}

void covariance_forget(bslam_ekf_t *ekf, int at, double variance)
{
    dense_t p = covariance_of(ekf);
    for (int i = 0; i < ekf->dim; i++) {
        p.at[i][at] = p.at[at][i] = i == at ? variance : 0;
    }
    covariance_set(ekf, &p);
}

void covariance_break(bslam_ekf_t *ekf, int first, int count)
{
    for (int i = first; i < first + count; i++) {
        covariance_forget(ekf, i, 1);
    }
    for (int i = first; i < first + count; i++) {
        ekf->factor.d[bslam_ekf_place(ekf, i)] = -1;
    }
}
