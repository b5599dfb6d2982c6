/// Boxes between two upright edges, as high as beacons are: what a component does not give where a beacon has
/// the wall's colour.
///
/// The floor line is height 0 and the horizon the camera's height, so in each column a row is a height on the
/// wall. Where the colour steps sideways along all of a kind's height there may be a side of it; two such
/// columns a plausible width apart make a box.
#ifndef BSLAM_VISION_BUILT_IN_DETECTION_VERTICAL_EDGES_H
#define BSLAM_VISION_BUILT_IN_DETECTION_VERTICAL_EDGES_H

#include "vision/built_in/detection/proposals.h"

/// Adds boxes to those known. `steps` is scratch, whose content does not matter before or after.
void bslam_vertical_edges_propose(bslam_proposals_t *proposals, const bslam_view_t *view,
                                  bslam_edge_steps_t *steps);

#endif
