// The few functions of a C library that the estimator calls. Copying and filling are instructions of
// WebAssembly (-mbulk-memory), to which the compiler turns these builtins.
#include <math.h>
#include <stdint.h>
#include <string.h>

void *memcpy(void *restrict to, const void *restrict from, size_t count)
{
    return __builtin_memcpy(to, from, count);
}

void *memmove(void *to, const void *from, size_t count)
{
    return __builtin_memmove(to, from, count);
}

void *memset(void *to, int byte, size_t count)
{
    return __builtin_memset(to, byte, count);
}

int memcmp(const void *a, const void *b, size_t count)
{
    const unsigned char *one = a;
    const unsigned char *other = b;
    for (size_t i = 0; i < count; i++) {
        if (one[i] != other[i]) {
            return one[i] - other[i];
        }
    }
    return 0;
}

/// By the bits of IEEE 754: a mantissa in [1/2, 1) has the exponent field 126.
float frexpf(float x, int *exponent)
{
    union {
        float number;
        uint32_t bits;
    } parts = {x};
    *exponent = 0;
    uint32_t field = parts.bits >> 23 & 0xff;
    if (x == 0 || field == 0xff) {
        return x;
    }
    if (field == 0) {  // denormal: 2^64 times as large it is none
        parts.number *= 0x1p64f;
        field = parts.bits >> 23 & 0xff;
        *exponent = -64;
    }
    *exponent += (int)field - 126;
    parts.bits = (parts.bits & ~(0xffu << 23)) | 126u << 23;
    return parts.number;
}
