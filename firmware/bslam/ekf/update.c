// Sightings: innovation, gain, down-date, and the end of a frame. MATH "Update".
#include <string.h>

#include "bslam/ekf/ekf.h"
#include "bslam/ekf/ekf_internal.h"
#include "bslam/ekf/sensor.h"
#include "base/trig.h"
#include "bslam/linalg/four.h"
#include "bslam/model/noise.h"
#include "bslam/model/pose.h"
#include "base/scalar.h"

/// A function whose callers name constants: each has a copy without tests of them.
#define COPIED __attribute__((always_inline)) static inline

// ---- rows of H --------------------------------------------------------------------------------------------

bslam_real_t bslam_ekf_dot(const bslam_row_t *row, const bslam_real_t *vector)
{
    bslam_real_t sum = row->base[0] * vector[0] + row->base[1] * vector[1] + row->base[2] * vector[2];
    const bslam_real_t *others = vector + row->at;
    for (int k = 0; k < row->dim; k++) {
        sum += row->other[k] * others[k];
    }
    for (int k = 0; k < row->sensor_dim; k++) {
        sum += row->sensor[k] * vector[row->sensor_at + k];
    }
    return sum;
}

/// What is made of rows of L: f = Lᵀ h in the columns from `from` up to `to`, of one h or two that look at
/// the same places. `two` the compiler knows.
typedef struct looks {
    int from, to;
    const bslam_row_t *a, *b;
    bslam_real_t *f, *g;
} looks_t;

/// Adds row `place` of L, times `a` to f and times `b` to g.
COPIED void add_row(const bslam_factor_t *factor, int place, bslam_real_t a, bslam_real_t b,
                    const looks_t *looks, const bool two)
{
    const bslam_real_t *row = bslam_factor_row(factor, place) + 4 * (size_t)looks->from;
    const int end = place + 1 < looks->to ? place + 1 : looks->to;
    bslam_real_t *f = looks->f, *g = looks->g;
    for (int j = 0; j < end - looks->from; j++) {
        f[j] += a * row[4 * j];
        if (two) {
            g[j] += b * row[4 * j];
        }
    }
}

/// The same of this row and the next one, by the two weights each.
COPIED void add_two_rows(const bslam_factor_t *factor, int place, const bslam_real_t *a,
                         const bslam_real_t *b, const looks_t *looks, const bool two)
{
    const bslam_real_t *row = bslam_factor_row(factor, place) + 4 * (size_t)looks->from;
    const bslam_real_t *next = bslam_factor_row(factor, place + 1) + 4 * (size_t)looks->from;
    const bslam_real_t a0 = a[0], a1 = a[1], b0 = b[0], b1 = b[1];
    bslam_real_t *f = looks->f, *g = looks->g;
    const int end = (place + 1 < looks->to ? place + 1 : looks->to) - looks->from;
    for (int j = 0; j < end; j++) {
        f[j] += a0 * row[4 * j] + a1 * next[4 * j];
        if (two) {
            g[j] += b0 * row[4 * j] + b1 * next[4 * j];
        }
    }
    const int own = place + 1 - looks->from;  // of the next row, which is 1 there
    if (own >= 0 && place + 1 < looks->to) {
        f[own] += a1;
        if (two) {
            g[own] += b1;
        }
    }
}

COPIED void look(const bslam_ekf_t *ekf, const looks_t *looks, const bool two)
{
    const bslam_factor_t *factor = &ekf->factor;
    const bslam_row_t *a = looks->a, *b = looks->b;
    // x, and y behind it
    const bslam_real_t *tail = factor->tail + factor->tail_count - 2 + 4 * (size_t)looks->from;
    for (int j = 0; j < looks->to - looks->from; j++) {
        const bslam_real_t x = tail[4 * j], y = tail[4 * j + 1];
        looks->f[j] = a->base[0] * x + a->base[1] * y;
        if (two) {
            looks->g[j] = b->base[0] * x + b->base[1] * y;
        }
    }
    add_row(factor, bslam_ekf_place(ekf, BSLAM_STATE_THETA), a->base[2], b->base[2], looks, two);
    for (int k = 0; k < a->sensor_dim; k++) {
        add_row(factor, bslam_ekf_place(ekf, a->sensor_at + k), a->sensor[k], b->sensor[k], looks, two);
    }
    int k = 0;
    for (; k + 1 < a->dim && a->at >= ekf->base_dim; k += 2) {
        add_two_rows(factor, bslam_ekf_place(ekf, a->at + k), &a->other[k], &b->other[k], looks, two);
    }
    for (; k < a->dim; k++) {
        add_row(factor, bslam_ekf_place(ekf, a->at + k), a->other[k], b->other[k], looks, two);
    }
}

void bslam_ekf_look(const bslam_ekf_t *ekf, const bslam_row_t *row, int from, int to, bslam_real_t *f)
{
    const looks_t looks = {from, to, row, row, f, f};
    look(ekf, &looks, false);
}

static void look_twice(const bslam_ekf_t *ekf, const bslam_row_t *a, const bslam_row_t *b, int from, int to,
                       bslam_real_t *f, bslam_real_t *g)
{
    const looks_t looks = {from, to, a, b, f, g};
    if (a->at == b->at && a->dim == b->dim && a->sensor_dim == b->sensor_dim) {
        look(ekf, &looks, true);
    } else {
        bslam_ekf_look(ekf, a, from, to, f);
        bslam_ekf_look(ekf, b, from, to, g);
    }
}

static void fill_row(const bslam_beacon_t *beacon, const bslam_real_t by_pose[3],
                     const bslam_real_t *by_beacon, bslam_row_t *row)
{
    row->sensor_dim = 0;
    row->at = (uint16_t)beacon->at;
    row->dim = (uint16_t)bslam_beacon_dim(beacon->kind);
    memcpy(row->base, by_pose, sizeof row->base);
    memcpy(row->other, by_beacon, sizeof row->other);
}

static void scale_row(bslam_row_t *row, bslam_real_t scale)
{
    for (int k = 0; scale != 1 && k < POSE_DIM; k++) {
        row->base[k] *= scale;
    }
    for (int k = 0; scale != 1 && k < row->dim; k++) {
        row->other[k] *= scale;
    }
}

/// Of two rows a P bᵀ, a P aᵀ and b P bᵀ. From the covariance but for what waits.
typedef struct forms {
    bslam_real_t ab, aa, bb;
} forms_t;

enum { COLUMNS = 16 };  // at once, so that no row of L need be kept

static forms_t quadratic(const bslam_ekf_t *ekf, const bslam_row_t *a, const bslam_row_t *b)
{
    const int places = bslam_factor_places(&ekf->factor);
    forms_t sums = {0, 0, 0};
    for (int from = 0; from < places; from += COLUMNS) {
        const int to = from + COLUMNS < places ? from + COLUMNS : places;
        bslam_real_t of_a[COLUMNS], of_b[COLUMNS];
        bslam_ekf_look(ekf, a, from, to, of_a);
        bslam_ekf_look(ekf, b, from, to, of_b);
        for (int j = 0; j < to - from; j++) {
            const bslam_real_t d = ekf->factor.d[from + j];
            sums.ab += d * of_a[j] * of_b[j];
            sums.aa += d * of_a[j] * of_a[j];
            sums.bb += d * of_b[j] * of_b[j];
        }
    }
    return sums;
}

// ---- innovation -------------------------------------------------------------------------------------------

/// What the bend of the direction's model adds to its variance, to second order: with e = d ln(length) and b
/// the direction, e P eᵀ b P bᵀ + (e P bᵀ)². MATH "Bearing-only".
static bslam_real_t curvature_variance(const bslam_ekf_t *ekf, const bslam_beacon_t *beacon,
                                       const bslam_observation_t *seen, const bslam_row_t *bearing)
{
    bslam_row_t stretch;
    fill_row(beacon, seen->stretch_by_pose, seen->stretch_by_beacon, &stretch);
    const forms_t p = quadratic(ekf, &stretch, bearing);
    return p.aa * p.bb + p.ab * p.ab;
}

static bslam_status_t observe(const bslam_ekf_t *ekf, const bslam_beacon_t *beacon, const bslam_pose_t *pose,
                              const bslam_pose_t *mount, bslam_observation_t *seen)
{
    const bslam_real_t *state = &ekf->mean[beacon->at];
    bslam_status_t status;
    switch (beacon->kind) {
    case BSLAM_BEACON_RAY:
        return bslam_observe_ray(pose, mount, state, seen);
    case BSLAM_BEACON_KNOWN:
        status = bslam_observe_point(pose, mount, beacon->known_x_m, beacon->known_y_m, seen);
        if (status == BSLAM_OK && beacon->known_scale > 0) {
            bslam_observation_scale(seen, beacon->known_scale);
        }
        return status;
    case BSLAM_BEACON_SIZED:
        status = bslam_observe_point(pose, mount, state[0], state[1], seen);
        if (status == BSLAM_OK) {
            bslam_observation_scale(seen, state[2]);
        }
        return status;
    case BSLAM_BEACON_POINT:
    default:
        return bslam_observe_point(pose, mount, state[0], state[1], seen);
    }
}

/// Of a beacon without a scale of its own, what it would have counts as noise.
static bslam_real_t range_variance_m2(const bslam_settings_t *settings, const bslam_sighting_t *sighting,
                                      const bslam_beacon_t *beacon, bslam_real_t range_m)
{
    const bool has_scale = beacon->kind == BSLAM_BEACON_SIZED || beacon->known_scale > 0;
    return bslam_scaled_range_variance_m2(settings, sighting, range_m,
                                          has_scale ? 0 : bslam_unknown_scale_var(settings, sighting));
}

bool bslam_ekf_classes_differ(const bslam_beacon_t *beacon, const bslam_sighting_t *sighting)
{
    return sighting->beacon_class != BSLAM_CLASS_NONE && beacon->beacon_class != BSLAM_CLASS_NONE &&
           sighting->beacon_class != beacon->beacon_class;
}

bslam_sighting_t bslam_ekf_taken_as(const bslam_beacon_t *beacon, const bslam_sighting_t *sighting)
{
    bslam_sighting_t taken = *sighting;
    taken.has_range = taken.has_range &&
                      (beacon->kind != BSLAM_BEACON_SIZED || !bslam_ekf_classes_differ(beacon, sighting));
    return taken;
}

/// Completes an innovation's rows. It is of the distance, too, if it says so.
static void fill_rows(const bslam_ekf_t *ekf, const bslam_beacon_t *beacon, const bslam_pose_t *mount,
                      const bslam_observation_t *seen, bslam_innovation_t *innovation)
{
    fill_row(beacon, seen->bearing_by_pose, seen->bearing_by_beacon, &innovation->bearing_row);
    bslam_ekf_fill_sensor(ekf, mount, -1, 0, &innovation->bearing_row);
    if (innovation->has_range) {
        fill_row(beacon, seen->range_by_pose, seen->range_by_beacon, &innovation->range_row);
        scale_row(&innovation->range_row, bslam_ekf_range_scale(ekf));
        bslam_ekf_fill_sensor(ekf, mount, 0, seen->range_m, &innovation->range_row);
    }
}

/// Three degrees: below that an arc differs from its tangent by less than the noise of any distance.
static const bslam_real_t BENT_HEADING_VAR_RAD2 = BSLAM_R(0.0027);

/// Ten degrees: so far the model is straight. A step leaves a fifth of the way, of the variance, too.
static const bslam_real_t STRAIGHT_VAR_RAD2 = BSLAM_R(0.03), STEP_SHARE = BSLAM_R(0.25);

static bslam_real_t squared(bslam_real_t x)
{
    return x * x;
}

/// A robot whose heading was in doubt while it moved stands somewhere on an arc, and the covariance has that
/// arc's tangent. How far they are apart counts as noise, to second order. MATH "Which beacon is it". Not in
/// the paper's equations.
static void bend_by_heading(const bslam_ekf_t *ekf, bslam_real_t range_m, bslam_innovation_t *innovation)
{
    const bslam_real_t variance = bslam_ekf_covariance(ekf, BSLAM_STATE_THETA, BSLAM_STATE_THETA);
    if (variance < BENT_HEADING_VAR_RAD2) {
        return;
    }
    const bslam_row_t heading = {.base = {[BSLAM_STATE_THETA] = 1},
                                 .sensor_at = innovation->bearing_row.sensor_at,
                                 .sensor_dim = innovation->bearing_row.sensor_dim};
    const bslam_row_t rows[] = {innovation->range_row, innovation->bearing_row};
    bslam_real_t with_heading[2];
    bslam_ekf_row_covariances(ekf, &heading, rows, 2, with_heading);
    const bslam_real_t turn =
        with_heading[1] / variance;  // by an error of the heading of 1; -1 where it stood
    innovation->range_var_m2 += BSLAM_R(0.75) * squared(range_m * with_heading[1] * (1 + turn));
    innovation->bearing_var_rad2 += BSLAM_R(0.75) * squared(with_heading[0] / range_m * (1 + 2 * turn));
}

bslam_status_t bslam_ekf_innovation(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                    const bslam_pose_t *told, const bslam_sighting_t *sighting, int index,
                                    bslam_innovation_t *innovation)
{
    const bslam_beacon_t *beacon = &ekf->beacons[index];
    const bslam_pose_t pose = bslam_ekf_pose(ekf);
    const bslam_pose_t mount = ekf->sensor_dim > 0 ? bslam_ekf_mount(ekf, told) : *told;
    bslam_observation_t seen;
    const bslam_status_t status = observe(ekf, beacon, &pose, &mount, &seen);
    if (status != BSLAM_OK) {
        return status;
    }
    if (sighting->has_range && !(seen.range_m > 0)) {
        return BSLAM_E_SINGULAR;
    }
    innovation->gate_d2 = settings->gate_d2;
    innovation->gate_is_open = false;
    innovation->has_range = sighting->has_range;
    innovation->bearing_rad = bslam_angle_wrap(sighting->bearing_rad - seen.bearing_rad);
    innovation->bearing_var_rad2 = bslam_bearing_variance_rad2(settings, sighting);
    fill_rows(ekf, beacon, &mount, &seen, innovation);
    if (!sighting->has_range && settings->bearing_only_curvature_factor > 0) {
        innovation->bearing_var_rad2 += settings->bearing_only_curvature_factor *
                                        curvature_variance(ekf, beacon, &seen, &innovation->bearing_row);
    }
    if (sighting->has_range) {
        const bslam_real_t range_m = bslam_ekf_range_scale(ekf) * seen.range_m;
        innovation->range_m = sighting->range_m - range_m;
        innovation->range_var_m2 = range_variance_m2(settings, sighting, beacon, range_m);
        if (settings->filter != BSLAM_FILTER_STANDARD) {
            bend_by_heading(ekf, seen.range_m, innovation);
        }
    }
    return BSLAM_OK;
}

bslam_status_t bslam_ekf_look_from(const bslam_ekf_t *ekf, const bslam_pose_t *told, bslam_real_t x_m,
                                   bslam_real_t y_m, int index, bslam_innovation_t *innovation)
{
    const bslam_beacon_t *beacon = &ekf->beacons[index];
    const bslam_pose_t mount = bslam_ekf_mount(ekf, told);
    const bslam_pose_t pose = {x_m, y_m, ekf->mean[BSLAM_STATE_THETA]};
    if (x_m == ekf->mean[BSLAM_STATE_X] && y_m == ekf->mean[BSLAM_STATE_Y]) {
        return BSLAM_OK;
    }
    bslam_observation_t seen;
    const bslam_status_t status = observe(ekf, beacon, &pose, &mount, &seen);
    if (status == BSLAM_OK) {
        fill_rows(ekf, beacon, &mount, &seen, innovation);
    }
    return status;
}

bslam_status_t bslam_ekf_distance2(const bslam_ekf_t *ekf, const bslam_innovation_t *innovation,
                                   bslam_real_t *distance2)
{
    const bslam_row_t *bearing = &innovation->bearing_row;
    bslam_sym2_t s = {.xx = 1, .xy = 0};
    if (!innovation->has_range) {
        s.yy = quadratic(ekf, bearing, bearing).bb + innovation->bearing_var_rad2;
        return bslam_sym2_mahalanobis(&s, 0, innovation->bearing_rad, distance2);
    }
    const forms_t p = quadratic(ekf, &innovation->range_row, bearing);
    s.xx = p.aa + innovation->range_var_m2;
    s.xy = p.ab;
    s.yy = p.bb + innovation->bearing_var_rad2;
    return bslam_sym2_mahalanobis(&s, innovation->range_m, innovation->bearing_rad, distance2);
}

bslam_real_t bslam_ekf_sighting_distance2(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                          const bslam_pose_t *mount, const bslam_sighting_t *sighting,
                                          int index)
{
    bslam_innovation_t innovation;
    bslam_real_t distance2;
    return bslam_ekf_innovation(ekf, settings, mount, sighting, index, &innovation) == BSLAM_OK &&
                   bslam_ekf_distance2(ekf, &innovation, &distance2) == BSLAM_OK
               ? distance2
               : -1;
}

bool bslam_ekf_soften(const bslam_ekf_t *ekf, bslam_innovation_t *innovation)
{
    const forms_t p = quadratic(ekf, &innovation->bearing_row, &innovation->bearing_row);
    if (p.bb <= STRAIGHT_VAR_RAD2) {
        return false;
    }
    const bslam_real_t factor = 1 + STEP_SHARE * p.bb / innovation->bearing_var_rad2;
    innovation->range_var_m2 *= factor;
    innovation->bearing_var_rad2 *= factor;
    return true;
}

/// The sum over a row of L, in the columns from `from` up to `to`, times h.
static bslam_real_t along_row(const bslam_factor_t *factor, int place, const bslam_real_t *h, int from,
                              int to)
{
    const bslam_real_t *row = bslam_factor_row(factor, place) + 4 * (size_t)from;
    const int end = place + 1 < to ? place + 1 : to;
    bslam_real_t sum = 0;
    for (int j = 0; j < end - from; j++) {
        sum += row[4 * j] * h[j];
    }
    return sum;
}

/// What some columns give of P aᵀ, with h the same columns of D Lᵀ aᵀ: at the robot's and the sensor's
/// values, and at a beacon's.
typedef struct column {
    bslam_real_t base[POSE_DIM], sensor[BSLAM_SENSOR_DIM], other[BSLAM_RAY_DIM];
} column_t;

static void fill_column_base(const bslam_ekf_t *ekf, const bslam_row_t *row, const bslam_real_t *h, int from,
                             int to, column_t *column)
{
    for (int k = 0; k < POSE_DIM; k++) {
        column->base[k] = along_row(&ekf->factor, bslam_ekf_place(ekf, k), h, from, to);
    }
    for (int k = 0; k < row->sensor_dim; k++) {
        column->sensor[k] = along_row(&ekf->factor, bslam_ekf_place(ekf, row->sensor_at + k), h, from, to);
    }
}

/// row · column.
static bslam_real_t dot_column(const bslam_row_t *row, const column_t *column)
{
    bslam_real_t sum = 0;
    for (int k = 0; k < POSE_DIM; k++) {
        sum += row->base[k] * column->base[k];
    }
    for (int k = 0; k < row->sensor_dim; k++) {
        sum += row->sensor[k] * column->sensor[k];
    }
    for (int k = 0; k < row->dim; k++) {
        sum += row->other[k] * column->other[k];
    }
    return sum;
}

void bslam_ekf_row_covariances(const bslam_ekf_t *ekf, const bslam_row_t *row, const bslam_row_t *others,
                               int count, bslam_real_t *covariances)
{
    const int places = bslam_factor_places(&ekf->factor);
    memset(covariances, 0, (size_t)count * sizeof covariances[0]);
    for (int from = 0; from < places; from += COLUMNS) {
        const int to = from + COLUMNS < places ? from + COLUMNS : places;
        bslam_real_t h[COLUMNS];
        column_t column = {.other = {0}};
        bslam_ekf_look(ekf, row, from, to, h);
        for (int j = 0; j < to - from; j++) {
            h[j] *= ekf->factor.d[from + j];
        }
        fill_column_base(ekf, row, h, from, to, &column);
        for (int i = 0; i < count; i++) {
            // Distance and direction of one beacon follow one another.
            for (int k = 0; k < others[i].dim && (i == 0 || others[i].at != others[i - 1].at); k++) {
                column.other[k] =
                    along_row(&ekf->factor, bslam_ekf_place(ekf, others[i].at + k), h, from, to);
            }
            covariances[i] += dot_column(&others[i], &column);
        }
    }
}

// ---- gain and down-date -----------------------------------------------------------------------------------

static bslam_waiting_t waiting(bslam_ekf_t *ekf, int k)
{
    return (bslam_waiting_t){ekf->v[k], ekf->lambda[k], ekf->gain[k]};
}

/// The correction takes what is given by place, where the robot's values stand otherwise than in the state.
static void take_change(bslam_ekf_t *ekf, bslam_real_t *change)
{
    const int tail = ekf->factor.tail_count;
    for (int i = 0; i < ekf->base_dim; i++) {
        const int place = bslam_ekf_place(ekf, i);
        ekf->correction[i] += change[place];
        change[place] = 0;
    }
    for (int at = 0; at < ekf->factor.body_count; at += 4) {
        *(bslam_four_at_t *)(ekf->correction + at + tail) += bslam_four(change + at);
    }
}

void bslam_ekf_settle(bslam_ekf_t *ekf)
{
    if (ekf->pending_count == 0) {
        return;
    }
    bslam_waiting_t list[BSLAM_PENDING_MAX];
    for (int k = 0; k < ekf->pending_count; k++) {
        list[k] = waiting(ekf, k);
    }
    memcpy(ekf->factor.d, ekf->d, sizeof ekf->d);
    bslam_real_t *change = ekf->d;  // whose room is free now
    memset(change, 0, sizeof ekf->d);
    bslam_factor_settle(&ekf->factor, list, ekf->pending_count, change);
    take_change(ekf, change);
    ekf->pending_count = 0;
}

/// Brings f of a row, in place `slot`, behind all that waits. Returns what the correction so far says of the
/// measurement.
static bslam_real_t foresee(bslam_ekf_t *ekf, const bslam_row_t *row, int slot)
{
    const int places = bslam_factor_places(&ekf->factor);
    bslam_real_t foreseen = ekf->has_correction ? bslam_ekf_dot(row, ekf->correction) : 0;
    for (int k = 0; k < ekf->pending_count; k++) {
        const bslam_waiting_t before = waiting(ekf, k);
        foreseen += before.gain * bslam_factor_carry(&before, places, ekf->lambda[slot]);
    }
    return foreseen;
}

COPIED bslam_real_t total(bslam_four_t four)
{
    return (four[0] + four[1]) + (four[2] + four[3]);
}

/// The variance of what the row of a slot predicts.
static bslam_real_t variance_of(const bslam_ekf_t *ekf, int slot)
{
    bslam_four_t sum = {0};
    for (int at = 0; at < bslam_factor_places(&ekf->factor); at += 4) {
        const bslam_four_t f = bslam_four(ekf->lambda[slot] + at);
        sum += bslam_four(ekf->d + at) * (f * f);
    }
    return total(sum);
}

/// What two rows' predictions have in common.
static bslam_real_t common(const bslam_ekf_t *ekf, int a, int b)
{
    bslam_four_t sum = {0};
    for (int at = 0; at < bslam_factor_places(&ekf->factor); at += 4) {
        sum += bslam_four(ekf->d + at) * (bslam_four(ekf->lambda[a] + at) * bslam_four(ekf->lambda[b] + at));
    }
    return total(sum);
}

static void make_room(bslam_ekf_t *ekf, int count)
{
    if (ekf->pending_count + count > BSLAM_PENDING_MAX) {
        bslam_ekf_settle(ekf);
    }
    if (ekf->pending_count == 0) {
        memcpy(ekf->d, ekf->factor.d, sizeof ekf->d);
    }
    if (!ekf->has_correction) {
        memset(ekf->correction, 0, sizeof ekf->correction);
    }
}

/// Takes the measurement in the next slot.
static void accept(bslam_ekf_t *ekf, bslam_real_t innovation, bslam_real_t variance)
{
    const int slot = ekf->pending_count;
    const bslam_waiting_t next = waiting(ekf, slot);
    const bslam_real_t s = bslam_factor_measure(&next, bslam_factor_places(&ekf->factor), variance, ekf->d);
    ekf->gain[slot] = innovation / s;
    ekf->pending_count++;
    ekf->has_correction = true;
}

void bslam_ekf_apply_scalar(bslam_ekf_t *ekf, const bslam_row_t *row, bslam_real_t innovation,
                            bslam_real_t variance)
{
    make_room(ekf, 1);
    const int slot = ekf->pending_count;
    bslam_ekf_look(ekf, row, 0, bslam_factor_places(&ekf->factor), ekf->lambda[slot]);
    const bslam_real_t left = innovation - foresee(ekf, row, slot);
    accept(ekf, left, variance);
}

/// Gate and Huber's rule. The weight divides the measurement's variances.
static bslam_status_t judge(const bslam_settings_t *settings, const bslam_innovation_t *innovation,
                            bslam_fusion_t *fusion)
{
    const bslam_real_t gate_d2 = innovation->gate_d2;
    if (gate_d2 > 0 && !innovation->gate_is_open && !(fusion->distance2 <= gate_d2)) {
        fusion->weight = 0;
        return BSLAM_E_RANGE;
    }
    const bslam_real_t at_gate = innovation->gate_is_open ? bslam_sqrt(gate_d2) : 0;
    const bslam_real_t limit = settings->huber_d > 0 ? settings->huber_d : at_gate;
    fusion->weight =
        limit > 0 && fusion->distance2 > limit * limit ? limit / bslam_sqrt(fusion->distance2) : 1;
    return BSLAM_OK;
}

/// Both rows of a sighting, or the one that it has, into the next slots.
static void look_sighting(bslam_ekf_t *ekf, const bslam_innovation_t *innovation)
{
    bslam_real_t *bearing = ekf->lambda[ekf->pending_count], *range = ekf->lambda[ekf->pending_count + 1];
    const int places = bslam_factor_places(&ekf->factor);
    if (innovation->has_range) {
        look_twice(ekf, &innovation->bearing_row, &innovation->range_row, 0, places, bearing, range);
    } else {
        bslam_ekf_look(ekf, &innovation->bearing_row, 0, places, bearing);
    }
}

bslam_status_t bslam_ekf_fuse(bslam_ekf_t *ekf, const bslam_settings_t *settings,
                              const bslam_innovation_t *innovation, bslam_fusion_t *fusion)
{
    make_room(ekf, 2);
    const int of_bearing = ekf->pending_count, of_range = of_bearing + 1;
    bslam_sym2_t hph = {0, 0, 0};
    bslam_real_t range_left = 0;
    look_sighting(ekf, innovation);
    const bslam_real_t bearing_left =
        innovation->bearing_rad - foresee(ekf, &innovation->bearing_row, of_bearing);
    hph.yy = variance_of(ekf, of_bearing);
    if (innovation->has_range) {
        range_left = innovation->range_m - foresee(ekf, &innovation->range_row, of_range);
        hph.xx = variance_of(ekf, of_range);
        hph.xy = common(ekf, of_range, of_bearing);
    }
    const bslam_sym2_t s = {.xx = innovation->has_range ? hph.xx + innovation->range_var_m2 : 1,
                            .xy = hph.xy,
                            .yy = hph.yy + innovation->bearing_var_rad2};
    bslam_status_t status = bslam_sym2_mahalanobis(&s, range_left, bearing_left, &fusion->distance2);
    if (status == BSLAM_OK) {
        status = judge(settings, innovation, fusion);
    }
    if (status != BSLAM_OK) {
        return status;
    }
    const bslam_real_t bearing_var = innovation->bearing_var_rad2 / fusion->weight;
    accept(ekf, bearing_left, bearing_var);
    if (innovation->has_range) {  // conditional on the bearing
        const bslam_waiting_t bearing = waiting(ekf, of_bearing);
        const bslam_real_t range_var = innovation->range_var_m2 / fusion->weight;
        range_left -= bearing.gain *
                      bslam_factor_carry(&bearing, bslam_factor_places(&ekf->factor), ekf->lambda[of_range]);
        accept(ekf, range_left, range_var);
    }
    return BSLAM_OK;
}

// ---- end of a frame ---------------------------------------------------------------------------------------

/// Moves the position at `at` by V(turn) correction, in whose place it leaves the shift J V(turn) correction
/// of the transport.
static void move_position(bslam_ekf_t *ekf, int at, const bslam_turning_t *turning)
{
    bslam_real_t dx = ekf->correction[at];
    bslam_real_t dy = ekf->correction[at + 1];
    bslam_turning_apply(turning, &dx, &dy);
    ekf->mean[at] += dx;
    ekf->mean[at + 1] += dy;
    ekf->correction[at] = -dy;
    ekf->correction[at + 1] = dx;
}

/// Moves what is no position by its correction: the transport does not shift it.
static void move_value(bslam_ekf_t *ekf, int at)
{
    ekf->mean[at] += ekf->correction[at];
    ekf->correction[at] = 0;
}

static void move_angle(bslam_ekf_t *ekf, int at)
{
    move_value(ekf, at);
    ekf->mean[at] = bslam_angle_wrap(ekf->mean[at]);
}

/// mean <- exp(correction) mean, whose translation is V(turn) correction; with turn = 0, mean + correction.
/// Where the correction stood, the shift of the transport does.
static void move_mean(bslam_ekf_t *ekf, bslam_real_t turn_rad)
{
    const bslam_turning_t turning = bslam_turning(turn_rad);
    move_position(ekf, BSLAM_STATE_X, &turning);
    move_angle(ekf, BSLAM_STATE_THETA);
    for (int i = BSLAM_STATE_FORWARD; i < bslam_ekf_map_at(ekf); i++) {
        move_value(ekf, i);
    }
    for (int b = 0; b < ekf->beacon_count; b++) {
        const bslam_beacon_t *beacon = &ekf->beacons[b];
        const int at = beacon->at;
        if (beacon->kind != BSLAM_BEACON_KNOWN) {
            move_position(ekf, at, &turning);
        }
        if (beacon->kind == BSLAM_BEACON_SIZED) {
            move_value(ekf, at + 2);
        }
        if (beacon->kind == BSLAM_BEACON_RAY) {
            move_angle(ekf, at + 2);
            move_value(ekf, at + 3);
        }
    }
}

/// Four rows get so much of the heading's, which has `by_turn` of the turn rate's, if there is one.
COPIED void shift_rows(bslam_factor_t *factor, int at, int theta, bslam_real_t by_turn, bslam_four_t shift)
{
    bslam_real_t *rows = bslam_factor_element(factor, at, 0);
    *(bslam_four_at_t *)(rows + 4 * theta) += shift;
    if (theta > 0) {
        *(bslam_four_at_t *)rows += by_turn * shift;
    }
}

/// P <- A P Aᵀ with A = I + shift e_thetaᵀ, where the shift stands in the correction, 0 but for positions:
/// L's first columns. O(n).
static void transport_covariance(bslam_ekf_t *ekf)
{
    bslam_factor_t *factor = &ekf->factor;
    const int tail = factor->tail_count, theta = bslam_ekf_place(ekf, BSLAM_STATE_THETA);
    const bslam_real_t by_turn = theta > 0 ? *bslam_factor_element(factor, theta, 0) : 0;
    memset(&ekf->correction[ekf->dim], 0, 3 * sizeof ekf->correction[0]);
    for (int at = 0; at < factor->body_count; at += 4) {
        shift_rows(factor, at, theta, by_turn, bslam_four(ekf->correction + at + tail));
    }
    const bslam_real_t x = ekf->correction[BSLAM_STATE_X], y = ekf->correction[BSLAM_STATE_Y];
    const bslam_four_t shift = tail == 2 ? (bslam_four_t){x, y, 0, 0} : (bslam_four_t){0, x, y, 0};
    shift_rows(factor, bslam_factor_tail_at(factor), theta, by_turn, shift);
}

void bslam_ekf_pin(bslam_ekf_t *ekf, int at, bslam_real_t innovation, bslam_real_t variance)
{
    const bslam_row_t row = {.other = {1}, .at = (uint16_t)at, .dim = 1};
    bslam_ekf_apply_scalar(ekf, &row, innovation, variance);
}

void bslam_ekf_correct(bslam_ekf_t *ekf, const bslam_settings_t *settings)
{
    if (!ekf->has_correction) {
        return;
    }
    const bool invariant = settings->filter != BSLAM_FILTER_STANDARD;
    bslam_ekf_settle(ekf);
    move_mean(ekf, invariant ? ekf->correction[BSLAM_STATE_THETA] : 0);
    if (invariant) {
        transport_covariance(ekf);
    }
    ekf->has_correction = false;
}
