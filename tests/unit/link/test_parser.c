#include "support.h"

#include "link/crc16.h"
#include "link/parser.h"

static bslam_link_parser_t parser;
static uint8_t bytes[BSLAM_LINK_FRAME_MAX];

/// A frame of `count` payload bytes, 0, 1, 2, ... from `first` on.
static size_t make_frame(uint16_t sequence, uint8_t first, int count)
{
    const bslam_link_header_t header = {.type = 9, .sequence = sequence, .time_us = -5};
    bslam_link_writer_t writer;
    bslam_link_begin(&writer, bytes, sizeof bytes, &header);
    for (int i = 0; i < count; i++) {
        bslam_link_put_u8(&writer, (uint8_t)(first + i));
    }
    return bslam_link_end(&writer);
}

/// How many frames these bytes complete.
static int push_all(const uint8_t *data, size_t length)
{
    int frames = 0;
    for (size_t i = 0; i < length; i++) {
        frames += bslam_link_push(&parser, data[i]) ? 1 : 0;
    }
    return frames;
}

static int start(void **state)
{
    parser = (bslam_link_parser_t){0};
    return 0;
}

static uint32_t dropped(void)
{
    const bslam_link_counters_t *c = &parser.counters;
    return c->bad_crc + c->truncated + c->too_long + c->bad_version;
}

/// Whatever came before, the parser takes the next good frame.
static void assert_takes_a_good_frame(void)
{
    const uint32_t before = parser.counters.frames;
    const size_t length = make_frame(77, 3, 5);
    assert_int_equal(push_all(bytes, length), 1);
    assert_int_equal(parser.counters.frames, before + 1);
    assert_int_equal(parser.header.type, 9);
    assert_int_equal(parser.header.sequence, 77);
    assert_int_equal(parser.header.time_us, -5);
    bslam_link_reader_t reader = bslam_link_payload(&parser);
    for (int i = 0; i < 5; i++) {
        assert_int_equal(bslam_link_get_u8(&reader), 3 + i);
    }
    assert_true(bslam_link_is_read(&reader));
}

static void test_link_push_frames_of_every_length_come_back(void **state)
{
    for (int count = 0; count <= BSLAM_LINK_PAYLOAD_MAX; count++) {
        const size_t length = make_frame((uint16_t)count, (uint8_t)count, count);
        assert_int_equal(push_all(bytes, length - 1), 0);
        assert_true(bslam_link_push(&parser, bytes[length - 1]));
        assert_int_equal(parser.header.sequence, count);
        bslam_link_reader_t reader = bslam_link_payload(&parser);
        for (int i = 0; i < count; i++) {
            assert_int_equal(bslam_link_get_u8(&reader), (uint8_t)(count + i));
        }
        assert_true(bslam_link_is_read(&reader));
    }
    assert_int_equal(dropped(), 0);
}

static void test_link_push_values_come_back(void **state)
{
    const bslam_link_header_t header = {.type = 1};
    bslam_link_writer_t writer;
    bslam_link_begin(&writer, bytes, sizeof bytes, &header);
    bslam_link_put_u16(&writer, 0xfffe);
    bslam_link_put_u32(&writer, 0xfffefdfc);
    bslam_link_put_i32(&writer, INT32_MIN);
    bslam_link_put_i32(&writer, -12345678);
    bslam_link_put_real(&writer, real(-0.15625));
    assert_int_equal(push_all(bytes, bslam_link_end(&writer)), 1);
    bslam_link_reader_t reader = bslam_link_payload(&parser);
    assert_int_equal(bslam_link_get_u16(&reader), 0xfffe);
    assert_int_equal(bslam_link_get_u32(&reader), 0xfffefdfc);
    assert_int_equal(bslam_link_get_i32(&reader), INT32_MIN);
    assert_int_equal(bslam_link_get_i32(&reader), -12345678);
    assert_true(bslam_link_get_real(&reader) == real(-0.15625));
    assert_true(bslam_link_is_read(&reader));
}

static void test_link_get_behind_the_end_is_0_and_failed(void **state)
{
    push_all(bytes, make_frame(1, 0xff, 1));
    bslam_link_reader_t reader = bslam_link_payload(&parser);
    assert_false(bslam_link_is_read(&reader));
    assert_int_equal(bslam_link_get_u32(&reader), 0xff);
    assert_true(reader.failed);
    assert_false(bslam_link_is_read(&reader));
}

static void test_link_push_any_flipped_bit_is_dropped_and_counted(void **state)
{
    const size_t length = make_frame(0x100, 0, 40);
    uint8_t good[128];
    memcpy(good, bytes, length);
    for (size_t bit = 0; bit < 8 * length; bit++) {
        uint8_t bad[128];
        memcpy(bad, good, length);
        bad[bit / 8] = (uint8_t)(bad[bit / 8] ^ 1u << bit % 8);
        const uint32_t before = dropped();
        assert_int_equal(push_all(bad, length), 0);
        (void)bslam_link_push(&parser, 0);  // a flip may have taken the delimiter
        assert_true(dropped() > before);
        assert_takes_a_good_frame();
    }
}

static void test_link_push_any_cut_frame_is_dropped_and_counted(void **state)
{
    const size_t length = make_frame(0x100, 0, 40);
    uint8_t good[128];
    memcpy(good, bytes, length);
    for (size_t kept = 1; kept + 1 < length; kept++) {
        const uint32_t before = dropped();
        assert_int_equal(push_all(good, kept), 0);
        assert_false(bslam_link_push(&parser, 0));
        assert_int_equal(dropped(), before + 1);
        assert_takes_a_good_frame();
    }
}

static void test_link_push_shorter_than_a_header_is_truncated(void **state)
{
    static const uint8_t cut[] = {0x01, 0x00};
    assert_int_equal(push_all(cut, sizeof cut), 0);
    assert_int_equal(parser.counters.truncated, 1);
    assert_takes_a_good_frame();
}

static void test_link_push_delimiters_alone_are_nothing(void **state)
{
    static const uint8_t zeros[9];
    assert_int_equal(push_all(zeros, sizeof zeros), 0);
    assert_int_equal(dropped(), 0);
    assert_takes_a_good_frame();
}

static void test_link_push_a_flood_without_delimiter_is_counted_once(void **state)
{
    for (int i = 0; i < 20 * BSLAM_LINK_FRAME_MAX; i++) {
        assert_false(bslam_link_push(&parser, 0xff));
    }
    assert_int_equal(parser.counters.too_long, 1);
    (void)bslam_link_push(&parser, 0);
    assert_int_equal(dropped(), 1);
    assert_takes_a_good_frame();
}

/// A good frame but for its first byte.
static void test_link_push_another_version_is_dropped_and_counted(void **state)
{
    size_t length = make_frame(0x101, 1, 3);
    assert_int_equal(bytes[1], BSLAM_LINK_VERSION);
    bslam_link_header_t header = {.type = 9};
    bslam_link_writer_t writer;
    bslam_link_begin(&writer, bytes, sizeof bytes, &header);
    bytes[1] = BSLAM_LINK_VERSION + 1;
    writer.crc = bslam_crc16_add(BSLAM_CRC16_START, BSLAM_LINK_VERSION + 1);
    writer.crc = bslam_crc16_add(writer.crc, 9);
    for (int i = 0; i < 10; i++) {
        writer.crc = bslam_crc16_add(writer.crc, 0);
    }
    length = bslam_link_end(&writer);
    assert_int_equal(push_all(bytes, length), 0);
    assert_int_equal(parser.counters.bad_version, 1);
    assert_int_equal(dropped(), 1);
    assert_takes_a_good_frame();
}

static void test_link_push_noise_never_passes_and_never_blocks(void **state)
{
    unit_random_t random = {.state = 20};
    for (int i = 0; i < 200000; i++) {
        (void)bslam_link_push(&parser, (uint8_t)unit_random(&random, 0, 256));
    }
    // One in 65536 of the frames of noise has a good CRC by chance, and one in 256 of those the version.
    assert_int_equal(parser.counters.frames, 0);
    (void)bslam_link_push(&parser, 0);
    assert_takes_a_good_frame();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_link_push_frames_of_every_length_come_back, start),
        cmocka_unit_test_setup(test_link_push_values_come_back, start),
        cmocka_unit_test_setup(test_link_get_behind_the_end_is_0_and_failed, start),
        cmocka_unit_test_setup(test_link_push_any_flipped_bit_is_dropped_and_counted, start),
        cmocka_unit_test_setup(test_link_push_any_cut_frame_is_dropped_and_counted, start),
        cmocka_unit_test_setup(test_link_push_shorter_than_a_header_is_truncated, start),
        cmocka_unit_test_setup(test_link_push_delimiters_alone_are_nothing, start),
        cmocka_unit_test_setup(test_link_push_a_flood_without_delimiter_is_counted_once, start),
        cmocka_unit_test_setup(test_link_push_another_version_is_dropped_and_counted, start),
        cmocka_unit_test_setup(test_link_push_noise_never_passes_and_never_blocks, start),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
