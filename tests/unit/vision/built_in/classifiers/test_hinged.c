#include "support.h"

#include <math.h>

#include "vision/built_in/classifiers/hinged.h"

enum { ROWS = 5, FEATURES = 7, BYTES = BSLAM_HINGED_BYTES(ROWS, FEATURES) };

/// A machine with tables of its own.
typedef struct machine {
    uint8_t knots[FEATURES];
    int8_t bytes[BYTES];
    float byte_scale[ROWS];
    float bias[ROWS];
    bslam_hinged_t view;
} machine_t;

static void fill(machine_t *m, unsigned seed)
{
    unit_random_t random = {seed};
    for (int i = 0; i < FEATURES; i++) {
        m->knots[i] = (uint8_t)unit_random(&random, 0, 256);
    }
    for (int k = 0; k < BYTES; k++) {
        m->bytes[k] = (int8_t)unit_random(&random, -127, 128);
    }
    for (int r = 0; r < ROWS; r++) {
        m->byte_scale[r] = (float)unit_random(&random, 0.0001, 0.01);
        m->bias[r] = (float)unit_random(&random, -1, 1);
    }
    m->view = (bslam_hinged_t){.rows = ROWS,
                               .features = FEATURES,
                               .knots = m->knots,
                               .bytes = m->bytes,
                               .byte_scale = m->byte_scale,
                               .bias = m->bias};
}

static void test_hinged_is_weights_times_bytes_and_what_is_above_knots(void **state)
{
    machine_t m;
    for (unsigned seed = 1; seed <= 200; seed++) {
        fill(&m, seed);
        assert_int_equal(bslam_hinged_check(&m.view, FEATURES), BSLAM_OK);
        unit_random_t random = {seed + 1000};
        uint8_t x[FEATURES];
        float values[ROWS];
        for (int i = 0; i < FEATURES; i++) {
            x[i] = (uint8_t)unit_random(&random, 0, 256);
        }
        bslam_hinged_decide(&m.view, x, values);
        for (int r = 0; r < ROWS; r++) {
            const int8_t *word = m.bytes + r / 2 * 4 * FEATURES + r % 2;
            double sum = 0;
            for (int i = 0; i < FEATURES; i++, word += 4) {
                sum += word[0] * x[i] + word[2] * fmax(x[i] - m.knots[i], 0);
            }
            assert_near(values[r], (double)m.bias[r] + (double)m.byte_scale[r] * sum, 1e-4);
        }
    }
}

static void test_hinged_largest_sum_fits(void **state)
{
    static uint8_t knots[BSLAM_HINGED_FEATURES_MAX], x[BSLAM_HINGED_FEATURES_MAX];
    static int8_t bytes[BSLAM_HINGED_BYTES(1, BSLAM_HINGED_FEATURES_MAX)];
    memset(x, 255, sizeof x);
    memset(bytes, -128, sizeof bytes);
    const float scale = 1, bias = 0;
    const bslam_hinged_t machine = {.rows = 1,
                                    .features = BSLAM_HINGED_FEATURES_MAX,
                                    .knots = knots,
                                    .bytes = bytes,
                                    .byte_scale = &scale,
                                    .bias = &bias};
    float value;
    assert_int_equal(bslam_hinged_check(&machine, BSLAM_HINGED_FEATURES_MAX), BSLAM_OK);
    bslam_hinged_decide(&machine, x, &value);
    assert_near(value, -2.0 * 255 * 128 * BSLAM_HINGED_FEATURES_MAX, 0);
}

static void test_hinged_check_refuses_counts(void **state)
{
    machine_t m;
    fill(&m, 1);
    assert_int_equal(bslam_hinged_check(&m.view, FEATURES + 1), BSLAM_E_COUNT);
    m.view.features = BSLAM_HINGED_FEATURES_MAX + 1;
    assert_int_equal(bslam_hinged_check(&m.view, BSLAM_HINGED_FEATURES_MAX + 1), BSLAM_E_COUNT);
    m.view.features = 0;
    assert_int_equal(bslam_hinged_check(&m.view, 0), BSLAM_E_COUNT);
    m.view.features = FEATURES;
    m.view.rows = 0;
    assert_int_equal(bslam_hinged_check(&m.view, FEATURES), BSLAM_E_COUNT);
    m.view.rows = 256;
    assert_int_equal(bslam_hinged_check(&m.view, FEATURES), BSLAM_E_COUNT);
}

static void test_hinged_check_refuses_missing_tables(void **state)
{
    machine_t m;
    fill(&m, 1);
    m.view.knots = NULL;
    assert_int_equal(bslam_hinged_check(&m.view, FEATURES), BSLAM_E_PARAMETER);
    fill(&m, 1);
    m.view.bytes = NULL;
    assert_int_equal(bslam_hinged_check(&m.view, FEATURES), BSLAM_E_PARAMETER);
    fill(&m, 1);
    m.view.byte_scale = NULL;
    assert_int_equal(bslam_hinged_check(&m.view, FEATURES), BSLAM_E_PARAMETER);
    fill(&m, 1);
    m.view.bias = NULL;
    assert_int_equal(bslam_hinged_check(&m.view, FEATURES), BSLAM_E_PARAMETER);
}

static void test_hinged_check_refuses_numbers(void **state)
{
    static const float bad[] = {NAN, INFINITY, -1e13f};
    machine_t m;
    for (int i = 0; i < COUNT_OF(bad); i++) {
        fill(&m, 1);
        m.byte_scale[ROWS - 1] = bad[i];
        assert_int_equal(bslam_hinged_check(&m.view, FEATURES), BSLAM_E_NOT_FINITE);
        fill(&m, 1);
        m.bias[0] = bad[i];
        assert_int_equal(bslam_hinged_check(&m.view, FEATURES), BSLAM_E_NOT_FINITE);
    }
    fill(&m, 1);
    m.byte_scale[1] = -1;
    assert_int_equal(bslam_hinged_check(&m.view, FEATURES), BSLAM_E_PARAMETER);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hinged_is_weights_times_bytes_and_what_is_above_knots),
        cmocka_unit_test(test_hinged_largest_sum_fits),
        cmocka_unit_test(test_hinged_check_refuses_counts),
        cmocka_unit_test(test_hinged_check_refuses_missing_tables),
        cmocka_unit_test(test_hinged_check_refuses_numbers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
