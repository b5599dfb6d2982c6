/// Where a beacon may be: each cell is judged by a linear SVM, then cells that hang together become boxes.
///
/// One segmentation misses much: an object whose middle looks like wall falls apart at a high threshold, two
/// neighbours run together at a low one. So five run over the same values, at different thresholds and with
/// different limits on how far the tone may step inside one component.
#ifndef BSLAM_VISION_PROPOSALS_H
#define BSLAM_VISION_PROPOSALS_H

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

/// Segmentations of a frame; boxes found otherwise have numbers from here on.
#define BSLAM_SEGMENTATIONS 7

/// A box in which there may be a beacon.
typedef struct bslam_proposal {
    int16_t left;  ///< in cells: [left, right) by [top, bottom)
    int16_t top;
    int16_t right;
    int16_t bottom;
    uint16_t cells;        ///< of the component
    uint8_t segmentation;  ///< which found it first
    bslam_box_t box;       ///< to the pixel
} bslam_proposal_t;

/// Scratch for one segmentation.
#define BSLAM_RUNS_MAX 1536
typedef struct bslam_run {
    uint16_t parent;
    uint16_t cells;
    uint8_t row;  ///< the run's own: columns [first, end) of this row
    uint8_t first;
    uint8_t end;
    uint8_t left;  ///< of all joined to it, if it is their root
    uint8_t top;
    uint8_t right;
    uint8_t bottom;
} bslam_run_t;

typedef struct bslam_proposals {
    int32_t count;
    uint32_t runs_dropped;   ///< since init: a frame so broken up that BSLAM_RUNS_MAX did not suffice
    uint32_t boxes_dropped;  ///< since init: BSLAM_PROPOSALS_MAX did not suffice
    bslam_proposal_t items[BSLAM_PROPOSALS_MAX];
    bslam_run_t runs[BSLAM_RUNS_MAX];
    uint8_t mask[BSLAM_CELLS_MAX];  ///< 1: the present segmentation joins this cell
} bslam_proposals_t;

/// The machine of a model, rounded to whole numbers.
bslam_cell_machine_t bslam_cell_machine(const bslam_svm_t *svm);

/// Fills the view's step_x and step_y, given as arrays to write to.
void bslam_cells_step(const bslam_view_t *view, uint8_t *step_x, uint8_t *step_y);

/// The features of one cell, in steps of tones and rows.
void bslam_cell_features(const bslam_view_t *view, int32_t row, int32_t column,
                         int16_t features[BSLAM_CELL_FEATURES]);

/// Fills the view's values, given as an array to write to.
void bslam_cells_decide(const bslam_view_t *view, const bslam_cell_machine_t *machine, int8_t *values);

/// Adds a box, unless it is known or there is no room.
void bslam_proposals_add(bslam_proposals_t *proposals, const bslam_proposal_t *proposal);

/// Finds the boxes: at most BSLAM_PROPOSALS_MAX, none twice.
void bslam_proposals_find(bslam_proposals_t *proposals, const bslam_view_t *view);

/// Intersection over union of two boxes.
bslam_real_t bslam_box_overlap(const bslam_box_t *a, const bslam_box_t *b);

#endif
