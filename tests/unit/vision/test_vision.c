// The public calls, where they do more than hand on to the front end.
#include "support.h"

#include "blank_model.h"

#include "vision/internal.h"

#define WIDTH 160
#define HEIGHT 120

static unit_detector_t detector;
static bslam_beacon_model_t model;
static bslam_vision_t vision;

static const bslam_camera_t camera = {.lens = BSLAM_LENS_PINHOLE,
                                      .width_px = WIDTH,
                                      .height_px = HEIGHT,
                                      .fx_px = 140,
                                      .fy_px = 140,
                                      .cx_px = 80,
                                      .cy_px = 60,
                                      .z_m = BSLAM_R(0.5)};

static int start(void **state)
{
    model = unit_blank_model(&detector);
    memset(&vision, 0, sizeof vision);
    assert_int_equal(bslam_vision_init(&vision, &model, &camera, 1), BSLAM_OK);
    return 0;
}

/// A picture of grey posts before a wall, so many pixels to the right.
static void show(int right_px)
{
    uint8_t row[WIDTH][3];
    assert_int_equal(bslam_vision_begin(&vision, 0, BSLAM_PIXELS_RGB888, WIDTH, HEIGHT), BSLAM_OK);
    for (int x = 0; x < WIDTH; x++) {
        const int at = x - right_px + WIDTH;
        memset(row[x], at * at / 16 % 13 < 5 ? 190 : 110, sizeof row[x]);
    }
    for (int y = 0; y < HEIGHT; y++) {
        assert_int_equal(bslam_vision_row(&vision, row), BSLAM_OK);
    }
    assert_int_equal(bslam_vision_row(&vision, row), BSLAM_E_COUNT);
    assert_int_equal(bslam_vision_end(&vision, true), BSLAM_OK);
}

static void test_init_other_sizes_are_refused_and_nothing_is_written(void **state)
{
    static bslam_vision_t before;
    memcpy(&before, &vision, sizeof before);
    assert_int_equal(
        bslam_vision_init_sized(&vision, sizeof vision + 8, BSLAM_VISION_HASH, &model, &camera, 1),
        BSLAM_E_SIZE);
    assert_int_equal(
        bslam_vision_init_sized(&vision, sizeof vision, BSLAM_VISION_HASH + 1, &model, &camera, 1),
        BSLAM_E_SIZE);
    assert_memory_equal(&vision, &before, sizeof before);
}

static void test_size_of_an_instance_is_hardly_more_than_what_stands_in_it(void **state)
{
    assert_true(sizeof vision <= sizeof(bslam_vision_instance_t) * 51 / 50);
}

static void test_sightings_are_those_of_the_candidates_with_a_bearing(void **state)
{
    bslam_front_end_t *front_end = &bslam_vision_instance(&vision)->front_end;
    for (int i = 0; i < 3; i++) {
        front_end->candidates[i] = (bslam_candidate_t){.has_bearing = i != 1,
                                                       .bearing_rad = real(0.1 * i),
                                                       .has_range = i == 2,
                                                       .range_m = 4,
                                                       .beacon_class = (uint8_t)(i + 1)};
    }
    front_end->candidate_count = 3;
    bslam_sighting_t seen[BSLAM_CANDIDATES_MAX];
    assert_int_equal(bslam_vision_sightings(&vision, seen), 2);
    assert_int_equal(seen[0].beacon_class, 1);
    assert_false(seen[0].has_range);
    assert_int_equal(seen[1].beacon_class, 3);
    assert_near(seen[1].bearing_rad, 0.2, 1e-6);
    assert_true(seen[1].has_range);
    assert_ptr_equal(seen[1].signature, front_end->candidates[2].signature);
}

static void test_counters_count_pictures_by_what_came_of_them(void **state)
{
    show(0);
    show(0);
    assert_int_equal(bslam_vision_begin(&vision, 0, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT), BSLAM_OK);
    const uint16_t row[WIDTH] = {0};
    assert_int_equal(bslam_vision_row(&vision, row), BSLAM_OK);
    assert_int_equal(bslam_vision_end(&vision, true), BSLAM_E_COUNT);
    assert_int_equal(bslam_vision_reason(&vision), BSLAM_VISION_UNFINISHED);
    show(0);
    const bslam_vision_counters_t counters = bslam_vision_counters(&vision);
    assert_int_equal(counters.frames[BSLAM_VISION_UNFINISHED], 1);
    assert_int_equal(counters.frames[BSLAM_VISION_SEEN] + counters.frames[BSLAM_VISION_NOTHING], 3);
}

static void test_turn_is_by_how_much_the_picture_went_sideways(void **state)
{
    bslam_turn_t turn = {.turn_rad = 7};
    show(0);
    assert_false(bslam_vision_turn(&vision, &turn));  // there is none before
    assert_near(turn.turn_rad, 7, 0);
    show(0);
    assert_true(bslam_vision_turn(&vision, &turn));
    assert_near(turn.turn_rad, 0, 1e-3);
    show(4);
    assert_true(bslam_vision_turn(&vision, &turn));
    assert_near(turn.turn_rad, 4.0 / 140, 3e-3);  // what stands ahead goes to the right: a turn to the left
    bslam_vision_forget_turns(&vision);
    show(4);
    assert_false(bslam_vision_turn(&vision, &turn));
}

static void test_reason_name_every_reason_has_its_own(void **state)
{
    for (int a = 0; a < BSLAM_VISION_REASON_COUNT; a++) {
        for (int b = 0; b < a; b++) {
            assert_string_not_equal(bslam_vision_reason_name((bslam_vision_reason_t)a),
                                    bslam_vision_reason_name((bslam_vision_reason_t)b));
        }
    }
    assert_string_equal(bslam_vision_reason_name(BSLAM_VISION_REASON_COUNT), "unknown reason");
}

#define TEST(name) cmocka_unit_test_setup(name, start)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(test_init_other_sizes_are_refused_and_nothing_is_written),
        TEST(test_size_of_an_instance_is_hardly_more_than_what_stands_in_it),
        TEST(test_sightings_are_those_of_the_candidates_with_a_bearing),
        TEST(test_counters_count_pictures_by_what_came_of_them),
        TEST(test_turn_is_by_how_much_the_picture_went_sideways),
        TEST(test_reason_name_every_reason_has_its_own),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
