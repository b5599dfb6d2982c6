#include "support.h"

#include <math.h>

#include "base/logarithm.h"

static void test_ln_is_libm_s_to_the_promised_error(void **state)
{
    const double promised = BSLAM_REAL_DOUBLE ? 1e-15 : 4e-7;
    unit_random_t random = {41};
    for (int i = 0; i < 200000; i++) {
        const bslam_real_t x = real(exp(unit_random(&random, -80, 80)));
        const double expected = log((double)x);
        assert_near(bslam_ln(x), expected, promised * fmax(1, fabs(expected)));
    }
}

static void test_ln_of_1_is_0(void **state)
{
    assert_true(bslam_ln(1) == 0);
}

static void test_ln_near_1_keeps_its_digits(void **state)
{
    const double promised = BSLAM_REAL_DOUBLE ? 1e-15 : 4e-7;
    for (int i = 1; i < 1000; i++) {
        const bslam_real_t x = real(1 + 1e-3 * i);
        assert_near(bslam_ln(x), log((double)x), promised);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ln_is_libm_s_to_the_promised_error),
        cmocka_unit_test(test_ln_of_1_is_0),
        cmocka_unit_test(test_ln_near_1_keeps_its_digits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
