/// Direction and distance of an object from its outline, with standard deviations that hold. MATH
/// "Measuring".
#ifndef BSLAM_VISION_MEASURE_H
#define BSLAM_VISION_MEASURE_H

#include "bslam/vision/outline.h"

/// What is known of an object's size.
typedef struct bslam_size {
    bslam_real_t height_m;  ///< 0: not known
    bslam_real_t depth_m;   ///< how far it stands out from the wall; 0: it is flat, or not known
} bslam_size_t;

/// Refines the rough box and fills the candidate's outline, bearing, range, marks and signature; its class,
/// margin and score stay as they are. Without a height there is no distance; without the right depth a body's
/// flank is taken for a part of its front, and its middle is off by half of what the flank takes.
///
/// A candidate without has_bearing must not be used, marks says why; one without has_range has only a
/// direction. Signature values are 0 where none could be taken.
/// BSLAM_E_NOT_FINITE: the box or the height. BSLAM_E_RANGE: the box is empty or lies outside the frame, or
/// the height is outside 0 to 10 m. BSLAM_E_PARAMETER: the camera's frame has another size. *candidate is
/// then unchanged. The camera has passed bslam_camera_check.
BSLAM_MUST_CHECK bslam_status_t bslam_measure(const bslam_frame_t *frame, const bslam_camera_t *camera,
                                              const bslam_box_t *rough, const bslam_size_t *size,
                                              bslam_candidate_t *candidate);

#endif
