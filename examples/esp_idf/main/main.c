// A robot on an ESP32: wheel encoders on pulse counters, a tag detector on UART1, and a task that runs the
// filter 25 times a second. Its pose comes out on the console.
#include <stdio.h>

#include "bslam/bslam.h"
#include "driver/pulse_cnt.h"
#include "driver/uart.h"
#include "esp_timer.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

// Your robot: pins, and measures in app_main (docs/TUNING.md says how to find them).
// These pins are free on ESP32, S2 and S3: no flash, console, USB, or level that is read at the start.
enum { LEFT_A = 4, LEFT_B = 13, RIGHT_A = 14, RIGHT_B = 18, DETECTOR_RX = 21 };
enum { STEP_MS = 40, LIMIT = 30000, STACK_BYTES = 8192, PRIORITY = 5 };

static bslam_t robot;  // all the memory that the filter has; too large for a task's stack
static pcnt_unit_handle_t left, right;
static int refused;                  // lines, sightings and readings that were not taken
static const char *reason = "none";  // of the last

static void check(bool is_taken, const char *why)
{
    refused += !is_taken;
    reason = is_taken ? reason : why;
}

/// A counter of both edges of channel A, which goes on beyond its 16 bits.
static pcnt_unit_handle_t start_encoder(int pin_a, int pin_b)
{
    const pcnt_unit_config_t limits = {.low_limit = -LIMIT, .high_limit = LIMIT, .flags.accum_count = true};
    const pcnt_chan_config_t pins = {.edge_gpio_num = pin_a, .level_gpio_num = pin_b};
    pcnt_unit_handle_t unit;
    pcnt_channel_handle_t channel;
    ESP_ERROR_CHECK(pcnt_new_unit(&limits, &unit));
    ESP_ERROR_CHECK(pcnt_new_channel(unit, &pins, &channel));
    ESP_ERROR_CHECK(pcnt_channel_set_edge_action(channel, PCNT_CHANNEL_EDGE_ACTION_INCREASE,
                                                 PCNT_CHANNEL_EDGE_ACTION_DECREASE));
    ESP_ERROR_CHECK(pcnt_channel_set_level_action(channel, PCNT_CHANNEL_LEVEL_ACTION_INVERSE,
                                                  PCNT_CHANNEL_LEVEL_ACTION_KEEP));
    ESP_ERROR_CHECK(pcnt_unit_add_watch_point(unit, LIMIT));  // where the driver adds up
    ESP_ERROR_CHECK(pcnt_unit_add_watch_point(unit, -LIMIT));
    ESP_ERROR_CHECK(pcnt_unit_enable(unit));
    ESP_ERROR_CHECK(pcnt_unit_clear_count(unit));
    ESP_ERROR_CHECK(pcnt_unit_start(unit));
    return unit;
}

/// "AGE_MS TAG BEARING_MRAD RANGE_MM": a tag, left positive. It counts from when the picture was taken.
static void take_sighting(const char *line)
{
    int age_ms = 0, tag = 0, mrad = 0, mm = 0;
    char more;
    const int numbers = sscanf(line, "%d %d %d %d %c", &age_ms, &tag, &mrad, &mm, &more);
    if (numbers != 4) {  // EOF: a blank line, which is nothing
        check(numbers == EOF, "not four whole numbers");
        return;
    }
    const bslam_sighting_t seen = {
        .label = tag, .bearing_rad = 1e-3f * mrad, .range_m = 1e-3f * mm, .has_range = true};
    const bslam_status_t status = bslam_sightings(&robot, esp_timer_get_time() - 1000LL * age_ms, &seen, 1);
    check(status == BSLAM_OK, bslam_status_name(status));
}

/// 0 from then on.
static TickType_t ticks_until(TickType_t end, TickType_t now)
{
    return (int32_t)(end - now) > 0 ? end - now : 0;
}

/// Waits for bytes, so that a line's age counts from when it has come.
static void listen_to_detector(TickType_t end)
{
    static char line[64];
    static size_t length;
    for (char byte; uart_read_bytes(UART_NUM_1, &byte, 1, ticks_until(end, xTaskGetTickCount())) == 1;) {
        if (byte == '\n') {
            line[length] = '\0';
            take_sighting(length < sizeof line - 1 ? line : "too long");  // and noise
            length = 0;
        } else if (length < sizeof line - 1) {
            line[length++] = byte;
        }
    }
}

/// The only task that calls the library: calls on one instance must not overlap.
static void follow(void *unused)
{
    (void)unused;
    for (TickType_t end = xTaskGetTickCount(), step = 0;; step++) {
        end += pdMS_TO_TICKS(STEP_MS);
        listen_to_detector(end);
        int left_count, right_count;
        ESP_ERROR_CHECK(pcnt_unit_get_count(left, &left_count));
        ESP_ERROR_CHECK(pcnt_unit_get_count(right, &right_count));
        const bslam_odometry_reading_t wheels = {.time_us = esp_timer_get_time(),
                                                 .source = BSLAM_ODOMETRY_TICKS,
                                                 .left_ticks = (uint32_t)left_count,
                                                 .right_ticks = (uint32_t)right_count};
        const bslam_status_t status = bslam_odometry(&robot, &wheels);
        check(status == BSLAM_OK, bslam_status_name(status));
        const bslam_pose_t pose = bslam_pose(&robot);  // what your robot steers by
        printf("%d mm, %d mm, %d mrad, %d beacons, %d refused (last: %s)\n", (int)(1e3f * pose.x_m),
               (int)(1e3f * pose.y_m), (int)(1e3f * pose.theta_rad), (int)bslam_health(&robot).beacons,
               refused, reason);
        bslam_beacon_view_t tag;  // one of the map, at each step another
        if (bslam_beacon(&robot, (int)(step % BSLAM_BEACONS_MAX), &tag) == BSLAM_OK) {
            printf("tag %d at %d mm, %d mm\n", (int)tag.label, (int)(1e3f * tag.x_m), (int)(1e3f * tag.y_m));
        }
    }
}

void app_main(void)
{
    bslam_settings_t settings;
    int bad_setting = -1;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    settings.wheelbase_m = 0.2f;
    settings.left_radius_m = settings.right_radius_m = 0.033f;
    settings.ticks_per_revolution = 1440;
    settings.counter_bits = 32;
    settings.mount_x_m = 0.05f;  // the camera, ahead of the axle
    const bslam_status_t status = bslam_init(&robot, &settings, &bad_setting);
    if (status != BSLAM_OK) {  // of a setting, or BSLAM_E_SIZE
        printf("%s %s\n", bslam_status_name(status),
               status == BSLAM_E_PARAMETER ? bslam_settings_info(bad_setting)->name : "README: Sizes");
        return;
    }
    left = start_encoder(LEFT_A, LEFT_B);
    right = start_encoder(RIGHT_A, RIGHT_B);
    const uart_config_t line = {
        .baud_rate = 115200, .data_bits = UART_DATA_8_BITS, .stop_bits = UART_STOP_BITS_1};
    ESP_ERROR_CHECK(uart_driver_install(UART_NUM_1, 1024, 0, 0, NULL, 0));
    ESP_ERROR_CHECK(uart_param_config(UART_NUM_1, &line));
    ESP_ERROR_CHECK(uart_set_pin(UART_NUM_1, -1, DETECTOR_RX, -1, -1));  // -1: none
    xTaskCreate(follow, "bslam", STACK_BYTES, NULL, PRIORITY, NULL);
}
