/// Reduces a frame while its rows stream in: cells, half-resolution copy, brightness. No frame is kept.
/// Internal.
///
/// Everything is summed in one word a pixel pair: the three channels of RGB565, spread so that 16 of them add
/// without meeting.
#ifndef BSLAM_VISION_BUILT_IN_THUMBNAIL_H
#define BSLAM_VISION_BUILT_IN_THUMBNAIL_H

#include "vision/built_in/detection/cells.h"

/// A frame's width is a multiple of this, its height of BSLAM_CELL_PX; both at least BSLAM_IMAGE_SIDE_MIN.
#define BSLAM_IMAGE_WIDTH_STEP 8
#define BSLAM_IMAGE_SIDE_MIN 32

/// A row's pairs of pixels.
#define BSLAM_ROW_SUMS (BSLAM_IMAGE_WIDTH_MAX / 2)

/// What is summed of a row of cells until it is finished. Scratch of a frame that streams in.
typedef struct bslam_row_sums {
    uint32_t upper[BSLAM_ROW_SUMS];          ///< of 2x2 pixels of its upper half,
    uint32_t lower[BSLAM_ROW_SUMS];          ///< of its lower one; two pixels, after the upper row of two
    uint16_t packed[BSLAM_IMAGE_WIDTH_MAX];  ///< a row that came with 8 bits a channel, or off words
} bslam_row_sums_t;

typedef struct bslam_thumbnail {
    bslam_pixel_format_t format;
    int32_t width_px;
    int32_t height_px;
    int32_t rows_seen;  ///< of the frame that is streaming in
    union {
        bslam_cells_t cells;       ///< until the frame's colours have been looked at,
        bslam_cell_notes_t notes;  ///< and then what is made of them
    };
    uint16_t half[BSLAM_HALF_MAX];
} bslam_thumbnail_t;

/// Starts a frame; what streamed in before is forgotten. BSLAM_E_RANGE, and nothing changed, if the size is
/// not as said above, is beyond BSLAM_IMAGE_WIDTH_MAX or _HEIGHT_MAX, or the format is none of the enum.
BSLAM_MUST_CHECK bslam_status_t bslam_thumbnail_begin(bslam_thumbnail_t *thumbnail,
                                                      bslam_pixel_format_t format, int32_t width_px,
                                                      int32_t height_px);

/// The next row, uppermost first, of width_px pixels. The sums are the same ones for all rows of a frame,
/// whatever they held before. BSLAM_E_COUNT, and nothing changed, if the frame has all its rows already.
BSLAM_MUST_CHECK bslam_status_t bslam_thumbnail_row(bslam_thumbnail_t *thumbnail, bslam_row_sums_t *sums,
                                                    const void *pixels);

/// The next two rows, from a row of half as many pixels that each stand for 2x2; all rows of the frame are
/// given so. BSLAM_E_COUNT, and nothing changed, if the frame has all its rows already.
BSLAM_MUST_CHECK bslam_status_t bslam_thumbnail_row_doubled(bslam_thumbnail_t *thumbnail,
                                                            bslam_row_sums_t *sums, const void *pixels);

#endif
