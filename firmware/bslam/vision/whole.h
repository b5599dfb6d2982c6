/// The outline of a whole object, where a detector's box shows only a part of it. Inside of measure.c; MATH
/// "Outline".
///
/// A radiator's last ribs or a window's bar look like a side. But a whole object's upper and lower side end
/// where its upright sides are; where they go on beyond, the box is that of a part.
#ifndef BSLAM_VISION_WHOLE_H
#define BSLAM_VISION_WHOLE_H

#include "bslam/vision/outline.h"

typedef struct bslam_whole {
    bslam_box_t rough;  ///< the box, as wide as it had to be drawn
    bslam_outline_t outline;
    bool left_goes_on;  ///< its level sides go on to the left, and no box was found that they end in
    bool right_goes_on;
} bslam_whole_t;

/// As bslam_outline_find, but draws the box wider until the level sides end with it. Costs one more
/// bslam_outline_find for each time, WIDEN_ROUNDS at most.
BSLAM_MUST_CHECK bslam_status_t bslam_whole_find(const bslam_frame_t *frame, const bslam_camera_t *camera,
                                                 const bslam_box_t *rough, bslam_real_t depth,
                                                 bslam_whole_t *whole);

#endif
