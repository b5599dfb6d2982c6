// Runs a peer over the drive on standard input and prints what it took: steps measured, CPU time of them in
// ns, mean position error over all steps in m, landmarks made, bytes kept at the end. Under callgrind only
// peer_step of the measured steps counts.
#include "peer.h"

#include <malloc.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#if __has_include(<valgrind/callgrind.h>)
#include <valgrind/callgrind.h>
#else
#define CALLGRIND_START_INSTRUMENTATION
#define CALLGRIND_STOP_INSTRUMENTATION
#endif

typedef struct drive {
    bench_model_t model;
    int count;
    int first_measured;
    bench_step_t *steps;
    double (*truth)[3];
} drive_t;

static void fail(const char *what)
{
    (void)fprintf(stderr, "bench: %s\n", what);
    exit(1);
}

static void *room(size_t count, size_t size)
{
    void *memory = calloc(count > 0 ? count : 1, size);
    if (memory == NULL) {
        fail("no memory for the drive");
    }
    return memory;
}

static void read_step(drive_t *drive, int number, int64_t step_us)
{
    bench_step_t *step = &drive->steps[number];
    double *truth = drive->truth[number];
    if (scanf("%lf %lf %lf %lf %lf %d", &step->left_m, &step->right_m, &truth[0], &truth[1], &truth[2],
              &step->count) != 6) {
        fail("the drive is cut short");
    }
    step->time_us = number * step_us;
    bench_sighting_t *sightings = room((size_t)step->count, sizeof *sightings);
    for (int i = 0; i < step->count; i++) {
        if (scanf("%d %lf %lf", &sightings[i].label, &sightings[i].bearing_rad, &sightings[i].range_m) != 3) {
            fail("a sighting is cut short");
        }
    }
    step->sightings = sightings;
}

static void read_drive(drive_t *drive)
{
    bench_model_t *model = &drive->model;
    int64_t step_us = 0;
    if (scanf("%lf %lf %lf %lf %lf %lf", &model->wheelbase_m, &model->wheel_sd_m, &model->bearing_sd_rad,
              &model->range_sd_floor_m, &model->range_sd_fraction, &model->range_sd_per_m) != 6 ||
        scanf("%ld %d %d", &step_us, &drive->count, &drive->first_measured) != 3) {
        fail("the drive has no head");
    }
    drive->steps = room((size_t)drive->count, sizeof *drive->steps);
    drive->truth = room((size_t)drive->count, sizeof *drive->truth);
    for (int number = 0; number < drive->count; number++) {
        read_step(drive, number, step_us);
    }
}

static size_t heap_bytes(void)
{
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

static int64_t cpu_ns(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

int main(int words, char **word)
{
    drive_t drive;
    read_drive(&drive);
    double(*pose)[3] = room((size_t)drive.count, sizeof *pose);
    peer_begin(&drive.model, drive.steps, drive.count, words, word);
    const size_t prepared_bytes = heap_bytes();
    for (int number = 0; number < drive.first_measured; number++) {
        peer_step(&drive.steps[number], number);
        peer_pose(pose[number]);
    }
    CALLGRIND_START_INSTRUMENTATION;
    const int64_t began_ns = cpu_ns();
    for (int number = drive.first_measured; number < drive.count; number++) {
        peer_step(&drive.steps[number], number);
        peer_pose(pose[number]);
    }
    const int64_t took_ns = cpu_ns() - began_ns;
    CALLGRIND_STOP_INSTRUMENTATION;
    double sum_m = 0;
    for (int number = 1; number < drive.count; number++) {
        sum_m += hypot(pose[number][0] - drive.truth[number][0], pose[number][1] - drive.truth[number][1]);
    }
    printf("%d %lld %.9g %d %zu\n", drive.count - drive.first_measured, (long long)took_ns,
           sum_m / (drive.count - 1), peer_landmarks(), heap_bytes() - prepared_bytes + peer_static_bytes());
    return 0;
}
