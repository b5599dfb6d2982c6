// Errors of sightings that hang together in time: a light that dazzles, a bearing off by the same for a
// second, a sensor that is not where it is told. Then innovations are no white noise, and many sightings tell
// what few do. MATH "Coloured noise".
#include "bslam/slam/slam_internal.h"

/// So many sightings the sums go back.
static const bslam_real_t MEMORY = BSLAM_R(2000.0);
/// As of so many sightings whose noise is white, before any has come.
static const bslam_real_t PRIOR = BSLAM_R(30.0);
/// A hundred sightings tell what one does.
static const bslam_real_t CORRELATION_MAX = BSLAM_R(0.98);
/// Standard deviations. What is farther off is an outlier, and tells nothing of the noise.
static const bslam_real_t INNOVATION_MAX = BSLAM_R(5.0);

static void note(bslam_autocorrelation_t *noise, bslam_real_t *last, bslam_real_t innovation,
                 bslam_real_t variance)
{
    const bslam_real_t y = innovation / bslam_sqrt(variance);
    if (y > INNOVATION_MAX || y < -INNOVATION_MAX) {
        *last = 0;
        return;
    }
    noise->product += *last * y;
    noise->square += y * y;
    *last = y;
}

static void forget(bslam_autocorrelation_t *noise, bslam_real_t count)
{
    noise->product -= noise->product * count / MEMORY;
    noise->square -= noise->square * count / MEMORY;
}

/// How many times the variance of white noise is that which in the mean of many tells as little.
static bslam_real_t factor_of(const bslam_autocorrelation_t *noise)
{
    const bslam_real_t r = noise->product / (noise->square + PRIOR);
    return r > CORRELATION_MAX ? (1 + CORRELATION_MAX) / (1 - CORRELATION_MAX)
           : r > 0             ? (1 + r) / (1 - r)
                               : 1;
}

bslam_real_t bslam_slam_evidence_share(const bslam_slam_t *slam)
{
    const bslam_real_t by_bearing = factor_of(&slam->bearing_noise), by_range = factor_of(&slam->range_noise);
    return 1 / (by_bearing > by_range ? by_bearing : by_range);
}

void bslam_slam_doubt_sightings(bslam_slam_t *slam, int count)
{
    // Those of now, so that the order within a frame does not matter.
    const bool is_shown = slam->settings.correlation_m < 0;
    const bslam_real_t by_bearing = is_shown ? factor_of(&slam->bearing_noise) : 1;
    const bslam_real_t by_range = is_shown ? factor_of(&slam->range_noise) : 1;
    bslam_real_t bearings = 0, ranges = 0;
    for (int i = 0; i < count; i++) {
        const bslam_match_t *match = &slam->records[i].match;
        bslam_innovation_t *innovation = &slam->records[i].innovation;
        if (match->verdict != BSLAM_VERDICT_MATCH) {
            continue;
        }
        bslam_beacon_t *beacon = &slam->ekf.beacons[match->beacon];
        note(&slam->bearing_noise, &beacon->last_bearing, innovation->bearing_rad,
             innovation->bearing_var_rad2);
        innovation->bearing_var_rad2 *= by_bearing;
        bearings++;
        if (innovation->has_range) {
            note(&slam->range_noise, &beacon->last_range, innovation->range_m, innovation->range_var_m2);
            innovation->range_var_m2 *= by_range;
            ranges++;
        }
    }
    forget(&slam->bearing_noise, bearings);
    forget(&slam->range_noise, ranges);
}
