/// From reset to main(), for every Cortex-M: the vector table, memory, the FPU. The linker script
/// (sections.ld) gives the addresses.
#include <stdint.h>

#include "port/port.h"

extern uint32_t start_stack_top[];
extern uint32_t start_data_load[], start_data[], start_data_end[];
extern uint32_t start_bss[], start_bss_end[];

int main(void);
void systick_interrupt(void);
void start_reset(void);
void port_interrupt(void);
void svc_interrupt(void);
void pendsv_interrupt(void);
static void fault(void);

#define EXCEPTIONS 16
#define INTERRUPTS 112

/// An entry is an address, of code but for the first.
typedef union vector {
    uint32_t *stack;
    void (*handler)(void);
} vector_t;

__attribute__((section(".vectors"), used)) static const vector_t vectors[EXCEPTIONS + INTERRUPTS] = {
    [0] = {.stack = start_stack_top},      [1] = {.handler = start_reset},
    [2 ... 10] = {.handler = fault},       [11] = {.handler = svc_interrupt},
    [12 ... 13] = {.handler = fault},      [14] = {.handler = pendsv_interrupt},
    [15] = {.handler = systick_interrupt}, [16 ... EXCEPTIONS + INTERRUPTS - 1] = {.handler = port_interrupt},
};

#if defined(__ARM_FP)
static void enable_fpu(void)
{
    volatile uint32_t *const cpacr = (volatile uint32_t *)0xe000ed88u;
    *cpacr |= 0xfu << 20;
    __asm__ volatile("dsb\n isb" ::: "memory");
}
#endif

/// A fault has no one to report to but the host: end, with a status of its own.
static void fault(void)
{
    port_exit(70);
}

/// A port that enables an interrupt has a handler of its own.
__attribute__((weak)) void port_interrupt(void)
{
    fault();
}

/// So have these an operating system.
__attribute__((weak)) void svc_interrupt(void)
{
    fault();
}

__attribute__((weak)) void pendsv_interrupt(void)
{
    fault();
}

void start_reset(void)
{
    const uint32_t *from = start_data_load;
    for (uint32_t *to = start_data; to < start_data_end; to++, from++) {
        *to = *from;
    }
    for (uint32_t *to = start_bss; to < start_bss_end; to++) {
        *to = 0;
    }
#if defined(__ARM_FP)
    enable_fpu();
#endif
    port_exit(main());
}
