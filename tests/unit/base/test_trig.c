#include "support.h"

#include <math.h>

#include "base/trig.h"

// The header's promises: 1.5e-7 and 4e-7 in float, 1e-15 in double.
#define SINE_ERROR (BSLAM_REAL_DOUBLE ? 1e-15 : 1.5e-7)
#define ATAN_ERROR (BSLAM_REAL_DOUBLE ? 1e-15 : 4e-7)

static const long double PI_L = 3.14159265358979323846264338328L;

/// Distance from |x| to the next number of the scalar type.
static double ulp(bslam_real_t x)
{
#if BSLAM_REAL_DOUBLE
    return nextafter(fabs(x), INFINITY) - fabs(x);
#else
    return (double)(nextafterf(fabsf(x), INFINITY) - fabsf(x));
#endif
}

static bslam_real_t next_up(bslam_real_t x)
{
    return x >= 0 ? x + real(ulp(x)) : -(-x - real(ulp(-x / 2)));
}

/// How far two angles differ as directions.
static double direction_difference(long double a, long double b)
{
    return (double)remainderl(a - b, 2 * PI_L);
}

// ---- sine and cosine --------------------------------------------------------------------------------------

static void assert_sin_cos(bslam_real_t angle, double tolerance)
{
    bslam_real_t s;
    bslam_real_t c;
    bslam_sin_cos(angle, &s, &c);
    assert_near(s, sinl((long double)angle), tolerance);
    assert_near(c, cosl((long double)angle), tolerance);
}

static void test_sin_cos_within_a_turn_meets_its_error_bound(void **state)
{
    for (int i = -20000; i <= 20000; i++) {
        const double angle = 3.14159 * i / 20000;
        assert_sin_cos(real(angle), SINE_ERROR);
    }
}

static void test_sin_cos_up_to_the_largest_angle_adds_one_ulp_of_the_angle(void **state)
{
    unit_random_t random = {1};
    for (int i = 0; i < 50000; i++) {
        const bslam_real_t angle = real(unit_random(&random, -1e4, 1e4));
        assert_sin_cos(angle, SINE_ERROR + ulp(angle));
    }
    assert_sin_cos(BSLAM_ANGLE_MAX, SINE_ERROR + ulp(BSLAM_ANGLE_MAX));
    assert_sin_cos(-BSLAM_ANGLE_MAX, SINE_ERROR + ulp(BSLAM_ANGLE_MAX));
}

static void test_sin_cos_at_every_edge_between_octants_meets_its_error_bound(void **state)
{
    for (int octant = -16; octant <= 16; octant++) {
        const bslam_real_t edge = (bslam_real_t)octant * BSLAM_PI / 4;
        bslam_real_t angle = edge - 3 * real(ulp(edge));
        for (int step = 0; step < 7; step++) {
            assert_sin_cos(angle, SINE_ERROR + ulp(angle));
            angle += real(ulp(edge));
        }
    }
}

static void test_sin_cos_of_a_tiny_angle_keeps_its_digits(void **state)
{
    static const double angles[] = {1e-3, 1e-5, 1e-10, 1e-20, 1e-30, 1e-37};
    for (int i = 0; i < COUNT_OF(angles); i++) {
        bslam_real_t s;
        bslam_real_t c;
        bslam_sin_cos(real(angles[i]), &s, &c);
        // Relative: two roundings.
        assert_near(s, sin((double)real(angles[i])), 4 * UNIT_ROUNDING * angles[i]);
    }
}

static void test_sin_cos_of_zero_is_exact(void **state)
{
    bslam_real_t s;
    bslam_real_t c;
    bslam_sin_cos(0, &s, &c);
    assert_true(s == 0 && c == 1);
}

static void test_sin_cos_of_the_opposite_angle_is_the_mirror_image_to_the_bit(void **state)
{
    unit_random_t random = {2};
    for (int i = 0; i < 5000; i++) {
        const bslam_real_t angle = real(unit_random(&random, -10, 10));
        bslam_real_t s[2];
        bslam_real_t c[2];
        bslam_sin_cos(angle, &s[0], &c[0]);
        bslam_sin_cos(-angle, &s[1], &c[1]);
        assert_true(s[0] == -s[1] && c[0] == c[1]);
    }
}

// ---- arc tangent ------------------------------------------------------------------------------------------

static void assert_atan2(bslam_real_t y, bslam_real_t x)
{
    const bslam_real_t angle = bslam_atan2(y, x);
    assert_near(direction_difference((long double)angle, atan2l((long double)y, (long double)x)), 0,
                ATAN_ERROR);
    assert_true(angle > -BSLAM_PI && angle <= BSLAM_PI);
}

static void test_atan2_all_around_meets_its_error_bound(void **state)
{
    unit_random_t random = {3};
    for (int i = 0; i < 40000; i++) {
        const double angle = 6.2832 * i / 40000;
        const double length = pow(10, unit_random(&random, -10, 10));
        assert_atan2(real(length * sin(angle)), real(length * cos(angle)));
    }
}

static void test_atan2_on_the_axes_is_a_multiple_of_a_quarter_turn(void **state)
{
    assert_true(bslam_atan2(0, 1) == 0);
    assert_true(bslam_atan2(1, 0) == BSLAM_PI / 2);
    assert_true(bslam_atan2(-1, 0) == -BSLAM_PI / 2);
    assert_true(bslam_atan2(0, -1) == BSLAM_PI);
    assert_true(bslam_atan2(-(bslam_real_t)0, -1) == BSLAM_PI);
    assert_true(bslam_atan2(0, 0) == 0);
}

static void test_atan2_just_below_the_negative_axis_stays_above_minus_pi(void **state)
{
    static const double small[] = {1e-3, 1e-7, 1e-8, 1e-15, 1e-17, 1e-30};
    for (int i = 0; i < COUNT_OF(small); i++) {
        assert_atan2(real(-small[i]), -1);
        assert_atan2(real(small[i]), -1);
    }
}

static void test_atan2_of_extreme_lengths_neither_overflows_nor_vanishes(void **state)
{
    static const double lengths[] = {1e-44, 1e-38, 1e-20, 1, 1e12, 1e20, 3e38};
    for (int i = 0; i < COUNT_OF(lengths); i++) {
        for (int j = 0; j < COUNT_OF(lengths); j++) {
            assert_atan2(real(lengths[i]), real(lengths[j]));
            assert_atan2(real(-lengths[i]), real(-lengths[j]));
        }
    }
}

static void test_atan2_undoes_sin_cos(void **state)
{
    unit_random_t random = {4};
    for (int i = 0; i < 10000; i++) {
        const bslam_real_t angle = real(unit_random(&random, -3.14159, 3.14159));
        bslam_real_t s;
        bslam_real_t c;
        bslam_sin_cos(angle, &s, &c);
        assert_near(direction_difference((long double)bslam_atan2(s, c), (long double)angle), 0,
                    SINE_ERROR + ATAN_ERROR);
    }
}

// ---- wrapping ---------------------------------------------------------------------------------------------

static void assert_wraps(bslam_real_t angle)
{
    const bslam_real_t wrapped = bslam_angle_wrap(angle);
    assert_true(wrapped > -BSLAM_PI && wrapped <= BSLAM_PI);
    // What the angle itself is rounded to, and two roundings of a result of at most pi.
    assert_near(direction_difference((long double)wrapped, (long double)angle), 0,
                ulp(angle) + 2 * ulp(BSLAM_PI));
    assert_true(bslam_angle_wrap(wrapped) == wrapped);
}

static void test_angle_wrap_an_angle_in_range_is_kept_to_the_bit(void **state)
{
    unit_random_t random = {5};
    for (int i = 0; i < 10000; i++) {
        const bslam_real_t angle = real(unit_random(&random, -3.1415, 3.1415));
        assert_true(bslam_angle_wrap(angle) == angle);
    }
    assert_true(bslam_angle_wrap(BSLAM_PI) == BSLAM_PI);
    assert_true(bslam_angle_wrap(0) == 0);
}

static void test_angle_wrap_minus_pi_comes_into_range(void **state)
{
    // The scalar type's -pi is no direction of the half-open range; which side it lands on is a matter of
    // rounding.
    assert_wraps(-BSLAM_PI);
}

static void test_angle_wrap_any_angle_keeps_its_direction_and_comes_into_range(void **state)
{
    unit_random_t random = {6};
    for (int i = 0; i < 50000; i++) {
        assert_wraps(real(unit_random(&random, -1e4, 1e4)));
        assert_wraps(real(unit_random(&random, -12, 12)));
    }
    assert_wraps(BSLAM_ANGLE_MAX);
    assert_wraps(-BSLAM_ANGLE_MAX);
}

static void test_angle_wrap_at_every_odd_multiple_of_pi_comes_into_range(void **state)
{
    for (int odd = -3183; odd <= 3183; odd += 2) {
        const bslam_real_t edge = real((double)odd * (double)PI_L);
        bslam_real_t angle = edge - 3 * real(ulp(edge));
        for (int step = 0; step < 7; step++) {
            assert_wraps(angle);
            angle = next_up(angle);
        }
    }
}

// ---- beyond BSLAM_ANGLE_MAX -------------------------------------------------------------------------------

static void test_angle_wrap_and_sin_cos_beyond_the_largest_angle_take_out_whole_turns(void **state)
{
    static const double angles[] = {1.0001e4, 12345.678, 3.7e5, 1e7, 1e12, 1e30, 3e38};
    for (int i = 0; i < COUNT_OF(angles); i++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            const bslam_real_t angle = real(sign * angles[i]);
            // Whole turns of the scalar type's own 2 pi: exact, whatever the angle.
            const long double rest = remainderl((long double)angle, (long double)(2 * BSLAM_PI));
            const bslam_real_t wrapped = bslam_angle_wrap(angle);
            assert_true(wrapped > -BSLAM_PI && wrapped <= BSLAM_PI);
            assert_near(direction_difference((long double)wrapped, rest), 0, 8 * ulp(BSLAM_PI));
            bslam_real_t s;
            bslam_real_t c;
            bslam_sin_cos(angle, &s, &c);
            assert_near(s, sinl(rest), 8 * ulp(BSLAM_PI));
            assert_near(c, cosl(rest), 8 * ulp(BSLAM_PI));
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sin_cos_within_a_turn_meets_its_error_bound),
        cmocka_unit_test(test_sin_cos_up_to_the_largest_angle_adds_one_ulp_of_the_angle),
        cmocka_unit_test(test_sin_cos_at_every_edge_between_octants_meets_its_error_bound),
        cmocka_unit_test(test_sin_cos_of_a_tiny_angle_keeps_its_digits),
        cmocka_unit_test(test_sin_cos_of_zero_is_exact),
        cmocka_unit_test(test_sin_cos_of_the_opposite_angle_is_the_mirror_image_to_the_bit),

        cmocka_unit_test(test_atan2_all_around_meets_its_error_bound),
        cmocka_unit_test(test_atan2_on_the_axes_is_a_multiple_of_a_quarter_turn),
        cmocka_unit_test(test_atan2_just_below_the_negative_axis_stays_above_minus_pi),
        cmocka_unit_test(test_atan2_of_extreme_lengths_neither_overflows_nor_vanishes),
        cmocka_unit_test(test_atan2_undoes_sin_cos),

        cmocka_unit_test(test_angle_wrap_an_angle_in_range_is_kept_to_the_bit),
        cmocka_unit_test(test_angle_wrap_minus_pi_comes_into_range),
        cmocka_unit_test(test_angle_wrap_any_angle_keeps_its_direction_and_comes_into_range),
        cmocka_unit_test(test_angle_wrap_at_every_odd_multiple_of_pi_comes_into_range),

        cmocka_unit_test(test_angle_wrap_and_sin_cos_beyond_the_largest_angle_take_out_whole_turns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
