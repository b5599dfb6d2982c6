#include "support.h"

#include <math.h>

#include "vision/classifiers/recogniser.h"

enum { OBJECTS = 3 };

/// Object i is the one whose signature has a 1 at place i: the machine says 2 s[i] - 1.
typedef struct machine {
    float weights[OBJECTS * BSLAM_SIGNATURE_SIZE];
    float bias[OBJECTS];
    bslam_beacon_class_t objects[OBJECTS];
} machine_t;

static const machine_t machine = {
    .weights = {[0] = 2, [BSLAM_SIGNATURE_SIZE + 1] = 2, [2 * BSLAM_SIGNATURE_SIZE + 2] = 2},
    .bias = {-1, -1, -1},
    .objects = {{"red box", 0.3f}, {"door", 2}, {"picture", 0}},
};

static bslam_recogniser_t view(const machine_t *of)
{
    return (bslam_recogniser_t){
        .svm = {.rows = OBJECTS, .features = BSLAM_SIGNATURE_SIZE, .weights = of->weights, .bias = of->bias},
        .objects = of->objects,
        .reject_margin = 0.25f,
    };
}

static void test_recognise_takes_the_object_that_says_the_most(void **state)
{
    const bslam_recogniser_t recogniser = view(&machine);
    assert_int_equal(bslam_recogniser_check(&recogniser), BSLAM_OK);
    for (int i = 0; i < OBJECTS; i++) {
        float signature[BSLAM_SIGNATURE_SIZE] = {0.5f, 0.5f, 0.5f};
        signature[i] = 1;
        float margin;
        assert_int_equal(bslam_recognise(&recogniser, signature, &margin), i);
        assert_near(margin, 1, 0);
    }
}

static void test_recognise_below_the_reject_margin_is_none(void **state)
{
    const bslam_recogniser_t recogniser = view(&machine);
    float signature[BSLAM_SIGNATURE_SIZE] = {0.5f, 0.625f};
    float margin;
    assert_int_equal(bslam_recognise(&recogniser, signature, &margin), 1);
    assert_near(margin, 0.25, 0);
    signature[1] = 0.62f;
    assert_int_equal(bslam_recognise(&recogniser, signature, &margin), BSLAM_OBJECT_NONE);
    assert_near(margin, 0.24, 1e-6);
}

static void test_recognise_signature_that_was_not_taken_is_none(void **state)
{
    machine_t eager = machine;
    eager.bias[1] = 5;
    const bslam_recogniser_t recogniser = view(&eager);
    const float signature[BSLAM_SIGNATURE_SIZE] = {0};
    float margin;
    assert_int_equal(bslam_recognise(&recogniser, signature, &margin), BSLAM_OBJECT_NONE);
    assert_near(margin, 0, 0);
}

static void test_check_bad_recogniser_is_refused(void **state)
{
    const bslam_recogniser_t good = view(&machine);
    machine_t tall = machine;
    tall.objects[2].height_m = 10.1f;
    machine_t unknown = machine;
    unknown.objects[0].height_m = NAN;
    bslam_recogniser_t cases[] = {good, good, good, good, view(&tall), view(&unknown)};
    static const bslam_status_t wanted[] = {BSLAM_E_COUNT,      BSLAM_E_PARAMETER, BSLAM_E_PARAMETER,
                                            BSLAM_E_NOT_FINITE, BSLAM_E_RANGE,     BSLAM_E_RANGE};
    cases[0].svm.features = BSLAM_SIGNATURE_SIZE - 1;
    cases[1].objects = NULL;
    cases[2].svm.weights = NULL;
    cases[3].reject_margin = NAN;
    for (int i = 0; i < COUNT_OF(cases); i++) {
        assert_int_equal(bslam_recogniser_check(&cases[i]), wanted[i]);
    }
}

static void test_check_quadratic_machine_is_refused(void **state)
{
    static const float weights[BSLAM_SVM_WEIGHTS(BSLAM_SIGNATURE_SIZE, true)];
    bslam_recogniser_t recogniser = view(&machine);
    recogniser.svm.rows = 1;
    recogniser.svm.weights = weights;
    assert_int_equal(bslam_recogniser_check(&recogniser), BSLAM_OK);
    recogniser.svm.quadratic = true;
    assert_int_equal(bslam_recogniser_check(&recogniser), BSLAM_E_PARAMETER);
    recogniser.svm.weights = machine.weights;  // too short for a quadratic one: they are not looked at
    assert_int_equal(bslam_recogniser_check(&recogniser), BSLAM_E_PARAMETER);
}

static void test_check_too_many_objects_are_refused(void **state)
{
    static const float weights[(BSLAM_OBJECTS_MAX + 1) * BSLAM_SIGNATURE_SIZE];
    static const float bias[BSLAM_OBJECTS_MAX + 1];
    static const bslam_beacon_class_t objects[BSLAM_OBJECTS_MAX + 1];
    bslam_recogniser_t recogniser = view(&machine);
    recogniser.svm.weights = weights;
    recogniser.svm.bias = bias;
    recogniser.objects = objects;
    recogniser.svm.rows = BSLAM_OBJECTS_MAX;
    assert_int_equal(bslam_recogniser_check(&recogniser), BSLAM_OK);
    recogniser.svm.rows = BSLAM_OBJECTS_MAX + 1;
    assert_int_equal(bslam_recogniser_check(&recogniser), BSLAM_E_COUNT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_recognise_takes_the_object_that_says_the_most),
        cmocka_unit_test(test_recognise_below_the_reject_margin_is_none),
        cmocka_unit_test(test_recognise_signature_that_was_not_taken_is_none),
        cmocka_unit_test(test_check_bad_recogniser_is_refused),
        cmocka_unit_test(test_check_quadratic_machine_is_refused),
        cmocka_unit_test(test_check_too_many_objects_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
