/// The cells of a frame, judged one by one: how the colour steps there, and a linear SVM's opinion whether it
/// is a beacon's.
#ifndef BSLAM_VISION_BUILT_IN_DETECTION_CELLS_H
#define BSLAM_VISION_BUILT_IN_DETECTION_CELLS_H

#include "vision/built_in/pixels/background.h"
#include "vision/built_in/classifiers/beacon_model.h"

/// Steps of a cell's value for a decision value of 1.
#define BSLAM_CELL_VALUE_ONE 32

/// A tone that is seen so often is no more frequent than that.
#define BSLAM_FREQUENT_MAX 32

/// What is known of a frame before its boxes are.
typedef struct bslam_view {
    const bslam_frame_t *frame;
    const bslam_camera_t *camera;
    bslam_mounting_t mounting;  ///< the camera's
    const bslam_background_t *background;
    const bslam_floor_line_t *floor_line;
    const bslam_tones_t *tones;
    const uint8_t *step_x;     ///< [rows][columns], as all that follow: colour difference of the cells on the
                               ///< left and right, at most 255
    const uint8_t *step_y;     ///< of those above and below
    const uint16_t *frequent;  ///< how frequent the tone is on walls, and 256 times that on floors, 0 to
                               ///< BSLAM_FREQUENT_MAX each
    const int8_t *values;      ///< decision value of each cell, in 1/BSLAM_CELL_VALUE_ONE
} bslam_view_t;

/// The cell SVM in whole numbers: value = (sum of weight x feature + bias) >> BSLAM_CELL_WEIGHT_SHIFT.
#define BSLAM_CELL_WEIGHT_SHIFT 10
typedef struct bslam_cell_machine {
    int16_t weights[BSLAM_CELL_FEATURES];
    int32_t bias;
} bslam_cell_machine_t;

/// What each bin of tones adds to a cell's sum in the present frame, worked out once a frame, and the view's
/// `frequent` of its tones.
typedef struct bslam_cell_tables {
    int32_t sums[BSLAM_TONE_BINS];
    uint16_t frequent[BSLAM_TONE_BINS];
} bslam_cell_tables_t;

/// Scratch: what each channel of a tone adds.
#define BSLAM_LIGHTS 194
typedef struct bslam_light_terms {
    int32_t value;
    uint32_t distances;   ///< from tones of the room (cells.c), a byte each
    int32_t above_floor;  ///< of a cell that is not below the floor line
} bslam_light_terms_t;

typedef struct bslam_chroma_terms {
    int32_t value;
    uint32_t distances;
} bslam_chroma_terms_t;

/// What a tone adds up to.
typedef struct bslam_tone_sum {
    uint32_t tone;  ///< light, reddish and bluish, a byte each; no tone has a fourth
    int32_t sum;
    int32_t sum_above_floor;  ///< of a cell that is not below the floor line
    uint32_t frequent;
} bslam_tone_sum_t;

/// Tones whose sums are kept, each in one place: most cells of a room have one of a few hundred tones.
#define BSLAM_TONES_KEPT 256
typedef struct bslam_channel_tables {
    bslam_light_terms_t light[BSLAM_LIGHTS];
    bslam_chroma_terms_t reddish[256];  ///< [(uint8_t)reddish]
    bslam_chroma_terms_t bluish[256];
    bslam_tone_sum_t kept[BSLAM_TONES_KEPT];
} bslam_channel_tables_t;

/// How the colour steps sideways where a kind of upright would stand (vertical_edges.h), by kind and column;
/// mean, in quarters.
#define BSLAM_UPRIGHTS 6
typedef struct bslam_edge_steps {
    uint8_t of_kind[BSLAM_UPRIGHTS][BSLAM_COLUMNS_MAX];
} bslam_edge_steps_t;

/// What is made of a frame's cells, [rows][columns].
typedef struct bslam_cell_notes {
    uint16_t frequent[BSLAM_CELLS_ROOM];  ///< as the view has it; so the values
    int8_t values[BSLAM_CELLS_ROOM];
    union {
        bslam_cell_tables_t tables;            ///< while these are worked out,
        uint32_t masks[2 * BSLAM_MASK_WORDS];  ///< then bits: segmentations join these cells;
        bslam_edge_steps_t steps;              ///< and then while uprights are looked for
    };
} bslam_cell_notes_t;

/// The machine of a model, rounded to whole numbers.
bslam_cell_machine_t bslam_cell_machine(const bslam_svm_t *svm);

/// Fills the view's step_x and step_y, given as arrays to write to.
void bslam_cells_step(const bslam_view_t *view, uint8_t *step_x, uint8_t *step_y);

/// The features of one cell, in steps of tones and rows.
void bslam_cell_features(const bslam_view_t *view, int32_t row, int32_t column,
                         int16_t features[BSLAM_CELL_FEATURES]);

/// Fills the view's values and frequent, given as arrays to write to: the machine's sum over
/// bslam_cell_features, with tables that it works out first. The floor line's rows are within the frame, or
/// one above it.
void bslam_cells_decide(const bslam_view_t *view, const bslam_cell_machine_t *machine,
                        bslam_cell_tables_t *tables, bslam_channel_tables_t *channels, uint16_t *frequent,
                        int8_t *values);

#endif
