/// What stands in a bslam_vision_t. Not for users.
#ifndef BSLAM_VISION_INSTANCE_H
#define BSLAM_VISION_INSTANCE_H

#include "vision/front_end.h"
#include "vision/scan/rig_scanner.h"
#if BSLAM_VISION_TURNS
#include "vision/gyro/frame_rotation.h"
#endif

typedef struct bslam_vision_instance {
    bool scans;  ///< for a user's own kinds
    union {
        bslam_rig_scanner_t scanner;
#if BSLAM_VISION_BUILT_IN
        bslam_front_end_t front_end;  ///< for the built-in ones
#endif
    };
#if BSLAM_VISION_TURNS
    bslam_turns_t turns;
#endif
} bslam_vision_instance_t;

static inline bslam_vision_instance_t *bslam_vision_instance(bslam_vision_t *vision)
{
    void *memory = vision;
    return memory;
}

static inline const bslam_vision_instance_t *bslam_const_vision_instance(const bslam_vision_t *vision)
{
    const void *memory = vision;
    return memory;
}

/// Whether a scanner looks. Constant where there is nothing else, so that nothing else is linked.
static inline bool bslam_vision_scans(const bslam_vision_instance_t *instance)
{
    return !BSLAM_VISION_BUILT_IN || instance->scans;
}

static inline bslam_front_end_t *bslam_vision_front_end(bslam_vision_instance_t *instance)
{
#if BSLAM_VISION_BUILT_IN
    return &instance->front_end;
#else
    (void)instance;
    return NULL;
#endif
}

#endif
