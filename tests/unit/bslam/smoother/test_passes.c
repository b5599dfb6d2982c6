// The three ways of a cycle against one small batch least squares over all that the window holds: in double,
// dense, derivatives by finite differences of the models as they stand on the page.
#include <math.h>

#include "support.h"
#include "twin.h"

#include "bslam/model/motion.h"
#include "bslam/smoother/smoother_internal.h"
#include "plain_settings.h"

enum { BEACONS = 3, BASE = 5, WALKS = 2, STEP = WALKS + 2, DIM = BASE + 2 * BEACONS };

/// Of a standard deviation, on the way forth: finite differences, and in float roundings.
#define TOLERANCE_FORTH (BSLAM_REAL_DOUBLE ? 1e-7 : 2e-3)
/// On the way back the (1 mm)² that it takes a pose to be doubtful by at least, beside the centimetres here.
#define TOLERANCE_BACK 0.02

static bslam_smoother_t smoother;
static bslam_ekf_t filter;
static bslam_settings_t settings;

// ---- the models from their definitions --------------------------------------------------------------------

/// What a step depends on: the robot's values, and what its two speeds walk by.
enum { V = BSLAM_STATE_FORWARD, OMEGA = BSLAM_STATE_TURN, V_WALK = BASE, OMEGA_WALK, ARGUMENTS };

static void step(const double *in, double *out, const void *context)
{
    const bslam_smoother_node_t *node = context;
    const double dt_s = (double)node->motion.dt_s;
    const bslam_bend_t bend = bslam_smoother_bend(node);
    double c;
    double s;
    out[V] = in[V] / (1 + dt_s / (double)settings.velocity_decay_s) + in[V_WALK];
    out[OMEGA] = in[OMEGA] / (1 + dt_s / (double)settings.turn_rate_decay_s) + in[OMEGA_WALK];
    unit_mean_direction(in[BSLAM_STATE_THETA] + (double)bend.turned_rad, out[OMEGA] * dt_s, &c, &s);
    out[BSLAM_STATE_X] = in[BSLAM_STATE_X] + out[V] * dt_s * (double)bend.stretch * c;
    out[BSLAM_STATE_Y] = in[BSLAM_STATE_Y] + out[V] * dt_s * (double)bend.stretch * s;
    out[BSLAM_STATE_THETA] = in[BSLAM_STATE_THETA] + out[OMEGA] * dt_s;
}

// ---- the batch --------------------------------------------------------------------------------------------

/// Unknown are the error of the base, what the speeds walked by in each step, and what its model missed: z.
/// All else follows from them: the correction of a node is rows z + offset.
typedef struct batch {
    int nodes;
    dense_t information;  ///< normal equations of z
    dense_t vector;
    dense_t rows[64];  ///< DIM x all unknowns, by node; [0] is the base
    double offset[64][DIM];
} batch_t;

static batch_t batch;

/// A measurement of the correction at a node: h correction = y, of this variance.
static void add_measurement(int node, const double h[DIM], double y, double variance)
{
    const dense_t *rows = &batch.rows[node];
    double by[DENSE_MAX] = {0};
    double left = y;
    for (int i = 0; i < DIM; i++) {
        left -= h[i] * batch.offset[node][i];
        for (int j = 0; j < rows->columns; j++) {
            by[j] += h[i] * rows->at[i][j];
        }
    }
    for (int i = 0; i < rows->columns; i++) {
        batch.vector.at[i][0] += by[i] * left / variance;
        for (int j = 0; j < rows->columns; j++) {
            batch.information.at[i][j] += by[i] * by[j] / variance;
        }
    }
}

static void start_batch(double v_walk)
{
    bslam_smoother_linearise_base(&smoother);  // about the places of the way that follows
    const twin_t base = twin_of(&smoother.base);
    const dense_t inverse = dense_inverse(&base.covariance);
    const int unknowns = DIM + STEP * smoother.node_count;
    batch.nodes = smoother.node_count;
    batch.information = dense_zero(unknowns, unknowns);
    batch.vector = dense_zero(unknowns, 1);
    batch.rows[0] = dense_zero(DIM, unknowns);
    for (int i = 0; i < DIM; i++) {
        batch.rows[0].at[i][i] = 1;
        batch.offset[0][i] = (double)smoother.base.correction[i];
        for (int j = 0; j < DIM; j++) {
            batch.information.at[i][j] = inverse.at[i][j];
        }
    }
    const double turn_walk = (double)settings.turn_rate_walk_radps_sqrt_s;
    for (int k = 0; k < batch.nodes; k++) {
        const double dt_s = (double)bslam_smoother_node(&smoother, k)->motion.dt_s;
        const int at = DIM + STEP * k;
        batch.information.at[at][at] = 1 / (v_walk * v_walk * dt_s);
        batch.information.at[at + 1][at + 1] = 1 / (turn_walk * turn_walk * dt_s);
    }
}

/// The robot's values where node k - 1 is linearised; the base's for the first.
static void point_before(int k, double point[ARGUMENTS])
{
    const bslam_real_t *at = k > 0 ? bslam_smoother_node(&smoother, k - 1)->at : smoother.base.mean;
    for (int i = 0; i < ARGUMENTS; i++) {
        point[i] = i < BASE ? (double)at[i] : 0;
    }
}

/// The step to node k, which becomes rows[k + 1]. Linear about speeds that have walked to those of node k.
static void add_step(int k)
{
    const bslam_smoother_node_t *node = bslam_smoother_node(&smoother, k);
    double point[ARGUMENTS];
    double next[BASE];
    point_before(k, point);
    step(point, next, node);
    point[V_WALK] = (double)node->at[V] - next[V];
    point[OMEGA_WALK] = (double)node->at[OMEGA] - next[OMEGA];
    step(point, next, node);
    batch.rows[k + 1] = batch.rows[k];
    memcpy(batch.offset[k + 1], batch.offset[k], sizeof batch.offset[k]);
    for (int i = 0; i < BASE; i++) {
        const double jump = next[i] - (double)node->at[i];
        batch.offset[k + 1][i] = i == BSLAM_STATE_THETA ? unit_angle_between(jump, 0) : jump;
        memset(batch.rows[k + 1].at[i], 0, sizeof batch.rows[k + 1].at[i]);
        for (int a = 0; a < BASE; a++) {
            const double by = unit_derivative(step, point, ARGUMENTS, i, a, node);
            batch.offset[k + 1][i] += by * batch.offset[k][a];
            for (int j = 0; j < batch.rows[k].columns; j++) {
                batch.rows[k + 1].at[i][j] += by * batch.rows[k].at[a][j];
            }
        }
        for (int w = 0; w < WALKS; w++) {
            const double by = unit_derivative(step, point, ARGUMENTS, i, V_WALK + w, node);
            batch.rows[k + 1].at[i][DIM + STEP * k + w] = by;
            batch.offset[k + 1][i] -= by * point[V_WALK + w];
        }
    }
    const double miss_m = hypot(next[BSLAM_STATE_X] - (double)node->at[BSLAM_STATE_X],
                                next[BSLAM_STATE_Y] - (double)node->at[BSLAM_STATE_Y]);
    for (int i = BSLAM_STATE_X; i <= BSLAM_STATE_Y; i++) {
        const int at = DIM + STEP * k + WALKS + i - BSLAM_STATE_X;
        batch.rows[k + 1].at[i][at] = (double)bslam_smoother_bend(node).doubt_of_miss * miss_m;
        batch.information.at[at][at] = 1;  // in its own standard deviations
    }
}

/// What the wheels read on the way to node k.
static void add_speeds(int k)
{
    const bslam_smoother_node_t *node = bslam_smoother_node(&smoother, k);
    const double dt_s = (double)node->motion.dt_s;
    const double sd = sqrt((double)node->motion.forward_var_m2);
    const double share = (double)node->motion.forward_turn_cov_mrad / sd;
    const double rest = sqrt((double)node->motion.turn_var_rad2 - share * share);
    const double v = (double)node->motion.forward_m / dt_s - (double)node->at[V];
    const double omega = (double)node->motion.turn_rad / dt_s - (double)node->at[OMEGA];
    // The part of the turn's error that goes with the way's, taken off.
    double h[DIM] = {0};
    h[V] = 1;
    add_measurement(k + 1, h, v, sd * sd / (dt_s * dt_s));
    h[V] = -share / sd;
    h[OMEGA] = 1;
    add_measurement(k + 1, h, omega - share / sd * v, rest * rest / (dt_s * dt_s));
}

/// What was seen at node k. `map_is_known`: by robots that differ, not by maps that do.
static void add_seen(int k, int first_seen, bool map_is_known)
{
    const bslam_smoother_node_t *node = bslam_smoother_node(&smoother, k);
    const bslam_pose_t mount = {settings.mount_x_m, settings.mount_y_m, settings.mount_yaw_rad};
    static bslam_ekf_t there;  // for the twin: a filter that stands where node k is linearised
    double values[DENSE_MAX];
    there = smoother.base;
    for (int i = 0; i < DIM; i++) {
        there.mean[i] = i < BASE ? node->at[i] : smoother.place[i];
    }
    twin_values(&there, values);
    for (int s = 0; s < node->seen; s++) {
        const bslam_smoother_seen_t *seen = bslam_smoother_seen(&smoother, first_seen + s);
        const dense_t rows = twin_rows(&there, &mount, seen->beacon);
        const double sd_rad = (double)bslam_smoother_sd_rad(seen);
        double range_m;
        double bearing_rad;
        double h[DIM];
        twin_observe(&there, &mount, seen->beacon, values, &range_m, &bearing_rad);
        for (int i = 0; i < DIM; i++) {
            h[i] = map_is_known && i >= BASE ? 0 : rows.at[1][i];
        }
        const double measured_rad = (double)bslam_smoother_bearing_rad(seen);
        const double left_rad = unit_angle_between(measured_rad, bearing_rad);
        assert_true(fabs(left_rad) < 6 * sd_rad);  // beyond what the poses are doubtful by, Huber's rule acts
        add_measurement(k + 1, h, left_rad, sd_rad * sd_rad);
    }
}

/// The base's robot, given that the map is where it is linearised.
static void pin_map(void)
{
    for (int i = BASE; i < DIM; i++) {
        double h[DIM] = {0};
        h[i] = 1;
        add_measurement(0, h, 0, 1e-6);
    }
}

/// All unknowns and their covariance. `map_is_known`: of the robot alone.
static twin_t solve_batch(double v_walk, bool map_is_known)
{
    start_batch(v_walk);
    if (map_is_known) {
        pin_map();
    }
    int first_seen = 0;
    for (int k = 0; k < batch.nodes; k++) {
        add_step(k);
        add_speeds(k);
        add_seen(k, first_seen, map_is_known);
        first_seen += bslam_smoother_node(&smoother, k)->seen;
    }
    assert_int_equal(first_seen, smoother.seen_count);
    twin_t z = {.covariance = dense_inverse(&batch.information)};
    z.mean = dense_product(&z.covariance, &batch.vector);
    return z;
}

/// Correction i of node k (0: the base).
static double correction_of(const twin_t *z, int k, int i)
{
    double sum = batch.offset[k][i];
    for (int j = 0; j < z->mean.rows; j++) {
        sum += batch.rows[k].at[i][j] * z->mean.at[j][0];
    }
    return sum;
}

// ---- a window ---------------------------------------------------------------------------------------------

static double true_pose[3];

static void move(unit_random_t *random)
{
    const double travelled_m = 0.02 + unit_random(random, -0.004, 0.004);
    const double turn_rad = 0.02 + unit_random(random, -0.01, 0.01);
    double c;
    double s;
    unit_mean_direction(true_pose[2], turn_rad, &c, &s);
    true_pose[0] += travelled_m * c;
    true_pose[1] += travelled_m * s;
    true_pose[2] += turn_rad;
    const bslam_motion_t motion = {.dt_s = BSLAM_R(0.04),
                                   .forward_m = real(travelled_m + unit_random(random, -0.004, 0.004)),
                                   .turn_rad = real(turn_rad + unit_random(random, -0.01, 0.01)),
                                   .forward_var_m2 = BSLAM_R(1e-5),
                                   .turn_var_rad2 = BSLAM_R(1e-4),
                                   .forward_turn_cov_mrad = BSLAM_R(1e-5)};
    bslam_motion_t moved;
    bslam_ekf_predict(&filter, &settings, &motion, &moved);
    bslam_smoother_move(&smoother, &filter, &motion);
}

/// Shows each beacon where a robot of the true pose sees it.
static void see(unit_random_t *random, const double *map)
{
    const bslam_pose_t mount = {settings.mount_x_m, settings.mount_y_m, settings.mount_yaw_rad};
    double values[DENSE_MAX] = {true_pose[0], true_pose[1], true_pose[2]};
    memcpy(&values[BASE], &map[BASE], 2 * BEACONS * sizeof *map);
    for (int b = 0; b < BEACONS; b++) {
        double range_m;
        double bearing_rad;
        twin_observe(&filter, &mount, b, values, &range_m, &bearing_rad);
        const bslam_sighting_t seen = unit_direction(bearing_rad + unit_random(random, -0.01, 0.01), b);
        bslam_smoother_see(&smoother, &seen, b);
    }
    bslam_smoother_frame(&smoother, &settings, &filter);
}

static bslam_settings_t smoother_params(void)
{
    bslam_settings_t p = unit_settings();
    p.filter = BSLAM_FILTER_SMOOTHER;
    p.motion = BSLAM_MOTION_ARC;
    p.velocity_states = 1;
    p.velocity_walk_mps_sqrt_s = 2;
    p.path_walk_mps_sqrt_s = BSLAM_R(0.5);
    p.mount_x_m = BSLAM_R(0.1);
    p.mount_y_m = BSLAM_R(-0.05);
    p.mount_yaw_rad = BSLAM_R(0.3);
    return p;
}

/// A window of so many nodes, from a base in which everything is correlated, and a cycle about to begin.
static void make_window(uint64_t seed, int nodes)
{
    unit_random_t random = {seed};
    double map[DENSE_MAX];
    settings = smoother_params();
    twin_randomise(&filter, &settings, &random, BEACONS, 0);
    twin_values(&filter, map);
    memcpy(true_pose, map, sizeof true_pose);
    memset(&smoother, 0, sizeof smoother);
    bslam_smoother_restart(&smoother, &settings, &filter);
    while (smoother.node_count < nodes) {
        move(&random);
        see(&random, map);
    }
    for (int k = 0; k < nodes; k++) {
        bslam_smoother_node(&smoother, k)->turned = (int16_t)(unit_random(&random, -2000, 2000));
        bslam_smoother_node(&smoother, k)->stretched = (int16_t)(unit_random(&random, -1000, 1000));
    }
    bslam_smoother_begin(&smoother);
    assert_int_equal(smoother.node_count, nodes);
}

/// Until the way forth has ended.
static void go_forth(void)
{
    while (!bslam_smoother_work(&smoother, 1, true)) {
    }
}

/// After it, until the way back has.
static void go_up_and_back(void)
{
    bslam_smoother_turn(&smoother);
    while (smoother.phase != BSLAM_SMOOTHER_FORTH) {
        assert_false(bslam_smoother_work(&smoother, 1, true));
    }
}

// ---- the ways ---------------------------------------------------------------------------------------------

static void assert_forth_is_the_batch(uint64_t seed, int nodes)
{
    make_window(seed, nodes);
    double point[DIM];
    for (int i = 0; i < DIM; i++) {
        point[i] = (double)(i < BASE ? bslam_smoother_node(&smoother, nodes - 1)->at[i] : smoother.place[i]);
    }
    const twin_t z = solve_batch((double)settings.velocity_walk_mps_sqrt_s, false);
    const dense_t covariance = dense_sandwich(&batch.rows[nodes], &z.covariance);
    go_forth();
    for (int i = 0; i < DIM; i++) {
        const double sd = sqrt(covariance.at[i][i]);
        const double expected = point[i] + correction_of(&z, nodes, i);
        const double off = (double)smoother.run.mean[i] - expected;
        assert_near((i == BSLAM_STATE_THETA ? unit_angle_between(off, 0) : off) / sd, 0, TOLERANCE_FORTH);
        for (int j = 0; j <= i; j++) {
            const double scale = sd * sqrt(covariance.at[j][j]);
            assert_near((double)bslam_ekf_covariance(&smoother.run, i, j) / scale,
                        covariance.at[i][j] / scale, TOLERANCE_FORTH);
        }
    }
    assert_int_equal(smoother.left_out, 0);
    assert_int_equal(smoother.halved, 0);
}

static void test_forth_is_the_batch_least_squares(void **state)
{
    for (uint64_t seed = 1; seed <= 5; seed++) {
        assert_forth_is_the_batch(seed, 1 + 2 * (int)seed);
    }
}

static void assert_back_is_the_batch(uint64_t seed, int nodes)
{
    make_window(seed, nodes);
    go_forth();
    const twin_t z = solve_batch((double)settings.path_walk_mps_sqrt_s, true);
    double before[64][BASE];
    for (int k = 0; k < nodes; k++) {
        for (int i = 0; i < BASE; i++) {
            before[k][i] = (double)bslam_smoother_node(&smoother, k)->at[i];
        }
    }
    go_up_and_back();
    for (int k = 0; k < nodes; k++) {
        const dense_t covariance = dense_sandwich(&batch.rows[k + 1], &z.covariance);
        for (int i = 0; i < BASE; i++) {
            const double moved = (double)bslam_smoother_node(&smoother, k)->at[i] - before[k][i];
            const double off = moved - correction_of(&z, k + 1, i);
            assert_near((i == BSLAM_STATE_THETA ? unit_angle_between(off, 0) : off) /
                            sqrt(covariance.at[i][i]),
                        0, TOLERANCE_BACK);
        }
    }
}

static void test_up_and_back_is_the_batch_least_squares_in_the_map(void **state)
{
    for (uint64_t seed = 1; seed <= 5; seed++) {
        assert_back_is_the_batch(seed, 1 + 2 * (int)seed);
    }
}

static void test_way_back_in_several_parts_is_the_same(void **state)
{
    // One part full, one a node long, one a node short.
    assert_back_is_the_batch(6, BSLAM_SMOOTHER_PART);
    assert_back_is_the_batch(7, BSLAM_SMOOTHER_PART + 1);
    assert_back_is_the_batch(8, BSLAM_SMOOTHER_PART - 1);
}

static void test_old_end_leaves_into_the_base_without_loss(void **state)
{
    // Of a window that is linear the filter of now does not depend on where it is cut.
    make_window(9, 8);
    go_forth();
    const twin_t whole = twin_of(&smoother.run);
    make_window(9, 8);
    bslam_smoother_drop_oldest(&smoother);
    bslam_smoother_drop_oldest(&smoother);
    assert_int_equal(smoother.node_count, 6);
    bslam_smoother_begin(&smoother);
    go_forth();
    const twin_t cut = twin_of(&smoother.run);
    for (int i = 0; i < DIM; i++) {
        const double sd = sqrt(whole.covariance.at[i][i]);
        // The base's own point moves with what left, so the step from it on has another derivative.
        assert_near((cut.mean.at[i][0] - whole.mean.at[i][0]) / sd, 0, 0.05);
        assert_near(cut.covariance.at[i][i] / whole.covariance.at[i][i], 1, 0.05);
    }
}

// ---- beacons where the robot is ---------------------------------------------------------------------------

/// A window in which beacon 1 is held to be where the sensor stands at node 2. Seen from there in any
/// direction.
static void go_forth_over_a_beacon(uint16_t direction)
{
    make_window(10, 5);
    const bslam_real_t *at = bslam_smoother_node(&smoother, 2)->at;
    const double theta = (double)at[BSLAM_STATE_THETA];
    const double mount[2] = {(double)settings.mount_x_m, (double)settings.mount_y_m};
    bslam_real_t *place = &smoother.place[smoother.base.beacons[1].at];
    place[0] = at[BSLAM_STATE_X] + real(cos(theta) * mount[0] - sin(theta) * mount[1]);
    place[1] = at[BSLAM_STATE_Y] + real(sin(theta) * mount[0] + cos(theta) * mount[1]);
    bslam_smoother_seen_t *seen = bslam_smoother_seen(&smoother, 2 * BEACONS + 1);
    assert_int_equal(seen->beacon, 1);
    seen->value = direction;
    smoother.fit = BSLAM_R(1e6);  // however it fits, it is not gone again
    bslam_smoother_begin(&smoother);
    go_forth();
}

static void test_sighting_from_the_beacon_s_own_place_is_left_out_and_counted(void **state)
{
    static bslam_ekf_t other;
    go_forth_over_a_beacon(0);
    assert_int_equal(smoother.left_out, 1);
    assert_true(bslam_ekf_is_sane(&smoother.run));
    other = smoother.run;
    go_forth_over_a_beacon(20000);
    assert_memory_equal(smoother.run.mean, other.mean, sizeof other.mean);
    assert_memory_equal(&smoother.run.factor, &other.factor, sizeof other.factor);
}

static void test_beacon_near_the_robot_is_linearised_about_a_metre_off(void **state)
{
    // The way forth ends at a robot in (1, 2), on beacon 0, 0.4 m from beacon 1 and 2.5 m from beacon 2.
    static const double ends[BEACONS][2] = {{1, 2}, {1 + 0.24, 2 + 0.32}, {1 - 2.5, 2}};
    static const double abouts[BEACONS][2] = {{1, 2}, {1 + 0.6, 2 + 0.8}, {1 - 2.5, 2}};
    make_window(11, 1);
    bslam_ekf_t *run = &smoother.run;
    smoother.at = smoother.node_count;
    memset(run->correction, 0, sizeof run->correction);
    run->mean[BSLAM_STATE_X] = 1;
    run->mean[BSLAM_STATE_Y] = 2;
    for (int b = 0; b < BEACONS; b++) {
        run->mean[run->beacons[b].at] = real(ends[b][0]);
        run->mean[run->beacons[b].at + 1] = real(ends[b][1]);
    }
    go_forth();
    for (int b = 0; b < BEACONS; b++) {
        const int at = run->beacons[b].at;
        assert_near((double)smoother.place[at], abouts[b][0], 1e-6);
        assert_near((double)smoother.place[at + 1], abouts[b][1], 1e-6);
        assert_near((double)run->mean[at], ends[b][0], 1e-6);  // the filter keeps what it found
        assert_near((double)run->mean[at + 1], ends[b][1], 1e-6);
    }
}

// ---- how far the map moves at once ------------------------------------------------------------------------

/// A way forth that ends 2.5 m from beacon 2 and moves it by 1 m, if it may; how far it does.
static double moved_m(double nearest_m)
{
    make_window(11, 1);
    bslam_ekf_t *run = &smoother.run;
    const int at = run->beacons[2].at;
    smoother.at = smoother.node_count;
    smoother.nearest_m2[2] = real(nearest_m * nearest_m);
    memset(run->correction, 0, sizeof run->correction);
    run->mean[at] = run->mean[BSLAM_STATE_X] + BSLAM_R(1.5);
    run->mean[at + 1] = run->mean[BSLAM_STATE_Y] + 2;
    const double before = (double)run->mean[at];
    run->correction[at] = 1;
    go_forth();
    return (double)run->mean[at] - before;
}

static void test_beacon_moves_by_a_part_of_its_least_distance_at_most(void **state)
{
    assert_near(moved_m(100), 0.3 * 2.5, 1e-5);
    assert_near(moved_m(0.4), 0.6 * 0.4, 1e-5);
}

static void test_way_forth_notes_how_near_beacons_were_seen_from(void **state)
{
    double least2[BEACONS];
    for (int b = 0; b < BEACONS; b++) {
        least2[b] = HUGE_VAL;
    }
    make_window(9, 8);
    for (int k = 0, at = 0; k < smoother.node_count; k++) {
        const bslam_smoother_node_t *node = bslam_smoother_node(&smoother, k);
        for (const int end = at + node->seen; at < end; at++) {
            const int b = bslam_smoother_seen(&smoother, at)->beacon;
            if (b != BSLAM_SMOOTHER_RANGE) {
                const bslam_real_t *place = &smoother.place[smoother.base.beacons[b].at];
                const double dx = (double)(place[0] - node->at[BSLAM_STATE_X]);
                const double dy = (double)(place[1] - node->at[BSLAM_STATE_Y]);
                least2[b] = fmin(least2[b], dx * dx + dy * dy);
            }
        }
    }
    go_forth();
    for (int b = 0; b < BEACONS; b++) {
        assert_near((double)smoother.nearest_m2[b], least2[b], 1e-5 * least2[b]);
    }
}

// ---- ways forth that are gone again -----------------------------------------------------------------------

enum { NODES = 8 };

static const double LEAP_M[2] = {-3.0, 2.5};

/// After a cycle, which has moved beacon 2 and the nodes, readings fit badly. before[NODES] and place are the
/// points that these were moved from.
static void fit_badly(bslam_real_t before[NODES][BASE], bslam_real_t place[2])
{
    make_window(9, NODES);
    go_forth();
    go_up_and_back();
    memset(smoother.place_moved, 0, sizeof smoother.place_moved);
    for (int i = 0; i < 2; i++) {
        const int at = smoother.base.beacons[2].at + i;
        place[i] = smoother.place[at];
        smoother.place_moved[at] = real(LEAP_M[i]);
        smoother.place[at] += real(LEAP_M[i]);
    }
    for (int k = 0; k < NODES; k++) {
        bslam_smoother_node_t *node = bslam_smoother_node(&smoother, k);
        memcpy(before[k], node->at, sizeof before[k]);
        for (int i = 0; i < BASE; i++) {
            node->moved[i] = (int16_t)(16 * (i + 1));
            node->at[i] += real(16e-3 * (i + 1));
        }
    }
    for (int k = 0; k < smoother.seen_count; k += 2) {
        bslam_smoother_seen(&smoother, k)->value =
            (uint16_t)(bslam_smoother_seen(&smoother, k)->value + 9000);
    }
    bslam_smoother_begin(&smoother);
}

static void test_pass_forth_that_fits_badly_is_gone_again_four_times_from_half_way_back(void **state)
{
    bslam_real_t before[NODES][BASE];
    bslam_real_t place[2];
    fit_badly(before, place);
    double share = 1;
    for (uint32_t halved = 1; halved <= 4; halved++) {
        share /= 2;
        while (smoother.halved < halved) {
            assert_false(bslam_smoother_work(&smoother, 1, true));
        }
        for (int i = 0; i < 2; i++) {
            const double moved_m = (double)(smoother.place[smoother.base.beacons[2].at + i] - place[i]);
            assert_near(moved_m, share * LEAP_M[i], 1e-5);
        }
        for (int k = 0; k < NODES * BASE; k++) {
            const int i = k % BASE;
            const double moved =
                (double)(bslam_smoother_node(&smoother, k / BASE)->at[i] - before[k / BASE][i]);
            const double off = moved - share * 16e-3 * (i + 1);
            assert_near(i == BSLAM_STATE_THETA ? unit_angle_between(off, 0) : off, 0, 1e-5);
        }
        assert_int_equal(smoother.phase, BSLAM_SMOOTHER_FORTH);
        assert_int_equal(smoother.at, 0);
    }
    go_forth();
    assert_int_equal(smoother.halved, 4);
    assert_int_equal(smoother.halvings, 0);  // the next cycle begins anew
    assert_true(smoother.fit > BSLAM_R(1.5));
}

static void test_way_forth_that_fits_as_the_last_one_is_taken(void **state)
{
    bslam_real_t before[NODES][BASE];
    bslam_real_t place[2];
    fit_badly(before, place);
    smoother.halvings = 4;
    go_forth();
    const bslam_real_t fit = smoother.fit;
    fit_badly(before, place);
    smoother.fit = fit / BSLAM_R(1.49);
    go_forth();
    assert_int_equal(smoother.halved, 0);
    fit_badly(before, place);
    smoother.fit = fit / BSLAM_R(1.51);
    go_forth();
    assert_true(smoother.halved > 0);
}

static void test_what_moved_belongs_to_its_beacon_when_others_come_and_leave(void **state)
{
    make_window(9, NODES);
    const int at[2] = {smoother.base.beacons[0].at, smoother.base.beacons[1].at};
    for (int i = 0; i < BSLAM_STATE_PADDED; i++) {
        smoother.place_moved[i] = real(i);
    }
    bslam_smoother_remove(&smoother, 0);
    assert_near((double)smoother.place_moved[at[0]], at[1], 0);
    assert_near((double)smoother.place_moved[at[0] + 1], at[1] + 1, 0);
    const int next = smoother.base.dim;
    smoother.place_moved[next] = 1;
    smoother.place_moved[next + 1] = 1;
    const bslam_pose_t mount = {0, 0, 0};
    const bslam_sighting_t seen = unit_direction(0.5, 9);
    int index;
    bslam_ekf_remove(&filter, 0);
    assert_int_equal(bslam_smoother_add(&smoother, &filter, &mount, &seen, &index), BSLAM_OK);
    assert_true(smoother.place_moved[next] == 0 && smoother.place_moved[next + 1] == 0);
}

// ---- ways that miss
// --------------------------------------------------------------------------------------------

/// What a way adds to the covariance by missing the node that it leads to, where it takes so long.
static void assert_doubt_of_miss(double dt_s, double share)
{
    make_window(12, 2);
    bslam_smoother_node_t node = *bslam_smoother_node(&smoother, 0);
    node.motion.dt_s = real(dt_s);
    node.at[BSLAM_STATE_X] += BSLAM_R(0.3);
    node.at[BSLAM_STATE_Y] -= BSLAM_R(0.2);
    double point[ARGUMENTS];
    double end[BASE];
    point_before(0, point);
    step(point, end, &node);
    // It is linear about the speeds of the node.
    point[V_WALK] = (double)node.at[V] - end[V];
    point[OMEGA_WALK] = (double)node.at[OMEGA] - end[OMEGA];
    step(point, end, &node);
    const double miss_m = hypot(end[BSLAM_STATE_X] - (double)node.at[BSLAM_STATE_X],
                                end[BSLAM_STATE_Y] - (double)node.at[BSLAM_STATE_Y]);
    assert_true(miss_m > 0.1);
    bslam_bend_t bend = bslam_smoother_bend(&node);
    bslam_ekf_t ekf = smoother.base;
    bslam_ekf_predict_about(&ekf, &smoother.model, &node.motion, &bend, node.at, NULL);
    bend.doubt_of_miss = 0;
    bslam_ekf_t sure = smoother.base;
    bslam_ekf_predict_about(&sure, &smoother.model, &node.motion, &bend, node.at, NULL);
    assert_memory_equal(ekf.correction, sure.correction, sizeof ekf.correction);
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j <= i; j++) {
            const double more =
                (double)(bslam_ekf_covariance(&ekf, i, j) - bslam_ekf_covariance(&sure, i, j));
            const bool is_place = i == j && (i == BSLAM_STATE_X || i == BSLAM_STATE_Y);
            assert_near(more, is_place ? share * share * miss_m * miss_m : 0, 1e-6);
        }
    }
}

static void test_way_is_as_doubtful_as_a_part_of_what_it_misses_by(void **state)
{
    assert_doubt_of_miss(0.2, 0.2);  // as long as a block may last
    assert_doubt_of_miss(0.201, 0.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_forth_is_the_batch_least_squares),
        cmocka_unit_test(test_up_and_back_is_the_batch_least_squares_in_the_map),
        cmocka_unit_test(test_way_back_in_several_parts_is_the_same),
        cmocka_unit_test(test_old_end_leaves_into_the_base_without_loss),
        cmocka_unit_test(test_sighting_from_the_beacon_s_own_place_is_left_out_and_counted),
        cmocka_unit_test(test_beacon_near_the_robot_is_linearised_about_a_metre_off),
        cmocka_unit_test(test_beacon_moves_by_a_part_of_its_least_distance_at_most),
        cmocka_unit_test(test_way_forth_notes_how_near_beacons_were_seen_from),
        cmocka_unit_test(test_pass_forth_that_fits_badly_is_gone_again_four_times_from_half_way_back),
        cmocka_unit_test(test_way_forth_that_fits_as_the_last_one_is_taken),
        cmocka_unit_test(test_what_moved_belongs_to_its_beacon_when_others_come_and_leave),
        cmocka_unit_test(test_way_is_as_doubtful_as_a_part_of_what_it_misses_by),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
