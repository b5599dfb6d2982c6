/// What the library asks of the settings beyond its header.
#ifndef BSLAM_SETTINGS_INTERNAL_H
#define BSLAM_SETTINGS_INTERNAL_H

#include "bslam/settings.h"

/// Number of settings, expert ones and tuning together.
int bslam_settings_count(void);

/// Field id as a number, an integer rounded to the scalar type. 0 for an id that does not exist.
bslam_real_t bslam_settings_get(const bslam_settings_t *settings, int id);

/// The table line of the field at an offset.
int bslam_settings_at(size_t offset);

/// Whether association goes by likelihood, and whether by what beacons look like, too.
static inline bool bslam_weighs_likelihood(const bslam_settings_t *settings)
{
    return settings->association == BSLAM_ASSOCIATION_SVM ||
           settings->association >= BSLAM_ASSOCIATION_POSITION;
}

static inline bool bslam_weighs_looks(const bslam_settings_t *settings)
{
    return bslam_weighs_likelihood(settings) && settings->association != BSLAM_ASSOCIATION_POSITION;
}

/// BSLAM_OK, or BSLAM_E_PARAMETER with *bad_id the first field that is outside its range (NaN is), or that
/// contradicts another: velocity_states needs a positive speed noise of both wheels, and excludes
/// scale_states.
BSLAM_MUST_CHECK bslam_status_t bslam_settings_check(const bslam_settings_t *settings, int *bad_id);

#endif
