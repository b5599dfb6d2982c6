#include "bslam/appearance/sample.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "base/real.h"

#if BSLAM_SAMPLE_FLOAT
typedef float sum_t;
#else
typedef int32_t sum_t;  // 72 * 127 * 32767 fits
#endif

static bool is_number(float x)
{
    return x >= -1e12f && x <= 1e12f;
}

static bslam_stored_t store(float x)
{
    const float limited = x < -1.0f ? -1.0f : x > 1.0f ? 1.0f : x;
#if BSLAM_SAMPLE_FLOAT
    return limited;
#else
    return (int8_t)(limited * 127.0f + (x < 0.0f ? -0.5f : 0.5f));
#endif
}

bslam_status_t bslam_sample_encode(const float features[BSLAM_SAMPLE_FEATURES], bslam_sample_t *sample)
{
    for (int32_t i = 0; i < BSLAM_SAMPLE_FEATURES; i++) {
        if (!is_number(features[i])) {
            return BSLAM_E_NOT_FINITE;
        }
    }
    for (int32_t i = 0; i < BSLAM_SAMPLE_FEATURES; i++) {
        sample->q[i] = store(features[i]);
    }
    sample->q[BSLAM_SAMPLE_FEATURES] = store(1.0f);
    return BSLAM_OK;
}

float bslam_sample_distance2(const bslam_sample_t *a, const bslam_sample_t *b)
{
    sum_t sum = 0;
    for (int32_t i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        const sum_t difference = (sum_t)a->q[i] - (sum_t)b->q[i];
        sum += difference * difference;
    }
    return (float)sum;
}

float bslam_sample_middle_distance2(const bslam_sample_t *others, int32_t count, const bslam_sample_t *b)
{
    float squares = 0.0f;
    for (int32_t i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        float sum = 0.0f;
        for (int32_t k = 0; k < count; k++) {
            sum += (float)others[k].q[i];
        }
        const float difference = sum / (float)count - (float)b->q[i];
        squares += difference * difference;
    }
    return squares;
}

float bslam_sample_decide(const bslam_weights_t *weights, const bslam_sample_t *sample)
{
    sum_t sum = 0;
    for (int32_t i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        sum += (sum_t)weights->w[i] * (sum_t)sample->q[i];
    }
    return weights->unit * (float)sum;
}

float bslam_weights_to_words(const float weights[BSLAM_SAMPLE_SIZE], int16_t words[BSLAM_SAMPLE_SIZE])
{
    float largest = 0.0f;
    for (int32_t i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        const float size = weights[i] < 0.0f ? -weights[i] : weights[i];
        largest = size > largest ? size : largest;
    }
    const float per_unit = largest > 0.0f ? 32767.0f / largest : 0.0f;
    for (int32_t i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        const float w = weights[i] * per_unit;
        words[i] = (int16_t)(w + (w < 0.0f ? -0.5f : 0.5f));
    }
    return largest;
}

void bslam_weights_round(const float weights[BSLAM_SAMPLE_SIZE], bslam_weights_t *rounded)
{
#if BSLAM_SAMPLE_FLOAT
    rounded->unit = 1.0f;
    memcpy(rounded->w, weights, sizeof rounded->w);
#else
    rounded->unit = bslam_weights_to_words(weights, rounded->w) / 32767.0f;
#endif
}
