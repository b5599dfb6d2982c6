/// What a proposed box looks like, as numbers for the detector's machines.
///
/// The floor line gives the distance of the wall behind a box, so sizes and heights are in metres; the rest
/// is contrast to what surrounds the box, texture, and how the tone is spread over 3x3 zones of it.
#ifndef BSLAM_VISION_FEATURES_H
#define BSLAM_VISION_FEATURES_H

#include "bslam/vision/proposals.h"

/// The features of a proposal, all finite; tools/training sees them in this order.
void bslam_blob_features(const bslam_view_t *view, const bslam_proposal_t *proposal,
                         float features[BSLAM_BLOB_FEATURES]);

#endif
