// One side of a rectangle that is drawn exactly: where the lens sees it, and which line it is traced along.
#include <math.h>

#include "picture.h"
#include "support.h"

#include "vision/built_in/measurement/orientation.h"
#include "vision/built_in/measurement/side.h"

static const bslam_stance_t FLAT = {0.0f, 1e9f, -1e9f};

static unit_picture_t picture;
static bslam_camera_t camera;

/// Straight ahead.
static bslam_facing_t facing(void)
{
    camera = unit_pinhole();
    return (bslam_facing_t){
        .camera = &camera, .mounting = bslam_camera_mounting(&camera), .sine = 0, .cosine = 1};
}

/// A tangent as so many pixels of the frame.
static bslam_real_t pixels(double count)
{
    return real(count / 277.1);
}

static void test_point_far_outside_the_frame_is_not_looked_for(void **state)
{
    static const struct {
        double across_px, up_px;
        bool is_seen;
    } cases[] = {
        {0, 0, true},       {15000, 15000, true}, {-15000, -15000, true}, {17000, 0, false},
        {-17000, 0, false}, {0, 17000, false},    {0, -17000, false},
    };
    const bslam_facing_t ahead = facing();
    for (int i = 0; i < COUNT_OF(cases); i++) {
        const bslam_plane_point_t point = {pixels(cases[i].across_px), pixels(cases[i].up_px)};
        bslam_real_t u = 0;
        bslam_real_t v = 0;
        assert_int_equal(bslam_facing_to_frame(&ahead, point, &u, &v), cases[i].is_seen);
        if (cases[i].is_seen) {
            assert_near(u, 159.5 - cases[i].across_px, 0.01);
            assert_near(v, 119.5 - cases[i].up_px, 0.01);
        }
    }
}

/// Darker to the right of a boundary of the half-resolution copy.
static void darken_from(int boundary, uint8_t light)
{
    for (int y = 0; y < UNIT_PICTURE_HEIGHT / 2; y++) {
        for (int x = boundary; x < UNIT_PICTURE_WIDTH / 2; x++) {
            unit_picture_set(&picture, x, y, light, light, light);
        }
    }
}

/// Black to the right of boundary `boundary` of the half-resolution copy.
static void draw_edge(int boundary)
{
    unit_picture_fill(&picture, 200, 200, 200);
    darken_from(boundary, 0);
}

/// How many points are found along a line, so many places inwards of a left side at boundary 60.
static int count_points(int shift)
{
    const bslam_facing_t ahead = facing();
    const bslam_line_t line = {.shift = (float)shift};
    const bslam_real_t across = pixels(159.5 - (2 * 60 - 0.5));
    bslam_side_t side;
    bslam_edge_t edge;
    assert_true(bslam_side_scan(&side, &picture.frame, &ahead, BSLAM_SIDE_LEFT, across, pixels(-80),
                                pixels(80), pixels(1)));
    assert_int_equal(side.count, BSLAM_SIDE_SCANS);
    bslam_side_trace(&side, &ahead, &line, &FLAT, &edge);
    for (int i = 0; i < edge.count; i++) {
        assert_near(edge.points[i].across, across - (bslam_real_t)(2 * shift) * pixels(1), 1e-4);
    }
    return edge.count;
}

static void test_edge_is_traced_within_the_places_that_are_looked_at(void **state)
{
    // From one place inside the outermost of the 15 to one inside the innermost.
    for (int shift = -BSLAM_SIDE_REACH_OUT; shift <= 14 - BSLAM_SIDE_REACH_OUT; shift++) {
        const bool is_within = shift > -BSLAM_SIDE_REACH_OUT && shift < 14 - BSLAM_SIDE_REACH_OUT;
        draw_edge(60 + shift);
        assert_int_equal(count_points(shift), is_within ? BSLAM_SIDE_SCANS : 0);
        draw_edge(60 + shift + 4);  // no change there
        assert_int_equal(count_points(shift), 0);
    }
}

/// Places inwards of a left side at boundary 60, so many pixels high, at which its likeliest line is.
static int likeliest_line(int height_px)
{
    const bslam_facing_t ahead = facing();
    bslam_side_t side;
    assert_true(bslam_side_scan(&side, &picture.frame, &ahead, BSLAM_SIDE_LEFT,
                                pixels(159.5 - (2 * 60 - 0.5)), pixels(-height_px / 2.0),
                                pixels(height_px / 2.0), pixels(1)));
    return (int)bslam_side_line(&side, &FLAT).shift;
}

static void test_line_of_a_long_side_may_be_farther_from_the_rough_one(void **state)
{
    // A frame three places wide, and what it frames.
    unit_picture_fill(&picture, 200, 200, 200);
    darken_from(57, 170);
    darken_from(60, 120);
    assert_int_equal(likeliest_line(30), 0);
    assert_int_equal(likeliest_line(180), -3);
}

static void test_body_whose_level_side_is_out_of_sight_has_no_level(void **state)
{
    const bslam_facing_t ahead = facing();
    const bslam_body_t seen = {pixels(50), pixels(-50), pixels(40), pixels(-40), pixels(1), {0, 0, 0}};
    bslam_body_t too_high = seen;
    bslam_body_t too_low = seen;
    bslam_level_t level;
    too_high.top = pixels(17000);
    too_low.bottom = pixels(-17000);
    unit_picture_fill(&picture, 200, 200, 200);
    assert_true(bslam_body_level(&seen, &picture.frame, &ahead, &level));
    assert_false(bslam_body_level(&too_high, &picture.frame, &ahead, &level));
    assert_false(bslam_body_level(&too_low, &picture.frame, &ahead, &level));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_point_far_outside_the_frame_is_not_looked_for),
        cmocka_unit_test(test_edge_is_traced_within_the_places_that_are_looked_at),
        cmocka_unit_test(test_line_of_a_long_side_may_be_farther_from_the_rough_one),
        cmocka_unit_test(test_body_whose_level_side_is_out_of_sight_has_no_level),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
