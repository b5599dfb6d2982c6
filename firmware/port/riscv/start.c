/// From reset to main(), for a RISC-V core in machine mode: stack, FPU, memory. The linker script
/// (sections.ld) gives the addresses. No interrupt is enabled.
#include <stdint.h>

#include "port/port.h"

extern uint32_t start_data_load[], start_data[], start_data_end[];
extern uint32_t start_bss[], start_bss_end[];

int main(void);
void start_reset(void);
_Noreturn void start_c(void);
void trap(void);

/// An exception has no one to report to but the host: end, with a status of its own.
__attribute__((aligned(4), used)) void trap(void)
{
    port_exit(70);
}

/// mstatus.FS = initial, fcsr = 0: round to nearest.
__attribute__((naked, section(".vectors"), used)) void start_reset(void)
{
    __asm__ volatile("la sp, start_stack_top\n"
                     "la t0, trap\n"
                     "csrw mtvec, t0\n"
                     "li t0, 0x2000\n"
                     "csrs mstatus, t0\n"
                     "csrw fcsr, zero\n"
                     "j start_c\n");
}

__attribute__((used)) void start_c(void)
{
    const uint32_t *from = start_data_load;
    for (uint32_t *to = start_data; to < start_data_end; to++, from++) {
        *to = *from;
    }
    for (uint32_t *to = start_bss; to < start_bss_end; to++) {
        *to = 0;
    }
    port_exit(main());
}
