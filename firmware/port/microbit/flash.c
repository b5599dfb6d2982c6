/// What the micro:bit keeps: the last two pages of the nRF51822's flash. Nordic's nRF51 reference manual,
/// chapter "NVMC". QEMU's board has them.
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
#define FIRST_ADDRESS 0x3f800u

static uint32_t place(int slot, uint32_t at)
{
    return FIRST_ADDRESS + (uint32_t)slot * PAGE_BYTES + at;
}

static void configure(uint32_t config)
{
    while (NVMC_READY == 0) {
    }
    NVMC_CONFIG = config;
}

static bool erase(void *context, int slot)
{
    (void)context;
    configure(CONFIG_ERASE);
    NVMC_ERASEPAGE = place(slot, 0);
    configure(CONFIG_READ);
    return true;
}

static bool write(void *context, int slot, uint32_t at, const void *bytes, uint32_t count)
{
    (void)context;
    configure(CONFIG_WRITE);
    for (uint32_t i = 0; i < count; i += sizeof(uint32_t)) {
        uint32_t word;
        memcpy(&word, (const uint8_t *)bytes + i, sizeof word);
        REGISTER(place(slot, at + i)) = word;
        while (NVMC_READY == 0) {
        }
    }
    configure(CONFIG_READ);
    return true;
}

static bool read(void *context, int slot, uint32_t at, void *bytes, uint32_t count)
{
    (void)context;
    memcpy(bytes, (const void *)place(slot, at), count);
    return true;
}

static const bslam_flash_t flash = {.erase = erase, .write = write, .read = read, .slot_bytes = PAGE_BYTES};

const bslam_flash_t *port_flash(void)
{
    return &flash;
}
