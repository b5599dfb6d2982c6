/// QEMU's `virt` machine: a 16550 UART, the core-local timer at 10 MHz, a register that ends the emulator. A
/// board without a robot: what a robot would measure comes over the link, or from a film at FILM_ADDRESS.
#include "port/film.h"

#define BYTE(address) (*(volatile uint8_t *)(address))
#define WORD(address) (*(volatile uint32_t *)(address))

#define UART_DATA BYTE(0x10000000u)
#define UART_STATE BYTE(0x10000005u)
#define STATE_RECEIVED 1u
#define STATE_MAY_SEND 0x20u
#define TIME_LOW WORD(0x0200bff8u)
#define TIME_HIGH WORD(0x0200bffcu)
#define TIME_HZ 10000000u
#define END WORD(0x00100000u)
#define END_GOOD 0x5555u
#define END_FAILED 0x3333u

void port_init(void)
{
    film_start((const film_t *)FILM_ADDRESS);
}

int port_read(void)
{
    return (UART_STATE & STATE_RECEIVED) != 0 ? (int)UART_DATA : -1;
}

void port_write(const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        while ((UART_STATE & STATE_MAY_SEND) == 0) {
        }
        UART_DATA = bytes[i];
    }
}

static uint64_t ticks(void)
{
    uint32_t high;
    uint32_t low;
    do {  // again, if the low word rolled over in between
        high = TIME_HIGH;
        low = TIME_LOW;
    } while (high != TIME_HIGH);
    return (uint64_t)high << 32 | low;
}

int64_t port_time_us(void)
{
    return (int64_t)(ticks() / (TIME_HZ / 1000000u));
}

uint32_t port_ticks(void)
{
    return (uint32_t)ticks();
}

uint32_t port_ticks_hz(void)
{
    return TIME_HZ;
}

void port_exit(int status)
{
    END = status == 0 ? END_GOOD : (uint32_t)status << 16 | END_FAILED;
    for (;;) {
    }
}
