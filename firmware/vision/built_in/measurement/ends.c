#include "vision/built_in/measurement/ends.h"

#include "base/logarithm.h"
#include "base/trig.h"
#include "vision/built_in/measurement/body.h"
#include "vision/built_in/measurement/shade.h"
#include "base/scalar.h"

// Places that a side may move to, from so many steps outwards to as many inwards; and how many steps are
// looked along at first.
enum { STEPS = 5, PLACES = 2 * STEPS + 1, FIRST_STEPS = 2 };

static const bslam_real_t STEP_PX = 6;

// Which place the side is at: weights of its upright edge (side.c's score); of each step that it takes in
// whose level sides are there, or are not (inwards; outwards they mostly are not), and whose colour is the
// object's and not the wall's; of each step that it moves; and of the parts by which the front would be too
// wide or too narrow. They are a multinomial logistic regression's over 960 training worlds, rounded. A side
// that does not gain that much stays.
static const float BY_EDGE = 0.8f;
static const float BY_LEVEL = 4.5f;
static const float BY_NO_LEVEL = 2.0f;
static const float BY_COLOUR = 2.3f;
static const float BY_STEP = 1.1f;
static const float BY_WIDE = 10.9f;
static const float BY_NARROW = 9.7f;
static const float GAIN_MIN = 0.3f;
// The score of what is no place.
static const float NO_PLACE = -1e9f;
// No edge makes up for more than that.
static const float EDGE_MOST = 6.0f;
// A step of level sides speaks for itself if it has this much of the contrast in the middle.
static const float LEVEL_SHARE = 0.8f;
// Too wide begins here; and this much too wide, as a part of what it may be, is reason enough to look.
static const float WIDE_MARGIN = 0.03f;
static const float WIDE_LOOK = 0.08f;
// The ends of level sides tell nothing of what they are like in the middle: so much of them at each end.
static const bslam_real_t END_SHARE = BSLAM_R(0.25);

typedef struct contrast {
    float top;
    float bottom;
} contrast_t;

/// One end of an outline.
typedef struct end {
    const bslam_frame_t *frame;
    const bslam_facing_t *facing;
    const bslam_outline_t *outline;
    const bslam_front_t *front;
    bslam_stance_t stance;
    contrast_t middle;      ///< of the level sides there
    bslam_shade_t inside;   ///< colour of the middle,
    bslam_shade_t outside;  ///< and of the outmost step
    bslam_side_name_t name;
    bslam_real_t at;       ///< of the end, across
    bslam_real_t inwards;  ///< a step
    int32_t inmost;        ///< steps that it may move inwards,
    int32_t outmost;       ///< and outwards
} end_t;

/// Where an end is, in steps inwards.
typedef struct place {
    int32_t best;
    float offset;    ///< from there to the mean of all places, by their probabilities,
    float variance;  ///< and these places' variance
} place_t;

static float lesser(float a, float b)
{
    return a < b ? a : b;
}

/// The place of a step's outer side, across.
static bslam_real_t across_at(const end_t *end, int32_t step)
{
    return end->at + (bslam_real_t)step * end->inwards;
}

/// Contrast along a level side between two places across; below 0 if there is none in the frame.
static float level_contrast(const end_t *end, bslam_side_name_t name, bslam_real_t left, bslam_real_t right)
{
    const bslam_outline_t *o = end->outline;
    const bslam_real_t at = name == BSLAM_SIDE_TOP ? o->top : o->bottom;
    return bslam_side_contrast(end->frame, end->facing, name, at, left, right, &end->stance);
}

static contrast_t level_contrasts(const end_t *end, bslam_real_t left, bslam_real_t right)
{
    return (contrast_t){level_contrast(end, BSLAM_SIDE_TOP, left, right),
                        level_contrast(end, BSLAM_SIDE_BOTTOM, left, right)};
}

/// What the level sides between two places say for that being the object's.
static float level_evidence(const end_t *end, int32_t outer, int32_t inner)
{
    const bslam_real_t from = across_at(end, outer), to = across_at(end, inner);
    const contrast_t strip =
        end->inwards < 0 ? level_contrasts(end, from, to) : level_contrasts(end, to, from);
    if (strip.top < 0 || strip.bottom < 0) {
        return 0;
    }
    const float top = lesser(strip.top, end->middle.top) - LEVEL_SHARE * end->middle.top;
    const float bottom = lesser(strip.bottom, end->middle.bottom) - LEVEL_SHARE * end->middle.bottom;
    if (top >= 0 && bottom >= 0) {
        return BY_LEVEL * (top + bottom);
    }
    return outer < 0 ? 0 : BY_NO_LEVEL * (lesser(top, 0) + lesser(bottom, 0));
}

static bool shade_of_step(const end_t *end, int32_t step, bslam_shade_t *shade)
{
    return bslam_shade_between(end->frame, end->facing, end->outline, across_at(end, step),
                               across_at(end, step + 1), shade);
}

/// Takes the colours that a step's is compared with; the same twice, which say nothing, if one is not there.
static void take_shades(end_t *end)
{
    const bslam_outline_t *o = end->outline;
    const bslam_real_t off = END_SHARE * (o->body_left - o->body_right);
    if (!bslam_shade_between(end->frame, end->facing, o, o->body_left - off, o->body_right + off,
                             &end->inside) ||
        !shade_of_step(end, -end->outmost, &end->outside)) {
        end->inside = end->outside = (bslam_shade_t){0, 0, 0};
    }
}

/// What a step says for being the object's.
static float step_evidence(const end_t *end, int32_t step)
{
    const float level = level_evidence(end, step, step + 1);
    bslam_shade_t shade;
    if (!shade_of_step(end, step, &shade)) {
        return level;
    }
    return level +
           BY_COLOUR * (bslam_shade_apart(&shade, &end->outside) - bslam_shade_apart(&shade, &end->inside));
}

/// By what part the front is seen too wide, or too narrow, with the end at a place; 0 if its size is not
/// known.
static float width_cost(const end_t *end, int32_t step)
{
    const bslam_outline_t *o = end->outline;
    const bslam_front_t *front = end->front;
    if (!(front->height_m > 0 && front->wide_m > 0)) {
        return 0;
    }
    const bslam_real_t moved = (bslam_real_t)step * bslam_abs(end->inwards);
    const bslam_real_t width_m =
        (o->body_left - o->body_right - moved) / (o->top - o->bottom) * front->height_m;
    const bslam_real_t cosine = 1 / bslam_sqrt(1 + o->turn * o->turn);
    const bslam_real_t most_m = front->wide_m + front->depth_m * cosine * bslam_abs(o->turn);
    const float wide = (float)(width_m / most_m) - 1 - WIDE_MARGIN;
    const bslam_real_t least_m = front->narrow_m * cosine;
    const float narrow = least_m > 0 ? 1 - (float)(width_m / least_m) : 0;
    return wide > 0 ? BY_WIDE * wide : narrow > 0 ? BY_NARROW * narrow : 0;
}

/// What an upright edge at a place says for it; false if the lens sees none.
static bool edge_evidence(const end_t *end, int32_t step, float *evidence)
{
    const bslam_outline_t *o = end->outline;
    const bslam_real_t at = across_at(end, step);
    const bslam_real_t near = 1 + o->turn * at;
    bslam_side_t side;
    if (!(near > 0) ||
        !bslam_side_scan(&side, end->frame, end->facing, end->name, at, o->top * near, o->bottom * near,
                         o->pixel) ||
        side.count == 0) {
        return false;
    }
    *evidence = BY_EDGE * bslam_side_score(&side, &BSLAM_FLAT);
    return true;
}

/// Whether the level sides are seen to go on for some steps beyond the end. Mostly the upper one does not,
/// and the lower one is not asked then.
static bool goes_on(const end_t *end, int32_t steps)
{
    const bslam_real_t beyond = across_at(end, -steps);
    const bool is_left = end->inwards < 0;
    const float top =
        level_contrast(end, BSLAM_SIDE_TOP, is_left ? beyond : end->at, is_left ? end->at : beyond);
    return top >= LEVEL_SHARE * end->middle.top && level_evidence(end, -steps, 0) > 0;
}

/// Whether what is next to an end speaks for moving it.
static bool is_doubtful(const end_t *end)
{
    const int32_t in = end->inmost < FIRST_STEPS ? end->inmost : FIRST_STEPS;
    const int32_t out = end->outmost < FIRST_STEPS ? end->outmost : FIRST_STEPS;
    return width_cost(end, 0) > BY_WIDE * WIDE_LOOK || level_evidence(end, 0, in) < 0 || goes_on(end, out);
}

/// What all but the upright edges says for the places from -STEPS to STEPS; returns the most.
static float score_places(const end_t *end, float scores[PLACES])
{
    scores[STEPS] = 0;
    for (int32_t step = 0; step < end->inmost; step++) {
        scores[STEPS + step + 1] = scores[STEPS + step] - step_evidence(end, step) - BY_STEP;
    }
    for (int32_t step = 0; step > -end->outmost; step--) {
        scores[STEPS + step - 1] = scores[STEPS + step] + step_evidence(end, step - 1) - BY_STEP;
    }
    float most = NO_PLACE;
    for (int32_t step = -end->outmost; step <= end->inmost; step++) {
        scores[STEPS + step] -= width_cost(end, step);
        most = scores[STEPS + step] > most ? scores[STEPS + step] : most;
    }
    return most;
}

/// Adds what upright edges say; places that none makes up for are out of the question.
static void score_edges(const end_t *end, float most, float scores[PLACES])
{
    for (int32_t step = -end->outmost; step <= end->inmost; step++) {
        const bool is_near = step >= -1 && step <= 1;  // the outline itself looks as far as that
        float edge = 0;
        const bool counts = is_near || scores[STEPS + step] >= most - EDGE_MOST;
        scores[STEPS + step] =
            counts && edge_evidence(end, step, &edge) ? scores[STEPS + step] + edge : NO_PLACE;
    }
}

/// The likeliest place, 0 if none is likelier than where the end is; and what the others leave open.
static place_t find_place(end_t *end)
{
    place_t place = {0, 0, 0};
    if (!is_doubtful(end)) {
        return place;
    }
    take_shades(end);
    float scores[PLACES];
    const float most_without = score_places(end, scores);
    score_edges(end, most_without, scores);
    int32_t best = 0;
    float stay = NO_PLACE;
    for (int32_t step = -end->outmost; step <= end->inmost; step++) {
        const float score = scores[STEPS + step];
        stay = step >= -1 && step <= 1 && score > stay ? score : stay;
        best = score > scores[STEPS + best] ? step : best;
    }
    const float most = scores[STEPS + best];
    place.best = most > stay + GAIN_MIN ? best : 0;
    float whole = 0, first = 0, second = 0;
    for (int32_t step = -end->outmost; step <= end->inmost; step++) {
        const int32_t off = step - place.best;
        const float away = off >= -1 && off <= 1 ? 0.0f : (float)off;  // the outline looks as far as that
        const float share = scores[STEPS + step] > NO_PLACE ? bslam_falling(most - scores[STEPS + step]) : 0;
        whole += share;
        first += share * away;
        second += share * away * away;
    }
    if (whole > 0) {
        place.offset = first / whole;
        place.variance = second / whole - place.offset * place.offset;
    }
    return place;
}

/// So many steps, but no more than that.
static int32_t steps_in(bslam_real_t room_px)
{
    return room_px < STEP_PX ? 0 : room_px < STEPS * STEP_PX ? (int32_t)(room_px / STEP_PX) : STEPS;
}

bslam_ends_t bslam_ends_move(const bslam_frame_t *frame, const bslam_camera_t *camera,
                             const bslam_outline_t *outline, const bslam_front_t *front, bslam_box_t *box)
{
    bslam_ends_t ends = {false, 0, 0};
    bslam_facing_t facing = {.camera = camera, .mounting = bslam_camera_mounting(camera)};
    bslam_sin_cos(outline->facing_rad, &facing.sine, &facing.cosine);
    const bslam_real_t width = outline->body_left - outline->body_right;
    const int32_t inmost = steps_in(width / (2 * outline->pixel) - STEP_PX);
    if (inmost == 0) {
        return ends;  // so narrow that any side is within the outline's reach
    }
    end_t end = {.frame = frame,
                 .facing = &facing,
                 .outline = outline,
                 .front = front,
                 .stance = bslam_outline_stance(outline, outline->pixel / 2),
                 .inmost = inmost};
    end.middle = level_contrasts(&end, outline->body_left - END_SHARE * width,
                                 outline->body_right + END_SHARE * width);
    if (end.middle.top < 0 || end.middle.bottom < 0) {
        return ends;
    }
    const bslam_real_t step = STEP_PX * outline->pixel, last_px = (bslam_real_t)frame->width_px - 1;
    for (int32_t i = 0; i < 2; i++) {
        const bool is_left = i == 0;
        end.name = is_left ? BSLAM_SIDE_LEFT : BSLAM_SIDE_RIGHT;
        end.at = is_left ? outline->body_left : outline->body_right;
        end.inwards = is_left ? -step : step;
        end.outmost = steps_in(is_left ? box->left_px : last_px - box->right_px);
        if (end.outmost == 0) {
            continue;  // what the frame's edge is next to may be cut off there: no side
        }
        const place_t place = find_place(&end);
        const bslam_real_t by_px = STEP_PX * (bslam_real_t)place.best;
        box->left_px += is_left ? by_px : 0;
        box->right_px -= is_left ? 0 : by_px;
        ends.moved = ends.moved || place.best != 0;
        ends.offset += end.inwards * (bslam_real_t)place.offset / 2;
        ends.variance += step * step * (bslam_real_t)place.variance / 4;
    }
    return ends;
}
