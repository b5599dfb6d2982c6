// Machines that come trained, as a header: bslam's (MACHINE_HEADER defines `machine`), or with M2CGEN what
// m2cgen wrote, `score`.
#include "svm_peer.h"

#include MACHINE_HEADER

static const svm_set_t *tests_given;

void svm_begin(const svm_set_t *sets, int count, double cost, const svm_set_t *tests)
{
    (void)sets;
    (void)count;
    (void)cost;
    tests_given = tests;
}

void svm_train(int m)
{
    (void)m;
}

void svm_decide(int test, double *values)
{
    const float *x = tests_given->samples[test].x;
#ifdef M2CGEN
    double wide[SVM_FEATURES];
    for (int k = 0; k < SVM_FEATURES; k++) {
        wide[k] = (double)x[k];
    }
    score(wide, values);
#else
    float narrow[BSLAM_SVM_ROWS_MAX];
    bslam_svm_decide(&classifier, x, narrow);
    for (int m = 0; m < classifier.rows; m++) {
        values[m] = (double)narrow[m];
    }
#endif
}
