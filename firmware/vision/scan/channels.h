/// Aggregated channels (Dollár, Appel, Belongie, Perona 2014): what a linear SVM's windows are made of. Rows
/// of a picture stream in; cells of 4x4 pixels remain: their colour, and how strong edges of each direction
/// are in them, relative to their surroundings. The same at half the size, and so on: octaves. Internal.
#ifndef BSLAM_VISION_SCAN_CHANNELS_H
#define BSLAM_VISION_SCAN_CHANNELS_H

#include "vision/frame.h"

enum {
    BSLAM_EDGE_DIRECTIONS = 4,  ///< dark to bright is as bright to dark: across, falling, down, rising
    BSLAM_EDGES = BSLAM_CHANNELS - BSLAM_EDGE_DIRECTIONS,  ///< the first of their channels; before: luma, red
                                                           ///< against green, yellow against blue, all edges
    BSLAM_OCTAVES = 4,
    BSLAM_AROUND = 5  ///< cells across, that edges are relative to
};

/// A luma row has room for a pixel beyond either side, and begins with a word.
#define BSLAM_LUMA_ROOM (BSLAM_IMAGE_WIDTH_MAX + 8)
#define BSLAM_LUMA_FIRST 4
/// Cells of all octaves are less than this.
#define BSLAM_OCTAVE_CELLS_MAX ((BSLAM_CELLS_MAX * 4 + 2) / 3)

/// One size of the picture.
typedef struct bslam_octave {
    int32_t width_px;
    int32_t height_px;
    int32_t columns;  ///< of cells; pixels beyond the last whole one are not looked at
    int32_t rows;
    int32_t luma_count;  ///< rows of luma so far
    int32_t edge_count;  ///< rows of pixels whose edges are counted
    uint8_t *cells;      ///< [rows][columns][BSLAM_CHANNELS]
    uint8_t luma[3][BSLAM_LUMA_ROOM];
    uint16_t sums[BSLAM_IMAGE_WIDTH_MAX / BSLAM_CELL_PX]
                 [BSLAM_EDGE_DIRECTIONS];  ///< of the row of cells that comes in
    uint16_t strengths[BSLAM_AROUND][BSLAM_IMAGE_WIDTH_MAX / BSLAM_CELL_PX];  ///< of the newest rows of cells
} bslam_octave_t;

typedef struct bslam_channels {
    int32_t octave_count;
    bslam_octave_t octaves[BSLAM_OCTAVES];
    uint32_t colours[BSLAM_IMAGE_WIDTH_MAX / BSLAM_CELL_PX];  ///< sums of spread pixels
    uint16_t packed[BSLAM_IMAGE_WIDTH_MAX];
    uint8_t cells[BSLAM_OCTAVE_CELLS_MAX * BSLAM_CHANNELS];
} bslam_channels_t;

/// A picture begins: width a multiple of 8, height of 4, at most the largest.
void bslam_channels_begin(bslam_channels_t *channels, int32_t width_px, int32_t height_px);

/// Its next row, uppermost first, in RGB565.
void bslam_channels_row(bslam_channels_t *channels, const uint16_t *pixels);

/// All rows have come: finishes the cells.
void bslam_channels_end(bslam_channels_t *channels);

#endif
