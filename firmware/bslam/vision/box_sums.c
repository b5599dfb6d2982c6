#include "bslam/vision/box_sums.h"

#include <string.h>

#include "bslam/math/bounds.h"
#include "bslam/math/lanes.h"

#define STRIP BSLAM_STRIP
#define ZONES BSLAM_BOX_ZONES
#define CELLS_ENOUGH 16

/// A rectangle of cells: [left, right) by [top, bottom).
typedef struct area {
    int32_t left, top, right, bottom;
} area_t;

/// An area within the frame: every row, or every other one.
typedef struct rows {
    int32_t first, end, stride;  ///< of rows
    int32_t left, right;         ///< columns [left, right)
} rows_t;

/// Means of every other row of a large area are as good.
static int32_t stride_of(int32_t cells)
{
    return cells > CELLS_ENOUGH ? 2 : 1;
}

static rows_t rows_of(const bslam_view_t *view, area_t area)
{
    const int32_t cells = (area.right - area.left) * (area.bottom - area.top);
    const int32_t left = bslam_most(area.left, 0), right = bslam_least(area.right, view->frame->columns);
    return (rows_t){.first = bslam_most(area.top, 0),
                    .end = bslam_least(area.bottom, view->frame->rows),
                    .stride = stride_of(cells),
                    .left = left,
                    .right = right > left ? right : left};
}

/// A strip along a side of a box, outside.
static area_t strip_of(const bslam_proposal_t *box, bslam_side_t side)
{
    switch (side) {
    case BSLAM_SIDE_LEFT:
        return (area_t){box->left - STRIP, box->top, box->left, box->bottom};
    case BSLAM_SIDE_RIGHT:
        return (area_t){box->right, box->top, box->right + STRIP, box->bottom};
    case BSLAM_SIDE_TOP:
        return (area_t){box->left, box->top - STRIP, box->right, box->top};
    default:
        return (area_t){box->left, box->bottom, box->right, box->bottom + STRIP};
    }
}

/// The box's zones: rows and columns that they begin at, and one past the last.
typedef struct grid {
    int32_t left[ZONES + 1], top[ZONES + 1];
} grid_t;

static grid_t grid_of(const bslam_proposal_t *p)
{
    grid_t grid;
    for (int32_t i = 0; i <= ZONES; i++) {
        grid.left[i] = p->left + i * (p->right - p->left) / ZONES;
        grid.top[i] = p->top + i * (p->bottom - p->top) / ZONES;
    }
    return grid;
}

/// Stride of each row of zones; 0 if it is not the same in all of them.
static void fill_strides(const grid_t *grid, const bslam_proposal_t *p, int32_t strides[ZONES])
{
    // The narrowest and the widest zone of a row; where they differ it is by one column.
    const int32_t narrow = (p->right - p->left) / ZONES, wide = (p->right - p->left + ZONES - 1) / ZONES;
    for (int32_t row = 0; row < ZONES; row++) {
        const int32_t height = grid->top[row + 1] - grid->top[row];
        const int32_t stride = stride_of(narrow * height);
        strides[row] = stride == stride_of(wide * height) ? stride : 0;
    }
}

#if BSLAM_HAS_LANES

// --- Sixteen cells side by side at a time, or two of each of eight rows. Tables have room for all of them
// beyond the last cell.

/// Bytes that stand for signed numbers are 128 more while they are added up.
#define SIGNED_ZERO 0x80808080U
/// Rows of a strip that stands upright.
#define ROWS_AT_ONCE 8

/// An area's rows.
typedef struct span {
    int32_t first;        ///< its first cell
    int32_t rows, apart;  ///< how many rows, and cells from one to the next
    int32_t width;        ///< cells of a row
} span_t;

static span_t span_of(const bslam_view_t *view, const rows_t *rows)
{
    const int32_t columns = view->frame->columns, height = bslam_most(rows->end - rows->first, 0);
    return (span_t){
        .first = rows->first * columns + rows->left,
        .rows = rows->stride == 1 ? height : (height + 1) / 2,
        .apart = rows->stride * columns,
        .width = rows->right - rows->left,
    };
}

/// Sums of bytes, which bslam_lanes_sum() adds up.
typedef struct byte_sums {
    bslam_lanes_t light, reddish, bluish, spread, value;
} byte_sums_t;

static inline bslam_lanes_t from_zero(bslam_lanes_t signed_bytes)
{
    return signed_bytes ^ bslam_lanes_of(SIGNED_ZERO);
}

/// Adds eight halves of each, walls' and floors' numbers.
typedef struct frequent_sums {
    bslam_lanes_t walls, floors;
} frequent_sums_t;

static inline void add_frequent(bslam_lanes_t frequent, frequent_sums_t *sums)
{
    sums->walls = bslam_halves_add(sums->walls, frequent & bslam_lanes_of(BSLAM_EVEN_BYTES));
    sums->floors = bslam_halves_add(sums->floors, bslam_halves_down(frequent, 8));
}

/// What does not count taken out.
static inline void take_frequent(const frequent_sums_t *from, bslam_lanes_t mask, bslam_sums_t *sums)
{
    sums->wall += bslam_halves_sum(from->walls & mask);
    sums->floor += bslam_halves_sum(from->floors & mask);
}

static void take_bytes(const byte_sums_t *from, bslam_sums_t *sums)
{
    sums->light += bslam_lanes_sum(from->light);
    sums->reddish += bslam_lanes_sum(from->reddish);
    sums->bluish += bslam_lanes_sum(from->bluish);
    sums->spread += bslam_lanes_sum(from->spread);
    sums->value += bslam_lanes_sum(from->value);
}

/// Adds 16 cells from the i-th on, as far as the mask has them.
static inline void add_strip(const bslam_view_t *view, int32_t i, bslam_lanes_t mask, byte_sums_t *sums)
{
    const bslam_tones_t *tones = view->tones;
    sums->light = bslam_lanes_sum_add(bslam_lanes_at(tones->light + i) & mask, sums->light);
    sums->reddish = bslam_lanes_sum_add(from_zero(bslam_lanes_at(tones->reddish + i)) & mask, sums->reddish);
    sums->bluish = bslam_lanes_sum_add(from_zero(bslam_lanes_at(tones->bluish + i)) & mask, sums->bluish);
    sums->spread = bslam_lanes_sum_add(bslam_lanes_at(tones->spread + i) & mask, sums->spread);
    sums->value = bslam_lanes_sum_add(from_zero(bslam_lanes_at(view->values + i)) & mask, sums->value);
}

/// All but what sum_upright() has of a strip.
static void sum_level(const bslam_view_t *view, const span_t *span, bslam_sums_t *sums)
{
    byte_sums_t bytes = {0};
    for (int32_t left = 0; left < span->width; left += BSLAM_CELL_STEP) {
        const bslam_lanes_t mask = bslam_lanes_first(span->width - left);
        frequent_sums_t low = {0}, high = {0};
        int32_t i = span->first + left;
        for (int32_t row = span->rows; row > 0; row--, i += span->apart) {
            add_strip(view, i, mask, &bytes);
            add_frequent(bslam_lanes_at(view->frequent + i), &low);
            add_frequent(bslam_lanes_at(view->frequent + i + 8), &high);
        }
        take_frequent(&low, bslam_bytes_lower_in_turn(mask, mask), sums);
        take_frequent(&high, bslam_bytes_upper_in_turn(mask, mask), sums);
    }
    take_bytes(&bytes, sums);
}

/// Takes ROWS_AT_ONCE rows at a time out of the span of a strip that is STRIP columns wide.
static void sum_upright(const bslam_view_t *view, span_t *span, bslam_sums_t *sums)
{
    const bslam_tones_t *tones = view->tones;
    const int32_t apart = span->apart;
    byte_sums_t bytes = {0};
    frequent_sums_t frequent = {0};
    for (; span->rows >= ROWS_AT_ONCE; span->rows -= ROWS_AT_ONCE) {
        const int32_t i = span->first;
        bytes.light = bslam_lanes_sum_add(bslam_lanes_of_pairs(tones->light + i, apart), bytes.light);
        bytes.reddish =
            bslam_lanes_sum_add(from_zero(bslam_lanes_of_pairs(tones->reddish + i, apart)), bytes.reddish);
        bytes.bluish =
            bslam_lanes_sum_add(from_zero(bslam_lanes_of_pairs(tones->bluish + i, apart)), bytes.bluish);
        bytes.spread = bslam_lanes_sum_add(bslam_lanes_of_pairs(tones->spread + i, apart), bytes.spread);
        bytes.value =
            bslam_lanes_sum_add(from_zero(bslam_lanes_of_pairs(view->values + i, apart)), bytes.value);
        for (int32_t k = 0; k < ROWS_AT_ONCE; k += 4) {
            const uint16_t *at = view->frequent + i + k * apart;
            add_frequent(bslam_lanes_of_words(bslam_word_at(at), bslam_word_at(at + apart),
                                              bslam_word_at(at + 2 * apart), bslam_word_at(at + 3 * apart)),
                         &frequent);
        }
        span->first += ROWS_AT_ONCE * apart;
    }
    take_bytes(&bytes, sums);
    take_frequent(&frequent, ~bslam_lanes_zero(), sums);
}

bslam_sums_t bslam_sum_beside(const bslam_view_t *view, const bslam_proposal_t *box, bslam_side_t side)
{
    const rows_t rows = rows_of(view, strip_of(box, side));
    span_t span = span_of(view, &rows);
    bslam_sums_t sums = {.cells = span.rows * span.width};
    if (span.width == STRIP && span.rows >= ROWS_AT_ONCE) {
        sum_upright(view, &span, &sums);
    }
    if (span.rows > 0) {
        sum_level(view, &span, &sums);
    }
    sums.reddish -= 128 * sums.cells;
    sums.bluish -= 128 * sums.cells;
    sums.value -= 128 * sums.cells;
    return sums;
}

/// The tones of a zone.
static inline bslam_zone_sums_t sum_zone(const bslam_tones_t *tones, const span_t *zone)
{
    const int32_t cells = zone->rows * zone->width;
    bslam_lanes_t light = bslam_lanes_zero(), reddish = light, bluish = light;
    for (int32_t left = 0; left < zone->width; left += BSLAM_CELL_STEP) {
        const bslam_lanes_t mask = bslam_lanes_first(zone->width - left);
        int32_t i = zone->first + left;
        for (int32_t row = zone->rows; row > 0; row--, i += zone->apart) {
            light = bslam_lanes_sum_add(bslam_lanes_at(tones->light + i) & mask, light);
            reddish = bslam_lanes_sum_add(from_zero(bslam_lanes_at(tones->reddish + i)) & mask, reddish);
            bluish = bslam_lanes_sum_add(from_zero(bslam_lanes_at(tones->bluish + i)) & mask, bluish);
        }
    }
    return (bslam_zone_sums_t){cells, bslam_lanes_sum(light), bslam_lanes_sum(reddish) - 128 * cells,
                               bslam_lanes_sum(bluish) - 128 * cells};
}

/// Sums of squares.
typedef struct square_sums {
    bslam_lanes_t light, reddish, bluish;
} square_sums_t;

static inline bslam_lanes_t squares_add(bslam_lanes_t even, bslam_lanes_t odd, bslam_lanes_t sums)
{
    return bslam_words_add(bslam_words_add(bslam_halves_dots(even, even), sums), bslam_halves_dots(odd, odd));
}

static inline bslam_lanes_t signed_squares_add(bslam_lanes_t bytes, bslam_lanes_t sums)
{
    return squares_add(bslam_bytes_signed_evens(bytes), bslam_bytes_signed_odds(bytes), sums);
}

static inline void add_squares(const bslam_tones_t *tones, int32_t i, bslam_lanes_t mask, square_sums_t *sums)
{
    const bslam_lanes_t light = bslam_lanes_at(tones->light + i) & mask;
    sums->light =
        squares_add(light & bslam_lanes_of(BSLAM_EVEN_BYTES), bslam_halves_down(light, 8), sums->light);
    sums->reddish = signed_squares_add(bslam_lanes_at(tones->reddish + i) & mask, sums->reddish);
    sums->bluish = signed_squares_add(bslam_lanes_at(tones->bluish + i) & mask, sums->bluish);
}

/// Sums of texture and values; `likely` has a byte a column, which the rows of a frame do not fill.
typedef struct texture_sums {
    bslam_lanes_t spread, step_x, step_y, value, likely;
} texture_sums_t;

_Static_assert(BSLAM_IMAGE_HEIGHT_MAX / BSLAM_CELL_PX <= 255, "rows fit a byte");

static inline void add_cells(const bslam_view_t *view, int32_t i, bslam_lanes_t mask, texture_sums_t *sums)
{
    const bslam_lanes_t values = bslam_lanes_at(view->values + i);
    sums->spread = bslam_lanes_sum_add(bslam_lanes_at(view->tones->spread + i) & mask, sums->spread);
    sums->step_x = bslam_lanes_sum_add(bslam_lanes_at(view->step_x + i) & mask, sums->step_x);
    sums->step_y = bslam_lanes_sum_add(bslam_lanes_at(view->step_y + i) & mask, sums->step_y);
    sums->value = bslam_lanes_sum_add(from_zero(values) & mask, sums->value);
    sums->likely = bslam_lanes_wrapped_less(sums->likely, bslam_bytes_are_positive(values));
}

/// Adds the texture and the values of an area's cells, and the squares of their tones.
static void add_texture(const bslam_view_t *view, const span_t *span, bslam_sums_t *sums)
{
    square_sums_t squares = {0};
    texture_sums_t texture = {0};
    for (int32_t left = 0; left < span->width; left += BSLAM_CELL_STEP) {
        const bslam_lanes_t mask = bslam_lanes_first(span->width - left);
        frequent_sums_t low = {0}, high = {0};
        const int32_t first = span->first + left;
        texture.likely = bslam_lanes_zero();
        for (int32_t row = span->rows, i = first; row > 0; row--, i += span->apart) {
            add_squares(view->tones, i, mask, &squares);
        }
        for (int32_t row = span->rows, i = first; row > 0; row--, i += span->apart) {
            add_cells(view, i, mask, &texture);
            add_frequent(bslam_lanes_at(view->frequent + i), &low);
            add_frequent(bslam_lanes_at(view->frequent + i + 8), &high);
        }
        sums->likely += bslam_lanes_sum(bslam_lanes_sum_add(texture.likely & mask, bslam_lanes_zero()));
        take_frequent(&low, bslam_bytes_lower_in_turn(mask, mask), sums);
        take_frequent(&high, bslam_bytes_upper_in_turn(mask, mask), sums);
    }
    sums->light_sq += bslam_words_sum(squares.light);
    sums->reddish_sq += bslam_words_sum(squares.reddish);
    sums->bluish_sq += bslam_words_sum(squares.bluish);
    sums->spread += bslam_lanes_sum(texture.spread);
    sums->step_x += bslam_lanes_sum(texture.step_x);
    sums->step_y += bslam_lanes_sum(texture.step_y);
    sums->value += bslam_lanes_sum(texture.value) - 128 * span->rows * span->width;
}

/// Adds a row of zones: the texture, which nothing asks of single zones, across them where they have the same
/// stride, else, 0, of each.
static void add_zones(const bslam_view_t *view, const grid_t *grid, int32_t r, int32_t stride,
                      bslam_zone_sums_t zones[ZONES], bslam_sums_t *sums)
{
    rows_t rows = {grid->top[r], grid->top[r + 1], stride, grid->left[0], grid->left[ZONES]};
    if (stride != 0) {
        const span_t span = span_of(view, &rows);
        add_texture(view, &span, sums);
    }
    for (int32_t c = 0; c < ZONES; c++) {
        rows.left = grid->left[c];
        rows.right = grid->left[c + 1];
        rows.stride = stride != 0 ? stride : stride_of((rows.right - rows.left) * (rows.end - rows.first));
        const span_t span = span_of(view, &rows);
        if (stride == 0) {
            add_texture(view, &span, sums);
        }
        zones[c] = sum_zone(view->tones, &span);
        sums->cells += zones[c].cells;
        sums->light += zones[c].light;
        sums->reddish += zones[c].reddish;
        sums->bluish += zones[c].bluish;
    }
}

#else

// --- By words, four cells at a time

#define ALL_BYTES 0xFFFFFFFFU
/// Bytes that stand for signed numbers are 128 more while they are added up.
#define SIGNED_ZERO 0x80808080U

/// An area's rows as words.
typedef struct words {
    int32_t first;        ///< its first cell
    int32_t rows, apart;  ///< how many rows, and cells from one to the next
    int32_t width;        ///< cells of a row
    int32_t whole;        ///< of these in whole words
    uint32_t mask;        ///< bytes of the word behind these that count; 0: there is no such word
} words_t;

static inline words_t words_of(const bslam_view_t *view, const rows_t *rows)
{
    const int32_t columns = view->frame->columns, width = rows->right - rows->left;
    const int32_t rest = width & (BSLAM_WORD_BYTES - 1), height = bslam_most(rows->end - rows->first, 0);
    return (words_t){
        .first = rows->first * columns + rows->left,
        .rows = rows->stride == 1 ? height : (height + 1) >> 1,
        .apart = rows->stride * columns,
        .width = width,
        .whole = width - rest,
        .mask = (1U << 8 * rest) - 1,
    };
}

/// Sums of light, chroma and spread, and of the squares of the former.
typedef struct tone_sums {
    uint32_t light, reddish, bluish, spread;
    int32_t light_sq, reddish_sq, bluish_sq;
} tone_sums_t;

static inline int32_t square_sum(uint32_t even, uint32_t odd, int32_t sum)
{
    return bslam_halves_dot(even, even, bslam_halves_dot(odd, odd, sum));
}

/// Bytes that do not count are 0.
static inline void add_tones(uint32_t light, uint32_t reddish, uint32_t bluish, tone_sums_t *sums)
{
    sums->light = bslam_bytes_sum(light, sums->light);
    sums->reddish = bslam_bytes_sum(reddish ^ SIGNED_ZERO, sums->reddish);
    sums->bluish = bslam_bytes_sum(bluish ^ SIGNED_ZERO, sums->bluish);
    sums->light_sq = square_sum(bslam_bytes_even(light), bslam_bytes_odd(light), sums->light_sq);
    sums->reddish_sq =
        square_sum(bslam_bytes_signed_even(reddish), bslam_bytes_signed_odd(reddish), sums->reddish_sq);
    sums->bluish_sq =
        square_sum(bslam_bytes_signed_even(bluish), bslam_bytes_signed_odd(bluish), sums->bluish_sq);
}

static inline void add_strip(const bslam_tones_t *tones, int32_t i, uint32_t mask, tone_sums_t *sums)
{
    sums->light = bslam_bytes_sum(bslam_word_at(tones->light + i) & mask, sums->light);
    sums->reddish = bslam_bytes_sum((bslam_word_at(tones->reddish + i) ^ SIGNED_ZERO) & mask, sums->reddish);
    sums->bluish = bslam_bytes_sum((bslam_word_at(tones->bluish + i) ^ SIGNED_ZERO) & mask, sums->bluish);
    sums->spread = bslam_bytes_sum(bslam_word_at(tones->spread + i) & mask, sums->spread);
}

#if __has_attribute(noclone)
#define AS_IT_STANDS __attribute__((noinline, noclone))
#else
#define AS_IT_STANDS __attribute__((noinline))
#endif

/// Of an area in a box, the spread aside. The tables come one by one, not to be known as parts of one: so
/// each has a pointer in a register, where offsets from one would take sums out of theirs.
AS_IT_STANDS static tone_sums_t sum_tones(const uint8_t *light, const int8_t *reddish, const int8_t *bluish,
                                          const words_t *words)
{
    tone_sums_t sums = {0};
    const int32_t skip = words->apart - words->whole;
    const uint32_t mask = words->mask;
    for (int32_t row = words->rows; row > 0; row--) {
        for (const uint8_t *end = light + words->whole; light != end;) {
            add_tones(bslam_word_at(light), bslam_word_at(reddish), bslam_word_at(bluish), &sums);
            light += BSLAM_WORD_BYTES;
            reddish += BSLAM_WORD_BYTES;
            bluish += BSLAM_WORD_BYTES;
        }
        if (mask != 0) {
            add_tones(bslam_word_at(light) & mask, bslam_word_at(reddish) & mask,
                      bslam_word_at(bluish) & mask, &sums);
        }
        light += skip;
        reddish += skip;
        bluish += skip;
    }
    const int32_t a_row = (words->width + BSLAM_WORD_BYTES - 1) & ~(BSLAM_WORD_BYTES - 1);
    const int32_t zeros = 128 * words->rows * a_row;
    sums.reddish -= (uint32_t)zeros;
    sums.bluish -= (uint32_t)zeros;
    return sums;
}

/// Of an area beside a box, without squares.
static tone_sums_t sum_strip(const bslam_view_t *view, const words_t *words)
{
    const bslam_tones_t *tones = view->tones;
    tone_sums_t sums = {0};
    int32_t first = words->first, last = first + words->whole;
    for (int32_t row = words->rows; row > 0; row--, first += words->apart, last += words->apart) {
        for (int32_t i = first; i < last; i += BSLAM_WORD_BYTES) {
            add_strip(tones, i, ALL_BYTES, &sums);
        }
        if (words->mask != 0) {
            add_strip(tones, last, words->mask, &sums);
        }
    }
    const int32_t zeros = 128 * words->rows * words->width;
    sums.reddish -= (uint32_t)zeros;
    sums.bluish -= (uint32_t)zeros;
    return sums;
}

/// Sums of spread and steps.
typedef struct step_sums {
    uint32_t spread, x, y;
} step_sums_t;

static inline void add_steps(const bslam_view_t *view, int32_t i, uint32_t mask, step_sums_t *sums)
{
    sums->spread = bslam_bytes_sum(bslam_word_at(view->tones->spread + i) & mask, sums->spread);
    sums->x = bslam_bytes_sum(bslam_word_at(view->step_x + i) & mask, sums->x);
    sums->y = bslam_bytes_sum(bslam_word_at(view->step_y + i) & mask, sums->y);
}

static step_sums_t sum_steps(const bslam_view_t *view, const words_t *words)
{
    step_sums_t sums = {0};
    int32_t first = words->first, last = first + words->whole;
    for (int32_t row = words->rows; row > 0; row--, first += words->apart, last += words->apart) {
        for (int32_t i = first; i < last; i += BSLAM_WORD_BYTES) {
            add_steps(view, i, ALL_BYTES, &sums);
        }
        if (words->mask != 0) {
            add_steps(view, last, words->mask, &sums);
        }
    }
    return sums;
}

/// Sums of the cells' values, of how many are likely, and of how frequent their tones are.
typedef struct value_sums {
    uint32_t value;
    uint32_t likely;         ///< 128 a cell
    uint32_t walls, floors;  ///< in halves, which a third of a frame does not fill
} value_sums_t;

static inline void add_values(const int8_t *values, uint32_t mask, value_sums_t *sums)
{
    const uint32_t value = (bslam_word_at(values) ^ SIGNED_ZERO) & mask;
    sums->value = bslam_bytes_sum(value, sums->value);
    // A value above 0 and 127 make 256 or more: the top bit of their mean.
    const uint32_t likely = bslam_bytes_mean(value, ~SIGNED_ZERO) & SIGNED_ZERO;
    sums->likely = bslam_bytes_sum(likely, sums->likely);
}

/// Two cells, or with a mask the first one.
static inline void add_frequent(const uint16_t *frequent, uint32_t mask, value_sums_t *sums)
{
    const uint32_t both = bslam_word_at(frequent) & mask;
    sums->walls = bslam_bytes_add_even(sums->walls, both);
    sums->floors = bslam_bytes_add_odd(sums->floors, both);
}

/// The cells of a row's last word.
static inline void add_last_values(const bslam_view_t *view, int32_t i, uint32_t mask, value_sums_t *sums)
{
    add_values(view->values + i, mask, sums);
    add_frequent(view->frequent + i, mask > 0xFFU ? ALL_BYTES : 0xFFFFU, sums);
    if (mask > 0xFFFFU) {
        add_frequent(view->frequent + i + 2, 0xFFFFU, sums);
    }
}

static value_sums_t sum_values(const bslam_view_t *view, const words_t *words)
{
    value_sums_t sums = {0};
    int32_t first = words->first, last = first + words->whole;
    for (int32_t row = words->rows; row > 0; row--, first += words->apart, last += words->apart) {
        for (int32_t i = first; i < last; i += BSLAM_WORD_BYTES) {
            add_values(view->values + i, ALL_BYTES, &sums);
            add_frequent(view->frequent + i, ALL_BYTES, &sums);
            add_frequent(view->frequent + i + 2, ALL_BYTES, &sums);
        }
        if (words->mask != 0) {
            add_last_values(view, last, words->mask, &sums);
        }
    }
    sums.value -= (uint32_t)(128 * words->rows * words->width);
    return sums;
}

/// The two halves of a word together.
static int32_t halves_sum(uint32_t halves)
{
    return (int32_t)((halves & 0xFFFFU) + (halves >> 16));
}

bslam_sums_t bslam_sum_beside(const bslam_view_t *view, const bslam_proposal_t *box, bslam_side_t side)
{
    const rows_t rows = rows_of(view, strip_of(box, side));
    const words_t words = words_of(view, &rows);
    const tone_sums_t tones = sum_strip(view, &words);
    const value_sums_t values = sum_values(view, &words);
    return (bslam_sums_t){
        .cells = words.rows * words.width,
        .light = (int32_t)tones.light,
        .reddish = (int32_t)tones.reddish,
        .bluish = (int32_t)tones.bluish,
        .spread = (int32_t)tones.spread,
        .value = (int32_t)values.value,
        .wall = halves_sum(values.walls),
        .floor = halves_sum(values.floors),
    };
}

/// Adds the texture and the values of an area's cells.
static void add_texture(const bslam_view_t *view, const rows_t *rows, bslam_sums_t *sums)
{
    const words_t words = words_of(view, rows);
    const step_sums_t steps = sum_steps(view, &words);
    const value_sums_t values = sum_values(view, &words);
    sums->spread += (int32_t)steps.spread;
    sums->step_x += (int32_t)steps.x;
    sums->step_y += (int32_t)steps.y;
    sums->value += (int32_t)values.value;
    sums->likely += (int32_t)(values.likely / 128);
    sums->wall += halves_sum(values.walls);
    sums->floor += halves_sum(values.floors);
}

/// Adds the tones of a zone.
static bslam_zone_sums_t add_zone(const bslam_view_t *view, const rows_t *rows, bslam_sums_t *sums)
{
    const words_t words = words_of(view, rows);
    const bslam_tones_t *all = view->tones;
    const tone_sums_t tones =
        sum_tones(all->light + words.first, all->reddish + words.first, all->bluish + words.first, &words);
    const int32_t cells = words.rows * words.width;
    sums->cells += cells;
    sums->light += (int32_t)tones.light;
    sums->reddish += (int32_t)tones.reddish;
    sums->bluish += (int32_t)tones.bluish;
    sums->light_sq += tones.light_sq;
    sums->reddish_sq += tones.reddish_sq;
    sums->bluish_sq += tones.bluish_sq;
    return (bslam_zone_sums_t){cells, (int32_t)tones.light, (int32_t)tones.reddish, (int32_t)tones.bluish};
}

/// Adds a row of zones: the texture, which nothing asks of single zones, across them where they have the same
/// stride, else, 0, of each.
static void add_zones(const bslam_view_t *view, const grid_t *grid, int32_t r, int32_t stride,
                      bslam_zone_sums_t zones[ZONES], bslam_sums_t *sums)
{
    rows_t rows = {.first = grid->top[r], .end = grid->top[r + 1], .stride = stride};
    for (int32_t c = 0; c < ZONES; c++) {
        rows.left = grid->left[c];
        rows.right = grid->left[c + 1];
        if (stride == 0) {
            rows.stride = stride_of((rows.right - rows.left) * (rows.end - rows.first));
            add_texture(view, &rows, sums);
        }
        zones[c] = add_zone(view, &rows, sums);
    }
    if (stride != 0) {
        rows.left = grid->left[0];
        add_texture(view, &rows, sums);
    }
}

#endif

void bslam_sum_box(const bslam_view_t *view, const bslam_proposal_t *box,
                   bslam_zone_sums_t zones[ZONES * ZONES], bslam_sums_t *inside)
{
    const grid_t grid = grid_of(box);
    int32_t strides[ZONES];
    fill_strides(&grid, box, strides);
    memset(inside, 0, sizeof *inside);
    for (int32_t r = 0; r < ZONES; r++) {
        add_zones(view, &grid, r, strides[r], zones + ZONES * r, inside);
    }
}
