#include "definite.h"
#include "support.h"

#include <math.h>

#include "bslam/linalg/symmat.h"

#define SIZE_MAX_TESTED 27

/// A matrix in an array of exactly its length, so that AddressSanitizer sees a step beyond it, and its plain
/// square twin.
typedef struct pair {
    int n;
    bslam_real_t *m;
    double naive[SIZE_MAX_TESTED][SIZE_MAX_TESTED];
} pair_t;

static bslam_real_t *new_array(int count)
{
    bslam_real_t *array = calloc((size_t)count, sizeof *array);
    assert_non_null(array);
    return array;
}

static bslam_real_t *new_random_vector(unit_random_t *random, int count)
{
    bslam_real_t *vector = new_array(count);
    for (int i = 0; i < count; i++) {
        vector[i] = real(unit_random(random, -1, 1));
    }
    return vector;
}

static void set_both(pair_t *pair, int i, int j, double value)
{
    bslam_symmat_set(pair->m, i, j, real(value));
    pair->naive[i][j] = pair->naive[j][i] = (double)real(value);
}

static pair_t new_random_pair(unit_random_t *random, int n)
{
    pair_t pair = {.n = n, .m = new_array(BSLAM_SYMMAT_LENGTH(n))};
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++) {
            set_both(&pair, i, j, unit_random(random, -1, 1));
        }
    }
    return pair;
}

/// B Bᵀ for a random n x rank matrix B: of rank `rank`, positive definite if rank >= n.
static pair_t new_gram_pair(unit_random_t *random, int n, int rank)
{
    double b[SIZE_MAX_TESTED][SIZE_MAX_TESTED];
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < rank; k++) {
            b[i][k] = unit_random(random, -1, 1);
        }
    }
    pair_t pair = {.n = n, .m = new_array(BSLAM_SYMMAT_LENGTH(n))};
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = 0;
            for (int k = 0; k < rank; k++) {
                sum += b[i][k] * b[j][k];
            }
            set_both(&pair, i, j, sum);
        }
    }
    return pair;
}

static void assert_pair_agrees(const pair_t *pair, double tolerance)
{
    for (int i = 0; i < pair->n; i++) {
        for (int j = 0; j < pair->n; j++) {
            assert_near(bslam_symmat_get(pair->m, i, j), pair->naive[i][j], tolerance);
        }
    }
}

// ---- layout -----------------------------------------------------------------------------------------------

static void test_at_every_element_has_its_own_place_within_the_length(void **state)
{
    for (int n = 1; n <= SIZE_MAX_TESTED; n++) {
        bool *taken = calloc((size_t)BSLAM_SYMMAT_LENGTH(n), sizeof *taken);
        assert_non_null(taken);
        for (int i = 0; i < n; i++) {
            for (int j = 0; j <= i; j++) {
                const size_t at = bslam_symmat_at(i, j);
                assert_true(at < (size_t)BSLAM_SYMMAT_LENGTH(n));
                assert_false(taken[at]);
                taken[at] = true;
                assert_true(bslam_symmat_at(j, i) == at);
            }
        }
        free(taken);
    }
}

static void test_row_is_filled_up_to_a_multiple_of_four_and_the_next_follows(void **state)
{
    size_t expected = 0;
    for (int i = 0; i < 300; i++) {
        assert_true(bslam_symmat_row(i) == expected);
        expected += (size_t)BSLAM_SYMMAT_PADDED(i + 1);
        // The array of a matrix of i + 1 rows ends with its own block of four rows.
        assert_true(expected <= (size_t)BSLAM_SYMMAT_LENGTH(i + 1));
        if ((i + 1) % 4 == 0) {
            assert_true(expected == (size_t)BSLAM_SYMMAT_LENGTH(i + 1));
        }
    }
}

static void test_set_is_read_back_from_both_sides(void **state)
{
    unit_random_t random = {1};
    pair_t pair = new_random_pair(&random, SIZE_MAX_TESTED);
    assert_pair_agrees(&pair, 0);
    free(pair.m);
}

// ---- arithmetic -------------------------------------------------------------------------------------------

/// A row that looks at `dim` neighbours from `at` on, all factors random.
static bslam_row_t random_row(unit_random_t *random, int at, int dim)
{
    bslam_row_t row = {.at = (uint16_t)at, .dim = (uint16_t)dim};
    for (int k = 0; k < 3; k++) {
        row.base[k] = real(unit_random(random, -2, 2));
    }
    for (int k = 0; k < dim; k++) {
        row.other[k] = real(unit_random(random, -2, 2));
    }
    return row;
}

static void assert_product(const pair_t *pair, int n, const bslam_row_t *row, const bslam_real_t *out)
{
    for (int i = 0; i < n; i++) {
        double expected = 0;
        for (int k = 0; k < 3; k++) {
            expected += (double)row->base[k] * pair->naive[i][k];
        }
        for (int k = 0; k < row->dim; k++) {
            expected += (double)row->other[k] * pair->naive[i][row->at + k];
        }
        // Two roundings a term, of values below 3 * terms.
        assert_near(out[i], expected, 6 * (3 + row->dim) * (3 + row->dim) * UNIT_ROUNDING);
    }
    for (int i = n; i < BSLAM_SYMMAT_PADDED(n); i++) {
        assert_true(out[i] == 0);
    }
}

static void test_times_is_the_naive_product_for_one_row_and_for_two(void **state)
{
    unit_random_t random = {2};
    for (int n = 3; n <= SIZE_MAX_TESTED; n++) {
        pair_t pair = new_random_pair(&random, n);
        for (int dim = 0; dim <= BSLAM_ROW_OTHERS_MAX; dim++) {
            for (int at = 3; at + dim <= n; at++) {
                const bslam_row_t a = random_row(&random, at, dim);
                const bslam_row_t b = random_row(&random, at, dim);
                bslam_real_t *alone = new_random_vector(&random, BSLAM_SYMMAT_PADDED(n));
                bslam_real_t *by_a = new_random_vector(&random, BSLAM_SYMMAT_PADDED(n));
                bslam_real_t *by_b = new_random_vector(&random, BSLAM_SYMMAT_PADDED(n));
                bslam_symmat_times(pair.m, n, &a, alone);
                bslam_symmat_times_two(pair.m, n, &a, &b, by_a, by_b);
                assert_product(&pair, n, &a, by_a);
                assert_product(&pair, n, &b, by_b);
                assert_memory_equal(alone, by_a, (size_t)BSLAM_SYMMAT_PADDED(n) * sizeof *alone);
                free(alone);
                free(by_a);
                free(by_b);
            }
        }
        free(pair.m);
    }
}

static void test_column_is_the_naive_one(void **state)
{
    unit_random_t random = {4};
    for (int n = 1; n <= SIZE_MAX_TESTED; n++) {
        pair_t pair = new_random_pair(&random, n);
        bslam_real_t *out = new_random_vector(&random, BSLAM_SYMMAT_PADDED(n));
        for (int j = 0; j < n; j++) {
            bslam_symmat_column(pair.m, n, j, out);
            for (int i = 0; i < BSLAM_SYMMAT_PADDED(n); i++) {
                assert_true((double)out[i] == (i < n ? pair.naive[i][j] : 0));
            }
        }
        free(out);
        free(pair.m);
    }
}

/// Two vectors u, v: u vᵀ + v uᵀ as two mirrored terms, and u uᵀ and v vᵀ with scales of either sign, or 0.
static void test_add_rank4_is_the_naive_sum_of_as_many_terms(void **state)
{
    unit_random_t random = {3};
    for (int n = 1; n <= 2 * SIZE_MAX_TESTED; n++) {
        const int size = (n + 1) / 2, count = n % 2 == 0 ? 4 : 2;
        pair_t pair = new_random_pair(&random, size);
        bslam_real_t *u = new_random_vector(&random, BSLAM_SYMMAT_PADDED(size));
        bslam_real_t *v = new_random_vector(&random, BSLAM_SYMMAT_PADDED(size));
        const double scale_u = count == 4 ? unit_random(&random, -1, 1) : 0;
        const double scale_v = count == 4 ? unit_random(&random, -1, 1) : 0;
        const bslam_symmat_term_t terms[4] = {
            {u, 1, v}, {v, 1, u}, {u, real(scale_u), u}, {v, real(scale_v), v}};
        for (int i = 0; i < size; i++) {
            for (int j = 0; j < size; j++) {
                const double ui = (double)u[i], uj = (double)u[j], vi = (double)v[i], vj = (double)v[j];
                pair.naive[i][j] +=
                    (double)terms[2].scale * ui * uj + (double)terms[3].scale * vi * vj + ui * vj + vi * uj;
            }
        }
        bslam_symmat_add_rank4(pair.m, size, terms, count);
        // Nine roundings of partial sums below 5.
        assert_pair_agrees(&pair, 45 * UNIT_ROUNDING);
        free(u);
        free(v);
        free(pair.m);
    }
}

static void test_add_rank4_with_zero_scales_changes_no_bit(void **state)
{
    unit_random_t random = {4};
    const int n = 13;
    pair_t pair = new_random_pair(&random, n);
    bslam_real_t *u = new_random_vector(&random, BSLAM_SYMMAT_PADDED(n));
    const bslam_symmat_term_t nothing = {u, 0, u};
    const bslam_symmat_term_t terms[4] = {nothing, nothing, nothing, nothing};
    bslam_symmat_add_rank4(pair.m, n, terms, 4);
    assert_pair_agrees(&pair, 0);
    free(u);
    free(pair.m);
}

// ---- removal ----------------------------------------------------------------------------------------------

static void assert_remove_is_naive(unit_random_t *random, int n, int first, int count)
{
    pair_t pair = new_random_pair(random, n);
    bslam_symmat_remove(pair.m, n, first, count);
    for (int i = 0; i < n - count; i++) {
        for (int j = 0; j <= i; j++) {
            const int from_i = i < first ? i : i + count;
            const int from_j = j < first ? j : j + count;
            assert_near(bslam_symmat_get(pair.m, i, j), pair.naive[from_i][from_j], 0);
        }
    }
    free(pair.m);
}

static void test_remove_every_stretch_of_every_size_is_the_naive_removal(void **state)
{
    unit_random_t random = {5};
    for (int n = 1; n <= 14; n++) {
        for (int count = 1; count <= n; count++) {
            for (int first = 0; first + count <= n; first++) {
                assert_remove_is_naive(&random, n, first, count);
            }
        }
    }
}

// ---- insertion --------------------------------------------------------------------------------------------

static void test_insert_at_every_place_puts_zeros_in_and_moves_the_rest(void **state)
{
    unit_random_t random = {15};
    for (int n = 1; n <= 14; n++) {
        for (int at = 0; at <= n; at++) {
            pair_t pair = new_random_pair(&random, n + 1);  // with room for one more row
            bslam_symmat_insert(pair.m, n, at);
            for (int i = 0; i <= n; i++) {
                for (int j = 0; j <= i; j++) {
                    const double expected =
                        i == at || j == at ? 0 : pair.naive[i < at ? i : i - 1][j < at ? j : j - 1];
                    assert_near(bslam_symmat_get(pair.m, i, j), expected, 0);
                }
            }
            free(pair.m);
        }
    }
}

// ---- definiteness -----------------------------------------------------------------------------------------

static void test_is_positive_definite_matrix_is(void **state)
{
    unit_random_t random = {6};
    for (int n = 1; n <= SIZE_MAX_TESTED; n++) {
        pair_t pair = new_gram_pair(&random, n, n);
        for (int i = 0; i < n; i++) {
            // Clear of rounding, whatever the random matrix.
            set_both(&pair, i, i, pair.naive[i][i] + 0.01);
        }
        assert_true(is_semidefinite(pair.m, n));
        free(pair.m);
    }
}

static void test_is_positive_matrix_with_a_repeated_row_is(void **state)
{
    // A new ray's anchor repeats the robot's position: exactly singular, and no fault, whatever the units.
    static const double scales[] = {1e-8, 1, 1e8};
    static const int source[7] = {0, 1, 2, 3, 4, 0, 1};
    unit_random_t random = {7};
    for (int s = 0; s < COUNT_OF(scales); s++) {
        pair_t pair = new_gram_pair(&random, 5, 5);
        pair_t grown = {.n = 7, .m = new_array(BSLAM_SYMMAT_LENGTH(7))};
        for (int i = 0; i < 7; i++) {
            for (int j = 0; j <= i; j++) {
                set_both(&grown, i, j, scales[s] * pair.naive[source[i]][source[j]]);
            }
        }
        assert_true(is_semidefinite(grown.m, 7));
        // A hair less than its own copy's variance is no longer a covariance.
        set_both(&grown, 5, 5, scales[s] * pair.naive[0][0] * 0.999);
        assert_false(is_semidefinite(grown.m, 7));
        free(pair.m);
        free(grown.m);
    }
}

static void test_is_positive_zero_matrix_is(void **state)
{
    // The pose before the first motion.
    bslam_real_t *m = new_array(BSLAM_SYMMAT_LENGTH(3));
    assert_true(is_semidefinite(m, 3));
    free(m);
}

static void test_is_positive_matrix_with_a_negative_eigenvalue_is_not(void **state)
{
    unit_random_t random = {8};
    for (int n = 2; n <= SIZE_MAX_TESTED; n++) {
        pair_t pair = new_gram_pair(&random, n, n);
        // A correlation of 1.001 between the first and the last.
        set_both(&pair, n - 1, 0, 1.001 * sqrt(pair.naive[0][0] * pair.naive[n - 1][n - 1]));
        assert_false(is_semidefinite(pair.m, n));
        free(pair.m);
    }
}

static void test_is_positive_three_values_that_fit_by_pairs_only_are_not(void **state)
{
    // Each two of them may move against each other, all three may not.
    bslam_real_t *m = new_array(BSLAM_SYMMAT_LENGTH(3));
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            bslam_symmat_set(m, i, j, j == i ? 1 : real(-0.49));
        }
    }
    assert_true(is_semidefinite(m, 3));
    bslam_symmat_set(m, 2, 0, real(-0.53));
    assert_false(is_semidefinite(m, 3));
    free(m);
}

static void test_is_positive_value_of_no_variance_goes_with_no_other(void **state)
{
    for (int known = 0; known < 3; known++) {
        bslam_real_t *m = new_array(BSLAM_SYMMAT_LENGTH(3));
        for (int i = 0; i < 3; i++) {
            bslam_symmat_set(m, i, i, i == known ? 0 : 1);
        }
        assert_true(is_semidefinite(m, 3));
        bslam_symmat_set(m, known, (known + 1) % 3, real(1e-3));
        assert_false(is_semidefinite(m, 3));
        free(m);
    }
}

static void test_factor_row_raises_the_diagonal_by_as_much_as_it_should(void **state)
{
    // Both values are the same to 0.05 %: one direction has a variance of -0.0005.
    const bslam_real_t values[3] = {1, real(1.0005), 1};
    bslam_real_t *m = new_array(BSLAM_SYMMAT_LENGTH(2));
    for (int turn = 0; turn < 2; turn++) {
        const bslam_real_t raise = turn == 0 ? real(4e-4) : real(6e-4);
        bslam_symmat_set(m, 0, 0, values[0]);
        bslam_symmat_set(m, 1, 0, values[1]);
        bslam_symmat_set(m, 1, 1, values[2]);
        assert_true(bslam_symmat_factor_row(m, 0, raise));
        assert_near(bslam_symmat_get(m, 0, 0), sqrt(1 + (double)raise), 1e-6);
        assert_true(bslam_symmat_factor_row(m, 1, raise) == (turn == 1));
    }
    const double below = (double)values[1] / sqrt(1 + 6e-4);
    assert_near(bslam_symmat_get(m, 1, 0), below, 1e-6);
    assert_near(bslam_symmat_get(m, 1, 1), sqrt(1 + 6e-4 - below * below), 1e-4);
    free(m);
}

static void test_is_positive_matrix_with_a_bad_element_is_not(void **state)
{
    static const double bad[] = {NAN, INFINITY, -INFINITY, -1};
    unit_random_t random = {9};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        for (int k = 0; k < 5; k++) {
            pair_t pair = new_gram_pair(&random, 5, 5);
            bslam_symmat_set(pair.m, k, k, real(bad[i]));
            assert_false(is_semidefinite(pair.m, 5));
            free(pair.m);
        }
    }
}

static void test_is_positive_nan_off_the_diagonal_is_not(void **state)
{
    unit_random_t random = {10};
    for (int i = 1; i < 5; i++) {
        for (int j = 0; j < i; j++) {
            pair_t pair = new_gram_pair(&random, 5, 5);
            bslam_symmat_set(pair.m, i, j, (bslam_real_t)NAN);
            assert_false(is_semidefinite(pair.m, 5));
            free(pair.m);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_at_every_element_has_its_own_place_within_the_length),
        cmocka_unit_test(test_row_is_filled_up_to_a_multiple_of_four_and_the_next_follows),
        cmocka_unit_test(test_set_is_read_back_from_both_sides),

        cmocka_unit_test(test_times_is_the_naive_product_for_one_row_and_for_two),
        cmocka_unit_test(test_column_is_the_naive_one),
        cmocka_unit_test(test_add_rank4_is_the_naive_sum_of_as_many_terms),
        cmocka_unit_test(test_add_rank4_with_zero_scales_changes_no_bit),

        cmocka_unit_test(test_remove_every_stretch_of_every_size_is_the_naive_removal),
        cmocka_unit_test(test_insert_at_every_place_puts_zeros_in_and_moves_the_rest),

        cmocka_unit_test(test_is_positive_definite_matrix_is),
        cmocka_unit_test(test_is_positive_matrix_with_a_repeated_row_is),
        cmocka_unit_test(test_is_positive_zero_matrix_is),
        cmocka_unit_test(test_is_positive_matrix_with_a_negative_eigenvalue_is_not),
        cmocka_unit_test(test_is_positive_three_values_that_fit_by_pairs_only_are_not),
        cmocka_unit_test(test_is_positive_value_of_no_variance_goes_with_no_other),
        cmocka_unit_test(test_factor_row_raises_the_diagonal_by_as_much_as_it_should),
        cmocka_unit_test(test_is_positive_matrix_with_a_bad_element_is_not),
        cmocka_unit_test(test_is_positive_nan_off_the_diagonal_is_not),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
