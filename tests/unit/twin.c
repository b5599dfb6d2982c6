#include "twin.h"

#include <math.h>

#include "covariance.h"

// ---- a random filter --------------------------------------------------------------------------------------

/// B Bᵀ + 0.3 I, scaled to the standard deviations: well conditioned, and everything is correlated.
static void randomise_covariance(bslam_ekf_t *ekf, unit_random_t *random, const double *sd)
{
    double b[DENSE_MAX][DENSE_MAX];
    const int n = ekf->dim;
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++) {
            b[i][k] = unit_random(random, -1, 1);
        }
    }
    dense_t p = dense_zero(n, n);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            double sum = i == j ? 0.3 * n : 0;
            for (int k = 0; k < n; k++) {
                sum += b[i][k] * b[j][k];
            }
            p.at[i][j] = sum * sd[i] * sd[j] / n;
        }
    }
    covariance_set(ekf, &p);
}

/// Puts a beacon 2 to 8 m away from (x, y), in any direction.
static void randomise_beacon(bslam_ekf_t *ekf, unit_random_t *random, const bslam_beacon_t *beacon, double x,
                             double y)
{
    const double direction = unit_random(random, -3.14159, 3.14159);
    const double distance = unit_random(random, 2, 8);
    const double px = x + distance * cos(direction);
    const double py = y + distance * sin(direction);
    bslam_real_t *state = &ekf->mean[beacon->at];
    if (beacon->kind != BSLAM_BEACON_RAY) {
        state[0] = real(px);
        state[1] = real(py);
        if (beacon->kind == BSLAM_BEACON_SIZED) {
            state[2] = real(unit_random(random, 0.8, 1.2));
        }
        return;
    }
    const double anchor_x = x + unit_random(random, -1, 1);
    const double anchor_y = y + unit_random(random, -1, 1);
    state[0] = real(anchor_x);
    state[1] = real(anchor_y);
    state[2] = real(atan2(py - anchor_y, px - anchor_x));
    state[3] = real(1 / hypot(px - anchor_x, py - anchor_y));
}

void twin_randomise(bslam_ekf_t *ekf, const bslam_settings_t *settings, unit_random_t *random, int points,
                    int rays)
{
    const bslam_pose_t mount = {0, 0, 0};
    bslam_ekf_init(ekf, settings);
    for (int i = 0; i < points + rays; i++) {
        const bslam_sighting_t sighting = i < points ? unit_polar(0, 5, i) : unit_direction(0, i);
        int index;
        assert_int_equal(bslam_ekf_add(ekf, settings, &mount, &sighting, &index), BSLAM_OK);
        assert_int_equal(index, i);
    }
    assert_true(ekf->dim <= DENSE_MAX);
    const double x = unit_random(random, -5, 5);
    const double y = unit_random(random, -5, 5);
    ekf->mean[BSLAM_STATE_X] = real(x);
    ekf->mean[BSLAM_STATE_Y] = real(y);
    ekf->mean[BSLAM_STATE_THETA] = real(unit_random(random, -3.1, 3.1));
    double sd[DENSE_MAX];
    for (int i = 0; i < ekf->dim; i++) {
        sd[i] = unit_random(random, 0.05, 0.5);
    }
    if (ekf->base_dim > 3) {
        ekf->mean[BSLAM_STATE_FORWARD] = real(unit_random(random, 0.3, 1.3));
        ekf->mean[BSLAM_STATE_TURN] = real(unit_random(random, 0.3, 1.3));
    }
    for (int k = 0; k < ekf->sensor_dim; k++) {
        ekf->mean[ekf->base_dim + k] += real(unit_random(random, -0.1, 0.1));
    }
    for (int b = 0; b < ekf->beacon_count; b++) {
        randomise_beacon(ekf, random, &ekf->beacons[b], x, y);
        if (ekf->beacons[b].kind == BSLAM_BEACON_RAY) {
            sd[ekf->beacons[b].at + 3] /= 10;
        }
    }
    randomise_covariance(ekf, random, sd);
}

// ---- comparison -------------------------------------------------------------------------------------------

twin_t twin_of(const bslam_ekf_t *ekf)
{
    twin_t twin = {.mean = dense_zero(ekf->dim, 1), .covariance = dense_zero(ekf->dim, ekf->dim)};
    for (int i = 0; i < ekf->dim; i++) {
        twin.mean.at[i][0] = (double)ekf->mean[i];
        for (int j = 0; j < ekf->dim; j++) {
            twin.covariance.at[i][j] = (double)bslam_ekf_covariance(ekf, i, j);
        }
    }
    return twin;
}

void twin_values(const bslam_ekf_t *ekf, double *values)
{
    for (int i = 0; i < ekf->dim; i++) {
        values[i] = (double)ekf->mean[i];
    }
}

bool twin_is_angle(const bslam_ekf_t *ekf, int at)
{
    bool angle = at == BSLAM_STATE_THETA;
    for (int b = 0; b < ekf->beacon_count; b++) {
        angle = angle || (ekf->beacons[b].kind == BSLAM_BEACON_RAY && at == ekf->beacons[b].at + 2);
    }
    return angle;
}

void twin_assert(const bslam_ekf_t *ekf, const twin_t *expected, double tolerance)
{
    const twin_t actual = twin_of(ekf);
    assert_int_equal(ekf->dim, expected->mean.rows);
    for (int i = 0; i < ekf->dim; i++) {
        if (twin_is_angle(ekf, i)) {
            assert_near(unit_angle_between(actual.mean.at[i][0], expected->mean.at[i][0]), 0, tolerance);
        } else {
            assert_near(actual.mean.at[i][0], expected->mean.at[i][0], tolerance);
        }
        for (int j = 0; j <= i; j++) {
            assert_near(actual.covariance.at[i][j], expected->covariance.at[i][j], tolerance);
        }
    }
}

// ---- observation ------------------------------------------------------------------------------------------

void twin_sensor(const bslam_ekf_t *ekf, const bslam_pose_t *mount, const double *state, double pose[3],
                 double *scale)
{
    static const double as_told[BSLAM_SENSOR_DIM] = {0, 0, 0, 1};
    const double *off = ekf->sensor_dim > 0 ? &state[ekf->base_dim] : as_told;
    const double turn = (double)mount->theta_rad, theta = state[BSLAM_STATE_THETA];
    const double x = (double)mount->x_m + cos(turn) * off[0] - sin(turn) * off[1];
    const double y = (double)mount->y_m + sin(turn) * off[0] + cos(turn) * off[1];
    pose[0] = state[BSLAM_STATE_X] + cos(theta) * x - sin(theta) * y;
    pose[1] = state[BSLAM_STATE_Y] + sin(theta) * x + cos(theta) * y;
    pose[2] = theta + turn + off[2];
    *scale = off[3];
}

void twin_observe(const bslam_ekf_t *ekf, const bslam_pose_t *mount, int beacon, const double *state,
                  double *range_m, double *bearing_rad)
{
    const bslam_beacon_t *b = &ekf->beacons[beacon];
    const double *own = &state[b->at];
    double px = own[0];
    double py = own[1];
    if (b->kind == BSLAM_BEACON_KNOWN) {
        px = (double)b->known_x_m;
        py = (double)b->known_y_m;
    } else if (b->kind == BSLAM_BEACON_RAY) {
        px += cos(own[2]) / own[3];
        py += sin(own[2]) / own[3];
    }
    double sensor[3], scale;
    twin_sensor(ekf, mount, state, sensor, &scale);
    const double dx = px - sensor[0], dy = py - sensor[1];
    *range_m = hypot(dx, dy) * scale * (b->kind == BSLAM_BEACON_SIZED ? own[2] : 1);
    *bearing_rad = unit_angle_between(atan2(dy, dx), sensor[2]);
}

typedef struct observing {
    const bslam_ekf_t *ekf;
    const bslam_pose_t *mount;
    int beacon;
    double bearing_rad;  // at the mean: differences from it have no jump at pi
} observing_t;

static void observe_near(const double *in, double *out, const void *context)
{
    const observing_t *o = context;
    twin_observe(o->ekf, o->mount, o->beacon, in, &out[0], &out[1]);
    out[1] = unit_angle_between(out[1], o->bearing_rad);
}

dense_t twin_rows(const bslam_ekf_t *ekf, const bslam_pose_t *mount, int beacon)
{
    double state[DENSE_MAX];
    twin_values(ekf, state);
    observing_t observing = {ekf, mount, beacon, 0};
    double range_m;
    twin_observe(ekf, mount, beacon, state, &range_m, &observing.bearing_rad);
    dense_t rows = dense_zero(2, ekf->dim);
    for (int i = 0; i < ekf->dim; i++) {
        rows.at[0][i] = unit_derivative(observe_near, state, ekf->dim, 0, i, &observing);
        rows.at[1][i] = unit_derivative(observe_near, state, ekf->dim, 1, i, &observing);
    }
    return rows;
}

// ---- update -----------------------------------------------------------------------------------------------

/// Where a position of the state begins at i: the robot's, a point's, a ray's anchor.
static bool is_position(const bslam_ekf_t *ekf, int i)
{
    bool position = i == BSLAM_STATE_X;
    for (int b = 0; b < ekf->beacon_count; b++) {
        position = position || (ekf->beacons[b].kind != BSLAM_BEACON_KNOWN && i == ekf->beacons[b].at);
    }
    return position;
}

/// From the invariant error (d theta, and d p - J p d theta for each position p) to the ordinary one, at a
/// mean.
static dense_t from_invariant(const bslam_ekf_t *ekf, const dense_t *mean)
{
    dense_t t = dense_identity(ekf->dim);
    for (int i = 0; i < ekf->dim; i++) {
        if (is_position(ekf, i)) {
            t.at[i][BSLAM_STATE_THETA] = -mean->at[i + 1][0];
            t.at[i + 1][BSLAM_STATE_THETA] = mean->at[i][0];
        }
    }
    return t;
}

/// exp(xi) mean: the world turns by xi's angle a, and each position p goes to R(a) p + V(a) xi_p.
static void apply_invariant(const bslam_ekf_t *ekf, const dense_t *xi, dense_t *mean)
{
    const double a = xi->at[BSLAM_STATE_THETA][0];
    double v_c;
    double v_s;
    unit_mean_direction(0, a, &v_c, &v_s);
    const dense_t before = *mean;
    *mean = dense_sum(mean, xi);
    for (int i = 0; i < ekf->dim; i++) {
        if (is_position(ekf, i)) {
            const double x = before.at[i][0], y = before.at[i + 1][0];
            const double dx = xi->at[i][0], dy = xi->at[i + 1][0];
            mean->at[i][0] = cos(a) * x - sin(a) * y + v_c * dx - v_s * dy;
            mean->at[i + 1][0] = sin(a) * x + cos(a) * y + v_s * dx + v_c * dy;
        }
    }
}

void twin_update(const bslam_ekf_t *ekf, int filter, const dense_t *h, const dense_t *y, const dense_t *r,
                 twin_t *twin)
{
    const dense_t identity = dense_identity(ekf->dim);
    const dense_t to_ordinary = filter == 0 ? identity : from_invariant(ekf, &twin->mean);
    const dense_t to_own = dense_inverse(&to_ordinary);
    const dense_t p = dense_sandwich(&to_own, &twin->covariance);
    const dense_t rows = dense_product(h, &to_ordinary);

    const dense_t rows_t = dense_transposed(&rows);
    const dense_t hph = dense_sandwich(&rows, &p);
    const dense_t s = dense_sum(&hph, r);
    const dense_t s_inverse = dense_inverse(&s);
    const dense_t p_rows = dense_product(&p, &rows_t);
    const dense_t k = dense_product(&p_rows, &s_inverse);
    const dense_t correction = dense_product(&k, y);
    const dense_t kh = dense_product(&k, &rows);
    const dense_t keep = dense_difference(&identity, &kh);
    const dense_t updated = dense_product(&keep, &p);
    if (filter == 0) {
        twin->mean = dense_sum(&twin->mean, &correction);
    } else {
        apply_invariant(ekf, &correction, &twin->mean);
    }
    const dense_t back = filter == 0 ? identity : from_invariant(ekf, &twin->mean);
    twin->covariance = dense_sandwich(&back, &updated);
}
