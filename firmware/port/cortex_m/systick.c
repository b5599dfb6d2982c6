#include "port/cortex_m/systick.h"

#include "port/port.h"

#define CONTROL (*(volatile uint32_t *)0xe000e010u)
#define LOAD (*(volatile uint32_t *)0xe000e014u)
#define VALUE (*(volatile uint32_t *)0xe000e018u)
#define ENABLE_INTERRUPT_CORE_CLOCK 7u
#define PERIOD_MAX 0x1000000u

static volatile uint32_t rounds;
static uint32_t period;  // counts down from period - 1 to 0, then interrupts and starts over
static uint64_t before;  // ticks before the present period was set

void systick_interrupt(void);

void systick_interrupt(void)
{
    rounds++;
    systick_hook();
}

__attribute__((weak)) void systick_hook(void)
{
}

static void start(uint32_t ticks)
{
    CONTROL = 0;
    rounds = 0;
    period = ticks;
    LOAD = ticks - 1;
    VALUE = 0;
    CONTROL = ENABLE_INTERRUPT_CORE_CLOCK;
}

void systick_start(void)
{
    start(PERIOD_MAX);
}

void systick_every(uint32_t ticks)
{
    before = systick_ticks();
    start(ticks);
}

uint64_t systick_ticks(void)
{
    uint32_t at;
    uint32_t value;
    do {  // again, if a round ended in between
        at = rounds;
        value = VALUE;
    } while (at != rounds);
    return before + (uint64_t)at * period + (period - 1 - value);
}

#ifdef CORE_HZ

__attribute__((weak)) int64_t port_time_us(void)
{
    return (int64_t)(systick_ticks() / (CORE_HZ / 1000000u));
}

__attribute__((weak)) uint32_t port_ticks(void)
{
    return (uint32_t)systick_ticks();
}

__attribute__((weak)) uint32_t port_ticks_hz(void)
{
    return CORE_HZ;
}

#endif
