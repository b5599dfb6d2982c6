#include "vision/built_in/measurement/truncation.h"

#include "base/bounds.h"
#include "base/logarithm.h"
#include "base/trig.h"
#include "vision/built_in/measurement/distance.h"
#include "vision/built_in/measurement/body.h"
#include "vision/built_in/measurement/partial_view.h"
#include "base/scalar.h"

// What comes this close to the frame's edge may go on outside: the detector's boxes end at cells of 4 pixels,
// or at some line of the object short of the edge.
static const bslam_real_t CUT_PX = 7;

// Is it whole? Weights of: how much of its level sides is seen between its side and the frame's edge; by what
// part it is narrower than its kind, at most WHOLE_NARROW; how wide it is, w / (w + WHOLE_WIDE_PX), for wide
// things are cut off more often; a level side that is cut off; how sure its side is an edge; and how far its
// box is from the frame's edge, pixels. They are a logistic regression's over 960 training worlds.
static const float WHOLE_BIAS = 5.4f;
static const float WHOLE_BY_LEVEL = 6.2f;
static const float WHOLE_BY_NARROW = 16.4f;
static const float WHOLE_NARROW = 0.3f;
static const float WHOLE_BY_WIDE = 7.3f;
static const float WHOLE_WIDE_PX = 30.0f;
static const float WIDE_MOST_PX = 1000.0f;
static const float WHOLE_BY_UPRIGHT = 5.4f;
static const float WHOLE_BY_EDGE = 4.2f;
static const float WHOLE_BY_BOX_PX = 0.45f;
// What counts for the level sides where there is no room to look for them.
static const float LEVEL_UNKNOWN = 0.5f;

// What is cut off is seen this much narrower than it is, because it is seen obliquely: mean and deviation.
static const bslam_real_t OBLIQUE_MEAN = BSLAM_R(0.9);
static const bslam_real_t OBLIQUE_SD = BSLAM_R(0.12);
// Of a side that the frame cuts off nothing is known: its variance, tangents.
static const bslam_real_t CUT_VAR = 1;
// How well a rough direction is known at best, since its kind may be another one; and the end that is seen,
// as a fraction of what is seen.
static const bslam_real_t CUT_FLOOR_RAD = BSLAM_R(0.02);
static const bslam_real_t END_SD = BSLAM_R(0.15);

unsigned bslam_cut_marks(const bslam_frame_t *frame, const bslam_box_t *box)
{
    const bslam_real_t right = (bslam_real_t)frame->width_px - BSLAM_R(0.5);
    const bslam_real_t bottom = (bslam_real_t)frame->height_px - BSLAM_R(0.5);
    return (box->left_px < CUT_PX - BSLAM_R(0.5) ? (unsigned)BSLAM_MARK_CUT_LEFT : 0U) |
           (box->right_px > right - CUT_PX ? (unsigned)BSLAM_MARK_CUT_RIGHT : 0U) |
           (box->top_px < CUT_PX - BSLAM_R(0.5) ? (unsigned)BSLAM_MARK_CUT_TOP : 0U) |
           (box->bottom_px > bottom - CUT_PX ? (unsigned)BSLAM_MARK_CUT_BOTTOM : 0U);
}

bool bslam_cut_on_one_side(unsigned marks)
{
    return ((marks & BSLAM_MARK_CUT_LEFT) != 0U) != ((marks & BSLAM_MARK_CUT_RIGHT) != 0U);
}

/// By what part its front is seen narrower than its kind; 0 if that is not known.
static float narrowness(const bslam_outline_t *o, const bslam_camera_t *camera, const bslam_size_t *size)
{
    if (!(size->height_m > 0) || !(size->narrow_m > 0)) {
        return 0.0f;
    }
    const bslam_ahead_t ahead = bslam_ahead_of_body(o, camera, size);
    if (!(ahead.inverse > 0)) {
        return WHOLE_NARROW;
    }
    const bslam_real_t missing = 1 - bslam_front_width_m(o, &ahead) / size->narrow_m;
    return bslam_clampf((float)missing, 0.0f, WHOLE_NARROW);
}

float bslam_cut_whole_chance(const bslam_frame_t *frame, const bslam_camera_t *camera,
                             const bslam_box_t *rough, const bslam_outline_t *o, const bslam_size_t *size,
                             unsigned marks)
{
    const bool is_left = (marks & BSLAM_MARK_CUT_LEFT) != 0U;
    const bslam_real_t from_edge_px = is_left
                                          ? rough->left_px + BSLAM_R(0.5)
                                          : (bslam_real_t)frame->width_px - BSLAM_R(0.5) - rough->right_px;
    const float level = bslam_outline_beyond(frame, camera, o, is_left);
    const bslam_stance_t front = {(float)o->turn, (float)o->left, (float)o->right};
    const float wide_px = bslam_clampf((float)(bslam_body_width(&front) / o->pixel), 0.0f, WIDE_MOST_PX);
    const float edge_px = (float)(bslam_sqrt(is_left ? o->left_var : o->right_var) / o->pixel);
    const bool is_cut_upright = (marks & (BSLAM_MARK_CUT_TOP | BSLAM_MARK_CUT_BOTTOM)) != 0U;
    const float odds = WHOLE_BIAS - WHOLE_BY_LEVEL * (level < 0.0f ? LEVEL_UNKNOWN : level) -
                       WHOLE_BY_NARROW * narrowness(o, camera, size) -
                       WHOLE_BY_WIDE * wide_px / (wide_px + WHOLE_WIDE_PX) -
                       (is_cut_upright ? WHOLE_BY_UPRIGHT : 0.0f) + WHOLE_BY_EDGE / (1.0f + edge_px) +
                       WHOLE_BY_BOX_PX * (float)from_edge_px;
    const float rarer = bslam_falling(odds < 0.0f ? -odds : odds);
    return (odds < 0.0f ? rarer : 1.0f) / (1.0f + rarer);
}

bool bslam_cut_bearing(const bslam_outline_t *outline, const bslam_camera_t *camera, const bslam_size_t *size,
                       unsigned marks, bslam_bearing_t *bearing)
{
    if (!(size->wide_m > 0) || !(size->height_m > 0)) {
        return false;
    }
    // The outline's corners are not asked: without one end the slope of its level sides is a guess.
    bslam_outline_t o = *outline;
    o.turn = 0;
    o.top_var = (marks & BSLAM_MARK_CUT_TOP) != 0U ? CUT_VAR : o.top_var;
    o.bottom_var = (marks & BSLAM_MARK_CUT_BOTTOM) != 0U ? CUT_VAR : o.bottom_var;
    const bslam_ahead_t ahead = bslam_ahead(&o, camera, size);
    if (!(ahead.inverse > 0) || !(ahead.relative_var < 1)) {
        return false;
    }
    const bool goes_left = (marks & BSLAM_MARK_CUT_LEFT) != 0U;
    const bslam_real_t mean_m = (size->narrow_m + size->wide_m) / 2, band_m = size->wide_m - size->narrow_m;
    const bslam_real_t seen = o.left - o.right;
    const bslam_real_t expected = OBLIQUE_MEAN * mean_m * ahead.inverse;
    const bslam_real_t half = (expected > seen ? expected : seen) / 2;
    const bslam_real_t relative_var =
        band_m * band_m / (12 * mean_m * mean_m) + OBLIQUE_SD * OBLIQUE_SD + ahead.relative_var;
    const bslam_real_t end_sd = END_SD * seen;
    const bslam_real_t middle = goes_left ? o.right + half : o.left - half;
    bearing->angle_rad = bslam_angle_wrap(o.facing_rad + bslam_atan2(middle, 1));
    bearing->sd_rad =
        bslam_sqrt(CUT_FLOOR_RAD * CUT_FLOOR_RAD + end_sd * end_sd + half * half * relative_var);
    return true;
}
