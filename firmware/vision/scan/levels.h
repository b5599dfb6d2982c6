/// The sizes between two octaves: an octave's cells taken fewer, row by row. Internal.
#ifndef BSLAM_VISION_SCAN_LEVELS_H
#define BSLAM_VISION_SCAN_LEVELS_H

#include "vision/scan/channels.h"

enum {
    BSLAM_LEVELS_AN_OCTAVE = 4,
    BSLAM_LEVELS_MAX = BSLAM_OCTAVES * BSLAM_LEVELS_AN_OCTAVE,
    BSLAM_LEVEL_PAD = 2  ///< cells that a level goes on beyond the picture on every side, as at its edge
};

/// One size: an octave, and how far apart its cells are there, 256 a cell of the octave.
typedef struct bslam_level {
    const bslam_octave_t *octave;
    int32_t step;
    int32_t columns;  ///< with what it is padded by
    int32_t rows;
    float cell_px;  ///< side of a cell in the picture
} bslam_level_t;

#define BSLAM_LEVEL_ROOM ((BSLAM_IMAGE_WIDTH_MAX / BSLAM_CELL_PX + 2 * BSLAM_LEVEL_PAD) * BSLAM_CHANNELS)

/// Level `index` of a finished picture, 0 to 4 * octave_count - 1.
bslam_level_t bslam_level(const bslam_channels_t *channels, int32_t index);

/// A row of its cells: [columns][BSLAM_CHANNELS].
void bslam_level_row(const bslam_level_t *level, int32_t row, uint8_t cells[BSLAM_LEVEL_ROOM]);

#endif
