// A robot in a room of twelve beacons, whose owner sets and calls whatever is allowed: settings at the ends
// of their ranges, tiny noises, no motion, clocks near their end, resumptions in all doubt, beacons given,
// taken out and loaded, numbers of all sizes. What an input of the other targets reaches in forty calls, this
// reaches after hundreds, as the world behind the measurements is one.
//
//     adversary PROFILE FIRST_SEED SEEDS STEPS
//
// Profile 0: settings as presets have them, and no odd number. 1: some others. 2: many. The sizes are the
// library's own. Whatever is refused has changed nothing; the state is sound after each call, `insane` is 0,
// and the map can be kept. A line at the end tells what happened; what does not hold ends the program.
#include "fuzz.h"

#include <math.h>
#include <sanitizer/common_interface_defs.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/crc32.h"
#include "map_memory.h"

enum { BEACONS = 12, CALLS = 14, LOOK_EVERY = 25, BLOB_MAX = 1 << 18 };

/// Where the robot is, and what is going on.
typedef struct world {
    int profile;
    double odd;  ///< so many numbers are any number
    double x_m, y_m, theta_rad, v_mps, omega_radps;
    double v_max_mps, omega_max_radps, bearing_sd_rad;
    int64_t now_us;
    uint32_t left_ticks, right_ticks;
    double places[BEACONS][2];
    float signatures[BEACONS][BSLAM_SAMPLE_FEATURES];
    bool has_range, by_looks;
} world_t;

static bslam_t robot, before;
static uint8_t blob[BLOB_MAX];
static uint32_t blob_size;
static uint64_t stream;
static unsigned long seed, step, calls, refusals, saved, loaded, unkept;
static const char *doing = "";

static void tell(void)
{
    (void)fprintf(stderr, "adversary: seed %lu, step %lu, %s\n", seed, step, doing);
}

static void tell_and_end(int signal_number)
{
    tell();
    _Exit(signal_number);
}

static bslam_slam_t *slam(void)
{
    return &bslam_instance(&robot)->slam;
}

// ---- chance -----------------------------------------------------------------------------------------------

static uint64_t bits(void)
{
    stream ^= stream << 13;
    stream ^= stream >> 7;
    stream ^= stream << 17;
    return stream * UINT64_C(0x2545f4914f6cdd1d);
}

static double uniform(double low, double high)
{
    return low + (high - low) * ((double)(bits() >> 11) / 9007199254740992.0);
}

/// 0 to count - 1.
static int any(int count)
{
    return (int)(bits() % (unsigned)count);
}

static bool one_in(int count)
{
    return any(count) == 0;
}

static double normal(void)
{
    return sqrt(-2 * log(uniform(1e-300, 1))) * cos(6.283185307179586 * uniform(0, 1));
}

static double any_number(void)
{
    static const double edges[] = {0,  -0.0, 1e-45, -1e-45, 1e-40,  1.17e-38,   1e-12,       1e-3,     1,
                                   -1, 1e4,  1e12,  -1e12,  9.9e11, 3.14159265, -3.14159265, 6.2831853};
    if (one_in(3)) {
        return edges[any(sizeof edges / sizeof edges[0])];
    }
    return (one_in(2) ? 1 : -1) * pow(10, uniform(-20, 20));
}

/// The number, or now and then any.
static bslam_real_t perhaps(const world_t *world, double value)
{
    return (bslam_real_t)(uniform(0, 1) < world->odd ? any_number() : value);
}

// ---- settings ---------------------------------------------------------------------------------------------

/// Some value of a setting's range, as likely an end of it as any between.
static void set_any(bslam_settings_t *settings)
{
    const bslam_setting_info_t *info;
    const int id = any(bslam_settings_count());
    info = bslam_settings_info(id);
    const double low = (double)info->low, high = (double)info->high;
    const double between = low > 0 ? exp(uniform(log(low), log(high))) : high * pow(10, uniform(-12, 0));
    const double values[] = {low, high, uniform(low, high), between};
    double value = values[any(4)];
    // No more work than a test has time for.
    value = strcmp(info->name, "joint_nodes") == 0 ? fmin(value, 20000) : value;
    value = strcmp(info->name, "learn_budget") == 0 ? fmin(value, 2000) : value;
    const bslam_status_t status =
        bslam_settings_set(settings, id, (bslam_real_t)(info->is_integer ? floor(value) : value));
    (void)status;  // a float beyond the range by a rounding
}

static void begin_robot(const world_t *world)
{
    bslam_settings_t settings;
    bslam_status_t status;
    do {
        bslam_settings_preset(&settings, one_in(2) ? BSLAM_PRESET_PAPER : BSLAM_PRESET_REAL_WHEELS);
        settings.filter = any(3);
        settings.association = any(5);
        settings.motion = any(2);
        settings.velocity_states = any(2);
        settings.scale_states = settings.velocity_states != 0 ? 0 : any(2);
        settings.recovery = any(2);
        settings.guard = any(2);
        settings.sensor_doubt = (bslam_real_t)any(2);
        if (one_in(2)) {
            bslam_settings_preset(&settings, BSLAM_PRESET_BEARING_ONLY);
        }
        for (int n = world->profile == 0 ? 0 : any(world->profile == 1 ? 3 : 12); n > 0; n--) {
            set_any(&settings);
        }
        int bad_setting;
        status = bslam_init(&robot, &settings, &bad_setting);
    } while (status == BSLAM_E_PARAMETER);
    fuzz_require(status == BSLAM_OK);
}

// ---- calls ------------------------------------------------------------------------------------------------

static bslam_status_t call_odometry(world_t *world)
{
    double dt_s = 0.04;
    if (uniform(0, 1) < world->odd) {
        dt_s = one_in(2) ? 1e-6 : uniform(0, 4.1);
    }
    if (one_in(25)) {
        world->v_mps = one_in(5) ? 0 : uniform(-0.3, 1) * world->v_max_mps;
        world->omega_radps = one_in(5) ? 0 : uniform(-1, 1) * world->omega_max_radps;
    }
    const double middle_rad = world->theta_rad + world->omega_radps * dt_s / 2;
    const double travel_m = world->v_mps * dt_s, turn_m = world->omega_radps * dt_s * 0.2;
    world->x_m += travel_m * cos(middle_rad);
    world->y_m += travel_m * sin(middle_rad);
    world->theta_rad = remainder(world->theta_rad + world->omega_radps * dt_s, 6.283185307179586);
    world->left_ticks += (uint32_t)(int32_t)((travel_m - turn_m) * 3000);
    world->right_ticks += (uint32_t)(int32_t)((travel_m + turn_m) * 3000);
    bslam_odometry_reading_t reading = {
        .time_us = world->now_us + (int64_t)(dt_s * 1e6),
        .source = (bslam_odometry_source_t)(uniform(0, 1) < world->odd ? any(4) : 2),
        .left_ticks = world->left_ticks & 0xffffu,
        .right_ticks = (uniform(0, 1) < world->odd ? (uint32_t)bits() : world->right_ticks) & 0xffffu,
        .left_m = perhaps(world, travel_m - turn_m),
        .right_m = perhaps(world, travel_m + turn_m + 0.001 * normal()),
        .v_mps = perhaps(world, world->v_mps + 0.05 * normal()),
        .omega_radps = perhaps(world, world->omega_radps + 0.05 * normal()),
        .has_gyro = one_in(4),
        .gyro_radps = perhaps(world, world->omega_radps),
        .gyro_sd_radps = perhaps(world, 0.01)};
    if (uniform(0, 4) < world->odd) {
        reading.time_us = one_in(2) ? INT64_MAX / 2 : (int64_t)bits();
    }
    const bslam_status_t status = bslam_odometry(&robot, &reading);
    world->now_us = status == BSLAM_OK ? reading.time_us : world->now_us;
    return status;
}

static bslam_sighting_t see(const world_t *world, int b)
{
    const double dx = world->places[b][0] - world->x_m, dy = world->places[b][1] - world->y_m;
    const double bearing_rad = remainder(atan2(dy, dx) - world->theta_rad, 6.283185307179586);
    bslam_sighting_t sighting = {.bearing_rad =
                                     perhaps(world, bearing_rad + world->bearing_sd_rad * normal()),
                                 .has_range = world->has_range && !one_in(6),
                                 .label = world->by_looks ? BSLAM_LABEL_NONE : b,
                                 .beacon_class = (uint8_t)(one_in(5)         ? any(256)
                                                           : world->by_looks ? 1 + b % 3
                                                                             : 0),
                                 .score = one_in(2) ? 0 : perhaps(world, uniform(-1, 3))};
    if (sighting.has_range) {
        sighting.range_m = perhaps(world, fmax(0.002, hypot(dx, dy) * (1 + 0.02 * normal())));
    }
    if (uniform(0, 1) < 0.3) {
        sighting.bearing_sd_rad = perhaps(world, pow(10, uniform(-4.9, 0.3)));
        sighting.range_sd_m = perhaps(world, pow(10, uniform(-2.9, 1)));
    }
    if (uniform(0, 1) < world->odd) {
        sighting.range_scale_sd = perhaps(world, uniform(0, 1));
        sighting.label = (int32_t)(bits() >> 33);
    }
    sighting.signature = world->by_looks ? world->signatures[b] : NULL;
    return sighting;
}

static bslam_status_t call_sightings(world_t *world)
{
    static bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX + 2];
    int count = 0;
    memset(seen, 0, sizeof seen);
    for (int b = 0; b < BEACONS && count < 5; b++) {
        if (one_in(3)) {
            seen[count++] = see(world, b);
        }
    }
    for (int i = 1; i < count; i++) {
        seen[i] = uniform(0, 1) < world->odd ? seen[i - 1] : seen[i];
    }
    count = uniform(0, 1) < world->odd ? any(BSLAM_SIGHTINGS_MAX + 2) : count;
    const double late_us = uniform(0, 1) < world->odd ? uniform(-1e6, 1e6) : uniform(0, 30000);
    return bslam_sightings(&robot, world->now_us - (int64_t)late_us, seen, count);
}

static bslam_status_t call_resume(world_t *world)
{
    const bslam_status_t status =
        bslam_resume_odometry(&robot, perhaps(world, uniform(0, 30)), perhaps(world, uniform(0, 3.2)));
    world->now_us += status == BSLAM_OK && one_in(3) ? (int64_t)uniform(0, 1e9) : 0;
    return status;
}

static bslam_status_t call_set_pose(world_t *world)
{
    const bslam_pose_t pose = {perhaps(world, world->x_m), perhaps(world, world->y_m),
                               perhaps(world, world->theta_rad)};
    return bslam_set_pose(&robot, one_in(4) ? NULL : &pose, perhaps(world, uniform(0, 2)),
                          perhaps(world, uniform(0, 1)));
}

static bslam_status_t call_add_known(world_t *world)
{
    return bslam_add_known_beacon(&robot, any(40) - 1, perhaps(world, uniform(-5, 5)),
                                  perhaps(world, uniform(-5, 5)));
}

static bslam_status_t call_remove(world_t *world)
{
    const int count = (int)bslam_health(&robot).beacons;
    bslam_beacon_view_t view = {.uid = (uint32_t)any(100)};
    (void)world;
    if (count > 0 && !one_in(3)) {
        fuzz_require(bslam_beacon(&robot, any(count), &view) == BSLAM_OK);
    }
    return bslam_remove_beacon(&robot, one_in(40) ? BSLAM_ALL_BEACONS : view.uid);
}

static bslam_status_t call_pose_at(world_t *world)
{
    bslam_pose_t pose = {0, 0, 0};
    const bslam_status_t status = bslam_pose_at(&robot, world->now_us - (int64_t)uniform(-3e5, 2e6), &pose);
    fuzz_require(isfinite((double)pose.x_m) && isfinite((double)pose.y_m) &&
                 isfinite((double)pose.theta_rad));
    return status;
}

static bslam_status_t call_save(world_t *world)
{
    map_memory_t memory = {blob, sizeof blob, 0};
    const bslam_map_sink_t sink = map_to_memory(&memory);
    (void)world;
    const bslam_status_t status = bslam_save_map(&robot, &sink, &blob_size);
    fuzz_require(status != BSLAM_OK || memory.count == blob_size);
    blob_size = status == BSLAM_OK ? blob_size : 0;
    saved += status == BSLAM_OK ? 1 : 0;
    return status;
}

static void put_u32(uint8_t *to, uint32_t value)
{
    for (int i = 0; i < 4; i++) {
        to[i] = (uint8_t)(value >> 8 * i);
    }
}

/// The map that was saved, or that with some numbers exchanged: what is whole may hold anything.
static bslam_status_t call_load(world_t *world)
{
    static uint8_t changed[BLOB_MAX];
    if (blob_size == 0) {
        return BSLAM_OK;
    }
    memcpy(changed, blob, blob_size);
    for (int n = any(3) * any(4); n > 0; n--) {
        const uint32_t at = (uint32_t)any((int)blob_size / 4) * 4;
        const float value = (float)any_number();
        memcpy(&changed[at], &value, sizeof value);
    }
    put_u32(&changed[8], blob_size);
    put_u32(&changed[blob_size - 4], ~bslam_crc32_add(BSLAM_CRC32_START, changed, blob_size - 4));
    const bslam_map_source_t source = map_from_memory(changed, blob_size);
    bslam_map_fault_t fault;
    bslam_freeze_map(&robot, one_in(4));
    memcpy(&before, &robot, sizeof before);
    const bslam_status_t status = bslam_load_map(&robot, &source, &fault);
    fuzz_require((status == BSLAM_OK) == (fault == BSLAM_MAP_FINE));
    loaded += status == BSLAM_OK ? 1 : 0;
    if (status == BSLAM_OK && one_in(2)) {
        const bslam_pose_t pose = {(bslam_real_t)world->x_m, (bslam_real_t)world->y_m,
                                   (bslam_real_t)world->theta_rad};
        fuzz_require(bslam_set_pose(&robot, &pose, (bslam_real_t)0.2, (bslam_real_t)0.1) == BSLAM_OK);
    }
    return status;
}

static bslam_status_t call_freeze(world_t *world)
{
    (void)world;
    bslam_freeze_map(&robot, one_in(4));
    return BSLAM_OK;
}

/// As after a reset, with the memory as it was.
static bslam_status_t call_restart(world_t *world)
{
    return bslam_restart(&robot, perhaps(world, uniform(0, 3)), perhaps(world, uniform(0, 1)));
}

static const struct {
    const char *name;
    bslam_status_t (*call)(world_t *world);
} events[] = {{"odometry", call_odometry}, {"sightings", call_sightings}, {"resume", call_resume},
              {"set_pose", call_set_pose}, {"add_known", call_add_known}, {"remove", call_remove},
              {"pose_at", call_pose_at},   {"save", call_save},           {"load", call_load},
              {"freeze", call_freeze},     {"restart", call_restart}};

// ---- what must hold ---------------------------------------------------------------------------------------

/// What a refused call may have touched: fuzz/api.c.
static void require_unchanged(bslam_status_t status)
{
    bslam_instance_t *was = bslam_instance(&before), *is = bslam_instance(&robot);
    was->slam.counters = is->slam.counters;
    was->slam.bad_sighting = is->slam.bad_sighting;
    was->slam.watch = is->slam.watch;
    if (status == BSLAM_E_JUMP) {
        was->slam.odometry = is->slam.odometry;
    }
    was->guard = is->guard;
    was->copy = is->copy;
    fuzz_require(memcmp(&robot, &before, sizeof robot) == 0);
    refusals++;
}

static void begin_world(world_t *world)
{
    static const double odds[] = {0, 0.002, 0.02, 0.3};
    memset(world->signatures, 0, sizeof world->signatures);
    for (int b = 0; b < BEACONS; b++) {
        world->places[b][0] = uniform(-6, 6);
        world->places[b][1] = uniform(-6, 6);
        for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
            world->signatures[b][k] = (float)uniform(0, 0.1);
        }
        world->signatures[b][3 * b] = 0.9f;
    }
    world->odd = world->profile == 0 ? 0 : odds[any(4)];
    world->has_range = !one_in(3);
    world->by_looks = one_in(2);
    world->v_max_mps = one_in(3) ? uniform(0, 15) : 0.6;
    world->omega_max_radps = one_in(3) ? uniform(0, 20) : 0.8;
    world->bearing_sd_rad = 0.0136;
    world->now_us = one_in(6)   ? INT64_MAX / 2 - (int64_t)uniform(0, 2e7)
                    : one_in(3) ? 0
                                : (int64_t)(bits() >> 20);
}

static void live(int profile, unsigned long steps)
{
    world_t world = {.profile = profile};
    stream = (seed + 1) * UINT64_C(0x9e3779b97f4a7c15) + (uint64_t)profile;
    for (int i = 0; i < 8; i++) {
        (void)bits();
    }
    memset(&robot, 0, sizeof robot);
    blob_size = 0;
    begin_world(&world);
    begin_robot(&world);
    for (step = 0; step < steps; step++) {
        const bool is_special = uniform(0, 1) < (profile == 0 ? 0.02 : 0.08);
        const int event = is_special ? 2 + any(sizeof events / sizeof events[0] - 2) : any(2);
        doing = events[event].name;
        memcpy(&before, &robot, sizeof before);
        const bslam_status_t status = events[event].call(&world);
        calls++;
        if (status != BSLAM_OK) {
            require_unchanged(status);
        }
        fuzz_require_sound(slam());
        fuzz_require(bslam_counters(&robot).slam.insane == 0);
        if (step % LOOK_EVERY == 0) {
            unkept += fuzz_require_kept(slam()) ? 0 : 1;
        }
    }
    unkept += fuzz_require_kept(slam()) ? 0 : 1;
}

int main(int argc, char **argv)
{
    if (argc != 5) {
        (void)fprintf(stderr, "usage: %s PROFILE FIRST_SEED SEEDS STEPS\n", argv[0]);
        return 2;
    }
    const int profile = atoi(argv[1]);
    const unsigned long first = strtoul(argv[2], NULL, 10), seeds = strtoul(argv[3], NULL, 10);
    (void)signal(SIGABRT, tell_and_end);
    __sanitizer_set_death_callback(tell);
    for (seed = first; seed < first + seeds; seed++) {
        live(profile, strtoul(argv[4], NULL, 10));
    }
    (void)printf(
        "adversary: profile %d, %lu seeds: %lu calls, %lu refused; %lu maps saved, %lu loaded, %lu with a "
        "number too large\n",
        profile, seeds, calls, refusals, saved, loaded, unkept);
    return 0;
}
