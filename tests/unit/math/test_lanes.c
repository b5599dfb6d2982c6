// Sixteen bytes at a time, against the same number by number. Where there are no lanes there is nothing to
// test.
#include "bslam/math/lanes.h"

#include "support.h"

#if BSLAM_HAS_LANES

enum { ROUNDS = 5000, WORDS = 4, HALVES = 8, BYTES = 16 };

/// A register's content as its numbers.
typedef struct numbers {
    uint32_t words[WORDS];
    int16_t halves[HALVES];
    uint8_t bytes[BYTES];
} numbers_t;

static numbers_t numbers_of(bslam_lanes_t lanes)
{
    numbers_t n;
    bslam_lanes_put(n.bytes, lanes);
    memcpy(n.words, n.bytes, sizeof n.words);
    memcpy(n.halves, n.bytes, sizeof n.halves);
    return n;
}

/// Random lanes, of which many numbers are at the ends of their range.
static bslam_lanes_t random_lanes(unit_random_t *random)
{
    static const uint8_t ends[] = {0, 1, 127, 128, 254, 255};
    uint8_t bytes[BYTES + 1];
    for (int k = 0; k < BYTES; k++) {
        const int i = (int)unit_random(random, 0, 12);
        bytes[k + 1] = (uint8_t)(i < 6 ? ends[i] : unit_random(random, 0, 256));
    }
    return bslam_lanes_at(bytes + 1);  // lanes lie anywhere
}

static int limited(int value, int low, int high)
{
    return value < low ? low : value > high ? high : value;
}

static void test_words_are_each_as_a_number(void **state)
{
    unit_random_t random = {1};
    for (int round = 0; round < ROUNDS; round++) {
        const bslam_lanes_t lanes_a = random_lanes(&random), lanes_b = random_lanes(&random);
        const numbers_t a = numbers_of(lanes_a), b = numbers_of(lanes_b);
        const numbers_t sum = numbers_of(bslam_words_add(lanes_a, lanes_b));
        const numbers_t less = numbers_of(bslam_words_less(lanes_a, lanes_b));
        const numbers_t down = numbers_of(bslam_words_down(lanes_a, 11));
        const numbers_t up = numbers_of(bslam_words_up(lanes_a, 16));
        const numbers_t turned = numbers_of(bslam_words_turned(lanes_a));
        const numbers_t even = numbers_of(bslam_words_even(lanes_a, lanes_b));
        const numbers_t odd = numbers_of(bslam_words_odd(lanes_a, lanes_b));
        const numbers_t same = numbers_of(bslam_lanes_of(a.words[0]));
        for (int k = 0; k < WORDS; k++) {
            assert_int_equal(sum.words[k], a.words[k] + b.words[k]);
            assert_int_equal(less.words[k], a.words[k] - b.words[k]);
            assert_int_equal(down.words[k], a.words[k] >> 11);
            assert_int_equal(up.words[k], a.words[k] << 16);
            assert_int_equal(turned.words[k], a.words[k] >> 16 | a.words[k] << 16);
            assert_int_equal(even.words[k], (k < 2 ? a : b).words[k % 2 * 2]);
            assert_int_equal(odd.words[k], (k < 2 ? a : b).words[k % 2 * 2 + 1]);
            assert_int_equal(same.words[k], a.words[0]);
            assert_int_equal(numbers_of(bslam_lanes_zero()).words[k], 0);
        }
        assert_int_equal(bslam_lanes_word(lanes_a, 0), a.words[0]);
        assert_int_equal(bslam_lanes_word(lanes_a, 1), a.words[1]);
        assert_int_equal(bslam_lanes_word(lanes_a, 2), a.words[2]);
        assert_int_equal(bslam_lanes_word(lanes_a, 3), a.words[3]);
    }
}

static void test_halves_are_each_as_a_number(void **state)
{
    unit_random_t random = {2};
    for (int round = 0; round < ROUNDS; round++) {
        const bslam_lanes_t lanes_a = random_lanes(&random), lanes_b = random_lanes(&random);
        const numbers_t a = numbers_of(lanes_a), b = numbers_of(lanes_b);
        const numbers_t most = numbers_of(bslam_halves_most_of(lanes_a, lanes_b));
        const numbers_t least = numbers_of(bslam_halves_least_of(lanes_a, lanes_b));
        for (int k = 0; k < HALVES; k++) {
            assert_int_equal(most.halves[k], a.halves[k] > b.halves[k] ? a.halves[k] : b.halves[k]);
            assert_int_equal(least.halves[k], a.halves[k] < b.halves[k] ? a.halves[k] : b.halves[k]);
        }
    }
}

static void test_narrower_numbers_are_the_nearest(void **state)
{
    unit_random_t random = {3};
    for (int round = 0; round < ROUNDS; round++) {
        const bslam_lanes_t lanes_a = random_lanes(&random), lanes_b = random_lanes(&random);
        const numbers_t a = numbers_of(lanes_a), b = numbers_of(lanes_b);
        const numbers_t halves = numbers_of(bslam_words_to_halves(lanes_a, lanes_b));
        const numbers_t bytes = numbers_of(bslam_halves_to_bytes(lanes_a, lanes_b));
        for (int k = 0; k < HALVES; k++) {
            const int32_t word = (int32_t)(k < WORDS ? a : b).words[k % WORDS];
            assert_int_equal(halves.halves[k], limited(word, INT16_MIN, INT16_MAX));
        }
        for (int k = 0; k < BYTES; k++) {
            assert_int_equal(bytes.bytes[k], limited((k < HALVES ? a : b).halves[k % HALVES], 0, 255));
        }
    }
}

#else

static void test_words_are_each_as_a_number(void **state)
{
    skip();
}

static void test_halves_are_each_as_a_number(void **state)
{
    skip();
}

static void test_narrower_numbers_are_the_nearest(void **state)
{
    skip();
}

#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_words_are_each_as_a_number),
        cmocka_unit_test(test_halves_are_each_as_a_number),
        cmocka_unit_test(test_narrower_numbers_are_the_nearest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
