// The pipeline against runs whose result an independent implementation in NumPy has computed:
// tests/vectors/filter_runs.h, written by tests/python/reference/make_vectors.py.
#include "support.h"

#include <math.h>

#include "bslam/internal.h"

/// One step: what the wheels report, how many sightings follow, and the size of the state after it.
typedef struct vector_step {
    int64_t time_us;
    double left_m;
    double right_m;
    int sighting_count;
    int dim;
} vector_step_t;

/// range_m is 0 where it is seen bearing-only.
typedef struct vector_sighting {
    int32_t label;
    double bearing_rad;
    double range_m;
} vector_sighting_t;

// For each run: its settings, its steps, the sightings of all steps in a row, and likewise the expected
// means and lower triangles of the covariance.
#include "../vectors/filter_runs.h"

/// In standard deviations of the value. In double the digits of the file limit the comparison (a position of
/// 1 m has 1e-12 m, a deviation may be 1 cm); in float rounding gives up to 1e-3 over thousands of steps.
#define TOLERANCE (BSLAM_REAL_DOUBLE ? 1e-8 : 1e-3)

/// Better known than this does not count as better known: an anchor of the first frame is known exactly.
#define DEVIATION_MIN 1e-3

typedef struct run {
    const vector_step_t *steps;
    int step_count;
    const vector_sighting_t *sightings;
    const double *means;
    const double *covariances;
} run_t;

static double deviation(const double *lower, int i)
{
    return fmax(sqrt(lower[i * (i + 1) / 2 + i]), DEVIATION_MIN);
}

static void assert_state(const bslam_ekf_t *ekf, const double *mean, const double *lower)
{
    for (int i = 0; i < ekf->dim; i++) {
        const double difference = (double)ekf->mean[i] - mean[i];
        // An angle may be a turn off; a position of the run is nowhere near that far off.
        const double off = fabs(difference) > 6 ? unit_angle_between(difference, 0) : difference;
        assert_near(off / deviation(lower, i), 0, TOLERANCE);
        for (int j = 0; j <= i; j++) {
            const double scale = deviation(lower, i) * deviation(lower, j);
            const double expected = lower[i * (i + 1) / 2 + j];
            assert_near((double)bslam_ekf_covariance(ekf, i, j) / scale, expected / scale, TOLERANCE);
        }
    }
}

static void take_step(bslam_slam_t *slam, const vector_step_t *step, const vector_sighting_t *sightings)
{
    const bslam_odometry_reading_t reading = {.time_us = step->time_us,
                                              .source = BSLAM_ODOMETRY_WHEELS,
                                              .left_m = real(step->left_m),
                                              .right_m = real(step->right_m)};
    assert_int_equal(bslam_slam_odometry(slam, &reading), BSLAM_OK);
    bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX];
    for (int i = 0; i < step->sighting_count; i++) {
        const vector_sighting_t *s = &sightings[i];
        seen[i] = s->range_m > 0 ? unit_polar(s->bearing_rad, s->range_m, s->label)
                                 : unit_direction(s->bearing_rad, s->label);
    }
    assert_int_equal(bslam_slam_sightings(slam, step->time_us, seen, step->sighting_count), BSLAM_OK);
}

static void assert_run(const bslam_settings_t *settings, run_t run)
{
    bslam_slam_t slam;
    int bad_id = -1;
    assert_int_equal(bslam_slam_init(&slam, settings, &bad_id), BSLAM_OK);
    for (int k = 0; k < run.step_count; k++) {
        const vector_step_t *step = &run.steps[k];
        take_step(&slam, step, run.sightings);
        assert_int_equal(slam.ekf.dim, step->dim);
        assert_state(&slam.ekf, run.means, run.covariances);
        run.sightings += step->sighting_count;
        run.means += step->dim;
        run.covariances += step->dim * (step->dim + 1) / 2;
    }
}

#define RUN(name) \
    (run_t) \
    { \
        name##_steps, COUNT_OF(name##_steps), name##_sightings, name##_means, name##_covariances \
    }

static void test_run_standard_euler_is_the_references(void **state)
{
    bslam_settings_t settings;
    standard_params(&settings);
    assert_run(&settings, RUN(standard));
}

static void test_run_invariant_arc_velocity_is_the_references(void **state)
{
    bslam_settings_t settings;
    invariant_params(&settings);
    assert_run(&settings, RUN(invariant));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_run_standard_euler_is_the_references),
        cmocka_unit_test(test_run_invariant_arc_velocity_is_the_references),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
