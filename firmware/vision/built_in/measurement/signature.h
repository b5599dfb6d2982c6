/// What an object looks like, in 71 numbers: the paper's feature vector, by which beacons are told apart.
/// MATH-CAMERA "Signature".
///
/// Taken from the half-resolution copy inside the outline. Colours are divided by the running colour of the
/// wall, so that neither the light's strength nor its colour, nor the camera's exposure, changes them; then
/// split into light, red against green, and yellow against blue.
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_SIGNATURE_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_SIGNATURE_H

#include "vision/built_in/measurement/outline.h"

/// Where the parts of a signature start.
/// COLOURS, 48: 1.4 times the square root of the share of pixels in each of 3 (light) x 4 (red-green) x 4
/// (yellow-blue) bins; a pixel is shared among the eight bins around its colour.
/// BANDS, 18: mean light, red-green and yellow-blue in each sixth of the height, from above.
/// ASPECT, 1: half of (height - width) / (height + width).
/// TEXTURE, 4: deviation of light, and of colour; mean change of light from one pixel to the next across, and
/// down; all against the mean light.
enum {
    BSLAM_SIGNATURE_COLOURS = 0,
    BSLAM_SIGNATURE_BANDS = 48,
    BSLAM_SIGNATURE_ASPECT = 66,
    BSLAM_SIGNATURE_TEXTURE = 67
};

/// The signature of what `quad` encloses: values from -1 to 1. BSLAM_E_RANGE, and nothing written, if that is
/// fewer than 12 pixels of the half-resolution copy, or the wall is black (a channel below 4 of 255).
BSLAM_MUST_CHECK bslam_status_t bslam_signature(const bslam_frame_t *frame, const bslam_quad_t *quad,
                                                float signature[BSLAM_SIGNATURE_SIZE]);

#endif
