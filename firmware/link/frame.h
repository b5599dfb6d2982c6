/// Frames on the serial link: what one is made of, and how to write one. docs/LINK.md has every byte.
///
///     bslam_link_begin(&writer, buffer, sizeof buffer, &header);
///     bslam_link_put_u8(&writer, 7);
///     length = bslam_link_end(&writer);     // 0: the buffer is too small
///
/// The COBS code, the CRC and the payload are written in one pass, in place: no second buffer.
#ifndef BSLAM_LINK_FRAME_H
#define BSLAM_LINK_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/real.h"

/// The first byte of every frame. Another version is refused: nothing else of it may be believed.
#define BSLAM_LINK_VERSION 1
/// Version, type, sequence, time.
#define BSLAM_LINK_HEADER_BYTES 12
#define BSLAM_LINK_CRC_BYTES 2
/// A frame of sightings of the largest size, but no less than the counters take.
#if BSLAM_SIGHTINGS_MAX < 16
#define BSLAM_LINK_PAYLOAD_MAX 496
#else
#define BSLAM_LINK_PAYLOAD_MAX (16 + 30 * BSLAM_SIGHTINGS_MAX)
#endif
/// Header, payload and CRC.
#define BSLAM_LINK_CONTENT_MAX (BSLAM_LINK_HEADER_BYTES + BSLAM_LINK_PAYLOAD_MAX + BSLAM_LINK_CRC_BYTES)
/// Bytes on the wire of the longest frame: COBS adds one byte in 254, and the delimiter ends it.
#define BSLAM_LINK_FRAME_MAX (BSLAM_LINK_CONTENT_MAX + BSLAM_LINK_CONTENT_MAX / 254 + 2)

typedef struct bslam_link_header {
    uint8_t type;
    uint16_t sequence;  ///< counts the sender's frames, modulo 2^16
    int64_t time_us;    ///< of what the frame tells
} bslam_link_header_t;

/// A frame in the making. Private.
typedef struct bslam_link_writer {
    uint8_t *bytes;
    size_t room;
    size_t length;
    size_t code_at;  ///< where the length of the present COBS block will stand
    uint16_t crc;
    bool failed;  ///< the room did not suffice
} bslam_link_writer_t;

/// Starts a frame in the caller's buffer of `room` bytes.
void bslam_link_begin(bslam_link_writer_t *writer, uint8_t *bytes, size_t room,
                      const bslam_link_header_t *header);

/// The next value of the payload, low byte first.
void bslam_link_put_u8(bslam_link_writer_t *writer, uint8_t value);
void bslam_link_put_u16(bslam_link_writer_t *writer, uint16_t value);
void bslam_link_put_u32(bslam_link_writer_t *writer, uint32_t value);
void bslam_link_put_i32(bslam_link_writer_t *writer, int32_t value);
void bslam_link_put_u64(bslam_link_writer_t *writer, uint64_t value);

/// A number as float32, which on the target is the scalar itself.
void bslam_link_put_real(bslam_link_writer_t *writer, bslam_real_t value);

/// Ends the frame with CRC and delimiter. Its length in bytes; 0 if the room did not suffice.
size_t bslam_link_end(bslam_link_writer_t *writer);

#endif
