// The robot object on a board of nothing but memory, with a camera.
#define ROBOT_VISION 1
#include "support.h"

#include <string.h>

#include "models/seeds.h"
#include "robot/param_store.h"
#include "robot/robot.h"

enum { STEP_US = 40000, STORE_BYTES = 1024, SLOT_BYTES = 65536, HOST_SEEDS = 20 };

static robot_t robot;
static int64_t now_us;
static uint8_t image_id[PORT_BUILD_ID_BYTES];
static uint8_t store[STORE_BYTES];
static size_t stored;
static uint8_t slots[2][SLOT_BYTES];
static bool has_flash;
static int cameras;
static float signatures[2][BSLAM_SAMPLE_FEATURES];

// ---- the board --------------------------------------------------------------------------------------------

int64_t port_time_us(void)
{
    return now_us;
}

const uint8_t *port_build_id(void)
{
    return image_id;
}

bool port_save(const uint8_t *bytes, size_t count)
{
    assert_true(count <= sizeof store);
    memcpy(store, bytes, count);
    stored = count;
    return true;
}

bool port_load(uint8_t *bytes, size_t count)
{
    if (stored != count) {
        return false;
    }
    memcpy(bytes, store, count);
    return true;
}

const bslam_camera_t *port_cameras(int *count)
{
    static const bslam_camera_t camera = {.width_px = 64,
                                          .height_px = 48,
                                          .fx_px = 50,
                                          .fy_px = 50,
                                          .cx_px = 31,
                                          .cy_px = 23,
                                          .z_m = BSLAM_R(0.5)};
    *count = cameras;
    return &camera;
}

static bool erase(void *context, int slot)
{
    memset(slots[slot], 0xff, SLOT_BYTES);
    return true;
}

static bool write(void *context, int slot, uint32_t at, const void *bytes, uint32_t count)
{
    memcpy(&slots[slot][at], bytes, count);
    return true;
}

static bool read(void *context, int slot, uint32_t at, void *bytes, uint32_t count)
{
    memcpy(bytes, &slots[slot][at], count);
    return true;
}

const bslam_flash_t *port_map_flash(void)
{
    static const bslam_flash_t flash = {erase, write, read, NULL, SLOT_BYTES};
    return has_flash ? &flash : NULL;
}

// ---- a drive ----------------------------------------------------------------------------------------------

static int setup(void **state)
{
    memset(&robot, 0, sizeof robot);
    memset(slots, 0xff, sizeof slots);
    now_us = 0;
    stored = 0;
    has_flash = false;
    cameras = 0;
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        signatures[0][k] = k % 2 == 0 ? 0.8f : 0.0f;
        signatures[1][k] = k % 3 == 0 ? 0.7f : 0.1f;
    }
    return 0;
}

static robot_start_t start(void)
{
    robot_start_t how;
    assert_int_equal(robot_start(&robot, &how), BSLAM_OK);
    return how;
}

static void drive(int steps)
{
    for (; steps > 0; steps--) {
        now_us += STEP_US;
        const bslam_odometry_reading_t reading = {
            .time_us = now_us, .left_m = BSLAM_R(0.01), .right_m = BSLAM_R(0.01)};
        const bslam_real_t x_m = bslam_pose(&robot.slam).x_m;
        const bslam_sighting_t seen[2] = {{.bearing_rad = BSLAM_R(0.4),
                                           .range_m = 5 - x_m,
                                           .has_range = true,
                                           .label = 1,
                                           .signature = signatures[0]},
                                          {.bearing_rad = BSLAM_R(-0.6),
                                           .range_m = 4 - x_m,
                                           .has_range = true,
                                           .label = 2,
                                           .signature = signatures[1]}};
        assert_int_equal(robot_odometry(&robot, &reading), BSLAM_OK);
        assert_int_equal(robot_sightings(&robot, now_us, seen, 2), BSLAM_OK);
    }
}

/// As a host begins: known data association, or by appearance with seeds of its own.
static void begin(int32_t association)
{
    int bad_setting;
    bslam_settings_preset(&robot.settings, BSLAM_PRESET_REAL_WHEELS);
    robot.settings.association = association;
    robot.settings.guard = 1;
    robot.settings.recovery = 1;
    if (association == BSLAM_ASSOCIATION_SVM) {
        for (int s = 0; s < HOST_SEEDS; s++) {
            memset(&robot.seeds[s], s + 1, sizeof robot.seeds[s]);
        }
        robot.settings.seeds = robot.seeds;
        robot.settings.seed_count = HOST_SEEDS;
    }
    assert_int_equal(robot_start_over(&robot, &bad_setting), BSLAM_OK);
}

static bool seeds_are_the_host_s(void)
{
    bslam_sample_t expected;
    bool same = robot.in_force.seeds == robot.seeds && robot.in_force.seed_count == HOST_SEEDS;
    for (int s = 0; s < HOST_SEEDS; s++) {
        memset(&expected, s + 1, sizeof expected);
        same = same && memcmp(&robot.in_force.seeds[s], &expected, sizeof expected) == 0;
    }
    return same;
}

static void assert_seeds_are_rendered(void)
{
    assert_int_equal(robot.in_force.seed_count, BSLAM_RENDERED_SEEDS);
    assert_memory_equal(robot.in_force.seeds, bslam_rendered_seeds, sizeof bslam_rendered_seeds);
}

// ---- starting ---------------------------------------------------------------------------------------------

static void test_start_gives_an_empty_map_and_the_wheels_of_the_preset(void **state)
{
    memset(&robot, 0xa5, sizeof robot);  // as memory may be that outlasted something else
    assert_int_equal(start(), ROBOT_STARTED_EMPTY);
    assert_int_equal(bslam_health(&robot.slam).beacons, 0);
    assert_int_equal(robot.in_force.association, BSLAM_ASSOCIATION_KNOWN);
    assert_int_equal(robot.in_force.recovery, 0);
    assert_int_equal(robot.in_force.guard, 0);
    assert_int_equal(robot.health.trouble, HEALTH_NONE);
}

static void test_start_with_a_camera_runs_what_its_figures_were_measured_with(void **state)
{
    bslam_settings_t expected;
    bslam_settings_preset(&expected, BSLAM_PRESET_REAL_WHEELS);
    expected.association = BSLAM_ASSOCIATION_BOTH;
    bslam_settings_preset(&expected, BSLAM_PRESET_CAMERA);
    cameras = 1;
    assert_int_equal(start(), ROBOT_STARTED_EMPTY);
    assert_int_equal(robot.in_force.recovery, 1);
    assert_seeds_are_rendered();
    expected.recovery = 1;
    for (int id = 0; id < param_store_count(); id++) {
        assert_true(param_store_get(&robot.in_force, id) == param_store_get(&expected, id));
    }
}

static void test_start_takes_the_settings_that_were_saved_and_seeds_for_its_camera(void **state)
{
    bslam_settings_t saved;
    bslam_settings_preset(&saved, BSLAM_PRESET_REAL_WHEELS);
    saved.wheelbase_m = BSLAM_R(0.25);
    saved.association = BSLAM_ASSOCIATION_SVM;
    assert_true(param_store_save(&saved));
    cameras = 1;
    (void)start();
    assert_near(robot.in_force.wheelbase_m, 0.25, 1e-7);
    assert_int_equal(robot.in_force.recovery, 0);
    assert_seeds_are_rendered();
    store[8] ^= 1;
    (void)start();
    assert_near(robot.in_force.wheelbase_m, 0.4, 1e-7);
}

// ---- after a reset that the memory outlasts ---------------------------------------------------------------

static void test_a_reset_leaves_a_guarded_robot_its_map_and_its_seeds(void **state)
{
    (void)start();
    begin(BSLAM_ASSOCIATION_SVM);
    drive(40);
    const bslam_health_t before = bslam_health(&robot.slam);
    const uint32_t updates = bslam_counters(&robot.slam).learner.updates;
    assert_true(before.beacons == 2 && updates > 0);
    assert_int_equal(start(), ROBOT_WENT_ON);
    assert_int_equal(bslam_health(&robot.slam).beacons, 2);
    assert_true(seeds_are_the_host_s());
    assert_int_equal(robot.health.trouble, HEALTH_RESTARTED);
    assert_int_equal(robot.settings.association, BSLAM_ASSOCIATION_SVM);
    drive(20);
    assert_true(seeds_are_the_host_s());
    assert_true(bslam_counters(&robot.slam).learner.updates > updates);
}

static void test_a_reset_leaves_nothing_where_the_memory_was_not_guarded_or_is_another_image_s(void **state)
{
    (void)start();
    begin(BSLAM_ASSOCIATION_KNOWN);
    drive(10);
    image_id[3]++;
    assert_int_equal(start(), ROBOT_STARTED_EMPTY);
    robot.settings.guard = 0;
    int bad_setting;
    assert_int_equal(robot_start_over(&robot, &bad_setting), BSLAM_OK);
    drive(10);
    assert_int_equal(start(), ROBOT_STARTED_EMPTY);
}

static void test_a_reset_that_damages_what_is_kept_starts_anew(void **state)
{
    (void)start();
    size_t places[] = {40, offsetof(robot_t, in_force) + 8, offsetof(robot_t, seeds) + 100,
                       offsetof(robot_t, image) + 2};
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        begin(BSLAM_ASSOCIATION_SVM);
        drive(10);
#if BSLAM_GUARD == 2
        if (i == 0) {
            ((unsigned char *)&robot)[places[i]] ^= 4;
            assert_int_equal(start(), ROBOT_WENT_ON);  // the copy is good
            continue;
        }
#endif
        ((unsigned char *)&robot)[places[i]] ^= 4;
        assert_int_equal(start(), ROBOT_STARTED_EMPTY);
        assert_int_equal(robot.in_force.seed_count, 0);
    }
}

static void test_start_in_a_saved_map_recovers_and_guards(void **state)
{
    bslam_map_fault_t fault;
    has_flash = true;
    assert_int_equal(start(), ROBOT_STARTED_EMPTY);
    assert_int_equal(robot.in_force.recovery, 0);
    begin(BSLAM_ASSOCIATION_KNOWN);
    drive(40);
    assert_int_equal(bslam_save_to_flash(&robot.slam, port_map_flash(), &fault), BSLAM_OK);
    memset(&robot, 0, sizeof robot);
    assert_int_equal(start(), ROBOT_STARTED_IN_MAP);
    assert_int_equal(bslam_health(&robot.slam).beacons, 2);
    assert_int_equal(bslam_health(&robot.slam).state, BSLAM_RECOVERY_LOST);
    assert_true(robot.in_force.recovery == 1 && robot.in_force.guard == 1);
    assert_int_equal(robot.health.counts.recovery.lost, 0);
}

// ---- troubles ---------------------------------------------------------------------------------------------

static void test_damaged_memory_starts_over_with_the_settings_in_force_and_is_counted(void **state)
{
    (void)start();
    begin(BSLAM_ASSOCIATION_KNOWN);
    drive(20);
    robot.settings.wheelbase_m = 1;  // waits for the host's next start
    for (int times = 1; times <= 2; times++) {
        ((unsigned char *)&robot.slam)[40] ^= 4;
        const bslam_odometry_reading_t reading = {.time_us = now_us + STEP_US};
        assert_int_equal(robot_odometry(&robot, &reading), BSLAM_E_STATE);
        assert_int_equal(bslam_health(&robot.slam).beacons, 0);
        assert_int_equal(robot.health.trouble, HEALTH_CORRUPT);
        assert_int_equal(robot.health.trouble_us, now_us + STEP_US);
        assert_int_equal(robot.health.counts.guard.corrupt, times);
        assert_near(robot.in_force.wheelbase_m, 0.4, 1e-7);
        drive(5);
    }
    assert_near(robot.settings.wheelbase_m, 1, 0);
}

static void test_damaged_memory_starts_over_in_the_saved_map(void **state)
{
    bslam_map_fault_t fault;
    has_flash = true;
    (void)start();
    begin(BSLAM_ASSOCIATION_KNOWN);
    drive(40);
    assert_int_equal(bslam_save_to_flash(&robot.slam, port_map_flash(), &fault), BSLAM_OK);
    ((unsigned char *)&robot.slam)[40] ^= 4;
    assert_int_equal(robot_sightings(&robot, now_us, NULL, 0), BSLAM_E_STATE);
    assert_int_equal(bslam_health(&robot.slam).beacons, 2);
    assert_int_equal(bslam_health(&robot.slam).state, BSLAM_RECOVERY_LOST);
}

static void test_a_reading_waits_for_the_picture_of_its_moment(void **state)
{
    bslam_odometry_reading_t out;
    cameras = 1;
    (void)start();
    bslam_odometry_reading_t reading = {.time_us = STEP_US, .source = BSLAM_ODOMETRY_TICKS, .left_ticks = 5};
    assert_false(robot_end_wait(&robot, &out));
    assert_true(robot_lets_wait(&robot, &reading));
    assert_int_equal(robot.moves, 1);
    assert_true(robot_end_wait(&robot, &out));
    assert_int_equal(out.left_ticks, 5);
    assert_false(robot_end_wait(&robot, &out));
    reading.has_gyro = true;
    assert_false(robot_lets_wait(&robot, &reading));
    assert_int_equal(robot.moves, 1);
    reading = (bslam_odometry_reading_t){
        .time_us = 2 * STEP_US, .source = BSLAM_ODOMETRY_TICKS, .left_ticks = 30000};
    assert_false(robot_lets_wait(&robot, &reading));  // a jump
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_start_gives_an_empty_map_and_the_wheels_of_the_preset, setup),
        cmocka_unit_test_setup(test_start_with_a_camera_runs_what_its_figures_were_measured_with, setup),
        cmocka_unit_test_setup(test_start_takes_the_settings_that_were_saved_and_seeds_for_its_camera, setup),
        cmocka_unit_test_setup(test_a_reset_leaves_a_guarded_robot_its_map_and_its_seeds, setup),
        cmocka_unit_test_setup(
            test_a_reset_leaves_nothing_where_the_memory_was_not_guarded_or_is_another_image_s, setup),
        cmocka_unit_test_setup(test_a_reset_that_damages_what_is_kept_starts_anew, setup),
        cmocka_unit_test_setup(test_start_in_a_saved_map_recovers_and_guards, setup),
        cmocka_unit_test_setup(test_damaged_memory_starts_over_with_the_settings_in_force_and_is_counted,
                               setup),
        cmocka_unit_test_setup(test_damaged_memory_starts_over_in_the_saved_map, setup),
        cmocka_unit_test_setup(test_a_reading_waits_for_the_picture_of_its_moment, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
