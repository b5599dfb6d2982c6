// Lives without parallax: a robot that stands, or turns on the spot, learns nothing of how far beacons are.
#include <math.h>

#include "support.h"

#include "bslam/internal.h"

enum { STEP_US = 40000, BEACONS = 5 };

static const double PI = 3.14159265358979;
static const double places[BEACONS][2] = {{2.5, 1.5}, {-1, -2.5}, {3.5, -2}, {-2, 2.5}, {2, 5.5}};
/// A beacon of unknown distance is thought to be half as far away, more or less.
static const double GUESS_SD = 0.5;

/// What a robot does: drives on a winding path for a while, then turns on the spot or creeps ahead.
typedef struct life {
    double drive_s, then_s, turn_radps, creep_mps;
    double bearing_sd_rad, wheel_sd_mps;
    int beacons;
    int steps_a_frame;
    int ranged_every;  ///< frame: then the first beacon's distance is measured; 0: never
} life_t;

/// As the real wheels have it.
static const life_t PLAIN = {
    .then_s = 120, .bearing_sd_rad = 0.0136, .wheel_sd_mps = 0.05, .beacons = 4, .steps_a_frame = 1};

static bslam_t robot;
static unit_random_t noise;
static double pose[3];

static double normal(void)
{
    const double u = unit_random(&noise, 1e-12, 1);
    return sqrt(-2 * log(u)) * cos(unit_random(&noise, 0, 2 * PI));
}

static void begin(const life_t *life)
{
    bslam_settings_t settings;
    int bad;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    settings.filter = BSLAM_FILTER_SMOOTHER;
    bslam_settings_preset(&settings, BSLAM_PRESET_BEARING_ONLY);
    settings.association = BSLAM_ASSOCIATION_KNOWN;
    settings.left_speed_sd_mps = settings.right_speed_sd_mps = real(life->wheel_sd_mps);
    assert_int_equal(bslam_init(&robot, &settings, &bad), BSLAM_OK);
    memset(pose, 0, sizeof pose);
    noise.state = 7;
}

static void drive(const life_t *life, int64_t time_us, double v_mps, double turn_radps)
{
    const double dt_s = 1e-6 * STEP_US, turn_rad = turn_radps * dt_s;
    const double sd_m = v_mps == 0 && turn_radps == 0 ? 0 : life->wheel_sd_mps * dt_s;
    double c, s;
    unit_mean_direction(pose[2], turn_rad, &c, &s);
    pose[0] += v_mps * dt_s * c;
    pose[1] += v_mps * dt_s * s;
    pose[2] += turn_rad;
    const bslam_odometry_reading_t wheels = {
        .time_us = time_us,
        .source = BSLAM_ODOMETRY_WHEELS,
        .left_m = real(v_mps * dt_s - turn_rad * 0.2 + sd_m * normal()),
        .right_m = real(v_mps * dt_s + turn_rad * 0.2 + sd_m * normal()),
    };
    assert_int_equal(bslam_odometry(&robot, &wheels), BSLAM_OK);
}

/// What is ahead. The last beacon is hidden until the drive is over.
static void look(const life_t *life, int64_t time_us, int frame)
{
    bslam_sighting_t seen[BEACONS];
    int count = 0;
    const bool is_over = 1e-6 * (double)time_us >= life->drive_s;
    for (int b = 0; b < life->beacons; b++) {
        const double dx = places[b][0] - pose[0], dy = places[b][1] - pose[1];
        const double bearing_rad = unit_angle_between(atan2(dy, dx), pose[2]);
        if (fabs(bearing_rad) < 1.6 && (is_over || b != BEACONS - 1)) {
            seen[count] = unit_direction(bearing_rad + life->bearing_sd_rad * normal(), b);
            seen[count].bearing_sd_rad = real(life->bearing_sd_rad);
            if (b == 0 && life->ranged_every > 0 && frame % life->ranged_every == 0) {
                seen[count].has_range = true;
                seen[count].range_m = real(hypot(dx, dy));
            }
            count++;
        }
    }
    assert_int_equal(bslam_sightings(&robot, time_us, seen, count), BSLAM_OK);
}

static void live(const life_t *life)
{
    begin(life);
    const int steps = (int)((life->drive_s + life->then_s) * 1e6 / STEP_US);
    for (int k = 0; k <= steps; k++) {
        const int64_t time_us = (int64_t)k * STEP_US;
        const double t_s = 1e-6 * (double)time_us;
        if (t_s <= life->drive_s) {
            drive(life, time_us, k > 0 ? 0.3 : 0, k > 0 ? 0.3 * sin(0.5 * t_s) : 0);
        } else {
            drive(life, time_us, life->creep_mps, life->turn_radps);
        }
        if (k % life->steps_a_frame == 0) {
            look(life, time_us, k / life->steps_a_frame);
        }
    }
    assert_int_equal(bslam_counters(&robot).slam.insane, 0);
    assert_int_equal(bslam_instance(&robot)->smoother.insane, 0);
}

/// A beacon's distance is true within three of its standard deviations, which are this share of it, no less
/// and no more.
static void assert_distance(int label, double least_share, double most_share)
{
    bslam_beacon_view_t view;
    int index = 0;
    do {
        assert_int_equal(bslam_beacon(&robot, index, &view), BSLAM_OK);
        index++;
    } while (view.label != label);
    const bslam_pose_t at = bslam_pose(&robot);
    const double true_m = hypot(places[label][0] - pose[0], places[label][1] - pose[1]);
    const double range_m = hypot((double)(view.x_m - at.x_m), (double)(view.y_m - at.y_m));
    const double sd_m = sqrt((double)(view.covariance_m2.xx + view.covariance_m2.yy));
    assert_near(range_m, true_m, 3 * sd_m);
    assert_true(sd_m >= least_share * range_m && sd_m <= most_share * range_m);
}

static void assert_all_doubtful(const life_t *life, int first)
{
    for (int b = first; b < life->beacons; b++) {
        assert_distance(b, 0.75 * GUESS_SD, 2 * GUESS_SD);
    }
}

// ---- without parallax -------------------------------------------------------------------------------------

static void test_turning_on_the_spot_leaves_distances_as_doubtful_as_they_were(void **state)
{
    static const double turns_radps[] = {0.7, -0.2, -0.03}, sds_rad[] = {0.0136, 1e-3, 1e-4, 1e-5};
    for (int i = 0; i < COUNT_OF(turns_radps); i++) {
        for (int j = 0; j < COUNT_OF(sds_rad); j++) {
            life_t life = PLAIN;
            life.turn_radps = turns_radps[i];
            life.bearing_sd_rad = sds_rad[j];
            life.beacons = i == 2 ? 2 : 4;  // of which a slow turn shows them all
            life.then_s = i + j == 0 ? 400 : 60;
            live(&life);
            assert_all_doubtful(&life, 0);
        }
    }
}

static void test_standing_leaves_distances_as_doubtful_as_they_were(void **state)
{
    static const double sds_rad[] = {0.0136, 1e-4, 1e-5};
    for (int j = 0; j < COUNT_OF(sds_rad); j++) {
        life_t life = PLAIN;
        life.bearing_sd_rad = sds_rad[j];
        live(&life);
        assert_distance(0, 0.85 * GUESS_SD, 2 * GUESS_SD);
        assert_distance(2, 0.85 * GUESS_SD, 2 * GUESS_SD);
    }
}

static void test_one_beacon_alone_stays_as_doubtful(void **state)
{
    life_t life = PLAIN;
    life.beacons = 1;
    life.turn_radps = 0.5;
    live(&life);
    assert_all_doubtful(&life, 0);
}

static void test_rare_frames_tell_no_distance_either(void **state)
{
    life_t life = PLAIN;
    life.turn_radps = 0.4;
    life.steps_a_frame = 25;
    life.then_s = 300;
    live(&life);
    assert_all_doubtful(&life, 0);
}

static void test_wheels_that_slip_on_the_spot_tell_no_distance(void **state)
{
    life_t life = PLAIN;
    life.turn_radps = 0.7;
    life.wheel_sd_mps = 0.3;
    live(&life);
    assert_all_doubtful(&life, 0);
}

static void test_distance_that_is_measured_is_that_of_its_beacon_alone(void **state)
{
    life_t life = PLAIN;
    life.turn_radps = 0.5;
    life.ranged_every = 10;
    live(&life);
    assert_distance(0, 0, 0.1);
    assert_all_doubtful(&life, 1);
}

// ---- beside driving ---------------------------------------------------------------------------------------

static void test_stand_after_a_drive_keeps_the_map_and_tells_nothing_of_what_is_new(void **state)
{
    static const double turns_radps[] = {0.5, 0}, sds_rad[] = {0.0136, 1e-4};
    for (int i = 0; i < COUNT_OF(turns_radps); i++) {
        for (int j = 0; j < COUNT_OF(sds_rad); j++) {
            life_t life = PLAIN;
            life.drive_s = 20;
            life.then_s = 80;
            life.turn_radps = turns_radps[i];
            life.bearing_sd_rad = sds_rad[j];
            life.beacons = turns_radps[i] != 0 ? BEACONS : BEACONS - 1;
            live(&life);
            assert_distance(0, 0, 0.1);
            assert_distance(2, 0, 0.1);
            assert_distance(3, 0, 0.1);
            assert_all_doubtful(&life, BEACONS - 1);  // which the drive has not shown
        }
    }
}

static void test_robot_that_creeps_does_not_stand(void **state)
{
    life_t life = PLAIN;
    life.then_s = 60;
    life.creep_mps = 0.04;
    life.turn_radps = 0.02;
    live(&life);
    assert_distance(0, 0, 0.6);
    assert_distance(2, 0, 0.15);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_turning_on_the_spot_leaves_distances_as_doubtful_as_they_were),
        cmocka_unit_test(test_standing_leaves_distances_as_doubtful_as_they_were),
        cmocka_unit_test(test_one_beacon_alone_stays_as_doubtful),
        cmocka_unit_test(test_rare_frames_tell_no_distance_either),
        cmocka_unit_test(test_wheels_that_slip_on_the_spot_tell_no_distance),
        cmocka_unit_test(test_distance_that_is_measured_is_that_of_its_beacon_alone),
        cmocka_unit_test(test_stand_after_a_drive_keeps_the_map_and_tells_nothing_of_what_is_new),
        cmocka_unit_test(test_robot_that_creeps_does_not_stand),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
