/// Everything trained that the vision front end uses, as one const view into flash: firmware/models/beacons.h
/// holds the one that comes with the library, made by `make train`.
#ifndef BSLAM_VISION_CLASSIFIERS_BEACON_MODEL_H
#define BSLAM_VISION_CLASSIFIERS_BEACON_MODEL_H

#include "base/status.h"
#include "vision/classifiers/additive.h"
#include "vision/classifiers/hinged.h"
#include "vision/classifiers/svm.h"

/// Lengths of the feature vectors (cells.h, features.h, glance.h, patch.h); a model of other lengths is
/// refused. Not macros, so that Python sees them.
enum {
    BSLAM_CELL_FEATURES = 22,
    BSLAM_BLOB_FEATURES = 82,
    BSLAM_GLANCE_FEATURES = 56,
    BSLAM_PATCH_FEATURES = 288,
    BSLAM_CLOSE_FEATURES = BSLAM_PATCH_FEATURES + BSLAM_BLOB_FEATURES,
};

#define BSLAM_CLASSES_MAX 16

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

/// Objects of a user's own, recognised by their signatures.
typedef struct bslam_recogniser {
    bslam_svm_t svm;  ///< one row an object, linear, BSLAM_SIGNATURE_SIZE
    const bslam_beacon_class_t *objects;
    float reject_margin;  ///< the best row's value is at least this, or the object is none of them
} bslam_recogniser_t;

typedef struct bslam_beacon_model {
    int32_t class_count;
    const bslam_beacon_class_t *classes;  ///< class c of a candidate is classes[c - 1]
    bslam_detector_model_t pinhole;
    bslam_detector_model_t wide;           ///< lenses beyond 120 degrees
    const bslam_recogniser_t *recogniser;  ///< NULL: none
} bslam_beacon_model_t;

/// BSLAM_OK if the front end may be given this model. BSLAM_E_COUNT: a count is out of range or a machine's
/// size is not as described above. BSLAM_E_RANGE: a height is not 0 to 10 m. BSLAM_E_NOT_FINITE or
/// BSLAM_E_PARAMETER: a number is not finite, a machine is quadratic that must not be, or what
/// bslam_svm_check refuses.
BSLAM_MUST_CHECK bslam_status_t bslam_beacon_model_check(const bslam_beacon_model_t *model);

#endif
