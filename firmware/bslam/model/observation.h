/// What a sensor on the robot sees of a beacon: distance and direction, paper equation (14), or direction
/// alone, equation (15). Pure functions with Jacobians. MATH "Observation".
#ifndef BSLAM_MODEL_OBSERVATION_H
#define BSLAM_MODEL_OBSERVATION_H

#include "base/status.h"
#include "base/types.h"

/// State values of a beacon: a point is (x, y); a sized one (x, y, scale), its distances all being measured
/// scale times as long as they are; a ray is (anchor x, anchor y, direction, inverse distance).
#define BSLAM_POINT_DIM 2
#define BSLAM_SIZED_DIM 3
#define BSLAM_RAY_DIM 4

/// A predicted sighting with its derivatives, the rows of H in paper equation (8). Those by values that a
/// point does not have are 0.
typedef struct bslam_observation {
    bslam_real_t range_m, bearing_rad;
    bslam_real_t range_by_pose[3];                ///< d range / d (x, y, theta)
    bslam_real_t bearing_by_pose[3];              ///< d bearing / d (x, y, theta)
    bslam_real_t range_by_beacon[BSLAM_RAY_DIM];  ///< d range / d beacon, in the order of its state values
    bslam_real_t bearing_by_beacon[BSLAM_RAY_DIM];
    bslam_real_t stretch_by_pose[3];  ///< d ln(length) / d (x, y, theta); length is the distance, or a ray's
                                      ///< distance times its inverse distance
    bslam_real_t stretch_by_beacon[BSLAM_RAY_DIM];
} bslam_observation_t;

/// Sighting of the point (x_m, y_m) by a sensor at mount on a robot at pose. BSLAM_E_SINGULAR, and *seen
/// unchanged, if the point is within 1 mm of the sensor: it has no direction.
BSLAM_MUST_CHECK bslam_status_t bslam_observe_point(const bslam_pose_t *pose, const bslam_pose_t *mount,
                                                    bslam_real_t x_m, bslam_real_t y_m,
                                                    bslam_observation_t *seen);

/// Makes of a point's sighting that of a sized one at the same place.
void bslam_observation_scale(bslam_observation_t *seen, bslam_real_t scale);

/// Sighting of a ray: the point anchor + (cos, sin)(direction) / inverse distance. An inverse distance of 0
/// is a beacon at infinity; range_m and its derivatives are 0 where the inverse distance is not positive.
/// BSLAM_E_SINGULAR as above.
BSLAM_MUST_CHECK bslam_status_t bslam_observe_ray(const bslam_pose_t *pose, const bslam_pose_t *mount,
                                                  const bslam_real_t ray[BSLAM_RAY_DIM],
                                                  bslam_observation_t *seen);

/// The sensor in the map, and how it moves with the robot's heading.
typedef struct bslam_sensor {
    bslam_pose_t pose;
    bslam_real_t x_by_theta, y_by_theta;
} bslam_sensor_t;

bslam_sensor_t bslam_sensor_at(const bslam_pose_t *pose, const bslam_pose_t *mount);

/// The point that a sighting (range_m, bearing_rad) shows: the inverse of bslam_observe_point.
typedef struct bslam_sighted_point {
    bslam_real_t x_m, y_m;
    bslam_real_t x_by_theta;  ///< d x / d theta of the robot; d x / d x = d y / d y = 1
    bslam_real_t y_by_theta, x_by_range, y_by_range, x_by_bearing, y_by_bearing;
} bslam_sighted_point_t;

bslam_sighted_point_t bslam_locate_point(const bslam_pose_t *pose, const bslam_pose_t *mount,
                                         bslam_real_t range_m, bslam_real_t bearing_rad);

/// A ray's point, and its derivatives by the ray's four values. The inverse distance is positive.
typedef struct bslam_ray_point {
    bslam_real_t x_m, y_m, x_by_ray[BSLAM_RAY_DIM], y_by_ray[BSLAM_RAY_DIM];
} bslam_ray_point_t;

bslam_ray_point_t bslam_ray_to_point(const bslam_real_t ray[BSLAM_RAY_DIM]);

#endif
