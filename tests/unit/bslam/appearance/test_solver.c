// The solver against what defines the solution: optimality conditions and duality gap, computed in double.
#include "support.h"

#include <math.h>

#include "bslam/appearance/solver.h"

enum { SAMPLES = BSLAM_SOLVER_ROWS_MAX, POSITIVES = 16, ENOUGH_STEPS = 1000000 };

static const double COST = 10;

static bslam_sample_t store[SAMPLES];
static bslam_samples_t all = {store, SAMPLES, NULL, 0};
static bslam_solver_t solver;

/// Two clouds that overlap, so that there are support vectors on both sides.
static void draw_samples(uint64_t seed, double spread)
{
    unit_random_t random = {seed};
    float features[BSLAM_SAMPLE_FEATURES];
    for (int i = 0; i < SAMPLES; i++) {
        for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
            const double middle = i < POSITIVES ? 0.3 * (k % 3) : 0.25 * (k % 4);
            features[k] = (float)(middle + unit_random(&random, -spread, spread));
        }
        assert_int_equal(bslam_sample_encode(features, &store[i]), BSLAM_OK);
    }
}

static void begin_with(int count, float tolerance, bool thorough)
{
    bslam_solver_begin(&solver, (float)COST, tolerance, thorough);
    for (int i = 0; i < count; i++) {
        bslam_solver_add(&solver, &all, i, i < POSITIVES, 0);
    }
}

static double feature(int sample, int k)
{
    return (double)store[sample].q[k] * (double)BSLAM_SAMPLE_UNIT;
}

static double sign_of(int row)
{
    return solver.rows[row].positive ? 1 : -1;
}

/// y w . x with w = sum of alpha y x, all in double.
static double margin_of(int row)
{
    double value = 0;
    for (int k = 0; k < BSLAM_SAMPLE_SIZE; k++) {
        double w = 0;
        for (int i = 0; i < solver.count; i++) {
            w += (double)solver.rows[i].alpha * sign_of(i) * feature(solver.rows[i].sample, k);
        }
        value += w * feature(solver.rows[row].sample, k);
    }
    return value * sign_of(row);
}

static double length2_of_w(void)
{
    double length2 = 0;
    for (int i = 0; i < solver.count; i++) {
        length2 += (double)solver.rows[i].alpha * margin_of(i);
    }
    return length2;
}

static void assert_is_the_solution(double tolerance)
{
    const double length2 = length2_of_w();
    double primal = length2 / 2;
    double dual = -length2 / 2;
    for (int i = 0; i < solver.count; i++) {
        const double alpha = (double)solver.rows[i].alpha;
        const double margin = margin_of(i);
        const double hinge = margin < 1 ? 1 - margin : 0;
        const double gradient = margin - 1 + alpha / (2 * COST);
        assert_true(alpha >= 0);
        assert_true(alpha > 0 ? fabs(gradient) <= tolerance : gradient >= -tolerance);
        primal += COST * hinge * hinge;
        dual += alpha - alpha * alpha / (4 * COST);
    }
    assert_true(primal >= dual * (1 - 1e-6));
    // Each row is off by at most alpha times its gradient.
    assert_near(primal, dual, 1e-3 * primal);
}

static void test_run_meets_the_optimality_conditions(void **state)
{
    for (uint64_t seed = 1; seed <= 5; seed++) {
        draw_samples(seed, 0.1 * (double)seed);
        begin_with(SAMPLES, 1e-4f, true);
        assert_true(bslam_solver_run(&solver, &all, ENOUGH_STEPS) < ENOUGH_STEPS);
        // The rounding of a decision value in float comes on top of the tolerance.
        assert_is_the_solution(3e-4);
    }
}

static void test_run_keeps_w_the_sum_of_its_rows(void **state)
{
    draw_samples(1, 0.3);
    begin_with(SAMPLES, 1e-4f, true);
    assert_true(bslam_solver_run(&solver, &all, ENOUGH_STEPS) < ENOUGH_STEPS);
    for (int k = 0; k < BSLAM_SAMPLE_SIZE; k++) {
        double w = 0;
        for (int i = 0; i < solver.count; i++) {
            w += (double)solver.rows[i].alpha * sign_of(i) * feature(solver.rows[i].sample, k);
        }
        assert_near((double)solver.weights[k] / (double)BSLAM_SAMPLE_UNIT, w, 1e-4);
    }
}

static void test_run_in_pieces_is_the_same_to_the_bit(void **state)
{
    static bslam_solver_t at_once;
    draw_samples(3, 0.2);
    begin_with(60, 0.01f, true);
    const int32_t steps = bslam_solver_run(&solver, &all, ENOUGH_STEPS);
    memcpy(&at_once, &solver, sizeof solver);
    begin_with(60, 0.01f, true);
    for (int i = 0; i < steps; i++) {
        assert_int_equal(bslam_solver_run(&solver, &all, 1), 1);
    }
    assert_int_equal(bslam_solver_run(&solver, &all, 1), 0);
    assert_memory_equal(&at_once, &solver, sizeof solver);
}

static void test_run_from_its_own_solution_ends_after_a_pass(void **state)
{
    float alpha[SAMPLES];
    draw_samples(4, 0.2);
    begin_with(SAMPLES, 1e-3f, true);
    const int32_t cold = bslam_solver_run(&solver, &all, ENOUGH_STEPS);
    for (int i = 0; i < SAMPLES; i++) {
        alpha[i] = solver.rows[i].alpha;
    }
    bslam_solver_begin(&solver, (float)COST, 2e-3f, true);
    for (int i = 0; i < SAMPLES; i++) {
        bslam_solver_add(&solver, &all, i, i < POSITIVES, alpha[i]);
    }
    // One pass, and one more over all rows if some left the first.
    assert_true(cold > 2 * SAMPLES);
    assert_true(bslam_solver_run(&solver, &all, ENOUGH_STEPS) <= 2 * SAMPLES);
}

static void test_run_not_thorough_takes_fewer_steps(void **state)
{
    draw_samples(5, 0.1);
    begin_with(SAMPLES, 0.5f, true);
    const int32_t thorough = bslam_solver_run(&solver, &all, ENOUGH_STEPS);
    begin_with(SAMPLES, 0.5f, false);
    assert_true(bslam_solver_run(&solver, &all, ENOUGH_STEPS) < thorough);
}

static void test_run_empty_set_is_solved(void **state)
{
    begin_with(0, 0.1f, true);
    assert_int_equal(bslam_solver_run(&solver, &all, 10), 0);
    assert_near(solver.weights[0], 0, 0);
}

static void test_run_one_sample_has_its_closed_form(void **state)
{
    draw_samples(6, 0.2);
    begin_with(1, 1e-4f, true);
    assert_true(bslam_solver_run(&solver, &all, ENOUGH_STEPS) < ENOUGH_STEPS);
    double length2 = 0;
    for (int k = 0; k < BSLAM_SAMPLE_SIZE; k++) {
        length2 += feature(0, k) * feature(0, k);
    }
    assert_near(solver.rows[0].alpha, 1 / (length2 + 1 / (2 * COST)), 1e-5);
}

static void test_run_same_sample_with_both_labels_ends_between(void **state)
{
    draw_samples(7, 0.2);
    for (int i = 1; i < SAMPLES; i++) {
        store[i] = store[0];
    }
    begin_with(2 * POSITIVES, 1e-3f, true);
    assert_true(bslam_solver_run(&solver, &all, ENOUGH_STEPS) < ENOUGH_STEPS);
    assert_near(margin_of(0), 0, 2e-3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_run_meets_the_optimality_conditions),
        cmocka_unit_test(test_run_keeps_w_the_sum_of_its_rows),
        cmocka_unit_test(test_run_in_pieces_is_the_same_to_the_bit),
        cmocka_unit_test(test_run_from_its_own_solution_ends_after_a_pass),
        cmocka_unit_test(test_run_not_thorough_takes_fewer_steps),
        cmocka_unit_test(test_run_empty_set_is_solved),
        cmocka_unit_test(test_run_one_sample_has_its_closed_form),
        cmocka_unit_test(test_run_same_sample_with_both_labels_ends_between),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
