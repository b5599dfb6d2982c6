/// A room, as the paper's without its middle wall, a robot that leads one of several lives in it, and what
/// its sensors say. All of it in double, whatever the filter's scalar; what is measured is rounded to
/// float32: the float build and its double twin get the same numbers.
#ifndef SOAK_WORLD_H
#define SOAK_WORLD_H

#include <stdint.h>

#include "bslam/bslam.h"

#define PI 3.14159265358979323846
#define STEP_S 0.04
#define STEP_US 40000
#define STEPS_AN_HOUR 90000

enum { BEACONS = 6 };

typedef struct chance {
    uint64_t state;
} chance_t;

double uniform(chance_t *chance);
double normal(chance_t *chance);

typedef struct life life_t;

typedef struct world {
    const life_t *life;
    chance_t chance;
    double time_s;
    double x_m, y_m, theta_rad;
    double v_mps, omega_radps;
    double unsteady_radps;  ///< of its steering
    double goal_x_m, goal_y_m;
} world_t;

struct life {
    const char *name;
    void (*move)(world_t *world);  ///< the speeds of the next step
    unsigned in_view;              ///< a bit a beacon that there is
    bool has_range;                ///< it sees distances
    bool has_speedometers;         ///< whose readings err at rest, too; else encoders
    int32_t doubt_s;               ///< carried, and resumed in doubt, so often; 0: never
};

/// The life of this name; NULL: there is none.
const life_t *find_life(const char *name);

/// Where it stands at first.
world_t begin_life(const life_t *life, uint64_t seed);

/// A step.
void live(world_t *world);

/// Somebody pushes it, as far as this on average.
void carry(world_t *world, double sd_m, double sd_rad);

bslam_odometry_reading_t read_wheels(world_t *world, int64_t time_us);

/// What it sees of the half in front of it. Returns how many.
int look(world_t *world, bslam_sighting_t seen[BEACONS]);

/// Where a beacon is from the robot.
void see_truly(const world_t *world, int beacon, double *bearing_rad, double *range_m);

/// What a filter should know of room and sensors.
bslam_settings_t settings_of(const life_t *life);

#endif
