#include "support.h"

#include <math.h>

#include "vision/built_in/classifiers/additive.h"

enum {
    ROWS = 3,
    FEATURES = 5,
    CROSSED = 3,
    WEIGHTS = BSLAM_ADDITIVE_WEIGHTS(FEATURES, CROSSED),
    BYTES = BSLAM_ADDITIVE_BYTES(ROWS, FEATURES, CROSSED)
};

/// A machine with tables of its own.
typedef struct machine {
    float knots[FEATURES * BSLAM_KNOTS];
    uint8_t crossed[CROSSED];
    int8_t bytes[BYTES];
    float byte_scale[ROWS];
    float bias[ROWS];
    bslam_additive_t view;
} machine_t;

/// Tables of any numbers; knots rise unevenly.
static void fill(machine_t *m, unsigned seed)
{
    unit_random_t random = {seed};
    for (int i = 0; i < FEATURES; i++) {
        float at = (float)unit_random(&random, -3, 0);
        for (int k = 0; k < BSLAM_KNOTS; k++) {
            m->knots[i * BSLAM_KNOTS + k] = at;
            at += (float)unit_random(&random, 0.01, 1);
        }
    }
    for (int k = 0; k < BYTES; k++) {
        m->bytes[k] = (int8_t)unit_random(&random, -127, 128);
    }
    const uint8_t crossed[CROSSED] = {0, 2, 4};
    memcpy(m->crossed, crossed, sizeof crossed);
    for (int r = 0; r < ROWS; r++) {
        m->byte_scale[r] = (float)unit_random(&random, 0.001, 0.1);
        m->bias[r] = (float)unit_random(&random, -1, 1);
    }
    m->view = (bslam_additive_t){.rows = ROWS,
                                 .features = FEATURES,
                                 .knots = m->knots,
                                 .crossed_count = CROSSED,
                                 .crossed = m->crossed,
                                 .bytes = m->bytes,
                                 .byte_scale = m->byte_scale,
                                 .bias = m->bias};
}

/// A share of a way between knots, as the machine counts it: in whole parts.
static double whole(double share)
{
    return round(share * BSLAM_SHARE_ONE) / BSLAM_SHARE_ONE;
}

/// How much a knot counts for x: 1 there, 0 at its neighbours and beyond, in between straight; the outermost
/// ones count on outside.
static double tent(const float *knots, const int *chosen, int count, int k, double x)
{
    const double here = knots[chosen[k]];
    if ((k == 0 && x <= here) || (k == count - 1 && x >= here)) {
        return 1;
    }
    if (x < here) {
        const double before = k > 0 ? knots[chosen[k - 1]] : here;
        return x > before ? whole((x - before) / (here - before)) : 0;
    }
    const double after = k < count - 1 ? knots[chosen[k + 1]] : here;
    return x < after ? whole((after - x) / (after - here)) : 0;
}

/// The definition: weights times tents and products of tents.
static double by_definition(const machine_t *m, int row, const float *x)
{
    static const int all[BSLAM_KNOTS] = {0, 1, 2, 3, 4, 5, 6, 7, 8};
    static const int coarse[BSLAM_GRID_KNOTS] = {0, 3, 5, 8};
    const int8_t *bytes = m->bytes + row / 2 * 2 * WEIGHTS + row % 2;  // every second byte
    double sum = 0;
    for (int i = 0; i < FEATURES; i++) {
        for (int k = 0; k < BSLAM_KNOTS; k++) {
            sum += *bytes * tent(m->knots + i * BSLAM_KNOTS, all, BSLAM_KNOTS, k, (double)x[i]);
            bytes += 2;
        }
    }
    for (int a = 0; a < CROSSED; a++) {
        for (int b = a + 1; b < CROSSED; b++) {
            const int i = m->crossed[a], j = m->crossed[b];
            for (int k = 0; k < BSLAM_GRID_KNOTS; k++) {
                const double share = tent(m->knots + i * BSLAM_KNOTS, coarse, 4, k, (double)x[i]);
                for (int l = 0; l < BSLAM_GRID_KNOTS; l++) {
                    sum += *bytes * share * tent(m->knots + j * BSLAM_KNOTS, coarse, 4, l, (double)x[j]);
                    bytes += 2;
                }
            }
        }
    }
    return (double)m->bias[row] + (double)m->byte_scale[row] * sum;
}

static void test_additive_is_weights_times_tents(void **state)
{
    machine_t m;
    for (unsigned seed = 1; seed <= 200; seed++) {
        fill(&m, seed);
        assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_OK);
        unit_random_t random = {seed + 1000};
        float x[FEATURES], values[ROWS];
        for (int i = 0; i < FEATURES; i++) {
            x[i] = (float)unit_random(&random, -5, 6);
        }
        bslam_additive_place_t place;
        bslam_additive_locate(&m.view, x, &place);
        bslam_additive_decide(&m.view, &place, 0, ROWS, values);
        for (int r = 0; r < ROWS; r++) {
            assert_near(values[r], by_definition(&m, r, x), 1e-4);
        }
        for (int r = 0; r < ROWS; r++) {  // some rows alone, from the second one of a pair, too
            float some[ROWS];
            bslam_additive_decide(&m.view, &place, r, ROWS, some);
            assert_memory_equal(some, values + r, (size_t)(ROWS - r) * sizeof values[0]);
            bslam_additive_decide(&m.view, &place, r, r + 1, some);
            assert_true(some[0] == values[r]);
        }
    }
}

static void test_additive_curve_goes_through_its_knots(void **state)
{
    machine_t m;
    fill(&m, 7);
    m.view.crossed_count = 0;
    memset(m.bytes, 0, sizeof m.bytes);
    m.bytes[2 * (BSLAM_KNOTS + 4)] = 100;  // the first row's second feature
    float x[FEATURES] = {0};
    bslam_additive_place_t place;
    for (int k = 0; k < BSLAM_KNOTS; k++) {
        float value;
        x[1] = m.knots[BSLAM_KNOTS + k];
        bslam_additive_locate(&m.view, x, &place);
        bslam_additive_decide(&m.view, &place, 0, 1, &value);
        assert_near(value, (double)m.bias[0] + (k == 4 ? 100 * (double)m.byte_scale[0] : 0), 1e-5);
    }
}

static void test_additive_check_refuses(void **state)
{
    machine_t m;
    fill(&m, 1);
    assert_int_equal(bslam_additive_check(&m.view, FEATURES + 1), BSLAM_E_COUNT);
    m.view.features = BSLAM_ADDITIVE_FEATURES_MAX + 1;
    assert_int_equal(bslam_additive_check(&m.view, BSLAM_ADDITIVE_FEATURES_MAX + 1), BSLAM_E_COUNT);
    fill(&m, 1);
    m.view.rows = 0;
    assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_E_COUNT);
    fill(&m, 1);
    m.view.crossed_count = 1;
    assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_E_COUNT);
    fill(&m, 1);
    m.view.crossed_count = BSLAM_CROSSED_MAX + 1;
    assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_E_COUNT);
    fill(&m, 1);
    m.crossed[1] = FEATURES;
    assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_E_COUNT);
    const void **const tables[] = {(const void **)&m.view.knots, (const void **)&m.view.bytes,
                                   (const void **)&m.view.byte_scale, (const void **)&m.view.bias,
                                   (const void **)&m.view.crossed};
    for (int i = 0; i < COUNT_OF(tables); i++) {
        fill(&m, 1);
        *tables[i] = NULL;
        assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_E_PARAMETER);
    }
    m.view.crossed_count = 0;  // then none is needed
    assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_OK);
    fill(&m, 1);
    m.byte_scale[0] = INFINITY;
    assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_E_NOT_FINITE);
    fill(&m, 1);
    m.knots[3] = m.knots[2];
    assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_E_PARAMETER);
    fill(&m, 1);
    m.byte_scale[1] = -1;
    assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_E_PARAMETER);
    fill(&m, 1);
    m.bias[1] = NAN;
    assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_E_NOT_FINITE);
    fill(&m, 1);
    m.knots[0] = -INFINITY;
    assert_int_equal(bslam_additive_check(&m.view, FEATURES), BSLAM_E_NOT_FINITE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_additive_is_weights_times_tents),
        cmocka_unit_test(test_additive_curve_goes_through_its_knots),
        cmocka_unit_test(test_additive_check_refuses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
