#include "covariance.h"
#include "support.h"

/// Of numbers of order 1 after some hundred roundings; where a share makes them larger, times that.
#define TOLERANCE (300 * UNIT_ROUNDING)

/// Sizes on both sides of a multiple of four.
enum { BODY_MOST = 9, SIZES = 2 * (BODY_MOST + 1) };

static bslam_real_t w[BSLAM_FACTOR_PLACES_MAX], scratch[2][BSLAM_FACTOR_PLACES_MAX];

static bslam_factor_t random_factor(unit_random_t *random, int body, int tail)
{
    bslam_factor_t factor;
    bslam_factor_begin(&factor, body, tail);
    for (int i = 0; i < body + tail; i++) {
        const int place = covariance_place(&factor, i);
        factor.d[place] = real(unit_random(random, 0.2, 1));
        for (int j = 0; j < i; j++) {
            *bslam_factor_element(&factor, place, covariance_place(&factor, j)) =
                real(unit_random(random, -1, 1));
        }
    }
    return factor;
}

static void assert_is(const bslam_factor_t *factor, const dense_t *expected, double tolerance)
{
    const dense_t p = covariance_of_factor(factor);
    covariance_assert_sound(factor);
    assert_int_equal(p.rows, expected->rows);
    for (int i = 0; i < p.rows; i++) {
        for (int j = 0; j < p.rows; j++) {
            assert_near(p.at[i][j], expected->at[i][j], tolerance);
        }
    }
}

/// A vector over the values, and in `by_place` what of it stands at each place.
static dense_t random_vector(unit_random_t *random, const bslam_factor_t *factor, int first,
                             bslam_real_t *by_place)
{
    const int count = factor->body_count + factor->tail_count;
    dense_t vector = dense_zero(count, 1);
    memset(by_place, 0, sizeof w);
    for (int i = first; i < count; i++) {
        const bslam_real_t value = real(unit_random(random, -1, 1));
        vector.at[i][0] = (double)value;
        by_place[covariance_place(factor, i)] = value;
    }
    return vector;
}

static dense_t plus_square(dense_t p, double share, const dense_t *vector)
{
    for (int i = 0; i < p.rows; i++) {
        for (int j = 0; j < p.rows; j++) {
            p.at[i][j] += share * vector->at[i][0] * vector->at[j][0];
        }
    }
    return p;
}

/// Size n of SIZES: each body with each tail.
static int body_of(int n)
{
    return n / 2;
}

static int tail_of(int n)
{
    return 2 + n % 2;
}

// ---- reading, rows ----------------------------------------------------------------------------------------

static void test_factor_begin_has_values_without_variance(void **state)
{
    bslam_factor_t factor;
    for (int n = 0; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        memset(&factor, 0x55, sizeof factor);
        bslam_factor_begin(&factor, body, tail);
        const dense_t none = dense_zero(body + tail, body + tail);
        assert_is(&factor, &none, 0);
        assert_int_equal(bslam_factor_tail_at(&factor), (body + 3) / 4 * 4);
        assert_int_equal(bslam_factor_places(&factor), (body + 3) / 4 * 4 + 4);
    }
}

static void test_factor_get_is_the_product(void **state)
{
    unit_random_t random = {1};
    for (int n = 2; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        const bslam_factor_t factor = random_factor(&random, body, tail);
        const dense_t p = covariance_of_factor(&factor);
        for (int i = 0; i < p.rows; i++) {
            for (int j = 0; j < p.rows; j++) {
                const int a = covariance_place(&factor, i), b = covariance_place(&factor, j);
                assert_near(bslam_factor_get(&factor, a, b), p.at[i][j], TOLERANCE);
            }
        }
    }
}

static void test_factor_add_row_is_the_sandwich(void **state)
{
    unit_random_t random = {2};
    for (int n = 2; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        for (int i = 1; i < body + tail; i++) {
            for (int k = 0; k < i; k++) {
                bslam_factor_t factor = random_factor(&random, body, tail);
                const dense_t p = covariance_of_factor(&factor);
                dense_t a = dense_identity(p.rows);
                a.at[i][k] = 0.7;
                const dense_t expected = dense_sandwich(&a, &p);
                bslam_factor_add_row(&factor, covariance_place(&factor, i), covariance_place(&factor, k),
                                     real(0.7));
                assert_is(&factor, &expected, TOLERANCE);
            }
        }
    }
}

static void test_factor_scale_is_the_sandwich(void **state)
{
    unit_random_t random = {3};
    for (int n = 2; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        for (int i = 0; i < body + tail; i++) {
            bslam_factor_t factor = random_factor(&random, body, tail);
            const dense_t p = covariance_of_factor(&factor);
            dense_t a = dense_identity(p.rows);
            a.at[i][i] = 0.3;
            const dense_t expected = dense_sandwich(&a, &p);
            bslam_factor_scale(&factor, covariance_place(&factor, i), real(0.3));
            assert_is(&factor, &expected, TOLERANCE);
        }
    }
}

// ---- sums -------------------------------------------------------------------------------------------------

/// A share of 1 adds to columns; one of 1000 leaves little of them.
static void test_factor_add_is_the_sum(void **state)
{
    unit_random_t random = {4};
    static const double shares[] = {1e-3, 1, 1e3};
    for (int n = 2; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        for (int first = 0; first < body + tail; first++) {
            for (int k = 0; k < COUNT_OF(shares); k++) {
                bslam_factor_t factor = random_factor(&random, body, tail);
                factor.d[covariance_place(&factor, (first + 1) % (body + tail))] = 0;
                const dense_t p = covariance_of_factor(&factor);
                const dense_t vector = random_vector(&random, &factor, first, w);
                const dense_t expected = plus_square(p, shares[k], &vector);
                bslam_factor_add(&factor, covariance_place(&factor, first), real(shares[k]), w, scratch);
                assert_is(&factor, &expected, TOLERANCE * (1 + shares[k]));
            }
        }
    }
}

/// Beside what a large share adds, what was there before stays as exact as it was: here all but w's own
/// direction, in which the sum is larger by 1e12.
static void test_factor_add_much_keeps_what_is_across(void **state)
{
    unit_random_t random = {5};
    for (int n = 4; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        bslam_factor_t factor = random_factor(&random, body, tail);
        const dense_t p = covariance_of_factor(&factor);
        const dense_t vector = random_vector(&random, &factor, 0, w);
        bslam_factor_add(&factor, 0, real(1e12), w, scratch);
        covariance_assert_sound(&factor);
        // One across: u w = 0.
        dense_t u = dense_zero(1, p.rows);
        u.at[0][0] = vector.at[p.rows - 1][0];
        u.at[0][p.rows - 1] = -vector.at[0][0];
        const dense_t before = dense_sandwich(&u, &p);
        double after = 0;
        for (int j = 0; j < p.rows; j++) {
            const bslam_real_t *l = NULL;
            double f = 0;
            for (int i = 0; i < p.rows; i++) {
                l = bslam_factor_row(&factor, covariance_place(&factor, i));
                f += j <= i ? u.at[0][i] * (double)l[4 * covariance_place(&factor, j)] : 0;
            }
            after += (double)factor.d[covariance_place(&factor, j)] * f * f;
        }
        // f of the first column is a difference of numbers that are rounded: squared, times 1e12.
        assert_near(after, before.at[0][0],
                    1e-3 * before.at[0][0] + 1e12 * 4 * UNIT_ROUNDING * UNIT_ROUNDING);
    }
}

static void test_factor_add_nothing_changes_nothing(void **state)
{
    static const double shares[] = {0, -1, NAN};
    unit_random_t random = {6};
    for (int k = 0; k < COUNT_OF(shares); k++) {
        bslam_factor_t factor = random_factor(&random, 5, 3);
        const bslam_factor_t before = factor;
        (void)random_vector(&random, &factor, 0, w);
        bslam_factor_add(&factor, 0, real(shares[k]), w, scratch);
        assert_memory_equal(&factor, &before, sizeof factor);
    }
}

/// Variances so small that a quotient by them would not be finite are none.
static void test_factor_add_next_to_nothing_to_nothing_stays_finite(void **state)
{
    for (double tiny = 1e-37; tiny < 1e-22; tiny *= 10) {
        bslam_factor_t factor;
        bslam_factor_begin(&factor, 3, 2);
        memset(w, 0, sizeof w);
        w[0] = 1;
        w[1] = real(1e3);
        w[4] = real(-1e3);
        bslam_factor_add(&factor, 0, real(tiny), w, scratch);
        covariance_assert_sound(&factor);
        assert_near(bslam_factor_get(&factor, 1, 1), 1e6 * tiny, 1e6 * tiny * TOLERANCE + 2e-24);
    }
}

static void test_factor_forget_leaves_the_others_as_they_were(void **state)
{
    unit_random_t random = {7};
    for (int n = 2; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        for (int k = 0; k < body + tail; k++) {
            bslam_factor_t factor = random_factor(&random, body, tail);
            dense_t expected = covariance_of_factor(&factor);
            for (int i = 0; i < expected.rows; i++) {
                expected.at[i][k] = expected.at[k][i] = i == k ? 0.125 : 0;
            }
            bslam_factor_forget(&factor, covariance_place(&factor, k), real(0.125), w, scratch);
            assert_is(&factor, &expected, TOLERANCE);
        }
    }
}

// ---- a body that grows and shrinks ------------------------------------------------------------------------

static void test_factor_remove_leaves_the_others_as_they_were(void **state)
{
    unit_random_t random = {8};
    for (int n = 2; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        for (int count = 1; count <= 4; count++) {
            for (int first = 0; first + count <= body; first++) {
                bslam_factor_t factor = random_factor(&random, body, tail);
                const dense_t p = covariance_of_factor(&factor);
                const dense_t expected = dense_without(&p, first, count);
                bslam_factor_remove(&factor, first, count, w, scratch);
                assert_int_equal(factor.body_count, body - count);
                assert_is(&factor, &expected, TOLERANCE);
            }
        }
    }
}

static void test_factor_cut_leaves_the_others_as_they_were(void **state)
{
    unit_random_t random = {9};
    for (int n = 2; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        for (int first = 0; first <= body; first++) {
            bslam_factor_t factor = random_factor(&random, body, tail);
            const dense_t p = covariance_of_factor(&factor);
            const dense_t expected = first < body ? dense_without(&p, first, body - first) : p;
            bslam_factor_cut(&factor, first);
            assert_int_equal(factor.body_count, first);
            assert_is(&factor, &expected, TOLERANCE);
        }
    }
}

/// A tail without variance has nothing to be divided by.
static void test_factor_cut_of_an_exact_tail_is_exact(void **state)
{
    bslam_factor_t factor;
    bslam_factor_begin(&factor, 4, 3);
    const dense_t none = dense_zero(4, 4);
    bslam_factor_cut(&factor, 1);
    assert_is(&factor, &none, 0);
}

/// With a variance that was, and with what stood where they come to stand.
static void test_factor_widen_after_removal_adds_exact_values(void **state)
{
    unit_random_t random = {10};
    for (int n = 8; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        for (int count = 1; count <= 5; count++) {
            bslam_factor_t factor = random_factor(&random, body, tail);
            bslam_factor_remove(&factor, 1, 3, w, scratch);
            const dense_t p = covariance_of_factor(&factor);
            const int left = body - 3;
            dense_t expected = dense_zero(p.rows + count, p.rows + count);
            for (int i = 0; i < p.rows; i++) {
                for (int j = 0; j < p.rows; j++) {
                    expected.at[i < left ? i : i + count][j < left ? j : j + count] = p.at[i][j];
                }
            }
            bslam_factor_widen(&factor, count);
            assert_int_equal(factor.body_count, left + count);
            assert_is(&factor, &expected, TOLERANCE);
        }
    }
}

/// New values are rows over the old ones and noises; P <- [A; B] diag(P, noises) [A; B]ᵀ, in the factor's
/// order.
static void assert_append(unit_random_t *random, int body, int tail, int count, int noise_count)
{
    bslam_factor_t factor = random_factor(random, body, tail);
    const int old = body + tail, all = old + noise_count;
    const dense_t p = covariance_of_factor(&factor);
    static bslam_real_t rows[BSLAM_FACTOR_GROWTH_MAX][BSLAM_FACTOR_PLACES_MAX];
    bslam_growth_t growth = {.count = count, .noise_count = noise_count};
    dense_t a = dense_zero(old + count, all), of_all = dense_zero(all, all);
    for (int i = 0; i < old; i++) {
        a.at[i < body ? i : i + count][i] = 1;
        memcpy(of_all.at[i], p.at[i], (size_t)old * sizeof p.at[i][0]);
    }
    for (int r = 0; r < count; r++) {
        const int here = body + r;
        bslam_real_t by_value[BSLAM_FACTOR_PLACES_MAX];
        const dense_t by = random_vector(random, &factor, 0, by_value);
        for (int j = 0; j < old; j++) {
            a.at[here][j] = by.at[j][0];
        }
        memset(rows[r], 0, sizeof rows[r]);
        for (int i = 0; i < bslam_factor_places(&factor); i++) {  // rowᵀ L
            for (int j = 0; by_value[i] != 0 && j <= i; j++) {
                rows[r][j] += by_value[i] * bslam_factor_row(&factor, i)[4 * j];
            }
        }
        growth.rows[r] = rows[r];
        for (int c = 0; c < noise_count; c++) {
            growth.by_noise[r][c] = real(unit_random(random, -1, 1));
            a.at[here][old + c] = (double)growth.by_noise[r][c];
        }
    }
    for (int c = 0; c < noise_count; c++) {
        growth.noise_var[c] = real(unit_random(random, 0.1, 1));
        of_all.at[old + c][old + c] = (double)growth.noise_var[c];
    }
    const dense_t expected = dense_sandwich(&a, &of_all);
    bslam_factor_append(&factor, &growth);
    assert_int_equal(factor.body_count, body + count);
    assert_is(&factor, &expected, 4 * TOLERANCE);
}

static void test_factor_append_is_the_textbooks(void **state)
{
    unit_random_t random = {11};
    for (int n = 2; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        for (int count = 1; count <= BSLAM_FACTOR_GROWTH_MAX; count++) {
            for (int noises = 0; noises <= 3; noises++) {
                assert_append(&random, body, tail, count, noises);
            }
        }
    }
}

// ---- scalar measurements ----------------------------------------------------------------------------------

enum { SCALARS_MOST = 4 };

/// Scalars that are to be measured, each with what the textbook says of it when those before it are taken.
typedef struct scalars {
    dense_t h[SCALARS_MOST];  ///< rows
    bslam_real_t v[SCALARS_MOST][BSLAM_FACTOR_PLACES_MAX], lambda[SCALARS_MOST][BSLAM_FACTOR_PLACES_MAX];
    bslam_waiting_t waiting[SCALARS_MOST];
} scalars_t;

/// lambda <- Lᵀ h
static void look(const bslam_factor_t *factor, const dense_t *h, bslam_real_t *lambda)
{
    memset(lambda, 0, sizeof w);
    for (int i = 0; i < h->columns; i++) {
        const int place = covariance_place(factor, i);
        for (int j = 0; j <= place; j++) {
            lambda[j] += real(h->at[0][i]) * bslam_factor_row(factor, place)[4 * j];
        }
    }
}

/// P <- P - P hᵀ h P / s, and *change += gain P hᵀ. Returns P hᵀ by the old P.
static dense_t measure(dense_t *p, const dense_t *h, double variance, double gain, dense_t *change)
{
    const dense_t across = dense_transposed(h), column = dense_product(p, &across);
    const dense_t predicted = dense_product(h, &column);
    const double s = predicted.at[0][0] + variance;
    for (int i = 0; i < p->rows; i++) {
        change->at[i][0] += gain * column.at[i][0];
    }
    *p = plus_square(*p, -1 / s, &column);
    return column;
}

static void assert_measured(unit_random_t *random, bslam_factor_t factor, int count, double variance)
{
    static scalars_t scalars;
    dense_t p = covariance_of_factor(&factor), change = dense_zero(p.rows, 1);
    bslam_real_t d[BSLAM_FACTOR_PLACES_MAX], changed[BSLAM_FACTOR_PLACES_MAX];
    const int places = bslam_factor_places(&factor);
    memcpy(d, factor.d, sizeof d);
    for (int k = 0; k < count; k++) {
        const dense_t across = random_vector(random, &factor, 0, w);
        scalars.h[k] = dense_transposed(&across);
        scalars.waiting[k] =
            (bslam_waiting_t){scalars.v[k], scalars.lambda[k], real(unit_random(random, -1, 1))};
        look(&factor, &scalars.h[k], scalars.lambda[k]);
        dense_t before = covariance_of_factor(&factor), unused = dense_zero(p.rows, 1);
        for (int b = 0; b < k; b++) {
            const dense_t column = measure(&before, &scalars.h[b], variance, 0, &unused);
            const dense_t expected = dense_product(&scalars.h[k], &column);
            const bslam_real_t met = bslam_factor_carry(&scalars.waiting[b], places, scalars.lambda[k]);
            assert_near(met, expected.at[0][0], 10 * TOLERANCE);
        }
        (void)measure(&p, &scalars.h[k], variance, (double)scalars.waiting[k].gain, &change);
        bslam_factor_measure(&scalars.waiting[k], places, real(variance), d);
    }
    memcpy(factor.d, d, sizeof d);
    for (int i = 0; i < places; i++) {
        changed[i] = 2;
    }
    bslam_factor_settle(&factor, scalars.waiting, count, changed);
    assert_is(&factor, &p, 10 * TOLERANCE);
    for (int i = 0; i < p.rows; i++) {
        assert_near(changed[covariance_place(&factor, i)], 2 + change.at[i][0], 10 * TOLERANCE);
    }
}

static void test_factor_measure_is_the_textbooks(void **state)
{
    unit_random_t random = {12};
    for (int n = 2; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        for (int count = 1; count <= SCALARS_MOST; count++) {
            assert_measured(&random, random_factor(&random, body, tail), count, 0.5);
        }
    }
}

static void test_factor_measure_where_values_are_exact_is_the_textbooks(void **state)
{
    unit_random_t random = {13};
    for (int n = 4; n < SIZES; n++) {
        const int body = body_of(n), tail = tail_of(n);
        for (int exact = 0; exact < body + tail; exact++) {
            bslam_factor_t factor = random_factor(&random, body, tail);
            factor.d[covariance_place(&factor, exact)] = 0;
            assert_measured(&random, factor, 1 + exact % SCALARS_MOST, 0.5);
        }
    }
}

/// D falls by as much as there is, however precise the measurement is.
static void test_factor_measure_ever_more_precisely_leaves_a_covariance(void **state)
{
    unit_random_t random = {14};
    for (double variance = 1; variance > 1e-30; variance /= 100) {
        static scalars_t scalars;
        bslam_factor_t factor = random_factor(&random, 5, 3);
        const dense_t p = covariance_of_factor(&factor);
        const dense_t across = random_vector(&random, &factor, 0, w);
        const dense_t h = dense_transposed(&across), hph = dense_sandwich(&h, &p);
        bslam_real_t unused[BSLAM_FACTOR_PLACES_MAX] = {0};
        scalars.waiting[0] = (bslam_waiting_t){scalars.v[0], scalars.lambda[0], 1};
        look(&factor, &h, scalars.lambda[0]);
        double product = 1, expected = variance / (hph.at[0][0] + variance);
        for (int i = 0; i < p.rows; i++) {
            expected *= (double)factor.d[covariance_place(&factor, i)];
        }
        bslam_factor_measure(&scalars.waiting[0], bslam_factor_places(&factor), real(variance), factor.d);
        bslam_factor_settle(&factor, scalars.waiting, 1, unused);
        covariance_assert_sound(&factor);
        for (int i = 0; i < p.rows; i++) {
            product *= (double)factor.d[covariance_place(&factor, i)];
        }
        assert_near(product, expected, 100 * TOLERANCE * expected);  // determinants
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_factor_begin_has_values_without_variance),
        cmocka_unit_test(test_factor_get_is_the_product),
        cmocka_unit_test(test_factor_add_row_is_the_sandwich),
        cmocka_unit_test(test_factor_scale_is_the_sandwich),
        cmocka_unit_test(test_factor_add_is_the_sum),
        cmocka_unit_test(test_factor_add_much_keeps_what_is_across),
        cmocka_unit_test(test_factor_add_nothing_changes_nothing),
        cmocka_unit_test(test_factor_add_next_to_nothing_to_nothing_stays_finite),
        cmocka_unit_test(test_factor_forget_leaves_the_others_as_they_were),
        cmocka_unit_test(test_factor_remove_leaves_the_others_as_they_were),
        cmocka_unit_test(test_factor_cut_leaves_the_others_as_they_were),
        cmocka_unit_test(test_factor_cut_of_an_exact_tail_is_exact),
        cmocka_unit_test(test_factor_widen_after_removal_adds_exact_values),
        cmocka_unit_test(test_factor_append_is_the_textbooks),
        cmocka_unit_test(test_factor_measure_is_the_textbooks),
        cmocka_unit_test(test_factor_measure_where_values_are_exact_is_the_textbooks),
        cmocka_unit_test(test_factor_measure_ever_more_precisely_leaves_a_covariance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
