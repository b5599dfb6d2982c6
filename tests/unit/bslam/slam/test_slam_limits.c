// The pipeline at its limits, whatever they are: every size comes from config.h, so that the same tests
// run in any build of the library (tests/python/core/test_sizes.py builds the smallest ones).
#include "support.h"

#include <math.h>

#include "bslam/internal.h"
#include "plain_settings.h"

#define STEP_US 40000
#ifndef UNIT_LIMITS_STEPS
#define UNIT_LIMITS_STEPS 300
#endif
/// Twice as many beacons stand around as the map holds, up to a number that keeps the test quick.
#define WORLD_MAX 64
#define WORLD (2 * BSLAM_BEACONS_MAX < WORLD_MAX ? 2 * BSLAM_BEACONS_MAX : WORLD_MAX)

/// A robot that drives a circle of 1 m within a ring of beacons.
typedef struct drive {
    bslam_slam_t slam;
    unit_random_t random;
    int step;
    bool directions_only;
    bslam_pose_t truth;
} drive_t;

static void start(drive_t *drive, bslam_settings_t settings, uint64_t seed)
{
    memset(drive, 0, sizeof *drive);
    drive->random.state = seed;
    int bad_id = -1;
    assert_int_equal(bslam_slam_init(&drive->slam, &settings, &bad_id), BSLAM_OK);
}

static void move(drive_t *drive)
{
    drive->step++;
    const double angle = 0.02 * drive->step;
    drive->truth = (bslam_pose_t){real(sin(angle)), real(1 - cos(angle)), real(angle)};
    const bslam_odometry_reading_t reading = {
        .time_us = (int64_t)drive->step * STEP_US,
        .source = BSLAM_ODOMETRY_WHEELS,
        .left_m = real(0.02 - 0.004 + unit_random(&drive->random, -0.005, 0.005)),
        .right_m = real(0.02 + 0.004 + unit_random(&drive->random, -0.005, 0.005)),
    };
    assert_int_equal(bslam_slam_odometry(&drive->slam, &reading), BSLAM_OK);
}

/// How beacon `label` of the ring looks, with noise of about the settings' size.
static bslam_sighting_t look(drive_t *drive, int label)
{
    const double place = 6.2831853 * label / WORLD;
    const double distance = 4 + label % 3;
    const double dx = distance * cos(place) - (double)drive->truth.x_m;
    const double dy = 1 + distance * sin(place) - (double)drive->truth.y_m;
    const double bearing = unit_angle_between(atan2(dy, dx), (double)drive->truth.theta_rad);
    const double noisy = bearing + unit_random(&drive->random, -0.03, 0.03);
    return drive->directions_only
               ? unit_direction(noisy, label)
               : unit_polar(noisy, hypot(dx, dy) * (1 + unit_random(&drive->random, -0.04, 0.04)), label);
}

/// A frame as large as one may be, of beacons that follow one another around the ring.
static void see(drive_t *drive)
{
    bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX];
    for (int i = 0; i < BSLAM_SIGHTINGS_MAX; i++) {
        seen[i] = look(drive, (drive->step + i) % WORLD);
    }
    assert_int_equal(
        bslam_slam_sightings(&drive->slam, (int64_t)drive->step * STEP_US, seen, BSLAM_SIGHTINGS_MAX),
        BSLAM_OK);
}

/// The correlation of two state values; an exactly known value has none, and 1 with itself.
static double correlation(const bslam_ekf_t *ekf, int i, int j)
{
    const double scale =
        sqrt((double)bslam_ekf_covariance(ekf, i, i)) * sqrt((double)bslam_ekf_covariance(ekf, j, j));
    return scale > 0 ? (double)bslam_ekf_covariance(ekf, i, j) / scale : i == j;
}

/// True if every eigenvalue of the correlation matrix is above minus a few roundings: Cholesky in double,
/// with these added to the diagonal. Exactly singular is no fault: after the first step x is v times dt.
static bool is_definite(const bslam_ekf_t *ekf)
{
    static double lower[BSLAM_STATE_MAX][BSLAM_STATE_MAX];
    // A singular matrix' eigenvalues scatter about 0 by more, the larger it is.
    const double rounding = (32 + ekf->dim / 4.0) * UNIT_ROUNDING;
    for (int i = 0; i < ekf->dim; i++) {
        for (int j = 0; j <= i; j++) {
            double rest = correlation(ekf, i, j) + (i == j ? rounding : 0);
            for (int k = 0; k < j; k++) {
                rest -= lower[i][k] * lower[j][k];
            }
            if (i == j && !(rest > 0)) {
                return false;
            }
            lower[i][j] = i == j ? sqrt(rest) : rest / lower[j][j];
        }
    }
    return true;
}

static void assert_sound(const bslam_slam_t *slam)
{
    assert_true(bslam_ekf_is_sane(&slam->ekf));
    assert_true(is_definite(&slam->ekf));
    assert_int_equal(slam->counters.insane, 0);
    assert_true(slam->ekf.beacon_count <= BSLAM_BEACONS_MAX && slam->ekf.ray_count <= BSLAM_RAYS_MAX);
    assert_true(slam->ekf.dim <= BSLAM_STATE_MAX);
}

static void assert_accounts_add_up(const bslam_slam_t *slam)
{
    const bslam_slam_counters_t *c = &slam->counters;
    assert_int_equal(c->sightings, c->matched + c->added + c->rejected + c->deferred);
    assert_true(c->gated + c->map_full <= c->rejected);
}

/// Filter, motion and further states in every combination that is allowed: 0 to 11.
static bslam_settings_t params_of(int kind)
{
    bslam_settings_t settings = unit_settings();
    settings.filter = kind % 2;
    settings.motion = kind / 2 % 2;
    settings.velocity_states = kind / 4 == 1;
    settings.scale_states = kind / 4 == 2;
    settings.gate_d2 = 25;
    // Half of them show the robot within the last step.
    settings.sighting_delay_us = kind % 4 < 2 ? 0 : 30000;
    settings.mount_x_m = BSLAM_R(0.05);
    return settings;
}

static void run_full(bool directions_only)
{
    for (int kind = 0; kind < 12; kind++) {
        static drive_t drive;
        start(&drive, params_of(kind), 5 + (uint64_t)kind);
        drive.directions_only = directions_only;
        see(&drive);
        for (int i = 0; i < UNIT_LIMITS_STEPS; i++) {
            move(&drive);
            see(&drive);
        }
        assert_sound(&drive.slam);
        assert_accounts_add_up(&drive.slam);
    }
}

static void test_full_map_of_points_goes_on_and_stays_sound(void **state)
{
    run_full(false);
}

static void test_all_directions_go_on_and_stay_sound(void **state)
{
    run_full(true);
}

static void test_full_map_holds_as_many_as_it_says(void **state)
{
    static drive_t drive;
    start(&drive, params_of(0), 3);
    for (int i = 0; i < WORLD; i++) {
        see(&drive);
        move(&drive);
    }
    const int expected = WORLD < BSLAM_BEACONS_MAX ? WORLD : BSLAM_BEACONS_MAX;
    assert_int_equal(drive.slam.ekf.beacon_count, expected);
    assert_int_equal(drive.slam.counters.added, expected);
}

static void test_directions_fill_the_room_for_rays_and_no_more(void **state)
{
    static drive_t drive;
    start(&drive, params_of(0), 4);
    drive.directions_only = true;
    see(&drive);
    const int seen = BSLAM_SIGHTINGS_MAX < WORLD ? BSLAM_SIGHTINGS_MAX : WORLD;
    const int expected = seen < BSLAM_RAYS_MAX ? seen : BSLAM_RAYS_MAX;
    assert_int_equal(drive.slam.ekf.beacon_count, expected);
    assert_int_equal(drive.slam.counters.map_full, seen - expected);
    assert_sound(&drive.slam);
}

static void test_every_method_of_association_at_full_size_stays_sound(void **state)
{
    for (int method = 0; method <= 4; method++) {
        bslam_settings_t settings = params_of(5);
        settings.association = method;
        settings.nearest_threshold_m = BSLAM_R(0.2);
        static drive_t drive;
        start(&drive, settings, 6);
        for (int i = 0; i < UNIT_LIMITS_STEPS; i++) {
            // Directions and distances in turn.
            drive.directions_only = i % 2 == 1;
            see(&drive);
            move(&drive);
        }
        assert_sound(&drive.slam);
        assert_accounts_add_up(&drive.slam);
    }
}

static void test_removing_at_random_between_frames_stays_sound(void **state)
{
    for (int kind = 0; kind < 12; kind++) {
        static drive_t drive;
        start(&drive, params_of(kind), 17 + (uint64_t)kind);
        for (int i = 0; i < UNIT_LIMITS_STEPS; i++) {
            drive.directions_only = i % 3 == 1;
            see(&drive);
            move(&drive);
            const int count = drive.slam.ekf.beacon_count;
            if (count > 0) {
                bslam_beacon_view_t view;
                const int index = (int)unit_random(&drive.random, 0, count);
                assert_int_equal(bslam_slam_beacon(&drive.slam, index, &view), BSLAM_OK);
                assert_int_equal(bslam_slam_remove_beacon(&drive.slam, view.uid), BSLAM_OK);
            }
            assert_sound(&drive.slam);
        }
    }
}

static void test_window_removes_and_gives_the_room_back(void **state)
{
    bslam_settings_t settings = params_of(5);
    settings.confirm_sightings = 1000;
    settings.confirm_window_us = 3 * STEP_US;
    settings.association = 2;
    static drive_t drive;
    start(&drive, settings, 8);
    for (int i = 0; i < UNIT_LIMITS_STEPS; i++) {
        drive.directions_only = i % 2 == 1;
        see(&drive);
        move(&drive);
        assert_sound(&drive.slam);
    }
    const bslam_slam_counters_t *c = &drive.slam.counters;
    assert_int_equal(c->added - c->removed, drive.slam.ekf.beacon_count);
    assert_true(c->removed > 0);
}

static void test_known_beacons_fill_the_map_and_localise(void **state)
{
    static drive_t drive;
    start(&drive, params_of(1), 9);
    for (int label = 0; label < BSLAM_BEACONS_MAX; label++) {
        const double place = 6.2831853 * label / WORLD;
        const double distance = 4 + label % 3;
        assert_int_equal(bslam_slam_add_known_beacon(&drive.slam, label, real(distance * cos(place)),
                                                     real(1 + distance * sin(place))),
                         BSLAM_OK);
    }
    assert_int_equal(bslam_slam_add_known_beacon(&drive.slam, BSLAM_BEACONS_MAX, 0, 0), BSLAM_E_MAP_FULL);
    for (int i = 0; i < UNIT_LIMITS_STEPS; i++) {
        move(&drive);
        see(&drive);
    }
    assert_int_equal(drive.slam.ekf.dim, 3);
    assert_sound(&drive.slam);
    // Even where one beacon at a time is seen half the time, the noise of 0.03 rad and 4 % leaves less than
    // this.
    assert_near(bslam_slam_pose(&drive.slam).x_m, drive.truth.x_m, 0.4);
    assert_near(bslam_slam_pose(&drive.slam).y_m, drive.truth.y_m, 0.4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_full_map_of_points_goes_on_and_stays_sound),
        cmocka_unit_test(test_all_directions_go_on_and_stay_sound),
        cmocka_unit_test(test_full_map_holds_as_many_as_it_says),
        cmocka_unit_test(test_directions_fill_the_room_for_rays_and_no_more),
        cmocka_unit_test(test_every_method_of_association_at_full_size_stays_sound),
        cmocka_unit_test(test_removing_at_random_between_frames_stays_sound),
        cmocka_unit_test(test_window_removes_and_gives_the_room_back),
        cmocka_unit_test(test_known_beacons_fill_the_map_and_localise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
