/// What a call answers. On every status but BSLAM_OK the instance is unchanged to the bit, but for its
/// counters.
#ifndef BSLAM_BASE_STATUS_H
#define BSLAM_BASE_STATUS_H

#ifdef __cplusplus
extern "C" {
#endif

typedef enum bslam_status {
    BSLAM_OK = 0,
    BSLAM_E_NOT_FINITE,  ///< an input is NaN, infinite or beyond 1e12
    BSLAM_E_TIME,        ///< a time stamp does not advance, or lies outside what the history covers
    BSLAM_E_RANGE,       ///< an input is finite and outside what its field allows
    BSLAM_E_JUMP,        ///< a wheel faster than speed_max_mps: encoder reset, glitch, travel not in m
    BSLAM_E_COUNT,       ///< more items than BSLAM_SIGHTINGS_MAX
    BSLAM_E_MAP_FULL,    ///< the map holds BSLAM_BEACONS_MAX beacons, or BSLAM_RAYS_MAX rays
    BSLAM_E_NO_BEACON,   ///< no such beacon in the map
    BSLAM_E_DUPLICATE,   ///< the map already holds a beacon of that label
    BSLAM_E_PARAMETER,   ///< a setting is outside its range, or contradicts another
    BSLAM_E_SINGULAR,    ///< a covariance is not positive definite where it must be
    BSLAM_E_MAP,         ///< a stored map is refused, or cannot be stored: the fault beside it says why
    BSLAM_E_STATE,       ///< bslam_init has not succeeded, or the memory is not as it was sealed
    BSLAM_E_SIZE,        ///< library and application were compiled with other sizes
    BSLAM_STATUS_COUNT
} bslam_status_t;

/// The name of a status, "BSLAM_E_TIME" say; "unknown status" outside the enum. Never NULL.
const char *bslam_status_name(bslam_status_t status);

/// The caller must look at the result.
#define BSLAM_MUST_CHECK __attribute__((warn_unused_result))

#ifdef __cplusplus
}
#endif

#endif
