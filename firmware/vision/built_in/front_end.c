#include "base/types.h"
#include "vision/built_in/front_end.h"

#include <stddef.h>
#include <string.h>

#include "base/bounds.h"
#include "vision/pixels/bytes.h"
#include "base/logarithm.h"
#include "base/trig.h"
#include "vision/camera/zoom.h"
#include "vision/built_in/detection/features.h"
#include "vision/built_in/detection/prefilter.h"
#include "vision/built_in/detection/vertical_edges.h"
#include "vision/built_in/classifiers/beacon_model.h"
#include "base/scalar.h"

/// A cell is black below this in every channel, saturated from the other on. The frame is unusable if more
/// than these shares of its cells are, in percent.
#define BLACK_BELOW 16
#define SATURATED_FROM 244
/// Bits of a word's bytes of which a black cell has none, a saturated one all.
#define HIGH_BITS 0xF0F0F0F0U
/// Where these bits differ from the next lower one, in a byte with itself shifted: nowhere in either cell.
#define HIGH_TURNS 0xE0E0E0E0U
#define BLACK_PERCENT 95
#define SATURATED_PERCENT 60
/// A frame whose cells' green differs by at most this is of one colour.
#define FLAT_RANGE 12
/// An outline that overlaps the detector's box less than this is of something else.
#define AGREE_MIN BSLAM_R(0.75)
/// What hanging where its kind does not costs, in margins: so much of half the square of its standard
/// deviations, of one at most, for an outline may be wrong by more. And the logarithm of the odds that a
/// margin stands for. Both are a logistic regression's over 5683 things in training worlds.
#define MISPLACED_MARGIN 0.4f
#define CLASS_SHARPNESS 3.3f
/// The same of what the frame cuts off, of which less is seen: a fit to 4000 things in training worlds.
#define CUT_CLASS_SHARPNESS 1.2f
/// From this margin on the other kind is so rare, below 4 %, that a filter's gate is the better remedy: a
/// standard deviation would take from all what few deserve.
#define CLASS_SURE 1.0f

static const bslam_detector_model_t *detector_for(const bslam_beacon_model_t *model,
                                                  const bslam_camera_t *camera)
{
    return camera->lens == BSLAM_LENS_PINHOLE ? &model->pinhole : &model->wide;
}

bslam_status_t bslam_front_end_init(bslam_front_end_t *vision, const bslam_beacon_model_t *model,
                                    const bslam_camera_t *cameras, int32_t camera_count)
{
    bslam_status_t status = bslam_beacon_model_check(model);
    if (status == BSLAM_OK) {
        status = bslam_zoom_check(cameras, camera_count);
    }
    if (status != BSLAM_OK) {
        return status;
    }
    memset(vision, 0, sizeof *vision);
    vision->model = model;
    vision->camera_count = camera_count;
    vision->reason = BSLAM_VISION_UNFINISHED;
    for (int32_t i = 0; i < camera_count; i++) {
        vision->cameras[i] = bslam_zoom_camera(cameras[i]);
        vision->machines[i] = bslam_cell_machine(&detector_for(model, &cameras[i])->cell);
        bslam_background_init(&vision->backgrounds[i]);
    }
    return BSLAM_OK;
}

static bool is_unfinished(const bslam_front_end_t *vision)
{
    const int32_t seen = vision->thumbnail.rows_seen;
    return vision->reason == BSLAM_VISION_UNFINISHED && seen > 0;
}

bslam_status_t bslam_front_end_begin(bslam_front_end_t *vision, int32_t camera, bslam_pixel_format_t format,
                                     int32_t width_px, int32_t height_px)
{
    if (camera < 0 || camera >= vision->camera_count) {
        return BSLAM_E_RANGE;
    }
    const bslam_camera_t *lens = &vision->cameras[camera];
    if (!bslam_zoom_is_size(lens, width_px, height_px)) {
        return BSLAM_E_RANGE;
    }
    const bool gives_up = is_unfinished(vision);
    const bslam_status_t status =
        bslam_thumbnail_begin(&vision->thumbnail, format, lens->width_px, lens->height_px);
    if (status != BSLAM_OK) {
        return status;
    }
    vision->frames[BSLAM_VISION_UNFINISHED] += gives_up ? 1 : 0;
    vision->camera = camera;
    vision->candidate_count = 0;
    vision->proposals.count = 0;
    vision->reason = BSLAM_VISION_UNFINISHED;
    return BSLAM_OK;
}

bslam_status_t bslam_front_end_row(bslam_front_end_t *vision, const void *pixels)
{
    bslam_thumbnail_t *thumbnail = &vision->thumbnail;
    return vision->cameras[vision->camera].zoom > 1
               ? bslam_thumbnail_row_doubled(thumbnail, &vision->row_sums, pixels)
               : bslam_thumbnail_row(thumbnail, &vision->row_sums, pixels);
}

bslam_status_t bslam_front_end_point(bslam_front_end_t *vision, int32_t camera, bslam_real_t yaw_rad)
{
    if (camera < 0 || camera >= vision->camera_count || !bslam_in_range(yaw_rad, -BSLAM_PI, BSLAM_PI)) {
        return BSLAM_E_RANGE;
    }
    vision->cameras[camera].yaw_rad = yaw_rad;
    return BSLAM_OK;
}

/// How many cells are black and saturated, and whether their green differs by more than FLAT_RANGE.
typedef struct light {
    int32_t black, saturated;
    bool varied;
} light_t;

static bool is_varied(const uint8_t *green, int32_t count)
{
    uint8_t low = 255, high = 0;
    for (int32_t i = 0; i < count; i++) {
        low = green[i] < low ? green[i] : low;
        high = green[i] > high ? green[i] : high;
        if (high - low > FLAT_RANGE) {
            return true;
        }
    }
    return false;
}

static void judge_cell(bslam_cell_t cell, light_t *light)
{
    const bool is_black = cell.red < BLACK_BELOW && cell.green < BLACK_BELOW && cell.blue < BLACK_BELOW;
    const bool is_saturated =
        cell.red >= SATURATED_FROM && cell.green >= SATURATED_FROM && cell.blue >= SATURATED_FROM;
    light->black += is_black ? 1 : 0;
    light->saturated += is_saturated ? 1 : 0;
}

enum { CELLS_AT_ONCE = BSLAM_WORD_BYTES };

/// Whether one of some cells has no bit above BLACK_BELOW, or all that SATURATED_FROM has. Most have not in
/// their green already.
static inline bool may_count(const bslam_cells_t *cells, int32_t i)
{
    const uint32_t green = bslam_word_at(cells->green + i);
    if (!bslam_has_zero_byte((green ^ green << 1) & HIGH_TURNS)) {
        return false;
    }
    const uint32_t red = bslam_word_at(cells->red + i), blue = bslam_word_at(cells->blue + i);
    const uint32_t bright = (red | green | blue) & HIGH_BITS, dim = ~(red & green & blue) & HIGH_BITS;
    return bslam_has_zero_byte(bright) || bslam_has_zero_byte(dim);
}

/// Cells are looked at one by one only where one of some may count: few do.
static light_t light_of(const bslam_cells_t *cells, int32_t count)
{
    light_t light = {.varied = is_varied(cells->green, count)};
    int32_t i = 0;
    for (; i + CELLS_AT_ONCE <= count; i += CELLS_AT_ONCE) {
        if (may_count(cells, i)) {
            for (int32_t k = 0; k < CELLS_AT_ONCE; k++) {
                judge_cell(bslam_cell_at(cells, i + k), &light);
            }
        }
    }
    for (; i < count; i++) {
        judge_cell(bslam_cell_at(cells, i), &light);
    }
    return light;
}

/// What makes a frame unusable, or BSLAM_VISION_NOTHING if nothing does.
static bslam_vision_reason_t judge_light(const bslam_frame_t *frame)
{
    const int32_t count = frame->rows * frame->columns;
    const light_t light = light_of(frame->cells, count);
    const int32_t black = light.black, saturated = light.saturated;
    if (100 * black > BLACK_PERCENT * count) {
        return BSLAM_VISION_BLACK;
    }
    if (100 * saturated > SATURATED_PERCENT * count) {
        return BSLAM_VISION_OVEREXPOSED;
    }
    return light.varied ? BSLAM_VISION_NOTHING : BSLAM_VISION_FLAT;
}

static bslam_frame_t finished_frame(const bslam_front_end_t *vision)
{
    const bslam_frame_t frame = {
        .width_px = vision->thumbnail.width_px,
        .height_px = vision->thumbnail.height_px,
        .columns = vision->thumbnail.width_px / BSLAM_CELL_PX,
        .rows = vision->thumbnail.height_px / BSLAM_CELL_PX,
        .cells = &vision->thumbnail.cells,
        .half = vision->thumbnail.half,
        .surroundings = &vision->backgrounds[vision->camera].surroundings,
    };
    return frame;
}

/// The view of the finished frame, for readers; its writable tables are the instance's own.
static bslam_view_t view_of(const bslam_front_end_t *vision, const bslam_frame_t *frame)
{
    const bslam_view_t view = {
        .frame = frame,
        .camera = &vision->cameras[vision->camera],
        .mounting = bslam_camera_mounting(&vision->cameras[vision->camera]),
        .background = &vision->backgrounds[vision->camera],
        .floor_line = &vision->floor_line,
        .tones = &vision->tones,
        .frequent = vision->thumbnail.notes.frequent,
        .step_x = vision->step_x,
        .step_y = vision->step_y,
        .values = vision->thumbnail.notes.values,
    };
    return view;
}

static bslam_size_t size_of(const bslam_beacon_class_t *kind)
{
    return (bslam_size_t){
        .height_m = (bslam_real_t)kind->height_m,
        .depth_m = (bslam_real_t)kind->depth_m,
        .top_low_m = (bslam_real_t)kind->top_low_m,
        .top_high_m = (bslam_real_t)kind->top_high_m,
        .looks_sd = (bslam_real_t)kind->looks_sd,
        .width_m = (bslam_real_t)kind->width_m,
        .body_m = (bslam_real_t)kind->body_m,
        .narrow_m = (bslam_real_t)kind->narrow_m,
        .wide_m = (bslam_real_t)kind->wide_m,
        .scale_sd = (bslam_real_t)kind->scale_sd,
    };
}

/// What hanging in the wrong place costs, in margins.
static float misplacement(const bslam_candidate_t *candidate)
{
    const float half_square = candidate->misplaced_sds * candidate->misplaced_sds / 2;
    return MISPLACED_MARGIN * (half_square < 1.0f ? half_square : 1.0f);
}

/// The candidate as its second kind would be measured; false if that cannot be.
static bool measure_as_second(const bslam_front_end_t *vision, const bslam_frame_t *frame,
                              const bslam_box_t *rough, const bslam_candidate_t *candidate,
                              bslam_candidate_t *other)
{
    const bslam_size_t size = size_of(&vision->model->classes[candidate->second_class - 1]);
    *other = *candidate;
    return bslam_measure(frame, &vision->cameras[vision->camera], rough, &size, other) == BSLAM_OK;
}

/// Where the second kind hangs better, so much that it outweighs the margin, the candidate becomes that: a
/// cabinet is often taken for a door, but would end in the air as one.
static void try_second_class(const bslam_front_end_t *vision, const bslam_frame_t *frame,
                             const bslam_box_t *rough, bslam_candidate_t *candidate)
{
    // Even where the second kind hangs perfectly, it must outweigh the margin.
    if (candidate->second_class == BSLAM_CLASS_NONE || !(misplacement(candidate) > candidate->class_margin)) {
        return;
    }
    bslam_candidate_t other;
    if (measure_as_second(vision, frame, rough, candidate, &other) && other.has_range &&
        misplacement(&other) + candidate->class_margin < misplacement(candidate)) {
        other.beacon_class = candidate->second_class;
        other.second_class = candidate->beacon_class;
        other.class_margin = -candidate->class_margin;
        *candidate = other;
    }
}

/// As the second kind it would be nearer or farther by the heights' ratio. How likely it is that goes into
/// the distance's standard deviation, and as a part of what all distances of the thing have in common: its
/// looks are the same in the next frame. What is hardly certain then is no distance.
static void doubt_class(const bslam_front_end_t *vision, bslam_candidate_t *candidate)
{
    const bslam_beacon_class_t *classes = vision->model->classes;
    if (candidate->second_class == BSLAM_CLASS_NONE || candidate->class_margin > CLASS_SURE) {
        return;
    }
    const float height_m = classes[candidate->beacon_class - 1].height_m;
    const float other_m = classes[candidate->second_class - 1].height_m;
    if (!(height_m > 0 && other_m > 0)) {
        return;
    }
    const float margin = candidate->class_margin > 0 ? candidate->class_margin : 0;
    const float quarter = bslam_falling(CLASS_SHARPNESS / 4 * margin);
    const float odds = quarter * quarter * quarter * quarter;
    const float off = bslam_clampf(other_m / height_m - 1, -1, 1);
    bslam_measure_doubt(candidate, (bslam_real_t)(off * off * odds / ((1 + odds) * (1 + odds))));
}

/// What the frame cuts off may be the second kind, and then goes on as far as that one does: a window's end
/// is often taken for a poster. Its direction is the mean of both by how likely they are.
static void doubt_cut(const bslam_front_end_t *vision, const bslam_frame_t *frame, const bslam_box_t *rough,
                      bslam_candidate_t *candidate)
{
    if (candidate->second_class == BSLAM_CLASS_NONE || !candidate->has_bearing ||
        (candidate->marks & (BSLAM_MARK_CUT_LEFT | BSLAM_MARK_CUT_RIGHT)) == 0U) {
        return;
    }
    bslam_candidate_t other;
    if (!measure_as_second(vision, frame, rough, candidate, &other) || !other.has_bearing) {
        return;
    }
    const float margin = candidate->class_margin > 0 ? candidate->class_margin : 0;
    const float odds = bslam_falling(CUT_CLASS_SHARPNESS * margin);
    const bslam_real_t chance = (bslam_real_t)(odds / (1 + odds));
    const bslam_real_t apart_rad = bslam_angle_wrap(other.bearing_rad - candidate->bearing_rad);
    const bslam_real_t variance = (1 - chance) * candidate->bearing_sd_rad * candidate->bearing_sd_rad +
                                  chance * other.bearing_sd_rad * other.bearing_sd_rad +
                                  chance * (1 - chance) * apart_rad * apart_rad;
    candidate->bearing_rad = bslam_angle_wrap(candidate->bearing_rad + chance * apart_rad);
    candidate->bearing_sd_rad = bslam_sqrt(variance);
}

/// Direction, distance and signature of a candidate.
static bslam_status_t measure_one(const bslam_front_end_t *vision, const bslam_frame_t *frame,
                                  bslam_candidate_t *candidate)
{
    const bslam_camera_t *camera = &vision->cameras[vision->camera];
    const bslam_size_t size = size_of(&vision->model->classes[candidate->beacon_class - 1]);
    const bslam_box_t rough = candidate->outline;
    const bslam_status_t status = bslam_measure(frame, camera, &rough, &size, candidate);
    if (status == BSLAM_OK) {
        try_second_class(vision, frame, &rough, candidate);
        doubt_class(vision, candidate);
        doubt_cut(vision, frame, &rough, candidate);
    }
    return status;
}

/// Measures the candidates; one that has no outline is of no use. Through a wide lens a thing's sides are
/// bent, and the box around the straight ones that measuring finds is too narrow: there the detector's stays.
/// So it does where the outline is of something else. Not to be inlined: its candidates would be on the stack
/// while proposals are judged.
__attribute__((noinline)) static void measure(bslam_front_end_t *vision, const bslam_frame_t *frame)
{
    const bool is_wide = vision->cameras[vision->camera].lens == BSLAM_LENS_EQUIDISTANT;
    int32_t kept = 0;
    for (int32_t i = 0; i < vision->candidate_count; i++) {
        bslam_candidate_t candidate = vision->candidates[i];
        const bslam_box_t found = candidate.outline;
        if (measure_one(vision, frame, &candidate) == BSLAM_OK) {
            const bool agrees = bslam_box_overlap(&found, &candidate.outline) >= AGREE_MIN;
            if (is_wide || !agrees) {
                candidate.outline = found;
            }
            candidate.outline = bslam_zoom_out_box(candidate.outline, vision->cameras[vision->camera].zoom);
            vision->candidates[kept] = candidate;
            kept++;
        }
    }
    vision->candidate_count = kept;
}

static void look(bslam_front_end_t *vision, const bslam_frame_t *frame, bool robot_moved)
{
    const int32_t camera = vision->camera;
    bslam_background_t *background = &vision->backgrounds[camera];
    const bslam_detector_model_t *detector = detector_for(vision->model, &vision->cameras[camera]);
    const bslam_view_t view = view_of(vision, frame);

    bslam_background_tones(frame, &vision->tones);
    if (robot_moved || !background->surroundings.known) {
        bslam_background_learn(background, frame, view.camera, &vision->tones);
    }
    bslam_background_floor_line(background, frame, view.camera, &vision->tones, &vision->floor_line);
    bslam_cells_step(&view, vision->step_x, vision->step_y);
    bslam_cell_notes_t *notes = &vision->thumbnail.notes;
    bslam_cells_decide(&view, &vision->machines[camera], &notes->tables, &vision->channel_tables,
                       notes->frequent, notes->values);
    bslam_proposals_find(&vision->proposals, &view, vision->runs, notes->masks);
    bslam_vertical_edges_propose(&vision->proposals, &view, &notes->steps);
    vision->candidate_count = bslam_detector_judge(
        detector, vision->model->classes, vision->model->class_count, &view, &vision->proposals,
        vision->opinions, vision->candidates, &vision->candidates_dropped);
    measure(vision, frame);
}

bslam_status_t bslam_front_end_end(bslam_front_end_t *vision, bool robot_moved)
{
    if (vision->reason != BSLAM_VISION_UNFINISHED || vision->thumbnail.rows_seen == 0 ||
        vision->thumbnail.rows_seen < vision->thumbnail.height_px) {
        return BSLAM_E_COUNT;
    }
    const bslam_frame_t frame = finished_frame(vision);
    vision->reason = judge_light(&frame);
    if (vision->reason == BSLAM_VISION_NOTHING) {
        look(vision, &frame, robot_moved);
        vision->reason = vision->candidate_count > 0 ? BSLAM_VISION_SEEN : BSLAM_VISION_NOTHING;
    }
    vision->frames[vision->reason]++;
    return BSLAM_OK;
}

bslam_box_t bslam_front_end_proposal_box(const bslam_front_end_t *vision, int32_t index)
{
    return bslam_zoom_out_box(vision->proposals.items[index].box, vision->cameras[vision->camera].zoom);
}

void bslam_front_end_blob_features(const bslam_front_end_t *vision, int32_t index,
                                   float features[BSLAM_BLOB_FEATURES])
{
    const bslam_frame_t frame = finished_frame(vision);
    const bslam_view_t view = view_of(vision, &frame);
    bslam_blob_features(&view, &vision->proposals.items[index], features);
}

void bslam_front_end_prefilter(const bslam_front_end_t *vision, int32_t index,
                               float glance[BSLAM_GLANCE_FEATURES])
{
    const bslam_frame_t frame = finished_frame(vision);
    const bslam_view_t view = view_of(vision, &frame);
    bslam_box_prefilter(&view, &vision->proposals.items[index], glance);
}

void bslam_front_end_close_features(const bslam_front_end_t *vision, int32_t index,
                                    uint8_t features[BSLAM_CLOSE_FEATURES])
{
    const bslam_frame_t frame = finished_frame(vision);
    float blob[BSLAM_BLOB_FEATURES];
    bslam_front_end_blob_features(vision, index, blob);
    bslam_detector_normalise(detector_for(vision->model, &vision->cameras[vision->camera]), blob);
    bslam_patch_features(&frame, &vision->proposals.items[index].box, features);
    bslam_detector_tell(blob, features + BSLAM_PATCH_FEATURES);
}

void bslam_front_end_cell_features(const bslam_front_end_t *vision, int32_t row, int32_t column,
                                   int16_t features[BSLAM_CELL_FEATURES])
{
    const bslam_frame_t frame = finished_frame(vision);
    const bslam_view_t view = view_of(vision, &frame);
    bslam_cell_features(&view, row, column, features);
}

bslam_status_t bslam_front_end_measure(const bslam_front_end_t *vision, const bslam_box_t *rough,
                                       const bslam_size_t *size, bslam_candidate_t *candidate)
{
    const bslam_frame_t frame = finished_frame(vision);
    const bslam_camera_t *camera = &vision->cameras[vision->camera];
    const bslam_box_t box = bslam_zoom_in_box(*rough, camera->zoom);
    const bslam_status_t status = bslam_measure(&frame, camera, &box, size, candidate);
    if (status == BSLAM_OK) {
        candidate->outline = bslam_zoom_out_box(candidate->outline, camera->zoom);
    }
    return status;
}
