/// Cameras whose pixels are looked at as several, across and down. Internal.
#ifndef BSLAM_VISION_CAMERA_ZOOM_H
#define BSLAM_VISION_CAMERA_ZOOM_H

#include "vision/vision.h"

_Static_assert(BSLAM_ZOOM_MAX == 2, "rows are doubled, or are not");

/// BSLAM_OK if an instance may be given these cameras: as bslam_vision_init says.
BSLAM_MUST_CHECK bslam_status_t bslam_zoom_check(const bslam_camera_t *cameras, int32_t camera_count);

/// The camera whose pixels are those that are looked at; its zoom is 1 at least.
bslam_camera_t bslam_zoom_camera(bslam_camera_t camera);

/// Whether a camera that is looked at zoomed gives pictures of this size.
bool bslam_zoom_is_size(const bslam_camera_t *zoomed, int32_t width_px, int32_t height_px);

/// A box of the picture where it is looked at, and back.
bslam_box_t bslam_zoom_in_box(bslam_box_t box, int32_t zoom);
bslam_box_t bslam_zoom_out_box(bslam_box_t box, int32_t zoom);

#endif
