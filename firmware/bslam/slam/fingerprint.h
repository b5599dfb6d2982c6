/// One number for all that the filter knows, to compare two machines step by step without sending the state.
#ifndef BSLAM_SLAM_FINGERPRINT_H
#define BSLAM_SLAM_FINGERPRINT_H

#include "bslam/slam/slam.h"

/// Goes on with a chain of fingerprints: the size of the state, its mean and its covariance, and where a
/// smoother is attached all that its window holds, where looks are the weights of every classifier, bit for
/// bit. FNV-1a, 64 bits, over 32-bit words. Once two chains differ they stay different while the states that
/// follow are equal. O(n²), O(what is kept) more with a smoother, O(BSLAM_LEARNER_SLOTS) with looks.
uint64_t bslam_slam_fingerprint(const bslam_slam_t *slam, uint64_t before);

#endif
