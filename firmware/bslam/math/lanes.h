/// Sixteen bytes at a time, or eight halves of words, or four words: what every x86 host has instructions for
/// (SSE2). Elsewhere BSLAM_HAS_LANES is 0, and the same is done by words of four bytes (bytes.h), to the same
/// bits.
#ifndef BSLAM_MATH_LANES_H
#define BSLAM_MATH_LANES_H

#include "bslam/math/bytes.h"

#define BSLAM_HAS_LANES BSLAM_HAS_SSE2

#if BSLAM_HAS_LANES

/// Bits of two are taken together by the operators & | ^, turned over by ~.
typedef __m128i bslam_lanes_t;

static inline bslam_lanes_t bslam_lanes_at(const void *bytes)
{
    return _mm_loadu_si128(bytes);
}

/// Eight bytes, the upper ones 0.
static inline bslam_lanes_t bslam_lanes_half_at(const void *bytes)
{
    return _mm_loadl_epi64(bytes);
}

static inline void bslam_lanes_put(void *bytes, bslam_lanes_t lanes)
{
    _mm_storeu_si128(bytes, lanes);
}

static inline bslam_lanes_t bslam_lanes_zero(void)
{
    return _mm_setzero_si128();
}

/// The same word four times.
static inline bslam_lanes_t bslam_lanes_of(uint32_t word)
{
    return _mm_set1_epi32((int)word);
}

/// Word k, counted from the lowest, a constant.
static inline uint32_t bslam_lanes_word(bslam_lanes_t a, int k)
{
    return (uint32_t)_mm_cvtsi128_si32(k == 1   ? _mm_shuffle_epi32(a, 1)
                                       : k == 2 ? _mm_shuffle_epi32(a, 2)
                                       : k == 3 ? _mm_shuffle_epi32(a, 3)
                                                : a);
}

/// Four words, the lowest first.
static inline bslam_lanes_t bslam_lanes_of_words(uint32_t first, uint32_t second, uint32_t third,
                                                 uint32_t fourth)
{
    return _mm_set_epi32((int)fourth, (int)third, (int)second, (int)first);
}

// --- Words

static inline bslam_lanes_t bslam_words_add(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_add_epi32(a, b);
}

static inline bslam_lanes_t bslam_words_less(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_sub_epi32(a, b);
}

/// Each word as an unsigned number, shifted to its lower bits; to its upper ones.
static inline bslam_lanes_t bslam_words_down(bslam_lanes_t a, int bits)
{
    return _mm_srli_epi32(a, bits);
}

static inline bslam_lanes_t bslam_words_up(bslam_lanes_t a, int bits)
{
    return _mm_slli_epi32(a, bits);
}

/// Each word with its other half first.
static inline bslam_lanes_t bslam_words_turned(bslam_lanes_t a)
{
    enum { OTHERS_FIRST = 1 << 0 | 0 << 2 | 3 << 4 | 2 << 6 };
    return _mm_shufflehi_epi16(_mm_shufflelo_epi16(a, OTHERS_FIRST), OTHERS_FIRST);
}

/// Each word as a signed number over 2^bits, rounded towards 0.
static inline bslam_lanes_t bslam_words_shifted_to_zero(bslam_lanes_t a, int bits)
{
    const bslam_lanes_t if_below_zero = _mm_srli_epi32(_mm_srai_epi32(a, 31), 32 - bits);
    return _mm_srai_epi32(_mm_add_epi32(a, if_below_zero), bits);
}

/// Words 0 and 2 of a, then those of b; words 1 and 3.
static inline bslam_lanes_t bslam_words_even(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_castps_si128(
        _mm_shuffle_ps(_mm_castsi128_ps(a), _mm_castsi128_ps(b), 0 << 0 | 2 << 2 | 0 << 4 | 2 << 6));
}

static inline bslam_lanes_t bslam_words_odd(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_castps_si128(
        _mm_shuffle_ps(_mm_castsi128_ps(a), _mm_castsi128_ps(b), 1 << 0 | 3 << 2 | 1 << 4 | 3 << 6));
}

/// Word 1 twice, then word 3 twice.
static inline bslam_lanes_t bslam_words_odd_twice(bslam_lanes_t a)
{
    return _mm_shuffle_epi32(a, 1 << 0 | 1 << 2 | 3 << 4 | 3 << 6);
}

/// The lower two words of a and of b in turn; the upper two.
static inline bslam_lanes_t bslam_words_lower_in_turn(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_unpacklo_epi32(a, b);
}

static inline bslam_lanes_t bslam_words_upper_in_turn(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_unpackhi_epi32(a, b);
}

/// All four together.
static inline int32_t bslam_words_sum(bslam_lanes_t a)
{
    const bslam_lanes_t pairs = bslam_words_add(a, _mm_shuffle_epi32(a, 2 << 0 | 3 << 2));
    return (int32_t)(bslam_lanes_word(pairs, 0) + bslam_lanes_word(pairs, 1));
}

/// Those of a, then those of b, as halves: signed numbers that fit these.
static inline bslam_lanes_t bslam_words_to_halves(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_packs_epi32(a, b);
}

/// Quotients rounded down, of numbers of 15 bits by numbers of 1 to 500: what is short of a whole number is
/// so by 1/500, twice the half step by which a float of 15 bits may be rounded up.
static inline bslam_lanes_t bslam_words_quotients(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_cvttps_epi32(_mm_div_ps(_mm_cvtepi32_ps(a), _mm_cvtepi32_ps(b)));
}

// --- Halves, signed numbers where that makes a difference

static inline bslam_lanes_t bslam_halves_most_of(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_max_epi16(a, b);
}

static inline bslam_lanes_t bslam_halves_least_of(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_min_epi16(a, b);
}

static inline bslam_lanes_t bslam_halves_add(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_add_epi16(a, b);
}

/// In each word the products of the lower halves of a and b and of the upper ones together.
static inline bslam_lanes_t bslam_halves_dots(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_madd_epi16(a, b);
}

/// All eight together.
static inline int32_t bslam_halves_sum(bslam_lanes_t a)
{
    return bslam_words_sum(bslam_halves_dots(a, _mm_set1_epi16(1)));
}

static inline bslam_lanes_t bslam_halves_minus(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_sub_epi16(a, b);
}

/// All bits of a half that is below 0, else none.
static inline bslam_lanes_t bslam_halves_are_negative(bslam_lanes_t a)
{
    return _mm_srai_epi16(a, 15);
}

/// Each half within [low, high].
static inline bslam_lanes_t bslam_halves_within(bslam_lanes_t a, int16_t low, int16_t high)
{
    return _mm_min_epi16(_mm_max_epi16(a, _mm_set1_epi16(low)), _mm_set1_epi16(high));
}

/// Each half over 2^bits, rounded towards 0.
static inline bslam_lanes_t bslam_halves_shifted_to_zero(bslam_lanes_t a, int bits)
{
    const bslam_lanes_t if_below_zero = _mm_srli_epi16(_mm_srai_epi16(a, 15), 16 - bits);
    return _mm_srai_epi16(_mm_add_epi16(a, if_below_zero), bits);
}

/// Each half times a factor, modulo 65536.
static inline bslam_lanes_t bslam_halves_times(bslam_lanes_t a, int16_t factor)
{
    return _mm_mullo_epi16(a, _mm_set1_epi16(factor));
}

/// Each half as an unsigned number, shifted to its lower bits; to its upper ones.
static inline bslam_lanes_t bslam_halves_down(bslam_lanes_t a, int bits)
{
    return _mm_srli_epi16(a, bits);
}

static inline bslam_lanes_t bslam_halves_up(bslam_lanes_t a, int bits)
{
    return _mm_slli_epi16(a, bits);
}

/// The lower four halves of a and of b in turn; the upper four.
static inline bslam_lanes_t bslam_halves_lower_in_turn(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_unpacklo_epi16(a, b);
}

static inline bslam_lanes_t bslam_halves_upper_in_turn(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_unpackhi_epi16(a, b);
}

/// Those of a, then those of b, as the bytes that are nearest.
static inline bslam_lanes_t bslam_halves_to_bytes(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_packus_epi16(a, b);
}

static inline bslam_lanes_t bslam_halves_to_signed_bytes(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_packs_epi16(a, b);
}

// --- Bytes

/// Each byte of a less that of b, at least 0.
static inline bslam_lanes_t bslam_lanes_less(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_subs_epu8(a, b);
}

/// The same modulo 256.
static inline bslam_lanes_t bslam_lanes_wrapped_less(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_sub_epi8(a, b);
}

/// Each byte of a and that of b together, at most 255.
static inline bslam_lanes_t bslam_lanes_plus(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_adds_epu8(a, b);
}

static inline bslam_lanes_t bslam_lanes_least(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_min_epu8(a, b);
}

/// How far each byte of a is from that of b.
static inline bslam_lanes_t bslam_lanes_apart(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_subs_epu8(a, b) | _mm_subs_epu8(b, a);
}

/// Half of each byte of a and that of b together, rounded down: the instruction rounds up.
static inline bslam_lanes_t bslam_lanes_mean(bslam_lanes_t a, bslam_lanes_t b)
{
    return ~_mm_avg_epu8(~a, ~b);
}

/// All bits of a byte that is above 0 as a signed number, else none.
static inline bslam_lanes_t bslam_bytes_are_positive(bslam_lanes_t a)
{
    return _mm_cmpgt_epi8(a, _mm_setzero_si128());
}

/// A bit for each byte that is 0, the first one's lowest.
static inline uint32_t bslam_bytes_are_zero(bslam_lanes_t a)
{
    return (uint32_t)_mm_movemask_epi8(_mm_cmpeq_epi8(a, _mm_setzero_si128()));
}

/// Adds all sixteen bytes to sums, of which bslam_lanes_sum() makes one.
static inline bslam_lanes_t bslam_lanes_sum_add(bslam_lanes_t bytes, bslam_lanes_t sums)
{
    return _mm_add_epi32(_mm_sad_epu8(bytes, _mm_setzero_si128()), sums);
}

static inline int32_t bslam_lanes_sum(bslam_lanes_t sums)
{
    return (int32_t)(bslam_lanes_word(sums, 0) + bslam_lanes_word(sums, 2));
}

/// All bits of the first `count` bytes, of none below 0, of all from 16 on.
static inline bslam_lanes_t bslam_lanes_first(int32_t count)
{
    static const uint8_t masks[32] = {255, 255, 255, 255, 255, 255, 255, 255,
                                      255, 255, 255, 255, 255, 255, 255, 255};
    return bslam_lanes_at(masks + (count < 0 ? 16 : count < 16 ? 16 - count : 0));
}

static inline int16_t bslam_half_at(const uint8_t *bytes)
{
    int16_t half;
    memcpy(&half, bytes, sizeof half);
    return half;
}

/// Two bytes from each of eight places so far apart.
static inline bslam_lanes_t bslam_lanes_of_pairs(const void *bytes, int32_t apart)
{
    const uint8_t *at = bytes, *next = at + 4 * apart;
    return _mm_set_epi16(bslam_half_at(next + 3 * apart), bslam_half_at(next + 2 * apart),
                         bslam_half_at(next + apart), bslam_half_at(next), bslam_half_at(at + 3 * apart),
                         bslam_half_at(at + 2 * apart), bslam_half_at(at + apart), bslam_half_at(at));
}

/// The lower eight bytes of a and of b in turn; the upper eight.
static inline bslam_lanes_t bslam_bytes_lower_in_turn(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_unpacklo_epi8(a, b);
}

static inline bslam_lanes_t bslam_bytes_upper_in_turn(bslam_lanes_t a, bslam_lanes_t b)
{
    return _mm_unpackhi_epi8(a, b);
}

/// The lower eight bytes, which stand for signed numbers, as halves; the upper eight.
static inline bslam_lanes_t bslam_bytes_signed_lower(bslam_lanes_t a)
{
    return _mm_srai_epi16(_mm_unpacklo_epi8(a, a), 8);
}

static inline bslam_lanes_t bslam_bytes_signed_upper(bslam_lanes_t a)
{
    return _mm_srai_epi16(_mm_unpackhi_epi8(a, a), 8);
}

/// Bytes 0, 2, 4 and so on, which stand for signed numbers, as halves; bytes 1, 3, 5 and so on.
static inline bslam_lanes_t bslam_bytes_signed_evens(bslam_lanes_t a)
{
    return _mm_srai_epi16(_mm_slli_epi16(a, 8), 8);
}

static inline bslam_lanes_t bslam_bytes_signed_odds(bslam_lanes_t a)
{
    return _mm_srai_epi16(a, 8);
}

// --- Floats: the operators + - * / are of each, rounded as of one alone

typedef __m128 bslam_floats_t;

static inline bslam_floats_t bslam_floats_at(const float *numbers)
{
    return _mm_loadu_ps(numbers);
}

static inline void bslam_floats_put(float *numbers, bslam_floats_t floats)
{
    _mm_storeu_ps(numbers, floats);
}

static inline bslam_floats_t bslam_floats_of(float number)
{
    return _mm_set1_ps(number);
}

/// The first lowest.
static inline bslam_floats_t bslam_floats_of_four(float first, float second, float third, float fourth)
{
    return _mm_set_ps(fourth, third, second, first);
}

/// Each float within [low, high]; high where it is none.
static inline bslam_floats_t bslam_floats_within(bslam_floats_t a, float low, float high)
{
    return _mm_max_ps(_mm_min_ps(a, _mm_set1_ps(high)), _mm_set1_ps(low));
}

/// Each float without what is behind the point; INT32_MIN where it is none, or beyond 32 bits.
static inline bslam_lanes_t bslam_floats_to_words(bslam_floats_t a)
{
    return _mm_cvttps_epi32(a);
}

#endif

#endif
