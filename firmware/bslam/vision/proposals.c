#include "bslam/vision/proposals.h"

#include <stddef.h>
#include <string.h>

#include "bslam/math/bytes.h"
#include "bslam/vision/snap.h"

/// What cells a segmentation joins.
typedef enum source {
    LIKELY,   ///< those whose value is above the level
    SMOOTH,   ///< those near which the colour steps by at most the level: faces of one colour
    STANDING  ///< all but smooth faces that are large or leave the frame: what stands before walls and floor
} source_t;

/// One segmentation. `shrink`: cells at the edge of what the source gives are left out first, which cuts
/// bridges. `grow`: cells that a box gains on each side, because shrinking or the step took them away.
typedef struct pass {
    source_t source;
    int16_t level;
    bool shrink;
    uint8_t grow;
    bool again;  ///< the mask is that of the first pass, which no other one writes to
} pass_t;

static const pass_t passes[] = {
    {LIKELY, 0, false, 0, false},
    {LIKELY, 24, false, 0, false},
    {LIKELY, 0, true, 1, true},
    {STANDING, 40, true, 1, false},
};
#define PASSES ((int32_t)(sizeof passes / sizeof passes[0]))
_Static_assert(sizeof passes / sizeof passes[0] == BSLAM_SEGMENTATIONS, "one number a segmentation");
/// A smooth face larger than this part of the frame is no beacon's.
#define FACE_MAX_PERCENT 10

/// A component is a proposal from this many cells on, and this many rows and columns.
#define CELLS_MIN 1
#define FACE_CELLS_MIN 6
#define SIDE_MIN 2
/// Wider than this part of the frame, it is a wall.
#define SIDE_MAX_PERCENT 75
#define SNAP_SIDE_MIN 6
/// How often a box is snapped: a side may move by so many cells.
#define SNAPS 2
/// Boxes that overlap more than this are the same.
#define SAME_OVERLAP BSLAM_R(0.85)
#define SAME_SIDES BSLAM_R(0.2)  // above .15 / .85, with room for rounding

static int32_t least(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static int32_t most(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

static int32_t root_of(bslam_run_t *runs, int32_t run)
{
    while (runs[run].parent != run) {
        runs[run].parent = runs[runs[run].parent].parent;  // halves the path
        run = runs[run].parent;
    }
    return run;
}

static void join(bslam_run_t *runs, int32_t a, int32_t b)
{
    const int32_t root_a = root_of(runs, a), root_b = root_of(runs, b);
    if (root_a == root_b) {
        return;
    }
    bslam_run_t *into = &runs[least(root_a, root_b)];
    bslam_run_t *from = &runs[most(root_a, root_b)];
    from->parent = (uint16_t)least(root_a, root_b);
    into->left = (uint8_t)least(into->left, from->left);
    into->top = (uint8_t)least(into->top, from->top);
    into->right = (uint8_t)most(into->right, from->right);
    into->bottom = (uint8_t)most(into->bottom, from->bottom);
    into->cells = (uint16_t)(into->cells + from->cells);
}

// A mask has a bit a cell: rows of whole words, the first cell in the lowest bit, none set behind the last.

/// Words of a row.
static int32_t words_of(int32_t columns)
{
    return (columns + BSLAM_MASK_BITS - 1) / BSLAM_MASK_BITS;
}

/// The bits of a row's last word that stand for cells.
static uint32_t last_bits(int32_t columns)
{
    return ~0U >> (-columns & (BSLAM_MASK_BITS - 1));
}

/// The first cell from `column` on that is in the mask, `flip` 0, or that is not, `flip` all ones; `columns`
/// if there is none.
static int32_t next_cell(const uint32_t *mask, int32_t column, int32_t columns, uint32_t flip)
{
    while (column < columns) {
        const uint32_t bits = (mask[column / BSLAM_MASK_BITS] ^ flip) >> column % BSLAM_MASK_BITS;
        if (bits != 0) {
            const int32_t found = column + __builtin_ctz(bits);
            return found < columns ? found : columns;
        }
        column = (column | (BSLAM_MASK_BITS - 1)) + 1;
    }
    return columns;
}

/// Appends the runs of a row; returns how many runs there are then.
static int32_t find_runs(bslam_proposals_t *proposals, const uint32_t *mask, int32_t columns, int32_t row,
                         int32_t count)
{
    int32_t end = 0;
    for (;;) {
        const int32_t first = next_cell(mask, end, columns, 0);
        if (first == columns) {
            return count;
        }
        end = next_cell(mask, first, columns, ~0U);
        if (count == BSLAM_RUNS_MAX) {
            proposals->runs_dropped++;
            continue;
        }
        proposals->runs[count] = (bslam_run_t){
            .parent = (uint16_t)count,
            .cells = (uint16_t)(end - first),
            .row = (uint8_t)row,
            .first = (uint8_t)first,
            .end = (uint8_t)end,
            .left = (uint8_t)first,
            .top = (uint8_t)row,
            .right = (uint8_t)end,
            .bottom = (uint8_t)(row + 1),
        };
        count++;
    }
}

/// Joins the runs [middle, end) of a row with the runs [begin, middle) of the row above.
static void join_rows(bslam_run_t *runs, int32_t begin, int32_t middle, int32_t end)
{
    int32_t above = begin, here = middle;
    while (above < middle && here < end) {
        if (runs[above].first < runs[here].end && runs[here].first < runs[above].end) {
            join(runs, above, here);
        }
        if (runs[above].end < runs[here].end) {
            above++;
        } else {
            here++;
        }
    }
}

bslam_real_t bslam_box_overlap(const bslam_box_t *a, const bslam_box_t *b)
{
    const bslam_real_t left = a->left_px > b->left_px ? a->left_px : b->left_px;
    const bslam_real_t right = a->right_px < b->right_px ? a->right_px : b->right_px;
    const bslam_real_t top = a->top_px > b->top_px ? a->top_px : b->top_px;
    const bslam_real_t bottom = a->bottom_px < b->bottom_px ? a->bottom_px : b->bottom_px;
    if (left >= right || top >= bottom) {
        return 0;
    }
    const bslam_real_t both = (right - left) * (bottom - top);
    const bslam_real_t area_a = (a->right_px - a->left_px) * (a->bottom_px - a->top_px);
    const bslam_real_t area_b = (b->right_px - b->left_px) * (b->bottom_px - b->top_px);
    return both / (area_a + area_b - both);
}

/// Boxes the same to SAME_OVERLAP have each side within .15 / .85 of the box's width or height: those that
/// have not need no division.
static bool is_known(const bslam_proposals_t *proposals, const bslam_box_t *box)
{
    const bslam_real_t off_x = SAME_SIDES * (box->right_px - box->left_px);
    const bslam_real_t off_y = SAME_SIDES * (box->bottom_px - box->top_px);
    for (int32_t i = 0; i < proposals->count; i++) {
        const bslam_box_t *known = &proposals->items[i].box;
        if (bslam_abs(known->left_px - box->left_px) <= off_x &&
            bslam_abs(known->top_px - box->top_px) <= off_y &&
            bslam_abs(known->right_px - box->right_px) <= off_x &&
            bslam_box_overlap(known, box) > SAME_OVERLAP) {
            return true;
        }
    }
    return false;
}

bslam_edge_t bslam_edge_along(const bslam_view_t *view, const bslam_proposal_t *box, bslam_side_t side,
                              int32_t line)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    const bool upright = side == BSLAM_SIDE_LEFT || side == BSLAM_SIDE_RIGHT;
    const int32_t first = upright ? box->top : box->left, end = upright ? box->bottom : box->right;
    bslam_edge_t edge = {0, 0};
    if (line < 0 || line >= (upright ? columns : rows) || first >= end) {
        return edge;
    }
    const uint8_t *step =
        upright ? view->step_x + first * columns + line : view->step_y + line * columns + first;
    const int32_t stride = upright ? columns : 1;
    int32_t sum = 0, clear = 0;
    for (int32_t i = 0; i < end - first; i++) {
        const int32_t here = step[i * stride];
        sum += least(here, BSLAM_EDGE_STEP_MAX);
        clear += here > BSLAM_EDGE_STEP_MIN ? 1 : 0;
    }
    edge.step = (float)sum / (float)(end - first);
    edge.share = (float)clear / (float)(end - first);
    return edge;
}

void bslam_proposals_add(bslam_proposals_t *proposals, const bslam_view_t *view,
                         const bslam_proposal_t *proposal)
{
    // In a small box a side would snap to the opposite one.
    const bool small =
        proposal->right - proposal->left < SNAP_SIDE_MIN || proposal->bottom - proposal->top < SNAP_SIDE_MIN;
    bslam_proposal_t box = *proposal;
    bool moves = !small;
    for (int32_t i = 0; i < SNAPS && moves; i++) {
        const bslam_proposal_t before = box;
        box = bslam_snapped(view, &before);
        moves = box.left != before.left || box.top != before.top || box.right != before.right ||
                box.bottom != before.bottom;
    }
    if (is_known(proposals, &box.box)) {
        return;
    }
    if (proposals->count == BSLAM_PROPOSALS_MAX) {
        proposals->boxes_dropped++;
        return;
    }
    proposals->items[proposals->count++] = box;
}

static void propose(bslam_proposals_t *proposals, const bslam_view_t *view, const bslam_run_t *root,
                    int32_t pass)
{
    const bslam_frame_t *frame = view->frame;
    const int32_t grow = passes[pass].grow;
    const int32_t left = most(root->left - grow, 0), right = least(root->right + grow, frame->columns);
    const int32_t top = most(root->top - grow, 0), bottom = least(root->bottom + grow, frame->rows);
    const int32_t cells_min = passes[pass].source == SMOOTH ? FACE_CELLS_MIN : CELLS_MIN;
    if (root->cells < cells_min || right - left < SIDE_MIN || bottom - top < SIDE_MIN ||
        right - left > frame->columns * SIDE_MAX_PERCENT / 100) {
        return;
    }
    const bslam_real_t cell_px = BSLAM_CELL_PX, edge_px = BSLAM_R(0.5);
    const bslam_proposal_t proposal = {
        .left = (int16_t)left,
        .top = (int16_t)top,
        .right = (int16_t)right,
        .bottom = (int16_t)bottom,
        .cells = root->cells,
        .segmentation = (uint8_t)pass,
        .box = {(bslam_real_t)left * cell_px - edge_px, (bslam_real_t)top * cell_px - edge_px,
                (bslam_real_t)right * cell_px - edge_px, (bslam_real_t)bottom * cell_px - edge_px},
    };
    bslam_proposals_add(proposals, view, &proposal);
}

/// Finds the components of the mask; returns how many runs they have.
static int32_t find_components(bslam_proposals_t *proposals, const bslam_frame_t *frame)
{
    int32_t begin = 0, middle = 0;
    for (int32_t row = 0; row < frame->rows; row++) {
        const uint32_t *mask = proposals->mask + row * words_of(frame->columns);
        const int32_t end = find_runs(proposals, mask, frame->columns, row, middle);
        join_rows(proposals->runs, begin, middle, end);
        begin = middle;
        middle = end;
    }
    return middle;
}

static void propose_components(bslam_proposals_t *proposals, const bslam_view_t *view, int32_t runs,
                               int32_t pass)
{
    for (int32_t run = 0; run < runs; run++) {
        if (proposals->runs[run].parent == run) {
            propose(proposals, view, &proposals->runs[run], pass);
        }
    }
}

#define ALL_FOUR 0x01010101U

/// Four cells of which each byte says 0 or 1, as four bits.
static uint32_t four_bits(uint32_t bytes)
{
    return (bytes * 0x01020408U) >> 24;
}

/// Bits of cells side by side, one word of them at most, whose value is above the level, which `limit` has
/// 128 more in each byte.
static uint32_t likely_bits(const int8_t *values, int32_t count, uint32_t limit)
{
    uint32_t bits = 0;
    for (int32_t k = 0; k < count; k += BSLAM_WORD_BYTES) {
        bits |= four_bits(bslam_bytes_above(bslam_word_at(values + k) ^ BSLAM_TOP_BITS, limit)) << k;
    }
    return bits;
}

/// Of those near which the colour steps by no more than `limit` has in each byte.
static uint32_t smooth_bits(const uint8_t *step_x, const uint8_t *step_y, int32_t count, uint32_t limit)
{
    uint32_t bits = 0;
    for (int32_t k = 0; k < count; k += BSLAM_WORD_BYTES) {
        const uint32_t beyond = bslam_bytes_less(bslam_word_at(step_x + k), limit) |
                                bslam_bytes_less(bslam_word_at(step_y + k), limit);
        bits |= four_bits(bslam_bytes_above(ALL_FOUR, beyond)) << k;
    }
    return bits;
}

/// The mask of a source. Words of cells go beyond a row's end, whose bits are then left out; tables have
/// room.
static void fill_mask(uint32_t *mask, const bslam_view_t *view, source_t source, int32_t level)
{
    const int32_t columns = view->frame->columns, cells = columns * view->frame->rows;
    const uint32_t limit = (uint32_t)(source == LIKELY ? level + 128 : level) * ALL_FOUR;
    for (int32_t first = 0; first < cells; first += columns) {
        for (int32_t start = 0; start < columns; start += BSLAM_MASK_BITS) {
            const int32_t count = least(columns - start, BSLAM_MASK_BITS), i = first + start;
            const uint32_t bits = source == LIKELY
                                      ? likely_bits(view->values + i, count, limit)
                                      : smooth_bits(view->step_x + i, view->step_y + i, count, limit);
            *mask++ = count < BSLAM_MASK_BITS ? bits & last_bits(columns) : bits;
        }
    }
}

static bool is_room(const bslam_run_t *face, const bslam_frame_t *frame)
{
    const bool leaves =
        face->left == 0 || face->top == 0 || face->right == frame->columns || face->bottom == frame->rows;
    return leaves || face->cells > frame->columns * frame->rows * FACE_MAX_PERCENT / 100;
}

/// Takes the cells [first, end) of a row out of its mask.
static void clear_cells(uint32_t *mask, int32_t first, int32_t end)
{
    for (int32_t word = first / BSLAM_MASK_BITS; word * BSLAM_MASK_BITS < end; word++) {
        const int32_t start = word * BSLAM_MASK_BITS;
        const uint32_t from = first > start ? ~0U << (first - start) : ~0U;
        const uint32_t to = end - start < BSLAM_MASK_BITS ? ~(~0U << (end - start)) : ~0U;
        mask[word] &= ~(from & to);
    }
}

/// From the components of the smooth cells: all that is not a face of the room, nor below the floor line.
static void mask_standing(bslam_proposals_t *proposals, const bslam_view_t *view, int32_t runs)
{
    const bslam_frame_t *frame = view->frame;
    const int32_t words = words_of(frame->columns);
    uint32_t *mask = proposals->mask;
    for (int32_t i = 0; i < frame->rows * words; i++) {
        mask[i] = (i + 1) % words == 0 ? last_bits(frame->columns) : ~0U;
    }
    for (int32_t i = 0; i < runs; i++) {
        const bslam_run_t *run = &proposals->runs[i];
        if (is_room(&proposals->runs[root_of(proposals->runs, i)], frame)) {
            clear_cells(mask + run->row * words, run->first, run->end);
        }
    }
    for (int32_t column = 0; column < frame->columns; column++) {
        const uint32_t others = ~(1U << column % BSLAM_MASK_BITS);
        uint32_t *bits = mask + column / BSLAM_MASK_BITS;
        for (int32_t row = view->floor_line->row[column] + 2; row < frame->rows; row++) {
            bits[row * words] &= others;
        }
    }
}

/// Leaves only the cells whose eight neighbours are in the mask too: columns, then rows.
static void shrink_mask(uint32_t *mask, int32_t columns, int32_t rows)
{
    enum { WORDS = (BSLAM_COLUMNS_MAX + BSLAM_MASK_BITS - 1) / BSLAM_MASK_BITS };
    const int32_t words = words_of(columns);
    uint32_t above[WORDS] = {0}, upright[1 + WORDS + 1] = {0};  // nothing on either side
    for (int32_t row = 0; row < rows; row++, mask += words) {
        for (int32_t i = 0; i < words; i++) {
            const uint32_t here = mask[i], below = row + 1 < rows ? mask[words + i] : 0;
            upright[1 + i] = above[i] & here & below;
            above[i] = here;
        }
        for (int32_t i = 0; i < words; i++) {
            const uint32_t *three = upright + i;
            const uint32_t before = three[1] << 1 | three[0] >> (BSLAM_MASK_BITS - 1);
            const uint32_t after = three[1] >> 1 | three[2] << (BSLAM_MASK_BITS - 1);
            mask[i] = three[1] & before & after;
        }
    }
}

static void segment(bslam_proposals_t *proposals, const bslam_view_t *view, int32_t pass)
{
    const pass_t *p = &passes[pass];
    const bslam_frame_t *frame = view->frame;
    if (!p->again) {
        fill_mask(proposals->mask, view, p->source, p->level);
    }
    if (p->source == STANDING) {
        mask_standing(proposals, view, find_components(proposals, frame));
    }
    if (p->shrink) {
        shrink_mask(proposals->mask, frame->columns, frame->rows);
    }
    propose_components(proposals, view, find_components(proposals, frame), pass);
}

void bslam_proposals_find(bslam_proposals_t *proposals, const bslam_view_t *view, bslam_run_t *runs,
                          uint32_t *mask)
{
    proposals->count = 0;
    proposals->runs = runs;
    for (int32_t pass = 0; pass < PASSES; pass++) {
        proposals->mask = pass == 0 || passes[pass].again ? mask : mask + BSLAM_MASK_WORDS;
        segment(proposals, view, pass);
    }
    proposals->runs = NULL;
    proposals->mask = NULL;
}
