/// Which of a user's own objects a candidate is, by its signature. Paper, module BOR: recognition in detail,
/// of objects whose size is known. tools/training/train_beacons.py trains it; docs/RETRAIN.md says how.
/// Internal.
#ifndef BSLAM_VISION_CLASSIFIERS_RECOGNISER_H
#define BSLAM_VISION_CLASSIFIERS_RECOGNISER_H

#include "vision/classifiers/beacon_model.h"
#include "vision/vision.h"

/// BSLAM_OK if bslam_recognise may be given it. Else what bslam_svm_check answers; BSLAM_E_COUNT: more
/// than BSLAM_OBJECTS_MAX objects; BSLAM_E_PARAMETER: the machine is quadratic, there are no objects;
/// BSLAM_E_RANGE: a height outside 0 to 10 m; BSLAM_E_NOT_FINITE: the reject margin.
BSLAM_MUST_CHECK bslam_status_t bslam_recogniser_check(const bslam_recogniser_t *recogniser);

/// Index of the object whose machine says the most, *margin being what it says; BSLAM_OBJECT_NONE, and the
/// same margin, if that is below the reject margin. A signature of zeros, which bslam_measure gives where
/// none could be taken, is no object: *margin is then 0.
int16_t bslam_recognise(const bslam_recogniser_t *recogniser, const float signature[BSLAM_SIGNATURE_SIZE],
                        float *margin);

#endif
