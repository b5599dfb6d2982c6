#include "support.h"

#include <math.h>

#include "vision/built_in/measurement/signature.h"
#include "picture.h"

// A wall that RGB565 holds exactly: 16/31, 32/63 and 16/31 of the range.
#define WALL_RED (16 * 255.0 / 31)
#define WALL_GREEN (32 * 255.0 / 63)
#define WALL_BLUE (16 * 255.0 / 31)

/// Levels are rounded to 1/256 of the wall's, places to 1/16 of a bin.
#define BIN_ERROR 0.06
#define MEAN_ERROR 0.01

/// Pixels 20 to 29 across and 40 to 51 down of the half-resolution copy: 20 x 24 px.
static const bslam_quad_t QUAD = {BSLAM_R(39.5),  BSLAM_R(59.5), BSLAM_R(79.5),
                                  BSLAM_R(103.5), BSLAM_R(79.5), BSLAM_R(103.5)};

static void paint(unit_picture_t *picture, int x0, int y0, int x1, int y1, double red, double green,
                  double blue)
{
    for (int y = y0; y < y1; y++) {
        for (int x = x0; x < x1; x++) {
            unit_picture_set(picture, x, y, red * WALL_RED, green * WALL_GREEN, blue * WALL_BLUE);
        }
    }
}

static unit_picture_t *room(void)
{
    static unit_picture_t picture;
    unit_picture_fill(&picture, WALL_RED, WALL_GREEN, WALL_BLUE);
    return &picture;
}

static void take(const unit_picture_t *picture, const bslam_quad_t *quad,
                 float signature[BSLAM_SIGNATURE_SIZE])
{
    memset(signature, 0x5A, BSLAM_SIGNATURE_SIZE * sizeof signature[0]);
    assert_int_equal(bslam_signature(&picture->frame, quad, signature), BSLAM_OK);
    for (int i = 0; i < BSLAM_SIGNATURE_SIZE; i++) {
        assert_true(signature[i] >= -1.0f && signature[i] <= 1.0f);
    }
}

/// The histogram of a picture whose pixels have two colours in the wall's units, half each, from the
/// definition.
static void histogram_by_hand(const double colours[2][3], double bins[48])
{
    memset(bins, 0, 48 * sizeof bins[0]);
    for (int k = 0; k < 2; k++) {
        const double *c = colours[k];
        const double range[3] = {0.65 * (c[0] + c[1] + c[2]) / 3, 0.5 + 0.65 * 1.2 * (c[0] - c[1]),
                                 0.5 + 0.65 * (0.5 * (c[0] + c[1]) - c[2])};
        static const int counts[3] = {3, 4, 4};
        for (int corner = 0; corner < 8; corner++) {
            double share = 0.5;
            int bin = 0;
            for (int axis = 0; axis < 3; axis++) {
                const double place = fmin(fmax(range[axis] * counts[axis] - 0.5, 0), counts[axis] - 1);
                const int lower = (int)fmin(place, counts[axis] - 2);
                const int upper = corner >> axis & 1;
                share *= upper != 0 ? place - lower : 1 - (place - lower);
                bin = bin * counts[axis] + lower + upper;
            }
            bins[bin] += share;
        }
    }
}

static void test_signature_of_two_colours_by_hand(void **state)
{
    // Left half: a quarter of the wall's red and blue, green as the wall. Right half: redder than the wall.
    static const double colours[2][3] = {{0.25, 1, 0.25}, {1.5, 0.5, 0.75}};
    unit_picture_t *picture = room();
    paint(picture, 20, 40, 25, 52, colours[0][0], colours[0][1], colours[0][2]);
    paint(picture, 25, 40, 30, 52, colours[1][0], colours[1][1], colours[1][2]);
    float signature[BSLAM_SIGNATURE_SIZE];
    take(picture, &QUAD, signature);
    double bins[48];
    histogram_by_hand(colours, bins);
    double whole = 0;
    for (int i = 0; i < 48; i++) {
        assert_near(signature[BSLAM_SIGNATURE_COLOURS + i], 1.4 * sqrt(bins[i]), BIN_ERROR);
        whole += (double)(signature[i] * signature[i]);
    }
    assert_near(whole, 1.4 * 1.4, 1e-5);
    // Means of both colours, in every band: light (1.5 + 2.75) / 6, red-green (-0.75 + 1) / 2, yellow-blue
    // (0.375 + 0.25) / 2; times 0.65.
    for (int band = 0; band < 6; band++) {
        const float *means = signature + BSLAM_SIGNATURE_BANDS + 3 * band;
        assert_near(means[0], 0.65 * 4.25 / 6, MEAN_ERROR);
        assert_near(means[1], 0.65 * 0.125, MEAN_ERROR);
        assert_near(means[2], 0.65 * 0.3125, MEAN_ERROR);
    }
    assert_near(signature[BSLAM_SIGNATURE_ASPECT], 0.5 * 4 / 44, 1e-5);
    // In sums of three channels: light 1.5 and 2.75, so the mean is 2.125, the deviation 0.625, and one step
    // in nine neighbours across is 1.25. Red-green -0.75 and 1, yellow-blue (two channels) 0.75 and 0.5.
    const double against = 2.125 + 3 * 0.1 / 0.65;
    const double colour = sqrt((0.5625 + 1 + 0.5625 + 0.25) / 2);
    const float *texture = signature + BSLAM_SIGNATURE_TEXTURE;
    assert_near(texture[0], 1.5 * 0.625 / against, MEAN_ERROR);
    assert_near(texture[1], 1.5 * colour / against, MEAN_ERROR);
    assert_near(texture[2], 3 * 1.25 / 9 / against, MEAN_ERROR);
    assert_near(texture[3], 0, 1e-6);
}

static void test_signature_tells_above_from_below(void **state)
{
    unit_picture_t *picture = room();
    paint(picture, 20, 40, 30, 46, 1, 0.25, 0.25);
    paint(picture, 20, 46, 30, 52, 0.25, 0.25, 1.5);
    float signature[BSLAM_SIGNATURE_SIZE];
    take(picture, &QUAD, signature);
    for (int band = 0; band < 6; band++) {
        const float *means = signature + BSLAM_SIGNATURE_BANDS + 3 * band;
        assert_near(means[1], band < 3 ? 0.65 * 0.75 : 0, MEAN_ERROR);
        assert_near(means[2], band < 3 ? 0.65 * 0.375 : -0.65 * 1.25, MEAN_ERROR);
    }
    assert_true(signature[BSLAM_SIGNATURE_TEXTURE + 3] > 0 && signature[BSLAM_SIGNATURE_TEXTURE + 2] == 0);
}

/// Paints something of many colours at a place of the half-resolution copy, in a light (red, green, blue).
static void paint_patchwork(unit_picture_t *picture, int x0, int y0, const double light[3])
{
    for (int y = 0; y < 12; y++) {
        for (int x = 0; x < 10; x++) {
            const double red = 0.2 + 0.15 * ((x * 7 + y * 3) % 6);
            const double green = 0.2 + 0.15 * ((x * 5 + y * 11) % 6);
            const double blue = 0.2 + 0.15 * ((x * 3 + y * 13) % 6);
            unit_picture_set(picture, x0 + x, y0 + y, red * WALL_RED * light[0],
                             green * WALL_GREEN * light[1], blue * WALL_BLUE * light[2]);
        }
    }
}

static void test_signature_in_other_light_is_the_same(void **state)
{
    static const double white[3] = {1, 1, 1};
    static const double lights[][3] = {{0.5, 0.5, 0.5}, {1.6, 1.6, 1.6}, {1.2, 0.9, 0.7}};
    float before[BSLAM_SIGNATURE_SIZE];
    float after[BSLAM_SIGNATURE_SIZE];
    unit_picture_t *picture = room();
    paint_patchwork(picture, 20, 40, white);
    take(picture, &QUAD, before);
    for (int i = 0; i < COUNT_OF(lights); i++) {
        unit_picture_fill(picture, WALL_RED * lights[i][0], WALL_GREEN * lights[i][1],
                          WALL_BLUE * lights[i][2]);
        paint_patchwork(picture, 20, 40, lights[i]);
        take(picture, &QUAD, after);
        double square = 0;
        for (int k = 0; k < BSLAM_SIGNATURE_SIZE; k++) {
            square += pow((double)(after[k] - before[k]), 2);
        }
        // RGB565 rounds a channel by up to 2 % of the wall's; the whole vector is about 1.2 long.
        assert_near(sqrt(square), 0, 0.15);
    }
}

static void test_signature_elsewhere_in_the_frame_is_the_same(void **state)
{
    static const double white[3] = {1, 1, 1};
    float here[BSLAM_SIGNATURE_SIZE];
    float there[BSLAM_SIGNATURE_SIZE];
    unit_picture_t *picture = room();
    paint_patchwork(picture, 20, 40, white);
    take(picture, &QUAD, here);
    picture = room();
    paint_patchwork(picture, 97, 3, white);
    const bslam_quad_t moved = {BSLAM_R(193.5), BSLAM_R(213.5), BSLAM_R(5.5),
                                BSLAM_R(29.5),  BSLAM_R(5.5),   BSLAM_R(29.5)};
    take(picture, &moved, there);
    // The places of the edges round differently in the last bit.
    for (int i = 0; i < BSLAM_SIGNATURE_SIZE; i++) {
        assert_near(there[i], here[i], 1e-5);
    }
}

static void test_signature_of_a_large_thing_takes_every_other_pixel(void **state)
{
    // Four quarters of one colour each, 240 x 200 px: every second or third pixel gives the same shares.
    unit_picture_t *picture = room();
    float large[BSLAM_SIGNATURE_SIZE];
    float small[BSLAM_SIGNATURE_SIZE];
    for (int k = 0; k < 4; k++) {
        const int x = k % 2, y = k / 2;
        paint(picture, 20 + 60 * x, 10 + 50 * y, 80 + 60 * x, 60 + 50 * y, 0.3 + 0.4 * x, 0.3 + 0.3 * y, 0.5);
    }
    const bslam_quad_t whole = {BSLAM_R(39.5),  BSLAM_R(279.5), BSLAM_R(19.5),
                                BSLAM_R(219.5), BSLAM_R(19.5),  BSLAM_R(219.5)};
    take(picture, &whole, large);
    for (int k = 0; k < 4; k++) {
        const int x = k % 2, y = k / 2;
        paint(picture, 20 + 12 * x, 10 + 10 * y, 32 + 12 * x, 20 + 10 * y, 0.3 + 0.4 * x, 0.3 + 0.3 * y, 0.5);
    }
    const bslam_quad_t part = {BSLAM_R(39.5), BSLAM_R(87.5), BSLAM_R(19.5),
                               BSLAM_R(59.5), BSLAM_R(19.5), BSLAM_R(59.5)};
    take(picture, &part, small);
    for (int i = 0; i < BSLAM_SIGNATURE_BANDS; i++) {
        assert_near(large[i], small[i], BIN_ERROR);
    }
    assert_near(large[BSLAM_SIGNATURE_ASPECT], small[BSLAM_SIGNATURE_ASPECT], 1e-6);
    assert_near(large[BSLAM_SIGNATURE_TEXTURE], small[BSLAM_SIGNATURE_TEXTURE], 0.02);
}

static void test_signature_follows_sloping_ends(void **state)
{
    // A trapezoid on a black ground: with its slopes none of the ground is inside, without them much is.
    unit_picture_t *picture = room();
    paint(picture, 0, 0, 160, 120, 0, 0, 0);
    for (int x = 20; x < 60; x++) {
        paint(picture, x, 20 + (x - 20) / 2, x + 1, 100 - (x - 20) / 2, 1, 1, 1);
    }
    const bslam_quad_t trapezoid = {BSLAM_R(39.5), BSLAM_R(119.5), 40, 199, 80, 159};
    float signature[BSLAM_SIGNATURE_SIZE];
    take(picture, &trapezoid, signature);
    assert_near(signature[BSLAM_SIGNATURE_TEXTURE], 0, 1e-3);
    bslam_quad_t box = trapezoid;
    box.top_right_px = box.top_left_px;
    box.bottom_right_px = box.bottom_left_px;
    take(picture, &box, signature);
    assert_true(signature[BSLAM_SIGNATURE_TEXTURE] > 0.2f);
}

static void test_signature_at_the_edge_of_the_frame_stays_inside(void **state)
{
    unit_picture_t *picture = room();
    const bslam_quad_t all = {BSLAM_R(-0.5),  BSLAM_R(319.5), BSLAM_R(-0.5),
                              BSLAM_R(239.5), BSLAM_R(-0.5),  BSLAM_R(239.5)};
    const bslam_quad_t beyond = {-30, 100, -50, 100, 20, 250};
    float signature[BSLAM_SIGNATURE_SIZE];
    take(picture, &all, signature);
    take(picture, &beyond, signature);
    assert_near(signature[BSLAM_SIGNATURE_TEXTURE], 0, 1e-6);
}

static void test_signature_refuses_what_is_too_small_or_in_the_dark(void **state)
{
    unit_picture_t *picture = room();
    float signature[BSLAM_SIGNATURE_SIZE] = {7};
    const bslam_quad_t bad[] = {{40, 46, 80, 86, 80, 86},         {40, 40, 80, 100, 80, 100},
                                {60, 40, 80, 100, 80, 100},       {40, 60, 100, 80, 100, 80},
                                {40, 60, 80, 2000, 80, 2000},     {40, real(NAN), 80, 100, 80, 100},
                                {40, 60, 80, real(NAN), 80, 100}, {400, 440, 80, 100, 80, 100}};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        assert_int_equal(bslam_signature(&picture->frame, &bad[i], signature), BSLAM_E_RANGE);
    }
    picture->surroundings.wall.green = 3.9f;
    assert_int_equal(bslam_signature(&picture->frame, &QUAD, signature), BSLAM_E_RANGE);
    picture->surroundings.wall.green = NAN;
    assert_int_equal(bslam_signature(&picture->frame, &QUAD, signature), BSLAM_E_RANGE);
    picture = room();
    picture->surroundings.wall.blue = 3.9f;
    assert_int_equal(bslam_signature(&picture->frame, &QUAD, signature), BSLAM_E_RANGE);
    picture->surroundings.wall.blue = 4.0f;
    float bright[BSLAM_SIGNATURE_SIZE];
    assert_int_equal(bslam_signature(&picture->frame, &QUAD, bright), BSLAM_OK);
    assert_true(signature[0] == 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_signature_of_two_colours_by_hand),
        cmocka_unit_test(test_signature_tells_above_from_below),
        cmocka_unit_test(test_signature_in_other_light_is_the_same),
        cmocka_unit_test(test_signature_elsewhere_in_the_frame_is_the_same),
        cmocka_unit_test(test_signature_of_a_large_thing_takes_every_other_pixel),
        cmocka_unit_test(test_signature_follows_sloping_ends),
        cmocka_unit_test(test_signature_at_the_edge_of_the_frame_stays_inside),
        cmocka_unit_test(test_signature_refuses_what_is_too_small_or_in_the_dark),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
