/// What stands in a bslam_vision_t. Not for users.
#ifndef BSLAM_VISION_INSTANCE_H
#define BSLAM_VISION_INSTANCE_H

#include "vision/scan/rig_scanner.h"
#if BSLAM_VISION_BUILT_IN
#include "vision/built_in/front_end.h"
#endif
#if BSLAM_VISION_TURNS
#include "vision/built_in/gyro/frame_rotation.h"
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

#endif
