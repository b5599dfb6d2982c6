/// Which way a body is turned: by its level sides, by how wide its front may be, and by what front and flank
/// look like. Inside of body.c; MATH-CAMERA "Outline".
#ifndef BSLAM_VISION_TURNS_H
#define BSLAM_VISION_TURNS_H

#include "bslam/vision/body.h"

/// A body's upper and lower side, looked at.
typedef struct bslam_level_sides {
    bslam_side_t top;
    bslam_side_t bottom;
} bslam_level_sides_t;

/// The stance at which both sides are likeliest; its turn, and what the others leave open of the front's
/// middle, go into *level.
bslam_stance_t bslam_turns_best(const bslam_frame_t *frame, const bslam_facing_t *facing,
                                const bslam_level_sides_t *sides, const bslam_body_t *body,
                                bslam_level_t *level);

#endif
