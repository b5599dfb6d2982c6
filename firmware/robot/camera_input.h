/// Pictures that come as pieces of rows, and what is seen in them as sightings: the vision library behind the
/// link or a board's camera. Only in an application that is built with ROBOT_VISION. It finds the built-in
/// kinds, or those of ROBOT_KINDS, a scanner's model in the header ROBOT_KINDS_HEADER.
#ifndef ROBOT_CAMERA_INPUT_H
#define ROBOT_CAMERA_INPUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "vision/vision.h"

#ifndef ROBOT_VISION
#define ROBOT_VISION 0
#endif

#if ROBOT_VISION

/// All members are this module's own, but for reading. All zero: no camera yet.
typedef struct camera_input {
    bslam_vision_t vision;
    bslam_camera_t cameras[BSLAM_CAMERAS_MAX];
    int camera_count;
    size_t row_bytes;  ///< of the frame that streams in; 0: there is none
    size_t filled;     ///< bytes of the row that have come
    bool takes_rows;   ///< a frame streams in by whole rows
    int count;         ///< of sightings in the last finished frame
    union {
        uint8_t row[3 * BSLAM_IMAGE_WIDTH_MAX];            ///< while a frame streams in
        bslam_sighting_t sightings[BSLAM_CANDIDATES_MAX];  ///< of one that is finished
    };
} camera_input_t;

/// Sets camera `index`, and that there are index + 1; starts over, with empty memories of the room. What
/// bslam_vision_init refuses, BSLAM_E_COUNT for an index: then there is no camera.
bslam_status_t camera_input_set_camera(camera_input_t *input, int index, const bslam_camera_t *camera);

/// Starts a frame of a camera: its statuses are bslam_vision_begin's, BSLAM_E_COUNT: there is no camera.
bslam_status_t camera_input_begin(camera_input_t *input, int camera, bslam_pixel_format_t format);

/// The next byte of the frame, row after row. bslam_vision_row's statuses.
bslam_status_t camera_input_take(camera_input_t *input, uint8_t byte);

/// The same for a frame in RGB565 that comes in whole rows. A frame begun in the other way ends it.
bslam_status_t camera_input_begin_rows(camera_input_t *input, int camera);
bslam_status_t camera_input_take_row(camera_input_t *input, const void *pixels);

/// Looks at the frame: its sightings, in the robot's axes, stand in input->sightings until the next frame
/// begins. bslam_vision_end's statuses.
bslam_status_t camera_input_look(camera_input_t *input, bool robot_moved);

#endif
#endif
