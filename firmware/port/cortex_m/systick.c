#include "port/cortex_m/systick.h"

/// Counts down from RELOAD to 0, then interrupts and starts over.
#define RELOAD 0xffffffu
#define CONTROL (*(volatile uint32_t *)0xe000e010u)
#define LOAD (*(volatile uint32_t *)0xe000e014u)
#define VALUE (*(volatile uint32_t *)0xe000e018u)
#define ENABLE_INTERRUPT_CORE_CLOCK 7u

static volatile uint32_t rounds;

void systick_interrupt(void);

void systick_interrupt(void)
{
    rounds++;
}

void systick_start(void)
{
    LOAD = RELOAD;
    VALUE = 0;
    CONTROL = ENABLE_INTERRUPT_CORE_CLOCK;
}

uint64_t systick_ticks(void)
{
    uint32_t before;
    uint32_t value;
    do {  // again, if a round ended in between
        before = rounds;
        value = VALUE;
    } while (before != rounds);
    return (uint64_t)before << 24 | (RELOAD - value);
}
