/// What an object looks like, in 71 numbers: the paper's feature vector, by which beacons are told apart.
/// MATH "Signature".
///
/// Taken from the half-resolution copy inside the outline. Colours are divided by the running colour of the
/// wall, so that neither the light's strength nor its colour, nor the camera's exposure, changes them.
#ifndef BSLAM_VISION_SIGNATURE_H
#define BSLAM_VISION_SIGNATURE_H

#include "bslam/vision/outline.h"

/// Where the parts of a signature start.
enum {
    BSLAM_SIGNATURE_COLOURS = 0,    ///< 64: square root of the share of pixels in each of 4x4x4 colour bins
    BSLAM_SIGNATURE_ASPECT = 64,    ///< (height - width) / (height + width)
    BSLAM_SIGNATURE_CONTRAST = 65,  ///< 3: how much red, green and blue vary over the object
    BSLAM_SIGNATURE_EDGES = 68      ///< 3: how much they vary from one pixel to the next
};

/// The signature of what `quad` encloses. BSLAM_E_RANGE, and nothing written, if that is fewer than 12 pixels
/// of the half-resolution copy, or the wall is black (a channel below 4 of 255).
BSLAM_MUST_CHECK bslam_status_t bslam_signature(const bslam_frame_t *frame, const bslam_quad_t *quad,
                                                float signature[BSLAM_SIGNATURE_SIZE]);

#endif
