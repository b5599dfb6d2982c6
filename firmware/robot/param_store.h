/// The robot's parameters over a restart, in what the board keeps.
#ifndef ROBOT_PARAM_STORE_H
#define ROBOT_PARAM_STORE_H

#include "bslam/params.h"

/// Of all parameters' names with their closing zeros: two tables that agree in it agree in every id.
uint16_t param_store_names_crc(void);

/// False: the board keeps nothing, or failed to.
bool param_store_params_save(const bslam_params_t *params);

/// False, and the defaults: nothing is stored, or not by an image with these parameters, or damaged.
bool param_store_params_load(bslam_params_t *params);

#endif
