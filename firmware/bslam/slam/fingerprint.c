#include "bslam/slam/fingerprint.h"

#include <string.h>

static const uint64_t FNV_PRIME = 0x100000001b3u;

static uint64_t add_word(uint64_t hash, uint32_t word)
{
    return (hash ^ word) * FNV_PRIME;
}

/// A multiple of four bytes.
static uint64_t add_words(uint64_t hash, const void *from, size_t size)
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
    hash = add_word(hash, (uint32_t)ekf->dim);
    hash = add_words(hash, ekf->mean, (size_t)ekf->dim * sizeof ekf->mean[0]);
    for (int i = 0; i < ekf->dim; i++) {
        const bslam_real_t *row = &ekf->covariance[bslam_symmat_row(i)];
        hash = add_words(hash, row, (size_t)(i + 1) * sizeof row[0]);
    }
    return hash;
}

static uint64_t add_machines(uint64_t hash, const bslam_learner_t *learner)
{
    for (uint32_t m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        const bslam_machine_t *machine = &learner->machines[m];
        if (machine->used && machine->trained) {
            hash = add_word(hash, m);
            hash = add_words(hash, &machine->weights, sizeof machine->weights);
        }
    }
    return hash;
}

uint64_t bslam_slam_fingerprint(const bslam_slam_t *slam, uint64_t before)
{
    const uint64_t hash = add_state(before, &slam->ekf);
    return slam->looks != NULL ? add_machines(hash, &slam->looks->learner) : hash;
}
