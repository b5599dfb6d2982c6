/// A map in flash that survives a power cut at any moment: two slots, of which one always holds a whole map.
///
/// A save erases the slot that is older or damaged, writes the map, reads it back, and only then the 16 bytes
/// that make it the newer one. Until the last of these the other slot is the map; from then on this one.
/// docs/MAP.md has the bytes.
#ifndef BSLAM_STORE_SLOTS_H
#define BSLAM_STORE_SLOTS_H

#include "bslam/store/map.h"

/// Saves the map. BSLAM_E_MAP: *fault is BSLAM_MAP_UNREADABLE if the flash failed or the map is larger than a
/// slot, else what is wrong with what was read back; the map saved before is still there. Which slot is whole
/// bslam_map_check says: one that is refused for its covariance alone counts as whole here.
BSLAM_MUST_CHECK bslam_status_t bslam_slots_save(const bslam_flash_t *flash, const bslam_slam_t *slam,
                                                 bslam_map_fault_t *fault);

/// Loads the newest map that bslam_map_load takes: where it refuses the newer one, for its covariance say,
/// the older one. BSLAM_E_MAP: there is none; *fault is what is wrong with the newer slot, BSLAM_MAP_NO_MAP
/// if nothing was ever saved.
BSLAM_MUST_CHECK bslam_status_t bslam_slots_load(const bslam_flash_t *flash, bslam_slam_t *slam,
                                                 bslam_map_mode_t mode, bslam_map_fault_t *fault);

#endif
