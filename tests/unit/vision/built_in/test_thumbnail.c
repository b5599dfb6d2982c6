#include "support.h"

#include "vision/built_in/thumbnail.h"

#define WIDTH 40  // ten cells: of those taken four at a time two are left
#define HEIGHT 32

static bslam_thumbnail_t thumbnail;
static bslam_row_sums_t row_sums;
static uint16_t picture[HEIGHT][WIDTH];

static uint16_t rgb565(int red5, int green6, int blue5)
{
    return (uint16_t)(red5 << 11 | green6 << 5 | blue5);
}

static void fill(uint16_t pixel)
{
    for (int row = 0; row < HEIGHT; row++) {
        for (int column = 0; column < WIDTH; column++) {
            picture[row][column] = pixel;
        }
    }
}

static void stream_in(void)
{
    assert_int_equal(bslam_thumbnail_begin(&thumbnail, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT), BSLAM_OK);
    for (int row = 0; row < HEIGHT; row++) {
        assert_int_equal(bslam_thumbnail_row(&thumbnail, &row_sums, picture[row]), BSLAM_OK);
    }
}

static void test_begin_size_or_format_not_allowed_is_refused_and_nothing_changes(void **state)
{
    static const struct {
        int format, width, height;
    } wrong[] = {
        {2, 32, 32},
        {-1, 32, 32},
        {0, 28, 32},
        {0, 36, 32},
        {0, 32, 30},
        {0, 24, 32},
        {0, BSLAM_IMAGE_WIDTH_MAX + 8, 32},
        {0, 32, BSLAM_IMAGE_HEIGHT_MAX + 4},
        {0, -32, 32},
        {0, 32, 0},
    };
    fill(rgb565(3, 5, 7));
    stream_in();
    static bslam_thumbnail_t before;
    before = thumbnail;
    for (int i = 0; i < COUNT_OF(wrong); i++) {
        assert_int_equal(bslam_thumbnail_begin(&thumbnail, (bslam_pixel_format_t)wrong[i].format,
                                               wrong[i].width, wrong[i].height),
                         BSLAM_E_RANGE);
        assert_memory_equal(&thumbnail, &before, sizeof before);
    }
}

static void test_row_beyond_the_last_is_refused_and_nothing_changes(void **state)
{
    fill(rgb565(3, 5, 7));
    stream_in();
    static bslam_thumbnail_t before;
    before = thumbnail;
    assert_int_equal(bslam_thumbnail_row(&thumbnail, &row_sums, picture[0]), BSLAM_E_COUNT);
    assert_memory_equal(&thumbnail, &before, sizeof before);
}

static void test_row_cell_is_the_mean_of_its_pixels_by_hand(void **state)
{
    fill(rgb565(0, 0, 0));
    // The second cell of the second row of cells: red 0 to 15, green 2 x red, blue 31 in one pixel.
    int value = 0;
    for (int row = 4; row < 8; row++) {
        for (int column = 4; column < 8; column++) {
            picture[row][column] = rgb565(value, 2 * value, value == 15 ? 31 : 0);
            value++;
        }
    }
    stream_in();
    const bslam_cell_t cell = bslam_cell_at(&thumbnail.cells, 1 * (WIDTH / 4) + 1);
    assert_int_equal(cell.red, 120 / 2);    // 16 values of 5 bits: half their sum is 8 bits
    assert_int_equal(cell.green, 240 / 4);  // 6 bits: a quarter
    assert_int_equal(cell.blue, 31 / 2);
    // Quarters: sums of red 10, 18, 42, 50 and of green twice that; luma is red + green.
    assert_int_equal(cell.spread, 3 * 50 - 3 * 10);
    assert_int_equal(thumbnail.cells.green[0], 0);
}

static void test_row_half_resolution_is_the_mean_of_four_rounded(void **state)
{
    fill(rgb565(10, 20, 30));
    picture[6][8] = rgb565(11, 22, 30);
    picture[7][9] = rgb565(11, 20, 28);
    stream_in();
    assert_int_equal(thumbnail.half[0], rgb565(10, 20, 30));
    // Red 42/4 = 10.5 rounds up, green 82/4 = 20.5 too, blue 118/4 = 29.5 too.
    assert_int_equal(thumbnail.half[3 * (WIDTH / 2) + 4], rgb565(11, 21, 30));
}

/// Sums of the channels of `side` x `side` pixels.
static void plain_sums(int row, int column, int side, int sums[3])
{
    memset(sums, 0, 3 * sizeof sums[0]);
    for (int r = row; r < row + side; r++) {
        for (int c = column; c < column + side; c++) {
            sums[0] += picture[r][c] >> 11;
            sums[1] += picture[r][c] >> 5 & 63;
            sums[2] += picture[r][c] & 31;
        }
    }
}

static void test_row_random_picture_is_summed_as_pixel_by_pixel(void **state)
{
    unit_random_t random = {21};
    for (int row = 0; row < HEIGHT; row++) {
        for (int column = 0; column < WIDTH; column++) {
            picture[row][column] = (uint16_t)unit_random(&random, 0, 65536);
        }
    }
    stream_in();
    int sums[3];
    for (int i = 0; i < WIDTH / 2 * (HEIGHT / 2); i++) {
        plain_sums(i / (WIDTH / 2) * 2, i % (WIDTH / 2) * 2, 2, sums);
        assert_int_equal(thumbnail.half[i], rgb565((sums[0] + 2) / 4, (sums[1] + 2) / 4, (sums[2] + 2) / 4));
    }
    for (int i = 0; i < WIDTH / 4 * (HEIGHT / 4); i++) {
        const int row = i / (WIDTH / 4) * 4, column = i % (WIDTH / 4) * 4;
        int low = 1000, high = 0;
        for (int quarter = 0; quarter < 4; quarter++) {
            plain_sums(row + quarter / 2 * 2, column + quarter % 2 * 2, 2, sums);
            low = sums[0] + sums[1] < low ? sums[0] + sums[1] : low;
            high = sums[0] + sums[1] > high ? sums[0] + sums[1] : high;
        }
        plain_sums(row, column, 4, sums);
        const bslam_cell_t cell = bslam_cell_at(&thumbnail.cells, i);
        assert_int_equal(cell.red, sums[0] / 2);
        assert_int_equal(cell.green, sums[1] / 4);
        assert_int_equal(cell.blue, sums[2] / 2);
        assert_int_equal(cell.spread, high - low > 255 ? 255 : high - low);
    }
}

static void test_row_may_lie_anywhere(void **state)
{
    static uint8_t bytes[sizeof picture[0] + 3];
    static bslam_thumbnail_t aligned;
    unit_random_t random = {22};
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        picture[i / WIDTH][i % WIDTH] = (uint16_t)unit_random(&random, 0, 65536);
    }
    stream_in();
    aligned = thumbnail;
    for (int shift = 1; shift < 4; shift++) {
        assert_int_equal(bslam_thumbnail_begin(&thumbnail, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT), BSLAM_OK);
        for (int row = 0; row < HEIGHT; row++) {
            memcpy(bytes + shift, picture[row], sizeof picture[row]);
            assert_int_equal(bslam_thumbnail_row(&thumbnail, &row_sums, bytes + shift), BSLAM_OK);
        }
        assert_memory_equal(&thumbnail.cells, &aligned.cells, sizeof aligned.cells);
        assert_memory_equal(thumbnail.half, aligned.half, sizeof aligned.half);
    }
}

static void test_row_extremes_do_not_run_over(void **state)
{
    fill(rgb565(31, 63, 31));
    stream_in();
    for (int i = 0; i < WIDTH / 4 * (HEIGHT / 4); i++) {
        assert_int_equal(thumbnail.cells.red[i], 248);
        assert_int_equal(thumbnail.cells.green[i], 252);
        assert_int_equal(thumbnail.cells.blue[i], 248);
        assert_int_equal(thumbnail.cells.spread[i], 0);
    }
    for (int i = 0; i < WIDTH / 2 * (HEIGHT / 2); i++) {
        assert_int_equal(thumbnail.half[i], 0xFFFF);
    }
}

static void test_row_rgb888_is_as_rgb565(void **state)
{
    static uint8_t row888[3 * WIDTH];
    static bslam_thumbnail_t packed;
    unit_random_t random = {11};
    for (int row = 0; row < HEIGHT; row++) {
        for (int column = 0; column < WIDTH; column++) {
            picture[row][column] = (uint16_t)unit_random(&random, 0, 65536);
        }
    }
    stream_in();
    packed = thumbnail;
    assert_int_equal(bslam_thumbnail_begin(&thumbnail, BSLAM_PIXELS_RGB888, WIDTH, HEIGHT), BSLAM_OK);
    for (int row = 0; row < HEIGHT; row++) {
        for (int column = 0; column < WIDTH; column++) {
            const uint16_t pixel = picture[row][column];
            row888[3 * column] = (uint8_t)((pixel >> 11) << 3 | 5);  // the lower bits do not count
            row888[3 * column + 1] = (uint8_t)((pixel >> 5 & 63) << 2 | 1);
            row888[3 * column + 2] = (uint8_t)((pixel & 31) << 3 | 7);
        }
        assert_int_equal(bslam_thumbnail_row(&thumbnail, &row_sums, row888), BSLAM_OK);
    }
    assert_memory_equal(&thumbnail.cells, &packed.cells, sizeof packed.cells);
    assert_memory_equal(thumbnail.half, packed.half, sizeof packed.half);
}

static void test_row_picture_moved_by_a_cell_moves_the_cells(void **state)
{
    static bslam_cells_t cells;
    unit_random_t random = {12};
    fill(rgb565(9, 9, 9));
    for (int row = 8; row < 16; row++) {
        for (int column = 8; column < 20; column++) {
            picture[row][column] = (uint16_t)unit_random(&random, 0, 65536);
        }
    }
    stream_in();
    cells = thumbnail.cells;
    memmove(&picture[4][8], &picture[0][0],
            sizeof picture - 4 * sizeof picture[0] - 8 * sizeof picture[0][0]);
    stream_in();
    for (int row = 2; row < 4; row++) {
        for (int column = 2; column < 5; column++) {
            const bslam_cell_t moved = bslam_cell_at(&thumbnail.cells, (row + 1) * (WIDTH / 4) + column + 2);
            const bslam_cell_t before = bslam_cell_at(&cells, row * (WIDTH / 4) + column);
            assert_memory_equal(&moved, &before, sizeof before);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_begin_size_or_format_not_allowed_is_refused_and_nothing_changes),
        cmocka_unit_test(test_row_beyond_the_last_is_refused_and_nothing_changes),
        cmocka_unit_test(test_row_cell_is_the_mean_of_its_pixels_by_hand),
        cmocka_unit_test(test_row_half_resolution_is_the_mean_of_four_rounded),
        cmocka_unit_test(test_row_random_picture_is_summed_as_pixel_by_pixel),
        cmocka_unit_test(test_row_may_lie_anywhere),
        cmocka_unit_test(test_row_extremes_do_not_run_over),
        cmocka_unit_test(test_row_rgb888_is_as_rgb565),
        cmocka_unit_test(test_row_picture_moved_by_a_cell_moves_the_cells),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
