/// A process on this computer: bytes over standard input and output. For tests of the application, under the
/// sanitizers, without an emulator. BSLAM_FILM in the environment names a film that moves
/// its robot.
#define _POSIX_C_SOURCE 200809L

#include "bslam/bslam.h"
#include "port/film.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static bool has_film;
static int64_t start_us;

static int64_t now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

void port_init(void)
{
    start_us = now_us();
    const char *path = getenv("BSLAM_FILM");
    struct stat about;
    const int file = path != NULL ? open(path, O_RDONLY) : -1;
    if (file >= 0 && fstat(file, &about) == 0) {
        const void *film = mmap(NULL, (size_t)about.st_size, PROT_READ, MAP_PRIVATE, file, 0);
        has_film = film != MAP_FAILED;
        if (has_film) {
            film_start(film);
        }
    }
}

/// Waits, where a board would return at once: for what comes next, with a film for a moment only. The end of
/// the input is the end.
int port_read(void)
{
    uint8_t byte = 0;
    struct pollfd waiting = {.fd = STDIN_FILENO, .events = POLLIN};
    if (has_film && poll(&waiting, 1, 0) == 0) {
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
    return now_us() - start_us;
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

// ---- flash for a map: the file that the environment variable BSLAM_MAP names
// -------------------------------

#define SLOT_BYTES 65536

static int map_file = -1;

static off_t place(int slot, uint32_t at)
{
    return (off_t)slot * SLOT_BYTES + (off_t)at;
}

static bool erase(void *context, int slot)
{
    (void)context;
    uint8_t blank[SLOT_BYTES];
    memset(blank, 0xff, sizeof blank);
    return pwrite(map_file, blank, sizeof blank, place(slot, 0)) == (ssize_t)sizeof blank;
}

static bool write_flash(void *context, int slot, uint32_t at, const void *bytes, uint32_t count)
{
    (void)context;
    return pwrite(map_file, bytes, count, place(slot, at)) == (ssize_t)count;
}

static bool read_flash(void *context, int slot, uint32_t at, void *bytes, uint32_t count)
{
    (void)context;
    return pread(map_file, bytes, count, place(slot, at)) == (ssize_t)count;
}

const bslam_flash_t *port_map_flash(void)
{
    static const bslam_flash_t flash = {erase, write_flash, read_flash, NULL, SLOT_BYTES};
    const char *path = getenv("BSLAM_MAP");
    if (path != NULL && map_file < 0) {
        map_file = open(path, O_RDWR | O_CREAT, 0644);
    }
    return map_file >= 0 ? &flash : NULL;
}

void port_exit(int status)
{
    exit(status);
}
