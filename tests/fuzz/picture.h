/// Small pictures for the targets that look at some.
#ifndef FUZZ_PICTURE_H
#define FUZZ_PICTURE_H

#include "vision/vision.h"
#include "fuzz.h"
#include "base/scalar.h"

/// A row of RGB888 or RGB565, as many bytes as the format takes.
#define FUZZ_ROW_BYTES (3 * BSLAM_IMAGE_WIDTH_MAX)

/// Size of the pictures that the targets mostly look at: the smallest that there are.
#define FUZZ_WIDTH 32
#define FUZZ_HEIGHT 32

/// A camera of that size that sees a room as one would on a robot.
bslam_camera_t fuzz_camera(bslam_lens_kind_t lens);

/// A camera by the input: mostly such a one with one of its values changed.
bslam_camera_t fuzz_any_camera(fuzz_input_t *input);

/// A row as the input has it: runs of one colour, or the row before with some bytes changed.
void fuzz_row(fuzz_input_t *input, uint8_t row[FUZZ_ROW_BYTES]);

/// A row of a room with a thing on its wall: light wall above, dark floor below.
void fuzz_room_row(int32_t y, uint8_t row[FUZZ_ROW_BYTES]);

/// Holds of a finished frame: all that candidates say is finite and within its range.
void fuzz_require_candidates(const bslam_vision_t *vision);

/// Looks at such a room, of which that holds.
void fuzz_look_at_room(bslam_vision_t *vision);

#endif
