/// Sums over the cells of a box and of the strips beside it: what its features are means of (features.h).
#ifndef BSLAM_VISION_BUILT_IN_DETECTION_BOX_SUMS_H
#define BSLAM_VISION_BUILT_IN_DETECTION_BOX_SUMS_H

#include "vision/built_in/detection/proposals.h"

/// Columns or rows of cells beside a box that count as its surroundings.
#define BSLAM_STRIP 2
/// A box has so many zones across and down.
#define BSLAM_BOX_ZONES 3

/// Sums over the cells of a zone.
typedef struct bslam_zone_sums {
    int32_t cells;
    int32_t light, reddish, bluish;
} bslam_zone_sums_t;

/// Sums over the cells of a rectangle; all whole numbers of 32 bits.
typedef struct bslam_sums {
    int32_t cells;
    int32_t light, reddish, bluish;
    int32_t spread;
    int32_t value;        ///< decision values of the cells
    int32_t wall, floor;  ///< how frequent the tones are in the zones' histograms
    // What follows only of what is inside the box.
    int32_t light_sq, reddish_sq, bluish_sq;
    int32_t step_x, step_y;
    int32_t likely;  ///< cells whose value is above 0
} bslam_sums_t;

/// Sums of a box's zones, and of the whole, which is within the frame: of every other row where a zone is
/// large, whose means are as good.
void bslam_sum_box(const bslam_view_t *view, const bslam_proposal_t *box,
                   bslam_zone_sums_t zones[BSLAM_BOX_ZONES * BSLAM_BOX_ZONES], bslam_sums_t *inside);

/// Sums of the strip along a side, outside, as far as it is in the frame.
bslam_sums_t bslam_sum_beside(const bslam_view_t *view, const bslam_proposal_t *box, bslam_box_side_t side);

#endif
