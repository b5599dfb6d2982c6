#include "bslam/vision/uprights.h"

#include <string.h>

/// What is looked for: from and to this height above the floor, at least and at most so wide as it appears,
/// slanted by up to 60 degrees.
typedef struct upright {
    float bottom_m, top_m;
    float width_min_m, width_max_m;
} upright_t;

static const upright_t uprights[] = {
    {0.0f, 1.9f, 0.45f, 1.3f},     // doors, cabinets
    {0.1f, 0.7f, 0.40f, 1.7f},     // radiators
    {0.9f, 2.1f, 0.45f, 1.9f},     // windows
    {1.08f, 1.92f, 0.30f, 0.75f},  // posters
    {0.6f, 1.2f, 0.10f, 0.30f},    // extinguishers, which hang at any height
    {0.9f, 1.5f, 0.10f, 0.30f},
};
#define UPRIGHTS ((int32_t)(sizeof uprights / sizeof uprights[0]))

/// Sides of a kind in a frame, and boxes that come of them.
#define SIDES_MAX 14
#define BOXES_MAX 8
/// A side is one whose mean step is at least this, in quarters; a cell counts at most STEP_MAX.
#define STEP_MEAN_MIN (4 * 7)
#define STEP_MAX 60

/// A column where there may be a side: rows [top, bottom) of the kind there, pixels of a metre, mean step in
/// quarters.
typedef struct side {
    int16_t column, top, bottom;
    float metre_px;
    float step;
} side_t;

/// Mean of the sideways steps in a column between two rows, in quarters.
static uint8_t mean_step(const bslam_view_t *view, int32_t column, int32_t top, int32_t bottom)
{
    const int32_t columns = view->frame->columns;
    int32_t sum = 0;
    for (int32_t row = top; row < bottom; row++) {
        const int32_t step = view->step_x[row * columns + column];
        sum += step < STEP_MAX ? step : STEP_MAX;
    }
    return (uint8_t)(4 * sum / (bottom - top));
}

/// Where the kind would stand in a column. False: it would leave the frame, or the floor line is not known.
static bool place(const bslam_view_t *view, const upright_t *kind, int32_t column, side_t *side)
{
    const float camera_m = (float)view->camera->z_m;
    const float horizon_px = (float)bslam_horizon_px(view->camera);
    const float below_px = (float)view->floor_line->edge_px[column] - horizon_px;
    if (!(view->floor_line->distance_m[column] > 0) || below_px < 4.0f) {
        return false;
    }
    const float metre_px = below_px / camera_m;
    const float top_px = horizon_px - metre_px * (kind->top_m - camera_m);
    const float bottom_px = horizon_px - metre_px * (kind->bottom_m - camera_m);
    if (top_px < -2.0f || bottom_px > (float)view->frame->height_px) {
        return false;
    }
    side->column = (int16_t)column;
    side->top = (int16_t)(top_px < 0 ? 0 : top_px / BSLAM_CELL_PX);
    side->bottom = (int16_t)(bottom_px / BSLAM_CELL_PX + 0.5f);
    side->bottom = side->bottom > view->frame->rows ? (int16_t)view->frame->rows : side->bottom;
    side->metre_px = metre_px;
    return side->bottom - side->top >= 2;
}

/// The strongest sides of a kind, at most SIDES_MAX, in order of columns.
static int32_t find_sides(const bslam_view_t *view, const upright_t *kind, side_t sides[SIDES_MAX])
{
    uint8_t steps[BSLAM_COLUMNS_MAX];
    const int32_t columns = view->frame->columns;
    side_t side = {0};
    for (int32_t column = 0; column < columns; column++) {
        const bool stands = place(view, kind, column, &side);
        steps[column] = stands ? mean_step(view, column, side.top, side.bottom) : 0;
    }
    int32_t count = 0;
    for (int32_t column = 1; column + 1 < columns; column++) {
        const uint8_t step = steps[column];
        if (step < STEP_MEAN_MIN || step < steps[column - 1] || step <= steps[column + 1]) {
            continue;
        }
        int32_t at = count;
        if (count == SIDES_MAX) {
            for (int32_t i = 0; i < count; i++) {
                at = at == SIDES_MAX || sides[i].step < sides[at].step ? i : at;
            }
            if (sides[at].step >= (float)step) {
                continue;
            }
            memmove(&sides[at], &sides[at + 1], (size_t)(count - 1 - at) * sizeof sides[0]);
            at = --count;
        }
        (void)place(view, kind, column, &sides[at]);
        sides[at].step = (float)step;
        count++;
    }
    return count;
}

static float pair_score(const side_t *left, const side_t *right, const upright_t *kind)
{
    const float metre_px = 0.5f * (left->metre_px + right->metre_px);
    const float width_m = (float)((right->column - left->column) * BSLAM_CELL_PX) / metre_px;
    if (width_m < kind->width_min_m || width_m > kind->width_max_m) {
        return 0;
    }
    return left->step < right->step ? left->step : right->step;
}

static bslam_proposal_t box_of(const side_t *left, const side_t *right, int32_t kind)
{
    const bslam_real_t cell_px = BSLAM_CELL_PX, middle_px = BSLAM_R(1.5), edge_px = BSLAM_R(0.5);
    const int16_t top = left->top < right->top ? left->top : right->top;
    const int16_t bottom = left->bottom > right->bottom ? left->bottom : right->bottom;
    const bslam_proposal_t proposal = {
        .left = left->column,
        .top = top,
        .right = (int16_t)(right->column + 1),
        .bottom = bottom,
        .cells = (uint16_t)((right->column + 1 - left->column) * (bottom - top)),
        .segmentation = (uint8_t)(BSLAM_SEGMENTATIONS + kind),
        .box = {(bslam_real_t)left->column * cell_px + middle_px, (bslam_real_t)top * cell_px - edge_px,
                (bslam_real_t)right->column * cell_px + middle_px, (bslam_real_t)bottom * cell_px - edge_px},
    };
    return proposal;
}

/// Proposes the best pairs of a kind's sides.
static void propose_pairs(bslam_proposals_t *proposals, const bslam_view_t *view, const side_t *sides,
                          int32_t count, int32_t kind)
{
    float limit = 1e9f;
    for (int32_t box = 0; box < BOXES_MAX; box++) {
        float best = 0;
        int32_t best_left = 0, best_right = 0;
        for (int32_t i = 0; i < count; i++) {
            for (int32_t k = i + 1; k < count; k++) {
                // Sums of all columns break ties between pairs that share their weaker side.
                const float tie = 1e-3f * (float)(i * SIDES_MAX + k);
                const float pair = pair_score(&sides[i], &sides[k], &uprights[kind]);
                const float score = pair > 0 ? pair + tie : 0;
                if (score > best && score < limit) {
                    best = score;
                    best_left = i;
                    best_right = k;
                }
            }
        }
        if (!(best > 0)) {
            return;
        }
        limit = best;
        const bslam_proposal_t proposal = box_of(&sides[best_left], &sides[best_right], kind);
        bslam_proposals_add(proposals, view, &proposal);
    }
}

void bslam_uprights_propose(bslam_proposals_t *proposals, const bslam_view_t *view)
{
    for (int32_t kind = 0; kind < UPRIGHTS; kind++) {
        side_t sides[SIDES_MAX] = {0};
        const int32_t count = find_sides(view, &uprights[kind], sides);
        propose_pairs(proposals, view, sides, count, kind);
    }
}
