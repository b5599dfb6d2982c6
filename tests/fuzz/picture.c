#include "picture.h"

#include <string.h>

#include "base/trig.h"
#include "base/scalar.h"
#include "vision/internal.h"

bslam_camera_t fuzz_camera(bslam_lens_kind_t lens)
{
    const bslam_camera_t camera = {.lens = lens,
                                   .width_px = FUZZ_WIDTH,
                                   .height_px = FUZZ_HEIGHT,
                                   .fx_px = lens == BSLAM_LENS_PINHOLE ? 28 : 10,
                                   .fy_px = lens == BSLAM_LENS_PINHOLE ? 28 : 10,
                                   .cx_px = BSLAM_R(15.5),
                                   .cy_px = BSLAM_R(15.5),
                                   .z_m = BSLAM_R(0.9)};
    return camera;
}

bslam_camera_t fuzz_any_camera(fuzz_input_t *input)
{
    const unsigned flags = fuzz_u8(input);
    bslam_camera_t camera = fuzz_camera((bslam_lens_kind_t)(flags & 1u));
    if ((flags & 2u) != 0) {
        camera.width_px = 24 + 8 * (int32_t)(fuzz_u8(input) % 6);
        camera.height_px = 28 + 4 * (int32_t)(fuzz_u8(input) % 4);
        camera.cx_px = (bslam_real_t)camera.width_px / 2;
        camera.cy_px = (bslam_real_t)camera.height_px / 2;
    }
    bslam_real_t *const values[] = {&camera.fx_px,   &camera.fy_px,     &camera.cx_px,
                                    &camera.cy_px,   &camera.k1,        &camera.k2,
                                    &camera.yaw_rad, &camera.pitch_rad, &camera.z_m};
    for (unsigned i = flags >> 2 & 3u; i > 0; i--) {
        const unsigned which = fuzz_u8(input) % (sizeof values / sizeof values[0]);
        *values[which] = fuzz_real(input, -2, which < 4 ? 70 : 2);
    }
    if ((flags & 128u) != 0) {
        camera.lens = (bslam_lens_kind_t)fuzz_u8(input);
        camera.width_px = (int32_t)fuzz_u16(input);
    }
    return camera;
}

void fuzz_row(fuzz_input_t *input, uint8_t row[FUZZ_ROW_BYTES])
{
    const unsigned choice = fuzz_u8(input);
    for (unsigned run = choice % 4; run > 0; run--) {
        const int from = fuzz_u8(input) % FUZZ_ROW_BYTES;
        const int count = fuzz_u8(input);
        const int room = FUZZ_ROW_BYTES - from;
        memset(&row[from], fuzz_u8(input), (size_t)(count < room ? count : room));
    }
    if (choice >= 192) {
        row[fuzz_u8(input) % FUZZ_ROW_BYTES] ^= fuzz_u8(input);
    }
}

void fuzz_room_row(int32_t y, uint8_t row[FUZZ_ROW_BYTES])
{
    static const uint8_t thing[3] = {190, 30, 40};
    static const uint8_t floor[3] = {90, 80, 70};
    const bool is_floor = y >= 22;
    const bool in_thing = y >= 8 && y < 18;
    for (int32_t x = 0; x < FUZZ_WIDTH; x++) {
        const bool is_thing = in_thing && x >= 8 && x < 16;
        const uint8_t wall[3] = {205, 200, (uint8_t)(190 + (x + y) % 4)};
        memcpy(&row[3 * x], is_thing ? thing : is_floor ? floor : wall, sizeof wall);
    }
}

static void require_candidate(const bslam_vision_t *vision, const bslam_candidate_t *candidate)
{
    const bslam_box_t *box = &candidate->outline;
    const int32_t classes = bslam_const_vision_instance(vision)->front_end.model->class_count;
    fuzz_require(isfinite((double)box->left_px) && isfinite((double)box->right_px));
    fuzz_require(box->left_px <= box->right_px && box->top_px <= box->bottom_px);
    fuzz_require(isfinite((double)candidate->score) && isfinite((double)candidate->class_margin));
    fuzz_require(candidate->beacon_class >= 1 && candidate->beacon_class <= classes);
    fuzz_require(candidate->second_class <= classes);
    if (candidate->has_bearing) {
        fuzz_require(bslam_in_range(candidate->bearing_rad, -BSLAM_PI, BSLAM_PI));
        fuzz_require(candidate->bearing_sd_rad > 0 && isfinite((double)candidate->bearing_sd_rad));
    }
    if (candidate->has_range) {
        fuzz_require(candidate->range_m > 0 && isfinite((double)candidate->range_m));
        fuzz_require(candidate->range_sd_m > 0 && isfinite((double)candidate->range_sd_m));
    }
    for (int k = 0; k < BSLAM_SIGNATURE_SIZE; k++) {
        fuzz_require(isfinite((double)candidate->signature[k]));
    }
}

void fuzz_require_candidates(const bslam_vision_t *vision)
{
    int32_t count = -1;
    const bslam_candidate_t *candidates = bslam_vision_candidates(vision, &count);
    fuzz_require(count >= 0 && count <= BSLAM_CANDIDATES_MAX);
    fuzz_require((count > 0) == (bslam_vision_reason(vision) == BSLAM_VISION_SEEN));
    for (int32_t i = 0; i < count; i++) {
        require_candidate(vision, &candidates[i]);
    }
}

void fuzz_look_at_room(bslam_vision_t *vision)
{
    uint8_t row[FUZZ_ROW_BYTES];
    fuzz_require(bslam_vision_begin(vision, 0, BSLAM_PIXELS_RGB888, FUZZ_WIDTH, FUZZ_HEIGHT) == BSLAM_OK);
    for (int32_t y = 0; y < FUZZ_HEIGHT; y++) {
        fuzz_room_row(y, row);
        fuzz_require(bslam_vision_row(vision, row) == BSLAM_OK);
    }
    fuzz_require(bslam_vision_end(vision, true) == BSLAM_OK);
    fuzz_require_candidates(vision);
}
