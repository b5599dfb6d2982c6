// What is known from before the first node, linear about other points. MATH "The smoother".
#include <string.h>

#include "base/logarithm.h"
#include "base/trig.h"
#include "bslam/smoother/smoother_internal.h"

/// A beacon nearer to the robot, or one that would stretch by more, is far from what the base was linear
/// about in any coordinates: it is shifted.
static const bslam_real_t NEAR_M = BSLAM_R(0.5);
static const bslam_real_t STRETCH_MAX = BSLAM_R(4.0);
/// A beacon more doubtful than this, both axes, has not been seen from within the base yet.
static const bslam_real_t UNSEEN_VARIANCE_M2 = BSLAM_R(100.0);

/// How a place, seen from where the base's robot stands, turns and stretches to become another: a complex
/// number, and its logarithm.
typedef struct similarity {
    bslam_real_t re, im, log_re, log_im;
} similarity_t;

/// False if there is none to speak of.
static bool find_similarity(const bslam_real_t from[2], const bslam_real_t to[2], similarity_t *g)
{
    const bslam_real_t square = from[0] * from[0] + from[1] * from[1];
    if (!(square > NEAR_M * NEAR_M)) {
        return false;
    }
    g->re = (from[0] * to[0] + from[1] * to[1]) / square;
    g->im = (from[0] * to[1] - from[1] * to[0]) / square;
    const bslam_real_t stretch2 = g->re * g->re + g->im * g->im;
    if (!(stretch2 * STRETCH_MAX * STRETCH_MAX > 1 && stretch2 < STRETCH_MAX * STRETCH_MAX)) {
        return false;
    }
    g->log_re = bslam_ln(stretch2) / 2;
    g->log_im = bslam_atan2(g->im, g->re);
    return true;
}

/// p + g (m - p) for two vectors.
static void turn_and_stretch(const similarity_t *g, const bslam_real_t p[2], bslam_real_t m[2])
{
    const bslam_real_t dx = m[0] - p[0], dy = m[1] - p[1];
    m[0] = p[0] + g->re * dx - g->im * dy;
    m[1] = p[1] + g->im * dx + g->re * dy;
}

/// Two of `length` values leave their place for the end.
static void move_to_end(bslam_real_t *values, int at, int length)
{
    const bslam_real_t first = values[at], second = values[at + 1];
    memmove(&values[at], &values[at + 2], (size_t)(length - at - 2) * sizeof values[0]);
    values[length - 2] = first;
    values[length - 1] = second;
}

/// A point becomes p + g (it - p), with p where the robot stands. Its values stand behind all others then.
static void transport(bslam_smoother_t *smoother, int beacon, const similarity_t *g)
{
    bslam_ekf_t *base = &smoother->base;
    const int at = base->beacons[beacon].at;
    const bslam_row_t rows[BSLAM_POINT_DIM] = {
        {.base = {1 - g->re, g->im}, .other = {g->re, -g->im}, .at = (uint16_t)at, .dim = BSLAM_POINT_DIM},
        {.base = {-g->im, 1 - g->re}, .other = {g->im, g->re}, .at = (uint16_t)at, .dim = BSLAM_POINT_DIM},
    };
    bslam_ekf_replace_point(base, beacon, rows);
    move_to_end(base->correction, at, base->dim);
    move_to_end(smoother->place, at, base->dim);
    move_to_end(smoother->place_moved, at, base->dim);
}

static bool is_seen(const bslam_ekf_t *base, int at)
{
    return bslam_ekf_covariance(base, at, at) + bslam_ekf_covariance(base, at + 1, at + 1) <
           UNSEEN_VARIANCE_M2;
}

/// A point's correction and covariance about where it is linearised. False, and nothing done, where that has
/// no use.
static bool transport_point(bslam_smoother_t *smoother, int beacon)
{
    bslam_ekf_t *base = &smoother->base;
    const int at = base->beacons[beacon].at;
    const bslam_real_t p[2] = {smoother->base_stand.x_m, smoother->base_stand.y_m};
    const bslam_real_t *place = &smoother->place[at];
    const bslam_real_t from[2] = {base->mean[at] - p[0], base->mean[at + 1] - p[1]};
    const bslam_real_t to[2] = {place[0] - p[0], place[1] - p[1]};
    similarity_t g;
    if (!is_seen(base, at) || !find_similarity(from, to, &g)) {
        return false;
    }
    turn_and_stretch(&g, &base->correction[BSLAM_STATE_X], &base->correction[at]);
    base->correction[at] -= to[0] * g.log_re - to[1] * g.log_im;
    base->correction[at + 1] -= to[0] * g.log_im + to[1] * g.log_re;
    transport(smoother, beacon, &g);
    return true;
}

void bslam_smoother_linearise_base(bslam_smoother_t *smoother)
{
    bslam_ekf_t *base = &smoother->base;
    for (int b = 0; b < base->beacon_count; b++) {
        const bslam_beacon_t *beacon = &base->beacons[b];
        const int dim = bslam_beacon_dim(beacon->kind);
        const bool is_moved = beacon->kind == BSLAM_BEACON_POINT && transport_point(smoother, b);
        for (int k = 0; k < dim; k++) {
            const bslam_real_t place = smoother->place[beacon->at + k];
            bslam_real_t *value = &base->mean[beacon->at + k];
            base->correction[beacon->at + k] += is_moved ? 0 : *value - place;
            *value = place;
        }
    }
}
