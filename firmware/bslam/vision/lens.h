/// A camera on the robot: which direction a pixel looks in, and the reverse. MATH-CAMERA "Lens".
///
/// Two kinds of lens, each with OpenCV's radial distortion, so that OpenCV's calibration can be used as it
/// is: pinhole (calib3d, k1 and k2) and equidistant (calib3d's fisheye, k1 and k2: r = f theta (1 + k1 theta²
/// + k2 theta⁴)). Pixel (0, 0) is the centre of the upper left one.
///
/// Directions are unit vectors in the robot's axes: x forward, y left, z up. The camera's yaw and pitch are
/// in them; its place is not, so a direction starts at the camera.
#ifndef BSLAM_VISION_LENS_H
#define BSLAM_VISION_LENS_H

#include <stdint.h>

#include "bslam/base/real.h"
#include "bslam/base/status.h"

typedef enum bslam_lens_kind {
    BSLAM_LENS_PINHOLE = 0,     ///< straight lines stay straight; to about 120 degrees
    BSLAM_LENS_EQUIDISTANT = 1  ///< the angle from the axis grows in proportion to the radius; to 180 degrees
} bslam_lens_kind_t;

/// Frames of at most this many pixels a side.
#define BSLAM_FRAME_SIDE_MAX 4096
#define BSLAM_ZOOM_MAX 2

typedef struct bslam_camera {
    bslam_lens_kind_t lens;
    int32_t width_px;  ///< of the frame
    int32_t height_px;
    bslam_real_t fx_px;  ///< focal lengths
    bslam_real_t fy_px;
    bslam_real_t cx_px;  ///< where the axis meets the frame
    bslam_real_t cy_px;
    bslam_real_t k1;
    bslam_real_t k2;
    bslam_real_t yaw_rad;    ///< mounting: of the axis, positive to the left
    bslam_real_t pitch_rad;  ///< positive looks down
    bslam_real_t z_m;        ///< height above the floor
    int32_t zoom;  ///< the front end looks at a pixel as so many, across and down: 2 for a lens that shows
                   ///< much in few pixels; 0 and 1: as it is
} bslam_camera_t;

/// A unit vector in the robot's axes.
typedef struct bslam_direction {
    bslam_real_t x;
    bslam_real_t y;
    bslam_real_t z;
} bslam_direction_t;

/// BSLAM_OK if the other functions may be given this camera. BSLAM_E_NOT_FINITE: a value is NaN or infinite.
/// BSLAM_E_PARAMETER: an unknown kind; a frame side outside 8 to BSLAM_FRAME_SIDE_MAX; a focal length outside
/// 1 to 1e5 px; a centre outside the frame; |yaw| above pi, |pitch| above 1.5 rad; a height outside 0 to 10
/// m; a zoom outside 0 to BSLAM_ZOOM_MAX; a distortion that folds: within the frame the radius must grow with
/// the angle, so that every pixel looks in one direction.
BSLAM_MUST_CHECK bslam_status_t bslam_camera_check(const bslam_camera_t *camera);

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
