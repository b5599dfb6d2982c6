#include "robot/map_transfer.h"

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

void map_transfer_put(const bslam_slam_t *slam, uint32_t at, bslam_link_writer_t *out)
{
    bslam_link_put_u32(out, bslam_map_size(slam));
    piece_t piece = {.before = at, .left = PIECE_BYTES, .out = out};
    const bslam_map_sink_t sink = {take_piece, &piece};
    bslam_map_fault_t fault;
    const bslam_status_t status = bslam_map_write(slam, &sink, &fault);
    (void)status;  // the sink takes all
}

#if SESSION_MAP_BYTES > 0

bool map_transfer_take(map_transfer_t *carried, uint32_t at, bslam_link_reader_t *reader)
{
    if (at > sizeof carried->bytes || reader->left > sizeof carried->bytes - at) {
        return false;
    }
    for (uint32_t to = at; reader->left > 0; to++) {
        carried->bytes[to] = bslam_link_get_u8(reader);
    }
    return true;
}

bslam_status_t map_transfer_load(map_transfer_t *carried, bslam_slam_t *slam, uint32_t size,
                                 bslam_map_mode_t mode)
{
    const uint32_t held = size < sizeof carried->bytes ? size : (uint32_t)sizeof carried->bytes;
    const bslam_map_source_t source = bslam_map_from_memory(carried->bytes, held);
    return bslam_map_load(slam, &source, mode, &carried->fault);
}

#else

bool map_transfer_take(map_transfer_t *carried, uint32_t at, bslam_link_reader_t *reader)
{
    (void)carried;
    (void)at;
    (void)reader;
    return false;
}

bslam_status_t map_transfer_load(map_transfer_t *carried, bslam_slam_t *slam, uint32_t size,
                                 bslam_map_mode_t mode)
{
    (void)slam;
    (void)size;
    (void)mode;
    carried->fault = BSLAM_MAP_UNREADABLE;
    return BSLAM_E_MAP;
}

#endif
