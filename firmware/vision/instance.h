/// What stands in a bslam_vision_t. Not for users.
#ifndef BSLAM_VISION_INSTANCE_H
#define BSLAM_VISION_INSTANCE_H

#include "vision/front_end.h"
#if BSLAM_VISION_TURNS
#include "vision/gyro/frame_rotation.h"
#endif

typedef struct bslam_vision_instance {
    bslam_front_end_t front_end;
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
