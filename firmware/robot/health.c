#include "robot/health.h"

static health_counts_t counts_of(const bslam_t *slam)
{
    const bslam_counters_t counters = bslam_counters(slam);
    return (health_counts_t){counters.recovery, counters.guard, counters.slam.insane};
}

/// A part of the estimator that was damaged has begun anew, and counts from 0.
static uint32_t since(uint32_t now, uint32_t last)
{
    return now >= last ? now - last : now;
}

void health_init(health_t *health, const bslam_t *slam)
{
    *health = (health_t){.last = counts_of(slam)};
}

void health_begin(health_t *health)
{
    health->last = (health_counts_t){0};
    health->counts.insane = 0;
}

void health_note(health_t *health, health_trouble_t trouble, int64_t time_us)
{
    health->trouble = trouble;
    health->trouble_us = time_us;
}

void health_look(health_t *health, const bslam_t *slam, int64_t time_us)
{
    const health_counts_t now = counts_of(slam);
    const health_counts_t *last = &health->last;
    health_counts_t *counts = &health->counts;
    const uint32_t lost = since(now.recovery.lost, last->recovery.lost);
    const uint32_t found = since(now.recovery.found, last->recovery.found);
    const uint32_t insane = since(now.insane, last->insane);
    counts->recovery.contradicting += since(now.recovery.contradicting, last->recovery.contradicting);
    counts->recovery.withheld += since(now.recovery.withheld, last->recovery.withheld);
    counts->recovery.lost += lost;
    counts->recovery.found += found;
    counts->guard.corrupt += since(now.guard.corrupt, last->guard.corrupt);
    counts->guard.restored += since(now.guard.restored, last->guard.restored);
    counts->insane += insane;
    health->last = now;
    if (lost > 0) {
        health_note(health, HEALTH_LOST, time_us);
    }
    if (found > 0) {
        health_note(health, HEALTH_FOUND, time_us);
    }
    if (insane > 0) {
        health_note(health, HEALTH_INSANE, time_us);
    }
}
