// ESP-IDF on this computer: the drive's wheels turn the counters, and its detector talks on UART1.
#include <string.h>

#include "../drive.h"
#include "bslam/bslam.h"
#include "driver/pulse_cnt.h"
#include "driver/uart.h"
#include "freertos/task.h"

struct pcnt_unit_t {
    int side;     // of the robot: -1 left, 1 right
    int rising;   // what a rising edge of A counts where B is low: 1, -1, 0
    int watched;  // limits that have a watch point
    bool accumulates, runs;
};

void app_main(void);
int64_t esp_timer_get_time(void);
bslam_status_t __wrap_bslam_sightings(bslam_t *robot, int64_t stamp_us, const bslam_sighting_t *seen,
                                      int count);
bslam_status_t __real_bslam_sightings(bslam_t *robot, int64_t stamp_us, const bslam_sighting_t *seen,
                                      int count);

static struct pcnt_unit_t units[2];
static int unit_count;
static int64_t time_us;
static char heard[512];
static int heard_length, heard_read;
static TaskFunction_t started;
static uint32_t started_stack_bytes;

esp_err_t pcnt_new_unit(const pcnt_unit_config_t *config, pcnt_unit_handle_t *unit)
{
    *unit = &units[unit_count];
    units[unit_count].side = unit_count == 0 ? -1 : 1;
    units[unit_count++].accumulates = config->flags.accum_count;
    return config->low_limit < 0 && config->high_limit > 0 ? ESP_OK : 1;
}

esp_err_t pcnt_new_channel(pcnt_unit_handle_t unit, const pcnt_chan_config_t *config,
                           pcnt_channel_handle_t *channel)
{
    *channel = (pcnt_channel_handle_t)unit;
    return config->edge_gpio_num != config->level_gpio_num ? ESP_OK : 1;
}

esp_err_t pcnt_channel_set_edge_action(pcnt_channel_handle_t channel, pcnt_channel_edge_action_t rising,
                                       pcnt_channel_edge_action_t falling)
{
    struct pcnt_unit_t *unit = (struct pcnt_unit_t *)channel;
    unit->rising = rising == PCNT_CHANNEL_EDGE_ACTION_INCREASE ? 1 : -1;
    return rising != falling ? ESP_OK : 1;
}

esp_err_t pcnt_channel_set_level_action(pcnt_channel_handle_t channel, pcnt_channel_level_action_t high,
                                        pcnt_channel_level_action_t low)
{
    struct pcnt_unit_t *unit = (struct pcnt_unit_t *)channel;
    unit->rising *= low == PCNT_CHANNEL_LEVEL_ACTION_KEEP ? 1 : -1;
    return high != low ? ESP_OK : 1;
}

esp_err_t pcnt_unit_add_watch_point(pcnt_unit_handle_t unit, int watch_point)
{
    unit->watched += watch_point != 0;
    return ESP_OK;
}

esp_err_t pcnt_unit_enable(pcnt_unit_handle_t unit)
{
    return unit->watched == 2 ? ESP_OK : 1;
}

esp_err_t pcnt_unit_clear_count(pcnt_unit_handle_t unit)
{
    (void)unit;
    return ESP_OK;
}

esp_err_t pcnt_unit_start(pcnt_unit_handle_t unit)
{
    unit->runs = true;
    return ESP_OK;
}

/// Backwards without accumulation it would begin again.
esp_err_t pcnt_unit_get_count(pcnt_unit_handle_t unit, int *count)
{
    *count = unit->rising * (int)drive_ticks(time_us, unit->side);
    return unit->accumulates && unit->runs ? ESP_OK : 1;
}

esp_err_t uart_driver_install(uart_port_t port, int rx_bytes, int tx_bytes, int queue_size,
                              QueueHandle_t *queue, int flags)
{
    (void)tx_bytes;
    (void)queue_size;
    (void)queue;
    (void)flags;
    return port == UART_NUM_1 && rx_bytes > 128 ? ESP_OK : 1;
}

esp_err_t uart_param_config(uart_port_t port, const uart_config_t *config)
{
    return port == UART_NUM_1 && config->baud_rate == 115200 ? ESP_OK : 1;
}

esp_err_t uart_set_pin(uart_port_t port, int tx, int rx, int rts, int cts)
{
    return port == UART_NUM_1 && tx != rx && rts < 0 && cts < 0 ? ESP_OK : 1;
}

static void pass_a_millisecond(void)
{
    time_us += 1000;
    if (time_us >= DRIVE_US) {
        exit(0);
    }
    if (time_us % PICTURE_US == 0) {
        heard_read = 0;
        heard_length = drive_lines(time_us, heard, sizeof heard);
    }
}

/// Waits until there is a byte, or to the end of the last of `wait` ticks.
int uart_read_bytes(uart_port_t port, void *bytes, uint32_t length, TickType_t wait)
{
    const TickType_t end = xTaskGetTickCount() + wait;
    while (heard_read == heard_length && xTaskGetTickCount() < end) {
        pass_a_millisecond();
    }
    if (port != UART_NUM_1 || length != 1 || heard_read == heard_length) {
        return 0;
    }
    memcpy(bytes, &heard[heard_read++], 1);
    return 1;
}

int64_t esp_timer_get_time(void)
{
    return time_us;
}

TickType_t xTaskGetTickCount(void)
{
    return (TickType_t)(time_us / 10000);
}

/// The linker has the example call this one: stamps must be the pictures' to the millisecond.
bslam_status_t __wrap_bslam_sightings(bslam_t *robot, int64_t stamp_us, const bslam_sighting_t *seen,
                                      int count)
{
    if ((stamp_us + AGE_US) % PICTURE_US > 1000) {
        printf("a picture's stamp is late by %d us\n", (int)((stamp_us + AGE_US) % PICTURE_US));
        exit(3);
    }
    return __real_bslam_sightings(robot, stamp_us, seen, count);
}

BaseType_t xTaskCreate(TaskFunction_t task, const char *name, uint32_t stack_bytes, void *argument,
                       UBaseType_t priority, TaskHandle_t *created)
{
    (void)name;
    (void)argument;
    (void)priority;
    (void)created;
    started = task;
    started_stack_bytes = stack_bytes;
    return 1;
}

int main(void)
{
    app_main();
    if (started == NULL || started_stack_bytes < 6144) {
        return 1;
    }
    started(NULL);
    return 2;
}
