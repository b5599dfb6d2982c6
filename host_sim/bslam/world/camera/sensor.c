/* From light to bytes: blur, exposure, noise, tone curve. */
#include "render.h"

#include <math.h>
#include <string.h>

#include "internal.h"

/* xorshift64*: one number has enough bits for a pixel's three deviates. */
static uint64_t next(uint64_t *random)
{
    uint64_t x = *random;
    x ^= x >> 12;
    x ^= x << 25;
    x ^= x >> 27;
    *random = x;
    return x * 0x2545f4914f6cdd1du;
}

/* Rows of `from` into `to`; beyond the border the outermost pixel is repeated. */
static void blur_rows(const render_lens_t *lens, const float *taps, const float *from, float *to)
{
    const int32_t width = lens->width_px, reach = RENDER_BLUR_TAPS / 2;
    memset(to, 0, sizeof *to * 3 * (size_t)(width * lens->height_px));
    for (int32_t y = 0; y < lens->height_px; y++) {
        const float *row = &from[3 * y * width];
        float *out = &to[3 * y * width];
        for (int32_t tap = 0; tap < RENDER_BLUR_TAPS; tap++) {
            const int32_t off = tap - reach;
            const int32_t low = off < 0 ? -off : 0, high = off > 0 ? width - off : width;
            if (taps[tap] == 0.0f)
                continue;
            for (int32_t i = 3 * low; i < 3 * high; i++)
                out[i] += taps[tap] * row[i + 3 * off];
            for (int32_t i = 0; i < 3 * low; i++)
                out[i] += taps[tap] * row[i % 3];
            for (int32_t i = 3 * high; i < 3 * width; i++)
                out[i] += taps[tap] * row[3 * (width - 1) + i % 3];
        }
    }
}

static void blur_columns(const render_lens_t *lens, float share, const float *from, float *to)
{
    const int32_t row_values = 3 * lens->width_px;
    for (int32_t y = 0; y < lens->height_px; y++) {
        const float *row = &from[y * row_values];
        const float *above = y > 0 ? row - row_values : row;
        const float *below = y + 1 < lens->height_px ? row + row_values : row;
        for (int32_t i = 0; i < row_values; i++)
            to[y * row_values + i] = (1.0f - 2.0f * share) * row[i] + share * (above[i] + below[i]);
    }
}

void render_expose(const render_lens_t *lens, const render_sensor_t *sensor, const float *normals,
                   const uint8_t *tones, uint64_t *random, float *linear, float *scratch, uint8_t *rgb)
{
    blur_rows(lens, sensor->blur_row, linear, scratch);
    blur_columns(lens, sensor->blur_column, scratch, linear);
    const float square = sensor->read * sensor->read;
    for (int32_t at = 0; at < lens->width_px * lens->height_px; at++) {
        const float *light = &linear[3 * at];
        const float middle = sensor->gain[1] * (light[0] + light[1] + light[2]) / 3.0f;
        const float sigma = sqrtf(sensor->shot * middle + square) * (float)(RENDER_TONES - 1);
        uint64_t bits = next(random);
        for (int32_t i = 0; i < 3; i++) {
            const float value = sensor->gain[i] * light[i] * (float)(RENDER_TONES - 1);
            const float noisy = value + sigma * normals[bits % RENDER_NORMALS];
            bits /= RENDER_NORMALS;
            const int32_t tone =
                noisy > 0.0f ? (noisy < (float)(RENDER_TONES - 1) ? (int32_t)noisy : RENDER_TONES - 1) : 0;
            rgb[3 * at + i] = tones[tone];
        }
    }
}
