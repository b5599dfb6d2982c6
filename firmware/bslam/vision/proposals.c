#include "bslam/vision/proposals.h"

#include <stddef.h>
#include <string.h>

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
} pass_t;

static const pass_t passes[] = {
    {LIKELY, 0, false, 0},    {LIKELY, 24, false, 0},  {LIKELY, 0, true, 1},   {STANDING, 20, true, 1},
    {STANDING, 40, false, 0}, {STANDING, 40, true, 1}, {SMOOTH, 40, false, 1},
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
/// Boxes that overlap more than this are the same.
#define SAME_OVERLAP BSLAM_R(0.85)

static int32_t least(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static int32_t most(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

static int32_t clamp(int32_t value, int32_t low, int32_t high)
{
    return most(low, least(value, high));
}

static int32_t magnitude(int32_t value)
{
    return value < 0 ? -value : value;
}

bslam_cell_machine_t bslam_cell_machine(const bslam_svm_t *svm)
{
    bslam_cell_machine_t machine = {0};
    const float scale = (float)(BSLAM_CELL_VALUE_ONE << BSLAM_CELL_WEIGHT_SHIFT);
    for (int32_t i = 0; i < BSLAM_CELL_FEATURES; i++) {
        const float weight = svm->bytes != NULL ? (float)svm->bytes[i] * svm->byte_scale[0] : svm->weights[i];
        machine.weights[i] = (int16_t)clamp((int32_t)(weight * scale), -32767, 32767);
    }
    machine.bias = (int32_t)(svm->bias[0] * scale);
    return machine;
}

/// Difference of two cells' colours; green counts twice.
static uint8_t colour_step(bslam_cell_t a, bslam_cell_t b)
{
    const int32_t step =
        magnitude(a.red - b.red) + 2 * magnitude(a.green - b.green) + magnitude(a.blue - b.blue);
    return (uint8_t)least(step, 255);
}

void bslam_cells_step(const bslam_view_t *view, uint8_t *step_x, uint8_t *step_y)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    const bslam_cell_t *cells = view->frame->cells;
    for (int32_t row = 0; row < rows; row++) {
        const int32_t up = row > 0 ? columns : 0, down = row + 1 < rows ? columns : 0;
        for (int32_t column = 0; column < columns; column++) {
            const int32_t i = row * columns + column;
            const int32_t left = column > 0 ? 1 : 0, right = column + 1 < columns ? 1 : 0;
            step_x[i] = colour_step(cells[i - left], cells[i + right]);
            step_y[i] = colour_step(cells[i - up], cells[i + down]);
        }
    }
}

void bslam_cell_features(const bslam_view_t *view, int32_t row, int32_t column,
                         int16_t features[BSLAM_CELL_FEATURES])
{
    const int32_t columns = view->frame->columns;
    const int32_t i = row * columns + column;
    const bslam_tone_t tone = view->tones[i];
    const bslam_background_t *background = view->background;
    const bslam_tone_t wall = background->tone[BSLAM_ZONE_WALL];
    const bslam_tone_t floor = background->tone[BSLAM_ZONE_FLOOR];
    const bslam_tone_t ceiling = background->tone[BSLAM_ZONE_CEILING];
    const int32_t bin = bslam_tone_bin(tone);
    const int32_t wall_distance = bslam_tone_distance(tone, wall);
    const int32_t floor_distance = bslam_tone_distance(tone, floor);
    const int32_t ceiling_distance = bslam_tone_distance(tone, ceiling);
    const int32_t above_floor = view->floor_line->row[column] - row;
    const int32_t above_horizon = bslam_horizon_row(view->camera) - row;
    int16_t *x = features;

    *x++ = (int16_t)clamp(tone.light - wall.light, -96, 96);
    *x++ = (int16_t)clamp(magnitude(tone.light - wall.light), 0, 96);
    *x++ = (int16_t)clamp(magnitude(tone.reddish - wall.reddish), 0, 64);
    *x++ = (int16_t)clamp(magnitude(tone.bluish - wall.bluish), 0, 64);
    *x++ = (int16_t)clamp(floor_distance, 0, 128);
    *x++ = (int16_t)clamp(ceiling_distance, 0, 128);
    *x++ = (int16_t)clamp(least(wall_distance, least(floor_distance, ceiling_distance)), 0, 128);
    *x++ = (int16_t)least(background->counts[BSLAM_ZONE_WALL][bin], 32);
    *x++ = (int16_t)least(background->counts[BSLAM_ZONE_WALL][bin], 6);
    *x++ = (int16_t)least(background->counts[BSLAM_ZONE_FLOOR][bin], 32);
    *x++ = (int16_t)least(background->counts[BSLAM_ZONE_FLOOR][bin], 6);
    *x++ = (int16_t)least(background->counts[BSLAM_ZONE_CEILING][bin], 32);
    *x++ = (int16_t)clamp(tone.spread, 0, 64);
    *x++ = (int16_t)least(view->step_x[i], 128);
    *x++ = (int16_t)least(view->step_y[i], 128);
    *x++ = (int16_t)least(magnitude(tone.reddish) + magnitude(tone.bluish), 128);
    *x++ = (int16_t)clamp(above_floor, -8, 40);
    *x++ = (int16_t)clamp(above_floor, -3, 3);
    *x++ = (int16_t)clamp(above_horizon, -30, 30);
    *x++ = (int16_t)most(clamp(above_horizon, -30, 30), 0);
    *x++ = (int16_t)(above_floor >= 0 ? least(wall_distance, 128) : 0);
    *x++ = (int16_t)(above_floor >= 0 ? clamp(tone.light - wall.light, -96, 0) : 0);
}

void bslam_cells_decide(const bslam_view_t *view, const bslam_cell_machine_t *machine, int8_t *values)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    for (int32_t row = 0; row < rows; row++) {
        for (int32_t column = 0; column < columns; column++) {
            int16_t x[BSLAM_CELL_FEATURES];
            bslam_cell_features(view, row, column, x);
            int32_t sum = machine->bias;
            for (int32_t k = 0; k < BSLAM_CELL_FEATURES; k++) {
                sum += machine->weights[k] * x[k];
            }
            const int32_t value = sum / (1 << BSLAM_CELL_WEIGHT_SHIFT);
            values[row * columns + column] = (int8_t)clamp(value, -127, 127);
        }
    }
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

/// Appends the runs of a row; returns how many runs there are then.
static int32_t find_runs(bslam_proposals_t *proposals, const uint8_t *mask, int32_t columns, int32_t row,
                         int32_t count)
{
    int32_t column = 0;
    while (column < columns) {
        if (mask[column] == 0) {
            column++;
            continue;
        }
        const int32_t first = column++;
        while (column < columns && mask[column] != 0) {
            column++;
        }
        if (count == BSLAM_RUNS_MAX) {
            proposals->runs_dropped++;
            continue;
        }
        proposals->runs[count] = (bslam_run_t){
            .parent = (uint16_t)count,
            .cells = (uint16_t)(column - first),
            .row = (uint8_t)row,
            .first = (uint8_t)first,
            .end = (uint8_t)column,
            .left = (uint8_t)first,
            .top = (uint8_t)row,
            .right = (uint8_t)column,
            .bottom = (uint8_t)(row + 1),
        };
        count++;
    }
    return count;
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

static bool is_known(const bslam_proposals_t *proposals, const bslam_box_t *box)
{
    for (int32_t i = 0; i < proposals->count; i++) {
        if (bslam_box_overlap(&proposals->items[i].box, box) > SAME_OVERLAP) {
            return true;
        }
    }
    return false;
}

void bslam_proposals_add(bslam_proposals_t *proposals, const bslam_proposal_t *proposal)
{
    if (is_known(proposals, &proposal->box)) {
        return;
    }
    if (proposals->count == BSLAM_PROPOSALS_MAX) {
        proposals->boxes_dropped++;
        return;
    }
    proposals->items[proposals->count++] = *proposal;
}

static void propose(bslam_proposals_t *proposals, const bslam_frame_t *frame, const bslam_run_t *root,
                    int32_t pass)
{
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
    bslam_proposals_add(proposals, &proposal);
}

/// Finds the components of the mask; returns how many runs they have.
static int32_t find_components(bslam_proposals_t *proposals, const bslam_frame_t *frame)
{
    int32_t begin = 0, middle = 0;
    for (int32_t row = 0; row < frame->rows; row++) {
        const uint8_t *mask = proposals->mask + row * frame->columns;
        const int32_t end = find_runs(proposals, mask, frame->columns, row, middle);
        join_rows(proposals->runs, begin, middle, end);
        begin = middle;
        middle = end;
    }
    return middle;
}

static void propose_components(bslam_proposals_t *proposals, const bslam_frame_t *frame, int32_t runs,
                               int32_t pass)
{
    for (int32_t run = 0; run < runs; run++) {
        if (proposals->runs[run].parent == run) {
            propose(proposals, frame, &proposals->runs[run], pass);
        }
    }
}

static void mask_likely(uint8_t *mask, const bslam_view_t *view, int32_t level)
{
    const int32_t cells = view->frame->rows * view->frame->columns;
    for (int32_t i = 0; i < cells; i++) {
        mask[i] = view->values[i] > level ? 1 : 0;
    }
}

static void mask_smooth(uint8_t *mask, const bslam_view_t *view, int32_t level)
{
    const int32_t cells = view->frame->rows * view->frame->columns;
    for (int32_t i = 0; i < cells; i++) {
        mask[i] = view->step_x[i] <= level && view->step_y[i] <= level ? 1 : 0;
    }
}

static bool is_room(const bslam_run_t *face, const bslam_frame_t *frame)
{
    const bool leaves =
        face->left == 0 || face->top == 0 || face->right == frame->columns || face->bottom == frame->rows;
    return leaves || face->cells > frame->columns * frame->rows * FACE_MAX_PERCENT / 100;
}

/// From the components of the smooth cells: all that is not a face of the room, nor below the floor line.
static void mask_standing(bslam_proposals_t *proposals, const bslam_view_t *view, int32_t runs)
{
    const bslam_frame_t *frame = view->frame;
    uint8_t *mask = proposals->mask;
    for (int32_t i = 0; i < frame->rows * frame->columns; i++) {
        mask[i] = 1;
    }
    for (int32_t i = 0; i < runs; i++) {
        const bslam_run_t *run = &proposals->runs[i];
        if (is_room(&proposals->runs[root_of(proposals->runs, i)], frame)) {
            memset(mask + run->row * frame->columns + run->first, 0, (size_t)(run->end - run->first));
        }
    }
    for (int32_t column = 0; column < frame->columns; column++) {
        for (int32_t row = view->floor_line->row[column] + 2; row < frame->rows; row++) {
            mask[row * frame->columns + column] = 0;
        }
    }
}

/// Leaves only the cells whose eight neighbours are in the mask too.
static void shrink_mask(uint8_t *mask, int32_t columns, int32_t rows)
{
    for (int32_t row = 0; row < rows; row++) {
        uint8_t *line = mask + row * columns;
        uint8_t before = 0;
        for (int32_t column = 0; column < columns; column++) {
            const uint8_t here = line[column];
            const uint8_t after = column + 1 < columns ? line[column + 1] : 0;
            line[column] = before & here & after;
            before = here;
        }
    }
    for (int32_t column = 0; column < columns; column++) {
        uint8_t before = 0;
        for (int32_t row = 0; row < rows; row++) {
            uint8_t *cell = mask + row * columns + column;
            const uint8_t here = *cell;
            const uint8_t after = row + 1 < rows ? cell[columns] : 0;
            *cell = before & here & after;
            before = here;
        }
    }
}

static void segment(bslam_proposals_t *proposals, const bslam_view_t *view, int32_t pass)
{
    const pass_t *p = &passes[pass];
    const bslam_frame_t *frame = view->frame;
    if (p->source == LIKELY) {
        mask_likely(proposals->mask, view, p->level);
    } else {
        mask_smooth(proposals->mask, view, p->level);
    }
    if (p->source == STANDING) {
        mask_standing(proposals, view, find_components(proposals, frame));
    }
    if (p->shrink) {
        shrink_mask(proposals->mask, frame->columns, frame->rows);
    }
    propose_components(proposals, frame, find_components(proposals, frame), pass);
}

void bslam_proposals_find(bslam_proposals_t *proposals, const bslam_view_t *view)
{
    proposals->count = 0;
    for (int32_t pass = 0; pass < PASSES; pass++) {
        segment(proposals, view, pass);
    }
}
