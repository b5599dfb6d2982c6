/// From a box to a direction and a distance. MATH-CAMERA "Scanner". Internal.
#ifndef BSLAM_VISION_SCAN_BOX_CANDIDATE_H
#define BSLAM_VISION_SCAN_BOX_CANDIDATE_H

#include "vision/vision.h"

/// What was found in a picture of a camera, as a candidate without signature. It has no bearing where the
/// camera has no direction, and no range where the kind's height is not known or the picture cuts it off.
bslam_candidate_t bslam_box_candidate(const bslam_scan_kind_t *kind, const bslam_camera_t *camera,
                                      const bslam_detection_t *found);

#endif
