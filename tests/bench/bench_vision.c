// The vision front end on one picture after the other. bench_vision.py makes the pictures and counts
// the instructions of measured_frame.
//
//     vision pinhole|wide WIDTH FILE    FILE: frames of WIDTH x 3/4 WIDTH in RGB565, the camera's rows one
//                                       after the other; WIDTH is 320 or 160
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "vision/vision.h"
#include "models/beacons.h"

#define WIDTH_PX 320
#define HEIGHT_PX 240

static bslam_vision_t vision;
static uint16_t picture[WIDTH_PX * HEIGHT_PX];
static int32_t width_px = WIDTH_PX;
static int32_t height_px = HEIGHT_PX;

void measured_frame(void);

__attribute__((noinline)) void measured_frame(void)
{
    bslam_status_t status = bslam_vision_begin(&vision, 0, BSLAM_PIXELS_RGB565, width_px, height_px);
    for (int row = 0; row < height_px && status == BSLAM_OK; row++) {
        status = bslam_vision_row(&vision, picture + row * width_px);
    }
    if (status != BSLAM_OK || bslam_vision_end(&vision, true) != BSLAM_OK) {
        (void)fprintf(stderr, "bench: a frame was refused\n");
        exit(1);
    }
}

/// The same lens before a sensor of half the pixels each way.
static bslam_camera_t halved(bslam_camera_t camera)
{
    camera.width_px /= 2;
    camera.height_px /= 2;
    camera.fx_px /= 2;
    camera.fy_px /= 2;
    camera.cx_px = (camera.cx_px - BSLAM_R(0.5)) / 2;
    camera.cy_px = (camera.cy_px - BSLAM_R(0.5)) / 2;
    return camera;
}

int main(int argc, char **argv)
{
    if (argc != 4) {
        return 1;
    }
    // As in host_sim/bslam/rigs: three60's middle camera, wide180's only one.
    const bslam_camera_t pinhole = {.lens = BSLAM_LENS_PINHOLE,
                                    .width_px = WIDTH_PX,
                                    .height_px = HEIGHT_PX,
                                    .fx_px = BSLAM_R(277.1),
                                    .fy_px = BSLAM_R(277.1),
                                    .cx_px = BSLAM_R(159.5),
                                    .cy_px = BSLAM_R(157.5),
                                    .z_m = BSLAM_R(0.5)};
    const bslam_camera_t wide = {.lens = BSLAM_LENS_EQUIDISTANT,
                                 .width_px = WIDTH_PX,
                                 .height_px = HEIGHT_PX,
                                 .fx_px = BSLAM_R(101.859),
                                 .fy_px = BSLAM_R(101.859),
                                 .cx_px = BSLAM_R(159.5),
                                 .cy_px = BSLAM_R(119.5),
                                 .z_m = BSLAM_R(0.5),
                                 .zoom = 2};
    const bslam_camera_t whole = strcmp(argv[1], "wide") == 0 ? wide : pinhole;
    const bslam_camera_t camera = strcmp(argv[2], "160") == 0 ? halved(whole) : whole;
    width_px = camera.width_px;
    height_px = camera.height_px;
    const size_t bytes = sizeof picture[0] * (size_t)width_px * (size_t)height_px;
    if (bslam_vision_init(&vision, &bslam_beacons_model, &camera, 1) != BSLAM_OK) {
        return 1;
    }
    FILE *file = fopen(argv[3], "rb");
    int frames = 0;
    int candidates = 0;
    while (file != NULL && fread(picture, bytes, 1, file) == 1) {
        int32_t count = 0;
        measured_frame();
        (void)bslam_vision_candidates(&vision, &count);
        candidates += count;
        frames++;
    }
    if (file == NULL || fclose(file) != 0 || frames == 0) {
        return 1;
    }
    printf("%d %d %zu\n", frames, candidates, sizeof vision);
    return 0;
}
