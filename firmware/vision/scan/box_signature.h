/// What a thing looks like, from a scanner's cells within its box: the paper's feature vector, by which
/// beacons are told apart. MATH-CAMERA "Signature of a box". Internal.
#ifndef BSLAM_VISION_SCAN_BOX_SIGNATURE_H
#define BSLAM_VISION_SCAN_BOX_SIGNATURE_H

#include "vision/scan/channels.h"

/// Where the parts of a signature start; what is behind them is 0.
/// COLOURS, 36: square roots of shares in 2 (light) x 3 (red against blue) x 6 (both against green) bins.
/// SHAPE, 16: how much of each of 4x4 parts is unlike the ring around the box.
/// LIGHT, 9: of 3x3 parts, in deviations. EDGES, 4: of each direction. ASPECT, 1: height against width.
enum {
    BSLAM_BOX_COLOURS = 0,
    BSLAM_BOX_SHAPE = 36,
    BSLAM_BOX_LIGHT = 52,
    BSLAM_BOX_EDGES = 61,
    BSLAM_BOX_ASPECT = 65,
    BSLAM_BOX_SIGNATURE = 66
};

/// Points across a box, and with one beyond it on either side, of the ring.
enum { BSLAM_BOX_GRID = 16, BSLAM_BOX_POINTS = BSLAM_BOX_GRID + 2 };

/// Logarithms of a cell's colours, 32 a doubling.
typedef struct bslam_box_tone {
    int16_t light;  ///< 128 a doubling
    int16_t red;    ///< against green
    int16_t blue;
} bslam_box_tone_t;

/// Scratch: a box's points, and how much of each is the thing, its middle above all.
typedef struct bslam_box_points {
    bslam_box_tone_t tones[BSLAM_BOX_POINTS][BSLAM_BOX_POINTS];  ///< with the ring
    int32_t edges[BSLAM_EDGE_DIRECTIONS];
    uint8_t mask[BSLAM_BOX_GRID][BSLAM_BOX_GRID];
    uint16_t weights[BSLAM_BOX_GRID][BSLAM_BOX_GRID];
    int32_t weight;  ///< sum
    int32_t light;   ///< means
    int32_t warmth;
    int32_t width;  ///< of the box, sixteenths of a pixel
    int32_t height;
} bslam_box_points_t;

/// Values from -1 to 1, of a box in a finished picture. Whole numbers until the end: the same bits
/// everywhere. No wall need be known: what is like the ring counts little, light and its warmth are the
/// thing's own. Some 40,000 instructions.
void bslam_box_signature(const bslam_channels_t *channels, const bslam_box_t *box, bslam_box_points_t *points,
                         float signature[BSLAM_SIGNATURE_SIZE]);

#endif
