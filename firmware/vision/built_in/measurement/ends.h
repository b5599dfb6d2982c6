/// Where the upright sides are that an outline missed: a detector's box may reach as far as a neighbour's
/// edge, or end at a bar or a rib within the object. Inside of measure.c; MATH-CAMERA "Outline".
///
/// An outline is looked for a few pixels around a box. Farther off, the level sides tell: along the object
/// they are seen, beyond it they are not; and the colour, which is the object's or the wall's.
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_ENDS_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_ENDS_H

#include "vision/built_in/measurement/outline.h"

/// What is left open of where the two sides are.
typedef struct bslam_ends {
    bool moved;             ///< the box: the outline is to be found anew there
    bslam_real_t offset;    ///< across, from the middle to the mean of where it may be, by probability,
    bslam_real_t variance;  ///< and these places' variance
} bslam_ends_t;

/// Moves the left and the right side of the box that an outline was found in, each by up to 30 pixels, to
/// where the level sides, an upright edge, the colour and the width together say they are.
bslam_ends_t bslam_ends_move(const bslam_frame_t *frame, const bslam_camera_t *camera,
                             const bslam_outline_t *outline, const bslam_front_t *front, bslam_box_t *box);

#endif
