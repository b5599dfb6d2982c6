#include "bslam/linalg/factor.h"

#include <string.h>

#include "bslam/linalg/four.h"

/// A function whose callers name constants: each has a copy without tests of them.
#define COPIED __attribute__((always_inline)) static inline

/// Variances below this are none: L, which is a quotient by them, would have a square that overflows.
static const bslam_real_t VARIANCE_MIN = BSLAM_R(1e-24);

COPIED bslam_four_t load(const bslam_real_t *block, int j)
{
    return bslam_four(block + 4 * (size_t)j);
}

COPIED void store(bslam_real_t *block, int j, bslam_four_t four)
{
    *(bslam_four_at_t *)(block + 4 * (size_t)j) = four;
}

bslam_real_t bslam_factor_get(const bslam_factor_t *factor, int i, int j)
{
    const bslam_real_t *a = bslam_factor_row(factor, i), *b = bslam_factor_row(factor, j);
    bslam_real_t sum = 0;
    for (int k = 0; k <= (i < j ? i : j); k++) {
        sum += factor->d[k] * (a[4 * k] * b[4 * k]);
    }
    return sum;
}

/// The four rows from place `at`, a multiple of four.
static bslam_real_t *block_of(bslam_factor_t *factor, int at)
{
    return at < factor->body_count ? factor->body + bslam_factor_block_at(at) : factor->tail;
}

static bslam_real_t *row_of(bslam_factor_t *factor, int i)
{
    return block_of(factor, i / 4 * 4) + i % 4;  // a row that does not exist, too
}

/// Row i is that of a value that goes with no other one, or of none.
static void begin_row(bslam_factor_t *factor, int i, bslam_real_t own)
{
    bslam_real_t *row = row_of(factor, i);
    for (int j = 0; j < i / 4 * 4 + 4; j++) {
        row[4 * j] = j == i ? own : 0;
    }
}

void bslam_factor_begin(bslam_factor_t *factor, int body_count, int tail_count)
{
    *factor = (bslam_factor_t){.body_count = body_count, .tail_count = tail_count};
    for (int i = 0; i < body_count; i++) {
        begin_row(factor, i, 1);
    }
    for (int i = 0; i < tail_count; i++) {
        begin_row(factor, bslam_factor_tail_at(factor) + i, 1);
    }
}

void bslam_factor_add_row(bslam_factor_t *factor, int i, int k, bslam_real_t share)
{
    bslam_real_t *row = row_of(factor, i);
    const bslam_real_t *other = bslam_factor_row(factor, k);
    for (int j = 0; j <= k; j++) {
        row[4 * j] += share * other[4 * j];
    }
}

void bslam_factor_scale(bslam_factor_t *factor, int i, bslam_real_t by)
{
    bslam_real_t *row = row_of(factor, i);
    for (int j = 0; j < i; j++) {
        row[4 * j] *= by;
    }
    for (int k = i + 1; k < bslam_factor_places(factor); k++) {
        row_of(factor, k)[4 * i] /= by;
    }
    factor->d[i] *= by * by;
}

// ---- a rank-one sum ---------------------------------------------------------------------------------------

/// A variance that becomes more than this many times larger leaves nothing to add to.
static const bslam_real_t GROWTH_MAX = 4;

/// What a column's own value takes of a sum; what its row has of w is p. *keep: of the column, 1 if that is
/// added to. False: nothing.
COPIED bool add_to_own(bslam_real_t *d, bslam_real_t p, bslam_real_t *share, bslam_real_t *by,
                       bslam_real_t *keep)
{
    const bslam_real_t scaled = *share * p, sum = *d + scaled * p;
    if (!(sum > VARIANCE_MIN) || p == 0) {
        return false;
    }
    const bslam_real_t inverse = 1 / sum, left = *d * inverse;
    *keep = sum > GROWTH_MAX * *d ? left : 1;
    *by = scaled * inverse;
    *share *= left;
    *d = sum;
    return true;
}

/// A column of four rows, l, of which w had so much before it and has so much behind it.
COPIED void add_to_column(bslam_real_t *l, bslam_real_t by, bslam_real_t keep, bslam_four_t before,
                          bslam_four_t behind)
{
    const bslam_four_t old = bslam_four(l);
    *(bslam_four_at_t *)l = keep < 1 ? keep * old + by * before : old + by * behind;
}

/// What goes through a factor: w and what columns have taken of it.
typedef struct passing {
    bslam_real_t *w, *by, *keep, *d;
    bslam_real_t share;
    int first;
    int grown;  ///< behind the last column that keeps less than all: there the usual way is a difference of
                ///< large numbers
    int end;    ///< behind the column that took all that was left
} passing_t;

/// Four rows through the columns before theirs. Returns what is left of w.
COPIED bslam_four_t pass_before(const passing_t *passing, bslam_real_t *block, int at)
{
    const bslam_real_t *w = passing->w, *by = passing->by;
    const int end = passing->end < at ? passing->end : at;
    bslam_four_t rest = bslam_four(w + at);
    int j = passing->first;
    for (; j < passing->grown && j < end; j++) {
        const bslam_four_t before = rest;
        rest -= w[j] * load(block, j);
        add_to_column(block + 4 * j, by[j], passing->keep[j], before, rest);
    }
    for (; j < end; j++) {
        const bslam_four_t l = load(block, j);
        rest -= w[j] * l;
        store(block, j, l + by[j] * rest);
    }
    return rest;
}

/// And through row `lane`'s own.
COPIED void pass_own(passing_t *passing, bslam_real_t *block, int at, const int lane, bslam_four_t *rest)
{
    const int j = at + lane;
    const bslam_real_t p = (*rest)[lane];
    if (j < passing->first || j >= passing->end) {
        return;
    }
    passing->w[j] = p;
    passing->by[j] = 0;
    passing->keep[j] = 1;
    if (!add_to_own(&passing->d[j], p, &passing->share, &passing->by[j], &passing->keep[j])) {
        *rest -= p * load(block, j);
        return;
    }
    const bslam_four_t before = *rest;
    *rest -= p * load(block, j);  // of its own row nothing is left
    add_to_column(block + 4 * j, passing->by[j], passing->keep[j], before, *rest);
    if (passing->keep[j] < 1) {
        passing->grown = j + 1;
        block[4 * j + lane] = 1;
    }
    if (!(passing->share > 0)) {
        passing->end = j + 1;
    }
}

void bslam_factor_add(bslam_factor_t *factor, int first, bslam_real_t share, bslam_real_t *w,
                      bslam_real_t scratch[2][BSLAM_FACTOR_PLACES_MAX])
{
    passing_t passing = {w,     scratch[0], scratch[1], factor->d,
                         share, first,      first,      bslam_factor_places(factor)};
    for (int at = first / 4 * 4; share > 0 && at < bslam_factor_places(factor); at += 4) {
        bslam_real_t *block = block_of(factor, at);
        bslam_four_t rest = pass_before(&passing, block, at);
        pass_own(&passing, block, at, 0, &rest);
        pass_own(&passing, block, at, 1, &rest);
        pass_own(&passing, block, at, 2, &rest);
        pass_own(&passing, block, at, 3, &rest);
    }
}

/// Column k leaves L; what it had is in w. Returns the first place behind it.
static int take_column(bslam_factor_t *factor, int k, bslam_real_t *w)
{
    memset(w, 0, (size_t)bslam_factor_places(factor) * sizeof w[0]);
    for (int i = k + 1; i < bslam_factor_places(factor); i++) {
        bslam_real_t *row = row_of(factor, i);
        w[i] = row[4 * k];
        row[4 * k] = 0;
    }
    return k + 1;
}

void bslam_factor_forget(bslam_factor_t *factor, int k, bslam_real_t variance, bslam_real_t *w,
                         bslam_real_t scratch[2][BSLAM_FACTOR_PLACES_MAX])
{
    const int behind = take_column(factor, k, w);
    bslam_factor_add(factor, behind, factor->d[k], w, scratch);
    begin_row(factor, k, 1);
    factor->d[k] = variance;
}

// ---- a body that grows and shrinks ------------------------------------------------------------------------

/// The tail's own columns go to where those of a body of this size end.
static void move_tail(bslam_factor_t *factor, int body_count)
{
    const size_t four = 4 * sizeof factor->d[0];
    const int from = bslam_factor_tail_at(factor), to = BSLAM_FACTOR_PADDED(body_count);
    factor->body_count = body_count;
    if (to != from) {
        memmove(factor->tail + 4 * to, factor->tail + 4 * from, 4 * four);
        memmove(factor->d + to, factor->d + from, four);
    }
    if (to > from) {
        const size_t length = (size_t)(to - from) * sizeof factor->d[0];
        memset(factor->tail + 4 * from, 0, 4 * length);
        memset(factor->d + from, 0, length);
    }
}

void bslam_factor_widen(bslam_factor_t *factor, int count)
{
    const int first = factor->body_count;
    move_tail(factor, first + count);
    for (int i = first; i < first + count; i++) {
        begin_row(factor, i, 1);
    }
}

void bslam_factor_remove(bslam_factor_t *factor, int first, int count, bslam_real_t *w,
                         bslam_real_t scratch[2][BSLAM_FACTOR_PLACES_MAX])
{
    for (int k = first; k < first + count; k++) {
        bslam_factor_forget(factor, k, 0, w, scratch);
    }
    const int left = factor->body_count - count;
    for (int i = first; i < left; i++) {
        const bslam_real_t *from = bslam_factor_row(factor, i + count);
        bslam_real_t *to = row_of(factor, i);
        for (int j = 0; j <= i; j++) {
            to[4 * j] = from[4 * (j < first ? j : j + count)];
        }
        factor->d[i] = factor->d[i + count];
    }
    for (int j = first; j < left; j++) {
        store(factor->tail, j, load(factor->tail, j + count));
    }
    for (int i = left; i < bslam_factor_tail_at(factor); i++) {
        begin_row(factor, i, 0);
        store(factor->tail, i, (bslam_four_t){0, 0, 0, 0});
        factor->d[i] = 0;
    }
    move_tail(factor, left);
}

enum { SMALL_MAX = BSLAM_FACTOR_GROWTH_MAX + BSLAM_FACTOR_TAIL_MAX };

/// A few rows over any number of columns with these variances, and their covariance as L D Lᵀ.
typedef struct rows {
    bslam_real_t *a;
    int row_step, column_step, count, columns;
    const bslam_real_t *variance;
    bslam_real_t l[SMALL_MAX][SMALL_MAX];
    bslam_real_t d[SMALL_MAX];
} rows_t;

static bslam_real_t product(const rows_t *rows, int i, int k)
{
    const bslam_real_t *a = rows->a + i * rows->row_step, *b = rows->a + k * rows->row_step;
    bslam_real_t sum = 0;
    for (int c = 0; c < rows->columns; c++) {
        sum += rows->variance[c] * (a[c * rows->column_step] * b[c * rows->column_step]);
    }
    return sum;
}

/// Gram and Schmidt: each row leaves to those behind it what it is not itself. Overwrites them.
static void orthogonalise(rows_t *rows)
{
    for (int i = 0; i < rows->count; i++) {
        const bslam_real_t d = product(rows, i, i);
        rows->l[i][i] = 1;
        rows->d[i] = d > VARIANCE_MIN ? d : 0;
        for (int k = i + 1; rows->d[i] > 0 && k < rows->count; k++) {
            rows->l[k][i] = product(rows, k, i) / d;
            for (int c = 0; c < rows->columns * rows->column_step; c += rows->column_step) {
                rows->a[k * rows->row_step + c] -= rows->l[k][i] * rows->a[i * rows->row_step + c];
            }
        }
    }
}

/// Of new values and the tail, what each has of the tail's own columns and of the noises.
static void fill_corner(const bslam_factor_t *factor, const bslam_growth_t *growth,
                        bslam_real_t a[SMALL_MAX][SMALL_MAX], bslam_real_t variance[SMALL_MAX])
{
    const int tail = factor->tail_count, at = bslam_factor_tail_at(factor);
    for (int c = 0; c < tail; c++) {
        variance[c] = factor->d[at + c];
        for (int r = 0; r < growth->count; r++) {
            a[r][c] = growth->rows[r][at + c];
        }
        for (int r = 0; r < tail; r++) {
            a[growth->count + r][c] = factor->tail[4 * (at + c) + r];
        }
    }
    for (int c = 0; c < growth->noise_count; c++) {
        variance[tail + c] = growth->noise_var[c];
        for (int r = 0; r < growth->count; r++) {
            a[r][tail + c] = growth->by_noise[r][c];
        }
    }
}

void bslam_factor_append(bslam_factor_t *factor, const bslam_growth_t *growth)
{
    const int tail = factor->tail_count, count = growth->count, first = factor->body_count;
    bslam_real_t a[SMALL_MAX][SMALL_MAX] = {{0}}, variance[SMALL_MAX] = {0};
    fill_corner(factor, growth, a, variance);
    rows_t corner = {.a = a[0], SMALL_MAX, 1, count + tail, tail + growth->noise_count, variance, {{0}}, {0}};
    orthogonalise(&corner);
    move_tail(factor, first + count);
    const int tail_at = bslam_factor_tail_at(factor);
    for (int r = 0; r < count; r++) {
        begin_row(factor, first + r, 1);
        bslam_real_t *row = row_of(factor, first + r);
        for (int j = 0; j < first + r; j++) {
            row[4 * j] = j < first ? growth->rows[r][j] : corner.l[r][j - first];
        }
        factor->d[first + r] = corner.d[r];
    }
    for (int r = 0; r < tail; r++) {
        for (int c = 0; c < count + tail; c++) {
            factor->tail[4 * (c < count ? first + c : tail_at + c - count) + r] = corner.l[count + r][c];
        }
        factor->d[tail_at + r] = corner.d[count + r];
    }
}

void bslam_factor_cut(bslam_factor_t *factor, int first)
{
    const int places = bslam_factor_places(factor), tail = factor->tail_count;
    bslam_real_t *from = factor->tail + 4 * (size_t)first;
    rows_t rows = {.a = from, 1, 4, tail, places - first, factor->d + first, {{0}}, {0}};
    orthogonalise(&rows);
    memset(from, 0, 4 * (size_t)(places - first) * sizeof *from);
    memset(factor->d + first, 0, (size_t)(places - first) * sizeof factor->d[0]);
    for (int i = first; i < bslam_factor_tail_at(factor); i++) {
        begin_row(factor, i, 0);
    }
    factor->body_count = first;
    const int at = bslam_factor_tail_at(factor);
    for (int i = 0; i < tail; i++) {
        factor->d[at + i] = rows.d[i];
        for (int k = i; k < tail; k++) {
            factor->tail[4 * (at + i) + k] = rows.l[k][i];
        }
    }
}

// ---- scalar measurements ----------------------------------------------------------------------------------

/// Of four numbers, what those behind each sum up to, and `behind` with them.
COPIED bslam_four_t sums_behind(bslam_four_t own, bslam_real_t behind)
{
    const bslam_real_t three = behind + own[3], two = three + own[2];
    return (bslam_four_t){two + own[1], two, three, behind};
}

bslam_real_t bslam_factor_carry(const bslam_waiting_t *waiting, int places, bslam_real_t *f)
{
    bslam_real_t sum = 0;
    for (int at = places - 4; at >= 0; at -= 4) {
        const bslam_four_t before = bslam_four(f + at);
        const bslam_four_t own = bslam_four(waiting->v + at) * before, behind = sums_behind(own, sum);
        *(bslam_four_at_t *)(f + at) = before + bslam_four(waiting->lambda + at) * behind;
        sum = behind[0] + own[0];
    }
    return sum;
}

bslam_real_t bslam_factor_measure(const bslam_waiting_t *waiting, int places, bslam_real_t variance,
                                  bslam_real_t *d)
{
    bslam_real_t last = variance, last_inverse = 1 / variance;
    for (int at = places - 4; at >= 0; at -= 4) {
        const bslam_four_t f = bslam_four(waiting->lambda + at), before = bslam_four(d + at);
        const bslam_four_t v = before * f, own = v * f, behind = sums_behind(own, last);
        const bslam_four_t sum = behind + own, inverse = 1 / sum;
        const bslam_four_t inverse_behind = {inverse[1], inverse[2], inverse[3], last_inverse};
        // A quotient near 1 is rounded to one side, a small difference is not.
        const bslam_four_t less = before - v * (v * inverse), part = before * (behind * inverse);
        *(bslam_four_at_t *)(waiting->v + at) = v;
        *(bslam_four_at_t *)(waiting->lambda + at) = -f * inverse_behind;
        for (int k = 0; k < 4; k++) {
            d[at + k] = own[k] < behind[k] ? less[k] : part[k];
        }
        last = sum[0];
        last_inverse = inverse[0];
    }
    return last;
}

/// Four rows through all columns of their block, from the last one on. The measurement that is taken last
/// meets what those before it leave.
COPIED void settle_rows(bslam_real_t *block, int columns, const bslam_waiting_t waiting[4], const int count,
                        bslam_real_t *change)
{
    const bslam_real_t *v0 = waiting[0].v, *v1 = waiting[1].v, *v2 = waiting[2].v, *v3 = waiting[3].v;
    const bslam_real_t *lambda0 = waiting[0].lambda, *lambda1 = waiting[1].lambda;
    const bslam_real_t *lambda2 = waiting[2].lambda, *lambda3 = waiting[3].lambda;
    bslam_four_t sum0 = {0}, sum1 = {0}, sum2 = {0}, sum3 = {0};
    for (int j = columns - 1; j >= 0; j--) {
        const bslam_four_t a = load(block, j), b = a + lambda0[j] * sum0;
        sum0 += v0[j] * a;
        if (count == 1) {
            store(block, j, b);
            continue;
        }
        const bslam_four_t c = b + lambda1[j] * sum1;
        sum1 += v1[j] * b;
        if (count == 2) {
            store(block, j, c);
            continue;
        }
        const bslam_four_t d = c + lambda2[j] * sum2;
        sum2 += v2[j] * c;
        store(block, j, count == 3 ? d : d + lambda3[j] * sum3);
        sum3 += v3[j] * d;
    }
    *(bslam_four_at_t *)change +=
        waiting[0].gain * sum0 + waiting[1].gain * sum1 + waiting[2].gain * sum2 + waiting[3].gain * sum3;
}

COPIED void settle_all(bslam_factor_t *factor, const bslam_waiting_t waiting[4], const int count,
                       bslam_real_t *change)
{
    const int body = factor->body_count;
    for (int at = 0; at < body; at += 4) {
        settle_rows(factor->body + bslam_factor_block_at(at), at + 4, waiting, count, change + at);
    }
    const int at = BSLAM_FACTOR_PADDED(body);
    settle_rows(factor->tail, at + 4, waiting, count, change + at);
}

// Functions of their own: in one they would take the stack of all.
#define SETTLE(count) \
    __attribute__((noinline)) static void settle_##count(bslam_factor_t *factor, \
                                                         const bslam_waiting_t *list, bslam_real_t *change) \
    { \
        settle_all(factor, list, count, change); \
    }
SETTLE(1)
SETTLE(2)
SETTLE(3)
SETTLE(4)

void bslam_factor_settle(bslam_factor_t *factor, const bslam_waiting_t *waiting, int count,
                         bslam_real_t *change)
{
    bslam_waiting_t list[4];
    for (int k = 0; k < 4; k++) {
        list[k] = waiting[k < count ? k : 0];
        list[k].gain = k < count ? list[k].gain : 0;
    }
    switch (count) {
    case 1:
        settle_1(factor, list, change);
        break;
    case 2:
        settle_2(factor, list, change);
        break;
    case 3:
        settle_3(factor, list, change);
        break;
    default:
        settle_4(factor, list, change);
        break;
    }
}
