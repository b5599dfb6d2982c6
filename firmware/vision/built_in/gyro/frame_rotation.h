/// How far the robot turned between two frames of a camera, by how far the pattern of the columns went
/// sideways. MATH-CAMERA "Visual gyro". Internal: vision.h has bslam_vision_turn.
#ifndef BSLAM_VISION_BUILT_IN_GYRO_FRAME_ROTATION_H
#define BSLAM_VISION_BUILT_IN_GYRO_FRAME_ROTATION_H

#include "vision/built_in/front_end.h"

enum {
    BSLAM_TURN_BANDS = 6,        ///< of rows, from the horizon up
    BSLAM_TURN_SHIFT_MAX = 24,   ///< columns of the half-resolution copy: what turns farther is not found
    BSLAM_TURN_WINDOW = 8,       ///< columns that are compared as one: what stands there is equally near
    BSLAM_TURN_SEARCH_STEP = 2,  ///< the search for the nearest whole shift takes every second column
};
#define BSLAM_TURN_COLUMNS (BSLAM_IMAGE_WIDTH_MAX / 2)
/// A place in 256ths of a column.
#if BSLAM_TURN_COLUMNS > 256
typedef uint32_t bslam_turn_place_t;
#else
typedef uint16_t bslam_turn_place_t;
#endif

/// What a camera saw last: the brightness of each column less that of its neighbourhood.
typedef struct bslam_turn_pattern {
    bool known;
    bslam_real_t yaw_rad;  ///< of the camera then
    int8_t values[BSLAM_TURN_BANDS][BSLAM_TURN_COLUMNS];
} bslam_turn_pattern_t;

/// Where a camera's columns are. They stand at equal angles, from the frame's left edge to its right.
typedef struct bslam_turn_grid {
    bslam_real_t first_rad;  ///< of the first, from the camera's axis, positive to the left
    bslam_real_t step_rad;   ///< to the next, to the right
    bslam_turn_place_t at_px[BSLAM_TURN_COLUMNS];  ///< in the half-resolution copy, 256ths of a pixel
    int16_t row_px[BSLAM_TURN_BANDS + 1];          ///< its rows between the bands, the lowest first
    bslam_real_t in_front_per_m;     ///< one over the distance of what hides all the floor in view,
    bslam_real_t in_front_sd_per_m;  ///< and its standard deviation
} bslam_turn_grid_t;

/// The sine of a column's bearing over the distance of what is there, and that one's standard deviation.
typedef struct bslam_turn_column {
    bslam_real_t parallax_per_m;
    bslam_real_t parallax_sd_per_m;  ///< negative to the right
} bslam_turn_column_t;

/// Sums of two patterns' squares from the first column on, every second one.
typedef struct bslam_turn_squares {
    int32_t now[BSLAM_TURN_COLUMNS + BSLAM_TURN_SEARCH_STEP];
    int32_t before[BSLAM_TURN_COLUMNS + BSLAM_TURN_SEARCH_STEP];
} bslam_turn_squares_t;

/// How far the robot drove between two frames of a camera, as far as pictures tell.
typedef struct bslam_turn_way {
    bslam_real_t travelled_m;
    bslam_real_t variance_m2;
} bslam_turn_way_t;

typedef struct bslam_turns {
    bslam_turn_grid_t grids[BSLAM_CAMERAS_MAX];
    bslam_turn_pattern_t before[BSLAM_CAMERAS_MAX];
    bslam_turn_way_t way;
    // All below is scratch.
    bslam_turn_pattern_t now;
    union {
        int32_t brightness[2][BSLAM_TURN_COLUMNS];
        bslam_turn_squares_t squares;
        bslam_turn_column_t columns[BSLAM_TURN_COLUMNS];
    };
} bslam_turns_t;

/// Makes an instance ready for the cameras of a front end that is.
void bslam_turns_init(bslam_turns_t *turns, const bslam_front_end_t *vision);

/// Looks at the frame that the front end has finished last, and remembers it. True, and *turn, if it tells
/// how far the robot has turned since the frame of the same camera before. False, *turn unchanged: there is
/// none before, one of the two was unusable (black, say), or it shows nothing but plain walls.
/// Work: some 9 instructions a pixel.
bool bslam_turns_see(bslam_turns_t *turns, const bslam_front_end_t *vision, bslam_turn_t *turn);

#endif
