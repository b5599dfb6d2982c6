#include "bslam/vision/measure.h"

#include <string.h>

#include "bslam/math/trig.h"
#include "bslam/vision/ends.h"
#include "bslam/vision/part.h"
#include "bslam/vision/signature.h"

static const bslam_real_t SIZE_MAX_M = 10;
// What comes this close to the frame's edge may go on outside: the detector's boxes end at cells of 4 pixels,
// or at some line of the object short of the edge.
static const bslam_real_t CUT_PX = 7;
// Below this height no distance, below this width or height no direction.
static const bslam_real_t HEIGHT_MIN_PX = 8;
static const bslam_real_t SIDE_MIN_PX = 5;
// The variances: a floor, how well an edge is found where it is sure which edge (pixels), and how much of the
// outline's doubts about which edge it is counts. Fitted to the errors in training worlds;
// docs/EXPERIMENTS.md has the errors that these leave in test worlds.
static const bslam_real_t BEARING_FLOOR_RAD = BSLAM_R(0.0008);
static const bslam_real_t RANGE_FLOOR = BSLAM_R(0.01);
static const bslam_real_t POINT_SD_PX = BSLAM_R(0.3);
static const bslam_real_t BEARING_DOUBT = BSLAM_R(0.3);
// Of a wide object's width, for what is not flat or not level about it; and pixels by its square, for turns.
static const bslam_real_t BEARING_BY_WIDTH = BSLAM_R(0.008);
static const bslam_real_t BEARING_BY_WIDTH2_PX = 8;
// So far from a lens' axis, radians, a bearing's variance is doubled: upright sides are bent into the scan
// lines.
static const bslam_real_t OFF_AXIS_RAD = BSLAM_R(1.05);
static const bslam_real_t RANGE_DOUBT = 1;
// A distance that is less certain than this, as a fraction, is none.
static const bslam_real_t RANGE_SD_MAX = BSLAM_R(0.15);
// An upper side that is outside its kind's band by more than so many standard deviations is another kind's,
// or no side. What is known of the band, and of where the horizon is.
static const bslam_real_t MISPLACED_SDS = 3;
static const bslam_real_t BAND_SD_M = BSLAM_R(0.015);
static const bslam_real_t HORIZON_SD_PX = BSLAM_R(0.7);
// A round thing's width may be off by this part, and contradict its height by so many standard deviations.
static const bslam_real_t WIDTH_SD = BSLAM_R(0.04);
static const bslam_real_t WIDTH_SDS = 2;
// What is seen narrower than this part of the least width of its kind has something before its side: less
// would mark what is only seen a little more obliquely than its level sides tell.
static const bslam_real_t HIDDEN_BELOW = BSLAM_R(0.8);
// What is cut off is seen this much narrower than it is, because it is seen obliquely: mean and deviation.
static const bslam_real_t OBLIQUE_MEAN = BSLAM_R(0.9);
static const bslam_real_t OBLIQUE_SD = BSLAM_R(0.12);
// Of a side that the frame cuts off nothing is known: its variance, tangents.
static const bslam_real_t CUT_VAR = 1;
// How well a rough direction is known at best, since its kind may be another one; and the end that is seen,
// as a fraction of what is seen.
static const bslam_real_t CUT_FLOOR_RAD = BSLAM_R(0.02);
static const bslam_real_t END_SD = BSLAM_R(0.15);
// Seen more obliquely than this, tangent, an object is marked and not measured.
static const bslam_real_t TURN_MAX = BSLAM_R(1.5);

static bool box_is_number(const bslam_box_t *box)
{
    return bslam_is_number(box->left_px) && bslam_is_number(box->top_px) && bslam_is_number(box->right_px) &&
           bslam_is_number(box->bottom_px);
}

static bslam_status_t check_size(const bslam_size_t *size)
{
    const bslam_real_t lengths_m[] = {size->height_m, size->depth_m, size->top_low_m, size->top_high_m,
                                      size->width_m,  size->body_m,  size->narrow_m,  size->wide_m};
    bool in_range = size->top_low_m <= size->top_high_m && size->narrow_m <= size->wide_m &&
                    size->body_m <= size->height_m && bslam_in_range(size->looks_sd, 0, 1) &&
                    bslam_in_range(size->scale_sd, 0, 1);
    bool are_numbers = bslam_is_number(size->looks_sd) && bslam_is_number(size->scale_sd);
    for (int32_t i = 0; i < (int32_t)(sizeof lengths_m / sizeof lengths_m[0]); i++) {
        in_range = in_range && bslam_in_range(lengths_m[i], 0, SIZE_MAX_M);
        are_numbers = are_numbers && bslam_is_number(lengths_m[i]);
    }
    return !are_numbers ? BSLAM_E_NOT_FINITE : in_range ? BSLAM_OK : BSLAM_E_RANGE;
}

/// Marks of a box that comes near the frame's edge.
static unsigned cuts_of(const bslam_frame_t *frame, const bslam_box_t *box)
{
    const bslam_real_t right = (bslam_real_t)frame->width_px - BSLAM_R(0.5);
    const bslam_real_t bottom = (bslam_real_t)frame->height_px - BSLAM_R(0.5);
    return (box->left_px < CUT_PX - BSLAM_R(0.5) ? (unsigned)BSLAM_MARK_CUT_LEFT : 0U) |
           (box->right_px > right - CUT_PX ? (unsigned)BSLAM_MARK_CUT_RIGHT : 0U) |
           (box->top_px < CUT_PX - BSLAM_R(0.5) ? (unsigned)BSLAM_MARK_CUT_TOP : 0U) |
           (box->bottom_px > bottom - CUT_PX ? (unsigned)BSLAM_MARK_CUT_BOTTOM : 0U);
}

static bool is_small(const bslam_box_t *rough)
{
    return rough->right_px - rough->left_px < SIDE_MIN_PX || rough->bottom_px - rough->top_px < HEIGHT_MIN_PX;
}

static unsigned mark_if(bool is, unsigned mark)
{
    return is ? mark : 0U;
}

/// Marks of what the rough box, or the outline found near it, tells.
static unsigned marks_of(const bslam_frame_t *frame, const bslam_camera_t *camera, const bslam_box_t *rough,
                         const bslam_outline_t *outline, const bslam_box_t *found)
{
    return cuts_of(frame, rough) | cuts_of(frame, found) | mark_if(is_small(rough), BSLAM_MARK_SMALL) |
           mark_if(bslam_abs(outline->turn) > TURN_MAX, BSLAM_MARK_SLANTED) |
           mark_if(bslam_outline_is_part(frame, camera, rough, outline), BSLAM_MARK_PART);
}

static bslam_box_t box_around(const bslam_quad_t *quad)
{
    const bool left_higher = quad->top_left_px < quad->top_right_px;
    const bool left_lower = quad->bottom_left_px > quad->bottom_right_px;
    return (bslam_box_t){.left_px = quad->left_px,
                         .top_px = left_higher ? quad->top_left_px : quad->top_right_px,
                         .right_px = quad->right_px,
                         .bottom_px = left_lower ? quad->bottom_left_px : quad->bottom_right_px};
}

/// The angle of a pixel as it came from the camera: what is doubled is not known better.
static bslam_real_t camera_pixel(const bslam_outline_t *o, const bslam_camera_t *camera)
{
    return camera->zoom > 1 ? o->pixel * (bslam_real_t)camera->zoom : o->pixel;
}

static bslam_real_t point_variance(const bslam_outline_t *o, const bslam_camera_t *camera)
{
    const bslam_real_t sd = POINT_SD_PX * camera_pixel(o, camera);
    return sd * sd;
}

static bslam_real_t bearing_variance(const bslam_outline_t *o, const bslam_camera_t *camera,
                                     bslam_real_t point_var)
{
    const bslam_real_t width = o->left - o->right;
    const bslam_real_t by_width =
        width * (BEARING_BY_WIDTH + width * BEARING_BY_WIDTH2_PX * camera_pixel(o, camera));
    const bslam_real_t off_axis = bslam_angle_wrap(o->facing_rad - camera->yaw_rad) / OFF_AXIS_RAD;
    const bslam_real_t square = off_axis * off_axis;
    return (BEARING_FLOOR_RAD * BEARING_FLOOR_RAD + point_var / 2 + by_width * by_width +
            BEARING_DOUBT * o->middle_var) *
           (1 + square * square * square);
}

/// How far ahead an object is, from where its upper and its lower side are seen.
typedef struct ahead {
    bslam_real_t inverse;       ///< 1/m
    bslam_real_t relative_var;  ///< of it
    bslam_real_t noise_var;     ///< the part of that which is another one in each frame, relative as well
    bslam_real_t residual_sds;  ///< by how much its two sides contradict its place; 0 without one
} ahead_t;

/// Least squares over both sides: each is seen at its height over the camera times the inverse distance. What
/// errs alike for both, the horizon and the place, counts as one common error: where the place is not known,
/// it is endless, and all that is left is the apparent height. MATH "Measuring".
static ahead_t ahead_of(const bslam_outline_t *o, const bslam_camera_t *camera, const bslam_size_t *size,
                        bslam_real_t point_var)
{
    const bslam_real_t nearness = 1 + o->turn * o->middle;  // of the middle, to what is straight ahead
    const bslam_real_t top = o->top * nearness;
    const bslam_real_t bottom = o->bottom * nearness;
    const bslam_real_t height_m = size->height_m;
    const bslam_real_t by_height = (top - bottom) / height_m;
    const bslam_real_t looks = size->looks_sd * height_m * by_height;
    const bslam_real_t top_noise = point_var + RANGE_DOUBT * o->top_var;
    const bslam_real_t bottom_noise = point_var + RANGE_DOUBT * o->bottom_var;
    const bslam_real_t top_var = top_noise;
    const bslam_real_t bottom_var = bottom_noise + looks * looks;
    if (!(size->top_high_m > 0)) {
        const bslam_real_t square = (top - bottom) * (top - bottom);
        return (ahead_t){by_height, (top_var + bottom_var) / square, (top_noise + bottom_noise) / square, 0};
    }
    const bslam_real_t band_m = size->top_high_m - size->top_low_m;
    const bslam_real_t place_var = (BAND_SD_M * BAND_SD_M + band_m * band_m / 12) * by_height * by_height;
    const bslam_real_t horizon = HORIZON_SD_PX * camera_pixel(o, camera);
    const bslam_real_t common = horizon * horizon + place_var;
    const bslam_real_t top_m = (size->top_low_m + size->top_high_m) / 2 - camera->z_m;
    const bslam_real_t bottom_m = top_m - height_m;
    const bslam_real_t information =
        top_m * top_m * bottom_var + bottom_m * bottom_m * top_var + common * height_m * height_m;
    const bslam_real_t determinant = top_var * bottom_var + common * (top_var + bottom_var);
    const bslam_real_t by_top = (top_m * bottom_var + common * height_m) / information;
    const bslam_real_t by_bottom = (bottom_m * top_var - common * height_m) / information;
    const bslam_real_t inverse = by_top * top + by_bottom * bottom;
    const bslam_real_t square = inverse * inverse;
    const bslam_real_t top_left = top - top_m * inverse;
    const bslam_real_t bottom_left = bottom - bottom_m * inverse;
    const bslam_real_t apart = top_left - bottom_left;
    const bslam_real_t distance2 =
        (top_left * top_left * bottom_var + bottom_left * bottom_left * top_var + common * apart * apart) /
        determinant;
    return (ahead_t){inverse, determinant / (information * square),
                     (by_top * by_top * top_noise + by_bottom * by_bottom * bottom_noise) / square,
                     bslam_sqrt(distance2)};
}

/// How wide something round is seen, of what it would be so far ahead.
static bslam_real_t width_ratio(const bslam_outline_t *o, const bslam_size_t *size, const ahead_t *ahead)
{
    return (o->left - o->right) / (size->width_m * ahead->inverse);
}

/// As ahead_of; by the body alone where the width is nearer to that of an object seen without its neck.
static ahead_t ahead_of_body(const bslam_outline_t *o, const bslam_camera_t *camera, const bslam_size_t *size,
                             bslam_real_t point_var)
{
    const ahead_t whole = ahead_of(o, camera, size, point_var);
    if (!(size->width_m > 0 && size->body_m > 0 && whole.inverse > 0)) {
        return whole;
    }
    const bslam_real_t ratio = width_ratio(o, size, &whole);
    if (ratio * ratio * size->body_m < size->height_m) {
        return whole;
    }
    const bslam_real_t neck_m = size->height_m - size->body_m;
    bslam_size_t body = *size;
    body.height_m = size->body_m;
    body.top_low_m -= neck_m;
    body.top_high_m -= neck_m;
    return ahead_of(o, camera, &body, point_var);
}

/// False if the width of something round contradicts that.
static bool agrees_with_width(const bslam_outline_t *o, const bslam_size_t *size, bslam_real_t point_var,
                              const ahead_t *ahead)
{
    if (!(size->width_m > 0)) {
        return true;
    }
    const bslam_real_t width = o->left - o->right;
    const bslam_real_t ratio = width_ratio(o, size, ahead);
    const bslam_real_t variance = WIDTH_SD * WIDTH_SD + ahead->relative_var +
                                  (2 * point_var + o->left_var + o->right_var) / (width * width);
    return (ratio - 1) * (ratio - 1) <= WIDTH_SDS * WIDTH_SDS * variance;
}

/// Marks a front that is narrower than its kind: something stands before one of its sides, so its middle may
/// be off by half of what is missing, to either side. Its height, and with it its distance, is not touched.
static void mark_hidden(const bslam_outline_t *o, const bslam_size_t *size, const ahead_t *ahead,
                        bslam_candidate_t *candidate)
{
    const bslam_real_t seen = o->left - o->right;
    const bslam_real_t both = (1 + o->turn * o->left) * (1 + o->turn * o->right);
    const bslam_real_t width_m = seen * bslam_sqrt(1 + o->turn * o->turn) / (ahead->inverse * both);
    if (width_m < HIDDEN_BELOW * size->narrow_m) {
        const bslam_real_t sd = candidate->bearing_sd_rad, off = (size->narrow_m / width_m - 1) * seen / 2;
        candidate->marks |= BSLAM_MARK_HIDDEN;
        candidate->bearing_sd_rad = bslam_sqrt(sd * sd + off * off);
    }
}

/// Direction, and distance if the height is known, with what is left of their errors when the outline is
/// known.
static void measure_outline(const bslam_outline_t *o, const bslam_camera_t *camera, const bslam_size_t *size,
                            bool is_whole, bslam_candidate_t *candidate)
{
    const bslam_real_t point_var = point_variance(o, camera);
    candidate->bearing_rad = bslam_angle_wrap(o->facing_rad + bslam_atan2(o->middle, 1));
    candidate->bearing_sd_rad = bslam_sqrt(bearing_variance(o, camera, point_var));
    candidate->has_bearing = true;
    if (!is_whole || !(size->height_m > 0)) {
        return;
    }
    const ahead_t ahead = ahead_of_body(o, camera, size, point_var);
    const bslam_real_t relative_var = RANGE_FLOOR * RANGE_FLOOR + ahead.relative_var;
    candidate->misplaced_sds = (float)ahead.residual_sds;
    const bool hangs_right = ahead.residual_sds <= MISPLACED_SDS && ahead.inverse > 0;
    if (hangs_right) {
        mark_hidden(o, size, &ahead, candidate);
    }
    if (!hangs_right || !agrees_with_width(o, size, point_var, &ahead)) {
        candidate->marks |= BSLAM_MARK_MISPLACED;
        return;
    }
    candidate->range_m = bslam_sqrt(1 + o->middle * o->middle) / ahead.inverse;
    candidate->range_sd_m = candidate->range_m * bslam_sqrt(relative_var);
    candidate->range_noise_sd_m = candidate->range_m * bslam_sqrt(ahead.noise_var);
    candidate->range_scale_sd =
        size->scale_sd > 0 ? size->scale_sd : bslam_sqrt(relative_var - ahead.noise_var);
    candidate->has_range = relative_var <= RANGE_SD_MAX * RANGE_SD_MAX;
}

/// Whether it is cut off on one upright side, and what is left of it can tell a rough direction.
static bool is_cut_sideways(unsigned marks)
{
    const bool left = (marks & BSLAM_MARK_CUT_LEFT) != 0U, right = (marks & BSLAM_MARK_CUT_RIGHT) != 0U;
    return left != right && (marks & (BSLAM_MARK_SMALL | BSLAM_MARK_SLANTED)) == 0U;
}

/// Rough direction of something that the frame cuts off on one side: from the end that is seen it reaches as
/// far as its kind is wide, at the distance that its height and place tell, and beyond the frame's edge at
/// least.
static void measure_cut(const bslam_outline_t *found, const bslam_camera_t *camera, const bslam_size_t *size,
                        unsigned marks, bslam_candidate_t *candidate)
{
    bslam_outline_t o = *found;
    o.turn = 0;
    o.top_var = (marks & BSLAM_MARK_CUT_TOP) != 0U ? CUT_VAR : o.top_var;
    o.bottom_var = (marks & BSLAM_MARK_CUT_BOTTOM) != 0U ? CUT_VAR : o.bottom_var;
    const ahead_t ahead = ahead_of(&o, camera, size, point_variance(&o, camera));
    if (!(ahead.inverse > 0) || !(ahead.relative_var < 1)) {
        return;
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
    candidate->bearing_rad = bslam_angle_wrap(o.facing_rad + bslam_atan2(middle, 1));
    candidate->bearing_sd_rad =
        bslam_sqrt(CUT_FLOOR_RAD * CUT_FLOOR_RAD + end_sd * end_sd + half * half * relative_var);
    candidate->has_bearing = true;
}

/// The outline near the box, whose sides move to where it ends. False if there is none.
static bool find_outline(const bslam_frame_t *frame, const bslam_camera_t *camera, const bslam_size_t *size,
                         bslam_box_t *box, bslam_outline_t *outline)
{
    const bslam_front_t front = {size->height_m, size->depth_m, size->narrow_m, size->wide_m};
    if (bslam_outline_find(frame, camera, box, &front, outline) != BSLAM_OK) {
        return false;
    }
    bslam_box_t moved = *box;
    if (bslam_ends_move(frame, camera, outline, &front, &moved) &&
        bslam_outline_find(frame, camera, &moved, &front, outline) == BSLAM_OK) {
        *box = moved;
    }
    return true;
}

bslam_status_t bslam_measure(const bslam_frame_t *frame, const bslam_camera_t *camera,
                             const bslam_box_t *rough, const bslam_size_t *size, bslam_candidate_t *candidate)
{
    const bslam_status_t bad_size = check_size(size);
    if (!box_is_number(rough) || bad_size == BSLAM_E_NOT_FINITE) {
        return BSLAM_E_NOT_FINITE;
    }
    if (camera->width_px != frame->width_px || camera->height_px != frame->height_px) {
        return BSLAM_E_PARAMETER;
    }
    bslam_box_t box = *rough;
    bslam_outline_t outline;
    if (bad_size != BSLAM_OK || !find_outline(frame, camera, size, &box, &outline)) {
        return BSLAM_E_RANGE;
    }
    const bslam_box_t found = box_around(&outline.quad);
    const unsigned marks = marks_of(frame, camera, &box, &outline, &found);
    const unsigned sideways =
        BSLAM_MARK_CUT_LEFT | BSLAM_MARK_CUT_RIGHT | BSLAM_MARK_SMALL | BSLAM_MARK_SLANTED | BSLAM_MARK_PART;
    const unsigned upright = BSLAM_MARK_CUT_TOP | BSLAM_MARK_CUT_BOTTOM;
    candidate->has_bearing = false;
    candidate->has_range = false;
    candidate->misplaced_sds = 0;
    candidate->marks = (uint16_t)marks;
    if ((marks & sideways) == 0U) {
        measure_outline(&outline, camera, size, (marks & upright) == 0U, candidate);
    } else if (is_cut_sideways(marks) && size->wide_m > 0) {
        // The outline's corners are not asked: without one end the slope of its level sides is a guess.
        measure_cut(&outline, camera, size, (marks & sideways) | (cuts_of(frame, &box) & upright), candidate);
    }
    candidate->outline = found;
    if (bslam_signature(frame, &outline.quad, candidate->signature) != BSLAM_OK) {
        memset(candidate->signature, 0, sizeof candidate->signature);
    }
    return BSLAM_OK;
}
