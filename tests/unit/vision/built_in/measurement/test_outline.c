#include "support.h"

#include <math.h>

#include "vision/built_in/measurement/outline.h"
#include "picture.h"

/// How well a drawn side is found, whole-frame pixels: RGB565 rounds the mixed pixels that tell its place.
#define SIDE_ERROR_PX 0.25

static const double WALL[3] = {180, 175, 160};

static const bslam_front_t FLAT = {0, 0, 0, 0};

/// A poster on a wall 4 m ahead, facing the camera.
static unit_panel_t poster(void)
{
    return (unit_panel_t){4, 0.6, 4, -0.2, 0.9, 1.6, 60, 80, 150};
}

/// Where the pinhole of unit_pinhole sees a point.
static double u_of(double x_m, double y_m)
{
    return 159.5 - 277.1 * y_m / x_m;
}

static double v_of(double x_m, double z_m)
{
    return 119.5 - 277.1 * (z_m - 0.5) / x_m;
}

static bslam_box_t box_off(double left, double top, double right, double bottom, const double off[4])
{
    return (bslam_box_t){real(left + off[0]), real(top + off[1]), real(right + off[2]),
                         real(bottom + off[3])};
}

static void assert_quad_near(const bslam_quad_t *quad, const double expected[6], double tolerance)
{
    assert_near(quad->left_px, expected[0], tolerance);
    assert_near(quad->right_px, expected[1], tolerance);
    assert_near(quad->top_left_px, expected[2], tolerance);
    assert_near(quad->bottom_left_px, expected[3], tolerance);
    assert_near(quad->top_right_px, expected[4], tolerance);
    assert_near(quad->bottom_right_px, expected[5], tolerance);
}

static void test_find_a_facing_rectangle_from_a_box_three_pixels_off(void **state)
{
    static const double offs[][4] = {
        {0, 0, 0, 0}, {3, 3, 3, 3}, {-3, -3, -3, -3}, {3, 3, -3, -3}, {-3, -3, 3, 3}};
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panel = poster();
    unit_picture_draw(&picture, &camera, WALL, &panel, 1);
    const double left = u_of(4, 0.6), right = u_of(4, -0.2), top = v_of(4, 1.6), bottom = v_of(4, 0.9);
    const double expected[6] = {left, right, top, bottom, top, bottom};
    for (int i = 0; i < COUNT_OF(offs); i++) {
        const bslam_box_t rough = box_off(left, top, right, bottom, offs[i]);
        bslam_outline_t outline;
        assert_int_equal(bslam_outline_find(&picture.frame, &camera, &rough, &FLAT, &outline), BSLAM_OK);
        // The turn, which is hardly seen in a thing so narrow, moves the corners.
        assert_quad_near(&outline.quad, expected, 2 * SIDE_ERROR_PX);
        assert_near(outline.facing_rad + real(atan((double)outline.middle)), atan2(0.2, 4), 0.3 / 277.1);
        assert_near(outline.top - outline.bottom, 0.7 / 4 / cos((double)outline.facing_rad), 0.5 / 277.1);
    }
}

static void test_find_a_turned_rectangle_as_a_trapezoid_with_its_middle_in_plan(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    // 1.4 m of wall whose left end is nearer: from (3.2, 0.7) to (4.2, -0.28), so 1/x falls to the right.
    const unit_panel_t panel = {3.2, 0.7, 4.2, -0.28, 0.1, 1.3, 200, 60, 40};
    unit_picture_draw(&picture, &camera, WALL, &panel, 1);
    const double expected[6] = {u_of(3.2, 0.7), u_of(4.2, -0.28), v_of(3.2, 1.3),
                                v_of(3.2, 0.1), v_of(4.2, 1.3),   v_of(4.2, 0.1)};
    static const double off[4] = {2, -2, -1, 3};
    const bslam_box_t rough = box_off(expected[0], expected[2], expected[1], expected[3], off);
    bslam_outline_t outline;
    assert_int_equal(bslam_outline_find(&picture.frame, &camera, &rough, &FLAT, &outline), BSLAM_OK);
    assert_quad_near(&outline.quad, expected, 0.8);
    const double middle_rad = atan2((0.7 - 0.28) / 2, (3.2 + 4.2) / 2);
    assert_near(outline.facing_rad + real(atan((double)outline.middle)), middle_rad, 0.5 / 277.1);
    // The middle of the picture is 0.6 degrees off: it is not that.
    const double picture_middle_rad = (atan2(0.7, 3.2) + atan2(-0.28, 4.2)) / 2;
    assert_true(fabs(picture_middle_rad - middle_rad) > 0.01);
}

static void test_find_through_a_wide_pitched_lens_gives_the_same_tangents(void **state)
{
    static unit_picture_t picture;
    bslam_camera_t camera = unit_equidistant();
    camera.pitch_rad = real(0.2);
    camera.yaw_rad = real(-0.4);
    // Facing the camera at 0.6 rad to the left of straight ahead, 1 rad off the axis; 2.5 m away, 1.2 m wide.
    const double cx = 2.5 * cos(0.6), cy = 2.5 * sin(0.6);
    const double ex = -sin(0.6), ey = cos(0.6);
    const unit_panel_t panel = {
        cx + 0.6 * ex, cy + 0.6 * ey, cx - 0.6 * ex, cy - 0.6 * ey, 0.1, 1.3, 40, 90, 60};
    unit_picture_draw(&picture, &camera, WALL, &panel, 1);
    double bounds[4] = {1e9, 1e9, -1e9, -1e9};
    for (int i = 0; i < 4; i++) {
        const double side = i % 2 == 0 ? 0.6 : -0.6;
        const bslam_direction_t corner = {real(cx + side * ex), real(cy + side * ey),
                                          real(i < 2 ? 0.8 : -0.4)};
        bslam_real_t u;
        bslam_real_t v;
        assert_int_equal(bslam_camera_project(&camera, &corner, &u, &v), BSLAM_OK);
        bounds[0] = fmin(bounds[0], (double)u);
        bounds[1] = fmin(bounds[1], (double)v);
        bounds[2] = fmax(bounds[2], (double)u);
        bounds[3] = fmax(bounds[3], (double)v);
    }
    static const double off[4] = {1, 1, 1, -1};
    const bslam_box_t rough = box_off(bounds[0], bounds[1], bounds[2], bounds[3], off);
    bslam_outline_t outline;
    assert_int_equal(bslam_outline_find(&picture.frame, &camera, &rough, &FLAT, &outline), BSLAM_OK);
    // Half a pixel of this lens is 0.005 rad.
    assert_near(outline.facing_rad + real(atan((double)outline.middle)), 0.6, 0.005);
    const double off_axis = cos((double)outline.facing_rad - 0.6);
    assert_near((outline.top - outline.bottom) * real(off_axis), 1.2 / 2.5, 0.01);
}

static void test_find_takes_the_flank_of_a_body_off(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    // A front from (3.5, 0.5) to (4.1, -0.3): 1 m wide, its left end nearer. Its flank, 0.4 m deep, goes back
    // from the left end at right angles: along (0.8, 0.6).
    const unit_panel_t panels[2] = {{3.5, 0.5, 4.1, -0.3, 0, 1.6, 170, 90, 40},
                                    {3.5 + 0.4 * 0.8, 0.5 + 0.4 * 0.6, 3.5, 0.5, 0, 1.6, 110, 60, 25}};
    unit_picture_draw(&picture, &camera, WALL, panels, 2);
    const double left = u_of(3.5 + 0.32, 0.5 + 0.24), right = u_of(4.1, -0.3);
    static const double off[4] = {-1, 1, 2, -2};
    const bslam_box_t rough = box_off(left, v_of(3.5, 1.6), right, v_of(3.5, 0), off);
    bslam_outline_t body;
    bslam_outline_t flat;
    const bslam_front_t front = {.height_m = real(1.6), .depth_m = real(0.4)};
    assert_int_equal(bslam_outline_find(&picture.frame, &camera, &rough, &front, &body), BSLAM_OK);
    assert_int_equal(bslam_outline_find(&picture.frame, &camera, &rough, &FLAT, &flat), BSLAM_OK);
    const double middle_rad = atan2(0.1, 3.8);
    const double body_rad = (double)body.facing_rad + atan((double)body.middle);
    const double flat_rad = (double)flat.facing_rad + atan((double)flat.middle);
    assert_near(body_rad, middle_rad, 1.5 / 277.1);
    assert_true(fabs(flat_rad - middle_rad) > 2 * fabs(body_rad - middle_rad));
}

enum { DRAWERS = 5 };

// So much of the light that the front reflects do its drawers.
static const double FAINT = 0.92;

typedef enum cabinet { CABINET_PLAIN, CABINET_DARK_FLANK, CABINET_DRAWERS, CABINET_BEHIND } cabinet_t;

/// A cabinet 1.8 m high, .9 wide and .375 deep, 4 m away, whose front looks away from the camera by so many
/// degrees: how far off its middle is found, degrees. Its flank is of the front's colour, or darker, or the
/// front has drawers, or that and a bright thing stands before the foot of its flank.
static double error_of_cabinet_deg(double slant_deg, cabinet_t looks, bslam_front_t front)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    const double at[2] = {4, 0.3}, sight_rad = atan2(at[1], at[0]);
    const double along_rad =
        sight_rad + (90 + slant_deg) * acos(-1) / 180;  // to its left end, the nearer one
    const double to_left[2] = {0.45 * cos(along_rad), 0.45 * sin(along_rad)};
    const double left[2] = {at[0] + to_left[0], at[1] + to_left[1]};
    const double right[2] = {at[0] - to_left[0], at[1] - to_left[1]};
    const double back[2] = {left[0] + 0.375 * sin(along_rad), left[1] - 0.375 * cos(along_rad)};
    const double shade = looks == CABINET_DARK_FLANK ? 0.65 : 1;
    unit_panel_t panels[3 + DRAWERS] = {
        {back[0], back[1], left[0], left[1], 0, 1.8, 170 * shade, 90 * shade, 40 * shade},
        {left[0], left[1], right[0], right[1], 0, 1.8, 170, 90, 40}};
    for (int i = 0; i < DRAWERS; i++) {
        // Within a frame of a tenth of the width, a little before the front.
        const double x[2] = {0.9 * left[0] + 0.1 * right[0], 0.1 * left[0] + 0.9 * right[0]};
        const double y[2] = {0.9 * left[1] + 0.1 * right[1], 0.1 * left[1] + 0.9 * right[1]};
        const double near = 0.999, low_m = 0.2 + 0.3 * i;
        panels[2 + i] = (unit_panel_t){near * x[0],  near * y[0], near * x[1], near * y[1], low_m,
                                       low_m + 0.15, FAINT * 170, FAINT * 90,  FAINT * 40};
    }
    panels[2 + DRAWERS] =
        (unit_panel_t){0.99 * back[0], 0.99 * back[1], 0.99 * left[0], 0.99 * left[1], 0, 0.5, 240, 240, 240};
    static const int counts[] = {2, 2, 2 + DRAWERS, 3 + DRAWERS};
    unit_picture_draw(&picture, &camera, WALL, panels, counts[looks]);
    const bslam_box_t rough = {real(u_of(back[0], back[1])), real(v_of(left[0], 1.8)),
                               real(u_of(right[0], right[1])), real(v_of(left[0], 0))};
    bslam_outline_t outline;
    assert_int_equal(bslam_outline_find(&picture.frame, &camera, &rough, &front, &outline), BSLAM_OK);
    return fabs((double)outline.facing_rad + atan((double)outline.middle) - sight_rad) * 180 / acos(-1);
}

/// The same, in the root of the mean square over slants from one to another, a degree apart.
static double rms_of_cabinet_deg(int from_deg, int to_deg, cabinet_t looks, bslam_front_t front)
{
    double square = 0;
    for (int slant_deg = from_deg; slant_deg <= to_deg; slant_deg++) {
        const double error_deg = error_of_cabinet_deg(slant_deg, looks, front);
        square += error_deg * error_deg;
    }
    return sqrt(square / (to_deg - from_deg + 1));
}

static void test_find_tells_a_flank_as_wide_as_the_front_by_the_edge_between_them(void **state)
{
    const bslam_front_t cabinet = {.height_m = real(1.8), .depth_m = real(0.375)};
    assert_true(error_of_cabinet_deg(50, CABINET_DARK_FLANK, cabinet) < 0.5);
    assert_true(error_of_cabinet_deg(56, CABINET_DARK_FLANK, cabinet) < 0.5);
    assert_true(rms_of_cabinet_deg(45, 58, CABINET_DARK_FLANK, cabinet) < 0.3);
    assert_true(rms_of_cabinet_deg(45, 58, CABINET_PLAIN, cabinet) > 1);
}

static void test_find_tells_the_front_by_what_is_on_it(void **state)
{
    const bslam_front_t cabinet = {.height_m = real(1.8), .depth_m = real(0.375)};
    assert_true(error_of_cabinet_deg(53, CABINET_DRAWERS, cabinet) < 0.5);
    assert_true(error_of_cabinet_deg(58, CABINET_DRAWERS, cabinet) < 0.5);
    assert_true(rms_of_cabinet_deg(45, 58, CABINET_DRAWERS, cabinet) < 0.5);
    assert_true(rms_of_cabinet_deg(45, 58, CABINET_PLAIN, cabinet) > 1);
    assert_true(rms_of_cabinet_deg(45, 58, CABINET_BEHIND, cabinet) < 0.5);
}

static void test_find_is_nearer_where_it_knows_how_wide_the_front_is(void **state)
{
    const bslam_front_t any = {.height_m = real(1.8), .depth_m = real(0.375)};
    const bslam_front_t known = {real(1.8), real(0.375), real(0.87), real(0.93)};
    assert_true(rms_of_cabinet_deg(54, 62, CABINET_PLAIN, known) <
                0.5 * rms_of_cabinet_deg(54, 62, CABINET_PLAIN, any));
}

static void test_find_in_dimmer_light_finds_the_same(void **state)
{
    static unit_picture_t bright;
    static unit_picture_t dim;
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panel = {3.4, 0.7, 4.2, -0.4, 0.8, 1.6, 230, 40, 90};
    unit_panel_t dim_panel = panel;
    double dim_wall[3];
    for (int c = 0; c < 3; c++) {
        dim_wall[c] = 0.5 * WALL[c];
    }
    dim_panel.red *= 0.5;
    dim_panel.green *= 0.5;
    dim_panel.blue *= 0.5;
    unit_picture_draw(&bright, &camera, WALL, &panel, 1);
    unit_picture_draw(&dim, &camera, dim_wall, &dim_panel, 1);
    const bslam_box_t rough = {real(u_of(3.4, 0.7)) + 2, real(v_of(3.4, 1.6)) + 2, real(u_of(4.2, -0.4)) + 1,
                               real(v_of(3.4, 0.8)) - 2};
    bslam_outline_t in_bright;
    bslam_outline_t in_dim;
    assert_int_equal(bslam_outline_find(&bright.frame, &camera, &rough, &FLAT, &in_bright), BSLAM_OK);
    assert_int_equal(bslam_outline_find(&dim.frame, &camera, &rough, &FLAT, &in_dim), BSLAM_OK);
    assert_near(in_bright.quad.left_px, in_dim.quad.left_px, SIDE_ERROR_PX);
    assert_near(in_bright.quad.right_px, in_dim.quad.right_px, SIDE_ERROR_PX);
    assert_near(in_bright.quad.top_left_px, in_dim.quad.top_left_px, 2 * SIDE_ERROR_PX);
    assert_near(in_bright.quad.bottom_right_px, in_dim.quad.bottom_right_px, 2 * SIDE_ERROR_PX);
}

static void test_find_is_less_sure_where_two_edges_may_be_the_side(void **state)
{
    static unit_picture_t plain;
    static unit_picture_t framed;
    const bslam_camera_t camera = unit_pinhole();
    // A frame round the poster, hardly different from the wall: which of the two edges is the top?
    const unit_panel_t outer = {4.01, 0.68, 4.01, -0.28, 0.82, 1.68, 165, 162, 150};
    const unit_panel_t panels[2] = {outer, poster()};
    unit_picture_draw(&plain, &camera, WALL, &panels[1], 1);
    unit_picture_draw(&framed, &camera, WALL, panels, 2);
    const bslam_box_t rough = {real(u_of(4, 0.64)), real(v_of(4, 1.64)), real(u_of(4, -0.24)),
                               real(v_of(4, 0.86))};
    bslam_outline_t sure;
    bslam_outline_t unsure;
    assert_int_equal(bslam_outline_find(&plain.frame, &camera, &rough, &FLAT, &sure), BSLAM_OK);
    assert_int_equal(bslam_outline_find(&framed.frame, &camera, &rough, &FLAT, &unsure), BSLAM_OK);
    assert_true(unsure.top_var > 2 * sure.top_var);
    assert_true(unsure.left_var > 2 * sure.left_var);
    assert_true(unsure.middle_var > sure.middle_var);
}

static void test_find_where_nothing_is_keeps_the_box_and_doubts_it(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    unit_picture_fill(&picture, 120, 130, 140);
    const bslam_box_t rough = {100, 60, 180, 150};
    bslam_outline_t outline;
    assert_int_equal(bslam_outline_find(&picture.frame, &camera, &rough, &FLAT, &outline), BSLAM_OK);
    // Turns that nothing speaks against move the corners by a pixel.
    assert_quad_near(&outline.quad, (const double[6]){100, 180, 60, 150, 60, 150}, 1);
    // Two pixels of the half-resolution copy.
    assert_near(outline.left_var, 16 * outline.pixel * outline.pixel, 1e-6);
    assert_near(outline.bottom_var, 16 * outline.pixel * outline.pixel, 1e-6);
}

static void test_find_at_every_edge_of_the_frame_reads_nothing_outside(void **state)
{
    // Address sanitizer watches; the answer may be anything but a number that is none.
    static unit_picture_t picture;
    bslam_camera_t cameras[2] = {unit_pinhole(), unit_equidistant()};
    unit_random_t random = {9};
    unit_picture_fill(&picture, 120, 130, 140);
    for (int i = 0; i < 2000; i++) {
        unit_picture_set(&picture, (int)unit_random(&random, 0, 160), (int)unit_random(&random, 0, 120), 10,
                         240, 90);
    }
    int found = 0;
    for (int i = 0; i < 1500; i++) {
        bslam_camera_t *camera = &cameras[i % 2];
        camera->pitch_rad = real(unit_random(&random, -1.4, 1.4));
        const double left = unit_random(&random, -0.5, 318), top = unit_random(&random, -0.5, 238);
        const bslam_box_t rough = {real(left), real(top), real(unit_random(&random, left, 319.5)),
                                   real(unit_random(&random, top, 239.5))};
        bslam_outline_t outline;
        const double narrow_m = unit_random(&random, 0, 3);
        const bslam_front_t front = {1, real(unit_random(&random, 0, 2)), real(narrow_m),
                                     real(unit_random(&random, narrow_m, 4))};
        const bslam_status_t status = bslam_outline_find(&picture.frame, camera, &rough, &front, &outline);
        assert_true(status == BSLAM_OK || status == BSLAM_E_RANGE);
        if (status == BSLAM_OK) {
            found++;
            assert_true(bslam_is_number(outline.middle) && outline.middle_var > 0 &&
                        outline.top > outline.bottom && outline.left > outline.right);
            // All of it is before the camera.
            assert_true(1 + outline.turn * outline.left > 0 && 1 + outline.turn * outline.right > 0);
        }
    }
    assert_true(found > 500);
}

/// Looking down at the floor: the box lies round what is straight below, of which no upright plane shows
/// anything.
static void test_find_refuses_a_box_that_reaches_to_straight_below(void **state)
{
    static unit_picture_t picture;
    bslam_camera_t camera = unit_equidistant();
    camera.pitch_rad = real(0.65);
    unit_picture_fill(&picture, 120, 130, 140);
    const bslam_box_t reaching = {36, 209, 287, 239};
    const bslam_box_t above = {120, 120, 200, 180};
    bslam_outline_t outline = {.left = 7};
    assert_int_equal(bslam_outline_find(&picture.frame, &camera, &reaching, &FLAT, &outline), BSLAM_E_RANGE);
    assert_true(outline.left == 7);
    assert_int_equal(bslam_outline_find(&picture.frame, &camera, &above, &FLAT, &outline), BSLAM_OK);
}

/// Looking up through a lens that bends straight lines much: an end of the upright side through the box's
/// middle height lies where the lens sees nothing.
static void test_find_refuses_a_box_of_which_the_lens_does_not_see_either_side(void **state)
{
    static unit_picture_t picture;
    bslam_camera_t camera = unit_pinhole();
    camera.fx_px = camera.fy_px = real(69.217);
    camera.pitch_rad = real(-1.43259);
    camera.k1 = real(-0.898651);
    camera.k2 = real(0.387267);
    unit_picture_fill(&picture, 120, 130, 140);
    assert_int_equal(bslam_camera_check(&camera), BSLAM_OK);
    const double left = 2.18808, right = 251.74, width = 2 * (double)camera.cx_px;
    const bslam_box_t boxes[] = {{real(left), real(165.879), real(right), real(190.64)},
                                 {real(width - right), real(165.879), real(width - left), real(190.64)}};
    for (int i = 0; i < 2; i++) {
        bslam_outline_t outline = {.left = 7};
        assert_int_equal(bslam_outline_find(&picture.frame, &camera, &boxes[i], &FLAT, &outline),
                         BSLAM_E_RANGE);
        assert_true(outline.left == 7);
    }
}

static void test_find_refuses_a_box_that_is_none(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    unit_picture_fill(&picture, 120, 130, 140);
    const bslam_box_t bad[] = {{100, 100, 100, 150},    {100, 150, 140, 100},   {-5, 10, 50, 50},
                               {10, -5, 50, 50},        {300, 10, 325, 50},     {10, 200, 50, 245},
                               {real(NAN), 10, 50, 50}, {10, 10, 50, real(NAN)}};
    bslam_outline_t outline = {.left = 7};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        assert_int_equal(bslam_outline_find(&picture.frame, &camera, &bad[i], &FLAT, &outline),
                         BSLAM_E_RANGE);
    }
    const bslam_box_t good = {100, 100, 140, 150};
    const bslam_front_t none[] = {{1, real(-0.1), 0, 0}, {1, real(2.1), 0, 0}, {1, real(NAN), 0, 0},
                                  {1, 0, 2, 1},          {1, 0, -1, 1},        {1, 0, 0, real(NAN)}};
    for (int i = 0; i < COUNT_OF(none); i++) {
        const bslam_status_t status = bslam_outline_find(&picture.frame, &camera, &good, &none[i], &outline);
        assert_int_equal(status, BSLAM_E_RANGE);
    }
    assert_true(outline.left == 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_find_a_facing_rectangle_from_a_box_three_pixels_off),
        cmocka_unit_test(test_find_a_turned_rectangle_as_a_trapezoid_with_its_middle_in_plan),
        cmocka_unit_test(test_find_through_a_wide_pitched_lens_gives_the_same_tangents),
        cmocka_unit_test(test_find_takes_the_flank_of_a_body_off),
        cmocka_unit_test(test_find_tells_a_flank_as_wide_as_the_front_by_the_edge_between_them),
        cmocka_unit_test(test_find_tells_the_front_by_what_is_on_it),
        cmocka_unit_test(test_find_is_nearer_where_it_knows_how_wide_the_front_is),
        cmocka_unit_test(test_find_in_dimmer_light_finds_the_same),
        cmocka_unit_test(test_find_is_less_sure_where_two_edges_may_be_the_side),
        cmocka_unit_test(test_find_where_nothing_is_keeps_the_box_and_doubts_it),
        cmocka_unit_test(test_find_at_every_edge_of_the_frame_reads_nothing_outside),
        cmocka_unit_test(test_find_refuses_a_box_that_reaches_to_straight_below),
        cmocka_unit_test(test_find_refuses_a_box_of_which_the_lens_does_not_see_either_side),
        cmocka_unit_test(test_find_refuses_a_box_that_is_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
