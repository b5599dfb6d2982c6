/// What ends next to the frame's edge: cut off there, or whole. Inside of measure.c; MATH-CAMERA "Measuring".
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_TRUNCATION_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_TRUNCATION_H

#include "vision/built_in/measurement/measure.h"

/// Marks of a box that comes near the frame's edge.
unsigned bslam_cut_marks(const bslam_frame_t *frame, const bslam_box_t *box);

/// Whether a box is near the frame's left or right edge, not both, by its marks.
bool bslam_cut_on_one_side(unsigned marks);

/// How likely it is that something near the frame's left or right edge ends there, 0 to 1. `rough` is the box
/// that the outline was found in, `marks` are all of both.
float bslam_cut_whole_chance(const bslam_frame_t *frame, const bslam_camera_t *camera,
                             const bslam_box_t *rough, const bslam_outline_t *outline,
                             const bslam_size_t *size, unsigned marks);

/// A direction and its standard deviation.
typedef struct bslam_bearing {
    bslam_real_t angle_rad;  ///< in the robot's frame
    bslam_real_t sd_rad;
} bslam_bearing_t;

/// Rough direction of something that the frame cuts off on one side: from the end that is seen it reaches as
/// far as its kind is wide, at the distance that its height and place tell, and beyond the frame's edge at
/// least. `marks` tell which side, and which of its level sides are not there. False, and *bearing unchanged,
/// if its size is not known or its distance is hardly told.
bool bslam_cut_bearing(const bslam_outline_t *outline, const bslam_camera_t *camera, const bslam_size_t *size,
                       unsigned marks, bslam_bearing_t *bearing);

#endif
