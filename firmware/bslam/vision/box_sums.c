#include "bslam/vision/box_sums.h"

#include <string.h>

#include "bslam/math/bytes.h"

#define STRIP BSLAM_STRIP
#define ZONES BSLAM_BOX_ZONES
#define CELLS_ENOUGH 16

static int32_t least(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static int32_t most(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

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
    const int32_t left = most(area.left, 0), right = least(area.right, view->frame->columns);
    return (rows_t){.first = most(area.top, 0),
                    .end = least(area.bottom, view->frame->rows),
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

static bslam_zone_sums_t zone_of(const bslam_sums_t *sums)
{
    return (bslam_zone_sums_t){sums->cells, sums->light, sums->reddish, sums->bluish};
}

/// The box's zones: rows and columns that they begin at, and one past the last.
typedef struct grid {
    int32_t left[ZONES + 1], top[ZONES + 1];
} grid_t;

static area_t zone_area(const grid_t *grid, int32_t row, int32_t column)
{
    return (area_t){grid->left[column], grid->top[row], grid->left[column + 1], grid->top[row + 1]};
}

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

#if BSLAM_HAS_BYTES

// --- By words, four cells at a time

/// Sums of bytes and of their squares. Those that stand for signed numbers are 128 more.
typedef struct byte_sums {
    uint32_t sum;
    int32_t square;
} byte_sums_t;

static inline void add_squared(byte_sums_t *sums, uint32_t bytes)
{
    const uint32_t even = bslam_bytes_even(bytes), odd = bslam_bytes_odd(bytes);
    sums->sum = bslam_bytes_sum(bytes, sums->sum);
    sums->square = bslam_halves_dot(even, even, bslam_halves_dot(odd, odd, sums->square));
}

#define ALL_BYTES 0xFFFFFFFFU
#define ONES 0x01010101U
#define SIGNED_ZERO 0x80808080U

/// The bytes of a row's last word that count.
static uint32_t mask_of(int32_t cells)
{
    return cells > 0 ? (1U << 8 * cells) - 1 : 0U;
}

static inline void add_tones(const bslam_tones_t *tones, int32_t i, uint32_t mask, byte_sums_t *light,
                             byte_sums_t *reddish, byte_sums_t *bluish)
{
    add_squared(light, bslam_word_at(tones->light + i) & mask);
    add_squared(reddish, (bslam_word_at(tones->reddish + i) ^ SIGNED_ZERO) & mask);
    add_squared(bluish, (bslam_word_at(tones->bluish + i) ^ SIGNED_ZERO) & mask);
}

/// Light and chroma of an area.
static void sum_tones(const bslam_view_t *view, const rows_t *rows, bslam_sums_t *sums)
{
    byte_sums_t light = {0}, reddish = {0}, bluish = {0};
    const int32_t width = rows->right - rows->left, last = width & ~(BSLAM_WORD_BYTES - 1);
    const uint32_t mask = mask_of(width - last);
    int32_t cells = 0;
    for (int32_t row = rows->first; row < rows->end; row += rows->stride) {
        int32_t i = row * view->frame->columns + rows->left;
        for (const int32_t end = i + last; i < end; i += BSLAM_WORD_BYTES) {
            add_tones(view->tones, i, ALL_BYTES, &light, &reddish, &bluish);
        }
        if (mask != 0) {
            add_tones(view->tones, i, mask, &light, &reddish, &bluish);
        }
        cells += width;
    }
    sums->cells = cells;
    sums->light = (int32_t)light.sum;
    sums->light_sq = light.square;
    sums->reddish = (int32_t)reddish.sum - 128 * cells;
    sums->reddish_sq = reddish.square - 256 * sums->reddish - 128 * 128 * cells;
    sums->bluish = (int32_t)bluish.sum - 128 * cells;
    sums->bluish_sq = bluish.square - 256 * sums->bluish - 128 * 128 * cells;
}

/// Sums of an area's texture and values.
typedef struct texture_sums {
    uint32_t spread, step_x, step_y;
    uint32_t value, likely;
    uint32_t wall, floor;
} texture_sums_t;

/// The two halves of a word together.
static uint32_t halves_sum(uint32_t halves)
{
    return (halves & 0xFFFFU) + (halves >> 16);
}

static inline void add_texture(const bslam_view_t *view, int32_t i, uint32_t mask, texture_sums_t *sums)
{
    const uint32_t value = (bslam_word_at(view->values + i) ^ SIGNED_ZERO) & mask;
    sums->spread = bslam_bytes_sum(bslam_word_at(view->tones->spread + i) & mask, sums->spread);
    sums->step_x = bslam_bytes_sum(bslam_word_at(view->step_x + i) & mask, sums->step_x);
    sums->step_y = bslam_bytes_sum(bslam_word_at(view->step_y + i) & mask, sums->step_y);
    sums->value = bslam_bytes_sum(value, sums->value);
    sums->likely = bslam_bytes_sum(bslam_bytes_above(value, SIGNED_ZERO), sums->likely);
}

static void merge_tones(bslam_sums_t *into, const bslam_sums_t *from)
{
    into->cells += from->cells;
    into->light += from->light;
    into->reddish += from->reddish;
    into->bluish += from->bluish;
    into->light_sq += from->light_sq;
    into->reddish_sq += from->reddish_sq;
    into->bluish_sq += from->bluish_sq;
}

/// Two cells, to a half of walls and of floors each.
static inline void add_frequent(const bslam_view_t *view, int32_t i, uint32_t *walls, uint32_t *floors)
{
    const uint32_t both = bslam_word_at(view->frequent + i);
    *walls = bslam_bytes_add_even(*walls, both);
    *floors = bslam_bytes_add_odd(*floors, both);
}

/// The cells of a row's last word: `count` of them, 1 to 3.
static inline void add_frequent_of(const bslam_view_t *view, int32_t i, int32_t count, uint32_t *walls,
                                   uint32_t *floors)
{
    const uint32_t both = bslam_word_at(view->frequent + i) & (count == 1 ? 0xFFFFU : ALL_BYTES);
    *walls = bslam_bytes_add_even(*walls, both);
    *floors = bslam_bytes_add_odd(*floors, both);
    if (count > 2) {
        *walls += view->frequent[i + 2] & 255U;
        *floors += view->frequent[i + 2] >> 8;
    }
}

/// Sums of a strip's cells: of bytes; those that stand for signed numbers are 128 more.
typedef struct strip_sums {
    uint32_t light, reddish, bluish, spread, value;
    uint32_t walls, floors;  ///< in halves, which a strip does not fill
} strip_sums_t;

static inline void add_strip(const bslam_view_t *view, int32_t i, uint32_t mask, strip_sums_t *sums)
{
    const bslam_tones_t *tones = view->tones;
    sums->light = bslam_bytes_sum(bslam_word_at(tones->light + i) & mask, sums->light);
    sums->reddish = bslam_bytes_sum((bslam_word_at(tones->reddish + i) ^ SIGNED_ZERO) & mask, sums->reddish);
    sums->bluish = bslam_bytes_sum((bslam_word_at(tones->bluish + i) ^ SIGNED_ZERO) & mask, sums->bluish);
    sums->spread = bslam_bytes_sum(bslam_word_at(tones->spread + i) & mask, sums->spread);
    sums->value = bslam_bytes_sum((bslam_word_at(view->values + i) ^ SIGNED_ZERO) & mask, sums->value);
}

bslam_sums_t bslam_sum_beside(const bslam_view_t *view, const bslam_proposal_t *box, bslam_side_t side)
{
    strip_sums_t sums = {0};
    const rows_t rows = rows_of(view, strip_of(box, side));
    const int32_t width = rows.right - rows.left, last = width & ~(BSLAM_WORD_BYTES - 1);
    const uint32_t mask = mask_of(width - last);
    int32_t cells = 0;
    for (int32_t row = rows.first; row < rows.end; row += rows.stride) {
        int32_t i = row * view->frame->columns + rows.left;
        for (const int32_t end = i + last; i < end; i += BSLAM_WORD_BYTES) {
            add_strip(view, i, ALL_BYTES, &sums);
            add_frequent(view, i, &sums.walls, &sums.floors);
            add_frequent(view, i + 2, &sums.walls, &sums.floors);
        }
        if (mask != 0) {
            add_strip(view, i, mask, &sums);
            add_frequent_of(view, i, width - last, &sums.walls, &sums.floors);
        }
        cells += width;
    }
    return (bslam_sums_t){
        .cells = cells,
        .light = (int32_t)sums.light,
        .reddish = (int32_t)sums.reddish - 128 * cells,
        .bluish = (int32_t)sums.bluish - 128 * cells,
        .spread = (int32_t)sums.spread,
        .value = (int32_t)sums.value - 128 * cells,
        .wall = (int32_t)halves_sum(sums.walls),
        .floor = (int32_t)halves_sum(sums.floors),
    };
}

/// Adds the texture and the values of an area's cells.
static void add_texture_of(const bslam_view_t *view, const rows_t *rows, texture_sums_t *sums)
{
    texture_sums_t all = *sums;
    uint32_t walls = 0, floors = 0;  // in halves, which a third of a frame does not fill
    const int32_t width = rows->right - rows->left, last = width & ~(BSLAM_WORD_BYTES - 1);
    const uint32_t mask = mask_of(width - last);
    for (int32_t row = rows->first; row < rows->end; row += rows->stride) {
        int32_t i = row * view->frame->columns + rows->left;
        const int32_t end = i + width;
        for (; i + BSLAM_WORD_BYTES <= end; i += BSLAM_WORD_BYTES) {
            add_texture(view, i, ALL_BYTES, &all);
            add_frequent(view, i, &walls, &floors);
            add_frequent(view, i + 2, &walls, &floors);
        }
        if (mask != 0) {
            add_texture(view, i, mask, &all);
            add_frequent_of(view, i, end - i, &walls, &floors);
        }
    }
    all.wall += halves_sum(walls);
    all.floor += halves_sum(floors);
    *sums = all;
}

static void take_texture(const texture_sums_t *all, bslam_sums_t *sums)
{
    sums->spread = (int32_t)all->spread;
    sums->step_x = (int32_t)all->step_x;
    sums->step_y = (int32_t)all->step_y;
    sums->value = (int32_t)all->value - 128 * sums->cells;
    sums->likely = (int32_t)all->likely;
    sums->wall = (int32_t)all->wall;
    sums->floor = (int32_t)all->floor;
}

/// A row of zones: the texture, which nothing asks of single zones, across them where they have the same
/// stride.
static void sum_zones(const bslam_view_t *view, const grid_t *grid, int32_t r, int32_t stride,
                      bslam_sums_t zones[ZONES], texture_sums_t *texture)
{
    rows_t rows = {0};
    for (int32_t c = 0; c < ZONES; c++) {
        rows = rows_of(view, zone_area(grid, r, c));
        sum_tones(view, &rows, &zones[c]);
        if (stride == 0) {
            add_texture_of(view, &rows, texture);
        }
    }
    if (stride != 0) {
        rows.left = grid->left[0];
        add_texture_of(view, &rows, texture);
    }
}

void bslam_sum_box(const bslam_view_t *view, const bslam_proposal_t *box,
                   bslam_zone_sums_t zones[ZONES * ZONES], bslam_sums_t *inside)
{
    const grid_t grid = grid_of(box);
    int32_t strides[ZONES];
    fill_strides(&grid, box, strides);
    bslam_sums_t sums = {0};
    texture_sums_t texture = {0};
    for (int32_t r = 0; r < ZONES; r++) {
        bslam_sums_t row[ZONES];
        sum_zones(view, &grid, r, strides[r], row, &texture);
        for (int32_t c = 0; c < ZONES; c++) {
            zones[ZONES * r + c] = zone_of(&row[c]);
            merge_tones(&sums, &row[c]);
        }
    }
    take_texture(&texture, &sums);
    *inside = sums;
}

#else

// --- By columns

bslam_sums_t bslam_sum_beside(const bslam_view_t *view, const bslam_proposal_t *box, bslam_side_t side)
{
    bslam_sums_t sums = {0};
    const bslam_tones_t *tones = view->tones;
    const rows_t rows = rows_of(view, strip_of(box, side));
    for (int32_t row = rows.first; row < rows.end; row += rows.stride) {
        const int32_t start = row * view->frame->columns, end = start + rows.right;
        sums.cells += rows.right - rows.left;
        for (int32_t i = start + rows.left; i < end; i++) {
            const int32_t frequent = view->frequent[i];
            sums.light += tones->light[i];
            sums.reddish += tones->reddish[i];
            sums.bluish += tones->bluish[i];
            sums.spread += tones->spread[i];
            sums.value += view->values[i];
            sums.wall += frequent & 255;
            sums.floor += frequent >> 8;
        }
    }
    return sums;
}

static void merge(bslam_sums_t *into, const bslam_sums_t *from)
{
    int32_t *a = &into->cells;
    const int32_t *b = &from->cells;
    for (int32_t i = 0; i < (int32_t)(sizeof *into / sizeof *a); i++) {
        a[i] += b[i];
    }
}

static bslam_sums_t sum_inside(const bslam_view_t *view, area_t area)
{
    bslam_sums_t sums = {0};
    const bslam_tones_t *tones = view->tones;
    const rows_t rows = rows_of(view, area);
    for (int32_t row = rows.first; row < rows.end; row += rows.stride) {
        const int32_t start = row * view->frame->columns, end = start + rows.right;
        sums.cells += rows.right - rows.left;
        for (int32_t i = start + rows.left; i < end; i++) {
            const int32_t light = tones->light[i];
            const int32_t reddish = (int32_t)tones->reddish[i], bluish = (int32_t)tones->bluish[i];
            const int32_t value = (int32_t)view->values[i], frequent = view->frequent[i];
            sums.light += light;
            sums.reddish += reddish;
            sums.bluish += bluish;
            sums.spread += tones->spread[i];
            sums.value += value;
            sums.wall += frequent & 255;
            sums.floor += frequent >> 8;
            sums.light_sq += light * light;
            sums.reddish_sq += reddish * reddish;
            sums.bluish_sq += bluish * bluish;
            sums.step_x += view->step_x[i];
            sums.step_y += view->step_y[i];
            sums.likely += value > 0 ? 1 : 0;
        }
    }
    return sums;
}

/// Columns of cells summed at a time; a constant, so that a compiler can use vector instructions.
#define LANES 16

/// Sums down LANES columns: of a row of zones, and of the whole box.
typedef struct lanes {
    int16_t light[LANES], reddish[LANES], bluish[LANES];
    uint16_t spread[LANES], step_x[LANES], step_y[LANES], wall[LANES], floor[LANES];
    int16_t value[LANES];
    uint8_t likely[LANES];
    uint32_t light_sq[LANES], reddish_sq[LANES], bluish_sq[LANES];
} lanes_t;

static void add_bytes(uint16_t *restrict sums, const uint8_t *restrict bytes)
{
    for (int32_t k = 0; k < LANES; k++) {
        sums[k] = (uint16_t)(sums[k] + bytes[k]);
    }
}

static void add_signed(int16_t *restrict sums, const int8_t *restrict bytes)
{
    for (int32_t k = 0; k < LANES; k++) {
        sums[k] = (int16_t)(sums[k] + bytes[k]);
    }
}

static void add_squares(uint32_t *restrict sums, const int8_t *restrict bytes)
{
    for (int32_t k = 0; k < LANES; k++) {
        sums[k] += (uint16_t)(bytes[k] * bytes[k]);
    }
}

/// Adds the cells from `i` on; what is beyond the box is not read out.
static void add_row(lanes_t *restrict lanes, const bslam_view_t *view, int32_t i)
{
    const uint8_t *restrict light = view->tones->light + i;
    const uint16_t *restrict frequent = view->frequent + i;
    const int8_t *restrict values = view->values + i;
    for (int32_t k = 0; k < LANES; k++) {
        lanes->light[k] = (int16_t)(lanes->light[k] + light[k]);
        lanes->light_sq[k] += (uint16_t)(light[k] * light[k]);
    }
    for (int32_t k = 0; k < LANES; k++) {
        lanes->wall[k] = (uint16_t)(lanes->wall[k] + (frequent[k] & 255));
        lanes->floor[k] = (uint16_t)(lanes->floor[k] + (frequent[k] >> 8));
    }
    for (int32_t k = 0; k < LANES; k++) {
        lanes->likely[k] = (uint8_t)(lanes->likely[k] + (values[k] > 0 ? 1 : 0));
    }
    add_signed(lanes->reddish, view->tones->reddish + i);
    add_signed(lanes->bluish, view->tones->bluish + i);
    add_signed(lanes->value, values);
    add_squares(lanes->reddish_sq, view->tones->reddish + i);
    add_squares(lanes->bluish_sq, view->tones->bluish + i);
    add_bytes(lanes->spread, view->tones->spread + i);
    add_bytes(lanes->step_x, view->step_x + i);
    add_bytes(lanes->step_y, view->step_y + i);
}

/// Adds what was summed of a row of zones down the columns from `first` on, and forgets it.
static void take_zones(const grid_t *grid, int32_t first, lanes_t *lanes, bslam_zone_sums_t zones[ZONES])
{
    int32_t column = 0;
    for (int32_t k = 0; k < LANES && first + k < grid->left[ZONES]; k++) {
        while (first + k >= grid->left[column + 1]) {
            column++;
        }
        zones[column].light += lanes->light[k];
        zones[column].reddish += lanes->reddish[k];
        zones[column].bluish += lanes->bluish[k];
    }
    memset(lanes->light, 0, sizeof lanes->light);
    memset(lanes->reddish, 0, sizeof lanes->reddish);
    memset(lanes->bluish, 0, sizeof lanes->bluish);
}

static void take_texture(const lanes_t *lanes, int32_t count, bslam_sums_t *inside)
{
    for (int32_t k = 0; k < count; k++) {
        inside->spread += lanes->spread[k];
        inside->value += lanes->value[k];
        inside->wall += lanes->wall[k];
        inside->floor += lanes->floor[k];
        inside->light_sq += (int32_t)lanes->light_sq[k];
        inside->reddish_sq += (int32_t)lanes->reddish_sq[k];
        inside->bluish_sq += (int32_t)lanes->bluish_sq[k];
        inside->step_x += lanes->step_x[k];
        inside->step_y += lanes->step_y[k];
        inside->likely += lanes->likely[k];
    }
}

/// Sums of the zones, and of the whole box, which is within the frame.
void bslam_sum_box(const bslam_view_t *view, const bslam_proposal_t *box,
                   bslam_zone_sums_t zones[ZONES * ZONES], bslam_sums_t *inside)
{
    const int32_t columns = view->frame->columns;
    const grid_t grid = grid_of(box);
    int32_t strides[ZONES];
    fill_strides(&grid, box, strides);
    memset(inside, 0, sizeof *inside);
    memset(zones, 0, ZONES * ZONES * sizeof zones[0]);
    for (int32_t first = box->left; first < box->right; first += LANES) {
        lanes_t lanes = {0};
        for (int32_t r = 0; r < ZONES; r++) {
            for (int32_t row = grid.top[r]; strides[r] > 0 && row < grid.top[r + 1]; row += strides[r]) {
                add_row(&lanes, view, row * columns + first);
            }
            take_zones(&grid, first, &lanes, zones + ZONES * r);
        }
        take_texture(&lanes, least(LANES, box->right - first), inside);
    }
    for (int32_t z = 0; z < ZONES * ZONES; z++) {
        const int32_t stride = strides[z / ZONES];
        const area_t area = zone_area(&grid, z / ZONES, z % ZONES);
        if (stride == 0) {
            const bslam_sums_t sums = sum_inside(view, area);
            zones[z] = zone_of(&sums);
            merge(inside, &sums);
            continue;
        }
        zones[z].cells = (area.bottom - area.top + stride - 1) / stride * (area.right - area.left);
        inside->cells += zones[z].cells;
        inside->light += zones[z].light;
        inside->reddish += zones[z].reddish;
        inside->bluish += zones[z].bluish;
    }
}

#endif
