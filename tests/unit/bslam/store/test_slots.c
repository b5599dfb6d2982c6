#include "base/crc32.h"
#include "covariance.h"
#include "kept_map.h"

static bslam_slam_t old_slam;
static bslam_slam_t new_slam;
static bslam_slam_t loaded;
static kept_flash_t flash;
static uint8_t old_bytes[KEPT_BYTES_MAX];
static uint8_t new_bytes[KEPT_BYTES_MAX];
static uint32_t old_size;
static uint32_t new_size;

static void save(const bslam_slam_t *slam, bslam_status_t expected)
{
    const bslam_flash_t interface = kept_flash(&flash);
    bslam_map_fault_t fault;
    assert_int_equal(bslam_slots_save(&interface, slam, &fault), expected);
}

static bslam_status_t load(bslam_map_fault_t *fault)
{
    const bslam_flash_t interface = kept_flash(&flash);
    kept_empty(&loaded, NULL);
    return bslam_slots_load(&interface, &loaded, BSLAM_MAP_LIVING, fault);
}

/// What is loaded, as bytes again: the old map, the new one, or the test fails.
static bool loads_new(void)
{
    static uint8_t bytes[KEPT_BYTES_MAX];
    bslam_map_fault_t fault;
    flash.left = UINT32_MAX;
    assert_int_equal(load(&fault), BSLAM_OK);
    const uint32_t size = kept_write(&loaded, bytes);
    const bool is_old = size == old_size && memcmp(bytes, old_bytes, size) == 0;
    const bool is_new = size == new_size && memcmp(bytes, new_bytes, size) == 0;
    assert_true(is_old || is_new);
    return is_new;
}

/// A pipeline whose map was once a blob, so that its numbers are float32 whatever the build: its bytes stay.
static uint32_t make_kept(bslam_slam_t *slam, int objects, uint8_t bytes[KEPT_BYTES_MAX])
{
    kept_make(slam, NULL, objects);
    const bslam_map_source_t source = map_from_memory(bytes, kept_write(slam, bytes));
    bslam_map_fault_t fault;
    assert_int_equal(bslam_map_load(slam, &source, BSLAM_MAP_LIVING, &fault), BSLAM_OK);
    return kept_write(slam, bytes);
}

static int setup(void **state)
{
    old_size = make_kept(&old_slam, 2, old_bytes);
    new_size = make_kept(&new_slam, 3, new_bytes);
    memset(&flash, 0xff, sizeof flash);
    flash.left = UINT32_MAX;
    return 0;
}

static void test_slots_load_nothing_saved_says_no_map(void **state)
{
    bslam_map_fault_t fault;
    assert_int_equal(load(&fault), BSLAM_E_MAP);
    assert_int_equal(fault, BSLAM_MAP_NO_MAP);
}

static void test_slots_load_gives_the_map_saved_last(void **state)
{
    save(&old_slam, BSLAM_OK);
    assert_false(loads_new());
    for (int turn = 0; turn < 5; turn++) {
        save(&new_slam, BSLAM_OK);
        assert_true(loads_new());
        save(&old_slam, BSLAM_OK);
        assert_false(loads_new());
    }
}

/// Bytes of the last piece that say nothing.
#define FILLED (BSLAM_FLASH_PIECE - 16u)

/// Bytes that a save of the new map erases and writes.
static uint32_t save_takes(void)
{
    static kept_flash_t before;
    before = flash;
    const uint32_t used = flash.used;
    save(&new_slam, BSLAM_OK);
    const uint32_t taken = flash.used - used;
    flash = before;
    return taken;
}

static void test_slots_save_cut_at_any_byte_leaves_the_old_map_or_the_new(void **state)
{
    static kept_flash_t before;
    save(&new_slam, BSLAM_OK);
    save(&old_slam, BSLAM_OK);  // both slots are used: the save must erase one
    before = flash;
    const uint32_t takes = save_takes();
    uint32_t old_maps = 0;
    for (uint32_t cut = 0; cut < takes; cut++) {
        flash = before;
        flash.left = cut;
        save(&new_slam, BSLAM_E_MAP);
        old_maps += loads_new() ? 0u : 1u;
        if (cut % 97 == 0) {  // and the next save succeeds
            save(&new_slam, BSLAM_OK);
            assert_true(loads_new());
        }
    }
    assert_int_equal(old_maps, takes - FILLED);  // the head's last byte makes it the new one
    flash = before;
    flash.left = takes;
    save(&new_slam, BSLAM_OK);
    assert_true(loads_new());
    print_message("power cuts: at each of %u bytes, 0 mixed\n", takes);
}

/// Power fails in a save, and again in the next one. Slots as small as the maps allow, to have few bytes.
static void test_slots_saves_cut_at_any_two_bytes_leave_the_old_map(void **state)
{
    static kept_flash_t before;
    static kept_flash_t between;
    flash.slot_bytes = (new_size + 2 * BSLAM_FLASH_PIECE) / BSLAM_FLASH_PIECE * BSLAM_FLASH_PIECE;
    save(&new_slam, BSLAM_OK);
    save(&old_slam, BSLAM_OK);
    before = flash;
    const uint32_t takes = save_takes() - FILLED;
    uint32_t pairs = 0;
    for (uint32_t first = 0; first < takes; first += unit_every(61)) {
        flash = before;
        flash.left = first;
        save(&new_slam, BSLAM_E_MAP);
        between = flash;
        for (uint32_t second = 0; second < takes; second += unit_every(67)) {
            flash = between;
            flash.left = second;
            save(&new_slam, BSLAM_E_MAP);
            assert_false(loads_new());
            pairs++;
        }
        flash = between;
        flash.left = takes + FILLED;
        save(&new_slam, BSLAM_OK);
        assert_true(loads_new());
    }
    print_message("power cuts: %u pairs of %u, 0 mixed\n", pairs, takes * takes);
}

static void test_slots_damaged_newer_slot_gives_the_older_and_is_overwritten_next(void **state)
{
    save(&old_slam, BSLAM_OK);
    save(&new_slam, BSLAM_OK);
    for (int slot = 0; slot < BSLAM_SLOTS; slot++) {
        if (memcmp(&flash.slots[slot][BSLAM_FLASH_PIECE], new_bytes, new_size) == 0) {
            flash.slots[slot][BSLAM_FLASH_PIECE + 40] ^= 4;
        }
    }
    assert_false(loads_new());
    save(&new_slam, BSLAM_OK);
    assert_true(loads_new());
}

/// What cannot be loaded is not saved; the map that was saved last stays.
static void test_slots_map_whose_covariance_is_none_is_not_saved(void **state)
{
    save(&old_slam, BSLAM_OK);
    bslam_map_fault_t fault;
    const bslam_flash_t interface = kept_flash(&flash);
    covariance_break(&new_slam.ekf, new_slam.ekf.base_dim, 1);
    for (int turn = 0; turn < 3; turn++) {
        assert_int_equal(bslam_slots_save(&interface, &new_slam, &fault), BSLAM_E_MAP);
        assert_int_equal(fault, BSLAM_MAP_COVARIANCE);
        assert_false(loads_new());
    }
}

/// A head whose check sum is right, but which says more than the area holds, is no save.
static void test_slots_head_that_says_too_much_is_no_save(void **state)
{
    save(&old_slam, BSLAM_OK);
    save(&new_slam, BSLAM_OK);
    for (int slot = 0; slot < BSLAM_SLOTS; slot++) {
        uint8_t *head = flash.slots[slot];
        if (memcmp(&head[BSLAM_FLASH_PIECE], new_bytes, new_size) == 0) {
            const uint32_t length = sizeof flash.slots[0] - BSLAM_FLASH_PIECE + 1;
            memcpy(&head[8], &length, 4);
            const uint32_t crc = ~bslam_crc32_add(BSLAM_CRC32_START, head, 12);
            memcpy(&head[12], &crc, 4);
        }
    }
    assert_false(loads_new());
}

/// Whole pieces are written: an area that ends within the map's last one does not hold it.
static void test_slots_area_that_ends_within_the_last_piece_is_too_small(void **state)
{
    save(&old_slam, BSLAM_OK);
    bslam_flash_t small = kept_flash(&flash);
    small.slot_bytes = BSLAM_FLASH_PIECE + new_size;
    assert_true(small.slot_bytes % BSLAM_FLASH_PIECE != 0);
    bslam_map_fault_t fault;
    assert_int_equal(bslam_slots_save(&small, &new_slam, &fault), BSLAM_E_MAP);
    assert_int_equal(fault, BSLAM_MAP_UNREADABLE);
    assert_false(loads_new());
}

static void test_slots_map_that_ends_with_a_piece_is_saved_as_any(void **state)
{
    static bslam_slam_t slam;
    static uint8_t kept[KEPT_BYTES_MAX];
    static uint8_t again[KEPT_BYTES_MAX];
    bslam_map_fault_t fault;
    // One of these maps ends so, whatever a beacon and its values take.
    uint32_t size = 1;
    for (int points = 1; points <= 6 && size % BSLAM_FLASH_PIECE != 0; points++) {
        (void)make_kept(&slam, points, kept);
        size = kept_write(&slam, kept);
        for (int k = 0; k < 10 && size % BSLAM_FLASH_PIECE != 0; k++) {
            assert_int_equal(bslam_slam_add_known_beacon(&slam, 70 + k, 1, real(2 + k)), BSLAM_OK);
            size = kept_write(&slam, kept);
        }
    }
    assert_int_equal(size % BSLAM_FLASH_PIECE, 0);
    save(&slam, BSLAM_OK);
    assert_int_equal(load(&fault), BSLAM_OK);
    assert_int_equal(kept_write(&loaded, again), size);
    assert_memory_equal(again, kept, size);
}

// ---- flash of any word ------------------------------------------------------------------------------------

/// Programmed word by word, each once between two erases.
typedef struct word_flash {
    uint8_t slots[BSLAM_SLOTS][KEPT_BYTES_MAX / 4];
    bool is_written[BSLAM_SLOTS][KEPT_BYTES_MAX / 4];
    uint32_t word_bytes;
    uint8_t erased;
} word_flash_t;

static bool erase_words(void *context, int slot)
{
    word_flash_t *words = context;
    memset(words->slots[slot], words->erased, sizeof words->slots[slot]);
    memset(words->is_written[slot], 0, sizeof words->is_written[slot]);
    return true;
}

static bool write_words(void *context, int slot, uint32_t at, const void *bytes, uint32_t count)
{
    word_flash_t *words = context;
    assert_int_equal(at % words->word_bytes, 0);
    assert_int_equal(count % words->word_bytes, 0);
    assert_int_equal((uintptr_t)bytes % 8, 0);
    for (uint32_t i = at; i < at + count; i++) {
        assert_false(words->is_written[slot][i]);
        words->is_written[slot][i] = true;
    }
    memcpy(&words->slots[slot][at], bytes, count);
    return true;
}

static bool read_words(void *context, int slot, uint32_t at, void *bytes, uint32_t count)
{
    const word_flash_t *words = context;
    memcpy(bytes, &words->slots[slot][at], count);
    return true;
}

static void test_slots_keep_a_map_in_flash_of_any_word_and_either_erased_value(void **state)
{
    static word_flash_t words;
    for (uint32_t word_bytes = 1; word_bytes <= 64; word_bytes *= 2) {
        for (int erased = 0; erased < 256; erased += 255) {
            words = (word_flash_t){.word_bytes = word_bytes, .erased = (uint8_t)erased};
            const bslam_flash_t interface = {erase_words, write_words, read_words, &words,
                                             sizeof words.slots[0]};
            bslam_map_fault_t fault;
            assert_true(erase_words(&words, 0) && erase_words(&words, 1));
            kept_empty(&loaded, NULL);
            assert_int_equal(bslam_slots_load(&interface, &loaded, BSLAM_MAP_LIVING, &fault), BSLAM_E_MAP);
            assert_int_equal(fault, BSLAM_MAP_NO_MAP);
            for (int save_number = 0; save_number < 4; save_number++) {
                const bslam_slam_t *slam = save_number % 2 == 0 ? &old_slam : &new_slam;
                assert_int_equal(bslam_slots_save(&interface, slam, &fault), BSLAM_OK);
                assert_int_equal(bslam_slots_load(&interface, &loaded, BSLAM_MAP_LIVING, &fault), BSLAM_OK);
                assert_int_equal(loaded.ekf.beacon_count, slam->ekf.beacon_count);
            }
        }
    }
}

static void test_slots_area_smaller_than_a_head_or_a_map_is_not_touched(void **state)
{
    save(&old_slam, BSLAM_OK);
    bslam_flash_t small = kept_flash(&flash);
    const uint32_t used = flash.used;
    const uint32_t sizes[] = {0, 15, BSLAM_FLASH_PIECE - 1, BSLAM_FLASH_PIECE, new_size};
    for (int i = 0; i < COUNT_OF(sizes); i++) {
        bslam_map_fault_t fault;
        small.slot_bytes = sizes[i];
        assert_int_equal(bslam_slots_save(&small, &new_slam, &fault), BSLAM_E_MAP);
        assert_int_equal(fault, BSLAM_MAP_UNREADABLE);
        assert_int_equal(flash.used, used);
    }
}

static void test_slots_a_map_larger_than_a_slot_is_refused_and_the_old_stays(void **state)
{
    save(&old_slam, BSLAM_OK);
    bslam_flash_t small = kept_flash(&flash);
    small.slot_bytes = new_size + 8;
    bslam_map_fault_t fault;
    assert_int_equal(bslam_slots_save(&small, &new_slam, &fault), BSLAM_E_MAP);
    assert_int_equal(fault, BSLAM_MAP_UNREADABLE);
    assert_false(loads_new());
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_slots_load_nothing_saved_says_no_map, setup),
        cmocka_unit_test_setup(test_slots_load_gives_the_map_saved_last, setup),
        cmocka_unit_test_setup(test_slots_save_cut_at_any_byte_leaves_the_old_map_or_the_new, setup),
        cmocka_unit_test_setup(test_slots_saves_cut_at_any_two_bytes_leave_the_old_map, setup),
        cmocka_unit_test_setup(test_slots_damaged_newer_slot_gives_the_older_and_is_overwritten_next, setup),
        cmocka_unit_test_setup(test_slots_map_whose_covariance_is_none_is_not_saved, setup),
        cmocka_unit_test_setup(test_slots_head_that_says_too_much_is_no_save, setup),
        cmocka_unit_test_setup(test_slots_area_that_ends_within_the_last_piece_is_too_small, setup),
        cmocka_unit_test_setup(test_slots_map_that_ends_with_a_piece_is_saved_as_any, setup),
        cmocka_unit_test_setup(test_slots_keep_a_map_in_flash_of_any_word_and_either_erased_value, setup),
        cmocka_unit_test_setup(test_slots_area_smaller_than_a_head_or_a_map_is_not_touched, setup),
        cmocka_unit_test_setup(test_slots_a_map_larger_than_a_slot_is_refused_and_the_old_stays, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
