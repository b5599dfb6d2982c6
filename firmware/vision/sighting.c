#include "vision/vision.h"

#include "base/scalar.h"

// What a thing's directions have in common for a whole drive and no front end can know; and the same of its
// distances, as a part of them. Tried on drives 0:8 of the paper's room, the latter on 1020:1036 and
// 1040:1060.
static const bslam_real_t BEARING_BIAS_RAD = BSLAM_R(0.004);
static const bslam_real_t RANGE_BIAS = BSLAM_R(0.01);

static bslam_real_t hypotenuse(bslam_real_t a, bslam_real_t b)
{
    return bslam_sqrt(a * a + b * b);
}

bslam_sighting_t bslam_sighting_of(const bslam_candidate_t *candidate)
{
    bslam_sighting_t sighting = {
        .bearing_rad = candidate->bearing_rad,
        .bearing_sd_rad = hypotenuse(candidate->bearing_sd_rad, BEARING_BIAS_RAD),
        .has_range = candidate->has_range,
        .beacon_class = candidate->beacon_class,
        .score = candidate->score,
        .label = BSLAM_LABEL_NONE,
        .signature = candidate->signature,
    };
    if (candidate->has_range) {
        sighting.range_m = candidate->range_m;
        sighting.range_sd_m = hypotenuse(candidate->range_noise_sd_m, RANGE_BIAS * candidate->range_m);
        sighting.range_scale_sd = candidate->range_scale_sd;
    }
    return sighting;
}
