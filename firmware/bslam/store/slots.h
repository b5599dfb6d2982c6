/// A map in flash that survives a power cut at any moment: two slots, of which one always holds a whole map.
/// A save erases the slot that is older or damaged, writes the map, reads it back, and only then the piece
/// that makes it the newer one. docs/MAP.md has the bytes.
#ifndef BSLAM_STORE_SLOTS_H
#define BSLAM_STORE_SLOTS_H

#include "bslam/store/map.h"

/// A slot is whole if bslam_map_check says so.
BSLAM_MUST_CHECK bslam_status_t bslam_slots_save(const bslam_flash_t *flash, const bslam_slam_t *slam,
                                                 bslam_map_fault_t *fault);

/// Loads the newer map, or where bslam_map_load refuses it the older one. *fault is what is wrong with the
/// newer slot; BSLAM_MAP_NO_MAP: nothing was ever saved.
BSLAM_MUST_CHECK bslam_status_t bslam_slots_load(const bslam_flash_t *flash, bslam_slam_t *slam,
                                                 bslam_map_mode_t mode, bslam_map_fault_t *fault);

#endif
