// Nodes farther back become fewer: what of them stays as it was, and what becomes of the rest.
#include <math.h>

#include "support.h"

#include "bslam/model/motion.h"
#include "bslam/model/observation.h"
#include "bslam/smoother/smoother_internal.h"
#include "plain_settings.h"

enum { NODES = 40, BEACONS = 3 };

static const double places[BEACONS][2] = {{3, 2}, {4, -2.5}, {-1.5, 3}};
static const double SD_RAD = 0.0136;

static bslam_smoother_t smoother;
static bslam_ekf_t filter;
static unit_random_t noise;

/// What is seen of a beacon from node k.
static bslam_observation_t observed(int k, int beacon)
{
    const bslam_real_t *at = bslam_smoother_node(&smoother, k)->at;
    const bslam_pose_t pose = {at[0], at[1], at[2]};
    const bslam_settings_t *model = &smoother.model;
    const bslam_pose_t mount = {model->mount_x_m, model->mount_y_m, model->mount_yaw_rad};
    bslam_observation_t seen;
    assert_int_equal(
        bslam_observe_point(&pose, &mount, real(places[beacon][0]), real(places[beacon][1]), &seen),
        BSLAM_OK);
    return seen;
}

static bslam_smoother_seen_t direction_of(int k, int beacon, double error_rad, double sd_rad)
{
    const double bearing_rad = (double)observed(k, beacon).bearing_rad + error_rad;
    return (bslam_smoother_seen_t){.value = (uint16_t)bslam_smoother_units(
                                       real(unit_angle_between(bearing_rad, 0)) / BSLAM_SMOOTHER_BEARING_RAD),
                                   .weight = bslam_smoother_weight(real(sd_rad)),
                                   .beacon = (uint8_t)beacon};
}

static bslam_smoother_seen_t range_of(int k, int beacon, double error_m, int weight)
{
    const bslam_real_t range_m = observed(k, beacon).range_m + real(error_m);
    const bool is_measured = weight != BSLAM_SMOOTHER_FIRST;
    return (bslam_smoother_seen_t){
        .value = (uint16_t)(is_measured ? bslam_smoother_units(range_m / BSLAM_SMOOTHER_RANGE_M) : 0),
        .weight = (uint8_t)weight,
        .beacon = BSLAM_SMOOTHER_RANGE};
}

/// Seen from node k, behind all that was before.
static void show(int k, bslam_smoother_seen_t seen)
{
    *bslam_smoother_seen(&smoother, smoother.seen_count) = seen;
    smoother.seen_count++;
    bslam_smoother_node(&smoother, k)->seen++;
}

/// A window of nodes along a curve, with a turn on the spot in its middle, whose sightings err by nothing.
/// The third beacon is seen from every second node, and its distance from every fourth.
static void fill(int nodes)
{
    bslam_settings_t settings = unit_settings();
    settings.filter = BSLAM_FILTER_SMOOTHER;
    settings.velocity_states = 1;
    bslam_ekf_init(&filter, &settings);
    for (int b = 0; b < BEACONS; b++) {
        int index;
        assert_int_equal(bslam_ekf_add_guess(&filter, real(places[b][0]), real(places[b][1]), 1, &index),
                         BSLAM_OK);
    }
    memset(&smoother, 0, sizeof smoother);
    bslam_smoother_restart(&smoother, &settings, &filter);
    assert_true(nodes <= BSLAM_SMOOTHER_NODES_MAX);
    bslam_pose_t pose = {0, 0, 0};
    for (int k = 0; k < nodes; k++) {
        const bool spins = k > 18 && k < 24;
        const bslam_real_t v = spins ? 0 : real(0.4 + 0.1 * sin(0.3 * k));
        const bslam_real_t omega = spins ? 1 : real(0.6 * sin(0.25 * k));
        const bslam_real_t dt = real(0.12);
        bslam_motion_jacobian_t unused;
        pose = bslam_motion_step(BSLAM_MOTION_ARC, &pose, v * dt, omega * dt, &unused);
        *bslam_smoother_node(&smoother, k) = (bslam_smoother_node_t){
            .at = {pose.x_m, pose.y_m, pose.theta_rad, v, omega},
            .motion = {.dt_s = dt,
                       .forward_m = v * dt + real(unit_random(&noise, -0.01, 0.01)),
                       .turn_rad = omega * dt,
                       .forward_var_m2 = real(1e-4),
                       .turn_var_rad2 = real(2e-3)},
        };
        for (int b = 0; b < BEACONS; b++) {
            if (b < 2 || k % 2 == 0) {
                show(k, direction_of(k, b, 0, SD_RAD));
            }
            if (b == 2 && k % 4 == 0) {
                show(k, range_of(k, b, 0, 3));
            }
        }
    }
    smoother.node_count = nodes;
    smoother.anchors = 0;
    smoother.anchors_to_come = 0;
    smoother.levels[0] = nodes - 1;
}

static int setup(void **state)
{
    noise.state = 3;
    fill(NODES);
    return 0;
}

static bslam_motion_t sum_of_motions(void)
{
    bslam_motion_t sum = {0};
    for (int k = 0; k < smoother.node_count; k++) {
        bslam_smoother_add_motion(&sum, &bslam_smoother_node(&smoother, k)->motion, 1);
    }
    return sum;
}

static void assert_counts(void)
{
    int nodes = 1;
    int seen = 0;
    for (int l = 0; l < BSLAM_SMOOTHER_LEVELS; l++) {
        assert_true(smoother.levels[l] >= 0);
        nodes += smoother.levels[l];
    }
    for (int k = 0; k < smoother.node_count; k++) {
        seen += bslam_smoother_node(&smoother, k)->seen;
    }
    assert_int_equal(smoother.node_count, nodes);
    assert_int_equal(smoother.seen_count, seen);
}

// ---- what stays -------------------------------------------------------------------------------------------

static void test_window_that_has_room_stays_as_it_is(void **state)
{
    static bslam_smoother_t before;
    before = smoother;
    bslam_smoother_thin(&smoother, NODES);
    assert_memory_equal(&smoother, &before, sizeof smoother);
}

static void test_no_motion_is_lost_and_neither_the_oldest_nor_the_newest_node(void **state)
{
    for (int most = NODES - 1; most > 20; most -= 3) {
        const bslam_motion_t before = sum_of_motions();
        const bslam_smoother_node_t first = *bslam_smoother_node(&smoother, 0);
        const bslam_smoother_node_t last = *bslam_smoother_node(&smoother, smoother.node_count - 1);
        bslam_smoother_thin(&smoother, most);
        assert_int_equal(smoother.node_count, most);
        assert_counts();
        const bslam_motion_t after = sum_of_motions();
        assert_near((double)after.dt_s, (double)before.dt_s, 1e-5);
        assert_near((double)after.forward_m, (double)before.forward_m, 1e-5);
        assert_near((double)after.turn_rad, (double)before.turn_rad, 1e-5);
        assert_near((double)after.forward_var_m2, (double)before.forward_var_m2, 1e-7);
        assert_near((double)after.turn_var_rad2, (double)before.turn_var_rad2, 1e-6);
        assert_memory_equal(bslam_smoother_node(&smoother, 0), &first, sizeof first);
        const bslam_smoother_node_t *newest = bslam_smoother_node(&smoother, smoother.node_count - 1);
        assert_memory_equal(newest->at, last.at, 3 * sizeof last.at[0]);
        assert_int_equal(newest->seen, last.seen);
    }
    assert_true(smoother.levels[1] > 0);
}

static void test_older_nodes_are_longer_ones(void **state)
{
    bslam_smoother_thin(&smoother, 30);
    bslam_smoother_thin(&smoother, 18);
    assert_true(smoother.levels[2] > 0);
    const bslam_real_t whole = real(0.12 * 4);
    assert_near((double)bslam_smoother_node(&smoother, 2)->motion.dt_s, (double)whole, 1e-5);
    assert_true(bslam_smoother_node(&smoother, smoother.node_count - 1)->motion.dt_s < real(0.2));
}

static void test_where_all_levels_are_full_the_oldest_leave(void **state)
{
    const bslam_real_t begun_s = sum_of_motions().dt_s;
    for (int most = NODES - 1; most > 3; most--) {
        bslam_smoother_thin(&smoother, most);
        assert_int_equal(smoother.node_count, most);
        assert_counts();
    }
    assert_true(sum_of_motions().dt_s < begun_s);
}

static void test_node_that_comes_into_a_full_ring_makes_room_at_the_old_end(void **state)
{
    fill(BSLAM_SMOOTHER_NODES_MAX);
    const bslam_smoother_node_t oldest = *bslam_smoother_node(&smoother, 0);
    const bslam_real_t begun_s = sum_of_motions().dt_s;
    const bslam_motion_t motion = {.dt_s = BSLAM_R(0.25)};
    filter.mean[BSLAM_STATE_X] = BSLAM_R(7.5);
    bslam_smoother_move(&smoother, &filter, &motion);
    assert_counts();
    assert_in_range(smoother.node_count, BSLAM_SMOOTHER_NODES_MAX / 2, BSLAM_SMOOTHER_NODES_MAX - 1);
    const bslam_smoother_node_t *newest = bslam_smoother_node(&smoother, smoother.node_count - 1);
    assert_true(newest->at[BSLAM_STATE_X] == BSLAM_R(7.5) && newest->motion.dt_s == motion.dt_s);
    assert_int_equal(newest->seen, 0);
    assert_memory_equal(smoother.base.mean, oldest.at, sizeof oldest.at);
    assert_near((double)sum_of_motions().dt_s, (double)(begun_s - oldest.motion.dt_s + motion.dt_s), 1e-4);
}

// ---- what becomes of the rest -----------------------------------------------------------------------------

static void test_bent_path_leads_from_a_node_to_the_next(void **state)
{
    bslam_smoother_thin(&smoother, 30);
    bslam_smoother_thin(&smoother, 18);
    int bent = 0;
    for (int k = 1; k < smoother.node_count; k++) {
        const bslam_real_t *from = bslam_smoother_node(&smoother, k - 1)->at;
        const bslam_smoother_node_t *node = bslam_smoother_node(&smoother, k);
        const bslam_bend_t bend = bslam_smoother_bend(node);
        const bslam_real_t dt = node->motion.dt_s;
        const bslam_pose_t start = {from[0], from[1], from[2] + bend.turned_rad};
        bslam_motion_jacobian_t unused;
        const bslam_pose_t end = bslam_motion_step(BSLAM_MOTION_ARC, &start, node->at[3] * dt * bend.stretch,
                                                   node->at[4] * dt, &unused);
        // A way shorter than 1 cm has no direction.
        const double least =
            hypot((double)(node->at[0] - from[0]), (double)(node->at[1] - from[1])) > 0.012 ? 1e-4 : 0.024;
        assert_near((double)end.x_m, (double)node->at[0], least);
        assert_near((double)end.y_m, (double)node->at[1], least);
        assert_near(unit_angle_between((double)(end.theta_rad - bend.turned_rad), (double)node->at[2]), 0,
                    1e-5);
        bent += bend.turned_rad > real(0.01) || bend.turned_rad < real(-0.01) ? 1 : 0;
    }
    assert_true(bent > 2);
}

static void test_joined_node_has_moved_by_the_mean_of_what_its_nodes_have(void **state)
{
    for (int k = 0; k < NODES; k++) {
        for (int i = 0; i < BSLAM_ROBOT_DIM_MAX; i++) {
            bslam_smoother_node(&smoother, k)->moved[i] = (int16_t)(32767 - 10 * k - 100 * i);
        }
    }
    bslam_smoother_thin(&smoother, NODES - 1);
    for (int i = 0; i < BSLAM_ROBOT_DIM_MAX; i++) {
        assert_int_equal(bslam_smoother_node(&smoother, 0)->moved[i], 32767 - 100 * i);
        assert_int_equal(bslam_smoother_node(&smoother, 1)->moved[i], 32767 - 15 - 100 * i);
        assert_int_equal(bslam_smoother_node(&smoother, 2)->moved[i], 32767 - 30 - 100 * i);
    }
}

static void test_way_shorter_than_a_centimetre_has_no_bend(void **state)
{
    // The speeds say 12 mm straight ahead, where it is 9 or 11 mm and half a radian to the left of that.
    static const double ways_m[] = {0.011, 0.009};
    for (int i = 0; i < COUNT_OF(ways_m); i++) {
        fill(NODES);
        const bslam_real_t *from = bslam_smoother_node(&smoother, 0)->at;
        const double direction_rad = (double)from[BSLAM_STATE_THETA] + 0.5;
        for (int k = 1; k < 3; k++) {
            bslam_real_t *at = bslam_smoother_node(&smoother, k)->at;
            at[BSLAM_STATE_X] = from[BSLAM_STATE_X] + real(ways_m[i] * cos(direction_rad));
            at[BSLAM_STATE_Y] = from[BSLAM_STATE_Y] + real(ways_m[i] * sin(direction_rad));
            at[BSLAM_STATE_THETA] = from[BSLAM_STATE_THETA];
            at[BSLAM_STATE_FORWARD] = real(0.012 / 0.18);
            at[BSLAM_STATE_TURN] = 0;
        }
        bslam_smoother_thin(&smoother, NODES - 1);
        const bslam_bend_t bend = bslam_smoother_bend(bslam_smoother_node(&smoother, 1));
        assert_near((double)bend.turned_rad, i == 0 ? 0.5 : 0, 1e-3);
        assert_near((double)bend.stretch, i == 0 ? 11.0 / 12 : 1, 1e-3);
    }
}

static void test_directions_are_those_from_where_the_node_is_and_weigh_as_many(void **state)
{
    bslam_smoother_thin(&smoother, 30);
    bslam_smoother_thin(&smoother, 18);
    int at = 0;
    for (int k = 0; k < smoother.node_count; k++) {
        const bslam_smoother_node_t *node = bslam_smoother_node(&smoother, k);
        const bslam_pose_t pose = {node->at[0], node->at[1], node->at[2]};
        const bslam_pose_t mount = {smoother.model.mount_x_m, smoother.model.mount_y_m,
                                    smoother.model.mount_yaw_rad};
        bslam_observation_t seen = {0};
        for (int s = 0; s < node->seen; s++, at++) {
            const bslam_smoother_seen_t *one = bslam_smoother_seen(&smoother, at);
            if (one->beacon == BSLAM_SMOOTHER_RANGE) {
                assert_near((double)(one->value * BSLAM_SMOOTHER_RANGE_M), (double)seen.range_m, 0.02);
                continue;
            }
            const double *place = places[one->beacon];
            assert_int_equal(bslam_observe_point(&pose, &mount, real(place[0]), real(place[1]), &seen),
                             BSLAM_OK);
            const double off = (double)(bslam_smoother_bearing_rad(one) - seen.bearing_rad);
            assert_near(unit_angle_between(off, 0), 0, 4e-4);
        }
    }
    assert_int_equal(at, smoother.seen_count);
    // The third node is of four, from all of which the first beacon was seen: half as doubtful.
    const bslam_smoother_seen_t *first = bslam_smoother_seen(
        &smoother, bslam_smoother_node(&smoother, 0)->seen + bslam_smoother_node(&smoother, 1)->seen);
    assert_int_equal(first->beacon, 0);
    assert_near((double)bslam_smoother_sd_rad(first), SD_RAD / 2, 0.06 * SD_RAD / 2);
}

/// Nodes 1 and 2 become node 1, half way between them.
static void join_pair(void)
{
    bslam_smoother_thin(&smoother, NODES - 1);
    assert_counts();
    assert_near((double)bslam_smoother_node(&smoother, 1)->motion.dt_s, 0.12 * 1.5, 1e-6);
}

/// As if no node had seen anything.
static void forget_seen(void)
{
    for (int k = 0; k < smoother.node_count; k++) {
        bslam_smoother_node(&smoother, k)->seen = 0;
    }
    smoother.seen_count = 0;
}

static void test_directions_that_differ_become_their_weighted_mean(void **state)
{
    forget_seen();
    // Four times as sure as the other one: (4 x 20 - 10) / 5 mrad off.
    show(1, direction_of(1, 0, 0.02, SD_RAD));
    const double about_pi_rad = 3.14159265 - (double)observed(1, 2).bearing_rad;
    show(1, direction_of(1, 2, about_pi_rad - 0.1, SD_RAD));
    show(2, direction_of(2, 0, -0.01, 2 * SD_RAD));
    show(2, direction_of(2, 2, about_pi_rad + 0.1, SD_RAD));
    join_pair();
    assert_int_equal(smoother.seen_count, 2);
    const bslam_smoother_seen_t *first = bslam_smoother_seen(&smoother, 0);
    const bslam_smoother_seen_t *across = bslam_smoother_seen(&smoother, 1);
    const double off_rad = (double)(bslam_smoother_bearing_rad(first) - observed(1, 0).bearing_rad);
    assert_near(unit_angle_between(off_rad, 0), 0.014, 3e-4);
    assert_near((double)bslam_smoother_sd_rad(first), SD_RAD * 2 / sqrt(5), 0.06 * SD_RAD);
    // On both sides of half a turn: not what lies between them the other way round.
    const double around_rad = (double)(bslam_smoother_bearing_rad(across) - observed(1, 2).bearing_rad);
    assert_near(unit_angle_between(around_rad, about_pi_rad), 0, 3e-4);
}

/// No distance.
#define NONE 0
#define FIRST BSLAM_SMOOTHER_FIRST

static void test_distances_become_their_mean_and_a_measured_one_is_never_lost(void **state)
{
    static const struct {
        int older;  ///< mean of so many
        double older_error_m;
        int newer;
        double newer_error_m;
        int joined;
        double joined_error_m;
    } cases[] = {
        {NONE, 0, NONE, 0, NONE, 0},         {3, 0.1, NONE, 0, 3, 0.1},
        {NONE, 0, 3, 0.1, 3, 0.1},           {FIRST, 0, NONE, 0, FIRST, 0},
        {NONE, 0, FIRST, 0, FIRST, 0},       {FIRST, 0, 3, 0.1, 3, 0.1},
        {3, 0.1, FIRST, 0, 3, 0.1},          {3, 0.1, 1, -0.02, 4, 0.07},
        {200, 0.1, 100, -0.2, FIRST - 1, 0},  // a count that has no room is the largest that has
    };
    for (int i = 0; i < COUNT_OF(cases); i++) {
        fill(NODES);
        forget_seen();
        const int weights[2] = {cases[i].older, cases[i].newer};
        const double errors_m[2] = {cases[i].older_error_m, cases[i].newer_error_m};
        for (int k = 0; k < 2; k++) {
            show(1 + k, direction_of(1 + k, 0, 0, SD_RAD));
            if (weights[k] != NONE) {
                show(1 + k, range_of(1 + k, 0, errors_m[k], weights[k]));
            }
        }
        join_pair();
        assert_int_equal(smoother.seen_count, cases[i].joined == NONE ? 1 : 2);
        if (cases[i].joined != NONE) {
            const bslam_smoother_seen_t *range = bslam_smoother_seen(&smoother, 1);
            const bslam_smoother_seen_t expected = range_of(1, 0, cases[i].joined_error_m, cases[i].joined);
            assert_int_equal(range->beacon, BSLAM_SMOOTHER_RANGE);
            assert_int_equal(range->weight, cases[i].joined);
            assert_near(range->value, expected.value, cases[i].joined == FIRST ? 0 : 1);
        }
    }
}

static void test_what_is_seen_of_a_beacon_where_the_robot_stands_stays_as_it_was(void **state)
{
    // At the older node, at the newer one, or half way between them: from there it has no direction.
    for (int i = 0; i < 3; i++) {
        fill(NODES);
        forget_seen();
        const bslam_smoother_seen_t direction = direction_of(1, 0, 0.3, SD_RAD);
        const bslam_smoother_seen_t range = range_of(1, 0, 0, 3);
        show(i == 1 ? 2 : 1, direction);
        show(i == 1 ? 2 : 1, range);
        const bslam_real_t *older = bslam_smoother_node(&smoother, i == 1 ? 2 : 1)->at;
        const bslam_real_t *newer = bslam_smoother_node(&smoother, i == 0 ? 1 : 2)->at;
        bslam_real_t *place = &smoother.base.mean[smoother.base.beacons[0].at];
        place[0] = (older[BSLAM_STATE_X] + newer[BSLAM_STATE_X]) / 2;
        place[1] = (older[BSLAM_STATE_Y] + newer[BSLAM_STATE_Y]) / 2;
        join_pair();
        assert_int_equal(smoother.seen_count, 2);
        assert_int_equal(bslam_smoother_seen(&smoother, 0)->value, direction.value);
        assert_int_equal(bslam_smoother_seen(&smoother, 1)->value, range.value);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_window_that_has_room_stays_as_it_is, setup),
        cmocka_unit_test_setup(test_no_motion_is_lost_and_neither_the_oldest_nor_the_newest_node, setup),
        cmocka_unit_test_setup(test_older_nodes_are_longer_ones, setup),
        cmocka_unit_test_setup(test_where_all_levels_are_full_the_oldest_leave, setup),
        cmocka_unit_test_setup(test_node_that_comes_into_a_full_ring_makes_room_at_the_old_end, setup),
        cmocka_unit_test_setup(test_bent_path_leads_from_a_node_to_the_next, setup),
        cmocka_unit_test_setup(test_joined_node_has_moved_by_the_mean_of_what_its_nodes_have, setup),
        cmocka_unit_test_setup(test_way_shorter_than_a_centimetre_has_no_bend, setup),
        cmocka_unit_test_setup(test_directions_are_those_from_where_the_node_is_and_weigh_as_many, setup),
        cmocka_unit_test_setup(test_directions_that_differ_become_their_weighted_mean, setup),
        cmocka_unit_test_setup(test_distances_become_their_mean_and_a_measured_one_is_never_lost, setup),
        cmocka_unit_test_setup(test_what_is_seen_of_a_beacon_where_the_robot_stands_stays_as_it_was, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
