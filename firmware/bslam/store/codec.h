/// One description of the map's format serves measuring, writing, checking and loading: each field passes
/// through one of these functions. docs/MAP.md has the same, byte by byte.
#ifndef BSLAM_STORE_CODEC_H
#define BSLAM_STORE_CODEC_H

#include "bslam/store/map.h"

/// Where the passage through a blob stands. The sink is NULL while reading; both are while measuring.
typedef struct bslam_codec {
    const bslam_map_sink_t *sink;
    const bslam_map_source_t *source;
    uint32_t at;
    uint32_t crc;
    bslam_map_fault_t fault;  ///< the first that was found; nothing moves after it
} bslam_codec_t;

/// Notes the fault if it does not hold and none was noted before.
void bslam_codec_require(bslam_codec_t *codec, bool holds, bslam_map_fault_t fault);

/// Bytes as they are; zeros once there is a fault.
void bslam_codec_bytes(bslam_codec_t *codec, void *bytes, uint32_t count);

/// A whole number of `size` bytes, four at most, low byte first.
uint32_t bslam_codec_whole(bslam_codec_t *codec, uint32_t value, uint32_t size);

/// A finite number as the bits of its float32.
float bslam_codec_float(bslam_codec_t *codec, float value);
bslam_real_t bslam_codec_real(bslam_codec_t *codec, bslam_real_t value);

/// The float32 of these bits.
float bslam_codec_float_of(uint32_t bits);

#endif
