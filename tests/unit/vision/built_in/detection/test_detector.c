#include "support.h"

#include "blank_model.h"
#include "made_view.h"

#include "vision/built_in/detection/detector.h"
#include "base/scalar.h"

/// Place of the logarithm of a box's area among the features.
#define LOG_AREA 5

static unit_detector_t detector;
static bslam_beacon_model_t model;
static made_view_t made;
static bslam_proposals_t proposals;
static bslam_box_opinion_t opinions[BSLAM_OPINIONS_MAX];
static bslam_candidate_t candidates[BSLAM_CANDIDATES_MAX];
static uint32_t dropped;

/// A detector that takes every box, the larger the surer.
static int setup(void **state)
{
    model = unit_blank_model(&detector);
    detector.blob_scale[LOG_AREA] = 0.2f;
    detector.screen_weights[LOG_AREA] = 1;
    detector.fusion_weights[UNIT_MODEL_CLASSES + 2] = 1;
    unit_made_view(&made, 0);
    memset(&proposals, 0, sizeof proposals);
    dropped = 0;
    return 0;
}

static void add(int16_t left, int16_t top, int16_t right, int16_t bottom)
{
    proposals.items[proposals.count++] = (bslam_proposal_t){
        .left = left,
        .top = top,
        .right = right,
        .bottom = bottom,
        .cells = 1,
        .box = {left * BSLAM_CELL_PX, top * BSLAM_CELL_PX, right * BSLAM_CELL_PX, bottom * BSLAM_CELL_PX},
    };
}

static int32_t judge(void)
{
    return bslam_detector_judge(&model.pinhole, model.classes, model.class_count, &made.view, &proposals,
                                opinions, candidates, &dropped);
}

static int32_t left_column(int32_t candidate)
{
    return (int32_t)candidates[candidate].outline.left_px / BSLAM_CELL_PX;
}

static void test_detector_of_boxes_that_overlap_the_surest_stays(void **state)
{
    add(10, 10, 20, 20);
    add(12, 10, 24, 20);  // larger; overlap 80 / 140
    assert_int_equal(judge(), 1);
    assert_int_equal(left_column(0), 12);
}

static void test_detector_order_of_proposals_does_not_matter(void **state)
{
    add(12, 10, 24, 20);
    add(10, 10, 20, 20);
    assert_int_equal(judge(), 1);
    assert_int_equal(left_column(0), 12);
}

static void test_detector_boxes_side_by_side_both_stay_surest_first(void **state)
{
    add(10, 10, 20, 20);
    add(22, 10, 40, 20);
    add(50, 10, 55, 20);
    assert_int_equal(judge(), 3);
    assert_int_equal(left_column(0), 22);
    assert_int_equal(left_column(1), 10);
    assert_int_equal(left_column(2), 50);
    assert_true(candidates[0].score > candidates[1].score && candidates[1].score > candidates[2].score);
}

static void test_detector_a_part_gives_way_to_the_whole(void **state)
{
    add(10, 10, 30, 30);
    add(12, 12, 16, 16);  // overlap only 16 / 400, but all of it lies within
    assert_int_equal(judge(), 1);
    assert_int_equal(left_column(0), 10);
}

static void test_detector_a_surer_box_takes_the_place_of_several(void **state)
{
    add(10, 10, 20, 20);
    add(20, 10, 30, 20);
    add(60, 10, 64, 20);
    add(10, 10, 30, 22);
    assert_int_equal(judge(), 2);
    assert_int_equal(left_column(0), 10);
    assert_near(candidates[0].outline.bottom_px, 88, 0);
    assert_int_equal(left_column(1), 60);
}

static void test_detector_keeps_the_surest_where_there_is_no_room(void **state)
{
    for (int16_t i = 0; i < BSLAM_CANDIDATES_MAX + 3; i++) {
        const int16_t left = (int16_t)(i % 10 * 8), top = (int16_t)(i / 10 * 8);
        add(left, top, (int16_t)(left + 2 + i % 5), (int16_t)(top + 2 + i / 10));
    }
    assert_int_equal(judge(), BSLAM_CANDIDATES_MAX);
    assert_int_equal(dropped, 3);
    for (int32_t i = 1; i < BSLAM_CANDIDATES_MAX; i++) {
        assert_true(candidates[i - 1].score >= candidates[i].score);
    }
}

static void test_detector_asks_glance_screen_first_machine_and_threshold(void **state)
{
    add(10, 10, 20, 20);
    assert_int_equal(judge(), 1);
    model.pinhole.glance_threshold = 0.5f;
    assert_int_equal(judge(), 0);
    detector.glance_bias = 1;
    assert_int_equal(judge(), 1);
    model.pinhole.screen_threshold = 10;
    assert_int_equal(judge(), 0);
    model.pinhole.screen_threshold = -10;
    model.pinhole.any_threshold = 0.5f;
    assert_int_equal(judge(), 0);
    detector.kind_bias[0] = 1;  // the first row: any beacon
    assert_int_equal(judge(), 1);
    model.pinhole.threshold = 100;
    assert_int_equal(judge(), 0);
}

static void test_detector_class_is_the_surest_kind_and_by_how_much(void **state)
{
    add(10, 10, 20, 20);
    detector.kind_bias[1] = 0.25f;
    detector.kind_bias[2] = 1.5f;
    detector.kind_bias[3] = 3;  // clutter is no class
    assert_int_equal(judge(), 1);
    assert_int_equal(candidates[0].beacon_class, 2);
    assert_near(candidates[0].class_margin, 1.25 / 2, 1e-6);
}

static void test_detector_kinds_value_is_the_mean_of_both_looks(void **state)
{
    add(10, 10, 20, 20);
    detector.kind_bias[1] = 1;
    detector.kind_bias[2] = 2;
    detector.close_bias[1] = 3.5f;
    detector.close_bias[2] = 0.5f;
    assert_int_equal(judge(), 1);
    assert_int_equal(candidates[0].beacon_class, 1);
    assert_near(candidates[0].class_margin, (1 + 3.5 - 2 - 0.5) / 2, 1e-6);
}

static void test_detector_verdict_weighs_fusion_first_machine_and_closer_look(void **state)
{
    add(10, 10, 20, 20);
    assert_int_equal(judge(), 1);
    const float fusion = candidates[0].score;
    detector.kind_bias[0] = 0.5f;
    detector.close_bias[0] = 2;
    detector.close_bias[UNIT_MODEL_CLASSES + 1] = 9;  // counts as 4, the limit
    detector.verdict_weights[1] = 10;
    detector.verdict_weights[2] = 100;
    detector.verdict_weights[UNIT_MODEL_CLASSES + 3] = 1000;
    detector.verdict_bias = 0.25f;
    assert_int_equal(judge(), 1);
    assert_near(candidates[0].score, (double)fusion + 5 + 200 + 4000 + 0.25, 1e-3);
}

static void test_detector_no_closer_look_below_the_fusions_threshold(void **state)
{
    add(10, 10, 20, 20);
    assert_int_equal(judge(), 1);
    const float fusion = candidates[0].score;
    detector.close_bias[0] = 1;
    detector.verdict_weights[2] = 100;
    model.pinhole.fusion_threshold = fusion + 0.01f;
    assert_int_equal(judge(), 0);
    model.pinhole.fusion_threshold = fusion - 0.01f;
    assert_int_equal(judge(), 1);
    model.pinhole.threshold = fusion + 101;
    assert_int_equal(judge(), 0);
}

static void test_detector_what_is_beaten_by_far_gets_no_closer_look(void **state)
{
    add(10, 10, 20, 20);
    add(12, 10, 24, 20);  // larger, so surer, by .2 ln 1.2
    add(40, 10, 50, 20);
    detector.verdict_weights[0] = -1;  // the closer look turns them round
    model.pinhole.threshold = -100;
    assert_int_equal(judge(), 2);
    assert_int_equal(left_column(0), 10);
    assert_int_equal(left_column(1), 40);
    detector.blob_scale[LOG_AREA] = 8;  // now by 1.5
    detector.blob_offset[LOG_AREA] = 7.4f;
    assert_int_equal(judge(), 2);
    assert_int_equal(left_column(0), 40);
    assert_int_equal(left_column(1), 12);
}

/// The pixels of the box, and the features, 42 steps for 1.
static void test_detector_closer_look_is_told_pixels_and_features(void **state)
{
    const float normalised[BSLAM_BLOB_FEATURES] = {BSLAM_FEATURE_LIMIT, -BSLAM_FEATURE_LIMIT, 0, 0.25f};
    uint8_t told[BSLAM_BLOB_FEATURES];
    bslam_detector_tell(normalised, told);
    assert_int_equal(told[0], 254);
    assert_int_equal(told[1], 2);
    assert_int_equal(told[2], 128);
    assert_int_equal(told[3], 139);
    add(10, 10, 20, 25);
    for (int i = 0; i < COUNT_OF(made.half); i++) {
        made.half[i] = (uint16_t)((uint32_t)i * 2654435761U >> 16);
    }
    uint8_t pixels[BSLAM_PATCH_FEATURES];
    bslam_patch_features(&made.frame, &proposals.items[0].box, pixels);
    assert_int_equal(judge(), 1);
    const float before = candidates[0].score;
    int8_t *first_row = detector.close_weights;  // even bytes of a word: the row's
    first_row[4 * 37] = 100;                     // a feature of the pixels
    detector.close_scale[0] = 1e-4f;
    detector.verdict_weights[2] = 1;
    assert_int_equal(judge(), 1);
    assert_near(candidates[0].score - before, 100 * 1e-4 * pixels[37], 1e-5);
    first_row[4 * 37] = 0;
    first_row[4 * (BSLAM_PATCH_FEATURES + LOG_AREA)] = 100;  // and one of the box
    assert_int_equal(judge(), 1);
    assert_near(candidates[0].score - before, 100 * 1e-4 * opinions[0].told[LOG_AREA], 1e-5);
    assert_true(opinions[0].told[LOG_AREA] > 128);
}

/// Opinions have less room than proposals.
static void test_detector_keeps_the_surest_opinions(void **state)
{
    model.pinhole.threshold = -100;
    for (int16_t i = 0; i < BSLAM_OPINIONS_MAX + 4; i++) {
        const int16_t left = (int16_t)(i % 10 * 8), top = (int16_t)(i / 10 * 8);
        add(left, top, (int16_t)(left + 2 + (i < 4 ? 0 : 4)),
            (int16_t)(top + 2));  // the first four are smaller
    }
    assert_int_equal(judge(), BSLAM_CANDIDATES_MAX);
    assert_int_equal(dropped, 4 + BSLAM_OPINIONS_MAX - BSLAM_CANDIDATES_MAX);
    for (int32_t i = 0; i < BSLAM_OPINIONS_MAX; i++) {
        assert_int_equal(opinions[i].proposal->right - opinions[i].proposal->left, 6);
    }
}

/// How high the floor line makes the box, by the features; it must know.
static float height_of(const bslam_proposal_t *proposal)
{
    float features[BSLAM_BLOB_FEATURES];
    bslam_blob_features(&made.view, proposal, features);
    assert_true(features[BSLAM_BLOB_PER_METRE] > 0);
    return features[BSLAM_BLOB_LOG_HEIGHT];
}

/// Twice the margin of kind 2 (0.3 m) over kind 1 (2 m), their machines being equally sure of the only box:
/// what these differ by, since the closer look says nothing.
static float margin_of_small(void)
{
    detector.kind_bias[1] = detector.kind_bias[2] = 2;
    assert_int_equal(judge(), 1);
    return (candidates[0].beacon_class == 2 ? 2 : -2) * candidates[0].class_margin;
}

static void test_detector_a_kind_of_another_height_loses_at_most_one(void **state)
{
    unit_made_view(&made, 3);
    add(10, 12, 20, 24);
    const float log_height = height_of(&proposals.items[0]);
    const float loss_small = 1.5f * (fabsf(log_height - logf(0.3f)) - 0.2f);
    const float loss_tall = 1.5f * (fabsf(log_height - logf(2.0f)) - 0.2f);
    assert_true(loss_small > 0 && loss_small < 1 && loss_tall > 1);  // the box is chosen so
    assert_near(margin_of_small(), 1 - loss_small, 0.02);
}

static void test_detector_a_box_at_the_frames_edge_may_be_of_any_height(void **state)
{
    unit_made_view(&made, 3);
    add(10, 0, 20, 8);
    assert_near(margin_of_small(), 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_detector_of_boxes_that_overlap_the_surest_stays, setup),
        cmocka_unit_test_setup(test_detector_order_of_proposals_does_not_matter, setup),
        cmocka_unit_test_setup(test_detector_boxes_side_by_side_both_stay_surest_first, setup),
        cmocka_unit_test_setup(test_detector_a_part_gives_way_to_the_whole, setup),
        cmocka_unit_test_setup(test_detector_a_surer_box_takes_the_place_of_several, setup),
        cmocka_unit_test_setup(test_detector_keeps_the_surest_where_there_is_no_room, setup),
        cmocka_unit_test_setup(test_detector_asks_glance_screen_first_machine_and_threshold, setup),
        cmocka_unit_test_setup(test_detector_class_is_the_surest_kind_and_by_how_much, setup),
        cmocka_unit_test_setup(test_detector_kinds_value_is_the_mean_of_both_looks, setup),
        cmocka_unit_test_setup(test_detector_verdict_weighs_fusion_first_machine_and_closer_look, setup),
        cmocka_unit_test_setup(test_detector_no_closer_look_below_the_fusions_threshold, setup),
        cmocka_unit_test_setup(test_detector_what_is_beaten_by_far_gets_no_closer_look, setup),
        cmocka_unit_test_setup(test_detector_keeps_the_surest_opinions, setup),
        cmocka_unit_test_setup(test_detector_closer_look_is_told_pixels_and_features, setup),
        cmocka_unit_test_setup(test_detector_a_kind_of_another_height_loses_at_most_one, setup),
        cmocka_unit_test_setup(test_detector_a_box_at_the_frames_edge_may_be_of_any_height, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
