#include "dense.h"

#include <math.h>

#include "support.h"

dense_t dense_zero(int rows, int columns)
{
    assert_true(rows <= DENSE_MAX && columns <= DENSE_MAX);
    return (dense_t){.rows = rows, .columns = columns};
}

dense_t dense_identity(int n)
{
    dense_t result = dense_zero(n, n);
    for (int i = 0; i < n; i++) {
        result.at[i][i] = 1;
    }
    return result;
}

dense_t dense_transposed(const dense_t *a)
{
    dense_t result = dense_zero(a->columns, a->rows);
    for (int i = 0; i < a->rows; i++) {
        for (int j = 0; j < a->columns; j++) {
            result.at[j][i] = a->at[i][j];
        }
    }
    return result;
}

static dense_t combined(const dense_t *a, double factor, const dense_t *b)
{
    assert_true(a->rows == b->rows && a->columns == b->columns);
    dense_t result = dense_zero(a->rows, a->columns);
    for (int i = 0; i < a->rows; i++) {
        for (int j = 0; j < a->columns; j++) {
            result.at[i][j] = a->at[i][j] + factor * b->at[i][j];
        }
    }
    return result;
}

dense_t dense_sum(const dense_t *a, const dense_t *b)
{
    return combined(a, 1, b);
}

dense_t dense_difference(const dense_t *a, const dense_t *b)
{
    return combined(a, -1, b);
}

dense_t dense_product(const dense_t *a, const dense_t *b)
{
    assert_int_equal(a->columns, b->rows);
    dense_t result = dense_zero(a->rows, b->columns);
    for (int i = 0; i < a->rows; i++) {
        for (int j = 0; j < b->columns; j++) {
            for (int k = 0; k < a->columns; k++) {
                result.at[i][j] += a->at[i][k] * b->at[k][j];
            }
        }
    }
    return result;
}

dense_t dense_sandwich(const dense_t *a, const dense_t *p)
{
    const dense_t left = dense_product(a, p);
    const dense_t right = dense_transposed(a);
    return dense_product(&left, &right);
}

static void swap_rows(dense_t *a, int i, int j)
{
    double row[DENSE_MAX];
    memcpy(row, a->at[i], sizeof row);
    memcpy(a->at[i], a->at[j], sizeof row);
    memcpy(a->at[j], row, sizeof row);
}

/// Row i of a, less factor times row j.
static void subtract_row(dense_t *a, int i, double factor, int j)
{
    for (int k = 0; k < a->columns; k++) {
        a->at[i][k] -= factor * a->at[j][k];
    }
}

static int largest_below(const dense_t *a, int column)
{
    int best = column;
    for (int i = column + 1; i < a->rows; i++) {
        if (fabs(a->at[i][column]) > fabs(a->at[best][column])) {
            best = i;
        }
    }
    return best;
}

dense_t dense_inverse(const dense_t *a)
{
    assert_int_equal(a->rows, a->columns);
    dense_t rest = *a;
    dense_t inverse = dense_identity(a->rows);
    for (int k = 0; k < a->rows; k++) {
        const int pivot = largest_below(&rest, k);
        swap_rows(&rest, k, pivot);
        swap_rows(&inverse, k, pivot);
        assert_true(rest.at[k][k] != 0);
        const double scale = 1 - 1 / rest.at[k][k];
        subtract_row(&inverse, k, scale, k);
        subtract_row(&rest, k, scale, k);
        for (int i = 0; i < a->rows; i++) {
            if (i != k) {
                subtract_row(&inverse, i, rest.at[i][k], k);
                subtract_row(&rest, i, rest.at[i][k], k);
            }
        }
    }
    return inverse;
}

/// Turns rows and columns i and j so that element (i, j) becomes 0.
static void rotate(dense_t *a, int i, int j)
{
    if (a->at[i][j] == 0) {
        return;
    }
    const double half = (a->at[j][j] - a->at[i][i]) / (2 * a->at[i][j]);
    const double t = (half < 0 ? -1 : 1) / (fabs(half) + sqrt(half * half + 1));
    const double c = 1 / sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < a->rows; k++) {
        const double row[2] = {a->at[i][k], a->at[j][k]};
        a->at[i][k] = c * row[0] - s * row[1];
        a->at[j][k] = s * row[0] + c * row[1];
    }
    for (int k = 0; k < a->rows; k++) {
        const double column[2] = {a->at[k][i], a->at[k][j]};
        a->at[k][i] = c * column[0] - s * column[1];
        a->at[k][j] = s * column[0] + c * column[1];
    }
}

double dense_least_eigenvalue(const dense_t *a)
{
    dense_t rest = *a;
    for (int sweep = 0; sweep < 12; sweep++) {  // each leaves about the square of what is off the diagonal
        for (int i = 0; i < a->rows; i++) {
            for (int j = i + 1; j < a->rows; j++) {
                rotate(&rest, i, j);
            }
        }
    }
    double least = rest.at[0][0];
    for (int i = 1; i < a->rows; i++) {
        least = fmin(least, rest.at[i][i]);
    }
    return least;
}

dense_t dense_without(const dense_t *a, int first, int count)
{
    const bool is_vector = a->columns == 1;
    dense_t result = dense_zero(a->rows - count, is_vector ? 1 : a->columns - count);
    for (int i = 0; i < result.rows; i++) {
        for (int j = 0; j < result.columns; j++) {
            result.at[i][j] = a->at[i < first ? i : i + count][is_vector || j < first ? j : j + count];
        }
    }
    return result;
}
