#include "bslam/vision/features.h"

#include <string.h>

/// Columns or rows of cells beside a box that count as its surroundings.
#define STRIP 2
#define ZONES 3
#define CELLS_ENOUGH 16
#define CONTRAST_FEATURES 6

static int32_t least(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static int32_t most(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

static float clampf(float value, float low, float high)
{
    return value < low ? low : value > high ? high : value;
}

/// A rectangle of cells: [left, right) by [top, bottom).
typedef struct area {
    int32_t left, top, right, bottom;
} area_t;

/// Sums over the cells of a zone.
typedef struct zone {
    int32_t cells;
    int32_t light, reddish, bluish;
} zone_t;

/// Sums over the cells of a rectangle; all whole numbers of 32 bits.
typedef struct sums {
    int32_t cells;
    int32_t light, reddish, bluish;
    int32_t spread;
    int32_t value;        ///< decision values of the cells
    int32_t wall, floor;  ///< how frequent the tones are in the zones' histograms
    // What follows only of what is inside the box.
    int32_t light_sq, reddish_sq, bluish_sq;
    int32_t step_x, step_y;
    int32_t likely;  ///< cells whose value is above 0
} sums_t;

/// An area within the frame: every row, or every other one.
typedef struct rows {
    int32_t first, end, stride;  ///< of rows
    int32_t left, right;         ///< columns [left, right)
} rows_t;

/// Means of every other row of a large area are as good.
static int32_t stride_of(int32_t cells)
{
    return cells > CELLS_ENOUGH ? 2 : 1;
}

static rows_t rows_of(const bslam_view_t *view, area_t area)
{
    const int32_t cells = (area.right - area.left) * (area.bottom - area.top);
    const int32_t left = most(area.left, 0), right = least(area.right, view->frame->columns);
    return (rows_t){.first = most(area.top, 0),
                    .end = least(area.bottom, view->frame->rows),
                    .stride = stride_of(cells),
                    .left = left,
                    .right = right > left ? right : left};
}

static sums_t sum_inside(const bslam_view_t *view, area_t area)
{
    sums_t sums = {0};
    const bslam_tones_t *tones = view->tones;
    const rows_t rows = rows_of(view, area);
    for (int32_t row = rows.first; row < rows.end; row += rows.stride) {
        const int32_t start = row * view->frame->columns, end = start + rows.right;
        sums.cells += rows.right - rows.left;
        for (int32_t i = start + rows.left; i < end; i++) {
            const int32_t light = tones->light[i];
            const int32_t reddish = (int32_t)tones->reddish[i], bluish = (int32_t)tones->bluish[i];
            const int32_t value = (int32_t)view->values[i], frequent = view->frequent[i];
            sums.light += light;
            sums.reddish += reddish;
            sums.bluish += bluish;
            sums.spread += tones->spread[i];
            sums.value += value;
            sums.wall += frequent & 255;
            sums.floor += frequent >> 8;
            sums.light_sq += light * light;
            sums.reddish_sq += reddish * reddish;
            sums.bluish_sq += bluish * bluish;
            sums.step_x += view->step_x[i];
            sums.step_y += view->step_y[i];
            sums.likely += value > 0 ? 1 : 0;
        }
    }
    return sums;
}

/// A strip along a side of a box, outside.
static area_t strip_of(const bslam_proposal_t *p, bslam_side_t side)
{
    switch (side) {
    case BSLAM_SIDE_LEFT:
        return (area_t){p->left - STRIP, p->top, p->left, p->bottom};
    case BSLAM_SIDE_RIGHT:
        return (area_t){p->right, p->top, p->right + STRIP, p->bottom};
    case BSLAM_SIDE_TOP:
        return (area_t){p->left, p->top - STRIP, p->right, p->top};
    default:
        return (area_t){p->left, p->bottom, p->right, p->bottom + STRIP};
    }
}

static sums_t sum_beside(const bslam_view_t *view, const bslam_proposal_t *p, bslam_side_t side)
{
    sums_t sums = {0};
    const bslam_tones_t *tones = view->tones;
    const rows_t rows = rows_of(view, strip_of(p, side));
    for (int32_t row = rows.first; row < rows.end; row += rows.stride) {
        const int32_t start = row * view->frame->columns, end = start + rows.right;
        sums.cells += rows.right - rows.left;
        for (int32_t i = start + rows.left; i < end; i++) {
            const int32_t frequent = view->frequent[i];
            sums.light += tones->light[i];
            sums.reddish += tones->reddish[i];
            sums.bluish += tones->bluish[i];
            sums.spread += tones->spread[i];
            sums.value += view->values[i];
            sums.wall += frequent & 255;
            sums.floor += frequent >> 8;
        }
    }
    return sums;
}

static zone_t zone_of(const sums_t *sums)
{
    return (zone_t){sums->cells, sums->light, sums->reddish, sums->bluish};
}

static void merge(sums_t *into, const sums_t *from)
{
    int32_t *a = &into->cells;
    const int32_t *b = &from->cells;
    for (int32_t i = 0; i < (int32_t)(sizeof *into / sizeof *a); i++) {
        a[i] += b[i];
    }
}

/// Columns of cells summed at a time; a constant, so that a compiler can use vector instructions.
#define LANES 16

/// Sums down LANES columns: of a row of zones, and of the whole box.
typedef struct lanes {
    int16_t light[LANES], reddish[LANES], bluish[LANES];
    uint16_t spread[LANES], step_x[LANES], step_y[LANES], wall[LANES], floor[LANES];
    int16_t value[LANES];
    uint8_t likely[LANES];
    uint32_t light_sq[LANES], reddish_sq[LANES], bluish_sq[LANES];
} lanes_t;

static void add_bytes(uint16_t *restrict sums, const uint8_t *restrict bytes)
{
    for (int32_t k = 0; k < LANES; k++) {
        sums[k] = (uint16_t)(sums[k] + bytes[k]);
    }
}

static void add_signed(int16_t *restrict sums, const int8_t *restrict bytes)
{
    for (int32_t k = 0; k < LANES; k++) {
        sums[k] = (int16_t)(sums[k] + bytes[k]);
    }
}

static void add_squares(uint32_t *restrict sums, const int8_t *restrict bytes)
{
    for (int32_t k = 0; k < LANES; k++) {
        sums[k] += (uint16_t)(bytes[k] * bytes[k]);
    }
}

/// Adds the cells from `i` on; what is beyond the box is not read out.
static void add_row(lanes_t *restrict lanes, const bslam_view_t *view, int32_t i)
{
    const uint8_t *restrict light = view->tones->light + i;
    const uint16_t *restrict frequent = view->frequent + i;
    const int8_t *restrict values = view->values + i;
    for (int32_t k = 0; k < LANES; k++) {
        lanes->light[k] = (int16_t)(lanes->light[k] + light[k]);
        lanes->light_sq[k] += (uint16_t)(light[k] * light[k]);
    }
    for (int32_t k = 0; k < LANES; k++) {
        lanes->wall[k] = (uint16_t)(lanes->wall[k] + (frequent[k] & 255));
        lanes->floor[k] = (uint16_t)(lanes->floor[k] + (frequent[k] >> 8));
    }
    for (int32_t k = 0; k < LANES; k++) {
        lanes->likely[k] = (uint8_t)(lanes->likely[k] + (values[k] > 0 ? 1 : 0));
    }
    add_signed(lanes->reddish, view->tones->reddish + i);
    add_signed(lanes->bluish, view->tones->bluish + i);
    add_signed(lanes->value, values);
    add_squares(lanes->reddish_sq, view->tones->reddish + i);
    add_squares(lanes->bluish_sq, view->tones->bluish + i);
    add_bytes(lanes->spread, view->tones->spread + i);
    add_bytes(lanes->step_x, view->step_x + i);
    add_bytes(lanes->step_y, view->step_y + i);
}

/// The box's zones: rows and columns that they begin at, and one past the last.
typedef struct grid {
    int32_t left[ZONES + 1], top[ZONES + 1];
    int32_t stride[ZONES];  ///< of a row of zones; 0 if it is not the same in all of them
} grid_t;

static area_t zone_area(const grid_t *grid, int32_t row, int32_t column)
{
    return (area_t){grid->left[column], grid->top[row], grid->left[column + 1], grid->top[row + 1]};
}

static grid_t grid_of(const bslam_proposal_t *p)
{
    grid_t grid;
    for (int32_t i = 0; i <= ZONES; i++) {
        grid.left[i] = p->left + i * (p->right - p->left) / ZONES;
        grid.top[i] = p->top + i * (p->bottom - p->top) / ZONES;
    }
    // The narrowest and the widest zone of a row; where they differ it is by one column.
    const int32_t narrow = (p->right - p->left) / ZONES, wide = (p->right - p->left + ZONES - 1) / ZONES;
    for (int32_t row = 0; row < ZONES; row++) {
        const int32_t height = grid.top[row + 1] - grid.top[row];
        const int32_t stride = stride_of(narrow * height);
        grid.stride[row] = stride == stride_of(wide * height) ? stride : 0;
    }
    return grid;
}

/// Adds what was summed of a row of zones down the columns from `first` on, and forgets it.
static void take_zones(const grid_t *grid, int32_t first, lanes_t *lanes, zone_t zones[ZONES])
{
    int32_t column = 0;
    for (int32_t k = 0; k < LANES && first + k < grid->left[ZONES]; k++) {
        while (first + k >= grid->left[column + 1]) {
            column++;
        }
        zones[column].light += lanes->light[k];
        zones[column].reddish += lanes->reddish[k];
        zones[column].bluish += lanes->bluish[k];
    }
    memset(lanes->light, 0, sizeof lanes->light);
    memset(lanes->reddish, 0, sizeof lanes->reddish);
    memset(lanes->bluish, 0, sizeof lanes->bluish);
}

static void take_texture(const lanes_t *lanes, int32_t count, sums_t *inside)
{
    for (int32_t k = 0; k < count; k++) {
        inside->spread += lanes->spread[k];
        inside->value += lanes->value[k];
        inside->wall += lanes->wall[k];
        inside->floor += lanes->floor[k];
        inside->light_sq += (int32_t)lanes->light_sq[k];
        inside->reddish_sq += (int32_t)lanes->reddish_sq[k];
        inside->bluish_sq += (int32_t)lanes->bluish_sq[k];
        inside->step_x += lanes->step_x[k];
        inside->step_y += lanes->step_y[k];
        inside->likely += lanes->likely[k];
    }
}

/// Sums of the zones, and of the whole box, which is within the frame.
static void sum_box(const bslam_view_t *view, const bslam_proposal_t *p, zone_t zones[ZONES * ZONES],
                    sums_t *inside)
{
    const int32_t columns = view->frame->columns;
    const grid_t grid = grid_of(p);
    memset(inside, 0, sizeof *inside);
    memset(zones, 0, ZONES * ZONES * sizeof zones[0]);
    for (int32_t first = p->left; first < p->right; first += LANES) {
        lanes_t lanes = {0};
        for (int32_t r = 0; r < ZONES; r++) {
            for (int32_t row = grid.top[r]; grid.stride[r] > 0 && row < grid.top[r + 1];
                 row += grid.stride[r]) {
                add_row(&lanes, view, row * columns + first);
            }
            take_zones(&grid, first, &lanes, zones + ZONES * r);
        }
        take_texture(&lanes, least(LANES, p->right - first), inside);
    }
    for (int32_t z = 0; z < ZONES * ZONES; z++) {
        const int32_t stride = grid.stride[z / ZONES];
        const area_t area = zone_area(&grid, z / ZONES, z % ZONES);
        if (stride == 0) {
            const sums_t sums = sum_inside(view, area);
            zones[z] = zone_of(&sums);
            merge(inside, &sums);
            continue;
        }
        zones[z].cells = (area.bottom - area.top + stride - 1) / stride * (area.right - area.left);
        inside->cells += zones[z].cells;
        inside->light += zones[z].light;
        inside->reddish += zones[z].reddish;
        inside->bluish += zones[z].bluish;
    }
}

static float mean(const sums_t *sums, int32_t sum)
{
    return sums->cells > 0 ? (float)sum / (float)sums->cells : 0.0f;
}

static float deviation(const sums_t *sums, int32_t sum, int32_t sum_sq)
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
    ray.slope = clampf((float)(d.z / flat), -10.0f, 10.0f);
    ray.x = (float)(d.x / flat);
    ray.y = (float)(d.y / flat);
    return ray;
}

/// Without libm: exponent by halving, then a parabola.
float bslam_log(float x)
{
    float halvings = 0;
    x = clampf(x, 1e-4f, 1e4f);
    while (x >= 2.0f) {
        x *= 0.5f;
        halvings += 1.0f;
    }
    while (x < 1.0f) {
        x *= 2.0f;
        halvings -= 1.0f;
    }
    return 0.6931472f * (halvings + (x - 1.0f) * (1.6931106f - 0.3465553f * x));
}

/// Mean distance of the floor line over columns [first, end); 0, and *share 0, where no column knows it.
static float line_distance_m(const bslam_view_t *view, int32_t first, int32_t end, float *share)
{
    float inverse = 0;
    int32_t known = 0;
    first = most(first, 0);
    end = least(end, view->frame->columns);
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
    float wall_m = line_distance_m(view, p->left - STRIP, p->right + STRIP, &share);
    const float left_m = line_distance_m(view, p->left - STRIP, p->left + 1, &ignored);
    const float right_m = line_distance_m(view, p->right - 1, p->right + STRIP, &ignored);
    const bool known = wall_m > 0;
    wall_m = known ? clampf(wall_m, 0.3f, 20.0f) : 1.0f;
    const float width_px = (float)(p->box.right_px - p->box.left_px);
    const float height_px = (float)(p->box.bottom_px - p->box.top_px);

    *x++ = bslam_log(wall_m * chord_of(rays));
    *x++ = bslam_log(wall_m * (top - bottom));
    *x++ = clampf(height_m + wall_m * bottom, -1.0f, 3.0f);
    *x++ = clampf(height_m + wall_m * top, -1.0f, 4.0f);
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
    *x++ = top - bottom > 1e-3f ? clampf((top + bottom) / (2.0f * (top - bottom)), -3.0f, 8.0f) : 0.0f;
    *x++ = bslam_log(foot_m(view, rays) * chord_of(rays));
    return x;
}

/// How the box differs from a strip beside it. 6 features: light, chroma, the cells' values, spread, and how
/// much the strip looks like wall and floor.
static float *contrast_features(const sums_t *inside, const sums_t *beside, float *x)
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
static float *likeness_features(const sums_t *a, const sums_t *b, float *x)
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
    const int32_t lines[BSLAM_SIDES] = {p->left, p->right - 1, p->top, p->bottom - 1};
    for (int32_t side = 0; side < BSLAM_SIDES; side++) {
        const bslam_edge_t edge = bslam_edge_along(view, p, (bslam_side_t)side, lines[side]);
        *x++ = edge.step;
        *x++ = edge.share;
    }
    fold(x - 2 * BSLAM_SIDES, x - 2 * BSLAM_SIDES + 2, 2);
    return x;
}

/// Means over the whole box. 15 features.
static float *texture_features(const bslam_view_t *view, const sums_t *inside, float *x)
{
    const bslam_tone_t wall = view->background->tone[BSLAM_ZONE_WALL];
    const sums_t *s = inside;
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

/// How the zones of the box differ from its mean. 2 features a zone: light, chroma.
static float *zone_features(const zone_t zones[ZONES * ZONES], const sums_t *inside, float *x)
{
    float *row = x;
    const zone_t whole = zone_of(inside);
    for (int32_t z = 0; z < ZONES * ZONES; z++) {
        const zone_t *zone = zones[z].cells > 0 ? &zones[z] : &whole;
        const float cells = (float)(zone->cells > 0 ? zone->cells : 1);
        const float reddish = (float)zone->reddish / cells - mean(inside, inside->reddish);
        const float bluish = (float)zone->bluish / cells - mean(inside, inside->bluish);
        *x++ = (float)zone->light / cells - mean(inside, inside->light);
        *x++ = sqrtf(reddish * reddish + bluish * bluish);
    }
    for (; row < x; row += 2 * ZONES) {
        fold(row, row + 2 * (ZONES - 1), 2);
    }
    return x;
}

void bslam_blob_features(const bslam_view_t *view, const bslam_proposal_t *proposal,
                         float features[BSLAM_BLOB_FEATURES])
{
    const bslam_proposal_t *p = proposal;
    zone_t zones[ZONES * ZONES];
    sums_t inside;
    sum_box(view, p, zones, &inside);
    const rays_t rays = rays_of(view, &p->box);
    float *x = place_features(view, p, &rays, features);
    const sums_t left = sum_beside(view, p, BSLAM_SIDE_LEFT), right = sum_beside(view, p, BSLAM_SIDE_RIGHT);
    x = contrast_features(&inside, &left, x);
    x = contrast_features(&inside, &right, x);
    fold(x - 2 * CONTRAST_FEATURES, x - CONTRAST_FEATURES, CONTRAST_FEATURES);
    for (int32_t side = BSLAM_SIDE_TOP; side < BSLAM_SIDES; side++) {
        const sums_t beside = sum_beside(view, p, (bslam_side_t)side);
        x = contrast_features(&inside, &beside, x);
    }
    x = likeness_features(&left, &right, x);
    x = edge_features(view, p, x);
    *x++ = p->segmentation >= BSLAM_SEGMENTATIONS ? 1.0f : 0.0f;
    x = texture_features(view, &inside, x);
    x = zone_features(zones, &inside, x);
    (void)upright_features(view, &rays, x);
}
