#include "bslam/store/guard.h"

#include <stddef.h>
#include <string.h>

#define START 0x9e3779b9u
#define SEALED 0x5ea1ed01u
#define FACTOR 0x85ebca6bu  // odd, so that every step can be undone

uint32_t bslam_guard_sum(uint32_t sum, const void *bytes, size_t size)
{
    const uint8_t *from = bytes;
    for (size_t at = 0; at + sizeof(uint32_t) <= size; at += sizeof(uint32_t)) {
        uint32_t word;
        memcpy(&word, &from[at], sizeof word);
        sum ^= word;
        sum = (sum << 7 | sum >> 25) * FACTOR;
    }
    return sum;
}

/// A count that may itself be damaged, for a length that must not be.
static size_t bounded(int32_t count, int32_t most)
{
    return count < 0 ? 0 : (size_t)(count < most ? count : most);
}

static uint32_t checksum_of(const bslam_slam_t *slam)
{
    const bslam_ekf_t *ekf = &slam->ekf;
    const bslam_factor_t *factor = &ekf->factor;
    const int body = (int)BSLAM_FACTOR_PADDED(bounded(factor->body_count, BSLAM_FACTOR_BODY_MAX));
    const size_t counts = offsetof(bslam_ekf_t, beacons) - offsetof(bslam_ekf_t, dim);
    const size_t flags = sizeof *ekf - offsetof(bslam_ekf_t, pending_count);
    const size_t rest = offsetof(bslam_slam_t, accounts) - offsetof(bslam_slam_t, odometry);
    uint32_t sum = bslam_guard_sum(START, &slam->settings, sizeof slam->settings);
    sum = bslam_guard_sum(sum, ekf->mean, sizeof ekf->mean);
    sum = bslam_guard_sum(sum, factor, offsetof(bslam_factor_t, body));
    sum = bslam_guard_sum(sum, factor->body, bslam_factor_block_at(body) * sizeof factor->body[0]);
    sum = bslam_guard_sum(sum, &ekf->dim, counts);
    sum = bslam_guard_sum(sum, ekf->beacons,
                          bounded(ekf->beacon_count, BSLAM_BEACONS_MAX) * sizeof ekf->beacons[0]);
    sum = bslam_guard_sum(sum, ekf->correction, sizeof ekf->correction);  // 0 between frames, and added to
    sum = bslam_guard_sum(sum, &ekf->pending_count, flags);
    return bslam_guard_sum(sum, &slam->odometry, rest);
}

void bslam_guard_seal(bslam_guard_t *guard, const bslam_slam_t *slam)
{
    guard->checksum = checksum_of(slam);
    guard->seal = SEALED;
    if (guard->copy != NULL) {
        memcpy(guard->copy, slam, sizeof *slam);
    }
}

bool bslam_guard_is_sealed(const bslam_guard_t *guard)
{
    return guard->seal == SEALED;
}

bslam_status_t bslam_guard_check(bslam_guard_t *guard, const bslam_slam_t *slam)
{
    if (bslam_guard_is_sealed(guard) && checksum_of(slam) == guard->checksum) {
        return BSLAM_OK;
    }
    guard->counters.corrupt++;
    return BSLAM_E_STATE;
}

bslam_status_t bslam_guard_restore(bslam_guard_t *guard, bslam_slam_t *slam)
{
    if (!bslam_guard_is_sealed(guard) || guard->copy == NULL || checksum_of(guard->copy) != guard->checksum) {
        return BSLAM_E_STATE;
    }
    memcpy(slam, guard->copy, sizeof *slam);
    guard->counters.restored++;
    return BSLAM_OK;
}
