#include "vision/built_in/measurement/side.h"

#include <stddef.h>
#include <string.h>

#include "base/bounds.h"
#include "vision/pixels/bytes.h"
#include "base/logarithm.h"
#include "base/scalar.h"

enum { CHANNELS = 3, PLACES = BSLAM_SIDE_PLACES, REACH_OUT = BSLAM_SIDE_REACH_OUT };
// Places for a side that does not turn away from the rough box.
enum { STRAIGHT_PLACES = 15 };

// Which line is the side: weights of the contrast along it and next to it, from three places outside to one
// inside. The contrast is C / (C + HALF_CONTRAST). The weights are a multinomial logistic regression's over
// training worlds: beyond the side the wall is quiet, within it the object has edges of its own. MATH-CAMERA
// "Outline".
enum { TAPS = 5, TAPS_OUTSIDE = 3 };
static const float TAP[TAPS] = {-2.2f, -2.6f, 2.6f, 5.0f, 2.1f};
static const float HALF_CONTRAST = 20.0f;
// How far off the rough side may be: standard deviations in half-resolution pixels, of any side, and as a
// part of the side's length. What is large is boxed by what is within it as easily as by its frame.
static const float ROUGH_SD = 1.0f;
static const float ROUGH_SD_SHARE = 0.06f;
// A line is likelier than another by so much more than their scores say.
static const float LINE_SHARPNESS = 1.25f;

// Scan lines stay this far from the ends of a side, as a fraction of it.
static const bslam_real_t END_MARGIN = BSLAM_R(0.12);
// An edge point needs this much change over three boundaries: squares of 1/63 of a channel's range.
static const int32_t CHANGE_MIN = 12;

// What lies farther from the axes than this is not looked for: coordinates fit in 16 bits, tangents stay
// tame.
static const bslam_real_t COORDINATE_MAX_PX = 16000;
static const bslam_real_t AHEAD_MIN = BSLAM_R(0.05);

bool bslam_facing_from_frame(const bslam_facing_t *facing, bslam_real_t u_px, bslam_real_t v_px,
                             bslam_plane_point_t *point)
{
    bslam_direction_t direction;
    if (bslam_camera_unproject_as(facing->camera, &facing->mounting, u_px, v_px, &direction) != BSLAM_OK) {
        return false;
    }
    const bslam_real_t ahead = facing->cosine * direction.x + facing->sine * direction.y;
    if (!(ahead > AHEAD_MIN)) {
        return false;
    }
    point->across = (facing->cosine * direction.y - facing->sine * direction.x) / ahead;
    point->up = direction.z / ahead;
    return true;
}

bool bslam_facing_to_frame(const bslam_facing_t *facing, bslam_plane_point_t point, bslam_real_t *u_px,
                           bslam_real_t *v_px)
{
    const bslam_direction_t direction = {facing->cosine - facing->sine * point.across,
                                         facing->sine + facing->cosine * point.across, point.up};
    return bslam_camera_project_as(facing->camera, &facing->mounting, &direction, u_px, v_px) == BSLAM_OK &&
           bslam_abs(*u_px) <= COORDINATE_MAX_PX && bslam_abs(*v_px) <= COORDINATE_MAX_PX;
}

static void begin(bslam_side_t *side, const bslam_frame_t *frame, bslam_side_name_t name)
{
    const int32_t width = frame->width_px / 2;
    const int32_t height = frame->height_px / 2;
    memset(side, 0, offsetof(bslam_side_t, scan));  // of its lines nothing is read beyond `count`
    side->half = frame->half;
    side->level = name == BSLAM_SIDE_TOP || name == BSLAM_SIDE_BOTTOM;
    side->backwards = name == BSLAM_SIDE_RIGHT || name == BSLAM_SIDE_BOTTOM;
    side->across = side->level ? width : 1;
    side->along = side->level ? 1 : width;
    side->size = side->level ? height : width;
    side->lines = side->level ? width : height;
}

// A colour in one word: channels of 6 bits each, 1/63 of their range, a byte each, so that two of them add
// without meeting; BIAS keeps the differences of such sums positive.
enum { FIELD_BITS = 8 };
#define FIELD_MASK 255U
#define FIELD_ZERO 128
#define BIAS 0x00808080U

static uint32_t packed(uint16_t pixel)
{
    return (uint32_t)(pixel >> 11) << 1 | (uint32_t)((pixel >> 5) & 63) << FIELD_BITS |
           (uint32_t)(pixel & 31) << (2 * FIELD_BITS + 1);
}

/// A channel of the difference of two words, or of two sums of two.
static int32_t channel_of(uint32_t difference_and_bias, int32_t channel)
{
    return (int32_t)(difference_and_bias >> channel * FIELD_BITS & FIELD_MASK) - FIELD_ZERO;
}

/// Reads `count` pixels inwards from `offset` inside place 0; beyond the frame, its last one is repeated.
static void read_strip(const bslam_side_t *side, int32_t index, int32_t offset, int32_t count,
                       uint32_t *strip)
{
    const int32_t inwards = side->backwards ? -1 : 1;
    const int32_t last = side->size - 1;
    const uint16_t *line = side->half + side->scan[index] * side->along;
    int32_t pixel = side->first[index] + (side->backwards ? -1 - offset : offset);
    const int32_t far_end = pixel + inwards * (count - 1);
    if (pixel >= 0 && pixel <= last && far_end >= 0 && far_end <= last) {
        const int32_t step = inwards * side->across;
        const int32_t start = pixel * side->across;
        for (int32_t k = 0; k < count; k++) {
            strip[k] = packed(line[start + k * step]);
        }
        return;
    }
    for (int32_t k = 0; k < count; k++) {
        const int32_t inside = pixel < 0 ? 0 : pixel > last ? last : pixel;
        strip[k] = packed(line[inside * side->across]);
        pixel += inwards;
    }
}

/// Contrast at each place: the two pixels inside against the two outside.
static void fill_steps(bslam_side_t *side, int32_t index)
{
    uint32_t strip[PLACES + 3];
    read_strip(side, index, -2, side->places + 3, strip);
    uint8_t *steps = side->steps[index];
    for (int32_t place = 0; place < side->places; place++) {
        const uint32_t *at = strip + place;
        steps[place] = bslam_byte_at_most(bslam_bytes_apart_sum(at[2] + at[3], at[0] + at[1]));
    }
}

static int32_t round_to_int(bslam_real_t x)
{
    return (int32_t)(x + (x < 0 ? BSLAM_R(-0.5) : BSLAM_R(0.5)));
}

/// Adds the scan line through a point of the rough side, from so many places outside it on, unless the frame
/// has none there or it is the same as the one before. False if the lens does not see the point.
static bool add_scan(bslam_side_t *side, const bslam_facing_t *facing, bslam_plane_point_t rough,
                     int32_t reach_out)
{
    bslam_real_t u_px;
    bslam_real_t v_px;
    if (!bslam_facing_to_frame(facing, rough, &u_px, &v_px)) {
        return false;
    }
    const int32_t scan = round_to_int(((side->level ? u_px : v_px) - BSLAM_R(0.5)) / 2);
    const bslam_real_t across = ((side->level ? v_px : u_px) + BSLAM_R(0.5)) / 2;
    const int32_t i = side->count;
    if (scan < 0 || scan >= side->lines || (i > 0 && scan == side->scan[i - 1])) {
        return true;
    }
    const int32_t boundary = round_to_int(across);
    const float rest = (float)(across - (bslam_real_t)boundary);
    side->scan[i] = (int16_t)scan;
    side->first[i] = (int16_t)(boundary + (side->backwards ? reach_out : -reach_out));
    side->at[i] = (float)rough.across;
    side->base[i] = (float)reach_out + (side->backwards ? -rest : rest);
    fill_steps(side, i);
    side->count++;
    return true;
}

/// Where a scan line crosses a side, off its ends.
static bslam_real_t along_side(bslam_real_t from, bslam_real_t to, int32_t index)
{
    const bslam_real_t part = (bslam_real_t)index / (BSLAM_SIDE_SCANS - 1);
    return from + (to - from) * (END_MARGIN + part * (1 - 2 * END_MARGIN));
}

/// What a line costs a place away from the rough side, by how long that is, half-resolution pixels.
static float rough_cost(float length)
{
    const float by_length = ROUGH_SD_SHARE * length;
    return 0.5f / (ROUGH_SD * ROUGH_SD + by_length * by_length);
}

bool bslam_side_scan(bslam_side_t *side, const bslam_frame_t *frame, const bslam_facing_t *facing,
                     bslam_side_name_t name, bslam_real_t at, bslam_real_t from, bslam_real_t to,
                     bslam_real_t pixel)
{
    begin(side, frame, name);
    side->places = STRAIGHT_PLACES;
    side->rough_cost = rough_cost((float)((to - from) / (2 * pixel)));
    if (side->level) {
        side->reach = (float)((side->backwards ? at : -at) / (2 * pixel));
        const bslam_real_t ends =
            bslam_abs((bslam_real_t)side->reach * (to - from));  // apart, for a turn of 1
        side->places = ends < PLACES - STRAIGHT_PLACES ? STRAIGHT_PLACES + (int32_t)ends : PLACES;
    }
    for (int32_t i = 0; i < BSLAM_SIDE_SCANS; i++) {
        const bslam_real_t along = along_side(from, to, i);
        const bslam_plane_point_t point = {side->level ? along : at, side->level ? at : along};
        if (!add_scan(side, facing, point, REACH_OUT)) {
            return false;
        }
    }
    return true;
}

/// How much nearer than in the plane's middle a body is at a place across.
///
/// Along the front 1/x is linear, 1/x = (1 + turn across) / x0; along a flank it is proportional to turn -
/// across.
static float nearness(const bslam_stance_t *stance, float across)
{
    const float corner = across > stance->left    ? stance->left
                         : across < stance->right ? stance->right
                                                  : across;
    const float near = 1.0f + stance->turn * corner;
    return corner != across ? near * ((stance->turn - across) / (stance->turn - corner)) : near;
}

/// Places inwards that a body's stance moves its edge by on a scan line.
static float tilt_of(const bslam_side_t *side, int32_t index, const bslam_stance_t *stance)
{
    const float tilt = side->reach * (nearness(stance, side->at[index]) - 1.0f);
    const float most = (float)PLACES;
    return tilt >= -most && tilt <= most ? tilt : most;  // out of the window, as is what has no place at all
}

float bslam_side_contrast(const bslam_frame_t *frame, const bslam_facing_t *facing, bslam_side_name_t name,
                          bslam_real_t at, bslam_real_t from, bslam_real_t to, const bslam_stance_t *stance)
{
    bslam_side_t side;
    begin(&side, frame, name);
    side.places = 1;
    int32_t sum = 0;
    for (int32_t i = 0; i < BSLAM_SIDE_SCANS; i++) {
        const bslam_real_t across = along_side(from, to, i);
        const bslam_real_t near = (bslam_real_t)nearness(stance, (float)across);
        const int32_t count = side.count;
        if (!add_scan(&side, facing, (bslam_plane_point_t){across, at * near}, 0)) {
            return -1;
        }
        sum += side.count > count ? side.steps[count][0] : 0;
    }
    return side.count > 0 ? (float)sum / ((float)sum + HALF_CONTRAST * (float)side.count) : -1;
}

/// One past the last line whose taps all lie in the window.
static int32_t lines_end(const bslam_side_t *side)
{
    return side->places - TAPS + TAPS_OUTSIDE;
}

/// Mean contrast along each of a stance's lines, as C / (C + HALF_CONTRAST), by shift + REACH_OUT; returns
/// how far inwards of the shift the outermost end of these lines is.
static float contrasts(const bslam_side_t *side, const bslam_stance_t *stance, float contrast[PLACES])
{
    const int32_t places = side->places;
    int32_t sums[PLACES] = {0};
    float outermost = 0;
    for (int32_t i = 0; i < side->count; i++) {
        const float tilt = tilt_of(side, i, stance);
        const int32_t offset = (int32_t)(side->base[i] + tilt + (float)PLACES + 0.5f) - PLACES - REACH_OUT;
        const int32_t from = offset < 0 ? -offset : 0;
        const int32_t to = offset > 0 ? places - offset : places;
        outermost = tilt < outermost ? tilt : outermost;
        for (int32_t k = from; k < to; k++) {
            sums[k] += side->steps[i][k + offset];
        }
    }
    const float half = HALF_CONTRAST * (float)(side->count > 0 ? side->count : 1);
    for (int32_t k = 0; k < places; k++) {
        const float sum = (float)sums[k];
        contrast[k] = sum / (sum + half);
    }
    return outermost;
}

/// Scores of a stance's lines by shift + REACH_OUT, from TAPS_OUTSIDE to before lines_end; returns the best
/// one.
static int32_t fill_scores(const bslam_side_t *side, const bslam_stance_t *stance, float scores[PLACES])
{
    float contrast[PLACES] = {0};
    const float outermost = contrasts(side, stance, contrast);
    const int32_t end = lines_end(side);
    int32_t best = TAPS_OUTSIDE;
    for (int32_t k = TAPS_OUTSIDE; k < end; k++) {
        const float away = (float)(k - REACH_OUT) + outermost;
        const float *taps = contrast + k - TAPS_OUTSIDE;
        scores[k] = TAP[0] * taps[0] + TAP[1] * taps[1] + TAP[2] * taps[2] + TAP[3] * taps[3] +
                    TAP[4] * taps[4] - side->rough_cost * away * away;
        best = scores[k] > scores[best] ? k : best;
    }
    return best;
}

float bslam_side_score(const bslam_side_t *side, const bslam_stance_t *stance)
{
    float scores[PLACES];
    return scores[fill_scores(side, stance, scores)];
}

bslam_line_t bslam_side_line(const bslam_side_t *side, const bslam_stance_t *stance)
{
    float scores[PLACES];
    const int32_t best = fill_scores(side, stance, scores);
    const int32_t end = lines_end(side);
    float whole = 0.0f;
    float first = 0.0f;
    float second = 0.0f;
    for (int32_t k = TAPS_OUTSIDE; k < end; k++) {
        const float share = bslam_falling(LINE_SHARPNESS * (scores[best] - scores[k]));
        const float away =
            bslam_magnitude(k - best) <= 1 ? 0.0f : (float)(k - best);  // neighbours are the same edge
        whole += share;
        first += share * away;
        second += share * away * away;
    }
    const float mean = first / whole;
    return (bslam_line_t){(float)(best - REACH_OUT), mean, second / whole - mean * mean};
}

/// Place of the edge on a scan line, near `near_place`: the centroid of the changes over the three boundaries
/// around it, each as far as it goes along the whole change. False where there is hardly any.
static bool edge_place(const bslam_side_t *side, int32_t index, float near_place, bslam_real_t *place)
{
    const int32_t middle = (int32_t)(near_place + 0.5f);
    if (middle < 1 || middle >= side->places - 1) {
        return false;
    }
    uint32_t pixels[4];
    read_strip(side, index, middle - 2, 4, pixels);
    const uint32_t change = pixels[3] + BIAS - pixels[0];
    const uint32_t shift = pixels[3] + pixels[0] + BIAS - pixels[2] - pixels[1];
    int32_t whole = 0;
    int32_t moment = 0;
    for (int32_t c = 0; c < CHANNELS; c++) {
        whole += channel_of(change, c) * channel_of(change, c);
        moment += channel_of(change, c) * channel_of(shift, c);
    }
    if (whole < CHANGE_MIN || bslam_magnitude(moment) > whole) {
        return false;
    }
    *place = (bslam_real_t)middle + (bslam_real_t)moment / (bslam_real_t)whole;
    return true;
}

void bslam_side_trace(const bslam_side_t *side, const bslam_facing_t *facing, const bslam_line_t *line,
                      const bslam_stance_t *stance, bslam_edge_t *edge)
{
    edge->count = 0;
    edge->offset = (bslam_real_t)line->offset;
    edge->variance = (bslam_real_t)line->variance;
    for (int32_t i = 0; i < side->count; i++) {
        const float near_place = side->base[i] + line->shift + tilt_of(side, i, stance);
        bslam_real_t place;
        if (edge_place(side, i, near_place, &place)) {
            const bslam_real_t first = (bslam_real_t)side->first[i];
            const bslam_real_t px = 2 * (side->backwards ? first - place : first + place) - BSLAM_R(0.5);
            const bslam_real_t scan_px = 2 * (bslam_real_t)side->scan[i] + BSLAM_R(0.5);
            const bool seen = bslam_facing_from_frame(facing, side->level ? scan_px : px,
                                                      side->level ? px : scan_px, &edge->points[edge->count]);
            edge->count += seen ? 1 : 0;
        }
    }
}
