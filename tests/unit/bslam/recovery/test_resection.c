#include "support.h"

#include <math.h>

#include "bslam/recovery/resection.h"

static const double beacons[][2] = {{0, 0}, {4, 1}, {3, 6}, {-2, 5}, {6, 4}};

/// Beacon i from (x, y, theta), with or without its distance, by a sensor in the robot's middle.
static bslam_clue_t clue_of(int i, double x, double y, double theta, bool has_range)
{
    const double dx = beacons[i][0] - x;
    const double dy = beacons[i][1] - y;
    return (bslam_clue_t){.beacon = i,
                          .x_m = real(beacons[i][0]),
                          .y_m = real(beacons[i][1]),
                          .bearing_rad = real(atan2(dy, dx) - theta),
                          .range_m = real(hypot(dx, dy)),
                          .has_range = has_range,
                          .bearing_var_rad2 = real(1e-4),
                          .range_var_m2 = real(0.01)};
}

static void assert_found(const bslam_clue_t *clues, int count, double x, double y, double theta, int agreeing)
{
    bslam_fix_t fix;
    assert_true(bslam_relocate(clues, count, &fix));
    assert_near(fix.pose.x_m, x, 2e-3);
    assert_near(fix.pose.y_m, y, 2e-3);
    assert_near(unit_angle_between((double)fix.pose.theta_rad, theta), 0, 1e-3);
    assert_int_equal(fix.agreeing, agreeing);
    assert_int_equal(fix.dissenting, count - agreeing);
    assert_true(fix.position_sd_m > 0 && fix.position_sd_m < 0.5);
}

static void test_relocate_by_two_beacons_with_distance(void **state)
{
    for (double theta = -3; theta <= 3; theta += 0.5) {
        const bslam_clue_t clues[] = {clue_of(0, 1, 3, theta, true), clue_of(1, 1, 3, theta, true)};
        assert_found(clues, 2, 1, 3, theta, 2);
    }
}

static void test_relocate_by_three_directions(void **state)
{
    for (double theta = -3; theta <= 3; theta += 0.5) {
        const bslam_clue_t clues[] = {clue_of(0, 1.5, 3, theta, false), clue_of(1, 1.5, 3, theta, false),
                                      clue_of(3, 1.5, 3, theta, false)};
        assert_found(clues, 3, 1.5, 3, theta, 3);
    }
}

static void test_relocate_leaves_out_a_clue_that_does_not_fit(void **state)
{
    bslam_clue_t clues[5];
    for (int i = 0; i < 5; i++) {
        clues[i] = clue_of(i, 2, 3, 1, true);
    }
    clues[2].bearing_rad += real(1.0);
    assert_found(clues, 5, 2, 3, 1, 4);
    for (int i = 0; i < 5; i++) {
        clues[i].has_range = false;
    }
    assert_found(clues, 5, 2, 3, 1, 4);
}

static void test_relocate_by_clues_from_along_the_path(void **state)
{
    // Seen 1 m behind the robot, which then turned by 0.5.
    bslam_clue_t clues[] = {clue_of(0, 1, 3, 0.2, true), clue_of(1, 1, 3, 0.2, true),
                            clue_of(3, 1, 3, 0.2, true)};
    for (int i = 0; i < 3; i++) {
        clues[i].sensor = (bslam_pose_t){real(-cos(0.5)), real(sin(0.5)), real(-0.5)};
    }
    assert_found(clues, 3, 1 + cos(0.2), 3 + sin(0.2), 0.7, 3);
}

static void test_relocate_by_three_directions_of_which_any_have_a_distance(void **state)
{
    for (int with = 0; with < 8; with++) {
        const bslam_clue_t clues[] = {clue_of(0, 1.5, 3, 0, (with & 1) != 0),
                                      clue_of(1, 1.5, 3, 0, (with & 2) != 0),
                                      clue_of(3, 1.5, 3, 0, (with & 4) != 0)};
        assert_found(clues, 3, 1.5, 3, 0, 3);
    }
}

/// Two of the three sightings show the same beacon: that is two beacons, whatever the order.
static void test_relocate_takes_a_beacon_that_is_seen_twice_for_one(void **state)
{
    const bslam_clue_t with = clue_of(0, 1, 3, 0, true);
    const bslam_clue_t without = clue_of(0, 1, 3, 0, false);
    const bslam_clue_t other = clue_of(1, 1, 3, 0, true);
    const bslam_clue_t orders[][3] = {{with, without, other}, {without, with, other}, {other, without, with}};
    for (int k = 0; k < COUNT_OF(orders); k++) {
        assert_found(orders[k], 3, 1, 3, 0, 3);
        bslam_fix_t fix;
        assert_true(bslam_relocate(orders[k], 3, &fix));
        assert_int_equal(fix.beacons, 2);
        assert_int_equal(fix.with_range, 2);
    }
    // Both of its distances agree: that is still one beacon with a distance.
    const bslam_clue_t twice[] = {with, with, other};
    assert_found(twice, 3, 1, 3, 0, 3);
    bslam_fix_t fix = {.agreeing = 77};
    bslam_fix_t by_two;
    assert_true(bslam_relocate(twice, 3, &by_two));
    assert_int_equal(by_two.beacons, 2);
    assert_int_equal(by_two.with_range, 2);
    const bslam_clue_t directions[] = {without, clue_of(1, 1, 3, 0, false), without};
    const bslam_clue_t distances[] = {with, with, clue_of(1, 1, 3, 0, false)};
    assert_false(bslam_relocate(directions, 3, &fix));
    assert_false(bslam_relocate(distances, 3, &fix));
    assert_int_equal(fix.agreeing, 77);
}

/// Where two of three beacons are in one line with the robot, or all on one circle with it, directions do not
/// tell where it is.
static void test_relocate_by_directions_that_do_not_tell_finds_nothing(void **state)
{
    static const double lines[][3][2] = {
        {{2, 0}, {4, 0}, {1, 3}},   // the first two
        {{1, 3}, {2, 0}, {4, 0}},   // the last two
        {{0, 2}, {2, 2}, {2, 0}},   // on a circle with the robot, in the origin
        {{3, 0}, {-3, 0}, {0, 2}},  // between two
    };
    for (int k = 0; k < COUNT_OF(lines); k++) {
        bslam_clue_t clues[3];
        bslam_fix_t fix = {.agreeing = 77};
        for (int i = 0; i < 3; i++) {
            clues[i] = clue_of(i, 0, 0, 0, false);
            clues[i].x_m = real(lines[k][i][0]);
            clues[i].y_m = real(lines[k][i][1]);
            clues[i].bearing_rad = real(atan2(lines[k][i][1], lines[k][i][0]));
        }
        assert_false(bslam_relocate(clues, 3, &fix));
        assert_int_equal(fix.agreeing, 77);
    }
}

/// The robot stands on a beacon: nothing tells its direction, and a clue of it agrees with nothing.
static void test_relocate_on_a_beacon_leaves_its_direction_out(void **state)
{
    const bslam_clue_t ahead = {.beacon = 1, .x_m = 4, .range_m = 4, .has_range = true};
    const bslam_clue_t behind = {
        .beacon = 2, .x_m = -4, .bearing_rad = BSLAM_R(3.14159265), .range_m = 4, .has_range = true};
    const bslam_clue_t here = {.bearing_rad = BSLAM_R(0.3)};
    bslam_clue_t clues[] = {ahead, behind, here};
    for (int i = 0; i < 3; i++) {
        clues[i].bearing_var_rad2 = real(1e-4);
        clues[i].range_var_m2 = real(0.01);
    }
    bslam_fix_t fix;
    assert_true(bslam_relocate(clues, 3, &fix));
    assert_near(fix.pose.x_m, 0, 1e-3);
    assert_near(fix.pose.y_m, 0, 1e-3);
    assert_int_equal(fix.agreeing, 2);
    assert_int_equal(fix.dissenting, 1);
}

/// Beacons so far away that squares of their places are infinite.
static void test_relocate_by_places_beyond_numbers_finds_nothing(void **state)
{
    const bslam_real_t huge = BSLAM_REAL_DOUBLE ? (bslam_real_t)1e200 : (bslam_real_t)1e25f;
    bslam_clue_t clues[] = {clue_of(0, 1.5, 3, 0, false), clue_of(1, 1.5, 3, 0, false),
                            clue_of(3, 1.5, 3, 0, false)};
    for (int i = 0; i < 3; i++) {
        clues[i].x_m *= huge;
        clues[i].y_m *= huge;
    }
    bslam_fix_t fix = {.agreeing = 77};
    assert_false(bslam_relocate(clues, 3, &fix));
    assert_int_equal(fix.agreeing, 77);
}

/// Three directions tell a place of which one coordinate is beyond what is taken for a number, 10^12 m.
static void test_relocate_to_half_a_place_finds_nothing(void **state)
{
    static const double directions[][2] = {{4, 1}, {0, 3}, {-2, 5}};
    for (int k = 0; k < 2; k++) {
        const double unit_m = k == 0 ? 1e3 : 1e12;
        bslam_clue_t clues[3];
        for (int i = 0; i < 3; i++) {
            clues[i] = clue_of(i, 0, 0, 0, false);
            clues[i].x_m = real(unit_m * directions[i][0]);
            clues[i].y_m = real(unit_m * (directions[i][1] - 5));
            clues[i].bearing_rad = real(atan2(directions[i][1], directions[i][0]));
        }
        bslam_fix_t fix = {.agreeing = 77};
        assert_int_equal(bslam_relocate(clues, 3, &fix), k == 0);
        assert_int_equal(fix.agreeing, k == 0 ? 3 : 77);
        assert_near(fix.pose.x_m, 0, k == 0 ? 0.1 : 0);
        assert_near(fix.pose.y_m, k == 0 ? -5e3 : 0, k == 0 ? 0.1 : 0);
    }
}

/// Two beacons straight ahead, one behind the other.
static bool find_before_two(double near_m, double far_m, double bearing_var_rad2, double range_var_m2)
{
    const double places_m[] = {near_m, far_m};
    bslam_clue_t clues[2];
    for (int i = 0; i < 2; i++) {
        clues[i] = (bslam_clue_t){.beacon = i,
                                  .x_m = real(places_m[i]),
                                  .range_m = real(places_m[i]),
                                  .has_range = true,
                                  .bearing_var_rad2 = real(bearing_var_rad2),
                                  .range_var_m2 = real(range_var_m2)};
    }
    bslam_fix_t fix = {.agreeing = 77};
    const bool found = bslam_relocate(clues, 2, &fix);
    assert_int_equal(fix.agreeing, found ? 2 : 77);
    assert_true(!found || (bslam_is_number(fix.pose.x_m) && bslam_is_number(fix.pose.y_m)));
    return found;
}

/// Clues so sure that their information has a determinant beyond numbers.
static void test_relocate_by_clues_surer_than_numbers_finds_nothing(void **state)
{
    const double root = BSLAM_REAL_DOUBLE ? 1.1e154 : 1.5e19;  // so that twice its square is no number
    assert_true(find_before_two(4, 7, 1e-4, 0.01));
    assert_true(find_before_two(1, 100, 1e-4, 0.01));
    assert_false(find_before_two(4, 7, 1e-4, BSLAM_REAL_DOUBLE ? 1e-305 : 1e-35));
    assert_false(find_before_two(1, 100, 1 / root, 2));
}

/// A sighting that is beacon 1 or 3, which look alike.
static void test_relocate_tells_by_geometry_which_of_two_is_seen(void **state)
{
    bslam_clue_t clues[] = {clue_of(0, 1, 3, 0.5, true), clue_of(1, 1, 3, 0.5, true),
                            clue_of(1, 1, 3, 0.5, true)};
    clues[2].beacon = 3;
    clues[2].x_m = real(beacons[3][0]);
    clues[2].y_m = real(beacons[3][1]);
    clues[2].is_other = true;
    bslam_fix_t fix;
    for (int swapped = 0; swapped < 2; swapped++) {
        assert_true(bslam_relocate(clues, 3, &fix));
        assert_near(fix.pose.x_m, 1, 2e-3);
        assert_near(fix.pose.y_m, 3, 2e-3);
        assert_int_equal(fix.agreeing, 2);
        assert_int_equal(fix.dissenting, 0);
        const bslam_clue_t first = clues[1];
        clues[1] = clues[2];
        clues[2] = first;
        clues[1].is_other = false;
        clues[2].is_other = true;
    }
    // The same distance from beacon 0, elsewhere: a pose for each, and no telling.
    clues[2].x_m = -clues[1].x_m;
    clues[2].y_m = -clues[1].y_m;
    fix.agreeing = 77;
    assert_false(bslam_relocate(clues, 3, &fix));
    assert_int_equal(fix.agreeing, 77);
    // A third beacon tells.
    const bslam_clue_t unambiguous[] = {clues[0], clues[1], clues[2], clue_of(2, 1, 3, 0.5, true)};
    assert_true(bslam_relocate(unambiguous, 4, &fix));
    assert_near(fix.pose.x_m, 1, 2e-3);
    assert_int_equal(fix.agreeing, 3);
}

/// Of the beacons that one sighting may show the nearest counts, whichever is asked first.
static void test_relocate_of_two_that_agree_the_nearest_is_seen(void **state)
{
    for (int asked_first = 0; asked_first < 2; asked_first++) {
        bslam_clue_t clues[6];
        for (int i = 0; i < 5; i++) {
            clues[i] = clue_of(i, 1, 3, 0, true);
        }
        clues[5] = clues[4];
        clues[5].is_other = true;
        clues[5].beacon = 5;
        clues[5 - asked_first].y_m += real(0.19);  // seen 3.8 deviations from there
        bslam_fix_t fix;
        assert_true(bslam_relocate(clues, 6, &fix));
        assert_near(fix.pose.x_m, 1, 2e-3);
        assert_near(fix.pose.y_m, 3, 2e-3);
        assert_int_equal(fix.agreeing, 5);
        assert_int_equal(fix.dissenting, 0);
    }
}

static void test_relocate_with_too_little_finds_nothing(void **state)
{
    const bslam_clue_t one[] = {clue_of(0, 1, 3, 0, true)};
    const bslam_clue_t two[] = {clue_of(0, 1, 3, 0, false), clue_of(1, 1, 3, 0, false)};
    const bslam_clue_t same[] = {clue_of(0, 1, 3, 0, true), clue_of(0, 1, 3, 0, true)};
    bslam_fix_t fix = {.agreeing = 77};
    assert_false(bslam_relocate(one, 0, &fix));
    assert_false(bslam_relocate(one, 1, &fix));
    assert_false(bslam_relocate(two, 2, &fix));
    assert_false(bslam_relocate(same, 2, &fix));
    assert_int_equal(fix.agreeing, 77);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_relocate_by_two_beacons_with_distance),
        cmocka_unit_test(test_relocate_by_three_directions),
        cmocka_unit_test(test_relocate_leaves_out_a_clue_that_does_not_fit),
        cmocka_unit_test(test_relocate_by_clues_from_along_the_path),
        cmocka_unit_test(test_relocate_by_three_directions_of_which_any_have_a_distance),
        cmocka_unit_test(test_relocate_takes_a_beacon_that_is_seen_twice_for_one),
        cmocka_unit_test(test_relocate_by_directions_that_do_not_tell_finds_nothing),
        cmocka_unit_test(test_relocate_on_a_beacon_leaves_its_direction_out),
        cmocka_unit_test(test_relocate_by_places_beyond_numbers_finds_nothing),
        cmocka_unit_test(test_relocate_to_half_a_place_finds_nothing),
        cmocka_unit_test(test_relocate_by_clues_surer_than_numbers_finds_nothing),
        cmocka_unit_test(test_relocate_tells_by_geometry_which_of_two_is_seen),
        cmocka_unit_test(test_relocate_of_two_that_agree_the_nearest_is_seen),
        cmocka_unit_test(test_relocate_with_too_little_finds_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
