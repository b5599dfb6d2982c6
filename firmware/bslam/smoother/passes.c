// The cycle: forth, up and back. MATH "The smoother".
#include <string.h>

#include "base/logarithm.h"
#include "base/trig.h"
#include "bslam/model/noise.h"
#include "bslam/smoother/smoother_internal.h"
#include "base/scalar.h"

#define ROBOT BSLAM_ROBOT_DIM_MAX

/// What a node costs on the passes up and back, where it costs the state's dimension forth: about in
/// proportion to a Cortex-M4F's instructions, so that all frames cost alike.
enum { UP_COST = 8, BACK_COST = 12 };

/// What may come in while a cycle lasts.
#define SLACK_NODES (BSLAM_SMOOTHER_NODES_MAX / 16 + 2)
#define SLACK_SEEN (BSLAM_SMOOTHER_SEEN_MAX / 12)
/// Places move no farther at once, as a share of the distance from the robot, and of the least that they were
/// seen from: beyond that the model is far from linear. No beacon must jump to the robot or over its path.
static const bslam_real_t STEP_MAX = BSLAM_R(0.3);
static const bslam_real_t NEAREST_STEP_MAX = BSLAM_R(0.6);
/// Sightings that fit worse by more than this than on the last pass forth tell of a step that was too long.
/// Halving it more often than this is of no use: then it is the readings that changed.
static const bslam_real_t FIT_RATIO_MAX = BSLAM_R(1.5);
static const bslam_real_t FIT_MIN = BSLAM_R(1.0);
enum { HALVINGS_MAX = 4 };
static const bslam_real_t NEVER_SEEN_M2 = BSLAM_R(1e6);
/// No beacon is linearised about a place nearer than this to where the robot is: with 1 / distance in its
/// Jacobian, one that is thought too near and is driven at throws the path metres off.
static const bslam_real_t NEAR_MIN_M = BSLAM_R(1.0);
/// How exactly the map is given to the robot alone, (1 mm)².
static const bslam_real_t PIN_VARIANCE = BSLAM_R(1e-6);
/// What the pass back takes a pose to be doubtful by at least, (1 mm)², (1 mrad)²: at the start it is not.
static const bslam_real_t DOUBT_MIN = BSLAM_R(1e-6);

// ---- forth ------------------------------------------------------------------------------------------------

void bslam_smoother_begin(bslam_smoother_t *smoother)
{
    bslam_smoother_thin(smoother, BSLAM_SMOOTHER_NODES_MAX - SLACK_NODES);
    while (smoother->seen_count > BSLAM_SMOOTHER_SEEN_MAX - SLACK_SEEN) {
        bslam_smoother_drop_oldest(smoother);
    }
    bslam_smoother_linearise_base(smoother);
    bslam_smoother_find_stands(smoother);
    smoother->run = smoother->base;
    smoother->run_stand = smoother->base_stand;
    smoother->model.velocity_walk_mps_sqrt_s = smoother->free_walk;
    smoother->phase = BSLAM_SMOOTHER_FORTH;
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        smoother->nearest_m2[b] = NEVER_SEEN_M2;
    }
    smoother->misfit = 0;
    smoother->fitted = 0;
    smoother->at = 0;
    smoother->at_seen = 0;
    smoother->work = 0;
}

static bslam_real_t smaller(bslam_real_t a, bslam_real_t b)
{
    return a < b ? a : b;
}

static bslam_real_t square_between(const bslam_real_t a[2], const bslam_real_t b[2])
{
    const bslam_real_t dx = a[0] - b[0], dy = a[1] - b[1];
    return dx * dx + dy * dy;
}

/// Notes how near the beacons were that are seen from a node.
static void note_nearest(bslam_smoother_t *smoother, const bslam_smoother_node_t *node, int first_seen)
{
    for (int k = 0; k < node->seen; k++) {
        const int b = bslam_smoother_seen(smoother, first_seen + k)->beacon;
        if (b != BSLAM_SMOOTHER_RANGE && smoother->run.beacons[b].kind != BSLAM_BEACON_KNOWN) {
            const bslam_real_t *place = &smoother->place[smoother->run.beacons[b].at];
            const bslam_real_t m2 = square_between(place, &node->at[BSLAM_STATE_X]);
            smoother->nearest_m2[b] = smaller(smoother->nearest_m2[b], m2);
        }
    }
}

/// How much of its correction beacon `b` may take.
static bslam_real_t share_of_step(const bslam_smoother_t *smoother, int b)
{
    const bslam_ekf_t *run = &smoother->run;
    const int at = run->beacons[b].at;
    const bslam_real_t *step = &run->correction[at];
    const bslam_real_t step2 = step[0] * step[0] + step[1] * step[1];
    const bslam_real_t far2 = square_between(&run->mean[at], &run->mean[BSLAM_STATE_X]);
    const bslam_real_t most2 =
        smaller(STEP_MAX * STEP_MAX * far2, NEAREST_STEP_MAX * NEAREST_STEP_MAX * smoother->nearest_m2[b]);
    return step2 > most2 ? bslam_sqrt(most2 / step2) : 1;
}

/// Where a point is linearised about: where it is, or behind that where the robot is too near.
static void keep_off(const bslam_ekf_t *run, bslam_real_t place[2])
{
    const bslam_real_t dx = place[0] - run->mean[BSLAM_STATE_X], dy = place[1] - run->mean[BSLAM_STATE_Y];
    const bslam_real_t distance_m = bslam_sqrt(dx * dx + dy * dy);
    if (distance_m > BSLAM_SMOOTHER_RANGE_MIN_M && distance_m < NEAR_MIN_M) {
        place[0] += dx * (NEAR_MIN_M / distance_m - 1);
        place[1] += dy * (NEAR_MIN_M / distance_m - 1);
    }
}

/// The map is linearised about where the filter of now has it.
static void move_places(bslam_smoother_t *smoother)
{
    const bslam_ekf_t *run = &smoother->run;
    for (int i = run->base_dim; i < run->dim; i++) {
        smoother->place_moved[i] = smoother->place[i];
        smoother->place[i] = run->mean[i];
    }
    for (int b = 0; b < run->beacon_count; b++) {
        if (run->beacons[b].kind == BSLAM_BEACON_POINT) {
            keep_off(run, &smoother->place[run->beacons[b].at]);
        }
    }
    for (int i = run->base_dim; i < run->dim; i++) {
        smoother->place_moved[i] = smoother->place[i] - smoother->place_moved[i];
    }
}

/// The filter of now takes its correction, or as much of it, all values alike, as no beacon refuses. The map
/// that comes of it is linearised about from then on.
static void end_forth(bslam_smoother_t *smoother)
{
    bslam_ekf_t *run = &smoother->run;
    bslam_real_t least = 1;
    for (int b = 0; b < run->beacon_count; b++) {
        if (run->beacons[b].kind != BSLAM_BEACON_KNOWN) {
            least = smaller(least, share_of_step(smoother, b));
        }
    }
    for (int i = 0; i < run->dim; i++) {
        run->correction[i] *= least;
        if (!bslam_is_number(run->correction[i])) {
            run->mean[i] = run->correction[i];  // no angle to wrap: what is not sane is not taken
            return;
        }
    }
    bslam_ekf_correct(run, &smoother->model);
    move_places(smoother);
    smoother->fit = smoother->fitted > 0 ? smoother->misfit / (bslam_real_t)smoother->fitted : 0;
    smoother->halvings = 0;
}

/// The pass forth was linear about points that the last cycle changed. If its sightings fit much worse than
/// before, the change was too large for the model to be linear on: all points go back half of it.
static bool is_worse(const bslam_smoother_t *smoother)
{
    const bslam_real_t most = FIT_RATIO_MAX * (smoother->fit > FIT_MIN ? smoother->fit : FIT_MIN);
    return smoother->halvings < HALVINGS_MAX && smoother->misfit > most * (bslam_real_t)smoother->fitted;
}

static void go_half_back(bslam_smoother_t *smoother)
{
    for (int i = smoother->base.base_dim; i < smoother->base.dim; i++) {
        smoother->place_moved[i] /= 2;
        smoother->place[i] -= smoother->place_moved[i];
    }
    for (int k = 0; k < smoother->node_count; k++) {
        bslam_smoother_node_t *node = bslam_smoother_node(smoother, k);
        for (int i = 0; i < smoother->base.base_dim; i++) {
            node->moved[i] = (int16_t)(node->moved[i] / 2);
            node->at[i] -= node->moved[i] * BSLAM_SMOOTHER_MOVED;
        }
        node->at[BSLAM_STATE_THETA] = bslam_angle_wrap(node->at[BSLAM_STATE_THETA]);
    }
    smoother->halvings++;
    smoother->halved++;
}

// ---- up and back: the robot alone -------------------------------------------------------------------------

/// Of a filter, what is left if the map is as it is linearised about: the robot, among known beacons.
static void give_map(bslam_ekf_t *ekf)
{
    for (int i = ekf->base_dim; i < ekf->dim; i++) {
        bslam_ekf_pin(ekf, i, 0, PIN_VARIANCE);
    }
    bslam_ekf_settle(ekf);
    for (int b = 0; b < ekf->beacon_count; b++) {
        bslam_beacon_t *beacon = &ekf->beacons[b];
        bslam_ekf_beacon_position(ekf, b, &beacon->known_x_m, &beacon->known_y_m);
        beacon->kind = BSLAM_BEACON_KNOWN;
    }
    for (int i = ekf->base_dim; i < ekf->dim; i++) {
        ekf->mean[i] = 0;
        ekf->correction[i] = 0;
    }
    bslam_factor_cut(&ekf->factor, ekf->base_dim - ekf->factor.tail_count);
    ekf->dim = ekf->base_dim;
    ekf->ray_count = 0;
    ekf->sized_count = 0;
}

static void begin_up(bslam_smoother_t *smoother)
{
    bslam_smoother_linearise_base(smoother);
    smoother->run = smoother->base;
    smoother->run_stand = smoother->base_stand;
    give_map(&smoother->run);
    smoother->model.velocity_walk_mps_sqrt_s = smoother->path_walk;
    smoother->phase = BSLAM_SMOOTHER_UP;
    smoother->at = 0;
    smoother->at_seen = 0;
    smoother->top = smoother->node_count;
}

/// Where value i of a robot without a map stands in its factor, in their order there.
static int place_of(const bslam_factor_t *factor, int i)
{
    return i < factor->body_count ? i : bslam_factor_tail_at(factor) + i - factor->body_count;
}

static void note_mark(const bslam_smoother_t *smoother, bslam_smoother_mark_t *mark)
{
    const bslam_ekf_t *run = &smoother->run;
    const bslam_factor_t *factor = &run->factor;
    int k = 0;
    mark->stand = smoother->run_stand;
    memcpy(mark->correction, run->correction, (size_t)run->base_dim * sizeof mark->correction[0]);
    for (int i = 0; i < run->base_dim; i++) {
        const int place = place_of(factor, i);
        for (int j = 0; j < i; j++) {
            mark->factor[k] = bslam_factor_row(factor, place)[4 * place_of(factor, j)];
            k++;
        }
        mark->factor[k] = factor->d[place];
        k++;
    }
}

/// The robot as it was before node `first`, about the point that it had there.
static void restore_mark(bslam_smoother_t *smoother, const bslam_smoother_mark_t *mark, int first)
{
    bslam_ekf_t *run = &smoother->run;
    bslam_factor_t *factor = &run->factor;
    const bslam_real_t *mean = first > 0 ? bslam_smoother_node(smoother, first - 1)->at : smoother->base.mean;
    int k = 0;
    smoother->run_stand = mark->stand;
    memcpy(run->mean, mean, (size_t)run->base_dim * sizeof run->mean[0]);
    memcpy(run->correction, mark->correction, (size_t)run->base_dim * sizeof run->correction[0]);
    for (int i = 0; i < run->base_dim; i++) {
        const int place = place_of(factor, i);
        for (int j = 0; j < i; j++) {
            *bslam_factor_element(factor, place, place_of(factor, j)) = mark->factor[k];
            k++;
        }
        factor->d[place] = mark->factor[k];
        k++;
    }
}

/// Lower triangle L with L Lᵀ = m + DOUBT_MIN I, n x n, from the symmetric matrix m.
static void factor(bslam_real_t m[ROBOT][ROBOT], int n, bslam_real_t l[ROBOT][ROBOT])
{
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++) {
            bslam_real_t sum = m[i][j] + (i == j ? DOUBT_MIN : 0);
            for (int k = 0; k < j; k++) {
                sum -= l[i][k] * l[j][k];
            }
            if (i == j) {
                l[i][i] = bslam_sqrt(sum > DOUBT_MIN / 4 ? sum : DOUBT_MIN / 4);
            } else {
                l[i][j] = sum / l[j][j];
            }
        }
    }
}

/// x <- (L Lᵀ)⁻¹ x.
static void solve(bslam_real_t l[ROBOT][ROBOT], int n, bslam_real_t x[ROBOT])
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++) {
            x[i] -= l[i][k] * x[k];
        }
        x[i] /= l[i][i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) {
            x[i] -= l[k][i] * x[k];
        }
        x[i] /= l[i][i];
    }
}

/// Row i of P Fᵀ.
static void cross_row(bslam_real_t p[ROBOT][ROBOT], int i, int n, const bslam_transition_t *f,
                      bslam_real_t row[ROBOT])
{
    for (int j = 0; j < n; j++) {
        row[j] = 0;
        for (int k = 0; j < 3 && k < n; k++) {
            row[j] += p[i][k] * f->by[j][k] * (k < 3 ? 1 : f->keep[k - 3]);
        }
        if (j >= 3) {
            row[j] = p[i][j] * f->keep[j - 3];
        }
    }
}

/// The robot goes on from a node to the next one, and what the pass back needs of it is kept.
static void step_on(bslam_smoother_t *smoother, const bslam_smoother_node_t *next,
                    bslam_smoother_step_t *step)
{
    bslam_ekf_t *run = &smoother->run;
    bslam_robot_t here = bslam_ekf_robot(run);
    const int n = run->base_dim;
    bslam_transition_t transition;
    bslam_real_t l[ROBOT][ROBOT];
    memcpy(step->here, run->correction, (size_t)n * sizeof step->here[0]);
    const bslam_bend_t bend = bslam_smoother_bend(next);
    bslam_ekf_predict_about(run, &smoother->model, &next->motion, &bend, next->at, &transition);
    memcpy(step->next, run->correction, (size_t)n * sizeof step->next[0]);
    bslam_robot_t there = bslam_ekf_robot(run);
    factor(there.covariance, n, l);
    for (int i = 0; i < n; i++) {
        cross_row(here.covariance, i, n, &transition, step->gain[i]);
        solve(l, n, step->gain[i]);
    }
}

/// As a node has it. What is too far to note is not taken back.
static int16_t note_moved(bslam_real_t moved)
{
    const bslam_real_t units = moved / BSLAM_SMOOTHER_MOVED;
    return (int16_t)(units < INT16_MAX && units > -INT16_MAX ? units : 0);
}

static void note_doubt(const bslam_ekf_t *run, bslam_smoother_node_t *node)
{
    const bslam_real_t variance_m2 = bslam_ekf_covariance(run, BSLAM_STATE_X, BSLAM_STATE_X) +
                                     bslam_ekf_covariance(run, BSLAM_STATE_Y, BSLAM_STATE_Y);
    node->doubt = bslam_smoother_weight(bslam_sqrt(variance_m2));
}

/// The nodes of a part, which begins at `first`, move to where they fit best.
static void go_back(bslam_smoother_t *smoother, int first, int first_seen)
{
    const int last =
        (first + BSLAM_SMOOTHER_PART < smoother->top ? first + BSLAM_SMOOTHER_PART : smoother->top) - 1;
    const int n = smoother->run.base_dim;
    restore_mark(smoother, &smoother->marks[first / BSLAM_SMOOTHER_PART], first);
    const bslam_smoother_node_t *begin = bslam_smoother_node(smoother, first);
    const bslam_bend_t bend = bslam_smoother_bend(begin);
    bslam_ekf_predict_about(&smoother->run, &smoother->model, &begin->motion, &bend, begin->at, NULL);
    for (int k = first; k <= last; k++) {
        bslam_smoother_node_t *node = bslam_smoother_node(smoother, k);
        bslam_smoother_follow(&smoother->run_stand, node);
        bslam_smoother_take_node(smoother, &smoother->run, &smoother->run_stand, node, first_seen);
        first_seen += node->seen;
        note_doubt(&smoother->run, node);
        if (k + 1 < smoother->top) {
            step_on(smoother, bslam_smoother_node(smoother, k + 1), &smoother->steps[k - first]);
        }
    }
    // The node behind the part has moved already: about where it is now it needs no change.
    bslam_real_t change[ROBOT] = {0};
    for (int k = last; k >= first; k--) {
        bslam_smoother_step_t *step = &smoother->steps[k - first];
        bslam_real_t moved[ROBOT];
        for (int i = 0; i < n; i++) {
            moved[i] = k + 1 < smoother->top ? step->here[i] : smoother->run.correction[i];
            for (int j = 0; k + 1 < smoother->top && j < n; j++) {
                moved[i] += step->gain[i][j] * (change[j] - step->next[j]);
            }
        }
        bslam_smoother_node_t *node = bslam_smoother_node(smoother, k);
        for (int i = 0; i < n; i++) {
            change[i] = moved[i];
            node->at[i] += moved[i];
            node->moved[i] = note_moved(moved[i]);
        }
        node->at[BSLAM_STATE_THETA] = bslam_angle_wrap(node->at[BSLAM_STATE_THETA]);
    }
}

// ---- the work ---------------------------------------------------------------------------------------------

/// One unit of the passes forth and up.
static void advance(bslam_smoother_t *smoother)
{
    const bslam_smoother_node_t *node = bslam_smoother_node(smoother, smoother->at);
    if (smoother->phase == BSLAM_SMOOTHER_FORTH) {
        note_nearest(smoother, node, smoother->at_seen);
    } else if (smoother->at % BSLAM_SMOOTHER_PART == 0) {
        note_mark(smoother, &smoother->marks[smoother->at / BSLAM_SMOOTHER_PART]);
    }
    bslam_smoother_pass_node(smoother, &smoother->run, &smoother->run_stand, node, smoother->at_seen);
    smoother->at++;
    smoother->at_seen += node->seen;
}

/// The last part of those that are left on the pass back.
static void retreat(bslam_smoother_t *smoother)
{
    const int first = (smoother->at - 1) / BSLAM_SMOOTHER_PART * BSLAM_SMOOTHER_PART;
    for (int k = first; k < smoother->at; k++) {
        smoother->at_seen -= bslam_smoother_node(smoother, k)->seen;
    }
    go_back(smoother, first, smoother->at_seen);
    smoother->at = first;
}

bool bslam_smoother_work(bslam_smoother_t *smoother, int units, bool is_whole)
{
    smoother->work += units * (smoother->base.dim + UP_COST + BACK_COST) / 3;
    while (smoother->work > 0) {
        switch (smoother->phase) {
        case BSLAM_SMOOTHER_FORTH:
            if (smoother->at < smoother->node_count) {
                smoother->work -= smoother->base.dim;
                advance(smoother);
                break;
            }
            smoother->work = 0;
            if (is_whole && is_worse(smoother)) {
                go_half_back(smoother);
                bslam_smoother_begin(smoother);
                return false;
            }
            if (is_whole) {
                end_forth(smoother);
            }
            return is_whole;
        case BSLAM_SMOOTHER_UP:
            if (smoother->at < smoother->top) {
                smoother->work -= UP_COST;
                advance(smoother);
                break;
            }
            smoother->phase = BSLAM_SMOOTHER_BACK;
            break;
        case BSLAM_SMOOTHER_BACK:
        default:
            if (smoother->at > 0) {
                smoother->work -= BACK_COST * BSLAM_SMOOTHER_PART;
                retreat(smoother);
                break;
            }
            bslam_smoother_begin(smoother);
            break;
        }
    }
    return false;
}

void bslam_smoother_turn(bslam_smoother_t *smoother)
{
    begin_up(smoother);
}
