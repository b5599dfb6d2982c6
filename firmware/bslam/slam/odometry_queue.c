#include "bslam/model/pose.h"
#include "bslam/slam/slam_internal.h"
#include "base/scalar.h"

static const bslam_real_t TRAVEL_MAX_M = BSLAM_R(1000.0);
static const bslam_real_t MICROMETRES_PER_M = BSLAM_R(1e6);

/// The length of a motion, or 1 km if it is longer, so that the conversion is defined.
static uint32_t whole_micrometres(bslam_real_t forward_m)
{
    return bslam_in_range(forward_m, -TRAVEL_MAX_M, TRAVEL_MAX_M)
               ? (uint32_t)(bslam_abs(forward_m) * MICROMETRES_PER_M)
               : (uint32_t)(TRAVEL_MAX_M * MICROMETRES_PER_M);
}

/// A robot that is lost has no sightings that could fit.
static void doubt_motion(const bslam_slam_t *slam, bslam_motion_t *motion)
{
    if (!slam->is_lost) {
        bslam_slam_doubt_motion(slam->misfit, slam->unseen_s, motion);
    }
}

/// The filter goes through one waiting motion, or its part before the moment until_us before the newest end.
static void predict_step(bslam_slam_t *slam, int64_t until_us)
{
    bslam_history_place_t place = slam->history.filter;
    bslam_motion_t motion = bslam_history_walk(&slam->history, &place, until_us);
    bslam_motion_t moved;
    bslam_slam_predict_others(slam, &motion);
    doubt_motion(slam, &motion);
    slam->unseen_s += motion.dt_s;
    bslam_ekf_predict(&slam->ekf, &slam->settings, &motion, &moved);
    if (bslam_slam_smooths(slam)) {
        bslam_smoother_move(slam->smoother, &slam->ekf, &motion);
    }
    bslam_history_take(&slam->history, &place, &moved);
    slam->travelled_um += whole_micrometres(moved.forward_m);
}

void bslam_slam_predict_until(bslam_slam_t *slam, int64_t until_us)
{
    while (slam->history.filter.behind_us > until_us) {
        predict_step(slam, until_us);
    }
}

/// A motion waits until a frame shows what comes after it, or until the room is needed.
static void queue_motion(bslam_slam_t *slam, int32_t duration_us, const bslam_motion_t *motion)
{
    const int32_t steps = slam->settings.history_steps;
    const int32_t room = steps < BSLAM_HISTORY_MAX ? steps : BSLAM_HISTORY_MAX;
    if (slam->history.filter.waiting >= room) {
        predict_step(slam, 0);
    }
    bslam_history_add(&slam->history, room, duration_us, motion);
    slam->elapsed_us += duration_us;
}

bslam_status_t bslam_slam_queue_odometry(bslam_slam_t *slam, const bslam_odometry_reading_t *reading)
{
    bslam_odometry_t odometry = slam->odometry;
    bslam_motion_t motion;
    bslam_status_t status = bslam_odometry_read(&odometry, &slam->settings, reading, &motion);
    if (status == BSLAM_E_JUMP) {
        slam->odometry = odometry;
    }
    if (status != BSLAM_OK) {
        return status;
    }
    if (motion.dt_s > 0) {
        status = bslam_ekf_check_motion(&slam->settings, &motion);
        if (status != BSLAM_OK) {
            return status;
        }
        queue_motion(slam, (int32_t)(odometry.time_us - slam->odometry.time_us), &motion);
        if (bslam_slam_smooths(slam)) {
            bslam_smoother_rest(slam->smoother, &slam->settings, &slam->ekf, motion.dt_s);
        }
    }
    slam->odometry = odometry;
    return BSLAM_OK;
}

int64_t bslam_slam_behind_us(const bslam_slam_t *slam, int64_t time_us)
{
    return slam->odometry.has_time ? slam->odometry.time_us - time_us : 0;
}

bslam_robot_t bslam_slam_robot_at(const bslam_slam_t *slam, int64_t behind_us, bslam_pose_t *pose)
{
    bslam_robot_t robot = bslam_ekf_robot(&slam->ekf);
    bslam_history_place_t place = slam->history.filter;
    bslam_motion_t moved = bslam_history_newest(&slam->history);
    const int64_t until_us = behind_us > 0 ? behind_us : 0;
    while (place.behind_us > until_us) {
        bslam_motion_t motion = bslam_history_walk(&slam->history, &place, until_us);
        doubt_motion(slam, &motion);
        bslam_robot_predict(&robot, &slam->settings, &motion, &moved);
    }
    *pose = bslam_pose_of(robot.mean);
    if (behind_us < 0) {
        const bslam_pose_t ahead = bslam_history_look_ahead(&slam->settings, &moved, -behind_us);
        *pose = bslam_pose_compose(pose, &ahead);
    }
    return robot;
}
