/// What stands in a bslam_scanner_t. Internal.
#ifndef BSLAM_VISION_SCAN_SCANNER_H
#define BSLAM_VISION_SCAN_SCANNER_H

#include "vision/scan/box_signature.h"
#include "vision/scan/levels.h"

/// Boxes of a picture before those are dropped that overlap a better one.
enum { BSLAM_HITS_MAX = 128 };

/// Rows of cells that windows at two places, one below the other, need; and of means of 2x2 cells.
enum { BSLAM_FINE_ROWS = BSLAM_WINDOW_SIDE_MAX + 2, BSLAM_COARSE_ROWS = BSLAM_WINDOW_SIDE_MAX / 2 };

typedef struct bslam_hit {
    float left_px;  ///< edges from the picture's own
    float top_px;
    float right_px;
    float bottom_px;
    float score;
    int32_t kind;  ///< -1: dropped
} bslam_hit_t;

typedef struct bslam_scanner_instance {
    const bslam_scanner_model_t *model;
    bslam_channels_t channels;
    bslam_pixel_format_t format;
    int32_t width_px;
    int32_t height_px;
    int32_t rows_seen;
    int32_t hit_count;
    bslam_detections_t found;
    bslam_hit_t hits[BSLAM_HITS_MAX];
    union {
        struct {
            uint8_t rows[BSLAM_FINE_ROWS][BSLAM_LEVEL_ROOM];  ///< of the level that is looked at, the newest
            uint8_t coarse[BSLAM_COARSE_ROWS][BSLAM_LEVEL_ROOM / 2];
        };
        bslam_box_points_t points;  ///< once all has been looked at
    };
} bslam_scanner_instance_t;

/// BSLAM_OK if a scanner may be given this model: as bslam_scanner_init says.
BSLAM_MUST_CHECK bslam_status_t bslam_scanner_model_check(const bslam_scanner_model_t *model);

static inline bslam_scanner_instance_t *bslam_scanner_instance(bslam_scanner_t *scanner)
{
    void *memory = scanner;
    return memory;
}

#endif
