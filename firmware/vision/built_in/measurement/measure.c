#include "vision/built_in/measurement/measure.h"

#include <string.h>

#include "base/trig.h"
#include "vision/built_in/measurement/distance.h"
#include "vision/built_in/measurement/truncation.h"
#include "vision/built_in/measurement/ends.h"
#include "vision/built_in/measurement/partial_view.h"
#include "vision/built_in/measurement/signature.h"
#include "base/scalar.h"

enum {
    SIDEWAYS = BSLAM_MARK_CUT_LEFT | BSLAM_MARK_CUT_RIGHT,
    UPRIGHT = BSLAM_MARK_CUT_TOP | BSLAM_MARK_CUT_BOTTOM,
    UNMEASURED = BSLAM_MARK_SMALL | BSLAM_MARK_SLANTED
};

static const bslam_real_t SIZE_MAX_M = 10;
// Below this height no distance, below this width or height no direction.
static const bslam_real_t HEIGHT_MIN_PX = 8;
static const bslam_real_t SIDE_MIN_PX = 5;
// The variances: floors, and how much of the outline's doubts about which edge it is counts. Fitted to the
// errors in training worlds.
static const bslam_real_t BEARING_FLOOR_RAD = BSLAM_R(0.0008);
static const bslam_real_t RANGE_FLOOR = BSLAM_R(0.01);
static const bslam_real_t BEARING_DOUBT = BSLAM_R(0.3);
// Of a wide object's width, for what is not flat or not level about it; and pixels by its square, for turns.
static const bslam_real_t BEARING_BY_WIDTH = BSLAM_R(0.008);
static const bslam_real_t BEARING_BY_WIDTH2_PX = 8;
// So far from a lens' axis, radians, a bearing's variance is doubled: upright sides are bent into the scan
// lines.
static const bslam_real_t OFF_AXIS_RAD = BSLAM_R(1.05);
// A distance that is less certain than this, as a fraction, is none.
static const bslam_real_t RANGE_SD_MAX = BSLAM_R(0.15);
// An upper side that is outside its kind's band by more than so many standard deviations is another kind's,
// or no side.
static const bslam_real_t MISPLACED_SDS = 3;
// What is seen narrower than this part of the least width of its kind has something before its side: less
// would mark what is only seen a little more obliquely than its level sides tell.
static const bslam_real_t HIDDEN_BELOW = BSLAM_R(0.8);
// What is seen as wide as its kind may be at most, but for this part of it, is no part of one.
static const bslam_real_t FULL_WITHIN = BSLAM_R(0.07);
// Seen more obliquely than this, tangent, an object is marked and not measured.
static const bslam_real_t TURN_MAX = BSLAM_R(1.5);
// What is next to the frame's edge is whole if that is so likely.
static const float WHOLE_SURE = 0.9f;

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

static bool is_small(const bslam_box_t *rough)
{
    return rough->right_px - rough->left_px < SIDE_MIN_PX || rough->bottom_px - rough->top_px < HEIGHT_MIN_PX;
}

static unsigned mark_if(bool is, unsigned mark)
{
    return is ? mark : 0U;
}

/// Whether a front is seen as wide as its kind can be: it has no more parts.
static bool is_full(const bslam_outline_t *o, const bslam_camera_t *camera, const bslam_size_t *size)
{
    if (!(size->height_m > 0) || !(size->wide_m > 0)) {
        return false;
    }
    const bslam_ahead_t ahead = bslam_ahead_of_body(o, camera, size);
    const bslam_real_t width = bslam_front_width_m(o, &ahead) / size->wide_m;
    return ahead.inverse > 0 && width >= 1 - FULL_WITHIN && width <= 1 + FULL_WITHIN;
}

/// Marks of what the rough box, or the outline found near it, tells.
static unsigned marks_of(const bslam_frame_t *frame, const bslam_camera_t *camera, const bslam_box_t *rough,
                         const bslam_outline_t *outline, const bslam_size_t *size, const bslam_box_t *found)
{
    const unsigned cuts = bslam_cut_marks(frame, rough) | bslam_cut_marks(frame, found);
    return cuts | mark_if(is_small(rough), BSLAM_MARK_SMALL) |
           mark_if(bslam_abs(outline->turn) > TURN_MAX, BSLAM_MARK_SLANTED) |
           mark_if(((cuts & UPRIGHT) != 0U || !is_full(outline, camera, size)) &&
                       bslam_outline_is_part(frame, camera, rough, outline, cuts),
                   BSLAM_MARK_PART);
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

/// Direction of an outline's middle.
static bslam_bearing_t outline_bearing(const bslam_outline_t *o, const bslam_camera_t *camera)
{
    const bslam_real_t width = o->left - o->right;
    const bslam_real_t by_width =
        width * (BEARING_BY_WIDTH + width * BEARING_BY_WIDTH2_PX * bslam_camera_pixel(o, camera));
    const bslam_real_t off_axis = bslam_angle_wrap(o->facing_rad - camera->yaw_rad) / OFF_AXIS_RAD;
    const bslam_real_t square = off_axis * off_axis;
    const bslam_real_t variance =
        (BEARING_FLOOR_RAD * BEARING_FLOOR_RAD + bslam_edge_variance(o, camera) / 2 + by_width * by_width +
         BEARING_DOUBT * o->middle_var + o->ends_var) *
        (1 + square * square * square);
    return (bslam_bearing_t){bslam_angle_wrap(o->facing_rad + bslam_atan2(o->middle, 1)),
                             bslam_sqrt(variance)};
}

static void set_bearing(bslam_candidate_t *candidate, const bslam_bearing_t *bearing)
{
    candidate->bearing_rad = bearing->angle_rad;
    candidate->bearing_sd_rad = bearing->sd_rad;
    candidate->has_bearing = true;
}

/// Marks a front that is narrower than its kind: something stands before one of its sides, so its middle may
/// be off by half of what is missing, to either side. Its height, and with it its distance, is not touched.
static void mark_hidden(const bslam_outline_t *o, const bslam_size_t *size, const bslam_ahead_t *ahead,
                        bslam_candidate_t *candidate)
{
    const bslam_real_t width_m = bslam_front_width_m(o, ahead), seen = o->left - o->right;
    if (width_m < HIDDEN_BELOW * size->narrow_m) {
        const bslam_real_t sd = candidate->bearing_sd_rad, off = (size->narrow_m / width_m - 1) * seen / 2;
        candidate->marks |= BSLAM_MARK_HIDDEN;
        candidate->bearing_sd_rad = bslam_sqrt(sd * sd + off * off);
    }
}

/// How many times its noise a distance errs by, whose two sides contradict each other: one of them is then
/// another edge, which it will be in the next frames as well.
static bslam_real_t contradiction(const bslam_ahead_t *ahead)
{
    const bslam_real_t square = ahead->residual_sds * ahead->residual_sds;
    return square > 1 ? square : 1;
}

/// Direction, and distance if the height is known, with what is left of their errors when the outline is
/// known.
static void measure_outline(const bslam_outline_t *o, const bslam_camera_t *camera, const bslam_size_t *size,
                            bool is_whole, bslam_candidate_t *candidate)
{
    const bslam_bearing_t bearing = outline_bearing(o, camera);
    set_bearing(candidate, &bearing);
    if (!is_whole || !(size->height_m > 0)) {
        return;
    }
    const bslam_ahead_t ahead = bslam_ahead_of_body(o, camera, size);
    const bslam_real_t times = contradiction(&ahead);
    const bslam_real_t noise_var = ahead.noise_var * times * times;
    const bslam_real_t relative_var =
        RANGE_FLOOR * RANGE_FLOOR + ahead.relative_var + (noise_var - ahead.noise_var);
    candidate->misplaced_sds = (float)ahead.residual_sds;
    const bool hangs_right = ahead.residual_sds <= MISPLACED_SDS && ahead.inverse > 0;
    if (hangs_right) {
        mark_hidden(o, size, &ahead, candidate);
    }
    if (!hangs_right || !bslam_width_agrees(o, camera, size, &ahead)) {
        candidate->marks |= BSLAM_MARK_MISPLACED;
        return;
    }
    candidate->range_m = bslam_sqrt(1 + o->middle * o->middle) / ahead.inverse;
    candidate->range_sd_m = candidate->range_m * bslam_sqrt(relative_var);
    candidate->range_noise_sd_m = candidate->range_m * bslam_sqrt(noise_var);
    candidate->range_scale_sd = size->scale_sd > 0 ? size->scale_sd : bslam_sqrt(relative_var - noise_var);
    candidate->has_range = relative_var <= RANGE_SD_MAX * RANGE_SD_MAX;
}

/// Something that ends next to the frame's left or right edge, or goes on beyond it: its direction is the
/// mean of both, by how likely they are. What is surely whole loses its mark and has a distance.
static void measure_at_edge(const bslam_frame_t *frame, const bslam_camera_t *camera,
                            const bslam_box_t *rough, const bslam_outline_t *o, const bslam_size_t *size,
                            bslam_candidate_t *candidate)
{
    const unsigned marks = candidate->marks;
    const bool is_part = (marks & BSLAM_MARK_PART) != 0U;
    const float whole = is_part ? 0 : bslam_cut_whole_chance(frame, camera, rough, o, size, marks);
    const bslam_real_t chance = (bslam_real_t)whole, other = 1 - chance;
    // A level side that the box does not leave out may be there, whatever its outline's corners do.
    const unsigned cuts = (marks & SIDEWAYS) | (bslam_cut_marks(frame, rough) & UPRIGHT);
    bslam_bearing_t cut = {0, 0}, mean = outline_bearing(o, camera);
    const bool has_cut = bslam_cut_bearing(o, camera, size, cuts, &cut);
    if (whole >= WHOLE_SURE) {
        candidate->marks &= (uint16_t)~SIDEWAYS;
        measure_outline(o, camera, size, (marks & UPRIGHT) == 0U, candidate);
    }
    if (has_cut) {
        const bslam_real_t apart_rad = bslam_angle_wrap(cut.angle_rad - mean.angle_rad);
        mean.angle_rad = bslam_angle_wrap(mean.angle_rad + other * apart_rad);
        mean.sd_rad = bslam_sqrt(chance * mean.sd_rad * mean.sd_rad + other * cut.sd_rad * cut.sd_rad +
                                 chance * other * apart_rad * apart_rad);
        set_bearing(candidate, &mean);
    }
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
    const bslam_ends_t ends = bslam_ends_move(frame, camera, outline, &front, &moved);
    if (ends.moved && bslam_outline_find(frame, camera, &moved, &front, outline) == BSLAM_OK) {
        *box = moved;
    }
    outline->middle += ends.offset;
    outline->ends_var = ends.variance;
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
    const unsigned marks = marks_of(frame, camera, &box, &outline, size, &found);
    candidate->has_bearing = false;
    candidate->has_range = false;
    candidate->misplaced_sds = 0;
    candidate->marks = (uint16_t)marks;
    if ((marks & (SIDEWAYS | UNMEASURED | BSLAM_MARK_PART)) == 0U) {
        measure_outline(&outline, camera, size, (marks & UPRIGHT) == 0U, candidate);
    } else if (bslam_cut_on_one_side(marks) && (marks & UNMEASURED) == 0U) {
        measure_at_edge(frame, camera, &box, &outline, size, candidate);
    }
    candidate->outline = found;
    if (bslam_signature(frame, &outline.quad, candidate->signature) != BSLAM_OK) {
        memset(candidate->signature, 0, sizeof candidate->signature);
    }
    return BSLAM_OK;
}

void bslam_measure_doubt(bslam_candidate_t *candidate, bslam_real_t relative_var)
{
    if (!candidate->has_range) {
        return;
    }
    const bslam_real_t relative_sd = candidate->range_sd_m / candidate->range_m;
    const bslam_real_t total = relative_sd * relative_sd + relative_var;
    candidate->range_sd_m = candidate->range_m * bslam_sqrt(total);
    candidate->range_scale_sd =
        bslam_sqrt(candidate->range_scale_sd * candidate->range_scale_sd + relative_var);
    candidate->has_range = total <= RANGE_SD_MAX * RANGE_SD_MAX;
}
