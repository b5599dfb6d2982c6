/// A map that goes over the link, from the robot to the host and back: the bytes of docs/MAP.md in pieces.
#ifndef ROBOT_MAP_TRANSFER_H
#define ROBOT_MAP_TRANSFER_H

#include "bslam/bslam.h"
#include "link/frame.h"
#include "link/parser.h"

/// Bytes of the largest map that a robot takes from the host. 0: it takes none, and has no room for one.
#ifndef SESSION_MAP_BYTES
#define SESSION_MAP_BYTES 0
#endif

/// All members are its own.
typedef struct map_transfer {
    bslam_map_fault_t fault;  ///< of the last map that was to be loaded
#if SESSION_MAP_BYTES > 0
    uint8_t bytes[SESSION_MAP_BYTES];
#endif
} map_transfer_t;

/// Puts the size of the map and its bytes from place `at` on, as many as one message holds. The map is
/// written anew for each piece: nothing is kept, and what changed in between shows by the CRC. O(n² +
/// classifiers).
void map_transfer_put(bslam_t *slam, uint32_t at, bslam_link_writer_t *out);

/// Takes what is left of a message as the bytes of a map from place `at` on. False: there is no such room.
bool map_transfer_take(map_transfer_t *transfer, uint32_t at, bslam_link_reader_t *reader);

/// Loads the `size` bytes that were taken (bslam_load_map).
BSLAM_MUST_CHECK bslam_status_t map_transfer_load(map_transfer_t *transfer, bslam_t *slam, uint32_t size);

#endif
