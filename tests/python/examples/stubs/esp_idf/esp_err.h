// What the example uses of ESP-IDF, with its names, types and order of arguments (v5.x).
#ifndef ESP_ERR_H
#define ESP_ERR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

typedef int esp_err_t;
#define ESP_OK 0
#define ESP_ERROR_CHECK(x) \
    do { \
        if ((x) != ESP_OK) { \
            abort(); \
        } \
    } while (0)

#endif
