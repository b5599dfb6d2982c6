#include "support.h"

#include "picture.h"

#include "vision/built_in/detection/gradients.h"
#include "base/scalar.h"

enum {
    SIDE = 24,
    CELLS = 6,
    WAYS = 4,
    BANDS = 3,
    ACROSS = CELLS * CELLS * WAYS,
    DOWN = ACROSS + BANDS * SIDE
};

/// Samples of this box are pixels of the half-resolution copy, one for one: its margin begins at pixel
/// 20, 20.
static const bslam_box_t BOX = {BSLAM_R(47.5), BSLAM_R(47.5), BSLAM_R(79.5), BSLAM_R(79.5)};

static unit_picture_t picture;
static uint8_t features[BSLAM_PATCH_FEATURES];

static int setup(void **state)
{
    unit_picture_fill(&picture, 100, 100, 100);
    return 0;
}

/// Light of a pixel of the half-resolution copy, 8 bits a channel.
static void put(int x, int y, double level)
{
    unit_picture_set(&picture, x, y, level, level, level);
}

static void look(const bslam_box_t *box)
{
    memset(features, 0xAA, sizeof features);
    bslam_patch_features(&picture.frame, box, features);
}

static int cell(int row, int column, int way)
{
    return features[(row * CELLS + column) * WAYS + way];
}

static void test_patch_of_one_colour_is_nothing(void **state)
{
    look(&BOX);
    for (int i = 0; i < BSLAM_PATCH_FEATURES; i++) {
        assert_int_equal(features[i], 0);
    }
}

/// The definition in floating point, from lights of 24x24 samples.
static void by_definition(double light[SIDE][SIDE], double out[BSLAM_PATCH_FEATURES])
{
    static const int edges[BANDS + 1] = {4, 9, 15, 20};
    double cells[CELLS][CELLS][WAYS] = {{{0}}}, across[BANDS][SIDE] = {{0}}, down[BANDS][SIDE] = {{0}},
           total = 0;
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            const int l = x > 0 ? x - 1 : 0, r = x < SIDE - 1 ? x + 1 : x;
            const int u = y > 0 ? y - 1 : 0, d = y < SIDE - 1 ? y + 1 : y;
            const double gx = (light[y][r] - light[y][l]) * 2 / (r - l);
            const double gy = (light[d][x] - light[u][x]) * 2 / (d - u);
            const double steep = atan2(gy, gx) / (3.14159265358979 / WAYS);
            const int way = ((int)floor(steep + 0.5) % WAYS + WAYS) % WAYS;
            cells[y / 4][x / 4][way] += fabs(gx) + fabs(gy);
            total += fabs(gx) + fabs(gy);
            for (int b = 0; b < BANDS; b++) {
                across[b][x] += y >= edges[b] && y < edges[b + 1] ? fabs(gx) / (edges[b + 1] - edges[b]) : 0;
                down[b][y] += x >= edges[b] && x < edges[b + 1] ? fabs(gy) / (edges[b + 1] - edges[b]) : 0;
            }
        }
    }
    for (int y = 0; y < CELLS; y++) {
        for (int x = 0; x < CELLS; x++) {
            double around = 0;
            for (int i = -1; i <= 1; i++) {
                for (int k = -1; k <= 1; k++) {
                    const int v = y + i < 0   ? 0
                                  : y + i > 5 ? 5
                                              : y + i,
                              h = x + k < 0   ? 0
                                  : x + k > 5 ? 5
                                              : x + k;
                    for (int w = 0; w < WAYS; w++) {
                        around += cells[v][h][w];
                    }
                }
            }
            for (int w = 0; w < WAYS; w++) {
                *out++ = fmin(255, 255 * cells[y][x][w] / (around / 9 + 10));
            }
        }
    }
    const double mean = total / (SIDE * SIDE) + 6;
    for (int b = 0; b < BANDS; b++) {
        for (int i = 0; i < SIDE; i++) {
            out[b * SIDE + i] = fmin(255, 32 * across[b][i] / mean);
            out[(BANDS + b) * SIDE + i] = fmin(255, 32 * down[b][i] / mean);
        }
    }
}

static void test_patch_is_what_the_definition_says(void **state)
{
    for (unsigned seed = 1; seed <= 50; seed++) {
        unit_random_t random = {seed};
        double light[SIDE][SIDE], wanted[BSLAM_PATCH_FEATURES];
        for (int y = 0; y < SIDE; y++) {
            for (int x = 0; x < SIDE; x++) {
                // Smooth here, rough there.
                const double level = seed % 2 == 0 ? unit_random(&random, 0, 256)
                                                   : 100 + 3 * x - 2 * y + (x > 12 && y < 9 ? 60 : 0);
                put(20 + x, 20 + y, level);
                const uint16_t pixel = picture.half[(20 + y) * (picture.frame.width_px / 2) + 20 + x];
                light[y][x] = 2 * ((pixel >> 11) + (pixel >> 5 & 63) + (pixel & 31));
            }
        }
        by_definition(light, wanted);
        look(&BOX);
        for (int i = 0; i < BSLAM_PATCH_FEATURES; i++) {
            assert_near(features[i], wanted[i],
                        1.07);  // rounded down, and so is the quotient, by a 4000th at most
        }
    }
}

static void test_patch_upright_edge_stands_where_it_stands(void **state)
{
    for (int y = 0; y < 60; y++) {
        for (int x = 30; x < 60; x++) {
            put(x, y, 200);
        }
    }
    look(&BOX);
    for (int band = 0; band < BANDS; band++) {
        for (int i = 0; i < SIDE; i++) {  // central differences: both samples beside the edge
            assert_true((features[ACROSS + band * SIDE + i] > 0) == (i == 9 || i == 10));
            assert_int_equal(features[DOWN + band * SIDE + i], 0);
        }
    }
    for (int row = 0; row < CELLS; row++) {
        for (int column = 0; column < CELLS; column++) {
            assert_true((cell(row, column, 0) > 0) == (column == 2));
            assert_int_equal(cell(row, column, 1) + cell(row, column, 2) + cell(row, column, 3), 0);
        }
    }
}

static void test_patch_directions_are_told_apart(void **state)
{
    static const int slopes[WAYS][2] = {{8, 0}, {4, 4}, {0, 8}, {4, -4}};
    for (int way = 0; way < WAYS; way++) {
        for (int y = 0; y < SIDE; y++) {
            for (int x = 0; x < SIDE; x++) {
                put(20 + x, 20 + y, 128 + slopes[way][0] * (x - 12) + slopes[way][1] * (y - 12));
            }
        }
        look(&BOX);
        for (int other = 0; other < WAYS; other++) {
            assert_true((cell(2, 3, other) > 128) == (other == way));
        }
    }
}

/// A thing twice as large looks the same.
static void test_patch_does_not_depend_on_size(void **state)
{
    unit_random_t random = {5};
    uint8_t small[BSLAM_PATCH_FEATURES];
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            put(20 + x, 20 + y, unit_random(&random, 0, 256));
        }
    }
    look(&BOX);
    memcpy(small, features, sizeof small);
    random = (unit_random_t){5};
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            const double level = unit_random(&random, 0, 256);
            for (int i = 0; i < 4; i++) {
                put(20 + 2 * x + i % 2, 20 + 2 * y + i / 2, level);
            }
        }
    }
    const bslam_box_t twice = {BSLAM_R(55.5), BSLAM_R(55.5), BSLAM_R(119.5), BSLAM_R(119.5)};
    look(&twice);
    assert_memory_equal(features, small, sizeof small);
}

static void test_patch_beyond_the_frame_its_edge_goes_on(void **state)
{
    const bslam_real_t width = (bslam_real_t)picture.frame.width_px,
                       height = (bslam_real_t)picture.frame.height_px;
    const bslam_box_t boxes[] = {{-200, -100, 40, 60},
                                 {width - 20, height - 20, width + 400, height + 300},
                                 {-BSLAM_R(1e5), -BSLAM_R(1e5), BSLAM_R(1e5), BSLAM_R(1e5)},
                                 {width + 500, height + 500, width + 501, height + 501}};
    for (int i = 0; i < COUNT_OF(boxes); i++) {
        look(&boxes[i]);
        for (int k = 0; k < BSLAM_PATCH_FEATURES; k++) {
            assert_int_equal(features[k], 0);  // of a picture of one colour
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_patch_of_one_colour_is_nothing, setup),
        cmocka_unit_test_setup(test_patch_is_what_the_definition_says, setup),
        cmocka_unit_test_setup(test_patch_upright_edge_stands_where_it_stands, setup),
        cmocka_unit_test_setup(test_patch_directions_are_told_apart, setup),
        cmocka_unit_test_setup(test_patch_does_not_depend_on_size, setup),
        cmocka_unit_test_setup(test_patch_beyond_the_frame_its_edge_goes_on, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
