#include "support.h"

#include <math.h>

#include "vision/camera/lens.h"

#define PI 3.14159265358979323846

/// A pixel after a few roundings of numbers up to 400, and the trigonometry's 4e-7 rad times a focal length.
#define PIXEL_ERROR (BSLAM_REAL_DOUBLE ? 1e-10 : 6e-4)
#define UNIT_ERROR (BSLAM_REAL_DOUBLE ? 1e-13 : 2e-6)

static bslam_camera_t pinhole(void)
{
    return (bslam_camera_t){.lens = BSLAM_LENS_PINHOLE,
                            .width_px = 320,
                            .height_px = 240,
                            .fx_px = BSLAM_R(277.128),
                            .fy_px = BSLAM_R(277.128),
                            .cx_px = BSLAM_R(159.5),
                            .cy_px = BSLAM_R(119.5),
                            .z_m = BSLAM_R(0.5)};
}

static bslam_camera_t equidistant(void)
{
    bslam_camera_t camera = pinhole();
    camera.lens = BSLAM_LENS_EQUIDISTANT;
    camera.fx_px = BSLAM_R(101.9);
    camera.fy_px = BSLAM_R(101.9);
    return camera;
}

/// OpenCV's own formulas, in its camera axes (x right, y down, z forward), for a camera that looks ahead.
static void opencv_pixel(const bslam_camera_t *camera, double forward, double left, double up, double *u,
                         double *v)
{
    const double a = -left / forward;
    const double b = -up / forward;
    const double r = sqrt(a * a + b * b);
    const double k1 = (double)camera->k1;
    const double k2 = (double)camera->k2;
    double scale;
    if (camera->lens == BSLAM_LENS_PINHOLE) {
        scale = 1 + k1 * r * r + k2 * pow(r, 4);
    } else {
        const double angle = atan(r);
        scale = angle * (1 + k1 * pow(angle, 2) + k2 * pow(angle, 4)) / r;
    }
    *u = (double)camera->fx_px * a * scale + (double)camera->cx_px;
    *v = (double)camera->fy_px * b * scale + (double)camera->cy_px;
}

static void assert_projects_to(const bslam_camera_t *camera, double x, double y, double z, double u, double v)
{
    const bslam_direction_t direction = {real(x), real(y), real(z)};
    bslam_real_t got_u;
    bslam_real_t got_v;
    assert_int_equal(bslam_camera_project(camera, &direction, &got_u, &got_v), BSLAM_OK);
    assert_near(got_u, u, PIXEL_ERROR);
    assert_near(got_v, v, PIXEL_ERROR);
}

static void test_project_on_the_axis_meets_the_centre(void **state)
{
    const bslam_camera_t ahead = pinhole();
    assert_projects_to(&ahead, 2, 0, 0, 159.5, 119.5);
    bslam_camera_t turned = equidistant();
    turned.yaw_rad = real(PI / 3);
    turned.pitch_rad = real(PI / 6);
    // Yaw 60 degrees to the left and 30 down: cos 30 (cos 60, sin 60), -sin 30.
    assert_projects_to(&turned, 0.4330127018922193, 0.75, -0.5, 159.5, 119.5);
}

static void test_project_without_distortion_by_hand(void **state)
{
    const bslam_camera_t flat = pinhole();
    // 1 m to the left and 0.5 m up at 2 m: half a focal length left, a quarter up.
    assert_projects_to(&flat, 2, 1, 0.5, 159.5 - 277.128 / 2, 119.5 - 277.128 / 4);
    const bslam_camera_t wide = equidistant();
    // 45 degrees to the right, and straight to the left.
    assert_projects_to(&wide, 1, -1, 0, 159.5 + 101.9 * PI / 4, 119.5);
    assert_projects_to(&wide, 0, 1, 0, 159.5 - 101.9 * PI / 2, 119.5);
}

static void test_project_follows_opencv(void **state)
{
    bslam_camera_t cameras[] = {pinhole(), equidistant()};
    unit_random_t random = {4};
    for (int i = 0; i < 400; i++) {
        bslam_camera_t *camera = &cameras[i % 2];
        camera->k1 = real(unit_random(&random, -0.2, 0.3));
        camera->k2 = real(unit_random(&random, 0, 0.05));
        const double y = unit_random(&random, -0.5, 0.5);
        const double z = unit_random(&random, -0.4, 0.4);
        double u;
        double v;
        opencv_pixel(camera, 1, y, z, &u, &v);
        assert_projects_to(camera, 1, y, z, u, v);
    }
}

/// Pixel -> direction -> pixel over the whole frame.
static void assert_round_trip(const bslam_camera_t *camera)
{
    assert_int_equal(bslam_camera_check(camera), BSLAM_OK);
    for (int v = 0; v < 240; v += 7) {
        for (int u = 0; u < 320; u += 7) {
            bslam_direction_t direction;
            bslam_real_t back_u;
            bslam_real_t back_v;
            assert_int_equal(bslam_camera_unproject(camera, (bslam_real_t)u, (bslam_real_t)v, &direction),
                             BSLAM_OK);
            assert_near(direction.x * direction.x + direction.y * direction.y + direction.z * direction.z, 1,
                        UNIT_ERROR);
            assert_int_equal(bslam_camera_project(camera, &direction, &back_u, &back_v), BSLAM_OK);
            assert_near(back_u, u, PIXEL_ERROR);
            assert_near(back_v, v, PIXEL_ERROR);
        }
    }
}

static void test_unproject_undoes_project_at_any_mounting_and_distortion(void **state)
{
    static const double distortions[][2] = {{0, 0}, {-0.2, 0.03}, {0.25, -0.02}, {-0.05, 0.0}, {0.1, 0.1}};
    for (int i = 0; i < COUNT_OF(distortions); i++) {
        bslam_camera_t cameras[] = {pinhole(), equidistant()};
        for (int k = 0; k < 2; k++) {
            // The equidistant corner is 1.96 rad out: the same numbers would fold there.
            const double weaker = k == 0 ? 1 : 0.1;
            cameras[k].k1 = real(distortions[i][0] * weaker);
            cameras[k].k2 = real(distortions[i][1] * weaker * weaker);
            cameras[k].yaw_rad = real(0.9 * i - 1.8);
            cameras[k].pitch_rad = real(0.2 * i - 0.4);
            assert_round_trip(&cameras[k]);
        }
    }
}

static void test_unproject_of_the_centre_is_the_axis(void **state)
{
    bslam_camera_t camera = equidistant();
    camera.yaw_rad = real(-PI / 2);
    bslam_direction_t direction;
    assert_int_equal(bslam_camera_unproject(&camera, camera.cx_px, camera.cy_px, &direction), BSLAM_OK);
    assert_near(bslam_direction_bearing_rad(&direction), -PI / 2, UNIT_ERROR);
    assert_near(bslam_direction_elevation_rad(&direction), 0, UNIT_ERROR);
}

static void test_elevation_of_a_pixel_below_the_centre_adds_to_the_pitch(void **state)
{
    bslam_camera_t camera = equidistant();
    camera.pitch_rad = real(0.3);
    bslam_direction_t direction;
    // 0.2 rad below the axis, which looks 0.3 rad down.
    assert_int_equal(
        bslam_camera_unproject(&camera, camera.cx_px, camera.cy_px + real(0.2 * 101.9), &direction),
        BSLAM_OK);
    assert_near(bslam_direction_bearing_rad(&direction), 0, UNIT_ERROR);
    assert_near(bslam_direction_elevation_rad(&direction), -0.5, UNIT_ERROR);
}

static void test_project_refuses_what_the_lens_does_not_see(void **state)
{
    const bslam_camera_t flat = pinhole();
    bslam_camera_t folding = pinhole();
    folding.k1 = real(-0.2);  // folds at tan = sqrt(1 / 0.6) = 1.29
    static const bslam_direction_t behind = {-1, BSLAM_R(0.1), 0};
    static const bslam_direction_t beside = {0, 1, 0};
    static const bslam_direction_t beyond = {1, BSLAM_R(1.4), 0};
    static const bslam_direction_t none = {0, 0, 0};
    bslam_real_t u = 7;
    bslam_real_t v = 8;
    assert_int_equal(bslam_camera_project(&flat, &behind, &u, &v), BSLAM_E_RANGE);
    assert_int_equal(bslam_camera_project(&flat, &beside, &u, &v), BSLAM_E_RANGE);
    assert_int_equal(bslam_camera_project(&folding, &beyond, &u, &v), BSLAM_E_RANGE);
    const bslam_camera_t wide = equidistant();
    assert_int_equal(bslam_camera_project(&wide, &none, &u, &v), BSLAM_E_RANGE);
    assert_true(u == 7 && v == 8);
}

static void test_unproject_refuses_what_has_no_direction(void **state)
{
    bslam_camera_t folding = pinhole();
    folding.k1 = real(-0.2);
    const bslam_camera_t wide = equidistant();
    bslam_direction_t direction = {1, 2, 3};
    // The fold's distorted radius is 1.29 (1 - 0.2 * 1.67) = 0.86 focal lengths: 238 px from the axis.
    assert_int_equal(bslam_camera_unproject(&folding, 420, 120, &direction), BSLAM_E_RANGE);
    // More than pi from the axis.
    assert_int_equal(bslam_camera_unproject(&wide, 500, 120, &direction), BSLAM_E_RANGE);
    assert_int_equal(bslam_camera_unproject(&wide, BSLAM_R(1e9), 120, &direction), BSLAM_E_RANGE);
    assert_true(direction.x == 1 && direction.y == 2 && direction.z == 3);
}

static void test_nan_and_infinity_are_refused(void **state)
{
    static const double bad[] = {NAN, INFINITY, -INFINITY};
    const bslam_camera_t camera = pinhole();
    for (int i = 0; i < COUNT_OF(bad); i++) {
        bslam_direction_t direction = {1, 0, 0};
        bslam_real_t u = 1;
        bslam_real_t v = 2;
        assert_int_equal(bslam_camera_unproject(&camera, real(bad[i]), 5, &direction), BSLAM_E_NOT_FINITE);
        assert_int_equal(bslam_camera_unproject(&camera, 5, real(bad[i]), &direction), BSLAM_E_NOT_FINITE);
        for (int k = 0; k < 3; k++) {
            const bslam_direction_t wrong = {k == 0 ? real(bad[i]) : 1, k == 1 ? real(bad[i]) : 0,
                                             k == 2 ? real(bad[i]) : 0};
            assert_int_equal(bslam_camera_project(&camera, &wrong, &u, &v), BSLAM_E_NOT_FINITE);
        }
    }
}

static void test_check_names_what_is_wrong(void **state)
{
    bslam_camera_t camera = pinhole();
    assert_int_equal(bslam_camera_check(&camera), BSLAM_OK);
    bslam_real_t *numbers[] = {&camera.fx_px, &camera.fy_px,   &camera.cx_px,     &camera.cy_px, &camera.k1,
                               &camera.k2,    &camera.yaw_rad, &camera.pitch_rad, &camera.z_m};
    for (int i = 0; i < COUNT_OF(numbers); i++) {
        camera = pinhole();
        *numbers[i] = real(NAN);
        assert_int_equal(bslam_camera_check(&camera), BSLAM_E_NOT_FINITE);
    }
    // Beyond its range on either side, in the same order.
    static const double beyond[][2] = {{0.5, 2e5},   {0, 2e5},  {-1, 320},   {-1, 240}, {-0.9, -0.9},
                                       {-0.9, -0.9}, {-4, 3.2}, {-1.6, 1.6}, {-0.1, 11}};
    for (int i = 0; i < COUNT_OF(numbers); i++) {
        for (int side = 0; side < 2; side++) {
            camera = pinhole();
            *numbers[i] = real(beyond[i][side]);
            assert_int_equal(bslam_camera_check(&camera), BSLAM_E_PARAMETER);
        }
    }
    int32_t *sizes[] = {&camera.width_px, &camera.height_px};
    for (int i = 0; i < 2; i++) {
        camera = pinhole();
        *sizes[i] = 7;
        assert_int_equal(bslam_camera_check(&camera), BSLAM_E_PARAMETER);
        *sizes[i] = BSLAM_FRAME_SIDE_MAX + 1;
        assert_int_equal(bslam_camera_check(&camera), BSLAM_E_PARAMETER);
    }
    camera = pinhole();
    camera.lens = (bslam_lens_kind_t)2;
    assert_int_equal(bslam_camera_check(&camera), BSLAM_E_PARAMETER);
}

/// The axis meets the frame in one corner: the opposite one is 1.44 focal lengths away, the others 1.16 at
/// most, and the radius stops growing at 1.3.
static void test_check_refuses_a_distortion_that_folds_in_one_corner(void **state)
{
    static const double centres_px[][2] = {{0, 0}, {319, 0}, {0, 239}, {319, 239}, {159.5, 119.5}};
    for (int i = 0; i < COUNT_OF(centres_px); i++) {
        bslam_camera_t camera = pinhole();
        camera.fx_px = 277;
        camera.fy_px = 277;
        camera.k1 = BSLAM_R(-0.197);
        camera.k2 = 0;
        camera.cx_px = real(centres_px[i][0]);
        camera.cy_px = real(centres_px[i][1]);
        assert_int_equal(bslam_camera_check(&camera), i < 4 ? BSLAM_E_PARAMETER : BSLAM_OK);
    }
}

/// The axis near the frame's corner: of the four corners only the one across is beyond the fold.
static void test_check_refuses_a_distortion_that_folds_across_the_frame_only(void **state)
{
    bslam_camera_t camera = pinhole();
    camera.cx_px = 0;
    camera.cy_px = 0;
    camera.k2 = 0;
    camera.k1 = BSLAM_R(-0.09);  // folds at 1.92, where the distorted radius is 1.28
    camera.fx_px = 270;          // right 1.185, bottom 1.0, the corner 1.55
    camera.fy_px = 240;
    assert_int_equal(bslam_camera_check(&camera), BSLAM_E_PARAMETER);
    camera.fx_px = 400;  // the corner 1.0
    camera.fy_px = 400;
    assert_int_equal(bslam_camera_check(&camera), BSLAM_OK);
}

static void test_check_refuses_a_distortion_that_folds_only_between(void **state)
{
    // The slope 1 + 3 k1 q + 5 k2 q², q = r², is -0.06 at q = 0.35 and again positive at the frame's corner,
    // whose distorted radius 0.722 is reached at q = 1.0.
    bslam_camera_t camera = pinhole();
    camera.k1 = real(-2);
    camera.k2 = real(1.7);
    assert_int_equal(bslam_camera_check(&camera), BSLAM_E_PARAMETER);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_project_on_the_axis_meets_the_centre),
        cmocka_unit_test(test_project_without_distortion_by_hand),
        cmocka_unit_test(test_project_follows_opencv),
        cmocka_unit_test(test_unproject_undoes_project_at_any_mounting_and_distortion),
        cmocka_unit_test(test_unproject_of_the_centre_is_the_axis),
        cmocka_unit_test(test_elevation_of_a_pixel_below_the_centre_adds_to_the_pitch),
        cmocka_unit_test(test_project_refuses_what_the_lens_does_not_see),
        cmocka_unit_test(test_unproject_refuses_what_has_no_direction),
        cmocka_unit_test(test_nan_and_infinity_are_refused),
        cmocka_unit_test(test_check_names_what_is_wrong),
        cmocka_unit_test(test_check_refuses_a_distortion_that_folds_in_one_corner),
        cmocka_unit_test(test_check_refuses_a_distortion_that_folds_across_the_frame_only),
        cmocka_unit_test(test_check_refuses_a_distortion_that_folds_only_between),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
