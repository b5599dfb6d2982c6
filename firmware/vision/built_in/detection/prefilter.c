#include "vision/built_in/detection/prefilter.h"

#include "base/bounds.h"
#include "vision/pixels/bytes.h"
#include "vision/built_in/detection/features.h"
#include "vision/built_in/detection/steps.h"

/// Rows of cells that stand for a box, and lines of the floor that tell how far the wall behind it is.
#define ROWS_LOOKED_AT 4
#define LINES_LOOKED_AT 3
/// What is beside a box is looked at so many cells outside; nearer where the frame ends.
#define BESIDE 2
/// A side is looked at in so many cells at least, if it has them.
#define SIDE_CELLS 8
/// Behind the numbers stand their squares: a thing is about so high, and a linear machine knows no band.
#define SQUARES (BSLAM_GLANCE_FEATURES / 2)
#define SIGNED_ZERO 0x80808080U

static float apart(float a, float b)
{
    return a < b ? b - a : a - b;
}

/// Sums of cells' light, and of their values, each 128 more.
typedef struct glanced {
    uint32_t light, value;
    int32_t cells;
} glanced_t;

static void add_cell(const bslam_view_t *view, int32_t i, glanced_t *sums)
{
    sums->light += view->tones->light[i];
    sums->value += (uint32_t)(view->values[i] + 128);
    sums->cells++;
}

/// Adds `count` cells side by side.
static void add_row(const bslam_view_t *view, int32_t first, int32_t count, glanced_t *sums)
{
    const uint8_t *light = view->tones->light + first;
    const int8_t *values = view->values + first;
    uint32_t light_sum = sums->light, value_sum = sums->value;
    int32_t left = count;
    for (; left >= BSLAM_WORD_BYTES; left -= BSLAM_WORD_BYTES) {
        light_sum = bslam_bytes_sum(bslam_word_at(light), light_sum);
        value_sum = bslam_bytes_sum(bslam_word_at(values) ^ SIGNED_ZERO, value_sum);
        light += BSLAM_WORD_BYTES;
        values += BSLAM_WORD_BYTES;
    }
    if (left > 0) {
        const uint32_t mask = (1U << 8 * left) - 1;
        light_sum = bslam_bytes_sum(bslam_word_at(light) & mask, light_sum);
        value_sum = bslam_bytes_sum((bslam_word_at(values) ^ SIGNED_ZERO) & mask, value_sum);
    }
    sums->light = light_sum;
    sums->value = value_sum;
    sums->cells += count;
}

/// Means of a box and of what is on its sides.
typedef struct look {
    float light, value;
} look_t;

static look_t mean_of(const glanced_t *sums)
{
    const float cells = (float)sums->cells;
    return (look_t){(float)sums->light / cells, (float)sums->value / cells - 128.0f};
}

/// Light and values of the box and beside it. 9 numbers. What is outside the frame looks as the box.
static float *look_features(const bslam_view_t *view, const bslam_proposal_t *box, float *x)
{
    const int32_t columns = view->frame->columns, rows = view->frame->rows;
    const int32_t width = box->right - box->left, height = box->bottom - box->top;
    const int32_t left = bslam_most(box->left - BESIDE, 0),
                  right = bslam_least(box->right + BESIDE, columns) - 1;
    const int32_t top = bslam_most(box->top - BESIDE, 0),
                  bottom = bslam_least(box->bottom + BESIDE, rows) - 1;
    glanced_t inside = {0}, sides[BSLAM_BOX_SIDES] = {0};
    for (int32_t i = 0; i < ROWS_LOOKED_AT; i++) {
        const int32_t first = (box->top + (2 * i + 1) * height / (2 * ROWS_LOOKED_AT)) * columns;
        add_row(view, first + box->left, width, &inside);
        add_cell(view, first + left, &sides[BSLAM_BOX_LEFT]);
        add_cell(view, first + right, &sides[BSLAM_BOX_RIGHT]);
    }
    add_row(view, top * columns + box->left, width, &sides[BSLAM_BOX_TOP]);
    add_row(view, bottom * columns + box->left, width, &sides[BSLAM_BOX_BOTTOM]);
    const look_t in = mean_of(&inside);
    const look_t a = mean_of(&sides[BSLAM_BOX_LEFT]), b = mean_of(&sides[BSLAM_BOX_RIGHT]);
    const look_t above = mean_of(&sides[BSLAM_BOX_TOP]), below = mean_of(&sides[BSLAM_BOX_BOTTOM]);
    *x++ = in.light - (float)view->background->tone[BSLAM_ZONE_WALL].light;
    *x++ = in.value;
    *x++ = 0.5f * (a.value + b.value);
    *x++ = apart(a.value, b.value);
    *x++ = above.value;
    *x++ = below.value;
    *x++ = 0.5f * (apart(in.light, a.light) + apart(in.light, b.light));
    *x++ = apart(in.light, above.light);
    *x++ = apart(in.light, below.light);
    return x;
}

/// How the colour steps across every few cells of a line of them: mean, a cell counting so much at most, and
/// the share that does.
static bslam_cell_edge_t edge_of(const uint8_t *step, int32_t count, int32_t apart_by)
{
    const int32_t every = count < 2 * SIDE_CELLS ? 1 : count / SIDE_CELLS;
    const int32_t cells = (count + every - 1) / every;
    const bslam_step_sums_t sums = bslam_sum_steps(step, cells, every * apart_by);
    const float per_cell = 1.0f / (float)cells;
    return (bslam_cell_edge_t){(float)sums.sum * per_cell, (float)sums.clear * per_cell};
}

/// The box's sides. 8 numbers; of left and right mean and difference, since a room has neither.
static float *side_features(const bslam_view_t *view, const bslam_proposal_t *box, float *x)
{
    const int32_t columns = view->frame->columns;
    const int32_t width = box->right - box->left, height = box->bottom - box->top;
    const int32_t first = box->top * columns + box->left, last = (box->bottom - 1) * columns + box->left;
    const bslam_cell_edge_t left = edge_of(view->step_x + first, height, columns);
    const bslam_cell_edge_t right = edge_of(view->step_x + first + width - 1, height, columns);
    const bslam_cell_edge_t top = edge_of(view->step_y + first, width, 1);
    const bslam_cell_edge_t bottom = edge_of(view->step_y + last, width, 1);
    *x++ = 0.5f * (left.step + right.step);
    *x++ = 0.5f * (left.share + right.share);
    *x++ = apart(left.step, right.step);
    *x++ = apart(left.share, right.share);
    *x++ = top.step;
    *x++ = top.share;
    *x++ = bottom.step;
    *x++ = bottom.share;
    return x;
}

/// How far the floor line is, in the mean over a few columns of the box; 0 where none of them knows it.
static float line_m(const bslam_view_t *view, const bslam_proposal_t *box)
{
    const int32_t width = box->right - box->left;
    float inverse = 0, known = 0;
    for (int32_t i = 0; i < LINES_LOOKED_AT; i++) {
        const int32_t column = box->left + (2 * i + 1) * width / (2 * LINES_LOOKED_AT);
        const float distance_m = (float)view->floor_line->distance_m[column];
        if (distance_m > 0) {
            inverse += 1.0f / distance_m;
            known += 1.0f;
        }
    }
    return known > 0 ? bslam_clampf(known / inverse, 0.3f, 20.0f) : 0.0f;
}

/// Size and place, by the floor line. 11 numbers.
static float *place_features(const bslam_view_t *view, const bslam_proposal_t *p, float *x)
{
    const bslam_camera_t *camera = view->camera;
    const float horizon_px = (float)bslam_horizon_px(camera), per_px = 1.0f / (float)camera->fy_px;
    const float width_px = (float)(p->box.right_px - p->box.left_px);
    const float height_px = (float)(p->box.bottom_px - p->box.top_px);
    const float top = (horizon_px - (float)p->box.top_px) * per_px;
    const float bottom = (horizon_px - (float)p->box.bottom_px) * per_px;
    const float line = line_m(view, p), wall_m = line > 0 ? line : 1.0f;
    const float log_wall = bslam_log(wall_m), log_width = bslam_log(width_px / (float)camera->fx_px);
    const float log_height = bslam_log(height_px * per_px);
    const float height_m = (float)camera->z_m;
    *x++ = log_wall + log_width;
    *x++ = log_wall + log_height;
    *x++ = bslam_clampf(height_m + wall_m * bottom, -1.0f, 3.0f);
    *x++ = bslam_clampf(height_m + wall_m * top, -1.0f, 4.0f);
    *x++ = log_height - log_width;
    *x++ = log_height + log_width;
    *x++ = (float)p->cells / (float)((p->right - p->left) * (p->bottom - p->top));
    *x++ = line > 0 ? 1.0f / line : 0.0f;
    *x++ = 0.5f * (top + bottom);
    *x++ = height_px > 1.0f ? bslam_clampf(0.5f * (top + bottom) / (height_px * per_px), -3.0f, 8.0f) : 0.0f;
    *x++ = p->segmentation >= BSLAM_SEGMENTATIONS ? 1.0f : 0.0f;
    return x;
}

void bslam_box_prefilter(const bslam_view_t *view, const bslam_proposal_t *box,
                         float glance[BSLAM_GLANCE_FEATURES])
{
    float *x = place_features(view, box, glance);
    x = side_features(view, box, x);
    (void)look_features(view, box, x);
    _Pragma("GCC unroll 3") for (int32_t i = 0; i < SQUARES; i++)
    {
        glance[SQUARES + i] = glance[i] * glance[i];
    }
}
