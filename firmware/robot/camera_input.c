#include "robot/camera_input.h"

#if ROBOT_VISION

#ifdef ROBOT_KINDS
#include ROBOT_KINDS_HEADER
#else
#include "models/beacons.h"
#endif

static bslam_status_t init_vision(camera_input_t *input, int32_t camera_count)
{
#ifdef ROBOT_KINDS
    return bslam_vision_init_scanner(&input->vision, &ROBOT_KINDS, input->cameras, camera_count);
#else
    return bslam_vision_init(&input->vision, &bslam_beacons_model, input->cameras, camera_count);
#endif
}

/// No frame streams in, and none has been looked at.
static void clear(camera_input_t *input)
{
    input->row_bytes = 0;
    input->takes_rows = false;
    input->count = 0;
}

bslam_status_t camera_input_set_camera(camera_input_t *input, int index, const bslam_camera_t *camera)
{
    clear(input);
    input->camera_count = 0;
    if (index < 0 || index >= BSLAM_CAMERAS_MAX) {
        return BSLAM_E_COUNT;
    }
    input->cameras[index] = *camera;
    const bslam_status_t status = init_vision(input, index + 1);
    if (status == BSLAM_OK) {
        input->camera_count = index + 1;
    }
    return status;
}

static bslam_status_t begin(camera_input_t *input, int camera, bslam_pixel_format_t format)
{
    clear(input);
    if (camera < 0 || camera >= input->camera_count) {
        return BSLAM_E_COUNT;
    }
    const bslam_camera_t *lens = &input->cameras[camera];
    return bslam_vision_begin(&input->vision, camera, format, lens->width_px, lens->height_px);
}

bslam_status_t camera_input_begin(camera_input_t *input, int camera, bslam_pixel_format_t format)
{
    const bslam_status_t status = begin(input, camera, format);
    if (status == BSLAM_OK) {
        const size_t pixel_bytes = format == BSLAM_PIXELS_RGB888 ? 3 : 2;
        input->row_bytes = (size_t)input->cameras[camera].width_px * pixel_bytes;
        input->filled = 0;
    }
    return status;
}

bslam_status_t camera_input_take(camera_input_t *input, uint8_t byte)
{
    if (input->row_bytes == 0) {
        return BSLAM_E_COUNT;
    }
    input->row[input->filled++] = byte;
    if (input->filled < input->row_bytes) {
        return BSLAM_OK;
    }
    input->filled = 0;
    return bslam_vision_row(&input->vision, input->row);
}

bslam_status_t camera_input_begin_rows(camera_input_t *input, int camera)
{
    const bslam_status_t status = begin(input, camera, BSLAM_PIXELS_RGB565);
    input->takes_rows = status == BSLAM_OK;
    return status;
}

bslam_status_t camera_input_take_row(camera_input_t *input, const void *pixels)
{
    if (!input->takes_rows) {
        return BSLAM_E_COUNT;
    }
    return bslam_vision_row(&input->vision, pixels);
}

bslam_status_t camera_input_look(camera_input_t *input, bool robot_moved)
{
    clear(input);
    const bslam_status_t status = bslam_vision_end(&input->vision, robot_moved);
    if (status == BSLAM_OK) {
        input->count = bslam_vision_sightings(&input->vision, input->sightings);
    }
    return status;
}

#endif
