#include "support.h"

#include <math.h>

#include "vision/built_in/measurement/measure.h"
#include "picture.h"

static const double WALL[3] = {180, 175, 160};
static const bslam_size_t POSTER_SIZE = {.height_m = BSLAM_R(0.8)};

/// A poster 0.8 m high and 0.7 m wide, `range_m` away in direction `bearing_rad`, its front turned by
/// `slant_rad`.
static unit_panel_t poster(double range_m, double bearing_rad, double slant_rad)
{
    const double x = range_m * cos(bearing_rad), y = range_m * sin(bearing_rad);
    const double along_x = -0.35 * sin(bearing_rad + slant_rad),
                 along_y = 0.35 * cos(bearing_rad + slant_rad);
    return (unit_panel_t){x + along_x, y + along_y, x - along_x, y - along_y, 0.7, 1.5, 60, 80, 150};
}

/// The box around a panel in the frame, 2 pixels larger.
static bslam_box_t box_of(const bslam_camera_t *camera, const unit_panel_t *panel)
{
    double box[4] = {1e9, 1e9, -1e9, -1e9};
    for (int i = 0; i < 4; i++) {
        const double z = (i < 2 ? panel->high_m : panel->low_m) - (double)camera->z_m;
        const bslam_direction_t corner = {real(i % 2 == 0 ? panel->x0_m : panel->x1_m),
                                          real(i % 2 == 0 ? panel->y0_m : panel->y1_m), real(z)};
        bslam_real_t u;
        bslam_real_t v;
        assert_int_equal(bslam_camera_project(camera, &corner, &u, &v), BSLAM_OK);
        box[0] = fmin(box[0], (double)u);
        box[1] = fmin(box[1], (double)v);
        box[2] = fmax(box[2], (double)u);
        box[3] = fmax(box[3], (double)v);
    }
    return (bslam_box_t){real(fmax(box[0] - 2, -0.5)), real(fmax(box[1] - 2, -0.5)),
                         real(fmin(box[2] + 2, 319.5)), real(fmin(box[3] + 2, 239.5))};
}

static bslam_candidate_t measured(const bslam_camera_t *camera, const unit_panel_t *panel,
                                  const bslam_size_t *size)
{
    static unit_picture_t picture;
    unit_picture_draw(&picture, camera, WALL, panel, 1);
    const bslam_box_t rough = box_of(camera, panel);
    bslam_candidate_t candidate = {.beacon_class = 3, .class_margin = 0.5f, .score = 0.25f};
    assert_int_equal(bslam_measure(&picture.frame, camera, &rough, size, &candidate), BSLAM_OK);
    return candidate;
}

static void test_measure_tells_direction_and_distance_of_a_known_object(void **state)
{
    // Range, bearing, slant.
    static const double cases[][3] = {{3, 0, 0}, {3, 0.2, 0}, {4, -0.25, 0.5}, {5, 0.1, -0.7}, {6, 0.3, 0.3}};
    const bslam_camera_t camera = unit_pinhole();
    for (int i = 0; i < COUNT_OF(cases); i++) {
        const unit_panel_t panel = poster(cases[i][0], cases[i][1], cases[i][2]);
        const bslam_candidate_t candidate = measured(&camera, &panel, &POSTER_SIZE);
        assert_true(candidate.has_bearing && candidate.has_range);
        assert_int_equal(candidate.marks, 0);
        assert_near(candidate.bearing_rad, cases[i][1], 0.5 / 277);
        // Half a pixel of the 35 to 75 that 0.8 m take.
        assert_near(candidate.range_m / real(cases[i][0]), 1, 0.013);
        assert_true(candidate.beacon_class == 3 && candidate.class_margin == 0.5f &&
                    candidate.score == 0.25f);
    }
}

static void test_measure_through_a_wide_turned_pitched_camera(void **state)
{
    bslam_camera_t camera = unit_equidistant();
    camera.yaw_rad = real(1.2);
    camera.pitch_rad = real(-0.15);
    for (int i = 0; i < 5; i++) {
        const double bearing_rad = 0.2 + 0.5 * i;
        const unit_panel_t panel = poster(2.5, bearing_rad, 0.3);
        const bslam_candidate_t candidate = measured(&camera, &panel, &POSTER_SIZE);
        assert_true(candidate.has_bearing && candidate.has_range);
        assert_near(candidate.bearing_rad, bearing_rad, 0.6 / 101.9);
        assert_near(candidate.range_m / real(2.5), 1, 0.025);
    }
}

static void test_measure_around_the_back_wraps_the_direction(void **state)
{
    bslam_camera_t camera = unit_pinhole();
    camera.yaw_rad = real(3.1);
    const unit_panel_t panel = poster(3, -3.0, 0);
    const bslam_candidate_t candidate = measured(&camera, &panel, &POSTER_SIZE);
    assert_near(candidate.bearing_rad, -3.0, 0.5 / 277);
}

static void test_measure_without_a_height_has_a_direction_only(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    const bslam_size_t unknown = {0};
    const unit_panel_t panel = poster(3, 0.1, 0.2);
    const bslam_candidate_t candidate = measured(&camera, &panel, &unknown);
    assert_true(candidate.has_bearing && !candidate.has_range);
    assert_near(candidate.bearing_rad, 0.1, 0.5 / 277);
}

static void test_measure_is_less_sure_of_what_is_farther_or_fainter(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t near_panel = poster(2.5, 0, 0);
    const unit_panel_t far_panel = poster(6, 0, 0);
    unit_panel_t faint_panel = near_panel;
    faint_panel.red = 172;
    faint_panel.green = 168;
    faint_panel.blue = 156;
    const bslam_candidate_t sharp = measured(&camera, &near_panel, &POSTER_SIZE);
    const bslam_candidate_t distant = measured(&camera, &far_panel, &POSTER_SIZE);
    const bslam_candidate_t faint = measured(&camera, &faint_panel, &POSTER_SIZE);
    assert_true(distant.range_sd_m / distant.range_m > 1.2f * (sharp.range_sd_m / sharp.range_m));
    assert_true(faint.bearing_sd_rad > 1.5f * sharp.bearing_sd_rad);
    assert_true(!faint.has_range || faint.range_sd_m > 1.5f * sharp.range_sd_m);
}

/// A picture of one panel, measured in a box given by hand.
static bslam_candidate_t measured_in(const unit_panel_t *panel, bslam_box_t rough)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    unit_picture_draw(&picture, &camera, WALL, panel, 1);
    bslam_candidate_t candidate;
    assert_int_equal(bslam_measure(&picture.frame, &camera, &rough, &POSTER_SIZE, &candidate), BSLAM_OK);
    return candidate;
}

static void test_measure_marks_what_is_cut_off(void **state)
{
    const unit_panel_t panel = poster(3, 0, 0);
    const bslam_candidate_t left = measured_in(&panel, (bslam_box_t){-0.5f, 20, 190, 100});
    const bslam_candidate_t right = measured_in(&panel, (bslam_box_t){130, 20, 319.5f, 100});
    const bslam_candidate_t top = measured_in(&panel, (bslam_box_t){127, -0.5f, 192, 100});
    const bslam_candidate_t bottom = measured_in(&panel, (bslam_box_t){127, 27, 192, 239.5f});
    assert_int_equal(left.marks, BSLAM_MARK_CUT_LEFT);
    assert_int_equal(right.marks, BSLAM_MARK_CUT_RIGHT);
    assert_int_equal(top.marks, BSLAM_MARK_CUT_TOP);
    assert_int_equal(bottom.marks, BSLAM_MARK_CUT_BOTTOM);
    assert_true(!left.has_bearing && !left.has_range && !right.has_bearing && !right.has_range);
    // Its width is not known, so it may end anywhere beyond the frame. Both upright sides are there: a
    // direction, but no distance.
    assert_true(top.has_bearing && !top.has_range && bottom.has_bearing && !bottom.has_range);
}

static void test_measure_marks_what_goes_on_beyond_a_box_short_of_the_frames_edge(void **state)
{
    const unit_panel_t panel = poster(3, 0.45, 0);  // its left side is 16 px outside
    const bslam_candidate_t found = measured_in(&panel, (bslam_box_t){5, 20, 74, 100});
    assert_true((found.marks & BSLAM_MARK_CUT_LEFT) != 0 && !found.has_bearing);
}

/// Of a kind that hangs so high and is so wide.
static const bslam_size_t HUNG_SIZE = {.height_m = BSLAM_R(0.8),
                                       .top_low_m = BSLAM_R(1.5),
                                       .top_high_m = BSLAM_R(1.5),
                                       .narrow_m = BSLAM_R(0.6),
                                       .wide_m = BSLAM_R(0.8)};

static void test_measure_of_what_is_cut_off_tells_roughly_where_its_middle_is(void **state)
{
    // Bearing, whereto the frame ends at 30 degrees; distance; slant. A third to three quarters are seen.
    static const double cases[][3] = {
        {0.5, 3, 0}, {-0.5, 3, 0}, {0.47, 3, 0.4}, {-0.55, 2.5, 0}, {0.52, 4, 0}};
    const bslam_camera_t camera = unit_pinhole();
    for (int i = 0; i < COUNT_OF(cases); i++) {
        const unit_panel_t panel = poster(cases[i][1], cases[i][0], cases[i][2]);
        const bslam_candidate_t found = measured(&camera, &panel, &HUNG_SIZE);
        const unsigned mark = cases[i][0] > 0 ? BSLAM_MARK_CUT_LEFT : BSLAM_MARK_CUT_RIGHT;
        assert_true((found.marks & mark) != 0 && found.has_bearing && !found.has_range);
        assert_true(found.bearing_sd_rad > BSLAM_R(0.02) && found.bearing_sd_rad < BSLAM_R(0.08));
        assert_near(found.bearing_rad, cases[i][0], 2 * (double)found.bearing_sd_rad);
    }
}

/// Its side is seen 6 pixels inside the frame, and it is as wide as its kind.
static void test_measure_of_what_ends_next_to_the_frames_edge_is_whole(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    for (int i = 0; i < 2; i++) {
        const double bearing = i == 0 ? 0.39 : -0.39;
        const unit_panel_t panel = poster(3, bearing, 0);
        const bslam_candidate_t found = measured(&camera, &panel, &HUNG_SIZE);
        assert_int_equal(found.marks, 0);
        assert_true(found.has_bearing && found.has_range);
        assert_near(found.bearing_rad, bearing, 0.5 / 277);
        assert_near(found.range_m / 3, 1, 0.013);
    }
}

static void test_measure_of_what_is_cut_off_and_of_unknown_height_tells_no_direction(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panel = poster(3, 0.5, 0);
    bslam_size_t size = HUNG_SIZE;
    size.height_m = 0;
    const bslam_candidate_t found = measured(&camera, &panel, &size);
    assert_true((found.marks & BSLAM_MARK_CUT_LEFT) != 0 && !found.has_bearing && !found.has_range);
}

static void test_measure_of_what_is_cut_off_on_both_sides_tells_no_direction(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panel = poster(0.8, 0, 0);
    const bslam_box_t rough = {-0.5f, 20, 319.5f, 220};
    unit_picture_draw(&picture, &camera, WALL, &panel, 1);
    bslam_candidate_t found;
    assert_int_equal(bslam_measure(&picture.frame, &camera, &rough, &HUNG_SIZE, &found), BSLAM_OK);
    assert_true(!found.has_bearing && !found.has_range);
}

/// A detector's box that holds a slice too narrow to be looked beyond.
static void test_measure_marks_a_part(void **state)
{
    const unit_panel_t panel = poster(3, 0, 0.3);
    const bslam_candidate_t found = measured_in(&panel, (bslam_box_t){150, 27, 170, 102});
    assert_int_equal(found.marks, BSLAM_MARK_PART);
    assert_true(!found.has_bearing && !found.has_range);
}

/// The flank of a cabinet is no part of its front that goes on.
static void test_measure_of_a_front_with_its_flank_is_no_part(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    const bslam_size_t cabinet = {.height_m = BSLAM_R(1.8), .depth_m = BSLAM_R(0.4)};
    // A front from (3.5, 0.5) to (4.1, -0.3), its left end nearer; its flank goes back from there.
    const unit_panel_t panels[2] = {{3.5 + 0.32, 0.5 + 0.24, 3.5, 0.5, 0, 1.8, 110, 60, 25},
                                    {3.5, 0.5, 4.1, -0.3, 0, 1.8, 170, 90, 40}};
    unit_picture_draw(&picture, &camera, WALL, panels, 2);
    const bslam_box_t left = box_of(&camera, &panels[0]), right = box_of(&camera, &panels[1]);
    const bslam_box_t rough = {left.left_px, left.top_px, right.right_px, left.bottom_px};
    bslam_candidate_t found;
    assert_int_equal(bslam_measure(&picture.frame, &camera, &rough, &cabinet, &found), BSLAM_OK);
    assert_int_equal(found.marks, 0);
    assert_near(found.bearing_rad, atan2(0.1, 3.8), 2.5 / 277);
    assert_near(found.range_m / real(hypot(0.1, 3.8)), 1, 0.02);
}

/// Rails run along the wall where its level sides are. It is as wide as its kind, so it has no more parts;
/// of a kind that may be wider it may be one.
static void test_measure_of_a_front_as_wide_as_its_kind_is_no_part(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panels[] = {poster(3, 0, 0),
                                   {3.01, 3, 3.01, -3, 1.44, 1.5, 60, 80, 150},
                                   {3.01, 3, 3.01, -3, 0.7, 0.76, 60, 80, 150}};
    unit_picture_draw(&picture, &camera, WALL, panels, COUNT_OF(panels));
    const bslam_box_t rough = box_of(&camera, &panels[0]);
    bslam_size_t size = HUNG_SIZE;
    size.wide_m = BSLAM_R(1.2);
    bslam_candidate_t found;
    assert_int_equal(bslam_measure(&picture.frame, &camera, &rough, &size, &found), BSLAM_OK);
    assert_int_equal(found.marks, BSLAM_MARK_PART);
    assert_true(!found.has_bearing && !found.has_range);
    size.wide_m = BSLAM_R(0.7);
    assert_int_equal(bslam_measure(&picture.frame, &camera, &rough, &size, &found), BSLAM_OK);
    assert_int_equal(found.marks, 0);
    assert_near(found.bearing_rad, 0, 0.7 / 277);
}

/// As light as the wall, so that its level sides are hardly seen and a neighbour's edge is the strongest: its
/// colour ends where it does.
static void test_measure_goes_by_the_colour_where_level_sides_are_pale(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    unit_panel_t pale = poster(3, 0, 0);
    pale.red = 176, pale.green = 168, pale.blue = 190;
    const unit_panel_t panels[] = {pale, {3, 0.75, 3, 0.6, 0.2, 1.9, 90, 60, 40}};
    unit_picture_draw(&picture, &camera, WALL, panels, COUNT_OF(panels));
    const bslam_box_t rough = {104, 27, 192, 102};
    bslam_size_t size = HUNG_SIZE;
    size.wide_m = BSLAM_R(1.2);
    bslam_candidate_t found;
    assert_int_equal(bslam_measure(&picture.frame, &camera, &rough, &size, &found), BSLAM_OK);
    assert_near(found.outline.left_px, 127.2, 1);
    assert_near(found.bearing_rad, 0, 0.01);
    const bslam_real_t doubtful_sd_rad = found.bearing_sd_rad;
    unit_picture_draw(&picture, &camera, WALL, panels, 1);
    const bslam_box_t own = box_of(&camera, &pale);
    assert_int_equal(bslam_measure(&picture.frame, &camera, &own, &size, &found), BSLAM_OK);
    assert_true(found.bearing_sd_rad < BSLAM_R(0.7) * doubtful_sd_rad);
}

/// A detector's box that holds only the right half of it, or the left one.
static void test_measure_follows_the_level_sides_to_where_a_thing_ends(void **state)
{
    const unit_panel_t panel = poster(3, 0, 0.3);
    const bslam_box_t halves[] = {{158, 27, 192, 102}, {127, 27, 158, 102}};
    for (int i = 0; i < COUNT_OF(halves); i++) {
        const bslam_candidate_t found = measured_in(&panel, halves[i]);
        assert_int_equal(found.marks, 0);
        assert_true(found.has_bearing && found.has_range);
        assert_near(found.bearing_rad, 0, 0.5 / 277);
        assert_near(found.range_m / 3, 1, 0.013);
    }
}

/// A box that reaches as far as a neighbour's edge, to either side: the level sides end before it.
static void test_measure_is_not_led_to_a_neighbour(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panels[] = {
        poster(3, 0, 0), {3, 0.7, 3, 0.55, 0.2, 1.9, 90, 60, 40}, {3, -0.55, 3, -0.7, 0.2, 1.9, 90, 60, 40}};
    unit_picture_draw(&picture, &camera, WALL, panels, COUNT_OF(panels));
    const bslam_box_t roughs[] = {{109, 27, 192, 102}, {127, 27, 210, 102}, {109, 27, 210, 102}};
    for (int i = 0; i < COUNT_OF(roughs); i++) {
        bslam_candidate_t found;
        assert_int_equal(bslam_measure(&picture.frame, &camera, &roughs[i], &POSTER_SIZE, &found), BSLAM_OK);
        assert_int_equal(found.marks, 0);
        assert_near(found.bearing_rad, 0, 0.5 / 277);
        assert_near(found.outline.left_px, 127.2, 1);
        assert_near(found.outline.right_px, 191.8, 1);
    }
}

/// Two posters that touch, so that level sides go on: how wide the kind is tells.
static void test_measure_of_two_of_a_kind_goes_by_their_width(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panels[] = {poster(3, 0, 0), {3, 1.05, 3, 0.35, 0.7, 1.5, 120, 60, 60}};
    unit_picture_draw(&picture, &camera, WALL, panels, COUNT_OF(panels));
    const bslam_box_t both = {103, 27, 192, 102};
    bslam_size_t size = HUNG_SIZE;
    size.wide_m = BSLAM_R(0.72);
    bslam_candidate_t found;
    assert_int_equal(bslam_measure(&picture.frame, &camera, &both, &size, &found), BSLAM_OK);
    assert_near(found.outline.left_px, 127.2, 1.5);
    assert_near(found.bearing_rad, 0, 1.0 / 277);
    size.wide_m = size.narrow_m = 0;
    assert_int_equal(bslam_measure(&picture.frame, &camera, &both, &size, &found), BSLAM_OK);
    assert_true(found.bearing_rad > BSLAM_R(0.02) || found.marks != 0);
}

static void test_measure_of_a_part_that_goes_on_out_of_the_frame_is_marked(void **state)
{
    const unit_panel_t panel = {3, 3, 3, -0.4, 0.7, 1.5, 60, 80, 150};
    const bslam_candidate_t found = measured_in(&panel, (bslam_box_t){120, 27, 197, 102});
    assert_true((found.marks & (BSLAM_MARK_CUT_LEFT | BSLAM_MARK_PART)) != 0 && !found.has_bearing);
}

static void test_measure_takes_no_distance_of_what_hangs_elsewhere_than_its_kind(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panel = poster(3, 0.1, 0.2);  // its upper side is 1.5 m above the floor
    bslam_size_t size = POSTER_SIZE;
    size.top_low_m = size.top_high_m = BSLAM_R(1.5);
    const bslam_candidate_t right = measured(&camera, &panel, &size);
    size.top_low_m = size.top_high_m = BSLAM_R(1.9);
    const bslam_candidate_t wrong = measured(&camera, &panel, &size);
    size.top_low_m = BSLAM_R(1.3);
    const bslam_candidate_t within = measured(&camera, &panel, &size);
    assert_true(right.has_range && right.misplaced_sds < 1 && within.has_range && within.misplaced_sds < 1);
    assert_int_equal(wrong.marks, BSLAM_MARK_MISPLACED);
    assert_true(wrong.has_bearing && !wrong.has_range && wrong.misplaced_sds > 3);
}

/// It hangs a little off, so that there is a distance: as much noisier as the square of how far it is off.
static void test_measure_is_less_sure_of_a_distance_whose_sides_contradict_each_other(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panel = poster(3, 0.1, 0.2);
    bslam_size_t size = POSTER_SIZE;
    size.top_low_m = size.top_high_m = BSLAM_R(1.5);
    const bslam_candidate_t right = measured(&camera, &panel, &size);
    const double plain = (double)(right.range_noise_sd_m / right.range_m);
    assert_true(right.misplaced_sds < 1);
    int contradicted = 0;
    for (int i = 1; i <= 8; i++) {
        size.top_low_m = size.top_high_m = BSLAM_R(1.5) + BSLAM_R(0.02) * (bslam_real_t)i;
        const bslam_candidate_t off = measured(&camera, &panel, &size);
        const double square = (double)off.misplaced_sds * (double)off.misplaced_sds;
        if (off.has_range && square > 1) {
            const double times = (double)(off.range_noise_sd_m / off.range_m) / plain;
            assert_true(times > 0.8 * square && times < 1.25 * square);
            assert_true(off.range_sd_m > off.range_noise_sd_m);
            contradicted++;
        }
    }
    assert_true(contradicted >= 2);
}

/// A rim of the wall's colour: by the height alone the poster seems farther; its place tells.
static void test_measure_of_a_kind_with_a_known_place_survives_a_pale_rim(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    unit_panel_t panel = poster(3, 0, 0);
    panel.low_m += 0.08;
    panel.high_m -= 0.08;
    bslam_size_t size = POSTER_SIZE;
    size.looks_sd = BSLAM_R(0.15);
    const bslam_candidate_t by_height = measured(&camera, &panel, &size);
    size.top_low_m = size.top_high_m = BSLAM_R(1.5);
    const bslam_candidate_t by_place = measured(&camera, &panel, &size);
    assert_near(by_height.range_m, 3 * 0.8 / 0.64, 0.05);
    assert_true(by_place.range_m > 2.9f && by_place.range_m < 3.35f);
    assert_true(by_place.range_sd_m < by_height.range_sd_m / 2);
}

/// Of something round, as wide from every side, the width is a second distance.
static void test_measure_takes_no_distance_where_height_and_width_contradict_each_other(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panel = poster(3, 0, 0);  // 0.8 m high, 0.7 m wide
    bslam_size_t size = POSTER_SIZE;
    size.width_m = BSLAM_R(0.7);
    const bslam_candidate_t whole = measured(&camera, &panel, &size);
    size.height_m = BSLAM_R(1.0);  // as if a fifth of it were not seen
    const bslam_candidate_t headless = measured(&camera, &panel, &size);
    assert_true(whole.has_range && whole.marks == 0);
    assert_true(headless.has_bearing && !headless.has_range && headless.marks == BSLAM_MARK_MISPLACED);
}

/// Told how high it is below its neck, the same gives the distance of the body; a whole one is as before.
static void test_measure_takes_the_distance_of_the_body_where_the_neck_is_not_found(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panel = poster(3, 0, 0);
    bslam_size_t size = POSTER_SIZE;
    size.width_m = BSLAM_R(0.7);
    const bslam_candidate_t plain = measured(&camera, &panel, &size);
    size.body_m = BSLAM_R(0.64);
    const bslam_candidate_t whole = measured(&camera, &panel, &size);
    assert_true(memcmp(&whole, &plain, sizeof whole) == 0);
    size.height_m = BSLAM_R(1.0);
    size.body_m = BSLAM_R(0.8);
    const bslam_candidate_t headless = measured(&camera, &panel, &size);
    assert_true(headless.has_range && headless.marks == 0);
    assert_near(headless.range_m, 3, 0.03);
    size.top_low_m = size.top_high_m = BSLAM_R(1.7);  // of the neck: the body ends at 1.5 m
    const bslam_candidate_t hung = measured(&camera, &panel, &size);
    assert_true(hung.has_range && hung.misplaced_sds < 1);
    assert_near(hung.range_m, 3, 0.03);
}

/// Where its looks leave open where it ends it is the lower side that is in doubt: a skirting, a shadow.
static void test_measure_trusts_the_upper_side_where_the_lower_one_is_not_the_objects(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    unit_panel_t panel = poster(3, 0, 0);
    panel.low_m -= 0.1;
    bslam_size_t size = POSTER_SIZE;
    size.top_low_m = size.top_high_m = BSLAM_R(1.5);
    size.looks_sd = BSLAM_R(0.12);
    const bslam_candidate_t longer = measured(&camera, &panel, &size);
    assert_near(longer.range_m, 3, 0.12);  // by its height alone it would be 2.67
    assert_true(fabs((double)longer.range_m - 3) < (double)longer.range_sd_m);
}

static void test_measure_is_as_sure_of_a_distance_as_its_kinds_looks_allow(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panel = poster(3, 0, 0);
    bslam_size_t size = POSTER_SIZE;
    const bslam_candidate_t plain = measured(&camera, &panel, &size);
    size.looks_sd = BSLAM_R(0.08);
    const bslam_candidate_t rimmed = measured(&camera, &panel, &size);
    const double relative = (double)(plain.range_sd_m / plain.range_m);
    assert_near(rimmed.range_sd_m / rimmed.range_m, sqrt(relative * relative + 0.08 * 0.08), 1e-5);
}

static void test_measure_says_what_all_distances_share_by_the_kind_or_by_what_is_no_noise(void **state)
{
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t panel = poster(3, 0, 0);
    bslam_size_t size = POSTER_SIZE;
    size.looks_sd = BSLAM_R(0.08);
    const bslam_candidate_t by_error = measured(&camera, &panel, &size);
    const double all = (double)(by_error.range_sd_m / by_error.range_m);
    const double noise = (double)(by_error.range_noise_sd_m / by_error.range_m);
    assert_near(by_error.range_scale_sd, sqrt(all * all - noise * noise), 1e-5);
    size.scale_sd = BSLAM_R(0.03);
    assert_near(measured(&camera, &panel, &size).range_scale_sd, 0.03, 1e-7);
}

/// A board before the left two fifths of a poster: its middle is not that of what is seen.
static void test_measure_marks_what_is_half_hidden_and_gives_it_a_rough_direction(void **state)
{
    static unit_picture_t picture;
    const bslam_camera_t camera = unit_pinhole();
    const unit_panel_t seen = {3, 0.07, 3, -0.35, 0.7, 1.5, 60, 80, 150};
    const unit_panel_t panels[2] = {poster(3, 0, 0), {2.7, 0.5, 2.7, 0.063, 0, 1.9, 90, 130, 70}};
    unit_picture_draw(&picture, &camera, WALL, panels, COUNT_OF(panels));
    const bslam_box_t rough = box_of(&camera, &seen);
    bslam_size_t size = POSTER_SIZE;
    bslam_candidate_t blind, told;
    assert_int_equal(bslam_measure(&picture.frame, &camera, &rough, &size, &blind), BSLAM_OK);
    size.narrow_m = size.wide_m = BSLAM_R(0.7);
    assert_int_equal(bslam_measure(&picture.frame, &camera, &rough, &size, &told), BSLAM_OK);
    assert_int_equal(blind.marks, 0);
    assert_true(fabs((double)blind.bearing_rad) > 5 * (double)blind.bearing_sd_rad);  // the poster's is 0
    assert_int_equal(told.marks, BSLAM_MARK_HIDDEN);
    assert_true(told.has_bearing && fabs((double)told.bearing_rad) < 1.5 * (double)told.bearing_sd_rad);
    assert_near(told.bearing_sd_rad, 0.14 / 3, 0.008);
    assert_true(told.has_range && fabs((double)told.range_m - 3) < 3 * (double)told.range_sd_m);
    const unit_panel_t whole = poster(3, 0, 0.9);  // what is only seen obliquely is not
    assert_int_equal(measured(&camera, &whole, &size).marks, 0);
}

static void test_measure_marks_what_is_small(void **state)
{
    // 4.6 px wide and 46 px high; 69 px wide and 7.4 px high.
    const unit_panel_t thin = {3, 0.025, 3, -0.025, 0.9, 1.4, 60, 80, 150};
    const unit_panel_t flat = {3, 0.375, 3, -0.375, 0.9, 0.98, 60, 80, 150};
    const bslam_candidate_t narrow = measured_in(&thin, (bslam_box_t){157.2f, 36.4f, 161.8f, 82.6f});
    const bslam_candidate_t low = measured_in(&flat, (bslam_box_t){124.9f, 75.2f, 194.1f, 82.6f});
    assert_true((narrow.marks & BSLAM_MARK_SMALL) != 0 && !narrow.has_bearing && !narrow.has_range);
    assert_true((low.marks & BSLAM_MARK_SMALL) != 0 && !low.has_bearing && !low.has_range);
}

static void test_measure_marks_what_is_slanted(void **state)
{
    // A door-high panel seen at 70 degrees, large enough for its turn to be plain.
    const bslam_camera_t camera = unit_pinhole();
    const double x0 = 2.2, y0 = 0.7, x1 = 5.0, y1 = -0.32;
    const unit_panel_t panel = {x0, y0, x1, y1, 0.05, 1.2, 60, 80, 150};
    const bslam_size_t size = {.height_m = BSLAM_R(1.15)};
    const bslam_candidate_t candidate = measured(&camera, &panel, &size);
    assert_int_equal(candidate.marks, BSLAM_MARK_SLANTED);
    assert_true(!candidate.has_bearing && !candidate.has_range);
}

static void test_measure_refuses_bad_input_and_leaves_the_candidate(void **state)
{
    static unit_picture_t picture;
    bslam_camera_t camera = unit_pinhole();
    unit_picture_fill(&picture, 120, 130, 140);
    const bslam_box_t good = {100, 60, 160, 120};
    const bslam_box_t outside = {300, 60, 330, 120};
    bslam_candidate_t candidate;
    bslam_candidate_t before;
    memset(&candidate, 0x5A, sizeof candidate);
    memcpy(&before, &candidate, sizeof before);
    for (int edge = 0; edge < 4; edge++) {
        bslam_box_t bad = good;
        bslam_real_t *const edges[] = {&bad.left_px, &bad.top_px, &bad.right_px, &bad.bottom_px};
        *edges[edge] = real(NAN);
        assert_int_equal(bslam_measure(&picture.frame, &camera, &bad, &POSTER_SIZE, &candidate),
                         BSLAM_E_NOT_FINITE);
    }
    bslam_camera_t lower = camera;
    lower.height_px -= 8;  // not the frame's
    assert_int_equal(bslam_measure(&picture.frame, &lower, &good, &POSTER_SIZE, &candidate),
                     BSLAM_E_PARAMETER);
    assert_int_equal(bslam_measure(&picture.frame, &camera, &outside, &POSTER_SIZE, &candidate),
                     BSLAM_E_RANGE);
    const struct {
        double height_m, depth_m;
        bslam_status_t status;
    } sizes[] = {{NAN, 0, BSLAM_E_NOT_FINITE}, {1, NAN, BSLAM_E_NOT_FINITE}, {-1, 0, BSLAM_E_RANGE},
                 {11, 0, BSLAM_E_RANGE},       {1, -0.1, BSLAM_E_RANGE},     {1, 2.1, BSLAM_E_RANGE}};
    const struct {
        double low_m, high_m, looks_sd, scale_sd;
        bslam_status_t status;
    } bands[] = {{NAN, 1, 0, 0, BSLAM_E_NOT_FINITE}, {1, NAN, 0, 0, BSLAM_E_NOT_FINITE},
                 {1, 1, NAN, 0, BSLAM_E_NOT_FINITE}, {1, 1, 0, NAN, BSLAM_E_NOT_FINITE},
                 {2, 1, 0, 0, BSLAM_E_RANGE},        {-1, 1, 0, 0, BSLAM_E_RANGE},
                 {1, 11, 0, 0, BSLAM_E_RANGE},       {1, 1, -0.1, 0, BSLAM_E_RANGE},
                 {1, 1, 1.1, 0, BSLAM_E_RANGE},      {1, 1, 0, -0.1, BSLAM_E_RANGE},
                 {1, 1, 0, 1.1, BSLAM_E_RANGE}};
    for (int i = 0; i < COUNT_OF(bands); i++) {
        const bslam_size_t size = {.height_m = 1,
                                   .top_low_m = real(bands[i].low_m),
                                   .top_high_m = real(bands[i].high_m),
                                   .looks_sd = real(bands[i].looks_sd),
                                   .scale_sd = real(bands[i].scale_sd)};
        assert_int_equal(bslam_measure(&picture.frame, &camera, &good, &size, &candidate), bands[i].status);
    }
    for (int i = 0; i < COUNT_OF(sizes); i++) {
        const bslam_size_t size = {.height_m = real(sizes[i].height_m), .depth_m = real(sizes[i].depth_m)};
        assert_int_equal(bslam_measure(&picture.frame, &camera, &good, &size, &candidate), sizes[i].status);
    }
    const bslam_size_t inside_out = {
        .height_m = 1, .top_high_m = 1, .narrow_m = BSLAM_R(0.6), .wide_m = BSLAM_R(0.5)};
    assert_int_equal(bslam_measure(&picture.frame, &camera, &good, &inside_out, &candidate), BSLAM_E_RANGE);
    const bslam_size_t all_body = {.height_m = 1, .body_m = BSLAM_R(1.1)};
    assert_int_equal(bslam_measure(&picture.frame, &camera, &good, &all_body, &candidate), BSLAM_E_RANGE);
    const bslam_size_t no_body = {.height_m = 1, .body_m = real(NAN)};
    assert_int_equal(bslam_measure(&picture.frame, &camera, &good, &no_body, &candidate), BSLAM_E_NOT_FINITE);
    camera.width_px = 160;
    assert_int_equal(bslam_measure(&picture.frame, &camera, &good, &POSTER_SIZE, &candidate),
                     BSLAM_E_PARAMETER);
    assert_memory_equal(&candidate, &before, sizeof before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_measure_tells_direction_and_distance_of_a_known_object),
        cmocka_unit_test(test_measure_through_a_wide_turned_pitched_camera),
        cmocka_unit_test(test_measure_around_the_back_wraps_the_direction),
        cmocka_unit_test(test_measure_without_a_height_has_a_direction_only),
        cmocka_unit_test(test_measure_is_less_sure_of_what_is_farther_or_fainter),
        cmocka_unit_test(test_measure_marks_what_is_cut_off),
        cmocka_unit_test(test_measure_marks_what_goes_on_beyond_a_box_short_of_the_frames_edge),
        cmocka_unit_test(test_measure_of_what_is_cut_off_tells_roughly_where_its_middle_is),
        cmocka_unit_test(test_measure_of_what_ends_next_to_the_frames_edge_is_whole),
        cmocka_unit_test(test_measure_of_what_is_cut_off_and_of_unknown_height_tells_no_direction),
        cmocka_unit_test(test_measure_of_what_is_cut_off_on_both_sides_tells_no_direction),
        cmocka_unit_test(test_measure_marks_a_part),
        cmocka_unit_test(test_measure_of_a_front_with_its_flank_is_no_part),
        cmocka_unit_test(test_measure_of_a_front_as_wide_as_its_kind_is_no_part),
        cmocka_unit_test(test_measure_goes_by_the_colour_where_level_sides_are_pale),
        cmocka_unit_test(test_measure_follows_the_level_sides_to_where_a_thing_ends),
        cmocka_unit_test(test_measure_is_not_led_to_a_neighbour),
        cmocka_unit_test(test_measure_of_two_of_a_kind_goes_by_their_width),
        cmocka_unit_test(test_measure_of_a_part_that_goes_on_out_of_the_frame_is_marked),
        cmocka_unit_test(test_measure_takes_no_distance_of_what_hangs_elsewhere_than_its_kind),
        cmocka_unit_test(test_measure_is_less_sure_of_a_distance_whose_sides_contradict_each_other),
        cmocka_unit_test(test_measure_of_a_kind_with_a_known_place_survives_a_pale_rim),
        cmocka_unit_test(test_measure_takes_no_distance_where_height_and_width_contradict_each_other),
        cmocka_unit_test(test_measure_takes_the_distance_of_the_body_where_the_neck_is_not_found),
        cmocka_unit_test(test_measure_trusts_the_upper_side_where_the_lower_one_is_not_the_objects),
        cmocka_unit_test(test_measure_is_as_sure_of_a_distance_as_its_kinds_looks_allow),
        cmocka_unit_test(test_measure_says_what_all_distances_share_by_the_kind_or_by_what_is_no_noise),
        cmocka_unit_test(test_measure_marks_what_is_half_hidden_and_gives_it_a_rough_direction),
        cmocka_unit_test(test_measure_marks_what_is_small),
        cmocka_unit_test(test_measure_marks_what_is_slanted),
        cmocka_unit_test(test_measure_refuses_bad_input_and_leaves_the_candidate),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
