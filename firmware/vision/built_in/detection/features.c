#include "vision/built_in/detection/features.h"

#include <string.h>

#include "base/bounds.h"
#include "vision/built_in/detection/box_sums.h"
#include "base/scalar.h"

#define CONTRAST_FEATURES 6

static float mean(const bslam_sums_t *sums, int32_t sum)
{
    return sums->cells > 0 ? (float)sum / (float)sums->cells : 0.0f;
}

static float deviation(const bslam_sums_t *sums, int32_t sum, int32_t sum_sq)
{
    const float m = mean(sums, sum);
    const float variance = mean(sums, sum_sq) - m * m;
    return variance > 0 ? sqrtf(variance) : 0.0f;
}

/// Slope of a pixel's direction, tan(elevation), and its horizontal unit vector.
typedef struct ray {
    bool exists;
    float slope, x, y;
} ray_t;

static ray_t ray_at(const bslam_view_t *view, bslam_real_t u_px, bslam_real_t v_px)
{
    bslam_direction_t d = {0};
    ray_t ray = {0};
    if (bslam_camera_unproject_as(view->camera, &view->mounting, u_px, v_px, &d) != BSLAM_OK) {
        return ray;
    }
    const bslam_real_t flat = bslam_sqrt(d.x * d.x + d.y * d.y);
    if (flat < BSLAM_R(1e-3)) {
        return ray;
    }
    ray.exists = true;
    ray.slope = bslam_clampf((float)(d.z / flat), -10.0f, 10.0f);
    ray.x = (float)(d.x / flat);
    ray.y = (float)(d.y / flat);
    return ray;
}

/// Without libm: exponent, then a parabola.
float bslam_log(float x)
{
    enum { FRACTION_BITS = 23, EXPONENT_OF_ONE = 127 };
    uint32_t bits;
    x = bslam_clampf(x, 1e-4f, 1e4f);
    memcpy(&bits, &x, sizeof bits);
    const uint32_t exponent = bits >> FRACTION_BITS;  // of a positive number
    const float doublings = (float)((int32_t)exponent - EXPONENT_OF_ONE);
    bits += (EXPONENT_OF_ONE - exponent) << FRACTION_BITS;
    memcpy(&x, &bits, sizeof x);
    return 0.6931472f * (doublings + (x - 1.0f) * (1.6931106f - 0.3465553f * x));
}

/// Mean distance of the floor line over columns [first, end); 0, and *share 0, where no column knows it.
static float line_distance_m(const bslam_view_t *view, int32_t first, int32_t end, float *share)
{
    float inverse = 0;
    int32_t known = 0;
    first = bslam_most(first, 0);
    end = bslam_least(end, view->frame->columns);
    for (int32_t column = first; column < end; column++) {
        const float distance_m = (float)view->floor_line->distance_m[column];
        if (distance_m > 0) {
            inverse += 1.0f / distance_m;
            known++;
        }
    }
    *share = end > first ? (float)known / (float)(end - first) : 0.0f;
    return known > 0 ? (float)known / inverse : 0.0f;
}

/// Rays through the middles of a box's sides.
typedef struct rays {
    ray_t left, right, top, bottom;
} rays_t;

static rays_t rays_of(const bslam_view_t *view, const bslam_box_t *box)
{
    const bslam_real_t u_px = (box->left_px + box->right_px) / 2, v_px = (box->top_px + box->bottom_px) / 2;
    const rays_t rays = {
        .left = ray_at(view, box->left_px, v_px),
        .right = ray_at(view, box->right_px, v_px),
        .top = ray_at(view, u_px, box->top_px),
        .bottom = ray_at(view, u_px, box->bottom_px),
    };
    return rays;
}

/// The box's width at a distance of 1.
static float chord_of(const rays_t *rays)
{
    const float x = rays->left.x - rays->right.x, y = rays->left.y - rays->right.y;
    return sqrtf(x * x + y * y);
}

/// How far a thing stands whose foot is the box's lower side.
static float foot_m(const bslam_view_t *view, const rays_t *rays)
{
    const bool is_below = rays->bottom.exists && rays->bottom.slope < -0.02f;
    return is_below ? (float)view->camera->z_m / -rays->bottom.slope : 25.0f;
}

/// Size and place in metres, by the floor line. 12 features.
static float *place_features(const bslam_view_t *view, const bslam_proposal_t *p, const rays_t *rays,
                             float *x)
{
    const float top = rays->top.slope, bottom = rays->bottom.slope;
    const float height_m = (float)view->camera->z_m;
    float share, ignored;
    float wall_m = line_distance_m(view, p->left - BSLAM_STRIP, p->right + BSLAM_STRIP, &share);
    const float left_m = line_distance_m(view, p->left - BSLAM_STRIP, p->left + 1, &ignored);
    const float right_m = line_distance_m(view, p->right - 1, p->right + BSLAM_STRIP, &ignored);
    const bool known = wall_m > 0;
    wall_m = known ? bslam_clampf(wall_m, 0.3f, 20.0f) : 1.0f;
    const float width_px = (float)(p->box.right_px - p->box.left_px);
    const float height_px = (float)(p->box.bottom_px - p->box.top_px);

    *x++ = bslam_log(wall_m * chord_of(rays));
    *x++ = bslam_log(wall_m * (top - bottom));
    *x++ = bslam_clampf(height_m + wall_m * bottom, -1.0f, 3.0f);
    *x++ = bslam_clampf(height_m + wall_m * top, -1.0f, 4.0f);
    *x++ = bslam_log(height_px / width_px);
    *x++ = bslam_log(height_px * width_px);
    *x++ = (float)p->cells / (float)((p->right - p->left) * (p->bottom - p->top));
    *x++ = known ? 1.0f / wall_m : 0.0f;
    *x++ = share;
    *x++ = known ? bslam_log(foot_m(view, rays) / wall_m) : 0.0f;
    const float turn = left_m > 0 && right_m > 0 ? bslam_log(left_m / right_m) : 0.0f;
    *x++ = turn < 0 ? -turn : turn;
    *x++ = (top + bottom) / 2;
    return x;
}

/// Size and place by the horizon and the foot alone, for where the floor line errs. How high the middle is
/// above the camera, in heights of the box: of a thing that hangs at a known height it is the same from every
/// distance. And the width if the box stands on the floor. 2 features.
static float *upright_features(const bslam_view_t *view, const rays_t *rays, float *x)
{
    const float top = rays->top.slope, bottom = rays->bottom.slope;
    *x++ = top - bottom > 1e-3f ? bslam_clampf((top + bottom) / (2.0f * (top - bottom)), -3.0f, 8.0f) : 0.0f;
    *x++ = bslam_log(foot_m(view, rays) * chord_of(rays));
    return x;
}

/// How the box differs from a strip beside it. 6 features: light, chroma, the cells' values, spread, and how
/// much the strip looks like wall and floor.
static float *contrast_features(const bslam_sums_t *inside, const bslam_sums_t *beside, float *x)
{
    const bool seen = beside->cells > 0;
    const float reddish = mean(inside, inside->reddish) - mean(beside, beside->reddish);
    const float bluish = mean(inside, inside->bluish) - mean(beside, beside->bluish);
    *x++ = seen ? mean(inside, inside->light) - mean(beside, beside->light) : 0.0f;
    *x++ = seen ? sqrtf(reddish * reddish + bluish * bluish) : 0.0f;
    *x++ = mean(beside, beside->value);
    *x++ = mean(beside, beside->spread);
    *x++ = mean(beside, beside->wall);
    *x++ = mean(beside, beside->floor);
    return x;
}

/// A room has no left and right: of features of both sides, `count` each, their mean and how they differ, so
/// that a machine need not learn everything twice.
static void fold(float *left, float *right, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        const float difference = left[i] - right[i];
        left[i] = 0.5f * (left[i] + right[i]);
        right[i] = difference < 0 ? -difference : difference;
    }
}

/// Whether what is on both sides is the same. 2 features: light, chroma.
static float *likeness_features(const bslam_sums_t *a, const bslam_sums_t *b, float *x)
{
    const bool seen = a->cells > 0 && b->cells > 0;
    const float light = mean(a, a->light) - mean(b, b->light);
    const float reddish = mean(a, a->reddish) - mean(b, b->reddish);
    const float bluish = mean(a, a->bluish) - mean(b, b->bluish);
    *x++ = seen ? (light < 0 ? -light : light) : 0.0f;
    *x++ = seen ? sqrtf(reddish * reddish + bluish * bluish) : 0.0f;
    return x;
}

/// How sharp the sides are. 2 features a side: mean step, share of it that steps.
static float *edge_features(const bslam_view_t *view, const bslam_proposal_t *p, float *x)
{
    const int32_t lines[BSLAM_BOX_SIDES] = {p->left, p->right - 1, p->top, p->bottom - 1};
    for (int32_t side = 0; side < BSLAM_BOX_SIDES; side++) {
        const bslam_cell_edge_t edge = bslam_edge_along(view, p, (bslam_box_side_t)side, lines[side]);
        *x++ = edge.step;
        *x++ = edge.share;
    }
    fold(x - 2 * BSLAM_BOX_SIDES, x - 2 * BSLAM_BOX_SIDES + 2, 2);
    return x;
}

/// Means over the whole box. 15 features.
static float *texture_features(const bslam_view_t *view, const bslam_sums_t *inside, float *x)
{
    const bslam_tone_t wall = view->background->tone[BSLAM_ZONE_WALL];
    const bslam_sums_t *s = inside;
    *x++ = mean(s, s->light) - (float)wall.light;
    *x++ = mean(s, s->reddish) - (float)wall.reddish;
    *x++ = mean(s, s->bluish) - (float)wall.bluish;
    *x++ = mean(s, s->reddish);
    *x++ = mean(s, s->bluish);
    *x++ = mean(s, s->value);
    *x++ = mean(s, s->likely);
    *x++ = mean(s, s->spread);
    *x++ = mean(s, s->step_x);
    *x++ = mean(s, s->step_y);
    *x++ = deviation(s, s->light, s->light_sq);
    *x++ = deviation(s, s->reddish, s->reddish_sq);
    *x++ = deviation(s, s->bluish, s->bluish_sq);
    *x++ = mean(s, s->wall);
    *x++ = mean(s, s->floor);
    return x;
}

static bslam_zone_sums_t whole_of(const bslam_sums_t *sums)
{
    return (bslam_zone_sums_t){sums->cells, sums->light, sums->reddish, sums->bluish};
}

/// How the zones of the box differ from its mean. 2 features a zone: light, chroma.
static float *zone_features(const bslam_zone_sums_t zones[BSLAM_BOX_ZONES * BSLAM_BOX_ZONES],
                            const bslam_sums_t *inside, float *x)
{
    float *row = x;
    const bslam_zone_sums_t whole = whole_of(inside);
    for (int32_t z = 0; z < BSLAM_BOX_ZONES * BSLAM_BOX_ZONES; z++) {
        const bslam_zone_sums_t *zone = zones[z].cells > 0 ? &zones[z] : &whole;
        const float cells = (float)(zone->cells > 0 ? zone->cells : 1);
        const float reddish = (float)zone->reddish / cells - mean(inside, inside->reddish);
        const float bluish = (float)zone->bluish / cells - mean(inside, inside->bluish);
        *x++ = (float)zone->light / cells - mean(inside, inside->light);
        *x++ = sqrtf(reddish * reddish + bluish * bluish);
    }
    for (; row < x; row += 2 * BSLAM_BOX_ZONES) {
        fold(row, row + 2 * (BSLAM_BOX_ZONES - 1), 2);
    }
    return x;
}

void bslam_blob_features(const bslam_view_t *view, const bslam_proposal_t *proposal,
                         float features[BSLAM_BLOB_FEATURES])
{
    const bslam_proposal_t *p = proposal;
    bslam_zone_sums_t zones[BSLAM_BOX_ZONES * BSLAM_BOX_ZONES];
    bslam_sums_t inside;
    bslam_sum_box(view, p, zones, &inside);
    const rays_t rays = rays_of(view, &p->box);
    float *x = place_features(view, p, &rays, features);
    const bslam_sums_t left = bslam_sum_beside(view, p, BSLAM_BOX_LEFT),
                       right = bslam_sum_beside(view, p, BSLAM_BOX_RIGHT);
    x = contrast_features(&inside, &left, x);
    x = contrast_features(&inside, &right, x);
    fold(x - 2 * CONTRAST_FEATURES, x - CONTRAST_FEATURES, CONTRAST_FEATURES);
    for (int32_t side = BSLAM_BOX_TOP; side < BSLAM_BOX_SIDES; side++) {
        const bslam_sums_t beside = bslam_sum_beside(view, p, (bslam_box_side_t)side);
        x = contrast_features(&inside, &beside, x);
    }
    x = likeness_features(&left, &right, x);
    x = edge_features(view, p, x);
    *x++ = p->segmentation >= BSLAM_SEGMENTATIONS ? 1.0f : 0.0f;
    x = texture_features(view, &inside, x);
    x = zone_features(zones, &inside, x);
    (void)upright_features(view, &rays, x);
}
