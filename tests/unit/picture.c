#include "picture.h"

#include "support.h"

#define RAYS 4  // a side of a pixel of the half-resolution copy

bslam_camera_t unit_pinhole(void)
{
    return (bslam_camera_t){.lens = BSLAM_LENS_PINHOLE,
                            .width_px = UNIT_PICTURE_WIDTH,
                            .height_px = UNIT_PICTURE_HEIGHT,
                            .fx_px = BSLAM_R(277.1),
                            .fy_px = BSLAM_R(277.1),
                            .cx_px = BSLAM_R(159.5),
                            .cy_px = BSLAM_R(119.5),
                            .z_m = BSLAM_R(0.5)};
}

bslam_camera_t unit_equidistant(void)
{
    bslam_camera_t camera = unit_pinhole();
    camera.lens = BSLAM_LENS_EQUIDISTANT;
    camera.fx_px = BSLAM_R(101.9);
    camera.fy_px = BSLAM_R(101.9);
    return camera;
}

void unit_picture_set(unit_picture_t *picture, int x, int y, double red, double green, double blue)
{
    const unsigned r = (unsigned)(red * 31 / 255 + 0.5);
    const unsigned g = (unsigned)(green * 63 / 255 + 0.5);
    const unsigned b = (unsigned)(blue * 31 / 255 + 0.5);
    picture->half[y * (UNIT_PICTURE_WIDTH / 2) + x] = (uint16_t)(r << 11 | g << 5 | b);
}

static void begin(unit_picture_t *picture, double red, double green, double blue)
{
    picture->surroundings =
        (bslam_surroundings_t){.wall = {(float)red, (float)green, (float)blue}, .known = true};
    picture->frame = (bslam_frame_t){.width_px = UNIT_PICTURE_WIDTH,
                                     .height_px = UNIT_PICTURE_HEIGHT,
                                     .columns = UNIT_PICTURE_WIDTH / BSLAM_CELL_PX,
                                     .rows = UNIT_PICTURE_HEIGHT / BSLAM_CELL_PX,
                                     .half = picture->half,
                                     .surroundings = &picture->surroundings};
}

void unit_picture_fill(unit_picture_t *picture, double red, double green, double blue)
{
    begin(picture, red, green, blue);
    for (int y = 0; y < UNIT_PICTURE_HEIGHT / 2; y++) {
        for (int x = 0; x < UNIT_PICTURE_WIDTH / 2; x++) {
            unit_picture_set(picture, x, y, red, green, blue);
        }
    }
}

/// How far along a ray from the camera a panel is, in lengths of the ray; 0 if it is not met.
static double meets(const unit_panel_t *panel, const bslam_direction_t *ray, double height_m)
{
    const double along_x = panel->x1_m - panel->x0_m;
    const double along_y = panel->y1_m - panel->y0_m;
    const double rx = (double)ray->x;
    const double ry = (double)ray->y;
    // t (rx, ry) = (x0, y0) + s along.
    const double determinant = along_x * ry - along_y * rx;
    const double t = (along_x * panel->y0_m - along_y * panel->x0_m) / determinant;
    const double s = (rx * panel->y0_m - ry * panel->x0_m) / determinant;
    const double z = height_m + t * (double)ray->z;
    return t > 0 && s >= 0 && s <= 1 && z >= panel->low_m && z <= panel->high_m ? t : 0;
}

/// Adds the colour that a point of the frame shows.
static void add_ray(const bslam_camera_t *camera, double u, double v, const double wall[3],
                    const unit_panel_t *panels, int count, double sum[3])
{
    bslam_direction_t ray = {0, 0, 1};
    const bool seen = bslam_camera_unproject(camera, real(u), real(v), &ray) == BSLAM_OK;
    const unit_panel_t *nearest = NULL;
    double nearest_t = 1e9;
    for (int i = 0; seen && i < count; i++) {
        const double t = meets(&panels[i], &ray, (double)camera->z_m);
        if (t > 0 && t < nearest_t) {
            nearest = &panels[i];
            nearest_t = t;
        }
    }
    sum[0] += nearest != NULL ? nearest->red : wall[0];
    sum[1] += nearest != NULL ? nearest->green : wall[1];
    sum[2] += nearest != NULL ? nearest->blue : wall[2];
}

void unit_picture_draw(unit_picture_t *picture, const bslam_camera_t *camera, const double wall[3],
                       const unit_panel_t *panels, int count)
{
    begin(picture, wall[0], wall[1], wall[2]);
    for (int y = 0; y < UNIT_PICTURE_HEIGHT / 2; y++) {
        for (int x = 0; x < UNIT_PICTURE_WIDTH / 2; x++) {
            double sum[3] = {0, 0, 0};
            for (int k = 0; k < RAYS * RAYS; k++) {
                const double right = (k % RAYS + 0.5) / RAYS;
                const double down = ((double)(k / RAYS) + 0.5) / RAYS;
                add_ray(camera, 2 * (x + right) - 0.5, 2 * (y + down) - 0.5, wall, panels, count, sum);
            }
            unit_picture_set(picture, x, y, sum[0] / (RAYS * RAYS), sum[1] / (RAYS * RAYS),
                             sum[2] / (RAYS * RAYS));
        }
    }
}
