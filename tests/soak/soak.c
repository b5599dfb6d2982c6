// Hours in a room, as the paper's without its middle wall: drives, measures, feeds the filter, and compares
// it with the truth at each step. One line a seed:
//
//     seed,hours,nees,nees_last_hour,error_m,repairs
//
// The filter has the library's own parameters, and the noise that the room is made with. The world is
// computed in double whatever the filter's scalar, and what the sensors say is rounded to float32: the float
// build and its double twin get the same numbers.
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "bslam/bslam.h"

#define PI 3.14159265358979323846
#define STEP_S 0.04
#define STEP_US 40000
#define STEPS_AN_HOUR 90000
/// Not judged: the pose of the start is exact, and its covariance has no inverse.
#define STEPS_AT_START 250

// The room, the robot and its sensors: host_sim/bslam/scenarios/paper_room.toml.
enum { BEACONS = 6 };
static const double beacons[BEACONS][2] = {{1.5, 0}, {4, 0}, {8.5, 0}, {2.5, 8}, {7, 8}, {9.5, 8}};
static const double WHEELBASE_M = 0.4;
static const double WHEEL_SD_MPS = 0.3;
static const double BEARING_SD_RAD = 0.013575;
static const double RANGE_SD_FRACTION = 0.02;
static const double RANGE_SCALE_M = 110.9;
static const double SPEED_MPS = 0.4;
static const double ACCELERATION_MPS2 = 0.5;
static const double TURN_RATE_RADPS = 1.0;
static const double TURN_ACCELERATION_RADPS2 = 3.0;
static const double HEADING_GAIN_PER_S = 1.4;
static const double TURN_NOISE_RADPS = 0.43;
static const double TURN_NOISE_TIME_S = 1.4;
static const double TURN_ON_SPOT_RAD = 1.1;

// ---- chance -----------------------------------------------------------------------------------------------

typedef struct chance {
    uint64_t state;
} chance_t;

/// splitmix64: seeds in a row give streams that have nothing in common.
static double uniform(chance_t *chance)
{
    chance->state += UINT64_C(0x9e3779b97f4a7c15);
    uint64_t z = chance->state;
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    z ^= z >> 31;
    return ((double)(z >> 11) + 0.5) / 9007199254740992.0;
}

static double normal(chance_t *chance)
{
    const double radius = sqrt(-2 * log(uniform(chance)));
    return radius * cos(2 * PI * uniform(chance));
}

// ---- the world --------------------------------------------------------------------------------------------

typedef struct world {
    chance_t chance;
    double x_m, y_m, theta_rad;
    double v_mps, omega_radps;
    double unsteady_radps;  ///< of its steering
    double goal_x_m, goal_y_m;
} world_t;

static double within(double value, double most)
{
    return fmax(-most, fmin(most, value));
}

static void next_goal(world_t *world)
{
    world->goal_x_m = 1 + 9 * uniform(&world->chance);
    world->goal_y_m = 1 + 6 * uniform(&world->chance);
}

static world_t begin(uint64_t seed)
{
    world_t world = {.chance = {seed * UINT64_C(1000003)}, .x_m = 1.5, .y_m = 2.5};
    next_goal(&world);
    return world;
}

/// A step towards the goal, along an arc.
static void drive(world_t *world)
{
    const double dx = world->goal_x_m - world->x_m;
    const double dy = world->goal_y_m - world->y_m;
    if (hypot(dx, dy) < 0.4) {
        next_goal(world);
    }
    const double off_rad = remainder(atan2(dy, dx) - world->theta_rad, 2 * PI);
    const double keep = exp(-STEP_S / TURN_NOISE_TIME_S);
    world->unsteady_radps =
        keep * world->unsteady_radps + TURN_NOISE_RADPS * sqrt(1 - keep * keep) * normal(&world->chance);
    const double turn = within(HEADING_GAIN_PER_S * off_rad, TURN_RATE_RADPS) + world->unsteady_radps;
    const double speed = fabs(off_rad) > TURN_ON_SPOT_RAD ? 0 : SPEED_MPS;
    world->omega_radps += within(turn - world->omega_radps, TURN_ACCELERATION_RADPS2 * STEP_S);
    world->v_mps += within(speed - world->v_mps, ACCELERATION_MPS2 * STEP_S);
    const double middle_rad = world->theta_rad + world->omega_radps * STEP_S / 2;
    world->x_m += world->v_mps * STEP_S * cos(middle_rad);
    world->y_m += world->v_mps * STEP_S * sin(middle_rad);
    world->theta_rad = remainder(world->theta_rad + world->omega_radps * STEP_S, 2 * PI);
}

static bslam_real_t measured(double value)
{
    return (bslam_real_t)(float)value;
}

static bslam_odometry_reading_t read_wheels(world_t *world, int64_t time_us)
{
    const double left_mps = world->v_mps - world->omega_radps * WHEELBASE_M / 2;
    const double right_mps = world->v_mps + world->omega_radps * WHEELBASE_M / 2;
    bslam_odometry_reading_t reading = {.time_us = time_us, .source = BSLAM_ODOMETRY_WHEELS};
    reading.left_m = measured((left_mps + WHEEL_SD_MPS * normal(&world->chance)) * STEP_S);
    reading.right_m = measured((right_mps + WHEEL_SD_MPS * normal(&world->chance)) * STEP_S);
    return reading;
}

/// Beacons in the half in front of the robot.
static int look(world_t *world, bslam_sighting_t seen[BEACONS])
{
    int count = 0;
    for (int i = 0; i < BEACONS; i++) {
        const double dx = beacons[i][0] - world->x_m;
        const double dy = beacons[i][1] - world->y_m;
        const double range_m = hypot(dx, dy);
        const double bearing_rad = remainder(atan2(dy, dx) - world->theta_rad, 2 * PI);
        if (fabs(bearing_rad) <= PI / 2) {
            const double range_sd_m = hypot(RANGE_SD_FRACTION * range_m, range_m * range_m / RANGE_SCALE_M);
            seen[count++] = (bslam_sighting_t){
                .bearing_rad = measured(bearing_rad + BEARING_SD_RAD * normal(&world->chance)),
                .range_m = measured(range_m + range_sd_m * normal(&world->chance)),
                .has_range = true,
                .label = i};
        }
    }
    return count;
}

// ---- the filter against the truth -------------------------------------------------------------------------

static bslam_settings_t filter_params(void)
{
    bslam_settings_t settings;
    bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
    settings.wheelbase_m = measured(WHEELBASE_M);
    settings.left_speed_sd_mps = measured(WHEEL_SD_MPS);
    settings.right_speed_sd_mps = measured(WHEEL_SD_MPS);
    settings.bearing_sd_rad = measured(BEARING_SD_RAD);
    settings.range_sd_floor_m = 0;
    settings.range_sd_fraction = measured(RANGE_SD_FRACTION);
    settings.range_sd_per_m = measured(1 / RANGE_SCALE_M);
    return settings;
}

/// eᵀ P⁻¹ e of the pose, by Cholesky's factor of P in double.
static double nees_of(const bslam_t *slam, const double e[3])
{
    bslam_real_t lower[6];
    bslam_pose_covariance(slam, lower);
    const double l00 = sqrt((double)lower[0]);
    const double l10 = (double)lower[1] / l00;
    const double l11 = sqrt((double)lower[2] - l10 * l10);
    const double l20 = (double)lower[3] / l00;
    const double l21 = ((double)lower[4] - l20 * l10) / l11;
    const double l22 = sqrt((double)lower[5] - l20 * l20 - l21 * l21);
    const double w0 = e[0] / l00;
    const double w1 = (e[1] - l10 * w0) / l11;
    const double w2 = (e[2] - l20 * w0 - l21 * w1) / l22;
    return w0 * w0 + w1 * w1 + w2 * w2;
}

/// The filter's error in the frame of the start, where the map's is.
static void error_of(const bslam_t *slam, const world_t *world, const world_t *start, double e[3])
{
    const bslam_pose_t pose = bslam_pose(slam);
    const double dx = world->x_m - start->x_m;
    const double dy = world->y_m - start->y_m;
    const double sine = sin(start->theta_rad);
    const double cosine = cos(start->theta_rad);
    e[0] = (double)pose.x_m - (cosine * dx + sine * dy);
    e[1] = (double)pose.y_m - (cosine * dy - sine * dx);
    e[2] = remainder((double)pose.theta_rad - (world->theta_rad - start->theta_rad), 2 * PI);
}

static void require(bool condition, const char *what)
{
    if (!condition) {
        (void)fprintf(stderr, "soak: %s\n", what);
        exit(1);
    }
}

/// It may stand for a while before it drives off.
static void soak(uint64_t seed, long steps, long standing)
{
    static bslam_t slam;
    const bslam_settings_t settings = filter_params();
    int bad_id;
    require(bslam_init(&slam, &settings, &bad_id) == BSLAM_OK, "a parameter is refused");
    world_t world = begin(seed);
    world_t start = world;
    double nees = 0;
    double nees_last = 0;
    double error_m = 0;
    for (long step = 1; step <= steps; step++) {
        if (step > standing) {
            drive(&world);
        }
        if (step == 1) {
            start = world;  // odometry begins with the first reading: the map has the frame of that moment
        }
        const bslam_odometry_reading_t reading = read_wheels(&world, step * (int64_t)STEP_US);
        bslam_sighting_t seen[BEACONS];
        const int count = look(&world, seen);
        require(bslam_odometry(&slam, &reading) == BSLAM_OK, "a reading is refused");
        require(bslam_sightings(&slam, reading.time_us, seen, count) == BSLAM_OK, "a frame is refused");
        if (step <= STEPS_AT_START) {
            continue;
        }
        double e[3];
        error_of(&slam, &world, &start, e);
        const double now = nees_of(&slam, e);
        require(isfinite(now), "the state is not finite, or its covariance not positive");
        nees += now;
        nees_last += step > steps - STEPS_AN_HOUR ? now : 0;
        error_m += hypot(e[0], e[1]);
    }
    const double all = (double)(steps - STEPS_AT_START);
    const double last = fmin(all, STEPS_AN_HOUR);
    (void)printf("%llu,%.3f,%.6f,%.6f,%.6f,%u\n", (unsigned long long)seed, (double)steps / STEPS_AN_HOUR,
                 nees / all, nees_last / last, error_m / all, (unsigned)bslam_counters(&slam).slam.insane);
    (void)fflush(stdout);
}

int main(int argc, char **argv)
{
    static const char usage[] = "usage: soak FIRST_SEED SEEDS MINUTES STANDSTILL_S";
    require(argc == 5, usage);
    const long first = strtol(argv[1], NULL, 10);
    const long seeds = strtol(argv[2], NULL, 10);
    const long minutes = strtol(argv[3], NULL, 10);
    const long standstill_s = strtol(argv[4], NULL, 10);
    require(first >= 0 && seeds > 0 && minutes > 0 && standstill_s >= 0, usage);
    for (long seed = first; seed < first + seeds; seed++) {
        soak((uint64_t)seed, minutes * (STEPS_AN_HOUR / 60), standstill_s * (STEPS_AN_HOUR / 3600));
    }
    return 0;
}
