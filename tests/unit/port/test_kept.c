#include "support.h"

#include <string.h>

#include "port/kept.c"

/// A flash as a data sheet has it: erased bytes are 0xff, writing only clears bits. After `left` bytes
/// written or areas erased the power is cut: what follows does not happen, and the piece under way is half
/// done.
#define AREA_BYTES 512
#define COUNT 150

static uint8_t areas[BSLAM_SLOTS][AREA_BYTES];
static int left;
static bool is_broken;  // writing does nothing, and says that all is well

static bool cut_erase(void *context, int slot)
{
    memset(areas[slot], 0xff, left > 0 ? AREA_BYTES : AREA_BYTES / 2);
    return left-- > 0;
}

static bool cut_write(void *context, int slot, uint32_t at, const void *bytes, uint32_t count)
{
    assert_int_equal(at % BSLAM_FLASH_PIECE, 0);
    assert_int_equal(count, BSLAM_FLASH_PIECE);
    assert_true(at + count <= AREA_BYTES);
    for (uint32_t i = 0; i < count && !is_broken; i++) {
        if (left-- <= 0) {
            return false;
        }
        areas[slot][at + i] &= ((const uint8_t *)bytes)[i];
    }
    return true;
}

static bool plain_read(void *context, int slot, uint32_t at, void *bytes, uint32_t count)
{
    assert_true(at + count <= AREA_BYTES);
    memcpy(bytes, &areas[slot][at], count);
    return true;
}

static const bslam_flash_t chip = {
    .erase = cut_erase, .write = cut_write, .read = plain_read, .slot_bytes = AREA_BYTES};

static bool has_flash;

const bslam_flash_t *port_flash(void)
{
    return has_flash ? &chip : NULL;
}

static int start(void **state)
{
    has_flash = true;
    memset(areas, 0xff, sizeof areas);
    left = 1 << 30;
    is_broken = false;
    return 0;
}

static void fill(uint8_t bytes[COUNT], int version)
{
    for (int i = 0; i < COUNT; i++) {
        bytes[i] = (uint8_t)(version * 31 + i);
    }
}

/// Which version is kept; -1: none.
static int kept_version(void)
{
    uint8_t found[COUNT], expected[COUNT];
    if (!port_load(found, COUNT)) {
        return -1;
    }
    for (int version = 0; version < 8; version++) {
        fill(expected, version);
        if (memcmp(found, expected, COUNT) == 0) {
            return version;
        }
    }
    fail_msg("a mix was loaded");
    return -2;
}

static bool keep(int version)
{
    uint8_t bytes[COUNT];
    fill(bytes, version);
    return port_save(bytes, COUNT);
}

static void test_the_newest_of_many_saves_is_loaded(void **state)
{
    assert_int_equal(kept_version(), -1);
    for (int version = 0; version < 8; version++) {
        assert_true(keep(version));
        assert_int_equal(kept_version(), version);
    }
}

static void test_power_cut_at_every_byte_leaves_the_old_or_the_new_never_a_mix(void **state)
{
    int olds = 0, news = 0;
    for (int first = 0; first < 2; first++) {  // into either area
        for (int cut = 0; cut <= COUNT + 2 * BSLAM_FLASH_PIECE; cut++) {
            start(state);
            for (int version = 0; version <= first + 1; version++) {
                assert_true(keep(version));
            }
            left = cut;
            const bool said = keep(7);
            left = 1 << 30;
            const int now = kept_version();
            assert_true(now == 7 || (now == first + 1 && !said));
            olds += now != 7;
            news += now == 7;
            assert_true(keep(5));  // and it goes on
            assert_int_equal(kept_version(), 5);
        }
    }
    assert_true(olds > COUNT && news > 0);
}

static void test_any_flipped_bit_of_the_newer_gives_the_older(void **state)
{
    assert_true(keep(1) && keep(2));
    for (int bit = 0; bit < 8 * (BSLAM_FLASH_PIECE + COUNT); bit++) {
        if (bit == 8 * (int)sizeof(head_t)) {
            bit = 8 * BSLAM_FLASH_PIECE;  // what fills the head's piece says nothing
        }
        areas[1][bit / 8] ^= (uint8_t)(1 << bit % 8);
        assert_int_equal(kept_version(), 1);
        areas[1][bit / 8] ^= (uint8_t)(1 << bit % 8);
    }
    assert_int_equal(kept_version(), 2);
}

static void test_a_flash_that_does_not_take_what_is_written_is_found_out(void **state)
{
    assert_true(keep(1));
    is_broken = true;
    assert_false(keep(2));
    assert_int_equal(kept_version(), 1);
}

static void test_bytes_of_another_number_are_none(void **state)
{
    static uint8_t bytes[AREA_BYTES];
    assert_true(keep(1));
    assert_false(kept_load(&chip, bytes, COUNT - 1));
    assert_false(kept_save(&chip, bytes, AREA_BYTES));
}

static void test_a_board_without_flash_keeps_nothing(void **state)
{
    has_flash = false;
    assert_false(keep(1));
    assert_int_equal(kept_version(), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_a_board_without_flash_keeps_nothing, start),
        cmocka_unit_test_setup(test_the_newest_of_many_saves_is_loaded, start),
        cmocka_unit_test_setup(test_power_cut_at_every_byte_leaves_the_old_or_the_new_never_a_mix, start),
        cmocka_unit_test_setup(test_any_flipped_bit_of_the_newer_gives_the_older, start),
        cmocka_unit_test_setup(test_a_flash_that_does_not_take_what_is_written_is_found_out, start),
        cmocka_unit_test_setup(test_bytes_of_another_number_are_none, start),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
