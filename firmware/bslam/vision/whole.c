#include "bslam/vision/whole.h"

#include "bslam/math/trig.h"
#include "bslam/vision/side.h"

enum { WIDEN_ROUNDS = 10 };

// A strip beyond an upright side, to see whether level sides go on there: so far from it, so wide at least,
// whole-frame pixels, and as a fraction of the outline's width.
static const bslam_real_t GAP_PX = 3;
static const bslam_real_t STRIP_MIN_PX = 10;
static const bslam_real_t STRIP_SHARE = BSLAM_R(0.3);
// Level sides that keep this much of their contrast beyond an upright one have not ended there.
static const float BEYOND_MAX = 0.4f;
// A level side of less contrast tells nothing of where it ends.
static const float CONTRAST_MIN = 0.05f;
// A box is drawn wider by so much at a time: what is too much, an outline finds back inwards.
static const bslam_real_t WIDEN_PX = 14;
// A box this close to the frame's upper or lower edge has no side there.
static const bslam_real_t CUT_PX = 4;

typedef struct strip {
    bslam_real_t left;  ///< across
    bslam_real_t right;
} strip_t;

/// Contrast along a level side's line, within a strip; below 0 if the lens does not see it.
static float level_contrast(const bslam_frame_t *frame, const bslam_facing_t *facing,
                            const bslam_outline_t *o, bslam_side_name_t name, strip_t strip)
{
    const bslam_stance_t stance = {(float)o->turn, 1e9f, -1e9f};
    const bslam_real_t at = name == BSLAM_SIDE_TOP ? o->top : o->bottom;
    bslam_side_t side;
    if (!bslam_side_scan(&side, frame, facing, name, at, strip.left, strip.right, o->pixel)) {
        return -1;
    }
    return bslam_side_contrast(&side, &stance);
}

/// True if a level side goes on in the strip as it is within the outline.
static bool goes_on(const bslam_frame_t *frame, const bslam_facing_t *facing, const bslam_outline_t *o,
                    bslam_side_name_t name, strip_t beyond)
{
    const strip_t within = {o->left, o->right};
    const float inside = level_contrast(frame, facing, o, name, within);
    return inside > CONTRAST_MIN && level_contrast(frame, facing, o, name, beyond) > BEYOND_MAX * inside;
}

/// The strip, as far as it is in the frame.
static strip_t strip_beyond(const bslam_frame_t *frame, const bslam_outline_t *o, bool left)
{
    const bslam_real_t last_px = (bslam_real_t)frame->width_px - 1;
    const bslam_real_t room_px = (left ? o->quad.left_px : last_px - o->quad.right_px) - GAP_PX;
    const bslam_real_t share = STRIP_SHARE * (o->left - o->right);
    const bslam_real_t least = STRIP_MIN_PX * o->pixel;
    const bslam_real_t room = room_px * o->pixel;
    const bslam_real_t wanted = share > least ? share : least;
    const bslam_real_t width = wanted < room ? wanted : room;
    const bslam_real_t gap = GAP_PX * o->pixel;
    return left ? (strip_t){o->left + gap + width, o->left + gap}
                : (strip_t){o->right - gap, o->right - gap - width};
}

/// Both level sides must go on: beneath things on the floor its line always does. Of something cut off above,
/// the lower side counts alone if it is above the horizon, where no floor is.
static bool ends_too_soon(const bslam_frame_t *frame, const bslam_facing_t *facing,
                          const bslam_whole_t *whole, bool left)
{
    const bslam_outline_t *o = &whole->outline;
    const strip_t beyond = strip_beyond(frame, o, left);
    const bool has_top = whole->rough.top_px > CUT_PX;
    const bool has_bottom = whole->rough.bottom_px < (bslam_real_t)frame->height_px - 1 - CUT_PX;
    if ((has_top && !goes_on(frame, facing, o, BSLAM_SIDE_TOP, beyond)) ||
        (has_bottom && !goes_on(frame, facing, o, BSLAM_SIDE_BOTTOM, beyond))) {
        return false;
    }
    return has_top ? has_bottom : has_bottom && o->bottom > 0;
}

static bslam_status_t find(const bslam_frame_t *frame, const bslam_camera_t *camera, bslam_real_t depth,
                           bslam_whole_t *whole)
{
    const bslam_status_t status = bslam_outline_find(frame, camera, &whole->rough, depth, &whole->outline);
    if (status != BSLAM_OK) {
        return status;
    }
    bslam_facing_t facing = {.camera = camera};
    bslam_sin_cos(whole->outline.facing_rad, &facing.sine, &facing.cosine);
    whole->left_goes_on = ends_too_soon(frame, &facing, whole, true);
    whole->right_goes_on = ends_too_soon(frame, &facing, whole, false);
    return BSLAM_OK;
}

/// Draws the box wider where its outline ends too soon; up to the frame's edge. Level sides keep their place.
static void widen(const bslam_frame_t *frame, bslam_whole_t *whole)
{
    const bslam_real_t last = (bslam_real_t)frame->width_px - BSLAM_R(0.5);
    const bslam_box_t *rough = &whole->rough;
    const bslam_real_t left = rough->left_px - WIDEN_PX;
    const bslam_real_t right = rough->right_px + WIDEN_PX;
    if (whole->left_goes_on) {
        whole->rough.left_px = left > BSLAM_R(-0.5) ? left : BSLAM_R(-0.5);
    }
    if (whole->right_goes_on) {
        whole->rough.right_px = right < last ? right : last;
    }
}

static bool reaches_edge(const bslam_frame_t *frame, const bslam_whole_t *whole)
{
    return (whole->left_goes_on && whole->rough.left_px <= 0) ||
           (whole->right_goes_on && whole->rough.right_px >= (bslam_real_t)(frame->width_px - 1));
}

bslam_status_t bslam_whole_find(const bslam_frame_t *frame, const bslam_camera_t *camera,
                                const bslam_box_t *rough, bslam_real_t depth, bslam_whole_t *whole)
{
    bslam_whole_t found = {.rough = *rough};
    const bslam_status_t status = find(frame, camera, depth, &found);
    if (status != BSLAM_OK) {
        return status;
    }
    for (int32_t i = 0;
         i < WIDEN_ROUNDS && (found.left_goes_on || found.right_goes_on) && !reaches_edge(frame, &found);
         i++) {
        bslam_whole_t wider = found;
        widen(frame, &wider);
        if (find(frame, camera, depth, &wider) != BSLAM_OK) {
            break;
        }
        found = wider;
    }
    *whole = found;
    return BSLAM_OK;
}
