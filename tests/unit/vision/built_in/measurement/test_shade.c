// Colours of upright strips: a panel's, the wall's, and what no frame shows.
#include "picture.h"
#include "support.h"

#include "base/trig.h"
#include "vision/built_in/measurement/shade.h"

static unit_picture_t picture;

static bslam_facing_t ahead(const bslam_camera_t *camera)
{
    return (bslam_facing_t){.camera = camera, .mounting = bslam_camera_mounting(camera), .cosine = 1};
}

/// A panel 3 m ahead from 0.4 to -0.4 across, between heights of 0.2 and 0.8 m.
static bslam_outline_t drawn(const bslam_camera_t *camera, const double wall[3], double red, double green,
                             double blue)
{
    const unit_panel_t panel = {3, 1.2, 3, -1.2, 0.2, 0.8, red, green, blue};
    unit_picture_draw(&picture, camera, wall, &panel, 1);
    return (bslam_outline_t){.left = BSLAM_R(0.4),
                             .right = BSLAM_R(-0.4),
                             .top = BSLAM_R(0.1),
                             .bottom = BSLAM_R(-0.1),
                             .pixel = 1 / BSLAM_R(277.1)};
}

static void test_shade_is_the_colour_without_its_light(void **state)
{
    static const double wall[3] = {120, 150, 120};
    const bslam_camera_t camera = unit_pinhole();
    const bslam_facing_t facing = ahead(&camera);
    const bslam_outline_t outline = drawn(&camera, wall, 180, 90, 60);
    bslam_shade_t object, beyond;
    assert_true(bslam_shade_between(&picture.frame, &facing, &outline, BSLAM_R(0.2), 0, &object));
    assert_near(object.red, 70, 5);  // half a step of five bits
    assert_near(object.green, -20, 5);
    assert_near(object.blue, -50, 5);
    assert_true(bslam_shade_between(&picture.frame, &facing, &outline, BSLAM_R(0.5), BSLAM_R(0.45), &beyond));
    assert_near(beyond.red, -10, 5);
    assert_near(beyond.green, 20, 5);
    assert_near(beyond.blue, -10, 5);
    assert_true(bslam_shade_apart(&object, &beyond) > 0.9f);
    assert_true(bslam_shade_apart(&object, &object) == 0.0f);
}

static void test_shade_of_the_same_thing_in_less_light_is_the_same(void **state)
{
    static const double walls[2][3] = {{200, 200, 200}, {120, 120, 120}};
    const bslam_camera_t camera = unit_pinhole();
    const bslam_facing_t facing = ahead(&camera);
    bslam_shade_t shades[2];
    for (int i = 0; i < 2; i++) {
        const double light = i == 0 ? 40 : 0;
        const bslam_outline_t outline = drawn(&camera, walls[i], 140 + light, 110 + light, 80 + light);
        assert_true(bslam_shade_between(&picture.frame, &facing, &outline, BSLAM_R(0.2), 0, &shades[i]));
    }
    assert_true(bslam_shade_apart(&shades[0], &shades[1]) < 0.5f);
}

static void test_shade_of_what_the_frame_does_not_show_is_none(void **state)
{
    static const double wall[3] = {120, 150, 120};
    const bslam_camera_t camera = unit_pinhole();
    const bslam_facing_t facing = ahead(&camera);
    bslam_outline_t outline = drawn(&camera, wall, 180, 90, 60);
    bslam_shade_t shade = {1, 2, 3};
    // The frame ends at 0.576 across and 0.432 up.
    assert_false(bslam_shade_between(&picture.frame, &facing, &outline, BSLAM_R(0.7), BSLAM_R(0.6), &shade));
    assert_false(bslam_shade_between(&picture.frame, &facing, &outline, BSLAM_R(0.6), BSLAM_R(0.5), &shade));
    outline.top = BSLAM_R(1.5);
    assert_false(bslam_shade_between(&picture.frame, &facing, &outline, BSLAM_R(0.2), 0, &shade));
    assert_true(shade.red == 1 && shade.green == 2 && shade.blue == 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shade_is_the_colour_without_its_light),
        cmocka_unit_test(test_shade_of_the_same_thing_in_less_light_is_the_same),
        cmocka_unit_test(test_shade_of_what_the_frame_does_not_show_is_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
