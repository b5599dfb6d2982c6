/// BBC micro:bit: UART on the USB chip (P0.24, P0.25) at 115200 baud, time from TIMER0. Registers as Nordic's
/// nRF51 reference manual has them. A board without a robot: what a robot would measure comes over the link.
#include "port/port.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))

#define CLOCK_TASKS_HFCLKSTART REGISTER(0x40000000u)
#define UART_TASKS_STARTRX REGISTER(0x40002000u)
#define UART_TASKS_STARTTX REGISTER(0x40002008u)
#define UART_EVENTS_RXDRDY REGISTER(0x40002108u)
#define UART_EVENTS_TXDRDY REGISTER(0x4000211cu)
#define UART_ENABLE REGISTER(0x40002500u)
#define UART_PSELTXD REGISTER(0x4000250cu)
#define UART_PSELRXD REGISTER(0x40002514u)
#define UART_RXD REGISTER(0x40002518u)
#define UART_TXD REGISTER(0x4000251cu)
#define UART_BAUDRATE REGISTER(0x40002524u)
#define TIMER_TASKS_START REGISTER(0x40008000u)
#define TIMER_TASKS_CAPTURE REGISTER(0x40008040u)
#define TIMER_BITMODE REGISTER(0x40008508u)
#define TIMER_PRESCALER REGISTER(0x40008510u)
#define TIMER_CC REGISTER(0x40008540u)

#define BAUD_115200 0x01d7e000u
#define TICKS_HZ 1000000u

static uint32_t last_ticks;
static uint32_t rounds;

void port_init(void)
{
    CLOCK_TASKS_HFCLKSTART = 1;
    UART_PSELTXD = 24;
    UART_PSELRXD = 25;
    UART_BAUDRATE = BAUD_115200;
    UART_ENABLE = 4;
    UART_TASKS_STARTRX = 1;
    UART_TASKS_STARTTX = 1;
    TIMER_BITMODE = 3;    // 32 bits
    TIMER_PRESCALER = 4;  // 16 MHz / 16
    TIMER_TASKS_START = 1;
}

/// The UART holds 6 bytes. A main loop without encoders reads them in time but during a step: the host waits
/// for its answer then.
int port_read(void)
{
    if (UART_EVENTS_RXDRDY == 0) {
        return -1;
    }
    UART_EVENTS_RXDRDY = 0;
    return (int)(UART_RXD & 0xffu);
}

void port_write(const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        UART_EVENTS_TXDRDY = 0;
        UART_TXD = bytes[i];
        while (UART_EVENTS_TXDRDY == 0) {
        }
    }
}

uint32_t port_ticks(void)
{
    TIMER_TASKS_CAPTURE = 1;
    return TIMER_CC;
}

uint32_t port_ticks_hz(void)
{
    return TICKS_HZ;
}

/// The main loop asks often enough to see each round of 71 minutes.
int64_t port_time_us(void)
{
    const uint32_t ticks = port_ticks();
    if (ticks < last_ticks) {
        rounds++;
    }
    last_ticks = ticks;
    return (int64_t)((uint64_t)rounds << 32 | ticks);
}

void port_watchdog(void)
{
    (void)port_time_us();
}
