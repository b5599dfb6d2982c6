/// Values that several modules exchange. SI units; angles in (-pi, pi]; x forward, y left (REP-103).
#ifndef BSLAM_BASE_TYPES_H
#define BSLAM_BASE_TYPES_H

#include <stdint.h>

#include "base/real.h"

/// A pose in the plane: of the robot in the map, of a sensor on the robot.
typedef struct bslam_pose {
    bslam_real_t x_m;
    bslam_real_t y_m;
    bslam_real_t theta_rad;
} bslam_pose_t;

/// A symmetric matrix [[xx, xy], [xy, yy]].
typedef struct bslam_sym2 {
    bslam_real_t xx;
    bslam_real_t xy;
    bslam_real_t yy;
} bslam_sym2_t;

/// What odometry says of one interval: how far the robot went along its path and how far it turned, with
/// covariance.
typedef struct bslam_motion {
    bslam_real_t dt_s;
    bslam_real_t forward_m;
    bslam_real_t turn_rad;
    bslam_real_t forward_var_m2;
    bslam_real_t turn_var_rad2;
    bslam_real_t forward_turn_cov_mrad;
} bslam_motion_t;

/// No identity: the detector knows no label.
#define BSLAM_LABEL_NONE (-1)
/// The detector has no classes.
#define BSLAM_CLASS_NONE 0
/// The detector says that this is no beacon, a moving thing say: it is never fused and never mapped.
#define BSLAM_CLASS_NOT_MAPPABLE 255

/// One beacon seen in one image, as a detector reports it.
typedef struct bslam_sighting {
    bslam_real_t bearing_rad;     ///< direction in the sensor's frame, positive to the left
    bslam_real_t range_m;         ///< distance from the sensor; read only if has_range
    bslam_real_t bearing_sd_rad;  ///< what the detector says of this direction's noise; 0: as the settings
    bslam_real_t range_sd_m;      ///< and of this distance's; 0: as the settings
    bslam_real_t range_scale_sd;  ///< part by which all the thing's distances err alike; 0: as settings
    bslam_real_t score;    ///< how sure the detector is that this is a beacon at all; 0: it does not say
    bool has_range;        ///< false: bearing-only, paper equation (15)
    uint8_t beacon_class;  ///< BSLAM_CLASS_NONE, BSLAM_CLASS_NOT_MAPPABLE, or the detector's own
    int32_t label;         ///< identity >= 0 if the detector knows it, else BSLAM_LABEL_NONE
    const float
        *signature;  ///< its appearance, BSLAM_SAMPLE_FEATURES values (appearance/sample.h); NULL: none
} bslam_sighting_t;

#endif
