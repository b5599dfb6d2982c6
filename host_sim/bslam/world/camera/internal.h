/* What the ray caster's files share; not for others. */
#ifndef BSLAM_WORLD_CAMERA_INTERNAL_H
#define BSLAM_WORLD_CAMERA_INTERNAL_H

#include "render.h"

/* For the loops that vectors make faster: compiled for old and for newer processors, chosen when the program
 * is loaded. The bits are the same, since neither fuses a multiplication with an addition. */
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__gnu_linux__)
#define RENDER_FOR_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define RENDER_FOR_VECTORS
#endif

static inline float dot3(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Rays along a side of so many pixels. */
static inline int32_t rays_along(int32_t pixels)
{
    return 2 * pixels + 1;
}

/* Alpha (0 to 255) of a texture at u, v in [0, 1], where a pixel covers pixel_u of its width. */
uint32_t texture_alpha(const render_scene_t *scene, int32_t texture, float u, float v, float pixel_u);

#endif
