/// A process on this computer: bytes over standard input and output. For tests of the application, under the
/// sanitizers, without an emulator. With the environment variable BSLAM_ENCODERS set it is a robot whose
/// wheels turn steadily, one 4/3 as fast as the other.
#define _POSIX_C_SOURCE 200809L

#include "port/port.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

void port_init(void)
{
}

#define STEP_MS 10

/// Waits, where a board would return at once: for what comes next, or where there are encoders for the time
/// of their reading. The end of the input is the end.
int port_read(void)
{
    uint8_t byte = 0;
    struct pollfd waiting = {.fd = STDIN_FILENO, .events = POLLIN};
    if (getenv("BSLAM_ENCODERS") != NULL && poll(&waiting, 1, STEP_MS) == 0) {
        return -1;
    }
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
    static uint32_t readings;
    if (getenv("BSLAM_ENCODERS") == NULL) {
        return false;
    }
    readings++;
    *left_ticks = 3 * readings & 0xffffu;
    *right_ticks = 4 * readings & 0xffffu;
    return true;
}

/// The file that the environment variable BSLAM_STORE names.
bool port_save(const uint8_t *bytes, size_t count)
{
    const char *path = getenv("BSLAM_STORE");
    const int file = path != NULL ? open(path, O_WRONLY | O_CREAT | O_TRUNC, 0644) : -1;
    return file >= 0 && write(file, bytes, count) == (ssize_t)count && close(file) == 0;
}

bool port_load(uint8_t *bytes, size_t count)
{
    const char *path = getenv("BSLAM_STORE");
    const int file = path != NULL ? open(path, O_RDONLY) : -1;
    return file >= 0 && read(file, bytes, count) == (ssize_t)count && close(file) == 0;
}

void port_exit(int status)
{
    exit(status);
}
