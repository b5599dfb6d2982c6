#include "base/bounds.h"

#include <math.h>

#include "support.h"

static void test_least_and_most_of_ends_and_equals(void **state)
{
    static const int32_t numbers[] = {INT32_MIN, -2, 0, 3, INT32_MAX};
    for (int i = 0; i < COUNT_OF(numbers); i++) {
        for (int j = 0; j < COUNT_OF(numbers); j++) {
            assert_int_equal(bslam_least(numbers[i], numbers[j]), numbers[i < j ? i : j]);
            assert_int_equal(bslam_most(numbers[i], numbers[j]), numbers[i > j ? i : j]);
        }
    }
}

static void test_magnitude_has_no_sign(void **state)
{
    assert_int_equal(bslam_magnitude(-7), 7);
    assert_int_equal(bslam_magnitude(0), 0);
    assert_int_equal(bslam_magnitude(INT32_MAX), INT32_MAX);
}

static void test_clamp_is_the_nearest_within_bounds(void **state)
{
    static const struct {
        int32_t value, expected;
    } cases[] = {{INT32_MIN, -3}, {-4, -3}, {-3, -3}, {0, 0}, {5, 5}, {6, 5}, {INT32_MAX, 5}};
    for (int i = 0; i < COUNT_OF(cases); i++) {
        assert_int_equal(bslam_clamp(cases[i].value, -3, 5), cases[i].expected);
        const float value = (float)cases[i].value, expected = (float)cases[i].expected;
        assert_true(bslam_clampf(value, -3.0f, 5.0f) == expected);
    }
    assert_true(bslam_clampf(INFINITY, -3.0f, 5.0f) == 5.0f);
    assert_true(isnan(bslam_clampf(NAN, -3.0f, 5.0f)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_least_and_most_of_ends_and_equals),
        cmocka_unit_test(test_magnitude_has_no_sign),
        cmocka_unit_test(test_clamp_is_the_nearest_within_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
