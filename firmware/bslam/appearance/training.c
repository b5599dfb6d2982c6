#include "bslam/appearance/learner_internal.h"

#include "base/bounds.h"

#include <string.h>

// A tolerance of 0.2 costs no decisions, 0.7 some.
static const float COST = 10.0f;
static const float TOLERANCE = 0.2f;

// Dual variables between two trainings. 64, where they stop, is beyond what a solution has: 2C times a hinge.
static const float ALPHA_UNIT = 1.0f / 1024.0f;
static const float ALPHAS = 65535.0f;

// Decision values from LOWEST on fall into bins; what lies below will not become a support vector.
static const float LOWEST = -1.3f;
static const float BINS_PER_UNIT = 40.0f;

// Of one training. A classifier that has not converged by then is trained again after the others.
enum { STEPS_MAX = 220 };

enum {
    NO_NEGATIVE = 0,  // bin of what is below LOWEST, or not looked at
    HARDEST = BSLAM_BINS - 1,
    LISTED = UINT8_MAX,  // in place of a bin: on the classifier's list, a row anyhow
    // A classifier that has been trained looks through every so-manieth of the others. Samples that came
    // since its last training were listed when they came, so only those are missed that its own change made
    // hard.
    TURNS = 4
};

static bslam_classifier_t *in_training(bslam_learner_t *learner)
{
    return &learner->classifiers[learner->training.classifier];
}

// ---- putting off ------------------------------------------------------------------------------------------

static uint16_t pack_alpha(float alpha)
{
    const float units = alpha / ALPHA_UNIT + 0.5f;
    return (uint16_t)(units < ALPHAS ? (units > 0.0f ? units : 0.0f) : ALPHAS);
}

/// Keeps the dual variables for the next start; competitors at 0 only if asked.
static void keep_alphas(bslam_learner_t *learner, bool with_zeros)
{
    bslam_classifier_t *classifier = in_training(learner);
    const bslam_solver_t *solver = &learner->training.solver;
    classifier->negatives = 0;
    for (int32_t i = 0; i < solver->count; i++) {
        const bslam_solver_row_t *row = &solver->rows[i];
        const uint16_t alpha = pack_alpha(row->alpha);
        if (row->positive) {
            classifier->own_alpha[row->sample - learner->training.classifier * BSLAM_PER_CLASSIFIER] = alpha;
        } else if ((alpha > 0 || with_zeros) && classifier->negatives < BSLAM_NEGATIVES_MAX) {
            classifier->negative[classifier->negatives] = row->sample;
            classifier->negative_alpha[classifier->negatives] = alpha;
            classifier->negatives++;
        }
    }
}

void bslam_training_pause(bslam_learner_t *learner)
{
    if (learner->training.stage == BSLAM_STAGE_IDLE) {
        return;
    }
    if (learner->training.stage == BSLAM_STAGE_SOLVE) {
        keep_alphas(learner, true);
    }
    in_training(learner)->waiting = true;
    learner->training.stage = BSLAM_STAGE_IDLE;
    learner->counters.interrupted++;
}

void bslam_training_pause_if_used(bslam_learner_t *learner, int32_t first, int32_t count)
{
    const bslam_training_t *training = &learner->training;
    const bool has_rows = training->stage >= BSLAM_STAGE_RECALL;
    bool used = false;
    for (int32_t i = 0; has_rows && i < training->solver.count; i++) {
        const int32_t sample = training->solver.rows[i].sample;
        used = used || (sample >= first && sample < first + count);
    }
    if (used) {
        bslam_training_pause(learner);
    }
}

// ---- beginning --------------------------------------------------------------------------------------------

/// Weights that say how near a sample is to a classifier's first one, which they give 1; a zero sample gets
/// -1.
static void rank_by_first_sample(const bslam_sample_t *first, bslam_weights_t *rank)
{
    float q[BSLAM_SAMPLE_SIZE];
    bslam_sample_unpack(first, q);
    float length2 = 0.0f;
    for (int32_t i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        length2 += q[i] * q[i];
    }
    for (int32_t i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        q[i] *= 2.0f / length2;
    }
    q[BSLAM_SAMPLE_FEATURES] -= BSLAM_SAMPLE_UNIT;
    bslam_weights_round(q, rank);
}

/// The next classifier that waits, in turn; -1 if none does.
static int32_t next_waiting(const bslam_learner_t *learner)
{
    int32_t m = learner->training.classifier;
    for (int32_t i = 0; i < BSLAM_LEARNER_SLOTS; i++) {
        m = m + 1 < BSLAM_LEARNER_SLOTS ? m + 1 : 0;
        if (learner->classifiers[m].waiting) {
            return m;
        }
    }
    return -1;
}

static void begin(bslam_learner_t *learner, int32_t m)
{
    bslam_training_t *training = &learner->training;
    bslam_classifier_t *classifier = &learner->classifiers[m];
    classifier->waiting = false;
    training->classifier = m;
    training->stage = BSLAM_STAGE_SCAN;
    memset(training->histogram, 0, sizeof training->histogram);
    memset(training->bins, NO_NEGATIVE, sizeof training->bins);
    for (int32_t i = 0; i < classifier->negatives; i++) {
        training->bins[classifier->negative[i]] = LISTED;
    }
    if (classifier->trained) {
        classifier->turn = (uint8_t)((classifier->turn + 1) % TURNS);
        training->first_block = classifier->turn;
        training->block_step = TURNS;
        training->rank = classifier->weights;
    } else {
        training->first_block = 0;
        training->block_step = 1;
        rank_by_first_sample(&learner->samples[m * BSLAM_PER_CLASSIFIER], &training->rank);
    }
    training->block = training->first_block;
}

// ---- choosing competitors
// --------------------------------------------------------------------------------------

static int32_t block_count(const bslam_learner_t *learner)
{
    return BSLAM_LEARNER_SLOTS + (learner->seed_count + BSLAM_PER_CLASSIFIER - 1) / BSLAM_PER_CLASSIFIER;
}

/// Samples of a block that may be competitors.
static int32_t samples_in_block(const bslam_learner_t *learner, int32_t block)
{
    if (block < BSLAM_LEARNER_SLOTS) {
        return block == learner->training.classifier ? 0 : learner->classifiers[block].samples;
    }
    const int32_t left = learner->seed_count - (block - BSLAM_LEARNER_SLOTS) * BSLAM_PER_CLASSIFIER;
    return left < BSLAM_PER_CLASSIFIER ? left : BSLAM_PER_CLASSIFIER;
}

static uint8_t bin_of(float value)
{
    const float place = (value - LOWEST) * BINS_PER_UNIT;
    const float inside = place < (float)NO_NEGATIVE ? (float)NO_NEGATIVE : place;
    return (uint8_t)(inside < (float)HARDEST ? inside : (float)HARDEST);
}

/// Finds the lowest bin such that there is room for all samples from it on, and how much room is left.
static void set_limit(bslam_training_t *training, int32_t room)
{
    int32_t bin = BSLAM_BINS;
    while (bin > NO_NEGATIVE + 1 && training->histogram[bin - 1] <= room) {
        bin--;
        room -= training->histogram[bin];
    }
    training->hard = bin;
    training->spare = bin > NO_NEGATIVE + 1 ? room : 0;
}

/// One piece: sorts the samples of a block into bins.
static void scan(bslam_learner_t *learner, const bslam_samples_t *samples)
{
    bslam_training_t *training = &learner->training;
    if (training->block >= block_count(learner)) {
        set_limit(training, BSLAM_NEGATIVES_MAX - in_training(learner)->negatives);
        bslam_solver_begin(&training->solver, COST, TOLERANCE, false);
        training->stage = BSLAM_STAGE_RECALL;
        training->own_recalled = 0;
        training->negatives_recalled = 0;
        return;
    }
    const int32_t first = training->block * BSLAM_PER_CLASSIFIER;
    const int32_t end = first + samples_in_block(learner, training->block);
    for (int32_t i = first; i < end; i++) {
        if (training->bins[i] != LISTED) {
            const uint8_t bin = bin_of(bslam_sample_decide(&training->rank, bslam_sample_at(samples, i)));
            training->bins[i] = bin;
            training->histogram[bin]++;
        }
    }
    training->block += training->block_step;
}

/// One piece: makes the next of the classifier's own samples or of its list a row, with its dual variable.
static void recall(bslam_learner_t *learner, const bslam_samples_t *samples)
{
    bslam_training_t *training = &learner->training;
    const bslam_classifier_t *classifier = in_training(learner);
    if (training->own_recalled < classifier->samples) {
        const int32_t own = training->own_recalled++;
        bslam_solver_add(&training->solver, samples, training->classifier * BSLAM_PER_CLASSIFIER + own, true,
                         ALPHA_UNIT * (float)classifier->own_alpha[own]);
    } else if (training->negatives_recalled < classifier->negatives) {
        const int32_t listed = training->negatives_recalled++;
        bslam_solver_add(&training->solver, samples, classifier->negative[listed], false,
                         ALPHA_UNIT * (float)classifier->negative_alpha[listed]);
    } else {
        training->stage = BSLAM_STAGE_CHOOSE;
        training->block = training->first_block;
    }
}

/// True if a sample is among the hardest that were found.
static bool is_hard(bslam_training_t *training, int32_t sample)
{
    const int32_t bin = training->bins[sample];
    if (bin == LISTED || bin < training->hard - 1 || training->solver.count == BSLAM_SOLVER_ROWS_MAX) {
        return false;
    }
    if (bin == training->hard - 1) {
        training->spare -= training->spare >= 0 ? 1 : 0;
        return training->spare >= 0;
    }
    return true;
}

/// One piece: makes the hard samples of a block rows.
static void choose(bslam_learner_t *learner, const bslam_samples_t *samples)
{
    bslam_training_t *training = &learner->training;
    if (training->block >= block_count(learner)) {
        training->stage = BSLAM_STAGE_SOLVE;
        training->steps_left = STEPS_MAX;
        return;
    }
    const int32_t first = training->block * BSLAM_PER_CLASSIFIER;
    const int32_t end = first + samples_in_block(learner, training->block);
    for (int32_t i = first; i < end; i++) {
        if (is_hard(training, i)) {
            bslam_solver_add(&training->solver, samples, i, false, 0.0f);
        }
    }
    training->block += training->block_step;
}

// ---- solving ----------------------------------------------------------------------------------------------

/// Ends a training; one that has not converged asks for another, a few times.
static void finish(bslam_learner_t *learner, bool converged)
{
    bslam_classifier_t *classifier = in_training(learner);
    keep_alphas(learner, false);
    bslam_weights_round(learner->training.solver.weights, &classifier->weights);
    classifier->trained = true;
    if (!converged && classifier->again > 0) {
        classifier->again--;
        classifier->waiting = true;
    }
    learner->training.stage = BSLAM_STAGE_IDLE;
    learner->counters.updates++;
    learner->counters.capped += converged ? 0 : 1;
}

/// Up to `wanted` pieces, each a dual step, or the end; how many it did.
static int32_t solve(bslam_learner_t *learner, const bslam_samples_t *samples, int32_t wanted)
{
    bslam_training_t *training = &learner->training;
    const int32_t steps = wanted < training->steps_left ? wanted : training->steps_left;
    const int32_t done = bslam_solver_run(&training->solver, samples, steps);
    training->steps_left -= done;
    learner->counters.steps += (uint32_t)done;
    if (done == wanted) {
        return wanted;
    }
    finish(learner, done < steps);
    return done + 1;
}

/// As many pieces as wanted, if there is work for them; how many it did.
static int32_t work_some(bslam_learner_t *learner, const bslam_samples_t *samples, int32_t wanted)
{
    int32_t waiting;
    switch (learner->training.stage) {
    case BSLAM_STAGE_SCAN:
        scan(learner, samples);
        return 1;
    case BSLAM_STAGE_RECALL:
        recall(learner, samples);
        return 1;
    case BSLAM_STAGE_CHOOSE:
        choose(learner, samples);
        return 1;
    case BSLAM_STAGE_SOLVE:
        return solve(learner, samples, wanted);
    case BSLAM_STAGE_IDLE:
    default:
        waiting = next_waiting(learner);
        if (waiting < 0) {
            return 0;
        }
        begin(learner, waiting);
        return 1;
    }
}

bool bslam_learner_work(bslam_learner_t *learner, int32_t budget)
{
    const bslam_samples_t samples = {learner->samples, BSLAM_OWN_SAMPLES, learner->seeds,
                                     learner->seed_count};
    int32_t done = 1;
    for (int32_t left = budget; left > 0 && done > 0; left -= done) {
        done = work_some(learner, &samples, left);
    }
    return learner->training.stage != BSLAM_STAGE_IDLE || next_waiting(learner) >= 0;
}
