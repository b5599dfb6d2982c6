#include "vision/built_in/measurement/shade.h"
#include "base/scalar.h"

// So many upright lines in a strip, and points on each.
enum { LINES = 3, POINTS = 6 };

// The points stay so far from the level sides, as a part of the height.
static const bslam_real_t MARGIN = BSLAM_R(0.15);
// Colours that are so far apart are half told apart.
static const float HALF = 5.0f;

bool bslam_line_colours(const bslam_frame_t *frame, const bslam_facing_t *facing, bslam_real_t at,
                        bslam_real_t top, bslam_real_t bottom, int32_t count,
                        bslam_rgb_t colours[BSLAM_LINE_POINTS_MAX])
{
    const bslam_real_t margin = MARGIN * (top - bottom);
    const bslam_plane_point_t upper = {at, top - margin}, lower = {at, bottom + margin};
    bslam_real_t upper_u, upper_v, lower_u, lower_v;
    if (!bslam_facing_to_frame(facing, upper, &upper_u, &upper_v) ||
        !bslam_facing_to_frame(facing, lower, &lower_u, &lower_v)) {
        return false;
    }
    const bslam_real_t width = (bslam_real_t)frame->width_px, height = (bslam_real_t)frame->height_px;
    for (int32_t i = 0; i < count; i++) {
        const bslam_real_t part = (bslam_real_t)i / (bslam_real_t)(count - 1);
        const bslam_real_t u = upper_u + part * (lower_u - upper_u), v = upper_v + part * (lower_v - upper_v);
        if (!(u >= 0 && v >= 0 && u < width && v < height)) {
            return false;
        }
        colours[i] = bslam_rgb_of_565(frame->half[(int32_t)v / 2 * (frame->width_px / 2) + (int32_t)u / 2]);
    }
    return true;
}

bool bslam_shade_between(const bslam_frame_t *frame, const bslam_facing_t *facing,
                         const bslam_outline_t *outline, bslam_real_t from, bslam_real_t to,
                         bslam_shade_t *shade)
{
    bslam_rgb_t sum = {0, 0, 0};
    for (int32_t i = 0; i < LINES; i++) {
        const bslam_real_t at = from + ((bslam_real_t)i + BSLAM_R(0.5)) / LINES * (to - from);
        const bslam_real_t near = 1 + outline->turn * at;
        bslam_rgb_t colours[BSLAM_LINE_POINTS_MAX];
        if (!bslam_line_colours(frame, facing, at, outline->top * near, outline->bottom * near, POINTS,
                                colours)) {
            return false;
        }
        for (int32_t k = 0; k < POINTS; k++) {
            sum.red += colours[k].red;
            sum.green += colours[k].green;
            sum.blue += colours[k].blue;
        }
    }
    const float count = (float)(LINES * POINTS), mean = (sum.red + sum.green + sum.blue) / 3;
    *shade = (bslam_shade_t){(sum.red - mean) / count, (sum.green - mean) / count, (sum.blue - mean) / count};
    return true;
}

float bslam_shade_apart(const bslam_shade_t *a, const bslam_shade_t *b)
{
    const float red = a->red - b->red, green = a->green - b->green, blue = a->blue - b->blue;
    const float distance = (float)bslam_sqrt((bslam_real_t)(red * red + green * green + blue * blue));
    return distance / (distance + HALF);
}
