/// Sides of a box move to where the colour steps most.
#ifndef BSLAM_VISION_BUILT_IN_DETECTION_BOX_REFINEMENT_H
#define BSLAM_VISION_BUILT_IN_DETECTION_BOX_REFINEMENT_H

#include "vision/built_in/detection/proposals.h"

/// The box with each side on its line of cells or the next one outside, whichever has the stronger edge; on
/// the next one inside only where both have none, since what is inside has edges of its own. box.box is then
/// to the pixel. The same box where its sides would meet.
bslam_proposal_t bslam_box_refined(const bslam_view_t *view, const bslam_proposal_t *rough);

#endif
