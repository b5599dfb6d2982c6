#include "base/status.h"

const char *bslam_status_name(bslam_status_t status)
{
    static const char *const names[BSLAM_STATUS_COUNT] = {
        [BSLAM_OK] = "BSLAM_OK",
        [BSLAM_E_NOT_FINITE] = "BSLAM_E_NOT_FINITE",
        [BSLAM_E_TIME] = "BSLAM_E_TIME",
        [BSLAM_E_RANGE] = "BSLAM_E_RANGE",
        [BSLAM_E_JUMP] = "BSLAM_E_JUMP",
        [BSLAM_E_COUNT] = "BSLAM_E_COUNT",
        [BSLAM_E_MAP_FULL] = "BSLAM_E_MAP_FULL",
        [BSLAM_E_NO_BEACON] = "BSLAM_E_NO_BEACON",
        [BSLAM_E_DUPLICATE] = "BSLAM_E_DUPLICATE",
        [BSLAM_E_PARAMETER] = "BSLAM_E_PARAMETER",
        [BSLAM_E_SINGULAR] = "BSLAM_E_SINGULAR",
        [BSLAM_E_MAP] = "BSLAM_E_MAP",
        [BSLAM_E_STATE] = "BSLAM_E_STATE",
        [BSLAM_E_SIZE] = "BSLAM_E_SIZE",
    };
    return (unsigned)status < (unsigned)BSLAM_STATUS_COUNT ? names[status] : "unknown status";
}
