// What a program with support vector machines offers, to be timed beside bslam's: svm.c measures svm_train
// and svm_decide.
#ifndef BENCH_SVM_PEER_H
#define BENCH_SVM_PEER_H

#include <stddef.h>

enum { SVM_FEATURES = 71 };  // as tools/bench/peers/machines.py writes them

typedef struct svm_sample {
    int label;  // in a set 1 or -1; of a test its class
    float x[SVM_FEATURES];
} svm_sample_t;

typedef struct svm_set {
    int count;
    svm_sample_t *samples;
} svm_set_t;

// Not measured: as many machines as sets, with this cost; samples come into the peer's own types.
void svm_begin(const svm_set_t *sets, int count, double cost, const svm_set_t *tests);

// Measured: trains machine m on its set. Nothing where machines come trained.
void svm_train(int m);

// Measured: decision values of all machines for a test sample by its number.
void svm_decide(int test, double *values);

#endif
