/// How far one pattern of columns is shifted against another, and how far the robot drove meanwhile. Inside
/// of frame_rotation.c; MATH-CAMERA "Visual gyro".
#ifndef BSLAM_VISION_BUILT_IN_GYRO_COLUMN_SHIFT_H
#define BSLAM_VISION_BUILT_IN_GYRO_COLUMN_SHIFT_H

#include "vision/built_in/gyro/frame_rotation.h"

/// Two patterns, the later shifted against the earlier: its column i is the other's column i + shift.
typedef struct bslam_pattern_pair {
    const bslam_turn_pattern_t *before;
    const bslam_turn_pattern_t *now;
    int32_t columns;
    bslam_real_t step_rad;  ///< from a column to the next
} bslam_pattern_pair_t;

/// Patterns that lie over each other.
typedef struct bslam_pattern_match {
    bslam_real_t shift;          ///< columns
    bslam_real_t mismatch;       ///< part of the patterns' squares
    bslam_real_t mean_residual;  ///< of a value
} bslam_pattern_match_t;

/// The whole shift by which the patterns differ least. squares: scratch.
bslam_pattern_match_t bslam_shift_search(const bslam_pattern_pair_t *pair, bslam_turn_squares_t *squares);

/// The turn and the way by which all windows lie over the earlier pattern, each column shifted by its own
/// parallax, from a whole shift on. *way: before, what is thought of it; after, what the patterns say as
/// well. False, *way and *turn unchanged: nothing has a slope.
bool bslam_shift_fit(const bslam_pattern_pair_t *pair, const bslam_pattern_match_t *start,
                     const bslam_turn_column_t *columns, bslam_turn_way_t *way, bslam_turn_t *turn);

#endif
