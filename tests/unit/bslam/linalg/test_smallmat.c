#include "support.h"

#include <math.h>

#include "bslam/linalg/smallmat.h"

/// A positive definite matrix with variances spread over decades and a correlation up to 0.99.
static bslam_sym2_t random_positive(unit_random_t *random)
{
    const double sd_x = pow(10, unit_random(random, -4, 4));
    const double sd_y = pow(10, unit_random(random, -4, 4));
    const double correlation = unit_random(random, -0.99, 0.99);
    return (bslam_sym2_t){real(sd_x * sd_x), real(correlation * sd_x * sd_y), real(sd_y * sd_y)};
}

static const bslam_sym2_t not_positive[] = {
    {0, 0, 1}, {1, 0, 0}, {-1, 0, 1},  {1, 0, -1},  {1, 2, 1},
    {1, 1, 1}, {0, 0, 0}, {NAN, 0, 1}, {1, NAN, 1}, {1, 0, NAN},
};

static void test_cholesky_squares_back_to_the_matrix(void **state)
{
    unit_random_t random = {1};
    for (int i = 0; i < 2000; i++) {
        const bslam_sym2_t m = random_positive(&random);
        bslam_lower2_t l;
        assert_int_equal(bslam_sym2_cholesky(&m, &l), BSLAM_OK);
        const double xx = (double)l.xx;
        const double yx = (double)l.yx;
        const double yy = (double)l.yy;
        // A handful of roundings, relative to what the element is scaled by.
        const double scale = 8 * UNIT_ROUNDING;
        assert_near(xx * xx, m.xx, scale * (double)m.xx);
        assert_near(yx * xx, m.xy, scale * sqrt((double)m.xx * (double)m.yy));
        assert_near(yx * yx + yy * yy, m.yy, scale * (double)m.yy);
        assert_true(l.xx > 0 && l.yy > 0);
    }
}

static void test_cholesky_not_positive_is_singular_and_changes_nothing(void **state)
{
    for (int i = 0; i < COUNT_OF(not_positive); i++) {
        bslam_lower2_t l = {1, 2, 3};
        assert_int_equal(bslam_sym2_cholesky(&not_positive[i], &l), BSLAM_E_SINGULAR);
        assert_true(l.xx == 1 && l.yx == 2 && l.yy == 3);
    }
}

static void test_mahalanobis_is_the_closed_form(void **state)
{
    unit_random_t random = {2};
    for (int i = 0; i < 2000; i++) {
        const bslam_sym2_t m = random_positive(&random);
        const bslam_real_t x = real(unit_random(&random, -3, 3)) * real(sqrt((double)m.xx));
        const bslam_real_t y = real(unit_random(&random, -3, 3)) * real(sqrt((double)m.yy));
        bslam_real_t distance2;
        assert_int_equal(bslam_sym2_mahalanobis(&m, x, y, &distance2), BSLAM_OK);
        // vᵀ adj(m) v / det(m) in double.
        const double det = (double)m.xx * (double)m.yy - (double)m.xy * (double)m.xy;
        const double expected =
            ((double)m.yy * (double)x * (double)x - 2 * (double)m.xy * (double)x * (double)y +
             (double)m.xx * (double)y * (double)y) /
            det;
        // Conditioning: 1 - 0.99^2 = 0.02 of the digits remain in the second pivot, and the sum is below 18 /
        // 0.02.
        assert_near(distance2, expected, 900 * 50 * UNIT_ROUNDING);
    }
}

static void test_mahalanobis_of_nothing_is_zero(void **state)
{
    const bslam_sym2_t m = {4, 1, 9};
    bslam_real_t distance2 = -1;
    assert_int_equal(bslam_sym2_mahalanobis(&m, 0, 0, &distance2), BSLAM_OK);
    assert_true(distance2 == 0);
}

static void test_mahalanobis_not_positive_is_singular_and_changes_nothing(void **state)
{
    for (int i = 0; i < COUNT_OF(not_positive); i++) {
        bslam_real_t distance2 = 7;
        assert_int_equal(bslam_sym2_mahalanobis(&not_positive[i], 1, 1, &distance2), BSLAM_E_SINGULAR);
        assert_true(distance2 == 7);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cholesky_squares_back_to_the_matrix),
        cmocka_unit_test(test_cholesky_not_positive_is_singular_and_changes_nothing),
        cmocka_unit_test(test_mahalanobis_is_the_closed_form),
        cmocka_unit_test(test_mahalanobis_of_nothing_is_zero),
        cmocka_unit_test(test_mahalanobis_not_positive_is_singular_and_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
