/// The robot's settings by their number, as the link and what the board keeps over a restart have them.
#ifndef ROBOT_PARAM_STORE_H
#define ROBOT_PARAM_STORE_H

#include "bslam/bslam.h"

/// How many there are, and one of them: an integer rounded to the scalar type, 0 if there is no such setting.
int param_store_count(void);
bslam_real_t param_store_get(const bslam_settings_t *settings, int id);

/// Of all settings' names with their closing zeros: two tables that agree in it agree in every id.
uint16_t param_store_names_crc(void);

/// False: the board keeps nothing, or failed to.
bool param_store_save(const bslam_settings_t *settings);

/// False, and the defaults: nothing is stored, or not by an image with these settings, or damaged.
bool param_store_load(bslam_settings_t *settings);

#endif
