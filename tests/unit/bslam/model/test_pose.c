#include "support.h"

#include <math.h>

#include "bslam/model/pose.h"

/// A few roundings of coordinates up to 20 m, and sine and cosine at their error bound times that.
#define POSITION_ERROR (BSLAM_REAL_DOUBLE ? 3e-14 : 1.5e-5)
#define ANGLE_ERROR (16 * UNIT_ROUNDING)

static bslam_pose_t random_pose(unit_random_t *random)
{
    return (bslam_pose_t){real(unit_random(random, -10, 10)), real(unit_random(random, -10, 10)),
                          real(unit_random(random, -3.14159, 3.14159))};
}

static void assert_same_pose(const bslam_pose_t *a, const bslam_pose_t *b)
{
    assert_near(a->x_m, b->x_m, POSITION_ERROR);
    assert_near(a->y_m, b->y_m, POSITION_ERROR);
    assert_near(unit_angle_between((double)a->theta_rad, (double)b->theta_rad), 0, ANGLE_ERROR);
}

static void test_compose_is_rotation_then_shift(void **state)
{
    unit_random_t random = {1};
    for (int i = 0; i < 1000; i++) {
        const bslam_pose_t a = random_pose(&random);
        const bslam_pose_t b = random_pose(&random);
        const double s = sin((double)a.theta_rad);
        const double c = cos((double)a.theta_rad);
        const bslam_pose_t expected = {real((double)a.x_m + c * (double)b.x_m - s * (double)b.y_m),
                                       real((double)a.y_m + s * (double)b.x_m + c * (double)b.y_m),
                                       a.theta_rad + b.theta_rad};
        const bslam_pose_t composed = bslam_pose_compose(&a, &b);
        assert_same_pose(&composed, &expected);
        assert_true(composed.theta_rad > real(-3.14160) && composed.theta_rad < real(3.14160));
    }
}

static void test_compose_is_associative(void **state)
{
    unit_random_t random = {2};
    for (int i = 0; i < 1000; i++) {
        const bslam_pose_t a = random_pose(&random);
        const bslam_pose_t b = random_pose(&random);
        const bslam_pose_t c = random_pose(&random);
        const bslam_pose_t ab = bslam_pose_compose(&a, &b);
        const bslam_pose_t bc = bslam_pose_compose(&b, &c);
        const bslam_pose_t left = bslam_pose_compose(&ab, &c);
        const bslam_pose_t right = bslam_pose_compose(&a, &bc);
        assert_same_pose(&left, &right);
    }
}

static void test_compose_with_the_identity_changes_no_bit(void **state)
{
    const bslam_pose_t identity = {0, 0, 0};
    const bslam_pose_t a = {1, -2, 3};
    const bslam_pose_t left = bslam_pose_compose(&identity, &a);
    const bslam_pose_t right = bslam_pose_compose(&a, &identity);
    assert_memory_equal(&left, &a, sizeof a);
    assert_memory_equal(&right, &a, sizeof a);
}

static void test_inverse_undoes_from_either_side(void **state)
{
    unit_random_t random = {3};
    const bslam_pose_t identity = {0, 0, 0};
    for (int i = 0; i < 1000; i++) {
        const bslam_pose_t a = random_pose(&random);
        const bslam_pose_t inverse = bslam_pose_inverse(&a);
        const bslam_pose_t behind = bslam_pose_compose(&a, &inverse);
        const bslam_pose_t before = bslam_pose_compose(&inverse, &a);
        assert_same_pose(&behind, &identity);
        assert_same_pose(&before, &identity);
    }
}

static void translate(bslam_real_t turn_rad, bslam_real_t *x, bslam_real_t *y)
{
    const bslam_turning_t turning = bslam_turning(turn_rad);
    bslam_turning_apply(&turning, x, y);
}

static void test_turning_is_the_integral_over_the_turn(void **state)
{
    // Zero, tiny, both sides of the series' limit, large, near half a turn, more than half a turn.
    static const double turns[] = {0,   1e-12, 1e-6, 1e-3, 0.0199, 0.0201, 0.1,
                                   0.8, 1.57,  1.58, 2.5,  3.1,    3.1416, 4};
    for (int i = 0; i < COUNT_OF(turns); i++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            bslam_real_t x = 3;
            bslam_real_t y = -2;
            double c;
            double s;
            unit_mean_direction(0, sign * turns[i], &c, &s);
            translate(real(sign * turns[i]), &x, &y);
            // The quadrature's error, and some roundings of 3.
            assert_near(x, c * 3 - s * -2, 1e-12 + 30 * UNIT_ROUNDING);
            assert_near(y, s * 3 + c * -2, 1e-12 + 30 * UNIT_ROUNDING);
        }
    }
}

static void test_turning_without_turn_changes_no_bit(void **state)
{
    bslam_real_t x = BSLAM_R(0.1);
    bslam_real_t y = BSLAM_R(-7.7);
    translate(0, &x, &y);
    assert_true(x == BSLAM_R(0.1) && y == BSLAM_R(-7.7));
}

static void test_turning_of_a_full_turn_comes_back(void **state)
{
    bslam_real_t x = 5;
    bslam_real_t y = 4;
    translate(real(6.283185307179586), &x, &y);
    assert_near(x, 0, 20 * UNIT_ROUNDING);
    assert_near(y, 0, 20 * UNIT_ROUNDING);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_compose_is_rotation_then_shift),
        cmocka_unit_test(test_compose_is_associative),
        cmocka_unit_test(test_compose_with_the_identity_changes_no_bit),
        cmocka_unit_test(test_inverse_undoes_from_either_side),
        cmocka_unit_test(test_turning_is_the_integral_over_the_turn),
        cmocka_unit_test(test_turning_without_turn_changes_no_bit),
        cmocka_unit_test(test_turning_of_a_full_turn_comes_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
