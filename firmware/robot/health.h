/// What watches over a session's filter, where the host wishes it: recovery, which notices that the robot is
/// lost, and the guard over its memory. And the health record, which says of both what happened, and why.
#ifndef ROBOT_HEALTH_H
#define ROBOT_HEALTH_H

#include "bslam/bslam.h"
#include "link/frame.h"

/// What the last trouble was.
typedef enum health_trouble {
    WATCH_NONE = 0,
    WATCH_LOST,     ///< the robot was not where the filter had it
    WATCH_FOUND,    ///< and found itself again
    WATCH_CORRUPT,  ///< the memory was no longer what it was: the filter started over
    WATCH_INSANE,   ///< a variance is negative, or the state not finite: it goes on, and is not to be trusted
    WATCH_RESTARTED  ///< the program started anew; the memory was good, so that the filter goes on
} health_trouble_t;

/// All members are the watch's own.
typedef struct watch {
    bool recovers;
    bool guards;
    bslam_recovery_t recovery;
    bslam_guard_t guard;
    uint32_t insane;  ///< that the filter had counted by the last step
    health_trouble_t trouble;
    int64_t trouble_us;  ///< of the message at which it showed
} health_t;

/// As the host wishes it; nothing has happened yet.
void health_init(health_t *watch, bool recovers, bool guards);

/// The filter starts over: what is known against its pose is forgotten, counts stay.
void health_restart(health_t *watch);

/// After a reset: whether the state is guarded, and as it was when it was last sealed.
bool health_is_kept(health_t *watch, const bslam_slam_t *slam);

/// After a reset, with a state that was kept.
void health_go_on(health_t *watch, int64_t time_us);

/// False: the state is not as it was when it was last sealed. Counted and noted.
bool health_is_good(health_t *watch, const bslam_slam_t *slam, int64_t time_us);

/// After a step: notes what it showed, and seals the state.
void health_end_step(health_t *watch, const bslam_slam_t *slam, int64_t time_us);

/// bslam_slam_sightings, or bslam_recovery_sightings where it recovers.
BSLAM_MUST_CHECK bslam_status_t health_sightings(health_t *watch, bslam_slam_t *slam, int64_t time_us,
                                                 const bslam_sighting_t *sightings, int count);

/// HEALTH.
void health_put_health(const health_t *watch, const bslam_slam_t *slam, bslam_link_writer_t *out);

#endif
