/// The example application: a robot whose encoders, if the port has any, and whose host, over the link, feed
/// the filter; pose, map and accounts go back over the link.
#include "app/session.h"
#include "port/port.h"

static session_t session;

int main(void)
{
    port_init();
    session_init(&session);
    for (;;) {
        int byte = port_read();
        while (byte >= 0) {
            session_take(&session, (uint8_t)byte);
            byte = port_read();
        }
        uint32_t left_ticks;
        uint32_t right_ticks;
        if (port_encoders(&left_ticks, &right_ticks)) {
            session_take_encoders(&session, port_time_us(), left_ticks, right_ticks);
        }
        port_watchdog();
    }
}
