/// What was trained, as constant tables and views on them: part of vision.h.
///
/// A model is a header of such tables: models/beacons.h comes with the library, `make train` and
/// `bslam detect train` write others. The library copies nothing and checks a model once, in
/// bslam_vision_init. Weights are always float or bytes, in the double build too: what was trained is what
/// runs. docs/MATH-CAMERA.md has the decision functions.
#ifndef BSLAM_VISION_MODEL_H
#define BSLAM_VISION_MODEL_H

#include <stdbool.h>
#include <stdint.h>

/// Values of a signature, by which a thing's appearance is told from others'.
#define BSLAM_SIGNATURE_SIZE 71

/// Lengths of the feature vectors; a model of other lengths is refused. Not macros, so that Python sees them.
enum {
    BSLAM_CELL_FEATURES = 22,
    BSLAM_BLOB_FEATURES = 82,
    BSLAM_GLANCE_FEATURES = 56,
    BSLAM_PATCH_FEATURES = 288,
    BSLAM_CLOSE_FEATURES = BSLAM_PATCH_FEATURES + BSLAM_BLOB_FEATURES
};

/// Kinds of beacons in a model, at most.
#define BSLAM_CLASSES_MAX 16

// ---- support vector machines ------------------------------------------------------------------------------

/// Most rows and features of a machine.
#define BSLAM_SVM_ROWS_MAX 255
#define BSLAM_SVM_FEATURES_MAX 255

/// Weights of a row. A quadratic machine has those of x_i first, then those of x_i x_j for i <= j, row by
/// row: 00 01 02 11 12 22 for three features.
#define BSLAM_SVM_WEIGHTS(features, quadratic) \
    ((features) + ((quadratic) ? (features) * ((features) + 1) / 2 : 0))

/// A machine, linear or quadratic: row r decides f_r(x) = bias[r] + sum of w[r][k] phi_k(x). Weights are
/// either floats or bytes, the other pointer being NULL; a byte stands for byte * byte_scale[r].
typedef struct bslam_svm {
    int32_t rows;             ///< 1: binary; more: a row a class, against the rest
    int32_t features;         ///< length of x
    bool quadratic;           ///< phi(x) = x and its products in pairs; false: x alone
    const float *weights;     ///< rows * BSLAM_SVM_WEIGHTS(features, quadratic) values, row by row, or NULL
    const int8_t *bytes;      ///< as many, or NULL
    const float *byte_scale;  ///< rows values, not negative; read only with bytes
    const float *bias;        ///< rows values
} bslam_svm_t;

enum {
    BSLAM_KNOTS = 9,       ///< of a feature
    BSLAM_GRID_KNOTS = 4,  ///< of these, each way of a pair's grid: knots 0, 3, 5 and 8
    BSLAM_ADDITIVE_FEATURES_MAX = 96,
    BSLAM_CROSSED_MAX = 24  ///< features that have a grid with each other
};

/// Weights of a row: those of the features' tents, feature by feature; then of the grids, of the pairs 0-1,
/// 0-2, ... 1-2, ... of `crossed`, the second one's knots running fastest.
#define BSLAM_ADDITIVE_WEIGHTS(features, crossed_count) \
    ((features) * BSLAM_KNOTS + \
     (crossed_count) * ((crossed_count) - 1) / 2 * BSLAM_GRID_KNOTS * BSLAM_GRID_KNOTS)

/// Bytes of a machine's weights: rows stand in pairs, the first two rows' weights in turn, then those of the
/// next two; after an odd number of rows comes one of zeros. So a word holds what two rows make of a place
/// between two knots.
#define BSLAM_ADDITIVE_BYTES(rows, features, crossed_count) \
    (((rows) + 1) / 2 * 2 * BSLAM_ADDITIVE_WEIGHTS(features, crossed_count))

/// An additive machine: every feature has a curve of its own in each row, a polygon through values at its
/// knots, and chosen pairs of features a surface over a grid of knots.
typedef struct bslam_additive {
    int32_t rows;             ///< a class each, against the rest
    int32_t features;         ///< length of x
    const float *knots;       ///< features * BSLAM_KNOTS, rising in each feature; beyond, curves are level
    int32_t crossed_count;    ///< 0 or 2 to BSLAM_CROSSED_MAX
    const uint8_t *crossed;   ///< so many features
    const int8_t *bytes;      ///< BSLAM_ADDITIVE_BYTES; a byte stands for byte * byte_scale[row]
    const float *byte_scale;  ///< rows values, not negative
    const float *bias;        ///< rows values
} bslam_additive_t;

enum { BSLAM_HINGED_FEATURES_MAX = 512 };

/// Bytes of a machine's weights: rows stand in pairs, after an odd number of them comes one of zeros. A pair
/// has a word a feature: both rows' weights of the byte, then both rows' weights of what is above the knot.
#define BSLAM_HINGED_BYTES(rows, features) (((rows) + 1) / 2 * 4 * (features))

/// A hinged machine: linear in bytes and in how much each exceeds a knot of its own, so every feature has a
/// curve of two straight parts in each row.
typedef struct bslam_hinged {
    int32_t rows;             ///< a class each, against the rest
    int32_t features;         ///< length of x
    const uint8_t *knots;     ///< one a feature
    const int8_t *bytes;      ///< BSLAM_HINGED_BYTES; a byte stands for byte * byte_scale[row]
    const float *byte_scale;  ///< rows values, not negative
    const float *bias;        ///< rows values
} bslam_hinged_t;

// ---- the scanner ------------------------------------------------------------------------------------------

/// Values of a cell of 4x4 pixels; cells of a window's side at most; of a kind's windows, and kinds, at most.
enum { BSLAM_CHANNELS = 8, BSLAM_WINDOW_SIDE_MAX = 20, BSLAM_WINDOWS_MAX = 32, BSLAM_KINDS_MAX = 16 };

/// Bytes of a window's weights for means of 2x2 cells; and of those that say where the edges are: left, top,
/// right, bottom.
#define BSLAM_COARSE_BYTES(columns, rows) ((columns) / 2 * ((rows) / 2) * BSLAM_CHANNELS)
#define BSLAM_EDGE_BYTES(columns, rows) (4 * BSLAM_COARSE_BYTES(columns, rows))

/// A window of cells that slides over all sizes of a picture, and its linear SVM: f = scale * (bias + sum of
/// weight * cell). A coarse one decides first, of means of 2x2 cells and so at a quarter of all places: row
/// after row is added, and what is below a row's floor then is given up.
typedef struct bslam_window {
    uint8_t kind;     ///< index in the model's kinds
    uint8_t columns;  ///< of cells; even, as are the rows
    uint8_t rows;
    float box_columns;  ///< of the box that it frames, in its middle
    float box_rows;
    const int8_t *weights;  ///< [rows][columns][BSLAM_CHANNELS]
    float scale;            ///< above 0
    int32_t bias;
    const int8_t *coarse;  ///< [rows / 2][columns / 2][BSLAM_CHANNELS]
    int32_t coarse_bias;
    const uint8_t *order;     ///< [rows / 2]: which row is added first, and so on
    const int32_t *floors;    ///< [rows / 2], of the sum so far, bias included
    const int8_t *edges;      ///< BSLAM_EDGE_BYTES
    const float *edge_scale;  ///< [4]: an edge is so far from the box's, of its width or height,
    const float *edge_bias;   ///< [4]: edge_scale * sum of weight * block's sum + edge_bias
} bslam_window_t;

/// A kind of thing that a scanner finds.
typedef struct bslam_scan_kind {
    const char *name;
    float height_m;   ///< of all of them; 0: not known, direction only
    float width_m;    ///< of their front, as they are seen from ahead; 0: not known
    float threshold;  ///< what is below it is not reported
    float slope;      ///< logarithm of the odds that what is reported is one: slope * f + offset
    float offset;
    float middle_sd;  ///< standard deviation of the box's middle, of its width,
    float height_sd;  ///< and of its height, of itself
} bslam_scan_kind_t;

typedef struct bslam_scanner_model {
    int32_t kind_count;
    const bslam_scan_kind_t *kinds;
    int32_t window_count;
    const bslam_window_t *windows;  ///< of all kinds
} bslam_scanner_model_t;

// ---- the detector -----------------------------------------------------------------------------------------

/// A kind of beacon.
typedef struct bslam_beacon_class {
    const char *name;
    float height_m;    ///< of every beacon of the kind; 0: not known, direction only
    float depth_m;     ///< how far it stands out from the wall: what of it is a flank; 0: flat, or not known
    float top_low_m;   ///< its upper side is so high above the floor at least,
    float top_high_m;  ///< and at most; 0: not known
    float looks_sd;    ///< what its looks (a pale rim, a lid) make of a distance by its height, as a fraction
    float width_m;     ///< of what is as wide from every side; 0: it is not, or not known
    float body_m;      ///< its height where only the body below its neck is found; 0: it has none
    float narrow_m;    ///< its front is so wide at least,
    float wide_m;      ///< and at most; 0: not known
    float scale_sd;    ///< by what part all distances of one thing err alike, mistaken kinds included; 0: not
                       ///< known
} bslam_beacon_class_t;

/// The detector for one kind of lens.
///
/// Kinds' rows: 0 any beacon, 1 to class_count a kind each, last clutter. The fusion's inputs are those rows'
/// values followed by the screen's. The closer look has the same rows; the verdict's inputs are the fusion's
/// value, that of kinds' first row, and the closer look's rows.
typedef struct bslam_detector_model {
    bslam_svm_t cell;          ///< 1 row, linear, BSLAM_CELL_FEATURES: beacon or surroundings
    bslam_svm_t glance;        ///< 1 row, linear, BSLAM_GLANCE_FEATURES
    float glance_threshold;    ///< a proposal below it is dropped before its features are worked out
    const float *blob_offset;  ///< [BSLAM_BLOB_FEATURES], subtracted from a feature,
    const float *blob_scale;   ///< [BSLAM_BLOB_FEATURES], which is then multiplied by it: about unit range
    bslam_svm_t screen;        ///< 1 row, linear, BSLAM_BLOB_FEATURES
    float screen_threshold;    ///< a proposal below it is dropped before the other machines
    float any_threshold;       ///< and one whose first row is below this before the other rows
    bslam_additive_t kinds;    ///< class_count + 2 rows, BSLAM_BLOB_FEATURES
    bslam_svm_t fusion;        ///< 1 row, linear or quadratic, class_count + 3 inputs
    float fusion_threshold;    ///< a proposal whose fusion value is below it gets no closer look
    bslam_hinged_t close;      ///< class_count + 2 rows, BSLAM_CLOSE_FEATURES
    bslam_svm_t verdict;       ///< 1 row, linear or quadratic, class_count + 4 inputs
    float threshold;           ///< a proposal whose verdict is below it is no candidate
} bslam_detector_model_t;

/// Everything trained.
typedef struct bslam_beacon_model {
    int32_t class_count;
    const bslam_beacon_class_t *classes;  ///< class c of a candidate is classes[c - 1]
    bslam_detector_model_t pinhole;
    bslam_detector_model_t wide;  ///< lenses beyond 120 degrees
} bslam_beacon_model_t;

#endif
