#include "blank_model.h"
#include "support.h"

#include <math.h>

static unit_detector_t detector;

static int setup(void **state)
{
    (void)unit_blank_model(&detector);
    return 0;
}

static void test_model_check_takes_the_blank_model(void **state)
{
    const bslam_beacon_model_t model = unit_blank_model(&detector);
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_OK);
}

static void test_model_check_refuses_a_number_of_classes_out_of_range(void **state)
{
    bslam_beacon_model_t model = unit_blank_model(&detector);
    model.class_count = 0;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_COUNT);
    model.class_count = BSLAM_CLASSES_MAX + 1;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_COUNT);
    model.class_count = UNIT_MODEL_CLASSES - 1;  // the machines have more
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_COUNT);
}

static void test_model_check_refuses_a_height_that_no_beacon_has(void **state)
{
    static const float heights_m[] = {-0.1f, 10.1f, NAN};
    bslam_beacon_model_t model = unit_blank_model(&detector);
    for (int i = 0; i < COUNT_OF(heights_m); i++) {
        bslam_beacon_class_t classes[UNIT_MODEL_CLASSES] = {{.height_m = 1}, {.height_m = heights_m[i]}};
        model.classes = classes;
        assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_RANGE);
    }
}

/// Cell and screen must be linear: the tables that are here have no room for products.
static void test_model_check_refuses_a_quadratic_machine_without_reading_its_weights(void **state)
{
    bslam_beacon_model_t model = unit_blank_model(&detector);
    model.wide.cell.quadratic = true;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_PARAMETER);
    model = unit_blank_model(&detector);
    model.pinhole.screen.quadratic = true;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_PARAMETER);
    model = unit_blank_model(&detector);
    model.wide.glance.quadratic = true;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_PARAMETER);
    static const float products[BSLAM_SVM_WEIGHTS(UNIT_MODEL_CLASSES + 3, true)];
    model = unit_blank_model(&detector);
    model.pinhole.fusion.quadratic = true;
    model.pinhole.fusion.weights = products;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_OK);
}

static void test_model_check_refuses_machines_of_another_size(void **state)
{
    bslam_beacon_model_t model = unit_blank_model(&detector);
    model.pinhole.cell.rows = 2;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_COUNT);
    model = unit_blank_model(&detector);
    model.pinhole.fusion.features--;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_COUNT);
    model = unit_blank_model(&detector);
    model.pinhole.glance.features--;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_COUNT);
    model = unit_blank_model(&detector);
    model.wide.kinds.rows--;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_COUNT);
    model = unit_blank_model(&detector);
    model.wide.kinds.knots = NULL;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_PARAMETER);
    model = unit_blank_model(&detector);
    model.pinhole.close.rows--;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_COUNT);
    model = unit_blank_model(&detector);
    model.pinhole.close.features--;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_COUNT);
    model = unit_blank_model(&detector);
    model.wide.verdict.features--;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_COUNT);
}

static void test_model_check_refuses_numbers_that_are_not_finite(void **state)
{
    float *const tables[] = {&detector.blob_offset[BSLAM_BLOB_FEATURES - 1],
                             &detector.blob_scale[0],
                             &detector.cell_weights[3],
                             &detector.kind_bias[0],
                             &detector.close_bias[0],
                             &detector.close_scale[1],
                             &detector.verdict_weights[0]};
    for (int i = 0; i < COUNT_OF(tables); i++) {
        const bslam_beacon_model_t model = unit_blank_model(&detector);
        *tables[i] = i % 2 == 0 ? NAN : INFINITY;
        assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_NOT_FINITE);
    }
    bslam_beacon_model_t model = unit_blank_model(&detector);
    model.wide.any_threshold = NAN;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_NOT_FINITE);
    model = unit_blank_model(&detector);
    model.pinhole.glance_threshold = NAN;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_NOT_FINITE);
    model = unit_blank_model(&detector);
    model.pinhole.fusion_threshold = INFINITY;
    assert_int_equal(bslam_beacon_model_check(&model), BSLAM_E_NOT_FINITE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_model_check_takes_the_blank_model, setup),
        cmocka_unit_test_setup(test_model_check_refuses_a_number_of_classes_out_of_range, setup),
        cmocka_unit_test_setup(test_model_check_refuses_a_height_that_no_beacon_has, setup),
        cmocka_unit_test_setup(test_model_check_refuses_a_quadratic_machine_without_reading_its_weights,
                               setup),
        cmocka_unit_test_setup(test_model_check_refuses_machines_of_another_size, setup),
        cmocka_unit_test_setup(test_model_check_refuses_numbers_that_are_not_finite, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
