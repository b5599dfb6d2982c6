/// Is an outline that of a part of something larger? Inside of measure.c; MATH-CAMERA "Outline".
///
/// A window's bar or a radiator's rib looks like a side. But a whole object's upper and lower side end where
/// its upright sides are; where they go on beyond, the outline is that of a part, and so is its middle.
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_PARTIAL_VIEW_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_PARTIAL_VIEW_H

#include "vision/built_in/measurement/outline.h"

/// True if the level sides go on beyond an upright one, as far as the frame shows. `rough` is the box that
/// the outline was found in: where it touches the frame's upper or lower edge there is no level side. Sides
/// that the marks call cut off are not asked.
bool bslam_outline_is_part(const bslam_frame_t *frame, const bslam_camera_t *camera, const bslam_box_t *rough,
                           const bslam_outline_t *outline, unsigned marks);

/// How much of the contrast of the two level sides is seen beyond the left or the right end, as far as the
/// frame goes and at most as is_part looks: 0 to 1. Below 0 if there is no room.
float bslam_outline_beyond(const bslam_frame_t *frame, const bslam_camera_t *camera,
                           const bslam_outline_t *outline, bool left);

#endif
