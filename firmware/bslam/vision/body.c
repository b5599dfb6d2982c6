#include "bslam/vision/body.h"

#include "bslam/math/logarithm.h"
#include "bslam/vision/shade.h"

enum {
    TURNS_MAX = 5,     // turns tried to either side
    CORNER_STEPS = 3,  // a flank's width depends on where its near corner is: rounds
    BUSY_LINES = 16    // upright lines of a body that are looked along
};

// The largest turn that is looked for; and what one costs before it is seen: 1 / (2 BSLAM_TURN_SD²).
static const bslam_real_t TURN_MAX = BSLAM_R(1.8);
static const float TURN_COST = 0.7f;
// What a front costs that is seen narrower or wider than it may be: by the square of the part by which it is.
// At most so much, for something may stand before one of its ends. Both are in a side's scores.
static const float WIDTH_COST = 60.0f;
static const float WIDTH_COST_MAX = 6.0f;
// A flank that is narrower is not told from the front, whole-frame pixels. The score of an edge between them
// that speaks neither for a stance nor against it.
static const float FLANK_MIN_PX = 4.0f;
static const float CORNER_EVEN = 2.0f;
// How much it says that the front is busier than the flank, by the logarithm of the ratio; what a flank costs
// that is as busy; and how busy, of 255, is half of what can be told. A multinomial logistic regression over
// 3329 cabinets and radiators of training worlds.
static const float BY_BUSY = 5.4f;
static const float BUSY_COST = 4.2f;
static const float BUSY_HALF = 6.0f;

bslam_stance_t bslam_body_stance(const bslam_body_t *body, bslam_real_t turn)
{
    const bslam_real_t back = body->shape.depth * (body->top - body->bottom) / bslam_sqrt(1 + turn * turn);
    bslam_real_t left = body->left;
    bslam_real_t right = body->right;
    for (int32_t i = 0; i < CORNER_STEPS; i++) {
        const bslam_real_t left_flank = back * (1 + turn * left) * (turn - left);
        const bslam_real_t right_flank = back * (1 + turn * right) * (turn - right);
        left = left_flank > 0 ? body->left - left_flank : body->left;
        right = right_flank < 0 ? body->right - right_flank : body->right;
    }
    return (bslam_stance_t){(float)turn, (float)left, (float)right};
}

bslam_real_t bslam_body_middle(const bslam_body_t *body, bslam_real_t turn)
{
    const bslam_stance_t stance = bslam_body_stance(body, turn);
    const bslam_real_t half = (bslam_real_t)(stance.left - stance.right) / 2;
    const bslam_real_t centre = (bslam_real_t)(stance.left + stance.right) / 2;
    return centre - half * half * turn / (1 + centre * turn);
}

bslam_real_t bslam_body_width(const bslam_stance_t *stance)
{
    const float both = (1.0f + stance->turn * stance->left) * (1.0f + stance->turn * stance->right);
    return (bslam_real_t)(stance->left - stance->right) *
           bslam_sqrt(1 + (bslam_real_t)(stance->turn * stance->turn)) / (bslam_real_t)both;
}

bslam_stance_t bslam_outline_stance(const bslam_outline_t *o, bslam_real_t flank_least)
{
    return (bslam_stance_t){(float)o->turn,
                            o->body_left - o->left > flank_least ? (float)o->left : BSLAM_FLAT.left,
                            o->right - o->body_right > flank_least ? (float)o->right : BSLAM_FLAT.right};
}

typedef struct scene {
    const bslam_frame_t *frame;
    const bslam_facing_t *facing;
} scene_t;

typedef struct sides {
    bslam_side_t top;
    bslam_side_t bottom;
} sides_t;

/// How many turns to either side make a difference of a place at the ends of a side.
static int32_t turn_count(const sides_t *sides, const bslam_body_t *body)
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

/// What the edge between front and flank says for a stance at which a flank is seen, to the left or to the
/// right: the front is the busy side of it, the flank the quiet one.
static float corner_evidence(const scene_t *scene, const bslam_body_t *body, const bslam_stance_t *stance,
                             bool is_left)
{
    const bslam_real_t corner = (bslam_real_t)(is_left ? stance->left : stance->right);
    const bslam_real_t near = 1 + (bslam_real_t)stance->turn * corner;
    bslam_side_t side;
    if (!(near > 0) ||
        !bslam_side_scan(&side, scene->frame, scene->facing, is_left ? BSLAM_SIDE_LEFT : BSLAM_SIDE_RIGHT,
                         corner, body->top * near, body->bottom * near, body->pixel) ||
        side.count == 0) {
        return 0.0f;
    }
    return bslam_side_score(&side, &BSLAM_FLAT) - CORNER_EVEN;
}

/// How much the light changes along upright lines across a body: standard deviations, of 255; below 0 where
/// the frame does not show it.
static void take_busyness(const scene_t *scene, const bslam_body_t *body, float busy[BUSY_LINES])
{
    const bslam_real_t step = (body->left - body->right) / BUSY_LINES;
    for (int32_t i = 0; i < BUSY_LINES; i++) {
        bslam_rgb_t colours[BSLAM_LINE_POINTS_MAX];
        busy[i] = -1;
        if (!bslam_line_colours(scene->frame, scene->facing,
                                body->left - ((bslam_real_t)i + BSLAM_R(0.5)) * step, body->top, body->bottom,
                                BSLAM_LINE_POINTS_MAX, colours)) {
            continue;
        }
        float sum = 0, squares = 0;
        for (int32_t k = 0; k < BSLAM_LINE_POINTS_MAX; k++) {
            const float light = (colours[k].red + colours[k].green + colours[k].blue) / 3;
            sum += light;
            squares += light * light;
        }
        const float mean = sum / BSLAM_LINE_POINTS_MAX;
        const float variance = squares / BSLAM_LINE_POINTS_MAX - mean * mean;
        busy[i] = variance > 0 ? (float)bslam_sqrt((bslam_real_t)variance) : 0;
    }
}

/// What it says that the front is so much busier than the flank that is seen at a stance: shelves, drawers
/// and ribs are on fronts. Where both are plain it says nothing.
static float busy_evidence(const bslam_body_t *body, const bslam_stance_t *stance,
                           const float busy[BUSY_LINES])
{
    const float step = (float)(body->left - body->right) / BUSY_LINES;
    float sums[2] = {0, 0}, counts[2] = {0, 0};
    for (int32_t i = 0; i < BUSY_LINES; i++) {
        const float at = (float)body->left - ((float)i + 0.5f) * step;
        const int32_t is_front = at < stance->left && at > stance->right;
        sums[is_front] += busy[i] >= 0 ? busy[i] : 0;
        counts[is_front] += busy[i] >= 0 ? 1 : 0;
    }
    if (!(counts[0] > 0 && counts[1] > 0)) {
        return 0;
    }
    const float front = sums[1] / counts[1], flank = sums[0] / counts[0];
    const float most = front > flank ? front : flank;
    const float ratio = (float)bslam_ln((bslam_real_t)((front + BUSY_HALF) / (flank + BUSY_HALF)));
    return BY_BUSY * ratio - BUSY_COST * most / (most + BUSY_HALF);
}

/// What front and flank look like says for a stance, if a flank is seen at it.
static float flank_evidence(const scene_t *scene, const bslam_body_t *body, const bslam_stance_t *stance,
                            const float busy[BUSY_LINES])
{
    const float left = (float)body->left - stance->left, right = stance->right - (float)body->right;
    if ((left > right ? left : right) < FLANK_MIN_PX * (float)body->pixel) {
        return 0;
    }
    return corner_evidence(scene, body, stance, left > right) + busy_evidence(body, stance, busy);
}

/// The stance at which both sides are likeliest; what the others leave open goes into *level.
static bslam_stance_t best_stance(const scene_t *scene, const sides_t *sides, const bslam_body_t *body,
                                  bslam_level_t *level)
{
    const int32_t turns = turn_count(sides, body);
    float scores[2 * TURNS_MAX + 1], busy[BUSY_LINES];
    int32_t best = 0;
    take_busyness(scene, body, busy);
    for (int32_t k = 0; k <= 2 * turns; k++) {
        const bslam_stance_t stance = bslam_body_stance(body, turn_at(k - turns, turns));
        scores[k] = bslam_side_score(&sides->top, &stance) + bslam_side_score(&sides->bottom, &stance) -
                    TURN_COST * stance.turn * stance.turn - width_cost(body, &stance) +
                    flank_evidence(scene, body, &stance, busy);
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
    sides_t sides;
    if (!bslam_side_scan(&sides.top, frame, facing, BSLAM_SIDE_TOP, body->top, body->left, body->right,
                         body->pixel) ||
        !bslam_side_scan(&sides.bottom, frame, facing, BSLAM_SIDE_BOTTOM, body->bottom, body->left,
                         body->right, body->pixel)) {
        return false;
    }
    const scene_t scene = {frame, facing};
    const bslam_stance_t stance = best_stance(&scene, &sides, body, level);
    const bslam_line_t top = bslam_side_line(&sides.top, &stance);
    const bslam_line_t bottom = bslam_side_line(&sides.bottom, &stance);
    bslam_side_trace(&sides.top, facing, &top, &stance, &level->top);
    bslam_side_trace(&sides.bottom, facing, &bottom, &stance, &level->bottom);
    return true;
}
