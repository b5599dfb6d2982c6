#include "vision/scan/levels.h"

#include <string.h>

#include "vision/pixels/bytes.h"

enum { ONE = 256 };
/// 256 times the fourth roots of 1, 2, 4 and 8.
static const int16_t STEPS[BSLAM_LEVELS_AN_OCTAVE] = {ONE, 304, 362, 431};

bslam_level_t bslam_level(const bslam_channels_t *channels, int32_t index)
{
    const int32_t o = index / BSLAM_LEVELS_AN_OCTAVE;
    const bslam_octave_t *octave = &channels->octaves[o];
    const int32_t step = STEPS[index % BSLAM_LEVELS_AN_OCTAVE];
    return (bslam_level_t){
        .octave = octave,
        .step = step,
        .columns = octave->columns * ONE / step + 2 * BSLAM_LEVEL_PAD,
        .rows = octave->rows * ONE / step + 2 * BSLAM_LEVEL_PAD,
        .cell_px = (float)((step << o) * BSLAM_CELL_PX) / ONE,
    };
}

/// The cell at or before a place, and how far on it is from there, of 256.
typedef struct place {
    int32_t cell;
    uint32_t on;
} place_t;

static inline place_t place_of(int32_t index, int32_t step, int32_t count)
{
    const int32_t at = ((2 * index + 1) * step - ONE) / 2, last = (count - 1) * ONE;
    const int32_t within = at < last ? at : last - 1;
    return (place_t){within >> 8, (uint32_t)within & 255};
}

/// Bytes between those of two words.
static inline uint32_t between(uint32_t a, uint32_t b, uint32_t on)
{
    const uint32_t even = (a & BSLAM_EVEN_BYTES) * (ONE - on) + (b & BSLAM_EVEN_BYTES) * on;
    const uint32_t odd = (a >> 8 & BSLAM_EVEN_BYTES) * (ONE - on) + (b >> 8 & BSLAM_EVEN_BYTES) * on;
    return (even >> 8 & BSLAM_EVEN_BYTES) | (odd & ~BSLAM_EVEN_BYTES);
}

static void sample_row(const bslam_level_t *level, int32_t row, uint8_t *cells, int32_t count)
{
    const bslam_octave_t *octave = level->octave;
    const place_t y = place_of(row, level->step, octave->rows);
    const int32_t bytes = octave->columns * BSLAM_CHANNELS;
    const uint8_t *above = octave->cells + y.cell * bytes, *below = above + bytes;
    for (int32_t c = 0; c < count; c++) {
        const place_t x = place_of(c, level->step, octave->columns);
        const uint8_t *a = above + x.cell * BSLAM_CHANNELS, *b = below + x.cell * BSLAM_CHANNELS;
        for (int32_t k = 0; k < BSLAM_CHANNELS; k += BSLAM_WORD_BYTES) {
            const uint32_t left = between(bslam_word_at(a + k), bslam_word_at(b + k), y.on);
            const uint32_t right =
                between(bslam_word_at(a + BSLAM_CHANNELS + k), bslam_word_at(b + BSLAM_CHANNELS + k), y.on);
            bslam_word_put(cells + k, between(left, right, x.on));
        }
        cells += BSLAM_CHANNELS;
    }
}

void bslam_level_row(const bslam_level_t *level, int32_t row, uint8_t cells[BSLAM_LEVEL_ROOM])
{
    const int32_t count = level->columns - 2 * BSLAM_LEVEL_PAD, last = level->rows - 2 * BSLAM_LEVEL_PAD - 1;
    const int32_t inside = row - BSLAM_LEVEL_PAD;
    const int32_t from = inside < 0 ? 0 : inside > last ? last : inside;
    uint8_t *first = cells + BSLAM_LEVEL_PAD * BSLAM_CHANNELS, *end = first + count * BSLAM_CHANNELS;
    if (level->step == ONE) {
        const int32_t bytes = count * BSLAM_CHANNELS;
        memcpy(first, level->octave->cells + from * bytes, (size_t)bytes);
    } else {
        sample_row(level, from, first, count);
    }
    for (int32_t i = 0; i < BSLAM_LEVEL_PAD; i++) {
        memcpy(cells + i * BSLAM_CHANNELS, first, BSLAM_CHANNELS);
        memcpy(end + i * BSLAM_CHANNELS, end - BSLAM_CHANNELS, BSLAM_CHANNELS);
    }
}
