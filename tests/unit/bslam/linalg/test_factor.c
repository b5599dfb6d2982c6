#include "covariance.h"
#include "support.h"

#include <math.h>

/// A hundred roundings, and the number of terms that a small factor sums.
#define TOLERANCE (200 * UNIT_ROUNDING)

enum { BODY_MAX = 13 };

/// A factor, and what it stands for: the operation is done to both.
static bslam_factor_t factor;
static dense_t p;
/// The deviation of each value before and after it, whichever is larger: what rounding goes by.
static double sd[DENSE_MAX];

static bslam_real_t w[BSLAM_FACTOR_PLACES_MAX];
static bslam_real_t scratch[2][BSLAM_FACTOR_PLACES_MAX];

static void note_deviations(int from, int to, int count)
{
    for (int k = 0; k < count; k++) {
        sd[to + k] = fmax(sd[to + k], sqrt(fmax(0, p.at[from + k][from + k])));
    }
}

static void begin_operation(void)
{
    p = covariance_of_factor(&factor);
    memset(sd, 0, sizeof sd);
    note_deviations(0, 0, p.rows);
}

/// The factor stands for p now, and is one.
static void assert_done(double tolerance)
{
    const dense_t now = covariance_of_factor(&factor);
    assert_int_equal(now.rows, p.rows);
    note_deviations(0, 0, p.rows);
    for (int i = 0; i < p.rows; i++) {
        for (int j = 0; j <= i; j++) {
            assert_near(now.at[i][j], p.at[i][j], tolerance * sd[i] * sd[j]);
        }
    }
    covariance_assert_sound(&factor);
}

/// B Bᵀ, with deviations from 0.01 to 100.
static dense_t random_covariance(unit_random_t *random, int n)
{
    dense_t b = dense_zero(n, n + 2);
    for (int i = 0; i < n; i++) {
        const double scale = pow(10, unit_random(random, -2, 2));
        for (int k = 0; k < n + 2; k++) {
            b.at[i][k] = scale * unit_random(random, -1, 1);
        }
    }
    const dense_t identity = dense_identity(n + 2);
    return dense_sandwich(&b, &identity);
}

/// Factors of each size: of full rank; of half of it; of values that are all known.
enum { KINDS = 3 };

static void make_factor(unit_random_t *random, int body, int tail, int kind)
{
    const int n = body + tail;
    const dense_t start = random_covariance(random, n);
    memset(&factor, 0, sizeof factor);
    if (kind == 2) {
        bslam_factor_begin(&factor, body, tail);
    } else {
        covariance_factor(&start, tail, &factor);
    }
    for (int i = 0; kind == 1 && i < n; i++) {
        factor.d[covariance_place(&factor, i)] *= unit_random(random, 0, 1) < 0.5 ? 0 : 1;
    }
    begin_operation();
}

/// Calls `check` with a factor of every kind and size, and with every value.
static void for_every_value(uint64_t seed, void (*check)(unit_random_t *random, int value))
{
    unit_random_t random = {seed};
    for (int tail = 2; tail <= BSLAM_FACTOR_TAIL_MAX; tail++) {
        for (int body = 1; body <= BODY_MAX; body++) {
            for (int value = 0; value < (body + tail) * KINDS; value++) {
                make_factor(&random, body, tail, value % KINDS);
                check(&random, value / KINDS);
            }
        }
    }
}

static int place(int value)
{
    return covariance_place(&factor, value);
}

/// P <- A P Aᵀ.
static void transform(const dense_t *a)
{
    p = dense_sandwich(a, &p);
}

// ---- layout -----------------------------------------------------------------------------------------------

static void test_layout_every_element_has_its_own_place_within_its_array(void **state)
{
    for (int tail = 2; tail <= BSLAM_FACTOR_TAIL_MAX; tail++) {
        for (int body = 1; body <= BSLAM_FACTOR_BODY_MAX; body++) {
            static bool body_taken[COUNT_OF(factor.body)], tail_taken[COUNT_OF(factor.tail)];
            memset(body_taken, 0, sizeof body_taken);
            memset(tail_taken, 0, sizeof tail_taken);
            factor.body_count = body;
            factor.tail_count = tail;
            assert_true(bslam_factor_places(&factor) <= BSLAM_FACTOR_PLACES_MAX);
            for (int i = 0; i < body + tail; i++) {
                for (int j = 0; j <= i; j++) {
                    const bslam_real_t *at = bslam_factor_element(&factor, place(i), place(j));
                    assert_ptr_equal(at, bslam_factor_row(&factor, place(i)) + 4 * place(j));
                    bool *taken = i < body ? &body_taken[at - factor.body] : &tail_taken[at - factor.tail];
                    assert_false(*taken);
                    *taken = true;
                }
            }
        }
    }
}

static void test_begin_has_no_variance_whatever_was_there(void **state)
{
    for (int tail = 2; tail <= BSLAM_FACTOR_TAIL_MAX; tail++) {
        for (int body = 1; body <= BODY_MAX; body++) {
            memset(&factor, 0xff, sizeof factor);
            bslam_factor_begin(&factor, body, tail);
            begin_operation();
            p = dense_zero(body + tail, body + tail);
            assert_done(0);
        }
    }
}

static void check_get(unit_random_t *random, int value)
{
    for (int j = 0; j < p.rows; j++) {
        const bslam_real_t got = bslam_factor_get(&factor, place(value), place(j));
        assert_near(got, p.at[value][j], TOLERANCE * sd[value] * sd[j]);
        assert_true(got == bslam_factor_get(&factor, place(j), place(value)));
    }
}

static void test_get_is_the_product_from_both_sides(void **state)
{
    for_every_value(1, check_get);
}

// ---- rows -------------------------------------------------------------------------------------------------

static void check_add_row(unit_random_t *random, int value)
{
    for (int k = 0; k < value; k++) {
        const bslam_real_t share = real(unit_random(random, -3, 3));
        dense_t a = dense_identity(p.rows);
        a.at[value][k] = (double)share;
        begin_operation();
        transform(&a);
        bslam_factor_add_row(&factor, place(value), place(k), share);
        sd[value] += fabs((double)share) * sd[k];
        assert_done(TOLERANCE);
    }
}

static void test_add_row_adds_a_share_of_any_value_before(void **state)
{
    for_every_value(2, check_add_row);
}

static void check_scale(unit_random_t *random, int value)
{
    const bslam_real_t by = real(pow(10, unit_random(random, -2, 2)));
    dense_t a = dense_identity(p.rows);
    a.at[value][value] = (double)by;
    transform(&a);
    bslam_factor_scale(&factor, place(value), by);
    assert_done(TOLERANCE);
}

static void test_scale_multiplies_any_value(void **state)
{
    for_every_value(3, check_scale);
}

// ---- sums -------------------------------------------------------------------------------------------------

static void add_both(unit_random_t *random, int first, double share)
{
    memset(w, 0, sizeof w);
    for (int i = first; i < p.rows; i++) {
        w[place(i)] = real(unit_random(random, -1, 1) * (sd[i] > 0 ? sd[i] : 1));
    }
    for (int i = first; i < p.rows; i++) {
        for (int j = first; j < p.rows; j++) {
            p.at[i][j] += (double)real(share) * (double)w[place(i)] * (double)w[place(j)];
        }
    }
    bslam_factor_add(&factor, place(first), real(share), w, scratch);
}

static void check_add(unit_random_t *random, int first)
{
    static const double shares[] = {1e-12, 1e-3, 1, 10, 1e6};
    const bslam_factor_t start = factor;
    for (int i = 0; i < COUNT_OF(shares); i++) {
        factor = start;
        begin_operation();
        add_both(random, first, shares[i]);
        assert_done(TOLERANCE);
    }
}

static void test_add_of_little_or_much_is_the_sum(void **state)
{
    for_every_value(4, check_add);
}

static void check_add_nothing(unit_random_t *random, int first)
{
    const bslam_factor_t before = factor;
    add_both(random, first, 0);
    assert_memory_equal(&factor, &before, sizeof before);
    memset(w, 0, sizeof w);
    bslam_factor_add(&factor, place(first), 1, w, scratch);
    assert_memory_equal(&factor, &before, sizeof before);
}

static void test_add_of_nothing_changes_no_bit(void **state)
{
    for_every_value(5, check_add_nothing);
}

/// A value that is known but for a millionth of what is added to it, and others that went with it.
static void test_add_of_much_to_what_is_known_keeps_what_is_beside(void **state)
{
    unit_random_t random = {6};
    for (int round = 0; round < 200; round++) {
        make_factor(&random, 6, 2, 0);
        for (int k = 0; k < 3; k++) {
            factor.d[k] *= real(pow(10, unit_random(&random, -12, -2)));
        }
        begin_operation();
        // Only of the first ones: what the others have of these goes, and the rest of them stays.
        memset(w, 0, sizeof w);
        for (int i = 0; i < 3; i++) {
            w[i] = real(unit_random(&random, -10, 10));
            for (int j = 0; j <= i; j++) {
                p.at[i][j] += (double)w[i] * (double)w[j];
                p.at[j][i] = p.at[i][j];
            }
        }
        bslam_factor_add(&factor, 0, 1, w, scratch);
        assert_done(TOLERANCE);
    }
}

// ---- values that come and go ------------------------------------------------------------------------------

/// Row and column `value` become 0 but for a variance.
static void forget_in(dense_t *m, int value, double variance)
{
    for (int i = 0; i < m->rows; i++) {
        m->at[i][value] = m->at[value][i] = i == value ? variance : 0;
    }
}

static void check_forget(unit_random_t *random, int value)
{
    const bslam_real_t variance = value % 3 == 0 ? 0 : real(unit_random(random, 0, 4));
    forget_in(&p, value, (double)variance);
    bslam_factor_forget(&factor, place(value), variance, w, scratch);
    assert_done(TOLERANCE);
    for (int i = 0; i < p.rows; i++) {
        if (i != value) {
            assert_true(bslam_factor_get(&factor, place(i), place(value)) == 0);
        }
    }
    assert_true(bslam_factor_get(&factor, place(value), place(value)) == variance);
}

static void test_forget_leaves_any_value_with_no_other_one(void **state)
{
    for_every_value(7, check_forget);
}

/// The operation took values first to first + count - 1 out.
static void assert_without(int first, int count)
{
    const int behind = p.rows - first - count;
    p = dense_without(&p, first, count);
    memmove(&sd[first], &sd[first + count], (size_t)behind * sizeof sd[0]);
    assert_done(TOLERANCE);
}

static void check_remove(unit_random_t *random, int first)
{
    const bslam_factor_t start = factor;
    for (int count = 1; first + count <= start.body_count; count++) {
        factor = start;
        begin_operation();
        bslam_factor_remove(&factor, first, count, w, scratch);
        assert_int_equal(factor.body_count, start.body_count - count);
        assert_without(first, count);
    }
}

static void test_remove_of_any_stretch_leaves_the_others(void **state)
{
    for_every_value(8, check_remove);
}

static void check_cut(unit_random_t *random, int first)
{
    if (first <= factor.body_count) {
        const int count = factor.body_count - first;
        bslam_factor_cut(&factor, first);
        assert_int_equal(factor.body_count, first);
        assert_without(first, count);
    }
}

static void test_cut_leaves_what_is_before_and_the_tail(void **state)
{
    for_every_value(9, check_cut);
}

/// The operation put `count` values at the body's end: `grown` has them behind the tail.
static void assert_with(const dense_t *grown, int body, int count)
{
    const int n = grown->rows - count;
    dense_t order = dense_zero(grown->rows, grown->rows);
    for (int i = 0; i < grown->rows; i++) {
        order.at[i][i < body ? i : i < body + count ? n + i - body : i - count] = 1;
    }
    p = dense_sandwich(&order, grown);
    memset(&sd[body], 0, (size_t)(grown->rows - body) * sizeof sd[0]);
    assert_int_equal(factor.body_count, body + count);
    assert_done(TOLERANCE);
}

static void check_widen(unit_random_t *random, int count)
{
    const int body = factor.body_count;
    dense_t grown = dense_zero(p.rows + count, p.rows + count);
    for (int i = 0; i < p.rows; i++) {
        memcpy(grown.at[i], p.at[i], (size_t)p.rows * sizeof grown.at[i][0]);
    }
    bslam_factor_widen(&factor, count);
    assert_with(&grown, body, count);
}

static void test_widen_puts_values_without_variance_at_the_bodys_end(void **state)
{
    for_every_value(10, check_widen);
}

/// New values made of all that there are, or of none, and of noises.
static void check_append(unit_random_t *random, int kind)
{
    static bslam_real_t rows[BSLAM_FACTOR_GROWTH_MAX][BSLAM_FACTOR_PLACES_MAX];
    const int n = p.rows, body = factor.body_count, noises = kind % (BSLAM_FACTOR_GROWTH_MAX + 1);
    bslam_growth_t growth = {.count = 1 + kind % BSLAM_FACTOR_GROWTH_MAX, .noise_count = noises};
    dense_t a = dense_zero(n + growth.count, n + noises), joint = dense_zero(n + noises, n + noises);
    memset(rows, 0, sizeof rows);
    for (int i = 0; i < n; i++) {
        a.at[i][i] = 1;
        memcpy(joint.at[i], p.at[i], (size_t)n * sizeof joint.at[i][0]);
    }
    for (int k = 0; k < noises; k++) {
        growth.noise_var[k] = real(unit_random(random, 0, 2));
        joint.at[n + k][n + k] = (double)growth.noise_var[k];
    }
    for (int r = 0; r < growth.count; r++) {
        growth.rows[r] = rows[r];
        for (int k = 0; k < noises; k++) {
            growth.by_noise[r][k] = real(unit_random(random, -1, 1));
            a.at[n + r][n + k] = (double)growth.by_noise[r][k];
        }
        for (int i = kind % 5 == 4 ? n : 0; i < n; i++) {
            const bslam_real_t by = real(unit_random(random, -1, 1));
            a.at[n + r][i] = (double)by;
            for (int j = 0; j <= i; j++) {
                rows[r][place(j)] += by * *bslam_factor_element(&factor, place(i), place(j));
            }
        }
    }
    const dense_t grown = dense_sandwich(&a, &joint);
    bslam_factor_append(&factor, &growth);
    assert_with(&grown, body, growth.count);
}

static void test_append_puts_values_made_of_others_and_of_noises_at_the_bodys_end(void **state)
{
    for_every_value(11, check_append);
}

/// A copy of a value, as a ray's origin is of the robot's place: both go on as one.
static void test_append_of_a_copy_is_singular_and_goes_on(void **state)
{
    unit_random_t random = {12};
    for (int body = 1; body <= BODY_MAX; body++) {
        make_factor(&random, body, 2, 0);
        bslam_real_t row[BSLAM_FACTOR_PLACES_MAX] = {0};
        for (int j = 0; j <= body; j++) {
            row[place(j)] = *bslam_factor_element(&factor, place(body), place(j));
        }
        const bslam_growth_t growth = {.count = 1, .rows = {row}};
        bslam_factor_append(&factor, &growth);
        const int copy = place(body), of = place(body + 1);
        const double var = (double)bslam_factor_get(&factor, of, of);
        assert_near(bslam_factor_get(&factor, copy, copy), var, TOLERANCE * var);
        assert_near(bslam_factor_get(&factor, copy, of), var, TOLERANCE * var);
        covariance_assert_sound(&factor);
        begin_operation();
        bslam_factor_remove(&factor, 0, 1, w, scratch);
        assert_without(0, 1);
        assert_near(bslam_factor_get(&factor, place(body - 1), place(body)), var, TOLERANCE * var);
    }
}

// ---- measurements -----------------------------------------------------------------------------------------

enum { WAITING_MAX = 4 };

static bslam_real_t v[WAITING_MAX][BSLAM_FACTOR_PLACES_MAX], lambda[WAITING_MAX][BSLAM_FACTOR_PLACES_MAX];
static bslam_real_t d[BSLAM_FACTOR_PLACES_MAX], change[BSLAM_FACTOR_PLACES_MAX];
static bslam_waiting_t waiting[WAITING_MAX];

/// f = Lᵀ h.
static void look(const dense_t *h, bslam_real_t f[BSLAM_FACTOR_PLACES_MAX])
{
    memset(f, 0, BSLAM_FACTOR_PLACES_MAX * sizeof f[0]);
    for (int i = 0; i < h->columns; i++) {
        for (int j = 0; j <= i; j++) {
            f[place(j)] += real(h->at[0][i]) * *bslam_factor_element(&factor, place(i), place(j));
        }
    }
}

/// A row that looks at all values by as much as they are in doubt, or at three of them.
static dense_t random_row(unit_random_t *random, bool is_sparse)
{
    dense_t h = dense_zero(1, p.rows);
    for (int k = 0; k < (is_sparse ? 3 : p.rows); k++) {
        const int i = is_sparse ? (int)unit_random(random, 0, p.rows) : k;
        h.at[0][i] = (double)real(unit_random(random, -1, 1) / (sd[i] > 0 ? sd[i] : 1));
    }
    return h;
}

/// a b ᵀ p a's of rows.
static double product(const dense_t *a, const dense_t *m, const dense_t *b)
{
    const dense_t bt = dense_transposed(b), mb = dense_product(m, &bt);
    return dense_product(a, &mb).at[0][0];
}

/// p, and the mean's change, after a scalar of noise `variance`: P - P hᵀ h P / S.
static void measure_dense(const dense_t *h, double variance, double innovation, double mean[DENSE_MAX])
{
    const dense_t ht = dense_transposed(h), ph = dense_product(&p, &ht);
    const double s = product(h, &p, h) + variance;
    for (int i = 0; i < p.rows; i++) {
        mean[i] += ph.at[i][0] * innovation / s;
        for (int j = 0; j < p.rows; j++) {
            p.at[i][j] -= ph.at[i][0] * ph.at[j][0] / s;
        }
    }
}

/// So many measurements in one pass; each foresees what those before it say of it.
static void measure_both(unit_random_t *random, int count, double variance)
{
    const int places = bslam_factor_places(&factor);
    dense_t rows[WAITING_MAX], met[WAITING_MAX];
    double mean[DENSE_MAX] = {0};
    memcpy(d, factor.d, sizeof d);
    memset(change, 0, sizeof change);
    for (int k = 0; k < count; k++) {
        const double noise = (double)real(variance * unit_random(random, 0.5, 2));
        rows[k] = random_row(random, k % 2 == 1);
        look(&rows[k], lambda[k]);
        bslam_real_t left = 1;  // the innovation
        for (int before = 0; before < k; before++) {
            const double expected = product(&rows[k], &met[before], &rows[before]);
            const bslam_real_t common = bslam_factor_carry(&waiting[before], places, lambda[k]);
            assert_near(common, expected, TOLERANCE * p.rows * p.rows);  // of rows that see deviations as 1
            left -= waiting[before].gain * common;
        }
        double s = noise;
        for (int j = 0; j < places; j++) {
            s += (double)(d[j] * (lambda[k][j] * lambda[k][j]));
        }
        waiting[k] = (bslam_waiting_t){v[k], lambda[k], left / real(s)};
        bslam_factor_measure(&waiting[k], places, real(noise), d);
        double already = 0;
        for (int i = 0; i < p.rows; i++) {
            already += rows[k].at[0][i] * mean[i];
        }
        met[k] = p;
        measure_dense(&rows[k], noise, 1 - already, mean);
    }
    memcpy(factor.d, d, sizeof d);
    bslam_factor_settle(&factor, waiting, count, change);
    for (int i = 0; i < p.rows; i++) {
        // Of a noise that is small the innovation is known as much less well.
        assert_near(change[place(i)], mean[i], TOLERANCE * p.rows * sd[i] * fmax(1, 1 / sqrt(variance)));
    }
}

static void check_measure(unit_random_t *random, int kind)
{
    static const double variances[] = {1e-3, 0.1, 1, 1e3};
    measure_both(random, 1 + kind % WAITING_MAX, variances[kind / WAITING_MAX % COUNT_OF(variances)]);
    assert_done(TOLERANCE * 4);
}

static void test_settle_any_number_of_measurements_is_their_update(void **state)
{
    for_every_value(13, check_measure);
}

static void test_settle_no_measurement_changes_no_bit(void **state)
{
    unit_random_t random = {14};
    make_factor(&random, 7, 3, 0);
    const bslam_factor_t before = factor;
    memset(change, 0, sizeof change);
    bslam_factor_settle(&factor, waiting, 0, change);
    assert_memory_equal(&factor, &before, sizeof before);
    for (int i = 0; i < COUNT_OF(change); i++) {
        assert_true(change[i] == 0);
    }
}

/// The change of the mean is added to what stands there.
static void test_settle_adds_its_change(void **state)
{
    unit_random_t random = {15};
    make_factor(&random, 9, 2, 0);
    const bslam_factor_t before = factor;
    measure_both(&random, 3, 1);
    bslam_real_t once[BSLAM_FACTOR_PLACES_MAX], twice[BSLAM_FACTOR_PLACES_MAX];
    memcpy(once, change, sizeof once);
    memcpy(twice, change, sizeof twice);
    factor = before;
    bslam_factor_settle(&factor, waiting, 3, twice);
    for (int i = 0; i < bslam_factor_places(&factor); i++) {
        assert_near(twice[i], 2 * once[i], TOLERANCE * fabs((double)once[i]));
    }
}

/// Two values that go together to a millionth, looked at more and more finely: what is left of D comes near 0
/// and never below.
static void test_measure_never_takes_more_than_there_is(void **state)
{
    unit_random_t random = {16};
    for (int round = 0; round < 300; round++) {
        make_factor(&random, 1 + round % 9, 2 + round % 2, round % 2);
        for (int k = 0; k < 20; k++) {
            const double before = (double)bslam_factor_get(&factor, place(0), place(0));
            const dense_t h = random_row(&random, k % 2 == 0);
            const bslam_real_t variance = real(pow(10, unit_random(&random, -16, -2)));
            look(&h, lambda[0]);
            waiting[0] = (bslam_waiting_t){v[0], lambda[0], 0};
            bslam_factor_measure(&waiting[0], bslam_factor_places(&factor), variance, factor.d);
            bslam_factor_settle(&factor, waiting, 1, change);
            covariance_assert_sound(&factor);
            assert_true((double)bslam_factor_get(&factor, place(0), place(0)) <= before * (1 + TOLERANCE));
        }
    }
}

// ---- all of them in a row ---------------------------------------------------------------------------------

/// As a filter goes: it moves, sees, and its map grows and shrinks. The dense matrix goes its own way.
static void go_on(unit_random_t *random)
{
    const int n = p.rows, body = factor.body_count;
    const int value = 1 + (int)unit_random(random, 0, n - 1), choice = (int)unit_random(random, 0, 6);
    if (choice == 0) {
        dense_t a = dense_identity(n);
        const int k = (int)unit_random(random, 0, value);
        const bslam_real_t share = real(unit_random(random, -0.3, 0.3) * sd[value] / (sd[k] + 1e-3));
        a.at[value][k] = (double)share;
        transform(&a);
        bslam_factor_add_row(&factor, place(value), place(k), share);
    } else if (choice == 1) {
        add_both(random, value, unit_random(random, 0, 0.3));
    } else if (choice == 2) {
        forget_in(&p, value, 1);
        bslam_factor_forget(&factor, place(value), 1, w, scratch);
    } else if (choice == 3 && body > 4) {
        const int first = (int)unit_random(random, 0, body - 3);
        p = dense_without(&p, first, 3);
        bslam_factor_remove(&factor, first, 3, w, scratch);
    } else if (choice == 4 && body < 20) {
        dense_t grown = dense_zero(n + 2, n + 2);
        for (int i = 0; i < n + 2; i++) {
            const int from = i < body ? i : i < body + 2 ? -1 : i - 2;
            for (int j = 0; j < n + 2; j++) {
                const int to = j < body ? j : j < body + 2 ? -1 : j - 2;
                grown.at[i][j] = from >= 0 && to >= 0 ? p.at[from][to] : i == j;
            }
        }
        p = grown;
        bslam_factor_widen(&factor, 2);
        factor.d[body] = factor.d[body + 1] = 1;
    } else if (choice == 5) {
        measure_both(random, 1 + value % WAITING_MAX, 0.5);
    }
}

static void test_any_row_of_operations_is_that_of_the_dense_matrix(void **state)
{
    unit_random_t random = {17};
    for (int round = 0; round < 20; round++) {
        make_factor(&random, 1 + round, 2 + round % 2, 0);
        for (int step = 0; step < 150; step++) {
            go_on(&random);
            memset(sd, 0, sizeof sd);
            assert_done(TOLERANCE * 100);
        }
    }
}

/// Numbers from a hundred millionth to a hundred million, without any order: no D below 0, and none that is
/// no number.
static void test_absurd_numbers_leave_a_covariance(void **state)
{
    unit_random_t random = {18};
    for (int round = 0; round < 300; round++) {
        make_factor(&random, 1 + round % BODY_MAX, 2 + round % 2, round % KINDS);
        for (int step = 0; step < 60; step++) {
            const int n = factor.body_count + factor.tail_count, value = (int)unit_random(&random, 1, n);
            const bslam_real_t much = real(pow(10, unit_random(&random, -8, 8)));
            begin_operation();
            if (step % 3 == 0) {
                memset(w, 0, sizeof w);
                for (int i = value; i < n; i++) {
                    w[place(i)] = real(unit_random(&random, -1, 1) * pow(10, unit_random(&random, -4, 4)));
                }
                bslam_factor_add(&factor, place(value), much, w, scratch);
            } else if (step % 3 == 1) {
                dense_t h = random_row(&random, true);
                h.at[0][value] = unit_random(&random, -1, 1) * pow(10, unit_random(&random, -4, 4));
                look(&h, lambda[0]);
                waiting[0] = (bslam_waiting_t){v[0], lambda[0], 0};
                bslam_factor_measure(&waiting[0], bslam_factor_places(&factor), much, factor.d);
                bslam_factor_settle(&factor, waiting, 1, change);
            } else {
                bslam_factor_forget(&factor, place(value), much, w, scratch);
            }
            covariance_assert_sound(&factor);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layout_every_element_has_its_own_place_within_its_array),
        cmocka_unit_test(test_begin_has_no_variance_whatever_was_there),
        cmocka_unit_test(test_get_is_the_product_from_both_sides),

        cmocka_unit_test(test_add_row_adds_a_share_of_any_value_before),
        cmocka_unit_test(test_scale_multiplies_any_value),

        cmocka_unit_test(test_add_of_little_or_much_is_the_sum),
        cmocka_unit_test(test_add_of_nothing_changes_no_bit),
        cmocka_unit_test(test_add_of_much_to_what_is_known_keeps_what_is_beside),

        cmocka_unit_test(test_forget_leaves_any_value_with_no_other_one),
        cmocka_unit_test(test_remove_of_any_stretch_leaves_the_others),
        cmocka_unit_test(test_cut_leaves_what_is_before_and_the_tail),
        cmocka_unit_test(test_widen_puts_values_without_variance_at_the_bodys_end),
        cmocka_unit_test(test_append_puts_values_made_of_others_and_of_noises_at_the_bodys_end),
        cmocka_unit_test(test_append_of_a_copy_is_singular_and_goes_on),

        cmocka_unit_test(test_settle_any_number_of_measurements_is_their_update),
        cmocka_unit_test(test_settle_no_measurement_changes_no_bit),
        cmocka_unit_test(test_settle_adds_its_change),
        cmocka_unit_test(test_measure_never_takes_more_than_there_is),

        cmocka_unit_test(test_any_row_of_operations_is_that_of_the_dense_matrix),
        cmocka_unit_test(test_absurd_numbers_leave_a_covariance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
