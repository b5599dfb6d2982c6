/// The example application on FreeRTOS. What main.c does in one loop two tasks do: one reads the encoders
/// when they are due, whatever the other is at; the other owns robot and session and does all the work. So no
/// reading waits until a picture has been looked at.
#include <FreeRTOS.h>
#include <queue.h>
#include <task.h>

#include "port/cortex_m/systick.h"
#include "port/port.h"
#include "robot/own_sensors.h"
#include "robot/session.h"

/// Readings that may wait while a picture is looked at.
#define READINGS_MAX 64
/// In words. The robot's is what tools/checks/check_image.py finds for robot.elf, and room for interrupts.
#define ROBOT_STACK 1536
#define BODY_STACK 160
#define ROBOT_PRIORITY 1
#define BODY_PRIORITY 2

PORT_KEPT static robot_t robot;
static session_t session;
static QueueHandle_t readings;

static void read_body(void *unused)
{
    (void)unused;
    for (;;) {
        bslam_odometry_reading_t reading;
        while (own_sensors_read(&reading)) {
            // A queue that is full loses the reading: the next one has its ticks.
            (void)xQueueSend(readings, &reading, 0);
        }
        vTaskDelay(1);
    }
}

static void take_readings(void)
{
    bslam_odometry_reading_t reading;
    while (xQueueReceive(readings, &reading, 0) == pdTRUE) {
        own_sensors_take_reading(&robot, &session, &reading);
    }
}

static void take_camera(void)
{
#if ROBOT_VISION
    port_row_t row;
    taskENTER_CRITICAL();
    const bool there = port_camera_row(&row);
    taskEXIT_CRITICAL();
    if (there) {
        own_sensors_take_row(&robot, &session, &row);
    }
#endif
}

static void run_robot(void *unused)
{
    (void)unused;
    session_start(&session, &robot);
    for (;;) {
        session_listen(&session);
        take_readings();
        take_camera();
        port_watchdog();
    }
}

/// Called by the kernel when it starts, in place of its own.
void vPortSetupTimerInterrupt(void);

void vPortSetupTimerInterrupt(void)
{
    systick_every(port_ticks_hz() / configTICK_RATE_HZ);
}

/// Called by the kernel when a task has overrun its stack.
void vApplicationStackOverflowHook(TaskHandle_t task, char *name)
{
    (void)task;
    (void)name;
    port_exit(72);
}

int main(void)
{
    static StaticTask_t robot_task, body_task;
    static StackType_t robot_stack[ROBOT_STACK], body_stack[BODY_STACK];
    static StaticQueue_t queue;
    static uint8_t queue_room[READINGS_MAX * sizeof(bslam_odometry_reading_t)];
    port_init();
    readings = xQueueCreateStatic(READINGS_MAX, sizeof(bslam_odometry_reading_t), queue_room, &queue);
    (void)xTaskCreateStatic(run_robot, "robot", ROBOT_STACK, NULL, ROBOT_PRIORITY, robot_stack, &robot_task);
    (void)xTaskCreateStatic(read_body, "body", BODY_STACK, NULL, BODY_PRIORITY, body_stack, &body_task);
    vTaskStartScheduler();
    return 1;
}
