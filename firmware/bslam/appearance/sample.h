/// A sample: what a classifier that learns on the robot keeps of one signature. Features are rounded to 8
/// bits, or kept as float32 where BSLAM_SAMPLE_FLOAT is set; a constant 1 stands after them, so that a weight
/// vector holds its bias too.
///
/// A float x is stored as q = x / BSLAM_SAMPLE_UNIT. Weights stand for q, not for x: a decision value is w .
/// q.
#ifndef BSLAM_APPEARANCE_SAMPLE_H
#define BSLAM_APPEARANCE_SAMPLE_H

#include <stdint.h>

#include "bslam/settings.h"
#include "base/status.h"

#if BSLAM_SAMPLE_FLOAT
typedef float bslam_stored_weight_t;
#else
typedef int16_t bslam_stored_weight_t;
#endif

/// Weights to decide by, as small as samples allow: w = unit * weight.
typedef struct bslam_weights {
    float unit;
    bslam_stored_weight_t w[BSLAM_SAMPLE_SIZE];
} bslam_weights_t;

/// Stores a signature. A feature beyond -1 to 1 counts as that limit. BSLAM_E_NOT_FINITE, and nothing
/// written, if one is NaN, infinite or beyond 1e12.
BSLAM_MUST_CHECK bslam_status_t bslam_sample_encode(const float features[BSLAM_SAMPLE_FEATURES],
                                                    bslam_sample_t *sample);

/// q as float. The two do not overlap: that, and a length known to the compiler, lets it use vectors.
static inline void bslam_sample_unpack(const bslam_sample_t *restrict sample,
                                       float q[restrict BSLAM_SAMPLE_SIZE])
{
    for (int32_t i = 0; i < BSLAM_SAMPLE_SIZE; i += 4) {
        q[i] = (float)sample->q[i];
        q[i + 1] = (float)sample->q[i + 1];
        q[i + 2] = (float)sample->q[i + 2];
        q[i + 3] = (float)sample->q[i + 3];
    }
}

/// Squared distance of two samples, in units of q.
float bslam_sample_distance2(const bslam_sample_t *a, const bslam_sample_t *b);

/// The same to the middle of count >= 1 others.
float bslam_sample_middle_distance2(const bslam_sample_t *others, int32_t count, const bslam_sample_t *b);

/// w . q, exact for 8-bit samples but for two roundings.
float bslam_sample_decide(const bslam_weights_t *weights, const bslam_sample_t *sample);

/// Weights in units of a 32767th of the largest of them, which is returned.
float bslam_weights_to_words(const float weights[BSLAM_SAMPLE_SIZE], int16_t words[BSLAM_SAMPLE_SIZE]);

/// Rounds weights to half a 32767th of the largest of them; for float samples nothing is rounded.
void bslam_weights_round(const float weights[BSLAM_SAMPLE_SIZE], bslam_weights_t *rounded);

#endif
