// vision.h's calls where a scanner looks.
#include "support.h"

#include <math.h>
#include <string.h>

#include "picture.h"
#include "square_model.h"
#include "vision/vision.h"

enum { WIDTH = 160, HEIGHT = 120 };

static bslam_vision_t vision, before;
static square_model_t square;
static bslam_camera_t cameras[2];
static uint16_t picture[HEIGHT][WIDTH];

static int make(void **state)
{
    (void)state;
    square_model_make(&square);
    const bslam_camera_t camera = {.width_px = WIDTH,
                                   .height_px = HEIGHT,
                                   .fx_px = 140,
                                   .fy_px = 140,
                                   .cx_px = 79.5f,
                                   .cy_px = 59.5f,
                                   .z_m = 0.5f};
    cameras[0] = cameras[1] = camera;
    cameras[1].yaw_rad = 1;
    assert_int_equal(bslam_vision_init_scanner(&vision, &square.model, cameras, 2), BSLAM_OK);
    return 0;
}

static void draw(int left, int top, int side)
{
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            const bool inside = x >= left && x < left + side && y >= top && y < top + side;
            picture[y][x] = inside ? 31 << 11 | 8 << 5 | 4 : 16 << 11 | 32 << 5 | 16;
        }
    }
}

static const bslam_candidate_t *see(int camera, int32_t *count)
{
    assert_int_equal(bslam_vision_begin(&vision, camera, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT), BSLAM_OK);
    for (int y = 0; y < HEIGHT; y++) {
        assert_int_equal(bslam_vision_row(&vision, picture[y]), BSLAM_OK);
    }
    assert_int_equal(bslam_vision_end(&vision, true), BSLAM_OK);
    return bslam_vision_candidates(&vision, count);
}

static void test_each_camera_tells_directions_of_the_robot(void **state)
{
    (void)state;
    draw(64, 44, 32);
    for (int camera = 0; camera < 2; camera++) {
        int32_t count = 0;
        const bslam_candidate_t *found = see(camera, &count);
        assert_true(count >= 1);
        assert_near(found[0].bearing_rad, camera, 0.03);
        assert_near(found[0].range_m, 0.5 * 140 / 32, 0.5);
        bslam_sighting_t sightings[BSLAM_CANDIDATES_MAX];
        assert_int_equal(bslam_vision_sightings(&vision, sightings), count);
        assert_near(sightings[0].bearing_rad, found[0].bearing_rad, 0);
        assert_int_equal(sightings[0].beacon_class, 1);
    }
    assert_int_equal(bslam_vision_reason(&vision), BSLAM_VISION_SEEN);
    assert_int_equal(bslam_vision_counters(&vision).frames[BSLAM_VISION_SEEN], 2);
    bslam_turn_t turn;
    assert_false(bslam_vision_turn(&vision, &turn));
}

static void test_pan_unit_turns_a_camera(void **state)
{
    (void)state;
    draw(64, 44, 32);
    assert_int_equal(bslam_vision_point(&vision, 0, 0.5f), BSLAM_OK);
    assert_int_equal(bslam_vision_point(&vision, 2, 0.5f), BSLAM_E_RANGE);
    assert_int_equal(bslam_vision_point(&vision, 0, 4), BSLAM_E_RANGE);
    int32_t count = 0;
    assert_near(see(0, &count)[0].bearing_rad, 0.5, 0.03);
}

static void test_zoom_looks_closer_and_boxes_stay_where_they_are(void **state)
{
    (void)state;
    draw(64, 44, 32);
    int32_t count = 0;
    const bslam_candidate_t plain = see(0, &count)[0];
    cameras[0].zoom = 2;
    assert_int_equal(bslam_vision_init_scanner(&vision, &square.model, cameras, 1), BSLAM_OK);
    const bslam_candidate_t zoomed = see(0, &count)[0];
    assert_near(zoomed.outline.left_px, plain.outline.left_px, 3);
    assert_near(zoomed.outline.bottom_px, plain.outline.bottom_px, 3);
    assert_near(zoomed.bearing_rad, plain.bearing_rad, 0.02);
    draw(60, 60, 8);  // two cells of the picture, four of what is looked at
    const bslam_candidate_t small = see(0, &count)[0];
    assert_true(count >= 1);
    assert_near(small.outline.left_px, 59.5, 2);
    assert_near(small.outline.right_px, 67.5, 2);
}

static void test_unfinished_picture_is_refused_and_counted(void **state)
{
    (void)state;
    draw(64, 44, 32);
    assert_int_equal(bslam_vision_row(&vision, picture[0]), BSLAM_E_COUNT);
    assert_int_equal(bslam_vision_end(&vision, true), BSLAM_E_COUNT);
    assert_int_equal(bslam_vision_begin(&vision, 0, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT), BSLAM_OK);
    assert_int_equal(bslam_vision_row(&vision, picture[0]), BSLAM_OK);
    assert_int_equal(bslam_vision_end(&vision, true), BSLAM_E_COUNT);
    int32_t count = 0;
    (void)see(0, &count);
    assert_int_equal(bslam_vision_row(&vision, picture[0]), BSLAM_E_COUNT);
    assert_int_equal(bslam_vision_end(&vision, true), BSLAM_E_COUNT);
    assert_int_equal(bslam_vision_counters(&vision).frames[BSLAM_VISION_UNFINISHED], 1);
}

static void test_what_is_refused_changes_nothing(void **state)
{
    (void)state;
    before = vision;
    assert_int_equal(bslam_vision_begin(&vision, 2, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT), BSLAM_E_RANGE);
    assert_int_equal(bslam_vision_begin(&vision, 0, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT / 2), BSLAM_E_RANGE);
    assert_int_equal(bslam_vision_init_scanner(&vision, &square.model, cameras, 0), BSLAM_E_COUNT);
    cameras[1].fx_px = NAN;
    assert_int_equal(bslam_vision_init_scanner(&vision, &square.model, cameras, 2), BSLAM_E_NOT_FINITE);
    cameras[1] = cameras[0];
    square.kind.height_sd = 0;
    assert_int_equal(bslam_vision_init_scanner(&vision, &square.model, cameras, 2), BSLAM_E_PARAMETER);
    assert_memory_equal(&vision, &before, sizeof vision);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_each_camera_tells_directions_of_the_robot, make),
        cmocka_unit_test_setup(test_pan_unit_turns_a_camera, make),
        cmocka_unit_test_setup(test_zoom_looks_closer_and_boxes_stay_where_they_are, make),
        cmocka_unit_test_setup(test_unfinished_picture_is_refused_and_counted, make),
        cmocka_unit_test_setup(test_what_is_refused_changes_nothing, make),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
