#include "support.h"

#include <math.h>

#include "picture.h"

#include "vision/built_in/gyro/frame_rotation.h"

// What is seen: posts before a wall, in a ring around the start, or in two.
#define POSTS 40
#define RING_M 4.0
#define NEAR_RING_M 1.6
#define TURN_FULL_RAD (2 * 3.14159265358979)

/// How far away a post of a direction from the start stands.
typedef double (*ring_of_t)(double direction_rad);

static double one_ring(double direction_rad)
{
    (void)direction_rad;
    return RING_M;
}

/// Five sectors of seven posts or so; every second one is near.
static double two_rings(double direction_rad)
{
    const double turns = direction_rad / TURN_FULL_RAD;
    return (int)(10 * (turns - floor(turns))) % 2 == 0 ? NEAR_RING_M : RING_M;
}

static bslam_front_end_t vision;
static bslam_turns_t turns;
static unit_picture_t picture;

static int start(void **state)
{
    memset(&vision, 0, sizeof vision);
    vision.camera_count = 2;
    vision.cameras[0] = vision.cameras[1] = unit_pinhole();
    bslam_turns_init(&turns, &vision);
    return 0;
}

/// What a camera sees from a pose of the robot, which has gone straight ahead from the start.
static void draw(ring_of_t ring_of, int camera, double x_m, double theta_rad)
{
    static const double wall[3] = {150, 150, 150};
    unit_panel_t posts[POSTS];
    for (int i = 0; i < POSTS; i++) {
        const double from_rad = TURN_FULL_RAD * (i + 0.3 * (i % 3)) / POSTS,
                     to_rad = from_rad + 0.03 + 0.01 * (i % 4), ring_m = ring_of(from_rad);
        const double ends[2][2] = {{ring_m * cos(from_rad) - x_m, ring_m * sin(from_rad)},
                                   {ring_m * cos(to_rad) - x_m, ring_m * sin(to_rad)}};
        const double c = cos(theta_rad), s = sin(theta_rad), grey = 110 + 20 * (i % 5);
        posts[i] = (unit_panel_t){.x0_m = c * ends[0][0] + s * ends[0][1],
                                  .y0_m = c * ends[0][1] - s * ends[0][0],
                                  .x1_m = c * ends[1][0] + s * ends[1][1],
                                  .y1_m = c * ends[1][1] - s * ends[1][0],
                                  .low_m = 0,
                                  .high_m = 2.5,
                                  .red = grey,
                                  .green = grey,
                                  .blue = 250 - grey};
    }
    unit_picture_draw(&picture, &vision.cameras[camera], wall, posts, POSTS);
    memcpy(vision.thumbnail.half, picture.half, sizeof picture.half);
    vision.camera = camera;
    vision.reason = BSLAM_VISION_NOTHING;
}

/// How far it is from x_m on the first axis to a ring, in a direction.
static double ring_from(double ring_m, double x_m, double direction_rad, double *at_rad)
{
    const double across_m = x_m * sin(direction_rad);
    const double along_m = sqrt(ring_m * ring_m - across_m * across_m) - x_m * cos(direction_rad);
    *at_rad = atan2(along_m * sin(direction_rad), x_m + along_m * cos(direction_rad));
    return along_m;
}

/// The floor line as it is where each ring stands.
static void tell_floor(ring_of_t ring_of, int camera, double x_m, double theta_rad)
{
    const bslam_camera_t *level = &vision.cameras[camera];
    for (int i = 0; i < BSLAM_COLUMNS_MAX; i++) {
        const double right = (BSLAM_CELL_PX * i + 1.5 - (double)level->cx_px) / (double)level->fx_px;
        const double direction_rad = theta_rad + (double)level->yaw_rad - atan(right);
        double at_rad = 0;
        const double near_m = ring_from(NEAR_RING_M, x_m, direction_rad, &at_rad);
        const bool is_near = ring_of(at_rad) < RING_M;
        vision.floor_line.distance_m[i] =
            real(is_near ? near_m : ring_from(RING_M, x_m, direction_rad, &at_rad));
    }
}

/// The same, and a floor line that says that all is where the ring is.
static void look(int camera, double x_m, double theta_rad)
{
    draw(one_ring, camera, x_m, theta_rad);
    for (int i = 0; i < BSLAM_COLUMNS_MAX; i++) {
        vision.floor_line.distance_m[i] = real(RING_M);
    }
}

static bslam_turn_t turn_seen(void)
{
    bslam_turn_t turn;
    assert_true(bslam_turns_see(&turns, &vision, &turn));
    return turn;
}

static bool sees_no_turn(void)
{
    bslam_turn_t turn = {.turn_rad = 7};
    const bool found = bslam_turns_see(&turns, &vision, &turn);
    return !found && turn.turn_rad == 7;
}

static void test_see_a_turn_is_measured_to_a_part_of_a_column(void **state)
{
    static const double turned_rad[] = {0.0, 0.004, -0.0131, 0.05, -0.12};
    for (int i = 0; i < COUNT_OF(turned_rad); i++) {
        start(state);
        look(0, 0, 0.3);
        assert_true(sees_no_turn());  // nothing before
        look(0, 0, 0.3 + turned_rad[i]);
        const bslam_turn_t turn = turn_seen();
        assert_near((double)turn.turn_rad, turned_rad[i], 0.001);
        assert_true(turn.mismatch < BSLAM_R(0.1));
        assert_true(turn.variance_rad2 > 0 && turn.variance_rad2 < BSLAM_R(1e-4));
    }
}

static void test_see_through_a_fisheye(void **state)
{
    vision.cameras[0] = unit_equidistant();
    bslam_turns_init(&turns, &vision);
    look(0, 0, 0);
    assert_true(sees_no_turn());
    look(0, 0, 0.1);
    assert_near((double)turn_seen().turn_rad, 0.1, 0.002);
}

static void test_see_driving_by_is_told_as_parallax(void **state)
{
    vision.cameras[0].yaw_rad = BSLAM_R(1.1);
    look(0, 0, 0);
    assert_true(sees_no_turn());
    look(0, 0.08, 0.01);
    const bslam_turn_t turn = turn_seen();
    assert_near((double)(turn.turn_rad + turn.parallax_rad_per_m * BSLAM_R(0.08)), 0.01, 0.0015);
    assert_near((double)turn.parallax_rad_per_m, sin(1.1) / RING_M, 0.03);
    // Each window of a dozen or more errs by 0.1/m, by itself.
    const double alike = (double)turn.parallax_sd_rad_per_m / (sin(1.1) * 0.1);
    assert_true(alike > 0.2 && alike < 0.6);
}

/// Drives on, a twentieth of a metre from frame to frame, and looks at what stands in two rings. Returns the
/// largest error of a turn, to whoever knows the way, once a few frames have told about how far it is.
static double worst_error_rad(double yaw_rad, bool is_told)
{
    enum { FRAMES = 8, FIRST = 4 };
    const double travelled_m = 0.05, turned_rad = 0.006;
    vision.cameras[0].yaw_rad = real(yaw_rad);
    double worst_rad = 0;
    for (int i = 0; i < FRAMES; i++) {
        look(0, 0, 0);
        draw(two_rings, 0, travelled_m * i, turned_rad * i);
        if (is_told) {
            tell_floor(two_rings, 0, travelled_m * i, turned_rad * i);
        }
        bslam_turn_t turn;
        if (bslam_turns_see(&turns, &vision, &turn) && i >= FIRST) {
            const double error_rad =
                (double)turn.turn_rad + (double)turn.parallax_rad_per_m * travelled_m - turned_rad;
            worst_rad = fmax(worst_rad, fabs(error_rad));
        }
    }
    return worst_rad;
}

/// What is near goes by faster than what is far: each column is shifted by its own, which tells the way, too.
static void test_see_near_and_far_things_side_by_side(void **state)
{
    assert_true(worst_error_rad(0, true) < 0.0018);
    assert_near((double)turns.way.travelled_m, 0.05, 0.005);
    start(state);
    assert_true(worst_error_rad(0.8, true) < 0.0012);
    assert_near((double)turns.way.travelled_m, 0.05, 0.01);
}

/// Ahead, a floor line that is wrong about half of what is seen does little harm.
static void test_see_things_that_the_floor_line_does_not_know(void **state)
{
    (void)state;
    assert_true(worst_error_rad(0, false) < 0.003);
}

/// A robot that turns a little to and fro where it stands.
static void test_see_the_way_of_a_robot_that_stands_is_none(void **state)
{
    (void)state;
    for (int i = 0; i < 30; i++) {
        look(0, 0, 0.004 * (i % 3));
        bslam_turn_t turn;
        assert_int_equal(bslam_turns_see(&turns, &vision, &turn), i > 0);
    }
    assert_near((double)turns.way.travelled_m, 0, 0.002);
}

static void hide_the_floor(void)
{
    for (int i = 0; i < BSLAM_COLUMNS_MAX; i++) {
        vision.floor_line.distance_m[i] = 0;
        vision.floor_line.edge_px[i] = (int16_t)vision.cameras[0].height_px;
    }
}

/// A camera that sees no floor anywhere says nothing of how near things are, and that it does not know it.
static void test_see_without_a_floor_little_is_known(void **state)
{
    vision.cameras[0].yaw_rad = BSLAM_R(1.1);
    vision.cameras[0].z_m = 0;
    bslam_turns_init(&turns, &vision);
    look(0, 0, 0);
    assert_true(sees_no_turn());
    look(0, 0.08, 0.01);
    hide_the_floor();
    const bslam_turn_t turn = turn_seen();
    assert_near((double)turn.parallax_rad_per_m, sin(1.1) * 0.25, 0.02);
    const double alike = (double)turn.parallax_sd_rad_per_m / (sin(1.1) * 0.25);
    assert_true(alike > 0.2 && alike < 0.6);
}

/// No floor to the frame's lower edge: what hides it is nearer than the floor seen there otherwise.
static void test_see_what_hides_the_floor_is_near(void **state)
{
    vision.cameras[0].yaw_rad = BSLAM_R(1.1);
    const bslam_camera_t *camera = &vision.cameras[0];
    look(0, 0, 0);
    assert_true(sees_no_turn());
    look(0, 0.08, 0.01);
    hide_the_floor();
    const bslam_turn_t hidden = turn_seen();
    const double nearest_m =
        (double)(camera->z_m * camera->fy_px / ((bslam_real_t)camera->height_px - camera->cy_px));
    const double before_it = (double)hidden.parallax_rad_per_m / sin(1.1) * nearest_m;
    assert_true(before_it > 1.1 && before_it < 1.5);
    assert_true((double)hidden.parallax_sd_rad_per_m > 0.2 * 0.33 * (double)hidden.parallax_rad_per_m);
}

static void test_see_a_camera_that_turned_on_its_own_is_no_turn_of_the_robot(void **state)
{
    look(0, 0, 0);
    assert_true(sees_no_turn());
    vision.cameras[0].yaw_rad = BSLAM_R(0.08);
    look(0, 0, 0.02);
    assert_near((double)turn_seen().turn_rad, 0.02, 0.0007);
}

static void test_see_each_camera_has_its_own_frame_before(void **state)
{
    look(0, 0, 0);
    assert_true(sees_no_turn());
    look(1, 0, 0.03);
    assert_true(sees_no_turn());
    look(0, 0, 0.05);
    assert_near((double)turn_seen().turn_rad, 0.05, 0.0007);
    look(1, 0, 0.04);
    assert_near((double)turn_seen().turn_rad, 0.01, 0.0007);
}

static void test_see_a_plain_wall_tells_nothing(void **state)
{
    look(0, 0, 0);
    memset(vision.thumbnail.half, 0x55, sizeof vision.thumbnail.half);
    assert_true(sees_no_turn());
    assert_true(sees_no_turn());
}

static void test_see_what_is_nothing_like_the_frame_before_tells_nothing(void **state)
{
    look(0, 0, 0);
    assert_true(sees_no_turn());
    look(0, 0, 2.0);
    assert_true(sees_no_turn());
}

static void test_see_after_an_unusable_frame_it_starts_anew(void **state)
{
    look(0, 0, 0);
    assert_true(sees_no_turn());
    look(0, 0, 0.02);
    vision.reason = BSLAM_VISION_BLACK;
    assert_true(sees_no_turn());
    look(0, 0, 0.04);
    assert_true(sees_no_turn());
    look(0, 0, 0.05);
    assert_near((double)turn_seen().turn_rad, 0.01, 0.0007);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_see_a_turn_is_measured_to_a_part_of_a_column, start),
        cmocka_unit_test_setup(test_see_through_a_fisheye, start),
        cmocka_unit_test_setup(test_see_driving_by_is_told_as_parallax, start),
        cmocka_unit_test_setup(test_see_near_and_far_things_side_by_side, start),
        cmocka_unit_test_setup(test_see_things_that_the_floor_line_does_not_know, start),
        cmocka_unit_test_setup(test_see_the_way_of_a_robot_that_stands_is_none, start),
        cmocka_unit_test_setup(test_see_without_a_floor_little_is_known, start),
        cmocka_unit_test_setup(test_see_what_hides_the_floor_is_near, start),
        cmocka_unit_test_setup(test_see_a_camera_that_turned_on_its_own_is_no_turn_of_the_robot, start),
        cmocka_unit_test_setup(test_see_each_camera_has_its_own_frame_before, start),
        cmocka_unit_test_setup(test_see_a_plain_wall_tells_nothing, start),
        cmocka_unit_test_setup(test_see_what_is_nothing_like_the_frame_before_tells_nothing, start),
        cmocka_unit_test_setup(test_see_after_an_unusable_frame_it_starts_anew, start),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
