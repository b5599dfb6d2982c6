/// Where a beacon may be: cells that hang together become boxes.
///
/// One segmentation misses much: an object whose middle looks like wall falls apart at a high threshold, two
/// neighbours run together at a low one. So several run over the same cells: by the cell machine's values at
/// different levels, and by where the colour steps.
#ifndef BSLAM_VISION_BUILT_IN_DETECTION_PROPOSALS_H
#define BSLAM_VISION_BUILT_IN_DETECTION_PROPOSALS_H

#include "vision/built_in/detection/cells.h"

/// Segmentations of a frame; boxes found otherwise have numbers from here on.
#define BSLAM_SEGMENTATIONS 5

/// A box in which there may be a beacon.
typedef struct bslam_proposal {
    int16_t left;  ///< in cells: [left, right) by [top, bottom); the outermost ones hold its edges
    int16_t top;
    int16_t right;
    int16_t bottom;
    uint16_t cells;        ///< of the component
    uint8_t segmentation;  ///< which found it first
    bslam_box_t box;       ///< to the pixel
} bslam_proposal_t;

/// Cells side by side that a segmentation joins.
#if BSLAM_CELLS_MAX > 4800
#define BSLAM_RUNS_MAX 4096
#else
#define BSLAM_RUNS_MAX 1024
#endif
typedef struct bslam_run {
    uint16_t parent;
    uint16_t cells;
    uint8_t row;  ///< the run's own: columns [first, end) of this row
    uint8_t first;
    uint8_t end;
    uint32_t extent;  ///< of all joined to it, if it is their root (proposals.c)
} bslam_run_t;

typedef struct bslam_proposals {
    int32_t count;
    uint32_t runs_dropped;   ///< since init: a frame so broken up that BSLAM_RUNS_MAX did not suffice
    uint32_t boxes_dropped;  ///< since init: BSLAM_PROPOSALS_MAX did not suffice
    bslam_proposal_t items[BSLAM_PROPOSALS_MAX];
    bslam_run_t *runs;  ///< scratch of bslam_proposals_find, and NULL after it
    uint32_t *mask;
} bslam_proposals_t;

/// Moves each side of a box by up to a cell to where the colour steps most along it, then adds the box,
/// unless it is known or there is no room.
void bslam_proposals_add(bslam_proposals_t *proposals, const bslam_view_t *view,
                         const bslam_proposal_t *proposal);

/// Sides of a box.
typedef enum bslam_box_side {
    BSLAM_BOX_LEFT = 0,
    BSLAM_BOX_RIGHT = 1,
    BSLAM_BOX_TOP = 2,
    BSLAM_BOX_BOTTOM = 3,
    BSLAM_BOX_SIDES = 4
} bslam_box_side_t;

/// A cell's step counts so much at most along an edge; above the other it is clearly one.
#define BSLAM_EDGE_STEP_MAX 60
#define BSLAM_EDGE_STEP_MIN 8

/// How the colour steps across a line of cells.
typedef struct bslam_cell_edge {
    float step;   ///< mean over the line; a cell counts 60 at most
    float share;  ///< of the cells that step by more than 8
} bslam_cell_edge_t;

/// The edge along a column (sides left, right) or row (top, bottom) of cells, between the box's other sides.
/// All zero outside the frame.
bslam_cell_edge_t bslam_edge_along(const bslam_view_t *view, const bslam_proposal_t *box,
                                   bslam_box_side_t side, int32_t line);

/// Finds the boxes: at most BSLAM_PROPOSALS_MAX, none twice. Scratch, whose content does not matter before or
/// after: BSLAM_RUNS_MAX runs, twice BSLAM_MASK_WORDS words.
void bslam_proposals_find(bslam_proposals_t *proposals, const bslam_view_t *view, bslam_run_t *runs,
                          uint32_t *mask);

/// Intersection over union of two boxes.
bslam_real_t bslam_box_overlap(const bslam_box_t *a, const bslam_box_t *b);

#endif
