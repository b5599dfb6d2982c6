#include "vision/built_in/measurement/orientation.h"

#include "base/logarithm.h"
#include "vision/built_in/measurement/side_face.h"
#include "base/scalar.h"

// Turns tried to either side.
enum { TURNS_MAX = 5 };

// The largest turn that is looked for; and what one costs before it is seen: 1 / (2 BSLAM_TURN_SD²).
static const bslam_real_t TURN_MAX = BSLAM_R(1.8);
static const float TURN_COST = 0.7f;
// What a front costs that is seen narrower or wider than it may be: by the square of the part by which it is.
// At most so much, for something may stand before one of its ends. Both are in a side's scores.
static const float WIDTH_COST = 60.0f;
static const float WIDTH_COST_MAX = 6.0f;

/// A body's upper and lower side, looked at.
typedef struct level_sides {
    bslam_side_t top;
    bslam_side_t bottom;
} level_sides_t;

/// How many turns to either side make a difference of a place at the ends of a side.
static int32_t turn_count(const level_sides_t *sides, const bslam_body_t *body)
{
    const bslam_real_t top = bslam_abs((bslam_real_t)sides->top.reach);
    const bslam_real_t bottom = bslam_abs((bslam_real_t)sides->bottom.reach);
    const bslam_real_t most = TURN_MAX * (top > bottom ? top : bottom) * (body->left - body->right) / 2;
    return most < TURNS_MAX ? (int32_t)most : TURNS_MAX;
}

static bslam_real_t turn_at(int32_t k, int32_t turns)
{
    return turns > 0 ? TURN_MAX * (bslam_real_t)k / (bslam_real_t)turns : 0;
}

/// What a stance costs at which the front is narrower or wider than it may be.
static float width_cost(const bslam_body_t *body, const bslam_stance_t *stance)
{
    const float narrow = (float)body->shape.narrow, wide = (float)body->shape.wide;
    const float width = (float)(bslam_body_width(stance) / (body->top - body->bottom));
    if (!(wide > 0.0f) || !(width > 0.0f)) {
        return 0.0f;
    }
    const float off = width < narrow ? narrow / width - 1.0f : width > wide ? width / wide - 1.0f : 0.0f;
    const float cost = WIDTH_COST * off * off;
    return cost < WIDTH_COST_MAX ? cost : WIDTH_COST_MAX;
}

/// The stance at which both sides are likeliest; its turn, and what the others leave open of the front's
/// middle, go into *level.
static bslam_stance_t best_stance(const bslam_frame_t *frame, const bslam_facing_t *facing,
                                  const level_sides_t *sides, const bslam_body_t *body, bslam_level_t *level)
{
    const int32_t turns = turn_count(sides, body);
    float scores[2 * TURNS_MAX + 1];
    int32_t best = 0;
    const bslam_busyness_t busy = bslam_busyness_of(frame, facing, body);
    for (int32_t k = 0; k <= 2 * turns; k++) {
        const bslam_stance_t stance = bslam_body_stance(body, turn_at(k - turns, turns));
        scores[k] = bslam_side_score(&sides->top, &stance) + bslam_side_score(&sides->bottom, &stance) -
                    TURN_COST * stance.turn * stance.turn - width_cost(body, &stance) +
                    bslam_flank_evidence(frame, facing, body, &stance, &busy);
        best = scores[k] > scores[best] ? k : best;
    }
    const bslam_real_t middle = bslam_body_middle(body, turn_at(best - turns, turns));
    float whole = 0.0f;
    float first = 0.0f;
    float second = 0.0f;
    for (int32_t k = 0; k <= 2 * turns; k++) {
        const bool same = k - best >= -1 && k - best <= 1;  // the edges' slopes will tell more closely
        const float away = same ? 0.0f : (float)(bslam_body_middle(body, turn_at(k - turns, turns)) - middle);
        const float share = bslam_falling(scores[best] - scores[k]);
        whole += share;
        first += share * away;
        second += share * away * away;
    }
    const float mean = first / whole;
    level->turn = turn_at(best - turns, turns);
    level->middle_offset = (bslam_real_t)mean;
    level->middle_var = (bslam_real_t)(second / whole - mean * mean);
    return bslam_body_stance(body, level->turn);
}

bool bslam_body_level(const bslam_body_t *body, const bslam_frame_t *frame, const bslam_facing_t *facing,
                      bslam_level_t *level)
{
    level_sides_t sides;
    if (!bslam_side_scan(&sides.top, frame, facing, BSLAM_SIDE_TOP, body->top, body->left, body->right,
                         body->pixel) ||
        !bslam_side_scan(&sides.bottom, frame, facing, BSLAM_SIDE_BOTTOM, body->bottom, body->left,
                         body->right, body->pixel)) {
        return false;
    }
    const bslam_stance_t stance = best_stance(frame, facing, &sides, body, level);
    const bslam_line_t top = bslam_side_line(&sides.top, &stance);
    const bslam_line_t bottom = bslam_side_line(&sides.bottom, &stance);
    bslam_side_trace(&sides.top, facing, &top, &stance, &level->top);
    bslam_side_trace(&sides.bottom, facing, &bottom, &stance, &level->bottom);
    return true;
}
