/// Colours along upright lines of the facing plane: whether what is next to a side is the object or the wall,
/// and whether it is busy or plain. Inside of ends.c and side_face.c; MATH-CAMERA "Outline".
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_SHADE_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_SHADE_H

#include "vision/built_in/measurement/outline.h"
#include "vision/built_in/measurement/side.h"

/// So many points a line at most.
#define BSLAM_LINE_POINTS_MAX 12

/// Colours at `count` points, evenly, of the upright line at a place across, from `top` to `bottom`, but for
/// a margin at either end. False where the frame does not show all of it.
bool bslam_line_colours(const bslam_frame_t *frame, const bslam_facing_t *facing, bslam_real_t at,
                        bslam_real_t top, bslam_real_t bottom, int32_t count,
                        bslam_rgb_t colours[BSLAM_LINE_POINTS_MAX]);

/// Mean colour less its mean channel, of 255: a channel.
typedef struct bslam_shade {
    float red;
    float green;
    float blue;
} bslam_shade_t;

/// Between two places across, light and dark left out, from the upper side to the lower one. False, and
/// *shade unchanged, where the frame does not show all of it.
bool bslam_shade_between(const bslam_frame_t *frame, const bslam_facing_t *facing,
                         const bslam_outline_t *outline, bslam_real_t from, bslam_real_t to,
                         bslam_shade_t *shade);

/// How far apart two of them are, 0 to 1.
float bslam_shade_apart(const bslam_shade_t *a, const bslam_shade_t *b);

#endif
