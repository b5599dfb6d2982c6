/// What the programs that measure costs share: their lines, their random numbers.
#ifndef BENCH_MEASURE_H
#define BENCH_MEASURE_H

#include <stdbool.h>

#include "bench/text.h"
#include "port/port.h"

/// A line "name size ticks".
static inline void measure_report(const char *name, int size, uint32_t ticks)
{
    text_put(name);
    text_put(" ");
    text_put_number((uint32_t)size);
    text_put(" ");
    text_put_number(ticks);
    text_put("\n");
}

/// What should not happen ends the program.
static inline void measure_need(bool good)
{
    if (!good) {
        text_put("failed\n");
        port_exit(1);
    }
}

/// The next number, uniform in -1 to 1, of a stream whose state is not 0.
static inline float measure_random(uint32_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return (float)(int32_t)*state * (1.0f / 2147483648.0f);
}

#endif
