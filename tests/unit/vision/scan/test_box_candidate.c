#include "support.h"

#include <math.h>

#include "picture.h"
#include "base/logarithm.h"
#include "vision/scan/box_candidate.h"

static const bslam_scan_kind_t post = {
    .name = "post", .height_m = 0.5f, .slope = 1, .middle_sd = 0.05f, .height_sd = 0.04f};

/// What a box at logarithmic odds of 3 adds to its noise: it is wrong, by 0.3 of itself, one time in 17.
#define MISSED (0.3 * sqrt(1 / (1 + 1 / (double)bslam_falling(3))))

/// What is 0.5 m high, its middle as high as the camera, 2 m ahead and 1 m to the right.
static bslam_detection_t seen_by(const bslam_camera_t *camera)
{
    const bslam_direction_t top = {2, -1, 0.25f}, bottom = {2, -1, -0.25f}, left = {2, -0.9f, 0},
                            right = {2, -1.1f, 0};
    bslam_detection_t found = {.kind = 0, .log_odds = 3};
    bslam_real_t unused;
    assert_int_equal(bslam_camera_project(camera, &top, &unused, &found.box.top_px), BSLAM_OK);
    assert_int_equal(bslam_camera_project(camera, &bottom, &unused, &found.box.bottom_px), BSLAM_OK);
    assert_int_equal(bslam_camera_project(camera, &left, &found.box.left_px, &unused), BSLAM_OK);
    assert_int_equal(bslam_camera_project(camera, &right, &found.box.right_px, &unused), BSLAM_OK);
    return found;
}

static void test_candidate_is_where_the_thing_is(void **state)
{
    (void)state;
    const bslam_camera_t camera = unit_pinhole();
    const bslam_detection_t found = seen_by(&camera);
    const bslam_candidate_t one = bslam_box_candidate(&post, &camera, &found);
    const double width_rad = atan2(1.1, 2) - atan2(0.9, 2);
    assert_true(one.has_bearing);
    assert_near(one.bearing_rad, atan2(-1, 2), 1e-3);
    assert_near(one.bearing_sd_rad,
                width_rad * hypot(hypot(0.05, MISSED), 0.5 / (found.box.right_px - found.box.left_px)), 1e-4);
    const double share = hypot(hypot(0.04, MISSED), 0.5 / (found.box.bottom_px - found.box.top_px));
    assert_true(one.has_range);
    assert_near(one.range_m, sqrt(5), 0.01);
    assert_near(one.range_noise_sd_m, sqrt(5) * share, 1e-3);
    assert_near(one.range_scale_sd, 0.02, 1e-6);
    assert_near(one.range_sd_m, sqrt(5) * hypot(share, 0.02), 1e-3);
    assert_int_equal(one.beacon_class, 1);
    assert_int_equal(one.second_class, BSLAM_CLASS_NONE);
    assert_near(one.score, 3, 0);
}

static void test_what_is_cut_off_or_of_no_height_has_no_range_or_a_rough_bearing(void **state)
{
    (void)state;
    const bslam_camera_t camera = unit_pinhole();
    bslam_detection_t found = seen_by(&camera);
    const double sure_rad = bslam_box_candidate(&post, &camera, &found).bearing_sd_rad;
    found.marks = BSLAM_MARK_CUT_TOP;
    assert_false(bslam_box_candidate(&post, &camera, &found).has_range);
    found.marks = BSLAM_MARK_CUT_RIGHT;
    const bslam_candidate_t cut = bslam_box_candidate(&post, &camera, &found);
    assert_true(cut.has_range);
    assert_true(cut.bearing_sd_rad > 5 * sure_rad);
    found.marks = 0;
    bslam_scan_kind_t unknown = post;
    unknown.height_m = 0;
    assert_false(bslam_box_candidate(&unknown, &camera, &found).has_range);
}

static void test_doubtful_box_is_noisier_in_both(void **state)
{
    (void)state;
    const bslam_camera_t camera = unit_pinhole();
    bslam_detection_t found = seen_by(&camera);
    found.log_odds = 1e6f;
    const bslam_candidate_t sure = bslam_box_candidate(&post, &camera, &found);
    found.log_odds = 0;
    const bslam_candidate_t doubtful = bslam_box_candidate(&post, &camera, &found);
    const double pixel_x = 0.5 / (found.box.right_px - found.box.left_px),
                 pixel_y = 0.5 / (found.box.bottom_px - found.box.top_px), missed = 0.3 * sqrt(0.5);
    assert_near(doubtful.bearing_sd_rad / sure.bearing_sd_rad,
                hypot(hypot(0.05, missed), pixel_x) / hypot(0.05, pixel_x), 1e-3);
    assert_near(doubtful.range_noise_sd_m / sure.range_noise_sd_m,
                hypot(hypot(0.04, missed), pixel_y) / hypot(0.04, pixel_y), 1e-3);
    assert_near(doubtful.range_m, sure.range_m, 0);
}

static void test_narrower_than_from_ahead_is_seen_from_aside_so_its_middle_is_farther(void **state)
{
    (void)state;
    const bslam_camera_t camera = unit_pinhole();
    bslam_detection_t found = seen_by(&camera);
    bslam_scan_kind_t wide = post;
    const double seen_m = (atan2(1.1, 2) - atan2(0.9, 2)) * sqrt(5);
    wide.width_m = (float)(seen_m * 1.25);  // of which 3/5 is along the line of sight
    assert_near(bslam_box_candidate(&wide, &camera, &found).range_m, sqrt(5) + 0.5 * 0.75 * seen_m, 0.01);
    wide.width_m = (float)(seen_m * 0.9);
    assert_near(bslam_box_candidate(&wide, &camera, &found).range_m, sqrt(5), 0.01);
    wide.width_m = 2;
    found.marks = BSLAM_MARK_CUT_LEFT;
    assert_near(bslam_box_candidate(&wide, &camera, &found).range_m, sqrt(5), 0.01);
}

static void test_box_without_a_direction_has_none(void **state)
{
    (void)state;
    const bslam_camera_t camera = unit_pinhole();
    bslam_detection_t found = seen_by(&camera);
    found.box.left_px = NAN;
    const bslam_candidate_t one = bslam_box_candidate(&post, &camera, &found);
    assert_false(one.has_bearing);
    assert_false(one.has_range);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_candidate_is_where_the_thing_is),
        cmocka_unit_test(test_what_is_cut_off_or_of_no_height_has_no_range_or_a_rough_bearing),
        cmocka_unit_test(test_doubtful_box_is_noisier_in_both),
        cmocka_unit_test(test_narrower_than_from_ahead_is_seen_from_aside_so_its_middle_is_farther),
        cmocka_unit_test(test_box_without_a_direction_has_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
