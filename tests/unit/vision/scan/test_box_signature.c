#include "support.h"

#include <math.h>
#include <string.h>

#include "vision/scan/box_signature.h"

enum { WIDTH = 160, HEIGHT = 120 };

static bslam_channels_t channels;
static bslam_box_points_t points;
static uint16_t rows[HEIGHT][WIDTH];

/// A red thing with a dark band before a wall.
static void look(uint16_t wall)
{
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            const bool inside = x >= 40 && x < 104 && y >= 24 && y < 88;
            rows[y][x] = !inside ? wall : y < 40 ? 4 << 11 | 10 << 5 | 5 : 28 << 11 | 12 << 5 | 6;
        }
    }
    bslam_channels_begin(&channels, WIDTH, HEIGHT);
    for (int y = 0; y < HEIGHT; y++) {
        bslam_channels_row(&channels, rows[y]);
    }
    bslam_channels_end(&channels);
}

static void describe(bslam_box_t box, float signature[BSLAM_SIGNATURE_SIZE])
{
    bslam_box_signature(&channels, &box, &points, signature);
    for (int i = 0; i < BSLAM_SIGNATURE_SIZE; i++) {
        assert_true(signature[i] >= -1 && signature[i] <= 1);
    }
}

static const bslam_box_t THING = {39.5f, 23.5f, 103.5f, 87.5f};

static void test_wall_changes_it_little_and_the_thing_much(void **state)
{
    (void)state;
    float its[BSLAM_SIGNATURE_SIZE], before_another[BSLAM_SIGNATURE_SIZE], other[BSLAM_SIGNATURE_SIZE];
    look(20 << 11 | 40 << 5 | 20);
    describe(THING, its);
    look(6 << 11 | 30 << 5 | 28);
    describe(THING, before_another);
    describe((bslam_box_t){63.5f, 39.5f, 95.5f, 111.5f}, other);
    double wall = 0, thing = 0;
    for (int i = 0; i < BSLAM_SIGNATURE_SIZE; i++) {
        wall += pow(its[i] - before_another[i], 2);
        thing += pow(its[i] - other[i], 2);
    }
    assert_true(wall < thing / 4);
}

static void test_shape_is_full_where_all_is_unlike_the_ring(void **state)
{
    (void)state;
    float its[BSLAM_SIGNATURE_SIZE];
    look(20 << 11 | 40 << 5 | 20);
    describe(THING, its);
    for (int i = 0; i < BSLAM_BOX_LIGHT - BSLAM_BOX_SHAPE; i++) {
        assert_near(its[BSLAM_BOX_SHAPE + i], 13 / 80.0, 1e-6);
    }
    assert_near(its[BSLAM_BOX_ASPECT], 0, 1e-6);
    double squares = 0;
    for (int i = 0; i < BSLAM_BOX_SHAPE; i++) {
        squares += pow(its[i], 2);
    }
    assert_near(sqrt(squares), 93 / 80.0, 0.04);  // shares add up to 1
    for (int i = BSLAM_BOX_SIGNATURE; i < BSLAM_SIGNATURE_SIZE; i++) {
        assert_near(its[i], 0, 0);
    }
}

static void test_any_box_has_one(void **state)
{
    (void)state;
    float its[BSLAM_SIGNATURE_SIZE];
    look(0xFFFF);
    describe((bslam_box_t){-0.5f, -0.5f, 159.5f, 119.5f}, its);
    describe((bslam_box_t){50, 50, 50, 50}, its);
    describe((bslam_box_t){-0.5f, 118, 0.5f, 119.5f}, its);
    look(0);
    describe((bslam_box_t){120, 2, 158, 118}, its);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wall_changes_it_little_and_the_thing_much),
        cmocka_unit_test(test_shape_is_full_where_all_is_unlike_the_ring),
        cmocka_unit_test(test_any_box_has_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
