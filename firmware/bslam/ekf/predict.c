// Time: the state moves with odometry. MATH "Prediction".
#include <stddef.h>
#include <string.h>

#include "bslam/ekf/ekf.h"
#include "bslam/ekf/ekf_internal.h"
#include "base/trig.h"
#include "bslam/model/motion.h"
#include "bslam/model/pose.h"
#include "base/scalar.h"

/// What moves: the filter's robot, or a copy of it alone. The robot's values come first in the mean.
typedef struct moving {
    bslam_real_t *mean;
    bslam_ekf_t *ekf;           ///< NULL: the copy
    bslam_robot_t *robot;       ///< NULL: the filter's
    bslam_real_t *correction;   ///< that waits about the mean, and moves with it; NULL: none
    bslam_transition_t *noted;  ///< where to say how; NULL: nowhere
    int base_dim;
} moving_t;

static moving_t moving_ekf(bslam_ekf_t *ekf)
{
    return (moving_t){.mean = ekf->mean, .ekf = ekf, .base_dim = ekf->base_dim};
}

static moving_t moving_robot(bslam_robot_t *robot)
{
    return (moving_t){.mean = robot->mean, .robot = robot, .base_dim = robot->dim};
}

/// Fills in the derivatives by pose, and by the two further states, which move the pose by forward_rate and
/// turn_rate times their own change.
static void fill_transition(const bslam_motion_jacobian_t *jacobian, bslam_real_t forward_rate,
                            bslam_real_t turn_rate, bslam_transition_t *transition)
{
    static const bslam_transition_t unmoved = {{{1}, {0, 1}, {0, 0, 1}}, {1, 1}};
    *transition = unmoved;
    transition->by[0][BSLAM_STATE_THETA] = jacobian->x_theta;
    transition->by[1][BSLAM_STATE_THETA] = jacobian->y_theta;
    transition->by[0][BSLAM_STATE_FORWARD] = jacobian->x_forward * forward_rate;
    transition->by[1][BSLAM_STATE_FORWARD] = jacobian->y_forward * forward_rate;
    transition->by[0][BSLAM_STATE_TURN] = jacobian->x_turn * turn_rate;
    transition->by[1][BSLAM_STATE_TURN] = jacobian->y_turn * turn_rate;
    transition->by[2][BSLAM_STATE_TURN] = turn_rate;
}

/// Row i of F times a vector of the robot's values.
static bslam_real_t row_times(const bslam_transition_t *transition, int i, int base,
                              const bslam_real_t *vector)
{
    const bslam_real_t *by = transition->by[i];
    bslam_real_t sum = vector[i];
    if (i != BSLAM_STATE_THETA) {
        sum += by[BSLAM_STATE_THETA] * vector[BSLAM_STATE_THETA];
    }
    if (base > POSE_DIM) {
        sum += by[BSLAM_STATE_FORWARD] * vector[BSLAM_STATE_FORWARD];
        sum += by[BSLAM_STATE_TURN] * vector[BSLAM_STATE_TURN];
    }
    return sum;
}

/// delta <- F delta.
static void move_correction(const moving_t *state, const bslam_transition_t *transition)
{
    bslam_real_t moved[POSE_DIM];
    for (int i = 0; i < POSE_DIM; i++) {
        moved[i] = row_times(transition, i, state->base_dim, state->correction);
    }
    memcpy(state->correction, moved, sizeof moved);
}

/// P <- F P Fᵀ of the copy.
static void move_robot(bslam_robot_t *robot, const bslam_transition_t *transition)
{
    const int base = robot->dim;
    bslam_real_t moved[BSLAM_ROBOT_DIM_MAX][BSLAM_ROBOT_DIM_MAX] = {{0}};
    for (int j = 0; j < base; j++) {
        for (int i = 0; i < base; i++) {
            moved[j][i] =
                i < POSE_DIM ? row_times(transition, i, base, robot->covariance[j]) : robot->covariance[j][i];
        }
    }
    for (int i = 0; i < base; i++) {
        bslam_real_t column[BSLAM_ROBOT_DIM_MAX] = {0};
        for (int j = 0; j < base; j++) {
            column[j] = moved[j][i];
        }
        for (int j = 0; j < base; j++) {
            robot->covariance[i][j] = j < POSE_DIM ? row_times(transition, j, base, column) : column[j];
        }
    }
}

/// The filter's: each row takes of those before it in the factor. O(n).
static void move_factor(bslam_ekf_t *ekf, const bslam_transition_t *transition)
{
    bslam_factor_t *factor = &ekf->factor;
    const int theta = bslam_ekf_place(ekf, BSLAM_STATE_THETA);
    const bool extended = ekf->base_dim > POSE_DIM;
    for (int i = BSLAM_STATE_X; i <= BSLAM_STATE_Y; i++) {
        const bslam_real_t *by = transition->by[i];
        const int place = bslam_ekf_place(ekf, i);
        bslam_factor_add_row(factor, place, theta, by[BSLAM_STATE_THETA]);
        if (extended) {
            bslam_factor_add_row(factor, place, bslam_ekf_place(ekf, BSLAM_STATE_TURN), by[BSLAM_STATE_TURN]);
            bslam_factor_add_row(factor, place, bslam_ekf_place(ekf, BSLAM_STATE_FORWARD),
                                 by[BSLAM_STATE_FORWARD]);
        }
    }
    if (extended) {
        bslam_factor_add_row(factor, theta, bslam_ekf_place(ekf, BSLAM_STATE_TURN),
                             transition->by[BSLAM_STATE_THETA][BSLAM_STATE_TURN]);
    }
}

/// P <- [F 0; 0 I] P [F 0; 0 I]ᵀ, where F replaces the pose rows.
static void move_covariance(const moving_t *state, const bslam_transition_t *transition)
{
    if (state->correction != NULL) {
        move_correction(state, transition);
    }
    if (state->noted != NULL) {
        *state->noted = *transition;
    }
    if (state->ekf != NULL) {
        move_factor(state->ekf, transition);
    } else {
        move_robot(state->robot, transition);
    }
}

/// P += variance by byᵀ, of the robot's values. No down-date may wait. O(n²) where the heading has a part in
/// it, else O(n).
static void add_noise(const moving_t *state, bslam_real_t variance, const bslam_real_t *by)
{
    if (state->ekf == NULL) {
        for (int i = 0; i < state->base_dim; i++) {
            for (int j = 0; j < state->base_dim; j++) {
                state->robot->covariance[i][j] += variance * by[i] * by[j];
            }
        }
        return;
    }
    bslam_ekf_t *ekf = state->ekf;
    const int places = bslam_factor_places(&ekf->factor);
    bslam_real_t *w = ekf->v[0];
    int first = places;
    memset(w, 0, (size_t)places * sizeof w[0]);
    for (int i = 0; i < state->base_dim; i++) {
        const int place = bslam_ekf_place(ekf, i);
        w[place] = by[i];
        first = by[i] != 0 && place < first ? place : first;
    }
    bslam_factor_add(&ekf->factor, first, variance, w, ekf->lambda);
}

/// One value of the robot's becomes more doubtful.
static void add_doubt(const moving_t *state, int at, bslam_real_t variance)
{
    bslam_real_t by[BSLAM_ROBOT_DIM_MAX] = {0};
    by[at] = 1;
    add_noise(state, variance, by);
}

/// Adds the noise of the increment, mapped into the pose: Q of equation (5), as that of the turn, with what
/// of the forward motion goes with it, and the rest of this one.
static void add_motion_noise(const moving_t *state, const bslam_motion_jacobian_t *jacobian,
                             const bslam_motion_t *motion)
{
    const bslam_real_t turn_var = motion->turn_var_rad2, common = motion->forward_turn_cov_mrad;
    const bslam_real_t share = turn_var > 0 ? common / turn_var : 0;
    const bslam_real_t rest = motion->forward_var_m2 - share * common;
    const bslam_real_t by_turn[BSLAM_ROBOT_DIM_MAX] = {jacobian->x_turn + share * jacobian->x_forward,
                                                       jacobian->y_turn + share * jacobian->y_forward, 1};
    const bslam_real_t by_forward[BSLAM_ROBOT_DIM_MAX] = {jacobian->x_forward, jacobian->y_forward};
    add_noise(state, turn_var, by_turn);
    add_noise(state, rest > 0 ? rest : 0, by_forward);
}

/// One of the two further states forgets at `keep` a step and walks with variance `walk_var`.
static void walk_state(const moving_t *state, int at, bslam_real_t keep, bslam_real_t walk_var)
{
    if (keep < 1) {
        state->mean[at] *= keep;
        if (state->correction != NULL) {
            state->correction[at] *= keep;
        }
        if (state->ekf != NULL) {
            bslam_factor_scale(&state->ekf->factor, bslam_ekf_place(state->ekf, at), keep);
        }
        for (int i = 0; state->robot != NULL && i < state->base_dim; i++) {
            state->robot->covariance[i][at] *= keep;
            state->robot->covariance[at][i] *= keep;
        }
    }
    add_doubt(state, at, walk_var);
}

static void step_pose(const moving_t *state, const bslam_settings_t *settings, bslam_real_t forward_m,
                      bslam_real_t turn_rad, bslam_motion_jacobian_t *jacobian)
{
    const bslam_pose_t before = bslam_pose_of(state->mean);
    const bslam_motion_kind_t kind = settings->motion == 0 ? BSLAM_MOTION_EULER : BSLAM_MOTION_ARC;
    const bslam_pose_t after = bslam_motion_step(kind, &before, forward_m, turn_rad, jacobian);
    state->mean[BSLAM_STATE_X] = after.x_m;
    state->mean[BSLAM_STATE_Y] = after.y_m;
    state->mean[BSLAM_STATE_THETA] = after.theta_rad;
}

// ---- the motion -------------------------------------------------------------------------------------------

/// v and omega forget and walk for dt_s, v by a variance of at most v_var_max.
static void walk_speeds(const moving_t *state, const bslam_settings_t *settings, bslam_real_t dt_s,
                        bslam_real_t v_var_max, bslam_real_t keep[2])
{
    const bslam_real_t v_walk = settings->velocity_walk_mps_sqrt_s;
    const bslam_real_t turn_walk = settings->turn_rate_walk_radps_sqrt_s;
    const bslam_real_t v_var = v_walk * v_walk * dt_s;
    keep[0] = 1 / (1 + dt_s / settings->velocity_decay_s);
    keep[1] = 1 / (1 + dt_s / settings->turn_rate_decay_s);
    walk_state(state, BSLAM_STATE_FORWARD, keep[0], v_var < v_var_max ? v_var : v_var_max);
    walk_state(state, BSLAM_STATE_TURN, keep[1], turn_walk * turn_walk * dt_s);
}

/// v and omega walk, and move the robot for dt_s.
static void drive_by_velocity(const moving_t *state, const bslam_settings_t *settings, bslam_real_t dt_s)
{
    bslam_real_t keep[2];
    walk_speeds(state, settings, dt_s, BSLAM_R(1e30), keep);
    bslam_motion_jacobian_t jacobian;
    bslam_transition_t transition;
    step_pose(state, settings, state->mean[BSLAM_STATE_FORWARD] * dt_s, state->mean[BSLAM_STATE_TURN] * dt_s,
              &jacobian);
    fill_transition(&jacobian, dt_s, dt_s, &transition);
    memcpy(transition.keep, keep, sizeof keep);
    move_covariance(state, &transition);
}

/// The increment moves the robot, times its scales. *moved is what moved it.
static void drive_by_increment(const moving_t *state, const bslam_settings_t *settings,
                               const bslam_motion_t *motion, bslam_motion_t *moved)
{
    const bool scales = settings->scale_states != 0;
    if (scales) {
        const bslam_real_t walk_var =
            settings->scale_walk_sqrt_s * settings->scale_walk_sqrt_s * motion->dt_s;
        walk_state(state, BSLAM_STATE_FORWARD, 1, walk_var);
        walk_state(state, BSLAM_STATE_TURN, 1, walk_var);
    }
    moved->forward_m *= scales ? state->mean[BSLAM_STATE_FORWARD] : settings->forward_scale;
    moved->turn_rad *= scales ? state->mean[BSLAM_STATE_TURN] : settings->turn_scale;
    bslam_motion_jacobian_t jacobian;
    bslam_transition_t transition;
    step_pose(state, settings, moved->forward_m, moved->turn_rad, &jacobian);
    fill_transition(&jacobian, motion->forward_m, motion->turn_rad, &transition);
    move_covariance(state, &transition);
    add_motion_noise(state, &jacobian, motion);
}

// ---- speedometers -----------------------------------------------------------------------------------------

/// An increment as two measurements of (v, omega) whose errors are independent with variance 1.
typedef struct speeds {
    bslam_real_t by_velocity[2][2];
    bslam_real_t innovation[2];
} speeds_t;

static bslam_status_t noise_of_motion(const bslam_motion_t *motion, bslam_lower2_t *noise)
{
    const bslam_sym2_t covariance = {motion->forward_var_m2, motion->forward_turn_cov_mrad,
                                     motion->turn_var_rad2};
    return bslam_sym2_cholesky(&covariance, noise);
}

/// v = forward/dt and omega = turn/dt, whose errors L⁻¹ makes independent. False if it cannot.
static bool read_speedometers(const bslam_real_t *mean, const bslam_settings_t *settings,
                              const bslam_motion_t *motion, speeds_t *speeds)
{
    bslam_lower2_t noise;
    if (noise_of_motion(motion, &noise) != BSLAM_OK) {
        return false;
    }
    const bslam_real_t rate = 1 / motion->dt_s;
    const bslam_real_t forward_weight = 1 / (noise.xx * rate), turn_weight = 1 / (noise.yy * rate);
    const bslam_real_t carried = -noise.yx / noise.xx * turn_weight;
    const bslam_real_t forward =
        motion->forward_m * settings->forward_scale * rate - mean[BSLAM_STATE_FORWARD];
    const bslam_real_t turn = motion->turn_rad * settings->turn_scale * rate - mean[BSLAM_STATE_TURN];
    *speeds = (speeds_t){
        .by_velocity = {{forward_weight, 0}, {carried, turn_weight}},
        .innovation = {forward_weight * forward, carried * forward + turn_weight * turn},
    };
    return true;
}

static void measure_speeds(bslam_ekf_t *ekf, const speeds_t *speeds)
{
    for (int k = 0; k < 2; k++) {
        const bslam_real_t *by = speeds->by_velocity[k];
        const bslam_row_t row = {.other = {by[0], by[1]}, .at = BSLAM_STATE_FORWARD, .dim = 2};
        bslam_ekf_apply_scalar(ekf, &row, speeds->innovation[k], 1);
    }
}

/// One of the two into the copy's covariance and its correction.
static void apply_speed(bslam_robot_t *robot, const bslam_real_t by[2], bslam_real_t innovation,
                        bslam_real_t *correction)
{
    bslam_real_t column[BSLAM_ROBOT_DIM_MAX];
    for (int i = 0; i < BSLAM_ROBOT_DIM_MAX; i++) {
        const bslam_real_t *row = robot->covariance[i];
        column[i] = by[0] * row[BSLAM_STATE_FORWARD] + by[1] * row[BSLAM_STATE_TURN];
    }
    const bslam_real_t s = by[0] * column[BSLAM_STATE_FORWARD] + by[1] * column[BSLAM_STATE_TURN] + 1;
    const bslam_real_t left =
        innovation - by[0] * correction[BSLAM_STATE_FORWARD] - by[1] * correction[BSLAM_STATE_TURN];
    for (int i = 0; i < BSLAM_ROBOT_DIM_MAX; i++) {
        const bslam_real_t gain = column[i] / s;
        correction[i] += gain * left;
        for (int j = 0; j < BSLAM_ROBOT_DIM_MAX; j++) {
            robot->covariance[i][j] -= gain * column[j];
        }
    }
}

/// measure_speeds without a map. The transport of the invariant form is what a motion by the correction does
/// to the covariance.
static void measure_robots_speeds(bslam_robot_t *robot, const bslam_settings_t *settings,
                                  const speeds_t *speeds)
{
    bslam_real_t correction[BSLAM_ROBOT_DIM_MAX] = {0};
    for (int k = 0; k < 2; k++) {
        apply_speed(robot, speeds->by_velocity[k], speeds->innovation[k], correction);
    }
    if (settings->filter != 0) {
        const bslam_turning_t turning = bslam_turning(correction[BSLAM_STATE_THETA]);
        bslam_turning_apply(&turning, &correction[BSLAM_STATE_X], &correction[BSLAM_STATE_Y]);
        const bslam_motion_jacobian_t shift = {.x_theta = -correction[BSLAM_STATE_Y],
                                               .y_theta = correction[BSLAM_STATE_X]};
        bslam_transition_t transition;
        fill_transition(&shift, 0, 0, &transition);
        move_robot(robot, &transition);
    }
    for (int i = 0; i < BSLAM_ROBOT_DIM_MAX; i++) {
        robot->mean[i] += correction[i];
    }
    robot->mean[BSLAM_STATE_THETA] = bslam_angle_wrap(robot->mean[BSLAM_STATE_THETA]);
}

// ---- prediction -------------------------------------------------------------------------------------------

bslam_status_t bslam_ekf_check_motion(const bslam_settings_t *settings, const bslam_motion_t *motion)
{
    bslam_lower2_t unused;
    return settings->velocity_states != 0 ? noise_of_motion(motion, &unused) : BSLAM_OK;
}

/// With velocity states the filter takes the interval for one at the speeds that it arrives at.
static void note_velocity(const bslam_real_t *mean, bslam_motion_t *moved)
{
    moved->forward_m = mean[BSLAM_STATE_FORWARD] * moved->dt_s;
    moved->turn_rad = mean[BSLAM_STATE_TURN] * moved->dt_s;
}

/// All but the measurement of the speeds. True if there is one.
static bool drive(const moving_t *state, const bslam_settings_t *settings, const bslam_motion_t *motion,
                  bslam_motion_t *moved, speeds_t *speeds)
{
    *moved = *motion;
    if (settings->velocity_states == 0) {
        drive_by_increment(state, settings, motion, moved);
        return false;
    }
    drive_by_velocity(state, settings, motion->dt_s);
    note_velocity(state->mean, moved);
    return read_speedometers(state->mean, settings, motion, speeds);
}

void bslam_ekf_predict(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_motion_t *motion,
                       bslam_motion_t *moved)
{
    const moving_t state = moving_ekf(ekf);
    speeds_t speeds;
    if (drive(&state, settings, motion, moved, &speeds)) {
        measure_speeds(ekf, &speeds);
        bslam_ekf_correct(ekf, settings);
        note_velocity(ekf->mean, moved);
    }
}

/// A walk of v makes the travel no more doubtful than this: beside more, the millimetres that are known of it
/// would be rounded away.
static const bslam_real_t TRAVEL_SD_MAX_M = BSLAM_R(1.5);

/// v and omega walk, and what they come to moves the robot: linear about what they are afterwards.
static void drive_about(const moving_t *state, const bslam_settings_t *settings, bslam_real_t dt_s,
                        bslam_real_t stretch, const bslam_real_t *next)
{
    bslam_transition_t transition;
    bslam_motion_jacobian_t jacobian;
    bslam_real_t keep[2];
    const bslam_real_t v_sd_max = TRAVEL_SD_MAX_M / dt_s;
    walk_speeds(state, settings, dt_s, v_sd_max * v_sd_max, keep);
    for (int i = BSLAM_STATE_FORWARD; i <= BSLAM_STATE_TURN; i++) {
        state->correction[i] += state->mean[i] - next[i];
        state->mean[i] = next[i];
    }
    step_pose(state, settings, next[BSLAM_STATE_FORWARD] * dt_s * stretch, next[BSLAM_STATE_TURN] * dt_s,
              &jacobian);
    fill_transition(&jacobian, dt_s * stretch, dt_s, &transition);
    memcpy(transition.keep, keep, sizeof keep);
    move_covariance(state, &transition);
}

/// The travel is as doubtful as it misses the next point, times `share`, both axes.
static void doubt_travel(const moving_t *state, const bslam_real_t *next, bslam_real_t share)
{
    const bslam_real_t x_m = share * (state->mean[BSLAM_STATE_X] - next[BSLAM_STATE_X]);
    const bslam_real_t y_m = share * (state->mean[BSLAM_STATE_Y] - next[BSLAM_STATE_Y]);
    add_doubt(state, BSLAM_STATE_X, x_m * x_m + y_m * y_m);
    add_doubt(state, BSLAM_STATE_Y, x_m * x_m + y_m * y_m);
}

void bslam_ekf_predict_about(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_motion_t *motion,
                             const bslam_bend_t *bend, const bslam_real_t *next,
                             bslam_transition_t *transition)
{
    bslam_ekf_settle(ekf);
    moving_t state = moving_ekf(ekf);
    state.correction = ekf->correction;
    state.noted = transition;
    ekf->mean[BSLAM_STATE_THETA] += bend->turned_rad;
    if (settings->velocity_states == 0) {
        bslam_motion_t moved = *motion;
        moved.forward_m *= bend->stretch;
        drive_by_increment(&state, settings, motion, &moved);
    } else {
        drive_about(&state, settings, motion->dt_s, bend->stretch, next);
    }
    ekf->mean[BSLAM_STATE_THETA] -= bend->turned_rad;
    doubt_travel(&state, next, bend->doubt_of_miss);
    for (int i = 0; i < ekf->base_dim; i++) {
        const bslam_real_t left = ekf->mean[i] - next[i];
        ekf->correction[i] += i == BSLAM_STATE_THETA ? bslam_angle_wrap(left) : left;
        ekf->mean[i] = next[i];
    }
}

void bslam_ekf_measure_speeds(bslam_ekf_t *ekf, const bslam_settings_t *settings,
                              const bslam_motion_t *motion)
{
    speeds_t speeds;
    if (settings->velocity_states != 0 && read_speedometers(ekf->mean, settings, motion, &speeds)) {
        measure_speeds(ekf, &speeds);
    }
}

bslam_robot_t bslam_ekf_robot(const bslam_ekf_t *ekf)
{
    bslam_robot_t robot = {.dim = ekf->base_dim};
    memcpy(robot.mean, ekf->mean, (size_t)robot.dim * sizeof robot.mean[0]);
    for (int i = 0; i < robot.dim; i++) {
        for (int j = 0; j <= i; j++) {
            robot.covariance[i][j] = robot.covariance[j][i] = bslam_ekf_covariance(ekf, i, j);
        }
    }
    return robot;
}

void bslam_robot_predict(bslam_robot_t *robot, const bslam_settings_t *settings, const bslam_motion_t *motion,
                         bslam_motion_t *moved)
{
    const moving_t state = moving_robot(robot);
    speeds_t speeds;
    if (drive(&state, settings, motion, moved, &speeds)) {
        measure_robots_speeds(robot, settings, &speeds);
        note_velocity(robot->mean, moved);
    }
}

// ---- after an interruption --------------------------------------------------------------------------------

/// Adds to a variance, but not beyond `most`.
static void add_variance(bslam_ekf_t *ekf, int at, bslam_real_t addition, bslam_real_t most)
{
    const moving_t state = moving_ekf(ekf);
    const bslam_real_t variance = bslam_ekf_covariance(ekf, at, at);
    const bslam_real_t room = most > variance ? most - variance : 0;
    add_doubt(&state, at, addition < room ? addition : room);
}

/// A state value that nothing is known of but its prior.
static void forget_state(bslam_ekf_t *ekf, int at, bslam_real_t mean, bslam_real_t variance)
{
    ekf->mean[at] = mean;
    bslam_factor_forget(&ekf->factor, bslam_ekf_place(ekf, at), variance, ekf->v[0], ekf->lambda);
}

void bslam_ekf_resume(bslam_ekf_t *ekf, const bslam_settings_t *settings, bslam_real_t position_var_m2,
                      bslam_real_t heading_var_rad2)
{
    add_variance(ekf, BSLAM_STATE_X, position_var_m2, BSLAM_R(900.0));
    add_variance(ekf, BSLAM_STATE_Y, position_var_m2, BSLAM_R(900.0));
    add_variance(ekf, BSLAM_STATE_THETA, heading_var_rad2, BSLAM_R(10.24));
    if (settings->velocity_states != 0) {
        forget_state(ekf, BSLAM_STATE_FORWARD, 0, settings->velocity_sd_mps * settings->velocity_sd_mps);
        forget_state(ekf, BSLAM_STATE_TURN, 0, settings->turn_rate_sd_radps * settings->turn_rate_sd_radps);
    }
}

void bslam_ekf_set_pose(bslam_ekf_t *ekf, const bslam_pose_t *pose, bslam_real_t position_var_m2,
                        bslam_real_t heading_var_rad2)
{
    forget_state(ekf, BSLAM_STATE_X, pose->x_m, position_var_m2);
    forget_state(ekf, BSLAM_STATE_Y, pose->y_m, position_var_m2);
    forget_state(ekf, BSLAM_STATE_THETA, bslam_angle_wrap(pose->theta_rad), heading_var_rad2);
}
