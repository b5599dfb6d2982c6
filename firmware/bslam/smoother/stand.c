// Where the robot stood: what is seen from there has no parallax. MATH "The smoother".
#include "bslam/smoother/smoother_internal.h"

/// A robot stands while it is no farther from where it began to than so many standard deviations (squared):
/// of what odometry went since, and of the path.
static const bslam_real_t TRAVEL_D2 = BSLAM_R(9.0);
static const bslam_real_t PATH_D2 = BSLAM_R(16.0);
/// Odometry is never exact: a command at rest has no noise, and points move by what is rounded, (1 mm)².
static const bslam_real_t TRAVEL_VAR_MIN_M2 = BSLAM_R(1e-6);
/// And no farther than this share of the distance of what it sees: one place is to do for both.
static const bslam_real_t SHARE_MAX = BSLAM_R(0.05);
/// It takes a while to tell. Driving, it would be taken to stand now and then; and till then it invents
/// little.
static const bslam_real_t STAND_MIN_S = BSLAM_R(2.0);

static bslam_smoother_stand_t stand_at(const bslam_smoother_node_t *node)
{
    const bslam_real_t sd_m = bslam_smoother_sd(node->doubt);
    return (bslam_smoother_stand_t){
        .x_m = node->at[BSLAM_STATE_X], .y_m = node->at[BSLAM_STATE_Y], .doubt_m2 = sd_m * sd_m};
}

static void lengthen(bslam_smoother_stand_t *stand, const bslam_smoother_node_t *node)
{
    stand->travel_var_m2 += node->motion.forward_var_m2;
    stand->lasts_s += node->motion.dt_s;
}

static bslam_real_t square_between(const bslam_smoother_stand_t *stand, bslam_real_t x_m, bslam_real_t y_m)
{
    const bslam_real_t dx = x_m - stand->x_m, dy = y_m - stand->y_m;
    return dx * dx + dy * dy;
}

/// Whether two places are one, as far as odometry and the path tell.
static bool is_near(const bslam_smoother_stand_t *stand, const bslam_smoother_stand_t *here)
{
    const bslam_real_t apart2 = square_between(stand, here->x_m, here->y_m);
    return apart2 <= TRAVEL_D2 * (stand->travel_var_m2 + TRAVEL_VAR_MIN_M2) &&
           apart2 <= PATH_D2 * (stand->doubt_m2 + here->doubt_m2);
}

/// Whether the path and what is seen at a node tell that the robot has left.
static bool has_left(bslam_smoother_t *smoother, const bslam_smoother_stand_t *stand,
                     const bslam_smoother_node_t *node, int first_seen)
{
    const bslam_smoother_stand_t here = stand_at(node);
    const bslam_real_t apart2 = square_between(stand, here.x_m, here.y_m);
    bool has = !is_near(stand, &here);
    for (int k = 0; k < node->seen && !has; k++) {
        const int beacon = bslam_smoother_seen(smoother, first_seen + k)->beacon;
        if (beacon != BSLAM_SMOOTHER_RANGE) {
            bslam_real_t x_m, y_m;
            bslam_ekf_beacon_position(&smoother->base, beacon, &x_m, &y_m);
            has = apart2 > SHARE_MAX * SHARE_MAX * square_between(&here, x_m, y_m);
        }
    }
    return has;
}

/// A stand lasts until a node, too, or the next one begins there. True if it lasts.
static bool reach(bslam_smoother_t *smoother, bslam_smoother_stand_t *stand,
                  const bslam_smoother_node_t *node, int first_seen)
{
    lengthen(stand, node);
    const bool lasts = !has_left(smoother, stand, node, first_seen);
    *stand = lasts ? *stand : stand_at(node);
    return lasts;
}

void bslam_smoother_begin_stand(bslam_smoother_t *smoother)
{
    const bslam_smoother_stand_t *last = &smoother->last_stand;
    const bslam_real_t *mean = smoother->base.mean;
    const bslam_smoother_stand_t here = {.x_m = mean[BSLAM_STATE_X], .y_m = mean[BSLAM_STATE_Y]};
    const bool lasts = last->lasts_s >= STAND_MIN_S && is_near(last, &here);
    smoother->base_stand = lasts ? *last : here;
    smoother->last_stand = smoother->base_stand;
}

void bslam_smoother_leave_stand(bslam_smoother_t *smoother)
{
    smoother->last_stand = (bslam_smoother_stand_t){0};
}

void bslam_smoother_follow(bslam_smoother_stand_t *stand, const bslam_smoother_node_t *node)
{
    if (node->stands) {
        lengthen(stand, node);
    } else {
        *stand = stand_at(node);
    }
}

void bslam_smoother_reach_newest(bslam_smoother_t *smoother)
{
    bslam_smoother_node_t *node = bslam_smoother_node(smoother, smoother->node_count - 1);
    const bool lasts = reach(smoother, &smoother->last_stand, node, smoother->seen_count - node->seen);
    node->stands = lasts && smoother->last_stand.lasts_s >= STAND_MIN_S;
}

/// The nodes from one on up to another are of one stand, which lasted so long.
static void note_stand(bslam_smoother_t *smoother, int begin, int end, bslam_real_t lasted_s)
{
    for (int k = begin; k < end; k++) {
        bslam_smoother_node(smoother, k)->stands = lasted_s >= STAND_MIN_S;
    }
}

void bslam_smoother_find_stands(bslam_smoother_t *smoother)
{
    bslam_smoother_stand_t *stand = &smoother->last_stand;
    int begin = 0, first_seen = 0;
    *stand = smoother->base_stand;
    for (int k = 0; k < smoother->node_count; k++) {
        bslam_smoother_node_t *node = bslam_smoother_node(smoother, k);
        const bslam_real_t lasted_s = stand->lasts_s;
        if (!reach(smoother, stand, node, first_seen)) {
            note_stand(smoother, begin, k, lasted_s);
            node->stands = false;
            begin = k + 1;
        }
        first_seen += node->seen;
    }
    note_stand(smoother, begin, smoother->node_count, stand->lasts_s);
}
