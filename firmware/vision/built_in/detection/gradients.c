#include "vision/built_in/detection/gradients.h"

#include <stddef.h>
#include <string.h>

#include "base/bounds.h"
#include "vision/pixels/bytes.h"

enum {
    SIDE = 24,  ///< samples,
    CELL = 4,   ///< of these to a cell's side
    CELLS = SIDE / CELL,
    WAYS = 4,   ///< directions that are told apart
    BANDS = 3,  ///< of the box; each way
};
_Static_assert(BSLAM_PATCH_FEATURES == CELLS * CELLS * WAYS + 2 * BANDS * SIDE, "as features are counted");
_Static_assert(CELL == sizeof(uint32_t), "a row of a cell is a word");

/// Where the bands begin and end; the box is samples 4 to 20.
static const uint8_t band_edges[BANDS + 2] = {4, 9, 15, 20, SIDE};

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

/// Sums of changes, in twos: light is even, and its half 125 at most, so that a byte holds a change.
typedef struct changes {
    /// A cell's changes: level and upright ones and, in the upper half of the word, the level ones; then
    /// level and falling ones and, in the upper half, all.
    uint32_t cells[CELLS][CELLS][2];
    uint32_t across[BANDS][CELLS][2];  ///< of four columns in a band: of the even ones, of the odd ones
    uint16_t down[BANDS][SIDE];        ///< of rows in a band
} changes_t;

/// Where a line's samples begin.
#define FIRST CELL

/// Half the light of a row of samples, and what is beside the outermost ones: the same again.
typedef struct line {
    uint8_t light[FIRST + SIDE + CELL];
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

/// Half the light of two pixels in the halves of a word: 0 to 125.
static inline uint32_t lights_of(uint32_t pixels)
{
    return (pixels >> 11 & 0x001F001FU) + (pixels >> 5 & 0x003F003FU) + (pixels & 0x001F001FU);
}

static void read_line(const uint16_t *pixels, const uint16_t columns[SIDE], line_t *line)
{
    uint8_t *light = line->light + FIRST;
    for (const uint16_t *at = columns; at != columns + SIDE; at += CELL) {
        const uint32_t even = lights_of(bslam_halves(pixels[at[0]], pixels[at[2]]));
        const uint32_t odd = lights_of(bslam_halves(pixels[at[1]], pixels[at[3]]));
        bslam_word_put(light, even | odd << 8);
        light += CELL;
    }
    light[0] = light[-1];
    line->light[FIRST - 1] = line->light[FIRST];
}

/// Of the larger change of two, in each byte, what the smaller one must be below for light to change along an
/// axis: within 22.5 degrees, whose tangent is 53 / 128.
static inline uint32_t limits_of(uint32_t larger)
{
    const uint32_t even = bslam_bytes_even(larger) * 53 + 0x007F007FU;
    const uint32_t odd = bslam_bytes_odd(larger) * 53 + 0x007F007FU;
    return (even >> 7 & BSLAM_EVEN_BYTES) | (odd << 1 & ~BSLAM_EVEN_BYTES);
}

/// The top bit of each byte of a that is above that of b, amid others.
static inline uint32_t are_above(uint32_t a, uint32_t b)
{
    return bslam_bytes_mean(a, ~b);
}

/// Adds changes across and down to a cell's sums: `axis` has all bits of those that are level or upright,
/// `slope` of those that are level or falling.
static inline void add_changes(uint32_t x, uint32_t y, uint32_t axis, uint32_t slope, uint32_t cell[2])
{
    const uint32_t x_along = x & axis, y_along = y & axis;
    const uint32_t level = bslam_bytes_sum(y_along & slope, bslam_bytes_sum(x_along & slope, 0));
    const uint32_t all = bslam_bytes_sum(y, bslam_bytes_sum(x, 0));
    cell[0] = bslam_bytes_sum(y_along, bslam_bytes_sum(x_along, cell[0])) + (level << 16);
    cell[1] = bslam_bytes_sum(y & slope, bslam_bytes_sum(x & slope, cell[1])) + (all << 16);
}

/// The lines of a row: that above it, its own, that below it. What is beyond the outermost ones is the
/// same again.
enum { ABOVE, HERE, BELOW, LINES };

/// Adds the four samples that begin at place `i` of lines to a cell; `twice_x` and `twice_y` are all bits of
/// the outermost, beyond which light goes on changing as it does before: what it changes to the one neighbour
/// counts twice. Returns how much light changes across each, and, in `down`, down.
static inline uint32_t add_four(const line_t lines[LINES], int32_t i, uint32_t twice_x, uint32_t twice_y,
                                uint32_t cell[2], uint32_t *down)
{
    const uint8_t *here = lines[HERE].light + i;
    const uint32_t left = bslam_word_at(here - 1), right = bslam_word_at(here + 1);
    const uint32_t above = bslam_word_at(lines[ABOVE].light + i);
    const uint32_t below = bslam_word_at(lines[BELOW].light + i);
    const uint32_t one_x = bslam_bytes_apart(left, right), one_y = bslam_bytes_apart(above, below);
    const uint32_t x = one_x + (one_x & twice_x), y = one_y + (one_y & twice_y);
    const uint32_t more = bslam_bytes_less(x, y);
    const uint32_t axis = are_above(limits_of(y + more), x - more), steep = are_above(x, y);
    // Half of light leaves a byte's top bit free to borrow from: it stays where light does not fall. Those of
    // the two differ where light changes one way across and the other way down.
    const uint32_t slope = ((right | BSLAM_TOP_BITS) - left) ^ ((below | BSLAM_TOP_BITS) - above);
    add_changes(x, y, bslam_bytes_filled(axis), bslam_bytes_filled(slope ^ (axis & (steep ^ slope))), cell);
    *down = y;
    return x;
}

/// Adds a row of samples; `across` are the sums of its band, or NULL.
static void add_row(changes_t *changes, int32_t row, const line_t lines[LINES], uint32_t (*across)[2])
{
    static const uint32_t ends[CELLS] = {0x000000FFU, 0, 0, 0, 0, 0xFF000000U};
    const uint32_t twice_y = row == 0 || row == SIDE - 1 ? ~0U : 0;
    uint32_t down[CELLS];
    for (int32_t i = 0; i < CELLS; i++) {
        const uint32_t x =
            add_four(lines, FIRST + CELL * i, ends[i], twice_y, changes->cells[row / CELL][i], &down[i]);
        if (across != NULL) {
            across[i][0] = bslam_bytes_add_even(across[i][0], x);
            across[i][1] = bslam_bytes_add_odd(across[i][1], x);
        }
    }
    // As bands begin and end: 4, 9, 15, 20.
    changes->down[0][row] = (uint16_t)bslam_bytes_sum(down[1], down[2] & 255);
    changes->down[1][row] = (uint16_t)bslam_bytes_sum(down[2] >> 8, bslam_bytes_sum(down[3] & 0xFFFFFFU, 0));
    changes->down[2][row] = (uint16_t)bslam_bytes_sum(down[4], down[3] >> 24);
}

static void find_changes(const bslam_frame_t *frame, const bslam_box_t *box, changes_t *changes)
{
    const int32_t width = frame->width_px / 2, height = frame->height_px / 2;
    uint16_t columns[SIDE], rows[SIDE];
    line_t lines[LINES];
    place_samples((float)box->left_px, (float)box->right_px, width, columns);
    place_samples((float)box->top_px, (float)box->bottom_px, height, rows);
    memset(changes, 0, sizeof *changes);
    read_line(frame->half + rows[0] * width, columns, &lines[BELOW]);
    lines[HERE] = lines[BELOW];
    for (int32_t row = 0, band = 0; row < SIDE; row++) {
        lines[ABOVE] = lines[HERE];
        lines[HERE] = lines[BELOW];
        if (row + 1 < SIDE) {
            read_line(frame->half + rows[row + 1] * width, columns, &lines[BELOW]);
        }
        band += row == band_edges[band] ? 1 : 0;
        add_row(changes, row, lines, band >= 1 && band <= BANDS ? changes->across[band - 1] : NULL);
    }
}

/// All that changes in a cell.
static uint32_t energy_of(const uint32_t cell[2])
{
    return cell[1] >> 16;
}

/// What changes in each column of cells of a row, those above and those below together; beyond the outer
/// cells they go on.
static void sum_around(const changes_t *changes, int32_t row, uint32_t sums[CELLS + 2])
{
    const int32_t above = bslam_most(row - 1, 0), below = bslam_least(row + 1, CELLS - 1);
    for (int32_t i = 0; i < CELLS; i++) {
        sums[i + 1] = energy_of(changes->cells[above][i]) + energy_of(changes->cells[row][i]) +
                      energy_of(changes->cells[below][i]);
    }
    sums[0] = sums[1];
    sums[CELLS + 1] = sums[CELLS];
}

static inline uint8_t share_of(uint32_t twos, uint32_t factor)
{
    return bslam_byte_at_most(twos * factor >> (CELL_PLACES - 1));
}

static uint8_t *write_cells(const changes_t *changes, uint8_t *out)
{
    for (int32_t row = 0; row < CELLS; row++) {
        uint32_t sums[CELLS + 2];
        sum_around(changes, row, sums);
        for (int32_t i = 0; i < CELLS; i++) {
            const uint32_t around = 2 * (sums[i] + sums[i + 1] + sums[i + 2]) + CELLS_NOISE;
            const uint32_t factor = (9U * CELL_BYTES << CELL_PLACES) / around;
            const uint32_t *cell = changes->cells[row][i];
            const uint32_t level = cell[0] >> 16, upright = (cell[0] & 0xFFFFU) - level;
            const uint32_t falling = (cell[1] & 0xFFFFU) - level;
            *out++ = share_of(level, factor);
            *out++ = share_of(energy_of(cell) - level - upright - falling, factor);
            *out++ = share_of(upright, factor);
            *out++ = share_of(falling, factor);
        }
    }
    return out;
}

/// What a band's sums are to be multiplied by, `total` being all that changes.
static uint32_t factor_of(int32_t band, uint32_t total)
{
    const uint32_t lines = (uint32_t)(band_edges[band + 1] - band_edges[band]), samples = SIDE * SIDE;
    return (MEAN_BYTES * samples << BAND_PLACES) / (lines * (total + SAMPLE_NOISE * samples));
}

static inline uint8_t mean_of(uint32_t twos, uint32_t factor)
{
    return bslam_byte_at_most(twos * factor >> (BAND_PLACES - 1));
}

/// All that changes.
static uint32_t total_of(const changes_t *changes)
{
    uint32_t twos = 0;
    for (int32_t row = 0; row < CELLS; row++) {
        for (int32_t i = 0; i < CELLS; i++) {
            twos += energy_of(changes->cells[row][i]);
        }
    }
    return 2 * twos;
}

static void write_bands(const changes_t *changes, uint8_t *out)
{
    const uint32_t total = total_of(changes);
    for (int32_t band = 0; band < BANDS; band++) {
        const uint32_t factor = factor_of(band, total);
        uint8_t *across = out + band * SIDE, *down = across + BANDS * SIDE;
        for (int32_t i = 0; i < CELLS; i++) {
            const uint32_t *four = changes->across[band][i];
            *across++ = mean_of(four[0] & 0xFFFFU, factor);
            *across++ = mean_of(four[1] & 0xFFFFU, factor);
            *across++ = mean_of(four[0] >> 16, factor);
            *across++ = mean_of(four[1] >> 16, factor);
        }
        for (int32_t i = 0; i < SIDE; i++) {
            *down++ = mean_of(changes->down[band][i], factor);
        }
    }
}

void bslam_patch_features(const bslam_frame_t *frame, const bslam_box_t *box,
                          uint8_t features[BSLAM_PATCH_FEATURES])
{
    changes_t changes;
    find_changes(frame, box, &changes);
    write_bands(&changes, write_cells(&changes, features));
}
