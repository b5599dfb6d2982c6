// LIBLINEAR, with the solver that bslam's is written after, and its default tolerance.
#include "svm_peer.h"

#include <linear.h>
#include <stdlib.h>

enum { MACHINES_MAX = 64, NODES = SVM_FEATURES + 2 };  // the constant, and the end

static struct problem problems[MACHINES_MAX];
static struct model *models[MACHINES_MAX];
static struct parameter parameter;
static struct feature_node **tests_given;
static int classifiers;

static void silent(const char *text)
{
    (void)text;
}

static struct feature_node **nodes_of(const svm_set_t *set)
{
    struct feature_node **rows = calloc((size_t)set->count, sizeof(struct feature_node *));
    for (int i = 0; i < set->count; i++) {
        rows[i] = calloc(NODES, sizeof(struct feature_node));
        int at = 0;
        for (int k = 0; k < SVM_FEATURES; k++) {
            if (set->samples[i].x[k] != 0.0f) {  // rows are sparse
                rows[i][at++] = (struct feature_node){k + 1, (double)set->samples[i].x[k]};
            }
        }
        rows[i][at++] = (struct feature_node){SVM_FEATURES + 1, 1.0};
        rows[i][at] = (struct feature_node){-1, 0.0};
    }
    return rows;
}

void svm_begin(const svm_set_t *sets, int count, double cost, const svm_set_t *tests)
{
    set_print_string_function(silent);
    parameter = (struct parameter){.solver_type = L2R_L2LOSS_SVC_DUAL, .eps = 0.1, .C = cost};
    classifiers = count;
    tests_given = nodes_of(tests);
    for (int m = 0; m < count; m++) {
        double *y = calloc((size_t)sets[m].count, sizeof *y);
        for (int i = 0; i < sets[m].count; i++) {
            y[i] = sets[m].samples[i].label;
        }
        problems[m] = (struct problem){
            .l = sets[m].count, .n = SVM_FEATURES + 1, .y = y, .x = nodes_of(&sets[m]), .bias = 1.0};
    }
}

void svm_train(int m)
{
    models[m] = train(&problems[m], &parameter);
}

void svm_decide(int test, double *values)
{
    for (int m = 0; m < classifiers; m++) {
        (void)predict_values(models[m], tests_given[test], &values[m]);
        values[m] *= models[m]->label[0];  // the class that a positive value stands for
    }
}
