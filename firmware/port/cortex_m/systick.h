/// Time from SysTick, the timer that a Cortex-M has; an M0 or M0+ may be without.
#ifndef PORT_CORTEX_M_SYSTICK_H
#define PORT_CORTEX_M_SYSTICK_H

#include <stdint.h>

/// Starts it on the core's clock.
void systick_start(void);

/// Ticks of that clock since then.
uint64_t systick_ticks(void);

#endif
