#include "vision/built_in/measurement/distance.h"

#include "vision/built_in/measurement/body.h"
#include "base/scalar.h"

// How well an edge is found where it is sure which edge (pixels), and how much of the outline's doubts about
// which edge it is counts. Fitted as measure.c's are.
static const bslam_real_t POINT_SD_PX = BSLAM_R(0.3);
static const bslam_real_t RANGE_DOUBT = 1;
// What is known of the band that an upper side is in, and of where the horizon is.
static const bslam_real_t BAND_SD_M = BSLAM_R(0.015);
static const bslam_real_t HORIZON_SD_PX = BSLAM_R(0.7);
// A round thing's width may be off by this part, and contradict its height by so many standard deviations.
static const bslam_real_t WIDTH_SD = BSLAM_R(0.04);
static const bslam_real_t WIDTH_SDS = 2;

bslam_real_t bslam_camera_pixel(const bslam_outline_t *o, const bslam_camera_t *camera)
{
    return camera->zoom > 1 ? o->pixel * (bslam_real_t)camera->zoom : o->pixel;
}

bslam_real_t bslam_edge_variance(const bslam_outline_t *o, const bslam_camera_t *camera)
{
    const bslam_real_t sd = POINT_SD_PX * bslam_camera_pixel(o, camera);
    return sd * sd;
}

/// Least squares over both sides: each is seen at its height over the camera times the inverse distance. What
/// errs alike for both, the horizon and the place, counts as one common error: where the place is not known,
/// it is endless, and all that is left is the apparent height. MATH-CAMERA "Measuring".
bslam_ahead_t bslam_ahead(const bslam_outline_t *o, const bslam_camera_t *camera, const bslam_size_t *size)
{
    const bslam_real_t nearness = 1 + o->turn * o->middle;  // of the middle, to what is straight ahead
    const bslam_real_t top = o->top * nearness;
    const bslam_real_t bottom = o->bottom * nearness;
    const bslam_real_t height_m = size->height_m;
    const bslam_real_t by_height = (top - bottom) / height_m;
    const bslam_real_t looks = size->looks_sd * height_m * by_height;
    const bslam_real_t edge_var = bslam_edge_variance(o, camera);
    const bslam_real_t top_noise = edge_var + RANGE_DOUBT * o->top_var;
    const bslam_real_t bottom_noise = edge_var + RANGE_DOUBT * o->bottom_var;
    const bslam_real_t top_var = top_noise;
    const bslam_real_t bottom_var = bottom_noise + looks * looks;
    if (!(size->top_high_m > 0)) {
        const bslam_real_t square = (top - bottom) * (top - bottom);
        return (bslam_ahead_t){by_height, (top_var + bottom_var) / square,
                               (top_noise + bottom_noise) / square, 0};
    }
    const bslam_real_t band_m = size->top_high_m - size->top_low_m;
    const bslam_real_t place_var = (BAND_SD_M * BAND_SD_M + band_m * band_m / 12) * by_height * by_height;
    const bslam_real_t horizon = HORIZON_SD_PX * bslam_camera_pixel(o, camera);
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
    return (bslam_ahead_t){inverse, determinant / (information * square),
                           (by_top * by_top * top_noise + by_bottom * by_bottom * bottom_noise) / square,
                           bslam_sqrt(distance2)};
}

/// How wide something round is seen, of what it would be so far ahead.
static bslam_real_t width_ratio(const bslam_outline_t *o, const bslam_size_t *size,
                                const bslam_ahead_t *ahead)
{
    return (o->left - o->right) / (size->width_m * ahead->inverse);
}

bslam_ahead_t bslam_ahead_of_body(const bslam_outline_t *o, const bslam_camera_t *camera,
                                  const bslam_size_t *size)
{
    const bslam_ahead_t whole = bslam_ahead(o, camera, size);
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
    return bslam_ahead(o, camera, &body);
}

bool bslam_width_agrees(const bslam_outline_t *o, const bslam_camera_t *camera, const bslam_size_t *size,
                        const bslam_ahead_t *ahead)
{
    if (!(size->width_m > 0)) {
        return true;
    }
    const bslam_real_t width = o->left - o->right;
    const bslam_real_t ratio = width_ratio(o, size, ahead);
    const bslam_real_t variance =
        WIDTH_SD * WIDTH_SD + ahead->relative_var +
        (2 * bslam_edge_variance(o, camera) + o->left_var + o->right_var) / (width * width);
    return (ratio - 1) * (ratio - 1) <= WIDTH_SDS * WIDTH_SDS * variance;
}

bslam_real_t bslam_front_width_m(const bslam_outline_t *o, const bslam_ahead_t *ahead)
{
    const bslam_stance_t front = {(float)o->turn, (float)o->left, (float)o->right};
    return bslam_body_width(&front) / ahead->inverse;
}
