#include "vision/built_in/measurement/partial_view.h"

#include "base/trig.h"
#include "vision/built_in/measurement/body.h"

// A strip beyond an upright side, to see whether level sides go on there: so far from it, so wide at least,
// whole-frame pixels, and as a fraction of the outline's width.
static const bslam_real_t GAP_PX = 3;
// Next to the frame's edge, where there may be little room.
static const bslam_real_t EDGE_GAP_PX = 1;
static const bslam_real_t STRIP_MIN_PX = 10;
static const bslam_real_t STRIP_SHARE = BSLAM_R(0.3);
// Level sides that keep this much of their contrast beyond an upright one have not ended there.
static const float BEYOND_MAX = 0.4f;
// A level side of less contrast tells nothing of where it ends.
static const float CONTRAST_MIN = 0.05f;
// Two level sides of hardly any contrast are said to go on hardly at all.
static const float CONTRAST_LITTLE = 0.02f;
// Along a flank that is narrower a level side goes on as along the front, as far as is seen.
static const bslam_real_t FLANK_MIN_PX = 8;
// A box this close to the frame's upper or lower edge has no side there.
static const bslam_real_t CUT_PX = 4;

typedef struct strip {
    bslam_real_t left;  ///< across
    bslam_real_t right;
} strip_t;

/// An outline in its frame, and how its level sides run.
typedef struct scene {
    const bslam_frame_t *frame;
    const bslam_outline_t *outline;
    bslam_facing_t facing;
    bslam_stance_t stance;
} scene_t;

static scene_t scene_of(const bslam_frame_t *frame, const bslam_camera_t *camera,
                        const bslam_outline_t *outline)
{
    scene_t scene = {.frame = frame,
                     .outline = outline,
                     .facing = {.camera = camera, .mounting = bslam_camera_mounting(camera)},
                     .stance = bslam_outline_stance(outline, FLANK_MIN_PX * outline->pixel)};
    bslam_sin_cos(outline->facing_rad, &scene.facing.sine, &scene.facing.cosine);
    return scene;
}

/// Contrast along a level side's line, within a strip; below 0 if the lens does not see it.
static float level_contrast(const scene_t *scene, bslam_side_name_t name, strip_t strip)
{
    const bslam_real_t at = name == BSLAM_SIDE_TOP ? scene->outline->top : scene->outline->bottom;
    return bslam_side_contrast(scene->frame, &scene->facing, name, at, strip.left, strip.right,
                               &scene->stance);
}

/// True if a level side goes on in the strip as it is within the outline, where its contrast is `inside`.
static bool goes_on(const scene_t *scene, bslam_side_name_t name, float inside, strip_t beyond)
{
    return inside > CONTRAST_MIN && level_contrast(scene, name, beyond) > BEYOND_MAX * inside;
}

/// A strip beyond an upright side, so far from it, as far as it is in the frame. False if none is.
static bool strip_beyond(const scene_t *scene, bool left, bslam_real_t gap_px, strip_t *strip)
{
    const bslam_outline_t *o = scene->outline;
    const bslam_real_t last_px = (bslam_real_t)scene->frame->width_px - 1;
    const bslam_real_t flank_px = (left ? o->body_left - o->left : o->right - o->body_right) / o->pixel;
    const bslam_real_t room_px = (left ? o->quad.left_px : last_px - o->quad.right_px) - flank_px - gap_px;
    const bslam_real_t share = STRIP_SHARE * (o->left - o->right);
    const bslam_real_t least = STRIP_MIN_PX * o->pixel;
    const bslam_real_t room = room_px * o->pixel;
    const bslam_real_t wanted = share > least ? share : least;
    const bslam_real_t width = wanted < room ? wanted : room;
    const bslam_real_t gap = gap_px * o->pixel;
    *strip = left ? (strip_t){o->body_left + gap + width, o->body_left + gap}
                  : (strip_t){o->body_right - gap, o->body_right - gap - width};
    return room > 0;
}

/// Both level sides must go on: beneath things on the floor its line always does. Of something cut off above,
/// the lower side counts alone if it is above the horizon, where no floor is.
bool bslam_outline_is_part(const bslam_frame_t *frame, const bslam_camera_t *camera, const bslam_box_t *rough,
                           const bslam_outline_t *outline, unsigned marks)
{
    static const unsigned CUTS[2] = {BSLAM_MARK_CUT_LEFT, BSLAM_MARK_CUT_RIGHT};
    const bool has_top = rough->top_px > CUT_PX;
    const bool has_bottom = rough->bottom_px < (bslam_real_t)frame->height_px - 1 - CUT_PX;
    if (!has_bottom || (!has_top && outline->bottom <= 0)) {
        return false;
    }
    const scene_t scene = scene_of(frame, camera, outline);
    const strip_t within = {outline->left, outline->right};
    const float top = has_top ? level_contrast(&scene, BSLAM_SIDE_TOP, within) : 0;
    for (int32_t end = 0; end < 2; end++) {
        strip_t beyond;
        if ((marks & CUTS[end]) != 0U || !strip_beyond(&scene, end == 0, GAP_PX, &beyond) ||
            (has_top && !goes_on(&scene, BSLAM_SIDE_TOP, top, beyond))) {
            continue;
        }
        const float bottom = level_contrast(&scene, BSLAM_SIDE_BOTTOM, within);
        if (goes_on(&scene, BSLAM_SIDE_BOTTOM, bottom, beyond)) {
            return true;
        }
    }
    return false;
}

float bslam_outline_beyond(const bslam_frame_t *frame, const bslam_camera_t *camera,
                           const bslam_outline_t *outline, bool left)
{
    const scene_t scene = scene_of(frame, camera, outline);
    const strip_t within = {outline->left, outline->right};
    strip_t beyond;
    if (!strip_beyond(&scene, left, EDGE_GAP_PX, &beyond)) {
        return -1;
    }
    float seen = 0, whole = CONTRAST_LITTLE;
    for (int32_t i = 0; i < 2; i++) {
        const bslam_side_name_t name = i == 0 ? BSLAM_SIDE_TOP : BSLAM_SIDE_BOTTOM;
        const float inside = level_contrast(&scene, name, within);
        const float outside = level_contrast(&scene, name, beyond);
        if (inside < 0 || outside < 0) {
            return -1;
        }
        seen += outside < inside ? outside : inside;
        whole += inside;
    }
    return seen / whole;
}
