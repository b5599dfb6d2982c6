/// Plain text over the serial line, for programs that report to a person or a test runner: no printf.
#ifndef BENCH_TEXT_H
#define BENCH_TEXT_H

#include <stdint.h>

void text_put(const char *text);

/// In decimal.
void text_put_number(uint32_t number);

#endif
