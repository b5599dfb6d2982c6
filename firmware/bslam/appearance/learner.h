/// Linear support vector machines that learn on the robot: each tells one beacon from all others by its
/// signature. MATH "The learner".
///
/// A classifier keeps a few signatures of its beacon. Its training sets them against the hardest of all other
/// classifiers' samples and of seeds, and starts from its last solution. Training is cut into pieces of
/// bounded time, so that a control loop keeps its deadline. Beacons that look the same may share one
/// classifier.
#ifndef BSLAM_APPEARANCE_LEARNER_H
#define BSLAM_APPEARANCE_LEARNER_H

#include <stdbool.h>
#include <stdint.h>

#include "bslam/bslam.h"
#include "bslam/config.h"
#include "base/status.h"
#include "bslam/appearance/sample.h"
#include "bslam/appearance/solver.h"

/// One classifier.
typedef struct bslam_classifier {
    bool used;
    bool trained;
    bool waiting;        ///< for a training
    uint8_t again;       ///< how many more trainings it may ask for itself, if one does not converge
    uint8_t turn;        ///< which part of the other classifiers the next training looks through
    uint8_t samples;     ///< how many it keeps
    uint16_t negatives;  ///< length of competitor[]
    uint16_t own_alpha[BSLAM_SAMPLES_PER_CLASSIFIER];  ///< dual variables, in units of BSLAM_ALPHA_UNIT
    uint16_t negative[BSLAM_NEGATIVES_MAX];            ///< samples inside its margin, by number
    uint16_t negative_alpha[BSLAM_NEGATIVES_MAX];
    bslam_weights_t weights;
} bslam_classifier_t;

/// Where a training stands.
typedef enum bslam_stage {
    BSLAM_STAGE_IDLE = 0,
    BSLAM_STAGE_SCAN,    ///< how hard is each sample of the others?
    BSLAM_STAGE_RECALL,  ///< the classifier's samples and its list become the solver's rows,
    BSLAM_STAGE_CHOOSE,  ///< and the hardest of the others
    BSLAM_STAGE_SOLVE
} bslam_stage_t;

#define BSLAM_BINS 160

/// The training under way.
typedef struct bslam_training {
    bslam_stage_t stage;
    int32_t classifier;  ///< in training, or trained last
    int32_t
        first_block;  ///< samples are looked at in blocks, those of a classifier or as many seeds: this one,
    int32_t block_step;          ///< and each so-manieth after it
    int32_t block;               ///< next
    int32_t own_recalled;        ///< samples of the classifier that are rows
    int32_t negatives_recalled;  ///< and of its list
    int32_t hard;                ///< samples in this bin and above become rows,
    int32_t spare;               ///< and so many of the bin below
    int32_t steps_left;
    bslam_weights_t rank;  ///< says how hard a sample is
    uint16_t histogram[BSLAM_BINS];
    uint8_t bins[BSLAM_LEARNER_SLOTS * BSLAM_SAMPLES_PER_CLASSIFIER + BSLAM_SEEDS_MAX];
    bslam_solver_t solver;
} bslam_training_t;

typedef struct bslam_learner {
    bslam_learner_counters_t counters;
    const bslam_sample_t *seeds;
    int32_t seed_count;
    bslam_classifier_t classifiers[BSLAM_LEARNER_SLOTS];
    bslam_sample_t samples[BSLAM_LEARNER_SLOTS * BSLAM_SAMPLES_PER_CLASSIFIER];
    bslam_training_t training;
} bslam_learner_t;

/// Starts empty. Seeds are signatures of things that are no beacon here; they make a classifier useful from
/// its first sample. BSLAM_E_COUNT: fewer than 0 or more than BSLAM_SEEDS_MAX.
BSLAM_MUST_CHECK bslam_status_t bslam_learner_init(bslam_learner_t *learner, const bslam_sample_t *seeds,
                                                   int32_t seed_count);

/// A new classifier's handle. BSLAM_E_MAP_FULL: no slot is free.
BSLAM_MUST_CHECK bslam_status_t bslam_learner_add(bslam_learner_t *learner, int32_t *classifier);

/// Forgets a classifier and its samples, in training or not. BSLAM_E_NO_BEACON.
BSLAM_MUST_CHECK bslam_status_t bslam_learner_remove(bslam_learner_t *learner, int32_t classifier);

/// Shows a signature of the classifier's beacon: keeps it and asks for a training, of this classifier and of
/// any other that takes the signature for its own. A full store has no use for a signature beyond the margin;
/// any other takes the place of the sample that matters least. BSLAM_E_NO_BEACON, BSLAM_E_NOT_FINITE.
/// O(classifiers).
BSLAM_MUST_CHECK bslam_status_t bslam_learner_show(bslam_learner_t *learner, int32_t classifier,
                                                   const float signature[BSLAM_SAMPLE_FEATURES]);

/// Goes on with the training under way, or begins the next one asked for: at most `budget` pieces, of which
/// each is a dual step, or a look at BSLAM_SAMPLES_PER_CLASSIFIER samples. True if work is left.
bool bslam_learner_work(bslam_learner_t *learner, int32_t budget);

/// True if a classifier has been trained with competitors: its decision values mean something.
bool bslam_learner_knows(const bslam_learner_t *learner, int32_t classifier);

/// Samples that a classifier keeps; 0 if there is no such classifier.
int32_t bslam_learner_samples(const bslam_learner_t *learner, int32_t classifier);

#endif
