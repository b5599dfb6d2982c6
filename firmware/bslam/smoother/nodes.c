// Nodes: how they hold what was read and seen, and how a filter goes along them. MATH "The smoother".
#include "base/logarithm.h"
#include "bslam/model/noise.h"
#include "bslam/smoother/smoother_internal.h"
#include "base/scalar.h"

/// The logarithm of 4.7 m, and its standard deviation: 2.9 to 7.8 m. Rather too far than too near: directions
/// are the more linear the farther a beacon is.
static const bslam_real_t LN_GUESS_M = BSLAM_R(1.55);
static const bslam_real_t GUESS_SD_LN = BSLAM_R(0.5);

// ---- as a node holds it -----------------------------------------------------------------------------------

void bslam_smoother_add_motion(bslam_motion_t *sum, const bslam_motion_t *motion, bslam_real_t share)
{
    sum->dt_s += share * motion->dt_s;
    sum->forward_m += share * motion->forward_m;
    sum->turn_rad += share * motion->turn_rad;
    sum->forward_var_m2 += share * motion->forward_var_m2;
    sum->turn_var_rad2 += share * motion->turn_var_rad2;
    sum->forward_turn_cov_mrad += share * motion->forward_turn_cov_mrad;
}

int32_t bslam_smoother_units(bslam_real_t value)
{
    const bool is_within = value < BSLAM_SMOOTHER_UNITS_MAX && value > -BSLAM_SMOOTHER_UNITS_MAX;
    return (int32_t)(is_within ? value + (value < 0 ? -BSLAM_R(0.5) : BSLAM_R(0.5))
                               : BSLAM_SMOOTHER_UNITS_MAX);
}

uint8_t bslam_smoother_weight(bslam_real_t sd)
{
    bslam_real_t mantissa = sd / BSLAM_SMOOTHER_SD;
    int exponent = 0;
    for (; mantissa >= BSLAM_R(31.5) && exponent < 15; exponent++) {
        mantissa /= 2;
    }
    const int32_t low = bslam_smoother_units(mantissa) - 16;
    return (uint8_t)(exponent * 16 + (low < 0 ? 0 : (low > 15 ? 15 : low)));
}

uint8_t bslam_smoother_carried(bslam_real_t variance_rad2)
{
    return bslam_smoother_weight(
        bslam_sqrt(variance_rad2 + BSLAM_SMOOTHER_CARRIED_SD_RAD * BSLAM_SMOOTHER_CARRIED_SD_RAD));
}

// ---- along the nodes --------------------------------------------------------------------------------------

/// A direction, and the distance that belongs to it, if any (`range`), as a sighting.
static bslam_sighting_t sighting_of(const bslam_settings_t *model, const bslam_smoother_seen_t *direction,
                                    const bslam_smoother_seen_t *range)
{
    bslam_sighting_t sighting = {.bearing_rad = bslam_smoother_bearing_rad(direction),
                                 .bearing_sd_rad = bslam_smoother_sd_rad(direction),
                                 .has_range = range != NULL,
                                 .label = BSLAM_LABEL_NONE};
    if (range != NULL && range->weight != BSLAM_SMOOTHER_FIRST) {
        sighting.range_m = range->value * BSLAM_SMOOTHER_RANGE_M;
        const bslam_real_t variance = bslam_range_variance_m2(model, &sighting, sighting.range_m);
        sighting.range_sd_m = bslam_sqrt(variance / range->weight);
    }
    return sighting;
}

/// How far a beacon is that was never seen before: one guesses, give or take a factor. Said of the robot that
/// saw it, not of a place in the map: where the robot is may be doubtful, too.
static bslam_status_t guess_range(bslam_innovation_t *innovation)
{
    const bslam_real_t range_m = -innovation->range_m;  // what is predicted, the sighting's being 0
    const bslam_real_t sd_m = GUESS_SD_LN * range_m;
    if (!(range_m > BSLAM_SMOOTHER_RANGE_MIN_M)) {
        return BSLAM_E_SINGULAR;
    }
    innovation->range_m = range_m * (LN_GUESS_M - bslam_ln(range_m));
    innovation->range_var_m2 = sd_m * sd_m;
    return BSLAM_OK;
}

/// What was seen of a beacon, into a filter, and how it fitted. False if it cannot be used.
static bool take_seen(const bslam_settings_t *model, bslam_ekf_t *ekf, const bslam_smoother_stand_t *stand,
                      const bslam_smoother_seen_t *direction, const bslam_smoother_seen_t *range,
                      bslam_fusion_t *fusion)
{
    const bslam_pose_t mount = {model->mount_x_m, model->mount_y_m, model->mount_yaw_rad};
    const bslam_sighting_t sighting = sighting_of(model, direction, range);
    bslam_innovation_t innovation;
    bslam_status_t status =
        bslam_ekf_innovation(ekf, model, &mount, &sighting, direction->beacon, &innovation);
    if (status == BSLAM_OK) {
        status = bslam_ekf_look_from(ekf, &mount, stand->x_m, stand->y_m, direction->beacon, &innovation);
    }
    if (status == BSLAM_OK && range != NULL && range->weight == BSLAM_SMOOTHER_FIRST) {
        status = guess_range(&innovation);
    }
    return status == BSLAM_OK && bslam_ekf_fuse(ekf, model, &innovation, fusion) == BSLAM_OK;
}

void bslam_smoother_take_node(bslam_smoother_t *smoother, bslam_ekf_t *ekf,
                              const bslam_smoother_stand_t *stand, const bslam_smoother_node_t *node,
                              int first_seen)
{
    if (node->motion.dt_s > 0) {
        bslam_ekf_measure_speeds(ekf, &smoother->model, &node->motion);
    }
    for (int k = 0; k < node->seen; k++) {
        const bslam_smoother_seen_t *direction = bslam_smoother_seen(smoother, first_seen + k);
        const bslam_smoother_seen_t *range = NULL;
        if (k + 1 < node->seen &&
            bslam_smoother_seen(smoother, first_seen + k + 1)->beacon == BSLAM_SMOOTHER_RANGE) {
            k++;
            range = bslam_smoother_seen(smoother, first_seen + k);
        }
        bslam_fusion_t fusion;
        if (take_seen(&smoother->model, ekf, stand, direction, range, &fusion)) {
            smoother->misfit += fusion.weight * fusion.distance2;
            smoother->fitted++;
        } else {
            smoother->left_out++;
        }
    }
    bslam_ekf_settle(ekf);
}

void bslam_smoother_pass_node(bslam_smoother_t *smoother, bslam_ekf_t *ekf, bslam_smoother_stand_t *stand,
                              const bslam_smoother_node_t *node, int first_seen)
{
    const bslam_bend_t bend = bslam_smoother_bend(node);
    bslam_ekf_predict_about(ekf, &smoother->model, &node->motion, &bend, node->at, NULL);
    bslam_smoother_follow(stand, node);
    bslam_smoother_take_node(smoother, ekf, stand, node, first_seen);
}

void bslam_smoother_drop_oldest(bslam_smoother_t *smoother)
{
    const bslam_smoother_node_t *node = bslam_smoother_node(smoother, 0);
    smoother->model.velocity_walk_mps_sqrt_s = smoother->free_walk;
    bslam_smoother_linearise_base(smoother);
    bslam_smoother_pass_node(smoother, &smoother->base, &smoother->base_stand, node, 0);
    smoother->first_seen = (smoother->first_seen + node->seen) % BSLAM_SMOOTHER_SEEN_MAX;
    smoother->seen_count -= node->seen;
    smoother->first_node = (smoother->first_node + 1) % BSLAM_SMOOTHER_NODES_MAX;
    smoother->node_count--;
    if (smoother->anchors > 0) {
        smoother->anchors--;
    }
    if (smoother->anchors > 0) {
        return;
    }
    int level = BSLAM_SMOOTHER_LEVELS - 1;
    while (level > 0 && smoother->levels[level] == 0) {
        level--;
    }
    smoother->levels[level] -= smoother->node_count > 0 ? 1 : 0;  // the next one is the oldest now
}
