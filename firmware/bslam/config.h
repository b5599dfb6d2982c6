/// Every compile-time size of the estimator, and what it has. How to override one: base/config.h.
///
/// What may change at run time is not here: it stands in bslam_settings_t. `make sizes` prints what each
/// choice costs.
#ifndef BSLAM_CONFIG_H
#define BSLAM_CONFIG_H

#include "base/config.h"

/// Beacons that the map holds, tentative ones included. RAM grows with the square: `make sizes` prints it.
#ifndef BSLAM_BEACONS_MAX
#define BSLAM_BEACONS_MAX 20
#endif
#if BSLAM_BEACONS_MAX < 1 || BSLAM_BEACONS_MAX > 250
#error "BSLAM_BEACONS_MAX is 1 to 250"
#endif

/// Beacons that may stand in inverse-distance form at once (4 state values in place of 2): bearing-only ones
/// whose distance is not yet known. 0 saves RAM where every sighting has a distance.
#ifndef BSLAM_RAYS_MAX
#define BSLAM_RAYS_MAX (BSLAM_BEACONS_MAX < 6 ? BSLAM_BEACONS_MAX : 6)
#endif
#if BSLAM_RAYS_MAX < 0 || BSLAM_RAYS_MAX > BSLAM_BEACONS_MAX
#error "BSLAM_RAYS_MAX is 0 to BSLAM_BEACONS_MAX"
#endif

/// Odometry readings that may wait for the next frame: so much older than the newest one a frame may be (24
/// bytes each in float). At 25 readings/s the default reaches 0.6 s back.
#ifndef BSLAM_HISTORY_MAX
#define BSLAM_HISTORY_MAX 16
#endif
#if BSLAM_HISTORY_MAX < 1 || BSLAM_HISTORY_MAX > 1024
#error "BSLAM_HISTORY_MAX is 1 to 1024"
#endif

/// 1: the robot notices that it is lost, and finds itself again (setting `recovery`). 1.3 KB of RAM.
#ifndef BSLAM_RECOVERY
#define BSLAM_RECOVERY 1
#endif
#if BSLAM_RECOVERY != 0 && BSLAM_RECOVERY != 1
#error "BSLAM_RECOVERY is 0 or 1"
#endif

/// 1: damaged memory is noticed (setting `guard`); twice a call, five instructions a word of what is watched.
/// 2: and a copy of the pipeline is kept, to go back to.
#ifndef BSLAM_GUARD
#define BSLAM_GUARD 1
#endif
#if BSLAM_GUARD < 0 || BSLAM_GUARD > 2
#error "BSLAM_GUARD is 0, 1 or 2"
#endif

/// 1: each beacon has a classifier that learns its appearance (setting `association` = 3). 1.9 KB of RAM
/// each.
#ifndef BSLAM_APPEARANCE
#define BSLAM_APPEARANCE 0
#endif
#if BSLAM_APPEARANCE != 0 && BSLAM_APPEARANCE != 1
#error "BSLAM_APPEARANCE is 0 or 1"
#endif

/// Hypotheses that may be followed at once while it is in doubt which beacon is seen (setting `hypotheses`):
/// a filter each. 1: what is decided once stands.
#ifndef BSLAM_HYPOTHESES_MAX
#define BSLAM_HYPOTHESES_MAX (BSLAM_APPEARANCE ? 2 : 1)
#endif
#if BSLAM_HYPOTHESES_MAX < 1 || BSLAM_HYPOTHESES_MAX > 8
#error "BSLAM_HYPOTHESES_MAX is 1 to 8"
#endif

/// 1: the bearing-only smoother (setting `filter` = 2).
#ifndef BSLAM_SMOOTHER
#define BSLAM_SMOOTHER 0
#endif
#if BSLAM_SMOOTHER != 0 && BSLAM_SMOOTHER != 1
#error "BSLAM_SMOOTHER is 0 or 1"
#endif

/// Nodes that the smoother keeps, of three frames or, farther back, of 6, 12 and 24, so 232 are 95 s of 25
/// frames/s; 52 bytes each in float, and 32 for what is seen from it.
#ifndef BSLAM_SMOOTHER_NODES_MAX
#define BSLAM_SMOOTHER_NODES_MAX 232
#endif
#if BSLAM_SMOOTHER_NODES_MAX < 8 || BSLAM_SMOOTHER_NODES_MAX > 10000
#error "BSLAM_SMOOTHER_NODES_MAX is 8 to 10000"
#endif

/// 0: bslam_settings_info has no texts of what a setting means, which saves 5 KB of flash.
#ifndef BSLAM_SETTING_MEANINGS
#define BSLAM_SETTING_MEANINGS 1
#endif
#if BSLAM_SETTING_MEANINGS != 0 && BSLAM_SETTING_MEANINGS != 1
#error "BSLAM_SETTING_MEANINGS is 0 or 1"
#endif

// ---- what follows from these: only the tests set them otherwise -------------------------------------------

/// Beacons seen from the smoother's nodes, all together: where they are too many, the oldest nodes go.
#ifndef BSLAM_SMOOTHER_SEEN_MAX
#define BSLAM_SMOOTHER_SEEN_MAX (8 * BSLAM_SMOOTHER_NODES_MAX)
#endif
#if BSLAM_SMOOTHER_SEEN_MAX < 2 * BSLAM_BEACONS_MAX
#error "BSLAM_SMOOTHER_NODES_MAX is a quarter of BSLAM_BEACONS_MAX at least"
#endif

/// Signatures that a classifier keeps of its beacon, 80 bytes each.
#ifndef BSLAM_SAMPLES_PER_CLASSIFIER
#define BSLAM_SAMPLES_PER_CLASSIFIER 16
#endif
#if BSLAM_SAMPLES_PER_CLASSIFIER < 2 || BSLAM_SAMPLES_PER_CLASSIFIER > 64
#error "BSLAM_SAMPLES_PER_CLASSIFIER is 2 to 64"
#endif

/// One classifier a beacon.
#ifndef BSLAM_LEARNER_SLOTS
#define BSLAM_LEARNER_SLOTS BSLAM_BEACONS_MAX
#endif

/// Signatures of other beacons that a training takes: the hardest. Must exceed the support vectors among
/// them, 30 to 40, or training does not settle.
#ifndef BSLAM_NEGATIVES_MAX
#define BSLAM_NEGATIVES_MAX 96
#endif

/// Samples have 8 bits a feature; float32 in the double-precision build, four times the RAM.
#define BSLAM_SAMPLE_FLOAT BSLAM_REAL_DOUBLE

#endif
