/// The example application: a robot whose encoders, gyro and cameras, if the port has any, and whose host,
/// over the link, feed the estimator; pose, map and accounts go back over the link.
#include "port/port.h"
#include "robot/own_sensors.h"
#include "robot/robot.h"
#include "robot/session.h"

PORT_KEPT static robot_t robot;
static session_t session;

int main(void)
{
    port_init();
    session_start(&session, &robot);
    for (;;) {
        session_listen(&session);
        own_sensors_take(&robot, &session);
        port_watchdog();
    }
}
