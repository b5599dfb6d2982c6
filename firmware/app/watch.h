/// What watches over a session's filter, where the host wishes it: recovery, which notices that the robot is
/// lost, and the guard over its memory. And the health record, which says of both what happened, and why.
#ifndef APP_WATCH_H
#define APP_WATCH_H

#include "bslam/bslam.h"
#include "bslam/link/frame.h"

/// What the last trouble was.
typedef enum watch_trouble {
    WATCH_NONE = 0,
    WATCH_LOST,     ///< the robot was not where the filter had it
    WATCH_FOUND,    ///< and found itself again
    WATCH_CORRUPT,  ///< the memory was no longer what it was: the filter started over
    WATCH_INSANE,   ///< a variance is negative, or the state not finite: it goes on, and is not to be trusted
    WATCH_RESTARTED  ///< the program started anew; the memory was good, so that the filter goes on
} watch_trouble_t;

/// All members are the watch's own.
typedef struct watch {
    bool recovers;
    bool guards;
    bslam_recovery_t recovery;
    bslam_guard_t guard;
    uint32_t insane;  ///< that the filter had counted by the last step
    watch_trouble_t trouble;
    int64_t trouble_us;  ///< of the message at which it showed
} watch_t;

/// As the host wishes it; nothing has happened yet.
void watch_init(watch_t *watch, bool recovers, bool guards);

/// The filter starts over: what is known against its pose is forgotten, counts stay.
void watch_restart(watch_t *watch);

/// After a reset: whether the state is guarded, and as it was when it was last sealed.
bool watch_is_kept(watch_t *watch, const bslam_slam_t *slam);

/// After a reset, with a state that was kept.
void watch_go_on(watch_t *watch, int64_t time_us);

/// False: the state is not as it was when it was last sealed. Counted and noted.
bool watch_is_good(watch_t *watch, const bslam_slam_t *slam, int64_t time_us);

/// After a step: notes what it showed, and seals the state.
void watch_end_step(watch_t *watch, const bslam_slam_t *slam, int64_t time_us);

/// bslam_slam_sightings, or bslam_recovery_sightings where it recovers.
BSLAM_MUST_CHECK bslam_status_t watch_sightings(watch_t *watch, bslam_slam_t *slam, int64_t time_us,
                                                const bslam_sighting_t *sightings, int count);

/// HEALTH.
void watch_put_health(const watch_t *watch, const bslam_slam_t *slam, bslam_link_writer_t *out);

#endif
