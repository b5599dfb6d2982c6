#include "support.h"

#include "base/crc32.h"

static void test_crc32_of_the_catalogues_check_string(void **state)
{
    assert_int_equal(~bslam_crc32_add(BSLAM_CRC32_START, "123456789", 9), 0xcbf43926u);
}

static void test_crc32_goes_on_where_it_ended(void **state)
{
    const uint32_t first = bslam_crc32_add(BSLAM_CRC32_START, "1234", 4);
    assert_int_equal(~bslam_crc32_add(first, "56789", 5), 0xcbf43926u);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_crc32_of_the_catalogues_check_string),
        cmocka_unit_test(test_crc32_goes_on_where_it_ended),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
