#include "vision/built_in/detection/box_refinement.h"

#include <string.h>

#include "base/bounds.h"
#include "vision/pixels/bytes.h"

/// Lines of cells about a side, in their order from inside: the side's own, those that it may snap to, one on
/// either side of each.
enum { SNAP_LINES = 5, OWN = 2, INNER = OWN - 1, OUTER = OWN + 1 };

/// What a step leaves free up to the largest byte: where it is added, sums stop at the limit, so much higher.
#define FREE (255 - BSLAM_EDGE_STEP_MAX)
#define ALL_FREE (FREE * 0x01010101U)

/// Columns of cells summed at a time.
enum { COLUMNS_AT_ONCE = BSLAM_WORD_BYTES };

/// Sums down the columns, each step limited.
static void sum_down(const uint8_t *steps, int32_t columns, int32_t rows, uint16_t sums[COLUMNS_AT_ONCE])
{
    uint32_t even = 0, odd = 0;
    int32_t left = rows;
    for (; left > 1; left -= 2, steps += 2 * columns) {
        const uint32_t four = bslam_bytes_plus(bslam_word_at(steps), ALL_FREE);
        const uint32_t below = bslam_bytes_plus(bslam_word_at(steps + columns), ALL_FREE);
        even = bslam_bytes_add_even(bslam_bytes_add_even(even, four), below);
        odd = bslam_bytes_add_odd(bslam_bytes_add_odd(odd, four), below);
    }
    if (left > 0) {
        const uint32_t four = bslam_bytes_plus(bslam_word_at(steps), ALL_FREE);
        even = bslam_bytes_add_even(even, four);
        odd = bslam_bytes_add_odd(odd, four);
    }
    for (int32_t k = 0; k < COLUMNS_AT_ONCE; k++) {
        const uint32_t halves = k % 2 == 0 ? even : odd;
        sums[k] = (uint16_t)((k < 2 ? halves : halves >> 16) - (uint32_t)(FREE * rows));
    }
}

static uint16_t sum_row(const uint8_t *steps, int32_t count)
{
    const int32_t rest = count & (BSLAM_WORD_BYTES - 1);
    const uint8_t *last = steps + count - rest;
    uint32_t sum = 0;
    for (; steps != last; steps += BSLAM_WORD_BYTES) {
        sum = bslam_bytes_sum(bslam_bytes_plus(bslam_word_at(steps), ALL_FREE), sum);
    }
    if (rest > 0) {
        const uint32_t mask = (1U << 8 * rest) - 1;
        sum = bslam_bytes_sum(bslam_bytes_plus(bslam_word_at(steps), ALL_FREE) & mask, sum);
    }
    return (uint16_t)(sum - (uint32_t)(FREE * count));
}

/// A side of a box, and the sums of the steps along the lines of cells about it, as far as they were asked
/// for; 0 outside the frame.
typedef struct near {
    const bslam_view_t *view;
    const bslam_proposal_t *box;
    int32_t line;     ///< the side's own
    int32_t outside;  ///< 1 or -1: where the next line outside is
    bool is_upright;
    int32_t cells;  ///< of a line
    int32_t sums[SNAP_LINES];
} near_t;

static int32_t line_of(const near_t *near, int32_t i)
{
    return near->line + near->outside * (i - OWN);
}

static bool is_in_frame(const near_t *near, int32_t i)
{
    const bslam_frame_t *frame = near->view->frame;
    const int32_t line = line_of(near, i);
    return line >= 0 && line < (near->is_upright ? frame->columns : frame->rows);
}

/// Fills in lines [first, first + 4) of an upright side; what a sum takes from beyond the frame is not read.
static void fill_columns(near_t *near, int32_t first)
{
    const bslam_proposal_t *box = near->box;
    const int32_t columns = near->view->frame->columns;
    const int32_t lowest = line_of(near, near->outside > 0 ? first : first + 3);
    const int32_t start = lowest > 0 ? lowest : 0;
    uint16_t sums[COLUMNS_AT_ONCE];
    sum_down(near->view->step_x + box->top * columns + start, columns, near->cells, sums);
    const bool are_in_frame = lowest >= 0 && lowest + 3 < near->view->frame->columns;
    int32_t at = line_of(near, first) - start;
    for (int32_t i = first; i < first + 4; i++, at += near->outside) {
        near->sums[i] = are_in_frame || is_in_frame(near, i) ? sums[at] : 0;
    }
}

/// Fills in lines [first, last] of a level side.
static void fill_rows(near_t *near, int32_t first, int32_t last)
{
    const int32_t columns = near->view->frame->columns;
    const uint8_t *step_y = near->view->step_y + near->box->left;
    for (int32_t i = first; i <= last; i++) {
        near->sums[i] = is_in_frame(near, i) ? sum_row(step_y + line_of(near, i) * columns, near->cells) : 0;
    }
}

/// Fills in a line beyond those next to the side's own. Of an upright side four columns cost as much as one,
/// and the innermost is seldom asked for.
static void fill_beyond(near_t *near, int32_t i)
{
    if (!near->is_upright) {
        fill_rows(near, i, i);
    } else if (i == 0) {
        fill_columns(near, 0);
    }
}

/// Where an edge lies between the cells `line` - 1 and `line` + 1, in cells from `line`: the top of a
/// parabola.
static float peak_of(float before, float here, float after)
{
    const float bend = 2 * here - before - after;
    const float shift = bend > 1e-3f ? 0.5f * (after - before) / bend : 0.0f;
    return shift < -0.5f ? -0.5f : shift > 0.5f ? 0.5f : shift;
}

/// The line of cells that the side snaps to. *shift is where in it, in cells.
static int32_t snap_side(const bslam_view_t *view, const bslam_proposal_t *box, bslam_box_side_t side,
                         int32_t line, float *shift)
{
    near_t near = {.view = view, .box = box, .line = line};
    near.outside = side == BSLAM_BOX_LEFT || side == BSLAM_BOX_TOP ? -1 : 1;
    near.is_upright = side == BSLAM_BOX_LEFT || side == BSLAM_BOX_RIGHT;
    near.cells = near.is_upright ? box->bottom - box->top : box->right - box->left;
    if (near.is_upright) {
        fill_columns(&near, INNER);
    } else {
        fill_rows(&near, INNER, OUTER);
    }
    const int32_t *sums = near.sums;
    int32_t best = sums[OUTER] > sums[OWN] ? OUTER : OWN;
    if (sums[best] < BSLAM_EDGE_STEP_MIN * near.cells && sums[INNER] > sums[best]) {
        best = INNER;
    }
    if (best != OWN) {
        fill_beyond(&near, best + best - OWN);
    }
    const float cells = (float)near.cells;
    *shift = peak_of((float)sums[best - near.outside] / cells, (float)sums[best] / cells,
                     (float)sums[best + near.outside] / cells);
    return line_of(&near, best);
}

bslam_proposal_t bslam_box_refined(const bslam_view_t *view, const bslam_proposal_t *rough)
{
    const int32_t lines[BSLAM_BOX_SIDES] = {rough->left, rough->right - 1, rough->top, rough->bottom - 1};
    const int32_t ends[BSLAM_BOX_SIDES] = {view->frame->columns, view->frame->columns, view->frame->rows,
                                           view->frame->rows};
    int32_t cells[BSLAM_BOX_SIDES];
    bslam_real_t edges_px[BSLAM_BOX_SIDES];
    for (int32_t side = 0; side < BSLAM_BOX_SIDES; side++) {
        float shift = 0;
        const int32_t line = snap_side(view, rough, (bslam_box_side_t)side, lines[side], &shift);
        cells[side] = bslam_clamp(line, 0, ends[side] - 1);
        edges_px[side] = ((bslam_real_t)cells[side] + (bslam_real_t)shift) * BSLAM_CELL_PX + BSLAM_R(1.5);
    }
    bslam_proposal_t box = *rough;
    if (cells[BSLAM_BOX_RIGHT] <= cells[BSLAM_BOX_LEFT] || cells[BSLAM_BOX_BOTTOM] <= cells[BSLAM_BOX_TOP]) {
        return box;
    }
    box.left = (int16_t)cells[BSLAM_BOX_LEFT];
    box.right = (int16_t)(cells[BSLAM_BOX_RIGHT] + 1);
    box.top = (int16_t)cells[BSLAM_BOX_TOP];
    box.bottom = (int16_t)(cells[BSLAM_BOX_BOTTOM] + 1);
    box.box = (bslam_box_t){edges_px[BSLAM_BOX_LEFT], edges_px[BSLAM_BOX_TOP], edges_px[BSLAM_BOX_RIGHT],
                            edges_px[BSLAM_BOX_BOTTOM]};
    return box;
}
