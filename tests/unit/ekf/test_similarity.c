// The similarity form: what it makes of a covariance is A P Aᵀ, and growth of the world stays as doubtful.
#include <math.h>

#include "support.h"
#include "twin.h"

#include "bslam/ekf/internal.h"

#define TOLERANCE (BSLAM_REAL_DOUBLE ? 1e-8 : 3e-4)

static const bslam_pose_t mount = {BSLAM_R(0.2), BSLAM_R(-0.1), BSLAM_R(0.4)};

static bslam_params_t similarity_params(void)
{
    bslam_params_t params = unit_params();
    params.filter = BSLAM_FILTER_SIMILARITY;
    params.velocity_states = 1;
    params.mount_x_m = mount.x_m;
    params.mount_y_m = mount.y_m;
    params.mount_yaw_rad = mount.theta_rad;
    return params;
}

/// How the state changes where the world grows, from the definition: all lengths and speeds times exp(s).
static dense_t growth(const bslam_ekf_t *ekf)
{
    dense_t t = dense_zero(ekf->dim, 1);
    t.at[0][0] = (double)ekf->mean[0];
    t.at[1][0] = (double)ekf->mean[1];
    t.at[BSLAM_STATE_FORWARD][0] = (double)ekf->mean[BSLAM_STATE_FORWARD];
    for (int b = 0; b < ekf->beacon_count; b++) {
        const int at = ekf->beacons[b].at;
        t.at[at][0] = (double)ekf->mean[at];
        t.at[at + 1][0] = (double)ekf->mean[at + 1];
        if (ekf->beacons[b].kind == BSLAM_BEACON_RAY) {
            t.at[at + 3][0] = -(double)ekf->mean[at + 3];
        }
    }
    return t;
}

typedef struct looking {
    const bslam_ekf_t *ekf;
    int beacon;
} looking_t;

static void log_range(const double *in, double *out, const void *context)
{
    const looking_t *looking = context;
    double bearing_rad;
    twin_observe(looking->ekf, &mount, looking->beacon, in, &out[0], &bearing_rad);
    out[0] = log(out[0]);
}

/// The mean gradient of all log distances by finite differences, weighted, of which `t` is 1.
static dense_t gauge_of(const bslam_ekf_t *ekf, const dense_t *p, const dense_t *t)
{
    double state[DENSE_MAX];
    double norm = 0;
    dense_t c = dense_zero(1, ekf->dim);
    twin_values(ekf, state);
    for (int b = 0; b < ekf->beacon_count; b++) {
        const looking_t looking = {ekf, b};
        dense_t row = dense_zero(1, ekf->dim);
        for (int i = 0; i < ekf->dim; i++) {
            row.at[0][i] = unit_derivative(log_range, state, ekf->dim, 0, i, &looking);
        }
        const double variance = dense_sandwich(&row, p).at[0][0] + 1e-6;
        for (int i = 0; i < ekf->dim; i++) {
            c.at[0][i] += row.at[0][i] / variance;
        }
    }
    for (int i = 0; i < ekf->dim; i++) {
        norm += c.at[0][i] * t->at[i][0];
    }
    for (int i = 0; i < ekf->dim; i++) {
        c.at[0][i] /= norm;
    }
    return c;
}

static bslam_ekf_t random_filter(const bslam_params_t *params, uint64_t seed)
{
    bslam_ekf_t ekf;
    unit_random_t random = {seed};
    twin_randomise(&ekf, params, &random, 3, 2);
    return ekf;
}

static void test_covariance_is_that_of_the_sandwich(void **state)
{
    for (uint64_t seed = 1; seed <= 5; seed++) {
        const bslam_params_t params = similarity_params();
        bslam_ekf_t ekf = random_filter(&params, seed);
        unit_random_t random = {seed + 100};
        twin_t twin = twin_of(&ekf);
        const dense_t before = growth(&ekf);
        const dense_t c = gauge_of(&ekf, &twin.covariance, &before);
        assert_true(bslam_ekf_note_scale(&ekf, &params));
        for (int i = 0; i < ekf.dim; i++) {
            ekf.mean[i] += real(unit_random(&random, -0.1, 0.1));
            twin.mean.at[i][0] = (double)ekf.mean[i];
        }
        bslam_ekf_scale_covariance(&ekf);
        const dense_t after = growth(&ekf);
        const dense_t change = dense_difference(&after, &before);
        const dense_t outer = dense_product(&change, &c);
        const dense_t identity = dense_identity(ekf.dim);
        const dense_t a = dense_sum(&identity, &outer);
        twin.covariance = dense_sandwich(&a, &twin.covariance);
        twin_assert(&ekf, &twin, TOLERANCE);
        // Which takes the old growth to the new one.
        const dense_t moved = dense_product(&a, &before);
        for (int i = 0; i < ekf.dim; i++) {
            assert_near(moved.at[i][0], after.at[i][0], 1e-9);
        }
    }
}

static void test_directions_tell_nothing_of_the_size_of_the_world(void **state)
{
    // A world of which nobody knows how large it is: information along its growth stays what it was, whatever
    // directions are fused; in the invariant form it does not.
    double information[2][2];
    for (int k = 0; k < 2; k++) {
        bslam_params_t params = similarity_params();
        params.filter = k == 0 ? BSLAM_FILTER_SIMILARITY : BSLAM_FILTER_INVARIANT;
        params.mount_x_m = 0;
        params.mount_y_m = 0;
        const bslam_pose_t axle = {0, 0, params.mount_yaw_rad};
        bslam_ekf_t ekf = random_filter(&params, 4);
        unit_random_t random = {9};
        for (int frame = 0; frame <= 20; frame++) {
            const twin_t twin = twin_of(&ekf);
            const dense_t t = growth(&ekf);
            const dense_t t_row = dense_transposed(&t);
            const dense_t inverse = dense_inverse(&twin.covariance);
            information[k][frame == 0 ? 0 : 1] = dense_sandwich(&t_row, &inverse).at[0][0];
            for (int b = 0; b < ekf.beacon_count; b++) {
                double values[DENSE_MAX];
                double range_m;
                double bearing_rad;
                bslam_innovation_t innovation;
                bslam_fusion_t fusion;
                twin_values(&ekf, values);
                twin_observe(&ekf, &axle, b, values, &range_m, &bearing_rad);
                const bslam_sighting_t seen =
                    unit_direction(bearing_rad + unit_random(&random, -0.05, 0.05), b);
                assert_int_equal(bslam_ekf_innovation(&ekf, &params, &axle, &seen, b, &innovation), BSLAM_OK);
                assert_int_equal(bslam_ekf_fuse(&ekf, &params, &innovation, &fusion), BSLAM_OK);
            }
            bslam_ekf_correct(&ekf, &params);
        }
    }
    assert_near(information[0][1] / information[0][0], 1, BSLAM_REAL_DOUBLE ? 1e-12 : 1e-3);
    assert_true(!BSLAM_REAL_DOUBLE || fabs(information[1][1] / information[1][0] - 1) > 1e-4);
}

static void test_without_a_distance_it_is_the_invariant_form(void **state)
{
    const bslam_params_t params = similarity_params();
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &params);
    assert_false(bslam_ekf_note_scale(&ekf, &params));
    int index;
    assert_int_equal(bslam_ekf_add_known(&ekf, 1, 2, &index), BSLAM_OK);
    assert_false(bslam_ekf_note_scale(&ekf, &params));  // a known place tells the scale
}

/// A ray from (0, 0) ahead, of this inverse distance, for a sensor at (x, 0).
static bool one_ray_tells_the_scale(double inverse_per_m, double x_m)
{
    bslam_params_t params = similarity_params();
    params.mount_x_m = 0;
    params.mount_y_m = 0;
    const bslam_pose_t axle = {0, 0, params.mount_yaw_rad};
    const bslam_sighting_t seen = unit_direction(-(double)params.mount_yaw_rad, 0);
    bslam_ekf_t ekf;
    int index;
    bslam_ekf_init(&ekf, &params);
    assert_int_equal(bslam_ekf_add(&ekf, &params, &axle, &seen, &index), BSLAM_OK);
    ekf.mean[ekf.beacons[index].at + 3] = real(inverse_per_m);
    ekf.mean[BSLAM_STATE_X] = real(x_m);
    return bslam_ekf_note_scale(&ekf, &params);
}

static void test_beacon_without_a_positive_distance_tells_no_scale(void **state)
{
    static const double nowhere_per_m[] = {0, -0.25, NAN};  // at infinity, behind it, no number
    assert_true(one_ray_tells_the_scale(0.25, 0));
    for (int i = 0; i < COUNT_OF(nowhere_per_m); i++) {
        assert_false(one_ray_tells_the_scale(nowhere_per_m[i], 0));
    }
    assert_true(one_ray_tells_the_scale(0.25, 3));
    assert_false(one_ray_tells_the_scale(0.25, 4));  // the sensor is where it is
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_covariance_is_that_of_the_sandwich),
        cmocka_unit_test(test_directions_tell_nothing_of_the_size_of_the_world),
        cmocka_unit_test(test_without_a_distance_it_is_the_invariant_form),
        cmocka_unit_test(test_beacon_without_a_positive_distance_tells_no_scale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
