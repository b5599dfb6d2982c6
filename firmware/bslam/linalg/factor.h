/// A covariance of changing size that cannot lose its definiteness: P = L D Lᵀ, L unit lower triangular and
/// D >= 0 diagonal. No operation takes more from D than is there, so whatever rounds, P is a covariance.
///
/// The last two or three values, the *tail*, are the robot's position and what it is integrated from; all
/// before them is the *body*. A motion changes the tail by what stands before it, so L stays triangular:
/// O(n). The noise of a sighting or of a turn goes through L in one pass: O(n²).
///
/// L is held in blocks of four rows whose columns are four neighbouring numbers, one a row, so that four rows
/// go through a recurrence at once. It has 1 on the diagonal, and 0 above it and in rows that do not exist.
/// The body is filled up to a multiple of four, and the tail is the block behind it, kept apart. Literature:
/// Agee and Turner 1972; Fletcher and Powell 1974; Bierman, "Factorization Methods for Discrete Sequential
/// Estimation", 1977.
#ifndef BSLAM_LINALG_FACTOR_H
#define BSLAM_LINALG_FACTOR_H

#include <stddef.h>
#include <stdint.h>

#include "base/real.h"
#include "bslam/config.h"

enum { BSLAM_FACTOR_TAIL_MAX = 3, BSLAM_FACTOR_GROWTH_MAX = 4 };

/// n filled up to a multiple of four.
#define BSLAM_FACTOR_PADDED(n) (((n) + 3) / 4 * 4)
/// The largest body: two values of the robot, four of the sensor, two a beacon, two more a ray; and room for
/// seven that come before others leave: what a stored map hung on, or what a new value is made of.
#define BSLAM_FACTOR_BODY_MAX BSLAM_FACTOR_PADDED(6 + 2 * BSLAM_BEACONS_MAX + 2 * BSLAM_RAYS_MAX + 7)
/// Places of the largest: the length of D, and of every vector that goes with it.
#define BSLAM_FACTOR_PLACES_MAX (BSLAM_FACTOR_BODY_MAX + 4)

typedef struct bslam_factor {
    int32_t body_count, tail_count;
    bslam_real_t d[BSLAM_FACTOR_PLACES_MAX];         ///< by place, 0 where no value stands
    bslam_real_t tail[4 * BSLAM_FACTOR_PLACES_MAX];  ///< one block
    bslam_real_t body[BSLAM_FACTOR_BODY_MAX * (BSLAM_FACTOR_BODY_MAX + 4) / 2];
} bslam_factor_t;

/// The tail's first place.
static inline int bslam_factor_tail_at(const bslam_factor_t *factor)
{
    return BSLAM_FACTOR_PADDED(factor->body_count);
}

static inline int bslam_factor_places(const bslam_factor_t *factor)
{
    return bslam_factor_tail_at(factor) + 4;
}

/// Where in the body the four rows from place `at`, a multiple of four, begin; and behind the last ones, how
/// many numbers a body has.
static inline size_t bslam_factor_block_at(int at)
{
    return (size_t)at * ((size_t)at + 4) / 2;
}

/// Row i of L: column j stands at 4 j.
static inline const bslam_real_t *bslam_factor_row(const bslam_factor_t *factor, int i)
{
    return (i < factor->body_count ? factor->body + bslam_factor_block_at(i / 4 * 4) : factor->tail) + i % 4;
}

/// Element (i, j) of L, j <= i.
static inline bslam_real_t *bslam_factor_element(bslam_factor_t *factor, int i, int j)
{
    bslam_real_t *rows =
        i < factor->body_count ? factor->body + bslam_factor_block_at(i / 4 * 4) : factor->tail;
    return rows + 4 * (size_t)j + i % 4;
}

/// P(i, j). O(n).
bslam_real_t bslam_factor_get(const bslam_factor_t *factor, int i, int j);

/// So many values that go with no other one, whose variances are 0.
void bslam_factor_begin(bslam_factor_t *factor, int body_count, int tail_count);

/// Value i becomes itself and so much of value k, k < i: as P <- A P Aᵀ with A = I + share e_i e_kᵀ. O(n).
void bslam_factor_add_row(bslam_factor_t *factor, int i, int k, bslam_real_t share);

/// Value i becomes `by` > 0 times itself. O(n).
void bslam_factor_scale(bslam_factor_t *factor, int i, bslam_real_t by);

// ---- what makes it larger or smaller ----------------------------------------------------------------------

/// P += share w wᵀ, share >= 0. w[places], 0 before `first`, is overwritten. O(n²).
void bslam_factor_add(bslam_factor_t *factor, int first, bslam_real_t share, bslam_real_t *w,
                      bslam_real_t scratch[2][BSLAM_FACTOR_PLACES_MAX]);

/// Value k goes with no other one from now on, and has this variance. O(n²).
void bslam_factor_forget(bslam_factor_t *factor, int k, bslam_real_t variance, bslam_real_t *w,
                         bslam_real_t scratch[2][BSLAM_FACTOR_PLACES_MAX]);

/// Takes `count` values of the body out; those behind move up. O(count n²).
void bslam_factor_remove(bslam_factor_t *factor, int first, int count, bslam_real_t *w,
                         bslam_real_t scratch[2][BSLAM_FACTOR_PLACES_MAX]);

/// The same of all values of the body from `first` on. O(n).
void bslam_factor_cut(bslam_factor_t *factor, int first);

/// Puts values that go with no other one, and have no variance, at the body's end. O(count n).
void bslam_factor_widen(bslam_factor_t *factor, int count);

/// New values: how much each has of those that there are, and of independent noises.
typedef struct bslam_growth {
    int count, noise_count;
    const bslam_real_t *rows[BSLAM_FACTOR_GROWTH_MAX];  ///< [places]: what of L's rows, by column
    bslam_real_t by_noise[BSLAM_FACTOR_GROWTH_MAX][BSLAM_FACTOR_GROWTH_MAX];
    bslam_real_t noise_var[BSLAM_FACTOR_GROWTH_MAX];
} bslam_growth_t;

/// Puts new values at the body's end. O(n).
void bslam_factor_append(bslam_factor_t *factor, const bslam_growth_t *growth);

// ---- scalar measurements ----------------------------------------------------------------------------------

/// A measurement h whose part in D is taken, and that in L waits for a pass.
typedef struct bslam_waiting {
    bslam_real_t *v;       ///< [places]: D f, where f = Lᵀ h
    bslam_real_t *lambda;  ///< [places]: f before it is taken; then what L takes of P hᵀ
    bslam_real_t gain;     ///< of the mean, by P hᵀ: innovation / S
} bslam_waiting_t;

/// f = Lᵀ g, of another row g, becomes what it is behind a waiting measurement. Returns g P hᵀ by the P that
/// this one met. O(n).
bslam_real_t bslam_factor_carry(const bslam_waiting_t *waiting, int places, bslam_real_t *f);

/// Takes a measurement with this noise > 0 into D. Returns S, the variance of its innovation. O(n).
bslam_real_t bslam_factor_measure(const bslam_waiting_t *waiting, int places, bslam_real_t variance,
                                  bslam_real_t *d);

/// Brings L up to date for `count` <= 4 measurements. change[places] += what they change of each value's
/// mean. O(count n²).
void bslam_factor_settle(bslam_factor_t *factor, const bslam_waiting_t *waiting, int count,
                         bslam_real_t *change);

#endif
