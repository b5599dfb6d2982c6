/// Noise of a sighting: its own if the detector gives one, else that of the settings. MATH "Observation".
#ifndef BSLAM_MODEL_NOISE_H
#define BSLAM_MODEL_NOISE_H

#include "bslam/settings.h"
#include "base/types.h"
#include "base/scalar.h"

/// Variance of a measured distance to a beacon predicted at range_m: floor² + (fraction r)² + (per_m r²)².
/// The detector's own is in proportion to the distance: what is measured too short must not count as more
/// exact.
static inline bslam_real_t bslam_range_variance_m2(const bslam_settings_t *settings,
                                                   const bslam_sighting_t *sighting, bslam_real_t range_m)
{
    if (sighting->range_sd_m > 0) {
        const bslam_real_t sd_m = sighting->range_sd_m * (range_m / sighting->range_m);
        return sd_m * sd_m;
    }
    const bslam_real_t proportional = settings->range_sd_fraction * range_m;
    const bslam_real_t quadratic = settings->range_sd_per_m * range_m * range_m;
    return settings->range_sd_floor_m * settings->range_sd_floor_m + proportional * proportional +
           quadratic * quadratic;
}

/// The same of a beacon whose scale, by which all of its distances are too long, is known to this variance:
/// 0 where the scale is a state value, bslam_unknown_scale_var where nobody knows it. MATH "Beacon scale
/// states".
static inline bslam_real_t bslam_scaled_range_variance_m2(const bslam_settings_t *settings,
                                                          const bslam_sighting_t *sighting,
                                                          bslam_real_t range_m, bslam_real_t scale_var)
{
    return bslam_range_variance_m2(settings, sighting, range_m) + scale_var * range_m * range_m;
}

/// Variance of the scale of a beacon of which only this sighting is known.
static inline bslam_real_t bslam_unknown_scale_var(const bslam_settings_t *settings,
                                                   const bslam_sighting_t *sighting)
{
    const bslam_real_t sd =
        sighting->range_scale_sd > 0 ? sighting->range_scale_sd : settings->range_scale_sd;
    return sd * sd;
}

/// Variance of a measured direction; larger where no distance comes with it. MATH "Bearing-only".
static inline bslam_real_t bslam_bearing_variance_rad2(const bslam_settings_t *settings,
                                                       const bslam_sighting_t *sighting)
{
    const bslam_real_t sd_rad =
        sighting->bearing_sd_rad > 0 ? sighting->bearing_sd_rad : settings->bearing_sd_rad;
    return sighting->has_range ? sd_rad * sd_rad : sd_rad * sd_rad * settings->bearing_only_variance_factor;
}

/// By how much a sighting's variances grow, since its error is much like that of the same beacon's sighting
/// before it, travelled_m ago; at most 100. MATH "Correlated errors".
static inline bslam_real_t bslam_correlation_factor(const bslam_settings_t *settings,
                                                    bslam_real_t travelled_m)
{
    const bslam_real_t length_m = settings->correlation_m;
    if (!(length_m > 0)) {
        return 1;
    }
    const bslam_real_t least_m = length_m / 50;
    const bslam_real_t ratio = 2 * length_m / (travelled_m > least_m ? travelled_m : least_m);
    return bslam_sqrt(1 + ratio * ratio);
}

#endif
