#include "definite.h"

#include <math.h>

enum { PLACES = BSLAM_FACTOR_PLACES_MAX, SWEEPS_MAX = 40 };

static double matrix[PLACES][PLACES];
static int size;

static double covariance(const bslam_factor_t *factor, int i, int j)
{
    const bslam_real_t *a = bslam_factor_row(factor, i), *b = bslam_factor_row(factor, j);
    double sum = 0;
    for (int k = 0; k <= (i < j ? i : j); k++) {
        sum += (double)factor->d[k] * (double)a[4 * k] * (double)b[4 * k];
    }
    return sum;
}

double definite_covariance(const bslam_ekf_t *ekf, int i, int j)
{
    return covariance(&ekf->factor, bslam_ekf_place(ekf, i), bslam_ekf_place(ekf, j));
}

/// The correlations of all values that vary. False: something is not finite, or a D negative.
static bool fill(const bslam_factor_t *factor)
{
    int places[PLACES];
    double sd[PLACES];
    size = 0;
    for (int n = 0; n < factor->body_count + factor->tail_count; n++) {
        const int i = n < factor->body_count ? n : bslam_factor_tail_at(factor) + n - factor->body_count;
        const double variance = covariance(factor, i, i);
        if (!(factor->d[i] >= 0) || !isfinite(variance)) {
            return false;
        }
        if (variance > 0) {
            sd[size] = sqrt(variance);
            places[size++] = i;
        }
    }
    for (int i = 0; i < size; i++) {
        for (int j = 0; j < size; j++) {
            matrix[i][j] = covariance(factor, places[i], places[j]) / sd[i] / sd[j];
        }
    }
    return true;
}

/// Makes element (p, q) zero by a rotation of both values.
static void rotate(int p, int q)
{
    const double half = (matrix[q][q] - matrix[p][p]) / (2 * matrix[p][q]);
    const double t = (half >= 0 ? 1 : -1) / (fabs(half) + hypot(half, 1));
    const double c = 1 / hypot(t, 1), s = t * c;
    for (int k = 0; k < size; k++) {
        const double a = matrix[k][p], b = matrix[k][q];
        matrix[k][p] = c * a - s * b;
        matrix[k][q] = s * a + c * b;
    }
    for (int k = 0; k < size; k++) {
        const double a = matrix[p][k], b = matrix[q][k];
        matrix[p][k] = c * a - s * b;
        matrix[q][k] = s * a + c * b;
    }
}

/// Rotates all pairs once. False: they were zero but for rounding.
static bool sweep(void)
{
    bool did = false;
    for (int p = 0; p < size; p++) {
        for (int q = p + 1; q < size; q++) {
            if (fabs(matrix[p][q]) > 1e-15) {
                rotate(p, q);
                did = true;
            }
        }
    }
    return did;
}

double definite_least_eigenvalue(const bslam_factor_t *factor)
{
    if (!fill(factor)) {
        return NAN;
    }
    for (int n = 0; n < SWEEPS_MAX && sweep(); n++) {
    }
    double least = 1;
    for (int i = 0; i < size; i++) {
        least = fmin(least, matrix[i][i]);
    }
    return least;
}
