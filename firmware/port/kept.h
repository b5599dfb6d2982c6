/// A few hundred bytes in flash that survive a power cut at any moment: two areas, of which one always holds
/// what was kept last. port_save and port_load of every board that has port_flash.
#ifndef PORT_KEPT_H
#define PORT_KEPT_H

#include "bslam/bslam.h"

/// Erases the older area, writes, reads back. False: it failed, and what was kept before is still there.
bool kept_save(const bslam_flash_t *flash, const uint8_t *bytes, uint32_t count);

/// What was kept last, if it was `count` bytes. False: nothing was; the bytes may be overwritten then.
bool kept_load(const bslam_flash_t *flash, uint8_t *bytes, uint32_t count);

#endif
