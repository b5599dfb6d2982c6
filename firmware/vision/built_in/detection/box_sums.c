#include "vision/built_in/detection/box_sums.h"

#include <string.h>

#include "base/bounds.h"
#include "vision/pixels/bytes.h"

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
static area_t strip_of(const bslam_proposal_t *box, bslam_box_side_t side)
{
    switch (side) {
    case BSLAM_BOX_LEFT:
        return (area_t){box->left - STRIP, box->top, box->left, box->bottom};
    case BSLAM_BOX_RIGHT:
        return (area_t){box->right, box->top, box->right + STRIP, box->bottom};
    case BSLAM_BOX_TOP:
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

bslam_sums_t bslam_sum_beside(const bslam_view_t *view, const bslam_proposal_t *box, bslam_box_side_t side)
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
