/// A process on this computer: bytes over standard input and output. For tests of the application, under the
/// sanitizers, without an emulator.
#define _POSIX_C_SOURCE 200809L

#include "port/port.h"

#include <stdlib.h>
#include <time.h>
#include <unistd.h>

void port_init(void)
{
}

/// Blocks, where a board would return at once: nothing else is to be done here. The end of the input is the
/// end.
int port_read(void)
{
    uint8_t byte = 0;
    if (read(STDIN_FILENO, &byte, 1) != 1) {
        exit(0);
    }
    return byte;
}

void port_write(const uint8_t *bytes, size_t count)
{
    while (count > 0) {
        const ssize_t sent = write(STDOUT_FILENO, bytes, count);
        if (sent <= 0) {
            exit(1);
        }
        bytes += sent;
        count -= (size_t)sent;
    }
}

int64_t port_time_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

uint32_t port_ticks(void)
{
    return 0;
}

uint32_t port_ticks_hz(void)
{
    return 0;
}

/// A process has none: its file is at hand.
const uint8_t *port_build_id(void)
{
    static const uint8_t none[PORT_BUILD_ID_BYTES];
    return none;
}

void port_watchdog(void)
{
}

bool port_encoders(uint32_t *left_ticks, uint32_t *right_ticks)
{
    (void)left_ticks;
    (void)right_ticks;
    return false;
}

void port_exit(int status)
{
    exit(status);
}
