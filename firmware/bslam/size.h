/// How many bytes an instance takes, from config.h: so that bslam_t can be a plain variable, and what stands
/// in it be the library's own. The library does not compile where a sum is too small; a test holds what is
/// too much below 2 %. docs/SIZES.md prints them.
#ifndef BSLAM_SIZE_H
#define BSLAM_SIZE_H

#include "bslam/config.h"
#include "base/status.h"

/// Of a number, of an address and of an enumeration: some compilers for cores take a byte for one.
#define BSLAM_SIZE_REAL (BSLAM_REAL_DOUBLE ? 8 : 4)
enum { BSLAM_SIZE_POINTER = sizeof(void *), BSLAM_SIZE_ENUM = sizeof(bslam_status_t) };

/// State values: 5 for the robot, 4 for its sensor, 2 a beacon, and room for 2 more a ray and 7 in passing;
/// filled up to a multiple of four.
#define BSLAM_SIZE_STATE ((9 + 2 * BSLAM_BEACONS_MAX + 2 * BSLAM_RAYS_MAX + 7 + 3) / 4 * 4)
/// A filter: means; triangle and tail of the factor, measurements that wait; beacons.
#define BSLAM_SIZE_BODY ((6 + 2 * BSLAM_BEACONS_MAX + 2 * BSLAM_RAYS_MAX + 7 + 3) / 4 * 4)
#define BSLAM_SIZE_EKF \
    (BSLAM_SIZE_REAL * (BSLAM_SIZE_STATE * 2 + (BSLAM_SIZE_BODY + 4) * 14 + \
                        BSLAM_SIZE_BODY * (BSLAM_SIZE_BODY + 4) / 2 + 4) + \
     BSLAM_BEACONS_MAX * (64 + 6 * BSLAM_SIZE_REAL) + 48)
/// The values of the settings.
#define BSLAM_SIZE_SETTINGS (64 * BSLAM_SIZE_REAL + 64 + 2 * BSLAM_SIZE_POINTER)
/// The pipeline: filter, waiting odometry, and for each sighting its record and its account.
#define BSLAM_SIZE_PIPELINE \
    (BSLAM_SIZE_EKF + BSLAM_SIZE_SETTINGS + BSLAM_HISTORY_MAX * 6 * BSLAM_SIZE_REAL + \
     BSLAM_SIGHTINGS_MAX * (28 + 5 * BSLAM_SIZE_ENUM + 37 * BSLAM_SIZE_REAL + 2 * BSLAM_SIZE_POINTER) + \
     10 * BSLAM_SIZE_REAL + 2 * BSLAM_SIZE_POINTER + 208 + 4 * BSLAM_HISTORY_MAX)

#define BSLAM_SIZE_RECOVERY \
    (BSLAM_RECOVERY * ((BSLAM_SIZE_REAL + BSLAM_SIZE_POINTER > 8 ? 496 : 416) + 124 * BSLAM_SIZE_REAL))
#define BSLAM_SIZE_GUARD (BSLAM_GUARD == 0 ? 0 : 48 + (BSLAM_GUARD == 2 ? BSLAM_SIZE_PIPELINE : 0))

/// A classifier: its list of negatives, its weights, its samples.
#define BSLAM_SIZE_SAMPLE (BSLAM_SAMPLE_FLOAT ? 288 : 72)
#define BSLAM_SIZE_SAMPLES (BSLAM_LEARNER_SLOTS * BSLAM_SAMPLES_PER_CLASSIFIER)
#define BSLAM_SIZE_CLASSIFIER \
    (12 + 2 * BSLAM_SAMPLES_PER_CLASSIFIER + 4 * BSLAM_NEGATIVES_MAX + (BSLAM_SAMPLE_FLOAT ? 288 : 144))
/// And one training under way for all.
#define BSLAM_SIZE_TRAINING \
    (848 + (BSLAM_SAMPLE_FLOAT ? 288 : 144) + BSLAM_SIZE_SAMPLES + \
     14 * (BSLAM_SAMPLES_PER_CLASSIFIER + BSLAM_NEGATIVES_MAX))
#define BSLAM_SIZE_APPEARANCE \
    (BSLAM_APPEARANCE * (BSLAM_BEACONS_MAX * 52 + BSLAM_LEARNER_SLOTS * BSLAM_SIZE_CLASSIFIER + \
                         BSLAM_SIZE_SAMPLES * BSLAM_SIZE_SAMPLE + BSLAM_SIZE_TRAINING + 104))

/// The smoother: two filters, and the nodes of the path.
#define BSLAM_SIZE_SMOOTHER \
    (BSLAM_SMOOTHER * \
     (2 * BSLAM_SIZE_EKF + BSLAM_SIZE_SETTINGS + 2 * BSLAM_SIZE_STATE * BSLAM_SIZE_REAL + \
      BSLAM_SMOOTHER_NODES_MAX * ((BSLAM_REAL_DOUBLE ? 24 : 20) + 11 * BSLAM_SIZE_REAL) + \
      BSLAM_SMOOTHER_SEEN_MAX * 4 + (BSLAM_SMOOTHER_NODES_MAX + 19) / 20 * 25 * BSLAM_SIZE_REAL + \
      20 * 35 * BSLAM_SIZE_REAL + \
      BSLAM_BEACONS_MAX * ((BSLAM_REAL_DOUBLE ? 24 : 20) + 8 * BSLAM_SIZE_REAL) + 42 * BSLAM_SIZE_REAL + \
      96))

/// Hypotheses besides the one in force: a filter each, what it knows of its beacons, and costs.
#define BSLAM_SIZE_DOUBTS \
    ((BSLAM_HYPOTHESES_MAX - 1) * (BSLAM_SIZE_EKF + 52 * BSLAM_BEACONS_MAX + \
                                   (BSLAM_SIGHTINGS_MAX + 7) * BSLAM_SIZE_REAL + BSLAM_SIGHTINGS_MAX + 16) + \
     8)

#define BSLAM_BYTES \
    ((BSLAM_SIZE_PIPELINE + BSLAM_SIZE_DOUBTS + BSLAM_SIZE_RECOVERY + BSLAM_SIZE_GUARD + \
      BSLAM_SIZE_APPEARANCE + BSLAM_SIZE_SMOOTHER + 39) / \
     8 * 8)

/// Differs where sizes do, so that library and application notice: bslam_init.
#define BSLAM_SIZES_MIX(hash, value) ((hash) * 16777619u + (value))
#define BSLAM_SIZES_FEW \
    BSLAM_SIZES_MIX( \
        BSLAM_SIZES_MIX(BSLAM_SIZES_MIX(BSLAM_SIZES_MIX(BSLAM_SIZES_MIX(2166136261u, BSLAM_REAL_DOUBLE), \
                                                        BSLAM_SIGHTINGS_MAX), \
                                        BSLAM_BEACONS_MAX), \
                        BSLAM_RAYS_MAX), \
        BSLAM_HISTORY_MAX)
#define BSLAM_SIZES_HASH \
    BSLAM_SIZES_MIX( \
        BSLAM_SIZES_MIX( \
            BSLAM_SIZES_MIX(BSLAM_SIZES_MIX(BSLAM_SIZES_MIX(BSLAM_SIZES_FEW, BSLAM_RECOVERY), BSLAM_GUARD), \
                            BSLAM_APPEARANCE *BSLAM_SAMPLES_PER_CLASSIFIER + 64 * BSLAM_HYPOTHESES_MAX), \
            BSLAM_APPEARANCE *BSLAM_NEGATIVES_MAX), \
        BSLAM_SMOOTHER *BSLAM_SMOOTHER_NODES_MAX)

#endif
