/// Every run-time setting: name, default, range and meaning stand once, in the tables below. C, the Python
/// package, the command line, the link and docs/TUNING.md read the same line. Presets are sets of values.
///
/// A user meets BSLAM_SETTINGS. BSLAM_EXPERT is for who knows the filter, and association/tuning.h is
/// internal.
#ifndef BSLAM_SETTINGS_H
#define BSLAM_SETTINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "bslam/association/tuning.h"
#include "bslam/config.h"
#include "base/real.h"
#include "base/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// clang-format off
/// REAL(name, default, low, high, meaning) and INTEGER(the same). The unit stands in the name.
#define BSLAM_SETTINGS(REAL, INTEGER) \
    /* robot */ \
    REAL(wheelbase_m, 0.4, 1e-3, 10.0, "distance between the wheels") \
    REAL(left_radius_m, 0.05, 1e-4, 10.0, "radius of the left wheel") \
    REAL(right_radius_m, 0.05, 1e-4, 10.0, "radius of the right wheel") \
    INTEGER(ticks_per_revolution, 1024, 1, 10000000, "encoder ticks in a turn of the wheel") \
    INTEGER(counter_bits, 16, 2, 32, "width of the tick counters, which roll over") \
    INTEGER(counter_modulus, 0, 0, 16000000, "the count in place of which they are 0 (0: 2^counter_bits)") \
    REAL(mount_x_m, 0.0, -100.0, 100.0, "sensor on the robot, forward of the wheel axle") \
    REAL(mount_y_m, 0.0, -100.0, 100.0, "sensor on the robot, to the left") \
    REAL(mount_yaw_rad, 0.0, -3.2, 3.2, "sensor on the robot, turned to the left") \
    /* odometry */ \
    INTEGER(velocity_states, 0, 0, 1, "1: v and omega are states, which the wheels measure (0: not)") \
    INTEGER(scale_states, 0, 0, 1, "1: odometry's scale factors are states; not with velocity_states") \
    REAL(scale_sd, 0.2, 1e-6, 1.0, "standard deviation of both scale factors at the start") \
    REAL(left_speed_sd_mps, 0.05, 0.0, 100.0, "noise of the left wheel's speed, independent at each step") \
    REAL(right_speed_sd_mps, 0.05, 0.0, 100.0, "noise of the right wheel's speed, independent at each step") \
    REAL(forward_sd_per_sqrt_m, 0.0, 0.0, 10.0, \
         "noise of forward motion that grows with the distance travelled") \
    REAL(turn_sd_per_sqrt_m, 0.0, 0.0, 10.0, "noise of the heading that grows with the distance travelled") \
    REAL(turn_sd_per_sqrt_rad, 0.0, 0.0, 10.0, "noise of the heading that grows with the turn") \
    REAL(gyro_sd_radps, 0.02, 1e-6, 100.0, "noise of the gyro rate, independent at each step") \
    REAL(speed_max_mps, 20.0, 1e-3, 1000.0, "a wheel reading faster than this is refused as a jump") \
    INTEGER(gap_us, 1000000, 1000, 4000000, "an odometry interval longer than this is a gap") \
    REAL(gap_speed_sd_mps, 0.2, 0.0, 100.0, "unknown forward speed during the part of a gap beyond gap_us") \
    REAL(gap_turn_sd_radps, 0.5, 0.0, 100.0, "unknown turn rate during the part of a gap beyond gap_us") \
    /* sensor */ \
    REAL(bearing_sd_rad, 0.0136, 1e-4, 3.2, "noise of the direction") \
    REAL(range_sd_floor_m, 0.0, 0.0, 100.0, \
         "noise of the distance: sd^2 = floor^2 + (fraction r)^2 + (per_m r^2)^2") \
    REAL(range_sd_fraction, 0.02, 0.0, 10.0, "noise of the distance in proportion to it") \
    REAL(range_sd_per_m, 0.009, 0.0, 10.0, "noise of the distance from apparent size: proportional to r^2") \
    REAL(range_scale_sd, 0.0, 0.0, 1.0, "all distances of a beacon err alike by this part of them (0: no)") \
    REAL(correlation_m, 0.0, -1.0, 100.0, \
         "a beacon's errors are alike until the robot has gone this far (0: no, below: as they show)") \
    INTEGER(sighting_delay_us, 0, -1000000, 10000000, "a sighting stamped t shows odometry's t - delay") \
    INTEGER(ahead_max_us, 200000, 0, 10000000, "a sighting may be this much newer than the last odometry") \
    /* map */ \
    INTEGER(filter, 1, 0, 2, "0 standard EKF (paper equations (4)-(11)), 1 right-invariant, 2 smoother") \
    INTEGER(motion, 1, 0, 1, "0 Euler step (paper equation (2)), 1 exact arc") \
    REAL(gate_d2, 13.8, 0.0, 1e6, "squared Mahalanobis distance of the gate (13.8: one in 1000; 0: none)") \
    REAL(huber_d, 0.0, 0.0, 1e3, "beyond this Mahalanobis distance a sighting counts less (Huber; 0: off)") \
    INTEGER(association, 0, 0, 8, \
            "0 known, 1 nearest, 2 Mahalanobis, 3 svm, 4 joint, 5 position, 6 sample, 7 centroid, 8 both") \
    REAL(nearest_threshold_m, 1.0, 1e-3, 100.0, "nearest: farther than this from any beacon is a new one") \
    REAL(nearest_threshold_rad, 0.2, 1e-4, 3.2, "nearest, bearing-only: the same as an angle") \
    REAL(match_d2, 13.8, 1e-3, 1e6, "mahalanobis: nearer than this is a match") \
    REAL(new_d2, 40.0, 1e-3, 1e6, "mahalanobis: farther from any beacon is a new one; between: rejected") \
    INTEGER(confirm_sightings, 4, 1, 1000, "a tentative beacon is confirmed by this many sightings") \
    INTEGER(confirm_window_us, 1000000, 0, 1000000000, \
         "one not confirmed by then is removed (known data association: if contradicted); 0: none") \
    INTEGER(learn_budget, 600, 0, 1000000, "svm: pieces of training after each frame") \
    /* recovery */ \
    INTEGER(recovery, 0, 0, 1, "1: notices that the robot is lost, and finds it again (0: not)") \
    INTEGER(settled_us, 30000000, 0, 1000000000, \
         "recovery, svm: nothing new for so long: one beacon may contradict the pose (0: always)") \
    INTEGER(guard, 0, 0, 1, "1: each call checks that the memory is as the last one left it (0: not)")

/// For who knows the filter.
#define BSLAM_EXPERT(REAL, INTEGER) \
    REAL(velocity_sd_mps, 0.02, 1e-6, 100.0, "standard deviation of v at the start, at a standstill") \
    REAL(velocity_walk_mps_sqrt_s, 0.15, 0.0, 100.0, "v changes by this much in a second (random walk)") \
    REAL(path_walk_mps_sqrt_s, 0.6, 0.0, 100.0, "smoother: the same along the path where it linearises") \
    REAL(velocity_decay_s, 1e6, 1e-3, 1e6, "v decays to 0 with this time constant (1e6: not)") \
    REAL(turn_rate_sd_radps, 0.05, 1e-6, 100.0, "standard deviation of omega at the start") \
    REAL(turn_rate_walk_radps_sqrt_s, 0.8, 0.0, 100.0, "omega changes by this in a second (random walk)") \
    REAL(turn_rate_decay_s, 1e6, 1e-3, 1e6, "omega decays to 0 with this time constant (1e6: not)") \
    REAL(forward_scale, 1.0, 0.1, 10.0, \
         "true over measured forward motion, or the start value of its state") \
    REAL(turn_scale, 1.0, 0.1, 10.0, "true over measured turn, or the start value of its state") \
    REAL(scale_walk_sqrt_s, 0.002, 0.0, 1.0, "a scale factor changes by this in a second (random walk)") \
    REAL(travel_sd_per_sqrt_m, 0.0, 0.0, 10.0, "noise of a wheel's travel that grows with the travel") \
    REAL(forward_sd_per_sqrt_s, 0.0, 0.0, 10.0, \
         "noise of forward motion that grows with the time of moving") \
    REAL(turn_sd_per_sqrt_s, 0.0, 0.0, 10.0, "noise of the heading that grows with the time of moving") \
    REAL(sensor_doubt, 0.0, 0.0, 10.0, \
         "sensor's place, yaw, range scale as states: this times 7 cm, 2 deg, 5 % doubtful (0: no)") \
    INTEGER(history_steps, 1024, 1, 1024, "readings that wait for a late sighting, to BSLAM_HISTORY_MAX") \
    REAL(bearing_only_variance_factor, 3.0, 1.0, 1000.0, \
         "bearing-only: the direction's variance times this") \
    REAL(bearing_only_curvature_factor, 100.0, 0.0, 1e6, "and plus this times the curvature of the model") \
    REAL(ray_inverse_distance_per_m, 0.2, 1e-4, 100.0, "bearing-only: a new beacon's inverse distance") \
    REAL(ray_inverse_distance_sd_per_m, 0.1, 1e-4, 100.0, "its standard deviation") \
    REAL(ray_linear_limit, 0.1, 1e-4, 10.0, "a ray becomes a point when its linearity index is below this") \
    REAL(joint_sd, 3.09, 0.0, 10.0, \
         "joint: normal deviations that fit together (3.09: one in 1000 does not)") \
    INTEGER(joint_nodes, 3000, 1, 10000000, "joint: choices that are tried for at most 5 sightings") \
    REAL(confirm_travel_m, 0.0, 0.0, 100.0, "a sighting confirms only this far from the last that did") \
    REAL(confirm_d2, 1e6, 1e-3, 1e6, "one beyond this squared Mahalanobis distance counts against")
// clang-format on

/// Values of `filter`.
enum { BSLAM_FILTER_STANDARD = 0, BSLAM_FILTER_INVARIANT = 1, BSLAM_FILTER_SMOOTHER = 2 };

/// Values of `association`.
enum {
    BSLAM_ASSOCIATION_KNOWN = 0,
    BSLAM_ASSOCIATION_NEAREST = 1,
    BSLAM_ASSOCIATION_MAHALANOBIS = 2,
    BSLAM_ASSOCIATION_SVM = 3,
    BSLAM_ASSOCIATION_JOINT = 4,
    BSLAM_ASSOCIATION_POSITION = 5,
    BSLAM_ASSOCIATION_NEAREST_SAMPLE = 6,
    BSLAM_ASSOCIATION_CENTROID = 7,
    BSLAM_ASSOCIATION_BOTH = 8
};

/// Values of a signature, by which a detector tells how a thing looks.
#define BSLAM_SAMPLE_FEATURES 71
/// These and a constant: 72, a multiple of 8, as loops over a sample take it.
#define BSLAM_SAMPLE_SIZE (BSLAM_SAMPLE_FEATURES + 1)
#if BSLAM_SAMPLE_FLOAT
typedef float bslam_stored_t;
#define BSLAM_SAMPLE_UNIT 1.0f
#else
typedef int8_t bslam_stored_t;
#define BSLAM_SAMPLE_UNIT (1.0f / 127.0f)
#endif

/// A signature as classifiers keep it: each value x as the nearest whole number to x / BSLAM_SAMPLE_UNIT,
/// -127 to 127, or as it is in the double-precision build; then a 1 in the same units, the constant.
typedef struct bslam_sample {
    bslam_stored_t q[BSLAM_SAMPLE_SIZE];
} bslam_sample_t;
/// Most seeds.
#define BSLAM_SEEDS_MAX 128

#define BSLAM_SETTINGS_FIELD_REAL(name, value, low, high, meaning) bslam_real_t name;
#define BSLAM_SETTINGS_FIELD_INTEGER(name, value, low, high, meaning) int32_t name;

/// The values, one field for each line of the tables.
typedef struct bslam_settings {
    BSLAM_SETTINGS(BSLAM_SETTINGS_FIELD_REAL, BSLAM_SETTINGS_FIELD_INTEGER)
    BSLAM_EXPERT(BSLAM_SETTINGS_FIELD_REAL, BSLAM_SETTINGS_FIELD_INTEGER)
    BSLAM_TUNING(BSLAM_SETTINGS_FIELD_REAL, BSLAM_SETTINGS_FIELD_INTEGER)
    /// What classifiers start from: signatures of things that are no beacon here. They stay where they are,
    /// in flash; NULL: none.
    const bslam_sample_t *seeds;
    int32_t seed_count;
} bslam_settings_t;

/// Sets of values. The first two set every field; the others go on top of one of them.
typedef enum bslam_preset {
    BSLAM_PRESET_REAL_WHEELS = 0,  ///< encoders, of which a wheel's true speed errs; the defaults
    BSLAM_PRESET_PAPER,            ///< the paper's speedometers: the reading errs, by 0.3 m/s at each step
    BSLAM_PRESET_COMMANDED,     ///< odometry of commands, unmeasured. By `association`, `filter`: set first
    BSLAM_PRESET_CAMERA,        ///< sightings of the vision library. By `association`: set that first
    BSLAM_PRESET_BEARING_ONLY,  ///< sightings without distance. By `filter`: set that first
    BSLAM_PRESET_COUNT
} bslam_preset_t;

void bslam_settings_preset(bslam_settings_t *settings, bslam_preset_t preset);

/// One line of a table, for tools and setting servers.
typedef struct bslam_setting_info {
    const char *name;
    const char *meaning;  ///< empty without BSLAM_SETTING_MEANINGS
    const char *group;    ///< "settings", "expert" or "tuning"
    bslam_real_t initial;
    bslam_real_t low;
    bslam_real_t high;
    bool is_integer;
    uint16_t offset;  ///< of the field in bslam_settings_t: a bslam_real_t, or an int32_t
} bslam_setting_info_t;

/// Line id >= 0 of the tables one after the other; NULL behind the last one.
const bslam_setting_info_t *bslam_settings_info(int id);

/// Sets field id. BSLAM_E_PARAMETER, and no change: there is no such field, the value is outside its range,
/// or an integer has a fraction.
BSLAM_MUST_CHECK bslam_status_t bslam_settings_set(bslam_settings_t *settings, int id, bslam_real_t value);

#ifdef __cplusplus
}
#endif

#endif
