/// Time from SysTick, the timer that every Cortex-M has.
#ifndef PORT_CORTEX_M_SYSTICK_H
#define PORT_CORTEX_M_SYSTICK_H

#include <stdint.h>

/// Starts it on the core's clock.
void systick_start(void);

/// Ticks of that clock since then.
uint64_t systick_ticks(void);

#endif
