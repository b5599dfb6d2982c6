/// What the micro:bit keeps: parameters in the last two pages of the nRF51822's flash, a map in the six
/// before. Nordic's nRF51 reference manual, chapter "NVMC". QEMU's board has them.
#include "port/kept.h"

#include <string.h>

#include "port/port.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define NVMC_READY REGISTER(0x4001e400u)
#define NVMC_CONFIG REGISTER(0x4001e504u)
#define NVMC_ERASEPAGE REGISTER(0x4001e508u)

#define CONFIG_READ 0u
#define CONFIG_WRITE 1u
#define CONFIG_ERASE 2u

#define PAGE_BYTES 0x400u
#define MAP_SLOT_BYTES (3 * PAGE_BYTES)

// docs/MAP.md, "Two slots": a slot holds the largest map, whatever the robot comes to know.
enum {
    VALUES = 2 * BSLAM_BEACONS_MAX + 2 * BSLAM_RAYS_MAX,
    LARGEST_MAP_BYTES = 56 + 38 * BSLAM_BEACONS_MAX + 30 * VALUES + 2 * VALUES * VALUES
};
_Static_assert(BSLAM_FLASH_PIECE + LARGEST_MAP_BYTES <= MAP_SLOT_BYTES && !BSLAM_APPEARANCE,
               "a map may outgrow its slot: more pages, or fewer beacons or rays in board.mk");

/// Two slots, one after the other.
typedef struct area {
    uint32_t first;
    uint32_t slot_bytes;
} area_t;

static const area_t params_area = {0x3f800u, PAGE_BYTES};
static const area_t map_area = {0x3e000u, MAP_SLOT_BYTES};

static uint32_t place(const area_t *area, int slot, uint32_t at)
{
    return area->first + (uint32_t)slot * area->slot_bytes + at;
}

static void configure(uint32_t config)
{
    while (NVMC_READY == 0) {
    }
    NVMC_CONFIG = config;
}

static bool erase(void *context, int slot)
{
    const area_t *area = context;
    configure(CONFIG_ERASE);
    for (uint32_t at = 0; at < area->slot_bytes; at += PAGE_BYTES) {
        NVMC_ERASEPAGE = place(area, slot, at);
        while (NVMC_READY == 0) {
        }
    }
    configure(CONFIG_READ);
    return true;
}

static bool write(void *context, int slot, uint32_t at, const void *bytes, uint32_t count)
{
    configure(CONFIG_WRITE);
    for (uint32_t i = 0; i < count; i += sizeof(uint32_t)) {
        uint32_t word;
        memcpy(&word, (const uint8_t *)bytes + i, sizeof word);
        REGISTER(place(context, slot, at + i)) = word;
        while (NVMC_READY == 0) {
        }
    }
    configure(CONFIG_READ);
    return true;
}

static bool read(void *context, int slot, uint32_t at, void *bytes, uint32_t count)
{
    memcpy(bytes, (const void *)place(context, slot, at), count);
    return true;
}

static const bslam_flash_t params_flash = {erase, write, read, (void *)&params_area, PAGE_BYTES};
static const bslam_flash_t map_flash = {erase, write, read, (void *)&map_area, MAP_SLOT_BYTES};

const bslam_flash_t *port_flash(void)
{
    return &params_flash;
}

const bslam_flash_t *port_map_flash(void)
{
    return &map_flash;
}
