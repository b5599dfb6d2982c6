// A robot in a room of five beacons, of which the map holds four: drives, is carried, slips, is told wrong
// labels, sees some and not others, forgets. With the recovery in front of the pipeline or without, the
// smoother behind it or without, by labels or by looks, with distances or directions alone. Whatever happens,
// the state stays sound, and no pose jumps silently: what was withheld has changed nothing but the time, and
// a robot that is lost or was found again has the map it had.
#include "fuzz.h"

#include <string.h>

#include "base/trig.h"
#include "bslam/recovery/recovery.h"
#include "base/scalar.h"
#include "bslam/slam/doubt.h"

enum { BEACONS = 5, FRAMES_MAX = 48, STEP_US = 40000 };

static const double places[BEACONS][2] = {{3, 1}, {4, -2}, {-2, 2}, {-3, -3}, {1, 4}};

/// What the pipeline lives in.
typedef struct robot {
    bslam_slam_t slam;
    bslam_appearance_t appearance;
    bslam_smoother_t smoother;
    bslam_recovery_t recovery;
    bslam_doubts_t doubts;
} robot_t;

/// Where the robot is, and how it sees.
typedef struct world {
    double x_m, y_m, theta_rad;
    int64_t now_us;
    unsigned in_view;  ///< a bit a beacon
    unsigned swap;   ///< by so much labels and looks are those of another beacon; from BEACONS on: all of one
    double stretch;  ///< of distances
    bool has_range;
    bool by_looks;
    bool has_recovery;
    int frames;
} world_t;

static robot_t robot;

static void make_signature(unsigned beacon, float signature[BSLAM_SAMPLE_FEATURES])
{
    memset(signature, 0, BSLAM_SAMPLE_FEATURES * sizeof signature[0]);
    signature[3 * beacon] = 0.9f;
    signature[3 * beacon + 1] = 0.4f;
}

/// Three beacons in view at most: as many sightings as a frame takes in this build.
static int look(const world_t *world, bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX],
                float signatures[BSLAM_SIGHTINGS_MAX][BSLAM_SAMPLE_FEATURES])
{
    int count = 0;
    for (unsigned b = 0; b < BEACONS && count < BSLAM_SIGHTINGS_MAX; b++) {
        const double dx = places[b][0] - world->x_m;
        const double dy = places[b][1] - world->y_m;
        const unsigned looks_like =
            world->swap < BEACONS ? (b + world->swap) % BEACONS : world->swap - BEACONS;
        if ((world->in_view >> b & 1u) == 0) {
            continue;
        }
        seen[count] = (bslam_sighting_t){
            .bearing_rad = (bslam_real_t)remainder(atan2(dy, dx) - world->theta_rad, 2 * (double)BSLAM_PI),
            .range_m = world->has_range ? (bslam_real_t)fmax(0.05, world->stretch * hypot(dx, dy)) : 0,
            .has_range = world->has_range,
            .label = world->by_looks ? BSLAM_LABEL_NONE : (int32_t)looks_like};
        if (world->by_looks) {
            make_signature(looks_like, signatures[count]);
            seen[count].signature = signatures[count];
        }
        count++;
    }
    return count;
}

// ---- what must hold ---------------------------------------------------------------------------------------

/// Whether some values of two filters' means are the same.
static bool same_mean(const bslam_ekf_t *a, const bslam_ekf_t *b, int from, int to)
{
    return memcmp(&a->mean[from], &b->mean[from], (size_t)(to - from) * sizeof a->mean[0]) == 0;
}

/// `unseeing` is the filter that had a frame without sightings instead. A smoother goes on with what it has
/// while the robot is lost, and begins anew where it is found.
static void require_no_silent_jump(const bslam_ekf_t *unseeing, const bslam_recovery_counters_t *was,
                                   bool was_lost)
{
    const bslam_recovery_counters_t *is = &robot.recovery.counters;
    const bslam_slam_t *slam = &robot.slam;
    if (is->lost == was->lost && is->found == was->found && is->withheld > was->withheld && !was_lost) {
        fuzz_require(same_mean(unseeing, &slam->ekf, 0, slam->ekf.base_dim));
    }
    if (was_lost) {
        fuzz_require(unseeing->dim == slam->ekf.dim);
        fuzz_require(slam->smoother != NULL ||
                     same_mean(unseeing, &slam->ekf, slam->ekf.base_dim, slam->ekf.dim));
        fuzz_require(slam->is_lost == (is->found == was->found));
    } else {
        fuzz_require(slam->is_lost == (is->lost > was->lost));
        fuzz_require(is->found == was->found);
    }
    fuzz_require((bslam_recovery_state(&robot.recovery, slam) == BSLAM_RECOVERY_LOST) == slam->is_lost);
}

// ---- a drive ----------------------------------------------------------------------------------------------

static void take_frame(const world_t *world)
{
    static robot_t before;
    bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX];
    float signatures[BSLAM_SIGHTINGS_MAX][BSLAM_SAMPLE_FEATURES];
    const int count = look(world, seen, signatures);
    const int64_t now_us = world->now_us;
    if (!world->has_recovery) {
        const bslam_status_t status = bslam_slam_sightings(&robot.slam, now_us, seen, count);
        fuzz_require(status == BSLAM_OK || status == BSLAM_E_TIME);
        return;
    }
    const bool was_lost = robot.slam.is_lost;
    memcpy(&before, &robot, sizeof robot);
    const bslam_status_t expected = bslam_slam_sightings(&robot.slam, now_us, NULL, 0);
    const bslam_ekf_t unseeing = robot.slam.ekf;
    memcpy(&robot, &before, sizeof robot);
    const bslam_status_t status = bslam_recovery_sightings(&robot.recovery, &robot.slam, now_us, seen, count);
    fuzz_require(status == expected && (status == BSLAM_OK || status == BSLAM_E_TIME));
    if (status == BSLAM_OK) {
        require_no_silent_jump(&unseeing, &before.recovery.counters, was_lost);
    }
}

/// Frames of a drive along an arc, wheels and all.
static void drive(world_t *world, int frames, double v_mps, double omega_radps)
{
    for (; frames > 0 && world->frames < FRAMES_MAX; frames--) {
        const double turn_rad = omega_radps * STEP_US * 1e-6;
        const double travelled_m = v_mps * STEP_US * 1e-6;
        world->x_m += travelled_m * cos(world->theta_rad + turn_rad / 2);
        world->y_m += travelled_m * sin(world->theta_rad + turn_rad / 2);
        world->theta_rad += turn_rad;
        world->now_us += STEP_US;
        world->frames++;
        const bslam_odometry_reading_t reading = {.time_us = world->now_us,
                                                  .source = BSLAM_ODOMETRY_VELOCITY,
                                                  .v_mps = (bslam_real_t)v_mps,
                                                  .omega_radps = (bslam_real_t)omega_radps};
        const bslam_status_t status = bslam_slam_odometry(&robot.slam, &reading);
        fuzz_require(status == BSLAM_OK || status == BSLAM_E_TIME || status == BSLAM_E_RANGE);
        take_frame(world);
        fuzz_require_sound(&robot.slam);
    }
}

static double within(fuzz_input_t *input, double most)
{
    return most * (fuzz_u8(input) - 128) / 128.0;
}

static void happen(fuzz_input_t *input, world_t *world)
{
    const unsigned what = fuzz_u8(input);
    if (what < 160) {
        const double omega_radps = within(input, 1.5);
        drive(world, 1 + (int)(what % 8), 0.05 * (what / 8), omega_radps);
        return;
    }
    switch (what % 10) {
    case 0:
        world->x_m = within(input, 5);
        world->y_m = within(input, 5);
        world->theta_rad = within(input, 3);
        break;
    case 1:
        world->swap = fuzz_u8(input) % (2 * BEACONS);
        break;
    case 2:
        world->now_us += (int64_t)fuzz_u8(input) * STEP_US;
        break;
    case 3:
        world->stretch = 1 + within(input, 0.9);
        break;
    case 4:
        (void)!bslam_slam_remove_beacon(&robot.slam, fuzz_u8(input) % 8);
        break;
    case 5:
        (void)!bslam_slam_add_known_beacon(&robot.slam, 4, (bslam_real_t)places[4][0],
                                           (bslam_real_t)places[4][1]);
        break;
    case 6:
        bslam_slam_lose_pose(&robot.slam);
        break;
    case 7:
        world->has_range = !world->has_range;
        break;
    default:
        world->in_view = fuzz_u8(input);
        break;
    }
}

/// A robot that knows four beacons: by labels, by looks, in directions alone.
static void prepare(robot_t *start, world_t *world, unsigned how)
{
    static robot_t made[8];
    static world_t stands[8];
    if (stands[how].now_us == 0) {
        bslam_settings_t settings;
        int bad_id;
        bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
        settings.association = (how & 1u) != 0 ? BSLAM_ASSOCIATION_SVM : BSLAM_ASSOCIATION_KNOWN;
        settings.filter = (how & 4u) != 0 ? BSLAM_FILTER_SMOOTHER : BSLAM_FILTER_INVARIANT;
        settings.learn_budget = 50;
        settings.confirm_travel_m = 0;
        fuzz_require(bslam_slam_init(&robot.slam, &settings, &bad_id) == BSLAM_OK);
        fuzz_require(bslam_appearance_init(&robot.appearance, NULL, 0) == BSLAM_OK);
        bslam_slam_attach_appearance(&robot.slam, (how & 1u) != 0 ? &robot.appearance : NULL);
        bslam_slam_attach_smoother(&robot.slam, (how & 4u) != 0 ? &robot.smoother : NULL);
        bslam_slam_attach_doubts(&robot.slam, &robot.doubts);
        robot.recovery = (bslam_recovery_t){0};
        *world = (world_t){.stretch = 1, .has_range = (how & 2u) == 0, .by_looks = (how & 1u) != 0};
        for (int k = 0; k < 12; k++) {
            world->in_view = k % 2 == 0 ? 7u : 14u;
            drive(world, 1, 0.5, 0.2);
        }
        world->frames = 0;
        made[how] = robot;
        stands[how] = *world;
    }
    *start = made[how];
    *world = stands[how];
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_input_t input = {data, size};
    world_t world;
    const unsigned choice = fuzz_u8(&input);
    prepare(&robot, &world, choice & 7u);
    world.has_recovery = (choice & 8u) == 0;
    while (input.left > 0 && world.frames < FRAMES_MAX) {
        happen(&input, &world);
        fuzz_require_sound(&robot.slam);
    }
    (void)fuzz_require_kept(&robot.slam);
    return 0;
}
