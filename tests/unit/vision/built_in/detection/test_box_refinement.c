// A box's sides move to the strongest lines of steps beside them, cell by cell.
#include "support.h"

#include "made_view.h"

#include "vision/built_in/detection/box_refinement.h"

enum { STRONG = 60, LEFT = 20, TOP = 10, RIGHT = 40, BOTTOM = 30 };

static made_view_t made;

static void draw_column(int column, uint8_t step)
{
    for (int row = TOP; row < BOTTOM; row++) {
        made.step_x[row * MADE_COLUMNS + column] = step;
    }
}

static void draw_row(int row, uint8_t step)
{
    for (int column = LEFT; column < RIGHT; column++) {
        made.step_y[row * MADE_COLUMNS + column] = step;
    }
}

static bslam_proposal_t box_of(int left, int top, int right, int bottom)
{
    return (bslam_proposal_t){
        .left = (int16_t)left,
        .top = (int16_t)top,
        .right = (int16_t)right,
        .bottom = (int16_t)bottom,
        .box = {real(4 * left - 0.5), real(4 * top - 0.5), real(4 * right - 0.5), real(4 * bottom - 0.5)}};
}

static void assert_box(const bslam_proposal_t *actual, const bslam_proposal_t *expected)
{
    assert_int_equal(actual->left, expected->left);
    assert_int_equal(actual->top, expected->top);
    assert_int_equal(actual->right, expected->right);
    assert_int_equal(actual->bottom, expected->bottom);
    assert_memory_equal(&actual->box, &expected->box, sizeof actual->box);
}

static void test_sides_snap_to_the_edges_beside_them(void **state)
{
    unit_made_view(&made, 4);
    draw_column(LEFT - 1, STRONG);
    draw_column(RIGHT, STRONG);
    draw_row(TOP - 1, STRONG);
    draw_row(BOTTOM, STRONG);
    const bslam_proposal_t rough = box_of(LEFT, TOP, RIGHT, BOTTOM);
    bslam_proposal_t expected = box_of(LEFT - 1, TOP - 1, RIGHT + 1, BOTTOM + 1);
    // An edge is in the middle of its cell.
    expected.box = (bslam_box_t){real(4 * (LEFT - 1) + 1.5), real(4 * (TOP - 1) + 1.5), real(4 * RIGHT + 1.5),
                                 real(4 * BOTTOM + 1.5)};
    const bslam_proposal_t snapped = bslam_box_refined(&made.view, &rough);
    assert_box(&snapped, &expected);
}

static void test_box_whose_sides_would_meet_stays_as_it_is(void **state)
{
    unit_made_view(&made, 4);
    const bslam_proposal_t column = box_of(LEFT, TOP, LEFT + 1, BOTTOM);
    const bslam_proposal_t row = box_of(LEFT, TOP, RIGHT, TOP + 1);
    bslam_proposal_t snapped = bslam_box_refined(&made.view, &column);
    assert_box(&snapped, &column);
    snapped = bslam_box_refined(&made.view, &row);
    assert_box(&snapped, &row);
    // Three columns, and a faint edge in the middle one: either side would snap to it.
    const bslam_proposal_t narrow = box_of(LEFT, TOP, LEFT + 3, BOTTOM);
    draw_column(LEFT + 1, 1);
    snapped = bslam_box_refined(&made.view, &narrow);
    assert_box(&snapped, &narrow);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sides_snap_to_the_edges_beside_them),
        cmocka_unit_test(test_box_whose_sides_would_meet_stays_as_it_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
