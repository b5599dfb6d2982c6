#include "bslam/slam/slam.h"

#include <string.h>

#include "base/trig.h"
#include "bslam/model/pose.h"
#include "bslam/slam/doubt.h"
#include "bslam/slam/slam_internal.h"
#include "bslam/settings_internal.h"
#include "base/scalar.h"

bslam_status_t bslam_slam_init(bslam_slam_t *slam, const bslam_settings_t *settings, int *bad_id)
{
    const bslam_status_t status = bslam_settings_check(settings, bad_id);
    if (status != BSLAM_OK) {
        return status;
    }
    const bslam_settings_t copy = *settings;  // settings may stand in *slam: starting over
    *slam = (bslam_slam_t){0};
    slam->settings = copy;
    slam->bad_sighting = -1;
    slam->elapsed_us = slam->moment_us = 1;  // what was never seen is of 0
    bslam_ekf_init(&slam->ekf, &slam->settings);
    return BSLAM_OK;
}

void bslam_slam_restart_smoother(bslam_slam_t *slam)
{
    if (bslam_slam_smooths(slam)) {
        bslam_smoother_restart(slam->smoother, &slam->settings, &slam->ekf);
    }
}

// ---- the pose ---------------------------------------------------------------------------------------------

bool bslam_slam_are_doubts(bslam_real_t position_sd_m, bslam_real_t heading_sd_rad)
{
    return bslam_in_range(position_sd_m, 0, BSLAM_POSITION_SD_MAX_M) &&
           bslam_in_range(heading_sd_rad, 0, BSLAM_HEADING_SD_MAX_RAD);
}

/// The pose, or the map, is another one than before.
static void begin_elsewhere(bslam_slam_t *slam)
{
    slam->misfit = 0;
    bslam_slam_end_doubt(slam);
    if (bslam_slam_smooths(slam)) {
        bslam_smoother_leave_stand(slam->smoother);
    }
    bslam_slam_restart_smoother(slam);
}

bslam_status_t bslam_slam_set_pose(bslam_slam_t *slam, const bslam_pose_t *pose, bslam_real_t position_sd_m,
                                   bslam_real_t heading_sd_rad)
{
    if (!bslam_is_number(pose->x_m) || !bslam_is_number(pose->y_m) || !bslam_is_number(pose->theta_rad)) {
        return BSLAM_E_NOT_FINITE;
    }
    if (!bslam_slam_are_doubts(position_sd_m, heading_sd_rad)) {
        return BSLAM_E_RANGE;
    }
    bslam_ekf_set_pose(&slam->ekf, pose, position_sd_m * position_sd_m, heading_sd_rad * heading_sd_rad);
    begin_elsewhere(slam);
    slam->is_lost = false;
    return BSLAM_OK;
}

void bslam_slam_lose_pose(bslam_slam_t *slam)
{
    const bslam_pose_t pose = bslam_ekf_pose(&slam->ekf);
    bslam_ekf_set_pose(&slam->ekf, &pose, 0, 0);
    begin_elsewhere(slam);
    slam->is_lost = true;
}

// ---- what may be attached ---------------------------------------------------------------------------------

void bslam_slam_attach_smoother(bslam_slam_t *slam, bslam_smoother_t *smoother)
{
    slam->smoother = slam->settings.filter == BSLAM_FILTER_SMOOTHER ? smoother : NULL;
    if (slam->smoother != NULL) {
        memset(smoother, 0, sizeof *smoother);
    }
    bslam_slam_restart_smoother(slam);
}

void bslam_slam_attach_appearance(bslam_slam_t *slam, bslam_appearance_t *appearance)
{
    slam->appearance = appearance;
    if (appearance != NULL) {
        bslam_appearance_clear(appearance);
    }
}

// ---- the map ----------------------------------------------------------------------------------------------

int bslam_slam_find_beacon(const bslam_slam_t *slam, uint32_t uid)
{
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        if (slam->ekf.beacons[b].uid == uid) {
            return b;
        }
    }
    return -1;
}

void bslam_slam_drop_beacon(bslam_slam_t *slam, int index)
{
    if (bslam_slam_learns(slam)) {
        bslam_appearance_forget(slam->appearance, index, slam->ekf.beacon_count);
    }
    if (bslam_slam_smooths(slam)) {
        bslam_smoother_remove(slam->smoother, index);
    }
    bslam_ekf_remove(&slam->ekf, index);
}

bslam_status_t bslam_slam_add_known_beacon(bslam_slam_t *slam, int32_t label, bslam_real_t x_m,
                                           bslam_real_t y_m)
{
    if (!bslam_is_number(x_m) || !bslam_is_number(y_m)) {
        return BSLAM_E_NOT_FINITE;
    }
    if (label < 0 || !bslam_slam_reaches(x_m, y_m)) {
        return BSLAM_E_RANGE;
    }
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        if (slam->ekf.beacons[b].label == label) {
            return BSLAM_E_DUPLICATE;
        }
    }
    int index;
    bslam_slam_end_doubt(slam);
    const bslam_status_t status =
        bslam_slam_has_uid(slam) ? bslam_ekf_add_known(&slam->ekf, x_m, y_m, &index) : BSLAM_E_MAP_FULL;
    if (status == BSLAM_OK) {
        slam->ekf.beacons[index].label = label;
        bslam_slam_restart_smoother(slam);
    }
    return status;
}

void bslam_slam_forget_map(bslam_slam_t *slam)
{
    bslam_slam_end_doubt(slam);
    if (bslam_slam_learns(slam)) {
        bslam_appearance_clear(slam->appearance);
    }
    bslam_ekf_forget_map(&slam->ekf);
    begin_elsewhere(slam);
    slam->is_frozen = false;
}

bslam_status_t bslam_slam_remove_beacon(bslam_slam_t *slam, uint32_t uid)
{
    const int index = bslam_slam_find_beacon(slam, uid);
    if (index < 0) {
        return BSLAM_E_NO_BEACON;
    }
    bslam_slam_end_doubt(slam);
    bslam_slam_drop_beacon(slam, index);
    return BSLAM_OK;
}

// ---- results ----------------------------------------------------------------------------------------------

bslam_pose_t bslam_slam_pose(const bslam_slam_t *slam)
{
    if (slam->history.filter.behind_us == 0) {
        return bslam_ekf_pose(&slam->ekf);  // nothing waits: no copy of the robot is to go further
    }
    bslam_pose_t pose;
    (void)bslam_slam_robot_at(slam, 0, &pose);
    return pose;
}

bslam_status_t bslam_slam_pose_at(const bslam_slam_t *slam, int64_t time_us, bslam_pose_t *pose)
{
    if (time_us < 0 || time_us > INT64_MAX / 2) {
        return BSLAM_E_TIME;
    }
    const int64_t behind_us = bslam_slam_behind_us(slam, time_us);
    if (behind_us < -slam->settings.ahead_max_us) {
        return BSLAM_E_TIME;
    }
    const int64_t back_us = behind_us - slam->history.filter.behind_us;
    if (back_us <= 0) {
        (void)bslam_slam_robot_at(slam, behind_us, pose);
        return BSLAM_OK;
    }
    bslam_history_view_t view;
    const bslam_status_t status = bslam_history_look_back(&slam->history, &slam->settings, back_us, &view);
    if (status == BSLAM_OK) {
        const bslam_pose_t filter = bslam_ekf_pose(&slam->ekf);
        *pose = bslam_pose_compose(&filter, &view.robot);
    }
    return status;
}

void bslam_slam_pose_covariance(const bslam_slam_t *slam, bslam_real_t lower[6])
{
    bslam_pose_t unused;
    const bslam_robot_t robot = bslam_slam_robot_at(slam, 0, &unused);
    int k = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            lower[k] = robot.covariance[i][j];
            k++;
        }
    }
    if (slam->is_lost) {
        lower[0] += BSLAM_POSITION_SD_MAX_M * BSLAM_POSITION_SD_MAX_M;
        lower[2] += BSLAM_POSITION_SD_MAX_M * BSLAM_POSITION_SD_MAX_M;
        lower[5] += BSLAM_HEADING_SD_MAX_RAD * BSLAM_HEADING_SD_MAX_RAD;
    }
}

bslam_status_t bslam_slam_beacon(const bslam_slam_t *slam, int index, bslam_beacon_view_t *view)
{
    if (index < 0 || index >= slam->ekf.beacon_count) {
        return BSLAM_E_NO_BEACON;
    }
    const bslam_beacon_t *beacon = &slam->ekf.beacons[index];
    view->uid = beacon->uid;
    view->label = beacon->label;
    view->kind = beacon->kind;
    view->confirmed = beacon->confirmed;
    view->beacon_class = beacon->beacon_class;
    view->sightings = beacon->sightings;
    bslam_ekf_beacon_position(&slam->ekf, index, &view->x_m, &view->y_m);
    view->covariance_m2 = bslam_ekf_beacon_covariance(&slam->ekf, index);
    view->range_m = bslam_sqrt(view->x_m * view->x_m + view->y_m * view->y_m);
    view->phi_rad = bslam_atan2(view->y_m, view->x_m);
    return BSLAM_OK;
}
