#include "vision/camera/lens.h"

#include "base/trig.h"
#include "base/scalar.h"

static const bslam_real_t FOCAL_MIN_PX = 1;
static const bslam_real_t FOCAL_MAX_PX = BSLAM_R(1e5);
static const bslam_real_t PITCH_MAX_RAD = BSLAM_R(1.5);
static const bslam_real_t HEIGHT_MAX_M = 10;
enum { FRAME_SIDE_MIN = 8, NEWTON_STEPS_MAX = 20 };

// A ray that leaves the axis at less than this (pinhole: its x against its length) is as good as behind.
static const bslam_real_t FORWARD_MIN = BSLAM_R(1e-4);

// Newton stops at this relative step: a few roundings.
#if BSLAM_REAL_DOUBLE
static const bslam_real_t NEWTON_STEP_MIN = 1e-14;
#else
static const bslam_real_t NEWTON_STEP_MIN = 5e-7f;
#endif

// Distortion, the same polynomial for both lenses: rd = r (1 + k1 r² + k2 r⁴), where r is the tangent of the
// angle from the axis (pinhole) or the angle itself (equidistant).

static bslam_real_t distorted(const bslam_camera_t *camera, bslam_real_t r)
{
    const bslam_real_t q = r * r;
    return r * (1 + q * (camera->k1 + q * camera->k2));
}

/// d rd / d r.
static bslam_real_t growth(const bslam_camera_t *camera, bslam_real_t r)
{
    const bslam_real_t q = r * r;
    return 1 + q * (3 * camera->k1 + 5 * q * camera->k2);
}

/// The r whose distorted value is rd, by Newton's method from rd. Barrel distortion is concave and starts
/// left of the root, cushion is convex and starts right of it: both approach it from one side. False if the
/// slope is lost on the way (a fold), or if the steps run out.
static bool undistort(const bslam_camera_t *camera, bslam_real_t rd, bslam_real_t *r)
{
    bslam_real_t x = rd;
    if (camera->k1 == 0 && camera->k2 == 0) {  // what the first step would find
        *r = rd;
        return bslam_is_number(rd) && rd >= 0;
    }
    for (int i = 0; i < NEWTON_STEPS_MAX; i++) {
        const bslam_real_t slope = growth(camera, x);
        if (!(slope > BSLAM_R(1e-3))) {
            return false;
        }
        const bslam_real_t step = (distorted(camera, x) - rd) / slope;
        x -= step;
        if (bslam_abs(step) <= NEWTON_STEP_MIN * bslam_abs(x)) {
            *r = x;
            return growth(camera, x) > 0 && x >= 0;
        }
    }
    return false;
}

/// The radius grows all the way from the axis to r: its slope, a parabola in r², stays positive.
static bool grows_up_to(const bslam_camera_t *camera, bslam_real_t r)
{
    if (!(growth(camera, r) > 0)) {
        return false;
    }
    const bslam_real_t lowest = camera->k2 > 0 ? BSLAM_R(-0.3) * camera->k1 / camera->k2 : 0;  // in r²
    return !(lowest > 0) || !(lowest < r * r) || growth(camera, bslam_sqrt(lowest)) > 0;
}

/// A point of the image plane in focal lengths from the axis (to the right, down), and how far it is.
typedef struct plane_point {
    bslam_real_t right;
    bslam_real_t down;
    bslam_real_t radius;
} plane_point_t;

static plane_point_t plane_point(const bslam_camera_t *camera, bslam_real_t u_px, bslam_real_t v_px)
{
    const bslam_real_t right = (u_px - camera->cx_px) / camera->fx_px;
    const bslam_real_t down = (v_px - camera->cy_px) / camera->fy_px;
    return (plane_point_t){right, down, bslam_sqrt(right * right + down * down)};
}

static bool corner_is_seen(const bslam_camera_t *camera, bslam_real_t u_px, bslam_real_t v_px)
{
    const plane_point_t corner = plane_point(camera, u_px, v_px);
    bslam_real_t r;
    return undistort(camera, corner.radius, &r) && grows_up_to(camera, r);
}

static bool numbers_are_finite(const bslam_camera_t *camera)
{
    const bslam_real_t values[] = {camera->fx_px,   camera->fy_px,     camera->cx_px,
                                   camera->cy_px,   camera->k1,        camera->k2,
                                   camera->yaw_rad, camera->pitch_rad, camera->z_m};
    for (int i = 0; i < (int)(sizeof values / sizeof values[0]); i++) {
        if (!bslam_is_number(values[i])) {
            return false;
        }
    }
    return true;
}

static bool frame_is_allowed(const bslam_camera_t *camera)
{
    const bool sides = camera->width_px >= FRAME_SIDE_MIN && camera->width_px <= BSLAM_FRAME_SIDE_MAX &&
                       camera->height_px >= FRAME_SIDE_MIN && camera->height_px <= BSLAM_FRAME_SIDE_MAX;
    return sides && bslam_in_range(camera->fx_px, FOCAL_MIN_PX, FOCAL_MAX_PX) &&
           bslam_in_range(camera->fy_px, FOCAL_MIN_PX, FOCAL_MAX_PX) &&
           bslam_in_range(camera->cx_px, 0, (bslam_real_t)(camera->width_px - 1)) &&
           bslam_in_range(camera->cy_px, 0, (bslam_real_t)(camera->height_px - 1));
}

static bool mounting_is_allowed(const bslam_camera_t *camera)
{
    return bslam_in_range(camera->yaw_rad, -BSLAM_PI, BSLAM_PI) &&
           bslam_in_range(camera->pitch_rad, -PITCH_MAX_RAD, PITCH_MAX_RAD) &&
           bslam_in_range(camera->z_m, 0, HEIGHT_MAX_M) && camera->zoom >= 0 &&
           camera->zoom <= BSLAM_ZOOM_MAX;
}

bslam_status_t bslam_camera_check(const bslam_camera_t *camera)
{
    if (!numbers_are_finite(camera)) {
        return BSLAM_E_NOT_FINITE;
    }
    if ((camera->lens != BSLAM_LENS_PINHOLE && camera->lens != BSLAM_LENS_EQUIDISTANT) ||
        !frame_is_allowed(camera) || !mounting_is_allowed(camera)) {
        return BSLAM_E_PARAMETER;
    }
    const bslam_real_t right = (bslam_real_t)camera->width_px;
    const bslam_real_t bottom = (bslam_real_t)camera->height_px;
    const bool seen = corner_is_seen(camera, -1, -1) && corner_is_seen(camera, right, -1) &&
                      corner_is_seen(camera, -1, bottom) && corner_is_seen(camera, right, bottom);
    return seen ? BSLAM_OK : BSLAM_E_PARAMETER;
}

bslam_mounting_t bslam_camera_mounting(const bslam_camera_t *camera)
{
    bslam_mounting_t mounting;
    bslam_sin_cos(camera->yaw_rad, &mounting.sin_yaw, &mounting.cos_yaw);
    bslam_sin_cos(camera->pitch_rad, &mounting.sin_pitch, &mounting.cos_pitch);
    return mounting;
}

/// From the camera's axes (forward, left, up) to the robot's: first pitch, then yaw.
static bslam_direction_t to_robot(const bslam_mounting_t *m, bslam_direction_t seen)
{
    const bslam_real_t ahead = m->cos_pitch * seen.x + m->sin_pitch * seen.z;
    return (bslam_direction_t){
        .x = m->cos_yaw * ahead - m->sin_yaw * seen.y,
        .y = m->sin_yaw * ahead + m->cos_yaw * seen.y,
        .z = m->cos_pitch * seen.z - m->sin_pitch * seen.x,
    };
}

static bslam_direction_t to_camera(const bslam_mounting_t *m, const bslam_direction_t *direction)
{
    const bslam_real_t ahead = m->cos_yaw * direction->x + m->sin_yaw * direction->y;
    return (bslam_direction_t){
        .x = m->cos_pitch * ahead - m->sin_pitch * direction->z,
        .y = m->cos_yaw * direction->y - m->sin_yaw * direction->x,
        .z = m->cos_pitch * direction->z + m->sin_pitch * ahead,
    };
}

/// Sine and cosine of the angle between the axis and a ray of undistorted radius r.
static bool angle_from_axis(const bslam_camera_t *camera, bslam_real_t r, bslam_real_t *sine,
                            bslam_real_t *cosine)
{
    if (camera->lens == BSLAM_LENS_EQUIDISTANT) {
        bslam_sin_cos(r, sine, cosine);
        return r < BSLAM_PI;
    }
    *cosine = 1 / bslam_sqrt(1 + r * r);
    *sine = r * *cosine;
    return true;
}

bslam_status_t bslam_camera_unproject(const bslam_camera_t *camera, bslam_real_t u_px, bslam_real_t v_px,
                                      bslam_direction_t *direction)
{
    const bslam_mounting_t mounting = bslam_camera_mounting(camera);
    return bslam_camera_unproject_as(camera, &mounting, u_px, v_px, direction);
}

bslam_status_t bslam_camera_unproject_as(const bslam_camera_t *camera, const bslam_mounting_t *mounting,
                                         bslam_real_t u_px, bslam_real_t v_px, bslam_direction_t *direction)
{
    if (!bslam_is_number(u_px) || !bslam_is_number(v_px)) {
        return BSLAM_E_NOT_FINITE;
    }
    const plane_point_t point = plane_point(camera, u_px, v_px);
    bslam_real_t r;
    bslam_real_t sine;
    bslam_real_t cosine;
    if (!(point.radius < BSLAM_R(1e4)) || !undistort(camera, point.radius, &r) ||
        !angle_from_axis(camera, r, &sine, &cosine)) {
        return BSLAM_E_RANGE;
    }
    const bslam_real_t scale = point.radius > 0 ? sine / point.radius : 0;
    *direction = to_robot(mounting, (bslam_direction_t){cosine, -point.right * scale, -point.down * scale});
    return BSLAM_OK;
}

/// Undistorted radius of a ray in the camera's axes, `sideways` off its axis; false where the lens is blind.
static bool radius_of(const bslam_camera_t *camera, bslam_real_t forward, bslam_real_t sideways,
                      bslam_real_t *r)
{
    if (camera->lens == BSLAM_LENS_EQUIDISTANT) {
        *r = bslam_atan2(sideways, forward);
        return sideways > 0 || forward > 0;
    }
    if (!(forward > FORWARD_MIN * sideways)) {
        return false;
    }
    *r = sideways / forward;
    return true;
}

bslam_status_t bslam_camera_project(const bslam_camera_t *camera, const bslam_direction_t *direction,
                                    bslam_real_t *u_px, bslam_real_t *v_px)
{
    const bslam_mounting_t mounting = bslam_camera_mounting(camera);
    return bslam_camera_project_as(camera, &mounting, direction, u_px, v_px);
}

bslam_status_t bslam_camera_project_as(const bslam_camera_t *camera, const bslam_mounting_t *mounting,
                                       const bslam_direction_t *direction, bslam_real_t *u_px,
                                       bslam_real_t *v_px)
{
    if (!bslam_is_number(direction->x) || !bslam_is_number(direction->y) || !bslam_is_number(direction->z)) {
        return BSLAM_E_NOT_FINITE;
    }
    const bslam_direction_t seen = to_camera(mounting, direction);
    const bslam_real_t sideways = bslam_sqrt(seen.y * seen.y + seen.z * seen.z);
    bslam_real_t r;
    if (!radius_of(camera, seen.x, sideways, &r) || !grows_up_to(camera, r)) {
        return BSLAM_E_RANGE;
    }
    const bslam_real_t scale = sideways > 0 ? distorted(camera, r) / sideways : 0;
    *u_px = camera->cx_px - camera->fx_px * seen.y * scale;
    *v_px = camera->cy_px - camera->fy_px * seen.z * scale;
    return BSLAM_OK;
}

bslam_real_t bslam_direction_bearing_rad(const bslam_direction_t *direction)
{
    return bslam_atan2(direction->y, direction->x);
}

bslam_real_t bslam_direction_elevation_rad(const bslam_direction_t *direction)
{
    const bslam_real_t flat = bslam_sqrt(direction->x * direction->x + direction->y * direction->y);
    return bslam_atan2(direction->z, flat);
}
