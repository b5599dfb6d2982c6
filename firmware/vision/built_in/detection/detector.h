/// Which of the proposed boxes are beacons, and of which kind: two linear machines screen them, the first by
/// a glance, additive ones judge what is left, a quadratic one weighs their answers; what may be a beacon
/// then gets a closer look at its pixels, and a last quadratic machine weighs what that says; overlapping
/// boxes give way to the best.
#ifndef BSLAM_VISION_BUILT_IN_DETECTION_DETECTOR_H
#define BSLAM_VISION_BUILT_IN_DETECTION_DETECTOR_H

#include "vision/built_in/detection/features.h"
#include "vision/built_in/detection/gradients.h"

/// What the machines said of a proposal before the closer look. Scratch: the front end has so many of them;
/// of more the surest are kept.
#define BSLAM_OPINIONS_MAX 24
typedef struct bslam_box_opinion {
    const bslam_proposal_t *proposal;
    float score;                          ///< the fusion's
    float values[BSLAM_CLASSES_MAX + 3];  ///< kinds' rows and the screen
    uint8_t told[BSLAM_BLOB_FEATURES];    ///< as the closer look's machine is told the features
} bslam_box_opinion_t;

/// Judges proposals and writes the best, surest first, to candidates[BSLAM_CANDIDATES_MAX]: outline, class,
/// margin and score; all else zero. Kinds that are not about as high as the box, by the floor line, lose of
/// their values. Returns how many. *dropped grows by those that found no room.
int32_t bslam_detector_judge(const bslam_detector_model_t *model, const bslam_beacon_class_t *classes,
                             int32_t class_count, const bslam_view_t *view,
                             const bslam_proposals_t *proposals,
                             bslam_box_opinion_t opinions[BSLAM_OPINIONS_MAX], bslam_candidate_t *candidates,
                             uint32_t *dropped);

/// Features minus offset, times scale, within +-BSLAM_FEATURE_LIMIT.
#define BSLAM_FEATURE_LIMIT 3.0f
/// Values of the machines, within this, go to the fusion.
#define BSLAM_FUSION_LIMIT 4.0f
void bslam_detector_normalise(const bslam_detector_model_t *model, float features[BSLAM_BLOB_FEATURES]);

/// Normalised features as the closer look's machine is told them, after those of the pixels (gradients.h):
/// BSLAM_CLOSE_STEPS steps for 1, 128 for 0.
#define BSLAM_CLOSE_STEPS 42.0f
void bslam_detector_tell(const float normalised[BSLAM_BLOB_FEATURES], uint8_t told[BSLAM_BLOB_FEATURES]);

#endif
