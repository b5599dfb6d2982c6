/// How far ahead an object is, from where its outline's upper and lower side are seen. Inside of measure.c;
/// MATH-CAMERA "Measuring".
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_DISTANCE_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_DISTANCE_H

#include "vision/built_in/measurement/measure.h"

typedef struct bslam_ahead {
    bslam_real_t inverse;       ///< 1/m
    bslam_real_t relative_var;  ///< of it
    bslam_real_t noise_var;     ///< the part of that which is another one in each frame, relative as well
    bslam_real_t residual_sds;  ///< by how much its two sides contradict its place; 0 without one
} bslam_ahead_t;

/// The angle of a pixel as it came from the camera: what is doubled is not known better.
bslam_real_t bslam_camera_pixel(const bslam_outline_t *outline, const bslam_camera_t *camera);

/// Of the place of an edge that is known to be the side: its variance.
bslam_real_t bslam_edge_variance(const bslam_outline_t *outline, const bslam_camera_t *camera);

/// By both sides. Its height is known, > 0.
bslam_ahead_t bslam_ahead(const bslam_outline_t *outline, const bslam_camera_t *camera,
                          const bslam_size_t *size);

/// The same; by the body alone where the width is nearer to that of an object seen without its neck.
bslam_ahead_t bslam_ahead_of_body(const bslam_outline_t *outline, const bslam_camera_t *camera,
                                  const bslam_size_t *size);

/// False if the width of something round contradicts that.
bool bslam_width_agrees(const bslam_outline_t *outline, const bslam_camera_t *camera,
                        const bslam_size_t *size, const bslam_ahead_t *ahead);

/// How wide the front is, meters.
bslam_real_t bslam_front_width_m(const bslam_outline_t *outline, const bslam_ahead_t *ahead);

#endif
