/// How many bytes an instance takes, from config.h: so that bslam_vision_t can be a plain variable, and what
/// stands in it be the library's own. The library does not compile where a sum is too small; a test holds
/// what is too much below 2 %. docs/SIZES.md prints them.
#ifndef BSLAM_VISION_SIZE_H
#define BSLAM_VISION_SIZE_H

#include "vision/config.h"

/// Of a number and of an address.
#define BSLAM_VISION_SIZE_REAL (BSLAM_REAL_DOUBLE ? 8 : 4)
enum { BSLAM_VISION_SIZE_POINTER = sizeof(void *) };
#define BSLAM_VISION_SIZE_LARGER(a, b) ((a) > (b) ? (a) : (b))

/// A picture's cells of 4x4 pixels, with room for loops that go 16 at a time; columns of them; pixels of its
/// half-resolution copy; and words of two masks, a bit a cell.
#define BSLAM_VISION_SIZE_COLUMNS (BSLAM_IMAGE_WIDTH_MAX / 4)
#define BSLAM_VISION_SIZE_CELLS (BSLAM_VISION_SIZE_COLUMNS * (BSLAM_IMAGE_HEIGHT_MAX / 4) + 32)
#define BSLAM_VISION_SIZE_HALF ((BSLAM_IMAGE_WIDTH_MAX / 2) * (BSLAM_IMAGE_HEIGHT_MAX / 2))
#define BSLAM_VISION_SIZE_MASKS (2 * (BSLAM_IMAGE_HEIGHT_MAX / 4) * ((BSLAM_VISION_SIZE_COLUMNS + 31) / 32))

/// A camera: its lens, its machine of cells, its memory of the room.
#define BSLAM_VISION_SIZE_CAMERA (3188 + (BSLAM_REAL_DOUBLE ? 96 : 52))

/// A candidate, and what is thought of a box before.
#define BSLAM_VISION_SIZE_CANDIDATE (BSLAM_REAL_DOUBLE ? 384 : 344)
#define BSLAM_VISION_SIZE_FOUND \
    (BSLAM_CANDIDATES_MAX * BSLAM_VISION_SIZE_CANDIDATE + 24 * ((169 + BSLAM_VISION_SIZE_POINTER) / 8 * 8))
/// Scratch that one stage after the other uses: sums of rows, tables of channels, runs of cells, candidates.
#define BSLAM_VISION_SIZE_RUNS (BSLAM_VISION_SIZE_CELLS > 4832 ? 49152 : 12288)
#define BSLAM_VISION_SIZE_SCRATCH BSLAM_VISION_SIZE_LARGER(BSLAM_VISION_SIZE_RUNS, BSLAM_VISION_SIZE_FOUND)

/// The picture as it is kept: cells or what is made of them, and its half-resolution copy.
#define BSLAM_VISION_SIZE_NOTES \
    (3 * BSLAM_VISION_SIZE_CELLS + \
     BSLAM_VISION_SIZE_LARGER( \
         6144, BSLAM_VISION_SIZE_LARGER(4 * BSLAM_VISION_SIZE_MASKS, 6 * BSLAM_VISION_SIZE_COLUMNS)))
#define BSLAM_VISION_SIZE_THUMBNAIL \
    (16 + BSLAM_VISION_SIZE_LARGER(4 * BSLAM_VISION_SIZE_CELLS, BSLAM_VISION_SIZE_NOTES) + \
     2 * BSLAM_VISION_SIZE_HALF)

#define BSLAM_VISION_SIZE_PROPOSALS \
    (BSLAM_PROPOSALS_MAX * (BSLAM_REAL_DOUBLE ? 48 : 28) + 2 * BSLAM_VISION_SIZE_POINTER + 16)

#define BSLAM_VISION_SIZE_FRONT_END \
    (BSLAM_CAMERAS_MAX * BSLAM_VISION_SIZE_CAMERA + BSLAM_VISION_SIZE_SCRATCH + \
     BSLAM_VISION_SIZE_THUMBNAIL + BSLAM_VISION_SIZE_PROPOSALS + \
     BSLAM_VISION_SIZE_COLUMNS * (4 + BSLAM_VISION_SIZE_REAL) + 6 * BSLAM_VISION_SIZE_CELLS + \
     BSLAM_VISION_SIZE_POINTER + 72)

/// The scanner: cells of four sizes of the picture with what makes them, rows of the size in between, boxes.
#define BSLAM_VISION_SIZE_OCTAVE \
    (32 + BSLAM_VISION_SIZE_POINTER + 3 * (BSLAM_IMAGE_WIDTH_MAX + 8) + 18 * BSLAM_VISION_SIZE_COLUMNS)
#define BSLAM_VISION_SIZE_LEVEL_ROW (8 * (BSLAM_VISION_SIZE_COLUMNS + 4))
#define BSLAM_SCANNER_BYTES \
    ((4 * BSLAM_VISION_SIZE_OCTAVE + 8 + 4 * BSLAM_VISION_SIZE_COLUMNS + 2 * BSLAM_IMAGE_WIDTH_MAX + \
      8 * ((BSLAM_VISION_SIZE_COLUMNS * (BSLAM_IMAGE_HEIGHT_MAX / 4) * 4 + 2) / 3) + \
      BSLAM_VISION_SIZE_LARGER(27 * BSLAM_VISION_SIZE_LEVEL_ROW, 2752) + 128 * 24 + \
      (BSLAM_REAL_DOUBLE ? 48 : 32) * BSLAM_CANDIDATES_MAX + BSLAM_VISION_SIZE_POINTER + 64 + 7) / \
     8 * 8)
/// With the cameras of a robot, and what it sees.
#define BSLAM_VISION_SIZE_RIG_SCANNER \
    (BSLAM_SCANNER_BYTES + BSLAM_CAMERAS_MAX * (BSLAM_REAL_DOUBLE ? 96 : 52) + \
     BSLAM_VISION_SIZE_LARGER(3 * BSLAM_IMAGE_WIDTH_MAX, \
                              BSLAM_CANDIDATES_MAX * BSLAM_VISION_SIZE_CANDIDATE) + \
     2 * BSLAM_VISION_SIZE_POINTER + 72)

/// Turns between pictures: for each camera where its columns are and what it saw last; and scratch.
#define BSLAM_VISION_SIZE_TURN_COLUMNS (BSLAM_IMAGE_WIDTH_MAX / 2)
#define BSLAM_VISION_SIZE_PATTERN (6 * BSLAM_VISION_SIZE_TURN_COLUMNS + 3 * BSLAM_VISION_SIZE_REAL)
#define BSLAM_VISION_SIZE_GRID \
    (BSLAM_VISION_SIZE_TURN_COLUMNS * (BSLAM_VISION_SIZE_TURN_COLUMNS > 256 ? 4 : 2) + 16 + \
     4 * BSLAM_VISION_SIZE_REAL)
#define BSLAM_VISION_SIZE_TURNS \
    (BSLAM_VISION_TURNS * \
     (BSLAM_CAMERAS_MAX * (BSLAM_VISION_SIZE_GRID + BSLAM_VISION_SIZE_PATTERN) + BSLAM_VISION_SIZE_PATTERN + \
      2 * BSLAM_VISION_SIZE_REAL + BSLAM_VISION_SIZE_TURN_COLUMNS * 2 * BSLAM_VISION_SIZE_REAL + 16))

#define BSLAM_VISION_BYTES \
    ((8 + \
      BSLAM_VISION_SIZE_LARGER(BSLAM_VISION_BUILT_IN * BSLAM_VISION_SIZE_FRONT_END, \
                               BSLAM_VISION_SIZE_RIG_SCANNER) + \
      BSLAM_VISION_SIZE_TURNS + 7) / \
     8 * 8)

/// The visual gyro: a state, its covariance, and each camera's last picture.
#define BSLAM_VISION_SIZE_STATES (3 + 2 * BSLAM_CAMERAS_MAX)
#define BSLAM_VISUAL_GYRO_BYTES \
    ((8 * BSLAM_CAMERAS_MAX + \
      BSLAM_VISION_SIZE_REAL * (BSLAM_VISION_SIZE_STATES * (BSLAM_VISION_SIZE_STATES + 1) + 4) + 8 + 7) / \
     8 * 8)

/// Differs where sizes do, so that library and application notice: bslam_vision_init.
#define BSLAM_VISION_MIX(hash, value) ((hash) * 16777619u + (value))
#define BSLAM_VISION_HASH_OF_IMAGE \
    BSLAM_VISION_MIX( \
        BSLAM_VISION_MIX(BSLAM_VISION_MIX(2166136261u, BSLAM_REAL_DOUBLE), BSLAM_IMAGE_WIDTH_MAX), \
        BSLAM_IMAGE_HEIGHT_MAX)
#define BSLAM_VISION_HASH \
    BSLAM_VISION_MIX( \
        BSLAM_VISION_MIX(BSLAM_VISION_MIX(BSLAM_VISION_MIX(BSLAM_VISION_HASH_OF_IMAGE, BSLAM_CAMERAS_MAX), \
                                          BSLAM_PROPOSALS_MAX), \
                         BSLAM_CANDIDATES_MAX), \
        2 * BSLAM_VISION_BUILT_IN + BSLAM_VISION_TURNS)

#endif
