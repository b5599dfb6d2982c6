/// What a board gives to the application: all that a port is. docs/PORTING.md says how to write one.
///
/// Whatever a board has not got it leaves out: port/absent.c says so for it. A misspelt name does not pass
/// for left out, since -Wmissing-prototypes refuses it.
#ifndef PORT_PORT_H
#define PORT_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/// Clocks, the serial line, the timer. Called once, first.
void port_init(void);

/// The next byte that came over the serial line, or -1 if none waits. Never blocks.
int port_read(void);

/// Sends bytes over the serial line; returns when the last one is on its way.
void port_write(const uint8_t *bytes, size_t count);

/// Microseconds since the start. Never goes back.
int64_t port_time_us(void);

/// A counter that runs up, modulo 2^32, and its rate: to measure what a step costs. A rate of 0: there is
/// none.
uint32_t port_ticks(void);
uint32_t port_ticks_hz(void);

/// Of a variable: it outlasts a reset, since the start-up code of a board leaves it as it is.
#if defined(__unix__)
#define PORT_KEPT
#else
#define PORT_KEPT __attribute__((noinit))
#endif

/// PORT_BUILD_ID_BYTES bytes that no other image has.
#define PORT_BUILD_ID_BYTES 20
const uint8_t *port_build_id(void);

/// The end: resets a robot; under an emulator ends it with this exit status.
_Noreturn void port_exit(int status);

// ---- what a board may leave out ---------------------------------------------------------------------------

/// Tells the watchdog that the main loop is alive.
void port_watchdog(void);

/// The counters of both wheel encoders, as they were at *time_us, if the robot has them and a reading is due.
/// They may roll over.
bool port_encoders(int64_t *time_us, uint32_t *left_ticks, uint32_t *right_ticks);

/// How fast the robot turns by its gyro, to the left: the mean since the reading before. Asked right after
/// each reading. False: it has none, or cannot tell now.
bool port_gyro(float *rate_radps);

/// The robot's cameras, as vision/vision.h describes them, and how many there are.
struct bslam_camera;
const struct bslam_camera *port_cameras(int *count);

/// A row of a picture. A camera's rows come from the uppermost to the lowest one; no two pictures overlap.
typedef struct port_row {
    const uint16_t *pixels;  ///< RGB565, as many as the camera's picture is wide; good until the next call
    int64_t time_us;         ///< when the picture was taken: the same for all its rows
    int camera;
    bool is_first;
    bool is_last;
} port_row_t;

/// The next row, if one has come.
bool port_camera_row(port_row_t *row);

/// Two areas of flash for what port_save keeps, as bslam/bslam.h, bslam_flash_t describes them.
struct bslam_flash;
const struct bslam_flash *port_flash(void);

/// Keeps bytes over a restart, the same number at each call, a few hundred; and gives them back. False: the
/// board has no memory for that, it failed, or nothing was ever kept. port/kept.c has both for every board.
bool port_save(const uint8_t *bytes, size_t count);
bool port_load(uint8_t *bytes, size_t count);

/// Two areas of flash for a map (bslam/bslam.h, bslam_flash_t); NULL: the board keeps none.
const struct bslam_flash *port_map_flash(void);

#endif
