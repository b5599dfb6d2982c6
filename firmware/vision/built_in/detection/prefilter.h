/// A first glance at a proposed box: numbers that cost a fifth of its features (features.h), enough to drop
/// most boxes before these are worked out. A few rows of cells stand for the box, a line of cells for what is
/// beside it, every few cells for a long side; directions are taken for straight in pixels.
#ifndef BSLAM_VISION_BUILT_IN_DETECTION_PREFILTER_H
#define BSLAM_VISION_BUILT_IN_DETECTION_PREFILTER_H

#include "vision/built_in/detection/proposals.h"

/// The numbers of a glance, all finite; tools/training sees them in this order.
void bslam_box_prefilter(const bslam_view_t *view, const bslam_proposal_t *box,
                         float glance[BSLAM_GLANCE_FEATURES]);

#endif
