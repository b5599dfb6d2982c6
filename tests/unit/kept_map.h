/// A pipeline with a map worth keeping, and where it is kept: for the tests of store.
#ifndef UNIT_KEPT_MAP_H
#define UNIT_KEPT_MAP_H

#include "map_memory.h"
#include "bslam/store/slots.h"
#include "support.h"

enum { KEPT_BYTES_MAX = 65536 };
/// kept_make's views, over a time in which a beacon is confirmed.
enum { KEPT_VIEWS = 12, KEPT_STEP_US = 100000 };

/// Settings of association by position and appearance.
bslam_settings_t kept_settings(void);

/// A signature of an object, a little different with each view.
const float *kept_signature(int object, int view, float signature[BSLAM_SAMPLE_FEATURES]);

/// A pipeline that has seen `objects` <= 6 beacons often enough to know their places and appearance, and one
/// in direction only. `appearance` stays attached; NULL: none.
void kept_make(bslam_slam_t *slam, bslam_appearance_t *appearance, int objects);

/// The same settings and appearance, and no map yet.
void kept_empty(bslam_slam_t *slam, bslam_appearance_t *appearance);

/// The map as bytes; how many.
uint32_t kept_write(const bslam_slam_t *slam, uint8_t bytes[KEPT_BYTES_MAX]);

/// Flash in memory that loses power: after `left` bytes erased or written nothing changes any more, and every
/// call fails. Erasing goes byte by byte, and the byte under way is left as anything. A byte that is written
/// without having been erased fails the test.
typedef struct kept_flash {
    uint8_t slots[BSLAM_SLOTS][KEPT_BYTES_MAX / 4];
    uint32_t slot_bytes;  ///< of each that are used; more than there are: all
    uint32_t left;
    uint32_t used;  ///< bytes erased or written so far
} kept_flash_t;

/// The interface to it.
bslam_flash_t kept_flash(kept_flash_t *flash);

#endif
