/// Direction and distance of an object from its outline, with standard deviations that hold. MATH-CAMERA
/// "Measuring".
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_MEASURE_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_MEASURE_H

#include "vision/built_in/measurement/outline.h"

/// What is known of an object's size.
typedef struct bslam_size {
    bslam_real_t height_m;    ///< 0: not known
    bslam_real_t depth_m;     ///< how far it stands out from the wall; 0: it is flat, or not known
    bslam_real_t top_low_m;   ///< its upper side is so high above the floor at least,
    bslam_real_t top_high_m;  ///< and at most; 0: not known
    bslam_real_t width_m;     ///< of what is as wide from every side; 0: it is not, or not known
    bslam_real_t body_m;      ///< its height where only the body below its neck is found; 0: it has none
    bslam_real_t narrow_m;    ///< its front is so wide at least,
    bslam_real_t wide_m;      ///< and at most; 0: not known
    bslam_real_t looks_sd;    ///< what its looks make of a distance by its height, as a fraction
    bslam_real_t scale_sd;    ///< by what part all its distances err alike; 0: as the error of one tells
} bslam_size_t;

/// Refines the rough box and fills the candidate's outline, bearing, range, marks and signature; its class,
/// margin and score stay as they are. The box may be 4 pixels off on each side, an upright one up to 30 where
/// the level sides tell that (MATH-CAMERA "Outline"). Without a height there is no distance; without the
/// right depth a body's flank is taken for a part of its front, and its middle is off by half of what the
/// flank takes.
///
/// Marked and not measured: what is small (less than 5 px wide or 8 px high), or seen to be turned by a
/// tangent of more than 1.5; and a part, whose level sides go on beyond it, unless it is as wide as its kind
/// can be. What is cut off to the left or to the right has a rough direction, from the end that is seen and
/// how wide its kind is, if that is known; what is cut off on both sides has none. What ends within 7 pixels
/// of the frame's edge may be either: its direction is the mean of both by how likely they are, and it bears
/// no mark from a chance of 0.9 on that it is whole. What is cut off above or below has a direction and no
/// distance; nor has one whose distance would be less certain than 15 %, or that would hang elsewhere than
/// its kind. What is much narrower than its kind is taken for half hidden: marked, its direction as rough as
/// what is missing makes it, its distance by its height. That something hides less of it, or of a kind whose
/// width is not known, is not noticed. A candidate without has_bearing must not be used. Signature values are
/// 0 where none could be taken.
///
/// The standard deviations are those of the errors left, of which a large part repeats from frame to frame:
/// they come from the object's appearance, not from noise. BSLAM_E_NOT_FINITE: the box or
/// the size. BSLAM_E_RANGE: the box is empty or lies outside the frame, the size is outside 0 to 10 m or
/// deeper than twice its height, or the lens sees no upright object there. BSLAM_E_PARAMETER: the camera's
/// frame has another size. *candidate is then unchanged. The camera has passed bslam_camera_check.
BSLAM_MUST_CHECK bslam_status_t bslam_measure(const bslam_frame_t *frame, const bslam_camera_t *camera,
                                              const bslam_box_t *rough, const bslam_size_t *size,
                                              bslam_candidate_t *candidate);

/// Adds a relative variance to a candidate's distance, if it has one: of an error that all distances of the
/// thing have in common. One that is less certain than 15 % then is none. O(1).
void bslam_measure_doubt(bslam_candidate_t *candidate, bslam_real_t relative_var);

#endif
