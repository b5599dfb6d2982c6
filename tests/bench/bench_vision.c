// The vision front end on one picture after the other. tools/bench_vision.py makes the pictures and counts
// the instructions of measured_frame.
//
//     vision pinhole|wide FILE    FILE: frames of 320x240 in RGB565, the camera's rows one after the other
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bslam/vision/vision.h"
#include "models/beacons.h"

#define WIDTH_PX 320
#define HEIGHT_PX 240

static bslam_vision_t vision;
static uint16_t picture[WIDTH_PX * HEIGHT_PX];

void measured_frame(void);

__attribute__((noinline)) void measured_frame(void)
{
    bslam_status_t status = bslam_vision_begin(&vision, 0, BSLAM_PIXELS_RGB565, WIDTH_PX, HEIGHT_PX);
    for (int row = 0; row < HEIGHT_PX && status == BSLAM_OK; row++) {
        status = bslam_vision_row(&vision, picture + row * WIDTH_PX);
    }
    if (status != BSLAM_OK || bslam_vision_end(&vision, true) != BSLAM_OK) {
        (void)fprintf(stderr, "bench: a frame was refused\n");
        exit(1);
    }
}

int main(int argc, char **argv)
{
    if (argc != 3) {
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
                                 .z_m = BSLAM_R(0.5)};
    const bslam_camera_t *camera = strcmp(argv[1], "wide") == 0 ? &wide : &pinhole;
    if (bslam_vision_init(&vision, &bslam_beacons_model, camera, 1) != BSLAM_OK) {
        return 1;
    }
    FILE *file = fopen(argv[2], "rb");
    int frames = 0;
    int candidates = 0;
    while (file != NULL && fread(picture, sizeof picture, 1, file) == 1) {
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
