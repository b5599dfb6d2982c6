#include "bench/text.h"

#include <string.h>

#include "port/port.h"

/// Digits of the largest number, and the closing zero.
#define ROOM 11

void text_put(const char *text)
{
    port_write((const uint8_t *)text, strlen(text));
}

void text_put_number(uint32_t number)
{
    char digits[ROOM];
    size_t at = ROOM - 1;
    digits[at] = '\0';
    do {
        at--;
        digits[at] = (char)('0' + number % 10);
        number /= 10;
    } while (number > 0);
    text_put(&digits[at]);
}
