#include "robot/health.h"

#include "robot/records.h"

#define FLAG_RECOVERS 1u
#define FLAG_GUARDS 2u

void health_init(health_t *watch, bool recovers, bool guards)
{
    *watch = (health_t){.recovers = recovers, .guards = guards};
    bslam_recovery_init(&watch->recovery);
    bslam_guard_init(&watch->guard, NULL);
}

void health_restart(health_t *watch)
{
    const bslam_recovery_counters_t counters = watch->recovery.counters;
    bslam_recovery_init(&watch->recovery);
    watch->recovery.counters = counters;
    watch->insane = 0;  // the filter counts anew
}

static void note(health_t *watch, health_trouble_t trouble, int64_t time_us)
{
    watch->trouble = trouble;
    watch->trouble_us = time_us;
}

bool health_is_kept(health_t *watch, const bslam_slam_t *slam)
{
    return watch->guards && bslam_guard_check(&watch->guard, slam) == BSLAM_OK;
}

void health_go_on(health_t *watch, int64_t time_us)
{
    health_restart(watch);
    note(watch, WATCH_RESTARTED, time_us);
}

bool health_is_good(health_t *watch, const bslam_slam_t *slam, int64_t time_us)
{
    if (!watch->guards || !watch->guard.is_sealed || bslam_guard_check(&watch->guard, slam) == BSLAM_OK) {
        return true;
    }
    note(watch, WATCH_CORRUPT, time_us);
    return false;
}

void health_end_step(health_t *watch, const bslam_slam_t *slam, int64_t time_us)
{
    if (slam->counters.insane != watch->insane) {
        watch->insane = slam->counters.insane;
        note(watch, WATCH_INSANE, time_us);
    }
    if (watch->guards) {
        bslam_guard_seal(&watch->guard, slam);
    }
}

bslam_status_t health_sightings(health_t *watch, bslam_slam_t *slam, int64_t time_us,
                                const bslam_sighting_t *sightings, int count)
{
    if (!watch->recovers) {
        return bslam_slam_sightings(slam, time_us, sightings, count);
    }
    const bslam_recovery_counters_t before = watch->recovery.counters;
    const bslam_status_t status = bslam_recovery_sightings(&watch->recovery, slam, time_us, sightings, count);
    if (watch->recovery.counters.lost != before.lost) {
        note(watch, WATCH_LOST, time_us);
    }
    if (watch->recovery.counters.found != before.found) {
        note(watch, WATCH_FOUND, time_us);
    }
    return status;
}

void health_put_health(const health_t *watch, const bslam_slam_t *slam, bslam_link_writer_t *out)
{
    bslam_link_put_u8(out, (watch->recovers ? FLAG_RECOVERS : 0u) | (watch->guards ? FLAG_GUARDS : 0u));
    bslam_link_put_u8(out, (uint8_t)bslam_recovery_state(&watch->recovery, slam));
    bslam_link_put_u8(out, (uint8_t)watch->trouble);
    bslam_link_put_u64(out, (uint64_t)watch->trouble_us);
    record_put_counters(out, &watch->recovery.counters, sizeof watch->recovery.counters);
    record_put_counters(out, &watch->guard.counters, sizeof watch->guard.counters);
    bslam_link_put_u32(out, slam->counters.insane);
}
