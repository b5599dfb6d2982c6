#include "square_model.h"

#include <string.h>

void square_model_make(square_model_t *square)
{
    memset(square, 0, sizeof *square);
    for (int r = 0; r < SQUARE_ROWS; r++) {
        for (int c = 0; c < SQUARE_COLUMNS; c++) {
            const bool inside = r > 0 && c > 0 && r < SQUARE_ROWS - 1 && c < SQUARE_COLUMNS - 1;
            square->weights[r][c][1] = inside ? 5 : -4;
        }
    }
    for (int r = 0; r < SQUARE_ROWS / 2; r++) {
        square->order[r] = (uint8_t)(SQUARE_ROWS / 2 - 1 - r);
        square->floors[r] = INT32_MIN;
    }
    // 16 cells of 5 and 20 of -4 are 0 where all is grey, 128.
    square->window = (bslam_window_t){.kind = 0,
                                      .columns = SQUARE_COLUMNS,
                                      .rows = SQUARE_ROWS,
                                      .box_columns = 4,
                                      .box_rows = 4,
                                      .weights = &square->weights[0][0][0],
                                      .scale = 0.001f,
                                      .bias = -3000,
                                      .coarse = &square->coarse[0][0][0],
                                      .order = square->order,
                                      .floors = square->floors,
                                      .edges = square->edges,
                                      .edge_scale = square->edge_scale,
                                      .edge_bias = square->edge_bias};
    square->kind = (bslam_scan_kind_t){.name = "red square",
                                       .height_m = 0.5f,
                                       .threshold = 0,
                                       .slope = 2,
                                       .offset = 1,
                                       .middle_sd = 0.05f,
                                       .height_sd = 0.04f};
    square->model = (bslam_scanner_model_t){
        .kind_count = 1, .kinds = &square->kind, .window_count = 1, .windows = &square->window};
}
