/// Every compile-time size of the estimator, in one place.
///
/// Override with -D or by naming a header in BSLAM_CONFIG_HEADER; not "config.h", which would be this one.
/// Tuning that may change at run time is not here: it stands in bslam_settings_t. `make sizes` prints what
/// each choice costs.
#ifndef BSLAM_CONFIG_H
#define BSLAM_CONFIG_H

#include "config.h"

/// Beacons that the map holds, provisional ones included. RAM grows with the square: `make sizes` prints it.
#ifndef BSLAM_BEACONS_MAX
#define BSLAM_BEACONS_MAX 20
#endif
#if BSLAM_BEACONS_MAX < 1 || BSLAM_BEACONS_MAX > 250
#error "BSLAM_BEACONS_MAX is 1 to 250"
#endif

/// Beacons that may stand in inverse-distance form at once (4 state values in place of 2): those seen in
/// direction only whose distance is not yet known. 0 saves RAM where every sighting has a distance.
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

/// Nodes that the smoother keeps, of three frames or, farther back, of 6, 12 and 24, so 232 are 95 s of 25
/// frames/s; 52 bytes each in float.
#ifndef BSLAM_SMOOTHER_NODES_MAX
#define BSLAM_SMOOTHER_NODES_MAX 232
#endif
#if BSLAM_SMOOTHER_NODES_MAX < 8 || BSLAM_SMOOTHER_NODES_MAX > 10000
#error "BSLAM_SMOOTHER_NODES_MAX is 8 to 10000"
#endif

/// Beacons seen from these nodes, all together, 4 bytes each, 8 with a distance: where they are too many, the
/// oldest nodes go. Twice BSLAM_BEACONS_MAX at least: a node's own.
#ifndef BSLAM_SMOOTHER_SEEN_MAX
#define BSLAM_SMOOTHER_SEEN_MAX (8 * BSLAM_SMOOTHER_NODES_MAX)
#endif
#if BSLAM_SMOOTHER_SEEN_MAX < 2 * BSLAM_BEACONS_MAX || BSLAM_SMOOTHER_SEEN_MAX > 100000
#error "BSLAM_SMOOTHER_SEEN_MAX is twice BSLAM_BEACONS_MAX to 100000"
#endif

/// Machines that learn to tell a beacon by its signature: one a beacon. RAM is about 1.9 KB each.
#ifndef BSLAM_LEARNER_SLOTS
#define BSLAM_LEARNER_SLOTS BSLAM_BEACONS_MAX
#endif
#if BSLAM_LEARNER_SLOTS < 1 || BSLAM_LEARNER_SLOTS > 250
#error "BSLAM_LEARNER_SLOTS is 1 to 250"
#endif

/// Signatures that a machine keeps of its beacon, 80 bytes each.
#ifndef BSLAM_SAMPLES_PER_CLASSIFIER
#define BSLAM_SAMPLES_PER_CLASSIFIER 16
#endif
#if BSLAM_SAMPLES_PER_CLASSIFIER < 2 || BSLAM_SAMPLES_PER_CLASSIFIER > 64
#error "BSLAM_SAMPLES_PER_CLASSIFIER is 2 to 64"
#endif

/// Signatures of other beacons that a training takes: the hardest. Must exceed the support vectors among
/// them, 30 to 40, or training does not settle.
#ifndef BSLAM_NEGATIVES_MAX
#define BSLAM_NEGATIVES_MAX 96
#endif
#if BSLAM_NEGATIVES_MAX < 8 || BSLAM_NEGATIVES_MAX > 1024
#error "BSLAM_NEGATIVES_MAX is 8 to 1024"
#endif

/// Dual steps of one training. A machine that has not converged by then is trained again after the others.
#ifndef BSLAM_LEARNER_STEPS_MAX
#define BSLAM_LEARNER_STEPS_MAX 220
#endif
#if BSLAM_LEARNER_STEPS_MAX < 100 || BSLAM_LEARNER_STEPS_MAX > 100000
#error "BSLAM_LEARNER_STEPS_MAX is 100 to 100000"
#endif

/// 0: bslam_settings_info has no texts of what a parameter means, which saves 4 KB of flash.
#ifndef BSLAM_SETTING_MEANINGS
#define BSLAM_SETTING_MEANINGS 1
#endif
#if BSLAM_SETTING_MEANINGS != 0 && BSLAM_SETTING_MEANINGS != 1
#error "BSLAM_SETTING_MEANINGS is 0 or 1"
#endif

/// 0: samples have 8 bits a feature. 1: float32, four times the RAM.
#ifndef BSLAM_SAMPLE_FLOAT
#define BSLAM_SAMPLE_FLOAT 0
#endif
#if BSLAM_SAMPLE_FLOAT != 0 && BSLAM_SAMPLE_FLOAT != 1
#error "BSLAM_SAMPLE_FLOAT is 0 or 1"
#endif

#endif
