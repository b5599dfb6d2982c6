/// The cells of a frame, judged one by one: how the colour steps there, and a linear SVM's opinion whether it
/// is a beacon's.
#ifndef BSLAM_VISION_CELLS_H
#define BSLAM_VISION_CELLS_H

#include "bslam/vision/background.h"
#include "bslam/vision/beacon_model.h"

/// Steps of a cell's value for a decision value of 1.
#define BSLAM_CELL_VALUE_ONE 32

/// What is known of a frame before its boxes are.
typedef struct bslam_view {
    const bslam_frame_t *frame;
    const bslam_camera_t *camera;
    const bslam_background_t *background;
    const bslam_floor_line_t *floor_line;
    const bslam_tone_t *tones;  ///< [rows][columns], as all that follow
    const uint8_t *step_x;      ///< colour difference of the cells on the left and right, at most 255
    const uint8_t *step_y;      ///< of those above and below
    const int8_t *values;       ///< decision value of each cell, in 1/BSLAM_CELL_VALUE_ONE
} bslam_view_t;

/// The cell SVM in whole numbers: value = (sum of weight x feature + bias) >> BSLAM_CELL_WEIGHT_SHIFT.
#define BSLAM_CELL_WEIGHT_SHIFT 10
typedef struct bslam_cell_machine {
    int16_t weights[BSLAM_CELL_FEATURES];
    int32_t bias;
} bslam_cell_machine_t;

/// What each light, reddish and bluish value and each bin adds to a cell's sum in the present frame, worked
/// out once a frame: then a cell takes a few look-ups. `distances` packs those from wall, floor and ceiling.
typedef struct bslam_tone_part {
    uint32_t distances;
    int32_t sum;
    int32_t sum_above_floor;
    uint16_t bin;
} bslam_tone_part_t;

typedef struct bslam_cell_tables {
    bslam_tone_part_t light[256];
    bslam_tone_part_t reddish[256];
    bslam_tone_part_t bluish[256];
    int32_t bins[BSLAM_TONE_BINS];
} bslam_cell_tables_t;

/// The machine of a model, rounded to whole numbers.
bslam_cell_machine_t bslam_cell_machine(const bslam_svm_t *svm);

/// Fills the view's step_x and step_y, given as arrays to write to.
void bslam_cells_step(const bslam_view_t *view, uint8_t *step_x, uint8_t *step_y);

/// The features of one cell, in steps of tones and rows.
void bslam_cell_features(const bslam_view_t *view, int32_t row, int32_t column,
                         int16_t features[BSLAM_CELL_FEATURES]);

/// Fills the view's values, given as an array to write to: the machine's sum over bslam_cell_features, from
/// tables that it works out first.
void bslam_cells_decide(const bslam_view_t *view, const bslam_cell_machine_t *machine,
                        bslam_cell_tables_t *tables, int8_t *values);

#endif
