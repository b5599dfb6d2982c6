/* The simulated camera's ray caster: what each pixel meets, how light it is there, and what a sensor makes of
 * it.
 *
 * A scene is a set of rectangles in space ("surfaces"): walls, floor, ceiling, the sides of boxes. A lens is
 * a table of rays, so pinhole, distorted and fisheye lenses are all the same here.
 *
 * A ray d (a unit vector from the eye) meets a surface's plane at the distance t with 1/t = s(d), and there
 * at the fractions u = a(d)/s(d) of its width and v = b(d)/s(d) of its height; s, a and b are linear in d. So
 * "the ray meets the rectangle" reads s > 0, 0 <= a <= s, 0 <= b <= s without a division, and the nearest
 * surface is the one with the largest s. Over a tile of rays, none farther than r from their mean c, a linear
 * form f stays within |f| r of f(c): that tells which surfaces a tile can meet at all.
 *
 * Rays stand on a grid of half pixels, (2 width + 1) x (2 height + 1): the ray (2 i + 1, 2 j + 1) is the
 * centre of pixel (i, j) and settles identity and depth; its eight neighbours tell which surfaces share the
 * pixel's colour, weighted 1 2 1 both ways. A texture is fetched once for each surface that a pixel meets.
 *
 * Frames: the scene's is x, y in plan, z up, metres. The level frame is the camera's without its pitch:
 * origin at the eye, x forward, y left, z up; rays are in it. Colours are linear, 1 = a white wall in unit
 * light. Nothing here allocates, keeps state or checks: raw.py owns every array and has checked its sizes.
 */
#ifndef BSLAM_WORLD_CAMERA_RENDER_H
#define BSLAM_WORLD_CAMERA_RENDER_H

#include <stdint.h>

enum {
    RENDER_TILE = 32,       /* rays a side of a tile */
    RENDER_LIGHT_NODES = 8, /* of a surface's light map, each way */
    RENDER_BLUR_TAPS = 7,   /* of the blur along a row, the middle one at index 3 */
    RENDER_LEVELS_MAX = 12, /* of a texture: 2048 texels a side */
    RENDER_NORMALS = 4096,  /* values in the table of normal deviates */
    RENDER_TONES = 4096,    /* steps of the tone curve */
    RENDER_NOTHING = -1,    /* in hits: the ray meets no surface */
    RENDER_CUT_OUT = 1,     /* flag: the texture's alpha says where the surface is, not how it glows */
    RENDER_BILLBOARD = 2    /* flag: turns about the vertical through its middle to face the eye */
};

/* A rectangle, seen only from the side on which `right` points to the right when `down` points down. */
typedef struct render_surface {
    float corner_m[3]; /* its upper left corner, as seen from the front */
    float right_m[3];  /* from there to the upper right one */
    float down_m[3];   /* and to the lower left one */
    float tiles_u;     /* how often the texture is repeated along `right` and `down` */
    float tiles_v;
    float glow_lamp; /* light sent out where alpha is 0, as a multiple of the lamps' and of the sky's level */
    float glow_sky;
    int32_t texture;
    int32_t flags;
    int32_t identity; /* what the identity picture says: a beacon's id, -1 none, -2 clutter */
} render_surface_t;

/* Mip-mapped picture with sides that are powers of two. Texels are 0xAABBGGRR, the square roots of linear
 * colour; level i starts at texels[first[i]] and has the sides halved i times, down to where one of them
 * is 1. */
typedef struct render_texture {
    int32_t first[RENDER_LEVELS_MAX];
    int32_t width_log2;
    int32_t height_log2;
    int32_t levels;
} render_texture_t;

/* A surface as the rays see it. All forms are 0 if the eye is behind it. The norms are those of s, a, b, s -
 * a and s - b. */
typedef struct render_face {
    float s[3];
    float a[3];
    float b[3];
    float norms[5];
} render_face_t;

typedef struct render_scene {
    const render_surface_t *surfaces;
    int32_t surface_count;
    const render_texture_t *textures;
    const uint32_t *texels;
    const float *light; /* [surface][node row][node column]{lamp, sky} */
} render_scene_t;

/* The rays and where the tiles are, (2 width + 1) x (2 height + 1) each; a ray (0, 0, 0) meets nothing. */
typedef struct render_lens {
    int32_t width_px;
    int32_t height_px;
    const float *ray_x;
    const float *ray_y;
    const float *ray_z;
    const float *tiles; /* [tile row][tile column]{mean ray, radius}; render_tiles writes it */
    float pixel_rad;    /* about what a pixel sees, for the choice of a mip level */
} render_lens_t;

/* Light at the moment of a frame, RGB: of the lamps and of the sky through the windows. */
typedef struct render_light {
    float lamp[3];
    float sky[3];
} render_light_t;

/* Eye in the scene's frame, and the direction that level rays' x axis points to. */
typedef struct render_eye {
    float at_m[3];
    float cos_yaw;
    float sin_yaw;
} render_eye_t;

/* What the sensor does with the light. The noise of a pixel's three values has the
 * variance shot * (their mean before white balance) + read^2; values are 0 to 1.
 */
typedef struct render_sensor {
    float gain[3]; /* exposure times white balance, by channel */
    float shot;
    float read;
    float blur_row[RENDER_BLUR_TAPS];
    float blur_column; /* share that goes to each of the two neighbours above and below */
} render_sensor_t;

/* Mean ray and radius of every tile. */
void render_tiles(const render_lens_t *lens, float *tiles);

/* The light maps: what lamps {x, y, z, strength, sky share} give each node of each surface, unless one of the
 * walls {x0, y0, x1, y1} stands between, plus the ambient {lamp, sky}. A lamp with sky share 1 is a window.
 */
void render_bake(const render_surface_t *surfaces, int32_t surface_count, const float *lamps,
                 int32_t lamp_count, const float *walls, int32_t wall_count, const float ambient[2],
                 float *light);

/* The scene's surfaces as seen from the eye: faces[surface_count]. */
void render_place(const render_scene_t *scene, const render_eye_t *eye, render_face_t *faces);

/* What each ray meets: an index of a surface, or RENDER_NOTHING. `list` is scratch for surface_count. */
void render_trace(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                  int32_t *list, int16_t *hits);

/* How many pixel centres the surfaces first .. first + count - 1 would cover if nothing stood before them.
 * All of those lie within the pixels box {left, top, right, bottom}. */
int32_t render_own_px(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                      int32_t first, int32_t count, const int32_t box[4]);

/* From hits to linear colour times the lens's shading [height][width], linear [height][width][3]. */
void render_shade(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                  const int16_t *hits, const render_light_t *light, const float *vignette, float *linear);

/* From hits to identity and distance along the ray in m (inf: nothing), [height][width], and how many pixel
 * centres each surface got, counts[surface_count]. */
void render_truth(const render_scene_t *scene, const render_lens_t *lens, const render_face_t *faces,
                  const int16_t *hits, int16_t *identity, float *depth_m, int32_t *counts);

/* Blurs the light and turns it into 8 bits with noise, rgb [height][width][3]; `random` is advanced.
 * normals[RENDER_NORMALS]: quantiles of the normal distribution; tones[RENDER_TONES]: the tone curve;
 * scratch [height + 1][width][3]. */
void render_expose(const render_lens_t *lens, const render_sensor_t *sensor, const float *normals,
                   const uint8_t *tones, uint64_t *random, const float *linear, float *scratch, uint8_t *rgb);

#endif
