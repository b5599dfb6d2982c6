#include "port/kept.h"

#include <string.h>

#include "base/crc32.h"
#include "port/port.h"

#define MAGIC 0x5450454bu  // "KEPT"

/// Before the bytes, and written after them: what makes them count.
typedef struct head {
    uint32_t magic;
    uint32_t sequence;
    uint32_t count;
    uint32_t crc;  ///< over sequence, count and the bytes
} head_t;

_Static_assert(sizeof(head_t) <= BSLAM_FLASH_PIECE, "a head is one piece");

/// Bytes of the piece that begins at `at`.
static uint32_t piece_at(uint32_t at, uint32_t count)
{
    return count - at < BSLAM_FLASH_PIECE ? count - at : BSLAM_FLASH_PIECE;
}

static uint32_t crc_of_head(const head_t *head)
{
    return bslam_crc32_add(BSLAM_CRC32_START, (const uint8_t *)&head->sequence, 2 * sizeof(uint32_t));
}

/// Whether a slot holds `count` whole bytes.
static bool read_head(const bslam_flash_t *flash, int slot, uint32_t count, head_t *head)
{
    if (!flash->read(flash->context, slot, 0, head, sizeof *head) || head->magic != MAGIC ||
        head->count != count) {
        return false;
    }
    uint32_t crc = crc_of_head(head);
    for (uint32_t at = 0; at < count; at += BSLAM_FLASH_PIECE) {
        uint8_t piece[BSLAM_FLASH_PIECE];
        const uint32_t size = piece_at(at, count);
        if (!flash->read(flash->context, slot, BSLAM_FLASH_PIECE + at, piece, size)) {
            return false;
        }
        crc = bslam_crc32_add(crc, piece, size);
    }
    return head->crc == ~crc;
}

/// The slot with what was kept last, and its sequence number; -1 and 0: none is whole. Numbers roll over.
static int find_newest(const bslam_flash_t *flash, uint32_t count, uint32_t *sequence)
{
    int newest = -1;
    *sequence = 0;
    for (int slot = 0; slot < BSLAM_SLOTS; slot++) {
        head_t head;
        if (read_head(flash, slot, count, &head) &&
            (newest < 0 || head.sequence - *sequence < UINT32_MAX / 2)) {
            newest = slot;
            *sequence = head.sequence;
        }
    }
    return newest;
}

static bool write_piece(const bslam_flash_t *flash, int slot, uint32_t at, const void *bytes, uint32_t count)
{
    _Alignas(8) uint8_t piece[BSLAM_FLASH_PIECE];
    memset(piece, 0xff, sizeof piece);
    memcpy(piece, bytes, count);
    return flash->write(flash->context, slot, at, piece, sizeof piece);
}

static bool write_bytes(const bslam_flash_t *flash, int slot, const uint8_t *bytes, uint32_t count)
{
    bool done = true;
    for (uint32_t at = 0; at < count && done; at += BSLAM_FLASH_PIECE) {
        done = write_piece(flash, slot, BSLAM_FLASH_PIECE + at, bytes + at, piece_at(at, count));
    }
    return done;
}

bool kept_save(const bslam_flash_t *flash, const uint8_t *bytes, uint32_t count)
{
    uint32_t sequence;
    const int slot = find_newest(flash, count, &sequence) == 0 ? 1 : 0;
    head_t head = {.magic = MAGIC, .sequence = sequence + 1, .count = count};
    head.crc = ~bslam_crc32_add(crc_of_head(&head), bytes, count);
    head_t written;
    return count + 2 * BSLAM_FLASH_PIECE <= flash->slot_bytes && flash->erase(flash->context, slot) &&
           write_bytes(flash, slot, bytes, count) && write_piece(flash, slot, 0, &head, sizeof head) &&
           read_head(flash, slot, count, &written) && memcmp(&written, &head, sizeof head) == 0;
}

bool kept_load(const bslam_flash_t *flash, uint8_t *bytes, uint32_t count)
{
    uint32_t sequence;
    const int slot = find_newest(flash, count, &sequence);
    return slot >= 0 && flash->read(flash->context, slot, BSLAM_FLASH_PIECE, bytes, count);
}

bool port_save(const uint8_t *bytes, size_t count)
{
    const bslam_flash_t *flash = port_flash();
    return flash != NULL && kept_save(flash, bytes, (uint32_t)count);
}

bool port_load(uint8_t *bytes, size_t count)
{
    const bslam_flash_t *flash = port_flash();
    return flash != NULL && kept_load(flash, bytes, (uint32_t)count);
}
