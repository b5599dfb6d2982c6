// What is known from before the first node, linear about other points. MATH "The smoother".
#include "base/logarithm.h"
#include "base/trig.h"
#include "bslam/smoother/smoother_internal.h"

/// A beacon nearer to the robot, or one that would stretch by more, is far from what the base was linear
/// about in any coordinates: it is shifted.
static const bslam_real_t NEAR_M = BSLAM_R(0.5);
static const bslam_real_t STRETCH_MAX = BSLAM_R(4.0);
/// A beacon more doubtful than this, both axes, has not been seen from within the base yet.
static const bslam_real_t UNSEEN_VARIANCE_M2 = BSLAM_R(100.0);

/// How a place, seen from the base's robot, turns and stretches to become another: a complex number, and its
/// logarithm.
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

/// The new pair's covariance with value j.
static void new_pair(const bslam_real_t *covariance, int at, int j, const similarity_t *g, bslam_real_t m[2])
{
    const bslam_real_t p[2] = {bslam_symmat_get(covariance, BSLAM_STATE_X, j),
                               bslam_symmat_get(covariance, BSLAM_STATE_Y, j)};
    m[0] = bslam_symmat_get(covariance, at, j);
    m[1] = bslam_symmat_get(covariance, at + 1, j);
    turn_and_stretch(g, p, m);
}

/// The covariance, where the values at `at` and behind are p + g (they - p) from now on.
static void transport_covariance(bslam_real_t *covariance, int dim, int at, const similarity_t *g)
{
    bslam_real_t own[2][2];  // of the new pair, by the old one
    new_pair(covariance, at, at, g, own[0]);
    new_pair(covariance, at, at + 1, g, own[1]);
    for (int j = 0; j < dim; j++) {
        if (j != at && j != at + 1) {
            bslam_real_t m[2];
            new_pair(covariance, at, j, g, m);
            bslam_symmat_set(covariance, at, j, m[0]);
            bslam_symmat_set(covariance, at + 1, j, m[1]);
        }
    }
    for (int k = 0; k < 2; k++) {
        const bslam_real_t p[2] = {bslam_symmat_get(covariance, at + k, BSLAM_STATE_X),
                                   bslam_symmat_get(covariance, at + k, BSLAM_STATE_Y)};
        bslam_real_t m[2] = {own[0][k], own[1][k]};
        turn_and_stretch(g, p, m);
        own[0][k] = m[0];
        own[1][k] = m[1];
    }
    bslam_symmat_set(covariance, at, at, own[0][0]);
    bslam_symmat_set(covariance, at + 1, at, (own[1][0] + own[0][1]) / 2);
    bslam_symmat_set(covariance, at + 1, at + 1, own[1][1]);
}

static bool is_seen(const bslam_ekf_t *base, int at)
{
    return bslam_symmat_get(base->covariance, at, at) + bslam_symmat_get(base->covariance, at + 1, at + 1) <
           UNSEEN_VARIANCE_M2;
}

/// A point's correction and covariance about `place`. False, and nothing done, where that has no use.
static bool transport_point(bslam_ekf_t *base, int at, const bslam_real_t place[2])
{
    const bslam_real_t *p = &base->mean[BSLAM_STATE_X];
    const bslam_real_t from[2] = {base->mean[at] - p[0], base->mean[at + 1] - p[1]};
    const bslam_real_t to[2] = {place[0] - p[0], place[1] - p[1]};
    similarity_t g;
    if (!is_seen(base, at) || !find_similarity(from, to, &g)) {
        return false;
    }
    turn_and_stretch(&g, &base->correction[BSLAM_STATE_X], &base->correction[at]);
    base->correction[at] -= to[0] * g.log_re - to[1] * g.log_im;
    base->correction[at + 1] -= to[0] * g.log_im + to[1] * g.log_re;
    transport_covariance(base->covariance, base->dim, at, &g);
    return true;
}

void bslam_smoother_linearise_base(bslam_smoother_t *smoother)
{
    bslam_ekf_t *base = &smoother->base;
    for (int b = 0; b < base->beacon_count; b++) {
        const bslam_beacon_t *beacon = &base->beacons[b];
        const bslam_real_t *place = &smoother->place[beacon->at];
        const int dim = bslam_beacon_dim(beacon->kind);
        const bool is_moved = beacon->kind == BSLAM_BEACON_POINT && transport_point(base, beacon->at, place);
        for (int k = 0; k < dim; k++) {
            bslam_real_t *value = &base->mean[beacon->at + k];
            base->correction[beacon->at + k] += is_moved ? 0 : *value - place[k];
            *value = place[k];
        }
    }
}
