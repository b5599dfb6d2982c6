// The link's parser against one that is written another way: frames are cut at their delimiters, decoded as a
// whole and judged. Both must announce the same frames, with the same content, and count the same damage.
#include "fuzz.h"

#include <string.h>

#include "link/crc16.h"
#include "link/parser.h"

enum { STREAM_MAX = 4096, PIECE_MAX = 200 };

/// Every byte of the content from a COBS frame without its delimiter; -1: it is none, or too long.
static int decode(const uint8_t *from, size_t size, uint8_t content[BSLAM_LINK_CONTENT_MAX])
{
    int length = 0;
    size_t at = 0;
    while (at < size) {
        const size_t code = from[at];
        if (at + code > size) {
            return -1;
        }
        const bool zero_follows = code < 255 && at + code < size;
        if (length + (int)code - 1 + (zero_follows ? 1 : 0) > BSLAM_LINK_CONTENT_MAX) {
            return -1;
        }
        memcpy(&content[length], &from[at + 1], code - 1);
        length += (int)code - 1;
        if (zero_follows) {
            content[length++] = 0;
        }
        at += code;
    }
    return length;
}

/// The content's length without its CRC if it is a good frame of this version, else -1.
static int judge(const uint8_t *from, size_t size, uint8_t content[BSLAM_LINK_CONTENT_MAX])
{
    const int length = decode(from, size, content);
    if (length < BSLAM_LINK_HEADER_BYTES + BSLAM_LINK_CRC_BYTES) {
        return -1;
    }
    uint16_t crc = BSLAM_CRC16_START;
    for (int i = 0; i < length; i++) {
        crc = bslam_crc16_add(crc, content[i]);
    }
    const bool good = crc == BSLAM_CRC16_GOOD && content[0] == BSLAM_LINK_VERSION;
    return good ? length - BSLAM_LINK_CRC_BYTES : -1;
}

static void require_frame(const bslam_link_parser_t *parser, const uint8_t *content, int length)
{
    const bslam_link_reader_t reader = bslam_link_payload(parser);
    fuzz_require(reader.left == (size_t)(length - BSLAM_LINK_HEADER_BYTES));
    fuzz_require(memcmp(reader.bytes, &content[BSLAM_LINK_HEADER_BYTES], reader.left) == 0);
    fuzz_require(parser->header.type == content[1]);
    fuzz_require(parser->header.sequence == (content[2] | content[3] << 8));
    uint64_t time_us = 0;
    for (int i = 0; i < 8; i++) {
        time_us |= (uint64_t)content[4 + i] << 8 * i;
    }
    fuzz_require(parser->header.time_us == (int64_t)time_us);
}

/// What the parser reads of a payload, it reads within it.
static void read_payload(const bslam_link_parser_t *parser)
{
    bslam_link_reader_t reader = bslam_link_payload(parser);
    const size_t size = reader.left;
    size_t taken = 0;
    while (!reader.failed) {
        switch (taken % 3) {
        case 0:
            (void)bslam_link_get_u8(&reader);
            taken += 1;
            break;
        case 1:
            (void)bslam_link_get_u16(&reader);
            taken += 2;
            break;
        default:
            (void)bslam_link_get_real(&reader);
            taken += 4;
            break;
        }
        fuzz_require(reader.failed == (taken > size));
    }
}

static void push_all(const uint8_t *stream, size_t size)
{
    bslam_link_parser_t parser;
    memset(&parser, 0, sizeof parser);
    uint8_t content[BSLAM_LINK_CONTENT_MAX];
    size_t start = 0;
    uint32_t frames = 0;
    uint32_t bad = 0;
    for (size_t i = 0; i < size; i++) {
        const bool announced = bslam_link_push(&parser, stream[i]);
        if (stream[i] != 0) {
            fuzz_require(!announced);
            continue;
        }
        const int length = judge(&stream[start], i - start, content);
        fuzz_require(announced == (length >= 0));
        if (announced) {
            frames++;
            require_frame(&parser, content, length);
            read_payload(&parser);
        }
        bad += !announced && i > start ? 1u : 0u;
        start = i + 1;
    }
    const bslam_link_counters_t *counters = &parser.counters;
    const uint32_t damaged =
        counters->bad_crc + counters->truncated + counters->too_long + counters->bad_version;
    fuzz_require(counters->frames == frames);
    fuzz_require(damaged == bad || damaged == bad + (parser.skipping ? 1u : 0u));
}

/// Good frames made of the input, one of them flipped in a bit or cut if the input says so.
static size_t make_stream(fuzz_input_t *input, uint8_t stream[STREAM_MAX])
{
    size_t size = 0;
    while (input->left > 0 && size + BSLAM_LINK_FRAME_MAX < STREAM_MAX) {
        const bslam_link_header_t header = {
            .type = fuzz_u8(input), .sequence = fuzz_u16(input), .time_us = fuzz_u8(input)};
        const unsigned damage = fuzz_u8(input);
        unsigned count = fuzz_u8(input) % PIECE_MAX;
        bslam_link_writer_t writer;
        bslam_link_begin(&writer, &stream[size], STREAM_MAX - size, &header);
        for (; count > 0; count--) {
            bslam_link_put_u8(&writer, fuzz_u8(input));
        }
        const size_t length = bslam_link_end(&writer);
        fuzz_require(length > 0);
        if (damage < 64) {
            stream[size + damage % length] ^= (uint8_t)(1u << fuzz_u8(input) % 8);
        }
        size += damage == 64 ? length / 2 : length;
    }
    return size;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static uint8_t stream[STREAM_MAX];
    fuzz_input_t input = {data, size};
    if ((fuzz_u8(&input) & 1u) != 0) {
        push_all(stream, make_stream(&input, stream));
    } else {
        push_all(input.bytes, input.left);
    }
    return 0;
}
