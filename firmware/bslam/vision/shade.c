#include "bslam/vision/shade.h"

// So many upright lines in a strip, and points on each.
enum { LINES = 3, POINTS = 6 };

// The points stay so far from the level sides, as a part of the height.
static const bslam_real_t MARGIN = BSLAM_R(0.15);
// Colours that are so far apart are half told apart.
static const float HALF = 5.0f;

/// Adds the colours along the upright line at a place across; false if the frame does not show it.
static bool add_line(const bslam_frame_t *frame, const bslam_facing_t *facing, const bslam_outline_t *o,
                     bslam_real_t at, bslam_rgb_t *sum)
{
    const bslam_real_t near = 1 + o->turn * at;
    const bslam_real_t margin = MARGIN * (o->top - o->bottom);
    bslam_real_t upper_u, upper_v, lower_u, lower_v;
    if (!bslam_facing_to_frame(facing, (bslam_plane_point_t){at, (o->top - margin) * near}, &upper_u,
                               &upper_v) ||
        !bslam_facing_to_frame(facing, (bslam_plane_point_t){at, (o->bottom + margin) * near}, &lower_u,
                               &lower_v)) {
        return false;
    }
    const bslam_real_t width = (bslam_real_t)frame->width_px, height = (bslam_real_t)frame->height_px;
    for (int32_t i = 0; i < POINTS; i++) {
        const bslam_real_t part = (bslam_real_t)i / (POINTS - 1);
        const bslam_real_t u = upper_u + part * (lower_u - upper_u), v = upper_v + part * (lower_v - upper_v);
        if (!(u >= 0 && v >= 0 && u < width && v < height)) {
            return false;
        }
        const int32_t pixel = (int32_t)v / 2 * (frame->width_px / 2) + (int32_t)u / 2;
        const bslam_rgb_t colour = bslam_rgb_of_565(frame->half[pixel]);
        sum->red += colour.red;
        sum->green += colour.green;
        sum->blue += colour.blue;
    }
    return true;
}

bool bslam_shade_between(const bslam_frame_t *frame, const bslam_facing_t *facing,
                         const bslam_outline_t *outline, bslam_real_t from, bslam_real_t to,
                         bslam_shade_t *shade)
{
    bslam_rgb_t sum = {0, 0, 0};
    for (int32_t i = 0; i < LINES; i++) {
        const bslam_real_t part = ((bslam_real_t)i + BSLAM_R(0.5)) / LINES;
        if (!add_line(frame, facing, outline, from + part * (to - from), &sum)) {
            return false;
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
