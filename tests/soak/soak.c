// Hours of a life (world.h): lives it, feeds the filter, and compares it with the truth at each step. One
// line a seed:
//
//     seed,hours,nees,nees_last_hour,nees_beacon,error_m,error_max_m,least_eigenvalue,repairs
//
// The filter has the library's own settings, and the noise that the room is made with. For a consistent
// filter NEES of the pose is 3 in the mean, and that of a beacon's direction and inverse distance from the
// robot 2.
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bslam/internal.h"

#include "definite.h"
#include "world.h"

/// Not judged: the pose of the start is exact, and its covariance has no inverse.
#define STEPS_AT_START 250
/// What takes long to look at is looked at so often.
#define STEPS_A_LOOK 25
/// How doubtful odometry is resumed in turn, and what of that is true.
static const double told_m[] = {30, 0.5, 2}, told_rad[] = {3.2, 0.3, 0.1}, carried[] = {0, 1, 0.5};

/// What came of one seed: sums, but for the last two.
typedef struct outcome {
    double nees, nees_last, nees_beacon, error_m, error_max_m, least_eigenvalue;
    long beacon_looks;
} outcome_t;

static bslam_t robot;

static const bslam_ekf_t *filter(void)
{
    return &bslam_const_instance(&robot)->slam.ekf;
}

static void require(bool condition, const char *what)
{
    if (!condition) {
        (void)fprintf(stderr, "soak: %s\n", what);
        exit(1);
    }
}

// ---- the filter against the truth -------------------------------------------------------------------------

/// eᵀ P⁻¹ e, by Cholesky's factor of P, of which `lower` has the rows.
static double nees_of(int n, double lower[3][3], const double *e)
{
    double sum = 0, w[3];
    for (int i = 0; i < n; i++) {
        w[i] = e[i];
        for (int j = 0; j <= i; j++) {
            for (int k = 0; k < j; k++) {
                lower[i][j] -= lower[i][k] * lower[j][k];
            }
            if (j < i) {
                lower[i][j] /= lower[j][j];
                w[i] -= lower[i][j] * w[j];
            }
        }
        lower[i][i] = sqrt(lower[i][i]);
        w[i] /= lower[i][i];
        sum += w[i] * w[i];
    }
    return sum;
}

/// Of the pose in the frame of the start, where the map's is.
static double judge_pose(const world_t *world, const world_t *start, double *error_m)
{
    const bslam_pose_t pose = bslam_pose(&robot);
    const double dx = world->x_m - start->x_m;
    const double dy = world->y_m - start->y_m;
    const double sine = sin(start->theta_rad);
    const double cosine = cos(start->theta_rad);
    const double e[3] = {(double)pose.x_m - (cosine * dx + sine * dy),
                         (double)pose.y_m - (cosine * dy - sine * dx),
                         remainder((double)pose.theta_rad - (world->theta_rad - start->theta_rad), 2 * PI)};
    double lower[3][3];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            lower[i][j] = definite_covariance(filter(), i, j);
        }
    }
    *error_m = hypot(e[0], e[1]);
    return nees_of(3, lower, e);
}

/// A beacon from the robot: its direction and its inverse distance, which a ray has before its distance is
/// known, and how they go with the robot's pose and the beacon's own values.
typedef struct sight {
    double bearing_rad, inverse_per_m;
    int count, values[3 + BSLAM_RAY_DIM];
    double by[2][3 + BSLAM_RAY_DIM];
} sight_t;

/// From q, a vector to it of length inverse/inverse_per_m, and their derivatives.
static sight_t sight_along(const bslam_ekf_t *ekf, int at, int dim, const double q[2], double inverse,
                           double by_q[2][3 + BSLAM_RAY_DIM], int of_inverse)
{
    const double length = hypot(q[0], q[1]);
    sight_t sight = {.bearing_rad = atan2(q[1], q[0]) - (double)ekf->mean[BSLAM_STATE_THETA],
                     .inverse_per_m = inverse / length,
                     .count = 3 + dim};
    for (int k = 0; k < sight.count; k++) {
        sight.values[k] = k < 3 ? k : at + k - 3;
        sight.by[0][k] = (q[0] * by_q[1][k] - q[1] * by_q[0][k]) / length / length;
        sight.by[1][k] = (k == of_inverse ? 1 / length : 0) -
                         inverse * (q[0] * by_q[0][k] + q[1] * by_q[1][k]) / pow(length, 3);
    }
    sight.by[0][BSLAM_STATE_THETA] -= 1;
    return sight;
}

static sight_t sight_of(const bslam_ekf_t *ekf, const bslam_beacon_t *beacon)
{
    const int at = beacon->at;
    const bool is_ray = beacon->kind == BSLAM_BEACON_RAY;
    const double dx = (double)ekf->mean[at] - (double)ekf->mean[BSLAM_STATE_X];
    const double dy = (double)ekf->mean[at + 1] - (double)ekf->mean[BSLAM_STATE_Y];
    const double rho = is_ray ? (double)ekf->mean[at + 3] : 1;
    const double direction = is_ray ? (double)ekf->mean[at + 2] : 0;
    const double ux = is_ray ? cos(direction) : 0, uy = is_ray ? sin(direction) : 0;
    const double q[2] = {rho * dx + ux, rho * dy + uy};
    double by_q[2][3 + BSLAM_RAY_DIM] = {{-rho, 0, 0, rho, 0, -uy, dx}, {0, -rho, 0, 0, rho, ux, dy}};
    return sight_along(ekf, at, bslam_beacon_dim(beacon->kind), q, rho, by_q, is_ray ? 6 : -1);
}

/// Of a beacon as it is from the robot, whatever is known of where both are on the whole. Negative: the map
/// has none of this label.
static double judge_beacon(const world_t *world, int32_t label)
{
    const bslam_ekf_t *ekf = filter();
    int index = 0;
    while (index < ekf->beacon_count && ekf->beacons[index].label != label) {
        index++;
    }
    if (index == ekf->beacon_count) {
        return -1;
    }
    const sight_t sight = sight_of(ekf, &ekf->beacons[index]);
    double bearing_rad, range_m, lower[3][3] = {{0}};
    see_truly(world, label, &bearing_rad, &range_m);
    const double e[2] = {remainder(sight.bearing_rad - bearing_rad, 2 * PI),
                         sight.inverse_per_m - 1 / range_m};
    for (int i = 0; i < sight.count; i++) {
        for (int j = 0; j < sight.count; j++) {
            const double p = definite_covariance(ekf, sight.values[i], sight.values[j]);
            lower[0][0] += sight.by[0][i] * p * sight.by[0][j];
            lower[1][0] += sight.by[1][i] * p * sight.by[0][j];
            lower[1][1] += sight.by[1][i] * p * sight.by[1][j];
        }
    }
    return nees_of(2, lower, e);
}

static void judge(outcome_t *outcome, const world_t *world, const world_t *start, bool in_last_hour)
{
    double error_m;
    const double nees = judge_pose(world, start, &error_m);
    require(isfinite(nees), "the state is not finite, or its covariance not positive");
    outcome->nees += nees;
    outcome->nees_last += in_last_hour ? nees : 0;
    outcome->error_m += error_m;
    outcome->error_max_m = fmax(outcome->error_max_m, error_m);
}

static void look_closer(outcome_t *outcome, const world_t *world, const bslam_sighting_t *seen, int count)
{
    const double least = definite_least_eigenvalue(&filter()->factor);
    require(isfinite(least), "the covariance is none");
    outcome->least_eigenvalue = fmin(outcome->least_eigenvalue, least);
    const double nees = count > 0 ? judge_beacon(world, seen[0].label) : -1;
    outcome->nees_beacon += nees >= 0 ? nees : 0;
    outcome->beacon_looks += nees >= 0 ? 1 : 0;
}

// ---- a life -----------------------------------------------------------------------------------------------

/// Odometry stops, somebody carries the robot, and odometry goes on.
static void interrupt(world_t *world, long times)
{
    const int turn = (int)(times % 3);
    carry(world, carried[turn] * told_m[turn], carried[turn] * told_rad[turn]);
    require(bslam_resume_odometry(&robot, (bslam_real_t)told_m[turn], (bslam_real_t)told_rad[turn]) ==
                BSLAM_OK,
            "a resumption is refused");
}

static void begin(const life_t *life, int32_t filter_kind)
{
    bslam_settings_t settings = settings_of(life);
    int bad_setting;
    settings.filter = filter_kind;
    if (!life->has_range) {
        bslam_settings_preset(&settings, BSLAM_PRESET_BEARING_ONLY);
    }
    require(bslam_init(&robot, &settings, &bad_setting) == BSLAM_OK, "a setting is refused");
}

/// It may stand for a while before it moves.
static outcome_t soak(const life_t *life, uint64_t seed, long steps, long standing)
{
    world_t world = begin_life(life, seed), start = world;
    outcome_t outcome = {.least_eigenvalue = 1};
    const long doubt = life->doubt_s * (STEPS_AN_HOUR / 3600);
    for (long step = 1; step <= steps; step++) {
        if (step > standing) {
            live(&world);
        }
        if (step == 1) {
            start = world;  // odometry begins with the first reading: the map has the frame of that moment
        }
        if (doubt > 0 && step % doubt == 0) {
            interrupt(&world, step / doubt);
        }
        const bslam_odometry_reading_t reading = read_wheels(&world, step * (int64_t)STEP_US);
        bslam_sighting_t seen[BEACONS];
        const int count = look(&world, seen);
        require(bslam_odometry(&robot, &reading) == BSLAM_OK, "a reading is refused");
        require(bslam_sightings(&robot, reading.time_us, seen, count) == BSLAM_OK, "a frame is refused");
        if (step > STEPS_AT_START) {
            judge(&outcome, &world, &start, step > steps - STEPS_AN_HOUR);
        }
        if (step % STEPS_A_LOOK == 0) {
            look_closer(&outcome, &world, seen, count);
        }
    }
    return outcome;
}

static void print_outcome(const outcome_t *outcome, uint64_t seed, long steps)
{
    const double all = (double)(steps - STEPS_AT_START), last = fmin(all, STEPS_AN_HOUR);
    (void)printf("%llu,%.3f,%.6f,%.6f,%.6f,%.6f,%.6f,%.3g,%u\n", (unsigned long long)seed,
                 (double)steps / STEPS_AN_HOUR, outcome->nees / all, outcome->nees_last / last,
                 outcome->nees_beacon / (double)outcome->beacon_looks, outcome->error_m / all,
                 outcome->error_max_m, outcome->least_eigenvalue,
                 (unsigned)bslam_counters(&robot).slam.insane);
    (void)fflush(stdout);
}

int main(int argc, char **argv)
{
    static const char usage[] = "usage: soak LIFE FILTER FIRST_SEED SEEDS MINUTES STANDSTILL_S";
    require(argc == 7, usage);
    const life_t *life = find_life(argv[1]);
    require(life != NULL, "no such life");
    const long filter_kind = strtol(argv[2], NULL, 10);
    const long first = strtol(argv[3], NULL, 10);
    const long seeds = strtol(argv[4], NULL, 10);
    const long minutes = strtol(argv[5], NULL, 10);
    const long standstill_s = strtol(argv[6], NULL, 10);
    require(first >= 0 && seeds > 0 && minutes > 0 && standstill_s >= 0, usage);
    for (long seed = first; seed < first + seeds; seed++) {
        const long steps = minutes * (STEPS_AN_HOUR / 60);
        begin(life, (int32_t)filter_kind);
        const outcome_t outcome = soak(life, (uint64_t)seed, steps, standstill_s * (STEPS_AN_HOUR / 3600));
        print_outcome(&outcome, (uint64_t)seed, steps);
    }
    return 0;
}
