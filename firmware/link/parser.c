#include "link/parser.h"

#include <string.h>

#include "link/crc16.h"

#define DELIMITER 0
#define COBS_CODE_MAX 0xff
#define CONTENT_MIN (BSLAM_LINK_HEADER_BYTES + BSLAM_LINK_CRC_BYTES)

static void store(bslam_link_parser_t *parser, uint8_t byte)
{
    if (parser->length == BSLAM_LINK_CONTENT_MAX) {
        parser->counters.too_long++;
        parser->skipping = true;
        return;
    }
    parser->content[parser->length] = byte;
    parser->length++;
    parser->crc = bslam_crc16_add(parser->crc, byte);
}

/// A byte of the COBS code that is no delimiter.
static void unstuff(bslam_link_parser_t *parser, uint8_t byte)
{
    if (parser->left > 0) {
        parser->left--;
        store(parser, byte);
        return;
    }
    if (parser->zero_next) {
        store(parser, 0);
    }
    parser->left = byte - 1u;
    parser->zero_next = byte != COBS_CODE_MAX;
}

static bslam_link_reader_t reader_of(const bslam_link_parser_t *parser, size_t from, size_t behind)
{
    return (bslam_link_reader_t){.bytes = &parser->content[from], .left = parser->length - from - behind};
}

static bslam_link_header_t read_header(const bslam_link_parser_t *parser)
{
    bslam_link_reader_t reader = reader_of(parser, 1, 0);
    bslam_link_header_t header;
    header.type = bslam_link_get_u8(&reader);
    header.sequence = bslam_link_get_u16(&reader);
    const uint64_t low = bslam_link_get_u32(&reader);
    const uint64_t high = bslam_link_get_u32(&reader);
    header.time_us = (int64_t)(high << 32 | low);
    return header;
}

/// Judges what stands between two delimiters, and counts it. Nothing at all is no frame: a sender may flush
/// the line with a delimiter.
static bool is_frame(bslam_link_parser_t *parser)
{
    bslam_link_counters_t *counters = &parser->counters;
    const bool empty = parser->length == 0 && parser->left == 0 && !parser->zero_next;
    if (parser->skipping || empty) {
        return false;
    }
    if (parser->left > 0 || parser->length < CONTENT_MIN) {
        counters->truncated++;
        return false;
    }
    if (parser->crc != BSLAM_CRC16_GOOD) {
        counters->bad_crc++;
        return false;
    }
    if (parser->content[0] != BSLAM_LINK_VERSION) {
        counters->bad_version++;
        return false;
    }
    counters->frames++;
    return true;
}

static void start_over(bslam_link_parser_t *parser)
{
    parser->length = 0;
    parser->left = 0;
    parser->crc = BSLAM_CRC16_START;
    parser->zero_next = false;
    parser->skipping = false;
}

bool bslam_link_push(bslam_link_parser_t *parser, uint8_t byte)
{
    if (!parser->running) {
        start_over(parser);
        parser->running = true;
    }
    if (byte != DELIMITER) {
        if (!parser->skipping) {
            unstuff(parser, byte);
        }
        return false;
    }
    if (!is_frame(parser)) {
        start_over(parser);
        return false;
    }
    parser->header = read_header(parser);
    parser->running = false;
    return true;
}

bslam_link_reader_t bslam_link_payload(const bslam_link_parser_t *parser)
{
    return reader_of(parser, BSLAM_LINK_HEADER_BYTES, BSLAM_LINK_CRC_BYTES);
}

uint8_t bslam_link_get_u8(bslam_link_reader_t *reader)
{
    if (reader->left == 0) {
        reader->failed = true;
        return 0;
    }
    const uint8_t byte = reader->bytes[0];
    reader->bytes++;
    reader->left--;
    return byte;
}

// Low and high in two statements each: the order of calls in one expression is the compiler's own.

uint16_t bslam_link_get_u16(bslam_link_reader_t *reader)
{
    const uint32_t low = bslam_link_get_u8(reader);
    const uint32_t high = bslam_link_get_u8(reader);
    return (uint16_t)(high << 8 | low);
}

uint32_t bslam_link_get_u32(bslam_link_reader_t *reader)
{
    const uint32_t low = bslam_link_get_u16(reader);
    const uint32_t high = bslam_link_get_u16(reader);
    return high << 16 | low;
}

int32_t bslam_link_get_i32(bslam_link_reader_t *reader)
{
    const uint32_t bits = bslam_link_get_u32(reader);
    int32_t value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

bslam_real_t bslam_link_get_real(bslam_link_reader_t *reader)
{
    const uint32_t bits = bslam_link_get_u32(reader);
    float value;
    memcpy(&value, &bits, sizeof value);
    return (bslam_real_t)value;
}

bool bslam_link_is_read(const bslam_link_reader_t *reader)
{
    return !reader->failed && reader->left == 0;
}
