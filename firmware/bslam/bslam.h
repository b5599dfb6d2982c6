/// bslam: simultaneous localisation and mapping with beacons, in fixed memory.
///
/// Start at slam/slam.h. Sizes: config.h. Parameters: settings.h. The vision front end, which a robot
/// with a detector of its own does without, is apart: vision/vision.h.
#ifndef BSLAM_H
#define BSLAM_H

#define BSLAM_VERSION_MAJOR 0
#define BSLAM_VERSION_MINOR 1
#define BSLAM_VERSION_PATCH 0

#include "link/parser.h"
#include "bslam/recovery/recovery.h"
#include "bslam/slam/fingerprint.h"
#include "bslam/store/guard.h"
#include "bslam/store/slots.h"
#include "bslam/appearance/learner.h"

#endif
