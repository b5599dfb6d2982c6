/// Doubts about which beacon is seen: a few whole filters, of which each has decided otherwise. What is seen
/// next says which of them was right. MATH "Which beacon is it".
#ifndef BSLAM_SLAM_DOUBT_H
#define BSLAM_SLAM_DOUBT_H

#include "bslam/slam/slam.h"

#if BSLAM_HYPOTHESES_MAX > 1
#define BSLAM_OTHERS_MAX (BSLAM_HYPOTHESES_MAX - 1)
#else
#define BSLAM_OTHERS_MAX 1  // of what is not there
#endif

/// A hypothesis that is not in force: what it has for itself. All else of the pipeline is shared.
typedef struct bslam_hypothesis {
    bslam_ekf_t ekf;
    bslam_beacon_appearance_t of[BSLAM_BEACONS_MAX];
    bslam_real_t misfit, unseen_s;
    bslam_autocorrelation_t bearing_noise, range_noise;
    int64_t since_us;                        ///< when it parted
    bslam_real_t behind;                     ///< nats by which it explains less than the one in force
    bslam_real_t cost[BSLAM_SIGHTINGS_MAX];  ///< within a frame: of each sighting,
    bool is_new[BSLAM_SIGHTINGS_MAX];        ///< and whether it is of a new beacon
} bslam_hypothesis_t;

typedef struct bslam_doubts {
    int32_t count;  ///< hypotheses besides the one in force
    bool is_exact;  ///< within a frame: some were alive when it began, so that densities are compared
    bslam_hypothesis_t others[BSLAM_OTHERS_MAX];
} bslam_doubts_t;

/// The hypothesis in force is right, as far as one can tell: the others are forgotten. Whenever the map or
/// the pose is changed from outside.
void bslam_slam_end_doubt(bslam_slam_t *slam);

/// The one that is the farthest behind, of those that are farther than so much, is forgotten.
void bslam_slam_forget_worst(bslam_slam_t *slam, bslam_real_t behind);

/// The hypothesis in force once more; and another one in force, with that in its place. Uids are given once,
/// whoever gives them.
void bslam_hypothesis_copy(const bslam_slam_t *slam, bslam_hypothesis_t *hypothesis);
void bslam_hypothesis_exchange(bslam_slam_t *slam, bslam_hypothesis_t *hypothesis);

/// Whether hypotheses share the classifiers may have changed.
void bslam_hypotheses_share(bslam_slam_t *slam);

/// How many hypotheses there are besides the one in force.
int bslam_slam_doubts(const bslam_slam_t *slam);

/// By how many nats the one in force explains more than the next best; 0 where there is no other.
bslam_real_t bslam_slam_lead(const bslam_slam_t *slam);

#endif
