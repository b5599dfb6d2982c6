/// Every run-time parameter: name, default, range and meaning stand once, in the table below. C, the Python
/// package and `bslam settings` read the same line.
#ifndef BSLAM_SETTINGS_H
#define BSLAM_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>

#include "bslam/config.h"
#include "base/real.h"
#include "base/status.h"

// clang-format off
/// REAL(name, default, low, high, meaning) and INTEGER(the same).
#define BSLAM_SETTINGS(REAL, INTEGER) \
    /* estimator */ \
    INTEGER(filter, 1, 0, 2, "0 standard EKF (paper equations (4)-(11)), 1 right-invariant, 2 smoother") \
    INTEGER(motion, 1, 0, 1, "0 Euler step (paper equation (2)), 1 exact arc") \
    INTEGER(velocity_states, 1, 0, 1, \
            "1: v and omega are states and the wheels measure them (speedometer noise)") \
    INTEGER(scale_states, 0, 0, 1, \
            "1: the scale factors of odometry are states; not together with velocity_states") \
    REAL(velocity_sd_mps, 0.02, 1e-6, 100.0, \
         "standard deviation of v at the start (the robot stands still)") \
    REAL(velocity_walk_mps_sqrt_s, 0.15, 0.0, 100.0, "v changes by this much in a second (random walk)") \
    REAL(path_walk_mps_sqrt_s, 0.6, 0.0, 100.0, \
         "smoother: the same along the path where it linearises, which is to be smooth") \
    REAL(velocity_decay_s, 1e6, 1e-3, 1e6, "v decays to 0 with this time constant (1e6: not)") \
    REAL(turn_rate_sd_radps, 0.05, 1e-6, 100.0, \
         "standard deviation of omega at the start (the robot stands still)") \
    REAL(turn_rate_walk_radps_sqrt_s, 0.8, 0.0, 100.0, \
         "omega changes by this much in a second (random walk)") \
    REAL(turn_rate_decay_s, 1e6, 1e-3, 1e6, "omega decays to 0 with this time constant (1e6: not)") \
    REAL(forward_scale, 1.0, 0.1, 10.0, \
         "true over measured forward motion; with scale_states its start value") \
    REAL(turn_scale, 1.0, 0.1, 10.0, "true over measured turn; with scale_states its start value") \
    REAL(scale_sd, 0.2, 1e-6, 1.0, "standard deviation of both scale factors at the start") \
    REAL(scale_walk_sqrt_s, 0.002, 0.0, 1.0, \
         "a scale factor changes by this much in a second (random walk)") \
    /* odometry */ \
    REAL(wheelbase_m, 0.4, 1e-3, 10.0, "distance between the wheels") \
    REAL(left_radius_m, 0.05, 1e-4, 10.0, "radius of the left wheel") \
    REAL(right_radius_m, 0.05, 1e-4, 10.0, "radius of the right wheel") \
    INTEGER(ticks_per_revolution, 1024, 1, 10000000, "encoder ticks in a turn of the wheel") \
    INTEGER(counter_bits, 16, 2, 32, "width of the tick counters, which roll over") \
    REAL(speed_max_mps, 20.0, 1e-3, 1000.0, "a wheel reading faster than this is refused as a jump") \
    REAL(left_speed_sd_mps, 0.3, 0.0, 100.0, \
         "noise of the left wheel's speed reading, independent at each step") \
    REAL(right_speed_sd_mps, 0.3, 0.0, 100.0, \
         "noise of the right wheel's speed reading, independent at each step") \
    REAL(travel_sd_per_sqrt_m, 0.0, 0.0, 10.0, "noise of a wheel's travel that grows with the travel") \
    REAL(forward_sd_per_sqrt_s, 0.0, 0.0, 10.0, \
         "noise of forward motion that grows with time while the robot moves") \
    REAL(forward_sd_per_sqrt_m, 0.0, 0.0, 10.0, "noise of forward motion that grows with the way") \
    REAL(turn_sd_per_sqrt_s, 0.0, 0.0, 10.0, \
         "noise of the heading that grows with time while the robot moves") \
    REAL(turn_sd_per_sqrt_m, 0.0, 0.0, 10.0, "noise of the heading that grows with the way") \
    REAL(turn_sd_per_sqrt_rad, 0.0, 0.0, 10.0, "noise of the heading that grows with the turn") \
    REAL(gyro_sd_radps, 0.02, 1e-6, 100.0, "noise of the gyro rate, independent at each step") \
    INTEGER(gap_us, 1000000, 1000, 4000000, "an odometry interval longer than this is a gap") \
    REAL(gap_speed_sd_mps, 0.2, 0.0, 100.0, "unknown forward speed during the part of a gap beyond gap_us") \
    REAL(gap_turn_sd_radps, 0.5, 0.0, 100.0, "unknown turn rate during the part of a gap beyond gap_us") \
    /* sightings */ \
    REAL(mount_x_m, 0.0, -100.0, 100.0, "sensor on the robot, forward of the wheel axle") \
    REAL(mount_y_m, 0.0, -100.0, 100.0, "sensor on the robot, to the left") \
    REAL(mount_yaw_rad, 0.0, -3.2, 3.2, "sensor on the robot, turned to the left") \
    INTEGER(sighting_delay_us, 0, -1000000, 10000000, \
            "a sighting stamped t shows what odometry has at t - delay") \
    INTEGER(ahead_max_us, 200000, 0, 10000000, "a sighting may be this much newer than the last odometry") \
    INTEGER(history_steps, 1024, 1, 1024, \
            "odometry readings that may wait for a late sighting, at most BSLAM_HISTORY_MAX of them") \
    REAL(bearing_sd_rad, 0.0136, 1e-4, 3.2, "noise of the direction") \
    REAL(range_sd_floor_m, 0.0, 0.0, 100.0, \
         "noise of the distance: sd^2 = floor^2 + (fraction r)^2 + (per_m r^2)^2") \
    REAL(range_sd_fraction, 0.02, 0.0, 10.0, "noise of the distance in proportion to it") \
    REAL(range_sd_per_m, 0.009, 0.0, 10.0, "noise of the distance from apparent size: proportional to r^2") \
    REAL(range_scale_sd, 0.0, 0.0, 1.0, \
         "all distances of a beacon are too long or too short by so much, as is its size (0: no)") \
    REAL(bearing_only_variance_factor, 3.0, 1.0, 1000.0, \
         "direction variance times this where no distance comes") \
    REAL(bearing_only_curvature_factor, 100.0, 0.0, 1e6, \
         "and plus this times the bend of the model, MATH 24") \
    REAL(correlation_m, 0.0, 0.0, 100.0, \
         "the errors of a beacon's sightings are alike until the robot has gone so far (0: they are not)") \
    REAL(gate_d2, 13.8, 0.0, 1e6, \
         "a sighting with a larger squared Mahalanobis distance is rejected (13.8: one in 1000; 0: none)") \
    REAL(huber_d, 0.0, 0.0, 1e3, "beyond this Mahalanobis distance a sighting counts less (Huber; 0: off)") \
    REAL(ray_inverse_distance_per_m, 0.2, 1e-4, 100.0, \
         "start value of a direction-only beacon's inverse distance") \
    REAL(ray_inverse_distance_sd_per_m, 0.1, 1e-4, 100.0, "its standard deviation") \
    REAL(ray_linear_limit, 0.1, 1e-4, 10.0, \
         "a ray becomes a point when its linearity index falls below this") \
    /* association and map */ \
    INTEGER(association, 0, 0, 4, \
            "0 known identity, 1 nearest (paper's baseline), 2 Mahalanobis, 3 svm, 4 joint") \
    REAL(nearest_threshold_m, 1.0, 1e-3, 100.0, "nearest: farther than this from any beacon is a new one") \
    REAL(nearest_threshold_rad, 0.2, 1e-4, 3.2, "nearest, direction only: the same as an angle") \
    REAL(match_d2, 13.8, 1e-3, 1e6, "mahalanobis: nearer than this is a match") \
    REAL(new_d2, 40.0, 1e-3, 1e6, \
         "mahalanobis: farther than this from any beacon is a new one, between: rejected") \
    REAL(joint_sd, 3.09, 0.0, 10.0, \
         "joint: sightings fit together up to this many normal deviations (3.09: one in 1000 does not)") \
    INTEGER(joint_nodes, 3000, 1, 10000000, "joint: choices that are tried for at most 5 sightings") \
    REAL(candidate_d2, 30.0, 1e-3, 1e6, "svm: beacons nearer than this are candidates") \
    REAL(new_per_m2, 0.02, 1e-9, 1e3, "svm: density of beacons not yet in the map") \
    REAL(new_per_rad, 0.3, 1e-9, 1e3, "svm: the same, direction only") \
    REAL(defer_score, 4.0, 0.0, 1e3, "svm: a best score between 0 and minus this is left undecided") \
    REAL(competitor_lead, 2.0, 0.0, 1e3, \
         "svm: of two sightings that want a beacon, one must score higher by this, or both wait") \
    REAL(again_odds, 4.2, 0.0, 100.0, \
         "svm: log odds that a beacon seen just now is seen again (4.2: missed 15 times in 1000)") \
    INTEGER(again_us, 200000, 0, 1000000000, "svm: just now is so long ago") \
    INTEGER(decision_delay_us, 1000000, 0, 1000000000, \
            "svm: a match that a machine of few samples is against waits so long, 0: not") \
    REAL(decision_delay_score, 3.0, 0.0, 100.0, \
         "svm: so does one that scores less, another in view; or leads by less, no distance, none in view") \
    REAL(appearance_weight, 1.0, 0.0, 100.0, "svm: what looks count against position (0: nothing)") \
    REAL(appearance_samples, 3.0, 0.0, 1e3, "svm: looks count half when a machine keeps so many samples") \
    REAL(appearance_slope, 4.0, 0.0, 1e3, "svm: log odds of a decision value") \
    REAL(appearance_offset, -0.5, -100.0, 100.0, "svm: log odds of the decision value 0") \
    REAL(appearance_low, 8.0, 0.0, 100.0, "svm: looks speak against a match by this much at most") \
    REAL(appearance_high, 4.0, 0.0, 100.0, "svm: and for one by this much") \
    REAL(viewpoint_low, 3.0, 0.0, 100.0, \
         "svm: log odds against a beacon seen from a right angle or more beside where it was seen from") \
    REAL(viewpoint_high, 1.0, 0.0, 100.0, "svm: and for one seen from where it was, if from two sides at least") \
    REAL(class_doubt, 0.1, 1e-3, 1e3, \
         "svm: a beacon counts as seen so often as each class before it is seen at all") \
    REAL(duplicate_m, 1.0, 0.0, 1e3, "svm: two beacons nearer than this may be one") \
    REAL(duplicate_sd_m, 0.1, 0.0, 1e3, "svm: whose two places differ by about this") \
    REAL(duplicate_d2, 9.0, 0.0, 1e3, "svm: and by no more than this squared Mahalanobis distance") \
    REAL(far_d2, 300.0, 0.0, 1e6, \
         "svm: a sighting that clearly looks like a beacon up to here, but is no candidate, is not new") \
    REAL(learn_d2, 9.0, 0.0, 1e6, "svm: a machine learns from matches nearer than this") \
    REAL(learn_lead, 4.0, 0.0, 1e3, "svm: whose score is ahead of the next beacon's by this") \
    REAL(learn_margin, 0.0, -100.0, 100.0, \
         "svm: and whose decision value is above this, once looks count half") \
    REAL(learn_travel_m, 0.1, 0.0, 100.0, "svm: and since the last one of its beacon the robot went this far") \
    REAL(share_value, 0.8, -100.0, 100.0, \
         "svm: a decision value above this says that a beacon looks like another machine's") \
    INTEGER(share_sightings, 12, 1, 250, "svm: so often before it shares that machine, or leaves one again") \
    INTEGER(doubt_sightings, 25, 1, 250, \
            "svm: of two beacons in one place or direction, seen so often and never both, one leaves") \
    INTEGER(missed_views, 3, 0, 32, \
            "svm: one missed from so many directions from which it was seen before leaves (0: never)") \
    INTEGER(learn_budget, 600, 0, 1000000, "svm: pieces of training after each frame") \
    INTEGER(confirm_sightings, 4, 1, 1000, "a provisional beacon is confirmed by this many sightings") \
    REAL(confirm_travel_m, 0.0, 0.0, 100.0, \
         "of which one counts when the robot has gone this far since the last that did") \
    REAL(confirm_d2, 1e6, 1e-3, 1e6, \
         "and against it beyond this squared Mahalanobis distance; it leaves with as many against as for") \
    INTEGER(confirm_window_us, 1000000, 0, 1000000000, \
            "one not confirmed by then is removed (of told identity: if contradicted); 0: none") \
    REAL(existence_score, 0.5, -100.0, 100.0, \
         "svm: a detector's score speaks for a beacon by how much it is above this") \
    REAL(existence_sum, 6.5, 0.0, 1e6, \
         "svm: until those of a beacon come to this, it is not confirmed, nor its sightings used") \
    REAL(existence_first_sum, 3.0, 0.0, 1e6, "svm: which they are from this on") \
    INTEGER(existence_beacons, 4, 0, 250, "svm: while fewer than so many are confirmed") \
    INTEGER(settled_us, 30000000, 0, 1000000000, \
            "recovery, svm: nothing new for so long: one beacon may contradict the pose (0: always)")
// clang-format on

/// Values of `filter`.
enum { BSLAM_FILTER_STANDARD = 0, BSLAM_FILTER_INVARIANT = 1, BSLAM_FILTER_SMOOTHER = 2 };

#define BSLAM_SETTINGS_FIELD_REAL(name, value, low, high, meaning) bslam_real_t name;
#define BSLAM_SETTINGS_FIELD_INTEGER(name, value, low, high, meaning) int32_t name;

/// The values, one field for each line of the table.
typedef struct bslam_params {
    BSLAM_SETTINGS(BSLAM_SETTINGS_FIELD_REAL, BSLAM_SETTINGS_FIELD_INTEGER)
} bslam_settings_t;

/// One line of the table, for tools and parameter servers.
typedef struct bslam_setting_info {
    const char *name;
    const char *meaning;  ///< empty without BSLAM_SETTING_MEANINGS
    bslam_real_t initial;
    bslam_real_t low;
    bslam_real_t high;
    bool is_integer;
} bslam_setting_info_t;

/// Number of parameters.
int bslam_settings_count(void);

/// Line 0 <= id < bslam_settings_count() of the table, else NULL.
const bslam_setting_info_t *bslam_settings_info(int id);

/// Every field to its default.
void bslam_settings_default(bslam_settings_t *settings);

/// BSLAM_OK, or BSLAM_E_PARAMETER with *bad_id the first field that is outside its range (NaN is), or that
/// contradicts another (velocity_states needs a positive speed noise of both wheels, and excludes
/// scale_states).
BSLAM_MUST_CHECK bslam_status_t bslam_settings_check(const bslam_settings_t *settings, int *bad_id);

/// Field id as a number, an integer rounded to the scalar type. 0 for an id that does not exist.
bslam_real_t bslam_settings_get(const bslam_settings_t *settings, int id);

/// Sets field id. BSLAM_E_PARAMETER, and no change, if there is no such field, the value is outside its
/// range, or an integer is asked for and the value has a fraction.
BSLAM_MUST_CHECK bslam_status_t bslam_settings_set(bslam_settings_t *settings, int id, bslam_real_t value);

#endif
