/// Small dense matrices in double, passed by value: textbook formulas as they stand on the page, for
/// comparison.
#ifndef UNIT_DENSE_H
#define UNIT_DENSE_H

#define DENSE_MAX 96

typedef struct dense {
    int rows;
    int columns;
    double at[DENSE_MAX][DENSE_MAX];
} dense_t;

dense_t dense_zero(int rows, int columns);
dense_t dense_identity(int n);
dense_t dense_transposed(const dense_t *a);
dense_t dense_sum(const dense_t *a, const dense_t *b);
dense_t dense_difference(const dense_t *a, const dense_t *b);
dense_t dense_product(const dense_t *a, const dense_t *b);

/// a p aᵀ.
dense_t dense_sandwich(const dense_t *a, const dense_t *p);

/// a⁻¹ by Gauss and Jordan with pivoting. Fails the test if there is none.
dense_t dense_inverse(const dense_t *a);

/// The least eigenvalue of a symmetric matrix, by Jacobi's rotations.
double dense_least_eigenvalue(const dense_t *a);

/// Without rows and columns first to first + count - 1 (a column vector: without the rows).
dense_t dense_without(const dense_t *a, int first, int count);

#endif
