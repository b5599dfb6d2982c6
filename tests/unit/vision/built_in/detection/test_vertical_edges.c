#include "support.h"

#include <math.h>

#include "made_view.h"

#include "vision/built_in/detection/vertical_edges.h"

#define WALL_M 4.0f

static made_view_t made;
static bslam_proposals_t proposals;

/// An upright edge on the wall between two heights.
static void draw_edge(int32_t column, float bottom_m, float top_m)
{
    const int32_t first = (int32_t)(unit_made_row_px(WALL_M, top_m) / BSLAM_CELL_PX);
    const int32_t end = (int32_t)(unit_made_row_px(WALL_M, bottom_m) / BSLAM_CELL_PX) + 1;
    for (int32_t row = first < 0 ? 0 : first; row < end; row++) {
        made.step_x[row * MADE_COLUMNS + column] = 50;
    }
}

static int32_t propose(void)
{
    memset(&proposals, 0, sizeof proposals);
    static bslam_edge_steps_t steps;
    bslam_vertical_edges_propose(&proposals, &made.view, &steps);
    return proposals.count;
}

/// Whether there is a box with these sides, and top and bottom within a cell.
static bool is_proposed(int32_t left_column, int32_t right_column, float bottom_m, float top_m)
{
    const double top = (double)unit_made_row_px(WALL_M, top_m);
    const double bottom = (double)unit_made_row_px(WALL_M, bottom_m);
    for (int32_t i = 0; i < proposals.count; i++) {
        const bslam_box_t *box = &proposals.items[i].box;
        if (fabs((double)box->left_px - (4 * left_column + 1.5)) < 1e-3 &&
            fabs((double)box->right_px - (4 * right_column + 1.5)) < 1e-3 &&
            fabs((double)box->top_px - top) <= 4 && fabs((double)box->bottom_px - bottom) <= 4) {
            return true;
        }
    }
    return false;
}

static void test_edge_outside_the_frame_or_of_no_length_is_none(void **state)
{
    unit_made_view(&made, WALL_M);
    memset(made.step_x, 50, sizeof made.step_x);
    memset(made.step_y, 50, sizeof made.step_y);
    const bslam_proposal_t box = {.left = 10, .top = 5, .right = 20, .bottom = 30};
    bslam_proposal_t flat = box;
    flat.bottom = flat.top;
    assert_true(bslam_edge_along(&made.view, &box, BSLAM_BOX_LEFT, MADE_COLUMNS - 1).step > 0);
    assert_true(bslam_edge_along(&made.view, &box, BSLAM_BOX_TOP, MADE_ROWS - 1).step > 0);
    const bslam_cell_edge_t edges[] = {
        bslam_edge_along(&made.view, &box, BSLAM_BOX_LEFT, -1),
        bslam_edge_along(&made.view, &box, BSLAM_BOX_LEFT, MADE_COLUMNS),
        bslam_edge_along(&made.view, &box, BSLAM_BOX_TOP, MADE_ROWS),
        bslam_edge_along(&made.view, &flat, BSLAM_BOX_LEFT, 10),
    };
    for (int i = 0; i < COUNT_OF(edges); i++) {
        assert_true(edges[i].step == 0 && edges[i].share == 0);
    }
}

static void test_uprights_two_edges_of_a_window_make_its_box(void **state)
{
    unit_made_view(&made, WALL_M);
    draw_edge(30, 0.9f, 2.1f);
    draw_edge(47, 0.9f, 2.1f);  // 17 columns of 4 px at 70 px a metre: 0.97 m
    assert_true(propose() > 0);
    assert_true(is_proposed(30, 47, 0.9f, 2.1f));
}

/// Boxes of which neither side is the frame's edge.
static int32_t boxes_inside(void)
{
    int32_t count = 0;
    for (int32_t i = 0; i < proposals.count; i++) {
        const bslam_box_t *box = &proposals.items[i].box;
        count += box->left_px > 2 && box->right_px < (bslam_real_t)(4 * (MADE_COLUMNS - 1)) ? 1 : 0;
    }
    return count;
}

static void test_uprights_one_edge_is_no_box_but_with_the_frame_s_edge(void **state)
{
    unit_made_view(&made, WALL_M);
    draw_edge(30, 0.0f, 2.1f);
    (void)propose();
    assert_int_equal(boxes_inside(), 0);
    unit_made_view(&made, WALL_M);
    draw_edge(10, 0.0f, 2.1f);  // 0.63 m of a door, the rest cut off
    assert_true(propose() > 0);
    assert_int_equal(boxes_inside(), 0);
    assert_true(is_proposed(0, 10, 0.0f, 1.9f));
}

static void test_uprights_edges_too_far_apart_are_no_box(void **state)
{
    unit_made_view(&made, WALL_M);
    draw_edge(10, 0.0f, 2.1f);
    draw_edge(45, 0.0f, 2.1f);  // exactly 2 m
    (void)propose();
    assert_int_equal(boxes_inside(), 0);
}

static void test_uprights_weak_edges_are_no_sides(void **state)
{
    unit_made_view(&made, WALL_M);
    draw_edge(30, 0.9f, 2.1f);
    draw_edge(47, 0.9f, 2.1f);
    for (int32_t i = 0; i < MADE_CELLS; i++) {
        made.step_x[i] /= 10;
    }
    assert_int_equal(propose(), 0);
}

static void test_uprights_without_a_floor_line_there_is_no_height(void **state)
{
    unit_made_view(&made, 0);
    draw_edge(30, 0.9f, 2.1f);
    draw_edge(47, 0.9f, 2.1f);
    assert_int_equal(propose(), 0);
}

/// Where a point of an upright falls: at a bearing to the left, so far away, so high.
static void project(float bearing_rad, float far_m, float height_m, bslam_real_t *u_px, bslam_real_t *v_px)
{
    const bslam_direction_t there = {(bslam_real_t)(far_m * cosf(bearing_rad)),
                                     (bslam_real_t)(far_m * sinf(bearing_rad)),
                                     (bslam_real_t)(height_m - MADE_CAMERA_M)};
    assert_int_equal(bslam_camera_project(&made.camera, &there, u_px, v_px), BSLAM_OK);
}

/// Draws the upright as the lens bends it, and widens the box by it.
static void draw_bent_edge(float bearing_rad, float far_m, float bottom_m, float top_m, bslam_box_t *box)
{
    for (float height_m = bottom_m; height_m <= top_m; height_m += 0.005f) {
        bslam_real_t u = 0, v = 0;
        project(bearing_rad, far_m, height_m, &u, &v);
        made.step_x[(int32_t)v / BSLAM_CELL_PX * MADE_COLUMNS + (int32_t)u / BSLAM_CELL_PX] = 50;
        box->left_px = u < box->left_px ? u : box->left_px;
        box->right_px = u > box->right_px ? u : box->right_px;
        box->top_px = v < box->top_px ? v : box->top_px;
        box->bottom_px = v > box->bottom_px ? v : box->bottom_px;
    }
}

/// A camera of 180 degrees in the middle of a round room.
static void look_wide(float wall_m)
{
    unit_made_view(&made, wall_m);
    made.camera.lens = BSLAM_LENS_EQUIDISTANT;
    made.camera.fx_px = made.camera.fy_px = BSLAM_R(101.859);
    made.view.mounting = bslam_camera_mounting(&made.camera);
    for (int32_t column = 0; column < MADE_COLUMNS; column++) {
        bslam_real_t u = 0, v = 0;
        project(0, wall_m, 0, &u, &v);
        made.floor_line.edge_px[column] = (int16_t)v;
    }
}

static void test_uprights_that_a_wide_lens_bends_make_a_box(void **state)
{
    const float bearings_rad[][2] = {{0.15f, -0.3f}, {0.9f, 0.45f}, {-0.6f, -1.05f}};
    for (int32_t i = 0; i < 3; i++) {
        look_wide(2.0f);
        bslam_box_t box = {1e3f, 1e3f, -1e3f, -1e3f};
        draw_bent_edge(bearings_rad[i][0], 2.0f, 0.9f, 2.1f, &box);
        draw_bent_edge(bearings_rad[i][1], 2.0f, 0.9f, 2.1f, &box);
        double best = 0;
        for (int32_t k = propose() - 1; k >= 0; k--) {
            best = fmax(best, (double)bslam_box_overlap(&proposals.items[k].box, &box));
        }
        assert_true(best > 0.75);
    }
}

static void test_uprights_neighbours_each_have_a_box(void **state)
{
    unit_made_view(&made, WALL_M);
    const int32_t edges[] = {10, 27, 50, 67};
    for (int32_t i = 0; i < 4; i++) {
        draw_edge(edges[i], 0.9f, 2.1f);
    }
    (void)propose();
    assert_true(is_proposed(10, 27, 0.9f, 2.1f));
    assert_true(is_proposed(50, 67, 0.9f, 2.1f));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_edge_outside_the_frame_or_of_no_length_is_none),
        cmocka_unit_test(test_uprights_two_edges_of_a_window_make_its_box),
        cmocka_unit_test(test_uprights_one_edge_is_no_box_but_with_the_frame_s_edge),
        cmocka_unit_test(test_uprights_edges_too_far_apart_are_no_box),
        cmocka_unit_test(test_uprights_weak_edges_are_no_sides),
        cmocka_unit_test(test_uprights_without_a_floor_line_there_is_no_height),
        cmocka_unit_test(test_uprights_that_a_wide_lens_bends_make_a_box),
        cmocka_unit_test(test_uprights_neighbours_each_have_a_box),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
