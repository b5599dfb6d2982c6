#include "vision/built_in/detection/proposals.h"

#include <stddef.h>
#include <string.h>

#include "base/bounds.h"
#include "vision/pixels/bytes.h"
#include "vision/built_in/detection/box_refinement.h"
#include "vision/built_in/detection/steps.h"

/// What cells a segmentation joins.
typedef enum source {
    LIKELY,   ///< those whose value is above the level
    SMOOTH,   ///< those near which the colour steps by at most the level: faces of one colour
    BRIGHT,   ///< those whose light is above the level, a tone's: what light from outside has washed out
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
    {LIKELY, 0, false, 0, false},   {LIKELY, 24, false, 0, false},  {LIKELY, 0, true, 1, true},
    {STANDING, 40, true, 1, false}, {BRIGHT, 185, false, 0, false},
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

// An extent holds left, top and how far right and bottom are from 255, a byte each: what two have together is
// the least of each.
enum { LEFT, TOP, RIGHT, BOTTOM };

static uint32_t extent_of(int32_t left, int32_t top, int32_t right, int32_t bottom)
{
    return (uint32_t)(left | top << 8 | (255 - right) << 16) | (uint32_t)(255 - bottom) << 24;
}

static int32_t side_of(uint32_t extent, int32_t side)
{
    const int32_t at = bslam_byte_of(extent, side);
    return side < RIGHT ? at : 255 - at;
}

static bslam_run_t *root_of(bslam_run_t *runs, bslam_run_t *run)
{
    bslam_run_t *parent = &runs[run->parent];
    while (parent != run) {
        run->parent = parent->parent;  // halves the path
        run = &runs[run->parent];
        parent = &runs[run->parent];
    }
    return run;
}

static void join(bslam_run_t *runs, bslam_run_t *a, bslam_run_t *b)
{
    bslam_run_t *root_a = root_of(runs, a), *root_b = root_of(runs, b);
    if (root_a == root_b) {
        return;
    }
    bslam_run_t *into = root_a < root_b ? root_a : root_b;
    bslam_run_t *from = root_a < root_b ? root_b : root_a;
    from->parent = into->parent;
    into->extent = bslam_bytes_least(into->extent, from->extent);
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

/// Appends the run [first, end) of a row, if there is room; returns how many runs there are then.
static int32_t add_run(bslam_proposals_t *proposals, int32_t row, int32_t first, int32_t end, int32_t count)
{
    if (count == BSLAM_RUNS_MAX) {
        proposals->runs_dropped++;
        return count;
    }
    proposals->runs[count] = (bslam_run_t){
        .parent = (uint16_t)count,
        .cells = (uint16_t)(end - first),
        .row = (uint8_t)row,
        .first = (uint8_t)first,
        .end = (uint8_t)end,
        .extent = extent_of(first, row, end, row + 1),
    };
    return count + 1;
}

/// Appends the runs of a row, whose mask has so many words; returns how many runs there are then.
static int32_t find_runs(bslam_proposals_t *proposals, const uint32_t *mask, int32_t words, int32_t row,
                         int32_t count)
{
    const int32_t columns =
        words * BSLAM_MASK_BITS;  // with those behind the row's last, of which none is set
    uint32_t before = 0;
    int32_t first = -1;
    for (int32_t start = 0; start < columns; start += BSLAM_MASK_BITS) {
        const uint32_t cells = *mask++;
        // Where a cell is not as the one on its left.
        uint32_t changes = cells ^ (cells << 1 | before >> (BSLAM_MASK_BITS - 1));
        before = cells;
        for (; changes != 0; changes &= changes - 1) {
            const int32_t column = start + __builtin_ctz(changes);
            count = first < 0 ? count : add_run(proposals, row, first, column, count);
            first = first < 0 ? column : -1;
        }
    }
    return first < 0 ? count : add_run(proposals, row, first, columns, count);
}

/// Joins the runs [middle, end) of a row with the runs [begin, middle) of the row above.
static void join_rows(bslam_run_t *runs, int32_t begin, int32_t middle, int32_t end)
{
    bslam_run_t *above = runs + begin, *here = runs + middle;
    const bslam_run_t *above_end = here, *here_end = runs + end;
    while (above < above_end && here < here_end) {
        if (above->first < here->end && here->first < above->end) {
            join(runs, above, here);
        }
        if (above->end < here->end) {
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

static bool is_within(bslam_real_t a, bslam_real_t b, bslam_real_t most_apart)
{
    const bslam_real_t apart = a - b;
    return apart <= most_apart && apart >= -most_apart;
}

/// Boxes the same to SAME_OVERLAP have each side within .15 / .85 of the box's width or height: those that
/// have not need no division.
static bool is_known(const bslam_proposals_t *proposals, const bslam_box_t *box)
{
    const bslam_real_t off_x = SAME_SIDES * (box->right_px - box->left_px);
    const bslam_real_t off_y = SAME_SIDES * (box->bottom_px - box->top_px);
    const bslam_proposal_t *end = proposals->items + proposals->count;
    for (const bslam_proposal_t *item = proposals->items; item != end; item++) {
        const bslam_box_t *known = &item->box;
        if (is_within(known->left_px, box->left_px, off_x) && is_within(known->top_px, box->top_px, off_y) &&
            is_within(known->right_px, box->right_px, off_x) &&
            bslam_box_overlap(known, box) > SAME_OVERLAP) {
            return true;
        }
    }
    return false;
}

bslam_cell_edge_t bslam_edge_along(const bslam_view_t *view, const bslam_proposal_t *box,
                                   bslam_box_side_t side, int32_t line)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    const bool upright = side == BSLAM_BOX_LEFT || side == BSLAM_BOX_RIGHT;
    const int32_t first = upright ? box->top : box->left, end = upright ? box->bottom : box->right;
    bslam_cell_edge_t edge = {0, 0};
    if (line < 0 || line >= (upright ? columns : rows) || first >= end) {
        return edge;
    }
    const uint8_t *step =
        upright ? view->step_x + first * columns + line : view->step_y + line * columns + first;
    const bslam_step_sums_t sums = bslam_sum_steps(step, end - first, upright ? columns : 1);
    edge.step = (float)sums.sum / (float)(end - first);
    edge.share = (float)sums.clear / (float)(end - first);
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
        box = bslam_box_refined(view, &before);
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
    const int32_t left = bslam_most(side_of(root->extent, LEFT) - grow, 0);
    const int32_t right = bslam_least(side_of(root->extent, RIGHT) + grow, frame->columns);
    const int32_t top = bslam_most(side_of(root->extent, TOP) - grow, 0);
    const int32_t bottom = bslam_least(side_of(root->extent, BOTTOM) + grow, frame->rows);
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
    const int32_t words = words_of(frame->columns), rows = frame->rows;
    const uint32_t *mask = proposals->mask;
    int32_t begin = 0, middle = 0;
    for (int32_t row = 0; row < rows; row++, mask += words) {
        const int32_t end = find_runs(proposals, mask, words, row, middle);
        if (begin < middle && middle < end) {
            join_rows(proposals->runs, begin, middle, end);
        }
        begin = middle;
        middle = end;
    }
    return middle;
}

static void propose_components(bslam_proposals_t *proposals, const bslam_view_t *view, int32_t runs,
                               int32_t pass)
{
    const bslam_run_t *all = proposals->runs;
    for (int32_t run = 0; run < runs; run++) {
        if (all[run].parent == run) {
            propose(proposals, view, &all[run], pass);
        }
    }
}

#define ALL_FOUR 0x01010101U

/// The level as bits_of takes it, in each byte.
static uint32_t limit_of(source_t source, int32_t level)
{
    return (uint32_t)(source == LIKELY ? level + 128 : level) * ALL_FOUR;
}

/// Bits of 16 cells: those whose value or light is above the level, or near which the colour steps by no more
/// than that.
static inline uint32_t bits_of(const bslam_view_t *view, source_t source, int32_t i, uint32_t limit)
{
    if (source == LIKELY) {
        return bslam_bits_above(view->values + i, view->values + i, BSLAM_TOP_BITS, limit);
    }
    if (source == BRIGHT) {
        return bslam_bits_above(view->tones->light + i, view->tones->light + i, 0, limit);
    }
    return bslam_bits_above(view->step_x + i, view->step_y + i, 0, limit) ^ 0xFFFFU;
}

/// The mask of a source. Steps of 16 cells go beyond a row's end, whose bits are then left out; tables have
/// room.
static void fill_mask(uint32_t *mask, const bslam_view_t *view, source_t source, int32_t level)
{
    const int32_t columns = view->frame->columns, cells = columns * view->frame->rows;
    const uint32_t limit = limit_of(source, level);
    for (int32_t first = 0; first < cells; first += columns) {
        for (int32_t k = 0; k < columns; k += BSLAM_MASK_BITS) {
            const uint32_t bits = bits_of(view, source, first + k, limit);
            const bool is_half = columns - k <= BSLAM_CELL_STEP;
            *mask++ = is_half ? bits : bits | bits_of(view, source, first + k + 16, limit) << 16;
        }
        mask[-1] &= last_bits(columns);
    }
}

static bool is_room(const bslam_run_t *face, const bslam_frame_t *frame)
{
    const uint32_t extent = face->extent;
    const bool leaves = side_of(extent, LEFT) == 0 || side_of(extent, TOP) == 0 ||
                        side_of(extent, RIGHT) == frame->columns || side_of(extent, BOTTOM) == frame->rows;
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

/// Takes what is below the floor line out of a word's columns, from `first` on: of each column down to where
/// the last one of them begins, from there on of all at once.
static void clear_floor(uint32_t *mask, const bslam_view_t *view, int32_t first, int32_t words)
{
    const bslam_frame_t *frame = view->frame;
    const int16_t *floor_row = view->floor_line->row + first;
    const int32_t columns = bslam_least(frame->columns - first, BSLAM_MASK_BITS);
    int32_t all_from = 0;
    for (int32_t k = 0; k < columns; k++) {
        all_from = bslam_most(all_from, floor_row[k] + 2);
    }
    all_from = bslam_least(all_from, frame->rows);
    const uint32_t *all = mask + all_from * words, *end = mask + frame->rows * words;
    for (int32_t k = 0; k < columns; k++) {
        const uint32_t others = ~(1U << k);
        for (uint32_t *at = mask + bslam_least(floor_row[k] + 2, all_from) * words; at != all; at += words) {
            *at &= others;
        }
    }
    for (uint32_t *at = mask + all_from * words; at != end; at += words) {
        *at = 0;
    }
}

/// From the components of the smooth cells: all that is not a face of the room, nor below the floor line.
static void mask_standing(bslam_proposals_t *proposals, const bslam_view_t *view, int32_t runs)
{
    const bslam_frame_t *frame = view->frame;
    const int32_t words = words_of(frame->columns);
    uint32_t *mask = proposals->mask;
    const uint32_t last = last_bits(frame->columns);
    memset(mask, 0xFF, (size_t)(frame->rows * words) * sizeof mask[0]);
    for (int32_t i = words - 1; i < frame->rows * words; i += words) {
        mask[i] = last;
    }
    for (bslam_run_t *run = proposals->runs; run != proposals->runs + runs; run++) {
        if (is_room(root_of(proposals->runs, run), frame)) {
            clear_cells(mask + run->row * words, run->first, run->end);
        }
    }
    for (int32_t word = 0; word < words; word++) {
        clear_floor(mask + word, view, word * BSLAM_MASK_BITS, words);
    }
}

/// Leaves only the cells above and below which are others.
static void shrink_columns(uint32_t *mask, int32_t words, int32_t rows)
{
    for (int32_t word = 0; word < words; word++) {
        uint32_t *at = mask + word;
        uint32_t above = 0, here = *at;
        for (int32_t row = 1; row < rows; row++, at += words) {
            const uint32_t below = at[words];
            *at = above & here & below;
            above = here;
            here = below;
        }
        *at = 0;
    }
}

/// Leaves only the cells on whose left and right are others.
static void shrink_rows(uint32_t *mask, int32_t words, int32_t rows)
{
    for (const uint32_t *end = mask + rows * words; mask != end; mask += words) {
        uint32_t before = 0, here = mask[0];
        for (int32_t i = 0; i < words; i++) {
            const uint32_t after = i + 1 < words ? mask[i + 1] : 0;
            mask[i] = here & (here << 1 | before >> (BSLAM_MASK_BITS - 1)) &
                      (here >> 1 | after << (BSLAM_MASK_BITS - 1));
            before = here;
            here = after;
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
        // Those whose eight neighbours are in the mask too are left.
        shrink_columns(proposals->mask, words_of(frame->columns), frame->rows);
        shrink_rows(proposals->mask, words_of(frame->columns), frame->rows);
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
