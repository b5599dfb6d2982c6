/// The pipeline: odometry and sightings in; pose, map and an account of each sighting out.
///
/// One struct an instance, owned by the caller; no heap, no global state, no output. Feed it in order of
/// time:
///
///     bslam_slam_init(&slam, &settings, &bad);
///     bslam_slam_odometry(&slam, &reading);              // each control step
///     bslam_slam_sightings(&slam, time_us, seen, count); // each image
///     bslam_slam_pose(&slam);
///
/// The filter stands at the moment that the last frame shows. Odometry since then waits, and the pose of now
/// is the filter's, carried on through it: so a frame may come late, and nothing is approximated for it. What
/// waits is BSLAM_HISTORY_MAX readings at most; then the filter goes on by one with each new reading.
///
/// The map's frame is the robot's pose at the start. On any status but BSLAM_OK nothing has changed but the
/// counters and what bslam_slam_bad_sighting answers (and the tick reference, after BSLAM_E_JUMP).
#ifndef BSLAM_SLAM_SLAM_H
#define BSLAM_SLAM_SLAM_H

#include "bslam/association/association.h"
#include "bslam/model/odometry.h"
#include "bslam/model/odometry_history.h"
#include "bslam/smoother/smoother.h"

/// All members are the pipeline's own; read them through the functions below.
typedef struct bslam_slam {
    bslam_settings_t settings;
    bslam_ekf_t ekf;
    bslam_odometry_t odometry;
    bslam_history_t history;
    uint32_t travelled_um;  ///< that the filter has gone, modulo 4.3 km
    int64_t last_frame_us;
    bool has_frame;
    bool confirmed_now;              ///< within a frame: it has confirmed a beacon
    bool measures_distance;          ///< some sighting had one
    bool is_lost;                    ///< the pose is what odometry makes of one that is unknown
    bool is_frozen;                  ///< the map: no beacon is added, learned or taken out by itself
    bslam_appearance_t *appearance;  ///< the caller's; NULL: none attached
    bslam_smoother_t *smoother;      ///< the caller's; NULL: none attached
    bslam_slam_counters_t counters;
    bslam_account_t accounts[BSLAM_SIGHTINGS_MAX];
    int32_t account_count;
    int32_t bad_sighting;  ///< place of the sighting for which the last frame was refused, else -1
    // Scratch: holds nothing between calls.
    bslam_record_t records[BSLAM_SIGHTINGS_MAX];
} bslam_slam_t;

/// Whether it learns appearance, and whether a smoother leads it: constants of the build where it has none,
/// so that a linker leaves out what is never called.
static inline bool bslam_slam_learns(const bslam_slam_t *slam)
{
    return BSLAM_APPEARANCE != 0 && slam->appearance != NULL;
}

static inline bool bslam_slam_smooths(const bslam_slam_t *slam)
{
    return BSLAM_SMOOTHER != 0 && slam->smoother != NULL;
}

/// Robot at the origin, empty map. settings is copied. BSLAM_E_PARAMETER with *bad_id, see
/// bslam_settings_check: then *slam is unchanged.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_init(bslam_slam_t *slam, const bslam_settings_t *settings,
                                                int *bad_id);

/// From now on the pipeline learns what beacons look like, and association 3 decides by it. *looks has been
/// through bslam_appearance_init and stays the caller's; it serves one pipeline, and forgets what it knew of
/// another map. NULL: looks are not used any more. bslam_slam_init detaches.
void bslam_slam_attach_appearance(bslam_slam_t *slam, bslam_appearance_t *appearance);

/// From now on the filter is led through the last drive again and again (smoother/smoother.h), if the
/// parameter `filter` says so; without a smoother it is the invariant one. *smoother stays the caller's and
/// serves one pipeline. NULL: no more. bslam_slam_init detaches.
void bslam_slam_attach_smoother(bslam_slam_t *slam, bslam_smoother_t *smoother);

/// One odometry reading, which waits until a frame shows a later moment. BSLAM_E_TIME, BSLAM_E_NOT_FINITE,
/// BSLAM_E_RANGE, BSLAM_E_JUMP as bslam_odometry_read has them; BSLAM_E_SINGULAR as bslam_ekf_check_motion
/// has it. O(1); where no more may wait one prediction, O(n), or O(n²) with velocity states.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_odometry(bslam_slam_t *slam,
                                                    const bslam_odometry_reading_t *reading);

/// After an interruption of odometry (an encoder reset, a pause of more than 4 s, the robot carried), at a
/// standstill: the next reading starts the clock and the tick reference anew, at any time stamp, and the pose
/// becomes as doubtful as the caller says the robot may have moved unseen. BSLAM_E_RANGE: position_sd_m
/// outside 0 to 30 or heading_sd_rad outside 0 to 3.2 (NaN is). Predicts through all that waits.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_resume_odometry(bslam_slam_t *slam, bslam_real_t position_sd_m,
                                                           bslam_real_t heading_sd_rad);

/// Puts the robot somewhere in the map, as of the last frame, this doubtful: at a charging station, in a kept
/// map, found again (recovery/recovery.h). The map stays as it is, odometry that waits is gone through from
/// there. BSLAM_E_NOT_FINITE; BSLAM_E_RANGE: position_sd_m outside 0 to 30 or heading_sd_rad outside 0
/// to 3.2.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_set_pose(bslam_slam_t *slam, const bslam_pose_t *pose,
                                                    bslam_real_t position_sd_m, bslam_real_t heading_sd_rad);

/// Nobody knows where the robot is. Its pose goes on from the present one by odometry alone, its covariance
/// says 30 m and 3.2 rad, sightings are accounted for as "lost" and used for nothing, and the map stays as it
/// is, until bslam_slam_set_pose.
void bslam_slam_lose_pose(bslam_slam_t *slam);

/// What one image shows, stamped time_us. Associates, fuses, adds, removes; the account of sighting i is
/// bslam_slam_accounts()[i]. An empty frame is fine. O(count n²), after a prediction for each reading that
/// waited up to then: BSLAM_HISTORY_MAX of O(n), or of O(n²) with velocity states, after a long time without
/// a frame. Before the first odometry only frames within ahead_max_us of the first one are taken.
/// BSLAM_E_COUNT: more than BSLAM_SIGHTINGS_MAX. BSLAM_E_TIME: not after the last frame, older than where the
/// filter stands, or newer than the odometry by more than ahead_max_us. BSLAM_E_NOT_FINITE, BSLAM_E_RANGE (a
/// distance or its noise outside 1 mm to 10 km, a direction beyond ±2 pi or its noise outside 1e-5 to pi, a
/// label below -1): bslam_slam_bad_sighting says which. Signatures need not outlive the call.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_sightings(bslam_slam_t *slam, int64_t time_us,
                                                     const bslam_sighting_t *sightings, int count);

/// Gives a beacon with a known place: localisation in a known map, paper equation (12). It never changes.
/// BSLAM_E_NOT_FINITE, BSLAM_E_RANGE (a label below 0), BSLAM_E_DUPLICATE, BSLAM_E_MAP_FULL.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_add_known_beacon(bslam_slam_t *slam, int32_t label,
                                                            bslam_real_t x_m, bslam_real_t y_m);

/// Takes a beacon out of the map. BSLAM_E_NO_BEACON.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_remove_beacon(bslam_slam_t *slam, uint32_t uid);

/// Takes all beacons out, with what is known of their looks; the map is no longer frozen.
void bslam_slam_forget_map(bslam_slam_t *slam);

// ---- results ----------------------------------------------------------------------------------------------

/// Where the newest odometry has the robot. O(readings that wait), like the two below.
bslam_pose_t bslam_slam_pose(const bslam_slam_t *slam);

/// The robot's pose at a time within the last BSLAM_HISTORY_MAX readings, or up to ahead_max_us after them,
/// from the present estimate. BSLAM_E_TIME: outside that; *pose is unchanged.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_pose_at(const bslam_slam_t *slam, int64_t time_us,
                                                   bslam_pose_t *pose);

/// Covariance of that pose (x, y, theta): the lower triangle xx, yx, yy, tx, ty, tt in m², m rad, rad².
void bslam_slam_pose_covariance(const bslam_slam_t *slam, bslam_real_t lower[6]);

/// The accounts of the last frame taken, one a sighting.
const bslam_account_t *bslam_slam_accounts(const bslam_slam_t *slam, int *count);

/// Which sighting the last refused frame was refused for; -1: none in particular.
int bslam_slam_bad_sighting(const bslam_slam_t *slam);

const bslam_slam_counters_t *bslam_slam_counters(const bslam_slam_t *slam);

/// Beacons in the map, provisional ones included.
int bslam_slam_beacon_count(const bslam_slam_t *slam);

/// Beacon 0 <= index < bslam_slam_beacon_count(). BSLAM_E_NO_BEACON otherwise.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_beacon(const bslam_slam_t *slam, int index,
                                                  bslam_beacon_view_t *view);

#endif
