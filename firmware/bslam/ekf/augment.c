// The map: beacons come into the state, leave it, and turn from rays into points. MATH "State augmentation",
// "Bearing-only".
#include <string.h>

#include "bslam/ekf/ekf.h"
#include "bslam/ekf/ekf_internal.h"
#include "bslam/ekf/sensor.h"
#include "base/trig.h"
#include "bslam/model/noise.h"
#include "base/scalar.h"

/// A distance tells where on a ray a point is unless it lies more across the ray than this, as a cosine.
static const bslam_real_t ALONG_MIN = BSLAM_R(0.5);
/// A scale is never taken for surer than this, where doubt is added by a difference of variances.
static const bslam_real_t SCALE_VAR_MIN = BSLAM_R(1e-6);

// ---- growing ----------------------------------------------------------------------------------------------

/// New state values: how they hang on those that there are, and on noises of their own.
typedef struct new_values {
    bslam_row_t rows[BSLAM_FACTOR_GROWTH_MAX];
    bslam_real_t mean[BSLAM_FACTOR_GROWTH_MAX];
    bslam_growth_t growth;
} new_values_t;

static void add_noise(new_values_t *values, bslam_real_t variance, const bslam_real_t *by, int count)
{
    bslam_growth_t *growth = &values->growth;
    for (int k = 0; k < count; k++) {
        growth->by_noise[k][growth->noise_count] = by[k];
    }
    growth->noise_var[growth->noise_count] = variance;
    growth->noise_count++;
}

/// Writes them and their rows of the factor at the end of the state.
static void append_values(bslam_ekf_t *ekf, new_values_t *values)
{
    for (int k = 0; k < values->growth.count; k++) {
        bslam_ekf_look(ekf, &values->rows[k], 0, bslam_factor_places(&ekf->factor), ekf->v[k]);
        values->growth.rows[k] = ekf->v[k];
        ekf->mean[ekf->dim + k] = values->mean[k];
    }
    bslam_factor_append(&ekf->factor, &values->growth);
    ekf->dim += values->growth.count;
}

/// The distance that a value's noise comes from may be too long by a scale: where that is larger, the point
/// is nearer. The scale itself is the third value.
static void add_scale(new_values_t *values, bslam_real_t scale_var, bslam_real_t range_m,
                      bslam_real_t x_by_range, bslam_real_t y_by_range)
{
    const bslam_real_t by_scale[BSLAM_SIZED_DIM] = {-range_m * x_by_range, -range_m * y_by_range, 1};
    add_noise(values, scale_var, by_scale, BSLAM_SIZED_DIM);
    values->mean[BSLAM_POINT_DIM] = 1;
    values->growth.count = BSLAM_SIZED_DIM;
}

/// The sighted point; a sized one if its scale is to be a value. scale_var: of the scale that all its
/// distances have.
static void append_point(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *told,
                         const bslam_sighting_t *sighting, bslam_real_t scale_var, bool is_sized)
{
    const bslam_pose_t pose = bslam_ekf_pose(ekf), mount = bslam_ekf_mount(ekf, told);
    const bslam_real_t scale = bslam_ekf_range_scale(ekf), range_m = sighting->range_m / scale;
    const bslam_sighted_point_t point = bslam_locate_point(&pose, &mount, range_m, sighting->bearing_rad);
    const bslam_real_t range_var =
        bslam_scaled_range_variance_m2(settings, sighting, sighting->range_m, is_sized ? 0 : scale_var);
    const bslam_real_t by_range[BSLAM_POINT_DIM] = {point.x_by_range / scale, point.y_by_range / scale};
    const bslam_real_t by_bearing[BSLAM_POINT_DIM] = {point.x_by_bearing, point.y_by_bearing};
    new_values_t values = {.rows = {{.base = {1, 0, point.x_by_theta}}, {.base = {0, 1, point.y_by_theta}}},
                           .mean = {point.x_m, point.y_m},
                           .growth = {.count = BSLAM_POINT_DIM}};
    for (int k = 0; k < BSLAM_POINT_DIM; k++) {
        bslam_ekf_fill_sensor(ekf, &mount, by_bearing[k], -range_m * by_range[k], &values.rows[k]);
    }
    add_noise(&values, range_var, by_range, BSLAM_POINT_DIM);
    add_noise(&values, bslam_bearing_variance_rad2(settings, sighting), by_bearing, BSLAM_POINT_DIM);
    if (is_sized) {
        add_scale(&values, scale_var, range_m, point.x_by_range, point.y_by_range);
    }
    append_values(ekf, &values);
}

/// Values of the state beyond two a beacon that there is room for.
static int room_of(const bslam_ekf_t *ekf)
{
    return 2 * (BSLAM_RAYS_MAX - ekf->ray_count) - ekf->sized_count;
}

static void append_ray(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *told,
                       const bslam_sighting_t *sighting)
{
    static const bslam_real_t OF_DIRECTION[BSLAM_RAY_DIM] = {0, 0, 1, 0},
                              OF_DISTANCE[BSLAM_RAY_DIM] = {0, 0, 0, 1};
    const bslam_pose_t pose = bslam_ekf_pose(ekf), mount = bslam_ekf_mount(ekf, told);
    const bslam_sensor_t sensor = bslam_sensor_at(&pose, &mount);
    const bslam_real_t direction_rad = bslam_angle_wrap(sensor.pose.theta_rad + sighting->bearing_rad);
    const bslam_real_t sd = settings->ray_inverse_distance_sd_per_m;
    new_values_t values = {
        .rows = {{.base = {1, 0, sensor.x_by_theta}},
                 {.base = {0, 1, sensor.y_by_theta}},
                 {.base = {0, 0, 1}}},
        .mean = {sensor.pose.x_m, sensor.pose.y_m, direction_rad, settings->ray_inverse_distance_per_m},
        .growth = {.count = BSLAM_RAY_DIM}};
    for (int k = 0; k < BSLAM_RAY_DIM - 1; k++) {
        bslam_ekf_fill_sensor(ekf, &mount, OF_DIRECTION[k], 0, &values.rows[k]);
    }
    add_noise(&values, bslam_bearing_variance_rad2(settings, sighting), OF_DIRECTION, BSLAM_RAY_DIM);
    add_noise(&values, sd * sd, OF_DISTANCE, BSLAM_RAY_DIM);
    append_values(ekf, &values);
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
        append_point(ekf, settings, mount, sighting, scale_var, true);
        ekf->sized_count++;
    } else {
        *index = append_beacon(ekf, BSLAM_BEACON_POINT);
        append_point(ekf, settings, mount, sighting, scale_var, false);
    }
    return BSLAM_OK;
}

bslam_status_t bslam_ekf_add_guess(bslam_ekf_t *ekf, bslam_real_t x_m, bslam_real_t y_m, bslam_real_t sd_m,
                                   int *index)
{
    static const bslam_real_t OF_X[BSLAM_POINT_DIM] = {1, 0}, OF_Y[BSLAM_POINT_DIM] = {0, 1};
    if (ekf->beacon_count == BSLAM_BEACONS_MAX) {
        return BSLAM_E_MAP_FULL;
    }
    *index = append_beacon(ekf, BSLAM_BEACON_POINT);
    new_values_t values = {.mean = {x_m, y_m}, .growth = {.count = BSLAM_POINT_DIM}};
    add_noise(&values, sd_m * sd_m, OF_X, BSLAM_POINT_DIM);
    add_noise(&values, sd_m * sd_m, OF_Y, BSLAM_POINT_DIM);
    append_values(ekf, &values);
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

// ---- shrinking --------------------------------------------------------------------------------------------

/// Takes `count` state values out; those behind them move up.
static void remove_values(bslam_ekf_t *ekf, int first, int count)
{
    bslam_factor_remove(&ekf->factor, bslam_ekf_place(ekf, first), count, ekf->v[0], ekf->lambda);
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

/// A beacon's values become others, which are made of them. They stand behind all others then.
static void replace_values(bslam_ekf_t *ekf, bslam_beacon_t *beacon, bslam_beacon_kind_t kind,
                           new_values_t *values)
{
    const int at = beacon->at, count = bslam_beacon_dim(beacon->kind);
    beacon->at = ekf->dim;
    append_values(ekf, values);
    remove_values(ekf, at, count);
    beacon->kind = kind;
}

void bslam_ekf_replace_point(bslam_ekf_t *ekf, int index, const bslam_row_t rows[BSLAM_POINT_DIM])
{
    bslam_beacon_t *beacon = &ekf->beacons[index];
    new_values_t values = {.rows = {rows[0], rows[1]},
                           .mean = {ekf->mean[beacon->at], ekf->mean[beacon->at + 1]},
                           .growth = {.count = BSLAM_POINT_DIM}};
    replace_values(ekf, beacon, BSLAM_BEACON_POINT, &values);
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

void bslam_ekf_remove_value(bslam_ekf_t *ekf, int at)
{
    remove_values(ekf, at, 1);
}

void bslam_ekf_forget_map(bslam_ekf_t *ekf)
{
    const int first = bslam_ekf_map_at(ekf);
    bslam_factor_cut(&ekf->factor, first - ekf->factor.tail_count);
    memset(&ekf->mean[first], 0, (size_t)(ekf->dim - first) * sizeof ekf->mean[0]);
    memset(ekf->beacons, 0, (size_t)ekf->beacon_count * sizeof ekf->beacons[0]);
    ekf->dim = first;
    ekf->beacon_count = 0;
    ekf->ray_count = 0;
    ekf->sized_count = 0;
}

// ---- scales -----------------------------------------------------------------------------------------------

/// The k-th of a beacon's values as it is.
static bslam_row_t same_value(const bslam_beacon_t *beacon, int k)
{
    bslam_row_t row = {.at = (uint16_t)beacon->at, .dim = (uint16_t)bslam_beacon_dim(beacon->kind)};
    row.other[k] = 1;
    return row;
}

bool bslam_ekf_give_scale(bslam_ekf_t *ekf, int index, bslam_real_t scale_var)
{
    bslam_beacon_t *beacon = &ekf->beacons[index];
    if (beacon->kind != BSLAM_BEACON_POINT || room_of(ekf) < 1) {
        return false;
    }
    new_values_t values = {.rows = {same_value(beacon, 0), same_value(beacon, 1)},
                           .mean = {ekf->mean[beacon->at], ekf->mean[beacon->at + 1]}};
    add_scale(&values, scale_var, 0, 0, 0);
    replace_values(ekf, beacon, BSLAM_BEACON_SIZED, &values);
    ekf->sized_count++;
    return true;
}

/// What hangs on a scale becomes as doubtful as if it had been doubted by more_var more from the start, when
/// it was by scale_var: what was learned of it, taken back.
static void doubt_scale(bslam_ekf_t *ekf, int at, bslam_real_t scale_var, bslam_real_t more_var)
{
    bslam_factor_t *factor = &ekf->factor;
    const int place = bslam_ekf_place(ekf, at);
    const bslam_real_t left_var = bslam_factor_get(factor, place, place);
    bslam_real_t var = scale_var > left_var ? scale_var : left_var;
    var = var > SCALE_VAR_MIN ? var : SCALE_VAR_MIN;
    bslam_real_t *with_scale = ekf->v[0];
    memset(with_scale, 0, sizeof ekf->v[0]);
    for (int i = 0; i < ekf->dim; i++) {
        const int other = bslam_ekf_place(ekf, i);
        with_scale[other] = bslam_factor_get(factor, other, place);
    }
    bslam_factor_add(factor, 0, 1 / (var + var * var / more_var - left_var), with_scale, ekf->lambda);
}

void bslam_ekf_renew_scale(bslam_ekf_t *ekf, int index, bslam_real_t scale_var, bslam_real_t more_var)
{
    const bslam_beacon_t *beacon = &ekf->beacons[index];
    if (beacon->kind == BSLAM_BEACON_SIZED) {
        const int at = beacon->at + BSLAM_POINT_DIM;
        doubt_scale(ekf, at, scale_var, more_var);
        bslam_factor_forget(&ekf->factor, bslam_ekf_place(ekf, at), scale_var + more_var, ekf->v[0],
                            ekf->lambda);
        ekf->mean[at] = 1;
    }
}

// ---- rays -------------------------------------------------------------------------------------------------

/// Civera's linearity index of a ray seen from the sensor: 4 sd(distance) |cos(parallax)| / distance from the
/// sensor.
static bool ray_is_linear(const bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *mount,
                          int at)
{
    const bslam_real_t *ray = &ekf->mean[at];
    const bslam_real_t inverse = ray[3];
    const bslam_real_t variance = bslam_ekf_covariance(ekf, at + 3, at + 3);
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

/// Where on the ray at `at` a sighting's distance ends, MATH (38), and how that goes with the
/// distance. False: nowhere, or so much across the ray that the distance does not tell.
static bool place_on_ray(const bslam_ekf_t *ekf, const bslam_pose_t *mount, bslam_real_t range_m, int at,
                         new_values_t *place, bslam_real_t by_range[2])
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
    *place = (new_values_t){.mean = {ekf->mean[at] + length_m * ux, ekf->mean[at + 1] + length_m * uy}};
    const bslam_real_t by_theta = ex * sensor.x_by_theta + ey * sensor.y_by_theta;
    place->rows[0] = (bslam_row_t){
        .base = {by_range[0] * ex, by_range[0] * ey, by_range[0] * by_theta},
        .other = {1 - by_range[0] * ex, -by_range[0] * ey, ux * turn - length_m * uy, 0},
        .at = (uint16_t)at,
        .dim = BSLAM_RAY_DIM,
    };
    place->rows[1] = (bslam_row_t){
        .base = {by_range[1] * ex, by_range[1] * ey, by_range[1] * by_theta},
        .other = {-by_range[1] * ex, 1 - by_range[1] * ey, uy * turn + length_m * ux, 0},
        .at = (uint16_t)at,
        .dim = BSLAM_RAY_DIM,
    };
    const bslam_real_t by_scale = -range_m / bslam_ekf_range_scale(ekf);  // of the distance
    for (int k = 0; k < BSLAM_POINT_DIM; k++) {
        bslam_ekf_fill_sensor(ekf, mount, 0, by_scale * by_range[k], &place->rows[k]);
    }
    return true;
}

bool bslam_ekf_measure_ray(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *told,
                           const bslam_sighting_t *sighting, int index, bslam_real_t scale_var)
{
    bslam_beacon_t *beacon = &ekf->beacons[index];
    const int at = beacon->at;
    const bslam_pose_t mount = bslam_ekf_mount(ekf, told);
    const bslam_real_t sensor_scale = bslam_ekf_range_scale(ekf), range_m = sighting->range_m / sensor_scale;
    new_values_t values;
    bslam_real_t by_range[BSLAM_POINT_DIM];
    if (beacon->kind != BSLAM_BEACON_RAY || !place_on_ray(ekf, &mount, range_m, at, &values, by_range)) {
        return false;
    }
    const bslam_real_t range_var = bslam_range_variance_m2(settings, sighting, sighting->range_m);
    add_noise(&values, range_var / (sensor_scale * sensor_scale), by_range, BSLAM_POINT_DIM);
    add_scale(&values, scale_var, range_m, by_range[0], by_range[1]);
    replace_values(ekf, beacon, BSLAM_BEACON_SIZED, &values);
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
    const bslam_row_t ray = {.at = (uint16_t)at, .dim = BSLAM_RAY_DIM};
    new_values_t values = {
        .rows = {ray, ray}, .mean = {point.x_m, point.y_m}, .growth = {.count = BSLAM_POINT_DIM}};
    memcpy(values.rows[0].other, point.x_by_ray, sizeof ray.other);
    memcpy(values.rows[1].other, point.y_by_ray, sizeof ray.other);
    replace_values(ekf, beacon, BSLAM_BEACON_POINT, &values);
    ekf->ray_count--;
    return true;
}
