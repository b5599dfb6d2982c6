// The vision library alone, in C: two pictures of posts before a wall tell how the robot turned between them.
#include <stdio.h>

#include "vision/vision.h"

#include "models/beacons.h"

#define WIDTH 160
#define HEIGHT 120
#define FOCAL_PX 140
#define TURN_PX 4

static bslam_vision_t vision;

/// A picture in which all stands so many pixels farther to the right. False: it was refused.
static bool look(int right_px)
{
    uint16_t row[WIDTH];
    for (int x = 0; x < WIDTH; x++) {
        const int at = x - right_px + WIDTH;
        row[x] = at * at / 16 % 13 < 5 ? 0xBDF7 : 0x6B6D;
    }
    bslam_status_t status = bslam_vision_begin(&vision, 0, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT);
    for (int y = 0; y < HEIGHT && status == BSLAM_OK; y++) {
        status = bslam_vision_row(&vision, row);
    }
    return status == BSLAM_OK && bslam_vision_end(&vision, true) == BSLAM_OK;
}

int main(void)
{
    const bslam_camera_t camera = {.width_px = WIDTH,
                                   .height_px = HEIGHT,
                                   .fx_px = FOCAL_PX,
                                   .fy_px = FOCAL_PX,
                                   .cx_px = WIDTH / 2,
                                   .cy_px = HEIGHT / 2,
                                   .z_m = BSLAM_R(0.5)};
    if (bslam_vision_init(&vision, &bslam_beacons_model, &camera, 1) != BSLAM_OK) {
        return 1;
    }
    bslam_turn_t turn = {0};
    const bool first = look(0) && bslam_vision_turn(&vision, &turn);
    const bool second = look(TURN_PX) && bslam_vision_turn(&vision, &turn);
    const bslam_real_t error_rad = turn.turn_rad - (bslam_real_t)TURN_PX / FOCAL_PX;
    printf("turned %.4f rad\n", (double)turn.turn_rad);
    return first || !second || !(error_rad < BSLAM_R(0.003) && error_rad > BSLAM_R(-0.003));
}
