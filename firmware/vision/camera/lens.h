/// Which direction a pixel of a camera looks in, and the reverse. MATH-CAMERA "Lens". Internal.
///
/// Directions are unit vectors in the robot's axes: x forward, y left, z up. The camera's yaw and pitch are
/// in them; its place is not, so a direction starts at the camera.
#ifndef BSLAM_VISION_CAMERA_LENS_H
#define BSLAM_VISION_CAMERA_LENS_H

#include "vision/vision.h"

/// A unit vector in the robot's axes.
typedef struct bslam_direction {
    bslam_real_t x;
    bslam_real_t y;
    bslam_real_t z;
} bslam_direction_t;

/// The direction that a point of the image looks in; it may lie outside the frame.
/// BSLAM_E_NOT_FINITE; BSLAM_E_RANGE: so far outside that the lens has no direction for it, or the inverse of
/// the distortion did not converge in 20 steps of Newton's method. *direction is then unchanged.
BSLAM_MUST_CHECK bslam_status_t bslam_camera_unproject(const bslam_camera_t *camera, bslam_real_t u_px,
                                                       bslam_real_t v_px, bslam_direction_t *direction);

/// Sines and cosines of a camera's mounting angles, for who unprojects many points.
typedef struct bslam_mounting {
    bslam_real_t sin_yaw;
    bslam_real_t cos_yaw;
    bslam_real_t sin_pitch;
    bslam_real_t cos_pitch;
} bslam_mounting_t;

bslam_mounting_t bslam_camera_mounting(const bslam_camera_t *camera);

/// As bslam_camera_unproject, with the camera's mounting worked out before.
BSLAM_MUST_CHECK bslam_status_t bslam_camera_unproject_as(const bslam_camera_t *camera,
                                                          const bslam_mounting_t *mounting, bslam_real_t u_px,
                                                          bslam_real_t v_px, bslam_direction_t *direction);

/// Where a direction (of any length) falls in the image plane, inside the frame or not.
/// BSLAM_E_NOT_FINITE; BSLAM_E_RANGE: the lens does not see there (behind a pinhole, straight behind an
/// equidistant lens, where the distortion folds). *u_px and *v_px are then unchanged.
BSLAM_MUST_CHECK bslam_status_t bslam_camera_project(const bslam_camera_t *camera,
                                                     const bslam_direction_t *direction, bslam_real_t *u_px,
                                                     bslam_real_t *v_px);

/// As bslam_camera_project, with the camera's mounting worked out before.
BSLAM_MUST_CHECK bslam_status_t bslam_camera_project_as(const bslam_camera_t *camera,
                                                        const bslam_mounting_t *mounting,
                                                        const bslam_direction_t *direction,
                                                        bslam_real_t *u_px, bslam_real_t *v_px);

/// Horizontal angle from the robot's forward axis, positive to the left, in (-pi, pi].
bslam_real_t bslam_direction_bearing_rad(const bslam_direction_t *direction);

/// Angle above the horizontal plane, in [-pi/2, pi/2].
bslam_real_t bslam_direction_elevation_rad(const bslam_direction_t *direction);

#endif
