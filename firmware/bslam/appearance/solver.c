#include "bslam/appearance/solver.h"

#include <float.h>

// A row at 0 whose first gradient is above this leaves at once: it lies well beyond its margin.
static const float FIRST_SHRINK = 0.1f;
// Of the tolerance: a smaller gradient is not worth the work of a move.
static const float NEGLIGIBLE = 0.1f;

/// In eight sums side by side: the same bits with a vector unit and without. Each by its name, so that a core
/// without one keeps them in registers.
static float dot(const float *restrict a, const float *restrict b)
{
    float s0 = 0, s1 = 0, s2 = 0, s3 = 0, s4 = 0, s5 = 0, s6 = 0, s7 = 0;
    for (const float *end = a + BSLAM_SAMPLE_SIZE; a != end; a += 8, b += 8) {
        s0 += a[0] * b[0];
        s1 += a[1] * b[1];
        s2 += a[2] * b[2];
        s3 += a[3] * b[3];
        s4 += a[4] * b[4];
        s5 += a[5] * b[5];
        s6 += a[6] * b[6];
        s7 += a[7] * b[7];
    }
    return ((s0 + s4) + (s1 + s5)) + ((s2 + s6) + (s3 + s7));
}

/// w += factor x. Both are kept in terms of q, so the unit enters twice.
static void add_scaled(float *restrict weights, float factor, const float *restrict q)
{
    const float by = factor * (BSLAM_SAMPLE_UNIT * BSLAM_SAMPLE_UNIT);
    for (int32_t i = 0; i < BSLAM_SAMPLE_SIZE; i += 4) {
        weights[i] += by * q[i];
        weights[i + 1] += by * q[i + 1];
        weights[i + 2] += by * q[i + 2];
        weights[i + 3] += by * q[i + 3];
    }
}

static float sign_of(const bslam_solver_row_t *row)
{
    return row->positive ? 1.0f : -1.0f;
}

static void begin_pass(bslam_solver_t *solver)
{
    solver->next = 0;
    solver->largest = -FLT_MAX;
    solver->smallest = FLT_MAX;
}

void bslam_solver_begin(bslam_solver_t *solver, float cost, float tolerance, bool thorough)
{
    solver->half_inverse_cost = 0.5f / cost;
    solver->tolerance = tolerance;
    solver->thorough = thorough;
    solver->count = 0;
    solver->active = 0;
    solver->shrink_above = FIRST_SHRINK;
    solver->random = 1;
    for (int32_t i = 0; i < BSLAM_SAMPLE_SIZE; i++) {
        solver->weights[i] = 0.0f;
    }
    begin_pass(solver);
}

void bslam_solver_add(bslam_solver_t *solver, const bslam_samples_t *samples, int32_t sample, bool positive,
                      float alpha)
{
    bslam_solver_row_t *row = &solver->rows[solver->count];
    row->alpha = alpha;
    row->diagonal = 0.0f;
    row->sample = (uint16_t)sample;
    row->positive = positive;
    if (alpha > 0.0f) {
        float q[BSLAM_SAMPLE_SIZE];
        bslam_sample_unpack(bslam_sample_at(samples, sample), q);
        add_scaled(solver->weights, sign_of(row) * alpha, q);
    }
    solver->order[solver->count] = (uint16_t)solver->count;
    solver->count++;
    solver->active = solver->count;
}

/// What the end of a pass decides; false: the solution is there.
static bool end_pass(bslam_solver_t *solver)
{
    const bool flat = solver->largest - solver->smallest <= solver->tolerance;
    if (flat && (solver->active == solver->count || !solver->thorough)) {
        return false;
    }
    // Flat without the rows that left: now with all. A pass without rows is flat, so the next one has some.
    solver->active = flat ? solver->count : solver->active;
    solver->shrink_above = flat || solver->largest <= 0.0f ? FLT_MAX : solver->largest;
    begin_pass(solver);
    return true;
}

static void swap(uint16_t *a, uint16_t *b)
{
    const uint16_t kept = *a;
    *a = *b;
    *b = kept;
}

/// Brings a random one of the rows that are left in this pass to its front.
static bslam_solver_row_t *draw(bslam_solver_t *solver)
{
    solver->random = solver->random * 1664525u + 1013904223u;
    const uint32_t left = (uint32_t)(solver->active - solver->next);
    const uint32_t chosen = ((solver->random >> 16) * left) >> 16;
    uint16_t *front = &solver->order[solver->next];
    swap(front, front + chosen);
    return &solver->rows[*front];
}

/// Moves a dual variable to where its own gradient is 0, or to 0, and w with it.
static void move(bslam_solver_t *solver, bslam_solver_row_t *row, float gradient, const float *q)
{
    if (row->diagonal <= 0.0f) {
        row->diagonal = dot(q, q) * (BSLAM_SAMPLE_UNIT * BSLAM_SAMPLE_UNIT) + solver->half_inverse_cost;
    }
    const float best = row->alpha - gradient / row->diagonal;
    const float alpha = best > 0.0f ? best : 0.0f;
    add_scaled(solver->weights, sign_of(row) * (alpha - row->alpha), q);
    row->alpha = alpha;
}

/// One dual step, in a pass that is not at its end.
static void step(bslam_solver_t *solver, const bslam_samples_t *samples)
{
    bslam_solver_row_t *row = draw(solver);
    float q[BSLAM_SAMPLE_SIZE];
    bslam_sample_unpack(bslam_sample_at(samples, row->sample), q);
    const float gradient =
        sign_of(row) * dot(solver->weights, q) - 1.0f + row->alpha * solver->half_inverse_cost;
    const bool stays_at_0 = row->alpha <= 0.0f && gradient >= 0.0f;
    if (stays_at_0 && gradient > solver->shrink_above) {
        solver->active--;
        swap(&solver->order[solver->next], &solver->order[solver->active]);
        return;
    }
    const float projected = stays_at_0 ? 0.0f : gradient;
    solver->largest = projected > solver->largest ? projected : solver->largest;
    solver->smallest = projected < solver->smallest ? projected : solver->smallest;
    solver->next++;
    const float negligible = NEGLIGIBLE * solver->tolerance;
    if (projected > negligible || projected < -negligible) {
        move(solver, row, gradient, q);
    }
}

int32_t bslam_solver_run(bslam_solver_t *solver, const bslam_samples_t *samples, int32_t steps)
{
    int32_t done = 0;
    while (done < steps && (solver->next < solver->active || end_pass(solver))) {
        step(solver, samples);
        done++;
    }
    return done;
}
