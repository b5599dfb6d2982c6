#include "vision/built_in/gyro/column_shift.h"

#include <string.h>

#include "base/bounds.h"
#include "base/scalar.h"

enum {
    BANDS = BSLAM_TURN_BANDS,
    SHIFT_MAX = BSLAM_TURN_SHIFT_MAX,
    SEARCH_STEP = BSLAM_TURN_SEARCH_STEP,
    WINDOW = BSLAM_TURN_WINDOW
};

// Steps of Gauss and Newton, with weights of Cauchy's kind, and how far one may go.
enum { REFINEMENTS = 4 };
static const bslam_real_t STEP_MAX = BSLAM_R(1.5);  // columns
static const bslam_real_t WAY_STEP_MAX_M = BSLAM_R(0.02);
static const bslam_real_t WAY_MAX_M = BSLAM_R(0.3);  // between two frames: what is thought to be more is none
static const bslam_real_t LEAST_RESIDUAL = BSLAM_R(0.3);
// Residuals are no noise but things that changed, alike over a window: so many count as one.
static const bslam_real_t ALIKE = 20;
static const bslam_real_t ROUNDING_VAR = BSLAM_R(0.17);  // of a residual, from two rounded values
static const bslam_real_t LEAST_SLOPE2 = 1;              // of a window that tells anything
// What a window errs by for not knowing how near things are is that of so much way at least, or a robot that
// seems to stand would seem to know all.
static const bslam_real_t LEAST_WAY_M = BSLAM_R(0.02);

/// sums[i]: of the squares of columns i - SEARCH_STEP, i - 2 SEARCH_STEP and so on.
static void sum_squares(const bslam_turn_pattern_t *pattern, int32_t columns, int32_t *sums)
{
    memset(sums, 0, SEARCH_STEP * sizeof sums[0]);
    for (int32_t i = 0; i < columns; i++) {
        int32_t squares = 0;
        for (int32_t band = 0; band < BANDS; band++) {
            squares += pattern->values[band][i] * pattern->values[band][i];
        }
        sums[i + SEARCH_STEP] = sums[i] + squares;
    }
}

/// Sum of the products of columns first, first + SEARCH_STEP and so on with those they are shifted to.
static int32_t product_sum(const bslam_pattern_pair_t *pair, int32_t first, int32_t end, int32_t shift)
{
    int32_t sum = 0;
    for (int32_t band = 0; band < BANDS; band++) {
        const int8_t *now = pair->now->values[band], *before = pair->before->values[band];
        for (int32_t i = first; i < end; i += SEARCH_STEP) {
            sum += now[i] * before[i + shift];
        }
    }
    return sum;
}

bslam_pattern_match_t bslam_shift_search(const bslam_pattern_pair_t *pair, bslam_turn_squares_t *squares)
{
    const int32_t *now_squares = squares->now, *before_squares = squares->before;
    sum_squares(pair->now, pair->columns, squares->now);
    sum_squares(pair->before, pair->columns, squares->before);
    // Of a narrow frame half must stay in view.
    const int32_t reach = pair->columns / 2 < SHIFT_MAX ? pair->columns / 2 : SHIFT_MAX;
    bslam_pattern_match_t best = {.mismatch = 2};
    for (int32_t shift = -reach; shift <= reach; shift++) {
        const int32_t first = shift < 0 ? -shift : 0;
        const int32_t count = (pair->columns - (shift > 0 ? shift : 0) - first) / SEARCH_STEP;
        const int32_t end = first + count * SEARCH_STEP;
        const int32_t square_sum = now_squares[end] - now_squares[first] + before_squares[end + shift] -
                                   before_squares[first + shift];
        const bslam_real_t differing = (bslam_real_t)(square_sum - 2 * product_sum(pair, first, end, shift));
        const bslam_real_t mismatch = differing / (bslam_real_t)(square_sum + 1);
        if (mismatch < best.mismatch) {
            best.shift = (bslam_real_t)shift;
            best.mismatch = mismatch;
            best.mean_residual = bslam_sqrt(differing / (bslam_real_t)(BANDS * count));
        }
    }
    return best;
}

/// What is looked for, and what is known of it so far.
typedef struct bslam_shift_state {
    bslam_real_t shift;  // columns, of what is infinitely far away
    bslam_real_t travelled_m;
    bslam_real_t scale;         // of residuals: half of it and more weigh less
    bslam_real_t residual_var;  // weighted
    bslam_real_t doubtful_m;    // way whose parallax is only as sure as how near things are
} shift_state_t;

/// Sums over the columns that both frames show.
typedef struct bslam_residual_sums {
    bslam_real_t weight;
    bslam_real_t square;    // weighted
    bslam_real_t absolute;  // not weighted
    int32_t count;
} residual_sums_t;

/// Sums over a few columns side by side, which are compared as one: what stands there is about as near.
typedef struct bslam_turn_window {
    bslam_real_t slope2;  // weighted, as all here
    bslam_real_t slope_residual;
    bslam_real_t parallax;     // slope2 times each column's parallax
    bslam_real_t parallax_sd;  // and times that one's
} window_t;

static void add_column(window_t *window, residual_sums_t *sums, const bslam_pattern_pair_t *pair, int32_t now,
                       bslam_real_t at, bslam_real_t scale, bslam_turn_column_t column)
{
    const int32_t left = (int32_t)at;
    const bslam_real_t part = at - (bslam_real_t)left;
    bslam_real_t slope2 = 0;
    for (int32_t band = 0; band < BANDS; band++) {
        const int8_t *before = &pair->before->values[band][left];
        const bslam_real_t slope = (bslam_real_t)(before[1] - before[0]);
        const bslam_real_t residual = (bslam_real_t)(pair->now->values[band][now] - before[0]) - slope * part;
        const bslam_real_t ratio = residual / (2 * scale);
        const bslam_real_t weight = 1 / (1 + ratio * ratio);
        sums->weight += weight;
        sums->square += weight * residual * residual;
        sums->absolute += bslam_abs(residual);
        slope2 += weight * slope * slope;
        window->slope_residual += weight * slope * residual;
    }
    window->slope2 += slope2;
    window->parallax += slope2 * column.parallax_per_m;
    window->parallax_sd += slope2 * column.parallax_sd_per_m;
    sums->count += BANDS;
}

/// A window's sums, each column shifted by its own parallax.
static window_t look_through(const bslam_pattern_pair_t *pair, const shift_state_t *state,
                             const bslam_turn_column_t *columns, int32_t first, residual_sums_t *sums)
{
    const bslam_real_t way = state->travelled_m / pair->step_rad;
    const int32_t end = bslam_least(first + WINDOW, pair->columns);
    window_t window = {0};
    for (int32_t i = first; i < end; i++) {
        const bslam_real_t at = (bslam_real_t)i + state->shift + way * columns[i].parallax_per_m;
        if (at >= 0 && at < (bslam_real_t)(pair->columns - 1)) {
            add_column(&window, sums, pair, i, at, state->scale, columns[i]);
        }
    }
    return window;
}

/// Normal equations of shift and way, and what goes into a turn: sums over windows, each with its weight.
typedef struct bslam_shift_sums {
    bslam_real_t weight;  // 1/columns²
    bslam_real_t slope;   // times what a metre shifts the window by, columns
    bslam_real_t slope2;  // times its square
    bslam_real_t shift;   // times what the window lacks of its place, columns
    bslam_real_t slope_shift;
    bslam_real_t noise;         // weight² times the patterns' part of the variance, 1/columns²
    bslam_real_t parallax;      // weight times parallax
    bslam_real_t parallax_var;  // and weight² times the square of what it errs by
    bslam_real_t side;          // weight times that error: its sign says on which side things are
} shift_sums_t;

/// A window weighs by the noise of the patterns, by what it errs by for not knowing how near things are, and,
/// as Cauchy has it, by how far it is off.
static void add_window(shift_sums_t *sums, const window_t *window, const shift_state_t *state,
                       bslam_real_t step_rad)
{
    if (window->slope2 < LEAST_SLOPE2) {
        return;
    }
    const bslam_real_t off = window->slope_residual / window->slope2;
    const bslam_real_t parallax = window->parallax / window->slope2;
    const bslam_real_t parallax_sd = window->parallax_sd / window->slope2;
    const bslam_real_t noise = ALIKE * state->residual_var / window->slope2;
    const bslam_real_t doubt = state->doubtful_m * parallax_sd / step_rad;
    const bslam_real_t slope = parallax / step_rad;
    const bslam_real_t weight = 1 / (noise + doubt * doubt + off * off);
    sums->weight += weight;
    sums->slope += weight * slope;
    sums->slope2 += weight * slope * slope;
    sums->shift += weight * off;
    sums->slope_shift += weight * slope * off;
    sums->noise += weight * weight * noise;
    sums->parallax += weight * parallax;
    sums->parallax_var += weight * weight * parallax_sd * parallax_sd;
    sums->side += weight * parallax_sd;
}

/// The sums of all windows. The noise of what they differ by is that of the look before.
static shift_sums_t sum_windows(const bslam_pattern_pair_t *pair, const shift_state_t *state,
                                const bslam_turn_column_t *columns, residual_sums_t *residuals)
{
    shift_sums_t sums = {0};
    for (int32_t first = 0; first < pair->columns; first += WINDOW) {
        const window_t window = look_through(pair, state, columns, first, residuals);
        add_window(&sums, &window, state, pair->step_rad);
    }
    return sums;
}

static bslam_real_t within(bslam_real_t value, bslam_real_t most)
{
    return value < -most ? -most : value > most ? most : value;
}

/// A step of Gauss and Newton; the way's variance by it.
static bslam_real_t step(shift_state_t *state, const shift_sums_t *sums, const bslam_turn_way_t *thought)
{
    const bslam_real_t prior = 1 / thought->variance_m2;
    const bslam_real_t b = sums->slope_shift + (thought->travelled_m - state->travelled_m) * prior;
    // Solved for the way first: its share is what the shift leaves.
    const bslam_real_t spread = sums->slope2 - sums->slope * sums->slope / sums->weight;
    const bslam_real_t information = (spread > 0 ? spread : 0) + prior;  // rounded, it may be below 0
    const bslam_real_t travelled_m = (b - sums->slope * sums->shift / sums->weight) / information;
    const bslam_real_t shift = (sums->shift - sums->slope * travelled_m) / sums->weight;
    state->travelled_m += within(travelled_m, WAY_STEP_MAX_M);
    state->shift += within(shift, STEP_MAX);
    return 1 / information;
}

/// Takes in the residuals of a look.
static void adapt(shift_state_t *state, const residual_sums_t *residuals)
{
    state->residual_var = residuals->square / residuals->weight + ROUNDING_VAR;
    state->scale = residuals->absolute / (bslam_real_t)residuals->count + LEAST_RESIDUAL;
}

/// From a whole shift to the one by which both patterns, each as a whole, lie best over each other, less what
/// driving by has shifted them. To start from the windows' own shifts would be to believe the nearest thing:
/// once most windows are off, they are odd to it and not it to them.
static bool start_at(shift_state_t *state, const bslam_pattern_pair_t *pair,
                     const bslam_turn_column_t *columns, bslam_real_t travelled_m)
{
    residual_sums_t residuals = {0};
    bslam_real_t slope2 = 0, slope_residual = 0, parallax = 0;
    for (int32_t first = 0; first < pair->columns; first += WINDOW) {
        const window_t window = look_through(pair, state, columns, first, &residuals);
        slope2 += window.slope2;
        slope_residual += window.slope_residual;
        parallax += window.parallax;
    }
    if (residuals.count == 0 || !(slope2 > 0)) {
        return false;
    }
    adapt(state, &residuals);
    state->shift +=
        within(slope_residual / slope2, STEP_MAX) - travelled_m * parallax / slope2 / pair->step_rad;
    state->travelled_m = travelled_m;
    state->doubtful_m = bslam_abs(travelled_m) > LEAST_WAY_M ? travelled_m : LEAST_WAY_M;
    return true;
}

bool bslam_shift_fit(const bslam_pattern_pair_t *pair, const bslam_pattern_match_t *start,
                     const bslam_turn_column_t *columns, bslam_turn_way_t *way, bslam_turn_t *turn)
{
    shift_state_t state = {.shift = start->shift, .scale = start->mean_residual + LEAST_RESIDUAL};
    if (!start_at(&state, pair, columns, way->travelled_m)) {
        return false;
    }
    shift_sums_t sums = {0};
    bslam_real_t way_var_m2 = 0;
    for (int32_t i = 0; i < REFINEMENTS; i++) {
        residual_sums_t residuals = {0};
        sums = sum_windows(pair, &state, columns, &residuals);
        if (!(sums.weight > 0)) {
            return false;
        }
        adapt(&state, &residuals);
        way_var_m2 = step(&state, &sums, way);
    }
    *way = (bslam_turn_way_t){within(state.travelled_m, WAY_MAX_M), way_var_m2};
    turn->parallax_rad_per_m = sums.parallax / sums.weight;
    const bslam_real_t parallax_sd = bslam_sqrt(sums.parallax_var) / sums.weight;
    turn->parallax_sd_rad_per_m = sums.side < 0 ? -parallax_sd : parallax_sd;
    turn->turn_rad = -state.shift * pair->step_rad - state.travelled_m * turn->parallax_rad_per_m;
    turn->variance_rad2 = sums.noise / (sums.weight * sums.weight) * pair->step_rad * pair->step_rad;
    turn->mismatch = start->mismatch;
    return true;
}
