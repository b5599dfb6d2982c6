/// A scanner behind the cameras of a robot: vision.h's calls where the model has one. Internal.
#ifndef BSLAM_VISION_SCAN_RIG_SCANNER_H
#define BSLAM_VISION_SCAN_RIG_SCANNER_H

#include "vision/vision.h"

typedef struct bslam_rig_scanner {
    bslam_scanner_t scanner;
    const bslam_scanner_model_t *model;
    int32_t camera_count;
    int32_t camera;  ///< of the present picture
    int32_t candidate_count;
    int32_t rows_seen;  ///< as they are looked at
    bslam_pixel_format_t format;
    bslam_vision_reason_t reason;
    uint32_t frames[BSLAM_VISION_REASON_COUNT];
    uint32_t candidates_dropped;
    bslam_camera_t cameras[BSLAM_CAMERAS_MAX];  ///< as they are looked at, zoomed
    union {
        uint8_t doubled[3 * BSLAM_IMAGE_WIDTH_MAX];          ///< a row, while a picture streams in,
        bslam_candidate_t candidates[BSLAM_CANDIDATES_MAX];  ///< and what was found
    };
} bslam_rig_scanner_t;

/// These do what vision.h says of bslam_vision_init and so on. *rig is unchanged where they refuse.
BSLAM_MUST_CHECK bslam_status_t bslam_rig_scanner_init(bslam_rig_scanner_t *rig,
                                                       const bslam_scanner_model_t *model,
                                                       const bslam_camera_t *cameras, int32_t camera_count);
BSLAM_MUST_CHECK bslam_status_t bslam_rig_scanner_begin(bslam_rig_scanner_t *rig, int32_t camera,
                                                        bslam_pixel_format_t format, int32_t width_px,
                                                        int32_t height_px);
BSLAM_MUST_CHECK bslam_status_t bslam_rig_scanner_row(bslam_rig_scanner_t *rig, const void *pixels);
BSLAM_MUST_CHECK bslam_status_t bslam_rig_scanner_end(bslam_rig_scanner_t *rig);
BSLAM_MUST_CHECK bslam_status_t bslam_rig_scanner_point(bslam_rig_scanner_t *rig, int32_t camera,
                                                        bslam_real_t yaw_rad);

#endif
