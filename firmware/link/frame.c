#include "link/frame.h"

#include <string.h>

#include "link/crc16.h"

#define COBS_CODE_MAX 0xff

static void append(bslam_link_writer_t *writer, uint8_t byte)
{
    if (writer->length < writer->room) {
        writer->bytes[writer->length] = byte;
        writer->length++;
    } else {
        writer->failed = true;
    }
}

/// Ends the COBS block: its code says how far the next zero is, or was not yet, after 254 bytes.
static void close_block(bslam_link_writer_t *writer)
{
    if (!writer->failed) {
        writer->bytes[writer->code_at] = (uint8_t)(writer->length - writer->code_at);
    }
}

static void open_block(bslam_link_writer_t *writer)
{
    writer->code_at = writer->length;
    append(writer, 0);
}

static void stuff(bslam_link_writer_t *writer, uint8_t byte)
{
    if (writer->failed) {
        return;
    }
    if (writer->length - writer->code_at == COBS_CODE_MAX) {
        close_block(writer);
        open_block(writer);
    }
    if (byte != 0) {
        append(writer, byte);
    } else {
        close_block(writer);
        open_block(writer);
    }
}

void bslam_link_put_u8(bslam_link_writer_t *writer, uint8_t value)
{
    writer->crc = bslam_crc16_add(writer->crc, value);
    stuff(writer, value);
}

void bslam_link_put_u16(bslam_link_writer_t *writer, uint16_t value)
{
    bslam_link_put_u8(writer, (uint8_t)(value & 0xffu));
    bslam_link_put_u8(writer, (uint8_t)(value >> 8));
}

void bslam_link_put_u32(bslam_link_writer_t *writer, uint32_t value)
{
    bslam_link_put_u16(writer, (uint16_t)(value & 0xffffu));
    bslam_link_put_u16(writer, (uint16_t)(value >> 16));
}

void bslam_link_put_i32(bslam_link_writer_t *writer, int32_t value)
{
    bslam_link_put_u32(writer, (uint32_t)value);
}

void bslam_link_put_u64(bslam_link_writer_t *writer, uint64_t value)
{
    bslam_link_put_u32(writer, (uint32_t)(value & 0xffffffffu));
    bslam_link_put_u32(writer, (uint32_t)(value >> 32));
}

void bslam_link_put_real(bslam_link_writer_t *writer, bslam_real_t value)
{
    const float narrow = (float)value;
    uint32_t bits;
    memcpy(&bits, &narrow, sizeof bits);
    bslam_link_put_u32(writer, bits);
}

void bslam_link_begin(bslam_link_writer_t *writer, uint8_t *bytes, size_t room,
                      const bslam_link_header_t *header)
{
    *writer = (bslam_link_writer_t){.room = room, .crc = BSLAM_CRC16_START};
    writer->bytes = bytes;
    open_block(writer);
    bslam_link_put_u8(writer, BSLAM_LINK_VERSION);
    bslam_link_put_u8(writer, header->type);
    bslam_link_put_u16(writer, header->sequence);
    bslam_link_put_u64(writer, (uint64_t)header->time_us);
}

size_t bslam_link_end(bslam_link_writer_t *writer)
{
    const uint16_t crc = bslam_crc16_end(writer->crc);
    bslam_link_put_u8(writer, (uint8_t)(crc >> 8));
    bslam_link_put_u8(writer, (uint8_t)(crc & 0xffu));
    close_block(writer);
    append(writer, 0);
    return writer->failed ? 0 : writer->length;
}
