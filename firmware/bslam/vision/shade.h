/// Colours of upright strips of an outline, light and dark left out: whether what is next to a side is the
/// object or the wall. Inside of ends.c; MATH "Outline".
#ifndef BSLAM_VISION_SHADE_H
#define BSLAM_VISION_SHADE_H

#include "bslam/vision/outline.h"
#include "bslam/vision/side.h"

/// Mean colour less its mean channel, of 255: a channel.
typedef struct bslam_shade {
    float red;
    float green;
    float blue;
} bslam_shade_t;

/// Between two places across, from the upper side to the lower one but for their margins. False, and *shade
/// unchanged, where the frame does not show all of it.
bool bslam_shade_between(const bslam_frame_t *frame, const bslam_facing_t *facing,
                         const bslam_outline_t *outline, bslam_real_t from, bslam_real_t to,
                         bslam_shade_t *shade);

/// How far apart two of them are, 0 to 1.
float bslam_shade_apart(const bslam_shade_t *a, const bslam_shade_t *b);

#endif
