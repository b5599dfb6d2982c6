/// Checks a model before its first use. Internal.
#ifndef BSLAM_VISION_BUILT_IN_CLASSIFIERS_BEACON_MODEL_H
#define BSLAM_VISION_BUILT_IN_CLASSIFIERS_BEACON_MODEL_H

#include "base/status.h"
#include "vision/built_in/classifiers/additive.h"
#include "vision/built_in/classifiers/hinged.h"
#include "vision/built_in/classifiers/svm.h"
#include "vision/model.h"

/// BSLAM_OK if the front end may be given this model. BSLAM_E_COUNT: a count is out of range or a machine's
/// size is not as model.h describes it. BSLAM_E_RANGE: a height is not 0 to 10 m. BSLAM_E_NOT_FINITE or
/// BSLAM_E_PARAMETER: a number is not finite, a machine is quadratic that must not be, or what
/// bslam_svm_check refuses.
BSLAM_MUST_CHECK bslam_status_t bslam_beacon_model_check(const bslam_beacon_model_t *model);

#endif
