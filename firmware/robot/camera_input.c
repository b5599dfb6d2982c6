#include "robot/camera_input.h"

#if SESSION_VISION

#include "models/beacons.h"

/// No frame streams in, and none has been looked at.
static void clear(camera_input_t *seeing)
{
    seeing->row_bytes = 0;
    seeing->takes_rows = false;
    seeing->count = 0;
}

bslam_status_t camera_input_set_camera(camera_input_t *seeing, int index, const bslam_camera_t *camera)
{
    clear(seeing);
    seeing->vision.camera_count = 0;
    if (index < 0 || index >= BSLAM_CAMERAS_MAX) {
        return BSLAM_E_COUNT;
    }
    seeing->cameras[index] = *camera;
    const bslam_status_t status =
        bslam_vision_init(&seeing->vision, &bslam_beacons_model, seeing->cameras, index + 1);
#if SESSION_TURNS
    gyro_wait_start(&seeing->turning, &seeing->vision);
#endif
    return status;
}

static bslam_status_t begin(camera_input_t *seeing, int camera, bslam_pixel_format_t format)
{
    clear(seeing);
    if (camera < 0 || camera >= seeing->vision.camera_count) {
        return BSLAM_E_COUNT;
    }
    const bslam_camera_t *lens = &seeing->cameras[camera];
    return bslam_vision_begin(&seeing->vision, camera, format, lens->width_px, lens->height_px);
}

bslam_status_t camera_input_begin(camera_input_t *seeing, int camera, bslam_pixel_format_t format)
{
    const bslam_status_t status = begin(seeing, camera, format);
    if (status == BSLAM_OK) {
        const size_t pixel_bytes = format == BSLAM_PIXELS_RGB888 ? 3 : 2;
        seeing->row_bytes = (size_t)seeing->cameras[camera].width_px * pixel_bytes;
        seeing->filled = 0;
    }
    return status;
}

bslam_status_t camera_input_take(camera_input_t *seeing, uint8_t byte)
{
    if (seeing->row_bytes == 0) {
        return BSLAM_E_COUNT;
    }
    seeing->row[seeing->filled++] = byte;
    if (seeing->filled < seeing->row_bytes) {
        return BSLAM_OK;
    }
    seeing->filled = 0;
    return bslam_vision_row(&seeing->vision, seeing->row);
}

bslam_status_t camera_input_begin_rows(camera_input_t *seeing, int camera)
{
    const bslam_status_t status = begin(seeing, camera, BSLAM_PIXELS_RGB565);
    seeing->takes_rows = status == BSLAM_OK;
    return status;
}

bslam_status_t camera_input_take_row(camera_input_t *seeing, const void *pixels)
{
    if (!seeing->takes_rows) {
        return BSLAM_E_COUNT;
    }
    return bslam_vision_row(&seeing->vision, pixels);
}

bslam_status_t camera_input_look(camera_input_t *seeing, bool robot_moved)
{
    clear(seeing);
    const bslam_status_t status = bslam_vision_end(&seeing->vision, robot_moved);
    int32_t count = 0;
    const bslam_candidate_t *found = bslam_vision_candidates(&seeing->vision, &count);
    for (int i = 0; status == BSLAM_OK && i < count; i++) {
        if (found[i].has_bearing) {
            seeing->sightings[seeing->count++] = bslam_sighting_of(&found[i]);
        }
    }
    return status;
}

#endif
