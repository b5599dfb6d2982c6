/// How the colour steps along a line of cells. Inside of proposals.c and prefilter.c.
#ifndef BSLAM_VISION_BUILT_IN_DETECTION_STEPS_H
#define BSLAM_VISION_BUILT_IN_DETECTION_STEPS_H

#include "base/bounds.h"
#include "vision/pixels/bytes.h"
#include "vision/built_in/detection/proposals.h"

/// Sums of steps, of each BSLAM_EDGE_STEP_MAX at most, and how many are above BSLAM_EDGE_STEP_MIN.
typedef struct bslam_step_sums {
    int32_t sum;
    uint32_t clear;
} bslam_step_sums_t;

static inline void bslam_step_add(int32_t step, bslam_step_sums_t *sums)
{
    sums->sum += bslam_least(step, BSLAM_EDGE_STEP_MAX);
    sums->clear += (uint32_t)(BSLAM_EDGE_STEP_MIN - step) >> 31;  // 1 where it is below 0
}

/// Of `count` cells that are so far apart.
static inline bslam_step_sums_t bslam_sum_steps(const uint8_t *step, int32_t count, int32_t apart)
{
    bslam_step_sums_t sums = {0, 0};
    if (count % 2 != 0) {
        bslam_step_add(*step, &sums);
        step += apart;
    }
    for (int32_t left = count / 2; left > 0; left--) {
        bslam_step_add(*step, &sums);
        step += apart;
        bslam_step_add(*step, &sums);
        step += apart;
    }
    return sums;
}

#endif
