#include "bslam/vision/outline.h"

#include <string.h>

#include "bslam/math/trig.h"

// A side is crossed by scan lines: rows for an upright side, columns for a level one. Boundary p of a scan
// line lies between pixels p - 1 and p of the half-resolution copy, which is at 2 p - 0.5 in the whole frame.
// On each line a window of boundaries is looked at, around where the rough box has the side; places are
// counted inwards in it.

enum {
    SCANS_MAX = 10,
    PLACES = 19,
    REACH_OUT = 6,  // places outside the rough box
    STEP_MAX = 255,
    TURNS_MAX = 6,    // slopes tried to either side
    FRONT_STEPS = 3,  // a body's front and its turn determine each other: rounds
    CHANNELS = 3
};

// Which line is the side: weights of the contrast along it and next to it, from two places outside to one
// inside; the contrast is C / (C + HALF_CONTRAST). The weights are those of a multinomial logistic regression
// over training worlds: beyond the side the wall is quiet, within it the object has edges of its own. MATH
// "Outline".
enum { TAPS = 5, TAPS_OUTSIDE = 3 };
static const float TAP[TAPS] = {-1.4f, -1.65f, 2.2f, 3.6f, 1.4f};
static const float HALF_CONTRAST = 20.0f;
// The same regression's for the square of the distance from the rough box, half-resolution pixels.
static const float ROUGH_COST = 0.12f;
// Steepest turn that is looked for: tangent of the slant.
static const bslam_real_t TURN_MAX = BSLAM_R(1.8);
// What is known of a turn before it is seen: its standard deviation.
static const bslam_real_t TURN_SD = BSLAM_R(0.7);
static const float TURN_COST = 1.0f;  // 1 / (2 TURN_SD²)
// An edge point this far from its line is another edge's, half-resolution pixels.
static const bslam_real_t STRAY_PX = BSLAM_R(1.2);
// How well an edge point is found, whole-frame pixels.
static const bslam_real_t POINT_SD_PX = BSLAM_R(0.7);
// Scan lines stay this far from the ends of a side, as a fraction of it.
static const bslam_real_t END_MARGIN = BSLAM_R(0.12);

/// Axes that look in a bearing: sine and cosine of it.
typedef struct facing {
    const bslam_camera_t *camera;
    bslam_real_t sine;
    bslam_real_t cosine;
} facing_t;

/// A point of the facing plane: y/x and z/x.
typedef struct plane_point {
    bslam_real_t across;
    bslam_real_t up;
} plane_point_t;

static bool to_plane(const facing_t *facing, bslam_real_t u_px, bslam_real_t v_px, plane_point_t *point)
{
    bslam_direction_t direction;
    if (bslam_camera_unproject(facing->camera, u_px, v_px, &direction) != BSLAM_OK) {
        return false;
    }
    const bslam_real_t ahead = facing->cosine * direction.x + facing->sine * direction.y;
    if (!(ahead > BSLAM_R(0.05))) {
        return false;
    }
    point->across = (facing->cosine * direction.y - facing->sine * direction.x) / ahead;
    point->up = direction.z / ahead;
    return true;
}

static bool to_frame(const facing_t *facing, plane_point_t point, bslam_real_t *u_px, bslam_real_t *v_px)
{
    const bslam_direction_t direction = {facing->cosine - facing->sine * point.across,
                                         facing->sine + facing->cosine * point.across, point.up};
    return bslam_camera_project(facing->camera, &direction, u_px, v_px) == BSLAM_OK;
}

/// One side of the object.
typedef struct side {
    const uint16_t *half;
    int32_t across;  ///< elements of `half` from a pixel to the next along a scan line
    int32_t along;   ///< and to the next scan line
    int32_t size;    ///< pixels of a scan line
    int32_t lines;   ///< scan lines of the frame
    bool level;      ///< an upper or lower side: scan lines are columns
    bool backwards;  ///< inwards is towards smaller coordinates
    int32_t count;
    int16_t scan[SCANS_MAX];   ///< coordinate of each line
    int16_t first[SCANS_MAX];  ///< boundary at place 0, a coordinate
    float base[SCANS_MAX];     ///< place of the rough side on each line
    float tilt[SCANS_MAX];     ///< places inwards by a turn of 1
    uint8_t steps[SCANS_MAX][PLACES];
} side_t;

typedef struct rgb {
    int32_t value[CHANNELS];
} rgb_t;

static rgb_t rgb_at(const side_t *side, int32_t index, int32_t pixel)
{
    const int32_t last = side->size - 1;
    const int32_t inside = pixel < 0 ? 0 : pixel > last ? last : pixel;
    const uint16_t value = side->half[side->scan[index] * side->along + inside * side->across];
    return (rgb_t){{(value >> 11) * 2, (value >> 5) & 63, (value & 31) * 2}};
}

/// The pixel that lies just inside a place, at whichever side inwards is.
static rgb_t inside_of(const side_t *side, int32_t index, int32_t place)
{
    return rgb_at(side, index, side->backwards ? side->first[index] - 1 - place : side->first[index] + place);
}

/// Contrast at each place: the two pixels inside against the two outside.
static void fill_steps(side_t *side, int32_t index)
{
    rgb_t window[4];
    for (int32_t k = 1; k < 4; k++) {
        window[k] = inside_of(side, index, k - 3);
    }
    for (int32_t place = 0; place < PLACES; place++) {
        memmove(window, window + 1, 3 * sizeof window[0]);
        window[3] = inside_of(side, index, place + 1);
        int32_t sum = 0;
        for (int32_t c = 0; c < CHANNELS; c++) {
            const int32_t step =
                window[2].value[c] + window[3].value[c] - window[0].value[c] - window[1].value[c];
            sum += step < 0 ? -step : step;
        }
        side->steps[index][place] = (uint8_t)(sum > STEP_MAX ? STEP_MAX : sum);
    }
}

static int32_t round_to_int(bslam_real_t x)
{
    return (int32_t)(x + (x < 0 ? BSLAM_R(-0.5) : BSLAM_R(0.5)));
}

/// Adds the scan line through a point of the rough side, unless it is the same as the one before or outside
/// the frame. False if the lens does not see the point.
static bool add_scan(side_t *side, const facing_t *facing, plane_point_t rough)
{
    bslam_real_t u_px;
    bslam_real_t v_px;
    if (!to_frame(facing, rough, &u_px, &v_px)) {
        return false;
    }
    const bslam_real_t along = ((side->level ? u_px : v_px) - BSLAM_R(0.5)) / 2;
    const bslam_real_t across = ((side->level ? v_px : u_px) + BSLAM_R(0.5)) / 2;
    const int32_t scan = round_to_int(along);
    const int32_t i = side->count;
    if (scan < 0 || scan >= side->lines || (i > 0 && scan == side->scan[i - 1])) {
        return true;
    }
    const int32_t boundary = round_to_int(across);
    const float rest = (float)(across - (bslam_real_t)boundary);
    side->scan[i] = (int16_t)scan;
    side->first[i] = (int16_t)(boundary + (side->backwards ? REACH_OUT : -REACH_OUT));
    side->base[i] = (float)REACH_OUT + (side->backwards ? -rest : rest);
    fill_steps(side, i);
    side->count++;
    return true;
}

/// Coordinate of a place in the whole frame.
static bslam_real_t place_px(const side_t *side, int32_t index, bslam_real_t place)
{
    const bslam_real_t first = (bslam_real_t)side->first[index];
    return 2 * (side->backwards ? first - place : first + place) - BSLAM_R(0.5);
}

/// A line that lies `shift` places inwards of the rough side.
typedef struct line {
    float score;
    float shift;
} line_t;

/// Mean contrast along each of the lines of one turn, as C / (C + HALF_CONTRAST), by shift + REACH_OUT;
/// returns how far inwards of the shift the outermost end of these lines is.
static float contrasts(const side_t *side, float turn, float contrast[PLACES])
{
    int32_t sums[PLACES] = {0};
    float outermost = 0;
    for (int32_t i = 0; i < side->count; i++) {
        const float tilt = turn * side->tilt[i];
        const int32_t offset = (int32_t)(side->base[i] + tilt + (float)PLACES + 0.5f) - PLACES - REACH_OUT;
        const int32_t from = offset < 0 ? -offset : 0;
        const int32_t to = offset > 0 ? PLACES - offset : PLACES;
        outermost = tilt < outermost ? tilt : outermost;
        for (int32_t k = from; k < to; k++) {
            sums[k] += side->steps[i][k + offset];
        }
    }
    for (int32_t k = 0; k < PLACES; k++) {
        const float sum = (float)sums[k];
        contrast[k] = side->count > 0 ? sum / (sum + HALF_CONTRAST * (float)side->count) : 0.0f;
    }
    return outermost;
}

/// The best of the lines of one turn.
static line_t best_line(const side_t *side, float turn)
{
    float contrast[PLACES];
    const float outermost = contrasts(side, turn, contrast);
    line_t best = {-1e9f, 0.0f};
    for (int32_t k = TAPS_OUTSIDE; k < PLACES - TAPS + TAPS_OUTSIDE; k++) {
        const float shift = (float)(k - REACH_OUT);
        float score = -ROUGH_COST * (shift + outermost) * (shift + outermost);
        for (int32_t t = 0; t < TAPS; t++) {
            score += TAP[t] * contrast[k + t - TAPS_OUTSIDE];
        }
        if (score > best.score) {
            best = (line_t){score, shift};
        }
    }
    return best;
}

/// Sub-pixel place of the edge near `place`: the centroid of the changes over the three boundaries around it,
/// each taken along the whole change. False where there is hardly any.
static bool edge_place(const side_t *side, int32_t index, float near_place, bslam_real_t *place)
{
    const int32_t middle = (int32_t)(near_place + 0.5f);
    if (middle < 1 || middle >= PLACES - 1) {
        return false;
    }
    rgb_t pixels[4];
    for (int32_t k = 0; k < 4; k++) {
        pixels[k] = inside_of(side, index, middle + k - 2);
    }
    int32_t whole = 0;
    int32_t moment = 0;
    for (int32_t c = 0; c < CHANNELS; c++) {
        const int32_t change = pixels[3].value[c] - pixels[0].value[c];
        whole += change * change;
        moment +=
            change * (pixels[3].value[c] - pixels[2].value[c] - pixels[1].value[c] + pixels[0].value[c]);
    }
    if (whole < 12 || moment > whole || moment < -whole) {
        return false;
    }
    *place = (bslam_real_t)middle + (bslam_real_t)moment / (bslam_real_t)whole;
    return true;
}

/// Points of an edge in the facing plane.
typedef struct edge {
    int32_t count;
    plane_point_t points[SCANS_MAX];
} edge_t;

/// The edge points near a line.
static edge_t trace_edge(const side_t *side, const facing_t *facing, line_t line, float turn)
{
    edge_t edge = {.count = 0};
    for (int32_t i = 0; i < side->count; i++) {
        const bslam_real_t scan_px = 2 * (bslam_real_t)side->scan[i] + BSLAM_R(0.5);
        bslam_real_t place;
        if (edge_place(side, i, side->base[i] + line.shift + turn * side->tilt[i], &place)) {
            const bslam_real_t px = place_px(side, i, place);
            const bool seen = side->level ? to_plane(facing, scan_px, px, &edge.points[edge.count])
                                          : to_plane(facing, px, scan_px, &edge.points[edge.count]);
            edge.count += seen ? 1 : 0;
        }
    }
    return edge;
}

/// A straight line through edge points, by least squares: value at the mean place along, and slope.
typedef struct fit {
    int32_t count;
    bslam_real_t at;      ///< mean place along
    bslam_real_t value;   ///< there
    bslam_real_t slope;   ///< of a level side; 0 for an upright one
    bslam_real_t spread;  ///< sum of squared distances from `at`
} fit_t;

/// An edge point as a level side sees it: along is across the object and value up; an upright side's are
/// swapped.
static plane_point_t oriented(const edge_t *edge, int32_t index, bool level)
{
    const plane_point_t point = edge->points[index];
    return level ? point : (plane_point_t){point.up, point.across};
}

static fit_t fit_all(const edge_t *edge, bool level)
{
    fit_t fit = {.count = edge->count};
    bslam_real_t mixed = 0;
    for (int32_t i = 0; i < edge->count; i++) {
        const plane_point_t point = oriented(edge, i, level);
        fit.at += point.across / (bslam_real_t)edge->count;
        fit.value += point.up / (bslam_real_t)edge->count;
    }
    for (int32_t i = 0; level && i < edge->count; i++) {
        const plane_point_t point = oriented(edge, i, level);
        fit.spread += (point.across - fit.at) * (point.across - fit.at);
        mixed += (point.across - fit.at) * (point.up - fit.value);
    }
    fit.slope = fit.spread > 0 ? mixed / fit.spread : 0;
    return fit;
}

/// The line through those points that lie between two places along and do not stray.
static fit_t fit_edge(const edge_t *edge, bool level, bslam_real_t low, bslam_real_t high, bslam_real_t stray)
{
    edge_t kept = {.count = 0};
    for (int32_t i = 0; i < edge->count; i++) {
        if (bslam_in_range(oriented(edge, i, level).across, low, high)) {
            kept.points[kept.count++] = edge->points[i];
        }
    }
    const fit_t all = fit_all(&kept, level);
    const int32_t count = kept.count;
    kept.count = 0;
    for (int32_t i = 0; i < count; i++) {
        const plane_point_t point = oriented(&kept, i, level);
        if (bslam_abs(point.up - all.value - all.slope * (point.across - all.at)) <= stray) {
            kept.points[kept.count++] = kept.points[i];
        }
    }
    return kept.count >= 2 ? fit_all(&kept, level) : all;
}

/// What all four sides need.
typedef struct search {
    const bslam_frame_t *frame;
    facing_t facing;
    bslam_outline_t *outline;
} search_t;

enum { LEFT, RIGHT, TOP, BOTTOM };

// Limits of tangents that exclude nothing.
#define EVERYWHERE BSLAM_R(-1e3), BSLAM_R(1e3)

/// An edge point that is farther than this from its line is another edge's.
static bslam_real_t stray_of(const search_t *search)
{
    return 2 * STRAY_PX * search->outline->pixel;
}

static void begin_side(const search_t *search, int32_t which, side_t *side)
{
    const int32_t width = search->frame->width_px / 2;
    const int32_t height = search->frame->height_px / 2;
    memset(side, 0, sizeof *side);
    side->half = search->frame->half;
    side->level = which == TOP || which == BOTTOM;
    side->backwards = which == RIGHT || which == BOTTOM;
    side->across = side->level ? width : 1;
    side->along = side->level ? 1 : width;
    side->size = side->level ? height : width;
    side->lines = side->level ? width : height;
}

/// Scan lines over an upright side at `across`, or a level one at `up`.
static bool add_scans(const search_t *search, int32_t which, bslam_real_t at, side_t *side)
{
    const bslam_outline_t *o = search->outline;
    begin_side(search, which, side);
    const bslam_real_t from = side->level ? o->left : o->top;
    const bslam_real_t to = side->level ? o->right : o->bottom;
    for (int32_t i = 0; i < SCANS_MAX; i++) {
        const bslam_real_t part = (bslam_real_t)i / (SCANS_MAX - 1);
        const bslam_real_t along = from + (to - from) * (END_MARGIN + part * (1 - 2 * END_MARGIN));
        const plane_point_t point = side->level ? (plane_point_t){along, at} : (plane_point_t){at, along};
        const int32_t before = side->count;
        if (!add_scan(side, &search->facing, point)) {
            return false;
        }
        if (side->level && side->count > before) {
            const bslam_real_t upwards = at * along / (2 * o->pixel);
            side->tilt[before] = (float)(which == TOP ? -upwards : upwards);
        }
    }
    return true;
}

static bool find_upright(const search_t *search, int32_t which, bslam_real_t *across)
{
    side_t side;
    if (!add_scans(search, which, *across, &side)) {
        return false;
    }
    const edge_t edge = trace_edge(&side, &search->facing, best_line(&side, 0), 0);
    const fit_t fit = fit_edge(&edge, false, EVERYWHERE, stray_of(search));
    if (fit.count >= 2) {
        *across = fit.value;
    }
    return true;
}

/// Places by which the ends of a level side move when the turn changes by 1.
static bslam_real_t reach_of(const bslam_outline_t *outline, bslam_real_t up)
{
    return bslam_abs(up) * (outline->left - outline->right) / (4 * outline->pixel);
}

/// The upper and the lower edge.
typedef struct edges {
    edge_t top;
    edge_t bottom;
} edges_t;

/// Two lines that are level in the room meet at the horizon: one turn for both.
static void find_lines(const side_t *top, const side_t *bottom, int32_t turns, const facing_t *facing,
                       edges_t *edges)
{
    float best = -1e9f;
    float best_turn = 0;
    line_t best_top = {0, 0};
    line_t best_bottom = {0, 0};
    for (int32_t k = -turns; k <= turns; k++) {
        const float turn = turns > 0 ? (float)TURN_MAX * (float)k / (float)turns : 0.0f;
        const line_t top_line = best_line(top, turn);
        const line_t bottom_line = best_line(bottom, turn);
        const float score = top_line.score + bottom_line.score - TURN_COST * turn * turn;
        if (score > best) {
            best = score;
            best_turn = turn;
            best_top = top_line;
            best_bottom = bottom_line;
        }
    }
    edges->top = trace_edge(top, facing, best_top, best_turn);
    edges->bottom = trace_edge(bottom, facing, best_bottom, best_turn);
}

static bool find_level(const search_t *search, edges_t *edges)
{
    const bslam_outline_t *o = search->outline;
    side_t top;
    side_t bottom;
    if (!add_scans(search, TOP, o->top, &top) || !add_scans(search, BOTTOM, o->bottom, &bottom)) {
        return false;
    }
    const bslam_real_t top_reach = reach_of(o, o->top);
    const bslam_real_t bottom_reach = reach_of(o, o->bottom);
    const bslam_real_t reach = TURN_MAX * (top_reach > bottom_reach ? top_reach : bottom_reach);
    const int32_t turns = reach < 1 ? 0 : reach < TURNS_MAX ? (int32_t)reach : TURNS_MAX;
    find_lines(&top, &bottom, turns, &search->facing, edges);
    return true;
}

/// Upper and lower side and turn from the edge points between the outline's left and right.
static void fit_level(const search_t *search, const edges_t *edges)
{
    bslam_outline_t *o = search->outline;
    const fit_t up = fit_edge(&edges->top, true, o->right, o->left, stray_of(search));
    const fit_t down = fit_edge(&edges->bottom, true, o->right, o->left, stray_of(search));
    const bslam_real_t noise = POINT_SD_PX * POINT_SD_PX * o->pixel * o->pixel;
    const bslam_real_t top_at = up.count >= 2 ? up.value : o->top;
    const bslam_real_t bottom_at = down.count >= 2 ? down.value : o->bottom;
    const bslam_real_t known =
        top_at * top_at * up.spread + bottom_at * bottom_at * down.spread + noise / (TURN_SD * TURN_SD);
    o->turn = (up.slope * top_at * up.spread + down.slope * bottom_at * down.spread) / known;
    o->turn_var = noise / known;
    o->top = top_at / (1 + o->turn * up.at);
    o->bottom = bottom_at / (1 + o->turn * down.at);
}

/// Takes the visible flank of a body that stands out from the wall off the outline: `outer` are its sides
/// with it. The flank's rear corner is `depth` behind the front's, at right angles to it.
static void take_flanks_off(bslam_outline_t *o, bslam_real_t outer_left, bslam_real_t outer_right,
                            bslam_real_t depth)
{
    const bslam_real_t back = depth * (o->top - o->bottom) / bslam_sqrt(1 + o->turn * o->turn);
    for (int32_t i = 0; i < 3; i++) {
        const bslam_real_t left = back * (1 + o->turn * o->left) * (o->turn - o->left);
        const bslam_real_t right = back * (1 + o->turn * o->right) * (o->turn - o->right);
        o->left = left > 0 ? outer_left - left : outer_left;
        o->right = right < 0 ? outer_right - right : outer_right;
    }
}

/// The front face from the edges of the whole body.
static void fit_front(const search_t *search, const edges_t *edges, bslam_real_t depth)
{
    bslam_outline_t *o = search->outline;
    const bslam_real_t outer_left = o->left;
    const bslam_real_t outer_right = o->right;
    fit_level(search, edges);
    for (int32_t i = 0; depth > 0 && i < FRONT_STEPS; i++) {
        take_flanks_off(o, outer_left, outer_right, depth);
        fit_level(search, edges);
    }
}

static bool box_is_allowed(const bslam_frame_t *frame, const bslam_box_t *box)
{
    return box->right_px - box->left_px >= 1 && box->bottom_px - box->top_px >= 1 &&
           box->left_px >= BSLAM_R(-0.5) && box->top_px >= BSLAM_R(-0.5) &&
           box->right_px <= (bslam_real_t)frame->width_px - BSLAM_R(0.5) &&
           box->bottom_px <= (bslam_real_t)frame->height_px - BSLAM_R(0.5);
}

/// The rough box in the plane that faces it.
static bool begin(search_t *search, const bslam_box_t *rough)
{
    bslam_outline_t *o = search->outline;
    const bslam_real_t u = (rough->left_px + rough->right_px) / 2;
    const bslam_real_t v = (rough->top_px + rough->bottom_px) / 2;
    bslam_direction_t centre;
    if (bslam_camera_unproject(search->facing.camera, u, v, &centre) != BSLAM_OK) {
        return false;
    }
    o->facing_rad = bslam_direction_bearing_rad(&centre);
    bslam_sin_cos(o->facing_rad, &search->facing.sine, &search->facing.cosine);
    plane_point_t left;
    plane_point_t right;
    plane_point_t top;
    plane_point_t bottom;
    if (!to_plane(&search->facing, rough->left_px, v, &left) ||
        !to_plane(&search->facing, rough->right_px, v, &right) ||
        !to_plane(&search->facing, u, rough->top_px, &top) ||
        !to_plane(&search->facing, u, rough->bottom_px, &bottom)) {
        return false;
    }
    o->left = left.across;
    o->right = right.across;
    o->top = top.up;
    o->bottom = bottom.up;
    o->pixel = (o->top - o->bottom) / (rough->bottom_px - rough->top_px);
    return o->pixel > 0 && o->left > o->right;
}

static bool end(const search_t *search)
{
    bslam_outline_t *o = search->outline;
    const plane_point_t corners[4] = {{o->left, o->top * (1 + o->turn * o->left)},
                                      {o->left, o->bottom * (1 + o->turn * o->left)},
                                      {o->right, o->top * (1 + o->turn * o->right)},
                                      {o->right, o->bottom * (1 + o->turn * o->right)}};
    bslam_real_t u[4];
    bslam_real_t v[4];
    for (int32_t i = 0; i < 4; i++) {
        if (!to_frame(&search->facing, corners[i], &u[i], &v[i])) {
            return false;
        }
    }
    o->quad = (bslam_quad_t){(u[0] + u[1]) / 2, (u[2] + u[3]) / 2, v[0], v[1], v[2], v[3]};
    return o->left > o->right && corners[0].up > corners[1].up && corners[2].up > corners[3].up;
}

bslam_status_t bslam_outline_find(const bslam_frame_t *frame, const bslam_camera_t *camera,
                                  const bslam_box_t *rough, bslam_real_t depth, bslam_outline_t *outline)
{
    bslam_outline_t found = {0};
    edges_t edges;
    search_t search = {.frame = frame, .facing = {.camera = camera}, .outline = &found};
    if (!box_is_allowed(frame, rough) || !begin(&search, rough) ||
        !find_upright(&search, LEFT, &found.left) || !find_upright(&search, RIGHT, &found.right) ||
        !find_level(&search, &edges)) {
        return BSLAM_E_RANGE;
    }
    fit_front(&search, &edges, depth);
    if (!end(&search)) {
        return BSLAM_E_RANGE;
    }
    *outline = found;
    return BSLAM_OK;
}
