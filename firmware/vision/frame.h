/// What the vision modules exchange: a picture, here called a frame, reduced while its rows streamed in, and
/// colours of the room. Colours are the camera's own, gamma included. Internal.
#ifndef BSLAM_VISION_FRAME_H
#define BSLAM_VISION_FRAME_H

#include "vision/vision.h"

/// Side of a cell, pixels.
#define BSLAM_CELL_PX 4
#define BSLAM_CELLS_MAX ((BSLAM_IMAGE_WIDTH_MAX / BSLAM_CELL_PX) * (BSLAM_IMAGE_HEIGHT_MAX / BSLAM_CELL_PX))
/// Loops over cells go so many at a time, from any cell; tables that they read or write have room for that.
#define BSLAM_CELL_STEP 16
#define BSLAM_CELLS_ROOM (BSLAM_CELLS_MAX + 2 * BSLAM_CELL_STEP)
/// A mask of the cells has a bit a cell, in rows of whole words.
#define BSLAM_MASK_BITS 32
#define BSLAM_MASK_WORDS \
    (BSLAM_IMAGE_HEIGHT_MAX / BSLAM_CELL_PX * \
     ((BSLAM_IMAGE_WIDTH_MAX / BSLAM_CELL_PX + BSLAM_MASK_BITS - 1) / BSLAM_MASK_BITS))
/// Pixels of the half-resolution copy.
#define BSLAM_HALF_MAX ((BSLAM_IMAGE_WIDTH_MAX / 2) * (BSLAM_IMAGE_HEIGHT_MAX / 2))

/// 4x4 pixels: their mean colour, and the spread (largest less smallest) of the luma of its four 2x2
/// quarters.
typedef struct bslam_cell {
    uint8_t red;
    uint8_t green;
    uint8_t blue;
    uint8_t spread;
} bslam_cell_t;

/// The cells of a frame, [rows][columns]: a table a value, so that a compiler can use vector instructions.
typedef struct bslam_cells {
    uint8_t red[BSLAM_CELLS_ROOM];
    uint8_t green[BSLAM_CELLS_ROOM];
    uint8_t blue[BSLAM_CELLS_ROOM];
    uint8_t spread[BSLAM_CELLS_ROOM];
} bslam_cells_t;

/// A colour, each channel 0 to 255.
typedef struct bslam_rgb {
    float red;
    float green;
    float blue;
} bslam_rgb_t;

/// Running colours of what the room is made of, per camera. Where `known` is false (the first frames) they
/// are a guess from the present frame.
typedef struct bslam_surroundings {
    bslam_rgb_t wall;
    bslam_rgb_t floor;
    bslam_rgb_t ceiling;
    bool known;
} bslam_surroundings_t;

/// A finished frame: const views into the front end's instance, good until its next frame begins.
typedef struct bslam_frame {
    int32_t width_px;  ///< of the camera's frame, a multiple of BSLAM_CELL_PX; so is the height
    int32_t height_px;
    int32_t columns;  ///< cells side by side: width_px / BSLAM_CELL_PX
    int32_t rows;     ///< cells one above the other
    const bslam_cells_t *cells;
    const uint16_t *half;  ///< [height_px / 2][width_px / 2], RGB565: means of 2x2 pixels
    const bslam_surroundings_t *surroundings;
} bslam_frame_t;

static inline bslam_cell_t bslam_cell_at(const bslam_cells_t *cells, int32_t i)
{
    return (bslam_cell_t){cells->red[i], cells->green[i], cells->blue[i], cells->spread[i]};
}

/// Red, green and blue of an RGB565 pixel, 0 to 255 (5 or 6 bits spread over 8).
static inline bslam_rgb_t bslam_rgb_of_565(uint16_t pixel)
{
    const bslam_rgb_t rgb = {
        .red = (float)(pixel >> 11) * (255.0f / 31.0f),
        .green = (float)((pixel >> 5) & 63) * (255.0f / 63.0f),
        .blue = (float)(pixel & 31) * (255.0f / 31.0f),
    };
    return rgb;
}

#endif
