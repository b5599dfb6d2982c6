#include "made_view.h"

#include <string.h>

float unit_made_row_px(float wall_m, float height_m)
{
    return MADE_HORIZON_PX - MADE_FOCAL_PX * (height_m - MADE_CAMERA_M) / wall_m;
}

void unit_made_view(made_view_t *made, float wall_m)
{
    memset(made, 0, sizeof *made);
    for (int32_t column = 0; column < MADE_COLUMNS && wall_m > 0; column++) {
        made->floor_line.distance_m[column] = wall_m;
        made->floor_line.edge_px[column] = (int16_t)unit_made_row_px(wall_m, 0);
        made->floor_line.row[column] = (int16_t)(unit_made_row_px(wall_m, 0) / BSLAM_CELL_PX);
    }
    made->camera = (bslam_camera_t){
        .lens = BSLAM_LENS_PINHOLE,
        .width_px = MADE_COLUMNS * BSLAM_CELL_PX,
        .height_px = MADE_ROWS * BSLAM_CELL_PX,
        .fx_px = MADE_FOCAL_PX,
        .fy_px = MADE_FOCAL_PX,
        .cx_px = (MADE_COLUMNS * BSLAM_CELL_PX - 1) / BSLAM_R(2.0),
        .cy_px = MADE_HORIZON_PX,
        .z_m = MADE_CAMERA_M,
    };
    made->frame = (bslam_frame_t){
        .width_px = MADE_COLUMNS * BSLAM_CELL_PX,
        .height_px = MADE_ROWS * BSLAM_CELL_PX,
        .columns = MADE_COLUMNS,
        .rows = MADE_ROWS,
        .half = made->half,
    };
    made->view = (bslam_view_t){
        .frame = &made->frame,
        .camera = &made->camera,
        .mounting = bslam_camera_mounting(&made->camera),
        .background = &made->background,
        .floor_line = &made->floor_line,
        .tones = &made->tones,
        .step_x = made->step_x,
        .step_y = made->step_y,
        .frequent = made->frequent,
        .values = made->values,
    };
}
