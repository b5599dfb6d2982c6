/// The way out for an image that runs under an emulator or a debugger: port_exit, where a board has none.
#ifndef PORT_CORTEX_M_SEMIHOSTING_H
#define PORT_CORTEX_M_SEMIHOSTING_H

/// Ends the emulator with this exit status.
_Noreturn void semihosting_exit(int status);

#endif
