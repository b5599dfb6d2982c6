/// The robot's parameters over a restart, in what the board keeps.
#ifndef APP_STORED_H
#define APP_STORED_H

#include "bslam/base/params.h"

/// Of all parameters' names with their closing zeros: two tables that agree in it agree in every id.
uint16_t stored_names_crc(void);

/// False: the board keeps nothing, or failed to.
bool stored_params_save(const bslam_params_t *params);

/// False, and the defaults: nothing is stored, or not by an image with these parameters, or damaged.
bool stored_params_load(bslam_params_t *params);

#endif
