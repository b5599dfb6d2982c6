/// Bytes in, frames out: the work a byte is bounded, whatever comes. A frame that is cut, wrong in a bit, too
/// long or of another version is counted and dropped, and the next delimiter starts afresh.
///
///     if (bslam_link_push(&parser, byte)) {
///         bslam_link_reader_t reader = bslam_link_payload(&parser);
///         ... parser.header, bslam_link_get_u8(&reader) ...
///     }
#ifndef BSLAM_LINK_PARSER_H
#define BSLAM_LINK_PARSER_H

#include "link/frame.h"

/// Never-decreasing counts of what came.
typedef struct bslam_link_counters {
    uint32_t frames;       ///< good ones
    uint32_t bad_crc;      ///< a bit is wrong
    uint32_t truncated;    ///< ended early, or shorter than a header
    uint32_t too_long;     ///< no delimiter where the longest frame ends
    uint32_t bad_version;  ///< a good frame of another version
} bslam_link_counters_t;

/// All zero is a parser that waits for a frame to begin.
typedef struct bslam_link_parser {
    bslam_link_header_t header;      ///< of the frame that bslam_link_push announced
    bslam_link_counters_t counters;  ///< for reading
    // Private.
    uint8_t content[BSLAM_LINK_CONTENT_MAX];
    uint32_t length;
    uint32_t left;   ///< bytes of the present COBS block still to come
    uint16_t crc;    ///< of content[0..length)
    bool zero_next;  ///< a zero stands between this block and the next, if there is one
    bool skipping;   ///< until the next delimiter
    bool running;    ///< false: the content is a good frame or nothing yet, and the next byte starts a frame
} bslam_link_parser_t;

/// Takes one byte. True if it completes a good frame, which stays until the next byte comes. O(1).
bool bslam_link_push(bslam_link_parser_t *parser, uint8_t byte);

/// Reads a payload from its start; what stands behind its end is 0, and `failed`.
typedef struct bslam_link_reader {
    const uint8_t *bytes;
    size_t left;
    bool failed;  ///< more was read than there is
} bslam_link_reader_t;

/// The payload of the frame that has just been announced.
bslam_link_reader_t bslam_link_payload(const bslam_link_parser_t *parser);

/// The next value.
uint8_t bslam_link_get_u8(bslam_link_reader_t *reader);
uint16_t bslam_link_get_u16(bslam_link_reader_t *reader);
uint32_t bslam_link_get_u32(bslam_link_reader_t *reader);
int32_t bslam_link_get_i32(bslam_link_reader_t *reader);
bslam_real_t bslam_link_get_real(bslam_link_reader_t *reader);

/// True if the payload was read to its end, neither less nor more: a frame of the right length.
bool bslam_link_is_read(const bslam_link_reader_t *reader);

#endif
