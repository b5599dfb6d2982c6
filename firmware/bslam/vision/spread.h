/// Sums of pixels of RGB565, all three channels in one word.
#ifndef BSLAM_VISION_SPREAD_H
#define BSLAM_VISION_SPREAD_H

#include <stdint.h>

#include "bslam/math/bytes.h"

/// Where the channels of a pixel stand once spread: blue in bits 0-4, red in 11-15, green in 21-26. Above
/// each are 5 free bits or more, so that up to 32 pixels add up.
#define BSLAM_SPREAD_MASK 0x07E0F81FU
#define BSLAM_SPREAD_RED 11
#define BSLAM_SPREAD_GREEN 21

/// The sum of two pixels that are side by side in a word. The word, and the same turned by half, hold between
/// them each channel of each pixel in its spread place; which of the two came first does not matter.
static inline uint32_t bslam_spread_pair(uint32_t word)
{
    return (word & BSLAM_SPREAD_MASK) + (bslam_halves_turned(word) & BSLAM_SPREAD_MASK);
}

#endif
