/// What the front and the flank of a body look like: an edge lies between them, and shelves, drawers and ribs
/// are on fronts. Inside of orientation.c; MATH-CAMERA "Outline".
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_SIDE_FACE_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_SIDE_FACE_H

#include "vision/built_in/measurement/body.h"

/// Upright lines of a body that are looked along, from left to right.
#define BSLAM_BUSY_LINES 16

/// How much the light changes along each, but for its busiest third: standard deviations, of 255; below 0
/// where the frame does not show it.
typedef struct bslam_busyness {
    float lines[BSLAM_BUSY_LINES];
} bslam_busyness_t;

bslam_busyness_t bslam_busyness_of(const bslam_frame_t *frame, const bslam_facing_t *facing,
                                   const bslam_body_t *body);

/// What the looks of its front and its flank say for a stance, the logarithm of odds; 0 if no flank is seen
/// at it.
float bslam_flank_evidence(const bslam_frame_t *frame, const bslam_facing_t *facing, const bslam_body_t *body,
                           const bslam_stance_t *stance, const bslam_busyness_t *busy);

#endif
