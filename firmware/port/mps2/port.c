/// Arm's MPS2 boards as QEMU has them: AN385 (Cortex-M3), AN386 (M4F), AN500 (M7), AN505 (M33). They differ
/// in where the serial line is, UART_BASE, and MPS3's AN547 (M55) in its clock, CORE_HZ. Boards without a
/// robot: what a robot would measure comes over the link, or from a film at FILM_ADDRESS, the upper half of
/// RAM.
#include "port/cortex_m/systick.h"
#include "port/film.h"

/// The CMSDK UART.
typedef struct uart {
    uint32_t data;
    uint32_t state;
    uint32_t control;
    uint32_t interrupt;
    uint32_t baud_divider;
} uart_t;

#define UART ((volatile uart_t *)UART_BASE)
#define STATE_SEND_FULL 1u
#define STATE_RECEIVED 2u
#define CONTROL_SEND_AND_RECEIVE 3u
#define BAUD 115200u

void port_init(void)
{
    UART->baud_divider = CORE_HZ / BAUD;
    UART->control = CONTROL_SEND_AND_RECEIVE;
    systick_start();
    film_start((const film_t *)FILM_ADDRESS);
}

int port_read(void)
{
    return (UART->state & STATE_RECEIVED) != 0 ? (int)(UART->data & 0xffu) : -1;
}

void port_write(const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        while ((UART->state & STATE_SEND_FULL) != 0) {
        }
        UART->data = bytes[i];
    }
}
