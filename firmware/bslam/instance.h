/// What stands in a bslam_t.
#ifndef BSLAM_INSTANCE_H
#define BSLAM_INSTANCE_H

#include "bslam/bslam.h"
#include "bslam/slam/doubt.h"
#include "bslam/slam/slam.h"
#if BSLAM_RECOVERY
#include "bslam/recovery/recovery.h"
#endif
#if BSLAM_GUARD
#include "bslam/store/guard.h"
#endif

typedef struct bslam_instance {
    bslam_slam_t slam;
#if BSLAM_RECOVERY
    bslam_recovery_t recovery;
#endif
#if BSLAM_GUARD
    bslam_guard_t guard;
#endif
#if BSLAM_GUARD == 2
    bslam_slam_t copy;
#endif
#if BSLAM_APPEARANCE
    bslam_appearance_t appearance;
#endif
#if BSLAM_SMOOTHER
    bslam_smoother_t smoother;
#endif
#if BSLAM_HYPOTHESES_MAX > 1
    bslam_doubts_t doubts;
#endif
} bslam_instance_t;

static inline bslam_instance_t *bslam_instance(bslam_t *robot)
{
    void *memory = robot;
    return memory;
}

static inline const bslam_instance_t *bslam_const_instance(const bslam_t *robot)
{
    const void *memory = robot;
    return memory;
}

#endif
