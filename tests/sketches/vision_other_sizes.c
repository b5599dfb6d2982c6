// An application that was compiled with other sizes than the vision library's: the first calls refuse it, and
// not a byte is written, neither in the instances nor beside them.
#include <stdio.h>
#include <string.h>

#include "vision/vision.h"

#include "models/beacons.h"

static struct memory {
    bslam_visual_gyro_t gyro;
    bslam_vision_t vision;
    unsigned char neighbour[8192];
} memory;

int main(void)
{
    const bslam_camera_t camera = {
        .width_px = 64, .height_px = 48, .fx_px = 60, .fy_px = 60, .cx_px = 32, .cy_px = 24};
    memset(&memory, 0x5a, sizeof memory);
    const bslam_status_t status = bslam_vision_init(&memory.vision, &bslam_beacons_model, &camera, 1);
    const bslam_status_t of_gyro = bslam_visual_gyro_init(&memory.gyro, BSLAM_VISUAL_GYRO_SD_RADPS);
    unsigned lost = 0;
    for (size_t i = 0; i < sizeof memory; i++) {
        lost += ((const unsigned char *)&memory)[i] != 0x5a;
    }
    printf("%s, %s, %u bytes written\n", bslam_status_name(status), bslam_status_name(of_gyro), lost);
    return status == BSLAM_E_SIZE && of_gyro == BSLAM_E_SIZE && lost == 0 ? 0 : 1;
}
