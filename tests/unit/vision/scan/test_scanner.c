#include "support.h"

#include <math.h>
#include <string.h>

#include "picture.h"
#include "square_model.h"
#include "vision/scan/scanner.h"

#define WIDTH 160
#define HEIGHT 120

static bslam_scanner_t scanner;
static uint16_t picture[HEIGHT][WIDTH];
static square_model_t square;

static int make_model(void **state)
{
    (void)state;
    square_model_make(&square);
    assert_int_equal(bslam_scanner_init(&scanner, &square.model), BSLAM_OK);
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

static const bslam_detections_t *see(void)
{
    assert_int_equal(bslam_scanner_begin(&scanner, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT), BSLAM_OK);
    for (int y = 0; y < HEIGHT; y++) {
        assert_int_equal(bslam_scanner_row(&scanner, picture[y]), BSLAM_OK);
    }
    return bslam_scanner_end(&scanner);
}

static void test_thing_is_found_where_it_is_at_any_size(void **state)
{
    (void)state;
    static const int places[][3] = {{64, 40, 16}, {20, 60, 16}, {48, 32, 32}, {70, 30, 45}, {24, 8, 64}};
    for (int i = 0; i < COUNT_OF(places); i++) {
        const int left = places[i][0], top = places[i][1], side = places[i][2];
        draw(left, top, side);
        const bslam_detections_t *found = see();
        assert_int_equal(found->reason, BSLAM_VISION_SEEN);
        assert_true(found->count >= 1);  // a corner may be taken for a small one
        const bslam_detection_t *one = &found->items[0];
        const double near = 0.22 * side;  // cells are a quarter of it
        assert_near(one->box.left_px, left - 0.5, near);
        assert_near(one->box.right_px, left + side - 0.5, near);
        assert_near(one->box.top_px, top - 0.5, near);
        assert_near(one->box.bottom_px, top + side - 0.5, near);
        assert_near(one->log_odds, 2 * one->score + 1, 1e-5);
        assert_int_equal(one->marks, 0);
    }
}

static void test_edges_move_a_box_and_no_farther_than_allowed(void **state)
{
    (void)state;
    draw(64, 40, 16);
    const bslam_box_t before = see()->items[0].box;
    square.edge_bias[0] = -0.25f;
    square.edge_bias[3] = 9.0f;
    const bslam_box_t after = see()->items[0].box;
    const double side = before.right_px - before.left_px;
    assert_near(after.left_px, before.left_px - 0.25 * side, 1e-3);
    assert_near(after.bottom_px, before.bottom_px + 0.4 * side, 1e-3);
    assert_near(after.right_px, before.right_px, 1e-3);
    assert_near(after.top_px, before.top_px, 1e-3);
}

static void test_what_is_below_a_floor_is_given_up(void **state)
{
    (void)state;
    draw(64, 40, 16);
    assert_int_equal(see()->count, 1);
    square.floors[0] = INT32_MAX;
    assert_int_equal(see()->count, 0);
}

static void test_thing_at_the_edge_is_marked_and_ends_there(void **state)
{
    (void)state;
    draw(0, 40, 16);
    const bslam_detections_t *found = see();
    assert_int_equal(found->count, 1);
    assert_int_equal(found->items[0].marks, BSLAM_MARK_CUT_LEFT);
    assert_near(found->items[0].box.left_px, -0.5, 1e-6);
}

static void test_thing_that_goes_on_outside_is_marked_wherever_windows_put_its_edges(void **state)
{
    (void)state;
    for (int top = -6; top <= 0; top++) {
        draw(64, top, 32);
        const bslam_detections_t *found = see();
        assert_true(found->count >= 1);
        assert_true(found->items[0].box.top_px >= -0.5);
        if (found->items[0].box.top_px < 0.5) {
            assert_int_equal(found->items[0].marks, BSLAM_MARK_CUT_TOP);
        }
    }
}

static void test_two_things_are_two_and_the_surer_one_is_first(void **state)
{
    (void)state;
    draw(24, 40, 16);
    for (int y = 40; y < 56; y++) {
        for (int x = 100; x < 116; x++) {
            picture[y][x] = 28 << 11 | 20 << 5 | 8;
        }
    }
    const bslam_detections_t *found = see();
    assert_int_equal(found->count, 2);
    assert_true(found->items[0].score > found->items[1].score);
    assert_true(found->items[0].box.right_px < found->items[1].box.left_px);
}

static void test_one_thing_is_of_the_kind_with_the_best_odds(void **state)
{
    (void)state;
    draw(64, 40, 16);
    bslam_scan_kind_t kinds[2] = {square.kind, square.kind};
    bslam_window_t windows[2] = {square.window, square.window};
    windows[1].kind = 1;
    const bslam_scanner_model_t both = {
        .kind_count = 2, .kinds = kinds, .window_count = 2, .windows = windows};
    for (int32_t better = 0; better < 2; better++) {
        kinds[better].offset = 1.5f;
        kinds[1 - better].offset = 1;
        assert_int_equal(bslam_scanner_init(&scanner, &both), BSLAM_OK);
        const bslam_detections_t *found = see();
        assert_int_equal(found->count, 1);
        assert_int_equal(found->items[0].kind, better);
    }
}

static void test_box_of_a_part_is_dropped(void **state)
{
    (void)state;
    draw(64, 40, 16);
    bslam_window_t windows[2] = {square.window, square.window};
    windows[1].box_columns /= 2;  // a quarter of the thing, and within it
    windows[1].box_rows /= 2;
    const bslam_scanner_model_t both = {
        .kind_count = 1, .kinds = &square.kind, .window_count = 2, .windows = windows};
    assert_int_equal(bslam_scanner_init(&scanner, &both), BSLAM_OK);
    assert_int_equal(see()->count, 1);
}

static void test_formats_give_the_same(void **state)
{
    (void)state;
    static uint8_t rgb[WIDTH][3];
    draw(64, 40, 16);
    const bslam_detections_t packed = *see();
    assert_int_equal(bslam_scanner_begin(&scanner, BSLAM_PIXELS_RGB888, WIDTH, HEIGHT), BSLAM_OK);
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            const unsigned pixel = picture[y][x];
            rgb[x][0] = (uint8_t)(pixel >> 11 << 3);
            rgb[x][1] = (uint8_t)((pixel >> 5 & 63) << 2);
            rgb[x][2] = (uint8_t)((pixel & 31) << 3);
        }
        assert_int_equal(bslam_scanner_row(&scanner, rgb), BSLAM_OK);
    }
    const bslam_detections_t *found = bslam_scanner_end(&scanner);
    assert_int_equal(found->count, 1);
    assert_memory_equal(&found->items[0].box, &packed.items[0].box, sizeof packed.items[0].box);
    assert_true(found->items[0].score == packed.items[0].score);
}

static void test_light_that_shows_nothing_has_its_reason(void **state)
{
    (void)state;
    static const struct {
        uint16_t pixel;
        bslam_vision_reason_t reason;
    } all[] = {{0, BSLAM_VISION_BLACK}, {0xFFFF, BSLAM_VISION_OVEREXPOSED}, {0x8410, BSLAM_VISION_FLAT}};
    for (int i = 0; i < COUNT_OF(all); i++) {
        for (int y = 0; y < HEIGHT; y++) {
            for (int x = 0; x < WIDTH; x++) {
                picture[y][x] = all[i].pixel;
            }
        }
        const bslam_detections_t *found = see();
        assert_int_equal(found->reason, all[i].reason);
        assert_int_equal(found->count, 0);
    }
}

static void test_picture_that_is_cut_short_or_looked_at_twice_shows_nothing(void **state)
{
    (void)state;
    assert_int_equal(bslam_scanner_end(&scanner)->reason, BSLAM_VISION_UNFINISHED);
    draw(64, 40, 16);
    assert_int_equal(see()->count, 1);
    const bslam_detections_t *found = bslam_scanner_end(&scanner);
    assert_int_equal(found->reason, BSLAM_VISION_UNFINISHED);
    assert_int_equal(found->count, 0);
    assert_int_equal(bslam_scanner_row(&scanner, picture[0]), BSLAM_E_COUNT);
    assert_int_equal(bslam_scanner_begin(&scanner, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT), BSLAM_OK);
    assert_int_equal(bslam_scanner_row(&scanner, picture[0]), BSLAM_OK);
    assert_int_equal(bslam_scanner_end(&scanner)->reason, BSLAM_VISION_UNFINISHED);
}

static void test_more_boxes_than_there_is_room_for_are_counted(void **state)
{
    (void)state;
    draw(0, 0, 0);
    for (int i = 0; i < 20; i++) {
        for (int k = 0; k < 16 * 16; k++) {
            picture[8 + 28 * (i / 5) + k / 16][8 + 30 * (i % 5) + k % 16] = 31 << 11 | 8 << 5 | 4;
        }
    }
    const bslam_detections_t *found = see();
    assert_int_equal(found->count, BSLAM_CANDIDATES_MAX);
    assert_true(found->dropped > 0);
    for (int i = 1; i < found->count; i++) {
        assert_true(found->items[i - 1].log_odds >= found->items[i].log_odds);  // the best remain
    }
}

static void test_size_or_format_not_allowed_is_refused_and_nothing_changes(void **state)
{
    (void)state;
    static const struct {
        int format, width, height;
    } wrong[] = {{2, 64, 64},  {-1, 64, 64}, {0, 28, 64}, {0, 36, 64}, {0, 64, 30},
                 {0, 24, 64},  {0, -64, 64}, {0, 64, 0},  {0, 64, 28}, {0, BSLAM_IMAGE_WIDTH_MAX + 8, 64},
                 {0, 64, 1000}};
    static bslam_scanner_t before;
    before = scanner;
    for (int i = 0; i < COUNT_OF(wrong); i++) {
        assert_int_equal(bslam_scanner_begin(&scanner, (bslam_pixel_format_t)wrong[i].format, wrong[i].width,
                                             wrong[i].height),
                         BSLAM_E_RANGE);
        assert_memory_equal(&scanner, &before, sizeof before);
    }
}

static void expect_refused(bslam_status_t status)
{
    static bslam_scanner_t before;
    before = scanner;
    assert_int_equal(bslam_scanner_init(&scanner, &square.model), status);
    assert_memory_equal(&scanner, &before, sizeof before);
}

#define WITH(what, value, status) \
    do { \
        const __typeof__(what) good = what; \
        (what) = (value); \
        expect_refused(status); \
        (what) = good; \
    } while (0)

static void test_model_that_cannot_be_is_refused_and_nothing_changes(void **state)
{
    (void)state;
    WITH(square.model.kind_count, 0, BSLAM_E_COUNT);
    WITH(square.model.kind_count, BSLAM_KINDS_MAX + 1, BSLAM_E_COUNT);
    WITH(square.model.window_count, 0, BSLAM_E_COUNT);
    WITH(square.model.window_count, BSLAM_WINDOWS_MAX + 1, BSLAM_E_COUNT);
    WITH(square.window.kind, 1, BSLAM_E_COUNT);
    WITH(square.window.columns, 1, BSLAM_E_COUNT);
    WITH(square.window.columns, BSLAM_WINDOW_SIDE_MAX + 1, BSLAM_E_COUNT);
    WITH(square.window.rows, 1, BSLAM_E_COUNT);
    WITH(square.window.rows, BSLAM_WINDOW_SIDE_MAX + 1, BSLAM_E_COUNT);
    WITH(square.order[2], SQUARE_ROWS / 2, BSLAM_E_COUNT);
    WITH(square.order[2], square.order[1], BSLAM_E_COUNT);
    WITH(square.window.weights, NULL, BSLAM_E_PARAMETER);
    WITH(square.window.order, NULL, BSLAM_E_PARAMETER);
    WITH(square.window.floors, NULL, BSLAM_E_PARAMETER);
    WITH(square.window.edges, NULL, BSLAM_E_PARAMETER);
    WITH(square.window.edge_scale, NULL, BSLAM_E_PARAMETER);
    WITH(square.window.edge_bias, NULL, BSLAM_E_PARAMETER);
    WITH(square.window.bias, INT32_MAX, BSLAM_E_PARAMETER);
    WITH(square.model.kinds, NULL, BSLAM_E_PARAMETER);
    WITH(square.model.windows, NULL, BSLAM_E_PARAMETER);
    WITH(square.window.scale, NAN, BSLAM_E_NOT_FINITE);
    WITH(square.window.scale, 0.0f, BSLAM_E_PARAMETER);
    WITH(square.window.box_columns, 0.0f, BSLAM_E_PARAMETER);
    WITH(square.window.box_columns, SQUARE_COLUMNS + 1.0f, BSLAM_E_PARAMETER);
    WITH(square.window.box_rows, NAN, BSLAM_E_PARAMETER);
    WITH(square.edge_scale[1], INFINITY, BSLAM_E_NOT_FINITE);
    WITH(square.edge_bias[3], NAN, BSLAM_E_NOT_FINITE);
    WITH(square.kind.threshold, NAN, BSLAM_E_NOT_FINITE);
    WITH(square.kind.height_m, -1.0f, BSLAM_E_PARAMETER);
    WITH(square.kind.height_m, 11.0f, BSLAM_E_PARAMETER);
    WITH(square.kind.name, NULL, BSLAM_E_PARAMETER);
    WITH(square.kind.middle_sd, 0.0f, BSLAM_E_PARAMETER);
    WITH(square.kind.height_sd, 0.0f, BSLAM_E_PARAMETER);
    WITH(square.kind.width_m, -1.0f, BSLAM_E_PARAMETER);
    WITH(square.kind.width_m, 10.5f, BSLAM_E_PARAMETER);
    WITH(square.kind.width_m, NAN, BSLAM_E_NOT_FINITE);
    WITH(square.kind.slope, 2e6f, BSLAM_E_PARAMETER);
    WITH(square.kind.offset, -2e6f, BSLAM_E_PARAMETER);
    WITH(square.window.scale, 2e6f, BSLAM_E_PARAMETER);
    assert_int_equal(bslam_scanner_init_sized(&scanner, sizeof scanner - 1, BSLAM_VISION_HASH, &square.model),
                     BSLAM_E_SIZE);
    assert_int_equal(bslam_scanner_init_sized(&scanner, sizeof scanner, BSLAM_VISION_HASH + 1, &square.model),
                     BSLAM_E_SIZE);
}

static void test_cells_are_given_row_by_row_for_training(void **state)
{
    (void)state;
    static uint8_t cells[BSLAM_LEVEL_ROOM];
    bslam_scanner_level_t size = {7, 7, 7};
    draw(64, 40, 16);
    (void)see();
    assert_true(bslam_scanner_cells(&scanner, 0, &size, 2, cells));
    assert_int_equal(size.rows, HEIGHT / 4 + 4);
    assert_int_equal(size.columns, WIDTH / 4 + 4);
    assert_near(size.cell_px, 4, 0);
    assert_int_equal(cells[1], 128);  // grey
    assert_true(bslam_scanner_cells(&scanner, 0, &size, 2 + 11, cells));
    assert_true(cells[(2 + 17) * BSLAM_CHANNELS + 1] > 200);  // red
    assert_false(bslam_scanner_cells(&scanner, 0, &size, size.rows, cells));
    assert_false(bslam_scanner_cells(&scanner, -1, &size, 0, cells));
    assert_false(bslam_scanner_cells(&scanner, 99, &size, 0, cells));
    assert_true(bslam_scanner_cells(&scanner, 4, &size, 0, NULL));
    assert_near(size.cell_px, 8, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_thing_is_found_where_it_is_at_any_size, make_model),
        cmocka_unit_test_setup(test_edges_move_a_box_and_no_farther_than_allowed, make_model),
        cmocka_unit_test_setup(test_what_is_below_a_floor_is_given_up, make_model),
        cmocka_unit_test_setup(test_thing_at_the_edge_is_marked_and_ends_there, make_model),
        cmocka_unit_test_setup(test_thing_that_goes_on_outside_is_marked_wherever_windows_put_its_edges,
                               make_model),
        cmocka_unit_test_setup(test_two_things_are_two_and_the_surer_one_is_first, make_model),
        cmocka_unit_test_setup(test_one_thing_is_of_the_kind_with_the_best_odds, make_model),
        cmocka_unit_test_setup(test_box_of_a_part_is_dropped, make_model),
        cmocka_unit_test_setup(test_formats_give_the_same, make_model),
        cmocka_unit_test_setup(test_light_that_shows_nothing_has_its_reason, make_model),
        cmocka_unit_test_setup(test_picture_that_is_cut_short_or_looked_at_twice_shows_nothing, make_model),
        cmocka_unit_test_setup(test_more_boxes_than_there_is_room_for_are_counted, make_model),
        cmocka_unit_test_setup(test_size_or_format_not_allowed_is_refused_and_nothing_changes, make_model),
        cmocka_unit_test_setup(test_model_that_cannot_be_is_refused_and_nothing_changes, make_model),
        cmocka_unit_test_setup(test_cells_are_given_row_by_row_for_training, make_model),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
