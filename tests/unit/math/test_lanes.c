// Sixteen bytes at a time, against the same number by number. Where there are no lanes there is nothing to
// test.
#include <math.h>

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
        const numbers_t shifted = numbers_of(bslam_words_shifted_to_zero(lanes_a, 10));
        const numbers_t same = numbers_of(bslam_lanes_of(a.words[0]));
        const numbers_t twice = numbers_of(bslam_words_odd_twice(lanes_a));
        const numbers_t lower = numbers_of(bslam_words_lower_in_turn(lanes_a, lanes_b));
        const numbers_t upper = numbers_of(bslam_words_upper_in_turn(lanes_a, lanes_b));
        const numbers_t given =
            numbers_of(bslam_lanes_of_words(a.words[3], b.words[0], a.words[1], b.words[2]));
        for (int k = 0; k < WORDS; k++) {
            assert_int_equal(sum.words[k], a.words[k] + b.words[k]);
            assert_int_equal(less.words[k], a.words[k] - b.words[k]);
            assert_int_equal(down.words[k], a.words[k] >> 11);
            assert_int_equal(up.words[k], a.words[k] << 16);
            assert_int_equal((int32_t)shifted.words[k], (int32_t)a.words[k] / 1024);
            assert_int_equal(turned.words[k], a.words[k] >> 16 | a.words[k] << 16);
            assert_int_equal(even.words[k], (k < 2 ? a : b).words[k % 2 * 2]);
            assert_int_equal(odd.words[k], (k < 2 ? a : b).words[k % 2 * 2 + 1]);
            assert_int_equal(same.words[k], a.words[0]);
            assert_int_equal(twice.words[k], a.words[k / 2 * 2 + 1]);
            assert_int_equal(lower.words[k], (k % 2 == 0 ? a : b).words[k / 2]);
            assert_int_equal(upper.words[k], (k % 2 == 0 ? a : b).words[2 + k / 2]);
            assert_int_equal(given.words[k], (k % 2 == 0 ? a : b).words[(k + 3) % WORDS]);
            assert_int_equal(numbers_of(bslam_lanes_zero()).words[k], 0);
        }
        assert_int_equal(bslam_words_sum(lanes_a),
                         (int32_t)(a.words[0] + a.words[1] + a.words[2] + a.words[3]));
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
        const numbers_t sum = numbers_of(bslam_halves_add(lanes_a, lanes_b));
        const numbers_t up = numbers_of(bslam_halves_up(lanes_a, 7));
        const numbers_t lower = numbers_of(bslam_halves_lower_in_turn(lanes_a, lanes_b));
        const numbers_t upper = numbers_of(bslam_halves_upper_in_turn(lanes_a, lanes_b));
        const numbers_t minus = numbers_of(bslam_halves_minus(lanes_a, lanes_b));
        const numbers_t negative = numbers_of(bslam_halves_are_negative(lanes_a));
        const numbers_t within = numbers_of(bslam_halves_within(lanes_a, -8, 40));
        const numbers_t shifted = numbers_of(bslam_halves_shifted_to_zero(lanes_a, 3));
        const numbers_t times = numbers_of(bslam_halves_times(lanes_a, 171));
        const numbers_t down = numbers_of(bslam_halves_down(lanes_a, 11));
        int halves_sum = 0;
        for (int k = 0; k < HALVES; k++) {
            halves_sum += a.halves[k];
        }
        assert_int_equal(bslam_halves_sum(lanes_a), halves_sum);
        const numbers_t dots = numbers_of(bslam_halves_dots(lanes_a, lanes_b));
        for (int k = 0; k < WORDS; k++) {
            const int64_t dot = (int64_t)a.halves[2 * k] * b.halves[2 * k] +
                                (int64_t)a.halves[2 * k + 1] * b.halves[2 * k + 1];
            assert_int_equal(dots.words[k], (uint32_t)dot);
        }
        for (int k = 0; k < HALVES; k++) {
            assert_int_equal(sum.halves[k], (int16_t)(a.halves[k] + b.halves[k]));
            assert_int_equal(minus.halves[k], (int16_t)(a.halves[k] - b.halves[k]));
            assert_int_equal(negative.halves[k], a.halves[k] < 0 ? -1 : 0);
            assert_int_equal(within.halves[k], limited(a.halves[k], -8, 40));
            assert_int_equal(shifted.halves[k], a.halves[k] / 8);
            assert_int_equal(times.halves[k], (int16_t)(a.halves[k] * 171));
            assert_int_equal(down.halves[k], (uint16_t)a.halves[k] >> 11);
            assert_int_equal(up.halves[k], (int16_t)((uint32_t)a.halves[k] << 7));
            assert_int_equal(lower.halves[k], (k % 2 == 0 ? a : b).halves[k / 2]);
            assert_int_equal(upper.halves[k], (k % 2 == 0 ? a : b).halves[4 + k / 2]);
            assert_int_equal(most.halves[k], a.halves[k] > b.halves[k] ? a.halves[k] : b.halves[k]);
            assert_int_equal(least.halves[k], a.halves[k] < b.halves[k] ? a.halves[k] : b.halves[k]);
        }
    }
}

static void test_lanes_bytes_are_each_as_a_number(void **state)
{
    unit_random_t random = {4};
    for (int round = 0; round < ROUNDS; round++) {
        const bslam_lanes_t lanes_a = random_lanes(&random), lanes_b = random_lanes(&random);
        const numbers_t a = numbers_of(lanes_a), b = numbers_of(lanes_b);
        const numbers_t less = numbers_of(bslam_lanes_less(lanes_a, lanes_b));
        const numbers_t wrapped = numbers_of(bslam_lanes_wrapped_less(lanes_a, lanes_b));
        const numbers_t plus = numbers_of(bslam_lanes_plus(lanes_a, lanes_b));
        const numbers_t least = numbers_of(bslam_lanes_least(lanes_a, lanes_b));
        const numbers_t apart = numbers_of(bslam_lanes_apart(lanes_a, lanes_b));
        const numbers_t mean = numbers_of(bslam_lanes_mean(lanes_a, lanes_b));
        const numbers_t lower = numbers_of(bslam_bytes_lower_in_turn(lanes_a, lanes_b));
        const numbers_t upper = numbers_of(bslam_bytes_upper_in_turn(lanes_a, lanes_b));
        const numbers_t evens = numbers_of(bslam_bytes_signed_evens(lanes_a));
        const numbers_t signed_lower = numbers_of(bslam_bytes_signed_lower(lanes_a));
        const numbers_t signed_upper = numbers_of(bslam_bytes_signed_upper(lanes_a));
        const numbers_t odds = numbers_of(bslam_bytes_signed_odds(lanes_a));
        const numbers_t positive = numbers_of(bslam_bytes_are_positive(lanes_a));
        const numbers_t pairs = numbers_of(bslam_lanes_of_pairs(a.bytes, round % 3));
        const int count = round % 20 - 2;
        const numbers_t first = numbers_of(bslam_lanes_first(count));
        const numbers_t half = numbers_of(bslam_lanes_half_at(a.bytes));
        int bytes_sum = round;
        for (int k = 0; k < BYTES; k++) {
            const int x = a.bytes[k], y = b.bytes[k];
            bytes_sum += x;
            assert_int_equal(positive.bytes[k], (int8_t)x > 0 ? 255 : 0);
            assert_int_equal(pairs.bytes[k], a.bytes[k / 2 * (round % 3) + k % 2]);
            assert_int_equal(first.bytes[k], k < count ? 255 : 0);
            assert_int_equal(half.bytes[k], k < 8 ? x : 0);
            assert_int_equal(bslam_bytes_are_zero(lanes_a) >> k & 1, x == 0 ? 1 : 0);
            assert_int_equal(less.bytes[k], limited(x - y, 0, 255));
            assert_int_equal(wrapped.bytes[k], (uint8_t)(x - y));
            assert_int_equal(plus.bytes[k], limited(x + y, 0, 255));
            assert_int_equal(least.bytes[k], x < y ? x : y);
            assert_int_equal(apart.bytes[k], x < y ? y - x : x - y);
            assert_int_equal(mean.bytes[k], (x + y) / 2);
            assert_int_equal(lower.bytes[k], (k % 2 == 0 ? a : b).bytes[k / 2]);
            assert_int_equal(upper.bytes[k], (k % 2 == 0 ? a : b).bytes[8 + k / 2]);
            assert_int_equal((k < 8 ? signed_lower : signed_upper).halves[k % 8], (int8_t)x);
            assert_int_equal((k % 2 == 0 ? evens : odds).halves[k / 2], (int8_t)x);
        }
        const bslam_lanes_t before = bslam_lanes_of_words((uint32_t)round, 0, 0, 0);
        assert_int_equal(bslam_lanes_sum(bslam_lanes_sum_add(lanes_a, before)), bytes_sum);
    }
}

static void test_quotients_are_rounded_down(void **state)
{
    for (uint32_t b = 1; b <= 500; b += b < 20 ? 1 : 7) {
        for (uint32_t a = 0; a < 1 << 15; a += 4) {
            const numbers_t all = numbers_of(
                bslam_words_quotients(bslam_lanes_of_words(a, a + 1, a + 2, a + 3), bslam_lanes_of(b)));
            for (uint32_t k = 0; k < WORDS; k++) {
                assert_int_equal(all.words[k], (a + k) / b);
            }
        }
    }
}

static void test_floats_are_each_as_a_number(void **state)
{
    const float a[WORDS] = {-7.75f, NAN, 2.5f, 3e9f}, b[WORDS] = {3.0f, 1.0f, -0.1f, 7.0f};
    float within[WORDS], quotients[WORDS];
    const bslam_floats_t of_a = bslam_floats_at(a), of_b = bslam_floats_of_four(b[0], b[1], b[2], b[3]);
    bslam_floats_put(within, bslam_floats_within(of_a, -2.0f, 5.0f));
    bslam_floats_put(quotients, (of_a - bslam_floats_of(1.5f)) / of_b * of_b + of_a);
    const numbers_t words = numbers_of(bslam_floats_to_words(of_a));
    const float expected[WORDS] = {-2.0f, 5.0f, 2.5f, 5.0f};
    const int32_t wholes[WORDS] = {-7, INT32_MIN, 2, INT32_MIN};
    for (int k = 0; k < WORDS; k++) {
        assert_true(within[k] == expected[k]);
        assert_int_equal((int32_t)words.words[k], wholes[k]);
        if (k != 1) {
            assert_true(quotients[k] == (a[k] - 1.5f) / b[k] * b[k] + a[k]);
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
        const numbers_t signed_bytes = numbers_of(bslam_halves_to_signed_bytes(lanes_a, lanes_b));
        for (int k = 0; k < BYTES; k++) {
            const int16_t half = (k < HALVES ? a : b).halves[k % HALVES];
            assert_int_equal((int8_t)signed_bytes.bytes[k], limited(half, -128, 127));
            assert_int_equal(bytes.bytes[k], limited((k < HALVES ? a : b).halves[k % HALVES], 0, 255));
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_words_are_each_as_a_number),
        cmocka_unit_test(test_halves_are_each_as_a_number),
        cmocka_unit_test(test_lanes_bytes_are_each_as_a_number),
        cmocka_unit_test(test_quotients_are_rounded_down),
        cmocka_unit_test(test_floats_are_each_as_a_number),
        cmocka_unit_test(test_narrower_numbers_are_the_nearest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

#else

static void test_this_machine_has_no_lanes(void **state)
{
    print_message("no SSE2 here: vision goes by words of four bytes (bytes.h, test_bytes)\n");
    skip();
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_this_machine_has_no_lanes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

#endif
