// Stored signatures: rounding, limits, refusals, and the sums over them against their definitions.
#include "support.h"

#include <math.h>

#include "bslam/appearance/sample.h"

#define HALF_STEP (BSLAM_SAMPLE_FLOAT ? 0.0 : 0.5 / 127)
#define FLOAT_ROUNDING 5.97e-8

static void draw_features(unit_random_t *random, float *features)
{
    for (int i = 0; i < BSLAM_SAMPLE_FEATURES; i++) {
        features[i] = (float)unit_random(random, -1, 1);
    }
}

static bslam_sample_t encoded(const float *features)
{
    bslam_sample_t sample;
    assert_int_equal(bslam_sample_encode(features, &sample), BSLAM_OK);
    return sample;
}

static void test_encode_rounds_to_the_nearest_step(void **state)
{
    unit_random_t random = {1};
    float features[BSLAM_SAMPLE_FEATURES];
    for (int k = 0; k < 20; k++) {
        draw_features(&random, features);
        const bslam_sample_t sample = encoded(features);
        for (int i = 0; i < BSLAM_SAMPLE_FEATURES; i++) {
            assert_near((double)sample.q[i] * (double)BSLAM_SAMPLE_UNIT, features[i], HALF_STEP + 1e-7);
        }
        assert_near((double)sample.q[BSLAM_SAMPLE_FEATURES] * (double)BSLAM_SAMPLE_UNIT, 1, 1e-7);
    }
}

static void test_encode_beyond_the_limits_is_the_limit(void **state)
{
    float features[BSLAM_SAMPLE_FEATURES] = {0};
    features[0] = 1.7f;
    features[1] = -1e11f;
    const bslam_sample_t sample = encoded(features);
    assert_near((double)sample.q[0] * (double)BSLAM_SAMPLE_UNIT, 1, 1e-7);
    assert_near((double)sample.q[1] * (double)BSLAM_SAMPLE_UNIT, -1, 1e-7);
}

static void test_encode_no_number_is_refused_and_writes_nothing(void **state)
{
    static const float bad[] = {NAN, INFINITY, -INFINITY, 2e12f, -2e12f};
    float features[BSLAM_SAMPLE_FEATURES] = {0};
    bslam_sample_t sample;
    memset(&sample, 0x55, sizeof sample);
    const bslam_sample_t before = sample;
    for (int i = 0; i < BSLAM_SAMPLE_FEATURES; i++) {
        for (int k = 0; k < COUNT_OF(bad); k++) {
            features[i] = bad[k];
            assert_int_equal(bslam_sample_encode(features, &sample), BSLAM_E_NOT_FINITE);
        }
        features[i] = 0;
    }
    assert_memory_equal(&sample, &before, sizeof sample);
}

static void test_distance2_is_the_definition(void **state)
{
    unit_random_t random = {2};
    float features[BSLAM_SAMPLE_FEATURES];
    draw_features(&random, features);
    const bslam_sample_t a = encoded(features);
    draw_features(&random, features);
    const bslam_sample_t b = encoded(features);
    double expected = 0;
    for (int i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        expected += ((double)a.q[i] - (double)b.q[i]) * ((double)a.q[i] - (double)b.q[i]);
    }
    assert_near(bslam_sample_distance2(&a, &b), expected, BSLAM_SAMPLE_SIZE * FLOAT_ROUNDING * expected);
    assert_near(bslam_sample_distance2(&a, &a), 0, 0);
}

static void draw_weights(unit_random_t *random, float *weights)
{
    for (int i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        weights[i] = (float)unit_random(random, -8, 8);
    }
}

static void test_weights_round_keeps_each_within_half_a_unit(void **state)
{
    unit_random_t random = {3};
    float weights[BSLAM_SAMPLE_SIZE];
    bslam_weights_t rounded;
    draw_weights(&random, weights);
    bslam_weights_round(weights, &rounded);
    const double half = BSLAM_SAMPLE_FLOAT ? 0.0 : 0.5 * (double)rounded.unit;
    assert_true(half <= 8.0 / 32767);
    for (int i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        assert_near((double)rounded.unit * (double)rounded.w[i], weights[i], half + 8 * 4 * FLOAT_ROUNDING);
    }
}

static void test_weights_round_zero_stays_zero(void **state)
{
    const float weights[BSLAM_SAMPLE_SIZE] = {0};
    const float features[BSLAM_SAMPLE_FEATURES] = {1};
    bslam_weights_t rounded;
    bslam_weights_round(weights, &rounded);
    const bslam_sample_t sample = encoded(features);
    assert_near(bslam_sample_decide(&rounded, &sample), 0, 0);
}

static void test_decide_is_the_dot_product(void **state)
{
    unit_random_t random = {4};
    float weights[BSLAM_SAMPLE_SIZE];
    float features[BSLAM_SAMPLE_FEATURES];
    bslam_weights_t rounded;
    for (int k = 0; k < 20; k++) {
        draw_weights(&random, weights);
        draw_features(&random, features);
        bslam_weights_round(weights, &rounded);
        const bslam_sample_t sample = encoded(features);
        double expected = 0;
        double sum = 0;
        for (int i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
            const double term = (double)rounded.unit * (double)rounded.w[i] * (double)sample.q[i];
            expected += term;
            sum += fabs(term);
        }
        assert_near(bslam_sample_decide(&rounded, &sample), expected,
                    BSLAM_SAMPLE_SIZE * FLOAT_ROUNDING * sum);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_encode_rounds_to_the_nearest_step),
        cmocka_unit_test(test_encode_beyond_the_limits_is_the_limit),
        cmocka_unit_test(test_encode_no_number_is_refused_and_writes_nothing),
        cmocka_unit_test(test_distance2_is_the_definition),
        cmocka_unit_test(test_weights_round_keeps_each_within_half_a_unit),
        cmocka_unit_test(test_weights_round_zero_stays_zero),
        cmocka_unit_test(test_decide_is_the_dot_product),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
