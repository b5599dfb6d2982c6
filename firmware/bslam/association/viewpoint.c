#include "bslam/association/viewpoint.h"

#include "base/trig.h"
#include "base/scalar.h"

static const bslam_real_t POSITION_SD_MAX = BSLAM_R(0.125);  // of the distance: seven degrees aside

int bslam_viewpoint_sector(bslam_real_t direction_rad)
{
    const bslam_real_t turns = (bslam_angle_wrap(direction_rad) + BSLAM_PI) / (2 * BSLAM_PI);
    return (int)(turns * BSLAM_APPEARANCE_SECTORS) % BSLAM_APPEARANCE_SECTORS;
}

bool bslam_has_viewpoint(const bslam_beacon_t *beacon)
{
    return beacon->kind == BSLAM_BEACON_POINT || beacon->kind == BSLAM_BEACON_SIZED;
}

bslam_viewpoint_t bslam_viewpoint_of(const bslam_ekf_t *ekf, int index)
{
    const bslam_pose_t robot = bslam_ekf_pose(ekf);
    const int at = ekf->beacons[index].at;
    const bslam_real_t dx_m = ekf->mean[at] - robot.x_m;
    const bslam_real_t dy_m = ekf->mean[at + 1] - robot.y_m;
    const bslam_real_t direction_rad = bslam_atan2(dy_m, dx_m);
    bslam_viewpoint_t viewpoint;
    viewpoint.range_m = bslam_sqrt(dx_m * dx_m + dy_m * dy_m);
    viewpoint.bearing_rad = bslam_angle_wrap(direction_rad - robot.theta_rad);
    viewpoint.sector = bslam_viewpoint_sector(direction_rad);
    const bslam_real_t sd_m = POSITION_SD_MAX * viewpoint.range_m;
    viewpoint.is_sure = bslam_ekf_covariance(ekf, 0, 0) + bslam_ekf_covariance(ekf, 1, 1) <= sd_m * sd_m;
    return viewpoint;
}
