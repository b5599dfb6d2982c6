// Sightings: innovation, gain, down-date, and the end of a frame. MATH "Update".
#include <string.h>

#include "bslam/ekf/ekf.h"
#include "bslam/ekf/ekf_internal.h"
#include "base/trig.h"
#include "bslam/model/noise.h"
#include "bslam/model/pose.h"
#include "base/scalar.h"

/// Sixteen roundings of one: what the sums of an update may be off by, as part of their largest term.
static const bslam_real_t ROUNDINGS = 8 * BSLAM_REAL_EPSILON;

// ---- rows of H --------------------------------------------------------------------------------------------

bslam_real_t bslam_ekf_dot(const bslam_row_t *row, const bslam_real_t *vector)
{
    bslam_real_t sum = row->base[0] * vector[0] + row->base[1] * vector[1] + row->base[2] * vector[2];
    const bslam_real_t *others = vector + row->at;
    if (row->dim == 2) {  // a beacon that is a point
        return sum + row->other[0] * others[0] + row->other[1] * others[1];
    }
    for (int k = 0; k < row->dim; k++) {
        sum += row->other[k] * others[k];
    }
    return sum;
}

/// Adds to P rowᵀ what the waiting down-dates make of it. Returns by how much less row P rowᵀ is for it.
static bslam_real_t add_pending(const bslam_ekf_t *ekf, const bslam_row_t *row, bslam_real_t *out)
{
    bslam_real_t less = 0;
    for (int p = 0; p < ekf->pending_count; p++) {
        const bslam_real_t *column = ekf->pending[p];
        const bslam_real_t by_row = bslam_ekf_dot(row, column);
        const bslam_real_t factor = ekf->pending_scale[p] * by_row;
        bslam_ekf_add_scaled(out, factor, column, ekf->dim);
        less -= factor * by_row;
    }
    return less;
}

bslam_real_t bslam_ekf_project(const bslam_ekf_t *ekf, const bslam_row_t *row, bslam_real_t *out)
{
    bslam_symmat_times(ekf->covariance, ekf->dim, row, out);
    return add_pending(ekf, row, out);
}

/// P times the rows of a sighting's bearing (y) and, if it has one, range (x). Returns by how much less their
/// variances are for what waits.
static bslam_sym2_t project_sighting(const bslam_ekf_t *ekf, const bslam_innovation_t *innovation,
                                     bslam_real_t *by_bearing, bslam_real_t *by_range)
{
    bslam_sym2_t less = {0, 0, 0};
    if (!innovation->has_range) {
        less.yy = bslam_ekf_project(ekf, &innovation->bearing_row, by_bearing);
        return less;
    }
    bslam_symmat_times_two(ekf->covariance, ekf->dim, &innovation->bearing_row, &innovation->range_row,
                           by_bearing, by_range);
    less.yy = add_pending(ekf, &innovation->bearing_row, by_bearing);
    less.xx = add_pending(ekf, &innovation->range_row, by_range);
    return less;
}

static void fill_row(const bslam_beacon_t *beacon, const bslam_real_t by_pose[3],
                     const bslam_real_t *by_beacon, bslam_row_t *row)
{
    row->at = (uint16_t)beacon->at;
    row->dim = (uint16_t)bslam_beacon_dim(beacon->kind);
    memcpy(row->base, by_pose, sizeof row->base);
    memcpy(row->other, by_beacon, sizeof row->other);
}

enum { SEEN_DIM_MAX = POSE_DIM + BSLAM_RAY_DIM };

/// Covariance of the i-th value that row a looks at with all that row b does: the robot's pose and a beacon
/// each.
static void fill_line(const bslam_ekf_t *ekf, const bslam_row_t *a, int i, const bslam_row_t *b,
                      bslam_real_t line[SEEN_DIM_MAX])
{
    const int at = i < POSE_DIM ? i : a->at + i - POSE_DIM;
    for (int j = 0; j < POSE_DIM; j++) {
        line[j] = bslam_symmat_get(ekf->covariance, at, j);
    }
    for (int j = 0; j < b->dim; j++) {
        line[POSE_DIM + j] = bslam_symmat_get(ekf->covariance, b->at + j, at);
    }
}

/// row · line.
static bslam_real_t weigh(const bslam_row_t *row, const bslam_real_t *line)
{
    bslam_real_t sum = 0;
    for (int k = 0; k < POSE_DIM; k++) {
        sum += line[k] * row->base[k];
    }
    for (int k = 0; k < row->dim; k++) {
        sum += line[POSE_DIM + k] * row->other[k];
    }
    return sum;
}

/// Of two rows a P bᵀ; and a P aᵀ and b P bᵀ, if they look at the same beacon. From the covariance as it is
/// stored.
typedef struct forms {
    bslam_real_t ab, aa, bb;
} forms_t;

static forms_t quadratic(const bslam_ekf_t *ekf, const bslam_row_t *a, const bslam_row_t *b)
{
    forms_t sums = {0, 0, 0};
    bslam_real_t line[SEEN_DIM_MAX] = {0};
    for (int i = 0; i < POSE_DIM + a->dim; i++) {
        fill_line(ekf, a, i, b, line);
        const bslam_real_t of_a = i < POSE_DIM ? a->base[i] : a->other[i - POSE_DIM];
        const bslam_real_t of_b = i < POSE_DIM ? b->base[i] : b->other[i - POSE_DIM];
        const bslam_real_t by_b = weigh(b, line);
        sums.ab += of_a * by_b;
        sums.aa += of_a * weigh(a, line);
        sums.bb += of_b * by_b;
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

static bslam_status_t observe(const bslam_ekf_t *ekf, const bslam_beacon_t *beacon, const bslam_pose_t *mount,
                              bslam_observation_t *seen)
{
    const bslam_pose_t pose = bslam_ekf_pose(ekf);
    const bslam_real_t *state = &ekf->mean[beacon->at];
    bslam_status_t status;
    switch (beacon->kind) {
    case BSLAM_BEACON_RAY:
        return bslam_observe_ray(&pose, mount, state, seen);
    case BSLAM_BEACON_KNOWN:
        status = bslam_observe_point(&pose, mount, beacon->known_x_m, beacon->known_y_m, seen);
        if (status == BSLAM_OK && beacon->known_scale > 0) {
            bslam_observation_scale(seen, beacon->known_scale);
        }
        return status;
    case BSLAM_BEACON_SIZED:
        status = bslam_observe_point(&pose, mount, state[0], state[1], seen);
        if (status == BSLAM_OK) {
            bslam_observation_scale(seen, state[2]);
        }
        return status;
    case BSLAM_BEACON_POINT:
    default:
        return bslam_observe_point(&pose, mount, state[0], state[1], seen);
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

bslam_status_t bslam_ekf_innovation(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                    const bslam_pose_t *mount, const bslam_sighting_t *sighting, int index,
                                    bslam_innovation_t *innovation)
{
    const bslam_beacon_t *beacon = &ekf->beacons[index];
    bslam_observation_t seen;
    const bslam_status_t status = observe(ekf, beacon, mount, &seen);
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
    fill_row(beacon, seen.bearing_by_pose, seen.bearing_by_beacon, &innovation->bearing_row);
    if (!sighting->has_range && settings->bearing_only_curvature_factor > 0) {
        innovation->bearing_var_rad2 += settings->bearing_only_curvature_factor *
                                        curvature_variance(ekf, beacon, &seen, &innovation->bearing_row);
    }
    if (sighting->has_range) {
        innovation->range_m = sighting->range_m - seen.range_m;
        innovation->range_var_m2 = range_variance_m2(settings, sighting, beacon, seen.range_m);
        fill_row(beacon, seen.range_by_pose, seen.range_by_beacon, &innovation->range_row);
    }
    return BSLAM_OK;
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

bslam_real_t bslam_ekf_row_covariance(const bslam_ekf_t *ekf, const bslam_row_t *a, const bslam_row_t *b)
{
    return quadratic(ekf, a, b).ab;
}

// ---- gain and down-date -----------------------------------------------------------------------------------

/// The first `count` waiting down-dates as terms of a pass; places without one add nothing.
static void fill_terms(const bslam_ekf_t *ekf, bslam_symmat_term_t *terms, int count)
{
    for (int p = 0; p < count; p++) {
        const bool waits = p < ekf->pending_count;
        terms[p].row_factors = ekf->pending[waits ? p : 0];
        terms[p].columns = ekf->pending[waits ? p : 0];
        terms[p].scale = waits ? ekf->pending_scale[p] : 0;
    }
}

void bslam_ekf_settle(bslam_ekf_t *ekf)
{
    if (ekf->pending_count > 0) {
        bslam_symmat_term_t terms[BSLAM_PENDING_MAX];
        fill_terms(ekf, terms, BSLAM_PENDING_MAX);
        bslam_symmat_add_rank4(ekf->covariance, ekf->dim, terms, ekf->pending_count);
        ekf->pending_count = 0;
    }
}

/// What the correction so far says of a measurement.
static bslam_real_t foreseen(const bslam_ekf_t *ekf, const bslam_row_t *row)
{
    return ekf->has_correction ? bslam_ekf_dot(row, ekf->correction) : 0;
}

/// How far a scalar measurement moves the mean and the covariance along its column P hᵀ.
typedef struct gain {
    bslam_real_t step;   ///< innovation / S
    bslam_real_t scale;  ///< -1 / S
} gain_t;

static gain_t gain_of(bslam_real_t innovation, bslam_real_t s)
{
    return (gain_t){innovation / s, -1 / s};
}

static void begin_correction(bslam_ekf_t *ekf)
{
    if (!ekf->has_correction) {
        memset(ekf->correction, 0, sizeof ekf->correction);
        ekf->has_correction = true;
    }
}

/// Takes the column in the next free pending slot into the correction and the pending down-dates.
static void accept_column(bslam_ekf_t *ekf, gain_t gain)
{
    begin_correction(ekf);
    bslam_ekf_add_scaled(ekf->correction, gain.step, ekf->pending[ekf->pending_count], ekf->dim);
    ekf->pending_scale[ekf->pending_count] = gain.scale;
    ekf->pending_count++;
}

/// The range's column becomes conditional on the bearing, and both go into the correction.
static void take_columns(bslam_real_t *restrict correction, const bslam_real_t *restrict by_bearing,
                         bslam_real_t *restrict by_range, int n, const gain_t gains[2], bslam_real_t share)
{
    const bslam_real_t by = gains[0].step, to = gains[1].step;
    for (int i = 0; i < n; i += 4) {
        const bslam_four_t bearing = bslam_four(by_bearing + i);
        const bslam_four_t own = bslam_four(by_range + i) - share * bearing;
        *(bslam_four_at_t *)(by_range + i) = own;
        *(bslam_four_at_t *)(correction + i) = bslam_four(correction + i) + by * bearing + to * own;
    }
}

/// The same for the columns of a bearing and a range in the next two slots, the range's conditional on the
/// bearing.
static void accept_two(bslam_ekf_t *ekf, gain_t bearing, gain_t range, bslam_real_t share)
{
    const int at = ekf->pending_count;
    begin_correction(ekf);
    const gain_t gains[2] = {bearing, range};
    take_columns(ekf->correction, ekf->pending[at], ekf->pending[at + 1], ekf->dim, gains, share);
    ekf->pending_scale[at] = bearing.scale;
    ekf->pending_scale[at + 1] = range.scale;
    ekf->pending_count += 2;
}

void bslam_ekf_apply_scalar(bslam_ekf_t *ekf, const bslam_row_t *row, bslam_real_t innovation,
                            bslam_real_t variance)
{
    if (ekf->pending_count == BSLAM_PENDING_MAX) {
        bslam_ekf_settle(ekf);
    }
    bslam_real_t *column = ekf->pending[ekf->pending_count];
    (void)bslam_ekf_project(ekf, row, column);
    const bslam_real_t left = innovation - foreseen(ekf, row);
    accept_column(ekf, gain_of(left, bslam_ekf_dot(row, column) + variance));
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

/// A measurement's variance, and at least what h P hᵀ is rounded by: a sighting surer than that would leave
/// no positive definite covariance. The doubt that a robot shares with a beacon cancels out, but not its
/// rounding. So `before`, which is h P hᵀ without what waits, and the robot's own part of it. MATH "Update".
static bslam_real_t noise_of(const bslam_ekf_t *ekf, const bslam_row_t *row, bslam_real_t variance,
                             bslam_real_t before)
{
    bslam_real_t terms = before;
    for (int k = 0; k < POSE_DIM; k++) {
        terms += row->base[k] * row->base[k] * ekf->covariance[5 * k];  // the first rows lie four apart
    }
    const bslam_real_t rounding = ROUNDINGS * terms;
    return variance > rounding ? variance : rounding;
}

bslam_status_t bslam_ekf_fuse(bslam_ekf_t *ekf, const bslam_settings_t *settings,
                              const bslam_innovation_t *innovation, bslam_fusion_t *fusion)
{
    if (ekf->pending_count + 2 > BSLAM_PENDING_MAX) {
        bslam_ekf_settle(ekf);
    }
    const bslam_row_t *bearing_row = &innovation->bearing_row;
    bslam_real_t *bearing_column = ekf->pending[ekf->pending_count];
    bslam_real_t *range_column = ekf->pending[ekf->pending_count + 1];
    bslam_sym2_t hph = {0, 0, 0};
    bslam_real_t range_left = 0;
    const bslam_real_t bearing_left = innovation->bearing_rad - foreseen(ekf, bearing_row);
    const bslam_sym2_t less = project_sighting(ekf, innovation, bearing_column, range_column);
    hph.yy = bslam_ekf_dot(bearing_row, bearing_column);
    if (innovation->has_range) {
        range_left = innovation->range_m - foreseen(ekf, &innovation->range_row);
        hph.xx = bslam_ekf_dot(&innovation->range_row, range_column);
        hph.xy = bslam_ekf_dot(&innovation->range_row, bearing_column);
    }
    const bslam_sym2_t s = {.xx = innovation->has_range ? hph.xx + innovation->range_var_m2 : 1,
                            .xy = hph.xy,
                            .yy = hph.yy + innovation->bearing_var_rad2};
    bslam_status_t status = bslam_sym2_mahalanobis(&s, range_left, bearing_left, &fusion->distance2);
    if (status != BSLAM_OK) {
        return status;
    }
    status = judge(settings, innovation, fusion);
    if (status != BSLAM_OK) {
        return status;
    }
    const bslam_real_t bearing_var = innovation->bearing_var_rad2 / fusion->weight;
    const bslam_real_t bearing_s = hph.yy + noise_of(ekf, bearing_row, bearing_var, hph.yy + less.yy);
    const gain_t bearing = gain_of(bearing_left, bearing_s);
    if (!innovation->has_range) {
        accept_column(ekf, bearing);
        return BSLAM_OK;
    }
    // The range's variance and innovation, conditional on the bearing.
    const bslam_real_t share = hph.xy / bearing_s;
    const bslam_real_t range_var = innovation->range_var_m2 / fusion->weight;
    const bslam_real_t range_s =
        hph.xx - share * hph.xy + noise_of(ekf, &innovation->range_row, range_var, hph.xx + less.xx);
    accept_two(ekf, bearing, gain_of(range_left - share * bearing_left, range_s), share);
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
    for (int i = BSLAM_STATE_FORWARD; i < ekf->base_dim; i++) {
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

/// P <- A P Aᵀ with A = I + shift e_thetaᵀ, in the pass over the triangle that the pending down-dates need:
/// A P Aᵀ = P + shift mirrorᵀ + mirror shiftᵀ with mirror = P e_theta + shift P_theta,theta / 2.
static void transport_covariance(bslam_ekf_t *ekf)
{
    static const bslam_row_t theta_row = {.base = {0, 0, 1}};
    const bslam_real_t *shift = ekf->correction;
    bslam_real_t *mirror = ekf->pending[BSLAM_PENDING_MAX - 1];
    if (ekf->pending_count > BSLAM_PENDING_MAX - 2) {
        bslam_ekf_settle(ekf);
    }
    bslam_symmat_column(ekf->covariance, ekf->dim, BSLAM_STATE_THETA, mirror);
    add_pending(ekf, &theta_row, mirror);
    const bslam_real_t half_variance = mirror[BSLAM_STATE_THETA] / 2;
    bslam_ekf_add_scaled(mirror, half_variance, shift, ekf->dim);
    bslam_symmat_term_t terms[BSLAM_PENDING_MAX];
    const int behind = ekf->pending_count > 0 ? 2 : 0;
    fill_terms(ekf, terms, BSLAM_PENDING_MAX);
    terms[behind] = (bslam_symmat_term_t){.row_factors = shift, .scale = 1, .columns = mirror};
    terms[behind + 1] = (bslam_symmat_term_t){.row_factors = mirror, .scale = 1, .columns = shift};
    bslam_symmat_add_rank4(ekf->covariance, ekf->dim, terms, behind + 2);
    ekf->pending_count = 0;
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
    move_mean(ekf, invariant ? ekf->correction[BSLAM_STATE_THETA] : 0);
    if (invariant) {
        transport_covariance(ekf);
    } else {
        bslam_ekf_settle(ekf);
    }
    ekf->has_correction = false;
}
