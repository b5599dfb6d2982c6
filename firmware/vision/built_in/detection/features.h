/// What a proposed box looks like, as numbers for the detector's machines.
///
/// The floor line gives the distance of the wall behind a box, so sizes and heights are in metres; the rest
/// is contrast to what surrounds the box, texture, and how the tone is spread over 3x3 zones of it.
#ifndef BSLAM_VISION_BUILT_IN_DETECTION_FEATURES_H
#define BSLAM_VISION_BUILT_IN_DETECTION_FEATURES_H

#include "vision/built_in/detection/proposals.h"

/// Features that have a name: natural logarithm of the height in metres, by the floor line; and 1 / the
/// distance of the wall in metres, 0 where the floor line is not known.
enum {
    BSLAM_BLOB_LOG_HEIGHT = 1,
    BSLAM_BLOB_PER_METRE = 7,
};

/// Natural logarithm to 0.01, of numbers from 1e-4 to 1e4; those outside count as the nearest inside.
float bslam_log(float x);

/// The features of a proposal, all finite; tools/training sees them in this order.
void bslam_blob_features(const bslam_view_t *view, const bslam_proposal_t *proposal,
                         float features[BSLAM_BLOB_FEATURES]);

#endif
