/// The front end: what vision.h does, on the instance as it is inside. Rows stream in and are reduced
/// (thumbnail.h); then cells are judged, joined to boxes, boxes judged and measured. Paper, modules BOE and
/// BOR. Internal.
#ifndef BSLAM_VISION_BUILT_IN_FRONT_END_H
#define BSLAM_VISION_BUILT_IN_FRONT_END_H

#include "vision/built_in/detection/detector.h"
#include "vision/built_in/measurement/measure.h"
#include "vision/built_in/thumbnail.h"

/// Each camera has its own memory of the room (background.h); all else is scratch.
typedef struct bslam_front_end {
    const bslam_beacon_model_t *model;
    int32_t camera_count;
    int32_t camera;  ///< of the present frame
    int32_t candidate_count;
    bslam_vision_reason_t reason;
    uint32_t frames[BSLAM_VISION_REASON_COUNT];  ///< finished or given up frames by what came of them
    uint32_t candidates_dropped;                 ///< BSLAM_CANDIDATES_MAX did not suffice
    bslam_camera_t cameras[BSLAM_CAMERAS_MAX];   ///< as they are looked at, zoomed
    bslam_background_t backgrounds[BSLAM_CAMERAS_MAX];
    bslam_cell_machine_t machines[BSLAM_CAMERAS_MAX];
    union {
        bslam_row_sums_t row_sums;              ///< while a frame streams in,
        bslam_channel_tables_t channel_tables;  ///< while its cells are looked at,
        bslam_run_t runs[BSLAM_RUNS_MAX];       ///< while they are joined,
        struct {
            bslam_candidate_t candidates[BSLAM_CANDIDATES_MAX];  ///< and of a frame that has been looked at;
            bslam_box_opinion_t opinions[BSLAM_OPINIONS_MAX];    ///< while these are found
        };
    };
    bslam_thumbnail_t thumbnail;
    bslam_proposals_t proposals;
    bslam_floor_line_t floor_line;
    bslam_tones_t tones;
    uint8_t step_x[BSLAM_CELLS_ROOM];
    uint8_t step_y[BSLAM_CELLS_ROOM];
} bslam_front_end_t;

/// These do what vision.h says of bslam_vision_init and so on. *vision is unchanged where they refuse.
BSLAM_MUST_CHECK bslam_status_t bslam_front_end_init(bslam_front_end_t *vision,
                                                     const bslam_beacon_model_t *model,
                                                     const bslam_camera_t *cameras, int32_t camera_count);
BSLAM_MUST_CHECK bslam_status_t bslam_front_end_begin(bslam_front_end_t *vision, int32_t camera,
                                                      bslam_pixel_format_t format, int32_t width_px,
                                                      int32_t height_px);
BSLAM_MUST_CHECK bslam_status_t bslam_front_end_row(bslam_front_end_t *vision, const void *pixels);
BSLAM_MUST_CHECK bslam_status_t bslam_front_end_end(bslam_front_end_t *vision, bool robot_moved);
BSLAM_MUST_CHECK bslam_status_t bslam_front_end_point(bslam_front_end_t *vision, int32_t camera,
                                                      bslam_real_t yaw_rad);

/// For training: the box of proposal `index` of the last finished frame, in the camera's pixels.
bslam_box_t bslam_front_end_proposal_box(const bslam_front_end_t *vision, int32_t index);

/// For training: the features of proposal `index` of the last finished frame, as bslam_blob_features gives
/// them, and those of a cell. Indices in range.
void bslam_front_end_blob_features(const bslam_front_end_t *vision, int32_t index,
                                   float features[BSLAM_BLOB_FEATURES]);
void bslam_front_end_prefilter(const bslam_front_end_t *vision, int32_t index,
                               float glance[BSLAM_GLANCE_FEATURES]);
void bslam_front_end_close_features(const bslam_front_end_t *vision, int32_t index,
                                    uint8_t features[BSLAM_CLOSE_FEATURES]);
void bslam_front_end_cell_features(const bslam_front_end_t *vision, int32_t row, int32_t column,
                                   int16_t features[BSLAM_CELL_FEATURES]);

/// For training: what bslam_measure says of a box in the last finished frame; its statuses.
BSLAM_MUST_CHECK bslam_status_t bslam_front_end_measure(const bslam_front_end_t *vision,
                                                        const bslam_box_t *rough, const bslam_size_t *size,
                                                        bslam_candidate_t *candidate);

#endif
