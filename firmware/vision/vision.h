/// bslam vision: camera pictures in, sightings of beacons out, in fixed memory. This header is its whole API;
/// it needs nothing of the estimator.
///
///     static bslam_vision_t vision;                                 // all the memory there is
///     bslam_vision_init(&vision, &bslam_beacons_model, cameras, 3);  // models/beacons.h
///     bslam_vision_begin(&vision, camera, BSLAM_PIXELS_RGB565, 320, 240);
///     bslam_vision_row(&vision, pixels);                            // every row, as it comes
///     bslam_vision_end(&vision, robot_moved);
///     count = bslam_vision_sightings(&vision, seen);
///
/// No picture is kept: rows stream in and are reduced at once. The work of a picture is bounded by the sizes
/// in config.h. One that shows nothing usable gives no sighting and a reason, never a made-up one.
///
/// One instance serves several cameras in turn: each has its own memory of the room. Every instance is its
/// caller's; there is no heap, no global state, no output. One instance must not be entered twice at a time,
/// and must not be copied or moved. On any status but BSLAM_OK it is as it was, to the bit.
///
/// SI units, angles in (-pi, pi], x forward, y left. Pixel (0, 0) is the upper left one, its centre at (0,
/// 0).
#ifndef BSLAM_VISION_H
#define BSLAM_VISION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"
#include "base/types.h"
#include "vision/model.h"
#include "vision/size.h"

#ifdef __cplusplus
extern "C" {
#endif

/// One front end. What stands in it is the library's own.
typedef union bslam_vision {
    unsigned char bytes[BSLAM_VISION_BYTES];
    uint32_t alignment_of_words;
    bslam_real_t alignment_of_numbers;
    void *alignment_of_pointers;
} bslam_vision_t;

// ---- the cameras ------------------------------------------------------------------------------------------

typedef enum bslam_lens_kind {
    BSLAM_LENS_PINHOLE = 0,     ///< straight lines stay straight; to about 120 degrees
    BSLAM_LENS_EQUIDISTANT = 1  ///< the angle from the axis grows in proportion to the radius; to 180 degrees
} bslam_lens_kind_t;

/// Pictures of at most this many pixels a side.
#define BSLAM_FRAME_SIDE_MAX 4096
#define BSLAM_ZOOM_MAX 2

/// A camera on the robot. Both lenses have OpenCV's radial distortion, so its calibration can be used as it
/// is: pinhole (calib3d, k1 and k2) and equidistant (calib3d's fisheye, k1 and k2: r = f theta (1 + k1 theta²
/// + k2 theta⁴)).
typedef struct bslam_camera {
    bslam_lens_kind_t lens;
    int32_t width_px;  ///< of the picture
    int32_t height_px;
    bslam_real_t fx_px;  ///< focal lengths
    bslam_real_t fy_px;
    bslam_real_t cx_px;  ///< where the axis meets the picture
    bslam_real_t cy_px;
    bslam_real_t k1;
    bslam_real_t k2;
    bslam_real_t yaw_rad;    ///< mounting: of the axis, positive to the left
    bslam_real_t pitch_rad;  ///< positive looks down
    bslam_real_t z_m;        ///< height above the floor
    int32_t zoom;  ///< a pixel is looked at as so many, across and down: 2 for a lens that shows much in few
                   ///< pixels; 0 and 1: as it is
} bslam_camera_t;

/// BSLAM_OK if the library may be given this camera. BSLAM_E_NOT_FINITE: a value is NaN or infinite.
/// BSLAM_E_PARAMETER: an unknown kind; a side outside 8 to BSLAM_FRAME_SIDE_MAX; a focal length outside 1 to
/// 1e5 px; a centre outside the picture; |yaw| above pi, |pitch| above 1.5 rad; a height outside 0 to 10 m; a
/// zoom outside 0 to BSLAM_ZOOM_MAX; a distortion that folds: within the picture the radius must grow with
/// the angle, so that every pixel looks in one direction.
BSLAM_MUST_CHECK bslam_status_t bslam_camera_check(const bslam_camera_t *camera);

// ---- pictures ---------------------------------------------------------------------------------------------

#if BSLAM_VISION_BUILT_IN
/// Makes an instance ready. The model stays where it is and must outlive the instance; the cameras are
/// copied. BSLAM_E_SIZE: library and application were compiled with other sizes (config.h); nothing was
/// written then. BSLAM_E_COUNT: camera_count is not 1 to BSLAM_CAMERAS_MAX, or a count of the model is not as
/// model.h has it. BSLAM_E_RANGE: a picture, zoomed, is beyond BSLAM_IMAGE_WIDTH_MAX or _HEIGHT_MAX, or a
/// kind's height is not 0 to 10 m. BSLAM_E_NOT_FINITE, BSLAM_E_PARAMETER: a camera or the model.
#define bslam_vision_init(vision, model, cameras, camera_count) \
    bslam_vision_init_sized((vision), sizeof *(vision), BSLAM_VISION_HASH, (model), (cameras), (camera_count))
#if BSLAM_REAL_DOUBLE  // library and application of two scalar types do not link
#define bslam_vision_init_sized bslam_vision_init_double
#endif
BSLAM_MUST_CHECK bslam_status_t bslam_vision_init_sized(bslam_vision_t *vision, size_t vision_bytes,
                                                        uint32_t sizes_hash,
                                                        const bslam_beacon_model_t *model,
                                                        const bslam_camera_t *cameras, int32_t camera_count);

#endif

/// The same for a user's own kinds, which `bslam detect train` wrote: MODEL.h. It needs no horizon and no
/// colour of the walls, and remembers nothing from picture to picture: robot_moved makes no difference. What
/// is wrong with the model has bslam_scanner_init's statuses.
#define bslam_vision_init_scanner(vision, model, cameras, camera_count) \
    bslam_vision_init_scanner_sized((vision), sizeof *(vision), BSLAM_VISION_HASH, (model), (cameras), \
                                    (camera_count))
#if BSLAM_REAL_DOUBLE
#define bslam_vision_init_scanner_sized bslam_vision_init_scanner_double
#endif
BSLAM_MUST_CHECK bslam_status_t bslam_vision_init_scanner_sized(bslam_vision_t *vision, size_t vision_bytes,
                                                                uint32_t sizes_hash,
                                                                const bslam_scanner_model_t *model,
                                                                const bslam_camera_t *cameras,
                                                                int32_t camera_count);

typedef enum bslam_pixel_format {
    BSLAM_PIXELS_RGB565 = 0,  ///< 2 bytes, in the machine's byte order; red in the upper bits
    BSLAM_PIXELS_RGB888 = 1   ///< 3 bytes: red, green, blue
} bslam_pixel_format_t;

/// Starts a picture of a camera (its index in bslam_vision_init's array). An unfinished one before it is
/// given up and counted. BSLAM_E_RANGE: another camera index, format or size than the camera's own; its width
/// is a multiple of 8, its height of 4, both are 32 at least.
BSLAM_MUST_CHECK bslam_status_t bslam_vision_begin(bslam_vision_t *vision, int32_t camera,
                                                   bslam_pixel_format_t format, int32_t width_px,
                                                   int32_t height_px);

/// The next row, uppermost first. BSLAM_E_COUNT: the picture has all its rows already.
BSLAM_MUST_CHECK bslam_status_t bslam_vision_row(bslam_vision_t *vision, const void *pixels);

/// Looks at the picture. robot_moved: since this camera's picture before; while it is false the memory of the
/// room stays as it is. BSLAM_E_COUNT: rows are missing.
BSLAM_MUST_CHECK bslam_status_t bslam_vision_end(bslam_vision_t *vision, bool robot_moved);

/// Turns a camera on a pan unit. BSLAM_E_RANGE: no such camera, |yaw| above pi.
BSLAM_MUST_CHECK bslam_status_t bslam_vision_point(bslam_vision_t *vision, int32_t camera,
                                                   bslam_real_t yaw_rad);

// ---- what is seen -----------------------------------------------------------------------------------------

/// What came of a picture.
typedef enum bslam_vision_reason {
    BSLAM_VISION_SEEN = 0,     ///< there are candidates
    BSLAM_VISION_NOTHING,      ///< a good picture without a beacon
    BSLAM_VISION_UNFINISHED,   ///< rows are missing: it is streaming in, or was cut short
    BSLAM_VISION_BLACK,        ///< nearly all of it is black
    BSLAM_VISION_OVEREXPOSED,  ///< most of it is saturated
    BSLAM_VISION_FLAT,         ///< one colour all over: a covered lens, a wall too close
    BSLAM_VISION_REASON_COUNT
} bslam_vision_reason_t;

/// Of the last picture, and its name: "black" say; "unknown reason" outside the enum.
bslam_vision_reason_t bslam_vision_reason(const bslam_vision_t *vision);
const char *bslam_vision_reason_name(bslam_vision_reason_t reason);

/// Edges of a rectangle in the whole picture; pixel i covers [i - 0.5, i + 0.5].
typedef struct bslam_box {
    bslam_real_t left_px;
    bslam_real_t top_px;
    bslam_real_t right_px;
    bslam_real_t bottom_px;
} bslam_box_t;

/// Why a candidate is not, or not fully, measured; bits of bslam_candidate_t.marks.
enum {
    BSLAM_MARK_CUT_LEFT = 1,  ///< reaches the picture's edge: the outline may go on outside
    BSLAM_MARK_CUT_RIGHT = 2,
    BSLAM_MARK_CUT_TOP = 4,
    BSLAM_MARK_CUT_BOTTOM = 8,
    BSLAM_MARK_SMALL = 16,       ///< too few pixels for a distance or a signature
    BSLAM_MARK_SLANTED = 32,     ///< seen too obliquely
    BSLAM_MARK_PART = 64,        ///< its level sides go on beyond it: the outline is that of a part
    BSLAM_MARK_MISPLACED = 128,  ///< its height contradicts its place or its width: no distance
    BSLAM_MARK_HIDDEN = 256      ///< narrower than its kind: something is before it, its direction is rough
};

/// A thing that is probably a beacon.
typedef struct bslam_candidate {
    bslam_box_t outline;
    bslam_real_t bearing_rad;  ///< of its middle, in the robot's frame; read only if has_bearing
    bslam_real_t bearing_sd_rad;
    bslam_real_t range_m;  ///< horizontal distance from the camera; read only if has_range
    bslam_real_t range_sd_m;
    bslam_real_t range_noise_sd_m;  ///< the part of it that is another one in each picture; the rest is the
                                    ///< thing's
    bslam_real_t range_scale_sd;    ///< by what part all distances of the thing err alike
    bool has_bearing;
    bool has_range;
    uint8_t beacon_class;  ///< 1 + index in the model's class table; BSLAM_CLASS_NONE if unsure
    uint8_t second_class;  ///< the next likely one; BSLAM_CLASS_NONE if there is none
    float class_margin;    ///< value of the class less that of the next; negative if its place decided; a
                           ///< scanner's: the score
    float score;           ///< detector's decision value: larger is surer; a scanner's: logarithm of the odds
    uint16_t marks;
    float misplaced_sds;  ///< by how many standard deviations it hangs where its kind does not; 0: not at all
    float signature[BSLAM_SIGNATURE_SIZE];
} bslam_candidate_t;

/// The candidates of the last finished picture, surest first; good until the next picture begins.
const bslam_candidate_t *bslam_vision_candidates(const bslam_vision_t *vision, int32_t *count);

/// A candidate with has_bearing as a sighting, without identity; its signature stays where it is. The noise
/// is what changes from picture to picture, and a little that nothing in a picture can tell; what repeats in
/// each distance of the thing is range_scale_sd. MATH-CAMERA "Sighting noise". O(1).
bslam_sighting_t bslam_sighting_of(const bslam_candidate_t *candidate);

/// Those of all candidates that have a bearing, in their order; returns how many. Their signatures are good
/// until the next picture begins.
int32_t bslam_vision_sightings(const bslam_vision_t *vision,
                               bslam_sighting_t sightings[BSLAM_CANDIDATES_MAX]);

/// Never-decreasing counts.
typedef struct bslam_vision_counters {
    uint32_t frames[BSLAM_VISION_REASON_COUNT];  ///< finished or given up pictures, by what came of them
    uint32_t candidates_dropped;                 ///< BSLAM_CANDIDATES_MAX did not suffice,
    uint32_t boxes_dropped;                      ///< BSLAM_PROPOSALS_MAX,
    uint32_t runs_dropped;                       ///< nor the room for parts of a picture so broken up
} bslam_vision_counters_t;

bslam_vision_counters_t bslam_vision_counters(const bslam_vision_t *vision);

// ---- your own kinds in any picture: a scanner -------------------------------------------------------------
//
//     static bslam_scanner_t scanner;
//     bslam_scanner_init(&scanner, &bslam_my_things);      what bslam_vision_init_scanner looks with
//     bslam_scanner_begin(&scanner, BSLAM_PIXELS_RGB565, 320, 240);
//     bslam_scanner_row(&scanner, pixels);                 every row, as it comes
//     found = bslam_scanner_end(&scanner);
//
// It needs no camera: boxes are all it tells. MATH-CAMERA "Scanner".

/// A scanner. What stands in it is the library's own.
typedef union bslam_scanner {
    unsigned char bytes[BSLAM_SCANNER_BYTES];
    void *alignment_of_pointers;
    bslam_real_t alignment_of_numbers;
    uint32_t alignment_of_words;
} bslam_scanner_t;

/// A thing that was found.
typedef struct bslam_detection {
    bslam_box_t box;  ///< within the picture
    int32_t kind;     ///< index in the model's kinds
    float score;      ///< the SVM's value
    float log_odds;   ///< that it is one of the kind
    uint16_t marks;   ///< BSLAM_MARK_CUT_LEFT and so on: the box reaches the picture's edge
} bslam_detection_t;

/// What came of a picture, surest first by log_odds. Good until the next call.
typedef struct bslam_detections {
    bslam_vision_reason_t reason;
    int32_t count;
    int32_t dropped;  ///< boxes on other things: there was no room; not those of windows beyond the 128 best
    bslam_detection_t items[BSLAM_CANDIDATES_MAX];
} bslam_detections_t;

/// Makes a scanner ready. The model must outlive it. BSLAM_E_SIZE: as bslam_vision_init. BSLAM_E_COUNT: a
/// count of the model is not as model.h has it, or a window has a kind or an order that is none.
/// BSLAM_E_NOT_FINITE; BSLAM_E_PARAMETER: a number of the model that cannot be. Nothing was written then.
#define bslam_scanner_init(scanner, model) \
    bslam_scanner_init_sized((scanner), sizeof *(scanner), BSLAM_VISION_HASH, (model))
#if BSLAM_REAL_DOUBLE
#define bslam_scanner_init_sized bslam_scanner_init_double
#endif
BSLAM_MUST_CHECK bslam_status_t bslam_scanner_init_sized(bslam_scanner_t *scanner, size_t scanner_bytes,
                                                         uint32_t sizes_hash,
                                                         const bslam_scanner_model_t *model);

/// Starts a picture; one before it that is unfinished is given up. BSLAM_E_RANGE: another format than there
/// is, or a side that is not 32 to BSLAM_IMAGE_WIDTH_MAX in steps of 8, or to BSLAM_IMAGE_HEIGHT_MAX in steps
/// of 4.
BSLAM_MUST_CHECK bslam_status_t bslam_scanner_begin(bslam_scanner_t *scanner, bslam_pixel_format_t format,
                                                    int32_t width_px, int32_t height_px);

/// The next row, uppermost first. BSLAM_E_COUNT: the picture has all its rows already, or none has begun.
BSLAM_MUST_CHECK bslam_status_t bslam_scanner_row(bslam_scanner_t *scanner, const void *pixels);

/// Looks at the picture: windows of all sizes, boxes of a kind that overlap by .4 become one. Where rows are
/// missing nothing is found, and the reason says so. docs/SIZES.md has the cost.
const bslam_detections_t *bslam_scanner_end(bslam_scanner_t *scanner);

/// One size of the picture that was ended last.
typedef struct bslam_scanner_level {
    int32_t rows;  ///< of cells, with two beyond the picture on every side
    int32_t columns;
    float cell_px;  ///< side of a cell in the picture
} bslam_scanner_level_t;

/// For training: what windows slide over. Size `index`, 0 the largest, and the cells of one of its rows,
/// columns * BSLAM_CHANNELS bytes; NULL: the size alone. False, nothing written: no such size or row.
bool bslam_scanner_cells(const bslam_scanner_t *scanner, int32_t index, bslam_scanner_level_t *size,
                         int32_t row, uint8_t *cells);

// ---- the visual gyro: how the robot turned ----------------------------------------------------------------
//
//     bslam_visual_gyro_init(&gyro, BSLAM_VISUAL_GYRO_SD_RADPS);
//     bslam_visual_gyro_advance(&gyro, time_us, speed_mps, speed_sd_mps);     at each reading of the wheels,
//     found = bslam_vision_turn(&vision, &turn);                              then for each picture of that
//     bslam_visual_gyro_take(&gyro, camera, found ? &turn : NULL);            time, after bslam_vision_end
//     reading.has_gyro = bslam_visual_gyro_rate(&gyro, &reading.gyro_radps, &reading.gyro_sd_radps);
//
// It needs no beacon: a skirting board's end, a door frame or a lamp will do. MATH-CAMERA "Visual gyro".

/// The turn between two pictures of one camera.
typedef struct bslam_turn {
    bslam_real_t turn_rad;       ///< to the left, if all that is seen were infinitely far away
    bslam_real_t variance_rad2;  ///< of its noise
    bslam_real_t mismatch;       ///< of the two patterns: 0 they are alike, 1 they have nothing in common
    /// A metre driven forward looks like a turn of minus so much, if things are where the floor ends, and
    /// what that errs by: things are nearer or farther, each by itself.
    bslam_real_t parallax_rad_per_m;
    bslam_real_t parallax_sd_rad_per_m;  ///< negative where what is seen lies to the right
} bslam_turn_t;

#if BSLAM_VISION_TURNS
/// Looks at the picture finished last, and remembers it. True, and *turn, if it tells how far the robot has
/// turned since the picture of the same camera before. False, *turn unchanged: there is none before, one of
/// the two was unusable (black, say), or it shows nothing but plain walls. Some 9 instructions a pixel.
bool bslam_vision_turn(bslam_vision_t *vision, bslam_turn_t *turn);

/// Forgets the pictures of before: where a gyro starts anew. The next one of each camera tells no turn.
void bslam_vision_forget_turns(bslam_vision_t *vision);
#endif

/// What the rate of a step errs by at least. Errors of some steps follow each other; this is what their sum
/// over seconds asks for.
#define BSLAM_VISUAL_GYRO_SD_RADPS 0.04f
/// The same through a lens of 180 degrees: its columns are coarse, and what is beside the robot moves most.
#define BSLAM_VISUAL_GYRO_WIDE_SD_RADPS 1.0f

/// A gyroscope made of pictures: turns between pictures of one camera each, which may overlap in time, become
/// the robot's turn rate from each step to the next.
///
/// A small Kalman filter of its own, so that a picture's turn, which spans several steps, need not wait in
/// the map's filter: turn rate, speed, the turn since each camera's picture before, how much nearer than the
/// floor line said is what each camera sees, and by how much the heading has turned from what was reported.
typedef union bslam_visual_gyro {
    unsigned char bytes[BSLAM_VISUAL_GYRO_BYTES];
    int64_t alignment_of_times;
    bslam_real_t alignment_of_numbers;
} bslam_visual_gyro_t;

#if BSLAM_VISION_BUILT_IN
/// Nothing known yet. least_sd_radps: what a rate errs by where all goes well, above 0. BSLAM_E_SIZE: as
/// bslam_vision_init.
#define bslam_visual_gyro_init(gyro, least_sd_radps) \
    bslam_visual_gyro_init_sized((gyro), sizeof *(gyro), BSLAM_VISION_HASH, (least_sd_radps))
#if BSLAM_REAL_DOUBLE
#define bslam_visual_gyro_init_sized bslam_visual_gyro_init_double
#endif
BSLAM_MUST_CHECK bslam_status_t bslam_visual_gyro_init_sized(bslam_visual_gyro_t *gyro, size_t gyro_bytes,
                                                             uint32_t sizes_hash,
                                                             bslam_real_t least_sd_radps);

/// Goes on to a time. speed_mps: forward, mean since the time before, by the wheels, and its noise; it only
/// corrects for how driving by moves things in the picture. The first call starts the clock. BSLAM_E_TIME:
/// the time does not advance, or by more than 4 s (after which bslam_visual_gyro_init starts anew).
/// BSLAM_E_NOT_FINITE: the speed. BSLAM_E_RANGE: a noise outside 1e-4 to 100 m/s.
BSLAM_MUST_CHECK bslam_status_t bslam_visual_gyro_advance(bslam_visual_gyro_t *gyro, int64_t time_us,
                                                          bslam_real_t speed_mps, bslam_real_t speed_sd_mps);

/// A picture of a camera, taken at the time of the last advance, and the turn that bslam_vision_turn found;
/// NULL if it found none. BSLAM_E_RANGE: another camera than 0 to BSLAM_CAMERAS_MAX - 1, a variance not above
/// 0; BSLAM_E_NOT_FINITE; BSLAM_E_TIME: before the first advance, or a turn without a picture before.
BSLAM_MUST_CHECK bslam_status_t bslam_visual_gyro_take(bslam_visual_gyro_t *gyro, int32_t camera,
                                                       const bslam_turn_t *turn);

/// The turn rate of the last step, positive to the left, and its noise. The rate brings the heading to where
/// it is thought to be, with what steps before reported wrongly, so that the sum over steps is right; the
/// noise is what the heading's variance grew by of late. False, both unchanged, where too little was seen to
/// know the rate to about 0.4 rad/s. It may be asked after each picture of a step; the last answer counts as
/// reported.
bool bslam_visual_gyro_rate(bslam_visual_gyro_t *gyro, bslam_real_t *rate_radps, bslam_real_t *sd_radps);
#endif

#ifdef __cplusplus
}
#endif

#endif
