// Time: the state moves with odometry. MATH "Prediction".
#include <stddef.h>

#include "bslam/ekf/ekf.h"
#include "bslam/ekf/internal.h"
#include "bslam/math/trig.h"
#include "bslam/model/motion.h"

#define POSE_DIM 3
#define BASE_DIM_MAX 5

/// The new pose's derivative by the robot's own state values: 3 x base_dim.
typedef struct transition {
    bslam_real_t by[POSE_DIM][BASE_DIM_MAX];
} transition_t;

/// Fills in the derivatives by pose, and by the two further states, which move the pose by forward_rate and
/// turn_rate times their own change.
static void fill_transition(const bslam_motion_jacobian_t *jacobian, bslam_real_t forward_rate,
                            bslam_real_t turn_rate, transition_t *transition)
{
    *transition = (transition_t){0};
    for (int i = 0; i < POSE_DIM; i++) {
        transition->by[i][i] = 1;
    }
    transition->by[0][BSLAM_STATE_THETA] = jacobian->x_theta;
    transition->by[1][BSLAM_STATE_THETA] = jacobian->y_theta;
    transition->by[0][BSLAM_STATE_FORWARD] = jacobian->x_forward * forward_rate;
    transition->by[1][BSLAM_STATE_FORWARD] = jacobian->y_forward * forward_rate;
    transition->by[0][BSLAM_STATE_TURN] = jacobian->x_turn * turn_rate;
    transition->by[1][BSLAM_STATE_TURN] = jacobian->y_turn * turn_rate;
    transition->by[2][BSLAM_STATE_TURN] = turn_rate;
}

/// P <- [F 0; 0 I] P [F 0; 0 I]ᵀ, where F replaces the pose rows. Touches those rows only: O(n).
static void move_covariance(bslam_ekf_t *ekf, const transition_t *transition)
{
    const int base = ekf->base_dim;
    bslam_real_t block[BASE_DIM_MAX][BASE_DIM_MAX];
    bslam_real_t moved[POSE_DIM][BASE_DIM_MAX];
    for (int i = 0; i < base; i++) {
        for (int j = 0; j < base; j++) {
            block[i][j] = bslam_symmat_get(ekf->covariance, i, j);
        }
    }
    for (int i = 0; i < POSE_DIM; i++) {
        for (int j = 0; j < base; j++) {
            bslam_real_t sum = 0;
            for (int k = 0; k < base; k++) {
                sum += transition->by[i][k] * block[k][j];
            }
            moved[i][j] = sum;
        }
    }
    for (int i = 0; i < POSE_DIM; i++) {
        for (int j = 0; j <= i; j++) {
            bslam_real_t sum = 0;
            for (int k = 0; k < base; k++) {
                sum += moved[i][k] * transition->by[j][k];
            }
            bslam_symmat_set(ekf->covariance, i, j, sum);
        }
        for (int j = POSE_DIM; j < base; j++) {
            bslam_symmat_set(ekf->covariance, i, j, moved[i][j]);
        }
    }
    const transition_t f = *transition;
    const bool extended = base > POSE_DIM;
    for (int i = base; i < ekf->dim; i++) {
        bslam_real_t *row = ekf->covariance + bslam_symmat_row(i);
        row[0] += f.by[0][2] * row[2];
        row[1] += f.by[1][2] * row[2];
        if (extended) {
            row[0] += f.by[0][3] * row[3] + f.by[0][4] * row[4];
            row[1] += f.by[1][3] * row[3] + f.by[1][4] * row[4];
            row[2] += f.by[2][4] * row[4];
        }
    }
}

/// Adds the noise of the increment, mapped into the pose: Q of equation (5).
static void add_motion_noise(bslam_ekf_t *ekf, const bslam_motion_jacobian_t *jacobian,
                             const bslam_motion_t *motion)
{
    const bslam_real_t by_forward[POSE_DIM] = {jacobian->x_forward, jacobian->y_forward, 0};
    const bslam_real_t by_turn[POSE_DIM] = {jacobian->x_turn, jacobian->y_turn, 1};
    for (int i = 0; i < POSE_DIM; i++) {
        for (int j = 0; j <= i; j++) {
            const bslam_real_t cross = by_forward[i] * by_turn[j] + by_turn[i] * by_forward[j];
            ekf->covariance[bslam_symmat_at(i, j)] += motion->forward_var_m2 * by_forward[i] * by_forward[j] +
                                                      motion->turn_var_rad2 * by_turn[i] * by_turn[j] +
                                                      motion->forward_turn_cov_mrad * cross;
        }
    }
}

/// One of the two further states forgets at `keep` a step and walks with variance `walk_var`.
static void walk_state(bslam_ekf_t *ekf, int at, bslam_real_t keep, bslam_real_t walk_var)
{
    if (keep < 1) {
        ekf->mean[at] *= keep;
        for (int i = 0; i < ekf->dim; i++) {
            ekf->covariance[bslam_symmat_at(i, at)] *= keep;
        }
        ekf->covariance[bslam_symmat_at(at, at)] *= keep;
    }
    ekf->covariance[bslam_symmat_at(at, at)] += walk_var;
}

static void step_pose(bslam_ekf_t *ekf, const bslam_params_t *params, bslam_real_t forward_m,
                      bslam_real_t turn_rad, bslam_motion_jacobian_t *jacobian)
{
    const bslam_pose_t before = bslam_ekf_pose(ekf);
    const bslam_motion_kind_t kind = params->motion == 0 ? BSLAM_MOTION_EULER : BSLAM_MOTION_ARC;
    const bslam_pose_t after = bslam_motion_step(kind, &before, forward_m, turn_rad, jacobian);
    ekf->mean[BSLAM_STATE_X] = after.x_m;
    ekf->mean[BSLAM_STATE_Y] = after.y_m;
    ekf->mean[BSLAM_STATE_THETA] = after.theta_rad;
}

/// Fuses v = forward/dt and omega = turn/dt, whose errors L⁻¹ makes independent with variance 1.
static void measure_velocity(bslam_ekf_t *ekf, const bslam_params_t *params, const bslam_motion_t *motion,
                             const bslam_lower2_t *noise)
{
    const bslam_real_t rate = 1 / motion->dt_s;
    const bslam_real_t forward_weight = 1 / (noise->xx * rate);
    const bslam_real_t turn_weight = 1 / (noise->yy * rate);
    const bslam_real_t carried = -noise->yx / noise->xx * turn_weight;
    const bslam_real_t forward_innovation = motion->forward_m * rate - ekf->mean[BSLAM_STATE_FORWARD];
    const bslam_real_t turn_innovation = motion->turn_rad * rate - ekf->mean[BSLAM_STATE_TURN];

    const bslam_row_t forward_row = {.base = {0, 0, 0, forward_weight}};
    const bslam_row_t turn_row = {.base = {0, 0, 0, carried, turn_weight}};
    bslam_ekf_apply_scalar(ekf, &forward_row, forward_weight * forward_innovation, 1);
    bslam_ekf_apply_scalar(ekf, &turn_row, carried * forward_innovation + turn_weight * turn_innovation, 1);
    bslam_ekf_correct(ekf, params);
}

static bslam_status_t predict_with_velocity(bslam_ekf_t *ekf, const bslam_params_t *params,
                                            const bslam_motion_t *motion, bslam_motion_t *moved)
{
    bslam_motion_t scaled = *motion;
    scaled.forward_m *= params->forward_scale;
    scaled.turn_rad *= params->turn_scale;
    const bslam_sym2_t covariance = {motion->forward_var_m2, motion->forward_turn_cov_mrad,
                                     motion->turn_var_rad2};
    bslam_lower2_t noise;
    const bslam_status_t status = bslam_sym2_cholesky(&covariance, &noise);
    if (status != BSLAM_OK) {
        return status;
    }
    const bslam_real_t dt = motion->dt_s;
    const bslam_real_t v_walk = params->velocity_walk_mps_sqrt_s;
    const bslam_real_t turn_walk = params->turn_rate_walk_radps_sqrt_s;
    walk_state(ekf, BSLAM_STATE_FORWARD, 1 / (1 + dt / params->velocity_decay_s), v_walk * v_walk * dt);
    walk_state(ekf, BSLAM_STATE_TURN, 1 / (1 + dt / params->turn_rate_decay_s), turn_walk * turn_walk * dt);

    bslam_motion_jacobian_t jacobian;
    transition_t transition;
    step_pose(ekf, params, ekf->mean[BSLAM_STATE_FORWARD] * dt, ekf->mean[BSLAM_STATE_TURN] * dt, &jacobian);
    fill_transition(&jacobian, dt, dt, &transition);
    move_covariance(ekf, &transition);
    measure_velocity(ekf, params, &scaled, &noise);
    moved->forward_m = ekf->mean[BSLAM_STATE_FORWARD] * dt;
    moved->turn_rad = ekf->mean[BSLAM_STATE_TURN] * dt;
    return BSLAM_OK;
}

bslam_status_t bslam_ekf_predict(bslam_ekf_t *ekf, const bslam_params_t *params, const bslam_motion_t *motion,
                                 bslam_motion_t *moved)
{
    *moved = *motion;
    if (params->velocity_states != 0) {
        return predict_with_velocity(ekf, params, motion, moved);
    }
    const bool scales = params->scale_states != 0;
    if (scales) {
        const bslam_real_t walk_var = params->scale_walk_sqrt_s * params->scale_walk_sqrt_s * motion->dt_s;
        walk_state(ekf, BSLAM_STATE_FORWARD, 1, walk_var);
        walk_state(ekf, BSLAM_STATE_TURN, 1, walk_var);
    }
    moved->forward_m *= scales ? ekf->mean[BSLAM_STATE_FORWARD] : params->forward_scale;
    moved->turn_rad *= scales ? ekf->mean[BSLAM_STATE_TURN] : params->turn_scale;
    bslam_motion_jacobian_t jacobian;
    transition_t transition;
    step_pose(ekf, params, moved->forward_m, moved->turn_rad, &jacobian);
    fill_transition(&jacobian, motion->forward_m, motion->turn_rad, &transition);
    move_covariance(ekf, &transition);
    add_motion_noise(ekf, &jacobian, motion);
    return BSLAM_OK;
}

/// Adds to a variance, but not beyond `most`.
static void add_variance(bslam_ekf_t *ekf, int at, bslam_real_t addition, bslam_real_t most)
{
    bslam_real_t *variance = &ekf->covariance[bslam_symmat_at(at, at)];
    const bslam_real_t room = most > *variance ? most - *variance : 0;
    *variance += addition < room ? addition : room;
}

/// A state value that nothing is known of but its prior.
static void forget_state(bslam_ekf_t *ekf, int at, bslam_real_t sd)
{
    ekf->mean[at] = 0;
    for (int i = 0; i < ekf->dim; i++) {
        bslam_symmat_set(ekf->covariance, i, at, 0);
    }
    bslam_symmat_set(ekf->covariance, at, at, sd * sd);
}

void bslam_ekf_resume(bslam_ekf_t *ekf, const bslam_params_t *params, bslam_real_t position_var_m2,
                      bslam_real_t heading_var_rad2)
{
    add_variance(ekf, BSLAM_STATE_X, position_var_m2, BSLAM_R(900.0));
    add_variance(ekf, BSLAM_STATE_Y, position_var_m2, BSLAM_R(900.0));
    add_variance(ekf, BSLAM_STATE_THETA, heading_var_rad2, BSLAM_R(10.24));
    if (params->velocity_states != 0) {
        forget_state(ekf, BSLAM_STATE_FORWARD, params->velocity_sd_mps);
        forget_state(ekf, BSLAM_STATE_TURN, params->turn_rate_sd_radps);
    }
}
