/// What the STM32F405 keeps: parameters in sectors 10 and 11, the last 256 KB of its flash, a map in sectors
/// 8 and 9 before them. ST's RM0090, section 3. An erase takes the core up to two seconds, in which nothing
/// runs: save at a standstill.
///
/// QEMU's flash cannot be written: what is kept is read back there, and found missing.
#include "port/kept.h"

#include <string.h>

#include "port/port.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define FLASH_ACR REGISTER(0x40023c00u)
#define FLASH_KEYR REGISTER(0x40023c04u)
#define FLASH_SR REGISTER(0x40023c0cu)
#define FLASH_CR REGISTER(0x40023c10u)

#define SR_ERRORS 0xf2u
#define SR_BUSY (1u << 16)
#define CR_PROGRAM 1u
#define CR_ERASE_SECTOR 2u
#define CR_SECTOR(number) ((uint32_t)(number) << 3)
#define CR_WORDS (2u << 8)  // 32 bits at a time: 2.7 V or more
#define CR_START (1u << 16)
#define CR_LOCK (1u << 31)
#define ACR_DATA_CACHE (1u << 10)
#define ACR_DATA_CACHE_RESET (1u << 12)

#define SECTOR_BYTES 0x20000u

/// Two slots, a sector each.
typedef struct area {
    int first_sector;
    uint32_t first_address;
} area_t;

static const area_t params_area = {10, 0x080c0000u};
static const area_t map_area = {8, 0x08080000u};

static uint32_t place(const area_t *area, int slot, uint32_t at)
{
    return area->first_address + (uint32_t)slot * SECTOR_BYTES + at;
}

static void unlock(uint32_t what)
{
    FLASH_KEYR = 0x45670123u;
    FLASH_KEYR = 0xcdef89abu;
    FLASH_SR = SR_ERRORS;  // those of before
    FLASH_CR = what;
}

/// Waits for the end and locks the flash. False: it reports an error.
static bool lock(void)
{
    while ((FLASH_SR & SR_BUSY) != 0) {
    }
    const bool good = (FLASH_SR & SR_ERRORS) == 0;
    FLASH_CR = CR_LOCK;
    return good;
}

static bool erase(void *context, int slot)
{
    const area_t *area = context;
    port_watchdog();
    const uint32_t what = CR_ERASE_SECTOR | CR_SECTOR(area->first_sector + slot) | CR_WORDS;
    unlock(what);
    FLASH_CR = what | CR_START;
    const bool good = lock();
    FLASH_ACR &= ~ACR_DATA_CACHE;  // it may hold what was there before
    FLASH_ACR |= ACR_DATA_CACHE_RESET;
    FLASH_ACR &= ~ACR_DATA_CACHE_RESET;
    FLASH_ACR |= ACR_DATA_CACHE;
    return good;
}

static bool write(void *context, int slot, uint32_t at, const void *bytes, uint32_t count)
{
    unlock(CR_PROGRAM | CR_WORDS);
    for (uint32_t i = 0; i < count; i += sizeof(uint32_t)) {
        uint32_t word;
        memcpy(&word, (const uint8_t *)bytes + i, sizeof word);
        REGISTER(place(context, slot, at + i)) = word;
        while ((FLASH_SR & SR_BUSY) != 0) {
        }
    }
    return lock();
}

static bool read(void *context, int slot, uint32_t at, void *bytes, uint32_t count)
{
    memcpy(bytes, (const void *)place(context, slot, at), count);
    return true;
}

static const bslam_flash_t params_flash = {erase, write, read, (void *)&params_area, SECTOR_BYTES};
static const bslam_flash_t map_flash = {erase, write, read, (void *)&map_area, SECTOR_BYTES};

const bslam_flash_t *port_flash(void)
{
    return &params_flash;
}

const bslam_flash_t *port_map_flash(void)
{
    return &map_flash;
}
