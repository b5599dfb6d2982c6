/// The pipeline: odometry and sightings in; pose, map and an account of each sighting out. What its calls
/// promise stands in bslam.h, at the public call of the same name.
#ifndef BSLAM_SLAM_SLAM_H
#define BSLAM_SLAM_SLAM_H

#include "bslam/association/association.h"
#include "bslam/model/odometry.h"
#include "bslam/model/odometry_history.h"
#include "bslam/smoother/smoother.h"

/// Readings that are refused for their time, and follow one another.
typedef struct bslam_clock_watch {
    int64_t from_us, to_us;
    bool has_some;
} bslam_clock_watch_t;

/// Sums over innovations: times the one before it of the same beacon, and times itself.
typedef struct bslam_autocorrelation {
    bslam_real_t product, square;
} bslam_autocorrelation_t;

typedef struct bslam_slam {
    bslam_settings_t settings;
    bslam_ekf_t ekf;
    bslam_odometry_t odometry;
    bslam_history_t history;
    uint32_t travelled_um;  ///< that the filter has gone, modulo 4.3 km
    bslam_real_t misfit;    ///< of the newest sightings to the pose: 0 all fit, 1 none does
    bslam_real_t unseen_s;  ///< of odometry since a sighting that counts in it
    bslam_autocorrelation_t bearing_noise, range_noise;
    int64_t elapsed_us;  ///< of odometry: the pipeline's own time, which goes on whatever the clock does
    int64_t moment_us;   ///< the newest frame's, in it
    bslam_clock_watch_t watch;
    uint32_t frames[BSLAM_HISTORY_MAX];  ///< sums over the last ones, so that none is used twice
    int32_t next_frame;                  ///< where the next sum goes
    bool confirmed_now;                  ///< within a frame: it has confirmed a beacon
    bool measures_distance;              ///< some sighting had one
    bool is_lost;                        ///< the pose is what odometry makes of one that is unknown
    bool is_frozen;                      ///< the map: no beacon is added, learned or taken out by itself
    bslam_appearance_t *appearance;      ///< the caller's; NULL: none attached
    bslam_smoother_t *smoother;          ///< the caller's; NULL: none attached
    struct bslam_doubts *doubts;         ///< the caller's; NULL: none attached
    bslam_slam_counters_t counters;
    bslam_account_t accounts[BSLAM_SIGHTINGS_MAX];
    int32_t account_count;
    int32_t bad_sighting;  ///< place of the sighting for which the last frame was refused, else -1
    // Scratch: holds nothing between calls.
    bslam_record_t records[BSLAM_SIGHTINGS_MAX];
} bslam_slam_t;

/// Whether it learns appearance, and whether a smoother leads it: constants of the build where it has none.
static inline bool bslam_slam_learns(const bslam_slam_t *slam)
{
    return BSLAM_APPEARANCE != 0 && slam->appearance != NULL;
}

static inline bool bslam_slam_smooths(const bslam_slam_t *slam)
{
    return BSLAM_SMOOTHER != 0 && slam->smoother != NULL;
}

static inline bool bslam_slam_can_doubt(const bslam_slam_t *slam)
{
    return BSLAM_HYPOTHESES_MAX > 1 && slam->doubts != NULL;
}

/// Settings may stand in *slam: starting over. No appearance and no smoother is attached.
BSLAM_MUST_CHECK bslam_status_t bslam_slam_init(bslam_slam_t *slam, const bslam_settings_t *settings,
                                                int *bad_id);

/// From now on it learns what beacons look like; what was known of another map is forgotten. NULL: no more.
void bslam_slam_attach_appearance(bslam_slam_t *slam, bslam_appearance_t *appearance);

/// From now on the smoother leads the filter, if the setting `filter` says so. NULL: no more.
void bslam_slam_attach_smoother(bslam_slam_t *slam, bslam_smoother_t *smoother);

/// From now on doubts about which beacon is seen may be followed, where the settings say so and no smoother
/// leads the filter. NULL: no more.
void bslam_slam_attach_doubts(bslam_slam_t *slam, struct bslam_doubts *doubts);

BSLAM_MUST_CHECK bslam_status_t bslam_slam_odometry(bslam_slam_t *slam,
                                                    const bslam_odometry_reading_t *reading);
BSLAM_MUST_CHECK bslam_status_t bslam_slam_resume_odometry(bslam_slam_t *slam, bslam_real_t position_sd_m,
                                                           bslam_real_t heading_sd_rad);
BSLAM_MUST_CHECK bslam_status_t bslam_slam_set_pose(bslam_slam_t *slam, const bslam_pose_t *pose,
                                                    bslam_real_t position_sd_m, bslam_real_t heading_sd_rad);

/// Nobody knows where the robot is: its covariance says 30 m and 3.2 rad, and no sighting is used.
void bslam_slam_lose_pose(bslam_slam_t *slam);

BSLAM_MUST_CHECK bslam_status_t bslam_slam_sightings(bslam_slam_t *slam, int64_t time_us,
                                                     const bslam_sighting_t *sightings, int count);
BSLAM_MUST_CHECK bslam_status_t bslam_slam_add_known_beacon(bslam_slam_t *slam, int32_t label,
                                                            bslam_real_t x_m, bslam_real_t y_m);
BSLAM_MUST_CHECK bslam_status_t bslam_slam_remove_beacon(bslam_slam_t *slam, uint32_t uid);
void bslam_slam_forget_map(bslam_slam_t *slam);

bslam_pose_t bslam_slam_pose(const bslam_slam_t *slam);
BSLAM_MUST_CHECK bslam_status_t bslam_slam_pose_at(const bslam_slam_t *slam, int64_t time_us,
                                                   bslam_pose_t *pose);
void bslam_slam_pose_covariance(const bslam_slam_t *slam, bslam_real_t lower[6]);
BSLAM_MUST_CHECK bslam_status_t bslam_slam_beacon(const bslam_slam_t *slam, int index,
                                                  bslam_beacon_view_t *view);

#endif
