#include "bslam/model/observation.h"

#include "base/trig.h"
#include "base/scalar.h"

static const bslam_real_t DISTANCE_MIN_M = BSLAM_R(1e-3);

bslam_sensor_t bslam_sensor_at(const bslam_pose_t *pose, const bslam_pose_t *mount)
{
    bslam_real_t forward_x = 0, forward_y = 0;
    if (mount->x_m != 0 || mount->y_m != 0) {  // a sensor above the axle's middle is where the robot is
        bslam_real_t s, c;
        bslam_sin_cos(pose->theta_rad, &s, &c);
        forward_x = c * mount->x_m - s * mount->y_m;
        forward_y = s * mount->x_m + c * mount->y_m;
    }
    return (bslam_sensor_t){
        .pose = {.x_m = pose->x_m + forward_x,
                 .y_m = pose->y_m + forward_y,
                 .theta_rad = bslam_angle_wrap(pose->theta_rad + mount->theta_rad)},
        .x_by_theta = -forward_y,
        .y_by_theta = forward_x,
    };
}

/// Completes the derivative of a scalar by the robot's pose from that by the sensor's position.
static void by_pose(const bslam_sensor_t *sensor, bslam_real_t by_x, bslam_real_t by_y,
                    bslam_real_t by_heading, bslam_real_t out[3])
{
    out[0] = by_x;
    out[1] = by_y;
    out[2] = by_x * sensor->x_by_theta + by_y * sensor->y_by_theta + by_heading;
}

bslam_status_t bslam_observe_point(const bslam_pose_t *pose, const bslam_pose_t *mount, bslam_real_t x_m,
                                   bslam_real_t y_m, bslam_observation_t *seen)
{
    const bslam_sensor_t sensor = bslam_sensor_at(pose, mount);
    const bslam_real_t dx = x_m - sensor.pose.x_m, dy = y_m - sensor.pose.y_m;
    const bslam_real_t square = dx * dx + dy * dy;
    if (!(square > DISTANCE_MIN_M * DISTANCE_MIN_M)) {
        return BSLAM_E_SINGULAR;
    }
    const bslam_real_t range = bslam_sqrt(square);
    seen->range_m = range;
    seen->bearing_rad = bslam_angle_wrap(bslam_atan2(dy, dx) - sensor.pose.theta_rad);
    const bslam_real_t along_x = dx / range, along_y = dy / range;
    const bslam_real_t inverse_x = dx / square, inverse_y = dy / square;
    by_pose(&sensor, -along_x, -along_y, 0, seen->range_by_pose);
    by_pose(&sensor, inverse_y, -inverse_x, -1, seen->bearing_by_pose);
    by_pose(&sensor, -inverse_x, -inverse_y, 0, seen->stretch_by_pose);
    for (int k = BSLAM_POINT_DIM; k < BSLAM_RAY_DIM; k++) {
        seen->range_by_beacon[k] = 0;
        seen->bearing_by_beacon[k] = 0;
        seen->stretch_by_beacon[k] = 0;
    }
    seen->range_by_beacon[0] = along_x;
    seen->range_by_beacon[1] = along_y;
    seen->bearing_by_beacon[0] = -inverse_y;
    seen->bearing_by_beacon[1] = inverse_x;
    seen->stretch_by_beacon[0] = inverse_x;
    seen->stretch_by_beacon[1] = inverse_y;
    return BSLAM_OK;
}

void bslam_observation_scale(bslam_observation_t *seen, bslam_real_t scale)
{
    seen->range_by_beacon[BSLAM_POINT_DIM] = seen->range_m;
    seen->range_m *= scale;
    for (int k = 0; k < 3; k++) {
        seen->range_by_pose[k] *= scale;
    }
    for (int k = 0; k < BSLAM_POINT_DIM; k++) {
        seen->range_by_beacon[k] *= scale;
    }
}

bslam_status_t bslam_observe_ray(const bslam_pose_t *pose, const bslam_pose_t *mount,
                                 const bslam_real_t ray[BSLAM_RAY_DIM], bslam_observation_t *seen)
{
    const bslam_sensor_t sensor = bslam_sensor_at(pose, mount);
    bslam_real_t s, c;
    bslam_sin_cos(bslam_angle_wrap(ray[2]), &s, &c);
    const bslam_real_t inverse = ray[3];
    // g = inverse * (point - sensor) has the point's direction, and stays finite for a beacon at infinity.
    const bslam_real_t from_sensor_x = ray[0] - sensor.pose.x_m, from_sensor_y = ray[1] - sensor.pose.y_m;
    const bslam_real_t gx = inverse * from_sensor_x + c, gy = inverse * from_sensor_y + s;
    const bslam_real_t square = gx * gx + gy * gy;
    if (!(square > DISTANCE_MIN_M * DISTANCE_MIN_M * inverse * inverse) || !(square > BSLAM_R(1e-12))) {
        return BSLAM_E_SINGULAR;
    }
    seen->bearing_rad = bslam_angle_wrap(bslam_atan2(gy, gx) - sensor.pose.theta_rad);
    const bslam_real_t bearing_by_gx = -gy / square;
    const bslam_real_t bearing_by_gy = gx / square;
    by_pose(&sensor, -inverse * bearing_by_gx, -inverse * bearing_by_gy, -1, seen->bearing_by_pose);
    seen->bearing_by_beacon[0] = inverse * bearing_by_gx;
    seen->bearing_by_beacon[1] = inverse * bearing_by_gy;
    seen->bearing_by_beacon[2] = bearing_by_gy * c - bearing_by_gx * s;
    seen->bearing_by_beacon[3] = bearing_by_gx * from_sensor_x + bearing_by_gy * from_sensor_y;

    const bslam_real_t stretch_by_gx = gx / square, stretch_by_gy = gy / square;
    by_pose(&sensor, -inverse * stretch_by_gx, -inverse * stretch_by_gy, 0, seen->stretch_by_pose);
    seen->stretch_by_beacon[0] = inverse * stretch_by_gx;
    seen->stretch_by_beacon[1] = inverse * stretch_by_gy;
    seen->stretch_by_beacon[2] = stretch_by_gy * c - stretch_by_gx * s;
    seen->stretch_by_beacon[3] = stretch_by_gx * from_sensor_x + stretch_by_gy * from_sensor_y;

    // range = |g| / inverse, so d range = range (d ln|g| - d inverse / inverse).
    const bool ahead = inverse > 0;
    const bslam_real_t range = ahead ? bslam_sqrt(square) / inverse : 0;
    seen->range_m = range;
    for (int k = 0; k < 3; k++) {
        seen->range_by_pose[k] = range * seen->stretch_by_pose[k];
    }
    for (int k = 0; k < BSLAM_RAY_DIM; k++) {
        seen->range_by_beacon[k] = range * seen->stretch_by_beacon[k];
    }
    seen->range_by_beacon[3] -= ahead ? range / inverse : 0;
    return BSLAM_OK;
}

bslam_sighted_point_t bslam_locate_point(const bslam_pose_t *pose, const bslam_pose_t *mount,
                                         bslam_real_t range_m, bslam_real_t bearing_rad)
{
    const bslam_sensor_t sensor = bslam_sensor_at(pose, mount);
    bslam_real_t s, c;
    bslam_sin_cos(bslam_angle_wrap(sensor.pose.theta_rad + bearing_rad), &s, &c);
    return (bslam_sighted_point_t){
        .x_m = sensor.pose.x_m + range_m * c,
        .y_m = sensor.pose.y_m + range_m * s,
        .x_by_theta = sensor.x_by_theta - range_m * s,
        .y_by_theta = sensor.y_by_theta + range_m * c,
        .x_by_range = c,
        .y_by_range = s,
        .x_by_bearing = -range_m * s,
        .y_by_bearing = range_m * c,
    };
}

bslam_ray_point_t bslam_ray_to_point(const bslam_real_t ray[BSLAM_RAY_DIM])
{
    bslam_real_t s, c;
    bslam_sin_cos(bslam_angle_wrap(ray[2]), &s, &c);
    const bslam_real_t distance = 1 / ray[3];
    return (bslam_ray_point_t){
        .x_m = ray[0] + distance * c,
        .y_m = ray[1] + distance * s,
        .x_by_ray = {1, 0, -distance * s, -distance * distance * c},
        .y_by_ray = {0, 1, distance * c, -distance * distance * s},
    };
}
