#include "support.h"

#include <math.h>

#include "bslam/model/noise.h"
#include "bslam/model/observation.h"
#include "plain_settings.h"

/// Arguments of the models in a test: the robot's pose, the sensor on it, then the beacon's values or a
/// sighting's.
enum { X, Y, THETA, MOUNT_X, MOUNT_Y, MOUNT_YAW, REST };
/// Results: STRETCH is the log of a point's distance, and of a ray's distance times its inverse distance.
enum { RANGE, BEARING, STRETCH, RESULTS };

#define POINT_ARGUMENTS (REST + 2)
#define RAY_ARGUMENTS (REST + 4)
#define TESTED 500

// ---- the models again, in double, from their definitions --------------------------------------------------

/// Sighting of the point (px, py). context: a bearing near which to keep the result, so that it has no jump
/// at pi.
static void see(const double *in, double px, double py, double *out, const void *context)
{
    const double s = sin(in[THETA]);
    const double c = cos(in[THETA]);
    const double dx = px - (in[X] + c * in[MOUNT_X] - s * in[MOUNT_Y]);
    const double dy = py - (in[Y] + s * in[MOUNT_X] + c * in[MOUNT_Y]);
    const double bearing = atan2(dy, dx) - in[THETA] - in[MOUNT_YAW];
    const double base = context != NULL ? *(const double *)context : 0;
    out[RANGE] = hypot(dx, dy);
    out[BEARING] = base + unit_angle_between(bearing, base);
    out[STRETCH] = log(out[RANGE]);
}

static void see_point(const double *in, double *out, const void *context)
{
    see(in, in[REST], in[REST + 1], out, context);
}

static void see_ray(const double *in, double *out, const void *context)
{
    const double distance = 1 / in[REST + 3];
    see(in, in[REST] + distance * cos(in[REST + 2]), in[REST + 1] + distance * sin(in[REST + 2]), out,
        context);
    out[STRETCH] -= log(distance);
}

/// in[REST] = range, in[REST + 1] = bearing.
static void locate(const double *in, double *out, const void *context)
{
    (void)context;
    const double s = sin(in[THETA]);
    const double c = cos(in[THETA]);
    const double direction = in[THETA] + in[MOUNT_YAW] + in[REST + 1];
    out[X] = in[X] + c * in[MOUNT_X] - s * in[MOUNT_Y] + in[REST] * cos(direction);
    out[Y] = in[Y] + s * in[MOUNT_X] + c * in[MOUNT_Y] + in[REST] * sin(direction);
}

/// in = anchor x, y, direction, inverse distance.
static void to_point(const double *in, double *out, const void *context)
{
    (void)context;
    out[X] = in[0] + cos(in[2]) / in[3];
    out[Y] = in[1] + sin(in[2]) / in[3];
}

// ---- inputs -----------------------------------------------------------------------------------------------

static void random_pose_and_mount(unit_random_t *random, double *in)
{
    in[X] = unit_random(random, -10, 10);
    in[Y] = unit_random(random, -10, 10);
    in[THETA] = unit_random(random, -3.14159, 3.14159);
    in[MOUNT_X] = unit_random(random, -0.5, 0.5);
    in[MOUNT_Y] = unit_random(random, -0.5, 0.5);
    in[MOUNT_YAW] = unit_random(random, -3.14159, 3.14159);
}

static void round_all(double *in, int count)
{
    for (int i = 0; i < count; i++) {
        in[i] = (double)real(in[i]);
    }
}

/// A pose, a mount, and a point that is 1 to 15 m from the sensor.
static void random_point_case(unit_random_t *random, double *in)
{
    double located[2];
    random_pose_and_mount(random, in);
    in[REST] = unit_random(random, 1, 15);
    in[REST + 1] = unit_random(random, -3.14159, 3.14159);
    locate(in, located, NULL);
    memcpy(&in[REST], located, sizeof located);
    round_all(in, POINT_ARGUMENTS);
}

/// A pose, a mount, and a ray whose point is 1 to 15 m from the sensor; the anchor lies anywhere within 10 m
/// of it.
static void random_ray_case(unit_random_t *random, double *in)
{
    random_point_case(random, in);
    const double direction = unit_random(random, -3.14159, 3.14159);
    const double distance = unit_random(random, 1, 10);
    in[REST] -= distance * cos(direction);
    in[REST + 1] -= distance * sin(direction);
    in[REST + 2] = direction;
    in[REST + 3] = 1 / distance;
    round_all(in, RAY_ARGUMENTS);
}

static bslam_pose_t pose_of(const double *in)
{
    return (bslam_pose_t){real(in[0]), real(in[1]), real(in[2])};
}

static bslam_status_t observe(const double *in, int count, bslam_observation_t *seen)
{
    const bslam_pose_t pose = pose_of(in);
    const bslam_pose_t mount = pose_of(&in[MOUNT_X]);
    if (count == POINT_ARGUMENTS) {
        return bslam_observe_point(&pose, &mount, real(in[REST]), real(in[REST + 1]), seen);
    }
    const bslam_real_t ray[BSLAM_RAY_DIM] = {real(in[REST]), real(in[REST + 1]), real(in[REST + 2]),
                                             real(in[REST + 3])};
    return bslam_observe_ray(&pose, &mount, ray, seen);
}

/// Roundings of coordinates up to 30 m; seen from 1 m on, as angles too. Sine and arc tangent are not better
/// either.
#define VALUE_ERROR (1e-12 + 300 * UNIT_ROUNDING)
/// Finite differences: 1e-15 of rounding at 30 m over a step of 2e-5; and roundings as above.
#define SLOPE_ERROR (1e-9 + 300 * UNIT_ROUNDING)

/// The derivatives of one result: by the pose, and by the beacon's values.
static void assert_slopes(const double *in, int count, unit_function_t model, int row,
                          const double *bearing_rad, const bslam_real_t by_pose[3],
                          const bslam_real_t *by_beacon)
{
    for (int k = 0; k < 3; k++) {
        assert_near(by_pose[k], unit_derivative(model, in, count, row, k, bearing_rad), SLOPE_ERROR);
    }
    for (int k = 0; k < count - REST; k++) {
        // By the inverse distance the slope is distance^2, up to 100.
        const double scale = k == 3 ? 100 : k == 2 ? 10 : 1;
        assert_near(by_beacon[k], unit_derivative(model, in, count, row, REST + k, bearing_rad),
                    SLOPE_ERROR * scale);
    }
}

static void assert_is_the_model(const double *in, int count, unit_function_t model)
{
    bslam_observation_t seen;
    double expected[RESULTS];
    assert_int_equal(observe(in, count, &seen), BSLAM_OK);
    model(in, expected, NULL);
    assert_near(seen.range_m, expected[RANGE], VALUE_ERROR);
    assert_near(unit_angle_between((double)seen.bearing_rad, expected[BEARING]), 0, VALUE_ERROR);
    assert_true(fabs((double)seen.bearing_rad) < 3.14160);
    const double *bearing = &expected[BEARING];
    assert_slopes(in, count, model, RANGE, bearing, seen.range_by_pose, seen.range_by_beacon);
    assert_slopes(in, count, model, BEARING, bearing, seen.bearing_by_pose, seen.bearing_by_beacon);
    assert_slopes(in, count, model, STRETCH, bearing, seen.stretch_by_pose, seen.stretch_by_beacon);
}

// ---- points -----------------------------------------------------------------------------------------------

static void test_observe_point_value_and_jacobians_are_the_models(void **state)
{
    unit_random_t random = {1};
    for (int i = 0; i < TESTED; i++) {
        double in[POINT_ARGUMENTS];
        random_point_case(&random, in);
        assert_is_the_model(in, POINT_ARGUMENTS, see_point);
    }
}

static void test_observe_point_straight_behind_has_a_bearing_of_pi(void **state)
{
    const double in[POINT_ARGUMENTS] = {0, 0, 0, 0, 0, 0, -3, 0};
    bslam_observation_t seen;
    assert_int_equal(observe(in, POINT_ARGUMENTS, &seen), BSLAM_OK);
    assert_near(seen.bearing_rad, 3.14159265358979324, 4 * UNIT_ROUNDING);
    assert_true(seen.range_m == 3);
}

/// A point at this distance in front of a sensor that is itself off the robot's axle.
static bslam_status_t observe_at(double distance, bslam_observation_t *seen)
{
    const double in[POINT_ARGUMENTS] = {0, 0, 0, 0, 0.25, 0, distance, 0.25};
    return observe(in, POINT_ARGUMENTS, seen);
}

static void test_observe_point_at_the_sensor_is_singular_and_changes_nothing(void **state)
{
    static const double distances[] = {0, 0.0005, -0.0009, NAN};
    for (int i = 0; i < COUNT_OF(distances); i++) {
        bslam_observation_t seen;
        bslam_observation_t before;
        memset(&seen, 0x5a, sizeof seen);
        memcpy(&before, &seen, sizeof seen);
        assert_int_equal(observe_at(distances[i], &seen), BSLAM_E_SINGULAR);
        assert_memory_equal(&seen, &before, sizeof seen);
    }
    bslam_observation_t seen;
    assert_int_equal(observe_at(0.0011, &seen), BSLAM_OK);
    assert_near(seen.range_m, 0.0011, UNIT_ROUNDING);
}

// ---- rays -------------------------------------------------------------------------------------------------

static void test_observe_ray_value_and_jacobians_are_the_models(void **state)
{
    unit_random_t random = {2};
    for (int i = 0; i < TESTED; i++) {
        double in[RAY_ARGUMENTS];
        random_ray_case(&random, in);
        assert_is_the_model(in, RAY_ARGUMENTS, see_ray);
    }
}

static void test_observe_ray_sees_what_observe_point_sees_at_its_point(void **state)
{
    unit_random_t random = {3};
    for (int i = 0; i < TESTED; i++) {
        double in[RAY_ARGUMENTS];
        random_ray_case(&random, in);
        double point[POINT_ARGUMENTS];
        memcpy(point, in, REST * sizeof *in);
        to_point(&in[REST], &point[REST], NULL);
        bslam_observation_t by_ray;
        bslam_observation_t by_point;
        assert_int_equal(observe(in, RAY_ARGUMENTS, &by_ray), BSLAM_OK);
        assert_int_equal(observe(point, POINT_ARGUMENTS, &by_point), BSLAM_OK);
        assert_near(by_ray.range_m, by_point.range_m, VALUE_ERROR);
        assert_near(unit_angle_between((double)by_ray.bearing_rad, (double)by_point.bearing_rad), 0,
                    VALUE_ERROR);
        for (int k = 0; k < 3; k++) {
            assert_near(by_ray.range_by_pose[k], by_point.range_by_pose[k], VALUE_ERROR * 2);
            assert_near(by_ray.bearing_by_pose[k], by_point.bearing_by_pose[k], VALUE_ERROR * 2);
        }
    }
}

static void test_observe_ray_at_infinity_has_its_direction_and_no_range(void **state)
{
    // Anchor and robot apart: at infinity that makes no difference to the bearing.
    const double in[RAY_ARGUMENTS] = {3, -2, 0.5, 0.1, 0.2, 0.3, 7, 8, 1.3, 0};
    bslam_observation_t seen;
    assert_int_equal(observe(in, RAY_ARGUMENTS, &seen), BSLAM_OK);
    assert_near(seen.bearing_rad, 1.3 - 0.5 - 0.3, 16 * UNIT_ROUNDING);
    assert_true(seen.range_m == 0);
    assert_near(seen.bearing_by_pose[X], 0, 0);
    assert_near(seen.bearing_by_pose[Y], 0, 0);
    assert_near(seen.bearing_by_pose[THETA], -1, 0);
    assert_near(seen.bearing_by_beacon[2], 1, 8 * UNIT_ROUNDING);
    for (int k = 0; k < 3; k++) {
        assert_true(seen.range_by_pose[k] == 0);
    }
    for (int k = 0; k < BSLAM_RAY_DIM; k++) {
        assert_true(seen.range_by_beacon[k] == 0);
    }
    // By the inverse distance: how the baseline, across the direction, turns the bearing: (a - p) x u.
    const double sensor_x = 3 + cos(0.5) * 0.1 - sin(0.5) * 0.2;
    const double sensor_y = -2 + sin(0.5) * 0.1 + cos(0.5) * 0.2;
    const double across = (8 - sensor_y) * cos(1.3) - (7 - sensor_x) * sin(1.3);
    assert_near(seen.bearing_by_beacon[3], across, VALUE_ERROR);
    // And how the baseline, along the direction, stretches g: (a - p) . u.
    const double along = (7 - sensor_x) * cos(1.3) + (8 - sensor_y) * sin(1.3);
    assert_near(seen.stretch_by_beacon[3], along, VALUE_ERROR);
}

static void test_observe_ray_beyond_infinity_is_finite_and_has_no_range(void **state)
{
    const double in[RAY_ARGUMENTS] = {3, -2, 0.5, 0, 0, 0, 7, 8, 1.3, -0.05};
    bslam_observation_t seen;
    assert_int_equal(observe(in, RAY_ARGUMENTS, &seen), BSLAM_OK);
    assert_true(seen.range_m == 0);
    // g = inverse (anchor - sensor) + direction.
    const double gx = -0.05 * 4 + cos(1.3);
    const double gy = -0.05 * 10 + sin(1.3);
    assert_near(seen.bearing_rad, atan2(gy, gx) - 0.5, VALUE_ERROR);
}

static void test_observe_ray_at_the_sensor_is_singular_and_changes_nothing(void **state)
{
    static const double at_sensor[][4] = {
        {-2, 0, 0, 0.5},                                // the point anchor + 2 m is the origin
        {-1.9995, 0, 0, 0.5},                           // half a millimetre off
        {-2, 0, 3.0, NAN},                              // no number
        {NAN, 0, 3.0, 0.5},   {-9999.995, 0, 0, 1e-4},  // 5 mm off, in a ray so long that g vanishes in float
    };
    for (int i = 0; i < COUNT_OF(at_sensor); i++) {
        double in[RAY_ARGUMENTS] = {0};
        memcpy(&in[REST], at_sensor[i], sizeof at_sensor[i]);
        bslam_observation_t seen;
        bslam_observation_t before;
        memset(&seen, 0x5a, sizeof seen);
        memcpy(&before, &seen, sizeof seen);
        assert_int_equal(observe(in, RAY_ARGUMENTS, &seen), BSLAM_E_SINGULAR);
        assert_memory_equal(&seen, &before, sizeof seen);
    }
}

static void test_ray_to_point_value_and_jacobian_are_the_models(void **state)
{
    unit_random_t random = {4};
    for (int i = 0; i < TESTED; i++) {
        double in[RAY_ARGUMENTS];
        random_ray_case(&random, in);
        const double *values = &in[REST];
        const bslam_real_t ray[BSLAM_RAY_DIM] = {real(values[0]), real(values[1]), real(values[2]),
                                                 real(values[3])};
        const bslam_ray_point_t point = bslam_ray_to_point(ray);
        double expected[2];
        to_point(values, expected, NULL);
        assert_near(point.x_m, expected[X], VALUE_ERROR);
        assert_near(point.y_m, expected[Y], VALUE_ERROR);
        for (int k = 0; k < BSLAM_RAY_DIM; k++) {
            // By the inverse distance the slope is distance^2, up to 100.
            assert_near(point.x_by_ray[k], unit_derivative(to_point, values, BSLAM_RAY_DIM, X, k, NULL),
                        SLOPE_ERROR * 100);
            assert_near(point.y_by_ray[k], unit_derivative(to_point, values, BSLAM_RAY_DIM, Y, k, NULL),
                        SLOPE_ERROR * 100);
        }
    }
}

// ---- the inverse ------------------------------------------------------------------------------------------

static void test_locate_point_value_and_jacobian_are_the_models(void **state)
{
    unit_random_t random = {5};
    for (int i = 0; i < TESTED; i++) {
        double in[POINT_ARGUMENTS];
        random_pose_and_mount(&random, in);
        in[REST] = unit_random(&random, 0.1, 15);
        in[REST + 1] = unit_random(&random, -3.14159, 3.14159);
        round_all(in, POINT_ARGUMENTS);
        const bslam_pose_t pose = pose_of(in);
        const bslam_pose_t mount = pose_of(&in[MOUNT_X]);
        const bslam_sighted_point_t point =
            bslam_locate_point(&pose, &mount, real(in[REST]), real(in[REST + 1]));
        double expected[2];
        locate(in, expected, NULL);
        assert_near(point.x_m, expected[X], VALUE_ERROR);
        assert_near(point.y_m, expected[Y], VALUE_ERROR);
        const struct {
            double value;
            int row;
            int column;
        } slopes[] = {
            {(double)point.x_by_theta, X, THETA},      {(double)point.y_by_theta, Y, THETA},
            {(double)point.x_by_range, X, REST},       {(double)point.y_by_range, Y, REST},
            {(double)point.x_by_bearing, X, REST + 1}, {(double)point.y_by_bearing, Y, REST + 1},
        };
        for (int k = 0; k < COUNT_OF(slopes); k++) {
            assert_near(slopes[k].value,
                        unit_derivative(locate, in, POINT_ARGUMENTS, slopes[k].row, slopes[k].column, NULL),
                        SLOPE_ERROR);
        }
    }
}

static void test_locate_point_undoes_observe_point(void **state)
{
    unit_random_t random = {6};
    for (int i = 0; i < TESTED; i++) {
        double in[POINT_ARGUMENTS];
        random_point_case(&random, in);
        const bslam_pose_t pose = pose_of(in);
        const bslam_pose_t mount = pose_of(&in[MOUNT_X]);
        bslam_observation_t seen;
        assert_int_equal(observe(in, POINT_ARGUMENTS, &seen), BSLAM_OK);
        const bslam_sighted_point_t point = bslam_locate_point(&pose, &mount, seen.range_m, seen.bearing_rad);
        // The bearing's error at 15 m.
        assert_near(point.x_m, in[REST], VALUE_ERROR * 4);
        assert_near(point.y_m, in[REST + 1], VALUE_ERROR * 4);
    }
}

// ---- noise ------------------------------------------------------------------------------------------------

static void test_range_variance_is_the_sum_of_its_three_parts(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.range_sd_floor_m = BSLAM_R(0.5);
    settings.range_sd_fraction = BSLAM_R(0.25);
    settings.range_sd_per_m = BSLAM_R(0.125);
    const bslam_sighting_t sighting = {.range_m = 4, .has_range = true};
    // At 4 m: 0.25 + 1 + 4.
    assert_near(bslam_range_variance_m2(&settings, &sighting, 4), 5.25, 16 * UNIT_ROUNDING);
    assert_near(bslam_range_variance_m2(&settings, &sighting, 0), 0.25, UNIT_ROUNDING);
}

static void test_range_variance_of_the_detector_is_in_proportion_to_the_predicted_distance(void **state)
{
    const bslam_settings_t settings = unit_settings();
    const bslam_sighting_t sighting = {.range_m = 4, .has_range = true, .range_sd_m = BSLAM_R(0.5)};
    assert_near(bslam_range_variance_m2(&settings, &sighting, 4), 0.25, 0);
    assert_near(bslam_range_variance_m2(&settings, &sighting, 8), 1, 0);
}

static void test_unknown_scale_is_the_detector_s_or_the_parameter_s(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.range_scale_sd = BSLAM_R(0.5);
    bslam_sighting_t sighting = {.range_m = 4, .has_range = true};
    assert_near(bslam_unknown_scale_var(&settings, &sighting), 0.25, 0);
    sighting.range_scale_sd = BSLAM_R(0.125);
    assert_near(bslam_unknown_scale_var(&settings, &sighting), 0.015625, 0);
}

static void test_correlation_factor_without_a_length_is_one(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.correlation_m = 0;
    assert_near(bslam_correlation_factor(&settings, 0), 1, 0);
    assert_near(bslam_correlation_factor(&settings, 5), 1, 0);
}

/// Of errors e_k with correlation rho from one to the next, a sighting adds (1 - rho) / (1 + rho) of its
/// information: that is tanh(way / (2 length)), which the factor follows within 9 %.
static void test_correlation_factor_is_that_of_a_first_order_process(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.correlation_m = BSLAM_R(0.5);
    for (double travelled_m = 0.02; travelled_m < 5; travelled_m *= 1.3) {
        const double rho = exp(-travelled_m / 0.5);
        const double exact = (1 + rho) / (1 - rho);
        assert_near(bslam_correlation_factor(&settings, (bslam_real_t)travelled_m) / exact, 1, 0.09);
    }
}

static void test_correlation_factor_at_a_standstill_is_bounded(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.correlation_m = BSLAM_R(0.5);
    assert_near(bslam_correlation_factor(&settings, 0), 100.005, 1e-3);
}

static void test_bearing_variance_grows_by_its_factor_without_a_distance(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.bearing_sd_rad = BSLAM_R(0.5);
    settings.bearing_only_variance_factor = 3;
    bslam_sighting_t sighting = {.has_range = true};
    assert_near(bslam_bearing_variance_rad2(&settings, &sighting), 0.25, 0);
    sighting.has_range = false;
    assert_near(bslam_bearing_variance_rad2(&settings, &sighting), 0.75, 0);
    sighting.bearing_sd_rad = 1;
    assert_near(bslam_bearing_variance_rad2(&settings, &sighting), 3, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_observe_point_value_and_jacobians_are_the_models),
        cmocka_unit_test(test_observe_point_straight_behind_has_a_bearing_of_pi),
        cmocka_unit_test(test_observe_point_at_the_sensor_is_singular_and_changes_nothing),

        cmocka_unit_test(test_observe_ray_value_and_jacobians_are_the_models),
        cmocka_unit_test(test_observe_ray_sees_what_observe_point_sees_at_its_point),
        cmocka_unit_test(test_observe_ray_at_infinity_has_its_direction_and_no_range),
        cmocka_unit_test(test_observe_ray_beyond_infinity_is_finite_and_has_no_range),
        cmocka_unit_test(test_observe_ray_at_the_sensor_is_singular_and_changes_nothing),
        cmocka_unit_test(test_ray_to_point_value_and_jacobian_are_the_models),

        cmocka_unit_test(test_locate_point_value_and_jacobian_are_the_models),
        cmocka_unit_test(test_locate_point_undoes_observe_point),

        cmocka_unit_test(test_range_variance_is_the_sum_of_its_three_parts),
        cmocka_unit_test(test_range_variance_of_the_detector_is_in_proportion_to_the_predicted_distance),
        cmocka_unit_test(test_unknown_scale_is_the_detector_s_or_the_parameter_s),
        cmocka_unit_test(test_correlation_factor_without_a_length_is_one),
        cmocka_unit_test(test_correlation_factor_is_that_of_a_first_order_process),
        cmocka_unit_test(test_correlation_factor_at_a_standstill_is_bounded),
        cmocka_unit_test(test_bearing_variance_grows_by_its_factor_without_a_distance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
