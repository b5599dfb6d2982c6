/// Settings that do not change when a default is tuned.
#ifndef UNIT_PLAIN_SETTINGS_H
#define UNIT_PLAIN_SETTINGS_H

#include "bslam/settings.h"
#include "plain_settings.h"

/// For tests that compare with numbers: every value a test may rely on is set, whatever its
/// default. Standard EKF, Euler step, no velocity or scale states, known identity, no gate, no Huber, no
/// delay, sensor on the axle.
bslam_settings_t unit_settings(void);

#endif
