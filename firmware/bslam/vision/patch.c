#include "bslam/vision/patch.h"

#include <string.h>

#include "bslam/math/bounds.h"
#include "bslam/math/bytes.h"

enum {
    SIDE = 24,  ///< samples,
    CELL = 4,   ///< of these to a cell's side
    CELLS = SIDE / CELL,
    WAYS = 4,   ///< directions that are told apart
    BANDS = 3,  ///< of the box; each way
};
_Static_assert(BSLAM_PATCH_FEATURES == CELLS * CELLS * WAYS + 2 * BANDS * SIDE, "as features are counted");

/// Where the bands begin and end; the box is samples 4 to 20.
#define BAND_EDGES 4, 9, 15, 20
static const uint8_t band_edges[BANDS + 2] = {BAND_EDGES, SIDE};

/// What counts as change where nothing changes, so that noise is not blown up: of a sample, and of the nine
/// cells around one.
#define SAMPLE_NOISE 6
#define CELLS_NOISE 90
/// Bytes that stand for a mean change, and for all that changes in a cell of nine.
#define MEAN_BYTES 32
#define CELL_BYTES 255
/// Quotients have so many binary places; no sum is above what it is divided by, so products fit.
#define CELL_PLACES 16
#define BAND_PLACES 17

typedef struct changes {
    uint16_t cells[CELLS][CELLS][WAYS];
    uint16_t across[BANDS + 2]
                   [SIDE];           ///< of columns; what is above the box and below it comes first and last
    uint16_t down[BANDS + 2][SIDE];  ///< of rows; so what is beside it
    uint32_t total;
} changes_t;

/// A row of samples with one more beyond each end, where light goes on changing as it does before.
typedef struct line {
    int16_t light[SIDE + 2];
} line_t;

/// Where samples lie along a side, in pixels of the half-resolution copy: those beyond the frame at its edge.
static void place_samples(float from_px, float to_px, int32_t limit, uint16_t at[SIDE])
{
    const float margin = (to_px - from_px) * 0.25f;
    const float step = (to_px - from_px) * (1.5f / SIDE);
    for (int32_t i = 0; i < SIDE; i++) {
        // Half-resolution pixel k is from 2 k - 0.5 to 2 k + 1.5.
        const float place = (from_px - margin + ((float)i + 0.5f) * step + 0.5f) * 0.5f;
        at[i] = (uint16_t)bslam_clampf(place, 0.0f, (float)(limit - 1));
    }
}

/// 0 to 250.
static inline int16_t light_of(uint32_t pixel)
{
    return (int16_t)(2 * ((pixel >> 11) + (pixel >> 5 & 63) + (pixel & 31)));
}

static void read_line(const uint16_t *pixels, const uint16_t columns[SIDE], line_t *line)
{
    int16_t *light = line->light;
    for (int32_t i = 0; i < SIDE; i++) {
        light[i + 1] = light_of(pixels[columns[i]]);
    }
    light[0] = (int16_t)(2 * light[1] - light[2]);
    light[SIDE + 1] = (int16_t)(2 * light[SIDE] - light[SIDE - 1]);
}

/// The line beyond `here`, where light goes on changing as it does from `before` to there.
static void go_on(const line_t *before, const line_t *here, line_t *beyond)
{
    for (int32_t i = 0; i < SIDE + 2; i++) {
        beyond->light[i] = (int16_t)(2 * here->light[i] - before->light[i]);
    }
}

/// Which way light changes by so much across and down: level, rising, upright, falling; the limits are
/// at 22.5 degrees from the axes, whose tangent is 53 / 128.
static inline int32_t way_of(int32_t across, int32_t down, int32_t x, int32_t y)
{
    if (128 * y < 53 * x) {
        return 0;
    }
    if (128 * x < 53 * y) {
        return 2;
    }
    return (across ^ down) >= 0 ? 1 : 3;
}

static inline int32_t size_of(int32_t number)
{
    return number < 0 ? -number : number;
}

/// Adds samples [first, end) of a row between two others; `cells` and `across_of` are those of the row.
/// Returns how much light changes down it.
static inline uint32_t add_samples(const line_t *above, const line_t *here, const line_t *below,
                                   int32_t first, int32_t end, uint16_t *cells, uint16_t *across_of)
{
    uint32_t down_sum = 0;
    for (int32_t i = first; i < end; i++) {
        const int32_t across = here->light[i + 2] - here->light[i];
        const int32_t down = below->light[i + 1] - above->light[i + 1];
        const int32_t x = size_of(across), y = size_of(down);
        _Static_assert(CELL == WAYS, "a cell has as many numbers as samples side by side");
        uint16_t *cell = cells + (i & ~(CELL - 1));
        cell[way_of(across, down, x, y)] += (uint16_t)(x + y);
        across_of[i] += (uint16_t)x;
        down_sum += (uint32_t)y;
    }
    return down_sum;
}

static void add_row(changes_t *changes, int32_t row, int32_t band, const line_t *above, const line_t *here,
                    const line_t *below)
{
    static const uint8_t edges[BANDS + 3] = {0, BAND_EDGES, SIDE};
    uint16_t *cells = changes->cells[row / CELL][0];
    for (int32_t b = 0; b < BANDS + 2; b++) {
        changes->down[b][row] =
            (uint16_t)add_samples(above, here, below, edges[b], edges[b + 1], cells, changes->across[band]);
    }
}

static uint32_t total_of(const changes_t *changes)
{
    uint32_t total = 0;
    for (int32_t band = 0; band < BANDS + 2; band++) {
        for (int32_t i = 0; i < SIDE; i++) {
            total += (uint32_t)changes->across[band][i] + changes->down[band][i];
        }
    }
    return total;
}

static void find_changes(const bslam_frame_t *frame, const bslam_box_t *box, changes_t *changes)
{
    const int32_t width = frame->width_px / 2, height = frame->height_px / 2;
    uint16_t columns[SIDE], rows[SIDE];
    line_t lines[3];
    place_samples((float)box->left_px, (float)box->right_px, width, columns);
    place_samples((float)box->top_px, (float)box->bottom_px, height, rows);
    memset(changes, 0, sizeof *changes);
    line_t *above = &lines[0], *here = &lines[1], *below = &lines[2];
    read_line(frame->half + rows[0] * width, columns, here);
    read_line(frame->half + rows[1] * width, columns, below);
    go_on(below, here, above);
    for (int32_t row = 0, band = 0; row < SIDE; row++) {
        band += row == band_edges[band] ? 1 : 0;
        add_row(changes, row, band, above, here, below);
        line_t *free_line = above;
        above = here;
        here = below;
        below = free_line;
        if (row + 2 < SIDE) {
            read_line(frame->half + rows[row + 2] * width, columns, below);
        } else {
            go_on(above, here, below);
        }
    }
    changes->total = total_of(changes);
}

/// All that changes in a cell; beyond the outer ones they go on.
static uint32_t energy_at(const changes_t *changes, int32_t row, int32_t column)
{
    const uint16_t *ways = changes->cells[bslam_least(bslam_most(row, 0), CELLS - 1)]
                                         [bslam_least(bslam_most(column, 0), CELLS - 1)];
    return (uint32_t)ways[0] + ways[1] + ways[2] + ways[3];
}

static uint8_t *write_cells(const changes_t *changes, uint8_t *out)
{
    for (int32_t row = 0; row < CELLS; row++) {
        for (int32_t column = 0; column < CELLS; column++) {
            uint32_t around = CELLS_NOISE;
            for (int32_t i = -1; i <= 1; i++) {
                for (int32_t k = -1; k <= 1; k++) {
                    around += energy_at(changes, row + i, column + k);
                }
            }
            const uint32_t factor = (9U * CELL_BYTES << CELL_PLACES) / around;
            for (int32_t way = 0; way < WAYS; way++) {
                *out++ = bslam_byte_at_most(changes->cells[row][column][way] * factor >> CELL_PLACES);
            }
        }
    }
    return out;
}

static uint8_t *write_bands(const uint16_t sums[BANDS + 2][SIDE], uint32_t total, uint8_t *out)
{
    const uint32_t samples = SIDE * SIDE;
    for (int32_t band = 0; band < BANDS; band++) {
        const uint32_t lines = (uint32_t)(band_edges[band + 1] - band_edges[band]);
        const uint32_t factor =
            (MEAN_BYTES * samples << BAND_PLACES) / (lines * (total + SAMPLE_NOISE * samples));
        for (int32_t i = 0; i < SIDE; i++) {
            *out++ = bslam_byte_at_most(sums[band + 1][i] * factor >> BAND_PLACES);
        }
    }
    return out;
}

void bslam_patch_features(const bslam_frame_t *frame, const bslam_box_t *box,
                          uint8_t features[BSLAM_PATCH_FEATURES])
{
    changes_t changes;
    find_changes(frame, box, &changes);
    uint8_t *out = write_cells(&changes, features);
    out = write_bands(changes.across, changes.total, out);
    (void)write_bands(changes.down, changes.total, out);
}
