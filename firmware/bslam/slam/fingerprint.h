/// One number for all that the filter knows, to compare two robots step by step without sending the state.
#ifndef BSLAM_SLAM_FINGERPRINT_H
#define BSLAM_SLAM_FINGERPRINT_H

#include "bslam/slam/slam.h"

/// Goes on with a chain of fingerprints: the state, all that a smoother keeps, and the weights of every
/// classifier, bit for bit. FNV-1a, 64 bits, over 32-bit words. O(n² + what is kept).
uint64_t bslam_slam_fingerprint(const bslam_slam_t *slam, uint64_t before);

#endif
