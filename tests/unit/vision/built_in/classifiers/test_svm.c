#include "support.h"

#include <math.h>

#include "vision/built_in/classifiers/svm.h"

/// Rounding of the float that a machine computes in, whatever the scalar type.
#define FLOAT_ROUNDING 5.97e-8

// ---- by hand ----------------------------------------------------------------------------------------------

static void test_decide_linear_is_the_dot_product(void **state)
{
    static const float weights[] = {1, 2, -3, 0.5f, 0, 4};
    static const float bias[] = {10, -1};
    const bslam_svm_t svm = {.rows = 2, .features = 3, .weights = weights, .bias = bias};
    assert_int_equal(bslam_svm_check(&svm, 3), BSLAM_OK);
    const float x[] = {2, -1, 0.5f};
    float values[2];
    bslam_svm_decide(&svm, x, values);
    assert_near(values[0], 10 + 2 - 2 - 1.5, 0);
    assert_near(values[1], -1 + 1 + 2, 0);
}

static void test_decide_quadratic_takes_the_upper_triangle_row_by_row(void **state)
{
    // x0 x1 x2, then 00 01 02 11 12 22; every weight another power of ten, so that each place shows.
    static const float weights[] = {1, 10, 100, 1e3f, 1e4f, 1e5f, 1e6f, 1e7f, 1e8f};
    static const float bias[] = {0};
    const bslam_svm_t svm = {.rows = 1, .features = 3, .quadratic = true, .weights = weights, .bias = bias};
    assert_int_equal(bslam_svm_check(&svm, 3), BSLAM_OK);
    const float x[] = {1, 2, 3};
    const double expected = 1 + 20 + 300 + 1e3 + 2e4 + 3e5 + 4e6 + 6e7 + 9e8;
    float value;
    bslam_svm_decide(&svm, x, &value);
    assert_near(value, expected, 4 * FLOAT_ROUNDING * expected);
}

static void test_decide_bytes_are_scaled_row_by_row(void **state)
{
    static const int8_t bytes[] = {127, -127, 1, 2};
    static const float scale[] = {0.5f, 0.25f};
    static const float bias[] = {1, 2};
    const bslam_svm_t svm = {.rows = 2, .features = 2, .bytes = bytes, .byte_scale = scale, .bias = bias};
    assert_int_equal(bslam_svm_check(&svm, 2), BSLAM_OK);
    const float x[] = {3, 1};
    float values[2];
    bslam_svm_decide(&svm, x, values);
    assert_near(values[0], 1 + 0.5 * (381 - 127), 1.5 * 9 / 16383 * 0.5 * 254);
    assert_near(values[1], 2 + 0.25 * (3 + 2), 1.5 * 9 / 16383 * 0.25 * 3);
}

// ---- against the definition, in double --------------------------------------------------------------------

enum { ROWS = 3, FEATURES = 57, WEIGHTS = BSLAM_SVM_WEIGHTS(FEATURES, true) };

/// A machine with tables of its own.
typedef struct machine {
    float weights[ROWS * WEIGHTS];
    int8_t bytes[ROWS * WEIGHTS];
    float scale[ROWS];
    float bias[ROWS];
    float x[FEATURES];
} machine_t;

static void fill(machine_t *machine, unit_random_t *random)
{
    for (int i = 0; i < ROWS * WEIGHTS; i++) {
        machine->weights[i] = (float)unit_random(random, -2, 2);
        machine->bytes[i] = (int8_t)unit_random(random, -127, 127);
    }
    for (int r = 0; r < ROWS; r++) {
        machine->scale[r] = (float)unit_random(random, 0, 0.1);
        machine->bias[r] = (float)unit_random(random, -5, 5);
    }
    for (int i = 0; i < FEATURES; i++) {
        machine->x[i] = (float)unit_random(random, -3, 3);
    }
}

static bslam_svm_t view(const machine_t *machine, bool quadratic, bool as_bytes)
{
    return (bslam_svm_t){.rows = ROWS,
                         .features = FEATURES,
                         .quadratic = quadratic,
                         .weights = as_bytes ? NULL : machine->weights,
                         .bytes = as_bytes ? machine->bytes : NULL,
                         .byte_scale = as_bytes ? machine->scale : NULL,
                         .bias = machine->bias};
}

static double weight(const bslam_svm_t *svm, int row, int k)
{
    const int at = row * BSLAM_SVM_WEIGHTS(svm->features, svm->quadratic) + k;
    return svm->bytes != NULL ? (double)svm->byte_scale[row] * svm->bytes[at] : (double)svm->weights[at];
}

/// The expansion written out; returns how many values it has.
static int expand(const bslam_svm_t *svm, const float *x, double *phi)
{
    int count = 0;
    for (int i = 0; i < svm->features; i++) {
        phi[count++] = (double)x[i];
    }
    for (int i = 0; svm->quadratic && i < svm->features; i++) {
        for (int j = i; j < svm->features; j++) {
            phi[count++] = (double)x[i] * (double)x[j];
        }
    }
    return count;
}

static void assert_decides_by_definition(const bslam_svm_t *svm, const float *x)
{
    static double phi[WEIGHTS];
    float values[ROWS];
    bslam_svm_decide(svm, x, values);
    const int count = expand(svm, x, phi);
    double most = 1;
    for (int i = 0; i < svm->features; i++) {
        most = fmax(most, fabs((double)x[i]));
    }
    for (int r = 0; r < svm->rows; r++) {
        double value = (double)svm->bias[r];
        double sum = fabs(value);
        double weights = 0;
        for (int k = 0; k < count; k++) {
            value += weight(svm, r, k) * phi[k];
            sum += fabs(weight(svm, r, k) * phi[k]);
            weights += fabs(weight(svm, r, k));
        }
        // What the header promises, and three roundings for bias and scale.
        const double steps = svm->bytes != NULL ? 1.5 * most * most / 16383 * weights : 0;
        assert_near(values[r], value, (2 * svm->features + 3) * FLOAT_ROUNDING * sum + steps);
    }
}

static void test_decide_is_the_definition_for_every_kind(void **state)
{
    static machine_t machine;
    unit_random_t random = {1};
    for (int k = 0; k < 40; k++) {
        fill(&machine, &random);
        const bslam_svm_t svm = view(&machine, k % 2 == 0, k % 4 < 2);
        assert_int_equal(bslam_svm_check(&svm, FEATURES), BSLAM_OK);
        assert_decides_by_definition(&svm, machine.x);
    }
}

/// A whole number's worth of rounding, not several, so that a sign or a shift gone wrong shows: the typical
/// error of a random machine is far below the bound.
static void test_decide_bytes_are_close_to_floats(void **state)
{
    static machine_t machine;
    static double phi[WEIGHTS];
    unit_random_t random = {7};
    double square = 0;
    for (int k = 0; k < 40; k++) {
        fill(&machine, &random);
        const bslam_svm_t svm = view(&machine, true, true);
        float values[ROWS];
        bslam_svm_decide(&svm, machine.x, values);
        const int count = expand(&svm, machine.x, phi);
        double value = (double)svm.bias[0];
        double spread = 0;
        for (int i = 0; i < count; i++) {
            value += weight(&svm, 0, i) * phi[i];
            spread += weight(&svm, 0, i) * weight(&svm, 0, i);
        }
        // Roundings of independent products, uniform over one step, downwards.
        const double step = 9.0 / 16383;
        square += (values[0] - value) * (values[0] - value) / (spread * step * step);
    }
    assert_true(sqrt(square / 40) < 1);
}

static void test_decide_bytes_largest_numbers_do_not_overflow(void **state)
{
    enum { N = BSLAM_SVM_FEATURES_MAX, COUNT = BSLAM_SVM_WEIGHTS(N, true) };
    static int8_t bytes[COUNT];
    static float x[N];
    static const float scale[] = {1}, bias[] = {0};
    for (int i = 0; i < COUNT; i++) {
        bytes[i] = -128;
    }
    for (int i = 0; i < N; i++) {
        x[i] = -3;
    }
    const bslam_svm_t svm = {
        .rows = 1, .features = N, .quadratic = true, .bytes = bytes, .byte_scale = scale, .bias = bias};
    float value;
    bslam_svm_decide(&svm, x, &value);
    const double wanted = -128.0 * (-3.0 * N + 9.0 * N * (N + 1) / 2);
    assert_near(value, wanted, fabs(wanted) * 2e-4);
}

static void test_decide_touches_no_value_beyond_its_rows(void **state)
{
    static machine_t machine;
    unit_random_t random = {2};
    fill(&machine, &random);
    bslam_svm_t svm = view(&machine, true, false);
    svm.rows = 1;
    float values[2] = {0, 12345};
    bslam_svm_decide(&svm, machine.x, values);
    assert_near(values[1], 12345, 0);
}

// ---- what is refused --------------------------------------------------------------------------------------

static void test_check_sizes_out_of_range_are_refused(void **state)
{
    static machine_t machine;
    const bslam_svm_t good = view(&machine, false, false);
    static const struct {
        int32_t rows;
        int32_t features;
        int32_t wanted;
    } cases[] = {
        {0, FEATURES, FEATURES},
        {-1, FEATURES, FEATURES},
        {BSLAM_SVM_ROWS_MAX + 1, FEATURES, FEATURES},
        {ROWS, 0, 0},
        {ROWS, -1, -1},
        {ROWS, BSLAM_SVM_FEATURES_MAX + 1, 256},
        {ROWS, FEATURES - 1, 57},
        {ROWS, FEATURES, 71},
    };
    for (int i = 0; i < COUNT_OF(cases); i++) {
        bslam_svm_t svm = good;
        svm.rows = cases[i].rows;
        svm.features = cases[i].features;
        assert_int_equal(bslam_svm_check(&svm, cases[i].wanted), BSLAM_E_COUNT);
    }
    assert_int_equal(bslam_svm_check(&good, FEATURES), BSLAM_OK);
}

static void test_check_missing_or_contradicting_tables_are_refused(void **state)
{
    static machine_t machine;
    bslam_svm_t cases[5];
    for (int i = 0; i < COUNT_OF(cases); i++) {
        cases[i] = view(&machine, true, i > 1);
    }
    cases[0].weights = NULL;
    cases[1].bias = NULL;
    cases[2].weights = machine.weights;
    cases[3].byte_scale = NULL;
    cases[4].bias = NULL;
    for (int i = 0; i < COUNT_OF(cases); i++) {
        assert_int_equal(bslam_svm_check(&cases[i], FEATURES), BSLAM_E_PARAMETER);
    }
}

static void test_check_negative_scale_is_refused(void **state)
{
    static machine_t machine;
    const bslam_svm_t svm = view(&machine, false, true);
    assert_int_equal(bslam_svm_check(&svm, FEATURES), BSLAM_OK);
    machine.scale[ROWS - 1] = -0.1f;
    assert_int_equal(bslam_svm_check(&svm, FEATURES), BSLAM_E_PARAMETER);
    machine.scale[ROWS - 1] = 0;
}

static void assert_not_finite_is_refused(const bslam_svm_t *svm, float *value)
{
    static const float bad[] = {NAN, INFINITY, -INFINITY, 2e12f};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        *value = bad[i];
        assert_int_equal(bslam_svm_check(svm, FEATURES), BSLAM_E_NOT_FINITE);
    }
    *value = 0;
    assert_int_equal(bslam_svm_check(svm, FEATURES), BSLAM_OK);
}

static void test_check_not_finite_value_anywhere_is_refused(void **state)
{
    static machine_t machine;
    const bslam_svm_t floats = view(&machine, true, false);
    const bslam_svm_t linear = view(&machine, false, false);
    const bslam_svm_t bytes = view(&machine, true, true);
    assert_not_finite_is_refused(&floats, &machine.weights[0]);
    assert_not_finite_is_refused(&floats, &machine.weights[ROWS * WEIGHTS - 1]);
    assert_not_finite_is_refused(&linear, &machine.weights[ROWS * FEATURES - 1]);
    assert_not_finite_is_refused(&floats, &machine.bias[ROWS - 1]);
    assert_not_finite_is_refused(&bytes, &machine.bias[0]);
    assert_not_finite_is_refused(&bytes, &machine.scale[ROWS - 1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_decide_linear_is_the_dot_product),
        cmocka_unit_test(test_decide_quadratic_takes_the_upper_triangle_row_by_row),
        cmocka_unit_test(test_decide_bytes_are_scaled_row_by_row),
        cmocka_unit_test(test_decide_bytes_are_close_to_floats),
        cmocka_unit_test(test_decide_bytes_largest_numbers_do_not_overflow),
        cmocka_unit_test(test_decide_is_the_definition_for_every_kind),
        cmocka_unit_test(test_decide_touches_no_value_beyond_its_rows),
        cmocka_unit_test(test_check_sizes_out_of_range_are_refused),
        cmocka_unit_test(test_check_missing_or_contradicting_tables_are_refused),
        cmocka_unit_test(test_check_negative_scale_is_refused),
        cmocka_unit_test(test_check_not_finite_value_anywhere_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
