#include "support.h"

#include <math.h>

#include "blank_model.h"

#include "base/trig.h"
#include "vision/built_in/front_end.h"

#define WIDTH 320
#define HEIGHT 240
#define HORIZON 120

static unit_detector_t detector;
static bslam_beacon_model_t model;
static bslam_front_end_t vision;
static bslam_front_end_t before;
static uint8_t picture[HEIGHT][WIDTH][3];

static bslam_camera_t camera_at(double yaw_rad)
{
    const bslam_camera_t camera = {
        .lens = BSLAM_LENS_PINHOLE,
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .fx_px = BSLAM_R(277.1),
        .fy_px = BSLAM_R(277.1),
        .cx_px = BSLAM_R(159.5),
        .cy_px = BSLAM_R(HORIZON - 0.5),
        .yaw_rad = real(yaw_rad),
        .z_m = BSLAM_R(0.5),
    };
    return camera;
}

static int start(void **state)
{
    const bslam_camera_t cameras[2] = {camera_at(0.5), camera_at(-0.5)};
    model = unit_blank_model(&detector);
    // A cell is a beacon's if it differs from wall, floor and ceiling by more than 40 steps.
    detector.cell_weights[6] = 0.1f;
    detector.cell_bias = -4.0f;
    memset(&vision, 0, sizeof vision);
    assert_int_equal(bslam_front_end_init(&vision, &model, cameras, 2), BSLAM_OK);
    return 0;
}

static void paint(int left, int top, int right, int bottom, int red, int green, int blue)
{
    for (int row = top; row < bottom; row++) {
        for (int column = left; column < right; column++) {
            picture[row][column][0] = (uint8_t)red;
            picture[row][column][1] = (uint8_t)green;
            picture[row][column][2] = (uint8_t)blue;
        }
    }
}

/// Wall to row 180, floor below: 0.5 m below the camera, the floor ends 0.5 x 277.1 / 60.5 m away.
static void paint_room(void)
{
    paint(0, 0, WIDTH, 180, 160, 160, 150);
    paint(0, 180, WIDTH, HEIGHT, 90, 70, 60);
}

static bslam_status_t show(int camera, bool moved)
{
    assert_int_equal(bslam_front_end_begin(&vision, camera, BSLAM_PIXELS_RGB888, WIDTH, HEIGHT), BSLAM_OK);
    for (int row = 0; row < HEIGHT; row++) {
        assert_int_equal(bslam_front_end_row(&vision, picture[row]), BSLAM_OK);
    }
    return bslam_front_end_end(&vision, moved);
}

static int candidate_count(void)
{
    return vision.candidate_count;
}

// ---- refusals ---------------------------------------------------------------------------------------------

static void test_init_bad_count_camera_or_model_is_refused_and_nothing_changes(void **state)
{
    bslam_camera_t cameras[BSLAM_CAMERAS_MAX + 1];
    for (int i = 0; i <= BSLAM_CAMERAS_MAX; i++) {
        cameras[i] = camera_at(0);
    }
    before = vision;
    assert_int_equal(bslam_front_end_init(&vision, &model, cameras, 0), BSLAM_E_COUNT);
    assert_int_equal(bslam_front_end_init(&vision, &model, cameras, BSLAM_CAMERAS_MAX + 1), BSLAM_E_COUNT);
    cameras[1].fx_px = 0;
    assert_int_equal(bslam_front_end_init(&vision, &model, cameras, 2), BSLAM_E_PARAMETER);
    cameras[1] = camera_at(0);
    cameras[1].width_px = BSLAM_IMAGE_WIDTH_MAX + 4;
    assert_int_equal(bslam_front_end_init(&vision, &model, cameras, 2), BSLAM_E_RANGE);
    cameras[1] = camera_at(0);
    cameras[1].height_px = BSLAM_IMAGE_HEIGHT_MAX + 4;
    assert_int_equal(bslam_front_end_init(&vision, &model, cameras, 2), BSLAM_E_RANGE);
    model.class_count = 0;
    assert_int_equal(bslam_front_end_init(&vision, &model, cameras, 1), BSLAM_E_COUNT);
    assert_memory_equal(&vision, &before, sizeof vision);
}

static void test_begin_other_camera_or_size_is_refused_and_nothing_changes(void **state)
{
    paint_room();
    assert_int_equal(show(0, true), BSLAM_OK);
    before = vision;
    assert_int_equal(bslam_front_end_begin(&vision, -1, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT), BSLAM_E_RANGE);
    assert_int_equal(bslam_front_end_begin(&vision, 2, BSLAM_PIXELS_RGB565, WIDTH, HEIGHT), BSLAM_E_RANGE);
    assert_int_equal(bslam_front_end_begin(&vision, 0, BSLAM_PIXELS_RGB565, 160, HEIGHT), BSLAM_E_RANGE);
    assert_int_equal(bslam_front_end_begin(&vision, 0, BSLAM_PIXELS_RGB565, WIDTH, 120), BSLAM_E_RANGE);
    assert_int_equal(bslam_front_end_begin(&vision, 0, (bslam_pixel_format_t)7, WIDTH, HEIGHT),
                     BSLAM_E_RANGE);
    assert_memory_equal(&vision, &before, sizeof vision);
}

static void test_end_of_a_truncated_frame_is_refused_and_nothing_is_learned(void **state)
{
    paint_room();
    assert_int_equal(show(0, true), BSLAM_OK);
    paint(0, 0, WIDTH, HEIGHT, 200, 30, 30);
    assert_int_equal(bslam_front_end_begin(&vision, 0, BSLAM_PIXELS_RGB888, WIDTH, HEIGHT), BSLAM_OK);
    for (int row = 0; row < HEIGHT - 1; row++) {
        assert_int_equal(bslam_front_end_row(&vision, picture[row]), BSLAM_OK);
    }
    before = vision;
    assert_int_equal(bslam_front_end_end(&vision, true), BSLAM_E_COUNT);
    assert_memory_equal(&vision, &before, sizeof vision);
    assert_int_equal(vision.reason, BSLAM_VISION_UNFINISHED);
    assert_int_equal(candidate_count(), 0);

    // The next frame gives it up, and counts it.
    paint_room();
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_int_equal(vision.frames[BSLAM_VISION_UNFINISHED], 1);
}

static void test_end_without_a_frame_or_twice_is_refused(void **state)
{
    assert_int_equal(bslam_front_end_end(&vision, true), BSLAM_E_COUNT);
    paint_room();
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_int_equal(bslam_front_end_end(&vision, true), BSLAM_E_COUNT);
    assert_int_equal(bslam_front_end_row(&vision, picture[0]), BSLAM_E_COUNT);
}

static void test_point_wrong_camera_or_angle_is_refused(void **state)
{
    before = vision;
    assert_int_equal(bslam_front_end_point(&vision, -1, 0), BSLAM_E_RANGE);
    assert_int_equal(bslam_front_end_point(&vision, 2, 0), BSLAM_E_RANGE);
    assert_int_equal(bslam_front_end_point(&vision, 0, BSLAM_R(3.2)), BSLAM_E_RANGE);
    assert_int_equal(bslam_front_end_point(&vision, 0, real(NAN)), BSLAM_E_RANGE);
    assert_memory_equal(&vision, &before, sizeof vision);
    assert_int_equal(bslam_front_end_point(&vision, 1, BSLAM_R(1.25)), BSLAM_OK);
    assert_near(vision.cameras[1].yaw_rad, 1.25, 0);
}

// ---- frames that show nothing -----------------------------------------------------------------------------

static void check_unusable(bslam_vision_reason_t reason)
{
    static bslam_background_t background;
    background = vision.backgrounds[0];
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_int_equal(vision.reason, reason);
    assert_int_equal(vision.frames[reason], 1);
    assert_int_equal(candidate_count(), 0);
    assert_memory_equal(&vision.backgrounds[0], &background, sizeof background);
}

static void test_end_black_frame_shows_nothing_and_says_so(void **state)
{
    paint(0, 0, WIDTH, HEIGHT, 3, 3, 3);
    paint(10, 10, 20, 20, 255, 255, 255);
    check_unusable(BSLAM_VISION_BLACK);
}

static void test_end_overexposed_frame_shows_nothing_and_says_so(void **state)
{
    paint_room();
    paint(0, 0, WIDTH, 160, 255, 255, 255);
    check_unusable(BSLAM_VISION_OVEREXPOSED);
}

static void test_end_frame_of_one_colour_shows_nothing_and_says_so(void **state)
{
    paint(0, 0, WIDTH, HEIGHT, 180, 40, 60);
    check_unusable(BSLAM_VISION_FLAT);
}

static void test_end_empty_room_shows_nothing(void **state)
{
    detector.fusion_bias = -1;
    paint_room();
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_int_equal(vision.reason, BSLAM_VISION_NOTHING);
    assert_int_equal(vision.frames[BSLAM_VISION_NOTHING], 1);
}

// ---- the room and what stands out of it -------------------------------------------------------------------

static void test_end_learns_the_colours_of_wall_and_floor(void **state)
{
    paint_room();
    assert_int_equal(show(0, true), BSLAM_OK);
    const bslam_surroundings_t *room = &vision.backgrounds[0].surroundings;
    assert_true(room->known);
    assert_near(room->wall.red, 160, 1);
    assert_near(room->wall.green, 160, 1);
    assert_near(room->floor.red, 90, 2);  // five bits of red: steps of 8
    assert_near(room->floor.green, 70, 2);
}

static void test_end_floor_line_is_where_the_floor_ends(void **state)
{
    paint_room();
    assert_int_equal(show(0, true), BSLAM_OK);
    for (int column = 0; column < WIDTH / 4; column++) {
        assert_int_equal(vision.floor_line.row[column], 180 / 4 - 1);
    }
    // In the middle the floor's edge, row 179.5, lies 60 px below the axis.
    assert_near(vision.floor_line.distance_m[WIDTH / 8], 0.5 * 277.1 / 60.0, 0.01);
}

/// A skirting board is more like this floor than like the wall, and yet no floor.
static void test_end_floor_line_is_below_a_skirting_board_and_above_a_line_on_the_floor(void **state)
{
    paint_room();
    paint(0, 170, WIDTH, 180, 140, 90, 40);
    paint(0, 186, WIDTH, 188, 60, 45, 40);
    assert_int_equal(show(0, true), BSLAM_OK);
    for (int column = 0; column < WIDTH / 4; column++) {
        assert_int_equal(vision.floor_line.edge_px[column], 180);
    }
}

static void test_end_unmoved_robot_learns_nothing_but_in_the_first_frame(void **state)
{
    static bslam_background_t background;
    paint_room();
    assert_int_equal(show(0, false), BSLAM_OK);
    assert_true(vision.backgrounds[0].surroundings.known);
    background = vision.backgrounds[0];
    paint(0, 0, WIDTH, 180, 60, 90, 160);
    assert_int_equal(show(0, false), BSLAM_OK);
    assert_memory_equal(&vision.backgrounds[0], &background, sizeof background);
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_memory_not_equal(&vision.backgrounds[0], &background, sizeof background);
}

static void test_end_each_camera_remembers_its_own_view(void **state)
{
    static bslam_background_t background;
    paint_room();
    assert_int_equal(show(0, true), BSLAM_OK);
    background = vision.backgrounds[0];
    paint(0, 0, WIDTH, 180, 60, 90, 160);
    assert_int_equal(show(1, true), BSLAM_OK);
    assert_memory_equal(&vision.backgrounds[0], &background, sizeof background);
    assert_near(vision.backgrounds[1].surroundings.wall.blue, 160, 1);
}

static bslam_real_t best_overlap(double left, double top, double right, double bottom)
{
    const bslam_box_t truth = {real(left), real(top), real(right), real(bottom)};
    bslam_real_t best = 0;
    for (int i = 0; i < vision.proposals.count; i++) {
        const bslam_real_t overlap = bslam_box_overlap(&vision.proposals.items[i].box, &truth);
        best = overlap > best ? overlap : best;
    }
    return best;
}

static void test_end_coloured_rectangle_on_a_wall_is_proposed(void **state)
{
    paint_room();
    paint(100, 60, 140, 100, 200, 30, 30);
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_true(best_overlap(99.5, 59.5, 139.5, 99.5) > BSLAM_R(0.9));
}

static void test_end_rectangle_off_the_grid_of_cells_is_proposed_to_the_pixel(void **state)
{
    paint_room();
    paint(102, 61, 145, 103, 200, 30, 30);
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_true(best_overlap(101.5, 60.5, 144.5, 102.5) > BSLAM_R(0.85));
}

static void test_end_rectangle_moved_by_cells_moves_its_box(void **state)
{
    paint_room();
    paint(100, 60, 140, 100, 200, 30, 30);
    assert_int_equal(show(0, true), BSLAM_OK);
    const bslam_real_t first = best_overlap(99.5, 59.5, 139.5, 99.5);
    paint_room();
    paint(148, 44, 188, 84, 200, 30, 30);
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_near(best_overlap(147.5, 43.5, 187.5, 83.5), first, 0.02);
}

static void test_end_brighter_light_gives_the_same_boxes(void **state)
{
    paint(0, 0, WIDTH, 180, 112, 112, 104);
    paint(0, 180, WIDTH, HEIGHT, 64, 48, 40);
    paint(100, 60, 140, 100, 120, 24, 24);
    assert_int_equal(show(0, true), BSLAM_OK);
    const bslam_real_t dim = best_overlap(99.5, 59.5, 139.5, 99.5);
    assert_true(dim > BSLAM_R(0.9));
    paint(0, 0, WIDTH, 180, 224, 224, 208);
    paint(0, 180, WIDTH, HEIGHT, 128, 96, 80);
    paint(100, 60, 140, 100, 240, 48, 48);
    assert_int_equal(show(1, true), BSLAM_OK);
    assert_near(best_overlap(99.5, 59.5, 139.5, 99.5), dim, 0.02);
}

/// How many boxes of a grey square on a wall the last segmentation finds; all that it finds are the square's.
static int washed_out_boxes(int grey)
{
    paint(0, 0, WIDTH, 180, 220, 220, 220);
    paint(0, 180, WIDTH, HEIGHT, 90, 70, 60);
    paint(100, 60, 140, 100, grey, grey, grey);
    assert_int_equal(show(0, true), BSLAM_OK);
    const bslam_box_t square = {BSLAM_R(99.5), BSLAM_R(59.5), BSLAM_R(139.5), BSLAM_R(99.5)};
    int boxes = 0;
    for (int i = 0; i < vision.proposals.count; i++) {
        const bslam_proposal_t *item = &vision.proposals.items[i];
        if (item->segmentation == BSLAM_SEGMENTATIONS - 1) {
            assert_true(bslam_box_overlap(&item->box, &square) > BSLAM_R(0.9));
            boxes++;
        }
    }
    return boxes;
}

/// Light from outside washes a window out: it is no beacon's colour, and its sides hardly step.
static void test_end_what_is_washed_out_is_proposed(void **state)
{
    detector.cell_weights[6] = 0;  // no cell is a beacon's
    assert_int_equal(washed_out_boxes(228), 1);
    assert_int_equal(washed_out_boxes(205), 0);
}

static void test_end_candidates_come_surest_first(void **state)
{
    detector.fusion_weights[UNIT_MODEL_CLASSES + 2] = 1;  // the screen's value
    detector.screen_weights[5] = 1;                       // log of the area: the largest box is the surest
    paint_room();
    detector.kind_bias[2] = 1;  // of the kind that is 18 px high here
    paint(100, 60, 124, 80, 200, 30, 30);
    paint(220, 60, 252, 84, 30, 160, 30);
    assert_int_equal(show(0, true), BSLAM_OK);
    const int32_t count = vision.candidate_count;
    const bslam_candidate_t *found = vision.candidates;
    assert_true(count >= 2 && count <= BSLAM_CANDIDATES_MAX);
    assert_int_equal(vision.reason, BSLAM_VISION_SEEN);
    for (int i = 0; i < count; i++) {
        assert_true(i == 0 || found[i].score <= found[i - 1].score);
        assert_in_range(found[i].beacon_class, 1, UNIT_MODEL_CLASSES);
    }
}

/// All that is proposed is a candidate, the largest box first.
static void take_all(int class_count)
{
    detector.fusion_weights[class_count + 2] = 1;
    detector.screen_weights[5] = 1;
}

static const bslam_candidate_t *found_in(bslam_status_t shown, int32_t *count)
{
    assert_int_equal(shown, BSLAM_OK);
    *count = vision.candidate_count;
    assert_true(*count > 0);
    return vision.candidates;
}

static void start_with(const bslam_camera_t *camera)
{
    assert_int_equal(bslam_front_end_init(&vision, &model, camera, 1), BSLAM_OK);
}

static void test_end_of_a_model_of_one_kind_there_is_no_second(void **state)
{
    // That it is of its kind is as unlikely as can be, and it hangs where no such thing does.
    const bslam_beacon_class_t kind = {.name = "small", .height_m = 0.3f, .top_low_m = 2, .top_high_m = 2.1f};
    const bslam_camera_t camera = camera_at(0);
    bslam_detector_model_t *lenses[] = {&model.pinhole, &model.wide};
    model.class_count = 1;
    model.classes = &kind;
    detector.kind_bias[1] = -1000;
    for (int i = 0; i < 2; i++) {
        lenses[i]->kinds.rows = 1 + 2;
        lenses[i]->fusion.features = 1 + 3;
        lenses[i]->close.rows = 1 + 2;
        lenses[i]->verdict.features = 1 + 4;
    }
    take_all(1);
    start_with(&camera);
    paint_room();
    paint(100, 60, 140, 100, 200, 30, 30);
    int32_t count;
    const bslam_candidate_t *found = found_in(show(0, true), &count);
    for (int i = 0; i < count; i++) {
        assert_int_equal(found[i].beacon_class, 1);
        assert_int_equal(found[i].second_class, BSLAM_CLASS_NONE);
    }
    assert_true(found->misplaced_sds > 2);
}

/// What hangs too high for its kind becomes the next one, which hangs there, if it can be measured as that.
static void test_end_candidate_becomes_its_second_kind_where_that_can_be_measured(void **state)
{
    bslam_beacon_class_t kinds[UNIT_MODEL_CLASSES] = {
        {.name = "tall", .height_m = 0.33f, .top_low_m = 1.9f, .top_high_m = 2.1f},
        {.name = "small", .height_m = 0.3f, .top_low_m = 0.9f, .top_high_m = 1.0f}};
    const bslam_camera_t camera = camera_at(0);
    model.classes = kinds;
    take_all(UNIT_MODEL_CLASSES);
    detector.kind_bias[1] = 0.5f;  // a little surer than the other
    paint_room();
    paint(140, 60, 180, 100, 200, 30, 30);  // 0.3 m high, 2.1 m away its top is at 0.95 m
    // A body that is deeper than twice its height is no upright thing.
    static const float depths_m[] = {0, 0.1f, 0.7f};
    for (int i = 0; i < COUNT_OF(depths_m); i++) {
        kinds[1].depth_m = depths_m[i];
        start_with(&camera);
        int32_t count;
        const bslam_candidate_t *found = found_in(show(0, true), &count);
        assert_int_equal(count, 1);
        assert_int_equal(found->beacon_class, i < 2 ? 2 : 1);
        assert_int_equal(found->second_class, i < 2 ? 1 : 2);
        assert_int_equal(found->has_range, i < 2);
    }
}

/// A candidate of two kinds, the first surer by so much; the other is a fifth higher, or of no known height.
static bslam_candidate_t found_with_margin(float margin, bool has_other_height)
{
    const bslam_beacon_class_t kinds[UNIT_MODEL_CLASSES] = {
        {.name = "one", .height_m = 0.3f}, {.name = "other", .height_m = has_other_height ? 0.36f : 0}};
    const bslam_camera_t camera = camera_at(0);
    model.classes = kinds;
    take_all(UNIT_MODEL_CLASSES);
    detector.kind_bias[1] = 2 * margin;  // of two machines, of which the other says nothing
    start_with(&camera);
    paint_room();
    paint(140, 60, 180, 100, 200, 30, 30);
    int32_t count;
    const bslam_candidate_t *found = found_in(show(0, true), &count);
    assert_int_equal(count, 1);
    assert_int_equal(found->beacon_class, 1);
    assert_near(found->class_margin, (double)margin, 1e-6);
    return *found;
}

/// Its distance is as open as its kind, and so is by what all its distances err alike.
static void test_end_distance_is_less_sure_where_the_kind_is(void **state)
{
    const bslam_candidate_t known = found_with_margin(0.1f, false);
    assert_true(known.has_range);
    const bslam_candidate_t sure = found_with_margin(1.1f, true);
    assert_true(sure.range_sd_m == known.range_sd_m && sure.range_scale_sd == known.range_scale_sd);
    bslam_real_t surer_sd_m = known.range_sd_m;
    for (int i = 0; i < 3; i++) {
        const double margin = 0.9 - 0.4 * i;
        const bslam_candidate_t found = found_with_margin((float)margin, true);
        const double odds = exp(-3.3 * margin), share = odds / (1 + odds);
        const double off = 0.2 * sqrt(share * (1 - share));
        assert_true(found.has_range && found.range_m == known.range_m);
        assert_true(found.range_sd_m > surer_sd_m);
        assert_near(found.range_sd_m / found.range_m, hypot((double)(known.range_sd_m / known.range_m), off),
                    0.1 * off);
        assert_near(found.range_scale_sd, hypot((double)known.range_scale_sd, off), 0.1 * off);
        assert_true(found.range_noise_sd_m == known.range_noise_sd_m);
        surer_sd_m = found.range_sd_m;
    }
}

/// What the frame cuts off on the right, of two kinds, the first surer by so much: 0.3 to 0.4 m wide; the
/// other so wide.
static bslam_candidate_t cut_with_margin(float margin, float other_m)
{
    const bslam_beacon_class_t kinds[UNIT_MODEL_CLASSES] = {
        {.name = "one", .height_m = 0.3f, .narrow_m = 0.3f, .wide_m = 0.4f},
        {.name = "other", .height_m = 0.3f, .narrow_m = other_m, .wide_m = other_m}};
    const bslam_camera_t camera = camera_at(0);
    model.classes = kinds;
    take_all(UNIT_MODEL_CLASSES);
    detector.kind_bias[1] = 2 * margin;
    start_with(&camera);
    paint_room();
    paint(290, 60, 320, 100, 200, 30, 30);
    int32_t count;
    const bslam_candidate_t *found = found_in(show(0, true), &count);
    assert_int_equal(found->beacon_class, 1);
    assert_true(found->has_bearing && (found->marks & BSLAM_MARK_CUT_RIGHT) != 0);
    return *found;
}

/// It may be the other kind, and then goes on as far as that does: its direction is the mean of both.
static void test_end_direction_of_what_is_cut_off_is_less_sure_where_the_kind_is(void **state)
{
    const bslam_candidate_t narrow = cut_with_margin(30, 0);  // of the other's width nothing is known
    const bslam_candidate_t wide = cut_with_margin(0, 1.5f);
    assert_true(wide.bearing_rad < narrow.bearing_rad - 0.05f);
    assert_true(wide.bearing_sd_rad > 0.05f && wide.bearing_sd_rad > 2 * narrow.bearing_sd_rad);
    const bslam_candidate_t surer = cut_with_margin(1, 1.5f);
    assert_true(surer.bearing_rad > wide.bearing_rad && surer.bearing_rad < narrow.bearing_rad);
    assert_true(surer.bearing_sd_rad < wide.bearing_sd_rad);
    const double odds = exp(-1.2), chance = odds / (1 + odds);
    assert_near((double)(narrow.bearing_rad - surer.bearing_rad),
                2 * chance * (double)(narrow.bearing_rad - wide.bearing_rad), 0.005);
}

/// Whether a candidate's outline is the box of a proposal, as the detector had it.
static bool is_of_the_detector(const bslam_candidate_t *candidate)
{
    bool is = false;
    for (int i = 0; i < vision.proposals.count; i++) {
        is = is || memcmp(&vision.proposals.items[i].box, &candidate->outline, sizeof(bslam_box_t)) == 0;
    }
    return is;
}

/// Overlap of a candidate's outline with the proposal that is nearest to it.
static bslam_real_t overlap_of(const bslam_candidate_t *candidate)
{
    bslam_real_t best = 0;
    for (int i = 0; i < vision.proposals.count; i++) {
        const bslam_real_t overlap = bslam_box_overlap(&vision.proposals.items[i].box, &candidate->outline);
        best = overlap > best ? overlap : best;
    }
    return best;
}

static void test_end_outline_is_the_measured_one_but_through_a_wide_lens_the_detector_s(void **state)
{
    take_all(UNIT_MODEL_CLASSES);
    for (int is_wide = 0; is_wide < 2; is_wide++) {
        bslam_camera_t camera = camera_at(0);
        camera.lens = is_wide ? BSLAM_LENS_EQUIDISTANT : BSLAM_LENS_PINHOLE;
        camera.fx_px = camera.fy_px = is_wide ? BSLAM_R(101.9) : camera.fx_px;
        start_with(&camera);
        paint_room();
        paint(142, 61, 181, 103, 200, 30, 30);
        int32_t count;
        const bslam_candidate_t *found = found_in(show(0, true), &count);
        assert_int_equal(is_of_the_detector(found), is_wide);
    }
}

/// Measuring takes the blue square for the thing, not the rim round it that hardly differs from the wall.
static void test_end_outline_of_something_else_is_not_taken(void **state)
{
    const bslam_camera_t camera = camera_at(0);
    const bslam_size_t size = {.height_m = 0.3f};
    take_all(UNIT_MODEL_CLASSES);
    start_with(&camera);
    paint_room();
    paint(140, 60, 160, 80, 144, 144, 166);
    paint(142, 62, 158, 78, 10, 10, 200);
    int32_t count;
    const bslam_candidate_t *found = found_in(show(0, true), &count);
    int others = 0;
    for (int i = 0; i < count; i++) {
        assert_true(overlap_of(&found[i]) >= BSLAM_R(0.75));
        if (is_of_the_detector(&found[i])) {
            bslam_candidate_t measured = {0};
            assert_int_equal(bslam_front_end_measure(&vision, &found[i].outline, &size, &measured), BSLAM_OK);
            assert_true(bslam_box_overlap(&measured.outline, &found[i].outline) < BSLAM_R(0.75));
            others++;
        }
    }
    assert_true(others > 0);
}

/// A camera of half the size that is looked at doubled.
static bslam_camera_t small_camera(void)
{
    bslam_camera_t camera = camera_at(0.5);
    camera.width_px = WIDTH / 2;
    camera.height_px = HEIGHT / 2;
    camera.fx_px /= 2;
    camera.fy_px /= 2;
    camera.cx_px = (camera.cx_px - BSLAM_R(0.5)) / 2;
    camera.cy_px = (camera.cy_px - BSLAM_R(0.5)) / 2;
    camera.zoom = 2;
    return camera;
}

/// The same picture, of which each 2x2 pixels are alike, at half the size.
static bslam_status_t show_small(bslam_pixel_format_t format)
{
    uint8_t rgb[WIDTH / 2][3];
    uint16_t packed[WIDTH / 2];
    assert_int_equal(bslam_front_end_begin(&vision, 0, format, WIDTH / 2, HEIGHT / 2), BSLAM_OK);
    for (int row = 0; row < HEIGHT; row += 2) {
        for (int i = 0; i < WIDTH / 2; i++) {
            const uint8_t *pixel = picture[row][2 * i];
            memcpy(rgb[i], pixel, 3);
            packed[i] = (uint16_t)(pixel[0] >> 3 << 11 | pixel[1] >> 2 << 5 | pixel[2] >> 3);
        }
        const void *pixels = format == BSLAM_PIXELS_RGB888 ? (const void *)rgb : (const void *)packed;
        assert_int_equal(bslam_front_end_row(&vision, pixels), BSLAM_OK);
    }
    assert_int_equal(bslam_front_end_row(&vision, packed), BSLAM_E_COUNT);
    return bslam_front_end_end(&vision, true);
}

static void test_end_zoomed_camera_sees_what_a_doubled_picture_shows(void **state)
{
    detector.fusion_weights[UNIT_MODEL_CLASSES + 2] = 1;
    detector.screen_weights[5] = 1;
    detector.kind_bias[2] = 1;
    paint_room();
    paint(100, 60, 124, 80, 200, 30, 30);
    paint(220, 60, 252, 84, 30, 160, 30);
    assert_int_equal(show(0, true), BSLAM_OK);
    const int32_t wanted_count = vision.candidate_count;
    const bslam_candidate_t *found = vision.candidates;
    bslam_candidate_t wanted[BSLAM_CANDIDATES_MAX];
    memcpy(wanted, found, sizeof wanted);
    const bslam_box_t wanted_box = bslam_front_end_proposal_box(&vision, 0);
    const bslam_size_t size = {.height_m = 1};
    bslam_candidate_t wanted_one = {0};
    const bslam_box_t rough = {99, 59, 124, 80};
    assert_int_equal(bslam_front_end_measure(&vision, &rough, &size, &wanted_one), BSLAM_OK);

    const bslam_camera_t small = small_camera();
    for (int format = 0; format < 2; format++) {
        assert_int_equal(bslam_front_end_init(&vision, &model, &small, 1), BSLAM_OK);
        assert_int_equal(show_small((bslam_pixel_format_t)format), BSLAM_OK);
        const int32_t count = vision.candidate_count;
        assert_int_equal(count, wanted_count);
        assert_true(count >= 2);
        for (int i = 0; i < count; i++) {
            assert_near(2 * found[i].outline.left_px + BSLAM_R(0.5), wanted[i].outline.left_px, 1e-3);
            assert_near(2 * found[i].outline.bottom_px + BSLAM_R(0.5), wanted[i].outline.bottom_px, 1e-3);
            assert_near(found[i].bearing_rad, wanted[i].bearing_rad, 1e-5);
            assert_near(found[i].score, wanted[i].score, 1e-4);
        }
        assert_near(2 * bslam_front_end_proposal_box(&vision, 0).top_px + BSLAM_R(0.5), wanted_box.top_px,
                    1e-3);
        bslam_candidate_t one = {0};
        const bslam_box_t half = {BSLAM_R(49.25), BSLAM_R(29.25), BSLAM_R(61.75), BSLAM_R(39.75)};
        assert_int_equal(bslam_front_end_measure(&vision, &half, &size, &one), BSLAM_OK);
        assert_near(one.range_m, wanted_one.range_m, 1e-4);
        assert_near(2 * one.outline.right_px + BSLAM_R(0.5), wanted_one.outline.right_px, 1e-3);
    }
}

static void test_init_zoom_without_room_is_refused_and_nothing_changes(void **state)
{
    bslam_camera_t camera = camera_at(0);
    camera.zoom = 2;
    before = vision;
    assert_int_equal(bslam_front_end_init(&vision, &model, &camera, 1), BSLAM_E_RANGE);
    camera = small_camera();
    camera.height_px = BSLAM_IMAGE_HEIGHT_MAX / 2 + 4;
    assert_int_equal(bslam_front_end_init(&vision, &model, &camera, 1), BSLAM_E_RANGE);
    camera.zoom = BSLAM_ZOOM_MAX + 1;
    assert_int_equal(bslam_front_end_init(&vision, &model, &camera, 1), BSLAM_E_PARAMETER);
    camera.zoom = -1;
    assert_int_equal(bslam_front_end_init(&vision, &model, &camera, 1), BSLAM_E_PARAMETER);
    assert_memory_equal(&vision, &before, sizeof vision);
}

static void test_end_same_frames_give_the_same_state(void **state)
{
    paint_room();
    paint(100, 60, 140, 100, 200, 30, 30);
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_int_equal(show(0, true), BSLAM_OK);
    before = vision;
    (void)start(state);
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_int_equal(show(0, true), BSLAM_OK);
    assert_memory_equal(vision.thumbnail.notes.values, before.thumbnail.notes.values,
                        sizeof vision.thumbnail.notes.values);
    assert_int_equal(vision.proposals.count, before.proposals.count);
    for (int i = 0; i < vision.proposals.count; i++) {
        const bslam_box_t *box = &vision.proposals.items[i].box, *other = &before.proposals.items[i].box;
        assert_memory_equal(box, other, sizeof *box);
    }
}

enum { LIGHT, SPREAD, STEP_X, LIKELY, FLOOR, MEANS };

/// Sums over a zone of a box, cell by cell, every other row if there are more than 16; adds them to `sums`,
/// returns how many cells.
static int plain_zone(const bslam_proposal_t *box, int zone, double sums[MEANS])
{
    const int width = box->right - box->left, height = box->bottom - box->top;
    const int left = box->left + zone % 3 * width / 3, right = box->left + (zone % 3 + 1) * width / 3;
    const int top = box->top + zone / 3 * height / 3, bottom = box->top + (zone / 3 + 1) * height / 3;
    const int stride = (right - left) * (bottom - top) > 16 ? 2 : 1;
    int cells = 0;
    for (int row = top; row < bottom; row += stride) {
        for (int i = row * (WIDTH / 4) + left; i < row * (WIDTH / 4) + right; i++) {
            const bslam_tone_t tone = bslam_tone_at(&vision.tones, i);
            const int seen = vision.backgrounds[0].counts[BSLAM_ZONE_FLOOR][bslam_tone_bin(tone)];
            sums[LIGHT] += tone.light;
            sums[SPREAD] += tone.spread;
            sums[STEP_X] += vision.step_x[i];
            sums[LIKELY] += vision.thumbnail.notes.values[i] > 0 ? 1 : 0;
            sums[FLOOR] += seen < BSLAM_FREQUENT_MAX ? seen : BSLAM_FREQUENT_MAX;
            cells++;
        }
    }
    return cells;
}

/// The zones and the texture of boxes of all sizes, summed many cells at a time, against cell by cell.
static void test_blob_features_are_means_over_the_cells(void **state)
{
    enum { TEXTURE = 47, ZONE_MIDDLE = 62 + 2 * 4 };  // where these features begin
    unit_random_t random = {9};
    for (int row = 0; row < HEIGHT; row++) {
        for (int column = 0; column < WIDTH; column++) {
            for (int channel = 0; channel < 3; channel++) {
                picture[row][column][channel] = (uint8_t)unit_random(&random, 40, 60 + row / 2);
            }
        }
    }
    for (int i = 0; i < BSLAM_CELL_FEATURES; i++) {
        detector.cell_weights[i] = (float)unit_random(&random, -0.02, 0.02);
    }
    const bslam_camera_t camera = camera_at(0);
    assert_int_equal(bslam_front_end_init(&vision, &model, &camera, 1), BSLAM_OK);
    assert_int_equal(show(0, true), BSLAM_OK);
    for (int k = 0; k < 200; k++) {
        const int width = (int)unit_random(&random, 2, WIDTH / 4),
                  height = (int)unit_random(&random, 2, HEIGHT / 4);
        const int left = (int)unit_random(&random, 0, WIDTH / 4 - width);
        const int top = (int)unit_random(&random, 0, HEIGHT / 4 - height);
        const bslam_proposal_t box = {
            .left = (int16_t)left,
            .top = (int16_t)top,
            .right = (int16_t)(left + width),
            .bottom = (int16_t)(top + height),
            .cells = (uint16_t)(width * height),
            .box = {real(4 * left), real(4 * top), real(4 * (left + width)), real(4 * (top + height))}};
        float features[BSLAM_BLOB_FEATURES];
        vision.proposals.items[0] = box;
        bslam_front_end_blob_features(&vision, 0, features);
        double sums[MEANS] = {0}, middle[MEANS] = {0};
        int cells = 0;
        for (int zone = 0; zone < 9; zone++) {
            cells += plain_zone(&box, zone, sums);
        }
        const int of_middle = plain_zone(&box, 4, middle);
        const double light = sums[LIGHT] / cells;
        assert_near(features[TEXTURE], light - vision.backgrounds[0].tone[BSLAM_ZONE_WALL].light, 1e-4);
        assert_near(features[TEXTURE + 6], sums[LIKELY] / cells, 1e-5);
        assert_near(features[TEXTURE + 7], sums[SPREAD] / cells, 1e-4);
        assert_near(features[TEXTURE + 8], sums[STEP_X] / cells, 1e-4);
        assert_near(features[TEXTURE + 14], sums[FLOOR] / cells, 1e-4);
        assert_near(features[ZONE_MIDDLE], of_middle > 0 ? middle[LIGHT] / of_middle - light : 0, 1e-4);
    }
}

static void test_end_noise_keeps_within_all_bounds(void **state)
{
    unit_random_t random = {5};
    for (int frame = 0; frame < 3; frame++) {
        for (int row = 0; row < HEIGHT; row++) {
            for (int column = 0; column < WIDTH; column++) {
                for (int channel = 0; channel < 3; channel++) {
                    picture[row][column][channel] = (uint8_t)unit_random(&random, 0, 256);
                }
            }
        }
        // Blocks of noise, so that cells differ as much as they can.
        for (int row = 0; row < HEIGHT; row++) {
            for (int column = 0; column < WIDTH; column++) {
                memcpy(picture[row][column], picture[row / 4 * 4][column / 4 * 4], 3);
            }
        }
        assert_int_equal(show(frame % 2, true), BSLAM_OK);
        assert_in_range(vision.proposals.count, 0, BSLAM_PROPOSALS_MAX);
        assert_in_range(candidate_count(), 0, BSLAM_CANDIDATES_MAX);
        for (int i = 0; i < vision.proposals.count; i++) {
            float features[BSLAM_BLOB_FEATURES];
            bslam_front_end_blob_features(&vision, i, features);
            for (int k = 0; k < BSLAM_BLOB_FEATURES; k++) {
                assert_true(features[k] > -1e6f && features[k] < 1e6f);
            }
        }
    }
}

#define TEST(name) cmocka_unit_test_setup(name, start)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(test_init_bad_count_camera_or_model_is_refused_and_nothing_changes),
        TEST(test_begin_other_camera_or_size_is_refused_and_nothing_changes),
        TEST(test_end_of_a_truncated_frame_is_refused_and_nothing_is_learned),
        TEST(test_end_without_a_frame_or_twice_is_refused),
        TEST(test_point_wrong_camera_or_angle_is_refused),
        TEST(test_end_black_frame_shows_nothing_and_says_so),
        TEST(test_end_overexposed_frame_shows_nothing_and_says_so),
        TEST(test_end_frame_of_one_colour_shows_nothing_and_says_so),
        TEST(test_end_empty_room_shows_nothing),
        TEST(test_end_learns_the_colours_of_wall_and_floor),
        TEST(test_end_floor_line_is_where_the_floor_ends),
        TEST(test_end_floor_line_is_below_a_skirting_board_and_above_a_line_on_the_floor),
        TEST(test_end_unmoved_robot_learns_nothing_but_in_the_first_frame),
        TEST(test_end_each_camera_remembers_its_own_view),
        TEST(test_end_coloured_rectangle_on_a_wall_is_proposed),
        TEST(test_end_rectangle_off_the_grid_of_cells_is_proposed_to_the_pixel),
        TEST(test_end_rectangle_moved_by_cells_moves_its_box),
        TEST(test_end_brighter_light_gives_the_same_boxes),
        TEST(test_end_what_is_washed_out_is_proposed),
        TEST(test_end_candidates_come_surest_first),
        TEST(test_end_of_a_model_of_one_kind_there_is_no_second),
        TEST(test_end_candidate_becomes_its_second_kind_where_that_can_be_measured),
        TEST(test_end_direction_of_what_is_cut_off_is_less_sure_where_the_kind_is),
        TEST(test_end_distance_is_less_sure_where_the_kind_is),
        TEST(test_end_outline_is_the_measured_one_but_through_a_wide_lens_the_detector_s),
        TEST(test_end_outline_of_something_else_is_not_taken),
        TEST(test_end_zoomed_camera_sees_what_a_doubled_picture_shows),
        TEST(test_init_zoom_without_room_is_refused_and_nothing_changes),
        TEST(test_end_same_frames_give_the_same_state),
        TEST(test_blob_features_are_means_over_the_cells),
        TEST(test_end_noise_keeps_within_all_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
