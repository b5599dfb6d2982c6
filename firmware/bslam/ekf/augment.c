// The map: beacons come into the state, leave it, and turn from rays into points. MATH "State augmentation",
// "Bearing-only".
#include <string.h>

#include "bslam/ekf/ekf.h"
#include "bslam/ekf/ekf_internal.h"
#include "base/trig.h"
#include "bslam/model/noise.h"
#include "base/scalar.h"

/// A distance tells where on a ray a point is unless it lies more across the ray than this, as a cosine.
static const bslam_real_t ALONG_MIN = BSLAM_R(0.5);
/// A scale is never taken for surer than this, where doubt is added by a difference of variances.
static const bslam_real_t SCALE_VAR_MIN = BSLAM_R(1e-6);

// ---- growing ----------------------------------------------------------------------------------------------

/// A new state value: its derivatives by the robot's pose, and the variance that the sighting adds.
typedef struct new_value {
    const bslam_real_t *by_pose;
    bslam_real_t mean, own_var;
} new_value_t;

/// Writes the value and its row of P at the end of the state.
static void append_value(bslam_ekf_t *ekf, const new_value_t *value)
{
    const int at = ekf->dim;
    bslam_real_t *row = ekf->covariance + bslam_symmat_row(at);
    memset(row, 0, (size_t)BSLAM_SYMMAT_PADDED(at + 1) * sizeof *row);
    bslam_row_t by_pose = {.dim = 0};
    memcpy(by_pose.base, value->by_pose, sizeof by_pose.base);
    bslam_symmat_times(ekf->covariance, at, &by_pose, row);
    bslam_real_t variance = value->own_var;
    for (int k = 0; k < 3; k++) {
        variance += value->by_pose[k] * row[k];
    }
    row[at] = variance;
    ekf->mean[at] = value->mean;
    ekf->dim = at + 1;
}

/// The sighted point, with which the caller may go on. scale_var: of the scale that all its distances have.
static bslam_sighted_point_t append_point(bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                          const bslam_pose_t *mount, const bslam_sighting_t *sighting,
                                          bslam_real_t scale_var)
{
    const bslam_pose_t pose = bslam_ekf_pose(ekf);
    const bslam_sighted_point_t point =
        bslam_locate_point(&pose, mount, sighting->range_m, sighting->bearing_rad);
    const bslam_real_t range_var =
        bslam_scaled_range_variance_m2(settings, sighting, sighting->range_m, scale_var);
    const bslam_real_t bearing_var = bslam_bearing_variance_rad2(settings, sighting);
    const bslam_real_t x_by_pose[3] = {1, 0, point.x_by_theta};
    const bslam_real_t y_by_pose[3] = {0, 1, point.y_by_theta};
    const bslam_real_t xx = point.x_by_range * point.x_by_range * range_var +
                            point.x_by_bearing * point.x_by_bearing * bearing_var;
    const bslam_real_t yx = point.x_by_range * point.y_by_range * range_var +
                            point.x_by_bearing * point.y_by_bearing * bearing_var;
    const bslam_real_t yy = point.y_by_range * point.y_by_range * range_var +
                            point.y_by_bearing * point.y_by_bearing * bearing_var;
    const new_value_t x = {x_by_pose, point.x_m, xx};
    const new_value_t y = {y_by_pose, point.y_m, yy};
    const int at = ekf->dim;
    append_value(ekf, &x);
    append_value(ekf, &y);
    ekf->covariance[bslam_symmat_at(at + 1, at)] += yx;
    return point;
}

/// As a point, and the scale: where it is larger, the point is nearer.
static void append_sized(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *mount,
                         const bslam_sighting_t *sighting, bslam_real_t scale_var)
{
    static const bslam_real_t BY_NOTHING[3] = {0, 0, 0};
    const bslam_sighted_point_t point = append_point(ekf, settings, mount, sighting, scale_var);
    const bslam_real_t by_range = -scale_var * sighting->range_m;
    const new_value_t scale = {BY_NOTHING, 1, scale_var};
    const int at = ekf->dim;
    append_value(ekf, &scale);
    ekf->covariance[bslam_symmat_at(at, at - 2)] = by_range * point.x_by_range;
    ekf->covariance[bslam_symmat_at(at, at - 1)] = by_range * point.y_by_range;
}

/// Values of the state beyond two a beacon that there is room for.
static int room_of(const bslam_ekf_t *ekf)
{
    return 2 * (BSLAM_RAYS_MAX - ekf->ray_count) - ekf->sized_count;
}

static void append_ray(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *mount,
                       const bslam_sighting_t *sighting)
{
    const bslam_pose_t pose = bslam_ekf_pose(ekf);
    const bslam_sensor_t sensor = bslam_sensor_at(&pose, mount);
    const bslam_real_t x_by_pose[3] = {1, 0, sensor.x_by_theta};
    const bslam_real_t y_by_pose[3] = {0, 1, sensor.y_by_theta};
    const bslam_real_t direction_by_pose[3] = {0, 0, 1};
    const bslam_real_t distance_by_pose[3] = {0, 0, 0};
    const bslam_real_t direction_rad = bslam_angle_wrap(sensor.pose.theta_rad + sighting->bearing_rad);
    const bslam_real_t direction_var = bslam_bearing_variance_rad2(settings, sighting);
    const bslam_real_t sd = settings->ray_inverse_distance_sd_per_m;
    const new_value_t values[BSLAM_RAY_DIM] = {
        {x_by_pose, sensor.pose.x_m, 0},
        {y_by_pose, sensor.pose.y_m, 0},
        {direction_by_pose, direction_rad, direction_var},
        {distance_by_pose, settings->ray_inverse_distance_per_m, sd * sd},
    };
    for (int k = 0; k < BSLAM_RAY_DIM; k++) {
        append_value(ekf, &values[k]);
    }
}

/// The next free place, filled with a beacon of this kind whose state values begin at the end of the state.
static int append_beacon(bslam_ekf_t *ekf, bslam_beacon_kind_t kind)
{
    const int index = ekf->beacon_count;
    ekf->beacons[index] = (bslam_beacon_t){.uid = ekf->next_uid,
                                           .label = BSLAM_LABEL_NONE,
                                           .kind = kind,
                                           .at = kind == BSLAM_BEACON_KNOWN ? 0 : ekf->dim};
    ekf->next_uid++;
    ekf->beacon_count++;
    return index;
}

bslam_status_t bslam_ekf_add(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *mount,
                             const bslam_sighting_t *sighting, int *index)
{
    const bool ray = !sighting->has_range;
    const bslam_real_t scale_var = bslam_unknown_scale_var(settings, sighting);
    const int room = room_of(ekf);
    if (ekf->beacon_count == BSLAM_BEACONS_MAX || (ray && room < 2)) {
        return BSLAM_E_MAP_FULL;
    }
    if (ray) {
        *index = append_beacon(ekf, BSLAM_BEACON_RAY);
        append_ray(ekf, settings, mount, sighting);
        ekf->ray_count++;
    } else if (scale_var > 0 && room > 0) {
        *index = append_beacon(ekf, BSLAM_BEACON_SIZED);
        append_sized(ekf, settings, mount, sighting, scale_var);
        ekf->sized_count++;
    } else {
        *index = append_beacon(ekf, BSLAM_BEACON_POINT);
        (void)append_point(ekf, settings, mount, sighting, scale_var);
    }
    return BSLAM_OK;
}

bslam_status_t bslam_ekf_add_guess(bslam_ekf_t *ekf, bslam_real_t x_m, bslam_real_t y_m, bslam_real_t sd_m,
                                   int *index)
{
    static const bslam_real_t BY_NOTHING[3] = {0, 0, 0};
    if (ekf->beacon_count == BSLAM_BEACONS_MAX) {
        return BSLAM_E_MAP_FULL;
    }
    *index = append_beacon(ekf, BSLAM_BEACON_POINT);
    const new_value_t x = {BY_NOTHING, x_m, sd_m * sd_m};
    const new_value_t y = {BY_NOTHING, y_m, sd_m * sd_m};
    append_value(ekf, &x);
    append_value(ekf, &y);
    return BSLAM_OK;
}

bslam_status_t bslam_ekf_add_known(bslam_ekf_t *ekf, bslam_real_t x_m, bslam_real_t y_m, int *index)
{
    if (ekf->beacon_count == BSLAM_BEACONS_MAX) {
        return BSLAM_E_MAP_FULL;
    }
    *index = append_beacon(ekf, BSLAM_BEACON_KNOWN);
    ekf->beacons[*index].known_x_m = x_m;
    ekf->beacons[*index].known_y_m = y_m;
    ekf->beacons[*index].confirmed = true;
    return BSLAM_OK;
}

// ---- scales -----------------------------------------------------------------------------------------------

/// The value at `at` becomes the scale of a thing that was not seen yet.
static void begin_scale(bslam_ekf_t *ekf, int at, bslam_real_t scale_var)
{
    for (int j = 0; j < ekf->dim; j++) {
        bslam_symmat_set(ekf->covariance, at, j, j == at ? scale_var : 0);
    }
    ekf->mean[at] = 1;
}

/// Puts a place in for one more state value, which the caller fills; beacons behind it move down.
static void insert_value(bslam_ekf_t *ekf, int at)
{
    bslam_symmat_insert(ekf->covariance, ekf->dim, at);
    for (int i = ekf->dim; i > at; i--) {
        ekf->mean[i] = ekf->mean[i - 1];
    }
    ekf->dim++;
    for (int b = 0; b < ekf->beacon_count; b++) {
        if (ekf->beacons[b].at >= at) {
            ekf->beacons[b].at++;
        }
    }
}

bool bslam_ekf_give_scale(bslam_ekf_t *ekf, int index, bslam_real_t scale_var)
{
    bslam_beacon_t *beacon = &ekf->beacons[index];
    if (beacon->kind != BSLAM_BEACON_POINT || room_of(ekf) < 1) {
        return false;
    }
    const int at = beacon->at + BSLAM_POINT_DIM;
    insert_value(ekf, at);
    begin_scale(ekf, at, scale_var);
    beacon->kind = BSLAM_BEACON_SIZED;
    ekf->sized_count++;
    return true;
}

/// What hangs on a scale becomes as doubtful as if it had been doubted by more_var more from the start, when
/// it was by scale_var: a measurement of negative variance takes back what is too much.
static void doubt_scale(bslam_ekf_t *ekf, const bslam_settings_t *settings, int at, bslam_real_t scale_var,
                        bslam_real_t more_var)
{
    const bslam_real_t left_var = ekf->covariance[bslam_symmat_at(at, at)];
    bslam_real_t var = scale_var > left_var ? scale_var : left_var;
    var = var > SCALE_VAR_MIN ? var : SCALE_VAR_MIN;
    bslam_ekf_pin(ekf, at, 0, -(var + var * var / more_var));
    bslam_ekf_correct(ekf, settings);
}

void bslam_ekf_renew_scale(bslam_ekf_t *ekf, const bslam_settings_t *settings, int index,
                           bslam_real_t scale_var, bslam_real_t more_var)
{
    const bslam_beacon_t *beacon = &ekf->beacons[index];
    if (beacon->kind == BSLAM_BEACON_SIZED) {
        const int at = beacon->at + BSLAM_POINT_DIM;
        doubt_scale(ekf, settings, at, scale_var, more_var);
        begin_scale(ekf, at, scale_var + more_var);
    }
}

// ---- shrinking --------------------------------------------------------------------------------------------

/// Takes `count` state values out; beacons behind them move up.
static void remove_values(bslam_ekf_t *ekf, int first, int count)
{
    bslam_symmat_remove(ekf->covariance, ekf->dim, first, count);
    ekf->dim -= count;
    for (int i = first; i < ekf->dim; i++) {
        ekf->mean[i] = ekf->mean[i + count];
    }
    memset(&ekf->mean[ekf->dim], 0, (size_t)count * sizeof ekf->mean[0]);
    for (int b = 0; b < ekf->beacon_count; b++) {
        if (ekf->beacons[b].at > first) {
            ekf->beacons[b].at -= count;
        }
    }
}

void bslam_ekf_remove(bslam_ekf_t *ekf, int index)
{
    const bslam_beacon_t *beacon = &ekf->beacons[index];
    ekf->ray_count -= beacon->kind == BSLAM_BEACON_RAY ? 1 : 0;
    ekf->sized_count -= beacon->kind == BSLAM_BEACON_SIZED ? 1 : 0;
    if (beacon->kind != BSLAM_BEACON_KNOWN) {
        remove_values(ekf, beacon->at, bslam_beacon_dim(beacon->kind));
    }
    ekf->beacon_count--;
    for (int b = index; b < ekf->beacon_count; b++) {
        ekf->beacons[b] = ekf->beacons[b + 1];
    }
}

void bslam_ekf_forget_map(bslam_ekf_t *ekf)
{
    memset(&ekf->mean[ekf->base_dim], 0, (size_t)(ekf->dim - ekf->base_dim) * sizeof ekf->mean[0]);
    memset(ekf->beacons, 0, (size_t)ekf->beacon_count * sizeof ekf->beacons[0]);
    ekf->dim = ekf->base_dim;
    ekf->beacon_count = 0;
    ekf->ray_count = 0;
    ekf->sized_count = 0;
}

// ---- rays -------------------------------------------------------------------------------------------------

/// Civera's linearity index of a ray seen from the sensor: 4 sd(distance) |cos(parallax)| / distance from the
/// sensor.
static bool ray_is_linear(const bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *mount,
                          int at)
{
    const bslam_real_t *ray = &ekf->mean[at];
    const bslam_real_t inverse = ray[3];
    const bslam_real_t variance = bslam_symmat_get(ekf->covariance, at + 3, at + 3);
    if (!(inverse > BSLAM_FAR_INVERSE_PER_M) || !(variance > 0)) {
        return false;
    }
    const bslam_pose_t pose = bslam_ekf_pose(ekf);
    const bslam_sensor_t sensor = bslam_sensor_at(&pose, mount);
    const bslam_ray_point_t point = bslam_ray_to_point(ray);
    const bslam_real_t dx = point.x_m - sensor.pose.x_m, dy = point.y_m - sensor.pose.y_m;
    const bslam_real_t square = dx * dx + dy * dy;
    const bslam_real_t along = bslam_abs((point.x_m - ray[0]) * dx + (point.y_m - ray[1]) * dy) * inverse;
    const bslam_real_t distance_sd = bslam_sqrt(variance) / (inverse * inverse);
    return 4 * distance_sd * along < settings->ray_linear_limit * square;
}

/// A point by what the state has: how it goes with that, and what it errs besides.
typedef struct located {
    bslam_real_t x_m, y_m;
    bslam_row_t x_row;
    bslam_row_t y_row;
    bslam_sym2_t own;
} located_t;

/// The values at `at` and behind it become the point.
static void set_place(bslam_ekf_t *ekf, int at, const located_t *place)
{
    bslam_real_t *x_column = ekf->pending[0];
    bslam_real_t *y_column = ekf->pending[1];
    bslam_symmat_times_two(ekf->covariance, ekf->dim, &place->x_row, &place->y_row, x_column, y_column);
    const bslam_real_t xx = bslam_ekf_dot(&place->x_row, x_column) + place->own.xx;
    const bslam_real_t xy = bslam_ekf_dot(&place->x_row, y_column) + place->own.xy;
    const bslam_real_t yy = bslam_ekf_dot(&place->y_row, y_column) + place->own.yy;
    for (int i = 0; i < ekf->dim; i++) {
        bslam_symmat_set(ekf->covariance, i, at, x_column[i]);
        bslam_symmat_set(ekf->covariance, i, at + 1, y_column[i]);
    }
    bslam_symmat_set(ekf->covariance, at, at, xx);
    bslam_symmat_set(ekf->covariance, at + 1, at, xy);
    bslam_symmat_set(ekf->covariance, at + 1, at + 1, yy);
    ekf->mean[at] = place->x_m;
    ekf->mean[at + 1] = place->y_m;
}

/// Where on the ray at `at` a sighting's distance ends, MATH (38), and how that goes with the
/// distance. False: nowhere, or so much across the ray that the distance does not tell.
static bool place_on_ray(const bslam_ekf_t *ekf, const bslam_pose_t *mount, bslam_real_t range_m, int at,
                         located_t *place, bslam_real_t by_range[2])
{
    const bslam_pose_t pose = bslam_ekf_pose(ekf);
    const bslam_sensor_t sensor = bslam_sensor_at(&pose, mount);
    bslam_real_t ux, uy;
    bslam_sin_cos(ekf->mean[at + 2], &uy, &ux);
    const bslam_real_t wx = ekf->mean[at] - sensor.pose.x_m;
    const bslam_real_t wy = ekf->mean[at + 1] - sensor.pose.y_m;
    const bslam_real_t across = ux * wy - uy * wx, square = range_m * range_m - across * across;
    if (!(square > range_m * range_m * ALONG_MIN * ALONG_MIN)) {
        return false;
    }
    const bslam_real_t reach_m = bslam_sqrt(square);
    const bslam_real_t length_m = reach_m - (wx * ux + wy * uy);
    if (!(length_m > 0)) {
        return false;
    }
    const bslam_real_t ex = (wx + length_m * ux) / range_m, ey = (wy + length_m * uy) / range_m;
    const bslam_real_t c = reach_m / range_m;
    const bslam_real_t turn = length_m * (uy * ex - ux * ey) / c;  // d length / d direction
    by_range[0] = ux / c;
    by_range[1] = uy / c;
    *place = (located_t){.x_m = ekf->mean[at] + length_m * ux, .y_m = ekf->mean[at + 1] + length_m * uy};
    const bslam_real_t by_theta = ex * sensor.x_by_theta + ey * sensor.y_by_theta;
    place->x_row = (bslam_row_t){
        .base = {by_range[0] * ex, by_range[0] * ey, by_range[0] * by_theta},
        .other = {1 - by_range[0] * ex, -by_range[0] * ey, ux * turn - length_m * uy, 0},
        .at = (uint16_t)at,
        .dim = BSLAM_RAY_DIM,
    };
    place->y_row = (bslam_row_t){
        .base = {by_range[1] * ex, by_range[1] * ey, by_range[1] * by_theta},
        .other = {-by_range[1] * ex, 1 - by_range[1] * ey, uy * turn + length_m * ux, 0},
        .at = (uint16_t)at,
        .dim = BSLAM_RAY_DIM,
    };
    return true;
}

bool bslam_ekf_measure_ray(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *mount,
                           const bslam_sighting_t *sighting, int index, bslam_real_t scale_var)
{
    bslam_beacon_t *beacon = &ekf->beacons[index];
    const int at = beacon->at;
    const bslam_real_t range_m = sighting->range_m;
    located_t place;
    bslam_real_t by_range[2];
    if (beacon->kind != BSLAM_BEACON_RAY || !place_on_ray(ekf, mount, range_m, at, &place, by_range)) {
        return false;
    }
    const bslam_real_t variance = bslam_scaled_range_variance_m2(settings, sighting, range_m, scale_var);
    place.own.xx = by_range[0] * by_range[0] * variance;
    place.own.xy = by_range[0] * by_range[1] * variance;
    place.own.yy = by_range[1] * by_range[1] * variance;
    set_place(ekf, at, &place);
    begin_scale(ekf, at + 2, scale_var);
    bslam_symmat_set(ekf->covariance, at + 2, at, -scale_var * range_m * by_range[0]);
    bslam_symmat_set(ekf->covariance, at + 2, at + 1, -scale_var * range_m * by_range[1]);
    remove_values(ekf, at + BSLAM_SIZED_DIM, BSLAM_RAY_DIM - BSLAM_SIZED_DIM);
    beacon->kind = BSLAM_BEACON_SIZED;
    ekf->ray_count--;
    ekf->sized_count++;
    return true;
}

bool bslam_ekf_settle_ray(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *mount,
                          int index)
{
    bslam_beacon_t *beacon = &ekf->beacons[index];
    const int at = beacon->at;
    if (beacon->kind != BSLAM_BEACON_RAY || !ray_is_linear(ekf, settings, mount, at)) {
        return false;
    }
    const bslam_ray_point_t point = bslam_ray_to_point(&ekf->mean[at]);
    located_t place = {.x_m = point.x_m, .y_m = point.y_m};
    place.x_row = (bslam_row_t){.at = (uint16_t)at, .dim = BSLAM_RAY_DIM};
    place.y_row = place.x_row;
    memcpy(place.x_row.other, point.x_by_ray, sizeof place.x_row.other);
    memcpy(place.y_row.other, point.y_by_ray, sizeof place.y_row.other);
    set_place(ekf, at, &place);
    remove_values(ekf, at + 2, BSLAM_RAY_DIM - BSLAM_POINT_DIM);
    beacon->kind = BSLAM_BEACON_POINT;
    ekf->ray_count--;
    return true;
}
