// Windows slide over all sizes of a picture. MATH-CAMERA "Scanner".
#include "vision/scan/scanner.h"

#include <string.h>

#include "base/bounds.h"
#include "base/scalar.h"
#include "vision/pixels/bytes.h"

_Static_assert(sizeof(bslam_scanner_instance_t) <= sizeof(bslam_scanner_t), "size.h: the scanner");
_Static_assert(_Alignof(bslam_scanner_instance_t) <= _Alignof(bslam_scanner_t), "vision.h: the scanner");

enum { SIDE_MIN = 32, WIDTH_STEP = 8, EDGES = 4, BLOCK = 2 };
/// With all products of a window still a number of 32 bits.
enum { BIAS_MAX = 1 << 30 };
/// Of a scale, a slope, an offset: so that scores and odds are numbers.
static const float NUMBER_MAX = 1e6f;
/// Boxes that overlap as much, of both together, are one thing's.
static const float OVERLAP_MAX = 0.4f;
/// Of two boxes of a kind that have so much of the smaller one in common, one is of a part.
static const float PART_MAX = 0.65f;
/// A window's score differs from that of the next by hardly more.
static const float FAR_BELOW = 2;
/// Windows whose score is farther below the best one's say nothing of where its edges are.
static const float MERGED_BELOW = 1;
/// An edge is no farther from its window's box than this, of width or height.
static const float EDGE_MAX = 0.4f;
/// A box that ends so near to the picture's edge may go on outside.
static const float CUT_PX = 1.0f;
/// Luma of cells, 0 to 242, and shares of them, percent: as of the front end.
enum { BLACK_BELOW = 15, SATURATED_FROM = 232, BLACK_PERCENT = 95, SATURATED_PERCENT = 60, FLAT_RANGE = 11 };

// ---- the model --------------------------------------------------------------------------------------------

static bool is_side(int32_t cells)
{
    return cells >= BLOCK && cells <= BSLAM_WINDOW_SIDE_MAX && cells % BLOCK == 0;
}

static bool is_share(float box, int32_t cells)
{
    return box > 0 && box <= (float)cells;
}

static bool is_small(float number)
{
    return number >= -NUMBER_MAX && number <= NUMBER_MAX;
}

static bool is_bias(int32_t bias)
{
    return bias >= -BIAS_MAX && bias <= BIAS_MAX;
}

static bool has_small_numbers(const bslam_window_t *window)
{
    return is_small(window->scale) && is_bias(window->bias) && is_bias(window->coarse_bias);
}

static bool has_tables(const bslam_window_t *window)
{
    return window->weights != NULL && window->coarse != NULL && window->order != NULL &&
           window->floors != NULL && window->edges != NULL && window->edge_scale != NULL &&
           window->edge_bias != NULL;
}

/// Each row is added once.
static bool is_order(const uint8_t *order, int32_t rows)
{
    uint32_t seen = 0;
    for (int32_t i = 0; i < rows; i++) {
        seen |= order[i] < rows ? 1U << order[i] : 0U;
    }
    return seen == (1U << rows) - 1U;
}

static bslam_status_t check_window(const bslam_scanner_model_t *model, const bslam_window_t *window)
{
    if (window->kind >= model->kind_count || !is_side(window->columns) || !is_side(window->rows)) {
        return BSLAM_E_COUNT;
    }
    if (!has_tables(window)) {
        return BSLAM_E_PARAMETER;
    }
    if (!is_order(window->order, window->rows / BLOCK)) {
        return BSLAM_E_COUNT;
    }
    for (int32_t i = 0; i < EDGES; i++) {
        if (!bslam_is_number(window->edge_scale[i]) || !bslam_is_number(window->edge_bias[i])) {
            return BSLAM_E_NOT_FINITE;
        }
    }
    if (!bslam_is_number(window->scale)) {
        return BSLAM_E_NOT_FINITE;
    }
    const bool is_good = window->scale > 0 && has_small_numbers(window) &&
                         is_share(window->box_columns, window->columns) &&
                         is_share(window->box_rows, window->rows);
    return is_good ? BSLAM_OK : BSLAM_E_PARAMETER;
}

static bslam_status_t check_kind(const bslam_scan_kind_t *kind)
{
    const float values[] = {kind->height_m, kind->width_m,   kind->threshold, kind->slope,
                            kind->offset,   kind->middle_sd, kind->height_sd};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        if (!bslam_is_number(values[i])) {
            return BSLAM_E_NOT_FINITE;
        }
    }
    const bool is_good = kind->name != NULL && kind->height_m >= 0 && kind->height_m <= 10 &&
                         kind->width_m >= 0 && kind->width_m <= 10 && kind->middle_sd > 0 &&
                         kind->height_sd > 0 && is_small(kind->slope) && is_small(kind->offset);
    return is_good ? BSLAM_OK : BSLAM_E_PARAMETER;
}

bslam_status_t bslam_scanner_model_check(const bslam_scanner_model_t *model)
{
    if (model->kind_count < 1 || model->kind_count > BSLAM_KINDS_MAX || model->window_count < 1 ||
        model->window_count > BSLAM_WINDOWS_MAX) {
        return BSLAM_E_COUNT;
    }
    if (model->kinds == NULL || model->windows == NULL) {
        return BSLAM_E_PARAMETER;
    }
    bslam_status_t status = BSLAM_OK;
    for (int32_t i = 0; i < model->kind_count && status == BSLAM_OK; i++) {
        status = check_kind(&model->kinds[i]);
    }
    for (int32_t i = 0; i < model->window_count && status == BSLAM_OK; i++) {
        status = check_window(model, &model->windows[i]);
    }
    return status;
}

bslam_status_t bslam_scanner_init_sized(bslam_scanner_t *scanner, size_t scanner_bytes, uint32_t sizes_hash,
                                        const bslam_scanner_model_t *model)
{
    if (scanner_bytes != sizeof *scanner || sizes_hash != BSLAM_VISION_HASH) {
        return BSLAM_E_SIZE;
    }
    const bslam_status_t status = bslam_scanner_model_check(model);
    if (status == BSLAM_OK) {
        memset(scanner, 0, sizeof *scanner);
        bslam_scanner_instance(scanner)->model = model;
    }
    return status;
}

// ---- rows come in -----------------------------------------------------------------------------------------

static bool is_size(int32_t size_px, int32_t size_max_px, int32_t step_px)
{
    return size_px >= SIDE_MIN && size_px <= size_max_px && size_px % step_px == 0;
}

bslam_status_t bslam_scanner_begin(bslam_scanner_t *scanner, bslam_pixel_format_t format, int32_t width_px,
                                   int32_t height_px)
{
    if ((format != BSLAM_PIXELS_RGB565 && format != BSLAM_PIXELS_RGB888) ||
        !is_size(width_px, BSLAM_IMAGE_WIDTH_MAX, WIDTH_STEP) ||
        !is_size(height_px, BSLAM_IMAGE_HEIGHT_MAX, BSLAM_CELL_PX)) {
        return BSLAM_E_RANGE;
    }
    bslam_scanner_instance_t *instance = bslam_scanner_instance(scanner);
    instance->format = format;
    instance->width_px = width_px;
    instance->height_px = height_px;
    instance->rows_seen = 0;
    bslam_channels_begin(&instance->channels, width_px, height_px);
    return BSLAM_OK;
}

bslam_status_t bslam_scanner_row(bslam_scanner_t *scanner, const void *pixels)
{
    bslam_scanner_instance_t *instance = bslam_scanner_instance(scanner);
    if (instance->rows_seen >= instance->height_px) {
        return BSLAM_E_COUNT;
    }
    uint16_t *packed = instance->channels.packed;
    if (instance->format == BSLAM_PIXELS_RGB565) {
        memcpy(packed, pixels, (size_t)instance->width_px * sizeof *packed);
    } else {
        const uint8_t *rgb = pixels;
        for (int32_t x = 0; x < instance->width_px; x++, rgb += 3) {
            packed[x] = (uint16_t)(rgb[0] >> 3 << 11 | rgb[1] >> 2 << 5 | rgb[2] >> 3);
        }
    }
    bslam_channels_row(&instance->channels, packed);
    instance->rows_seen++;
    return BSLAM_OK;
}

/// Whether the light lets anything be seen.
static bslam_vision_reason_t judge_light(const bslam_octave_t *octave)
{
    const int32_t count = octave->rows * octave->columns;
    int32_t black = 0, saturated = 0, low = 255, high = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t luma = octave->cells[i * BSLAM_CHANNELS];
        black += luma < BLACK_BELOW ? 1 : 0;
        saturated += luma >= SATURATED_FROM ? 1 : 0;
        low = luma < low ? luma : low;
        high = luma > high ? luma : high;
    }
    if (100 * black > BLACK_PERCENT * count) {
        return BSLAM_VISION_BLACK;
    }
    if (100 * saturated > SATURATED_PERCENT * count) {
        return BSLAM_VISION_OVEREXPOSED;
    }
    return high - low > FLAT_RANGE ? BSLAM_VISION_NOTHING : BSLAM_VISION_FLAT;
}

// ---- windows ----------------------------------------------------------------------------------------------

/// Rows of cells that a window covers, for what looks at them.
typedef struct view {
    const bslam_window_t *window;
    const uint8_t *rows[BSLAM_WINDOW_SIDE_MAX];
} view_t;

/// The sum of products of bytes, in words.
static inline int32_t add_products(const int8_t *weights, const uint8_t *cells, int32_t count, int32_t sum)
{
#ifdef __ARM_FEATURE_SIMD32
    for (int32_t i = 0; i < count; i += BSLAM_WORD_BYTES) {
        const uint32_t w = bslam_word_at(weights + i), c = bslam_word_at(cells + i);
        sum = bslam_halves_dot(bslam_bytes_signed_even(w), bslam_bytes_even(c), sum);
        sum = bslam_halves_dot(bslam_bytes_signed_odd(w), bslam_bytes_odd(c), sum);
    }
#else
    for (int32_t i = 0; i < count; i++) {
        sum += weights[i] * cells[i];
    }
#endif
    return sum;
}

/// Whether the coarse window with its upper left cell in a column passes all floors.
static bool is_likely(const view_t *view, int32_t column)
{
    const bslam_window_t *window = view->window;
    const int32_t bytes = window->columns / BLOCK * BSLAM_CHANNELS, at = column * BSLAM_CHANNELS;
    int32_t sum = window->coarse_bias;
    for (int32_t i = 0; i < window->rows / BLOCK; i++) {
        const int32_t row = window->order[i];
        sum = add_products(window->coarse + row * bytes, view->rows[row] + at, bytes, sum);
        if (sum < window->floors[i]) {
            return false;
        }
    }
    return true;
}

/// The window's sum with its upper left cell in a column.
static int32_t value_at(const view_t *view, int32_t column)
{
    const bslam_window_t *window = view->window;
    const int32_t bytes = window->columns * BSLAM_CHANNELS, at = column * BSLAM_CHANNELS;
    int32_t sum = window->bias;
    for (int32_t i = 0; i < window->rows; i++) {
        sum = add_products(window->weights + i * bytes, view->rows[i] + at, bytes, sum);
    }
    return sum;
}

/// By how much the box's edges differ from the window's, of its width and height.
static void edges_at(const view_t *view, int32_t column, float edges[EDGES])
{
    const bslam_window_t *window = view->window;
    const int32_t across = window->columns / BLOCK, down = window->rows / BLOCK;
    const int8_t *weights = window->edges;
    for (int32_t e = 0; e < EDGES; e++) {
        int32_t sum = 0;
        for (int32_t r = 0; r < down; r++) {
            const uint8_t *above = view->rows[BLOCK * r] + column * BSLAM_CHANNELS;
            const uint8_t *below = view->rows[BLOCK * r + 1] + column * BSLAM_CHANNELS;
            for (int32_t c = 0; c < across; c++) {
                for (int32_t k = 0; k < BSLAM_CHANNELS; k++) {
                    sum += *weights++ *
                           (above[k] + above[k + BSLAM_CHANNELS] + below[k] + below[k + BSLAM_CHANNELS]);
                }
                above += BLOCK * BSLAM_CHANNELS;
                below += BLOCK * BSLAM_CHANNELS;
            }
        }
        const float edge = window->edge_scale[e] * (float)sum + window->edge_bias[e];
        edges[e] = bslam_clampf(edge, -EDGE_MAX, EDGE_MAX);
    }
}

static float overlap(float low_a, float high_a, float low_b, float high_b)
{
    const float low = low_a > low_b ? low_a : low_b, high = high_a < high_b ? high_a : high_b;
    return high > low ? high - low : 0;
}

static float log_odds(const bslam_scanner_instance_t *instance, const bslam_hit_t *hit)
{
    const bslam_scan_kind_t *kind = &instance->model->kinds[hit->kind];
    return kind->slope * hit->score + kind->offset;
}

/// Where the weakest of all hits stands.
static bslam_hit_t *weakest(bslam_scanner_instance_t *instance)
{
    bslam_hit_t *least = &instance->hits[0];
    for (int32_t i = 1; i < BSLAM_HITS_MAX; i++) {
        bslam_hit_t *hit = &instance->hits[i];
        least = log_odds(instance, hit) < log_odds(instance, least) ? hit : least;
    }
    return least;
}

static void note_hit(bslam_scanner_instance_t *instance, const bslam_hit_t *hit)
{
    if (instance->hit_count < BSLAM_HITS_MAX) {
        instance->hits[instance->hit_count] = *hit;
        instance->hit_count++;
        return;
    }
    bslam_hit_t *least = weakest(instance);
    if (log_odds(instance, hit) > log_odds(instance, least)) {
        *least = *hit;
    }
}

static void note_window(bslam_scanner_instance_t *instance, const bslam_level_t *level, const view_t *view,
                        int32_t column, int32_t top, float score)
{
    const bslam_window_t *window = view->window;
    float edges[EDGES];
    edges_at(view, column, edges);
    const float middle_x = (float)(2 * (column - BSLAM_LEVEL_PAD) + window->columns) / 2 * level->cell_px;
    const float middle_y = (float)(2 * (top - BSLAM_LEVEL_PAD) + window->rows) / 2 * level->cell_px;
    const float width = window->box_columns * level->cell_px, height = window->box_rows * level->cell_px;
    const bslam_hit_t hit = {
        .left_px = middle_x + (edges[0] - 0.5f) * width,
        .top_px = middle_y + (edges[1] - 0.5f) * height,
        .right_px = middle_x + (edges[2] + 0.5f) * width,
        .bottom_px = middle_y + (edges[3] + 0.5f) * height,
        .score = score,
        .kind = window->kind,
    };
    const float shown_x = overlap(hit.left_px, hit.right_px, 0, (float)instance->width_px);
    const float shown_y = overlap(hit.top_px, hit.bottom_px, 0, (float)instance->height_px);
    if (shown_x > 0 && shown_y > 0) {
        note_hit(instance, &hit);
    }
}

/// The window's score; what is above its kind's threshold is noted.
static float take_window(bslam_scanner_instance_t *instance, const bslam_level_t *level, const view_t *view,
                         int32_t column, int32_t top)
{
    const bslam_window_t *window = view->window;
    const float score = window->scale * (float)value_at(view, column);
    if (score >= instance->model->kinds[window->kind].threshold) {
        note_window(instance, level, view, column, top, score);
    }
    return score;
}

/// The four windows of a place of the coarse one, or where the first is far below its kind's threshold, that
/// one.
static void take_place(bslam_scanner_instance_t *instance, const bslam_level_t *level,
                       const view_t fine[BLOCK], int32_t column, int32_t top, bool both)
{
    const bslam_window_t *window = fine[0].window;
    const bool has_next = column + window->columns < level->columns;
    const float least = instance->model->kinds[window->kind].threshold - FAR_BELOW;
    if (take_window(instance, level, &fine[0], column, top) < least) {
        return;
    }
    for (int32_t i = 1; i < BLOCK * BLOCK; i++) {
        const int32_t down = i / BLOCK, across = i % BLOCK;
        if ((down == 0 || both) && (across == 0 || has_next)) {
            (void)take_window(instance, level, &fine[down], column + across, top + down);
        }
    }
}

/// Windows of an upper row, and of the one below it if `both`: those where the coarse one is likely.
static void scan_rows(bslam_scanner_instance_t *instance, const bslam_level_t *level,
                      const bslam_window_t *window, int32_t top, bool both)
{
    view_t coarse = {.window = window}, fine[BLOCK] = {{.window = window}, {.window = window}};
    for (int32_t i = 0; i < window->rows; i++) {
        fine[0].rows[i] = instance->rows[(top + i) % BSLAM_FINE_ROWS];
        fine[1].rows[i] = instance->rows[(top + i + 1) % BSLAM_FINE_ROWS];
        coarse.rows[i / BLOCK] = instance->coarse[(top + i) / BLOCK % BSLAM_COARSE_ROWS];
    }
    const int32_t last = level->columns - window->columns;
    for (int32_t column = 0; column <= last; column += BLOCK) {
        if (is_likely(&coarse, column / BLOCK)) {
            take_place(instance, level, fine, column, top, both);
        }
    }
}

/// Means of 2x2 cells of two rows.
static void halve_rows(const uint8_t *above, const uint8_t *below, uint8_t *half, int32_t columns)
{
    for (int32_t c = 0; c + 1 < columns; c += BLOCK) {
        for (int32_t k = 0; k < BSLAM_CHANNELS; k += BSLAM_WORD_BYTES) {
            const uint32_t upper =
                bslam_bytes_mean(bslam_word_at(above + k), bslam_word_at(above + k + BSLAM_CHANNELS));
            const uint32_t lower =
                bslam_bytes_mean(bslam_word_at(below + k), bslam_word_at(below + k + BSLAM_CHANNELS));
            bslam_word_put(half + k, bslam_bytes_mean(upper, lower));
        }
        above += BLOCK * BSLAM_CHANNELS;
        below += BLOCK * BSLAM_CHANNELS;
        half += BSLAM_CHANNELS;
    }
}

/// Windows whose last row but one has come, and so both places of theirs; where none comes any more, the
/// upper.
static void scan_windows(bslam_scanner_instance_t *instance, const bslam_level_t *level, int32_t row)
{
    for (int32_t i = 0; i < instance->model->window_count; i++) {
        const bslam_window_t *window = &instance->model->windows[i];
        if (row >= window->rows) {
            scan_rows(instance, level, window, row - window->rows, row < level->rows);
        }
    }
}

static void scan_level(bslam_scanner_instance_t *instance, const bslam_level_t *level)
{
    for (int32_t row = 0; row < level->rows; row++) {
        uint8_t *newest = instance->rows[row % BSLAM_FINE_ROWS];
        bslam_level_row(level, row, newest);
        if (row % BLOCK == 0) {
            scan_windows(instance, level, row);
        } else {
            halve_rows(instance->rows[(row - 1) % BSLAM_FINE_ROWS], newest,
                       instance->coarse[row / BLOCK % BSLAM_COARSE_ROWS], level->columns);
        }
    }
    if (level->rows % BLOCK == 0) {
        scan_windows(instance, level, level->rows);
    }
}

// ---- boxes ------------------------------------------------------------------------------------------------

static float area(const bslam_hit_t *hit)
{
    return (hit->right_px - hit->left_px) * (hit->bottom_px - hit->top_px);
}

static float shared(const bslam_hit_t *a, const bslam_hit_t *b)
{
    return overlap(a->left_px, a->right_px, b->left_px, b->right_px) *
           overlap(a->top_px, a->bottom_px, b->top_px, b->bottom_px);
}

static bool is_same_place(const bslam_hit_t *a, const bslam_hit_t *b)
{
    const float both = shared(a, b);
    return both >= OVERLAP_MAX * (area(a) + area(b) - both);
}

/// Whether one is a part of the other.
static bool is_part(const bslam_hit_t *a, const bslam_hit_t *b)
{
    const float first = area(a), second = area(b);
    return a->kind == b->kind && shared(a, b) >= PART_MAX * (first < second ? first : second);
}

/// By odds, which kinds can be compared by.
static bslam_hit_t *best_left(bslam_scanner_instance_t *instance)
{
    bslam_hit_t *best = NULL;
    float most = 0;
    for (int32_t i = 0; i < instance->hit_count; i++) {
        bslam_hit_t *hit = &instance->hits[i];
        const float odds = hit->kind >= 0 ? log_odds(instance, hit) : 0;
        if (hit->kind >= 0 && (best == NULL || odds > most)) {
            best = hit;
            most = odds;
        }
    }
    return best;
}

static bslam_detection_t detection_of(const bslam_scanner_instance_t *instance, const bslam_hit_t *hit)
{
    const float right = (float)instance->width_px - CUT_PX, bottom = (float)instance->height_px - CUT_PX;
    const int32_t marks = (hit->left_px < CUT_PX ? BSLAM_MARK_CUT_LEFT : 0) |
                          (hit->right_px > right ? BSLAM_MARK_CUT_RIGHT : 0) |
                          (hit->top_px < CUT_PX ? BSLAM_MARK_CUT_TOP : 0) |
                          (hit->bottom_px > bottom ? BSLAM_MARK_CUT_BOTTOM : 0);
    const float most_x = (float)instance->width_px, most_y = (float)instance->height_px;
    return (bslam_detection_t){
        .box = {bslam_clampf(hit->left_px, 0, most_x) - 0.5f, bslam_clampf(hit->top_px, 0, most_y) - 0.5f,
                bslam_clampf(hit->right_px, 0, most_x) - 0.5f,
                bslam_clampf(hit->bottom_px, 0, most_y) - 0.5f},
        .kind = hit->kind,
        .score = hit->score,
        .log_odds = log_odds(instance, hit),
        .marks = (uint16_t)marks,
    };
}

/// The mean box of what shows the same thing as the best, by how much each is above what is far below it. All
/// of them are dropped, and what is there of any kind: one thing is of one.
static bslam_hit_t merged(bslam_scanner_instance_t *instance, const bslam_hit_t *best)
{
    const bslam_hit_t first = *best;
    bslam_hit_t mean = {.score = first.score, .kind = first.kind};
    float sum = 0;
    for (int32_t i = 0; i < instance->hit_count; i++) {
        bslam_hit_t *hit = &instance->hits[i];
        if (hit->kind == first.kind && is_same_place(hit, &first)) {
            const float above = hit->score - first.score + MERGED_BELOW, weight = above > 0 ? above : 0;
            sum += weight;
            mean.left_px += weight * hit->left_px;
            mean.top_px += weight * hit->top_px;
            mean.right_px += weight * hit->right_px;
            mean.bottom_px += weight * hit->bottom_px;
            hit->kind = -1;
        }
    }
    mean.left_px /= sum;
    mean.top_px /= sum;
    mean.right_px /= sum;
    mean.bottom_px /= sum;
    for (int32_t i = 0; i < instance->hit_count; i++) {
        bslam_hit_t *hit = &instance->hits[i];
        hit->kind = is_same_place(hit, &mean) || is_part(hit, &mean) ? -1 : hit->kind;
    }
    return mean;
}

static void report_best(bslam_scanner_instance_t *instance)
{
    bslam_detections_t *found = &instance->found;
    for (bslam_hit_t *best = best_left(instance); best != NULL; best = best_left(instance)) {
        const bslam_hit_t thing = merged(instance, best);
        if (found->count < BSLAM_CANDIDATES_MAX) {
            found->items[found->count] = detection_of(instance, &thing);
            found->count++;
        } else {
            found->dropped++;
        }
    }
}

const bslam_detections_t *bslam_scanner_end(bslam_scanner_t *scanner)
{
    bslam_scanner_instance_t *instance = bslam_scanner_instance(scanner);
    bslam_detections_t *found = &instance->found;
    found->count = 0;
    found->dropped = 0;
    instance->hit_count = 0;
    if (instance->rows_seen < instance->height_px || instance->height_px == 0) {
        found->reason = BSLAM_VISION_UNFINISHED;
        return found;
    }
    instance->rows_seen = 0;
    bslam_channels_end(&instance->channels);
    found->reason = judge_light(&instance->channels.octaves[0]);
    if (found->reason == BSLAM_VISION_NOTHING) {
        const int32_t levels = instance->channels.octave_count * BSLAM_LEVELS_AN_OCTAVE;
        for (int32_t i = 0; i < levels; i++) {
            const bslam_level_t level = bslam_level(&instance->channels, i);
            scan_level(instance, &level);
        }
        report_best(instance);
        found->reason = found->count > 0 ? BSLAM_VISION_SEEN : BSLAM_VISION_NOTHING;
    }
    instance->height_px = 0;
    return found;
}

bool bslam_scanner_cells(const bslam_scanner_t *scanner, int32_t index, bslam_scanner_level_t *size,
                         int32_t row, uint8_t *cells)
{
    const void *memory = scanner;
    const bslam_scanner_instance_t *instance = memory;
    if (index < 0 || index >= instance->channels.octave_count * BSLAM_LEVELS_AN_OCTAVE) {
        return false;
    }
    const bslam_level_t level = bslam_level(&instance->channels, index);
    if (row < 0 || row >= level.rows) {
        return false;
    }
    *size = (bslam_scanner_level_t){level.rows, level.columns, level.cell_px};
    if (cells != NULL) {
        bslam_level_row(&level, row, cells);
    }
    return true;
}
