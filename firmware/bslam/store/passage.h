/// One description of the map's format serves measuring, writing, checking and loading: each field passes
/// through one of these functions, which takes it from where it is to where it goes. docs/MAP.md has the
/// same, byte by byte. Not for users.
#ifndef BSLAM_STORE_PASSAGE_H
#define BSLAM_STORE_PASSAGE_H

#include "bslam/store/map.h"

/// Where the passage through a blob stands. The sink is NULL while reading; both are while measuring.
typedef struct passage {
    const bslam_map_sink_t *sink;
    const bslam_map_source_t *source;
    uint32_t at;
    uint32_t crc;
    uint32_t version;
    bslam_map_fault_t fault;  ///< the first that was found; nothing moves after it
} bslam_passage_t;

/// Notes the fault if it does not hold and none was noted before.
void bslam_passage_require(bslam_passage_t *passage, bool holds, bslam_map_fault_t fault);

/// Bytes as they are; zeros once there is a fault.
void bslam_passage_bytes(bslam_passage_t *passage, void *bytes, uint32_t count);

/// A whole number of `size` bytes, four at most, low byte first.
uint32_t bslam_passage_whole(bslam_passage_t *passage, uint32_t value, uint32_t size);

/// A finite number as the bits of its float32.
float bslam_passage_float(bslam_passage_t *passage, float value);
bslam_real_t bslam_passage_real(bslam_passage_t *passage, bslam_real_t value);

/// The float32 of these bits.
float bslam_passage_float_of(uint32_t bits);

#endif
