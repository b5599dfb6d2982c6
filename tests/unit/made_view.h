/// A view of a picture that a test makes up cell by cell: a level pinhole, a wall at one distance.
#ifndef UNIT_MADE_VIEW_H
#define UNIT_MADE_VIEW_H

#include "vision/built_in/detection/features.h"
#include "base/scalar.h"

enum {
    MADE_COLUMNS = 80,
    MADE_ROWS = 60,
    MADE_CELLS = MADE_COLUMNS * MADE_ROWS,
};
#define MADE_HORIZON_PX 119.5f
#define MADE_FOCAL_PX 280.0f
#define MADE_CAMERA_M 0.5f

typedef struct made_view {
    bslam_tones_t tones;
    uint8_t step_x[BSLAM_CELLS_ROOM];
    uint8_t step_y[BSLAM_CELLS_ROOM];
    uint16_t frequent[BSLAM_CELLS_ROOM];
    int8_t values[BSLAM_CELLS_ROOM];
    uint16_t half[MADE_COLUMNS * 2 * MADE_ROWS * 2];
    bslam_background_t background;
    bslam_floor_line_t floor_line;
    bslam_camera_t camera;
    bslam_frame_t frame;
    bslam_view_t view;
} made_view_t;

/// All tones, steps and values 0; the floor line of a wall at this distance straight ahead, in every column;
/// 0: not known.
void unit_made_view(made_view_t *made, float wall_m);

/// Row (a fraction of pixels) in which a height above the floor stands on that wall.
float unit_made_row_px(float wall_m, float height_m);

#endif
