/// The vision front end: camera rows stream in, beacon candidates come out. Paper, modules BOE and BOR.
///
///     bslam_vision_init(&vision, &bslam_beacons_model, cameras, 3)
///     bslam_vision_begin(&vision, camera, BSLAM_PIXELS_RGB565, 320, 240)
///     bslam_vision_row(&vision, pixels)                   for every row
///     bslam_vision_end(&vision, robot_moved)
///     bslam_vision_candidates(&vision, &count)
///
/// One instance serves several cameras in turn: each has its own memory of the room (background.h), all else
/// is scratch. `make sizes` prints what an instance takes. The work a frame costs is bounded by the sizes in
/// config.h. A frame that shows nothing usable gives no candidate and a reason, never a made-up one.
#ifndef BSLAM_VISION_VISION_H
#define BSLAM_VISION_VISION_H

#include "vision/detection/detector.h"
#include "vision/measurement/measure.h"
#include "vision/sighting.h"
#include "vision/pixels/thumbnail.h"

/// What came of the last frame.
typedef enum bslam_vision_reason {
    BSLAM_VISION_SEEN = 0,     ///< there are candidates
    BSLAM_VISION_NOTHING,      ///< a good frame without a beacon
    BSLAM_VISION_UNFINISHED,   ///< rows are missing: the frame is streaming in, or was cut short
    BSLAM_VISION_BLACK,        ///< nearly all of the frame is black
    BSLAM_VISION_OVEREXPOSED,  ///< most of the frame is saturated
    BSLAM_VISION_FLAT,         ///< one colour all over: a covered lens, a wall too close
    BSLAM_VISION_REASON_COUNT
} bslam_vision_reason_t;

typedef struct bslam_vision {
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
} bslam_vision_t;

/// Makes an instance ready. The model stays where it is and must outlive the instance; the cameras are
/// copied. BSLAM_E_COUNT: camera_count is not 1 to BSLAM_CAMERAS_MAX. BSLAM_E_RANGE: a frame, zoomed, is
/// beyond BSLAM_IMAGE_WIDTH_MAX or _HEIGHT_MAX. Else what bslam_camera_check,
/// bslam_beacon_model_check or, where the model has a recogniser, bslam_recogniser_check refuses. *vision is
/// then unchanged.
BSLAM_MUST_CHECK bslam_status_t bslam_vision_init(bslam_vision_t *vision, const bslam_beacon_model_t *model,
                                                  const bslam_camera_t *cameras, int32_t camera_count);

/// Starts a frame of a camera (its index in bslam_vision_init's array). An unfinished frame before it is
/// given up and counted. BSLAM_E_RANGE, and nothing changed, for another camera index, format or size than
/// allowed: the size is the camera's own.
BSLAM_MUST_CHECK bslam_status_t bslam_vision_begin(bslam_vision_t *vision, int32_t camera,
                                                   bslam_pixel_format_t format, int32_t width_px,
                                                   int32_t height_px);

/// The next row, uppermost first. BSLAM_E_COUNT, and nothing changed, if the frame has all its rows already.
BSLAM_MUST_CHECK bslam_status_t bslam_vision_row(bslam_vision_t *vision, const void *pixels);

/// Looks at the frame. robot_moved: since this camera's frame before; while it is false the memory of the
/// room stays as it is. BSLAM_E_COUNT, nothing learned and no candidate, if rows are missing.
BSLAM_MUST_CHECK bslam_status_t bslam_vision_end(bslam_vision_t *vision, bool robot_moved);

/// Turns a camera on a pan unit. BSLAM_E_RANGE, and nothing changed: no such camera, |yaw| above pi.
BSLAM_MUST_CHECK bslam_status_t bslam_vision_point(bslam_vision_t *vision, int32_t camera,
                                                   bslam_real_t yaw_rad);

/// The candidates of the last finished frame, surest first; good until the next frame begins.
const bslam_candidate_t *bslam_vision_candidates(const bslam_vision_t *vision, int32_t *count);

/// What came of the last frame, and its name: "black" say.
bslam_vision_reason_t bslam_vision_reason(const bslam_vision_t *vision);
const char *bslam_vision_reason_name(bslam_vision_reason_t reason);

/// For training: the box of proposal `index` of the last finished frame, in the camera's pixels.
bslam_box_t bslam_vision_proposal_box(const bslam_vision_t *vision, int32_t index);

/// For training: the features of proposal `index` of the last finished frame, as bslam_blob_features gives
/// them, and those of a cell. Indices in range.
void bslam_vision_blob_features(const bslam_vision_t *vision, int32_t index,
                                float features[BSLAM_BLOB_FEATURES]);
void bslam_vision_prefilter(const bslam_vision_t *vision, int32_t index, float glance[BSLAM_GLANCE_FEATURES]);
void bslam_vision_close_features(const bslam_vision_t *vision, int32_t index,
                                 uint8_t features[BSLAM_CLOSE_FEATURES]);
void bslam_vision_cell_features(const bslam_vision_t *vision, int32_t row, int32_t column,
                                int16_t features[BSLAM_CELL_FEATURES]);

/// For training: what bslam_measure says of a box in the last finished frame; its statuses.
BSLAM_MUST_CHECK bslam_status_t bslam_vision_measure(const bslam_vision_t *vision, const bslam_box_t *rough,
                                                     const bslam_size_t *size, bslam_candidate_t *candidate);

#endif
