@ From reset to main(): vectors, the floating-point unit, initial values of variables.
    .syntax unified
    .cpu cortex-m4
    .thumb

    .section .vectors, "a"
    .word stack_top, reset
    .rept 14 + 38
    .word stop
    .endr
    .word usart2_interrupt

    .text
    .global reset
    .thumb_func
reset:
    ldr r0, =0xe000ed88
    ldr r1, [r0]
    orr r1, #0xf00000
    str r1, [r0]
    dsb
    isb
    ldr r0, =data_begin
    ldr r1, =data_end
    ldr r2, =data_in_flash
1:  cmp r0, r1
    ittt lo
    ldrlo r3, [r2], #4
    strlo r3, [r0], #4
    blo 1b
    ldr r0, =bss_begin
    ldr r1, =bss_end
    movs r2, #0
2:  cmp r0, r1
    itt lo
    strlo r2, [r0], #4
    blo 2b
    bl main
    .thumb_func
stop:
    b stop
