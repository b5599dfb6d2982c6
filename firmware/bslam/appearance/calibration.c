#include "bslam/appearance/calibration.h"

const bslam_calibration_t *bslam_calibration_of(int32_t association)
{
    static const bslam_calibration_t SVM = {3.816f, 0, 5.483f, -0.802f, 0, -0.027f, false};
    static const bslam_calibration_t NEAREST = {6.313f, -7.533f, 0, 0.355f, -1.159f, 0, false};
    static const bslam_calibration_t CENTROID = {6.496f, -7.872f, 0, 0.388f, -0.410f, 0, true};
    static const bslam_calibration_t BOTH = {5.885f, -5.043f, 3.075f, -1.059f, 0.998f, 0.659f, false};
    return association == BSLAM_ASSOCIATION_SVM              ? &SVM
           : association == BSLAM_ASSOCIATION_NEAREST_SAMPLE ? &NEAREST
           : association == BSLAM_ASSOCIATION_CENTROID       ? &CENTROID
                                                             : &BOTH;
}
