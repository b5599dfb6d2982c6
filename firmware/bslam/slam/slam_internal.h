/// What the files of this directory call of each other.
#ifndef BSLAM_SLAM_SLAM_INTERNAL_H
#define BSLAM_SLAM_SLAM_INTERNAL_H

#include "base/scalar.h"
#include "bslam/slam/slam.h"

// ---- odometry_queue.c: odometry waits until a frame shows what comes after it -----------------------------

/// bslam_slam_odometry, but for the counters and a clock that begins again.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_queue_odometry(bslam_slam_t *slam,
                                                          const bslam_odometry_reading_t *reading);

/// The filter goes on to the moment until_us before the newest odometry.
void bslam_slam_predict_until(bslam_slam_t *slam, int64_t until_us);

/// How long before the newest odometry a moment is; 0 while no clock has started.
int64_t bslam_slam_behind_us(const bslam_slam_t *slam, int64_t time_us);

/// The robot of a moment that the filter has not passed, as it goes there from where it is known.
bslam_robot_t bslam_slam_robot_at(const bslam_slam_t *slam, int64_t behind_us, bslam_pose_t *pose);

// ---- frame_check.c ----------------------------------------------------------------------------------------

/// Checks a frame, and says how long before the newest odometry it was taken. The statuses of
/// bslam_slam_sightings; bad_sighting is noted, nothing else changes.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_check_frame(bslam_slam_t *slam, int64_t time_us,
                                                       const bslam_sighting_t *sightings, int count,
                                                       int64_t *behind_us);

/// Remembers a frame that is taken: it is refused when it comes again.
void bslam_slam_note_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings, int count);

// ---- confirmation.c ---------------------------------------------------------------------------------------

/// A beacon that a sighting has just started: what that says for it.
void bslam_slam_confirm_new(bslam_slam_t *slam, bslam_beacon_t *beacon, const bslam_sighting_t *sighting);

/// One that was glimpsed, not seen for long enough, and comes again after a while has all to prove anew: else
/// an accident would confirm it. Before it is noted that it is seen. False: it is not such a one.
bool bslam_slam_confirm_again(const bslam_slam_t *slam, bslam_beacon_t *beacon, int64_t time_us);

/// A sighting was matched with it, at this squared Mahalanobis distance: it may be confirmed by that.
void bslam_slam_confirm_match(bslam_slam_t *slam, bslam_beacon_t *beacon, const bslam_sighting_t *sighting,
                              bslam_real_t distance2);

/// Notes whether the sensor measures distances. Matches with tentative beacons, and new ones that would be
/// refuted at once, become BSLAM_VERDICT_TENTATIVE. Before anything of the frame is used: its order does not
/// matter.
void bslam_slam_mark_tentative(bslam_slam_t *slam, int count);

// ---- misfit.c ---------------------------------------------------------------------------------------------

/// How well the sightings of a frame fit that were just fused or rejected. Once a frame, before the mean
/// moves.
void bslam_slam_note_misfit(bslam_slam_t *slam, int count);

/// Whether a beacon's sightings are used beyond their gate: of late so much was beyond it that the pose errs.
bool bslam_slam_opens_gate(const bslam_slam_t *slam, const bslam_beacon_t *beacon);

/// Raises the noise of a motion while sightings do not fit, as a misfit says: wheels that slip say nothing of
/// it.
void bslam_slam_doubt_motion(bslam_real_t misfit, bslam_real_t unseen_s, bslam_motion_t *motion);

// ---- coloured_noise.c -------------------------------------------------------------------------------------

/// Notes how much errors of late were those of the sightings before, and raises the noise of a frame's
/// matches by that, if `correlation_m` asks for it. Once a frame, behind their innovations.
void bslam_slam_doubt_sightings(bslam_slam_t *slam, int count);

/// What part of its evidence a sighting brings, since errors hang together. 1: all.
bslam_real_t bslam_slam_evidence_share(const bslam_slam_t *slam);

// ---- beacon_scale.c ---------------------------------------------------------------------------------------

/// A beacon whose place came of directions has a scale from its first sighting with a distance on. True: the
/// distance is used up, it says where on a ray the beacon is. Before any innovation is taken. O(n²).
bool bslam_slam_begin_scale(bslam_slam_t *slam, const bslam_pose_t *mount, int index,
                            const bslam_sighting_t *sighting);

/// Whether a matched sighting's distance counts. One that does not fit where the direction does counts
/// against the beacon's size; where most of late did not fit, the size is forgotten. Before any innovation is
/// taken. O(n²).
bool bslam_slam_vote_distance(bslam_slam_t *slam, const bslam_pose_t *mount, int index,
                              const bslam_sighting_t *sighting);

/// What a fused sighting says for the beacon's class. With another class goes another scale. O(n²).
void bslam_slam_vote_class(bslam_slam_t *slam, int index, const bslam_sighting_t *sighting);

// ---- frame.c: a frame as one hypothesis takes it ----------------------------------------------------------

/// From where a frame was taken, as the filter has it that uses the frame.
typedef struct bslam_vantage {
    bslam_pose_t mount;  ///< the sensor, from the robot where the filter stands
    int64_t moment_us;   ///< in the pipeline's own time, which never goes back
    bool is_elsewhere;   ///< the frame is older than the filter, or newer than odometry
    bslam_real_t position_var_m2, heading_var_rad2;  ///< of the way since, where the frame is older
} bslam_vantage_t;

/// A beacon that was not seen for so long comes into view anew.
#define BSLAM_VIEW_US 1000000

/// By how much another frame moves what appearance says of a view: the mean of its first frames' log odds.
bslam_real_t bslam_slam_view_gain(const bslam_beacon_appearance_t *of, bslam_real_t looks);

/// Decides which beacons a frame's sightings show, but for what is barred; NULL: nothing is.
void bslam_slam_associate(bslam_slam_t *slam, const bslam_vantage_t *vantage,
                          const bslam_sighting_t *sightings, int count, const bslam_bar_t *bar);

/// Fuses what was associated and adds beacons: all of a frame but learning and tidying.
void bslam_slam_use_associated(bslam_slam_t *slam, const bslam_vantage_t *vantage, int count);

/// Fills in what became of a sighting that is not fused, yet; beacon NULL: none.
void bslam_slam_fill_account(bslam_account_t *account, bslam_outcome_t outcome, bslam_reason_t reason,
                             const bslam_beacon_t *beacon);

/// Whether a sighting counted for a tentative beacon, and for no more.
bool bslam_slam_was_tentative(const bslam_account_t *account);

/// Of two beacons in one place one leaves. Rays whose distance is known become points; tentative beacons
/// whose time is up leave.
void bslam_slam_tidy_map(bslam_slam_t *slam, const bslam_vantage_t *vantage);

// ---- doubt.c ----------------------------------------------------------------------------------------------

/// Before a frame: the hypothesis that explains most is in force from now on, and what is too far behind or
/// old is forgotten.
void bslam_slam_settle_doubts(bslam_slam_t *slam, int64_t time_us);

/// The others go through a motion that the one in force went through.
void bslam_slam_predict_others(bslam_slam_t *slam, const bslam_motion_t *motion);

// ---- step.c: the two halves of bslam_slam_sightings, for who judges a frame first ------------------------

/// Checks a frame and takes the filter to its moment, if it is not there yet. After BSLAM_OK
/// bslam_slam_close_frame must follow with the same frame.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_open_frame(bslam_slam_t *slam, int64_t time_us,
                                                      const bslam_sighting_t *sightings, int count,
                                                      bslam_vantage_t *vantage);

/// Works the frame off. If it is not to be used, it leaves what one without sightings does, but for the
/// accounts; where the robot is lost, the map stays as it is.
void bslam_slam_close_frame(bslam_slam_t *slam, const bslam_vantage_t *vantage,
                            const bslam_sighting_t *sightings, int count, bool use);

// ---- slam.c -----------------------------------------------------------------------------------------------

/// The largest doubts of a pose.
#define BSLAM_POSITION_SD_MAX_M BSLAM_R(30.0)
#define BSLAM_HEADING_SD_MAX_RAD BSLAM_R(3.2)

/// Whether the doubts of a pose are within 0 and these.
bool bslam_slam_are_doubts(bslam_real_t position_sd_m, bslam_real_t heading_sd_rad);

/// Where a beacon is in the map, or -1.
int bslam_slam_find_beacon(const bslam_slam_t *slam, uint32_t uid);

/// Whether the map reaches to a place.
static inline bool bslam_slam_reaches(bslam_real_t x_m, bslam_real_t y_m)
{
    return bslam_in_range(x_m, -BSLAM_PLACE_MAX_M, BSLAM_PLACE_MAX_M) &&
           bslam_in_range(y_m, -BSLAM_PLACE_MAX_M, BSLAM_PLACE_MAX_M);
}

/// Whether a uid is left for one more beacon.
static inline bool bslam_slam_has_uid(const bslam_slam_t *slam)
{
    return slam->ekf.next_uid != BSLAM_ALL_BEACONS;
}

/// Takes a beacon out of the map, and what is known of its appearance with it.
void bslam_slam_drop_beacon(bslam_slam_t *slam, int index);

/// The filter's state was changed from outside: what the smoother knows of the past no longer leads to it.
void bslam_slam_restart_smoother(bslam_slam_t *slam);

#endif
