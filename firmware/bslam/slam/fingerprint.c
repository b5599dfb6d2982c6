#include "bslam/slam/fingerprint.h"

#include <string.h>

#include "bslam/slam/doubt.h"

static const uint64_t FNV_PRIME = 0x100000001b3u;

static uint64_t add_word(uint64_t hash, uint32_t word)
{
    return (hash ^ word) * FNV_PRIME;
}

/// A multiple of four bytes. Not to be inlined: one loop, not one for each that is added.
__attribute__((noinline)) static uint64_t add_words(uint64_t hash, const void *from, size_t size)
{
    const uint8_t *bytes = from;
    for (size_t at = 0; at < size; at += sizeof(uint32_t)) {
        uint32_t word;
        memcpy(&word, &bytes[at], sizeof word);
        hash = add_word(hash, word);
    }
    return hash;
}

static uint64_t add_state(uint64_t hash, const bslam_ekf_t *ekf)
{
    const bslam_factor_t *factor = &ekf->factor;
    hash = add_word(hash, (uint32_t)ekf->dim);
    hash = add_words(hash, ekf->mean, (size_t)ekf->dim * sizeof ekf->mean[0]);
    const size_t tail_at = (size_t)bslam_factor_tail_at(factor), places = tail_at + 4;
    hash = add_words(hash, factor->d, places * sizeof factor->d[0]);
    hash = add_words(hash, factor->tail, 4 * places * sizeof factor->tail[0]);
    return add_words(hash, factor->body, bslam_factor_block_at((int)tail_at) * sizeof factor->body[0]);
}

static uint64_t add_classifiers(uint64_t hash, const bslam_learner_t *learner)
{
    for (uint32_t m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        const bslam_classifier_t *classifier = &learner->classifiers[m];
        if (classifier->used && classifier->trained) {
            hash = add_word(hash, m);
            hash = add_words(hash, &classifier->weights, sizeof classifier->weights);
        }
    }
    return hash;
}

/// What the smoother keeps: where its window begins, and what was read and seen since.
static uint64_t add_smoother(uint64_t hash, const bslam_smoother_t *smoother)
{
    hash = add_state(hash, &smoother->base);
    hash = add_words(hash, smoother->place, (size_t)smoother->base.dim * sizeof smoother->place[0]);
    hash = add_words(hash, &smoother->base_stand, sizeof smoother->base_stand);
    for (int n = 0; n < smoother->node_count; n++) {
        const bslam_smoother_node_t *node =
            &smoother->nodes[(smoother->first_node + n) % BSLAM_SMOOTHER_NODES_MAX];
        hash = add_words(hash, node->at, sizeof node->at);
        hash = add_words(hash, &node->motion, sizeof node->motion);
        hash = add_word(hash, (uint32_t)node->seen);
        hash = add_word(hash, (uint32_t)node->turned);
        hash = add_word(hash, (uint32_t)node->stretched);
        hash = add_word(hash, 2u * node->doubt + (node->stands ? 1u : 0u));
    }
    for (int s = 0; s < smoother->seen_count; s++) {
        const int at = (smoother->first_seen + s) % BSLAM_SMOOTHER_SEEN_MAX;
        hash = add_words(hash, &smoother->seen[at], sizeof smoother->seen[at]);
    }
    return add_word(hash, smoother->cycles);
}

uint64_t bslam_slam_fingerprint(const bslam_slam_t *slam, uint64_t before)
{
    uint64_t hash = add_state(before, &slam->ekf);
    hash = add_words(hash, &slam->misfit, sizeof slam->misfit);
    hash = add_words(hash, &slam->bearing_noise, sizeof slam->bearing_noise);
    hash = add_words(hash, &slam->range_noise, sizeof slam->range_noise);
    for (int k = 0; k < bslam_slam_doubts(slam); k++) {
        hash = add_state(hash, &slam->doubts->others[k].ekf);
        hash = add_words(hash, &slam->doubts->others[k].behind, sizeof slam->doubts->others[k].behind);
    }
    if (bslam_slam_smooths(slam)) {
        hash = add_smoother(hash, slam->smoother);
    }
    return bslam_slam_learns(slam) ? add_classifiers(hash, &slam->appearance->learner) : hash;
}
