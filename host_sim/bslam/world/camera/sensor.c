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

/* out += tap * in, where the compiler may use vectors. */
RENDER_FOR_VECTORS static void add_scaled(float *restrict out, const float *restrict in, float tap,
                                          int32_t count)
{
    for (int32_t i = 0; i < count; i++)
        out[i] += tap * in[i];
}

/* Beyond the border the outermost pixel is repeated. */
static void blur_row(const float *taps, int32_t width, const float *row, float *out)
{
    memset(out, 0, sizeof *out * 3 * (size_t)width);
    for (int32_t tap = 0; tap < RENDER_BLUR_TAPS; tap++) {
        if (taps[tap] == 0.0f)
            continue;
        const int32_t off = tap - RENDER_BLUR_TAPS / 2;
        const int32_t low = off < 0 ? -off : 0, high = off > 0 ? width - off : width;
        add_scaled(&out[3 * low], &row[3 * (low + off)], taps[tap], 3 * (high - low));
        for (int32_t x = 0; x < low; x++)
            add_scaled(&out[3 * x], row, taps[tap], 3);
        for (int32_t x = high; x < width; x++)
            add_scaled(&out[3 * x], &row[3 * (width - 1)], taps[tap], 3);
    }
}

RENDER_FOR_VECTORS static void blur_column(float share, const float *restrict above,
                                           const float *restrict row, const float *restrict below,
                                           float *restrict out, int32_t count)
{
    const float own = 1.0f - 2.0f * share;
    for (int32_t i = 0; i < count; i++)
        out[i] = own * row[i] + share * (above[i] + below[i]);
}

/* A row of blurred light into bytes. */
static void expose_row(const render_sensor_t *sensor, const float *normals, const uint8_t *tones,
                       uint64_t *random, int32_t width, const float *light, uint8_t *rgb)
{
    const float top = (float)(RENDER_TONES - 1);
    const float gain[3] = {top * sensor->gain[0], top * sensor->gain[1], top * sensor->gain[2]};
    const float shot = sensor->shot * sensor->gain[1] / 3.0f, square = sensor->read * sensor->read;
    for (int32_t at = 0; at < 3 * width; at += 3) {
        const float sigma = top * sqrtf(shot * (light[at] + light[at + 1] + light[at + 2]) + square);
        uint64_t bits = next(random);
        for (int32_t i = 0; i < 3; i++) {
            const float noisy = gain[i] * light[at + i] + sigma * normals[bits % RENDER_NORMALS];
            bits /= RENDER_NORMALS;
            const float clipped = noisy < 0.0f ? 0.0f : noisy > top ? top : noisy;
            rgb[at + i] = tones[(int32_t)clipped];
        }
    }
}

void render_expose(const render_lens_t *lens, const render_sensor_t *sensor, const float *normals,
                   const uint8_t *tones, uint64_t *random, const float *linear, float *scratch, uint8_t *rgb)
{
    const int32_t width = lens->width_px, values = 3 * width, last = lens->height_px - 1;
    float *light = &scratch[lens->height_px * values];
    for (int32_t y = 0; y <= last; y++)
        blur_row(sensor->blur_row, width, &linear[y * values], &scratch[y * values]);
    for (int32_t y = 0; y <= last; y++) {
        const float *row = &scratch[y * values];
        const float *above = y > 0 ? row - values : row, *below = y < last ? row + values : row;
        blur_column(sensor->blur_column, above, row, below, light, values);
        expose_row(sensor, normals, tones, random, width, light, &rgb[y * values]);
    }
}
