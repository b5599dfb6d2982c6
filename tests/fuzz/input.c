// Values out of an input. By itself, so that the fastest target does not have the filter in it.
#include "fuzz.h"
#include "base/scalar.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Noreturn void fuzz_fail(const char *what, const char *file, int line)
{
    (void)fprintf(stderr, "%s:%d: does not hold: %s\n", file, line, what);
    abort();
}

uint8_t fuzz_u8(fuzz_input_t *input)
{
    if (input->left == 0) {
        return 0;
    }
    input->left--;
    return *input->bytes++;
}

uint16_t fuzz_u16(fuzz_input_t *input)
{
    const unsigned low = fuzz_u8(input);
    return (uint16_t)(low | (unsigned)fuzz_u8(input) << 8);
}

uint32_t fuzz_u32(fuzz_input_t *input)
{
    const uint32_t low = fuzz_u16(input);
    return low | (uint32_t)fuzz_u16(input) << 16;
}

static bslam_real_t any_bits(fuzz_input_t *input)
{
    const uint32_t bits = fuzz_u32(input);
    float value;
    memcpy(&value, &bits, sizeof value);
    return (bslam_real_t)value;
}

bslam_real_t fuzz_real(fuzz_input_t *input, double low, double high)
{
    static const float odd[] = {NAN,   INFINITY, -INFINITY, 1e-40f, -1e-40f, 1e12f, -1e12f, 2e12f,
                                3e38f, -3e38f,   0.0f,      -0.0f,  1e-3f,   1.0f,  -1.0f};
    const unsigned choice = fuzz_u8(input);
    if (choice < sizeof odd / sizeof odd[0]) {
        return (bslam_real_t)odd[choice];
    }
    if (choice == 15) {
        return any_bits(input);
    }
    return (bslam_real_t)(low + (high - low) * fuzz_u16(input) / 65535);
}

void fuzz_signature(fuzz_input_t *input, float signature[BSLAM_SAMPLE_FEATURES])
{
    const unsigned place = fuzz_u8(input) % BSLAM_SAMPLE_FEATURES;
    const unsigned value = fuzz_u8(input);
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        signature[k] = 0.1f;
    }
    signature[place] = value == 0 ? NAN : (float)value / 128.0f;
}

bslam_sighting_t fuzz_sighting(fuzz_input_t *input, float signature[BSLAM_SAMPLE_FEATURES])
{
    const unsigned flags = fuzz_u8(input);
    bslam_sighting_t sighting = {.bearing_rad = fuzz_real(input, -3.2, 3.2),
                                 .has_range = (flags & 1u) != 0,
                                 .label = (int32_t)(flags >> 1 & 7u) - 1};
    if (sighting.has_range) {
        sighting.range_m = fuzz_real(input, 0.1, 10);
    }
    if ((flags & 16u) != 0) {
        sighting.bearing_sd_rad = fuzz_real(input, 0.001, 0.1);
        sighting.range_sd_m = fuzz_real(input, 0.01, 1);
        sighting.range_scale_sd = (flags & 32u) != 0 ? sighting.range_sd_m / 8 : 0;
    }
    if ((flags & 32u) != 0) {
        sighting.beacon_class = fuzz_u8(input);
        sighting.score = fuzz_real(input, -2, 4);
    }
    if ((flags & 64u) != 0) {
        fuzz_signature(input, signature);
        sighting.signature = signature;
    }
    if ((flags & 128u) != 0) {
        sighting.label = (int32_t)fuzz_u32(input);
    }
    return sighting;
}

int64_t fuzz_time(fuzz_input_t *input, int64_t now_us)
{
    const unsigned choice = fuzz_u8(input);
    if (choice < 4) {
        static const int64_t odd[] = {INT64_MIN, -1, INT64_MAX / 2 + 1, INT64_MAX};
        return odd[choice];
    }
    if (choice < 16) {
        return now_us + (int64_t)(int32_t)fuzz_u32(input);
    }
    return now_us + ((int64_t)choice - 32) * 2000;
}

bslam_odometry_reading_t fuzz_reading(fuzz_input_t *input, int64_t now_us)
{
    const unsigned flags = fuzz_u8(input);
    bslam_odometry_reading_t reading = {.source = (bslam_odometry_source_t)(flags & 3u),
                                        .has_gyro = (flags & 4u) != 0};
    reading.time_us = (flags & 8u) != 0 ? fuzz_time(input, now_us) : now_us;
    switch (reading.source) {
    case BSLAM_ODOMETRY_TICKS:
        reading.left_ticks = (flags & 16u) != 0 ? fuzz_u32(input) : fuzz_u8(input);
        reading.right_ticks = fuzz_u16(input);
        break;
    case BSLAM_ODOMETRY_VELOCITY:
        reading.v_mps = fuzz_real(input, -2, 2);
        reading.omega_radps = fuzz_real(input, -4, 4);
        break;
    case BSLAM_ODOMETRY_WHEELS:
    default:
        reading.left_m = fuzz_real(input, -0.1, 0.1);
        reading.right_m = fuzz_real(input, -0.1, 0.1);
        break;
    }
    if (reading.has_gyro) {
        reading.gyro_radps = fuzz_real(input, -4, 4);
        reading.gyro_sd_radps = fuzz_real(input, 0, 2);
    }
    return reading;
}
