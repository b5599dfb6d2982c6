#include "bslam/appearance/learner_internal.h"

#include "base/bounds.h"

#include <string.h>

// Trainings that a classifier may ask for itself when its steps did not suffice.
enum { AGAIN = 20 };

static bool exists(const bslam_learner_t *learner, int32_t classifier)
{
    return classifier >= 0 && classifier < BSLAM_LEARNER_SLOTS && learner->classifiers[classifier].used;
}

// ---- classifiers
// ---------------------------------------------------------------------------------------------

bslam_status_t bslam_learner_init(bslam_learner_t *learner, const bslam_sample_t *seeds, int32_t seed_count)
{
    if (seed_count < 0 || seed_count > BSLAM_SEEDS_MAX) {
        return BSLAM_E_COUNT;
    }
    memset(learner, 0, sizeof *learner);
    learner->seeds = seeds;
    learner->seed_count = seed_count;
    return BSLAM_OK;
}

bslam_status_t bslam_learner_add(bslam_learner_t *learner, int32_t *classifier)
{
    for (int32_t m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        if (!learner->classifiers[m].used) {
            learner->classifiers[m].used = true;
            *classifier = m;
            return BSLAM_OK;
        }
    }
    learner->counters.refused_full++;
    return BSLAM_E_MAP_FULL;
}

/// Takes samples that are gone out of a classifier's list.
static void strike(bslam_classifier_t *classifier, int32_t first, int32_t count)
{
    uint16_t kept = 0;
    for (int32_t i = 0; i < classifier->negatives; i++) {
        const uint16_t sample = classifier->negative[i];
        if (sample < first || sample >= first + count) {
            classifier->negative[kept] = sample;
            classifier->negative_alpha[kept] = classifier->negative_alpha[i];
            kept++;
        }
    }
    classifier->negatives = kept;
}

bslam_status_t bslam_learner_remove(bslam_learner_t *learner, int32_t classifier)
{
    if (!exists(learner, classifier)) {
        learner->counters.refused_no_machine++;
        return BSLAM_E_NO_BEACON;
    }
    if (learner->training.classifier == classifier) {
        bslam_training_pause(learner);
    }
    bslam_training_pause_if_used(learner, classifier * BSLAM_PER_CLASSIFIER, BSLAM_PER_CLASSIFIER);
    memset(&learner->classifiers[classifier], 0, sizeof learner->classifiers[classifier]);
    for (int32_t m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        strike(&learner->classifiers[m], classifier * BSLAM_PER_CLASSIFIER, BSLAM_PER_CLASSIFIER);
    }
    return BSLAM_OK;
}

// ---- samples ----------------------------------------------------------------------------------------------

/// Which of a full store matters least: the one with the smallest dual variable, of equals the nearest to the
/// new sample.
static int32_t least(const bslam_learner_t *learner, int32_t classifier, const bslam_sample_t *fresh)
{
    const uint16_t *alpha = learner->classifiers[classifier].own_alpha;
    const bslam_sample_t *samples = &learner->samples[classifier * BSLAM_PER_CLASSIFIER];
    uint16_t smallest = UINT16_MAX;
    for (int32_t i = 0; i < BSLAM_PER_CLASSIFIER; i++) {
        smallest = alpha[i] < smallest ? alpha[i] : smallest;
    }
    int32_t best = -1;
    float best_distance2 = 0.0f;
    for (int32_t i = 0; i < BSLAM_PER_CLASSIFIER; i++) {
        if (alpha[i] == smallest) {
            const float distance2 = bslam_sample_distance2(&samples[i], fresh);
            if (best < 0 || distance2 < best_distance2) {
                best = i;
                best_distance2 = distance2;
            }
        }
    }
    return best;
}

/// Puts a sample on a classifier's list, if it is not there; on a full one in place of what matters least.
static void list_negative(bslam_classifier_t *classifier, int32_t sample)
{
    int32_t place = 0;
    for (int32_t i = 0; i < classifier->negatives; i++) {
        if (classifier->negative[i] == sample) {
            return;
        }
        place = classifier->negative_alpha[i] < classifier->negative_alpha[place] ? i : place;
    }
    if (classifier->negatives < BSLAM_NEGATIVES_MAX) {
        place = classifier->negatives;
        classifier->negatives++;
    }
    classifier->negative[place] = (uint16_t)sample;
    classifier->negative_alpha[place] = 0;
}

static void ask_for_training(bslam_classifier_t *classifier)
{
    classifier->waiting = true;
    classifier->again = AGAIN;
}

/// Tells the other classifiers of a new sample: one that has it inside its margin will train with it, one
/// that takes it for its own asks for a training.
static void warn_others(bslam_learner_t *learner, int32_t classifier, int32_t sample)
{
    for (int32_t m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        bslam_classifier_t *other = &learner->classifiers[m];
        if (m == classifier || !other->trained) {
            continue;
        }
        const float value = bslam_sample_decide(&other->weights, &learner->samples[sample]);
        if (value > -1.0f) {
            if (m == learner->training.classifier) {
                bslam_training_pause(learner);
            }
            list_negative(other, sample);
            if (value > 0.0f) {
                ask_for_training(other);
            }
        }
    }
}

bslam_status_t bslam_learner_show(bslam_learner_t *learner, int32_t classifier,
                                  const float signature[BSLAM_SAMPLE_FEATURES])
{
    if (!exists(learner, classifier)) {
        learner->counters.refused_no_machine++;
        return BSLAM_E_NO_BEACON;
    }
    bslam_sample_t fresh;
    const bslam_status_t status = bslam_sample_encode(signature, &fresh);
    if (status != BSLAM_OK) {
        learner->counters.refused_not_finite++;
        return status;
    }
    bslam_classifier_t *m = &learner->classifiers[classifier];
    int32_t place = m->samples;
    if (place == BSLAM_PER_CLASSIFIER) {
        if (m->trained && bslam_sample_decide(&m->weights, &fresh) >= 1.0f) {
            learner->counters.dropped++;
            return BSLAM_OK;
        }
        place = least(learner, classifier, &fresh);
        bslam_training_pause_if_used(learner, classifier * BSLAM_PER_CLASSIFIER + place, 1);
    } else {
        m->samples++;
    }
    learner->samples[classifier * BSLAM_PER_CLASSIFIER + place] = fresh;
    m->own_alpha[place] = 0;
    ask_for_training(m);
    learner->counters.kept++;
    warn_others(learner, classifier, classifier * BSLAM_PER_CLASSIFIER + place);
    return BSLAM_OK;
}

int32_t bslam_learner_samples(const bslam_learner_t *learner, int32_t classifier)
{
    return exists(learner, classifier) ? learner->classifiers[classifier].samples : 0;
}

bool bslam_learner_knows(const bslam_learner_t *learner, int32_t classifier)
{
    return exists(learner, classifier) && learner->classifiers[classifier].trained &&
           learner->classifiers[classifier].negatives > 0;
}
