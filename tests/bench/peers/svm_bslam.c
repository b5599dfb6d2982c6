// The solver and the weights of the machines that learn on the robot: samples and weights as they are kept
// there. To the same tolerance as LIBLINEAR's default.
#include "svm_peer.h"

#include <stdio.h>
#include <stdlib.h>

#include "bslam/appearance/solver.h"

enum { MACHINES_MAX = 64 };

static bslam_solver_t solver;
static bslam_samples_t samples[MACHINES_MAX];
static bslam_weights_t weights[MACHINES_MAX];
static const svm_set_t *sets_given;
static const svm_set_t *tests_given;
static int classifiers;
static float cost_given;

void svm_begin(const svm_set_t *sets, int count, double cost, const svm_set_t *tests)
{
    sets_given = sets;
    tests_given = tests;
    classifiers = count;
    cost_given = (float)cost;
    for (int m = 0; m < count; m++) {
        bslam_sample_t *stored = calloc((size_t)sets[m].count, sizeof *stored);
        for (int i = 0; stored != NULL && i < sets[m].count; i++) {
            if (sets[m].count > BSLAM_SOLVER_ROWS_MAX ||
                bslam_sample_encode(sets[m].samples[i].x, &stored[i]) != BSLAM_OK) {
                (void)fprintf(stderr, "bench: bslam refuses a set\n");
                exit(1);
            }
        }
        samples[m] = (bslam_samples_t){.own = stored, .own_count = sets[m].count};
    }
}

void svm_train(int m)
{
    bslam_solver_begin(&solver, cost_given, 0.1f, true);
    for (int i = 0; i < sets_given[m].count; i++) {
        bslam_solver_add(&solver, &samples[m], i, sets_given[m].samples[i].label > 0, 0);
    }
    (void)bslam_solver_run(&solver, &samples[m], INT32_MAX);
    bslam_weights_round(solver.weights, &weights[m]);
}

void svm_decide(int test, double *values)
{
    bslam_sample_t sample;
    if (bslam_sample_encode(tests_given->samples[test].x, &sample) != BSLAM_OK) {
        exit(1);
    }
    for (int m = 0; m < classifiers; m++) {
        values[m] = (double)bslam_sample_decide(&weights[m], &sample);
    }
}
