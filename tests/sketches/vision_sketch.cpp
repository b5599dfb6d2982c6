// A sketch as a board's C++ core runs it: a camera's rows stream in, what is seen comes out as sightings.
#include <stdio.h>

#include "vision/vision.h"

#include "models/beacons.h"

static const int WIDTH = 320;
static const int HEIGHT = 240;

static bslam_vision_t vision;
static bool failed = false;

static void check(bslam_status_t status)
{
    if (status != BSLAM_OK) {
        printf("%s\n", bslam_status_name(status));
        failed = true;
    }
}

static bslam_camera_t camera_ahead()
{
    bslam_camera_t camera = bslam_camera_t();
    camera.lens = BSLAM_LENS_PINHOLE;
    camera.width_px = WIDTH;
    camera.height_px = HEIGHT;
    camera.fx_px = camera.fy_px = 277.1F;
    camera.cx_px = 159.5F;
    camera.cy_px = 157.5F;
    camera.z_m = 0.5F;
    return camera;
}

/// A blue cabinet of 1.8 m, 5 m ahead, before a light wall that ends where a dark floor begins.
static void take_row(int y, unsigned char row[3 * WIDTH])
{
    static const unsigned char wall[3] = {190, 185, 175}, floor[3] = {100, 85, 70},
                               cabinet[3] = {30, 70, 150};
    for (int x = 0; x < WIDTH; x++) {
        const bool is_cabinet = y >= 85 && y < 185 && x >= 135 && x < 185;
        for (int channel = 0; channel < 3; channel++) {
            row[3 * x + channel] = (is_cabinet ? cabinet : y >= 185 ? floor : wall)[channel];
        }
    }
}

static void setup()
{
    const bslam_camera_t camera = camera_ahead();
    check(bslam_camera_check(&camera));
    check(bslam_vision_init(&vision, &bslam_beacons_model, &camera, 1));
}

static void loop()
{
    unsigned char row[3 * WIDTH];
    check(bslam_vision_begin(&vision, 0, BSLAM_PIXELS_RGB888, WIDTH, HEIGHT));
    for (int y = 0; y < HEIGHT; y++) {
        take_row(y, row);
        check(bslam_vision_row(&vision, row));
    }
    check(bslam_vision_end(&vision, true));
}

int main()
{
    setup();
    for (int picture = 0; picture < 2; picture++) {
        loop();
    }
    bslam_sighting_t seen[BSLAM_CANDIDATES_MAX];
    const int count = bslam_vision_sightings(&vision, seen);
    printf("%s: %d\n", bslam_vision_reason_name(bslam_vision_reason(&vision)), count);
    if (failed || count != 1) {
        return 1;
    }
    printf("%s at %.2f m, %.3f rad\n", bslam_beacons_model.classes[seen[0].beacon_class - 1].name,
           (double)seen[0].range_m, (double)seen[0].bearing_rad);
    return !(seen[0].has_range && seen[0].range_m > 4.8F && seen[0].range_m < 5.2F);
}
