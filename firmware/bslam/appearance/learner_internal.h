/// What the two files of the learner share.
#ifndef BSLAM_APPEARANCE_LEARNER_INTERNAL_H
#define BSLAM_APPEARANCE_LEARNER_INTERNAL_H

#include "bslam/appearance/learner.h"

enum {
    BSLAM_PER_CLASSIFIER = BSLAM_SAMPLES_PER_CLASSIFIER,
    BSLAM_OWN_SAMPLES = BSLAM_LEARNER_SLOTS * BSLAM_SAMPLES_PER_CLASSIFIER
};

/// Puts the training under way off, if there is one. What it has reached is kept for its next start.
void bslam_training_pause(bslam_learner_t *learner);

/// The same, if it uses one of the samples first to first + count - 1.
void bslam_training_pause_if_used(bslam_learner_t *learner, int32_t first, int32_t count);

#endif
