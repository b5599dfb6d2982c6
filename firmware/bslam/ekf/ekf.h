/// The extended Kalman filter over robot and map: paper equations (1)-(11) and the augment step, and its
/// right-invariant form. MATH "The filter".
///
/// State: x, y, theta | v, omega or their scale factors | what the sensor is told wrong, both if switched on
/// | beacons, 2 to 4 values each. The covariance is held in these coordinates in both forms; the invariant
/// form transports it after each correction. It is held as a factor (linalg/factor.h), in the order omega,
/// theta | sensor, beacons | v, x, y: then a motion, the transport and a new beacon keep that triangular.
///
/// Cost in multiply-adds for n values: a motion n², for the noise of its turn. Each scalar of a sighting 10
/// n, and n² for its part in the factor, which waits until four scalars share one pass. The transport 2 n.
#ifndef BSLAM_EKF_EKF_H
#define BSLAM_EKF_EKF_H

#include "bslam/bslam.h"
#include "base/status.h"
#include "base/types.h"
#include "bslam/linalg/factor.h"
#include "bslam/linalg/smallmat.h"
#include "bslam/model/observation.h"

/// The robot's own values: pose, and v, omega or their scale factors.
#define BSLAM_ROBOT_DIM_MAX 5
/// By what the sensor differs from what is told: place and yaw, in the told frame; all distances are too long
/// by the scale.
enum { BSLAM_SENSOR_X = 0, BSLAM_SENSOR_Y, BSLAM_SENSOR_YAW, BSLAM_SENSOR_SCALE, BSLAM_SENSOR_DIM };
/// The largest state: room for 2 values more a ray, or 1 more for each of twice as many sized beacons.
#define BSLAM_STATE_MAX (BSLAM_ROBOT_DIM_MAX + BSLAM_SENSOR_DIM + 2 * BSLAM_BEACONS_MAX + 2 * BSLAM_RAYS_MAX)
/// And what comes before others leave: linalg/factor.h.
#define BSLAM_STATE_PADDED BSLAM_FACTOR_PADDED(BSLAM_STATE_MAX + 7)
/// Scalars that wait for a common pass through the factor.
#define BSLAM_PENDING_MAX 4

/// Where the robot's values stand in the state.
enum {
    BSLAM_STATE_X = 0,
    BSLAM_STATE_Y = 1,
    BSLAM_STATE_THETA = 2,
    BSLAM_STATE_FORWARD = 3,  ///< v, or the scale factor of forward motion
    BSLAM_STATE_TURN = 4      ///< omega, or the scale factor of turns
};

/// How many state values a beacon of this kind has.
static inline int32_t bslam_beacon_dim(bslam_beacon_kind_t kind)
{
    return kind == BSLAM_BEACON_POINT   ? BSLAM_POINT_DIM
           : kind == BSLAM_BEACON_SIZED ? BSLAM_SIZED_DIM
           : kind == BSLAM_BEACON_RAY   ? BSLAM_RAY_DIM
                                        : 0;
}

/// A beacon's class_lead and distance_lead at most: so many sightings in a row overturn either.
#define BSLAM_LEAD_MAX 20

/// A beacon of the map.
typedef struct bslam_beacon {
    uint32_t uid;  ///< counts up from 0 with each beacon ever added; never used twice
    int32_t label;
    bslam_beacon_kind_t kind;
    int32_t at;  ///< its first state value, if it has one
    bslam_real_t known_x_m, known_y_m;
    int64_t first_seen_us, last_seen_us;
    uint32_t sightings;     ///< that were matched with it, the one that started it included
    uint32_t gated;         ///< sightings taken for it that its gate rejected
    uint32_t travelled_um;  ///< that the robot had gone when it was fused last, modulo 4.3 km
    uint32_t view_um;       ///< the same when it was last counted in views
    uint16_t views;         ///< sightings far apart that count towards its confirmation, less those against
    bool confirmed;
    uint8_t beacon_class;
    uint8_t class_lead;        ///< by how many votes it leads, slam/beacon_scale.c
    uint8_t distance_lead;     ///< by how many more its distances fitted than did not
    uint8_t alone;             ///< how often it was seen without near_uid, or that without it
    uint8_t ousted;            ///< how many beacons were retired for being in this one's place
    bool has_scores;           ///< of its sightings
    uint32_t near_uid;         ///< an older beacon in the same place
    bslam_real_t score_sum;    ///< what these say for its being a beacon at all
    bslam_real_t known_scale;  ///< a known beacon's distances come out too long by it; 0: nobody knows
    bslam_real_t last_bearing, last_range;  ///< innovations, in standard deviations of their noise
} bslam_beacon_t;

typedef struct bslam_ekf {
    bslam_real_t mean[BSLAM_STATE_PADDED];
    bslam_factor_t factor;  ///< of the covariance, but for what waits
    int32_t dim;
    int32_t base_dim;    ///< 3, or 5 with velocity or scale states
    int32_t sensor_dim;  ///< 0, or BSLAM_SENSOR_DIM behind those
    int32_t beacon_count, ray_count, sized_count;
    uint32_t next_uid;
    bslam_beacon_t beacons[BSLAM_BEACONS_MAX];
    // Scratch: holds nothing between calls.
    bslam_real_t d[BSLAM_FACTOR_PLACES_MAX];  ///< the factor's with what waits
    bslam_real_t v[BSLAM_PENDING_MAX][BSLAM_FACTOR_PLACES_MAX],
        lambda[BSLAM_PENDING_MAX][BSLAM_FACTOR_PLACES_MAX];
    bslam_real_t gain[BSLAM_PENDING_MAX];
    bslam_real_t correction[BSLAM_STATE_PADDED];
    int32_t pending_count;
    bool has_correction;
} bslam_ekf_t;

/// A sparse row: not zero only at x, y, theta, at the sensor's values, if there are any, and at `dim`
/// neighbouring state values from `at` on, at >= 3.
typedef struct bslam_row {
    bslam_real_t base[3], other[BSLAM_RAY_DIM], sensor[BSLAM_SENSOR_DIM];
    uint16_t at;
    uint16_t dim;
    uint16_t sensor_at, sensor_dim;
} bslam_row_t;

/// The first state value of the map.
static inline int bslam_ekf_map_at(const bslam_ekf_t *ekf)
{
    return ekf->base_dim + ekf->sensor_dim;
}

/// Where state value i stands in the factor.
static inline int bslam_ekf_place(const bslam_ekf_t *ekf, int i)
{
    const int tail = ekf->factor.tail_count, tail_at = bslam_factor_tail_at(&ekf->factor);
    if (i >= ekf->base_dim) {
        return i - tail;
    }
    return i == BSLAM_STATE_THETA  ? ekf->base_dim - tail - 1
           : i == BSLAM_STATE_TURN ? 0
                                   : tail_at + (i == BSLAM_STATE_FORWARD ? 0 : tail - 2 + i);
}

/// The covariance of state values i and j. O(n).
static inline bslam_real_t bslam_ekf_covariance(const bslam_ekf_t *ekf, int i, int j)
{
    return bslam_factor_get(&ekf->factor, bslam_ekf_place(ekf, i), bslam_ekf_place(ekf, j));
}

/// Robot at the origin, which it knows exactly; no beacons.
void bslam_ekf_init(bslam_ekf_t *ekf, const bslam_settings_t *settings);

// ---- time -------------------------------------------------------------------------------------------------

/// BSLAM_E_SINGULAR: the motion's noise is not positive definite, which velocity states need.
BSLAM_MUST_CHECK bslam_status_t bslam_ekf_check_motion(const bslam_settings_t *settings,
                                                       const bslam_motion_t *motion);

/// Moves the robot by one odometry increment with dt_s > 0: paper equations (4), (5). With velocity states
/// the increment is a measurement of v and omega instead. *moved is the motion that the filter took for the
/// interval.
void bslam_ekf_predict(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_motion_t *motion,
                       bslam_motion_t *moved);

/// The robot's own part of a state, which goes through odometry alone as it does with the map.
typedef struct bslam_robot {
    bslam_real_t mean[BSLAM_ROBOT_DIM_MAX];
    bslam_real_t covariance[BSLAM_ROBOT_DIM_MAX][BSLAM_ROBOT_DIM_MAX];
    int32_t dim;
} bslam_robot_t;

/// The robot as the filter has it. O(n).
bslam_robot_t bslam_ekf_robot(const bslam_ekf_t *ekf);

/// What bslam_ekf_predict does to the robot. O(1).
void bslam_robot_predict(bslam_robot_t *robot, const bslam_settings_t *settings, const bslam_motion_t *motion,
                         bslam_motion_t *moved);

/// The robot may have moved unseen and stands still now: adds variance to its position (each axis) and
/// heading, up to (30 m)² and (3.2 rad)² in all; velocity states become as at the start. O(n).
void bslam_ekf_resume(bslam_ekf_t *ekf, const bslam_settings_t *settings, bslam_real_t position_var_m2,
                      bslam_real_t heading_var_rad2);

/// Puts the robot somewhere: its pose has these variances (each axis) and is independent of all else. O(n).
void bslam_ekf_set_pose(bslam_ekf_t *ekf, const bslam_pose_t *pose, bslam_real_t position_var_m2,
                        bslam_real_t heading_var_rad2);

// ---- sightings --------------------------------------------------------------------------------------------

/// A sighting against a beacon of the map: equations (6)-(8), at the present mean.
typedef struct bslam_innovation {
    bool has_range;
    bslam_real_t range_m;  ///< measured less predicted
    bslam_real_t bearing_rad;
    bslam_real_t range_var_m2;  ///< of the measurement, at the predicted distance
    bslam_real_t bearing_var_rad2;
    bslam_real_t gate_d2;  ///< beyond this squared Mahalanobis distance it is not used; 0: no gate
    bool gate_is_open;     ///< beyond it, it is used and weighs as much as if it were at the gate
    bslam_row_t range_row;
    bslam_row_t bearing_row;
} bslam_innovation_t;

/// True if a beacon and a sighting have classes, and not the same.
bool bslam_ekf_classes_differ(const bslam_beacon_t *beacon, const bslam_sighting_t *sighting);

/// A sighting as it shows a beacon. How much too long a beacon's distances are goes with its class: taken for
/// another class, a sighting is bearing-only.
bslam_sighting_t bslam_ekf_taken_as(const bslam_beacon_t *beacon, const bslam_sighting_t *sighting);

/// Innovation of a sighting if it shows beacon `index`, at the mean and covariance before the frame: take all
/// of a frame before the first bslam_ekf_fuse. BSLAM_E_SINGULAR: the beacon stands at the sensor, or is a ray
/// without a point and the sighting has a distance. O(1).
BSLAM_MUST_CHECK bslam_status_t bslam_ekf_innovation(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                                     const bslam_pose_t *mount,
                                                     const bslam_sighting_t *sighting, int index,
                                                     bslam_innovation_t *innovation);

/// Adds noise to an innovation of distance and direction, so that it makes a step of the way, where the model
/// is not straight as far as the direction is in doubt. False, and no change: it is straight. O(n).
bool bslam_ekf_soften(const bslam_ekf_t *ekf, bslam_innovation_t *innovation);

/// Squared Mahalanobis distance of an innovation, by equation (8)'s S, from the covariance as it stands.
/// BSLAM_E_SINGULAR: S is not positive definite. O(n).
BSLAM_MUST_CHECK bslam_status_t bslam_ekf_distance2(const bslam_ekf_t *ekf,
                                                    const bslam_innovation_t *innovation,
                                                    bslam_real_t *distance2);

/// The same of a sighting if it shows beacon `index`; negative: it has none. O(n).
bslam_real_t bslam_ekf_sighting_distance2(const bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                          const bslam_pose_t *mount, const bslam_sighting_t *sighting,
                                          int index);

/// row P othersᵀ, from the covariance as it stands: how alike the errors of predictions are. O(n count).
void bslam_ekf_row_covariances(const bslam_ekf_t *ekf, const bslam_row_t *row, const bslam_row_t *others,
                               int count, bslam_real_t *covariances);

typedef struct bslam_fusion {
    bslam_real_t
        distance2;  ///< squared Mahalanobis distance, conditional on what was fused before it in this frame
    bslam_real_t weight;  ///< 1, or less by Huber's rule; 0: gated out
} bslam_fusion_t;

/// Equations (9)-(11) for one sighting, conditional on those fused since the last bslam_ekf_correct, which
/// alone moves the mean. Not used: BSLAM_E_RANGE, outside the gate; BSLAM_E_SINGULAR, S is not positive
/// definite.
BSLAM_MUST_CHECK bslam_status_t bslam_ekf_fuse(bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                               const bslam_innovation_t *innovation, bslam_fusion_t *fusion);

/// Ends a frame: moves the mean, by the exponential map in the invariant form, and brings the covariance up
/// to date.
void bslam_ekf_correct(bslam_ekf_t *ekf, const bslam_settings_t *settings);

// ---- about given points -----------------------------------------------------------------------------------

// For who goes through the same drive again (smoother/smoother.h): a linear Kalman filter. While
// has_correction is set the mean is where the models are linearised, and the correction about it is what is
// known of the state.

/// How the robot's values go through a motion, MATH (14).
typedef struct bslam_transition {
    bslam_real_t by[3]
                   [BSLAM_ROBOT_DIM_MAX];  ///< the new pose by the old values, the two further ones decayed
    bslam_real_t keep[2];                  ///< what is left of these
} bslam_transition_t;

/// How a path of changing speeds differs from the arc at their means: its chord is turned to the left, and
/// stretched. By how much it still misses the next point, times doubt_of_miss, is its standard deviation.
typedef struct bslam_bend {
    bslam_real_t turned_rad, stretch, doubt_of_miss;
} bslam_bend_t;

/// bslam_ekf_predict in that filter, but for the speedometers. next[base_dim] are the robot's values that the
/// models are linearised about from then on. *transition, if not NULL, becomes what it did.
void bslam_ekf_predict_about(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_motion_t *motion,
                             const bslam_bend_t *bend, const bslam_real_t *next,
                             bslam_transition_t *transition);

/// The speedometers' part, where there are velocity states.
void bslam_ekf_measure_speeds(bslam_ekf_t *ekf, const bslam_settings_t *settings,
                              const bslam_motion_t *motion);

/// An innovation becomes linear as it is for a robot that stands here, and turned as it is. What is predicted
/// stays. BSLAM_E_SINGULAR: the beacon stands here.
BSLAM_MUST_CHECK bslam_status_t bslam_ekf_look_from(const bslam_ekf_t *ekf, const bslam_pose_t *mount,
                                                    bslam_real_t x_m, bslam_real_t y_m, int index,
                                                    bslam_innovation_t *innovation);

/// The state value at `at` is its mean and this much more, up to `variance`.
void bslam_ekf_pin(bslam_ekf_t *ekf, int at, bslam_real_t innovation, bslam_real_t variance);

/// Brings the stored covariance up to date, in one pass for all that waits; the correction still waits.
void bslam_ekf_settle(bslam_ekf_t *ekf);

// ---- map --------------------------------------------------------------------------------------------------

/// Adds the beacon that a sighting shows: a ray if it has no distance; else a point, or a sized one where
/// distances err alike and there is room. *index is its place. BSLAM_E_MAP_FULL. O(n).
BSLAM_MUST_CHECK bslam_status_t bslam_ekf_add(bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                              const bslam_pose_t *mount, const bslam_sighting_t *sighting,
                                              int *index);

/// Adds a beacon at a position that is given and exact. BSLAM_E_MAP_FULL.
BSLAM_MUST_CHECK bslam_status_t bslam_ekf_add_known(bslam_ekf_t *ekf, bslam_real_t x_m, bslam_real_t y_m,
                                                    int *index);

/// Adds a point where a guess has it, whatever the robot's pose, each axis this doubtful. BSLAM_E_MAP_FULL.
/// O(n).
BSLAM_MUST_CHECK bslam_status_t bslam_ekf_add_guess(bslam_ekf_t *ekf, bslam_real_t x_m, bslam_real_t y_m,
                                                    bslam_real_t sd_m, int *index);

/// A ray that is seen with a distance becomes a sized beacon where that ends, of a scale of this variance >
/// 0. False: it does not end on the ray. MATH "Beacon scale states". O(n²).
bool bslam_ekf_measure_ray(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *mount,
                           const bslam_sighting_t *sighting, int index, bslam_real_t scale_var);

/// A point becomes a sized beacon, of a scale of this variance > 0. False: it is no point, or there is no
/// room. O(n²).
bool bslam_ekf_give_scale(bslam_ekf_t *ekf, int index, bslam_real_t scale_var);

/// A sized beacon is something else than was thought: its scale is 1 again, to this variance and more_var >
/// 0. Means stay; what hung on the scale becomes as doubtful as if more_var had been there from the start. No
/// correction may be under way. O(n²).
void bslam_ekf_renew_scale(bslam_ekf_t *ekf, int index, bslam_real_t scale_var, bslam_real_t more_var);

/// A point becomes another one, made of the state by these rows. Its values stand behind all others then, and
/// its mean is as it was. O(n²).
void bslam_ekf_replace_point(bslam_ekf_t *ekf, int index, const bslam_row_t rows[BSLAM_POINT_DIM]);

/// Takes a beacon out of the state; those behind it move up one place. O(n²).
void bslam_ekf_remove(bslam_ekf_t *ekf, int index);

/// Takes a value that is no beacon's out of the state. O(n²).
void bslam_ekf_remove_value(bslam_ekf_t *ekf, int at);

/// Takes all beacons out. The robot stays as it is. O(n).
void bslam_ekf_forget_map(bslam_ekf_t *ekf);

/// Turns a ray into a point if its distance is linear enough (Civera's index, MATH "Bearing-only"). True if
/// it did.
bool bslam_ekf_settle_ray(bslam_ekf_t *ekf, const bslam_settings_t *settings, const bslam_pose_t *mount,
                          int index);

// ---- queries ----------------------------------------------------------------------------------------------

/// Of a state, or of the robot's part of it, the pose.
static inline bslam_pose_t bslam_pose_of(const bslam_real_t *mean)
{
    return (bslam_pose_t){mean[BSLAM_STATE_X], mean[BSLAM_STATE_Y], mean[BSLAM_STATE_THETA]};
}

static inline bslam_pose_t bslam_ekf_pose(const bslam_ekf_t *ekf)
{
    return bslam_pose_of(ekf->mean);
}

/// Where a beacon is, in the map. A ray without a positive inverse distance answers with a point 1 km along
/// it.
void bslam_ekf_beacon_position(const bslam_ekf_t *ekf, int index, bslam_real_t *x_m, bslam_real_t *y_m);

/// Covariance of a beacon's position in the map; zero for a known one.
bslam_sym2_t bslam_ekf_beacon_covariance(const bslam_ekf_t *ekf, int index);

/// Whether all means are finite, and so is D, which is not negative. O(n).
bool bslam_ekf_is_sane(const bslam_ekf_t *ekf);

#endif
