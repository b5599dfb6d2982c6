#include "support.h"

#include "base/status.h"

static void test_status_name_every_code_is_its_own_name(void **state)
{
    static const struct {
        bslam_status_t status;
        const char *name;
    } cases[] = {
        {BSLAM_OK, "BSLAM_OK"},
        {BSLAM_E_NOT_FINITE, "BSLAM_E_NOT_FINITE"},
        {BSLAM_E_TIME, "BSLAM_E_TIME"},
        {BSLAM_E_RANGE, "BSLAM_E_RANGE"},
        {BSLAM_E_JUMP, "BSLAM_E_JUMP"},
        {BSLAM_E_COUNT, "BSLAM_E_COUNT"},
        {BSLAM_E_MAP_FULL, "BSLAM_E_MAP_FULL"},
        {BSLAM_E_NO_BEACON, "BSLAM_E_NO_BEACON"},
        {BSLAM_E_DUPLICATE, "BSLAM_E_DUPLICATE"},
        {BSLAM_E_PARAMETER, "BSLAM_E_PARAMETER"},
        {BSLAM_E_SINGULAR, "BSLAM_E_SINGULAR"},
        {BSLAM_E_MAP, "BSLAM_E_MAP"},
        {BSLAM_E_STATE, "BSLAM_E_STATE"},
        {BSLAM_E_SIZE, "BSLAM_E_SIZE"},
    };
    // A new status needs a line above.
    assert_int_equal(COUNT_OF(cases), BSLAM_STATUS_COUNT);
    for (int i = 0; i < COUNT_OF(cases); i++) {
        assert_string_equal(bslam_status_name(cases[i].status), cases[i].name);
    }
}

static void test_status_name_every_code_has_a_name(void **state)
{
    for (int code = 0; code < BSLAM_STATUS_COUNT; code++) {
        assert_non_null(bslam_status_name((bslam_status_t)code));
    }
}

static void test_status_name_outside_the_enum_is_unknown(void **state)
{
    static const int outside[] = {BSLAM_STATUS_COUNT, -1, INT32_MAX, INT32_MIN};
    for (int i = 0; i < COUNT_OF(outside); i++) {
        // Through memory, as a corrupted value would come: UBSan has no say in what an enum variable may hold
        // in C.
        bslam_status_t status;
        memcpy(&status, &outside[i], sizeof status);
        assert_string_equal(bslam_status_name(status), "unknown status");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_status_name_every_code_is_its_own_name),
        cmocka_unit_test(test_status_name_every_code_has_a_name),
        cmocka_unit_test(test_status_name_outside_the_enum_is_unknown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
