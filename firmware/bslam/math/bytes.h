/// Four bytes of a word at a time: what a Cortex-M4 and its elders have instructions for (SIMD32 of the
/// ACLE), and for all others the same in portable C, to the bit.
#ifndef BSLAM_MATH_BYTES_H
#define BSLAM_MATH_BYTES_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#ifdef __ARM_FEATURE_SIMD32
#include <arm_acle.h>
#endif

enum { BSLAM_WORD_BYTES = 4 };

// A core that loads no words but where they belong would be made to call memcpy by a compiler.
#if defined(__arm__) && !defined(__ARM_FEATURE_UNALIGNED)

static inline uint32_t bslam_word_at(const void *bytes)
{
    const uint8_t *b = bytes;
    return b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static inline void bslam_word_put(void *bytes, uint32_t word)
{
    uint8_t *b = bytes;
    b[0] = (uint8_t)word;
    b[1] = (uint8_t)(word >> 8);
    b[2] = (uint8_t)(word >> 16);
    b[3] = (uint8_t)(word >> 24);
}

#else

static inline uint32_t bslam_word_at(const void *bytes)
{
    uint32_t word;
    memcpy(&word, bytes, sizeof word);
    return word;
}

static inline void bslam_word_put(void *bytes, uint32_t word)
{
    memcpy(bytes, &word, sizeof word);
}

#endif

#define BSLAM_EVEN_BYTES 0x00FF00FFU
#define BSLAM_TOP_BITS 0x80808080U

/// Each byte of a less that of b, at least 0.
static inline uint32_t bslam_bytes_less(uint32_t a, uint32_t b)
{
#ifdef __ARM_FEATURE_SIMD32
    return __uqsub8(a, b);
#else
    const uint32_t wrapped = ((a | BSLAM_TOP_BITS) - (b & ~BSLAM_TOP_BITS)) ^ ((a ^ ~b) & BSLAM_TOP_BITS);
    const uint32_t borrows = ((~a & b) | (~(a ^ b) & wrapped)) & BSLAM_TOP_BITS;
    return wrapped & ~((borrows << 1) - (borrows >> 7));
#endif
}

/// Each byte of a and that of b together, at most 255.
static inline uint32_t bslam_bytes_plus(uint32_t a, uint32_t b)
{
#ifdef __ARM_FEATURE_SIMD32
    return __uqadd8(a, b);
#else
    return ~bslam_bytes_less(~a, b);
#endif
}

static inline uint32_t bslam_bytes_least(uint32_t a, uint32_t b)
{
    return a - bslam_bytes_less(a, b);
}

/// How far each byte of a is from that of b.
static inline uint32_t bslam_bytes_apart(uint32_t a, uint32_t b)
{
    return bslam_bytes_less(a, b) | bslam_bytes_less(b, a);
}

/// Half of each byte of a and that of b together, rounded down.
static inline uint32_t bslam_bytes_mean(uint32_t a, uint32_t b)
{
#ifdef __ARM_FEATURE_SIMD32
    return __uhadd8(a, b);
#else
    return (a & b) + ((a ^ b) >> 1 & ~BSLAM_TOP_BITS);
#endif
}

/// Each byte of a less that of b as a signed byte, within +-127.
static inline uint32_t bslam_bytes_difference(uint32_t a, uint32_t b)
{
#ifdef __ARM_FEATURE_SIMD32
    // From -128, where the subtraction stops, to -127: one less, as far as it goes, and one more.
    const int8x4_t less = __qsub8((int8x4_t)(a ^ BSLAM_TOP_BITS), (int8x4_t)(b ^ BSLAM_TOP_BITS));
    return (uint32_t)__sadd8(__qadd8(less, -1), 0x01010101);
#else
    const uint32_t more = bslam_bytes_least(bslam_bytes_less(a, b), ~BSLAM_TOP_BITS);
    const uint32_t less = bslam_bytes_least(bslam_bytes_less(b, a), ~BSLAM_TOP_BITS);
    // 0 - less in each byte, of which one of the two is 0: no borrow crosses bytes.
    return more | ((BSLAM_TOP_BITS - less) ^ BSLAM_TOP_BITS);
#endif
}

/// All bits of each byte whose top bit is set, else none.
static inline uint32_t bslam_bytes_filled(uint32_t bytes)
{
    const uint32_t ones = bytes >> 7 & 0x01010101U;
    return (ones << 8) - ones;
}

/// The top bits of eight bytes, the first word's lowest byte's first.
static inline uint32_t bslam_top_bits(uint32_t first, uint32_t next)
{
    const uint32_t both = (first & BSLAM_TOP_BITS) >> 4 | (next & BSLAM_TOP_BITS);
    return both * 0x00204081U >> 24;
}

/// Top bits of the bytes of which one or the other, with the bits of `flip` turned over, is above the limit.
static inline uint32_t bslam_word_above(const uint8_t *one, const uint8_t *other, uint32_t flip,
                                        uint32_t limit)
{
    // A byte above the limit and what that is short of 255 make 256 or more: the top bit of their mean.
    return bslam_bytes_mean(bslam_word_at(one) ^ flip, ~limit) |
           bslam_bytes_mean(bslam_word_at(other) ^ flip, ~limit);
}

/// In which of 16 places the byte of one table or that of the other, with the bits of `flip` turned over, is
/// above the limit: a bit each, the first place's lowest. In flip and limit the same byte stands four times.
static inline uint32_t bslam_bits_above(const void *one, const void *other, uint32_t flip, uint32_t limit)
{
    const uint8_t *a = one, *b = other;
    const uint32_t low =
        bslam_top_bits(bslam_word_above(a, b, flip, limit), bslam_word_above(a + 4, b + 4, flip, limit));
    const uint32_t high = bslam_top_bits(bslam_word_above(a + 8, b + 8, flip, limit),
                                         bslam_word_above(a + 12, b + 12, flip, limit));
    return low | high << 8;
}

static inline bool bslam_has_zero_byte(uint32_t bytes)
{
#ifdef __ARM_FEATURE_SIMD32
    return __uqsub8(0x01010101U, bytes) != 0;
#else
    return ((bytes - 0x01010101U) & ~bytes & BSLAM_TOP_BITS) != 0;
#endif
}

/// Byte k, counted from the lowest; in memory, too, on a machine of that byte order.
static inline int32_t bslam_byte_of(uint32_t bytes, int32_t k)
{
    return (int32_t)(bytes >> 8 * k & 255);
}

/// The sum and the four bytes.
static inline uint32_t bslam_bytes_sum(uint32_t bytes, uint32_t sum)
{
#ifdef __ARM_FEATURE_SIMD32
    return __usada8(bytes, 0, sum);
#else
    const uint32_t pairs = (bytes & BSLAM_EVEN_BYTES) + (bytes >> 8 & BSLAM_EVEN_BYTES);
    return sum + (pairs & 0xFFFFU) + (pairs >> 16);
#endif
}

/// The sum and how far the bytes of a are from those of b, all four together.
static inline uint32_t bslam_bytes_apart_add(uint32_t a, uint32_t b, uint32_t sum)
{
#ifdef __ARM_FEATURE_SIMD32
    return __usada8(a, b, sum);
#else
    return bslam_bytes_sum(bslam_bytes_apart(a, b), sum);
#endif
}

/// The same without a sum before.
static inline uint32_t bslam_bytes_apart_sum(uint32_t a, uint32_t b)
{
#ifdef __ARM_FEATURE_SIMD32
    return __usad8(a, b);
#else
    return bslam_bytes_apart_add(a, b, 0);
#endif
}

/// Bytes 0 and 2 as halves of a word.
static inline uint32_t bslam_bytes_even(uint32_t bytes)
{
    return bytes & BSLAM_EVEN_BYTES;
}

/// A number below 2^31, at most 255.
static inline uint8_t bslam_byte_at_most(uint32_t number)
{
#ifdef __ARM_FEATURE_SAT
    return (uint8_t)__builtin_arm_usat((int32_t)number, 8);
#else
    return (uint8_t)(number < 255 ? number : 255);
#endif
}

/// The signed byte that is nearest to a number.
static inline int32_t bslam_signed_byte_nearest(int32_t number)
{
#ifdef __ARM_FEATURE_SAT
    return (int32_t)__builtin_arm_ssat(number, 8);
#else
    return number < -128 ? -128 : number < 127 ? number : 127;
#endif
}

/// Bytes 1 and 3. Here and below the core turns the word in the same instruction, which no intrinsic says.
static inline uint32_t bslam_bytes_odd(uint32_t bytes)
{
#ifdef __ARM_FEATURE_SIMD32
    uint32_t halves;
    __asm__("uxtb16 %0, %1, ror #8" : "=r"(halves) : "r"(bytes));
    return halves;
#else
    return bytes >> 8 & BSLAM_EVEN_BYTES;
#endif
}

/// Two numbers of 16 bits in a word, the first one lower.
static inline uint32_t bslam_halves(int32_t low, int32_t high)
{
    return (uint16_t)low | (uint32_t)high << 16;
}

/// Bytes 0 and 2, which stand for signed numbers, as halves of a word.
static inline uint32_t bslam_bytes_signed_even(uint32_t bytes)
{
#ifdef __ARM_FEATURE_SIMD32
    return (uint32_t)__sxtb16((int8x4_t)bytes);
#else
    return bslam_halves((int8_t)bytes, (int8_t)(bytes >> 16));
#endif
}

/// Bytes 1 and 3.
static inline uint32_t bslam_bytes_signed_odd(uint32_t bytes)
{
#ifdef __ARM_FEATURE_SIMD32
    uint32_t halves;
    __asm__("sxtb16 %0, %1, ror #8" : "=r"(halves) : "r"(bytes));
    return halves;
#else
    return bslam_bytes_signed_even(bytes >> 8);
#endif
}

/// Adds bytes 0 and 2 to the lower and upper half of sums, neither of which grows beyond 16 bits.
static inline uint32_t bslam_bytes_add_even(uint32_t sums, uint32_t bytes)
{
#ifdef __ARM_FEATURE_SIMD32
    return __uxtab16(sums, bytes);
#else
    return sums + (bytes & BSLAM_EVEN_BYTES);
#endif
}

/// Adds bytes 1 and 3.
static inline uint32_t bslam_bytes_add_odd(uint32_t sums, uint32_t bytes)
{
#ifdef __ARM_FEATURE_SIMD32
    uint32_t more;
    __asm__("uxtab16 %0, %1, %2, ror #8" : "=r"(more) : "r"(sums), "r"(bytes));
    return more;
#else
    return bslam_bytes_add_even(sums, bytes >> 8);
#endif
}

/// Each half of a less that of b, at least 0.
static inline uint32_t bslam_halves_less(uint32_t a, uint32_t b)
{
#ifdef __ARM_FEATURE_SIMD32
    return __uqsub16(a, b);
#else
    const uint32_t low_a = a & 0xFFFFU, low_b = b & 0xFFFFU, high_a = a >> 16, high_b = b >> 16;
    return (low_a > low_b ? low_a - low_b : 0) | (high_a > high_b ? high_a - high_b : 0) << 16;
#endif
}

static inline uint32_t bslam_halves_least(uint32_t a, uint32_t b)
{
    return a - bslam_halves_less(a, b);
}

/// The other half first.
static inline uint32_t bslam_halves_turned(uint32_t halves)
{
    return halves >> 16 | halves << 16;
}

/// The sum and the products of the lower halves of a and b, and of the upper ones, as signed numbers.
static inline int32_t bslam_halves_dot(uint32_t a, uint32_t b, int32_t sum)
{
#ifdef __ARM_FEATURE_SIMD32
    return __smlad((int16x2_t)a, (int16x2_t)b, sum);
#else
    return sum + (int16_t)a * (int16_t)b + (int16_t)(a >> 16) * (int16_t)(b >> 16);
#endif
}

/// The sum and the product of the lower half of a word and a factor of 16 bits, as signed numbers.
static inline int32_t bslam_low_half_times(uint32_t halves, int32_t factor, int32_t sum)
{
#ifdef __ARM_FEATURE_SIMD32
    return __smlabb((int32_t)halves, factor, sum);
#else
    return sum + (int16_t)halves * factor;
#endif
}

/// The same of the upper half.
static inline int32_t bslam_high_half_times(uint32_t halves, int32_t factor, int32_t sum)
{
#ifdef __ARM_FEATURE_SIMD32
    return __smlatb((int32_t)halves, factor, sum);
#else
    return sum + (int16_t)(halves >> 16) * factor;
#endif
}

/// The sum and a product of 64 bits. The core has an instruction for it, of which a compiler that knows a
/// factor to fit 16 bits makes several.
static inline int64_t bslam_product_add(int32_t a, int32_t b, int64_t sum)
{
#ifdef __ARM_FEATURE_SIMD32
    __asm__("smlal %Q0, %R0, %1, %2" : "+r"(sum) : "r"(a), "r"(b));
    return sum;
#else
    return sum + (int64_t)a * b;
#endif
}

#endif
