#include "robot/map_transfer.h"

#include <string.h>

/// Bytes of a map in one answer, behind its status, detail and size.
#define PIECE_BYTES (BSLAM_LINK_PAYLOAD_MAX - 6)

/// A piece of what is written: bytes before it are passed over, those behind it dropped.
typedef struct piece {
    uint32_t before;
    uint32_t left;
    bslam_link_writer_t *out;
} piece_t;

static bool take_piece(void *context, const void *bytes, uint32_t count)
{
    piece_t *piece = context;
    const uint8_t *from = bytes;
    for (uint32_t i = 0; i < count; i++) {
        if (piece->before > 0) {
            piece->before--;
        } else if (piece->left > 0) {
            piece->left--;
            bslam_link_put_u8(piece->out, from[i]);
        }
    }
    return true;
}

void map_transfer_put(bslam_t *slam, uint32_t at, bslam_link_writer_t *out)
{
    uint32_t size = 0;
    bslam_status_t status = bslam_save_map(slam, NULL, &size);
    bslam_link_put_u32(out, size);
    piece_t piece = {.before = at, .left = PIECE_BYTES, .out = out};
    const bslam_map_sink_t sink = {take_piece, &piece};
    if (status == BSLAM_OK) {
        status = bslam_save_map(slam, &sink, &size);
    }
    (void)status;  // of a map that cannot be read nothing is put
}

#if SESSION_MAP_BYTES > 0

bool map_transfer_take(map_transfer_t *transfer, uint32_t at, bslam_link_reader_t *reader)
{
    if (at > sizeof transfer->bytes || reader->left > sizeof transfer->bytes - at) {
        return false;
    }
    for (uint32_t to = at; reader->left > 0; to++) {
        transfer->bytes[to] = bslam_link_get_u8(reader);
    }
    return true;
}

static bool read_bytes(const void *context, uint32_t at, void *bytes, uint32_t count)
{
    const map_transfer_t *transfer = context;
    memcpy(bytes, &transfer->bytes[at], count);
    return true;
}

bslam_status_t map_transfer_load(map_transfer_t *transfer, bslam_t *slam, uint32_t size)
{
    const uint32_t held = size < sizeof transfer->bytes ? size : (uint32_t)sizeof transfer->bytes;
    const bslam_map_source_t source = {read_bytes, transfer, held};
    return bslam_load_map(slam, &source, &transfer->fault);
}

#else

bool map_transfer_take(map_transfer_t *transfer, uint32_t at, bslam_link_reader_t *reader)
{
    (void)transfer;
    (void)at;
    (void)reader;
    return false;
}

bslam_status_t map_transfer_load(map_transfer_t *transfer, bslam_t *slam, uint32_t size)
{
    (void)slam;
    (void)size;
    transfer->fault = BSLAM_MAP_UNREADABLE;
    return BSLAM_E_MAP;
}

#endif
