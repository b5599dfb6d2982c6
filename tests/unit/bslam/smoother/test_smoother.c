// Nodes, refusals, and drives that tell little: through the pipeline.
#include <math.h>

#include "support.h"

#include "bslam/slam/slam.h"
#include "bslam/smoother/smoother_internal.h"
#include "plain_settings.h"

enum { STEP_US = 40000, LABELS = 4 };

static const double places[LABELS][2] = {{3, 2}, {4, -2.5}, {-1.5, 3}, {1, -3}};

static bslam_slam_t slam;
static bslam_smoother_t smoother;
static unit_random_t noise;
static double pose[3];
static int step;

static bslam_settings_t smoother_params(void)
{
    bslam_settings_t settings = unit_settings();
    settings.filter = BSLAM_FILTER_SMOOTHER;
    settings.velocity_states = 1;
    settings.velocity_walk_mps_sqrt_s = 30;
    settings.turn_rate_walk_radps_sqrt_s = 1;
    settings.turn_rate_decay_s = 1;
    settings.left_speed_sd_mps = BSLAM_R(0.1);
    settings.right_speed_sd_mps = BSLAM_R(0.1);
    settings.bearing_sd_rad = BSLAM_R(0.01);
    return settings;
}

static int setup(void **state)
{
    const bslam_settings_t settings = smoother_params();
    int bad_id;
    memset(&smoother, 0, sizeof smoother);
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    bslam_slam_attach_smoother(&slam, &smoother);
    memset(pose, 0, sizeof pose);
    noise.state = 5;
    step = 0;
    return 0;
}

// ---- drives -----------------------------------------------------------------------------------------------

/// The wheels read what they went and 4 mm more or less.
static void drive(double left_m, double right_m)
{
    const double turn_rad = (right_m - left_m) / 0.4;
    double c;
    double s;
    unit_mean_direction(pose[2], turn_rad, &c, &s);
    pose[0] += (left_m + right_m) / 2 * c;
    pose[1] += (left_m + right_m) / 2 * s;
    pose[2] += turn_rad;
    step++;
    const bslam_odometry_reading_t reading = {
        .time_us = (int64_t)step * STEP_US,
        .source = BSLAM_ODOMETRY_WHEELS,
        .left_m = real(left_m + unit_random(&noise, -0.007, 0.007)),
        .right_m = real(right_m + unit_random(&noise, -0.007, 0.007)),
    };
    assert_int_equal(bslam_slam_odometry(&slam, &reading), BSLAM_OK);
}

static bslam_sighting_t sighting_of(int label)
{
    const double x = places[label % LABELS][0] + label / LABELS;
    const double y = places[label % LABELS][1] + label / LABELS;
    const double bearing = atan2(y - pose[1], x - pose[0]) - pose[2] + unit_random(&noise, -0.017, 0.017);
    return unit_direction(unit_angle_between(bearing, 0), label);
}

static void look(int first, int count)
{
    bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX];
    for (int i = 0; i < count; i++) {
        seen[i] = sighting_of(first + i);
    }
    assert_int_equal(bslam_slam_sightings(&slam, (int64_t)step * STEP_US, seen, count), BSLAM_OK);
}

static void drive_curve(int steps)
{
    if (step == 0) {
        look(0, LABELS);
    }
    for (int k = 0; k < steps; k++) {
        drive(0.016 + 0.003 * sin(0.05 * step), 0.016 + 0.003 * cos(0.03 * step));
        look(0, LABELS);
    }
}

/// Standard deviation of a beacon's place along the direction from the origin to it.
static double sd_along(int index)
{
    bslam_beacon_view_t view;
    assert_int_equal(bslam_slam_beacon(&slam, index, &view), BSLAM_OK);
    const double x = (double)view.x_m;
    const double y = (double)view.y_m;
    const double variance = x * x * (double)view.covariance_m2.xx +
                            2 * x * y * (double)view.covariance_m2.xy + y * y * (double)view.covariance_m2.yy;
    assert_true(variance > 0);
    return sqrt(variance / (x * x + y * y));
}

static void assert_sound(void)
{
    assert_true(bslam_ekf_is_sane(&slam.ekf));
    assert_int_equal(smoother.insane, 0);
    assert_in_range(smoother.node_count, 0, BSLAM_SMOOTHER_NODES_MAX);
    assert_in_range(smoother.seen_count, 0, BSLAM_SMOOTHER_SEEN_MAX);
    int seen = 0;
    for (int k = 0; k < smoother.node_count; k++) {
        const bslam_smoother_node_t *node = bslam_smoother_node(&smoother, k);
        for (int i = 0; i < slam.ekf.base_dim; i++) {
            assert_true(bslam_is_number(node->at[i]));
        }
        for (int s = 0; s < node->seen; s++) {
            const int beacon = bslam_smoother_seen(&smoother, seen + s)->beacon;
            assert_true(beacon < slam.ekf.beacon_count || (s > 0 && beacon == BSLAM_SMOOTHER_RANGE));
        }
        seen += node->seen;
    }
    assert_int_equal(seen, smoother.seen_count);
    assert_int_equal(smoother.base.beacon_count, slam.ekf.beacon_count);
    assert_int_equal(smoother.base.dim, slam.ekf.dim);
}

// ---- nodes ------------------------------------------------------------------------------------------------

static void test_node_is_the_line_through_its_bearings(void **state)
{
    // Weighted least squares of a line, by hand: offset and slope, the slope about -omega +- 0.5 rad/s.
    static const double bearing[] = {3.12, 3.15, 3.19, 3.2};  // half a turn lies between them
    static const double sd[] = {0.01, 0.02, 0.015, 0.02};
    const double omega = -0.3;
    assert_in_range(BSLAM_SMOOTHER_FRAMES, 1, COUNT_OF(bearing));
    drive_curve(3);
    bslam_smoother_restart(&smoother, &slam.settings, &slam.ekf);
    smoother.anchors_to_come = 0;
    bslam_ekf_t filter = slam.ekf;
    filter.mean[BSLAM_STATE_TURN] = real(omega);
    double a[3] = {1 / (0.5 * 0.5), 0, 0};  // of slope²; of slope, offset; of offset²
    double b[2] = {-omega / (0.5 * 0.5), 0};
    for (int k = 0; k < BSLAM_SMOOTHER_FRAMES; k++) {
        const bslam_motion_t motion = {.dt_s = BSLAM_R(0.04)};
        bslam_sighting_t seen = unit_direction(unit_angle_between(bearing[k], 0), 1);
        seen.bearing_sd_rad = real(sd[k]);
        if (k > 0) {
            bslam_smoother_move(&smoother, &filter, &motion);
        }
        bslam_smoother_see(&smoother, &seen, 1);
        const double w = 1 / (sd[k] * sd[k]);
        const double after = 0.04 * (k - BSLAM_SMOOTHER_FRAMES / 2);
        a[0] += w * after * after;
        a[1] += w * after;
        a[2] += w;
        b[0] += w * after * bearing[k];
        b[1] += w * bearing[k];
        bslam_smoother_frame(&smoother, &slam.settings, &filter);
    }
    assert_int_equal(smoother.node_count, 1);
    assert_int_equal(smoother.seen_count, 1);
    const bslam_smoother_seen_t *seen = bslam_smoother_seen(&smoother, 0);
    const double determinant = a[0] * a[2] - a[1] * a[1];
    const double expected = (a[0] * b[1] - a[1] * b[0]) / determinant;
    assert_int_equal(seen->beacon, 1);
    assert_near(unit_angle_between((double)bslam_smoother_bearing_rad(seen), expected), 0, 6e-5);
    // Kept with five bits, the first of which is 1, so half of the last one off at most.
    const double sd_rad = sqrt(a[0] / determinant);
    const double last_bit_rad = 1e-6 * exp2(floor(log2(sd_rad * 1e6)) - 4);
    assert_near((double)bslam_smoother_sd_rad(seen), sd_rad, 0.51 * last_bit_rad);
}

static void test_first_frames_stay_nodes_of_their_own(void **state)
{
    drive_curve(BSLAM_SMOOTHER_ANCHORS - 1);  // and the frame at the start
    assert_int_equal(smoother.node_count, BSLAM_SMOOTHER_ANCHORS);
    drive_curve(BSLAM_SMOOTHER_FRAMES);
    assert_int_equal(smoother.node_count, BSLAM_SMOOTHER_ANCHORS + 1);
    drive_curve(2 * BSLAM_SMOOTHER_NODES_MAX * BSLAM_SMOOTHER_FRAMES);
    assert_true(smoother.levels[1] > 0);
    assert_int_equal(smoother.anchors, BSLAM_SMOOTHER_ANCHORS);
    for (int k = 1; k < smoother.anchors; k++) {
        assert_near((double)bslam_smoother_node(&smoother, k)->motion.dt_s, 1e-6 * STEP_US, 1e-6);
    }
    while (smoother.node_count > 1) {
        const int anchors = smoother.anchors;
        bslam_smoother_drop_oldest(&smoother);
        int nodes = anchors > 2 ? anchors - 1 : 1;
        for (int l = 0; l < BSLAM_SMOOTHER_LEVELS; l++) {
            nodes += smoother.levels[l];
        }
        assert_int_equal(smoother.node_count, nodes);
    }
}

static void test_deviation_is_kept_within_three_percent_and_one_radian_at_most(void **state)
{
    static const double kept_rad[] = {16e-6, 1e-4, 1e-3, 0.0136, 0.1, 0.5, 1};
    static const double larger_rad[] = {1.1, 2, 1e3};
    bslam_smoother_seen_t seen = {0};
    for (int i = 0; i < COUNT_OF(kept_rad); i++) {
        seen.weight = bslam_smoother_weight(real(kept_rad[i]));
        assert_near((double)bslam_smoother_sd_rad(&seen) / kept_rad[i], 1, 0.032);
    }
    for (int i = 0; i < COUNT_OF(larger_rad); i++) {
        seen.weight = bslam_smoother_weight(real(larger_rad[i]));
        assert_near((double)bslam_smoother_sd_rad(&seen), 31e-6 * 32768, 1e-6);
    }
}

static void test_windows_of_any_length_stay_within_their_room(void **state)
{
    for (int k = 0; k < 4; k++) {
        drive_curve(BSLAM_SMOOTHER_NODES_MAX);
        assert_sound();
    }
    assert_true(smoother.node_count > BSLAM_SMOOTHER_NODES_MAX / 2);
    assert_true(smoother.cycles > 8);
}

static void test_more_beacons_than_the_window_holds_push_the_oldest_out(void **state)
{
    const int count = BSLAM_BEACONS_MAX < BSLAM_SIGHTINGS_MAX ? BSLAM_BEACONS_MAX : BSLAM_SIGHTINGS_MAX;
    look(0, count);
    for (int k = 0; k < 4 * BSLAM_SMOOTHER_NODES_MAX; k++) {
        drive(0.016, 0.018);
        look(0, count);
    }
    assert_sound();
    assert_int_equal(smoother.seen_count, smoother.node_count * count);
    assert_true(smoother.seen_count > BSLAM_SMOOTHER_SEEN_MAX / 2);
}

static void test_frames_that_show_one_beacon_fill_the_window_with_nodes(void **state)
{
    look(0, 1);
    for (int k = 0; k < 16 * BSLAM_SMOOTHER_NODES_MAX; k++) {
        drive(0.016, 0.018);
        look(0, 1);
    }
    assert_sound();
    assert_int_equal(smoother.seen_count, smoother.node_count);
    assert_true(smoother.node_count > BSLAM_SMOOTHER_NODES_MAX / 2);
    assert_true(bslam_smoother_node(&smoother, 0)->seen == 1);
}

/// Drives on unseen until this much of time has gone, and says how many nodes came of it.
static int nodes_of_unseen_s(int seconds)
{
    const int before = smoother.node_count;
    const int first = step;
    while (step - first < seconds * 1000000 / STEP_US) {
        drive(0.016, 0.016);
    }
    return smoother.node_count - before;
}

static void test_where_nothing_is_seen_cycles_end_too(void **state)
{
    drive_curve(60);
    const uint32_t cycles = smoother.cycles;
    const int nodes = nodes_of_unseen_s(20);
    assert_in_range(nodes, 80, 100);  // five steps each, or six as 0.04 s is rounded
    assert_true(smoother.cycles > cycles + 5);
    assert_sound();
    // The filter is what the last cycle made of it at the newest node, and has gone on to now.
    look(0, LABELS);
    assert_sound();
}

static void test_ways_of_odometry_alone_make_longer_nodes(void **state)
{
    bslam_settings_t settings = smoother_params();
    settings.velocity_states = 0;
    int bad_id;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    bslam_slam_attach_smoother(&slam, &smoother);
    drive_curve(60);
    const int nodes = nodes_of_unseen_s(20);
    assert_in_range(nodes, 28, 34);  // fifteen steps each, or sixteen
    assert_sound();
}

static void test_beacon_leaves_in_any_phase(void **state)
{
    bool met[3] = {false, false, false};
    for (int k = 0; k < 60; k++) {
        drive_curve(5);
        met[smoother.phase] = true;
        bslam_beacon_view_t view;
        assert_int_equal(bslam_slam_beacon(&slam, k % LABELS, &view), BSLAM_OK);
        assert_int_equal(bslam_slam_remove_beacon(&slam, view.uid), BSLAM_OK);
        assert_sound();
    }
    assert_true(met[BSLAM_SMOOTHER_FORTH] && met[BSLAM_SMOOTHER_UP] && met[BSLAM_SMOOTHER_BACK]);
}

// ---- refusals ---------------------------------------------------------------------------------------------

static void refuse_frame(const bslam_sighting_t *seen, int count, int64_t time_us, bslam_status_t expected)
{
    assert_int_equal(bslam_slam_sightings(&slam, time_us, seen, count), expected);
}

static void refuse_odometry(int64_t time_us, double left_m, bslam_status_t expected)
{
    const bslam_odometry_reading_t reading = {
        .time_us = time_us, .source = BSLAM_ODOMETRY_WHEELS, .left_m = real(left_m)};
    assert_int_equal(bslam_slam_odometry(&slam, &reading), expected);
}

static void refuse_all(void)
{
    const int64_t now_us = (int64_t)step * STEP_US;
    bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX + 1] = {{0}};
    const bslam_pose_t nowhere = {real(NAN), 0, 0};
    const bslam_pose_t somewhere = {0, 0, 0};
    int index;
    refuse_frame(seen, BSLAM_SIGHTINGS_MAX + 1, now_us + 1, BSLAM_E_COUNT);
    refuse_frame(seen, -1, now_us + 1, BSLAM_E_COUNT);
    refuse_frame(seen, 1, 0, BSLAM_E_TIME);
    refuse_frame(seen, 1, now_us + 10000000, BSLAM_E_TIME);
    seen[0].bearing_rad = real(NAN);
    refuse_frame(seen, 1, now_us + 1, BSLAM_E_NOT_FINITE);
    seen[0].bearing_rad = 9;
    refuse_frame(seen, 1, now_us + 1, BSLAM_E_RANGE);
    refuse_odometry(now_us, 0, BSLAM_E_TIME);
    refuse_odometry(now_us + 1, INFINITY, BSLAM_E_NOT_FINITE);
    assert_int_equal(bslam_slam_set_pose(&slam, &nowhere, 0, 0), BSLAM_E_NOT_FINITE);
    assert_int_equal(bslam_slam_set_pose(&slam, &somewhere, -1, 0), BSLAM_E_RANGE);
    assert_int_equal(bslam_slam_resume_odometry(&slam, 0, 4), BSLAM_E_RANGE);
    assert_int_equal(bslam_slam_add_known_beacon(&slam, 0, 1, 1), BSLAM_E_DUPLICATE);
    assert_int_equal(bslam_slam_add_known_beacon(&slam, 9, real(NAN), 1), BSLAM_E_NOT_FINITE);
    assert_int_equal(bslam_slam_remove_beacon(&slam, 999), BSLAM_E_NO_BEACON);
    assert_int_equal(bslam_slam_beacon(&slam, LABELS, NULL), BSLAM_E_NO_BEACON);
    assert_int_equal(bslam_slam_init(&slam, &(bslam_settings_t){0}, &index), BSLAM_E_PARAMETER);
}

static void test_refusals_leave_smoother_and_filter_as_they_are_in_any_phase(void **state)
{
    static bslam_smoother_t smoother_before;
    static bslam_ekf_t filter_before;
    bool met[3] = {false, false, false};
    drive_curve(100);
    for (int k = 0; k < 40; k++) {
        drive_curve(1);
        met[smoother.phase] = true;
        smoother_before = smoother;
        filter_before = slam.ekf;
        const uint32_t refused = slam.counters.frames_refused;
        refuse_all();
        assert_int_equal(slam.counters.frames_refused, refused + 6);
        assert_memory_equal(&smoother, &smoother_before, sizeof smoother);
        assert_memory_equal(&slam.ekf, &filter_before, sizeof filter_before);
    }
    assert_true(met[BSLAM_SMOOTHER_FORTH] && met[BSLAM_SMOOTHER_UP] && met[BSLAM_SMOOTHER_BACK]);
}

static void test_full_map_takes_no_beacon_and_says_so(void **state)
{
    static bslam_smoother_t smoother_before;
    static bslam_ekf_t filter_before;
    for (int label = 0; label < BSLAM_BEACONS_MAX; label++) {
        drive(0.016, 0.016);
        look(label, 1);
    }
    assert_int_equal(slam.ekf.beacon_count, BSLAM_BEACONS_MAX);
    const bslam_sighting_t seen = sighting_of(BSLAM_BEACONS_MAX);
    const bslam_pose_t mount = {0, 0, 0};
    int index = -1;
    smoother_before = smoother;
    filter_before = slam.ekf;
    assert_int_equal(bslam_smoother_add(&smoother, &slam.ekf, &mount, &seen, &index), BSLAM_E_MAP_FULL);
    assert_memory_equal(&smoother, &smoother_before, sizeof smoother);
    assert_memory_equal(&slam.ekf, &filter_before, sizeof filter_before);
    drive(0.016, 0.016);
    look(BSLAM_BEACONS_MAX, 1);
    assert_int_equal(slam.accounts[0].reason, BSLAM_REASON_MAP_FULL);
    assert_sound();
}

// ---- drives that tell little ------------------------------------------------------------------------------

static void test_beacon_straight_ahead_is_never_ranged(void **state)
{
    // Driven at from afar, its direction never changes: nothing tells how far it is.
    for (int k = 0; k < 400; k++) {
        const bslam_sighting_t ahead = unit_direction(unit_random(&noise, -0.017, 0.017) - pose[2], 0);
        assert_int_equal(bslam_slam_sightings(&slam, (int64_t)step * STEP_US, &ahead, 1), BSLAM_OK);
        drive(0.004, 0.004);
    }
    assert_sound();
    assert_true(sd_along(0) > 1);
}

static void test_robot_that_only_turns_learns_no_distance(void **state)
{
    look(0, LABELS);
    for (int k = 0; k < 500; k++) {
        drive(-0.004, 0.004);
        look(0, LABELS);
    }
    assert_sound();
    for (int b = 0; b < LABELS; b++) {
        // Half of the doubt of a first guess is left at least, which is half of the distance; and it is true.
        bslam_beacon_view_t view;
        assert_int_equal(bslam_slam_beacon(&slam, b, &view), BSLAM_OK);
        const double distance_m = hypot((double)view.x_m, (double)view.y_m);
        assert_true(sd_along(b) > 0.25 * distance_m);
        assert_near(distance_m, hypot(places[b][0], places[b][1]), 2.5 * sd_along(b));
    }
}

static void test_robot_that_stands_stays_sound_and_where_it_is(void **state)
{
    look(0, LABELS);
    for (int k = 0; k < 500; k++) {
        drive(0, 0);
        look(0, LABELS);
    }
    assert_sound();
    assert_near(slam.ekf.mean[BSLAM_STATE_X], 0, 0.3);
    assert_near(slam.ekf.mean[BSLAM_STATE_Y], 0, 0.3);
}

static void test_estimate_that_is_not_finite_is_not_taken(void **state)
{
    drive_curve(200);
    while (smoother.phase != BSLAM_SMOOTHER_FORTH) {
        drive_curve(1);
    }
    smoother.run.factor.d[0] = real(NAN);
    while (smoother.insane == 0) {
        drive_curve(1);
        assert_true(bslam_ekf_is_sane(&slam.ekf));
    }
    drive_curve(100);
    assert_int_equal(smoother.insane, 1);
    assert_true(smoother.node_count > 20);
    assert_true(bslam_ekf_is_sane(&slam.ekf));
}

static void test_without_the_parameter_it_is_not_attached(void **state)
{
    bslam_settings_t settings = smoother_params();
    int bad_id;
    settings.filter = BSLAM_FILTER_INVARIANT;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    bslam_slam_attach_smoother(&slam, &smoother);
    assert_null(slam.smoother);
    settings.filter = BSLAM_FILTER_SMOOTHER;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    bslam_slam_attach_smoother(&slam, &smoother);
    assert_ptr_equal(slam.smoother, &smoother);
    bslam_slam_attach_smoother(&slam, NULL);
    assert_null(slam.smoother);
    drive_curve(10);
    assert_int_equal(smoother.node_count, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_node_is_the_line_through_its_bearings, setup),
        cmocka_unit_test_setup(test_first_frames_stay_nodes_of_their_own, setup),
        cmocka_unit_test(test_deviation_is_kept_within_three_percent_and_one_radian_at_most),
        cmocka_unit_test_setup(test_windows_of_any_length_stay_within_their_room, setup),
        cmocka_unit_test_setup(test_more_beacons_than_the_window_holds_push_the_oldest_out, setup),
        cmocka_unit_test_setup(test_frames_that_show_one_beacon_fill_the_window_with_nodes, setup),
        cmocka_unit_test_setup(test_where_nothing_is_seen_cycles_end_too, setup),
        cmocka_unit_test_setup(test_ways_of_odometry_alone_make_longer_nodes, setup),
        cmocka_unit_test_setup(test_beacon_leaves_in_any_phase, setup),
        cmocka_unit_test_setup(test_refusals_leave_smoother_and_filter_as_they_are_in_any_phase, setup),
        cmocka_unit_test_setup(test_full_map_takes_no_beacon_and_says_so, setup),
        cmocka_unit_test_setup(test_beacon_straight_ahead_is_never_ranged, setup),
        cmocka_unit_test_setup(test_robot_that_only_turns_learns_no_distance, setup),
        cmocka_unit_test_setup(test_robot_that_stands_stays_sound_and_where_it_is, setup),
        cmocka_unit_test_setup(test_estimate_that_is_not_finite_is_not_taken, setup),
        cmocka_unit_test_setup(test_without_the_parameter_it_is_not_attached, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
