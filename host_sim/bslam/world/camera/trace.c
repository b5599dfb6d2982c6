/* Which surface each ray meets. See render.h for the linear forms. */
#include "render.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "internal.h"

#define NEAREST_EYE_M 1e-4f /* an eye nearer to a plane than this sees it end-on: nothing */

static int32_t smaller(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static int32_t tiles_along(int32_t rays)
{
    return (rays + RENDER_TILE - 1) / RENDER_TILE;
}

/* --- Tiles
 * --------------------------------------------------------------------------------------------------- */

typedef struct tile {
    int32_t x, y, columns, rows; /* of rays */
    float mean[3], radius;
} tile_t;

static tile_t tile_at(const render_lens_t *lens, int32_t column, int32_t row)
{
    const int32_t rays_x = rays_along(lens->width_px), rays_y = rays_along(lens->height_px);
    tile_t tile = {.x = column * RENDER_TILE, .y = row * RENDER_TILE};
    tile.columns = smaller(RENDER_TILE, rays_x - tile.x);
    tile.rows = smaller(RENDER_TILE, rays_y - tile.y);
    const float *bounds = &lens->tiles[4 * (row * tiles_along(rays_x) + column)];
    memcpy(tile.mean, bounds, sizeof tile.mean);
    tile.radius = bounds[3];
    return tile;
}

static void tile_bounds(const render_lens_t *lens, const tile_t *tile, float bounds[4])
{
    const int32_t stride = rays_along(lens->width_px);
    const float *axes[3] = {lens->ray_x, lens->ray_y, lens->ray_z};
    float square = 0.0f;
    for (int32_t axis = 0; axis < 3; axis++) {
        double sum = 0.0;
        for (int32_t y = 0; y < tile->rows; y++)
            for (int32_t x = 0; x < tile->columns; x++)
                sum += (double)axes[axis][(tile->y + y) * stride + tile->x + x];
        bounds[axis] = (float)(sum / (tile->rows * tile->columns));
    }
    for (int32_t y = 0; y < tile->rows; y++) {
        for (int32_t x = 0; x < tile->columns; x++) {
            const int32_t at = (tile->y + y) * stride + tile->x + x;
            const float off[3] = {axes[0][at] - bounds[0], axes[1][at] - bounds[1], axes[2][at] - bounds[2]};
            square = fmaxf(square, dot3(off, off));
        }
    }
    bounds[3] = 1.0001f * sqrtf(square);
}

void render_tiles(const render_lens_t *lens, float *tiles)
{
    const int32_t columns = tiles_along(rays_along(lens->width_px));
    const int32_t rows = tiles_along(rays_along(lens->height_px));
    render_lens_t own = *lens;
    own.tiles = tiles;
    memset(tiles, 0, sizeof *tiles * 4 * (size_t)(columns * rows));
    for (int32_t row = 0; row < rows; row++) {
        for (int32_t column = 0; column < columns; column++) {
            const tile_t tile = tile_at(&own, column, row);
            tile_bounds(lens, &tile, &tiles[4 * (row * columns + column)]);
        }
    }
}

/* Whether some ray of the tile may meet the face. */
static bool may_meet(const render_face_t *face, const tile_t *tile)
{
    const float r = tile->radius;
    const float s = dot3(face->s, tile->mean);
    if (!(s + face->norms[0] * r > 0.0f))
        return false;
    const float a = dot3(face->a, tile->mean), b = dot3(face->b, tile->mean);
    return a + face->norms[1] * r >= 0.0f && b + face->norms[2] * r >= 0.0f &&
           s - a + face->norms[3] * r >= 0.0f && s - b + face->norms[4] * r >= 0.0f;
}

/* --- Placing surfaces before the eye
 * ------------------------------------------------------------------------- */

static void to_level(const render_eye_t *eye, const float from[3], float to[3])
{
    to[0] = eye->cos_yaw * from[0] + eye->sin_yaw * from[1];
    to[1] = eye->cos_yaw * from[1] - eye->sin_yaw * from[0];
    to[2] = from[2];
}

/* Turns a billboard: its width across the line of sight to its middle. */
static render_surface_t facing(const render_surface_t *surface, const render_eye_t *eye)
{
    render_surface_t turned = *surface;
    const float half_m = 0.5f * sqrtf(dot3(surface->right_m, surface->right_m));
    const float middle_x = surface->corner_m[0] + 0.5f * surface->right_m[0];
    const float middle_y = surface->corner_m[1] + 0.5f * surface->right_m[1];
    const float look_x = middle_x - eye->at_m[0], look_y = middle_y - eye->at_m[1];
    const float length = fmaxf(sqrtf(look_x * look_x + look_y * look_y), NEAREST_EYE_M);
    const float right_x = half_m * look_y / length, right_y = -half_m * look_x / length;
    turned.corner_m[0] = middle_x - right_x;
    turned.corner_m[1] = middle_y - right_y;
    turned.right_m[0] = 2.0f * right_x;
    turned.right_m[1] = 2.0f * right_y;
    return turned;
}

/* The form of a fraction along one side: (p - corner) . side / |side|^2 at p = d / s(d), times s(d). */
static void fraction_form(const float corner[3], const float side[3], const float s[3], float form[3])
{
    const float scale = 1.0f / dot3(side, side);
    const float offset = dot3(corner, side) * scale;
    for (int32_t i = 0; i < 3; i++)
        form[i] = side[i] * scale - offset * s[i];
}

static float difference_norm(const float a[3], const float b[3])
{
    const float d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sqrtf(dot3(d, d));
}

static render_face_t place(const render_surface_t *surface, const render_eye_t *eye)
{
    render_face_t face = {0};
    const float from_eye[3] = {surface->corner_m[0] - eye->at_m[0], surface->corner_m[1] - eye->at_m[1],
                               surface->corner_m[2] - eye->at_m[2]};
    float corner[3], right[3], down[3];
    to_level(eye, from_eye, corner);
    to_level(eye, surface->right_m, right);
    to_level(eye, surface->down_m, down);
    /* Points away from whoever sees the front. */
    const float normal[3] = {right[1] * down[2] - right[2] * down[1], right[2] * down[0] - right[0] * down[2],
                             right[0] * down[1] - right[1] * down[0]};
    const float length = sqrtf(dot3(normal, normal));
    const float away = dot3(normal, corner);
    if (!(away > NEAREST_EYE_M * length))
        return face;
    for (int32_t i = 0; i < 3; i++)
        face.s[i] = normal[i] / away;
    fraction_form(corner, right, face.s, face.a);
    fraction_form(corner, down, face.s, face.b);
    face.norms[0] = sqrtf(dot3(face.s, face.s));
    face.norms[1] = sqrtf(dot3(face.a, face.a));
    face.norms[2] = sqrtf(dot3(face.b, face.b));
    face.norms[3] = difference_norm(face.s, face.a);
    face.norms[4] = difference_norm(face.s, face.b);
    return face;
}

void render_place(const render_scene_t *scene, const render_eye_t *eye, render_face_t *faces)
{
    for (int32_t i = 0; i < scene->surface_count; i++) {
        const render_surface_t *surface = &scene->surfaces[i];
        if (surface->flags & RENDER_BILLBOARD) {
            const render_surface_t turned = facing(surface, eye);
            faces[i] = place(&turned, eye);
        } else {
            faces[i] = place(surface, eye);
        }
    }
}

/* --- Tracing
 * ------------------------------------------------------------------------------------------------- */

/* A tile being traced: the inverse distance of the nearest hit so far, and which surface that is. */
typedef struct cover {
    float nearest[RENDER_TILE * RENDER_TILE];
    int32_t hit[RENDER_TILE * RENDER_TILE];
} cover_t;

/* The hot loop: branch-free, so that the compiler makes it a vector loop. */
RENDER_FOR_VECTORS static void cover_row(const render_face_t *face, int32_t index, int32_t count,
                                         const float *restrict x, const float *restrict y,
                                         const float *restrict z, float *restrict nearest,
                                         int32_t *restrict hit)
{
    const float s0 = face->s[0], s1 = face->s[1], s2 = face->s[2];
    const float a0 = face->a[0], a1 = face->a[1], a2 = face->a[2];
    const float b0 = face->b[0], b1 = face->b[1], b2 = face->b[2];
    for (int32_t i = 0; i < count; i++) {
        const float s = s0 * x[i] + s1 * y[i] + s2 * z[i];
        const float a = a0 * x[i] + a1 * y[i] + a2 * z[i];
        const float b = b0 * x[i] + b1 * y[i] + b2 * z[i];
        const int32_t inside = (s > nearest[i]) & (a >= 0.0f) & (a <= s) & (b >= 0.0f) & (b <= s);
        nearest[i] = inside ? s : nearest[i];
        hit[i] = inside ? index : hit[i];
    }
}

/* The same for a texture with holes. */
static void cover_row_cut_out(const render_scene_t *scene, const render_face_t *face, int32_t index,
                              float pixel_rad, int32_t count, const float *x, const float *y, const float *z,
                              float *nearest, int32_t *hit)
{
    const render_surface_t *surface = &scene->surfaces[index];
    const float width_m = sqrtf(dot3(surface->right_m, surface->right_m));
    for (int32_t i = 0; i < count; i++) {
        const float ray[3] = {x[i], y[i], z[i]};
        const float s = dot3(face->s, ray), a = dot3(face->a, ray), b = dot3(face->b, ray);
        if (!(s > nearest[i] && a >= 0.0f && a <= s && b >= 0.0f && b <= s))
            continue;
        const float pixel_u = pixel_rad / (s * width_m);
        if (texture_alpha(scene, surface->texture, a / s, b / s, pixel_u) < 128)
            continue;
        nearest[i] = s;
        hit[i] = index;
    }
}

static void cover_tile(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *face,
                       int32_t index, const tile_t *tile, cover_t *cover)
{
    const int32_t stride = rays_along(lens->width_px);
    const bool cut_out = scene->surfaces[index].flags & RENDER_CUT_OUT;
    for (int32_t row = 0; row < tile->rows; row++) {
        const int32_t at = (tile->y + row) * stride + tile->x;
        float *nearest = &cover->nearest[row * RENDER_TILE];
        int32_t *hit = &cover->hit[row * RENDER_TILE];
        const float *x = &lens->ray_x[at], *y = &lens->ray_y[at], *z = &lens->ray_z[at];
        if (cut_out)
            cover_row_cut_out(scene, face, index, lens->pixel_rad, tile->columns, x, y, z, nearest, hit);
        else
            cover_row(face, index, tile->columns, x, y, z, nearest, hit);
    }
}

static void clear(cover_t *cover)
{
    memset(cover->nearest, 0, sizeof cover->nearest);
    for (int32_t i = 0; i < RENDER_TILE * RENDER_TILE; i++)
        cover->hit[i] = RENDER_NOTHING;
}

static void trace_tile(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                       const int32_t *list, int32_t list_count, const tile_t *tile, int16_t *hits)
{
    cover_t cover;
    clear(&cover);
    for (int32_t i = 0; i < list_count; i++) {
        const render_face_t *face = &faces[list[i]];
        if (may_meet(face, tile))
            cover_tile(scene, lens, face, list[i], tile, &cover);
    }
    const int32_t stride = rays_along(lens->width_px);
    for (int32_t row = 0; row < tile->rows; row++)
        for (int32_t column = 0; column < tile->columns; column++)
            hits[(tile->y + row) * stride + tile->x + column] =
                (int16_t)cover.hit[row * RENDER_TILE + column];
}

void render_trace(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                  int32_t *list, int16_t *hits)
{
    int32_t count = 0;
    for (int32_t i = 0; i < scene->surface_count; i++)
        if (faces[i].norms[0] > 0.0f)
            list[count++] = i;
    const int32_t columns = tiles_along(rays_along(lens->width_px));
    const int32_t rows = tiles_along(rays_along(lens->height_px));
    for (int32_t row = 0; row < rows; row++) {
        for (int32_t column = 0; column < columns; column++) {
            const tile_t tile = tile_at(lens, column, row);
            trace_tile(scene, lens, faces, list, count, &tile, hits);
        }
    }
}

/* Pixel centres are the rays with two odd coordinates; a tile starts at even ones. */
static int32_t centres_covered(const tile_t *tile, const cover_t *cover)
{
    int32_t count = 0;
    for (int32_t row = 1; row < tile->rows; row += 2)
        for (int32_t column = 1; column < tile->columns; column += 2)
            count += cover->hit[row * RENDER_TILE + column] != RENDER_NOTHING;
    return count;
}

int32_t render_own_px(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                      int32_t first, int32_t count, const int32_t box[4])
{
    int32_t own_px = 0;
    for (int32_t row = 2 * box[1] / RENDER_TILE; row <= (2 * box[3] + 1) / RENDER_TILE; row++) {
        for (int32_t column = 2 * box[0] / RENDER_TILE; column <= (2 * box[2] + 1) / RENDER_TILE; column++) {
            const tile_t tile = tile_at(lens, column, row);
            cover_t cover;
            clear(&cover);
            for (int32_t i = first; i < first + count; i++)
                if (may_meet(&faces[i], &tile))
                    cover_tile(scene, lens, &faces[i], i, &tile, &cover);
            own_px += centres_covered(&tile, &cover);
        }
    }
    return own_px;
}
