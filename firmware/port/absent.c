/// What a board has not got: the linker takes these where a port has no function of that name. Wheels and
/// camera are then the film's, if the port has put one in.
#include "port/film.h"

#define ABSENT __attribute__((weak))

ABSENT void port_watchdog(void)
{
}

ABSENT bool port_encoders(int64_t *time_us, uint32_t *left_ticks, uint32_t *right_ticks)
{
    return film_encoders(port_time_us(), time_us, left_ticks, right_ticks);
}

ABSENT bool port_gyro(float *rate_radps)
{
    return film_gyro(rate_radps);
}

ABSENT const struct bslam_camera *port_cameras(int *count)
{
    return film_cameras(count);
}

ABSENT bool port_camera_row(port_row_t *row)
{
    return film_row(row);
}

ABSENT const struct bslam_flash *port_flash(void)
{
    return NULL;
}

ABSENT const struct bslam_flash *port_map_flash(void)
{
    return NULL;
}
