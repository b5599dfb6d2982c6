#include "vision/built_in/measurement/outline.h"

#include "base/trig.h"
#include "vision/built_in/measurement/orientation.h"
#include "base/scalar.h"

// A body's front and its turn determine each other: rounds.
enum { FRONT_STEPS = 3 };

// An edge point this far from its line is another edge's; how well one is found; whole-frame pixels.
static const bslam_real_t STRAY_PX = BSLAM_R(2.4);
static const bslam_real_t POINT_SD_PX = BSLAM_R(0.7);
// How far off a side may be that is not found at all, half-resolution pixels.
static const bslam_real_t LOST_SD = 2;
// How much of the doubt about which line an edge is applies to its slope.
static const bslam_real_t SLOPE_SHARE = BSLAM_R(0.2);
// Beyond these a body is no flat thing on a wall.
static const bslam_real_t DEPTH_MAX = 2;

typedef struct search {
    const bslam_frame_t *frame;
    bslam_facing_t facing;
    bslam_outline_t *outline;
} search_t;

// --- Straight lines through edge points

/// By least squares: value at the mean place along, and slope.
typedef struct fit {
    int32_t count;
    bslam_real_t at;      ///< mean place along
    bslam_real_t value;   ///< there
    bslam_real_t slope;   ///< of a level side; 0 for an upright one
    bslam_real_t spread;  ///< sum of squared distances from `at`
    bslam_real_t square;  ///< sum of squared distances of the points from the line
} fit_t;

/// An edge point as a level side sees it: along is across the object and value up. An upright side's are
/// swapped.
static bslam_plane_point_t oriented(const bslam_edge_t *edge, int32_t index, bool level)
{
    const bslam_plane_point_t point = edge->points[index];
    return level ? point : (bslam_plane_point_t){point.up, point.across};
}

static fit_t fit_all(const bslam_edge_t *edge, bool level)
{
    fit_t fit = {.count = edge->count};
    bslam_real_t mixed = 0;
    for (int32_t i = 0; i < edge->count; i++) {
        const bslam_plane_point_t point = oriented(edge, i, level);
        fit.at += point.across / (bslam_real_t)edge->count;
        fit.value += point.up / (bslam_real_t)edge->count;
    }
    for (int32_t i = 0; level && i < edge->count; i++) {
        const bslam_plane_point_t point = oriented(edge, i, level);
        fit.spread += (point.across - fit.at) * (point.across - fit.at);
        mixed += (point.across - fit.at) * (point.up - fit.value);
    }
    fit.slope = fit.spread > 0 ? mixed / fit.spread : 0;
    for (int32_t i = 0; i < edge->count; i++) {
        const bslam_plane_point_t point = oriented(edge, i, level);
        const bslam_real_t off = point.up - fit.value - fit.slope * (point.across - fit.at);
        fit.square += off * off;
    }
    return fit;
}

/// The line through those points of a level edge that lie on the front, or of an upright edge, and do not
/// stray.
static fit_t fit_edge(const search_t *search, const bslam_edge_t *edge, bool level)
{
    const bslam_outline_t *o = search->outline;
    bslam_edge_t kept = {.count = 0};
    for (int32_t i = 0; i < edge->count; i++) {
        if (!level || bslam_in_range(edge->points[i].across, o->right, o->left)) {
            kept.points[kept.count++] = edge->points[i];
        }
    }
    const fit_t all = fit_all(&kept, level);
    const int32_t count = kept.count;
    kept.count = 0;
    for (int32_t i = 0; i < count; i++) {
        const bslam_plane_point_t point = oriented(&kept, i, level);
        if (bslam_abs(point.up - all.value - all.slope * (point.across - all.at)) <= STRAY_PX * o->pixel) {
            kept.points[kept.count++] = kept.points[i];
        }
    }
    return kept.count >= 2 ? fit_all(&kept, level) : all;
}

/// A side's place: its fit, moved from the best line to the likely place.
static bslam_real_t place_of(const search_t *search, const bslam_edge_t *edge, const fit_t *fit,
                             bslam_real_t rough, bslam_real_t inwards, bslam_real_t *variance)
{
    const bslam_real_t step = 2 * search->outline->pixel;
    const bool found = fit->count >= 2;
    *variance = step * step * (found ? edge->variance : LOST_SD * LOST_SD);
    return found ? fit->value + inwards * step * edge->offset : rough;
}

// --- Upright sides

static bool find_upright(const search_t *search, bslam_side_name_t name, bslam_real_t *across,
                         bslam_real_t *variance)
{
    bslam_side_t side;
    const bslam_outline_t *o = search->outline;
    if (!bslam_side_scan(&side, search->frame, &search->facing, name, *across, o->top, o->bottom, o->pixel)) {
        return false;
    }
    const bslam_line_t line = bslam_side_line(&side, &BSLAM_FLAT);
    bslam_edge_t edge;
    bslam_side_trace(&side, &search->facing, &line, &BSLAM_FLAT, &edge);
    const fit_t fit = fit_edge(search, &edge, false);
    *across = place_of(search, &edge, &fit, *across, name == BSLAM_SIDE_LEFT ? -1 : 1, variance);
    return true;
}

// --- Level sides

/// How much the edges leave open which turn it is, 0 to 1: points that scatter about their lines, scan lines
/// on which there is none.
static bslam_real_t doubt_of(const fit_t *up, const fit_t *down, bslam_real_t pixel)
{
    const bslam_real_t scans = 2 * BSLAM_SIDE_SCANS;
    const bslam_real_t found = (bslam_real_t)(up->count + down->count);
    const bslam_real_t freedom = found > 5 ? found - 4 : 1;  // two lines take four of the points
    const bslam_real_t scatter_px2 = (up->square + down->square) / (freedom * pixel * pixel);
    const bslam_real_t doubt = scatter_px2 / (POINT_SD_PX * POINT_SD_PX) + (scans - found) / scans;
    return doubt < 1 ? doubt : 1;
}

/// Upper and lower side and the turn, from the edge points on the front. up(across) = up(0) (1 + turn across)
/// for both, and each weighs by how long it is and how sure. Returns what is left open: doubt_of.
static bslam_real_t fit_level(const search_t *search, const bslam_body_t *body, const bslam_level_t *level)
{
    bslam_outline_t *o = search->outline;
    const fit_t up = fit_edge(search, &level->top, true);
    const fit_t down = fit_edge(search, &level->bottom, true);
    const bslam_real_t top = place_of(search, &level->top, &up, body->top, -1, &o->top_var);
    const bslam_real_t bottom = place_of(search, &level->bottom, &down, body->bottom, 1, &o->bottom_var);
    const bslam_real_t noise = POINT_SD_PX * POINT_SD_PX * o->pixel * o->pixel;
    const bslam_real_t by_top = top * up.spread / (noise + SLOPE_SHARE * o->top_var);
    const bslam_real_t by_bottom = bottom * down.spread / (noise + SLOPE_SHARE * o->bottom_var);
    const bslam_real_t known = top * by_top + bottom * by_bottom + 1 / (BSLAM_TURN_SD * BSLAM_TURN_SD);
    o->turn = (up.slope * by_top + down.slope * by_bottom) / known;
    o->turn_var = 1 / known;
    o->top = top / (1 + o->turn * up.at);
    o->bottom = bottom / (1 + o->turn * down.at);
    return doubt_of(&up, &down, o->pixel);
}

/// The front face from the edges of the whole body: the turn tells where it ends, its ends what belongs to
/// it, and that the turn.
static void fit_front(const search_t *search, const bslam_body_t *body, const bslam_level_t *level)
{
    bslam_outline_t *o = search->outline;
    bslam_real_t doubt = 1;
    o->turn = level->turn;
    for (int32_t i = 0; i < (body->shape.depth > 0 ? FRONT_STEPS : 1); i++) {
        const bslam_stance_t stance = bslam_body_stance(body, o->turn);
        o->left = (bslam_real_t)stance.left;
        o->right = (bslam_real_t)stance.right;
        doubt = fit_level(search, body, level);
    }
    o->middle = bslam_body_middle(body, o->turn) + doubt * level->middle_offset;
    const bslam_real_t turn_sd = bslam_sqrt(o->turn_var);
    const bslam_real_t by_turn =
        (bslam_body_middle(body, o->turn + turn_sd) - bslam_body_middle(body, o->turn - turn_sd)) / 2;
    o->middle_var = (o->left_var + o->right_var) / 4 + by_turn * by_turn + doubt * level->middle_var;
}

// --- The whole

static bool box_is_allowed(const bslam_frame_t *frame, const bslam_box_t *box)
{
    return box->right_px - box->left_px >= 1 && box->bottom_px - box->top_px >= 1 &&
           box->left_px >= BSLAM_R(-0.5) && box->top_px >= BSLAM_R(-0.5) &&
           box->right_px <= (bslam_real_t)frame->width_px - BSLAM_R(0.5) &&
           box->bottom_px <= (bslam_real_t)frame->height_px - BSLAM_R(0.5);
}

static bslam_shape_t shape_of(const bslam_front_t *front)
{
    const bslam_real_t scale = front->height_m > 0 ? 1 / front->height_m : 0;
    return (bslam_shape_t){front->depth_m * scale, front->narrow_m * scale, front->wide_m * scale};
}

static bool shape_is_allowed(const bslam_shape_t *shape)
{
    return bslam_in_range(shape->depth, 0, DEPTH_MAX) && shape->narrow >= 0 && shape->wide >= shape->narrow &&
           bslam_is_number(shape->wide);
}

/// The innermost place across that an upright edge of the rough box has, over its ends and its middle: a lens
/// that bends straight sides makes the box touch them at one point only. `inwards` is 1 to the left. False if
/// the lens does not see it.
static bool innermost(const bslam_facing_t *facing, bslam_real_t u_px, const bslam_box_t *box,
                      bslam_real_t inwards, bslam_real_t *across)
{
    for (int32_t i = 0; i < 3; i++) {
        const bslam_real_t v_px = box->top_px + (bslam_real_t)i / 2 * (box->bottom_px - box->top_px);
        bslam_plane_point_t point;
        if (!bslam_facing_from_frame(facing, u_px, v_px, &point)) {
            return false;
        }
        if (i == 0 || inwards * (point.across - *across) > 0) {
            *across = point.across;
        }
    }
    return true;
}

/// The rough box in the plane that faces it.
static bool begin(search_t *search, const bslam_box_t *rough)
{
    bslam_outline_t *o = search->outline;
    bslam_facing_t *facing = &search->facing;
    const bslam_real_t u = (rough->left_px + rough->right_px) / 2;
    const bslam_real_t v = (rough->top_px + rough->bottom_px) / 2;
    bslam_direction_t centre;
    if (bslam_camera_unproject_as(facing->camera, &facing->mounting, u, v, &centre) != BSLAM_OK) {
        return false;
    }
    o->facing_rad = bslam_direction_bearing_rad(&centre);
    bslam_sin_cos(o->facing_rad, &facing->sine, &facing->cosine);
    bslam_plane_point_t top;
    bslam_plane_point_t bottom;
    if (!innermost(facing, rough->left_px, rough, -1, &o->left) ||
        !innermost(facing, rough->right_px, rough, 1, &o->right) ||
        !bslam_facing_from_frame(facing, u, rough->top_px, &top) ||
        !bslam_facing_from_frame(facing, u, rough->bottom_px, &bottom)) {
        return false;
    }
    o->top = top.up;
    o->bottom = bottom.up;
    o->pixel = (o->top - o->bottom) / (rough->bottom_px - rough->top_px);
    return o->pixel > 0 && o->left > o->right;
}

/// The corners in the frame; false if what was found is no trapezoid that the lens sees.
static bool end(const search_t *search)
{
    bslam_outline_t *o = search->outline;
    const bslam_real_t by_left = 1 + o->turn * o->left;
    const bslam_real_t by_right = 1 + o->turn * o->right;
    const bslam_plane_point_t corners[4] = {{o->left, o->top * by_left},
                                            {o->left, o->bottom * by_left},
                                            {o->right, o->top * by_right},
                                            {o->right, o->bottom * by_right}};
    bslam_real_t u[4];
    bslam_real_t v[4];
    for (int32_t i = 0; i < 4; i++) {
        if (!bslam_facing_to_frame(&search->facing, corners[i], &u[i], &v[i])) {
            return false;
        }
    }
    o->quad = (bslam_quad_t){(u[0] + u[1]) / 2, (u[2] + u[3]) / 2, v[0], v[1], v[2], v[3]};
    return o->left > o->right && o->top > o->bottom && by_left > 0 && by_right > 0 &&
           bslam_is_number(o->middle) && bslam_is_number(o->middle_var);
}

bslam_status_t bslam_outline_find(const bslam_frame_t *frame, const bslam_camera_t *camera,
                                  const bslam_box_t *rough, const bslam_front_t *front,
                                  bslam_outline_t *outline)
{
    const bslam_shape_t shape = shape_of(front);
    bslam_outline_t found = {0};
    search_t search = {.frame = frame,
                       .facing = {.camera = camera, .mounting = bslam_camera_mounting(camera)},
                       .outline = &found};
    if (!box_is_allowed(frame, rough) || !shape_is_allowed(&shape) || !begin(&search, rough) ||
        !find_upright(&search, BSLAM_SIDE_LEFT, &found.left, &found.left_var) ||
        !find_upright(&search, BSLAM_SIDE_RIGHT, &found.right, &found.right_var) ||
        !(found.left > found.right)) {
        return BSLAM_E_RANGE;
    }
    const bslam_body_t body = {found.left, found.right, found.top, found.bottom, found.pixel, shape};
    bslam_level_t level;
    if (!bslam_body_level(&body, frame, &search.facing, &level)) {
        return BSLAM_E_RANGE;
    }
    found.body_left = found.left;
    found.body_right = found.right;
    fit_front(&search, &body, &level);
    if (!end(&search)) {
        return BSLAM_E_RANGE;
    }
    *outline = found;
    return BSLAM_OK;
}
