#include "vision/built_in/detection/vertical_edges.h"

#include <stddef.h>
#include <string.h>

#include "base/bounds.h"
#include "vision/pixels/bytes.h"
#include "base/scalar.h"

/// What is looked for: foot, middle and top are so high above the floor, and it is at least and at most so
/// wide as it appears, slanted by up to 60 degrees.
typedef struct upright {
    float heights_m[3];
    float width_min_m, width_max_m;
} upright_t;

#define FROM_TO(bottom_m, top_m) \
    {(bottom_m), (bottom_m) + 0.5f * ((top_m) - (bottom_m)), (bottom_m) + ((top_m) - (bottom_m))}

static const upright_t uprights[] = {
    {FROM_TO(0.0f, 1.9f), 0.45f, 1.3f},     // doors, cabinets
    {FROM_TO(0.1f, 0.7f), 0.40f, 1.7f},     // radiators
    {FROM_TO(0.9f, 2.1f), 0.45f, 1.9f},     // windows
    {FROM_TO(1.08f, 1.92f), 0.30f, 0.75f},  // posters
    {FROM_TO(0.6f, 1.2f), 0.10f, 0.30f},    // extinguishers, which hang at any height
    {FROM_TO(0.9f, 1.5f), 0.10f, 0.30f},
};
#define UPRIGHTS BSLAM_UPRIGHTS
_Static_assert(sizeof uprights / sizeof uprights[0] == BSLAM_UPRIGHTS, "room for the steps of each kind");

/// Sides of a kind in a frame, and boxes that come of them.
#define SIDES_FEW 14
#define BOXES_FEW 8
#define SIDES_MANY 24
#define BOXES_MANY 14
/// Few in a frame of up to so many columns, many in a wider one, which shows more.
#define COLUMNS_FEW 80
#define SIDES_MAX (BSLAM_COLUMNS_MAX > COLUMNS_FEW ? SIDES_MANY : SIDES_FEW)
#define BOXES_MAX (BSLAM_COLUMNS_MAX > COLUMNS_FEW ? BOXES_MANY : BOXES_FEW)
/// Boxes of a kind that the frame's left edge cuts off, and as many by its right one. What is left of them is
/// at least this part of the kind's least width.
#define CUT_BOXES_MAX 2
#define CUT_SHARE_MIN 0.3f
/// Cells across a box and down it, at least.
#define SIDE_MIN 2
/// A side is one whose mean step is at least this, in quarters; a cell counts at most STEP_MAX.
#define STEP_MEAN_MIN (4 * 7)
#define STEP_MAX 60

/// An upright line on the wall where there may be a side, and what stands there: where its foot, middle and
/// top fall in the frame; pixels of a metre; mean step in quarters. Through a wide lens it is bent.
typedef struct side {
    int16_t column;       ///< of the middle
    int16_t top, bottom;  ///< rows of cells [top, bottom)
    float u_px[3], v_px[3];
    float metre_px;
    int32_t step;
} side_t;

/// The sideways steps of four columns side by side, from their upper end to a row: of the even ones and of
/// the odd ones, each two in the halves of a word; STEP_FREE more a cell, which is what STEP_MAX leaves free.
typedef uint32_t step_sums_t[2];

#define STEP_FREE (255 - STEP_MAX)

typedef struct column_sums {
    step_sums_t to[BSLAM_IMAGE_HEIGHT_MAX / BSLAM_CELL_PX + 1];
} column_sums_t;

/// Of columns from `first` on; tables have room for a word that goes beyond the last.
static void sum_columns(const bslam_view_t *view, int32_t first, column_sums_t *sums)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    const uint8_t *step = view->step_x + first;
    uint32_t even = 0, odd = 0;
    step_sums_t *to = sums->to;
    (*to)[0] = (*to)[1] = 0;
    for (const step_sums_t *end = to + rows; to != end; step += columns) {
        to++;
        const uint32_t four = bslam_bytes_plus(bslam_word_at(step), STEP_FREE * 0x01010101U);
        even = bslam_bytes_add_even(even, four);
        odd = bslam_bytes_add_odd(odd, four);
        (*to)[0] = even;
        (*to)[1] = odd;
    }
}

/// Of one of these columns, between two rows.
static int32_t steps_between(const column_sums_t *sums, int32_t column, int32_t top, int32_t bottom)
{
    const uint32_t odd = (uint32_t)column & 1, shift = ((uint32_t)column & 2) * 8;
    const uint32_t from = sums->to[top][odd], to = sums->to[bottom][odd];
    return (int32_t)(((to >> shift) - (from >> shift)) & 0xFFFFU) - STEP_FREE * (bottom - top);
}

/// A straight part of a line, from foot to middle or from there to top: the column that it crosses changes by
/// the same from row to row.
typedef struct part {
    float v_px, height_px;  ///< where it begins, and how far down and right it ends
    float u_px, width_px;
} part_t;

static part_t part_of(const side_t *side, int32_t part)
{
    const float *v_px = side->v_px + part, *u_px = side->u_px + part;
    return (part_t){v_px[0], v_px[1] - v_px[0], u_px[0], u_px[1] - u_px[0]};
}

static float middle_px(int32_t row)
{
    return (float)(row * BSLAM_CELL_PX) + 1.5f;
}

/// Of a column in a row of so many; 0 outside.
static inline int32_t limited_step(const uint8_t *steps, int32_t columns, int32_t column)
{
    const int32_t step = column >= 0 && column < columns ? steps[column] : 0;
    return step < STEP_MAX ? step : STEP_MAX;
}

/// The column of cells that a part crosses in a row of them; -1 where it goes far outside, or nowhere,
/// because both its ends fall on one row.
static int32_t column_at(const part_t *part, int32_t row)
{
    const float u_px = part->u_px + (middle_px(row) - part->v_px) / part->height_px * part->width_px;
    const bool is_near = u_px > (float)-BSLAM_FRAME_SIDE_MAX && u_px < (float)BSLAM_FRAME_SIDE_MAX;
    return is_near ? (int32_t)(u_px / BSLAM_CELL_PX) : -1;
}

/// Sum of the sideways steps along a part, of rows [row, end).
static int32_t sum_part(const bslam_view_t *view, part_t part, int32_t row, int32_t end)
{
    const int32_t columns = view->frame->columns;
    const uint8_t *steps = view->step_x + row * columns;
    int32_t sum = 0;
    for (; row < end; row++, steps += columns) {
        sum += limited_step(steps, columns, column_at(&part, row));
    }
    return sum;
}

/// Mean of the sideways steps along a line that stays in its column, in quarters.
static inline uint8_t straight_step(const column_sums_t *sums, const side_t *side)
{
    const int32_t top = side->top, bottom = side->bottom;
    return (uint8_t)(4 * steps_between(sums, side->column, top, bottom) / (bottom - top));
}

/// The same along any line.
static uint8_t mean_step(const bslam_view_t *view, const column_sums_t *sums, const side_t *side)
{
    const int32_t top = side->top, bottom = side->bottom;
    if (side->u_px[0] == side->u_px[2]) {
        return straight_step(sums, side);
    }
    int32_t middle = top;
    while (middle < bottom && !(middle_px(middle) > side->v_px[1])) {
        middle++;
    }
    const int32_t sum =
        sum_part(view, part_of(side, 1), top, middle) + sum_part(view, part_of(side, 0), middle, bottom);
    return (uint8_t)(4 * sum / (bottom - top));
}

/// The row of the horizon; and through a lens that bends uprights where the wall stands in each column,
/// horizontally, from the camera: worked out once for all kinds.
typedef struct wall {
    float horizon_px;
    bslam_real_t x_m[BSLAM_COLUMNS_MAX], y_m[BSLAM_COLUMNS_MAX];
    bool is_seen[BSLAM_COLUMNS_MAX];
} wall_t;

static bool does_bend(const bslam_view_t *view)
{
    return view->camera->lens == BSLAM_LENS_EQUIDISTANT;
}

static void find_wall(const bslam_view_t *view, wall_t *wall)
{
    const bslam_camera_t *camera = view->camera;
    const bslam_real_t v_px = bslam_horizon_px(camera);
    wall->horizon_px = (float)v_px;
    for (int32_t column = 0; does_bend(view) && column < view->frame->columns; column++) {
        const bslam_real_t u_px = (bslam_real_t)(column * BSLAM_CELL_PX) + BSLAM_R(1.5);
        const bslam_real_t distance_m = view->floor_line->distance_m[column];
        bslam_direction_t ahead = {0};
        wall->is_seen[column] =
            bslam_camera_unproject_as(camera, &view->mounting, u_px, v_px, &ahead) == BSLAM_OK;
        const bslam_real_t flat = bslam_sqrt(ahead.x * ahead.x + ahead.y * ahead.y);
        wall->x_m[column] = ahead.x * distance_m / flat;
        wall->y_m[column] = ahead.y * distance_m / flat;
    }
}

/// A lens that bends uprights: foot, middle and top of the line that crosses the horizon in this column.
/// Not to be inlined: what a straight side needs stays in registers.
__attribute__((noinline)) static bool bend(const bslam_view_t *view, const wall_t *wall,
                                           const upright_t *kind, side_t *side)
{
    const bslam_camera_t *camera = view->camera;
    if (!wall->is_seen[side->column]) {
        return false;
    }
    for (int32_t i = 0; i < 3; i++) {
        const bslam_direction_t there = {wall->x_m[side->column], wall->y_m[side->column],
                                         (bslam_real_t)kind->heights_m[i] - camera->z_m};
        bslam_real_t u = 0, v = 0;
        if (bslam_camera_project_as(camera, &view->mounting, &there, &u, &v) != BSLAM_OK) {
            return false;
        }
        side->u_px[i] = (float)u;
        side->v_px[i] = (float)v;
    }
    return true;
}

/// What all kinds have in common in a column. False: the floor line is not known there.
static bool begin_side(const bslam_view_t *view, const wall_t *wall, int32_t column, side_t *side)
{
    const float below_px = (float)view->floor_line->edge_px[column] - wall->horizon_px;
    if (!(view->floor_line->distance_m[column] > 0) || below_px < 4.0f) {
        return false;
    }
    side->column = (int16_t)column;
    side->metre_px = below_px / (float)view->camera->z_m;
    side->u_px[0] = side->u_px[1] = side->u_px[2] = (float)(column * BSLAM_CELL_PX) + 1.5f;
    return true;
}

/// The rows of cells of a side whose foot and top are known. False: it would leave the frame.
static inline bool find_rows(const bslam_frame_t *frame, side_t *side)
{
    const float foot_px = side->v_px[0], top_px = side->v_px[2];
    // In positive form: a camera on the floor gives no number.
    if (!(top_px >= -2.0f) || !(foot_px >= top_px) || !(foot_px <= (float)frame->height_px)) {
        return false;
    }
    const int32_t end = (int32_t)(foot_px / BSLAM_CELL_PX + 0.5f), rows = frame->rows;
    side->top = (int16_t)(top_px < 0 ? 0 : (int32_t)(top_px / BSLAM_CELL_PX));
    side->bottom = (int16_t)(end < rows ? end : rows);
    return side->bottom - side->top >= 2;
}

/// Where the kind would stand in the side's column, upright in the frame. False: it would leave the frame.
static inline bool place_straight(const bslam_view_t *view, const wall_t *wall, const upright_t *kind,
                                  side_t *side)
{
    const float camera_m = (float)view->camera->z_m;
    // A straight side's middle is of no use.
    side->v_px[0] = wall->horizon_px - side->metre_px * (kind->heights_m[0] - camera_m);
    side->v_px[2] = wall->horizon_px - side->metre_px * (kind->heights_m[2] - camera_m);
    return find_rows(view->frame, side);
}

/// The same through a lens that bends uprights.
static bool place_bent(const bslam_view_t *view, const wall_t *wall, const upright_t *kind, side_t *side)
{
    return bend(view, wall, kind, side) && find_rows(view->frame, side);
}

/// The same through any lens.
static bool place(const bslam_view_t *view, const wall_t *wall, const upright_t *kind, side_t *side)
{
    return does_bend(view) ? place_bent(view, wall, kind, side) : place_straight(view, wall, kind, side);
}

static bool shows_much(const bslam_view_t *view)
{
    return view->frame->columns > COLUMNS_FEW;
}

/// How the colour steps where a kind would stand in a side's column; 0: it does not. A copy of the side that
/// none but this function sees stays in registers.
static inline uint8_t step_where(const bslam_view_t *view, const wall_t *wall, const column_sums_t *sums,
                                 const upright_t *kind, const side_t *side)
{
    side_t here = *side;
    return place_straight(view, wall, kind, &here) ? straight_step(sums, &here) : 0;
}

/// The same through a lens that bends uprights.
static uint8_t step_where_bent(const bslam_view_t *view, const wall_t *wall, const column_sums_t *sums,
                               const upright_t *kind, side_t *side)
{
    return place_bent(view, wall, kind, side) ? mean_step(view, sums, side) : 0;
}

/// How the colour steps where each kind would stand in each column; 0: it does not. Not to be
/// inlined: its sums are off the stack when boxes are proposed.
__attribute__((noinline)) static void find_steps(const bslam_view_t *view, const wall_t *wall,
                                                 bslam_edge_steps_t *steps)
{
    column_sums_t sums;
    side_t side = {0};
    const bool bends = does_bend(view);
    for (int32_t column = 0; column < view->frame->columns; column++) {
        if (column % BSLAM_WORD_BYTES == 0) {
            sum_columns(view, column, &sums);
        }
        const bool is_known = begin_side(view, wall, column, &side);
        for (int32_t kind = 0; kind < UPRIGHTS; kind++) {
            const upright_t *upright = &uprights[kind];
            steps->of_kind[kind][column] = !is_known ? 0
                                           : bends   ? step_where_bent(view, wall, &sums, upright, &side)
                                                     : step_where(view, wall, &sums, upright, &side);
        }
    }
}

/// The strongest sides of a kind, in order of columns.
static int32_t find_sides(const bslam_view_t *view, const wall_t *wall, const upright_t *kind,
                          const uint8_t *steps, side_t sides[SIDES_MAX])
{
    const int32_t limit = shows_much(view) ? SIDES_MAX : SIDES_FEW;
    const int32_t columns = view->frame->columns;
    int32_t count = 0;
    for (int32_t column = 1; column + 1 < columns; column++) {
        const uint8_t step = steps[column];
        if (step < STEP_MEAN_MIN || step < steps[column - 1] || step <= steps[column + 1]) {
            continue;
        }
        int32_t at = count;
        if (count == limit) {
            for (int32_t i = 0; i < count; i++) {
                at = at == limit || sides[i].step < sides[at].step ? i : at;
            }
            if (sides[at].step >= step) {
                continue;
            }
            memmove(&sides[at], &sides[at + 1], (size_t)(count - 1 - at) * sizeof sides[0]);
            at = --count;
        }
        (void)begin_side(view, wall, column, &sides[at]);
        (void)place(view, wall, kind, &sides[at]);
        sides[at].step = step;
        count++;
    }
    return count;
}

static bool is_as_wide(const side_t *left, const side_t *right, const upright_t *kind)
{
    const float metre_px = 0.5f * (left->metre_px + right->metre_px);
    const float width_m = (float)((right->column - left->column) * BSLAM_CELL_PX) / metre_px;
    return !(width_m < kind->width_min_m || width_m > kind->width_max_m);
}

static float least_of(const float values[3])
{
    const float two = values[0] < values[1] ? values[0] : values[1];
    return two < values[2] ? two : values[2];
}

static float most_of(const float values[3])
{
    const float two = values[0] > values[1] ? values[0] : values[1];
    return two > values[2] ? two : values[2];
}

/// The box round both sides.
static bslam_proposal_t box_of(const bslam_view_t *view, const side_t *left, const side_t *right,
                               int32_t kind)
{
    const int32_t columns = view->frame->columns;
    const bslam_real_t cell_px = BSLAM_CELL_PX, middle_px = BSLAM_R(1.5), edge_px = BSLAM_R(0.5);
    const int32_t first = (int32_t)(least_of(left->u_px) / BSLAM_CELL_PX);
    const int32_t last = (int32_t)(most_of(right->u_px) / BSLAM_CELL_PX);
    const int16_t from = (int16_t)(first < 0 ? 0 : first);
    const int16_t to = (int16_t)(last < columns - 1 ? last : columns - 1);
    const int16_t top = left->top < right->top ? left->top : right->top;
    const int16_t bottom = left->bottom > right->bottom ? left->bottom : right->bottom;
    const bslam_proposal_t proposal = {
        .left = from,
        .top = top,
        .right = (int16_t)(to + 1),
        .bottom = bottom,
        .cells = (uint16_t)((to + 1 - from) * (bottom - top)),
        .segmentation = (uint8_t)(BSLAM_SEGMENTATIONS + kind),
        .box = {(bslam_real_t)from * cell_px + middle_px, (bslam_real_t)top * cell_px - edge_px,
                (bslam_real_t)to * cell_px + middle_px, (bslam_real_t)bottom * cell_px - edge_px},
    };
    return proposal;
}

/// Pairs by rank: of two the one whose weaker side is stronger, of equals the one further right. A rank holds
/// that side's step and, in bits of INDEX_BITS each, both sides' places.
#define INDEX_BITS 5
#define INDEX_BELOW (1U << INDEX_BITS)
_Static_assert(SIDES_MAX <= 1 << INDEX_BITS, "a place fits its bits");

static uint32_t rank_of(const side_t *sides, int32_t left, int32_t right)
{
    const int32_t step = bslam_least(sides[left].step, sides[right].step);
    return ((uint32_t)step << INDEX_BITS | (uint32_t)left) << INDEX_BITS | (uint32_t)right;
}

/// Puts a rank above the last one where it belongs, and drops the last one.
static void put_rank(uint32_t *ranks, int32_t count, uint32_t rank)
{
    uint32_t *at = ranks + count - 1;
    for (; at != ranks && at[-1] < rank; at--) {
        *at = at[-1];
    }
    *at = rank;
}

/// The highest ranks of pairs as wide as the kind, in falling order; 0: there are no more.
static void rank_pairs(const side_t *sides, int32_t count, const upright_t *kind, uint32_t *ranks,
                       int32_t ranks_count)
{
    const uint32_t *last = ranks + ranks_count - 1;
    for (int32_t i = 0; i < count; i++) {
        for (int32_t k = i + 1; k < count; k++) {
            // Most are not among the highest, which shows without a division.
            const uint32_t rank = rank_of(sides, i, k);
            if (rank > *last && is_as_wide(&sides[i], &sides[k], kind)) {
                put_rank(ranks, ranks_count, rank);
            }
        }
    }
}

/// Proposes the best pairs of a kind's sides.
static void propose_pairs(bslam_proposals_t *proposals, const bslam_view_t *view, const side_t *sides,
                          int32_t count, int32_t kind)
{
    const int32_t boxes = shows_much(view) ? BOXES_MAX : BOXES_FEW;
    uint32_t ranks[BOXES_MAX] = {0};
    rank_pairs(sides, count, &uprights[kind], ranks, boxes);
    for (int32_t box = 0; box < boxes && ranks[box] != 0; box++) {
        const side_t *left = &sides[ranks[box] >> INDEX_BITS & (INDEX_BELOW - 1)];
        const side_t *right = &sides[ranks[box] & (INDEX_BELOW - 1)];
        const bslam_proposal_t proposal = box_of(view, left, right, kind);
        // Bent sides may meet, or leave the frame on the way.
        if (proposal.right - proposal.left >= SIDE_MIN && proposal.bottom - proposal.top >= SIDE_MIN) {
            bslam_proposals_add(proposals, view, &proposal);
        }
    }
}

/// The strongest side of less step than `limit` with which something that the frame cuts off at its left or
/// right edge could end; NULL if there is none.
static const side_t *end_of_cut(const bslam_view_t *view, const side_t *sides, int32_t count,
                                const upright_t *kind, bool left, float limit)
{
    const side_t *best = NULL;
    for (int32_t i = 0; i < count; i++) {
        const int32_t columns = left ? sides[i].column + 1 : view->frame->columns - sides[i].column;
        const float width_m = (float)(columns * BSLAM_CELL_PX) / sides[i].metre_px;
        const float step = (float)sides[i].step + 1e-3f * (float)i;  // of equals another one
        if (width_m > CUT_SHARE_MIN * kind->width_min_m && width_m < kind->width_max_m && step < limit &&
            (best == NULL || sides[i].step >= best->step)) {
            best = &sides[i];
        }
    }
    return best;
}

/// Proposes what the frame cuts off on the left or the right: one of its sides is the frame's edge.
static void propose_cut(bslam_proposals_t *proposals, const bslam_view_t *view, const side_t *sides,
                        int32_t count, int32_t kind, bool left)
{
    float limit = 1e9f;
    for (int32_t box = 0; box < CUT_BOXES_MAX; box++) {
        const side_t *end = end_of_cut(view, sides, count, &uprights[kind], left, limit);
        if (end == NULL) {
            return;
        }
        limit = (float)end->step + 1e-3f * (float)(end - sides);
        side_t edge = *end;
        edge.column = (int16_t)(left ? 0 : view->frame->columns - 1);
        edge.u_px[0] = edge.u_px[1] = edge.u_px[2] = (float)(edge.column * BSLAM_CELL_PX) + 1.5f;
        const bslam_proposal_t proposal =
            left ? box_of(view, &edge, end, kind) : box_of(view, end, &edge, kind);
        if (proposal.right - proposal.left >= SIDE_MIN && proposal.bottom - proposal.top >= SIDE_MIN) {
            bslam_proposals_add(proposals, view, &proposal);
        }
    }
}

/// Not to be inlined: each function has a kilobyte of stack at most.
__attribute__((noinline)) static void propose_kind(bslam_proposals_t *proposals, const bslam_view_t *view,
                                                   const wall_t *wall, const uint8_t *steps, int32_t kind)
{
    side_t sides[SIDES_MAX] = {0};
    const int32_t count = find_sides(view, wall, &uprights[kind], steps, sides);
    propose_pairs(proposals, view, sides, count, kind);
    propose_cut(proposals, view, sides, count, kind, true);
    propose_cut(proposals, view, sides, count, kind, false);
}

void bslam_vertical_edges_propose(bslam_proposals_t *proposals, const bslam_view_t *view,
                                  bslam_edge_steps_t *steps)
{
    wall_t wall;
    find_wall(view, &wall);
    find_steps(view, &wall, steps);
    for (int32_t kind = 0; kind < UPRIGHTS; kind++) {
        propose_kind(proposals, view, &wall, steps->of_kind[kind], kind);
    }
}
