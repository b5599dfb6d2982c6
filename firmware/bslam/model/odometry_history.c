#include "bslam/model/odometry_history.h"

#include "bslam/model/motion.h"
#include "bslam/model/pose.h"

static const bslam_real_t SECONDS_PER_US = BSLAM_R(1e-6);

void bslam_history_add(bslam_history_t *history, int32_t room, int32_t duration_us,
                       const bslam_motion_t *motion)
{
    history->steps[history->next] =
        (bslam_history_step_t){.duration_us = duration_us,
                               .forward_m = motion->forward_m,
                               .turn_rad = motion->turn_rad,
                               .forward_var_m2 = motion->forward_var_m2,
                               .turn_var_rad2 = motion->turn_var_rad2,
                               .forward_turn_cov_mrad = motion->forward_turn_cov_mrad};
    history->next = (history->next + 1) % BSLAM_HISTORY_MAX;
    if (history->count < room) {
        history->count++;
    }
    history->filter.waiting++;
    history->filter.behind_us += duration_us;
}

void bslam_history_clear(bslam_history_t *history)
{
    history->count = 0;
    history->filter = (bslam_history_place_t){0, 0, 0};
    history->gone_forward_m = 0;
    history->gone_turn_rad = 0;
}

/// Where the motion `back` before the newest stands.
static int32_t index_back(const bslam_history_t *history, int32_t back)
{
    return (history->next + 2 * BSLAM_HISTORY_MAX - 1 - back) % BSLAM_HISTORY_MAX;
}

bslam_motion_t bslam_history_walk(const bslam_history_t *history, bslam_history_place_t *place,
                                  int64_t until_us)
{
    const bslam_history_step_t *step = &history->steps[index_back(history, place->waiting - 1)];
    const int32_t rest_us = step->duration_us - place->gone_us;
    const bool whole = place->behind_us - until_us >= rest_us;
    const int32_t part_us = whole ? rest_us : (int32_t)(place->behind_us - until_us);
    place->behind_us -= part_us;
    place->waiting -= whole ? 1 : 0;
    place->gone_us = whole ? 0 : place->gone_us + part_us;
    const bslam_real_t share = (bslam_real_t)part_us / (bslam_real_t)step->duration_us;
    return (bslam_motion_t){.dt_s = (bslam_real_t)part_us * SECONDS_PER_US,
                            .forward_m = step->forward_m * share,
                            .turn_rad = step->turn_rad * share,
                            .forward_var_m2 = step->forward_var_m2 * share,
                            .turn_var_rad2 = step->turn_var_rad2 * share,
                            .forward_turn_cov_mrad = step->forward_turn_cov_mrad * share};
}

void bslam_history_take(bslam_history_t *history, const bslam_history_place_t *place,
                        const bslam_motion_t *moved)
{
    history->gone_forward_m += moved->forward_m;
    history->gone_turn_rad += moved->turn_rad;
    if (place->waiting < history->filter.waiting) {
        bslam_history_step_t *step = &history->steps[index_back(history, place->waiting)];
        step->forward_m = history->gone_forward_m;
        step->turn_rad = history->gone_turn_rad;
        history->gone_forward_m = 0;
        history->gone_turn_rad = 0;
    }
    history->filter = *place;
}

/// A part of a motion, as a pose in the frame at its beginning.
static bslam_pose_t part_of_motion(const bslam_settings_t *settings, bslam_real_t forward_m,
                                   bslam_real_t turn_rad, bslam_real_t share)
{
    const bslam_pose_t start = {0, 0, 0};
    const bslam_motion_kind_t kind = settings->motion == 0 ? BSLAM_MOTION_EULER : BSLAM_MOTION_ARC;
    bslam_motion_jacobian_t unused;
    return bslam_motion_step(kind, &start, forward_m * share, turn_rad * share, &unused);
}

/// The motion `back` before the newest as the filter took it, up to where it stands.
static bslam_history_step_t taken_step(const bslam_history_t *history, int32_t back)
{
    bslam_history_step_t step = history->steps[index_back(history, back)];
    if (back < history->filter.waiting) {
        const bslam_real_t share = (bslam_real_t)history->filter.gone_us / (bslam_real_t)step.duration_us;
        step.duration_us = history->filter.gone_us;
        step.forward_var_m2 *= share;
        step.turn_var_rad2 *= share;
        step.forward_m = history->gone_forward_m;
        step.turn_rad = history->gone_turn_rad;
    }
    return step;
}

bslam_status_t bslam_history_look_back(const bslam_history_t *history, const bslam_settings_t *settings,
                                       int64_t back_us, bslam_history_view_t *view)
{
    bslam_history_view_t since = {.robot = {0, 0, 0}};
    int64_t left_us = back_us;
    const int32_t first = history->filter.waiting - (history->filter.gone_us > 0 ? 1 : 0);
    for (int32_t k = first; k < history->count; k++) {
        const bslam_history_step_t step = taken_step(history, k);
        const bool begins_before = left_us <= step.duration_us;
        // From 32 bits, since the conversion of 64 takes double arithmetic on an ARMv6-M.
        const bslam_real_t share =
            begins_before ? (bslam_real_t)(int32_t)left_us / (bslam_real_t)step.duration_us : 1;
        const bslam_pose_t part = part_of_motion(settings, step.forward_m, step.turn_rad, share);
        since.robot = bslam_pose_compose(&part, &since.robot);
        since.forward_var_m2 += step.forward_var_m2 * share;
        since.turn_var_rad2 += step.turn_var_rad2 * share;
        if (begins_before) {
            *view = since;
            view->robot = bslam_pose_inverse(&since.robot);
            return BSLAM_OK;
        }
        left_us -= step.duration_us;
    }
    return BSLAM_E_TIME;
}

bslam_motion_t bslam_history_newest(const bslam_history_t *history)
{
    bslam_motion_t motion = {0};
    if (history->count > 0) {
        const bslam_history_step_t *step = &history->steps[index_back(history, 0)];
        motion.dt_s = (bslam_real_t)step->duration_us * SECONDS_PER_US;
        motion.forward_m = step->forward_m;
        motion.turn_rad = step->turn_rad;
    }
    return motion;
}

bslam_pose_t bslam_history_look_ahead(const bslam_settings_t *settings, const bslam_motion_t *last,
                                      int64_t ahead_us)
{
    if (!(last->dt_s > 0)) {
        return (bslam_pose_t){0, 0, 0};
    }
    return part_of_motion(settings, last->forward_m, last->turn_rad,
                          (bslam_real_t)(int32_t)ahead_us * SECONDS_PER_US / last->dt_s);
}
