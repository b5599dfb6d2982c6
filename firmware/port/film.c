#include "port/film.h"

#include <math.h>

#define COUNTER_MASK 0xffffu

static const film_t *film;  // NULL: there is none
static uint32_t next_step;
static float gyro_radps;  // of the last reading
static int64_t last_us;
static uint32_t left;
static uint32_t right;
static const uint16_t *next_row;  // of the picture that is being taken; NULL: none is
static int32_t rows_taken;

void film_start(const film_t *there)
{
    const bool good = there->magic == FILM_MAGIC && there->steps > 0 && there->steps <= FILM_STEPS_MAX &&
                      (there->pictures == 0 || bslam_camera_check(&there->camera) == BSLAM_OK);
    film = good ? there : NULL;
}

static const film_step_t *film_steps(void)
{
    return (const film_step_t *)(film + 1);
}

static void take_picture(uint32_t number)
{
    if (number == 0 || number > film->pictures) {
        return;
    }
    const uint16_t *pictures = (const uint16_t *)(film_steps() + film->steps);
    next_row = pictures + (size_t)film->camera.width_px * (size_t)film->camera.height_px * (number - 1);
    rows_taken = 0;
}

bool film_encoders(int64_t now_us, int64_t *time_us, uint32_t *left_ticks, uint32_t *right_ticks)
{
    if (film == NULL || next_row != NULL || last_us + film->step_us > now_us) {
        return false;
    }
    const film_step_t *step = &film_steps()[next_step];
    next_step = (next_step + 1) % film->steps;
    last_us += film->step_us;
    left = (left + step->left_ticks) & COUNTER_MASK;
    right = (right + step->right_ticks) & COUNTER_MASK;
    gyro_radps = step->gyro_radps;
    take_picture(step->picture);
    *time_us = last_us;
    *left_ticks = left;
    *right_ticks = right;
    return true;
}

bool film_gyro(float *rate_radps)
{
    if (film == NULL || isnan(gyro_radps)) {
        return false;
    }
    *rate_radps = gyro_radps;
    return true;
}

const bslam_camera_t *film_cameras(int *count)
{
    *count = film != NULL && film->pictures > 0 ? 1 : 0;
    return *count > 0 ? &film->camera : NULL;
}

bool film_row(port_row_t *row)
{
    if (next_row == NULL) {
        return false;
    }
    *row = (port_row_t){.pixels = next_row, .time_us = last_us, .is_first = rows_taken == 0};
    rows_taken++;
    row->is_last = rows_taken == film->camera.height_px;
    next_row = row->is_last ? NULL : next_row + film->camera.width_px;
    return true;
}
