/// bslam: simultaneous localisation and mapping with beacons, in fixed memory. This header is its whole API.
///
///     static bslam_t robot;                                     // all the memory there is
///     bslam_settings_t settings;
///     bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
///     bslam_init(&robot, &settings, &bad_setting);
///     bslam_odometry(&robot, &reading);                         // each control step
///     bslam_sightings(&robot, time_us, seen, count);            // each image
///     bslam_pose(&robot);
///
/// Odometry comes in the order of time; frames of one camera or several may be late by BSLAM_HISTORY_MAX
/// readings. The filter stands at the moment that the newest frame shows. Odometry since then waits, and the
/// pose of now is the filter's, carried on through it. So nothing is approximated for a late frame; for one
/// that is older than a frame before it, the noise of the way between counts as its own.
///
/// The map's frame is the robot's pose at the start: x forward, y left, SI units, angles in (-pi, pi].
///
/// Every instance is its caller's: no heap, no global state, no output. It must not be entered twice at a
/// time, moved or copied. A pointer may be NULL only where a comment says so. On any status but BSLAM_OK the
/// instance is as it was, to the bit, but for its counters, its health, and what it holds against refused
/// stamps and tick counts. Costs are in the number n of state values: 5 for the robot, 2 a beacon, up to 2
/// more a ray.
#ifndef BSLAM_H
#define BSLAM_H

#include <stddef.h>

#include "bslam/size.h"
#include "bslam/settings.h"
#include "base/status.h"
#include "base/types.h"

#define BSLAM_VERSION_MAJOR 0
#define BSLAM_VERSION_MINOR 2
#define BSLAM_VERSION_PATCH 0

#ifdef __cplusplus
extern "C" {
#endif

/// One estimator. What stands in it is the library's own.
typedef union bslam {
    unsigned char bytes[BSLAM_BYTES];
    int64_t alignment_of_times;
    bslam_real_t alignment_of_numbers;
    void *alignment_of_pointers;
} bslam_t;

// ---- beginning --------------------------------------------------------------------------------------------

/// Robot at the origin, empty map. The settings are copied. In zeroed memory, as static is, each call
/// until it succeeds answers BSLAM_E_STATE; those that only read check nothing. BSLAM_E_PARAMETER:
/// *bad_setting is the first setting outside its range, or that contradicts another (bslam_settings_info);
/// else it becomes -1. BSLAM_E_SIZE: library and this file were compiled with other sizes (config.h); *robot
/// is not written, and must not be used. BSLAM_E_COUNT: more seeds than BSLAM_SEEDS_MAX. O(memory).
#define bslam_init(robot, settings, bad_setting) \
    bslam_init_sized((robot), sizeof *(robot), BSLAM_SIZES_HASH, (settings), (bad_setting))
#if BSLAM_REAL_DOUBLE
#define bslam_init_sized bslam_init_double  // library and application of two scalar types do not link
#endif
BSLAM_MUST_CHECK bslam_status_t bslam_init_sized(bslam_t *robot, size_t robot_bytes, uint32_t sizes_hash,
                                                 const bslam_settings_t *settings, int *bad_setting);

/// With the setting `guard`, after a reset that the memory outlasted, or BSLAM_E_STATE: goes on with the
/// state if it is as the last call left it, else with the copy that BSLAM_GUARD = 2 keeps. The next odometry
/// reading starts the clock anew, at any time stamp. The pose becomes as doubtful as bslam_resume_odometry
/// has it, in the same ranges. BSLAM_E_STATE: no such state; nothing has changed: bslam_init. O(n²).
BSLAM_MUST_CHECK bslam_status_t bslam_restart(bslam_t *robot, bslam_real_t position_sd_m,
                                              bslam_real_t heading_sd_rad);

// ---- what the robot measures ------------------------------------------------------------------------------

typedef enum bslam_odometry_source {
    BSLAM_ODOMETRY_WHEELS = 0,  ///< left_m, right_m: travel of each wheel since the reading before
    BSLAM_ODOMETRY_TICKS,    ///< left_ticks, right_ticks: the counters, which roll over as the settings say
    BSLAM_ODOMETRY_VELOCITY  ///< v_mps, omega_radps: held over the interval that ends at time_us
} bslam_odometry_source_t;

/// One reading. Only the source's own fields are read.
typedef struct bslam_odometry_reading {
    int64_t time_us;  ///< end of the interval
    bslam_odometry_source_t source;
    uint32_t left_ticks;
    uint32_t right_ticks;
    bslam_real_t left_m;
    bslam_real_t right_m;
    bslam_real_t v_mps;
    bslam_real_t omega_radps;
    bool has_gyro;
    bslam_real_t gyro_radps;     ///< mean turn rate over the interval; read only if has_gyro
    bslam_real_t gyro_sd_radps;  ///< noise of this one; 0: the setting gyro_sd_radps
} bslam_odometry_reading_t;

/// One odometry reading, which waits until a frame shows a later moment. O(1); where no more may wait one
/// prediction, O(n). BSLAM_E_NOT_FINITE. BSLAM_E_RANGE: a count that the counters do not have, a gyro turn
/// beyond 100 rad, or an unknown source. BSLAM_E_SINGULAR: velocity states without noise.
///
/// BSLAM_E_TIME: the time is negative, does not advance, or jumps by more than 4 s. Where readings follow one
/// another for 1 s elsewhere in time, the clock began again: counted, goes on as after bslam_resume_odometry,
/// as doubtful as a gap of that length.
///
/// BSLAM_E_JUMP: a wheel faster than speed_max_mps. The next count that goes with those before tells all the
/// way. A third that goes with the odd one says that the counters began anew there: the time before is a gap.
BSLAM_MUST_CHECK bslam_status_t bslam_odometry(bslam_t *robot, const bslam_odometry_reading_t *reading);

/// After an interruption of odometry, at a standstill: an encoder reset, a pause of more than 4 s, a robot
/// that was pushed. The next reading starts the clock and the tick reference anew, at any time stamp; give no
/// frame of before. The pose becomes as doubtful as the robot may have moved unseen. BSLAM_E_RANGE:
/// position_sd_m outside 0 to 30 or heading_sd_rad outside 0 to 3.2 (NaN is).
BSLAM_MUST_CHECK bslam_status_t bslam_resume_odometry(bslam_t *robot, bslam_real_t position_sd_m,
                                                      bslam_real_t heading_sd_rad);

/// What one image shows (bslam_sighting_t: base/types.h), stamped time_us. Associates, fuses, adds beacons
/// and removes them; bslam_results tells what became of each. An empty frame (NULL, 0) is fine, so are
/// several of one moment, and any order. Of sightings with one label the best is used. O(count n²), after a
/// prediction for each reading that waited. BSLAM_E_COUNT: more than BSLAM_SIGHTINGS_MAX. BSLAM_E_TIME:
/// older than BSLAM_HISTORY_MAX readings, newer than odometry by more than ahead_max_us, or one of the last
/// BSLAM_HISTORY_MAX frames again. BSLAM_E_NOT_FINITE. BSLAM_E_RANGE: a distance or its noise outside 1 mm
/// to 10 km, a direction beyond +-2 pi or its noise outside 1e-5 to pi, a label below -1. bslam_health says
/// which sighting.
BSLAM_MUST_CHECK bslam_status_t bslam_sightings(bslam_t *robot, int64_t time_us,
                                                const bslam_sighting_t *sightings, int count);

// ---- what it says of the robot ----------------------------------------------------------------------------

/// Where the newest odometry has the robot. O(readings that wait), like the two below.
bslam_pose_t bslam_pose(const bslam_t *robot);

/// The pose at a time within the last BSLAM_HISTORY_MAX readings, or up to ahead_max_us after them, from the
/// present estimate. BSLAM_E_TIME: outside that; *pose is unchanged.
BSLAM_MUST_CHECK bslam_status_t bslam_pose_at(const bslam_t *robot, int64_t time_us, bslam_pose_t *pose);

/// Covariance of bslam_pose (x, y, theta), lower triangle: xx, yx, yy, tx, ty, tt in m², m rad, rad².
void bslam_pose_covariance(const bslam_t *robot, bslam_real_t lower[6]);

typedef enum bslam_recovery_state {
    BSLAM_RECOVERY_FOLLOWING = 0,  ///< all is well
    BSLAM_RECOVERY_DOUBTING,       ///< sightings contradict the pose, or may show one beacon or another
    BSLAM_RECOVERY_LOST            ///< the pose is unknown
} bslam_recovery_state_t;

typedef struct bslam_health {
    bslam_recovery_state_t state;
    bool is_frozen;          ///< the map: no beacon is added, learned or taken out by itself
    int32_t beacons;         ///< in the map, tentative ones included
    int32_t bad_sighting;    ///< for which the last frame was refused; -1: none in particular
    int32_t hypotheses;      ///< of which beacons were seen: 1, or more while that is in doubt
    bslam_real_t lead_nats;  ///< log odds of the one in force against the next best, which may be below 0; 0
                             ///< where there is no other
} bslam_health_t;

/// How the robot is doing. O(1).
bslam_health_t bslam_health(const bslam_t *robot);

/// Where a chain of fingerprints starts.
#define BSLAM_FINGERPRINT_START 0xcbf29ce484222325u

/// Goes on with a hash of the whole state: two robots with the same inputs have the same. O(n²).
uint64_t bslam_fingerprint(const bslam_t *robot, uint64_t before);

// ---- what became of the sightings -------------------------------------------------------------------------

typedef enum bslam_outcome {
    BSLAM_OUTCOME_REJECTED = 0,
    BSLAM_OUTCOME_MATCHED,
    BSLAM_OUTCOME_NEW,
    BSLAM_OUTCOME_DEFERRED
} bslam_outcome_t;

/// Why a sighting was not used.
typedef enum bslam_reason {
    BSLAM_REASON_NONE = 0,
    BSLAM_REASON_CLASS,        ///< its class is BSLAM_CLASS_NOT_MAPPABLE
    BSLAM_REASON_NO_IDENTITY,  ///< known data association: it has no label
    BSLAM_REASON_DUPLICATE,    ///< a better sighting of this frame shows the same beacon
    BSLAM_REASON_AMBIGUOUS,    ///< not near enough to a beacon to match nor far enough to be new, or delayed
    BSLAM_REASON_APPEARANCE,   ///< a known beacon or a new one: in doubt, and no hypothesis is free
    BSLAM_REASON_GATE,         ///< its innovation is outside the gate
    BSLAM_REASON_MAP_FULL,     ///< it is new, and there is no room: see BSLAM_PLACE_MAX_M, too
    BSLAM_REASON_SINGULAR,     ///< the beacon stands at the sensor, or S is not positive definite
    BSLAM_REASON_FROZEN,       ///< it is new, and the map is frozen
    BSLAM_REASON_LOST,         ///< it contradicts the robot's pose, or the pose is unknown
    BSLAM_REASON_TENTATIVE,    ///< it shows a beacon that may be none, as far as the detector's scores tell
    BSLAM_REASON_COUNT
} bslam_reason_t;

/// What became of a sighting, and why.
typedef struct bslam_account {
    bslam_outcome_t outcome;
    bslam_reason_t reason;  ///< BSLAM_REASON_NONE if it was used
    bool has_beacon;        ///< beacon_uid is set: of the beacon it was matched with, started, or was gated
                            ///< against
    uint32_t beacon_uid;
    bslam_real_t test_ratio;  ///< squared Mahalanobis distance over the gate's; negative: not computed
    bslam_real_t weight;      ///< 1 for full weight, 0 for not used
} bslam_account_t;

/// Of the last frame taken, one a sighting, in its order.
const bslam_account_t *bslam_results(const bslam_t *robot, int *count);

/// Never-decreasing counts of what happened to readings, frames and sightings.
typedef struct bslam_slam_counters {
    uint32_t odometry;          ///< readings taken
    uint32_t odometry_refused;  ///< readings refused, any status
    uint32_t jumps;             ///< of these, BSLAM_E_JUMP
    uint32_t clock_restarts;    ///< times that the clock began again without bslam_resume_odometry
    uint32_t frames;            ///< frames taken
    uint32_t frames_refused;    ///< frames refused, any status
    uint32_t sightings;         ///< in the frames taken
    uint32_t matched;           ///< fused with a beacon of the map
    uint32_t down_weighted;     ///< of these, with less than full weight (Huber)
    uint32_t added;             ///< started a beacon
    uint32_t rejected;          ///< not used, any reason
    uint32_t gated;             ///< of these, outside the gate
    uint32_t map_full;          ///< of these, new without room
    uint32_t duplicates;        ///< of these, a second sighting of one beacon in a frame
    uint32_t unidentified;      ///< of these, without a label under known data association
    uint32_t unmappable;        ///< of these, of a class that is not mappable
    uint32_t deferred;          ///< left undecided, or of a tentative beacon
    uint32_t removed;           ///< tentative beacons taken out
    uint32_t retired;           ///< beacons taken out because another was in the same place
    uint32_t settled;           ///< rays that became points
    uint32_t frozen;            ///< of the rejected, new in a frozen map
    uint32_t insane;  ///< times the state was found not finite or with a negative variance: must stay 0
} bslam_slam_counters_t;

typedef struct bslam_recovery_counters {
    uint32_t contradicting;  ///< sightings
    uint32_t withheld;       ///< frames that were not used
    uint32_t lost;           ///< times
    uint32_t found;          ///< times
} bslam_recovery_counters_t;

typedef struct bslam_guard_counters {
    uint32_t corrupt;   ///< checks that found the state changed
    uint32_t restored;  ///< times that the copy took its place
} bslam_guard_counters_t;

typedef struct bslam_appearance_counters {
    uint32_t trained;  ///< sightings that a classifier was trained with
    uint32_t unsure;   ///< matches that none was trained with, because they may be wrong
    uint32_t shared;   ///< times that a beacon was found to look like another and took its classifier
    uint32_t missed;   ///< beacons taken out because they were missed from where they had been seen
    uint32_t parted;   ///< times that a beacon got a classifier of its own again
    uint32_t no_slot;  ///< beacons that got no classifier when they were first seen: none was free
} bslam_appearance_counters_t;

typedef struct bslam_learner_counters {
    uint32_t kept;         ///< samples
    uint32_t dropped;      ///< samples that the full store of a classifier has no use for
    uint32_t updates;      ///< trainings finished
    uint32_t steps;        ///< dual steps
    uint32_t capped;       ///< of the trainings, ended by their limit of steps
    uint32_t interrupted;  ///< trainings put off because a sample they use changed, or a negative came
    uint32_t refused_not_finite;
    uint32_t refused_no_machine;
    uint32_t refused_full;
} bslam_learner_counters_t;

typedef struct bslam_counters {
    bslam_slam_counters_t slam;
    bslam_recovery_counters_t recovery;
    bslam_guard_counters_t guard;
    bslam_appearance_counters_t appearance;
    bslam_learner_counters_t learner;
} bslam_counters_t;

/// All of them; those of what is switched off are 0.
bslam_counters_t bslam_counters(const bslam_t *robot);

// ---- the map ----------------------------------------------------------------------------------------------

typedef enum bslam_beacon_kind {
    BSLAM_BEACON_POINT = 0,  ///< 2 state values: x, y in the map
    BSLAM_BEACON_RAY = 1,    ///< 4 state values: anchor x, y, direction, inverse distance
    BSLAM_BEACON_KNOWN = 2,  ///< no state value: its position is given, paper equation (12)
    BSLAM_BEACON_SIZED = 3   ///< 3 state values: x, y, and its scale, by which its distances are too long
} bslam_beacon_kind_t;

/// A beacon (the field's landmark) as the map has it since the last frame.
typedef struct bslam_beacon_view {
    uint32_t uid;  ///< its number: none is used twice. After 2^32 - 1 of them the map is full
    int32_t label;
    bslam_beacon_kind_t kind;
    bool confirmed;
    uint8_t beacon_class;
    uint32_t sightings;
    bslam_real_t x_m;
    bslam_real_t y_m;
    bslam_sym2_t covariance_m2;
    bslam_real_t range_m;  ///< polar, from the start, as the paper's state vector has it
    bslam_real_t phi_rad;
} bslam_beacon_view_t;

/// Beacon 0 <= index < bslam_health().beacons. BSLAM_E_NO_BEACON otherwise.
BSLAM_MUST_CHECK bslam_status_t bslam_beacon(const bslam_t *robot, int index, bslam_beacon_view_t *view);

/// From the origin in x and in y: a pose that is set, and a beacon. Float32 rounds to 0.06 mm at 1 km, a
/// sixteenth of the least noise of a distance, and to 1 mm at 10 km. Give far places from one near by.
#define BSLAM_POSE_MAX_M BSLAM_R(1000.0)
#define BSLAM_PLACE_MAX_M BSLAM_R(10000.0)

/// Gives a beacon with a known place, which never changes: localisation in a known map. BSLAM_E_NOT_FINITE,
/// BSLAM_E_RANGE (a label below 0, beyond BSLAM_PLACE_MAX_M), BSLAM_E_DUPLICATE, BSLAM_E_MAP_FULL.
BSLAM_MUST_CHECK bslam_status_t bslam_add_known_beacon(bslam_t *robot, int32_t label, bslam_real_t x_m,
                                                       bslam_real_t y_m);

/// Of bslam_remove_beacon: all of them, with what is known of their appearance; the map is no longer frozen.
#define BSLAM_ALL_BEACONS UINT32_MAX

/// Takes a beacon out of the map. BSLAM_E_NO_BEACON. O(n²).
BSLAM_MUST_CHECK bslam_status_t bslam_remove_beacon(bslam_t *robot, uint32_t uid);

/// Frozen: no beacon is added, learned or taken out by itself. A map that is loaded then stays as it is: its
/// beacons become known ones, which never change.
void bslam_freeze_map(bslam_t *robot, bool is_frozen);

/// Puts the robot somewhere in the map, as of the last frame, this doubtful: at a charging station, say.
/// Odometry that waits is gone through from there. pose NULL: nobody knows where the robot is. Its pose then
/// goes on by odometry alone, sightings are accounted for as "lost", and the map stays as it is, until it is
/// put somewhere or, with the setting `recovery`, finds itself. BSLAM_E_NOT_FINITE. BSLAM_E_RANGE: beyond
/// BSLAM_POSE_MAX_M or 100 rad, position_sd_m outside 0 to 30 or heading_sd_rad outside 0 to 3.2.
BSLAM_MUST_CHECK bslam_status_t bslam_set_pose(bslam_t *robot, const bslam_pose_t *pose,
                                               bslam_real_t position_sd_m, bslam_real_t heading_sd_rad);

// ---- keeping the map: docs/MAP.md has every byte ----------------------------------------------------------

/// Why a stored map is refused.
typedef enum bslam_map_fault {
    BSLAM_MAP_FINE = 0,
    BSLAM_MAP_TRUNCATED,   ///< fewer bytes than it says of itself, or than a header has
    BSLAM_MAP_TOO_LONG,    ///< more bytes than it says of itself
    BSLAM_MAP_NO_MAP,      ///< it does not begin as a map does
    BSLAM_MAP_BYTE_ORDER,  ///< written high byte first
    BSLAM_MAP_OTHER_VERSION,
    BSLAM_MAP_BAD_CRC,
    BSLAM_MAP_BEACONS,      ///< more beacons, or rays, than this build holds
    BSLAM_MAP_CLASSIFIERS,  ///< classifiers, samples or negatives beyond what this build holds
    BSLAM_MAP_NOT_FINITE,   ///< a NaN, an infinity, or beyond 1e12; 1e18 in a factor
    BSLAM_MAP_CONTENT,      ///< a field that contradicts others, or outside its range: a place beyond 20 km
    BSLAM_MAP_COVARIANCE,   ///< a D below 0 in its factor, or a variance beyond 1e12
    BSLAM_MAP_UNREADABLE,   ///< the source cannot be read, or reads otherwise than before; the sink fails
    BSLAM_MAP_FAULT_COUNT
} bslam_map_fault_t;

/// Where the bytes of a map come from: copies `count` bytes from place `at` on. False: it cannot.
typedef struct bslam_map_source {
    bool (*read)(const void *context, uint32_t at, void *bytes, uint32_t count);
    const void *context;
    uint32_t size;  ///< bytes there are
} bslam_map_source_t;

/// Where they go, one piece after the other. False: it cannot.
typedef struct bslam_map_sink {
    bool (*write)(void *context, const void *bytes, uint32_t count);
    void *context;
} bslam_map_sink_t;

/// Writes the confirmed beacons, their covariance and their classifiers. sink NULL: only counts. *bytes is
/// how many there are. BSLAM_E_MAP: the sink failed, or a number is beyond 1e12. O(n² + samples), twice.
BSLAM_MUST_CHECK bslam_status_t bslam_save_map(bslam_t *robot, const bslam_map_sink_t *sink, uint32_t *bytes);

/// Takes a stored map in place of the robot's own; the robot does not know where it is in it (bslam_set_pose,
/// or the setting `recovery`). Settings, clock and counters stay, and no uid that the robot or the map had
/// is given again. The same bytes load into builds of other sizes where there is room. BSLAM_E_MAP with
/// *fault: refused, and nothing has changed; but if a source that was whole when it was checked reads
/// otherwise later, there is no map. O(n³ / 6 + samples).
BSLAM_MUST_CHECK bslam_status_t bslam_load_map(bslam_t *robot, const bslam_map_source_t *source,
                                               bslam_map_fault_t *fault);

/// Written at once, at a multiple of it, from memory aligned to 8, and once between two erases: flash takes
/// that whose word is any divisor of it, 1 to 64 bytes.
#define BSLAM_FLASH_PIECE 64
/// Areas of a bslam_flash_t.
#define BSLAM_SLOTS 2

/// What a board gives to keep a map over a power cut: two areas, each erased as a whole (to 0xff, or 0), of
/// which one always holds a whole map. False: it failed.
typedef struct bslam_flash {
    bool (*erase)(void *context, int slot);
    bool (*write)(void *context, int slot, uint32_t at, const void *bytes, uint32_t count);
    bool (*read)(void *context, int slot, uint32_t at, void *bytes, uint32_t count);
    void *context;
    uint32_t slot_bytes;  ///< of each area: a map takes a piece, and what bslam_save_map counts in whole ones
} bslam_flash_t;

/// Saves the map in the slot that is older or damaged, and reads it back. BSLAM_E_MAP with *fault: the flash
/// failed, or the map is larger than a slot; the map saved before is still there.
BSLAM_MUST_CHECK bslam_status_t bslam_save_to_flash(bslam_t *robot, const bslam_flash_t *flash,
                                                    bslam_map_fault_t *fault);

/// bslam_load_map of the newest map that it takes. BSLAM_E_MAP: there is none.
BSLAM_MUST_CHECK bslam_status_t bslam_load_from_flash(bslam_t *robot, const bslam_flash_t *flash,
                                                      bslam_map_fault_t *fault);

#ifdef __cplusplus
}
#endif

#endif
