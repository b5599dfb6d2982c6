#include "base/trig.h"
#include "base/scalar.h"

#include <stdint.h>

// Cody-Waite splitting of pi/2: the high parts have trailing zero bits, so that quadrant * part is exact.
#if BSLAM_REAL_DOUBLE
#define HALF_PI_HIGH 1.57079632673412561417e+00
#define HALF_PI_MIDDLE 6.07710050630396597660e-11
#define HALF_PI_LOW 2.02226624879595063154e-21
#else
#define HALF_PI_HIGH 1.5703125f
#define HALF_PI_MIDDLE 4.837512969970703125e-4f
#define HALF_PI_LOW 7.5497899548918821e-8f
#endif

/// What whole turns leave of an angle, with its sign: C's fmod to the bit, since nothing in it rounds. Not
/// fmod itself, whose code and stack are a multiple of this. NaN for what is not finite.
static bslam_real_t remainder_of_turns(bslam_real_t angle)
{
    bslam_real_t left = bslam_abs(angle);
    if (!(left - left == 0)) {
        return angle - angle;
    }
    bslam_real_t turns = 2 * BSLAM_PI;
    while (turns <= left / 2) {
        turns *= 2;
    }
    while (turns >= 2 * BSLAM_PI) {
        left -= left >= turns ? turns : 0;
        turns /= 2;
    }
    return angle < 0 ? -left : left;
}

/// The same direction within BSLAM_ANGLE_MAX.
static bslam_real_t bring_near(bslam_real_t angle)
{
    return bslam_abs(angle) <= BSLAM_ANGLE_MAX ? angle : remainder_of_turns(angle);
}

/// The nearest whole number; 0 for NaN, which goes on in what the caller makes of the angle itself.
static int32_t nearest_whole(bslam_real_t turns)
{
    if (!(turns == turns)) {
        return 0;
    }
    return (int32_t)(turns + (turns < 0 ? BSLAM_R(-0.5) : BSLAM_R(0.5)));
}

/// The angle less the nearest multiple of pi/2, and which multiple that was.
static bslam_real_t reduce_to_quadrant(bslam_real_t any_angle, int32_t *quadrant)
{
    const bslam_real_t angle = bring_near(any_angle);
    const bslam_real_t turns = angle * BSLAM_R(0.63661977236758134308);
    const int32_t nearest = nearest_whole(turns);
    const bslam_real_t q = (bslam_real_t)nearest;
    *quadrant = nearest;
    return ((angle - q * HALF_PI_HIGH) - q * HALF_PI_MIDDLE) - q * HALF_PI_LOW;
}

// Minimax on [-pi/4, pi/4]; coefficients as published for Cephes (float) and fdlibm (double).
static bslam_real_t sin_polynomial(bslam_real_t x)
{
    const bslam_real_t z = x * x;
#if BSLAM_REAL_DOUBLE
    const double tail = 8.33333333332248946124e-03 +
                        z * (-1.98412698298579493134e-04 +
                             z * (2.75573137070700676789e-06 +
                                  z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
    return x + x * z * (-1.66666666666666324348e-01 + z * tail);
#else
    return x + x * z * (-1.6666654611e-1f + z * (8.3321608736e-3f + z * -1.9515295891e-4f));
#endif
}

static bslam_real_t cos_polynomial(bslam_real_t x)
{
    const bslam_real_t z = x * x;
#if BSLAM_REAL_DOUBLE
    const double tail = -1.38888888888741095749e-03 +
                        z * (2.48015872894767294178e-05 +
                             z * (-2.75573143513906633035e-07 +
                                  z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)));
    return 1.0 - (0.5 * z - z * z * (4.16666666666666019037e-02 + z * tail));
#else
    return 1.0f -
           (0.5f * z -
            z * z * (4.166664568298827e-2f + z * (-1.388731625493765e-3f + z * 2.443315711809948e-5f)));
#endif
}

void bslam_sin_cos(bslam_real_t angle_rad, bslam_real_t *sine, bslam_real_t *cosine)
{
    int32_t quadrant;
    const bslam_real_t x = reduce_to_quadrant(angle_rad, &quadrant);
    const bslam_real_t s = sin_polynomial(x), c = cos_polynomial(x);
    switch ((uint32_t)quadrant & 3u) {
    case 0u:
        *sine = s;
        *cosine = c;
        break;
    case 1u:
        *sine = c;
        *cosine = -s;
        break;
    case 2u:
        *sine = -s;
        *cosine = -c;
        break;
    default:
        *sine = -c;
        *cosine = s;
        break;
    }
}

/// Arc tangent of a ratio in [0, 1].
static bslam_real_t atan_unit(bslam_real_t ratio)
{
    // Above tan(pi/8) use atan(t) = pi/4 + atan((t - 1)/(t + 1)), which brings the argument into [-0.4143,
    // 0.4143].
    const bool upper = ratio > BSLAM_R(0.41421356237309504880);
    const bslam_real_t t = upper ? (ratio - 1) / (ratio + 1) : ratio;
    const bslam_real_t z = t * t;
#if BSLAM_REAL_DOUBLE
    // Cephes atan: rational on |t| <= 0.66.
    const double numerator =
        ((((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z - 7.500855792314704667340e1) *
              z -
          1.228866684490136173410e2) *
             z -
         6.485021904942025371773e1);
    const double denominator = (((((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z +
                                  4.328810604912902668951e2) *
                                     z +
                                 4.853903996359136964868e2) *
                                    z +
                                1.945506571482613964425e2);
    const double small = t + t * (z * numerator / denominator);
#else
    const float small = t + t * z *
                                (-3.33329491539e-1f +
                                 z * (1.99777106478e-1f + z * (-1.38776856032e-1f + z * 8.05374449538e-2f)));
#endif
    return upper ? BSLAM_PI / 4 + small : small;
}

bslam_real_t bslam_atan2(bslam_real_t y, bslam_real_t x)
{
    const bslam_real_t ax = bslam_abs(x), ay = bslam_abs(y);
    if (ax == 0 && ay == 0) {
        return 0;
    }
    bslam_real_t angle = ay <= ax ? atan_unit(ay / ax) : BSLAM_PI / 2 - atan_unit(ax / ay);
    if (x < 0) {
        angle = BSLAM_PI - angle;
    }
    // Below -pi's own rounding the answer is +pi: -pi is not in (-pi, pi].
    return y < 0 && angle < BSLAM_PI ? -angle : angle;
}

bslam_real_t bslam_angle_wrap(bslam_real_t angle_rad)
{
    if (angle_rad > -BSLAM_PI && angle_rad <= BSLAM_PI) {
        return angle_rad;
    }
    const bslam_real_t near_rad = bring_near(angle_rad);
    const bslam_real_t turns = near_rad / (2 * BSLAM_PI);
    const int32_t nearest = nearest_whole(turns);
    const bslam_real_t quadrants = (bslam_real_t)(4 * nearest);
    bslam_real_t wrapped =
        ((near_rad - quadrants * HALF_PI_HIGH) - quadrants * HALF_PI_MIDDLE) - quadrants * HALF_PI_LOW;
    if (wrapped <= -BSLAM_PI) {
        wrapped += 2 * BSLAM_PI;
    } else if (wrapped > BSLAM_PI) {
        wrapped -= 2 * BSLAM_PI;
    }
    return wrapped;
}
