/// Support vector machines that were trained elsewhere: decision values of a linear machine, or of a
/// quadratic one by explicit expansion of its features, which leaves a dot product. Binary, or one against
/// the rest for each of several classes. MATH-CAMERA "SVM inference". Internal.
#ifndef BSLAM_VISION_BUILT_IN_CLASSIFIERS_SVM_H
#define BSLAM_VISION_BUILT_IN_CLASSIFIERS_SVM_H

#include "base/status.h"
#include "vision/model.h"

/// Whether all are numbers that a machine may have: not NaN, infinite or beyond 1e12.
bool bslam_are_numbers(const float *values, int32_t count);

/// Looks a machine over, once, before its first use. BSLAM_E_COUNT: rows or features out of 1 to
/// BSLAM_SVM_..._MAX, or not as many features as the caller computes. BSLAM_E_PARAMETER: weights and bytes
/// are both given or both missing, bytes without a scale, no bias, a scale below 0. BSLAM_E_NOT_FINITE: a
/// weight, scale or bias is NaN, infinite or beyond 1e12. Time is linear in the weights.
BSLAM_MUST_CHECK bslam_status_t bslam_svm_check(const bslam_svm_t *svm, int32_t features);

/// values[r] = f_r(x) for every row; above 0 is "yes". svm has passed bslam_svm_check, x is within +-1e15.
/// One multiplication a weight. With float weights the error of rounding is below 2 features roundings (6e-8)
/// of the sum of |w_k phi_k(x)|. With bytes all is whole numbers, phi_k(x) in steps of M^2 / 16383, where M
/// is the largest |x_i|, at least 1: the error is below 1.5 steps times the sum of |w_k|. Takes 1 KB of
/// stack. Touches nothing but values.
void bslam_svm_decide(const bslam_svm_t *svm, const float *x, float *values);

#endif
