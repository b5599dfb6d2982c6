#include "vision/camera/zoom.h"

/// What becomes of a place along a side when each pixel becomes `zoom`: centres at whole numbers, as before.
static bslam_real_t in(bslam_real_t px, int32_t zoom)
{
    return px * (bslam_real_t)zoom + (bslam_real_t)(zoom - 1) / 2;
}

static bslam_real_t out(bslam_real_t px, int32_t zoom)
{
    return (px - (bslam_real_t)(zoom - 1) / 2) / (bslam_real_t)zoom;
}

bslam_box_t bslam_zoom_in_box(bslam_box_t box, int32_t zoom)
{
    return (bslam_box_t){in(box.left_px, zoom), in(box.top_px, zoom), in(box.right_px, zoom),
                         in(box.bottom_px, zoom)};
}

bslam_box_t bslam_zoom_out_box(bslam_box_t box, int32_t zoom)
{
    return (bslam_box_t){out(box.left_px, zoom), out(box.top_px, zoom), out(box.right_px, zoom),
                         out(box.bottom_px, zoom)};
}

bslam_camera_t bslam_zoom_camera(bslam_camera_t camera)
{
    camera.zoom = camera.zoom > 1 ? camera.zoom : 1;
    camera.width_px *= camera.zoom;
    camera.height_px *= camera.zoom;
    camera.fx_px *= (bslam_real_t)camera.zoom;
    camera.fy_px *= (bslam_real_t)camera.zoom;
    camera.cx_px = in(camera.cx_px, camera.zoom);
    camera.cy_px = in(camera.cy_px, camera.zoom);
    return camera;
}

bool bslam_zoom_is_size(const bslam_camera_t *zoomed, int32_t width_px, int32_t height_px)
{
    return (int64_t)width_px * zoomed->zoom == zoomed->width_px &&
           (int64_t)height_px * zoomed->zoom == zoomed->height_px;
}

static bool has_room(const bslam_camera_t *camera)
{
    const int32_t zoom = camera->zoom > 1 ? camera->zoom : 1;
    return zoom * camera->width_px <= BSLAM_IMAGE_WIDTH_MAX &&
           zoom * camera->height_px <= BSLAM_IMAGE_HEIGHT_MAX;
}

bslam_status_t bslam_zoom_check(const bslam_camera_t *cameras, int32_t camera_count)
{
    if (camera_count < 1 || camera_count > BSLAM_CAMERAS_MAX) {
        return BSLAM_E_COUNT;
    }
    for (int32_t i = 0; i < camera_count; i++) {
        const bslam_status_t status = bslam_camera_check(&cameras[i]);
        if (status != BSLAM_OK) {
            return status;
        }
        if (!has_room(&cameras[i])) {
            return BSLAM_E_RANGE;
        }
    }
    return BSLAM_OK;
}
