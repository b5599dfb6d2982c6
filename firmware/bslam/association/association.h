/// Data association: which beacon does each sighting of a frame show? One signature for every method, so that
/// they plug into the same place. MATH "Data association".
#ifndef BSLAM_ASSOCIATION_ASSOCIATION_H
#define BSLAM_ASSOCIATION_ASSOCIATION_H

#include "bslam/appearance/appearance.h"
#include "bslam/ekf/ekf.h"

/// What a method decides.
typedef enum bslam_verdict {
    BSLAM_VERDICT_REJECT = 0,
    BSLAM_VERDICT_MATCH,
    BSLAM_VERDICT_NEW,
    BSLAM_VERDICT_DEFER,     ///< undecided: used for nothing
    BSLAM_VERDICT_TENTATIVE  ///< no method's: a match or a new one that says whether there is a beacon, no
                             ///< more
} bslam_verdict_t;

typedef struct bslam_match {
    bslam_verdict_t verdict;
    bslam_reason_t reason;
    int32_t beacon;            ///< index into the map for a match, else -1
    bslam_real_t distance2;    ///< to the chosen beacon in the method's own measure; negative: not computed
    bslam_real_t score;        ///< log odds of that beacon against a new one; new: of the best one
    bslam_real_t log_density;  ///< ln N(y; 0, S) given the matches before it, or the density of new ones
    bslam_real_t looks;        ///< log odds by appearance and class
    bslam_real_t lead;         ///< by how much the choice leads any other
    bool is_match;             ///< within a method: it has a beacon that it may be
    bool sure;                 ///< enough to learn from
    bool slipped;              ///< it takes a slip of the wheels to be that beacon
    bool range_used;  ///< within a frame: the distance has said where on a ray the beacon is, or does not fit
} bslam_match_t;

/// All that is known of one sighting on its way through a frame: each stage fills in its own part.
typedef struct bslam_record {
    const bslam_sighting_t *sighting;
    bslam_account_t *account;       ///< what became of it: the result
    bslam_match_t match;            ///< what association decides
    bslam_innovation_t innovation;  ///< of what is fused
} bslam_record_t;

/// Nats that a slip of the wheels costs, of which the filter knows nothing.
#define BSLAM_SLIP_NATS 5
/// In place of a beacon: a new one.
#define BSLAM_CHOICE_NEW (-1)

/// What a hypothesis may not choose: MATH "Which beacon is it".
typedef struct bslam_bar {
    int sighting, count;
    int choices[BSLAM_HYPOTHESES_MAX];
} bslam_bar_t;

/// All a method may look at.
typedef struct bslam_sighting_frame {
    const bslam_ekf_t *ekf;
    const bslam_settings_t *settings;
    const bslam_appearance_t *appearance;  ///< what the beacons look like; NULL: nobody knows
    const bslam_pose_t *mount;             ///< the sensor relative to the robot's present pose
    const bslam_sighting_t *sightings;
    int count;
    int64_t time_us;
    const bslam_bar_t *bar;  ///< by likelihood; NULL: all is allowed
    bool is_exact;           ///< densities are those given all matches before, whatever that costs
} bslam_sighting_frame_t;

/// Decides for every sighting of the frame: the match in records[0..count). A beacon is matched at most once
/// in a frame.
typedef void (*bslam_associate_fn)(const bslam_sighting_frame_t *frame, bslam_record_t *records);

/// By label: the detector knows which beacon it is. O(count * beacons).
void bslam_associate_known(const bslam_sighting_frame_t *frame, bslam_record_t *records);

/// The paper's baseline (Bailey's flowchart): far from any found feature is new, else it is the nearest one.
/// Measured in the map, or as an angle where there is no distance. O(count * beacons).
void bslam_associate_nearest(const bslam_sighting_frame_t *frame, bslam_record_t *records);

/// Mahalanobis nearest neighbour with two thresholds, match_d2 and new_d2. O(count * beacons).
void bslam_associate_mahalanobis(const bslam_sighting_frame_t *frame, bslam_record_t *records);

/// By likelihood: where a beacon is seen, given the frame's other matches, and how it looks, as far as that
/// is known. O(count * beacons), and again where a match makes others clearer.
void bslam_associate_likely(const bslam_sighting_frame_t *frame, bslam_record_t *records);

/// Joint compatibility branch and bound: the pairing that explains the most sightings together. At most
/// BSLAM_CONDITIONAL_MAX sightings are paired together, and joint_nodes choices are tried for each such
/// group.
void bslam_associate_joint(const bslam_sighting_frame_t *frame, bslam_record_t *records);

/// Whether some beacon that counts, other than one (-1: whichever), was where it should be within the last
/// `within_us`: then the robot's pose is not what is wrong. O(beacons).
bool bslam_is_placed(const bslam_ekf_t *ekf, int64_t within_us, int other_than, int64_t time_us);

/// The method that settings->association names.
bslam_associate_fn bslam_associate_method(const bslam_settings_t *settings);

#endif
