/// LIBLINEAR's dual coordinate descent for the linear support vector machine with squared hinge loss, on a
/// small fixed set, one step at a time. MATH "The learner".
///
/// Finds the w that minimises |w|^2 / 2 + C sum of max(0, 1 - y w . x)^2, x with the constant 1 as its last
/// feature. Hsieh, Chang, Lin, Keerthi, Sundararajan: A Dual Coordinate Descent Method for Large-scale Linear
/// SVM, ICML 2008, algorithm 3 with shrinking.
#ifndef BSLAM_APPEARANCE_SOLVER_H
#define BSLAM_APPEARANCE_SOLVER_H

#include <stdbool.h>
#include <stdint.h>

#include "bslam/config.h"
#include "bslam/appearance/sample.h"

/// Samples of a set.
#define BSLAM_SOLVER_ROWS_MAX (BSLAM_SAMPLES_PER_CLASSIFIER + BSLAM_NEGATIVES_MAX)

/// Where samples stand: those of the instance, numbered from 0, and after them seeds, which are constant.
typedef struct bslam_samples {
    const bslam_sample_t *own;
    int32_t own_count;
    const bslam_sample_t *seeds;
    int32_t seed_count;
} bslam_samples_t;

static inline const bslam_sample_t *bslam_sample_at(const bslam_samples_t *samples, int32_t number)
{
    return number < samples->own_count ? &samples->own[number] : &samples->seeds[number - samples->own_count];
}

typedef struct bslam_solver_row {
    float alpha;     ///< dual variable, >= 0
    float diagonal;  ///< x . x + 1 / 2C; 0 until it is needed
    uint16_t sample;
    bool positive;  ///< y is 1, not -1 as a competitor's
} bslam_solver_row_t;

typedef struct bslam_solver {
    float half_inverse_cost;  ///< 1 / 2C
    float tolerance;
    bool thorough;
    int32_t count;   ///< rows
    int32_t active;  ///< of them still looked at: order[0..active)
    int32_t next;    ///< place in the pass
    float largest;   ///< projected gradients of this pass
    float smallest;
    float shrink_above;  ///< a row at 0 whose gradient is above it leaves the pass
    uint32_t random;
    float weights[BSLAM_SAMPLE_SIZE];  ///< for q, see sample.h
    bslam_solver_row_t rows[BSLAM_SOLVER_ROWS_MAX];
    uint16_t order[BSLAM_SOLVER_ROWS_MAX];
} bslam_solver_t;

/// An empty set: w = 0. cost is C, above 0. Steps end when the projected gradients of a pass differ by no
/// more than `tolerance`. thorough: only after a pass over all rows, as LIBLINEAR does; else rows that have
/// left the passes since they seemed to need no change are not looked at again.
void bslam_solver_begin(bslam_solver_t *solver, float cost, float tolerance, bool thorough);

/// Adds a row, with the dual variable that it had in an earlier solution, or 0. There is room, and no step
/// has been made.
void bslam_solver_add(bslam_solver_t *solver, const bslam_samples_t *samples, int32_t sample, bool positive,
                      float alpha);

/// Makes up to `steps` dual steps; how many it made. Fewer than asked: the solution is there.
int32_t bslam_solver_run(bslam_solver_t *solver, const bslam_samples_t *samples, int32_t steps);

#endif
