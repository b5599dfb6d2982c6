/// Which way a body is turned: by its level sides, by how wide its front may be, and by what front and flank
/// look like. Inside of outline.c; MATH-CAMERA "Outline".
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_ORIENTATION_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_ORIENTATION_H

#include "vision/built_in/measurement/body.h"

/// The upper and the lower edge, and the turn at which they were found.
typedef struct bslam_level {
    bslam_edge_t top;
    bslam_edge_t bottom;
    bslam_real_t turn;
    bslam_real_t
        middle_offset;        ///< from the front's middle there to the mean of all, by their probabilities,
    bslam_real_t middle_var;  ///< and these places' variance
} bslam_level_t;

/// Finds them. Two lines that are level in the room meet at the horizon, so one turn serves both. False if
/// the lens does not see a side.
bool bslam_body_level(const bslam_body_t *body, const bslam_frame_t *frame, const bslam_facing_t *facing,
                      bslam_level_t *level);

#endif
