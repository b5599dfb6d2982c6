/// How a body on a wall stands towards the camera, from its upper and lower side. Inside of outline.c;
/// MATH-CAMERA "Outline".
///
/// Places are tangents in the plane of bslam_facing_t.
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_BODY_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_BODY_H

#include "vision/built_in/measurement/outline.h"
#include "vision/built_in/measurement/side.h"

/// What is known of an object's shape, as fractions of its height; 0: not known, or flat.
typedef struct bslam_shape {
    bslam_real_t depth;   ///< how far it stands out from the wall
    bslam_real_t narrow;  ///< its front is so wide at least,
    bslam_real_t wide;    ///< and at most
} bslam_shape_t;

/// What is known of a body before its turn is.
typedef struct bslam_body {
    bslam_real_t left;  ///< outermost upright sides, across: of its front, or of a flank
    bslam_real_t right;
    bslam_real_t top;  ///< roughly, up
    bslam_real_t bottom;
    bslam_real_t pixel;  ///< size of a frame pixel
    bslam_shape_t shape;
} bslam_body_t;

/// What is known of a turn before it is seen: its standard deviation. TURN_COST in orientation.c is the same.
#define BSLAM_TURN_SD BSLAM_R(0.85)

/// The body with this turn: its visible flank taken off. The flank's rear corner is `depth` behind the
/// front's, at right angles to it.
bslam_stance_t bslam_body_stance(const bslam_body_t *body, bslam_real_t turn);

/// Where the front's middle is seen with this turn, across: half way in plan between the front's two ends, of
/// which the farther one is seen nearer to it.
bslam_real_t bslam_body_middle(const bslam_body_t *body, bslam_real_t turn);

/// How wide a front that stands so is, in units of how far ahead it is.
bslam_real_t bslam_body_width(const bslam_stance_t *stance);

/// How an outline's body stands: its level sides run on along a flank that is at least so wide, across, and
/// as along the front where it is narrower.
bslam_stance_t bslam_outline_stance(const bslam_outline_t *outline, bslam_real_t flank_least);

#endif
