#include "world.h"

#include <math.h>
#include <string.h>

// The room, the robot and its sensors: host_sim/bslam/scenarios/paper_room.toml.
static const double beacons[BEACONS][2] = {{1.5, 0}, {4, 0}, {8.5, 0}, {2.5, 8}, {7, 8}, {9.5, 8}};
static const double WHEELBASE_M = 0.4;
static const double SPEEDOMETER_SD_MPS = 0.3;
static const double ENCODER_SD_MPS = 0.05;
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
// Of other lives.
static const double SPIN_RADPS = 0.5;
static const double SHUTTLE_MPS = 0.1;
static const double SHUTTLE_S = 60;
static const double PARKED_EVERY_S = 7200;
static const double DRIVES_S = 600;

#define ALL ((1u << BEACONS) - 1)

// ---- chance -----------------------------------------------------------------------------------------------

/// splitmix64: seeds in a row give streams that have nothing in common.
double uniform(chance_t *chance)
{
    chance->state += UINT64_C(0x9e3779b97f4a7c15);
    uint64_t z = chance->state;
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    z ^= z >> 31;
    return ((double)(z >> 11) + 0.5) / 9007199254740992.0;
}

double normal(chance_t *chance)
{
    const double radius = sqrt(-2 * log(uniform(chance)));
    return radius * cos(2 * PI * uniform(chance));
}

// ---- moving -----------------------------------------------------------------------------------------------

static double within(double value, double most)
{
    return fmax(-most, fmin(most, value));
}

static void next_goal(world_t *world)
{
    world->goal_x_m = 1 + 9 * uniform(&world->chance);
    world->goal_y_m = 1 + 6 * uniform(&world->chance);
}

/// Towards one goal after the other, as unsteadily as people steer.
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
}

static void rest(world_t *world)
{
    world->v_mps = world->omega_radps = 0;
}

/// Drives for ten minutes, then stands until two hours are over.
static void park(world_t *world)
{
    (fmod(world->time_s, PARKED_EVERY_S) < DRIVES_S ? drive : rest)(world);
}

static void spin(world_t *world)
{
    world->omega_radps = SPIN_RADPS;
}

/// A straight line, forward and back.
static void shuttle(world_t *world)
{
    world->v_mps = fmod(world->time_s, 2 * SHUTTLE_S) < SHUTTLE_S ? SHUTTLE_MPS : -SHUTTLE_MPS;
}

static const life_t lives[] = {
    {"drive", drive, .in_view = ALL, .has_range = true, .has_speedometers = true},
    {"rest", rest, .in_view = ALL, .has_range = true},
    {"park", park, .in_view = ALL, .has_range = true},
    {"spin", spin, .in_view = ALL, .has_range = true},
    {"shuttle", shuttle, .in_view = ALL, .has_range = true},
    {"one_beacon", drive, .in_view = 1u << 1, .has_range = true},
    {"doubt", drive, .in_view = ALL, .has_range = true, .doubt_s = 60},
    {"directions", drive, .in_view = ALL},
    {"rest_directions", rest, .in_view = ALL},
    {"park_directions", park, .in_view = ALL},
    {"spin_directions", spin, .in_view = ALL},
    {"doubt_directions", drive, .in_view = ALL, .doubt_s = 300},
};

const life_t *find_life(const char *name)
{
    for (size_t i = 0; i < sizeof lives / sizeof lives[0]; i++) {
        if (strcmp(lives[i].name, name) == 0) {
            return &lives[i];
        }
    }
    return NULL;
}

world_t begin_life(const life_t *life, uint64_t seed)
{
    world_t world = {.life = life, .chance = {seed * UINT64_C(1000003)}, .x_m = 1.5, .y_m = 2.5};
    next_goal(&world);
    return world;
}

void live(world_t *world)
{
    world->life->move(world);
    const double middle_rad = world->theta_rad + world->omega_radps * STEP_S / 2;
    world->x_m += world->v_mps * STEP_S * cos(middle_rad);
    world->y_m += world->v_mps * STEP_S * sin(middle_rad);
    world->theta_rad = remainder(world->theta_rad + world->omega_radps * STEP_S, 2 * PI);
    world->time_s += STEP_S;
}

void carry(world_t *world, double sd_m, double sd_rad)
{
    world->x_m += sd_m * normal(&world->chance);
    world->y_m += sd_m * normal(&world->chance);
    world->theta_rad = remainder(world->theta_rad + sd_rad * normal(&world->chance), 2 * PI);
    world->v_mps = world->omega_radps = world->unsteady_radps = 0;
}

// ---- sensors ----------------------------------------------------------------------------------------------

static bslam_real_t measured(double value)
{
    return (bslam_real_t)(float)value;
}

bslam_odometry_reading_t read_wheels(world_t *world, int64_t time_us)
{
    const double left_mps = world->v_mps - world->omega_radps * WHEELBASE_M / 2;
    const double right_mps = world->v_mps + world->omega_radps * WHEELBASE_M / 2;
    const bool stands = world->v_mps == 0 && world->omega_radps == 0;
    const double sd_mps = world->life->has_speedometers ? SPEEDOMETER_SD_MPS : stands ? 0 : ENCODER_SD_MPS;
    bslam_odometry_reading_t reading = {.time_us = time_us, .source = BSLAM_ODOMETRY_WHEELS};
    reading.left_m = measured((left_mps + sd_mps * normal(&world->chance)) * STEP_S);
    reading.right_m = measured((right_mps + sd_mps * normal(&world->chance)) * STEP_S);
    return reading;
}

void see_truly(const world_t *world, int beacon, double *bearing_rad, double *range_m)
{
    const double dx = beacons[beacon][0] - world->x_m;
    const double dy = beacons[beacon][1] - world->y_m;
    *range_m = hypot(dx, dy);
    *bearing_rad = remainder(atan2(dy, dx) - world->theta_rad, 2 * PI);
}

int look(world_t *world, bslam_sighting_t seen[BEACONS])
{
    int count = 0;
    for (int i = 0; i < BEACONS; i++) {
        double bearing_rad, range_m;
        see_truly(world, i, &bearing_rad, &range_m);
        if ((world->life->in_view >> i & 1u) != 0 && fabs(bearing_rad) <= PI / 2) {
            const double range_sd_m = hypot(RANGE_SD_FRACTION * range_m, range_m * range_m / RANGE_SCALE_M);
            bslam_sighting_t *sighting = &seen[count++];
            *sighting = (bslam_sighting_t){
                .bearing_rad = measured(bearing_rad + BEARING_SD_RAD * normal(&world->chance)),
                .has_range = world->life->has_range,
                .label = i};
            if (sighting->has_range) {
                sighting->range_m = measured(range_m + range_sd_m * normal(&world->chance));
            }
        }
    }
    return count;
}

bslam_settings_t settings_of(const life_t *life)
{
    bslam_settings_t settings;
    bslam_settings_preset(&settings, life->has_speedometers ? BSLAM_PRESET_PAPER : BSLAM_PRESET_REAL_WHEELS);
    settings.wheelbase_m = measured(WHEELBASE_M);
    const double wheel_sd_mps = life->has_speedometers ? SPEEDOMETER_SD_MPS : ENCODER_SD_MPS;
    settings.left_speed_sd_mps = settings.right_speed_sd_mps = measured(wheel_sd_mps);
    settings.bearing_sd_rad = measured(BEARING_SD_RAD);
    settings.range_sd_floor_m = 0;
    settings.range_sd_fraction = measured(RANGE_SD_FRACTION);
    settings.range_sd_per_m = measured(1 / RANGE_SCALE_M);
    return settings;
}
