// What lies farther back is kept with fewer nodes: two neighbours become one. MATH "The smoother".
#include <string.h>

#include "base/trig.h"
#include "bslam/model/motion.h"
#include "bslam/model/observation.h"
#include "bslam/smoother/smoother_internal.h"
#include "base/scalar.h"

/// No path is bent by more: beyond that it has no direction to speak of.
static const bslam_real_t TURNED_MAX_RAD = BSLAM_R(1.0);
static const bslam_real_t STRETCHED_MAX = BSLAM_R(0.3);
/// A chord shorter than this has no direction.
static const bslam_real_t CHORD_MIN_M = BSLAM_R(0.01);
/// Seen from one of two nodes alone, it is seen from their mean but for the difference of what they err by.
static const bslam_real_t LONE_VAR_FACTOR = BSLAM_R(1.5625);
/// As many distances as a bslam_smoother_seen_t may be the mean of.
enum { RANGES_MAX = BSLAM_SMOOTHER_FIRST - 1 };

enum { SPEEDS = BSLAM_ROBOT_DIM_MAX - BSLAM_STATE_FORWARD };

/// Two neighbours that become one.
typedef struct pair {
    bslam_pose_t pose[2];
    bslam_pose_t mean;
    int32_t first_seen[3];  ///< of the older, of the newer, and behind that
} pair_t;

// ---- the path ---------------------------------------------------------------------------------------------

/// How far the node's speeds drive it and turn it; odometry's increments, times their scales, where there are
/// no speeds.
static void arc_to(const bslam_settings_t *model, const bslam_smoother_node_t *node, bslam_real_t *forward_m,
                   bslam_real_t *turn_rad)
{
    const bslam_motion_t *motion = &node->motion;
    const bool scales = model->velocity_states == 0 && model->scale_states == 0;
    *forward_m = scales ? model->forward_scale : node->at[BSLAM_STATE_FORWARD];
    *turn_rad = scales ? model->turn_scale : node->at[BSLAM_STATE_TURN];
    *forward_m *= model->velocity_states != 0 ? motion->dt_s : motion->forward_m;
    *turn_rad *= model->velocity_states != 0 ? motion->dt_s : motion->turn_rad;
}

/// How the chord from `from` to the node differs from that of the arc that its speeds or odometry tell.
static void bend_path(const bslam_settings_t *model, const bslam_real_t *from, bslam_smoother_node_t *node)
{
    bslam_real_t forward_m, turn_rad;
    arc_to(model, node, &forward_m, &turn_rad);
    const bslam_pose_t start = bslam_pose_of(from);
    bslam_motion_jacobian_t unused;
    const bslam_pose_t end = bslam_motion_step(BSLAM_MOTION_ARC, &start, forward_m, turn_rad, &unused);
    const bslam_real_t arc[2] = {end.x_m - start.x_m, end.y_m - start.y_m};
    const bslam_real_t chord[2] = {node->at[BSLAM_STATE_X] - start.x_m, node->at[BSLAM_STATE_Y] - start.y_m};
    const bslam_real_t arc2 = arc[0] * arc[0] + arc[1] * arc[1],
                       chord2 = chord[0] * chord[0] + chord[1] * chord[1];
    node->turned = 0;
    node->stretched = 0;
    if (!(arc2 > CHORD_MIN_M * CHORD_MIN_M && chord2 > CHORD_MIN_M * CHORD_MIN_M)) {
        return;
    }
    const bslam_real_t turned =
        bslam_atan2(arc[0] * chord[1] - arc[1] * chord[0], arc[0] * chord[0] + arc[1] * chord[1]);
    const bslam_real_t stretched = bslam_sqrt(chord2 / arc2) - 1;
    if (turned < TURNED_MAX_RAD && turned > -TURNED_MAX_RAD && stretched < STRETCHED_MAX &&
        stretched > -STRETCHED_MAX) {
        node->turned = (int16_t)bslam_smoother_units(turned / BSLAM_SMOOTHER_BEND);
        node->stretched = (int16_t)bslam_smoother_units(stretched / BSLAM_SMOOTHER_BEND);
    }
}

/// A node's path, at whose beginning there is more than the node knows: `motion`, at these speeds.
static void lengthen(bslam_smoother_node_t *node, const bslam_motion_t *motion, const bslam_real_t *speeds)
{
    const bslam_real_t share = motion->dt_s / (motion->dt_s + node->motion.dt_s);
    for (int i = 0; i < SPEEDS; i++) {
        node->at[BSLAM_STATE_FORWARD + i] += share * (speeds[i] - node->at[BSLAM_STATE_FORWARD + i]);
    }
    bslam_smoother_add_motion(&node->motion, motion, 1);
}

/// Half way between two poses, where what was seen from both is seen from: what each of them errs by at
/// random is what their mean errs by half of.
static void go_half_way(const bslam_real_t *older, bslam_real_t *newer)
{
    newer[BSLAM_STATE_X] += (older[BSLAM_STATE_X] - newer[BSLAM_STATE_X]) / 2;
    newer[BSLAM_STATE_Y] += (older[BSLAM_STATE_Y] - newer[BSLAM_STATE_Y]) / 2;
    newer[BSLAM_STATE_THETA] = bslam_angle_wrap(
        newer[BSLAM_STATE_THETA] + bslam_angle_wrap(older[BSLAM_STATE_THETA] - newer[BSLAM_STATE_THETA]) / 2);
}

// ---- what was seen ----------------------------------------------------------------------------------------

/// Where in the ring what was seen of a beacon stands between two places, or -1.
static int find_seen(bslam_smoother_t *smoother, int begin, int end, int beacon)
{
    for (int k = begin; k < end; k++) {
        if (bslam_smoother_seen(smoother, k)->beacon == beacon) {
            return k;
        }
    }
    return -1;
}

/// The distance that belongs to the direction at `k`, or NULL.
static const bslam_smoother_seen_t *range_behind(bslam_smoother_t *smoother, int k, int end)
{
    const bool has = k + 1 < end && bslam_smoother_seen(smoother, k + 1)->beacon == BSLAM_SMOOTHER_RANGE;
    return has ? bslam_smoother_seen(smoother, k + 1) : NULL;
}

/// What was seen of a beacon from a pose of the pair, as it would have been from the mean.
static void carry(const bslam_smoother_t *smoother, const pair_t *pair, int which,
                  bslam_smoother_seen_t seen[2])
{
    const bslam_settings_t *model = &smoother->model;
    const bslam_pose_t mount = {model->mount_x_m, model->mount_y_m, model->mount_yaw_rad};
    bslam_real_t x_m, y_m;
    bslam_observation_t before, after;
    bslam_ekf_beacon_position(&smoother->base, seen[0].beacon, &x_m, &y_m);
    if (bslam_observe_point(&pair->pose[which], &mount, x_m, y_m, &before) != BSLAM_OK ||
        bslam_observe_point(&pair->mean, &mount, x_m, y_m, &after) != BSLAM_OK) {
        return;
    }
    const bslam_real_t turned_rad = after.bearing_rad - before.bearing_rad;
    const bslam_real_t bearing_rad = bslam_angle_wrap(bslam_smoother_bearing_rad(&seen[0]) + turned_rad);
    seen[0].value = (uint16_t)bslam_smoother_units(bearing_rad / BSLAM_SMOOTHER_BEARING_RAD);
    if (seen[1].beacon == BSLAM_SMOOTHER_RANGE && seen[1].weight != BSLAM_SMOOTHER_FIRST) {
        const bslam_real_t range_m = seen[1].value * BSLAM_SMOOTHER_RANGE_M + after.range_m - before.range_m;
        seen[1].value = (uint16_t)(range_m > 0 ? bslam_smoother_units(range_m / BSLAM_SMOOTHER_RANGE_M) : 0);
    }
}

/// Both directions as one, in `mean`.
static void join_directions(const bslam_smoother_seen_t *one, bslam_smoother_seen_t *mean)
{
    const bslam_real_t sd[2] = {bslam_smoother_sd_rad(one), bslam_smoother_sd_rad(mean)};
    const bslam_real_t weight[2] = {1 / (sd[0] * sd[0]), 1 / (sd[1] * sd[1])};
    const bslam_real_t share = weight[0] / (weight[0] + weight[1]);
    const bslam_real_t mean_rad = bslam_smoother_bearing_rad(mean);
    const bslam_real_t apart_rad = bslam_angle_wrap(bslam_smoother_bearing_rad(one) - mean_rad);
    const bslam_real_t bearing_rad = bslam_angle_wrap(mean_rad + share * apart_rad);
    mean->value = (uint16_t)bslam_smoother_units(bearing_rad / BSLAM_SMOOTHER_BEARING_RAD);
    mean->weight = bslam_smoother_carried(1 / (weight[0] + weight[1]));
}

/// Both distances as one, in `mean`. A measured one says more than a guess.
static void join_ranges(const bslam_smoother_seen_t *one, bslam_smoother_seen_t *mean)
{
    if (one->beacon != BSLAM_SMOOTHER_RANGE ||
        (mean->beacon == BSLAM_SMOOTHER_RANGE && one->weight == BSLAM_SMOOTHER_FIRST)) {
        return;
    }
    if (mean->beacon != BSLAM_SMOOTHER_RANGE || mean->weight == BSLAM_SMOOTHER_FIRST) {
        *mean = *one;
        return;
    }
    const uint32_t count = (uint32_t)one->weight + mean->weight;
    const uint32_t sum = (uint32_t)one->value * one->weight + (uint32_t)mean->value * mean->weight;
    mean->value = (uint16_t)((sum + count / 2) / count);
    mean->weight = (uint8_t)(count < RANGES_MAX ? count : RANGES_MAX);
}

/// What a node of the pair saw of a beacon, from their mean. False: nothing.
static bool take_seen(bslam_smoother_t *smoother, const pair_t *pair, int which, int beacon,
                      bslam_smoother_seen_t seen[2])
{
    const int end = pair->first_seen[which + 1];
    const int at = find_seen(smoother, pair->first_seen[which], end, beacon);
    if (at < 0) {
        return false;
    }
    const bslam_smoother_seen_t *range = range_behind(smoother, at, end);
    seen[0] = *bslam_smoother_seen(smoother, at);
    if (range != NULL) {
        seen[1] = *range;
    }
    carry(smoother, pair, which, seen);
    return true;
}

/// What was seen of a beacon from both nodes, into joined[2]. How much that is.
static int join_seen(bslam_smoother_t *smoother, const pair_t *pair, int beacon,
                     bslam_smoother_seen_t joined[2])
{
    bslam_smoother_seen_t seen[2][2] = {{{0}, {0}}, {{0}, {0}}};
    const bool older = take_seen(smoother, pair, 0, beacon, seen[0]);
    const bool newer = take_seen(smoother, pair, 1, beacon, seen[1]);
    if (!older && !newer) {
        return 0;
    }
    joined[0] = seen[newer ? 1 : 0][0];
    if (older && newer) {
        join_directions(&seen[0][0], &joined[0]);
    } else {
        const bslam_real_t sd_rad = bslam_smoother_sd_rad(&joined[0]);
        joined[0].weight = bslam_smoother_carried(LONE_VAR_FACTOR * sd_rad * sd_rad);
    }
    join_ranges(&seen[0][1], &seen[1][1]);
    joined[1] = seen[1][1];
    return joined[1].beacon == BSLAM_SMOOTHER_RANGE ? 2 : 1;
}

// ---- the window -------------------------------------------------------------------------------------------

/// Where nodes and what was seen are read and written while the window closes its gaps: never ahead of what
/// is still to be read.
typedef struct closing {
    int32_t node, seen, to_node, to_seen;
    bslam_real_t from[BSLAM_ROBOT_DIM_MAX];  ///< the robot at the node before
    bslam_motion_t ahead;                    ///< from there to where the next node's path begins, if anywhere
    bslam_real_t speeds[SPEEDS];             ///< on that path
} closing_t;

/// The next node, with all of its path.
static bslam_smoother_node_t read_node(bslam_smoother_t *smoother, closing_t *at)
{
    bslam_smoother_node_t node = *bslam_smoother_node(smoother, at->node);
    if (at->ahead.dt_s > 0) {
        lengthen(&node, &at->ahead, at->speeds);
        bend_path(&smoother->model, at->from, &node);
        at->ahead = (bslam_motion_t){0};
    }
    at->node++;
    return node;
}

static void write_node(bslam_smoother_t *smoother, closing_t *at, const bslam_smoother_node_t *node)
{
    *bslam_smoother_node(smoother, at->to_node) = *node;
    memcpy(at->from, node->at, sizeof at->from);
    at->to_node++;
    at->to_seen += node->seen;
}

/// The next node stays as it is.
static void keep_node(bslam_smoother_t *smoother, closing_t *at)
{
    const bslam_smoother_node_t node = read_node(smoother, at);
    for (int k = 0; k < node.seen; k++) {
        *bslam_smoother_seen(smoother, at->to_seen + k) = *bslam_smoother_seen(smoother, at->seen + k);
    }
    at->seen += node.seen;
    write_node(smoother, at, &node);
}

/// The next two nodes become one, half way between them.
static void join_nodes(bslam_smoother_t *smoother, closing_t *at)
{
    const bslam_smoother_node_t older = read_node(smoother, at);
    bslam_smoother_node_t joined = read_node(smoother, at);
    pair_t pair = {{bslam_pose_of(older.at), bslam_pose_of(joined.at)},
                   {0, 0, 0},
                   {at->seen, at->seen + older.seen, at->seen + older.seen + joined.seen}};
    go_half_way(older.at, joined.at);
    for (int i = 0; i < BSLAM_ROBOT_DIM_MAX; i++) {
        joined.moved[i] = (int16_t)((older.moved[i] + joined.moved[i]) / 2);
    }
    pair.mean = bslam_pose_of(joined.at);
    int count = 0;
    for (int b = 0; b < smoother->base.beacon_count; b++) {
        count += join_seen(smoother, &pair, b, &smoother->joined[count]);
    }
    for (int k = 0; k < count; k++) {
        *bslam_smoother_seen(smoother, at->to_seen + k) = smoother->joined[k];
    }
    at->seen = pair.first_seen[2];
    at->ahead = (bslam_motion_t){0};
    bslam_smoother_add_motion(&at->ahead, &joined.motion, BSLAM_R(0.5));
    memcpy(at->speeds, &joined.at[BSLAM_STATE_FORWARD], sizeof at->speeds);
    joined.motion = at->ahead;
    lengthen(&joined, &older.motion, &older.at[BSLAM_STATE_FORWARD]);
    bend_path(&smoother->model, at->from, &joined);
    joined.seen = (int16_t)count;
    joined.doubt = older.doubt > joined.doubt ? older.doubt : joined.doubt;
    write_node(smoother, at, &joined);
}

/// How many pairs of each level become one. False if the oldest node is to leave first.
static bool plan(const bslam_smoother_t *smoother, int nodes_max, int pairs[BSLAM_SMOOTHER_LEVELS])
{
    const int room = nodes_max / BSLAM_SMOOTHER_LEVELS;
    int left[BSLAM_SMOOTHER_LEVELS];
    memset(pairs, 0, BSLAM_SMOOTHER_LEVELS * sizeof pairs[0]);
    for (int l = 0; l < BSLAM_SMOOTHER_LEVELS; l++) {
        left[l] = smoother->levels[l];
    }
    for (int count = smoother->node_count; count > nodes_max; count--) {
        int l = 0;
        while (l < BSLAM_SMOOTHER_LEVELS - 1 &&
               (left[l] <= room || 2 * pairs[l] + 2 >= smoother->levels[l])) {
            l++;
        }
        if (l == BSLAM_SMOOTHER_LEVELS - 1) {
            return false;
        }
        pairs[l]++;
        left[l] -= 2;
        left[l + 1]++;
    }
    return true;
}

void bslam_smoother_thin(bslam_smoother_t *smoother, int nodes_max)
{
    int pairs[BSLAM_SMOOTHER_LEVELS];
    if (smoother->node_count <= nodes_max) {
        return;
    }
    while (!plan(smoother, nodes_max, pairs)) {
        bslam_smoother_drop_oldest(smoother);
    }
    closing_t at = {0};
    memcpy(at.from, smoother->base.mean, sizeof at.from);
    keep_node(smoother, &at);
    for (int k = 1; k < smoother->anchors; k++) {
        keep_node(smoother, &at);
    }
    for (int l = BSLAM_SMOOTHER_LEVELS - 1; l >= 0; l--) {
        for (int k = 0; k < pairs[l]; k++) {
            join_nodes(smoother, &at);
        }
        for (int k = 2 * pairs[l]; k < smoother->levels[l]; k++) {
            keep_node(smoother, &at);
        }
    }
    for (int l = 0; l < BSLAM_SMOOTHER_LEVELS; l++) {
        smoother->levels[l] += (l > 0 ? pairs[l - 1] : 0) - 2 * pairs[l];
    }
    smoother->node_count = at.to_node;
    smoother->seen_count = at.to_seen;
}
