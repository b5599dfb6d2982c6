#include "support.h"

#include "link/frame.h"

/// Made by the Python packages cobs and binascii, which share nothing with this code.
static void test_link_end_a_frame_with_zeros_is_the_golden_bytes(void **state)
{
    static const uint8_t golden[] = {0x0d, 0x01, 0x03, 0x34, 0x12, 0x08, 0x07, 0x06, 0x05, 0x04,
                                     0x03, 0x02, 0x01, 0x02, 0x11, 0x03, 0x3c, 0xb9, 0x00};
    const bslam_link_header_t header = {.type = 3, .sequence = 0x1234, .time_us = 0x0102030405060708};
    uint8_t bytes[64];
    bslam_link_writer_t writer;
    bslam_link_begin(&writer, bytes, sizeof bytes, &header);
    bslam_link_put_u8(&writer, 0);
    bslam_link_put_u16(&writer, 0x0011);
    assert_int_equal(bslam_link_end(&writer), sizeof golden);
    assert_memory_equal(bytes, golden, sizeof golden);
}

static void test_link_end_an_empty_payload_is_the_golden_bytes(void **state)
{
    static const uint8_t golden[] = {0x04, 0x01, 0x02, 0x07, 0x01, 0x01, 0x01, 0x01,
                                     0x01, 0x01, 0x01, 0x01, 0x03, 0xc4, 0x3a, 0x00};
    const bslam_link_header_t header = {.type = 2, .sequence = 7};
    uint8_t bytes[sizeof golden];
    bslam_link_writer_t writer;
    bslam_link_begin(&writer, bytes, sizeof bytes, &header);
    assert_int_equal(bslam_link_end(&writer), sizeof golden);
    assert_memory_equal(bytes, golden, sizeof golden);
}

static void test_link_put_values_stand_low_byte_first(void **state)
{
    static const uint8_t golden[] = {0x22, 0x11, 0x66, 0x55, 0x44, 0x33, 0xfe, 0xff, 0xff, 0xff, 0x88,
                                     0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11, 0xdb, 0x0f, 0x49, 0xc0};
    // No zero in the header either: the content stands in one block, as it is.
    const bslam_link_header_t header = {.type = 1, .sequence = 0x0101, .time_us = 0x0101010101010101};
    uint8_t bytes[64];
    bslam_link_writer_t writer;
    bslam_link_begin(&writer, bytes, sizeof bytes, &header);
    bslam_link_put_u16(&writer, 0x1122);
    bslam_link_put_u32(&writer, 0x33445566);
    bslam_link_put_i32(&writer, -2);
    bslam_link_put_u64(&writer, 0x1122334455667788);
    bslam_link_put_real(&writer, real(-3.14159274));  // float32's pi
    assert_true(bslam_link_end(&writer) > 0);
    assert_memory_equal(&bytes[1 + BSLAM_LINK_HEADER_BYTES], golden, sizeof golden);
}

/// Without a single zero COBS needs a code every 254 bytes.
static void test_link_end_the_longest_frame_fits_its_room_exactly(void **state)
{
    static uint8_t bytes[BSLAM_LINK_FRAME_MAX + 1];
    const bslam_link_header_t header = {.type = 1, .sequence = 0x0101, .time_us = 0x0101010101010101};
    bslam_link_writer_t writer;
    bytes[BSLAM_LINK_FRAME_MAX] = 0x5a;
    bslam_link_begin(&writer, bytes, BSLAM_LINK_FRAME_MAX, &header);
    for (int i = 0; i < BSLAM_LINK_PAYLOAD_MAX; i++) {
        bslam_link_put_u8(&writer, 0xff);
    }
    const size_t length = bslam_link_end(&writer);
    assert_in_range(length, BSLAM_LINK_CONTENT_MAX + 2, BSLAM_LINK_FRAME_MAX);
    assert_int_equal(bytes[length - 1], 0);
    for (size_t i = 0; i + 1 < length; i++) {
        assert_int_not_equal(bytes[i], 0);
    }
    assert_int_equal(bytes[BSLAM_LINK_FRAME_MAX], 0x5a);
}

static void test_link_end_any_room_too_small_is_0_and_nothing_is_overrun(void **state)
{
    const bslam_link_header_t header = {.type = 1};
    uint8_t whole[320];
    uint8_t bytes[320];
    bslam_link_writer_t writer;
    for (size_t room = 0; room <= sizeof whole; room++) {
        memset(bytes, 0x5a, sizeof bytes);
        bslam_link_begin(&writer, bytes, room, &header);
        for (int i = 0; i < 280; i++) {
            bslam_link_put_u8(&writer, (uint8_t)(i < 270 ? 1 : 0));
        }
        const size_t length = bslam_link_end(&writer);
        assert_true(length == 0 || length <= room);
        assert_int_equal(length != 0, room >= 297);  // 294 bytes of content, 2 codes, the delimiter
        for (size_t i = room; i < sizeof bytes; i++) {
            assert_int_equal(bytes[i], 0x5a);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_link_end_a_frame_with_zeros_is_the_golden_bytes),
        cmocka_unit_test(test_link_end_an_empty_payload_is_the_golden_bytes),
        cmocka_unit_test(test_link_put_values_stand_low_byte_first),
        cmocka_unit_test(test_link_end_the_longest_frame_fits_its_room_exactly),
        cmocka_unit_test(test_link_end_any_room_too_small_is_0_and_nothing_is_overrun),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
