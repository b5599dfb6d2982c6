// From a box to a direction and a distance. MATH-CAMERA "Scanner".
#include "base/scalar.h"
#include "base/trig.h"
#include "vision/camera/lens.h"
#include "vision/scan/scanner.h"

/// An edge is not known better than by half a pixel.
static const bslam_real_t PIXEL_SD = BSLAM_R(0.5);
enum {
    CUT_BESIDE = BSLAM_MARK_CUT_LEFT | BSLAM_MARK_CUT_RIGHT,
    CUT_ABOVE = BSLAM_MARK_CUT_TOP | BSLAM_MARK_CUT_BOTTOM
};

/// How steeply a direction goes up.
static bslam_real_t slope_of(const bslam_direction_t *direction)
{
    return direction->z / bslam_sqrt(direction->x * direction->x + direction->y * direction->y);
}

static bslam_real_t sum_of_squares(bslam_real_t a, bslam_real_t b)
{
    return a * a + b * b;
}

/// Directions of the middles of a box's four sides.
typedef struct sides {
    bslam_direction_t left, top, right, bottom;
} sides_t;

static bslam_status_t look_at_sides(const bslam_camera_t *camera, const bslam_box_t *box, sides_t *sides)
{
    const bslam_real_t x = (box->left_px + box->right_px) / 2, y = (box->top_px + box->bottom_px) / 2;
    bslam_status_t status = bslam_camera_unproject(camera, box->left_px, y, &sides->left);
    status = status == BSLAM_OK ? bslam_camera_unproject(camera, box->right_px, y, &sides->right) : status;
    status = status == BSLAM_OK ? bslam_camera_unproject(camera, x, box->top_px, &sides->top) : status;
    return status == BSLAM_OK ? bslam_camera_unproject(camera, x, box->bottom_px, &sides->bottom) : status;
}

/// Distance and its noise, from how much steeper the upper side is seen than the lower one.
static void measure_range(const bslam_scan_kind_t *kind, const bslam_box_t *box, const sides_t *sides,
                          bslam_sighting_t *sighting)
{
    const bslam_real_t steeper = slope_of(&sides->top) - slope_of(&sides->bottom);
    sighting->has_range = kind->height_m > 0 && steeper > 0 && bslam_is_number(steeper);
    if (sighting->has_range) {
        const bslam_real_t pixel = PIXEL_SD / (box->bottom_px - box->top_px);
        sighting->range_m = kind->height_m / steeper;
        sighting->range_sd_m = sighting->range_m * bslam_sqrt(sum_of_squares(kind->height_sd, pixel));
    }
}

bslam_status_t bslam_scanner_sighting(const bslam_scanner_t *scanner, const bslam_camera_t *camera,
                                      const bslam_detection_t *found, bslam_sighting_t *sighting)
{
    const void *memory = scanner;
    const bslam_scanner_instance_t *instance = memory;
    if (found->kind < 0 || found->kind >= instance->model->kind_count) {
        return BSLAM_E_RANGE;
    }
    const bslam_scan_kind_t *kind = &instance->model->kinds[found->kind];
    sides_t sides;
    bslam_direction_t middle;
    const bslam_box_t *box = &found->box;
    bslam_status_t status = look_at_sides(camera, box, &sides);
    if (status == BSLAM_OK) {
        status = bslam_camera_unproject(camera, (box->left_px + box->right_px) / 2,
                                        (box->top_px + box->bottom_px) / 2, &middle);
    }
    if (status != BSLAM_OK) {
        return status;
    }
    const bslam_real_t width_rad = bslam_angle_wrap(bslam_direction_bearing_rad(&sides.left) -
                                                    bslam_direction_bearing_rad(&sides.right));
    // What goes on beyond the picture has its middle somewhere else.
    const bslam_real_t share = (found->marks & CUT_BESIDE) != 0 ? BSLAM_R(0.5) : kind->middle_sd;
    const bslam_real_t pixel = PIXEL_SD / (box->right_px - box->left_px);
    *sighting = (bslam_sighting_t){
        .bearing_rad = bslam_direction_bearing_rad(&middle),
        .bearing_sd_rad = bslam_abs(width_rad) * bslam_sqrt(sum_of_squares(share, pixel)),
        .label = BSLAM_LABEL_NONE,
        .beacon_class = (uint8_t)(found->kind + 1),
        .score = found->log_odds,
    };
    if ((found->marks & CUT_ABOVE) == 0) {
        measure_range(kind, box, &sides, sighting);
    }
    return BSLAM_OK;
}
