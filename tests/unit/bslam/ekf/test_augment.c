#include "covariance.h"
#include "support.h"
#include "twin.h"
#include "plain_settings.h"

#include <math.h>

/// In double the finite differences of the expected Jacobians limit the comparison; in float some hundred
/// roundings of numbers of order 1 (positions up to 10 m).
#define TOLERANCE (BSLAM_REAL_DOUBLE ? 1e-8 : 5e-5)

/// A few roundings of a covariance below 1, or of its factor.
#define ROUNDED (32 * UNIT_ROUNDING)

static const bslam_pose_t mount = {BSLAM_R(0.2), BSLAM_R(-0.1), BSLAM_R(0.4)};

/// A filter with two points and one ray, with velocity states so that more than the pose stands before the
/// map; and sensor states, or not.
static bslam_ekf_t filter_that_doubts(bslam_settings_t *settings, unit_random_t *random, bool doubts_sensor)
{
    *settings = unit_settings();
    settings->velocity_states = 1;
    settings->sensor_doubt = doubts_sensor ? 1 : 0;
    bslam_ekf_t ekf;
    twin_randomise(&ekf, settings, random, 2, 1);
    return ekf;
}

static bslam_ekf_t random_filter(bslam_settings_t *settings, unit_random_t *random)
{
    return filter_that_doubts(settings, random, false);
}

/// The state with `count` values appended that are functions of the state and of noise n (with covariance q)
/// after it: the augment step, with Jacobians by finite differences. The function's argument is (state,
/// noise).
static twin_t augmented(const bslam_ekf_t *ekf, unit_function_t function, int count, const double *noise_var,
                        int noise_count, const void *context)
{
    const twin_t before = twin_of(ekf);
    const int n = ekf->dim;
    double in[UNIT_ARGUMENTS_MAX] = {0};
    twin_values(ekf, in);
    double added[UNIT_RESULTS_MAX];
    function(in, added, context);
    // (state, noise) -> (state, added), and the covariance of (state, noise).
    dense_t jacobian = dense_zero(n + count, n + noise_count);
    dense_t joint = dense_zero(n + noise_count, n + noise_count);
    twin_t after = {.mean = dense_zero(n + count, 1)};
    for (int i = 0; i < n; i++) {
        jacobian.at[i][i] = 1;
        after.mean.at[i][0] = before.mean.at[i][0];
        memcpy(joint.at[i], before.covariance.at[i], (size_t)n * sizeof joint.at[i][0]);
    }
    for (int k = 0; k < noise_count; k++) {
        joint.at[n + k][n + k] = noise_var[k];
    }
    for (int k = 0; k < count; k++) {
        after.mean.at[n + k][0] = added[k];
        for (int j = 0; j < n + noise_count; j++) {
            jacobian.at[n + k][j] = unit_derivative(function, in, n + noise_count, k, j, context);
        }
    }
    after.covariance = dense_sandwich(&jacobian, &joint);
    return after;
}

// ---- adding -----------------------------------------------------------------------------------------------

typedef struct adding {
    const bslam_ekf_t *ekf;
    int dim;  // where the noise stands among the arguments
    double range_m;
    double bearing_rad;
} adding_t;

/// What a sensor at a pose measured, at its point.
static void point_seen(const double pose[3], double range_m, double bearing_rad, double *out)
{
    out[0] = pose[0] + range_m * cos(pose[2] + bearing_rad);
    out[1] = pose[1] + range_m * sin(pose[2] + bearing_rad);
}

/// Noise: of the distance, of the direction.
static void new_point(const double *in, double *out, const void *context)
{
    const adding_t *a = context;
    double pose[3], scale;
    twin_sensor(a->ekf, &mount, in, pose, &scale);
    point_seen(pose, (a->range_m + in[a->dim]) / scale, a->bearing_rad + in[a->dim + 1], out);
}

/// Noise: of the distance, of the direction, of the scale.
static void new_sized(const double *in, double *out, const void *context)
{
    const adding_t *a = context;
    double pose[3], scale;
    twin_sensor(a->ekf, &mount, in, pose, &scale);
    out[2] = 1 + in[a->dim + 2];
    point_seen(pose, (a->range_m + in[a->dim]) / scale / out[2], a->bearing_rad + in[a->dim + 1], out);
}

/// Noise: of the direction, of the inverse distance.
static void new_ray(const double *in, double *out, const void *context)
{
    const adding_t *a = context;
    double pose[3], scale;
    twin_sensor(a->ekf, &mount, in, pose, &scale);
    out[0] = pose[0];
    out[1] = pose[1];
    out[2] = pose[2] + a->bearing_rad + in[a->dim];
    out[3] = 0.2 + in[a->dim + 1];
}

static void test_add_point_is_the_augment_step(void **state)
{
    unit_random_t random = {1};
    for (int i = 0; i < 20; i++) {
        bslam_settings_t settings;
        bslam_ekf_t ekf = filter_that_doubts(&settings, &random, i % 2 == 1);
        const double range_m = unit_random(&random, 0.5, 8);
        const double bearing = unit_random(&random, -3.14, 3.14);
        const double range_sd2 = 0.01 * 0.01 + pow(0.02 * range_m, 2) + pow(0.01 * range_m * range_m, 2);
        const double noise_var[] = {range_sd2, 0.02 * 0.02};
        const adding_t adding = {&ekf, ekf.dim, range_m, bearing};
        const twin_t expected = augmented(&ekf, new_point, 2, noise_var, 2, &adding);
        const bslam_sighting_t sighting = unit_polar(bearing, range_m, 7);
        int index;
        assert_int_equal(bslam_ekf_add(&ekf, &settings, &mount, &sighting, &index), BSLAM_OK);
        assert_int_equal(index, 3);
        assert_int_equal(ekf.beacons[index].kind, BSLAM_BEACON_POINT);
        twin_assert(&ekf, &expected, TOLERANCE);
    }
}

static void test_add_sized_is_the_augment_step(void **state)
{
    unit_random_t random = {15};
    for (int i = 0; i < 20; i++) {
        bslam_settings_t settings;
        bslam_ekf_t ekf = filter_that_doubts(&settings, &random, i % 2 == 1);
        settings.range_scale_sd = i % 4 == 3 ? 0 : BSLAM_R(0.07);
        const double range_m = unit_random(&random, 0.5, 8);
        const double bearing = unit_random(&random, -3.14, 3.14);
        const double range_sd2 = 0.01 * 0.01 + pow(0.02 * range_m, 2) + pow(0.01 * range_m * range_m, 2);
        const double own_sd = i % 2 == 0 ? 0 : 0.12;  // what the detector says goes before the parameter
        const double scale_sd = own_sd > 0 ? own_sd : 0.07;
        const double noise_var[] = {range_sd2, 0.02 * 0.02, scale_sd * scale_sd};
        const adding_t adding = {&ekf, ekf.dim, range_m, bearing};
        const twin_t expected = augmented(&ekf, new_sized, 3, noise_var, 3, &adding);
        bslam_sighting_t sighting = unit_polar(bearing, range_m, 7);
        sighting.range_scale_sd = (bslam_real_t)own_sd;
        int index;
        assert_int_equal(bslam_ekf_add(&ekf, &settings, &mount, &sighting, &index), BSLAM_OK);
        assert_int_equal(ekf.beacons[index].kind, BSLAM_BEACON_SIZED);
        assert_int_equal(ekf.sized_count, 1);
        twin_assert(&ekf, &expected, TOLERANCE);
    }
}

static void test_add_sized_beyond_their_room_are_points(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.range_scale_sd = BSLAM_R(0.07);
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    const bslam_sighting_t polar = unit_polar(0.1, 3, 5);
    for (int i = 0; i < BSLAM_BEACONS_MAX; i++) {
        int index;
        assert_int_equal(bslam_ekf_add(&ekf, &settings, &mount, &polar, &index), BSLAM_OK);
        assert_int_equal(ekf.beacons[index].kind,
                         i < 2 * BSLAM_RAYS_MAX ? BSLAM_BEACON_SIZED : BSLAM_BEACON_POINT);
    }
    assert_true(ekf.dim <= BSLAM_STATE_MAX);
}

static void test_add_sized_where_rays_took_their_room_is_a_point(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.range_scale_sd = BSLAM_R(0.07);
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    const bslam_sighting_t ray = unit_direction(0.3, 1);
    const bslam_sighting_t polar = unit_polar(0.1, 3, 5);
    int index;
    for (int i = 0; i < BSLAM_RAYS_MAX && i < BSLAM_BEACONS_MAX - 1; i++) {
        assert_int_equal(bslam_ekf_add(&ekf, &settings, &mount, &ray, &index), BSLAM_OK);
    }
    const bool has_room = ekf.ray_count < BSLAM_RAYS_MAX;
    assert_int_equal(bslam_ekf_add(&ekf, &settings, &mount, &polar, &index), BSLAM_OK);
    assert_int_equal(ekf.beacons[index].kind, has_room ? BSLAM_BEACON_SIZED : BSLAM_BEACON_POINT);
}

static void test_add_ray_is_the_augment_step(void **state)
{
    unit_random_t random = {2};
    for (int i = 0; i < 20; i++) {
        bslam_settings_t settings;
        bslam_ekf_t ekf = filter_that_doubts(&settings, &random, i % 2 == 1);
        const double bearing = unit_random(&random, -3.14, 3.14);
        // Direction variance times 2 where no distance comes with it; inverse distance 0.2 with sd 0.1.
        const double noise_var[] = {2 * 0.02 * 0.02, 0.1 * 0.1};
        const adding_t adding = {&ekf, ekf.dim, 0, bearing};
        const twin_t expected = augmented(&ekf, new_ray, 4, noise_var, 2, &adding);
        const bslam_sighting_t sighting = unit_direction(bearing, 7);
        int index;
        assert_int_equal(bslam_ekf_add(&ekf, &settings, &mount, &sighting, &index), BSLAM_OK);
        assert_int_equal(ekf.beacons[index].kind, BSLAM_BEACON_RAY);
        assert_int_equal(ekf.ray_count, 2);
        twin_assert(&ekf, &expected, TOLERANCE);
    }
}

/// Adds with add_one until the map is full; then another changes no byte and is refused.
static void assert_fills_up(bslam_ekf_t *ekf, const bslam_settings_t *settings, bslam_sighting_t sighting,
                            int room)
{
    int index;
    for (int i = 0; i < room; i++) {
        assert_int_equal(bslam_ekf_add(ekf, settings, &mount, &sighting, &index), BSLAM_OK);
        assert_int_equal(ekf->beacons[index].uid, i);
    }
    bslam_ekf_t before;
    memcpy(&before, ekf, sizeof before);
    assert_int_equal(bslam_ekf_add(ekf, settings, &mount, &sighting, &index), BSLAM_E_MAP_FULL);
    assert_memory_equal(ekf, &before, sizeof before);
}

static void test_add_points_beyond_the_map_are_refused(void **state)
{
    bslam_settings_t settings = unit_settings();
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    assert_fills_up(&ekf, &settings, unit_polar(0.3, 2, 1), BSLAM_BEACONS_MAX);
    int index;
    assert_int_equal(bslam_ekf_add_known(&ekf, 1, 2, &index), BSLAM_E_MAP_FULL);
}

static void test_add_rays_beyond_their_number_are_refused_but_points_are_not(void **state)
{
    bslam_settings_t settings = unit_settings();
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    assert_fills_up(&ekf, &settings, unit_direction(0.3, 1), BSLAM_RAYS_MAX);
    const bslam_sighting_t polar = unit_polar(0.1, 3, 5);
    int index;
    assert_int_equal(bslam_ekf_add(&ekf, &settings, &mount, &polar, &index),
                     BSLAM_RAYS_MAX < BSLAM_BEACONS_MAX ? BSLAM_OK : BSLAM_E_MAP_FULL);
}

static void test_add_known_takes_no_room_in_the_state(void **state)
{
    unit_random_t random = {3};
    bslam_settings_t settings;
    bslam_ekf_t ekf = random_filter(&settings, &random);
    const twin_t expected = twin_of(&ekf);
    int index;
    assert_int_equal(bslam_ekf_add_known(&ekf, 3, -4, &index), BSLAM_OK);
    twin_assert(&ekf, &expected, 0);
    bslam_real_t x;
    bslam_real_t y;
    bslam_ekf_beacon_position(&ekf, index, &x, &y);
    assert_true(x == 3 && y == -4);
    assert_true(ekf.beacons[index].confirmed);
}

// ---- removing ---------------------------------------------------------------------------------------------

/// A state without values first to first + count - 1.
static twin_t twin_without(const twin_t *twin, int first, int count)
{
    return (twin_t){.mean = dense_without(&twin->mean, first, count),
                    .covariance = dense_without(&twin->covariance, first, count)};
}

/// Points, rays and known beacons mixed: every second removal hits another kind.
static bslam_ekf_t mixed_filter(bslam_settings_t *settings, unit_random_t *random)
{
    bslam_ekf_t ekf = random_filter(settings, random);
    int index;
    assert_int_equal(bslam_ekf_add_known(&ekf, 3, -4, &index), BSLAM_OK);
    const bslam_sighting_t polar = unit_polar(0.5, 3, 9);
    settings->range_scale_sd = BSLAM_R(0.1);
    assert_int_equal(bslam_ekf_add(&ekf, settings, &mount, &polar, &index), BSLAM_OK);
    assert_int_equal(ekf.beacons[index].kind, BSLAM_BEACON_SIZED);
    settings->range_scale_sd = 0;
    assert_int_equal(bslam_ekf_add(&ekf, settings, &mount, &polar, &index), BSLAM_OK);
    return ekf;
}

static void test_remove_any_beacon_leaves_the_others(void **state)
{
    unit_random_t random = {4};
    bslam_settings_t settings;
    const bslam_ekf_t full = mixed_filter(&settings, &random);
    for (int gone = 0; gone < full.beacon_count; gone++) {
        bslam_ekf_t ekf = full;
        const bslam_beacon_t *removed = &full.beacons[gone];
        const twin_t whole = twin_of(&full);
        const twin_t expected = twin_without(&whole, removed->at, bslam_beacon_dim(removed->kind));
        bslam_ekf_remove(&ekf, gone);
        twin_assert(&ekf, &expected, ROUNDED);
        covariance_assert_sound(&ekf.factor);
        assert_int_equal(ekf.beacon_count, full.beacon_count - 1);
        assert_int_equal(ekf.ray_count, full.ray_count - (removed->kind == BSLAM_BEACON_RAY ? 1 : 0));
        assert_int_equal(ekf.sized_count, full.sized_count - (removed->kind == BSLAM_BEACON_SIZED ? 1 : 0));
        for (int b = 0; b < ekf.beacon_count; b++) {
            const int from = b < gone ? b : b + 1;
            bslam_real_t x[2];
            bslam_real_t y[2];
            bslam_ekf_beacon_position(&ekf, b, &x[0], &y[0]);
            bslam_ekf_beacon_position(&full, from, &x[1], &y[1]);
            assert_true(x[0] == x[1] && y[0] == y[1]);
            assert_int_equal(ekf.beacons[b].uid, full.beacons[from].uid);
        }
    }
}

static void test_remove_then_add_again_is_as_if_it_had_never_been_there(void **state)
{
    unit_random_t random = {5};
    bslam_settings_t settings;
    const bslam_ekf_t full = mixed_filter(&settings, &random);
    const bslam_sighting_t direction = unit_direction(-0.4, 3);
    // The last beacon is a point: in one filter it goes and comes back after the ray, in the other it never
    // was.
    bslam_ekf_t a = full;
    bslam_ekf_t b = full;
    const int last = full.beacon_count - 1;
    const bslam_sighting_t polar = unit_polar(0.7, 4, 9);
    int index;
    bslam_ekf_remove(&b, last);
    assert_int_equal(bslam_ekf_add(&a, &settings, &mount, &polar, &index), BSLAM_OK);
    bslam_ekf_remove(&a, index);
    bslam_ekf_remove(&a, last);
    assert_int_equal(bslam_ekf_add(&a, &settings, &mount, &direction, &index), BSLAM_OK);
    assert_int_equal(bslam_ekf_add(&b, &settings, &mount, &direction, &index), BSLAM_OK);
    const twin_t expected = twin_of(&b);
    twin_assert(&a, &expected, ROUNDED);
    // A number is never given twice.
    assert_int_equal(a.beacons[index].uid, b.beacons[index].uid + 1);
}

static void test_remove_down_to_the_last_beacon_and_fill_again(void **state)
{
    unit_random_t random = {6};
    bslam_settings_t settings;
    bslam_ekf_t ekf = mixed_filter(&settings, &random);
    const int base = ekf.base_dim;
    while (ekf.beacon_count > 0) {
        bslam_ekf_remove(&ekf, ekf.beacon_count / 2);
    }
    assert_int_equal(ekf.dim, base);
    assert_int_equal(ekf.ray_count, 0);
    const bslam_sighting_t polar = unit_polar(0.3, 3, 1);
    for (int i = 0; i < BSLAM_BEACONS_MAX; i++) {
        int index;
        assert_int_equal(bslam_ekf_add(&ekf, &settings, &mount, &polar, &index), BSLAM_OK);
        assert_int_equal(index, i);
    }
    assert_true(bslam_ekf_is_sane(&ekf));
}

// ---- rays into points -------------------------------------------------------------------------------------

/// The ray's point, as a function of the state; context: where the ray stands.
static void point_of_ray(const double *in, double *out, const void *context)
{
    const double *ray = &in[*(const int *)context];
    out[0] = ray[0] + cos(ray[2]) / ray[3];
    out[1] = ray[1] + sin(ray[2]) / ray[3];
}

/// A filter whose ray, beacon 2 of 4, is so well known that it is a point.
static bslam_ekf_t filter_with_settled_ray(bslam_settings_t *settings, unit_random_t *random)
{
    bslam_ekf_t ekf = random_filter(settings, random);
    const bslam_sighting_t polar = unit_polar(0.5, 3, 9);
    int index;
    assert_int_equal(bslam_ekf_add(&ekf, settings, &mount, &polar, &index), BSLAM_OK);
    // The same correlations with a deviation 300 times smaller.
    dense_t by = dense_identity(ekf.dim);
    by.at[ekf.beacons[2].at + 3][ekf.beacons[2].at + 3] = 1.0 / 300;
    const dense_t before = covariance_of(&ekf), after = dense_sandwich(&by, &before);
    covariance_set(&ekf, &after);
    return ekf;
}

static void test_settle_ray_becomes_its_point_with_the_covariance_of_the_change(void **state)
{
    unit_random_t random = {7};
    for (int i = 0; i < 20; i++) {
        bslam_settings_t settings;
        bslam_ekf_t ekf = filter_with_settled_ray(&settings, &random);
        const int at = ekf.beacons[2].at;
        const twin_t both = augmented(&ekf, point_of_ray, 2, NULL, 0, &at);
        const twin_t expected = twin_without(&both, at, 4);
        assert_true(bslam_ekf_settle_ray(&ekf, &settings, &mount, 2));
        assert_int_equal(ekf.beacons[2].kind, BSLAM_BEACON_POINT);
        assert_int_equal(ekf.ray_count, 0);
        // The slope by the inverse distance is distance², up to 80.
        twin_assert(&ekf, &expected, TOLERANCE * 10);
    }
}

/// Civera's index of beacon 2 as the header's MATH has it: 4 sd(distance) |cos(parallax)| / distance from the
/// sensor.
static double linearity_index(const bslam_ekf_t *ekf)
{
    double values[DENSE_MAX];
    twin_values(ekf, values);
    const int at = ekf->beacons[2].at;
    double point[2];
    point_of_ray(values, point, &at);
    double pose[3], scale;
    twin_sensor(ekf, &mount, values, pose, &scale);
    const double x = pose[0], y = pose[1];
    const double distance = hypot(point[0] - x, point[1] - y);
    const double variance = (double)bslam_ekf_covariance(ekf, at + 3, at + 3);
    const double distance_sd = sqrt(variance) / (values[at + 3] * values[at + 3]);
    const double parallax = unit_angle_between(atan2(point[1] - y, point[0] - x), values[at + 2]);
    return 4 * distance_sd * fabs(cos(parallax)) / distance;
}

static void test_settle_ray_happens_where_its_index_falls_below_the_limit(void **state)
{
    unit_random_t random = {8};
    for (int i = 0; i < 20; i++) {
        bslam_settings_t settings;
        const bslam_ekf_t ekf = random_filter(&settings, &random);
        const double index = linearity_index(&ekf);
        bslam_ekf_t copy = ekf;
        settings.ray_linear_limit = real(index * 0.999);
        assert_false(bslam_ekf_settle_ray(&copy, &settings, &mount, 2));
        assert_memory_equal(&copy, &ekf, sizeof copy);
        settings.ray_linear_limit = real(index * 1.001);
        assert_true(bslam_ekf_settle_ray(&copy, &settings, &mount, 2));
    }
}

static void test_settle_ray_what_is_no_ray_stays(void **state)
{
    unit_random_t random = {9};
    bslam_settings_t settings;
    bslam_ekf_t ekf = mixed_filter(&settings, &random);
    const bslam_ekf_t before = ekf;
    for (int b = 0; b < ekf.beacon_count; b++) {
        if (ekf.beacons[b].kind != BSLAM_BEACON_RAY) {
            assert_false(bslam_ekf_settle_ray(&ekf, &settings, &mount, b));
        }
    }
    assert_memory_equal(&ekf, &before, sizeof ekf);
}

static void test_settle_ray_without_a_positive_variance_stays(void **state)
{
    unit_random_t random = {15};
    bslam_settings_t settings;
    bslam_ekf_t ekf = filter_with_settled_ray(&settings, &random);
    const int at = ekf.beacons[2].at + 3;
    ekf.mean[at] = BSLAM_R(0.2);
    covariance_forget(&ekf, at, 0);
    assert_false(bslam_ekf_settle_ray(&ekf, &settings, &mount, 2));
    covariance_break(&ekf, at, 1);
    assert_false(bslam_ekf_settle_ray(&ekf, &settings, &mount, 2));
}

static void test_settle_ray_without_a_positive_inverse_distance_stays(void **state)
{
    static const double inverses[] = {0, -0.2, 1e-4, NAN};
    unit_random_t random = {10};
    for (int i = 0; i < COUNT_OF(inverses); i++) {
        bslam_settings_t settings;
        bslam_ekf_t ekf = filter_with_settled_ray(&settings, &random);
        ekf.mean[ekf.beacons[2].at + 3] = real(inverses[i]);
        assert_false(bslam_ekf_settle_ray(&ekf, &settings, &mount, 2));
        assert_int_equal(ekf.beacons[2].kind, BSLAM_BEACON_RAY);
    }
}

// ---- scales -----------------------------------------------------------------------------------------------

typedef struct measuring {
    const bslam_ekf_t *ekf;
    int dim;  // where the noise stands among the arguments
    int at;   // where the ray does
    double range_m;
} measuring_t;

/// The point of a ray that is as far from the sensor as was measured, and its scale. Noise: of the distance,
/// of the scale.
static void new_on_ray(const double *in, double *out, const void *context)
{
    const measuring_t *m = context;
    double pose[3], scale;
    twin_sensor(m->ekf, &mount, in, pose, &scale);
    const double *ray = &in[m->at];
    out[2] = 1 + in[m->dim + 1];
    const double range_m = (m->range_m + in[m->dim]) / scale / out[2];
    const double along = (pose[0] - ray[0]) * cos(ray[2]) + (pose[1] - ray[1]) * sin(ray[2]);
    const double across = (pose[0] - ray[0]) * sin(ray[2]) - (pose[1] - ray[1]) * cos(ray[2]);
    const double length = along + sqrt(range_m * range_m - across * across);
    out[0] = ray[0] + length * cos(ray[2]);
    out[1] = ray[1] + length * sin(ray[2]);
}

/// The distance as it is measured of the point that is so far along beacon 2, a ray; and how much of it lies
/// along the ray.
static double range_along_ray(const bslam_ekf_t *ekf, double length_m, double *cosine)
{
    double in[UNIT_ARGUMENTS_MAX] = {0};
    twin_values(ekf, in);
    double pose[3], scale;
    twin_sensor(ekf, &mount, in, pose, &scale);
    const double *ray = &in[ekf->beacons[2].at];
    const double dx = ray[0] + length_m * cos(ray[2]) - pose[0];
    const double dy = ray[1] + length_m * sin(ray[2]) - pose[1];
    *cosine = (dx * cos(ray[2]) + dy * sin(ray[2])) / hypot(dx, dy);
    return hypot(dx, dy) * scale;
}

static void test_measure_ray_is_the_place_where_the_distance_ends(void **state)
{
    unit_random_t random = {21};
    int measured = 0;
    for (int i = 0; i < 60; i++) {
        bslam_settings_t settings;
        bslam_ekf_t ekf = filter_that_doubts(&settings, &random, i % 2 == 1);
        double cosine;
        const double range_m = range_along_ray(&ekf, unit_random(&random, 1, 8), &cosine);
        if (cosine < 0.55) {
            continue;
        }
        measured++;
        const int at = ekf.beacons[2].at;
        const double range_sd2 = 0.01 * 0.01 + pow(0.02 * range_m, 2) + pow(0.01 * range_m * range_m, 2);
        const double noise_var[] = {range_sd2, 0.09 * 0.09};
        const measuring_t measuring = {&ekf, ekf.dim, at, range_m};
        const twin_t both = augmented(&ekf, new_on_ray, 3, noise_var, 2, &measuring);
        const twin_t expected = twin_without(&both, at, 4);
        const bslam_sighting_t sighting = unit_polar(3, range_m, 7);  // its direction is not asked for
        assert_true(bslam_ekf_measure_ray(&ekf, &settings, &mount, &sighting, 2, BSLAM_R(0.0081)));
        assert_int_equal(ekf.beacons[2].kind, BSLAM_BEACON_SIZED);
        assert_int_equal(ekf.ray_count, 0);
        assert_int_equal(ekf.sized_count, 1);
        twin_assert(&ekf, &expected, TOLERANCE * 10);
    }
    assert_in_range(measured, 20, 60);
}

static void test_measure_ray_that_the_distance_does_not_end_on_stays(void **state)
{
    unit_random_t random = {22};
    bslam_settings_t settings;
    bslam_ekf_t ekf = random_filter(&settings, &random);
    bslam_real_t *ray = &ekf.mean[ekf.beacons[2].at];
    ekf.mean[BSLAM_STATE_X] = 0;
    ekf.mean[BSLAM_STATE_Y] = 0;
    ekf.mean[BSLAM_STATE_THETA] = 0;  // the sensor is at (.2, -.1)
    ray[0] = BSLAM_R(0.2);
    ray[1] = BSLAM_R(-2.1);
    ray[2] = 0;  // passes the sensor 2 m away
    const bslam_ekf_t before = ekf;
    static const double ranges_m[] = {1.9, 2.0, 2.2, 2.3};  // short of it, or too much across
    for (int i = 0; i < COUNT_OF(ranges_m); i++) {
        const bslam_sighting_t seen = unit_polar(0, ranges_m[i], 7);
        assert_false(bslam_ekf_measure_ray(&ekf, &settings, &mount, &seen, 2, BSLAM_R(0.01)));
    }
    const bslam_sighting_t seen = unit_polar(0, 4, 7);
    assert_false(bslam_ekf_measure_ray(&ekf, &settings, &mount, &seen, 0, BSLAM_R(0.01)));  // a point
    assert_memory_equal(&ekf, &before, sizeof ekf);
    ray[0] = 6;  // begins behind where the distance ends
    assert_false(bslam_ekf_measure_ray(&ekf, &settings, &mount, &seen, 2, BSLAM_R(0.01)));
    ray[0] = BSLAM_R(0.2);
    assert_true(bslam_ekf_measure_ray(&ekf, &settings, &mount, &seen, 2, BSLAM_R(0.01)));
}

typedef struct giving {
    int at;   // where the point stands among the arguments
    int dim;  // where the noise of the scale does
} giving_t;

static void new_scale(const double *in, double *out, const void *context)
{
    const giving_t *g = context;
    out[0] = in[g->at];
    out[1] = in[g->at + 1];
    out[2] = 1 + in[g->dim];
}

static void test_give_scale_puts_a_value_of_its_own_behind_the_point(void **state)
{
    unit_random_t random = {23};
    bslam_settings_t settings;
    bslam_ekf_t ekf = random_filter(&settings, &random);
    const giving_t giving = {ekf.beacons[0].at, ekf.dim};
    const double noise_var[] = {0.0049};
    const twin_t both = augmented(&ekf, new_scale, 3, noise_var, 1, &giving);
    const twin_t expected = twin_without(&both, giving.at, 2);
    const int next = ekf.beacons[1].at, ray = ekf.beacons[2].at;
    assert_true(bslam_ekf_give_scale(&ekf, 0, BSLAM_R(0.0049)));
    assert_int_equal(ekf.beacons[0].kind, BSLAM_BEACON_SIZED);
    assert_int_equal(ekf.sized_count, 1);
    assert_int_equal(ekf.beacons[0].at, ekf.dim - 3);  // behind all others
    assert_int_equal(ekf.beacons[1].at, next - 2);
    assert_int_equal(ekf.beacons[2].at, ray - 2);
    twin_assert(&ekf, &expected, TOLERANCE);
    const bslam_ekf_t before = ekf;
    assert_false(bslam_ekf_give_scale(&ekf, 0, BSLAM_R(0.01)));  // has one
    assert_false(bslam_ekf_give_scale(&ekf, 2, BSLAM_R(0.01)));  // a ray
    assert_memory_equal(&ekf, &before, sizeof ekf);
}

static void test_give_scale_beyond_their_room_is_not_done(void **state)
{
    const bslam_settings_t settings = unit_settings();
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    int index;
    const bslam_sighting_t point = unit_polar(0.3, 3, 1), ray = unit_direction(0.1, 2);
    assert_int_equal(bslam_ekf_add(&ekf, &settings, &mount, &point, &index), BSLAM_OK);
    for (int i = 0; i < BSLAM_RAYS_MAX && ekf.beacon_count < BSLAM_BEACONS_MAX; i++) {
        assert_int_equal(bslam_ekf_add(&ekf, &settings, &mount, &ray, &index), BSLAM_OK);
    }
    if (ekf.ray_count < BSLAM_RAYS_MAX) {  // as many rays as beacons: they never take all the room
        ekf.ray_count = BSLAM_RAYS_MAX;
    }
    const bslam_ekf_t before = ekf;
    assert_false(bslam_ekf_give_scale(&ekf, 0, BSLAM_R(0.01)));
    assert_memory_equal(&ekf, &before, sizeof ekf);
}

/// The filter with a sized beacon, whose scale was doubted so much at first.
static bslam_ekf_t with_sized(bslam_settings_t *settings, double scale_sd, int *index)
{
    unit_random_t random = {24};
    bslam_ekf_t ekf = random_filter(settings, &random);
    bslam_sighting_t sighting = unit_polar(0.7, 4, 7);
    sighting.range_scale_sd = real(scale_sd);
    assert_int_equal(bslam_ekf_add(&ekf, settings, &mount, &sighting, index), BSLAM_OK);
    return ekf;
}

/// All else is then as if the scale had been so doubtful from the start, and is not known any more.
static void test_renew_scale_leaves_what_hung_on_it_as_doubtful_as_it_would_have_been(void **state)
{
    bslam_settings_t settings;
    int index;
    bslam_ekf_t ekf = with_sized(&settings, 0.05, &index);
    const bslam_ekf_t sure = ekf;
    const bslam_ekf_t doubted = with_sized(&settings, sqrt(0.0025 + 0.01), &index);
    const int at = ekf.beacons[index].at + 2;
    ekf.mean[at] = BSLAM_R(1.2);
    twin_t expected = twin_of(&ekf);
    expected.covariance = twin_of(&doubted).covariance;
    for (int i = 0; i < ekf.dim; i++) {
        expected.covariance.at[i][at] = expected.covariance.at[at][i] = i == at ? 0.0125 : 0;
    }
    expected.mean.at[at][0] = 1;
    bslam_ekf_renew_scale(&ekf, index, BSLAM_R(0.0025), BSLAM_R(0.01));
    twin_assert(&ekf, &expected, TOLERANCE);
    assert_true(bslam_ekf_covariance(&ekf, at - 2, at - 2) >
                BSLAM_R(1.1) * bslam_ekf_covariance(&sure, at - 2, at - 2));
    const bslam_ekf_t before = ekf;
    bslam_ekf_renew_scale(&ekf, 0, BSLAM_R(0.01), BSLAM_R(0.01));  // a point
    bslam_ekf_renew_scale(&ekf, 2, BSLAM_R(0.01), BSLAM_R(0.01));  // a ray
    assert_memory_equal(&ekf, &before, sizeof ekf);
}

/// Whatever was said of it before: a scale that is doubted more than was told adds doubt all the same.
static void test_renew_scale_never_takes_doubt_away(void **state)
{
    static const double scale_vars[] = {0, 1e-8, 1e-4, 0.0025, 0.2};
    for (size_t i = 0; i < sizeof scale_vars / sizeof scale_vars[0]; i++) {
        bslam_settings_t settings;
        int index;
        bslam_ekf_t ekf = with_sized(&settings, 0.05, &index);
        const bslam_ekf_t before = ekf;
        bslam_ekf_renew_scale(&ekf, index, real(scale_vars[i]), BSLAM_R(0.01));
        for (int k = 0; k < ekf.dim; k++) {
            const bool is_scale = k == ekf.beacons[index].at + 2;
            const double was = is_scale ? scale_vars[i] : (double)bslam_ekf_covariance(&before, k, k);
            assert_true((double)bslam_ekf_covariance(&ekf, k, k) >= was * (1 - 1e-5));
        }
        covariance_assert_sound(&ekf.factor);
    }
}

// ---- queries ----------------------------------------------------------------------------------------------

static void test_beacon_position_and_covariance_of_a_ray_are_those_of_its_point(void **state)
{
    unit_random_t random = {11};
    for (int i = 0; i < 20; i++) {
        bslam_settings_t settings;
        const bslam_ekf_t ekf = random_filter(&settings, &random);
        const int at = ekf.beacons[2].at;
        const twin_t expected = augmented(&ekf, point_of_ray, 2, NULL, 0, &at);
        const int n = ekf.dim;
        bslam_real_t x;
        bslam_real_t y;
        bslam_ekf_beacon_position(&ekf, 2, &x, &y);
        assert_near(x, expected.mean.at[n][0], TOLERANCE);
        assert_near(y, expected.mean.at[n + 1][0], TOLERANCE);
        const bslam_sym2_t covariance = bslam_ekf_beacon_covariance(&ekf, 2);
        assert_near(covariance.xx, expected.covariance.at[n][n], TOLERANCE * 10);
        assert_near(covariance.xy, expected.covariance.at[n + 1][n], TOLERANCE * 10);
        assert_near(covariance.yy, expected.covariance.at[n + 1][n + 1], TOLERANCE * 10);
    }
}

static void test_beacon_position_of_a_ray_at_infinity_is_a_kilometre_along_it(void **state)
{
    static const double inverses[] = {0, -1, 1e-9};
    unit_random_t random = {12};
    bslam_settings_t settings;
    bslam_ekf_t ekf = random_filter(&settings, &random);
    const int at = ekf.beacons[2].at;
    for (int i = 0; i < COUNT_OF(inverses); i++) {
        ekf.mean[at + 3] = real(inverses[i]);
        bslam_real_t x;
        bslam_real_t y;
        bslam_ekf_beacon_position(&ekf, 2, &x, &y);
        const double distance = hypot((double)x - (double)ekf.mean[at], (double)y - (double)ekf.mean[at + 1]);
        assert_near(distance, 1000, 1000 * 16 * UNIT_ROUNDING);
    }
}

static void test_beacon_covariance_of_a_point_is_its_block(void **state)
{
    unit_random_t random = {13};
    bslam_settings_t settings;
    const bslam_ekf_t ekf = random_filter(&settings, &random);
    const int at = ekf.beacons[1].at;
    const bslam_sym2_t covariance = bslam_ekf_beacon_covariance(&ekf, 1);
    assert_true(covariance.xx == bslam_ekf_covariance(&ekf, at, at));
    assert_true(covariance.xy == bslam_ekf_covariance(&ekf, at, at + 1));
    assert_true(covariance.yy == bslam_ekf_covariance(&ekf, at + 1, at + 1));
}

static void test_is_sane_finds_every_bad_value(void **state)
{
    static const double bad[] = {NAN, INFINITY, -INFINITY};
    unit_random_t random = {14};
    bslam_settings_t settings;
    const bslam_ekf_t good = random_filter(&settings, &random);
    assert_true(bslam_ekf_is_sane(&good));
    for (int at = 0; at < good.dim; at++) {
        for (int i = 0; i < COUNT_OF(bad); i++) {
            bslam_ekf_t ekf = good;
            ekf.mean[at] = real(bad[i]);
            assert_false(bslam_ekf_is_sane(&ekf));
            ekf = good;
            ekf.factor.d[bslam_ekf_place(&ekf, at)] = real(bad[i]);
            assert_false(bslam_ekf_is_sane(&ekf));
        }
        bslam_ekf_t ekf = good;
        ekf.factor.d[bslam_ekf_place(&ekf, at)] = real(-1e-6);
        assert_false(bslam_ekf_is_sane(&ekf));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_add_point_is_the_augment_step),
        cmocka_unit_test(test_add_sized_is_the_augment_step),
        cmocka_unit_test(test_add_sized_beyond_their_room_are_points),
        cmocka_unit_test(test_add_sized_where_rays_took_their_room_is_a_point),
        cmocka_unit_test(test_add_ray_is_the_augment_step),
        cmocka_unit_test(test_add_points_beyond_the_map_are_refused),
        cmocka_unit_test(test_add_rays_beyond_their_number_are_refused_but_points_are_not),
        cmocka_unit_test(test_add_known_takes_no_room_in_the_state),

        cmocka_unit_test(test_remove_any_beacon_leaves_the_others),
        cmocka_unit_test(test_remove_then_add_again_is_as_if_it_had_never_been_there),
        cmocka_unit_test(test_remove_down_to_the_last_beacon_and_fill_again),

        cmocka_unit_test(test_settle_ray_becomes_its_point_with_the_covariance_of_the_change),
        cmocka_unit_test(test_settle_ray_happens_where_its_index_falls_below_the_limit),
        cmocka_unit_test(test_settle_ray_what_is_no_ray_stays),
        cmocka_unit_test(test_settle_ray_without_a_positive_variance_stays),
        cmocka_unit_test(test_settle_ray_without_a_positive_inverse_distance_stays),
        cmocka_unit_test(test_measure_ray_is_the_place_where_the_distance_ends),
        cmocka_unit_test(test_measure_ray_that_the_distance_does_not_end_on_stays),
        cmocka_unit_test(test_give_scale_puts_a_value_of_its_own_behind_the_point),
        cmocka_unit_test(test_give_scale_beyond_their_room_is_not_done),
        cmocka_unit_test(test_renew_scale_leaves_what_hung_on_it_as_doubtful_as_it_would_have_been),
        cmocka_unit_test(test_renew_scale_never_takes_doubt_away),

        cmocka_unit_test(test_beacon_position_and_covariance_of_a_ray_are_those_of_its_point),
        cmocka_unit_test(test_beacon_position_of_a_ray_at_infinity_is_a_kilometre_along_it),
        cmocka_unit_test(test_beacon_covariance_of_a_point_is_its_block),
        cmocka_unit_test(test_is_sane_finds_every_bad_value),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
