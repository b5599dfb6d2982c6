/// Noise of a sighting. MATH "Observation".
#ifndef BSLAM_MODEL_NOISE_H
#define BSLAM_MODEL_NOISE_H

#include "bslam/base/params.h"

/// Variance of a measured distance to a beacon at range_m: floor² + (fraction r)² + (per_m r²)².
static inline bslam_real_t bslam_range_variance_m2(const bslam_params_t *params, bslam_real_t range_m)
{
    const bslam_real_t proportional = params->range_sd_fraction * range_m;
    const bslam_real_t quadratic = params->range_sd_per_m * range_m * range_m;
    return params->range_sd_floor_m * params->range_sd_floor_m + proportional * proportional +
           quadratic * quadratic;
}

/// Variance of a measured direction; larger where no distance comes with it (docs/DESIGN.md, "Direction
/// only").
static inline bslam_real_t bslam_bearing_variance_rad2(const bslam_params_t *params, bool has_range)
{
    const bslam_real_t variance = params->bearing_sd_rad * params->bearing_sd_rad;
    return has_range ? variance : variance * params->bearing_only_variance_factor;
}

#endif
