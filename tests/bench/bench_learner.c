// A robot that learns its beacons by sight, from a recording on standard input: records of a machine (int32)
// and 71 features (float32); those of machine -1, which come first, are seeds. Each sample is shown, and
// training goes on until nothing is left to do. tools/bench/bench_learner.py counts the instructions of the
// measured functions.
#include <stdio.h>
#include <stdlib.h>

#include "bslam/svm/learner.h"

// The last sightings are worked off piece by piece.
#define PIECEWISE 5

typedef struct record {
    int32_t machine;
    float signature[BSLAM_SAMPLE_FEATURES];
} record_t;

static bslam_learner_t learner;
static bslam_sample_t seeds[BSLAM_SEEDS_MAX];

void measured_show(const record_t *record);
bool measured_update(void);
bool measured_piece(void);

static void fail(const char *what)
{
    (void)fprintf(stderr, "bench: %s\n", what);
    exit(1);
}

__attribute__((noinline)) void measured_show(const record_t *record)
{
    if (bslam_learner_show(&learner, record->machine, record->signature) != BSLAM_OK) {
        fail("a signature was refused");
    }
}

/// One training, from its first piece to its last, a call each: the dearest way.
__attribute__((noinline)) bool measured_update(void)
{
    const uint32_t updates = learner.counters.updates;
    bool left = true;
    while (left && learner.counters.updates == updates) {
        left = bslam_learner_work(&learner, 1);
    }
    return left;
}

__attribute__((noinline)) bool measured_piece(void)
{
    return bslam_learner_work(&learner, 1);
}

static bool next(record_t *record)
{
    return fread(record, sizeof *record, 1, stdin) == 1;
}

static void begin(record_t *record)
{
    int32_t seed_count = 0;
    int32_t machine;
    while (next(record) && record->machine < 0 && seed_count < BSLAM_SEEDS_MAX) {
        if (bslam_sample_encode(record->signature, &seeds[seed_count]) != BSLAM_OK) {
            fail("a seed was refused");
        }
        seed_count++;
    }
    if (bslam_learner_init(&learner, seeds, seed_count) != BSLAM_OK) {
        fail("the seeds were refused");
    }
    for (int32_t m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        if (bslam_learner_add(&learner, &machine) != BSLAM_OK) {
            fail("no room for a machine");
        }
    }
}

int main(int argc, char **argv)
{
    const int sightings = argc > 1 ? atoi(argv[1]) : 0;
    record_t record;
    begin(&record);
    for (int i = 0; i < sightings; i++) {
        measured_show(&record);
        while (i < sightings - PIECEWISE ? measured_update() : measured_piece()) {
        }
        if (i + 1 < sightings && !next(&record)) {
            fail("the recording is too short");
        }
    }
    printf("%u %u\n", (unsigned)learner.counters.updates, (unsigned)learner.counters.steps);
    return 0;
}
