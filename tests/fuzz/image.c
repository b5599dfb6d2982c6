// The front end for pictures: any cameras, any rows, calls in any order. What is refused changes nothing, and
// no picture makes a candidate that is not finite.
#include <string.h>

#include "base/trig.h"
#include "vision/internal.h"

#include "models/beacons.h"
#include "picture.h"
#include "base/scalar.h"

enum { FRAMES_MAX = 3 };

static bslam_vision_t vision;
static bslam_vision_t before;

static void require_unchanged_if(bslam_status_t status)
{
    fuzz_require(status == BSLAM_OK || memcmp(&vision, &before, sizeof vision) == 0);
}

static bool set_up(fuzz_input_t *input)
{
    const unsigned count = fuzz_u8(input) % (BSLAM_CAMERAS_MAX + 2);
    bslam_camera_t cameras[BSLAM_CAMERAS_MAX];
    for (unsigned i = 0; i < BSLAM_CAMERAS_MAX; i++) {
        cameras[i] = i < count ? fuzz_any_camera(input) : fuzz_camera(BSLAM_LENS_PINHOLE);
    }
    const bslam_status_t status = bslam_vision_init(&vision, &bslam_beacons_model, cameras, (int32_t)count);
    require_unchanged_if(status);
    return status == BSLAM_OK;
}

/// A turn that two frames tell is one, with a doubt: at most the widest pattern and half a turn of the head.
static void require_turn(void)
{
    bslam_turn_t turn;
    if (bslam_vision_turn(&vision, &turn)) {
        fuzz_require(bslam_in_range(turn.turn_rad, -3 * BSLAM_PI, 3 * BSLAM_PI));
        fuzz_require(turn.variance_rad2 > 0 && isfinite((double)turn.variance_rad2));
        fuzz_require(bslam_in_range(turn.mismatch, 0, 2));
        fuzz_require(isfinite((double)turn.parallax_rad_per_m) &&
                     isfinite((double)turn.parallax_sd_rad_per_m));
    }
}

/// The rows of a frame: as many as it has, fewer, or too many.
static void give_rows(fuzz_input_t *input, int32_t height_px)
{
    uint8_t row[FUZZ_ROW_BYTES];
    const unsigned choice = fuzz_u8(input);
    const int32_t rows = choice < 8 ? (int32_t)choice * 5 : height_px;
    const bool is_room = (choice & 64u) != 0;
    memset(row, fuzz_u8(input), sizeof row);
    for (int32_t y = 0; y < rows; y++) {
        if (is_room) {
            fuzz_room_row(y, row);
        }
        if (!is_room || choice >= 128) {
            fuzz_row(input, row);
        }
        const bslam_status_t status = bslam_vision_row(&vision, row);
        fuzz_require((status == BSLAM_OK) == (y < height_px));
    }
}

static void give_frame(fuzz_input_t *input)
{
    const unsigned flags = fuzz_u8(input);
    const int32_t camera = (int32_t)(flags & 3u) - 1;
    const bslam_pixel_format_t format = (bslam_pixel_format_t)(flags >> 2 & 3u);
    const bslam_camera_t *lens = camera >= 0 && camera < BSLAM_CAMERAS_MAX
                                     ? &bslam_vision_instance(&vision)->front_end.cameras[camera]
                                     : NULL;
    const int32_t width_px = lens != NULL ? lens->width_px : BSLAM_IMAGE_WIDTH_MAX;
    const int32_t height_px = lens != NULL ? lens->height_px : BSLAM_IMAGE_HEIGHT_MAX;
    memcpy(&before, &vision, sizeof before);
    const bslam_status_t status =
        bslam_vision_begin(&vision, camera, format, width_px, height_px + ((flags & 16u) != 0 ? 4 : 0));
    require_unchanged_if(status);
    if (status == BSLAM_OK) {
        give_rows(input, height_px);
    }
    memcpy(&before, &vision, sizeof before);
    const bslam_status_t ended = bslam_vision_end(&vision, (flags & 32u) != 0);
    require_unchanged_if(ended);
    if (ended == BSLAM_OK) {
        fuzz_require_candidates(&vision);
        require_turn();
    }
    memcpy(&before, &vision, sizeof before);
    require_unchanged_if(bslam_vision_point(&vision, camera, fuzz_real(input, -4, 4)));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_input_t input = {data, size};
    memset(&vision, 0, sizeof vision);
    memset(&before, 0, sizeof before);
    if (!set_up(&input)) {
        return 0;
    }
    for (int frame = 0; frame < FRAMES_MAX && input.left > 0; frame++) {
        give_frame(&input);
    }
    return 0;
}
