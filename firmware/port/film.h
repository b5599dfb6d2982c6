/// A made-up body for a board without one: wheels that turn and a camera that sees as a film in memory says.
/// Emulated boards have their robot's readings and pictures from it; host_sim/bslam/target/film.py makes one.
#ifndef PORT_FILM_H
#define PORT_FILM_H

#include "vision/vision.h"
#include "port/port.h"

#define FILM_MAGIC 0x4d4c4946u  // "FILM"
#define FILM_STEPS_MAX 4096u

/// What happens at a reading: how far the encoders have turned since the one before, modulo 2^16, and the
/// picture that is taken, from 1 on; 0: none.
typedef struct film_step {
    uint16_t left_ticks;
    uint16_t right_ticks;
    uint32_t picture;
    float gyro_radps;  ///< NaN: no gyro tells
} film_step_t;

/// The film's head. Behind it: `steps` of film_step_t, then `pictures` pictures of the camera's size, RGB565.
typedef struct film {
    uint32_t magic;
    uint32_t step_us;
    uint32_t steps;
    uint32_t pictures;
    bslam_camera_t camera;
} film_t;

/// Puts in the film that lies at this address; what is no film there is none.
void film_start(const film_t *film);

/// As port_encoders, if the next reading's time has come by `now_us`. The film goes round and round, and its
/// counters have 16 bits. While a picture's rows are to be fetched no further reading is due: what a robot
/// makes of a film does not depend on how fast it is.
bool film_encoders(int64_t now_us, int64_t *time_us, uint32_t *left_ticks, uint32_t *right_ticks);

/// As port_gyro, of that reading.
bool film_gyro(float *rate_radps);

/// As port_cameras, port_camera_row.
const bslam_camera_t *film_cameras(int *count);
bool film_row(port_row_t *row);

#endif
