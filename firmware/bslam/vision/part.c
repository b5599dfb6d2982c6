#include "bslam/vision/part.h"

#include "bslam/math/trig.h"
#include "bslam/vision/side.h"

// A strip beyond an upright side, to see whether level sides go on there: so far from it, so wide at least,
// whole-frame pixels, and as a fraction of the outline's width.
static const bslam_real_t GAP_PX = 3;
static const bslam_real_t STRIP_MIN_PX = 10;
static const bslam_real_t STRIP_SHARE = BSLAM_R(0.3);
// Level sides that keep this much of their contrast beyond an upright one have not ended there.
static const float BEYOND_MAX = 0.4f;
// A level side of less contrast tells nothing of where it ends.
static const float CONTRAST_MIN = 0.05f;
// Along a flank that is narrower a level side goes on as along the front, as far as is seen.
static const bslam_real_t FLANK_MIN_PX = 8;
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
    const bslam_real_t least = FLANK_MIN_PX * o->pixel;
    const bslam_stance_t stance = {(float)o->turn,
                                   o->body_left - o->left > least ? (float)o->left : BSLAM_FLAT.left,
                                   o->right - o->body_right > least ? (float)o->right : BSLAM_FLAT.right};
    const bslam_real_t at = name == BSLAM_SIDE_TOP ? o->top : o->bottom;
    return bslam_side_contrast(frame, facing, name, at, strip.left, strip.right, &stance);
}

/// True if a level side goes on in the strip as it is within the outline, where its contrast is `inside`.
static bool goes_on(const bslam_frame_t *frame, const bslam_facing_t *facing, const bslam_outline_t *o,
                    bslam_side_name_t name, float inside, strip_t beyond)
{
    return inside > CONTRAST_MIN && level_contrast(frame, facing, o, name, beyond) > BEYOND_MAX * inside;
}

/// The strip, as far as it is in the frame.
static strip_t strip_beyond(const bslam_frame_t *frame, const bslam_outline_t *o, bool left)
{
    const bslam_real_t last_px = (bslam_real_t)frame->width_px - 1;
    const bslam_real_t flank_px = (left ? o->body_left - o->left : o->right - o->body_right) / o->pixel;
    const bslam_real_t room_px = (left ? o->quad.left_px : last_px - o->quad.right_px) - flank_px - GAP_PX;
    const bslam_real_t share = STRIP_SHARE * (o->left - o->right);
    const bslam_real_t least = STRIP_MIN_PX * o->pixel;
    const bslam_real_t room = room_px * o->pixel;
    const bslam_real_t wanted = share > least ? share : least;
    const bslam_real_t width = wanted < room ? wanted : room;
    const bslam_real_t gap = GAP_PX * o->pixel;
    return left ? (strip_t){o->body_left + gap + width, o->body_left + gap}
                : (strip_t){o->body_right - gap, o->body_right - gap - width};
}

/// Both level sides must go on: beneath things on the floor its line always does. Of something cut off above,
/// the lower side counts alone if it is above the horizon, where no floor is.
bool bslam_outline_is_part(const bslam_frame_t *frame, const bslam_camera_t *camera, const bslam_box_t *rough,
                           const bslam_outline_t *outline)
{
    const bool has_top = rough->top_px > CUT_PX;
    const bool has_bottom = rough->bottom_px < (bslam_real_t)frame->height_px - 1 - CUT_PX;
    if (!has_bottom || (!has_top && outline->bottom <= 0)) {
        return false;
    }
    bslam_facing_t facing = {.camera = camera, .mounting = bslam_camera_mounting(camera)};
    bslam_sin_cos(outline->facing_rad, &facing.sine, &facing.cosine);
    const strip_t within = {outline->left, outline->right};
    const float top = has_top ? level_contrast(frame, &facing, outline, BSLAM_SIDE_TOP, within) : 0;
    for (int32_t end = 0; end < 2; end++) {
        const strip_t beyond = strip_beyond(frame, outline, end == 0);
        if (has_top && !goes_on(frame, &facing, outline, BSLAM_SIDE_TOP, top, beyond)) {
            continue;
        }
        const float bottom = level_contrast(frame, &facing, outline, BSLAM_SIDE_BOTTOM, within);
        if (goes_on(frame, &facing, outline, BSLAM_SIDE_BOTTOM, bottom, beyond)) {
            return true;
        }
    }
    return false;
}
