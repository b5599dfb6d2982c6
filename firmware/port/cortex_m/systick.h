/// Time from SysTick, the timer that a Cortex-M has; an M0 or M0+ may be without. A board whose board.mk says
/// its core's clock, -DCORE_HZ, has port_time_us, port_ticks and port_ticks_hz from here.
#ifndef PORT_CORTEX_M_SYSTICK_H
#define PORT_CORTEX_M_SYSTICK_H

#include <stdint.h>

/// Starts it on the core's clock.
void systick_start(void);

/// Ticks of that clock since then.
uint64_t systick_ticks(void);

/// From now on systick_hook is called every so many ticks, at most 2^24: an operating system's clock.
void systick_every(uint32_t ticks);

/// Does nothing unless a program has one of its own.
void systick_hook(void);

#endif
