#include "bslam/store/slots.h"

#include <string.h>

#include "base/crc32.h"

#define MAGIC 0x534c5342u  // "BSLS"
/// What fills a piece up: as most flash has it before it is written.
#define ERASED 0xff

/// The head has a piece to itself, and the map begins with the next one.
enum { HEAD_WORDS = 4, HEAD_BYTES = 16, MAP_AT = BSLAM_FLASH_PIECE };

/// One slot as it is found.
typedef struct slot {
    const bslam_flash_t *flash;
    int number;
    bool has_head;  ///< a save was finished
    uint32_t sequence;
    uint32_t length;
    bslam_map_fault_t fault;
} slot_t;

static uint32_t word_at(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static void fill_head(uint8_t head[HEAD_BYTES], uint32_t sequence, uint32_t length)
{
    uint32_t words[HEAD_WORDS] = {MAGIC, sequence, length, 0};
    for (int w = 0; w < HEAD_WORDS; w++) {
        if (w == HEAD_WORDS - 1) {
            words[w] = ~bslam_crc32_add(BSLAM_CRC32_START, head, HEAD_BYTES - 4);
        }
        for (int i = 0; i < 4; i++) {
            head[4 * w + i] = (uint8_t)(words[w] >> 8 * i);
        }
    }
}

static bool read_map(const void *context, uint32_t at, void *bytes, uint32_t count)
{
    const slot_t *slot = context;
    return slot->flash->read(slot->flash->context, slot->number, MAP_AT + at, bytes, count);
}

static bslam_map_source_t source_of(const slot_t *slot)
{
    return (bslam_map_source_t){read_map, slot, slot->length};
}

/// Whether an area holds a map of so many bytes, in whole pieces.
static bool has_room(const bslam_flash_t *flash, uint32_t length)
{
    const uint32_t pieces = flash->slot_bytes / BSLAM_FLASH_PIECE;
    return pieces > 0 && length <= (pieces - 1) * BSLAM_FLASH_PIECE;
}

static slot_t read_slot(const bslam_flash_t *flash, int number)
{
    slot_t slot = {.flash = flash, .number = number, .fault = BSLAM_MAP_NO_MAP};
    uint8_t head[HEAD_BYTES] = {0};
    if (!flash->read(flash->context, number, 0, head, sizeof head)) {
        slot.fault = BSLAM_MAP_UNREADABLE;
        return slot;
    }
    slot.sequence = word_at(&head[4]);
    slot.length = word_at(&head[8]);
    uint8_t expected[HEAD_BYTES];
    fill_head(expected, slot.sequence, slot.length);
    slot.has_head = memcmp(head, expected, sizeof head) == 0 && has_room(flash, slot.length);
    if (slot.has_head) {
        const bslam_map_source_t source = source_of(&slot);
        slot.fault = bslam_map_check(&source);
    }
    return slot;
}

/// Whether a was saved after b. Sequence numbers roll over.
static bool is_newer(const slot_t *a, const slot_t *b)
{
    return a->has_head && (!b->has_head || a->sequence - b->sequence < UINT32_MAX / 2);
}

/// Both slots, the newer one first.
static void find_slots(const bslam_flash_t *flash, slot_t slots[BSLAM_SLOTS])
{
    slots[0] = read_slot(flash, 0);
    slots[1] = read_slot(flash, 1);
    if (is_newer(&slots[1], &slots[0])) {
        const slot_t swap = slots[0];
        slots[0] = slots[1];
        slots[1] = swap;
    }
}

// ---- saving -----------------------------------------------------------------------------------------------

/// Pieces on their way into a slot.
typedef struct writer {
    const bslam_flash_t *flash;
    int slot;
    uint32_t at;
    uint32_t waiting;
    _Alignas(8) uint8_t piece[BSLAM_FLASH_PIECE];
} writer_t;

static bool flush(writer_t *writer)
{
    memset(&writer->piece[writer->waiting], ERASED, BSLAM_FLASH_PIECE - writer->waiting);
    const bool done = writer->flash->write(writer->flash->context, writer->slot, writer->at, writer->piece,
                                           BSLAM_FLASH_PIECE);
    writer->at += BSLAM_FLASH_PIECE;
    writer->waiting = 0;
    return done;
}

static bool write_piece(void *context, const void *bytes, uint32_t count)
{
    writer_t *writer = context;
    const uint8_t *from = bytes;
    for (uint32_t i = 0; i < count; i++) {
        writer->piece[writer->waiting] = from[i];
        writer->waiting++;
        if (writer->waiting == BSLAM_FLASH_PIECE && !flush(writer)) {
            return false;
        }
    }
    return true;
}

/// Writes the map behind the head, and looks whether it is there.
static bslam_map_fault_t write_map(const slot_t *slot, const bslam_slam_t *slam)
{
    writer_t writer = {.flash = slot->flash, .slot = slot->number, .at = MAP_AT};
    const bslam_map_sink_t sink = {write_piece, &writer};
    bslam_map_fault_t fault;
    if (bslam_map_write(slam, &sink, &fault) != BSLAM_OK) {
        return fault;
    }
    if (writer.waiting > 0 && !flush(&writer)) {
        return BSLAM_MAP_UNREADABLE;
    }
    const bslam_map_source_t source = source_of(slot);
    return bslam_map_check(&source);
}

bslam_status_t bslam_slots_save(const bslam_flash_t *flash, const bslam_slam_t *slam,
                                bslam_map_fault_t *fault)
{
    slot_t slots[BSLAM_SLOTS];
    find_slots(flash, slots);
    const bool newer_is_whole = slots[0].fault == BSLAM_MAP_FINE;
    slot_t *slot = newer_is_whole || slots[1].fault != BSLAM_MAP_FINE ? &slots[1] : &slots[0];
    const uint32_t sequence = slots[0].has_head ? slots[0].sequence + 1 : 1;
    _Alignas(8) uint8_t head[BSLAM_FLASH_PIECE];
    memset(head, ERASED, sizeof head);
    *fault = BSLAM_MAP_UNREADABLE;
    slot->length = bslam_map_size(slam);
    fill_head(head, sequence, slot->length);
    if (!has_room(flash, slot->length) || !flash->erase(flash->context, slot->number)) {
        return BSLAM_E_MAP;
    }
    *fault = write_map(slot, slam);
    if (*fault == BSLAM_MAP_FINE && !flash->write(flash->context, slot->number, 0, head, sizeof head)) {
        *fault = BSLAM_MAP_UNREADABLE;
    }
    return *fault == BSLAM_MAP_FINE ? BSLAM_OK : BSLAM_E_MAP;
}

// ---- loading ----------------------------------------------------------------------------------------------

bslam_status_t bslam_slots_load(const bslam_flash_t *flash, bslam_slam_t *slam, bslam_map_mode_t mode,
                                bslam_map_fault_t *fault)
{
    slot_t slots[BSLAM_SLOTS];
    find_slots(flash, slots);
    bslam_status_t status = BSLAM_E_MAP;
    // One that looks whole may be refused yet: because it can no longer be read.
    for (int s = 0; s < BSLAM_SLOTS && status != BSLAM_OK; s++) {
        const bslam_map_source_t source = source_of(&slots[s]);
        if (slots[s].fault == BSLAM_MAP_FINE) {
            status = bslam_map_load(slam, &source, mode, &slots[s].fault);
        }
    }
    *fault = status == BSLAM_OK ? BSLAM_MAP_FINE : slots[0].fault;
    return status;
}
