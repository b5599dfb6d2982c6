/// What the robot needs of FreeRTOS (app/rtos/robot_rtos.c): two tasks and a queue in static memory, on the
/// port's clock and vectors.
#ifndef FREERTOS_CONFIG_H
#define FREERTOS_CONFIG_H

#include "port/port.h"

#define configCPU_CLOCK_HZ port_ticks_hz()
#define configTICK_RATE_HZ 1000
#define configTICK_TYPE_WIDTH_IN_BITS TICK_TYPE_WIDTH_32_BITS
#define configUSE_PREEMPTION 1
#define configMAX_PRIORITIES 3
#define configMINIMAL_STACK_SIZE 128
#define configUSE_IDLE_HOOK 0
#define configUSE_TICK_HOOK 0
#define configSUPPORT_STATIC_ALLOCATION 1
#define configSUPPORT_DYNAMIC_ALLOCATION 0
#define configKERNEL_PROVIDED_STATIC_MEMORY 1
#define configUSE_TIMERS 0
#define configCHECK_FOR_STACK_OVERFLOW 2
#define configMAX_TASK_NAME_LEN 8

/// A port's interrupts call nothing of the kernel's, so they may have the highest priority, which is theirs
/// at reset.
#define configPRIO_BITS 3
#define configKERNEL_INTERRUPT_PRIORITY (7 << (8 - configPRIO_BITS))
#define configMAX_SYSCALL_INTERRUPT_PRIORITY (1 << (8 - configPRIO_BITS))

#define INCLUDE_vTaskDelay 1
#define INCLUDE_vTaskDelayUntil 1

/// The kernel's handlers take the names that start.c and systick.c look for.
#define vPortSVCHandler svc_interrupt
#define xPortPendSVHandler pendsv_interrupt
#define xPortSysTickHandler systick_hook

#define configASSERT(good) \
    do { \
        if (!(good)) { \
            port_exit(71); \
        } \
    } while (0)

#endif
