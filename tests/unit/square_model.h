// A model of one window that finds red squares of 4x4 cells, at all sizes.
#ifndef TESTS_SQUARE_MODEL_H
#define TESTS_SQUARE_MODEL_H

#include "vision/vision.h"

enum { SQUARE_COLUMNS = 6, SQUARE_ROWS = 6 };

typedef struct square_model {
    int8_t weights[SQUARE_ROWS][SQUARE_COLUMNS][BSLAM_CHANNELS];
    int8_t coarse[SQUARE_ROWS / 2][SQUARE_COLUMNS / 2][BSLAM_CHANNELS];
    uint8_t order[SQUARE_ROWS / 2];
    int32_t floors[SQUARE_ROWS / 2];
    int8_t edges[BSLAM_EDGE_BYTES(SQUARE_COLUMNS, SQUARE_ROWS)];
    float edge_scale[4], edge_bias[4];
    bslam_window_t window;
    bslam_scan_kind_t kind;
    bslam_scanner_model_t model;
} square_model_t;

void square_model_make(square_model_t *square);

#endif
