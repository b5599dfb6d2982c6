#include "vision/built_in/measurement/side_face.h"

#include "base/logarithm.h"
#include "vision/built_in/measurement/shade.h"
#include "base/scalar.h"

// A flank that is narrower is not told from the front, whole-frame pixels. The score of an edge between them
// that speaks neither for a stance nor against it.
static const float FLANK_MIN_PX = 4.0f;
static const float CORNER_EVEN = 2.0f;
// How much it says that the front is busier than the flank, by the logarithm of the ratio; what a flank costs
// that is as busy; and how busy, of 255, is half of what can be told. A multinomial logistic regression over
// 3329 cabinets and radiators of training worlds.
static const float BY_BUSY = 5.4f;
static const float BUSY_COST = 4.2f;
static const float BUSY_HALF = 4.0f;
// Parts of an upright line.
enum { LINE_PARTS = 3, PART_POINTS = BSLAM_LINE_POINTS_MAX / LINE_PARTS };

/// What the edge between front and flank says for a stance at which a flank is seen, to the left or to the
/// right: the front is the busy side of it, the flank the quiet one.
static float corner_evidence(const bslam_frame_t *frame, const bslam_facing_t *facing,
                             const bslam_body_t *body, const bslam_stance_t *stance, bool is_left)
{
    const bslam_real_t corner = (bslam_real_t)(is_left ? stance->left : stance->right);
    const bslam_real_t near = 1 + (bslam_real_t)stance->turn * corner;
    bslam_side_t side;
    if (!(near > 0) ||
        !bslam_side_scan(&side, frame, facing, is_left ? BSLAM_SIDE_LEFT : BSLAM_SIDE_RIGHT, corner,
                         body->top * near, body->bottom * near, body->pixel) ||
        side.count == 0) {
        return 0.0f;
    }
    return bslam_side_score(&side, &BSLAM_FLAT) - CORNER_EVEN;
}

/// Standard deviation of the light at some points.
static float spread_of(const bslam_rgb_t *colours, int32_t count)
{
    float sum = 0, squares = 0;
    for (int32_t k = 0; k < count; k++) {
        const float light = (colours[k].red + colours[k].green + colours[k].blue) / 3;
        sum += light;
        squares += light * light;
    }
    const float mean = sum / (float)count;
    const float variance = squares / (float)count - mean * mean;
    return variance > 0 ? (float)bslam_sqrt((bslam_real_t)variance) : 0;
}

/// The mean over the parts of an upright line but the busiest: there something may stand before the body.
static float busyness_of_line(const bslam_rgb_t colours[BSLAM_LINE_POINTS_MAX])
{
    float sum = 0, most = 0;
    for (int32_t i = 0; i < LINE_PARTS; i++) {
        const float spread = spread_of(colours + i * PART_POINTS, PART_POINTS);
        sum += spread;
        most = spread > most ? spread : most;
    }
    return (sum - most) / (LINE_PARTS - 1);
}

bslam_busyness_t bslam_busyness_of(const bslam_frame_t *frame, const bslam_facing_t *facing,
                                   const bslam_body_t *body)
{
    bslam_busyness_t busy;
    const bslam_real_t step = (body->left - body->right) / BSLAM_BUSY_LINES;
    for (int32_t i = 0; i < BSLAM_BUSY_LINES; i++) {
        bslam_rgb_t colours[BSLAM_LINE_POINTS_MAX];
        busy.lines[i] = -1;
        if (!bslam_line_colours(frame, facing, body->left - ((bslam_real_t)i + BSLAM_R(0.5)) * step,
                                body->top, body->bottom, BSLAM_LINE_POINTS_MAX, colours)) {
            continue;
        }
        busy.lines[i] = busyness_of_line(colours);
    }
    return busy;
}

/// What it says that the front is so much busier than the flank that is seen at a stance: shelves, drawers
/// and ribs are on fronts. Where both are plain it says nothing.
static float busy_evidence(const bslam_body_t *body, const bslam_stance_t *stance,
                           const bslam_busyness_t *busy)
{
    const float step = (float)(body->left - body->right) / BSLAM_BUSY_LINES;
    float sums[2] = {0, 0}, counts[2] = {0, 0};
    for (int32_t i = 0; i < BSLAM_BUSY_LINES; i++) {
        const float at = (float)body->left - ((float)i + 0.5f) * step;
        const int32_t is_front = at < stance->left && at > stance->right;
        sums[is_front] += busy->lines[i] >= 0 ? busy->lines[i] : 0;
        counts[is_front] += busy->lines[i] >= 0 ? 1 : 0;
    }
    if (!(counts[0] > 0 && counts[1] > 0)) {
        return 0;
    }
    const float front = sums[1] / counts[1], flank = sums[0] / counts[0];
    const float most = front > flank ? front : flank;
    const float ratio = (float)bslam_ln((bslam_real_t)((front + BUSY_HALF) / (flank + BUSY_HALF)));
    return BY_BUSY * ratio - BUSY_COST * most / (most + BUSY_HALF);
}

float bslam_flank_evidence(const bslam_frame_t *frame, const bslam_facing_t *facing, const bslam_body_t *body,
                           const bslam_stance_t *stance, const bslam_busyness_t *busy)
{
    const float left = (float)body->left - stance->left, right = stance->right - (float)body->right;
    if ((left > right ? left : right) < FLANK_MIN_PX * (float)body->pixel) {
        return 0;
    }
    return corner_evidence(frame, facing, body, stance, left > right) + busy_evidence(body, stance, busy);
}
