/* Colour of what the rays meet: textures, light maps, and how the surfaces in a pixel mix. */
#include "render.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "internal.h"

/* --- Textures
 * ------------------------------------------------------------------------------------------------ */

/* Base 2 logarithm of a positive normal float, within 0.01: the exponent, and a parabola for the mantissa. */
static float rough_log2(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    const float exponent = (float)((int32_t)(bits >> 23) - 127);
    bits = (bits & 0x007fffffu) | 0x3f800000u;
    float mantissa;
    memcpy(&mantissa, &bits, sizeof mantissa);
    return exponent + (mantissa - 1.0f) * (1.3465f - 0.3465f * (mantissa - 1.0f));
}

/* One texel as four lanes of 16 bits: R, B, G, A from the lowest. */
static uint64_t lanes(uint32_t texel)
{
    const uint64_t wide = texel;
    return (wide & 0x00ff00ffu) | ((wide & 0xff00ff00u) << 24);
}

/* Between two texels; share 0 to 256 of the second. 255 * 256 fits a lane. */
static uint64_t blend(uint64_t a, uint64_t b, uint32_t share)
{
    return ((a * (256u - share) + b * share) >> 8) & 0x00ff00ff00ff00ffu;
}

typedef struct level {
    const uint32_t *texels;
    int32_t width, height;
} level_t;

/* Where a texture is looked at, in repeats of it. Along a way in which it is not repeated, its border goes
 * on: the foot of a wall must not show at its top. */
typedef struct spot {
    float u, v;
    bool ends_u, ends_v;
} spot_t;

static level_t level_of(const render_scene_t *scene, const render_texture_t *texture, int32_t index)
{
    return (level_t){&scene->texels[texture->first[index]], 1 << (texture->width_log2 - index),
                     1 << (texture->height_log2 - index)};
}

static float larger(float a, float b)
{
    return a > b ? a : b;
}

static float within(float x, float highest)
{
    return x < 0.0f ? 0.0f : x > highest ? highest : x;
}

/* A call of floorf costs more than all the rest of a fetch. */
static int32_t floor_of(float x)
{
    const int32_t towards_zero = (int32_t)x;
    return towards_zero - (x < (float)towards_zero);
}

/* Bilinear; sides are powers of two, so a mask repeats them. */
static uint64_t fetch(const level_t *level, const spot_t *spot)
{
    const float free_x = spot->u * (float)level->width - 0.5f, free_y = spot->v * (float)level->height - 0.5f;
    const float x = spot->ends_u ? within(free_x, (float)(level->width - 1)) : free_x;
    const float y = spot->ends_v ? within(free_y, (float)(level->height - 1)) : free_y;
    const int32_t column = floor_of(x), row = floor_of(y);
    const uint32_t share_x = (uint32_t)((x - (float)column) * 256.0f);
    const uint32_t share_y = (uint32_t)((y - (float)row) * 256.0f);
    const int32_t x0 = column & (level->width - 1), x1 = (x0 + 1) & (level->width - 1);
    const int32_t y0 = row & (level->height - 1), y1 = (y0 + 1) & (level->height - 1);
    const uint32_t *row0 = &level->texels[y0 * level->width], *row1 = &level->texels[y1 * level->width];
    return blend(blend(lanes(row0[x0]), lanes(row0[x1]), share_x),
                 blend(lanes(row1[x0]), lanes(row1[x1]), share_x), share_y);
}

/* Trilinear, but where one level would have less than an eighth of the say, the other has it all. */
static uint64_t sample(const render_scene_t *scene, const render_texture_t *texture, const spot_t *spot,
                       float lod)
{
    const float eighth = 0.125f;
    const float clipped = within(lod, (float)(texture->levels - 1));
    const int32_t index = (int32_t)(clipped + eighth);
    const float share = clipped - (float)index;
    level_t level = level_of(scene, texture, index);
    const uint64_t fine = fetch(&level, spot);
    if (share < eighth || index + 1 >= texture->levels)
        return fine;
    level = level_of(scene, texture, index + 1);
    return blend(fine, fetch(&level, spot), (uint32_t)(256.0f * share));
}

uint32_t texture_alpha(const render_scene_t *scene, int32_t texture, float u, float v, float pixel_u)
{
    const render_texture_t *picture = &scene->textures[texture];
    const float texels = pixel_u * (float)(1 << picture->width_log2);
    int32_t index = texels > 1.0f ? (int32_t)rough_log2(texels) : 0;
    index = index < picture->levels ? index : picture->levels - 1;
    const level_t level = level_of(scene, picture, index);
    const spot_t spot = {u, v, true, true};
    return (uint32_t)(fetch(&level, &spot) >> 48);
}

/* --- Light
 * --------------------------------------------------------------------------------------------------- */

/* Bilinear in a surface's light map, u and v in [0, 1]: the lamps' and the sky's share. */
static void light_at(const float *map, float u, float v, float shares[2])
{
    const float steps = (float)(RENDER_LIGHT_NODES - 1);
    const float x = within(steps * u, steps), y = within(steps * v, steps);
    const int32_t column = x < steps ? (int32_t)x : RENDER_LIGHT_NODES - 2;
    const int32_t row = y < steps ? (int32_t)y : RENDER_LIGHT_NODES - 2;
    const float share_x = x - (float)column, share_y = y - (float)row;
    const float *above = &map[2 * (row * RENDER_LIGHT_NODES + column)];
    const float *below = above + 2 * RENDER_LIGHT_NODES;
    for (int32_t i = 0; i < 2; i++) {
        const float upper = above[i] + share_x * (above[2 + i] - above[i]);
        const float lower = below[i] + share_x * (below[2 + i] - below[i]);
        shares[i] = upper + share_y * (lower - upper);
    }
}

static bool hidden(const float from[3], const float to[3], const float *walls, int32_t wall_count)
{
    const float ray_x = to[0] - from[0], ray_y = to[1] - from[1];
    for (int32_t i = 0; i < wall_count; i++) {
        const float *wall = &walls[4 * i];
        const float along_x = wall[2] - wall[0], along_y = wall[3] - wall[1];
        const float off_x = wall[0] - from[0], off_y = wall[1] - from[1];
        const float det = ray_x * along_y - ray_y * along_x;
        if (det == 0.0f)
            continue;
        const float t = (off_x * along_y - off_y * along_x) / det;
        const float u = (off_x * ray_y - off_y * ray_x) / det;
        /* The ends are spared: a node lies on its own wall. */
        if (t > 0.01f && t < 0.99f && u >= 0.0f && u <= 1.0f)
            return true;
    }
    return false;
}

/* What one lamp gives a point: as a diffuse panel, with a soft limit near it. */
static float lamp_at(const float lamp[5], const float at[3], const float normal[3])
{
    const float to[3] = {lamp[0] - at[0], lamp[1] - at[1], lamp[2] - at[2]};
    const float square = dot3(to, to) + 0.05f;
    const float cosine = dot3(to, normal) / sqrtf(square);
    /* A wrapped cosine: part of the light has come by way of the other walls. */
    const float wrapped = (cosine + 0.3f) / 1.3f;
    return wrapped > 0.0f ? lamp[3] * wrapped / (square + 1.0f) : 0.0f;
}

static void bake_node(const float at[3], const float normal[3], const float *lamps, int32_t lamp_count,
                      const float *walls, int32_t wall_count, float node[2])
{
    for (int32_t i = 0; i < lamp_count; i++) {
        const float *lamp = &lamps[5 * i];
        const float got = lamp_at(lamp, at, normal);
        if (got <= 0.0f)
            continue;
        const float seen = hidden(at, lamp, walls, wall_count) ? 0.1f * got : got;
        node[0] += seen * (1.0f - lamp[4]);
        node[1] += seen * lamp[4];
    }
}

static void bake_surface(const render_surface_t *surface, const float *lamps, int32_t lamp_count,
                         const float *walls, int32_t wall_count, const float ambient[2], float *map)
{
    const float *right = surface->right_m, *down = surface->down_m;
    float normal[3] = {right[2] * down[1] - right[1] * down[2], right[0] * down[2] - right[2] * down[0],
                       right[1] * down[0] - right[0] * down[1]};
    const float length = sqrtf(dot3(normal, normal));
    for (int32_t i = 0; i < 3; i++)
        normal[i] = surface->flags & RENDER_BILLBOARD ? 0.0f : normal[i] / length;
    for (int32_t node = 0; node < RENDER_LIGHT_NODES * RENDER_LIGHT_NODES; node++) {
        const int32_t row = node / RENDER_LIGHT_NODES, column = node % RENDER_LIGHT_NODES;
        const float u = (float)column / (float)(RENDER_LIGHT_NODES - 1);
        const float v = (float)row / (float)(RENDER_LIGHT_NODES - 1);
        float at[3];
        for (int32_t i = 0; i < 3; i++)
            at[i] = surface->corner_m[i] + (0.01f + 0.98f * u) * right[i] + (0.01f + 0.98f * v) * down[i] +
                    0.02f * normal[i];
        map[2 * node] = ambient[0];
        map[2 * node + 1] = ambient[1];
        bake_node(at, normal, lamps, lamp_count, walls, wall_count, &map[2 * node]);
    }
}

void render_bake(const render_surface_t *surfaces, int32_t surface_count, const float *lamps,
                 int32_t lamp_count, const float *walls, int32_t wall_count, const float ambient[2],
                 float *light)
{
    const int32_t map_size = 2 * RENDER_LIGHT_NODES * RENDER_LIGHT_NODES;
    for (int32_t i = 0; i < surface_count; i++)
        bake_surface(&surfaces[i], lamps, lamp_count, walls, wall_count, ambient, &light[i * map_size]);
}

/* --- Pixels
 * -------------------------------------------------------------------------------------------------- */

/* The pixel's footprint in the texture: steps of (u, v) along the picture's row and column, in texels. */
typedef struct footprint {
    float row_u, row_v, column_u, column_v;
} footprint_t;

static footprint_t footprint_of(const render_scene_t *scene, const render_face_t *faces, int32_t index,
                                const float ray[3], const float steps[2][3])
{
    const render_surface_t *surface = &scene->surfaces[index];
    const render_texture_t *texture = &scene->textures[surface->texture];
    const render_face_t *face = &faces[index];
    const float inverse = 1.0f / dot3(face->s, ray);
    const float u = dot3(face->a, ray) * inverse, v = dot3(face->b, ray) * inverse;
    const float scale_u = inverse * surface->tiles_u * (float)(1 << texture->width_log2);
    const float scale_v = inverse * surface->tiles_v * (float)(1 << texture->height_log2);
    const float row_s = dot3(face->s, steps[0]), column_s = dot3(face->s, steps[1]);
    return (footprint_t){
        .row_u = scale_u * (dot3(face->a, steps[0]) - u * row_s),
        .row_v = scale_v * (dot3(face->b, steps[0]) - v * row_s),
        .column_u = scale_u * (dot3(face->a, steps[1]) - u * column_s),
        .column_v = scale_v * (dot3(face->b, steps[1]) - v * column_s),
    };
}

/* The texture over a pixel: 1, 2 or 4 fetches along the longer side of the footprint, so that what is seen
 * at a slant is neither smeared nor jagged. */
static uint64_t texture_over(const render_scene_t *scene, const render_texture_t *texture,
                             const spot_t *middle, const footprint_t *print)
{
    const float row = print->row_u * print->row_u + print->row_v * print->row_v;
    const float column = print->column_u * print->column_u + print->column_v * print->column_v;
    const bool by_row = row > column;
    const float major = by_row ? row : column, minor = by_row ? column : row;
    const int32_t count = major > 16.0f * minor ? 4 : major > 4.0f * minor ? 2 : 1;
    const float share = 1.0f / (float)count;
    const float lod = 0.5f * rough_log2(larger(larger(minor, major * share * share), 1e-12f));
    if (count == 1)
        return sample(scene, texture, middle, lod);
    const float step_u =
        share * (by_row ? print->row_u : print->column_u) / (float)(1 << texture->width_log2);
    const float step_v =
        share * (by_row ? print->row_v : print->column_v) / (float)(1 << texture->height_log2);
    /* The spots overlap, so the nearest level will do. */
    const level_t level = level_of(scene, texture, (int32_t)within(lod + 0.5f, (float)(texture->levels - 1)));
    uint64_t sum = 0;
    for (int32_t i = 0; i < count; i++) {
        const float off = (float)i - 0.5f * (float)(count - 1);
        spot_t spot = *middle;
        spot.u += off * step_u;
        spot.v += off * step_v;
        sum += fetch(&level, &spot);
    }
    return (sum >> (count / 2)) & 0x00ff00ff00ff00ffu;
}

/* Adds `weight` times the colour of a surface where the ray meets it. */
static void add_colour(const render_scene_t *scene, const render_face_t *faces, const render_light_t *light,
                       int32_t index, const float ray[3], const footprint_t *print, float weight,
                       float rgb[3])
{
    const render_surface_t *surface = &scene->surfaces[index];
    const render_face_t *face = &faces[index];
    const float inverse = 1.0f / dot3(face->s, ray);
    const float u = dot3(face->a, ray) * inverse, v = dot3(face->b, ray) * inverse;
    const spot_t spot = {u * surface->tiles_u, v * surface->tiles_v, surface->tiles_u == 1.0f,
                         surface->tiles_v == 1.0f};
    const uint64_t texel = texture_over(scene, &scene->textures[surface->texture], &spot, print);
    float shares[2];
    light_at(&scene->light[index * 2 * RENDER_LIGHT_NODES * RENDER_LIGHT_NODES], u, v, shares);
    const float dark = surface->flags & RENDER_CUT_OUT ? 0.0f : 1.0f - (float)(texel >> 48) * (1.0f / 255.0f);
    const float lamp = shares[0] + dark * surface->glow_lamp, sky = shares[1] + dark * surface->glow_sky;
    const float roots[3] = {(float)(texel & 0xffu), (float)((texel >> 32) & 0xffu),
                            (float)((texel >> 16) & 0xffu)};
    for (int32_t i = 0; i < 3; i++) {
        const float colour = roots[i] * roots[i] * (1.0f / (255.0f * 255.0f));
        rgb[i] += weight * colour * (lamp * light->lamp[i] + sky * light->sky[i]);
    }
}

static const float ray_weights[9] = {0.0625f, 0.125f,  0.0625f, 0.125f, 0.25f,
                                     0.125f,  0.0625f, 0.125f,  0.0625f};

/* Whether the nine rays of a pixel meet more than one surface; `hit` is the middle one's. */
static bool is_mixed(const int16_t *hit, int32_t stride)
{
    const int16_t *above = hit - stride, *below = hit + stride;
    const int32_t differ = (above[-1] ^ *hit) | (above[0] ^ *hit) | (above[1] ^ *hit) | (hit[-1] ^ *hit) |
                           (hit[1] ^ *hit) | (below[-1] ^ *hit) | (below[0] ^ *hit) | (below[1] ^ *hit);
    return differ != 0;
}

static void ray_at(const render_lens_t *lens, int32_t at, float ray[3])
{
    ray[0] = lens->ray_x[at];
    ray[1] = lens->ray_y[at];
    ray[2] = lens->ray_z[at];
}

/* From one pixel to the next along the row and the column. */
static void ray_steps(const render_lens_t *lens, int32_t centre, float steps[2][3])
{
    const int32_t offsets[2] = {1, rays_along(lens->width_px)};
    for (int32_t i = 0; i < 2; i++) {
        const int32_t before = centre - offsets[i], after = centre + offsets[i];
        steps[i][0] = lens->ray_x[after] - lens->ray_x[before];
        steps[i][1] = lens->ray_y[after] - lens->ray_y[before];
        steps[i][2] = lens->ray_z[after] - lens->ray_z[before];
    }
}

/* Each surface in the pixel counts by the weights of its rays, and is looked at in their mean direction. */
static void mix(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                const render_light_t *light, const int16_t *hits, int32_t centre, float rgb[3])
{
    float steps[2][3];
    ray_steps(lens, centre, steps);
    const int32_t stride = rays_along(lens->width_px);
    int32_t at[9];
    for (int32_t i = 0; i < 9; i++)
        at[i] = centre + (i / 3 - 1) * stride + i % 3 - 1;
    uint32_t done = 0;
    for (int32_t first = 0; first < 9; first++) {
        const int16_t hit = hits[at[first]];
        if ((done >> first & 1u) || hit == RENDER_NOTHING)
            continue;
        float ray[3] = {0.0f}, weight = 0.0f;
        for (int32_t i = first; i < 9; i++) {
            if (hits[at[i]] != hit)
                continue;
            done |= 1u << i;
            weight += ray_weights[i];
            ray[0] += ray_weights[i] * lens->ray_x[at[i]];
            ray[1] += ray_weights[i] * lens->ray_y[at[i]];
            ray[2] += ray_weights[i] * lens->ray_z[at[i]];
        }
        const footprint_t print = footprint_of(scene, faces, hit, ray, steps);
        add_colour(scene, faces, light, hit, ray, &print, weight, rgb);
    }
}

/* A footprint changes slowly: it is worked out for every fourth pixel, and when the surface changes. */
static void shade_row(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                      const render_light_t *light, const int16_t *hits, int32_t row, const float *vignette,
                      float *linear)
{
    const int32_t stride = rays_along(lens->width_px);
    int32_t centre = (2 * row + 1) * stride + 1, last = RENDER_NOTHING;
    footprint_t print = {0};
    for (int32_t column = 0; column < lens->width_px; column++, centre += 2, linear += 3) {
        const int16_t hit = hits[centre];
        linear[0] = linear[1] = linear[2] = 0.0f;
        if (is_mixed(&hits[centre], stride)) {
            mix(scene, lens, faces, light, hits, centre, linear);
        } else if (hit != RENDER_NOTHING) {
            float ray[3], steps[2][3];
            ray_at(lens, centre, ray);
            if (hit != last || column % 4 == 0) {
                ray_steps(lens, centre, steps);
                print = footprint_of(scene, faces, hit, ray, steps);
                last = hit;
            }
            add_colour(scene, faces, light, hit, ray, &print, 1.0f, linear);
        }
        for (int32_t i = 0; i < 3; i++)
            linear[i] *= vignette[column];
    }
}

void render_shade(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                  const int16_t *hits, const render_light_t *light, const float *vignette, float *linear)
{
    const int32_t width = lens->width_px;
    for (int32_t row = 0; row < lens->height_px; row++)
        shade_row(scene, lens, faces, light, hits, row, &vignette[row * width], &linear[3 * row * width]);
}

void render_truth(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                  const int16_t *hits, int16_t *identity, float *depth_m, int32_t *counts)
{
    memset(counts, 0, sizeof *counts * (size_t)scene->surface_count);
    for (int32_t row = 0; row < lens->height_px; row++) {
        int32_t centre = (2 * row + 1) * rays_along(lens->width_px) + 1;
        for (int32_t column = 0; column < lens->width_px; column++, centre += 2) {
            const int16_t hit = hits[centre];
            float ray[3];
            ray_at(lens, centre, ray);
            *identity++ = hit == RENDER_NOTHING ? -1 : (int16_t)scene->surfaces[hit].identity;
            *depth_m++ = hit == RENDER_NOTHING ? INFINITY : 1.0f / dot3(faces[hit].s, ray);
            if (hit != RENDER_NOTHING)
                counts[hit]++;
        }
    }
}
