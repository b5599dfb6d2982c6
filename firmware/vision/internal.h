/// What training, tests and benches look at beyond vision.h. Not for users.
#ifndef BSLAM_VISION_INTERNAL_H
#define BSLAM_VISION_INTERNAL_H

#include "vision/built_in/classifiers/beacon_model.h"
#include "vision/built_in/gyro/visual_gyro.h"
#include "vision/instance.h"
#include "vision/scan/scanner.h"

#endif
