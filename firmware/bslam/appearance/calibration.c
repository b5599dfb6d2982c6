#include "bslam/appearance/calibration.h"

const bslam_calibration_t *bslam_calibration_of(int32_t association)
{
    static const bslam_calibration_t SVM = {3.624f, 0, 4.961f, -1.140f, 0, -0.375f, false};
    static const bslam_calibration_t NEAREST = {6.297f, -7.726f, 0, 0.183f, -0.845f, 0, false};
    static const bslam_calibration_t CENTROID = {6.361f, -7.802f, 0, 0.094f, 0.038f, 0, true};
    static const bslam_calibration_t BOTH = {6.273f, -6.230f, 2.172f, -1.182f, 0.734f, 0.245f, false};
    return association == BSLAM_ASSOCIATION_SVM              ? &SVM
           : association == BSLAM_ASSOCIATION_NEAREST_SAMPLE ? &NEAREST
           : association == BSLAM_ASSOCIATION_CENTROID       ? &CENTROID
                                                             : &BOTH;
}
