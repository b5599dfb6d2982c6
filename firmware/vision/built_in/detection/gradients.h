/// What the pixels of a box show, in a closer look than its cells allow (features.h): where edges run and
/// which way, in bytes.
///
/// The box and a quarter of it on each side, in the half-resolution copy, are seen as 24x24 samples of light.
/// Of 6x6 cells of these it tells how much light changes in each of four directions, against what changes
/// around the cell (histograms of oriented gradients: Dalal and Triggs, 2005). And for each column of
/// samples, in three bands of the box, how much light changes across it, for each row down it, against the
/// mean: sides, frames and bars stand where they stand, to a sample. Whole numbers throughout, the same on
/// every core.
#ifndef BSLAM_VISION_BUILT_IN_DETECTION_GRADIENTS_H
#define BSLAM_VISION_BUILT_IN_DETECTION_GRADIENTS_H

#include "vision/built_in/classifiers/beacon_model.h"
#include "vision/frame.h"

/// Writes the features of a box, which may reach beyond the frame: there its edge goes on. The box is within
/// 1e5 px, its sides are 1 px or more. In order: cells row by row, their directions (level change, rising,
/// upright change, falling) within; columns' changes by bands, upper first; rows' changes by bands, left
/// first. About 20 thousand instructions on a Cortex-M4F.
void bslam_patch_features(const bslam_frame_t *frame, const bslam_box_t *box,
                          uint8_t features[BSLAM_PATCH_FEATURES]);

#endif
