/// The robot's parameters over a restart, in what the board keeps.
#ifndef ROBOT_PARAM_STORE_H
#define ROBOT_PARAM_STORE_H

#include "bslam/settings.h"

/// Of all parameters' names with their closing zeros: two tables that agree in it agree in every id.
uint16_t param_store_names_crc(void);

/// False: the board keeps nothing, or failed to.
bool param_store_params_save(const bslam_settings_t *settings);

/// False, and the defaults: nothing is stored, or not by an image with these parameters, or damaged.
bool param_store_params_load(bslam_settings_t *settings);

#endif
