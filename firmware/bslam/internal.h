/// All of the estimator's insides in one header, for its tests and tools: nothing here is promised. Users
/// include bslam/bslam.h.
#ifndef BSLAM_INTERNAL_H
#define BSLAM_INTERNAL_H

#include "base/scalar.h"
#include "bslam/instance.h"
#include "bslam/recovery/recovery.h"
#include "bslam/settings_internal.h"
#include "bslam/slam/fingerprint.h"
#include "bslam/store/guard.h"
#include "bslam/store/slots.h"

#endif
