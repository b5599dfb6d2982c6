#include "vision/scan/rig_scanner.h"

#include <string.h>

#include "base/scalar.h"
#include "base/trig.h"
#include "vision/camera/zoom.h"
#include "vision/scan/box_candidate.h"
#include "vision/scan/scanner.h"

bslam_status_t bslam_rig_scanner_init(bslam_rig_scanner_t *rig, const bslam_scanner_model_t *model,
                                      const bslam_camera_t *cameras, int32_t camera_count)
{
    bslam_status_t status = bslam_zoom_check(cameras, camera_count);
    if (status == BSLAM_OK) {
        status = bslam_scanner_model_check(model);
    }
    if (status != BSLAM_OK) {
        return status;
    }
    memset(rig, 0, sizeof *rig);
    rig->model = model;
    rig->camera_count = camera_count;
    rig->reason = BSLAM_VISION_UNFINISHED;
    for (int32_t i = 0; i < camera_count; i++) {
        rig->cameras[i] = bslam_zoom_camera(cameras[i]);
    }
    return bslam_scanner_init(&rig->scanner, model);
}

bslam_status_t bslam_rig_scanner_begin(bslam_rig_scanner_t *rig, int32_t camera, bslam_pixel_format_t format,
                                       int32_t width_px, int32_t height_px)
{
    if (camera < 0 || camera >= rig->camera_count) {
        return BSLAM_E_RANGE;
    }
    const bslam_camera_t *lens = &rig->cameras[camera];
    if (!bslam_zoom_is_size(lens, width_px, height_px)) {
        return BSLAM_E_RANGE;
    }
    const bool gives_up = rig->reason == BSLAM_VISION_UNFINISHED && rig->rows_seen > 0;
    const bslam_status_t status = bslam_scanner_begin(&rig->scanner, format, lens->width_px, lens->height_px);
    if (status != BSLAM_OK) {
        return status;
    }
    rig->frames[BSLAM_VISION_UNFINISHED] += gives_up ? 1 : 0;
    rig->camera = camera;
    rig->format = format;
    rig->candidate_count = 0;
    rig->rows_seen = 0;
    rig->reason = BSLAM_VISION_UNFINISHED;
    return BSLAM_OK;
}

/// A row of twice as many pixels, each twice.
static void double_row(uint8_t *doubled, const uint8_t *pixels, size_t pixel_bytes, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        memcpy(doubled, pixels, pixel_bytes);
        memcpy(doubled + pixel_bytes, pixels, pixel_bytes);
        doubled += 2 * pixel_bytes;
        pixels += pixel_bytes;
    }
}

bslam_status_t bslam_rig_scanner_row(bslam_rig_scanner_t *rig, const void *pixels)
{
    const bslam_camera_t *lens = &rig->cameras[rig->camera];
    bslam_status_t status = BSLAM_OK;
    if (lens->zoom > 1 && rig->rows_seen < lens->height_px) {
        const size_t pixel_bytes = rig->format == BSLAM_PIXELS_RGB888 ? 3 : 2;
        double_row(rig->doubled, pixels, pixel_bytes, lens->width_px / lens->zoom);
        status = bslam_scanner_row(&rig->scanner, rig->doubled);
        pixels = rig->doubled;
    }
    if (status == BSLAM_OK) {
        status = bslam_scanner_row(&rig->scanner, pixels);
    }
    rig->rows_seen += status == BSLAM_OK ? lens->zoom : 0;
    return status;
}

bslam_status_t bslam_rig_scanner_end(bslam_rig_scanner_t *rig)
{
    const bslam_camera_t *lens = &rig->cameras[rig->camera];
    if (rig->reason != BSLAM_VISION_UNFINISHED || rig->rows_seen == 0 || rig->rows_seen < lens->height_px) {
        return BSLAM_E_COUNT;
    }
    const bslam_detections_t *found = bslam_scanner_end(&rig->scanner);
    bslam_scanner_instance_t *scanner = bslam_scanner_instance(&rig->scanner);
    for (int32_t i = 0; i < found->count; i++) {
        const bslam_detection_t *one = &found->items[i];
        rig->candidates[i] = bslam_box_candidate(&rig->model->kinds[one->kind], lens, one);
        bslam_box_signature(&scanner->channels, &one->box, &scanner->points, rig->candidates[i].signature);
        rig->candidates[i].outline = bslam_zoom_out_box(one->box, lens->zoom);
    }
    rig->candidate_count = found->count;
    rig->candidates_dropped += (uint32_t)found->dropped;
    rig->reason = found->reason;
    rig->frames[rig->reason]++;
    return BSLAM_OK;
}

bslam_status_t bslam_rig_scanner_point(bslam_rig_scanner_t *rig, int32_t camera, bslam_real_t yaw_rad)
{
    if (camera < 0 || camera >= rig->camera_count || !bslam_in_range(yaw_rad, -BSLAM_PI, BSLAM_PI)) {
        return BSLAM_E_RANGE;
    }
    rig->cameras[camera].yaw_rad = yaw_rad;
    return BSLAM_OK;
}
