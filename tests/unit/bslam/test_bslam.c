// The public calls, as a user's program has them: nothing of the library's inside is included here.
#include "bslam/bslam.h"
#include "support.h"

#include <math.h>

#define PI 3.14159265358979323846

enum { STEP_US = 40000, BEACONS = 5, MAP_BYTES_MAX = 65536 };

static const double places[BEACONS][2] = {{3, 1}, {4, -2}, {6, 2}, {5, 4}, {-2, 3}};
static bslam_t robot;
static bslam_settings_t settings;
static int64_t now_us;

static int setup(void **state)
{
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    settings.recovery = 0;
    settings.guard = 0;
    now_us = 0;
    int bad_setting;
    return bslam_init(&robot, &settings, &bad_setting) == BSLAM_OK ? 0 : 1;
}

static void start(void)
{
    int bad_setting;
    assert_int_equal(bslam_init(&robot, &settings, &bad_setting), BSLAM_OK);
}

/// What its wheels say of a robot that went so far.
static bslam_status_t roll(double forward_m, double turn_rad)
{
    now_us += STEP_US;
    const double half = 0.5 * turn_rad * (double)settings.wheelbase_m;
    const bslam_odometry_reading_t reading = {.time_us = now_us,
                                              .source = BSLAM_ODOMETRY_WHEELS,
                                              .left_m = real(forward_m - half),
                                              .right_m = real(forward_m + half)};
    return bslam_odometry(&robot, &reading);
}

/// A frame of the first `count` beacons, seen from (x, y, theta).
static bslam_status_t look_from(double x, double y, double theta, int count)
{
    bslam_sighting_t seen[BEACONS];
    for (int i = 0; i < count; i++) {
        const double dx = places[i][0] - x;
        const double dy = places[i][1] - y;
        seen[i] = unit_polar(remainder(atan2(dy, dx) - theta, 2 * PI), hypot(dx, dy), i);
    }
    return bslam_sightings(&robot, now_us, seen, count);
}

static void stand_at(double x, double y, double theta, int frames)
{
    for (int i = 0; i < frames; i++) {
        assert_int_equal(roll(0, 0), BSLAM_OK);
        assert_int_equal(look_from(x, y, theta, BEACONS), BSLAM_OK);
    }
}

static uint64_t fingerprint(void)
{
    return bslam_fingerprint(&robot, 0);
}

static void assert_pose(double x, double y, double theta)
{
    const bslam_pose_t pose = bslam_pose(&robot);
    assert_near(pose.x_m, x, 0.05);
    assert_near(pose.y_m, y, 0.05);
    assert_near(pose.theta_rad, theta, 0.02);
}

// ---- beginning --------------------------------------------------------------------------------------------

static bslam_t marked;

static void mark(void)
{
    memset(&marked, 0x5a, sizeof marked);
    memset(&robot, 0x5a, sizeof robot);
}

static void assert_untouched(void)
{
    assert_memory_equal(&robot, &marked, sizeof robot);
}

static void test_init_of_another_size_is_refused_and_writes_nothing(void **state)
{
    int bad_setting = -7;
    mark();
    assert_int_equal(bslam_init_sized(&robot, sizeof robot - 1, BSLAM_SIZES_HASH, &settings, &bad_setting),
                     BSLAM_E_SIZE);
    assert_int_equal(bslam_init_sized(&robot, sizeof robot, BSLAM_SIZES_HASH + 1u, &settings, &bad_setting),
                     BSLAM_E_SIZE);
    assert_int_equal(bad_setting, -1);
    assert_untouched();
}

static void test_init_names_the_setting_that_it_refuses(void **state)
{
    int bad_setting = -7;
    mark();
    settings.wheelbase_m = real(NAN);
    assert_int_equal(bslam_init(&robot, &settings, &bad_setting), BSLAM_E_PARAMETER);
    assert_string_equal(bslam_settings_info(bad_setting)->name, "wheelbase_m");
    assert_untouched();
}

static void test_init_refuses_seeds_that_cannot_be(void **state)
{
    static const bslam_sample_t seed;
    int bad_setting;
    mark();
    settings.seed_count = 1;  // of none
    assert_int_equal(bslam_init(&robot, &settings, &bad_setting), BSLAM_E_COUNT);
    settings.seeds = &seed;
    settings.seed_count = BSLAM_SEEDS_MAX + 1;
    assert_int_equal(bslam_init(&robot, &settings, &bad_setting), BSLAM_E_COUNT);
    settings.seed_count = -1;
    assert_int_equal(bslam_init(&robot, &settings, &bad_setting), BSLAM_E_COUNT);
    assert_int_equal(bad_setting, -1);
    assert_untouched();
    settings.seed_count = 1;
    assert_int_equal(bslam_init(&robot, &settings, &bad_setting), BSLAM_OK);
}

static void test_nothing_begins_without_an_init_that_succeeds(void **state)
{
    static const bslam_t zeroed;
    const bslam_pose_t origin = {0, 0, 0};
    int bad_setting;
    uint32_t bytes;
    memset(&robot, 0, sizeof robot);
    settings.wheelbase_m = 0;
    assert_int_equal(bslam_init(&robot, &settings, &bad_setting), BSLAM_E_PARAMETER);
    assert_int_equal(roll(0, 0), BSLAM_E_STATE);
    assert_int_equal(look_from(0, 0, 0, 1), BSLAM_E_STATE);
    assert_int_equal(bslam_resume_odometry(&robot, 0, 0), BSLAM_E_STATE);
    assert_int_equal(bslam_set_pose(&robot, &origin, 0, 0), BSLAM_E_STATE);
    assert_int_equal(bslam_add_known_beacon(&robot, 77, 0, 0), BSLAM_E_STATE);
    assert_int_equal(bslam_save_map(&robot, NULL, &bytes), BSLAM_E_STATE);
    bslam_freeze_map(&robot, true);
    assert_memory_equal(&robot, &zeroed, sizeof robot);
}

static void test_init_begins_at_the_origin_without_a_map(void **state)
{
    const bslam_health_t health = bslam_health(&robot);
    assert_int_equal(health.state, BSLAM_RECOVERY_FOLLOWING);
    assert_false(health.is_frozen);
    assert_int_equal(health.beacons, 0);
    assert_int_equal(health.bad_sighting, -1);
    assert_pose(0, 0, 0);
    int count = -1;
    (void)bslam_results(&robot, &count);
    assert_int_equal(count, 0);
    const bslam_counters_t none = {{0}, {0}, {0}, {0}, {0}};
    const bslam_counters_t counters = bslam_counters(&robot);
    assert_memory_equal(&counters, &none, sizeof none);
}

static void test_two_robots_share_nothing(void **state)
{
    static bslam_t other;
    int bad_setting;
    assert_int_equal(bslam_init(&other, &settings, &bad_setting), BSLAM_OK);
    const uint64_t before = bslam_fingerprint(&other, 0);
    stand_at(0, 0, 0, 3);
    assert_true(bslam_fingerprint(&other, 0) == before);
    assert_true(fingerprint() != before);
}

// ---- steps ------------------------------------------------------------------------------------------------

static void test_drive_is_followed_by_wheels_and_beacons(void **state)
{
    double x = 0;
    for (int i = 0; i < 50; i++) {
        assert_int_equal(roll(0.02, 0), BSLAM_OK);
        x += i > 0 ? 0.02 : 0;  // the first reading starts the clock
        assert_int_equal(look_from(x, 0, 0, BEACONS), BSLAM_OK);
    }
    assert_pose(x, 0, 0);
    bslam_pose_t then;
    assert_int_equal(bslam_pose_at(&robot, now_us - STEP_US, &then), BSLAM_OK);
    assert_near(then.x_m, x - 0.02, 0.05);
    assert_int_equal(bslam_pose_at(&robot, now_us + 10000000, &then), BSLAM_E_TIME);
    bslam_real_t lower[6];
    bslam_pose_covariance(&robot, lower);
    assert_true(lower[0] > 0 && lower[2] > 0 && lower[5] > 0);
    int count;
    const bslam_account_t *accounts = bslam_results(&robot, &count);
    assert_int_equal(count, BEACONS);
    bslam_beacon_view_t view;
    for (int i = 0; i < BEACONS; i++) {
        assert_int_equal(accounts[i].outcome, BSLAM_OUTCOME_MATCHED);
        assert_int_equal(bslam_beacon(&robot, i, &view), BSLAM_OK);
        assert_true(view.confirmed);
        assert_near(view.x_m, places[view.label][0], 0.1);
        assert_near(view.y_m, places[view.label][1], 0.1);
    }
    assert_int_equal(bslam_beacon(&robot, BEACONS, &view), BSLAM_E_NO_BEACON);
    assert_int_equal(bslam_beacon(&robot, -1, &view), BSLAM_E_NO_BEACON);
    const bslam_counters_t counters = bslam_counters(&robot);
    assert_int_equal(counters.slam.odometry, 50);
    assert_int_equal(counters.slam.frames, 50);
    assert_int_equal(counters.slam.added, BEACONS);
    assert_int_equal(counters.slam.insane, 0);
}

static void test_refused_calls_change_no_bit(void **state)
{
    stand_at(0, 0, 0, 6);
    const uint64_t before = fingerprint();
    const bslam_counters_t counted = bslam_counters(&robot);
    const bslam_odometry_reading_t reading = {
        .time_us = now_us + STEP_US, .source = BSLAM_ODOMETRY_WHEELS, .left_m = real(NAN)};
    assert_int_equal(bslam_odometry(&robot, &reading), BSLAM_E_NOT_FINITE);
    static bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX + 1];
    seen[0] = unit_polar(0, 2, 0);
    seen[1] = unit_polar(NAN, 2, 1);
    assert_int_equal(bslam_sightings(&robot, now_us + 1, seen, 2), BSLAM_E_NOT_FINITE);
    assert_int_equal(bslam_health(&robot).bad_sighting, 1);
    assert_int_equal(bslam_sightings(&robot, now_us + 1, seen, BSLAM_SIGHTINGS_MAX + 1), BSLAM_E_COUNT);
    assert_int_equal(bslam_sightings(&robot, -1, seen, 1), BSLAM_E_TIME);
    assert_int_equal(bslam_resume_odometry(&robot, real(NAN), 0), BSLAM_E_RANGE);
    const bslam_pose_t pose = {real(NAN), 0, 0};
    assert_int_equal(bslam_set_pose(&robot, &pose, 0, 0), BSLAM_E_NOT_FINITE);
    assert_int_equal(bslam_add_known_beacon(&robot, 0, 1, 1), BSLAM_E_DUPLICATE);
    assert_int_equal(bslam_add_known_beacon(&robot, -1, 1, 1), BSLAM_E_RANGE);
    assert_int_equal(bslam_remove_beacon(&robot, 99), BSLAM_E_NO_BEACON);
    assert_true(fingerprint() == before);
    const bslam_counters_t after = bslam_counters(&robot);
    assert_int_equal(after.slam.odometry_refused, counted.slam.odometry_refused + 1);
    assert_int_equal(after.slam.frames_refused, counted.slam.frames_refused + 3);
}

static void test_resume_odometry_starts_the_clock_anew(void **state)
{
    stand_at(0, 0, 0, 6);
    now_us = 0;
    assert_int_equal(roll(0, 0), BSLAM_E_TIME);
    assert_int_equal(bslam_resume_odometry(&robot, real(0.1), real(0.1)), BSLAM_OK);
    now_us = 0;
    stand_at(0, 0, 0, 3);
    assert_pose(0, 0, 0);
}

// ---- the map ----------------------------------------------------------------------------------------------

static void test_known_beacon_holds_the_robot(void **state)
{
    for (int i = 0; i < BEACONS; i++) {
        assert_int_equal(bslam_add_known_beacon(&robot, i, real(places[i][0]), real(places[i][1])), BSLAM_OK);
    }
    const bslam_pose_t near_by = {real(0.5), 0, 0};
    assert_int_equal(bslam_set_pose(&robot, &near_by, 1, real(0.5)), BSLAM_OK);
    stand_at(1, 0.5, 0.2, 20);
    assert_pose(1, 0.5, 0.2);
    bslam_beacon_view_t view;
    assert_int_equal(bslam_beacon(&robot, 0, &view), BSLAM_OK);
    assert_int_equal(view.kind, BSLAM_BEACON_KNOWN);
    assert_near(view.x_m, places[0][0], 1e-6);
}

static void test_remove_beacon_takes_one_out_or_all(void **state)
{
    stand_at(0, 0, 0, 6);
    bslam_beacon_view_t view;
    assert_int_equal(bslam_beacon(&robot, 1, &view), BSLAM_OK);
    assert_int_equal(bslam_remove_beacon(&robot, view.uid), BSLAM_OK);
    assert_int_equal(bslam_health(&robot).beacons, BEACONS - 1);
    assert_int_equal(bslam_remove_beacon(&robot, view.uid), BSLAM_E_NO_BEACON);
    bslam_freeze_map(&robot, true);
    assert_int_equal(bslam_remove_beacon(&robot, BSLAM_ALL_BEACONS), BSLAM_OK);
    assert_int_equal(bslam_health(&robot).beacons, 0);
    assert_false(bslam_health(&robot).is_frozen);
}

static void test_frozen_map_takes_nothing_new(void **state)
{
    assert_int_equal(roll(0, 0), BSLAM_OK);
    assert_int_equal(look_from(0, 0, 0, 2), BSLAM_OK);
    bslam_freeze_map(&robot, true);
    assert_true(bslam_health(&robot).is_frozen);
    assert_int_equal(roll(0, 0), BSLAM_OK);
    assert_int_equal(look_from(0, 0, 0, 3), BSLAM_OK);
    assert_int_equal(bslam_health(&robot).beacons, 2);
    int count;
    assert_int_equal(bslam_results(&robot, &count)[2].reason, BSLAM_REASON_FROZEN);
    bslam_freeze_map(&robot, false);
    stand_at(0, 0, 0, 1);
    assert_int_equal(bslam_health(&robot).beacons, BEACONS);
}

// ---- recovery ---------------------------------------------------------------------------------------------

static void lose_and_show(int frames)
{
    stand_at(0, 0, 0, 10);
    bslam_freeze_map(&robot, true);
    assert_int_equal(bslam_set_pose(&robot, NULL, 0, 0), BSLAM_OK);
    assert_int_equal(bslam_health(&robot).state, BSLAM_RECOVERY_LOST);
    stand_at(1, -1, 0.6, frames);
}

static void test_robot_without_recovery_stays_lost(void **state)
{
    lose_and_show(50);
    assert_int_equal(bslam_health(&robot).state, BSLAM_RECOVERY_LOST);
    int count;
    assert_int_equal(bslam_results(&robot, &count)[0].reason, BSLAM_REASON_LOST);
    assert_int_equal(bslam_counters(&robot).recovery.found, 0);
}

static void test_robot_with_recovery_finds_itself(void **state)
{
    settings.recovery = 1;
    start();
    lose_and_show(50);
    assert_int_equal(bslam_health(&robot).state, BSLAM_RECOVERY_FOLLOWING);
    assert_int_equal(bslam_counters(&robot).recovery.found, 1);
    assert_pose(1, -1, 0.6);
}

static void test_kidnapped_robot_is_doubted_then_lost(void **state)
{
    settings.recovery = 1;
    start();
    stand_at(0, 0, 0, 10);
    bslam_freeze_map(&robot, true);
    bool has_doubted = false;
    for (int i = 0; i < 100 && bslam_counters(&robot).recovery.found == 0; i++) {
        stand_at(-2, 2, 1.5, 1);
        has_doubted = has_doubted || bslam_health(&robot).state == BSLAM_RECOVERY_DOUBTING;
    }
    assert_true(has_doubted);
    assert_int_equal(bslam_counters(&robot).recovery.lost, 1);
    assert_pose(-2, 2, 1.5);
}

// ---- guard ------------------------------------------------------------------------------------------------

static void start_guarded(void)
{
    settings.guard = 1;
    start();
    stand_at(0, 0, 0, 6);
}

/// Flips a bit of the estimate, which begins behind the settings.
static void damage(void)
{
    robot.bytes[sizeof(bslam_settings_t) + 2 * sizeof(bslam_real_t) + 1] ^= 4u;
}

static void test_guard_refuses_every_call_on_damaged_memory(void **state)
{
    start_guarded();
    const bslam_pose_t origin = {0, 0, 0};
    bslam_map_fault_t fault;
    const bslam_map_source_t source = {NULL, NULL, 0};
    const bslam_flash_t flash = {NULL, NULL, NULL, NULL, 0};
    damage();
    const uint64_t before = fingerprint();
    assert_int_equal(roll(0, 0), BSLAM_E_STATE);
    assert_int_equal(look_from(0, 0, 0, 1), BSLAM_E_STATE);
    assert_int_equal(bslam_resume_odometry(&robot, 0, 0), BSLAM_E_STATE);
    assert_int_equal(bslam_set_pose(&robot, &origin, 0, 0), BSLAM_E_STATE);
    assert_int_equal(bslam_add_known_beacon(&robot, 77, 0, 0), BSLAM_E_STATE);
    assert_int_equal(bslam_remove_beacon(&robot, BSLAM_ALL_BEACONS), BSLAM_E_STATE);
    assert_int_equal(bslam_load_map(&robot, &source, &fault), BSLAM_E_STATE);
    assert_int_equal(fault, BSLAM_MAP_FINE);
    assert_int_equal(bslam_load_from_flash(&robot, &flash, &fault), BSLAM_E_STATE);
    bslam_freeze_map(&robot, true);
    assert_false(bslam_health(&robot).is_frozen);
    assert_true(fingerprint() == before);
    assert_int_equal(bslam_counters(&robot).guard.corrupt, 9);
}

static void test_restart_goes_back_to_the_copy(void **state)
{
    start_guarded();
    damage();
    assert_int_equal(roll(0, 0), BSLAM_E_STATE);
    assert_int_equal(bslam_restart(&robot, real(0.1), real(0.1)), BSLAM_OK);
    assert_int_equal(bslam_counters(&robot).guard.restored, 1);
    now_us = 0;
    stand_at(0, 0, 0, 3);
    assert_pose(0, 0, 0);
    assert_int_equal(bslam_health(&robot).beacons, BEACONS);
}

static void test_restart_goes_on_with_memory_that_is_whole(void **state)
{
    start_guarded();
    assert_int_equal(bslam_restart(&robot, real(0.1), real(0.1)), BSLAM_OK);
    assert_int_equal(bslam_counters(&robot).guard.restored, 0);
    now_us = 0;
    stand_at(0, 0, 0, 3);
    assert_pose(0, 0, 0);
}

static void test_restart_of_what_holds_no_state_is_refused(void **state)
{
    assert_int_equal(bslam_restart(&robot, 0, 0), BSLAM_E_STATE);  // without the setting nothing is sealed
    start_guarded();
    mark();
    assert_int_equal(bslam_restart(&robot, 0, 0), BSLAM_E_STATE);
    assert_int_equal(bslam_restart(&robot, real(0.1), real(0.1)), BSLAM_E_STATE);
}

static void test_restart_in_a_doubt_that_is_refused_changes_nothing(void **state)
{
    settings.recovery = 1;
    start_guarded();
    bslam_freeze_map(&robot, true);
    while (bslam_health(&robot).state != BSLAM_RECOVERY_DOUBTING) {
        stand_at(-2, 2, 1.5, 1);
    }
    const uint64_t before = fingerprint();
    assert_int_equal(bslam_restart(&robot, real(31), 0), BSLAM_E_RANGE);
    assert_int_equal(bslam_health(&robot).state, BSLAM_RECOVERY_DOUBTING);
    assert_true(fingerprint() == before);
    assert_int_equal(bslam_restart(&robot, real(30), 0), BSLAM_OK);
    assert_int_equal(bslam_health(&robot).state, BSLAM_RECOVERY_FOLLOWING);
}

// ---- keeping the map --------------------------------------------------------------------------------------

typedef struct kept {
    uint8_t bytes[MAP_BYTES_MAX];
    uint32_t count;
    uint32_t room;
} kept_t;

static kept_t kept;

static bool take(void *context, const void *bytes, uint32_t count)
{
    kept_t *to = context;
    if (to->count + count > to->room) {
        return false;
    }
    memcpy(&to->bytes[to->count], bytes, count);
    to->count += count;
    return true;
}

static bool give(const void *context, uint32_t at, void *bytes, uint32_t count)
{
    const kept_t *from = context;
    memcpy(bytes, &from->bytes[at], count);
    return true;
}

static void test_map_that_was_saved_is_loaded(void **state)
{
    stand_at(0, 0, 0, 6);
    kept = (kept_t){.room = MAP_BYTES_MAX};
    const bslam_map_sink_t sink = {take, &kept};
    uint32_t counted;
    uint32_t bytes;
    assert_int_equal(bslam_save_map(&robot, NULL, &counted), BSLAM_OK);
    assert_int_equal(bslam_save_map(&robot, &sink, &bytes), BSLAM_OK);
    assert_int_equal(bytes, counted);
    assert_int_equal(kept.count, counted);
    kept_t short_of_room = {.room = 10};
    const bslam_map_sink_t narrow = {take, &short_of_room};
    assert_int_equal(bslam_save_map(&robot, &narrow, &bytes), BSLAM_E_MAP);

    start();
    bslam_map_fault_t fault = BSLAM_MAP_BAD_CRC;
    const bslam_map_source_t source = {give, &kept, kept.count};
    assert_int_equal(bslam_load_map(&robot, &source, &fault), BSLAM_OK);
    assert_int_equal(fault, BSLAM_MAP_FINE);
    assert_int_equal(bslam_health(&robot).beacons, BEACONS);
    assert_int_equal(bslam_health(&robot).state, BSLAM_RECOVERY_LOST);
    const uint64_t before = fingerprint();
    kept.bytes[kept.count / 2] ^= 1u;
    assert_int_equal(bslam_load_map(&robot, &source, &fault), BSLAM_E_MAP);
    assert_int_equal(fault, BSLAM_MAP_BAD_CRC);
    assert_true(fingerprint() == before);
}

static uint8_t slots[BSLAM_SLOTS][MAP_BYTES_MAX / 4];

static bool erase(void *context, int slot)
{
    memset(slots[slot], 0xff, sizeof slots[slot]);
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

static void test_map_in_flash_is_loaded(void **state)
{
    const bslam_flash_t flash = {erase, write, read, NULL, sizeof slots[0]};
    bslam_map_fault_t fault;
    memset(slots, 0xff, sizeof slots);
    assert_int_equal(bslam_load_from_flash(&robot, &flash, &fault), BSLAM_E_MAP);
    assert_int_equal(fault, BSLAM_MAP_NO_MAP);
    stand_at(0, 0, 0, 6);
    assert_int_equal(bslam_save_to_flash(&robot, &flash, &fault), BSLAM_OK);
    start();
    assert_int_equal(bslam_load_from_flash(&robot, &flash, &fault), BSLAM_OK);
    assert_int_equal(bslam_health(&robot).beacons, BEACONS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_init_of_another_size_is_refused_and_writes_nothing, setup),
        cmocka_unit_test_setup(test_init_names_the_setting_that_it_refuses, setup),
        cmocka_unit_test_setup(test_init_refuses_seeds_that_cannot_be, setup),
        cmocka_unit_test_setup(test_nothing_begins_without_an_init_that_succeeds, setup),
        cmocka_unit_test_setup(test_init_begins_at_the_origin_without_a_map, setup),
        cmocka_unit_test_setup(test_two_robots_share_nothing, setup),

        cmocka_unit_test_setup(test_drive_is_followed_by_wheels_and_beacons, setup),
        cmocka_unit_test_setup(test_refused_calls_change_no_bit, setup),
        cmocka_unit_test_setup(test_resume_odometry_starts_the_clock_anew, setup),

        cmocka_unit_test_setup(test_known_beacon_holds_the_robot, setup),
        cmocka_unit_test_setup(test_remove_beacon_takes_one_out_or_all, setup),
        cmocka_unit_test_setup(test_frozen_map_takes_nothing_new, setup),

        cmocka_unit_test_setup(test_robot_without_recovery_stays_lost, setup),
        cmocka_unit_test_setup(test_robot_with_recovery_finds_itself, setup),
        cmocka_unit_test_setup(test_kidnapped_robot_is_doubted_then_lost, setup),

        cmocka_unit_test_setup(test_guard_refuses_every_call_on_damaged_memory, setup),
        cmocka_unit_test_setup(test_restart_goes_back_to_the_copy, setup),
        cmocka_unit_test_setup(test_restart_goes_on_with_memory_that_is_whole, setup),
        cmocka_unit_test_setup(test_restart_of_what_holds_no_state_is_refused, setup),
        cmocka_unit_test_setup(test_restart_in_a_doubt_that_is_refused_changes_nothing, setup),

        cmocka_unit_test_setup(test_map_that_was_saved_is_loaded, setup),
        cmocka_unit_test_setup(test_map_in_flash_is_loaded, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
