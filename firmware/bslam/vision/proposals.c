#include "bslam/vision/proposals.h"

#include <stddef.h>

/// One segmentation: cells above the threshold, joined where the tone steps by at most `gate`.
typedef struct pass {
    int8_t threshold;
    uint8_t gate;
} pass_t;

#define NO_GATE 255
static const pass_t passes[] = {{0, NO_GATE}, {24, NO_GATE}, {-16, 20}, {-32, 10}, {0, 40}};
#define PASSES ((int32_t)(sizeof passes / sizeof passes[0]))

/// A component is a proposal from this many cells on, and this many rows and columns.
#define CELLS_MIN 4
#define SIDE_MIN 2
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

void bslam_cells_step(const bslam_view_t *view, uint8_t *step_x, uint8_t *step_y)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    for (int32_t row = 0; row < rows; row++) {
        for (int32_t column = 0; column < columns; column++) {
            const int32_t i = row * columns + column;
            const bslam_tone_t here = view->tones[i];
            const int32_t x = column > 0 ? bslam_tone_distance(here, view->tones[i - 1]) : 0;
            const int32_t y = row > 0 ? bslam_tone_distance(here, view->tones[i - columns]) : 0;
            step_x[i] = (uint8_t)least(x, 255);
            step_y[i] = (uint8_t)least(y, 255);
        }
    }
}

void bslam_cell_features(const bslam_view_t *view, int32_t row, int32_t column,
                         int16_t features[BSLAM_CELL_FEATURES])
{
    const int32_t columns = view->frame->columns;
    const int32_t i = row * columns + column;
    const int32_t right = column + 1 < columns ? i + 1 : i;
    const int32_t below = row + 1 < view->frame->rows ? i + columns : i;
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
    *x++ = (int16_t)least(view->step_x[i] + view->step_x[right], 128);
    *x++ = (int16_t)least(view->step_y[i] + view->step_y[below], 128);
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
static int32_t find_runs(bslam_proposals_t *proposals, const bslam_view_t *view, const pass_t *pass,
                         int32_t row, int32_t count)
{
    const int32_t columns = view->frame->columns;
    const int8_t *values = view->values + row * columns;
    const uint8_t *step = view->step_x + row * columns;
    int32_t column = 0;
    while (column < columns) {
        if (values[column] <= pass->threshold) {
            column++;
            continue;
        }
        const int32_t first = column++;
        while (column < columns && values[column] > pass->threshold && step[column] <= pass->gate) {
            column++;
        }
        if (count == BSLAM_RUNS_MAX) {
            proposals->runs_dropped++;
            continue;
        }
        proposals->runs[count] = (bslam_run_t){
            .parent = (uint16_t)count,
            .cells = (uint16_t)(column - first),
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

/// True if somewhere between two columns of a row the tone steps little from the row above.
static bool is_linked(const bslam_view_t *view, int32_t row, int32_t first, int32_t end, uint8_t gate)
{
    const uint8_t *step = view->step_y + row * view->frame->columns;
    for (int32_t column = first; column < end; column++) {
        if (step[column] <= gate) {
            return true;
        }
    }
    return false;
}

/// Joins the runs [middle, end) of a row with the runs [begin, middle) of the row above.
static void join_rows(bslam_run_t *runs, const bslam_view_t *view, int32_t row, uint8_t gate, int32_t begin,
                      int32_t middle, int32_t end)
{
    int32_t above = begin, here = middle;
    while (above < middle && here < end) {
        const int32_t first = most(runs[above].first, runs[here].first);
        const int32_t last = least(runs[above].end, runs[here].end);
        if (first < last && is_linked(view, row, first, last, gate)) {
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

static void propose(bslam_proposals_t *proposals, const bslam_run_t *root, int32_t pass)
{
    if (root->cells < CELLS_MIN || root->right - root->left < SIDE_MIN ||
        root->bottom - root->top < SIDE_MIN) {
        return;
    }
    const bslam_real_t cell_px = BSLAM_CELL_PX, edge_px = BSLAM_R(0.5);
    const bslam_proposal_t proposal = {
        .left = root->left,
        .top = root->top,
        .right = root->right,
        .bottom = root->bottom,
        .cells = root->cells,
        .segmentation = (uint8_t)pass,
        .box = {root->left * cell_px - edge_px, root->top * cell_px - edge_px,
                root->right * cell_px - edge_px, root->bottom * cell_px - edge_px},
    };
    if (is_known(proposals, &proposal.box)) {
        return;
    }
    if (proposals->count == BSLAM_PROPOSALS_MAX) {
        proposals->boxes_dropped++;
        return;
    }
    proposals->items[proposals->count++] = proposal;
}

static void segment(bslam_proposals_t *proposals, const bslam_view_t *view, int32_t pass)
{
    int32_t begin = 0, middle = 0;
    for (int32_t row = 0; row < view->frame->rows; row++) {
        const int32_t end = find_runs(proposals, view, &passes[pass], row, middle);
        join_rows(proposals->runs, view, row, passes[pass].gate, begin, middle, end);
        begin = middle;
        middle = end;
    }
    for (int32_t run = 0; run < middle; run++) {
        if (proposals->runs[run].parent == run) {
            propose(proposals, &proposals->runs[run], pass);
        }
    }
}

void bslam_proposals_find(bslam_proposals_t *proposals, const bslam_view_t *view)
{
    proposals->count = 0;
    for (int32_t pass = 0; pass < PASSES; pass++) {
        segment(proposals, view, pass);
    }
}
