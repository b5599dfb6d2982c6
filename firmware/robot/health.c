#include "robot/health.h"

void health_init(health_t *health, const bslam_counters_t *counters)
{
    *health = (health_t){.last = *counters};
}

void health_begin(health_t *health)
{
    health->last = (bslam_counters_t){0};
    health->insane = 0;
}

void health_note(health_t *health, health_trouble_t trouble, int64_t time_us)
{
    health->trouble = trouble;
    health->trouble_us = time_us;
}

void health_look(health_t *health, const bslam_counters_t *counters, int64_t time_us)
{
    const bslam_counters_t *last = &health->last;
    const uint32_t lost = counters->recovery.lost - last->recovery.lost;
    const uint32_t found = counters->recovery.found - last->recovery.found;
    const uint32_t insane = counters->slam.insane - last->slam.insane;
    health->recovery.contradicting += counters->recovery.contradicting - last->recovery.contradicting;
    health->recovery.withheld += counters->recovery.withheld - last->recovery.withheld;
    health->recovery.lost += lost;
    health->recovery.found += found;
    health->guard.corrupt += counters->guard.corrupt - last->guard.corrupt;
    health->guard.restored += counters->guard.restored - last->guard.restored;
    health->insane += insane;
    health->last = *counters;
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
