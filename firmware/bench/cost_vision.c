/// What the vision front end costs on this board, in ticks of port_ticks for each frame: one line each,
/// "frame number ticks candidates"; then a scanner's of five kinds: "rows number ticks candidates" while
/// they come in, "scan number ticks candidates" for the rest. sizes_doc.py puts the pictures at PICTURES: the
/// camera's lens (0 pinhole, 1 equidistant), how many frames, and the frames, 320x240 in RGB565.
#include "bench/text.h"
#include "vision/vision.h"
#include "models/beacons.h"
#include "models/own_room.h"
#include "port/port.h"

#define WIDTH_PX 320
#define HEIGHT_PX 240
#define PICTURES ((const pictures_t *)0x20200000u)

typedef struct pictures {
    uint32_t is_wide;
    uint32_t count;
    uint16_t frames[][WIDTH_PX * HEIGHT_PX];
} pictures_t;

static bslam_vision_t vision;

// As in host_sim/bslam/rigs: three60's middle camera, wide180's only one.
static const bslam_camera_t pinhole = {.lens = BSLAM_LENS_PINHOLE,
                                       .width_px = WIDTH_PX,
                                       .height_px = HEIGHT_PX,
                                       .fx_px = 277.1f,
                                       .fy_px = 277.1f,
                                       .cx_px = 159.5f,
                                       .cy_px = 157.5f,
                                       .z_m = 0.5f};
static const bslam_camera_t wide = {.lens = BSLAM_LENS_EQUIDISTANT,
                                    .width_px = WIDTH_PX,
                                    .height_px = HEIGHT_PX,
                                    .fx_px = 101.859f,
                                    .fy_px = 101.859f,
                                    .cx_px = 159.5f,
                                    .cy_px = 119.5f,
                                    .z_m = 0.5f};

typedef struct ticks {
    uint32_t rows, end;
} ticks_t;

static ticks_t look(const uint16_t *picture)
{
    const uint32_t began = port_ticks();
    bslam_status_t status = bslam_vision_begin(&vision, 0, BSLAM_PIXELS_RGB565, WIDTH_PX, HEIGHT_PX);
    for (int row = 0; row < HEIGHT_PX && status == BSLAM_OK; row++) {
        status = bslam_vision_row(&vision, picture + row * WIDTH_PX);
    }
    const uint32_t came = port_ticks();
    if (status != BSLAM_OK || bslam_vision_end(&vision, true) != BSLAM_OK) {
        text_put("a frame was refused\n");
        port_exit(1);
    }
    return (ticks_t){came - began, port_ticks() - came};
}

static void tell(const char *what, uint32_t frame, uint32_t ticks)
{
    int32_t candidates = 0;
    (void)bslam_vision_candidates(&vision, &candidates);
    text_put(what);
    text_put_number(frame);
    text_put(" ");
    text_put_number(ticks);
    text_put(" ");
    text_put_number((uint32_t)candidates);
    text_put("\n");
}

int main(void)
{
    port_init();
    const bslam_camera_t *camera = PICTURES->is_wide != 0 ? &wide : &pinhole;
    if (bslam_vision_init(&vision, &bslam_beacons_model, camera, 1) != BSLAM_OK) {
        return 1;
    }
    for (uint32_t f = 0; f < PICTURES->count; f++) {
        const ticks_t ticks = look(PICTURES->frames[f]);
        tell("frame ", f, ticks.rows + ticks.end);
    }
    if (bslam_vision_init_scanner(&vision, &bslam_own_room, camera, 1) != BSLAM_OK) {
        return 1;
    }
    for (uint32_t f = 0; f < PICTURES->count; f++) {
        const ticks_t ticks = look(PICTURES->frames[f]);
        tell("rows ", f, ticks.rows);
        tell("scan ", f, ticks.end);
    }
    return 0;
}
