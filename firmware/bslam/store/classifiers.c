#include "bslam/store/classifiers.h"

#include <string.h>

#define SEED 0xffu

/// 8-bit samples and 16-bit weights, whatever this build keeps.
static int8_t to_byte(bslam_stored_t q)
{
    const float scaled = (float)q * (BSLAM_SAMPLE_UNIT * 127.0f);
    return (int8_t)(scaled + (scaled < 0.0f ? -0.5f : 0.5f));
}

static bslam_stored_t from_byte(int8_t byte)
{
    return (bslam_stored_t)((float)byte / (BSLAM_SAMPLE_UNIT * 127.0f));
}

static void move_sample(bslam_codec_t *codec, bslam_sample_t *sample)
{
    int8_t bytes[BSLAM_SAMPLE_FEATURES];
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        bytes[k] = to_byte(sample->q[k]);
    }
    bslam_codec_bytes(codec, bytes, sizeof bytes);
    *sample = (bslam_sample_t){{0}};
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        sample->q[k] = from_byte(bytes[k]);
        bslam_codec_require(codec, bytes[k] >= -127, BSLAM_MAP_CONTENT);
    }
    sample->q[BSLAM_SAMPLE_FEATURES] = from_byte(127);
}

#if BSLAM_SAMPLE_FLOAT
/// The unit and the 16-bit weights that come nearest, for samples in units of 1/127.
static float weights_to_words(const bslam_weights_t *weights, int16_t words[BSLAM_SAMPLE_SIZE])
{
    return weights->unit * bslam_weights_to_words(weights->w, words) / (32767.0f * 127.0f);
}

static void words_to_weights(float unit, const int16_t words[BSLAM_SAMPLE_SIZE], bslam_weights_t *weights)
{
    *weights = (bslam_weights_t){.unit = 1.0f};
    for (int k = 0; k < BSLAM_SAMPLE_SIZE; k++) {
        weights->w[k] = unit * 127.0f * (float)words[k];
    }
}
#else
static float weights_to_words(const bslam_weights_t *weights, int16_t words[BSLAM_SAMPLE_SIZE])
{
    memcpy(words, weights->w, BSLAM_SAMPLE_SIZE * sizeof words[0]);
    return weights->unit;
}

static void words_to_weights(float unit, const int16_t words[BSLAM_SAMPLE_SIZE], bslam_weights_t *weights)
{
    *weights = (bslam_weights_t){.unit = unit};
    memcpy(weights->w, words, BSLAM_SAMPLE_SIZE * sizeof words[0]);
}
#endif

static void move_weights(bslam_codec_t *codec, bslam_weights_t *weights)
{
    int16_t words[BSLAM_SAMPLE_SIZE];
    const float unit = bslam_codec_float(codec, weights_to_words(weights, words));
    for (int k = 0; k < BSLAM_SAMPLE_SIZE; k++) {
        words[k] = (int16_t)(uint16_t)bslam_codec_whole(codec, (uint16_t)words[k], 2);
    }
    bslam_codec_require(codec, unit >= 0.0f, BSLAM_MAP_CONTENT);
    words_to_weights(unit, words, weights);
}

bool bslam_map_owns(const bslam_slam_t *slam, int32_t slot)
{
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        if (bslam_map_saves(&slam->ekf, b) && slam->appearance->of[b].classifier == slot) {
            return true;
        }
    }
    return false;
}

uint32_t bslam_map_classifier_number(const bslam_slam_t *slam, int32_t slot)
{
    if (slot < 0 || !bslam_map_owns(slam, slot)) {
        return BSLAM_MAP_NO_CLASSIFIER;
    }
    uint32_t number = 0;
    for (int32_t s = 0; s < slot; s++) {
        number += bslam_map_owns(slam, s) ? 1u : 0u;
    }
    return number;
}

/// A competitor as the blob names it: classifier << 8 | sample, or SEED << 8 | seed. False: it is not saved.
static bool name_negative(const bslam_slam_t *slam, uint16_t sample, uint32_t *name)
{
    const int32_t own = BSLAM_LEARNER_SLOTS * BSLAM_SAMPLES_PER_CLASSIFIER;
    if (sample >= own) {
        *name = SEED << 8 | (uint32_t)(sample - own);
        return true;
    }
    const uint32_t classifier = bslam_map_classifier_number(slam, sample / BSLAM_SAMPLES_PER_CLASSIFIER);
    *name = classifier << 8 | (uint32_t)(sample % BSLAM_SAMPLES_PER_CLASSIFIER);
    return classifier != BSLAM_MAP_NO_CLASSIFIER;
}

static uint32_t saved_negatives(const bslam_slam_t *slam, const bslam_classifier_t *classifier)
{
    uint32_t count = 0;
    uint32_t unused;
    for (int r = 0; r < classifier->negatives; r++) {
        count += name_negative(slam, classifier->negative[r], &unused) ? 1u : 0u;
    }
    return count;
}

void bslam_map_write_classifier(bslam_codec_t *codec, const bslam_slam_t *slam, int32_t slot)
{
    const bslam_learner_t *learner = &slam->appearance->learner;
    const bslam_classifier_t *classifier = &learner->classifiers[slot];
    (void)bslam_codec_whole(codec, classifier->samples, 1);
    (void)bslam_codec_whole(codec, classifier->trained ? 1 : 0, 1);
    (void)bslam_codec_whole(codec, saved_negatives(slam, classifier), 2);
    bslam_weights_t weights = classifier->weights;
    move_weights(codec, &weights);
    for (int s = 0; s < classifier->samples; s++) {
        bslam_sample_t sample = learner->samples[slot * BSLAM_SAMPLES_PER_CLASSIFIER + s];
        move_sample(codec, &sample);
        (void)bslam_codec_whole(codec, classifier->own_alpha[s], 2);
    }
    for (int r = 0; r < classifier->negatives; r++) {
        uint32_t name;
        if (name_negative(slam, classifier->negative[r], &name)) {
            (void)bslam_codec_whole(codec, name, 2);
            (void)bslam_codec_whole(codec, classifier->negative_alpha[r], 2);
        }
    }
}

/// Samples that each classifier has, and the first that nobody may name, to be held against each other.
typedef struct named {
    uint8_t samples[BSLAM_LEARNER_SLOTS];
    uint8_t end[BSLAM_LEARNER_SLOTS];
} named_t;

static void read_negative(bslam_codec_t *codec, uint32_t classifiers, named_t *named,
                          bslam_learner_t *learner, bslam_classifier_t *classifier)
{
    const uint32_t name = bslam_codec_whole(codec, 0, 2);
    const uint32_t alpha = bslam_codec_whole(codec, 0, 2);
    const uint32_t owner = name >> 8;
    const uint32_t place = name & 0xffu;
    const bool is_seed = owner == SEED;
    bslam_codec_require(codec, is_seed ? place < BSLAM_SEEDS_MAX : owner < classifiers && place < UINT8_MAX,
                        BSLAM_MAP_CONTENT);
    if (codec->fault != BSLAM_MAP_FINE) {
        return;
    }
    if (!is_seed && place >= named->end[owner]) {
        named->end[owner] = (uint8_t)(place + 1);
    }
    // A robot with fewer seeds trains without those it does not have.
    if (classifier != NULL && (!is_seed || (int32_t)place < learner->seed_count)) {
        const uint32_t first = is_seed ? BSLAM_LEARNER_SLOTS : owner;
        classifier->negative[classifier->negatives] =
            (uint16_t)(first * BSLAM_SAMPLES_PER_CLASSIFIER + place);
        classifier->negative_alpha[classifier->negatives] = (uint16_t)alpha;
        classifier->negatives++;
    }
}

static void read_classifier(bslam_codec_t *codec, uint32_t classifiers, named_t *named, uint32_t slot,
                            bslam_learner_t *learner)
{
    bslam_classifier_t *classifier = learner != NULL ? &learner->classifiers[slot] : NULL;
    const uint32_t samples = bslam_codec_whole(codec, 0, 1);
    const uint32_t trained = bslam_codec_whole(codec, 0, 1);
    const uint32_t negatives = bslam_codec_whole(codec, 0, 2);
    bslam_codec_require(codec, samples <= BSLAM_SAMPLES_PER_CLASSIFIER && negatives <= BSLAM_NEGATIVES_MAX,
                        BSLAM_MAP_CLASSIFIERS);
    bslam_codec_require(codec, trained <= 1, BSLAM_MAP_CONTENT);
    bslam_weights_t weights = {0};
    move_weights(codec, &weights);
    if (codec->fault != BSLAM_MAP_FINE) {
        return;
    }
    named->samples[slot] = (uint8_t)samples;
    if (classifier != NULL) {
        classifier->used = true;
        classifier->trained = trained != 0;
        classifier->samples = (uint8_t)samples;
        classifier->weights = weights;
    }
    for (uint32_t s = 0; s < samples && codec->fault == BSLAM_MAP_FINE; s++) {
        bslam_sample_t sample = {{0}};
        move_sample(codec, &sample);
        const uint32_t alpha = bslam_codec_whole(codec, 0, 2);
        if (classifier != NULL) {
            learner->samples[slot * BSLAM_SAMPLES_PER_CLASSIFIER + s] = sample;
            classifier->own_alpha[s] = (uint16_t)alpha;
        }
    }
    for (uint32_t r = 0; r < negatives && codec->fault == BSLAM_MAP_FINE; r++) {
        read_negative(codec, classifiers, named, learner, classifier);
    }
}

void bslam_map_read_classifiers(bslam_codec_t *codec, uint32_t classifiers, bslam_learner_t *learner)
{
    named_t named = {{0}, {0}};
    for (uint32_t m = 0; m < classifiers && codec->fault == BSLAM_MAP_FINE; m++) {
        read_classifier(codec, classifiers, &named, m, learner);
    }
    for (uint32_t m = 0; m < classifiers && codec->fault == BSLAM_MAP_FINE; m++) {
        bslam_codec_require(codec, named.end[m] <= named.samples[m], BSLAM_MAP_CONTENT);
    }
}
