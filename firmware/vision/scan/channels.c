#include "vision/scan/channels.h"

#include <string.h>

#include "vision/pixels/bytes.h"
#include "vision/pixels/spread.h"

/// Octaves that are smaller than so many cells a side show nothing that one before does not.
enum { OCTAVE_CELLS_MIN = 7 };
enum { CELL_PIXELS = BSLAM_CELL_PX * BSLAM_CELL_PX, HALF_AROUND = BSLAM_AROUND / 2 };
/// Of the sum of a cell's gradients to what is kept of it: strong edges through all of a cell saturate.
enum { EDGE_SHIFT = 3, STRENGTH_SHIFT = 1 };
enum { COLOURS = 3, STRENGTH = 3 };
/// Edges as strong as around them have this value divided by the number of directions. The floor is added to
/// the sum around: what is fainter is noise.
enum { USUAL_EDGES = 96, EDGES_FLOOR = 200 };

void bslam_channels_begin(bslam_channels_t *channels, int32_t width_px, int32_t height_px)
{
    uint8_t *cells = channels->cells;
    channels->octave_count = 0;
    for (int32_t o = 0; o < BSLAM_OCTAVES; o++) {
        bslam_octave_t *octave = &channels->octaves[o];
        octave->width_px = width_px >> o;
        octave->height_px = height_px >> o;
        octave->columns = octave->width_px / BSLAM_CELL_PX;
        octave->rows = octave->height_px / BSLAM_CELL_PX;
        octave->luma_count = 0;
        octave->edge_count = 0;
        octave->cells = cells;
        memset(octave->sums, 0, sizeof octave->sums);
        if (octave->columns < OCTAVE_CELLS_MIN || octave->rows < OCTAVE_CELLS_MIN) {
            break;
        }
        cells += octave->rows * octave->columns * BSLAM_CHANNELS;
        channels->octave_count++;
    }
    memset(channels->colours, 0, sizeof channels->colours);
}

// ---- colours ----------------------------------------------------------------------------------------------

/// About .3, .59 and .11 of red, green and blue, from how many bits RGB565 has of each: 0 to 242. Of two
/// pixels in a word.
static inline uint32_t luma_of_pair(uint32_t word)
{
    const uint32_t red = word >> 11 & 0x001F001FU, green = word >> 5 & 0x003F003FU, blue = word & 0x001F001FU;
    return (9 * (red + green) + 4 * blue) >> 2 & BSLAM_EVEN_BYTES;
}

static void fill_luma(uint8_t *luma, const uint16_t *pixels, int32_t count)
{
    for (int32_t x = 0; x < count; x += 2) {
        const uint32_t pair = luma_of_pair(bslam_halves(pixels[x], pixels[x + 1]));
        luma[x] = (uint8_t)pair;
        luma[x + 1] = (uint8_t)(pair >> 16);
    }
}

static void note_colours(bslam_channels_t *channels, const uint16_t *pixels)
{
    const int32_t columns = channels->octaves[0].columns;
    for (int32_t c = 0; c < columns; c++) {
        const uint8_t *four = (const uint8_t *)(pixels + c * BSLAM_CELL_PX);
        channels->colours[c] += bslam_spread_pair(bslam_word_at(four)) +
                                bslam_spread_pair(bslam_word_at(four + BSLAM_WORD_BYTES));
    }
}

/// The colours of a row of cells, from their sums.
static void end_colours(bslam_channels_t *channels, int32_t row)
{
    const bslam_octave_t *octave = &channels->octaves[0];
    uint8_t *cell = octave->cells + row * octave->columns * BSLAM_CHANNELS;
    for (int32_t c = 0; c < octave->columns; c++) {
        const uint32_t sum = channels->colours[c];
        const int32_t red = sum >> BSLAM_SPREAD_RED & 0x3FF, green = (int32_t)(sum >> BSLAM_SPREAD_GREEN),
                      blue = sum & 0x3FF;
        cell[0] = (uint8_t)((9 * (red + green) + 4 * blue) / (4 * CELL_PIXELS));
        cell[1] = (uint8_t)(128 + (2 * red - green) / 8);
        cell[2] = (uint8_t)(128 + (2 * red + green - 4 * blue) / 16);
        channels->colours[c] = 0;
        cell += BSLAM_CHANNELS;
    }
}

/// An octave's colours are those of the octave before, of four cells each.
static void halve_colours(const bslam_octave_t *from, const bslam_octave_t *to)
{
    const int32_t below = from->columns * BSLAM_CHANNELS;
    for (int32_t i = 0; i < to->rows; i++) {
        const uint8_t *four = from->cells + 2 * i * below;
        uint8_t *cell = to->cells + i * to->columns * BSLAM_CHANNELS;
        for (int32_t c = 0; c < to->columns; c++) {
            for (int32_t k = 0; k < COLOURS; k++) {
                const int32_t sum =
                    four[k] + four[k + BSLAM_CHANNELS] + four[k + below] + four[k + below + BSLAM_CHANNELS];
                cell[k] = (uint8_t)((sum + 2) / 4);
            }
            four += 2 * BSLAM_CHANNELS;
            cell += BSLAM_CHANNELS;
        }
    }
}

// ---- edges ------------------------------------------------------------------------------------------------

/// The top bit of each byte that is not 0.
static inline uint32_t bytes_set(uint32_t bytes)
{
    return bslam_bytes_mean(bytes, UINT32_MAX);
}

/// What the smaller difference stays below where the larger is each byte: seven sixteenths of it, the tangent
/// of 23.6 degrees, and 1 more, so none beside the least one is no slope.
static inline uint32_t flat_below(uint32_t bytes)
{
    const uint32_t half = bslam_bytes_mean(bytes, 0), quarter = bslam_bytes_mean(half, 0);
    return bslam_bytes_mean(half, bslam_bytes_mean(half, quarter)) + 0x01010101U;
}

/// Adds the edges of four pixels to their cell's sums. Luma of the neighbours of each.
static inline void sum_four(uint16_t *sums, uint32_t left, uint32_t right, uint32_t above, uint32_t below)
{
    const uint32_t leftward = bslam_bytes_less(left, right), upward = bslam_bytes_less(above, below);
    const uint32_t across = bslam_bytes_less(right, left) | leftward;
    const uint32_t down = bslam_bytes_less(below, above) | upward;
    const uint32_t more = bslam_bytes_less(down, across);  // larger + half of the smaller
    const uint32_t length = bslam_bytes_plus(across + more, bslam_bytes_mean(down - more, 0));
    const uint32_t is_across = bslam_bytes_filled(bytes_set(bslam_bytes_less(flat_below(across), down)));
    const uint32_t is_down = bslam_bytes_filled(bytes_set(bslam_bytes_less(flat_below(down), across)));
    const uint32_t rises = bslam_bytes_filled(bytes_set(leftward) ^ bytes_set(upward));
    const uint32_t slanted = length & ~(is_across | is_down);
    sums[0] = (uint16_t)bslam_bytes_sum(length & is_across, sums[0]);
    sums[1] = (uint16_t)bslam_bytes_sum(slanted & ~rises, sums[1]);
    sums[2] = (uint16_t)bslam_bytes_sum(length & is_down, sums[2]);
    sums[3] = (uint16_t)bslam_bytes_sum(slanted & rises, sums[3]);
}

/// Adds the edges of a row of pixels to the cells' sums. Luma of the rows above, of it and below.
static void sum_edges(bslam_octave_t *octave, const uint8_t *above, const uint8_t *row, const uint8_t *below)
{
    for (int32_t c = 0; c < octave->columns; c++) {
        const int32_t x = c * BSLAM_CELL_PX;
        sum_four(octave->sums[c], bslam_word_at(row + x - 1), bslam_word_at(row + x + 1),
                 bslam_word_at(above + x), bslam_word_at(below + x));
    }
}

/// What edges add up to in a column of the rows around; beyond the picture it goes on as at its edge.
static inline uint32_t column_sum(const uint16_t *const rows[BSLAM_AROUND], int32_t column, int32_t columns)
{
    const int32_t at = column < 0 ? 0 : column > columns - 1 ? columns - 1 : column;
    return (uint32_t)rows[0][at] + rows[1][at] + rows[2][at] + rows[3][at] + rows[4][at];
}

/// The row's cells in proportion to what edges add up to around each.
static void end_edges(bslam_octave_t *octave, int32_t row)
{
    const int32_t columns = octave->columns, last_row = octave->rows - 1;
    const uint16_t *rows[BSLAM_AROUND];
    for (int32_t i = 0; i < BSLAM_AROUND; i++) {
        const int32_t at = row + i - HALF_AROUND;
        rows[i] = octave->strengths[(at < 0 ? 0 : at > last_row ? last_row : at) % BSLAM_AROUND];
    }
    uint8_t *cell = octave->cells + row * columns * BSLAM_CHANNELS + BSLAM_EDGES;
    uint32_t around = EDGES_FLOOR;
    for (int32_t k = -HALF_AROUND; k < HALF_AROUND; k++) {
        around += column_sum(rows, k, columns);
    }
    for (int32_t c = 0; c < columns; c++) {
        around += column_sum(rows, c + HALF_AROUND, columns);
        const uint32_t factor = (USUAL_EDGES * BSLAM_AROUND * BSLAM_AROUND << 8) / around;
        for (int32_t k = 0; k < BSLAM_EDGE_DIRECTIONS; k++) {
            const uint32_t value = cell[k] * factor >> 8;
            cell[k] = (uint8_t)(value < UINT8_MAX ? value : UINT8_MAX);
        }
        around -= column_sum(rows, c - HALF_AROUND, columns);
        cell += BSLAM_CHANNELS;
    }
}

/// A row of cells has all its pixels.
static void end_cells(bslam_octave_t *octave, int32_t row)
{
    uint8_t *cell = octave->cells + row * octave->columns * BSLAM_CHANNELS + BSLAM_EDGES;
    uint16_t *strengths = octave->strengths[row % BSLAM_AROUND];
    for (int32_t c = 0; c < octave->columns; c++) {
        uint32_t strength = 0;
        for (int32_t k = 0; k < BSLAM_EDGE_DIRECTIONS; k++) {
            const uint32_t value = octave->sums[c][k] >> EDGE_SHIFT;
            cell[k] = (uint8_t)(value < UINT8_MAX ? value : UINT8_MAX);
            strength += cell[k];
            octave->sums[c][k] = 0;
        }
        strengths[c] = (uint16_t)strength;
        cell[STRENGTH - BSLAM_EDGES] =
            (uint8_t)(strength >> STRENGTH_SHIFT < UINT8_MAX ? strength >> STRENGTH_SHIFT : UINT8_MAX);
        cell += BSLAM_CHANNELS;
    }
    if (row >= HALF_AROUND) {
        end_edges(octave, row - HALF_AROUND);
    }
}

/// The next row of pixels whose neighbours are there; beyond the picture it goes on as at its edge.
static void next_edges(bslam_octave_t *octave, bool is_last)
{
    const int32_t at = octave->edge_count;
    if (at < octave->rows * BSLAM_CELL_PX) {
        const uint8_t *rows[3];
        for (int32_t i = 0; i < 3; i++) {
            const int32_t row = at + i - 1;
            rows[i] = octave->luma[(row < 0 ? 0 : is_last && i == 2 ? at : row) % 3] + BSLAM_LUMA_FIRST;
        }
        sum_edges(octave, rows[0], rows[1], rows[2]);
        octave->edge_count++;
        if (octave->edge_count % BSLAM_CELL_PX == 0) {
            end_cells(octave, octave->edge_count / BSLAM_CELL_PX - 1);
        }
    }
}

/// Two rows of luma as one of half as many pixels.
static void halve_luma(const uint8_t *above, const uint8_t *below, uint8_t *half, int32_t count)
{
    for (int32_t x = 0; x < count; x++) {
        half[x] = (uint8_t)((above[2 * x] + above[2 * x + 1] + below[2 * x] + below[2 * x + 1] + 2) / 4);
    }
}

static uint8_t *next_luma(bslam_octave_t *octave)
{
    return octave->luma[octave->luma_count % 3] + BSLAM_LUMA_FIRST;
}

/// The row of luma that next_luma gave is written.
static void take_luma(bslam_octave_t *octave)
{
    uint8_t *row = next_luma(octave);
    row[-1] = row[0];
    row[octave->width_px] = row[octave->width_px - 1];
    octave->luma_count++;
    if (octave->luma_count >= 2) {
        next_edges(octave, false);
    }
}

void bslam_channels_row(bslam_channels_t *channels, const uint16_t *pixels)
{
    bslam_octave_t *octave = &channels->octaves[0];
    fill_luma(next_luma(octave), pixels, octave->width_px);
    note_colours(channels, pixels);
    take_luma(octave);
    if (octave->luma_count % BSLAM_CELL_PX == 0) {
        end_colours(channels, octave->luma_count / BSLAM_CELL_PX - 1);
    }
    // Each second row of an octave makes one of the next.
    for (int32_t o = 1; o < channels->octave_count && octave->luma_count % 2 == 0; o++) {
        bslam_octave_t *next = &channels->octaves[o];
        if (next->luma_count == next->height_px) {
            break;
        }
        const int32_t newest = octave->luma_count - 1;
        halve_luma(octave->luma[(newest - 1) % 3] + BSLAM_LUMA_FIRST,
                   octave->luma[newest % 3] + BSLAM_LUMA_FIRST, next_luma(next), next->width_px);
        take_luma(next);
        octave = next;
    }
}

void bslam_channels_end(bslam_channels_t *channels)
{
    for (int32_t o = 0; o < channels->octave_count; o++) {
        bslam_octave_t *octave = &channels->octaves[o];
        next_edges(octave, true);
        for (int32_t row = octave->rows - HALF_AROUND; row < octave->rows; row++) {
            end_edges(octave, row);
        }
        if (o > 0) {
            halve_colours(&channels->octaves[o - 1], octave);
        }
    }
}
