/// Direction and distance of an object from its outline, with standard deviations that hold. MATH
/// "Measuring".
#ifndef BSLAM_VISION_MEASURE_H
#define BSLAM_VISION_MEASURE_H

#include "bslam/vision/outline.h"

/// Refines the rough box and fills the candidate's outline, bearing, range, marks and signature; its class,
/// margin and score stay as they are. height_m is the object's real height, 0 if it is not known: then no
/// distance.
///
/// A candidate without has_bearing must not be used, marks says why; one without has_range has only a
/// direction. Signature values are 0 where none could be taken.
/// BSLAM_E_NOT_FINITE: the box or the height. BSLAM_E_RANGE: the box is empty or lies outside the frame, or
/// the height is outside 0 to 10 m. BSLAM_E_PARAMETER: the camera's frame has another size. *candidate is
/// then unchanged. The camera has passed bslam_camera_check.
BSLAM_MUST_CHECK bslam_status_t bslam_measure(const bslam_frame_t *frame, const bslam_camera_t *camera,
                                              const bslam_box_t *rough, bslam_real_t height_m,
                                              bslam_candidate_t *candidate);

#endif
