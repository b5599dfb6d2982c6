#include "vision/scan/box_candidate.h"

#include "base/logarithm.h"
#include "base/scalar.h"
#include "base/trig.h"
#include "vision/camera/lens.h"

/// An edge is not known better than by half a pixel.
static const bslam_real_t PIXEL_SD = BSLAM_R(0.5);
/// How much of a height's error is alike in all distances of one thing: labels and looks of it are the same.
static const float SHARED = 0.5f;
/// Standard deviation of the middle and of the height of a box that is round a part of a thing, of itself.
static const bslam_real_t MISSED_SD = BSLAM_R(0.3);
enum {
    CUT_BESIDE = BSLAM_MARK_CUT_LEFT | BSLAM_MARK_CUT_RIGHT,
    CUT_ABOVE = BSLAM_MARK_CUT_TOP | BSLAM_MARK_CUT_BOTTOM
};

/// How steeply a direction goes up.
static bslam_real_t slope_of(const bslam_direction_t *direction)
{
    return direction->z / bslam_sqrt(direction->x * direction->x + direction->y * direction->y);
}

static bslam_real_t hypotenuse(bslam_real_t a, bslam_real_t b)
{
    return bslam_sqrt(a * a + b * b);
}

/// Directions of a box's middle and of the middles of its sides.
typedef struct sides {
    bslam_direction_t middle, left, top, right, bottom;
} sides_t;

static bool look_at_sides(const bslam_camera_t *camera, const bslam_box_t *box, sides_t *sides)
{
    const bslam_real_t x = (box->left_px + box->right_px) / 2, y = (box->top_px + box->bottom_px) / 2;
    return bslam_camera_unproject(camera, x, y, &sides->middle) == BSLAM_OK &&
           bslam_camera_unproject(camera, box->left_px, y, &sides->left) == BSLAM_OK &&
           bslam_camera_unproject(camera, box->right_px, y, &sides->right) == BSLAM_OK &&
           bslam_camera_unproject(camera, x, box->top_px, &sides->top) == BSLAM_OK &&
           bslam_camera_unproject(camera, x, box->bottom_px, &sides->bottom) == BSLAM_OK;
}

static bslam_real_t width_rad(const sides_t *sides)
{
    return bslam_abs(bslam_angle_wrap(bslam_direction_bearing_rad(&sides->left) -
                                      bslam_direction_bearing_rad(&sides->right)));
}

/// Standard deviation of a part of a box that has `sd` where the box is right, and is right by its odds.
static bslam_real_t doubted(float sd, float log_odds)
{
    const float rarer = bslam_falling(log_odds > 0 ? log_odds : -log_odds);
    const float wrong = (log_odds > 0 ? rarer : 1.0f) / (1.0f + rarer);
    return hypotenuse((bslam_real_t)sd, MISSED_SD * bslam_sqrt((bslam_real_t)wrong));
}

static void measure_bearing(const bslam_scan_kind_t *kind, const sides_t *sides, bslam_candidate_t *candidate)
{
    const bslam_box_t *box = &candidate->outline;
    // What goes on beyond the picture has its middle somewhere else.
    const bslam_real_t share =
        (candidate->marks & CUT_BESIDE) != 0 ? BSLAM_R(0.5) : doubted(kind->middle_sd, candidate->score);
    const bslam_real_t pixel = PIXEL_SD / (box->right_px - box->left_px);
    candidate->has_bearing = true;
    candidate->bearing_rad = bslam_direction_bearing_rad(&sides->middle);
    candidate->bearing_sd_rad = width_rad(sides) * hypotenuse(share, pixel);
}

/// How much farther the middle of a front is than its nearer end, which the box is as high as: by how much
/// narrower it is seen than from ahead.
static bslam_real_t nearer_end_m(const bslam_scan_kind_t *kind, const sides_t *sides, bslam_real_t range_m)
{
    const bslam_real_t seen_m = width_rad(sides) * range_m;
    const bslam_real_t along2 = (bslam_real_t)kind->width_m * kind->width_m - seen_m * seen_m;
    return along2 > 0 ? bslam_sqrt(along2) / 2 : 0;
}

/// From how much steeper the upper side is seen than the lower one.
static void measure_range(const bslam_scan_kind_t *kind, const sides_t *sides, bslam_candidate_t *candidate)
{
    const bslam_box_t *box = &candidate->outline;
    const bslam_real_t steeper = slope_of(&sides->top) - slope_of(&sides->bottom);
    candidate->has_range =
        (candidate->marks & CUT_ABOVE) == 0 && kind->height_m > 0 && steeper > 0 && bslam_is_number(steeper);
    if (candidate->has_range) {
        const bslam_real_t pixel = PIXEL_SD / (box->bottom_px - box->top_px);
        const bslam_real_t noise = hypotenuse(doubted(kind->height_sd, candidate->score), pixel);
        const bslam_real_t near_m = kind->height_m / steeper;
        const bslam_real_t more_m =
            (candidate->marks & CUT_BESIDE) == 0 ? nearer_end_m(kind, sides, near_m) : 0;
        candidate->range_m = near_m + more_m;
        candidate->range_noise_sd_m = hypotenuse(candidate->range_m * noise, more_m / 2);
        candidate->range_scale_sd = SHARED * kind->height_sd;
        candidate->range_sd_m =
            hypotenuse(candidate->range_noise_sd_m, candidate->range_m * candidate->range_scale_sd);
    }
}

bslam_candidate_t bslam_box_candidate(const bslam_scan_kind_t *kind, const bslam_camera_t *camera,
                                      const bslam_detection_t *found)
{
    bslam_candidate_t candidate = {
        .outline = found->box,
        .beacon_class = (uint8_t)(found->kind + 1),
        .second_class = BSLAM_CLASS_NONE,
        .class_margin = found->log_odds,
        .score = found->log_odds,
        .marks = found->marks,
    };
    sides_t sides;
    if (look_at_sides(camera, &found->box, &sides)) {
        measure_bearing(kind, &sides, &candidate);
        measure_range(kind, &sides, &candidate);
    }
    return candidate;
}
