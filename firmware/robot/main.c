/// The example application: a robot whose encoders, gyro and cameras, if the port has any, and whose host,
/// over the link, feed the filter; pose, map and accounts go back over the link.
#include "robot/session.h"
#include "port/port.h"

PORT_KEPT static session_t session;

static void take_bytes(void)
{
    int byte = port_read();
    while (byte >= 0) {
        session_take(&session, (uint8_t)byte);
        byte = port_read();
    }
}

static void take_reading(void)
{
    bslam_odometry_reading_t reading;
    if (session_read_body(&reading)) {
        session_take_reading(&session, &reading);
    }
}

static void take_camera(void)
{
#if SESSION_VISION
    port_row_t row;
    if (port_camera_row(&row)) {
        session_take_row(&session, &row);
    }
#endif
}

int main(void)
{
    port_init();
    session_init(&session);
    for (;;) {
        take_bytes();
        take_reading();
        take_camera();
        port_watchdog();
    }
}
