#include "support.h"

#include "link/crc16.h"

static uint16_t crc_of(const char *text)
{
    uint16_t crc = BSLAM_CRC16_START;
    for (size_t i = 0; i < strlen(text); i++) {
        crc = bslam_crc16_add(crc, (uint8_t)text[i]);
    }
    return bslam_crc16_end(crc);
}

/// The check value of the catalogue of CRCs (reveng, CRC-16/GENIBUS).
static void test_crc16_add_check_string_gives_the_catalogues_value(void **state)
{
    assert_int_equal(crc_of("123456789"), 0xd64e);
    assert_int_equal(crc_of(""), 0);
}

/// Bit by bit, as the polynomial's division is defined.
static uint16_t by_definition(uint16_t crc, uint8_t byte)
{
    uint32_t c = crc ^ (uint32_t)byte << 8;
    for (int bit = 0; bit < 8; bit++) {
        c = (c & 0x8000u) != 0 ? (c << 1 ^ 0x1021u) & 0xffffu : c << 1;
    }
    return (uint16_t)c;
}

static void test_crc16_add_every_state_and_byte_is_the_definition(void **state)
{
    for (uint32_t crc = 0; crc < 0x10000; crc += 251) {
        for (uint32_t byte = 0; byte < 256; byte++) {
            assert_int_equal(bslam_crc16_add((uint16_t)crc, (uint8_t)byte),
                             by_definition((uint16_t)crc, (uint8_t)byte));
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_crc16_add_check_string_gives_the_catalogues_value),
        cmocka_unit_test(test_crc16_add_every_state_and_byte_is_the_definition),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
