// Four bytes at a time, against the same byte by byte.
#include "vision/pixels/bytes.h"

#include "support.h"

enum { ROUNDS = 20000 };

/// Random bytes, of which many are at the ends of their range.
static uint32_t random_word(unit_random_t *random)
{
    static const uint8_t ends[] = {0, 1, 127, 128, 254, 255};
    uint32_t word = 0;
    for (int k = 0; k < BSLAM_WORD_BYTES; k++) {
        const int i = (int)unit_random(random, 0, 12);
        const uint32_t byte = i < 6 ? ends[i] : (uint32_t)unit_random(random, 0, 256);
        word |= byte << 8 * k;
    }
    return word;
}

static int least(int a, int b)
{
    return a < b ? a : b;
}

static void test_bytes_are_each_as_a_number(void **state)
{
    unit_random_t random = {1};
    for (int round = 0; round < ROUNDS; round++) {
        const uint32_t a = random_word(&random), b = random_word(&random);
        bool has_zero = false;
        int apart_sum = 0;
        for (int k = 0; k < BSLAM_WORD_BYTES; k++) {
            const int x = (int)(a >> 8 * k & 255), y = (int)(b >> 8 * k & 255);
            assert_int_equal(bslam_byte_of(a, k), x);
            assert_int_equal(bslam_byte_of(bslam_bytes_less(a, b), k), x > y ? x - y : 0);
            assert_int_equal(bslam_byte_of(bslam_bytes_plus(a, b), k), least(x + y, 255));
            assert_int_equal(bslam_byte_of(bslam_bytes_least(a, b), k), least(x, y));
            assert_int_equal(bslam_byte_of(bslam_bytes_apart(a, b), k), x > y ? x - y : y - x);
            assert_int_equal(bslam_byte_of(bslam_bytes_mean(a, b), k), (x + y) / 2);
            assert_int_equal(bslam_byte_of(bslam_bytes_filled(a), k), x >= 128 ? 255 : 0);
            const int32_t apart = least(x > y ? x - y : y - x, 127);
            assert_int_equal((int8_t)bslam_byte_of(bslam_bytes_difference(a, b), k), x > y ? apart : -apart);
            has_zero = has_zero || x == 0;
            apart_sum += x > y ? x - y : y - x;
        }
        assert_int_equal(bslam_bytes_apart_sum(a, b), apart_sum);
        assert_int_equal(bslam_bytes_apart_add(a, b, (uint32_t)round), apart_sum + round);
        assert_int_equal(bslam_has_zero_byte(a), has_zero);
    }
}

static void test_sums_of_bytes_and_of_halves(void **state)
{
    unit_random_t random = {2};
    for (int round = 0; round < ROUNDS; round++) {
        const uint32_t a = random_word(&random), b = random_word(&random);
        int sum = round;
        uint32_t even = 0, odd = 0;
        for (int k = 0; k < BSLAM_WORD_BYTES; k++) {
            const uint32_t x = a >> 8 * k & 255;
            sum += (int)x;
            *(k % 2 == 0 ? &even : &odd) += x << 8 * (k & 2);
        }
        assert_int_equal(bslam_bytes_sum(a, (uint32_t)round), sum);
        assert_int_equal(bslam_bytes_even(a), even);
        assert_int_equal(bslam_bytes_odd(a), odd);
        assert_int_equal(bslam_bytes_signed_even(a), bslam_halves((int8_t)a, (int8_t)(a >> 16)));
        assert_int_equal(bslam_bytes_signed_odd(a), bslam_halves((int8_t)(a >> 8), (int8_t)(a >> 24)));
        assert_int_equal(bslam_bytes_add_even(7U << 16, a), even + (7U << 16));
        assert_int_equal(bslam_bytes_add_odd(9U, a), odd + 9);
        const int16_t low_a = (int16_t)a, high_a = (int16_t)(a >> 16);
        const int16_t low_b = (int16_t)b, high_b = (int16_t)(b >> 16);
        const int64_t dot = (int64_t)low_a * low_b + (int64_t)high_a * high_b;
        if (dot < INT32_MAX - round) {
            assert_int_equal(bslam_halves_dot(a, b, round), dot + round);
        }
        // A factor of 16 bits; the sum stays within 32.
        assert_int_equal(bslam_low_half_times(a, high_b, round), low_a * high_b + round);
        assert_int_equal(bslam_high_half_times(a, high_b, round), high_a * high_b + round);
        assert_int_equal(bslam_halves(low_a, high_a), a);
        const int lower = least((int)(a & 0xFFFF), (int)(b & 0xFFFF));
        const int upper = least((int)(a >> 16), (int)(b >> 16));
        assert_int_equal(bslam_halves_least(a, b), bslam_halves(lower, upper));
    }
}

static void test_numbers_become_the_nearest_byte(void **state)
{
    static const struct {
        int32_t number, nearest;
    } signed_ones[] = {{-128, -128}, {-129, -128}, {INT32_MIN, -128}, {-1, -1},
                       {127, 127},   {128, 127},   {INT32_MAX, 127}};
    for (int i = 0; i < COUNT_OF(signed_ones); i++) {
        assert_int_equal(bslam_signed_byte_nearest(signed_ones[i].number), signed_ones[i].nearest);
    }
    assert_int_equal(bslam_byte_at_most(0), 0);
    assert_int_equal(bslam_byte_at_most(255), 255);
    assert_int_equal(bslam_byte_at_most(256), 255);
    assert_int_equal(bslam_byte_at_most(INT32_MAX), 255);
}

static void test_product_add_is_exact_in_64_bits(void **state)
{
    static const int32_t ends[] = {0, 1, -1, INT16_MAX, INT16_MIN, INT32_MAX, INT32_MIN};
    for (int i = 0; i < COUNT_OF(ends); i++) {
        for (int j = 0; j < COUNT_OF(ends); j++) {
            const int64_t product = (int64_t)ends[i] * ends[j];
            assert_true(bslam_product_add(ends[i], ends[j], 0) == product);
            assert_true(bslam_product_add(ends[i], ends[j], -1) == product - 1);
            assert_true(bslam_product_add(ends[i], ends[j], 1LL << 40) == product + (1LL << 40));
        }
    }
}

static void test_bits_of_what_is_above(void **state)
{
    enum { PLACES = 16 };
    unit_random_t random = {3};
    for (int round = 0; round < ROUNDS; round++) {
        uint8_t one[PLACES], other[PLACES];
        for (int k = 0; k < PLACES; k += BSLAM_WORD_BYTES) {
            bslam_word_put(one + k, random_word(&random));
            bslam_word_put(other + k, random_word(&random));
        }
        const uint32_t limit = (uint32_t)(random_word(&random) & 255), flip = round % 2 == 0 ? 0 : 128;
        uint32_t expected = 0, tops = 0;
        for (int k = 0; k < PLACES; k++) {
            const bool is_above = (one[k] ^ flip) > limit || (other[k] ^ flip) > limit;
            expected |= is_above ? 1U << k : 0U;
            tops |= k < 2 * BSLAM_WORD_BYTES && one[k] >= 128 ? 1U << k : 0U;
        }
        assert_int_equal(bslam_bits_above(one, other, flip * 0x01010101U, limit * 0x01010101U), expected);
        assert_int_equal(bslam_top_bits(bslam_word_at(one), bslam_word_at(one + BSLAM_WORD_BYTES)), tops);
    }
}

static void test_words_lie_anywhere(void **state)
{
    uint8_t bytes[9] = {0, 1, 2, 3, 4, 5, 6, 7, 8};
    for (int at = 0; at <= 5; at++) {
        uint8_t copy[9] = {0};
        bslam_word_put(copy + at, bslam_word_at(bytes + at));
        assert_memory_equal(copy + at, bytes + at, BSLAM_WORD_BYTES);
        assert_int_equal(bslam_byte_of(bslam_word_at(bytes + at), 0), at);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bytes_are_each_as_a_number),
        cmocka_unit_test(test_sums_of_bytes_and_of_halves),
        cmocka_unit_test(test_numbers_become_the_nearest_byte),
        cmocka_unit_test(test_product_add_is_exact_in_64_bits),
        cmocka_unit_test(test_bits_of_what_is_above),
        cmocka_unit_test(test_words_lie_anywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
