/// What a filter is told of a thing that the front end saw. MATH-CAMERA "Sighting noise".
#ifndef BSLAM_VISION_SIGHTING_H
#define BSLAM_VISION_SIGHTING_H

#include "bslam/base/types.h"
#include "bslam/vision/frame.h"

/// A candidate with has_bearing as a sighting, without identity; its signature stays where it is. The noise
/// is what changes from frame to frame, a distance's more of it the lower the score is, and a little that
/// nothing in a frame can tell; what repeats in each distance of the thing is range_scale_sd. O(1).
bslam_sighting_t bslam_sighting_of(const bslam_candidate_t *candidate);

#endif
