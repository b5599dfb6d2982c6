#include "bslam/vision/outline.h"

#include "bslam/math/trig.h"

/// Axes that look in a bearing: sine and cosine of it.
typedef struct facing {
    bslam_real_t sine;
    bslam_real_t cosine;
} facing_t;

/// A pixel's place in the facing plane; false if it is not before the plane's camera.
static bool to_plane(const bslam_camera_t *camera, const facing_t *facing, bslam_real_t u_px,
                     bslam_real_t v_px, bslam_real_t *across, bslam_real_t *up)
{
    bslam_direction_t direction;
    if (bslam_camera_unproject(camera, u_px, v_px, &direction) != BSLAM_OK) {
        return false;
    }
    const bslam_real_t ahead = facing->cosine * direction.x + facing->sine * direction.y;
    if (!(ahead > BSLAM_R(0.05))) {
        return false;
    }
    *across = (facing->cosine * direction.y - facing->sine * direction.x) / ahead;
    *up = direction.z / ahead;
    return true;
}

static bool box_is_allowed(const bslam_frame_t *frame, const bslam_box_t *box)
{
    return box->right_px - box->left_px >= 1 && box->bottom_px - box->top_px >= 1 &&
           box->left_px >= BSLAM_R(-0.5) && box->top_px >= BSLAM_R(-0.5) &&
           box->right_px <= (bslam_real_t)frame->width_px - BSLAM_R(0.5) &&
           box->bottom_px <= (bslam_real_t)frame->height_px - BSLAM_R(0.5);
}

bslam_status_t bslam_outline_find(const bslam_frame_t *frame, const bslam_camera_t *camera,
                                  const bslam_box_t *rough, bslam_outline_t *outline)
{
    if (!box_is_allowed(frame, rough)) {
        return BSLAM_E_RANGE;
    }
    const bslam_real_t u = (rough->left_px + rough->right_px) / 2;
    const bslam_real_t v = (rough->top_px + rough->bottom_px) / 2;
    bslam_direction_t centre;
    if (bslam_camera_unproject(camera, u, v, &centre) != BSLAM_OK) {
        return BSLAM_E_RANGE;
    }
    bslam_outline_t found = {.facing_rad = bslam_direction_bearing_rad(&centre)};
    facing_t facing;
    bslam_sin_cos(found.facing_rad, &facing.sine, &facing.cosine);
    bslam_real_t top;
    bslam_real_t bottom;
    bslam_real_t aside;
    bslam_real_t level;
    if (!to_plane(camera, &facing, rough->left_px, v, &found.left, &level) ||
        !to_plane(camera, &facing, rough->right_px, v, &found.right, &level) ||
        !to_plane(camera, &facing, u, rough->top_px, &aside, &top) ||
        !to_plane(camera, &facing, u, rough->bottom_px, &aside, &bottom)) {
        return BSLAM_E_RANGE;
    }
    found.top_left = found.top_right = top;
    found.bottom_left = found.bottom_right = bottom;
    found.pixel = (top - bottom) / (rough->bottom_px - rough->top_px);
    found.quad = (bslam_quad_t){rough->left_px,   rough->right_px, rough->top_px,
                                rough->bottom_px, rough->top_px,   rough->bottom_px};
    *outline = found;
    return BSLAM_OK;
}
