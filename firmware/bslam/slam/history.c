#include "bslam/slam/history.h"

#include "bslam/model/motion.h"
#include "bslam/model/pose.h"

static const bslam_real_t SECONDS_PER_US = BSLAM_R(1e-6);

void bslam_history_add(bslam_history_t *history, int64_t end_us, const bslam_motion_t *moved)
{
    history->steps[history->next] = (bslam_history_step_t){
        .end_us = end_us, .dt_s = moved->dt_s, .forward_m = moved->forward_m, .turn_rad = moved->turn_rad};
    history->next = (history->next + 1) % BSLAM_HISTORY_MAX;
    if (history->count < BSLAM_HISTORY_MAX) {
        history->count++;
    }
}

void bslam_history_clear(bslam_history_t *history)
{
    history->count = 0;
}

/// The motion `back` before the newest.
static const bslam_history_step_t *step_back(const bslam_history_t *history, int back)
{
    return &history->steps[(history->next + 2 * BSLAM_HISTORY_MAX - 1 - back) % BSLAM_HISTORY_MAX];
}

/// A part of a motion, as a pose in the frame at its beginning.
static bslam_pose_t part_of_step(const bslam_params_t *params, const bslam_history_step_t *step,
                                 bslam_real_t share)
{
    const bslam_pose_t start = {0, 0, 0};
    const bslam_motion_kind_t kind = params->motion == 0 ? BSLAM_MOTION_EULER : BSLAM_MOTION_ARC;
    bslam_motion_jacobian_t unused;
    return bslam_motion_step(kind, &start, step->forward_m * share, step->turn_rad * share, &unused);
}

static bslam_status_t look_back(const bslam_history_t *history, const bslam_params_t *params, int64_t time_us,
                                bslam_pose_t *relative)
{
    bslam_pose_t since = {0, 0, 0};
    for (int k = 0; k < history->count; k++) {
        const bslam_history_step_t *step = step_back(history, k);
        const bslam_real_t back_s = (bslam_real_t)(step->end_us - time_us) * SECONDS_PER_US;
        const bool begins_before = back_s <= step->dt_s;
        const bslam_pose_t part = part_of_step(params, step, begins_before ? back_s / step->dt_s : 1);
        since = bslam_pose_compose(&part, &since);
        if (begins_before) {
            *relative = bslam_pose_inverse(&since);
            return BSLAM_OK;
        }
    }
    return BSLAM_E_TIME;
}

static bslam_status_t look_ahead(const bslam_history_t *history, const bslam_params_t *params,
                                 int64_t ahead_us, bslam_pose_t *relative)
{
    if (ahead_us > params->ahead_max_us) {
        return BSLAM_E_TIME;
    }
    *relative = (bslam_pose_t){0, 0, 0};
    if (history->count > 0) {
        const bslam_history_step_t *last = step_back(history, 0);
        *relative = part_of_step(params, last, (bslam_real_t)ahead_us * SECONDS_PER_US / last->dt_s);
    }
    return BSLAM_OK;
}

bslam_status_t bslam_history_relative_pose(const bslam_history_t *history, const bslam_params_t *params,
                                           int64_t now_us, int64_t time_us, bslam_pose_t *relative)
{
    if (time_us == now_us) {
        *relative = (bslam_pose_t){0, 0, 0};
        return BSLAM_OK;
    }
    return time_us > now_us ? look_ahead(history, params, time_us - now_us, relative)
                            : look_back(history, params, time_us, relative);
}
