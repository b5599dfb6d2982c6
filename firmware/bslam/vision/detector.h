/// Which of the proposed boxes are beacons, and of which kind: two linear machines screen them, the first by
/// a glance, additive ones judge what is left, a quadratic one weighs their answers; overlapping boxes give
/// way to the best.
#ifndef BSLAM_VISION_DETECTOR_H
#define BSLAM_VISION_DETECTOR_H

#include "bslam/vision/features.h"

/// Judges proposals and writes the best, surest first, to candidates[BSLAM_CANDIDATES_MAX]: outline, class,
/// margin and score; all else zero. Kinds that are not about as high as the box, by the floor line, lose of
/// their values. Returns how many. *dropped grows by those that found no room.
int32_t bslam_detector_judge(const bslam_detector_model_t *model, const bslam_beacon_class_t *classes,
                             int32_t class_count, const bslam_view_t *view,
                             const bslam_proposals_t *proposals, bslam_candidate_t *candidates,
                             uint32_t *dropped);

/// Features minus offset, times scale, within +-BSLAM_FEATURE_LIMIT.
#define BSLAM_FEATURE_LIMIT 3.0f
/// Values of the machines, within this, go to the fusion.
#define BSLAM_FUSION_LIMIT 4.0f
void bslam_detector_normalise(const bslam_detector_model_t *model, float features[BSLAM_BLOB_FEATURES]);

#endif
