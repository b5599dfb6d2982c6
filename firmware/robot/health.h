/// What goes wrong with a robot's estimator: the last trouble, and counts that a new start of the estimator
/// does not begin anew.
#ifndef ROBOT_HEALTH_H
#define ROBOT_HEALTH_H

#include "bslam/bslam.h"

/// What the last trouble was.
typedef enum health_trouble {
    HEALTH_NONE = 0,
    HEALTH_LOST,     ///< the robot was not where the filter had it
    HEALTH_FOUND,    ///< and found itself again
    HEALTH_CORRUPT,  ///< the memory was no longer what it was: the filter started over
    HEALTH_INSANE,  ///< a variance is negative, or the state not finite: it goes on, and is not to be trusted
    HEALTH_RESTARTED  ///< the program started anew; the memory was good, so that the filter goes on
} health_trouble_t;

/// What the estimator counts of it.
typedef struct health_counts {
    bslam_recovery_counters_t recovery;
    bslam_guard_counters_t guard;
    uint32_t insane;
} health_counts_t;

/// For reading.
typedef struct health {
    health_trouble_t trouble;
    int64_t trouble_us;  ///< when it showed
    health_counts_t counts;
    health_counts_t last;  ///< the estimator's own, as of the last look
} health_t;

/// Nothing has happened yet, whatever the estimator has counted.
void health_init(health_t *health, const bslam_t *slam);

/// The estimator has begun anew, and counts from 0.
void health_begin(health_t *health);

void health_note(health_t *health, health_trouble_t trouble, int64_t time_us);

/// What it has counted since the last look, noted as troubles of this time.
void health_look(health_t *health, const bslam_t *slam, int64_t time_us);

#endif
