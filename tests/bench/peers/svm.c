// Trains a peer's machines on the sets on standard input, one against the rest each, and lets them decide
// about the tests. Prints CPU time of a training and of a decision by all machines in ns, and how many tests
// the largest value names rightly. Under callgrind only svm_train or svm_decide counts, as the caller
// chooses.
#include "svm_peer.h"

#include <stdio.h>
#include <stdint.h>
#include <stdlib.h>
#include <time.h>

enum { MACHINES_MAX = 64 };

static void fail(const char *what)
{
    (void)fprintf(stderr, "bench: %s\n", what);
    exit(1);
}

static svm_set_t read_set(void)
{
    svm_set_t set = {0};
    if (scanf("%d", &set.count) != 1 || set.count < 1) {
        fail("a set has no size");
    }
    set.samples = calloc((size_t)set.count, sizeof *set.samples);
    for (int i = 0; set.samples != NULL && i < set.count; i++) {
        int read = scanf("%d", &set.samples[i].label);
        for (int k = 0; k < SVM_FEATURES; k++) {
            read += scanf("%f", &set.samples[i].x[k]);
        }
        if (read != 1 + SVM_FEATURES) {
            fail("a sample is cut short");
        }
    }
    return set;
}

static int64_t cpu_ns(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static int largest(const double *values, int count)
{
    int best = 0;
    for (int i = 1; i < count; i++) {
        best = values[i] > values[best] ? i : best;
    }
    return best;
}

int main(void)
{
    int count = 0;
    double cost = 0;
    svm_set_t sets[MACHINES_MAX];
    if (scanf("%d %lf", &count, &cost) != 2 || count < 1 || count > MACHINES_MAX) {
        fail("no number of sets");
    }
    for (int m = 0; m < count; m++) {
        sets[m] = read_set();
    }
    const svm_set_t tests = read_set();
    svm_begin(sets, count, cost, &tests);
    const int64_t began_ns = cpu_ns();
    for (int m = 0; m < count; m++) {
        svm_train(m);
    }
    const int64_t trained_ns = cpu_ns();
    int right = 0;
    for (int i = 0; i < tests.count; i++) {
        double values[MACHINES_MAX];
        svm_decide(i, values);
        right += largest(values, count) == tests.samples[i].label;
    }
    const int64_t decided_ns = cpu_ns();
    printf("%lld %lld %d\n", (long long)(trained_ns - began_ns) / count,
           (long long)(decided_ns - trained_ns) / tests.count, right);
    return 0;
}
