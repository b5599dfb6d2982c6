#include "vision/built_in/gyro/frame_rotation.h"

#include <string.h>

#include "base/bounds.h"
#include "base/trig.h"
#include "vision/built_in/gyro/column_shift.h"
#include "base/scalar.h"

enum { BANDS = BSLAM_TURN_BANDS };

// Edges of the bands, tangents of the elevation. All lie above the floor, whose pattern moves otherwise than
// the walls'.
static const bslam_real_t EDGE[BANDS + 1] = {BSLAM_R(-0.03), BSLAM_R(0.03), BSLAM_R(0.085), BSLAM_R(0.16),
                                             BSLAM_R(0.245), BSLAM_R(0.35), BSLAM_R(0.48)};
// A column's neighbourhood, columns to either side.
enum { NEIGHBOURS = 8 };
// Steps of a pattern's values in one of luma (of a half-resolution pixel, 0 to 187).
enum { VALUE_STEPS = 2, VALUE_MAX = 127 };
// Patterns that differ by more than this part of what they are show no shift.
static const bslam_real_t MISMATCH_MAX = BSLAM_R(0.2);
// By how much the way between two frames of a camera changes from frame to frame, and how little is known of
// it at most.
static const bslam_real_t WAY_SD_M = BSLAM_R(0.002);
static const bslam_real_t WAY_SD_MOST_M = BSLAM_R(0.02);
// One over the distance of things, 1/m: how much it errs where the floor line tells it (most things stand
// where the floor ends, some before); what it is taken for where nothing does, and how much that errs; the
// largest.
static const bslam_real_t TOLD_SD_PER_M = BSLAM_R(0.1);
static const bslam_real_t USUAL_PER_M = BSLAM_R(0.25);
static const bslam_real_t USUAL_SD_PER_M = BSLAM_R(0.25);
static const bslam_real_t MOST_PER_M = 2;
// Where there is no floor to the frame's lower edge, something stands nearer than the floor that would be
// seen there: one over its distance is larger by this in the mean, and errs by a third of itself.
static const bslam_real_t IN_FRONT = BSLAM_R(1.27);
static const bslam_real_t IN_FRONT_SD = BSLAM_R(0.33);

/// The row of the half-resolution copy where an elevation is, in the middle of the frame.
static int16_t row_at(const bslam_camera_t *camera, bslam_real_t elevation_tangent)
{
    const bslam_real_t v_px = bslam_horizon_px(camera) - camera->fy_px * elevation_tangent;
    const bslam_real_t row = (v_px + BSLAM_R(0.5)) / 2;
    const int32_t rows = camera->height_px / 2;
    return (int16_t)bslam_clamp((int32_t)(row < 0 ? 0 : row), 0, rows);
}

/// Bearing of a column of the frame at the horizon, from the camera's axis.
static bslam_real_t bearing_at(const bslam_camera_t *level, bslam_real_t u_px)
{
    bslam_direction_t direction;
    return bslam_camera_unproject(level, u_px, bslam_horizon_px(level), &direction) == BSLAM_OK
               ? bslam_atan2(direction.y, direction.x)
               : 0;
}

/// One over the distance of what hides all the floor that the frame's lower edge would show, in its middle.
static void fill_in_front(bslam_turn_grid_t *grid, const bslam_camera_t *camera)
{
    const bslam_real_t v_px = (bslam_real_t)camera->height_px - BSLAM_R(0.5);
    bslam_direction_t ray = {0};
    grid->in_front_per_m = USUAL_PER_M;
    grid->in_front_sd_per_m = USUAL_SD_PER_M;
    if (camera->z_m > 0 && bslam_camera_unproject(camera, camera->cx_px, v_px, &ray) == BSLAM_OK &&
        ray.z < 0) {
        const bslam_real_t along = bslam_sqrt(ray.x * ray.x + ray.y * ray.y);
        const bslam_real_t per_m = along > 0 ? -ray.z / (camera->z_m * along) * IN_FRONT : MOST_PER_M;
        grid->in_front_per_m = per_m < MOST_PER_M ? per_m : MOST_PER_M;
        grid->in_front_sd_per_m = grid->in_front_per_m * IN_FRONT_SD;
    }
}

static void make_grid(bslam_turn_grid_t *grid, const bslam_camera_t *camera)
{
    bslam_camera_t level = *camera;
    level.yaw_rad = 0;
    const int32_t columns = camera->width_px / 2;
    const bslam_real_t last_px = (bslam_real_t)(camera->width_px - 2) + BSLAM_R(0.5);
    grid->first_rad = bearing_at(&level, BSLAM_R(0.5));
    grid->step_rad = (grid->first_rad - bearing_at(&level, last_px)) / (bslam_real_t)(columns - 1);
    for (int32_t i = 0; i < columns; i++) {
        bslam_direction_t direction = {.z = 0};
        bslam_real_t u_px = 0, v_px = 0;
        bslam_sin_cos(grid->first_rad - grid->step_rad * (bslam_real_t)i, &direction.y, &direction.x);
        const bool seen = bslam_camera_project(&level, &direction, &u_px, &v_px) == BSLAM_OK;
        const bslam_real_t at_px = seen ? (u_px - BSLAM_R(0.5)) / 2 : 0;
        const bslam_real_t end_px = (bslam_real_t)(columns - 1) - BSLAM_R(0.004);
        grid->at_px[i] = (bslam_turn_place_t)((at_px < 0 ? 0 : at_px > end_px ? end_px : at_px) * 256);
    }
    for (int32_t i = 0; i <= BANDS; i++) {
        grid->row_px[i] = row_at(camera, EDGE[i]);
    }
    fill_in_front(grid, camera);
}

void bslam_turns_init(bslam_turns_t *turns, const bslam_front_end_t *vision)
{
    memset(turns, 0, sizeof *turns);
    turns->way.variance_m2 = WAY_SD_MOST_M * WAY_SD_MOST_M;
    for (int32_t i = 0; i < vision->camera_count; i++) {
        make_grid(&turns->grids[i], &vision->cameras[i]);
    }
}

/// Luma of an RGB565 pixel: twice red, green and twice blue, 0 to 187.
static int32_t luma(uint16_t pixel)
{
    return ((pixel >> 10) & 62) + ((pixel >> 5) & 63) + ((pixel << 1) & 62);
}

/// The mean luma of each column of the half-resolution copy between two rows, in steps of a 16th.
static void column_means(const uint16_t *half, int32_t columns, int32_t first_row, int32_t end_row,
                         int32_t *means)
{
    memset(means, 0, (size_t)columns * sizeof means[0]);
    for (int32_t row = first_row; row < end_row; row++) {
        for (int32_t i = 0; i < columns; i++) {
            means[i] += luma(half[row * columns + i]);
        }
    }
    const int32_t rows = end_row - first_row;
    for (int32_t i = 0; i < columns && rows > 0; i++) {
        means[i] = means[i] * 16 / rows;
    }
}

/// Smooths, so that a pattern can be shifted by part of a column, and takes the mean of each column's
/// neighbourhood off; at the ends, the last column stands for what is beyond.
static void take_neighbours_off(const int32_t *at, int32_t columns, int8_t *values)
{
    const int32_t last = columns - 1;
    int32_t sum = 0;
    for (int32_t i = -NEIGHBOURS; i <= NEIGHBOURS; i++) {
        sum += at[bslam_clamp(i, 0, last)];
    }
    for (int32_t i = 0; i < columns; i++) {
        const int32_t smooth =
            (at[bslam_clamp(i - 1, 0, last)] + 2 * at[i] + at[bslam_clamp(i + 1, 0, last)]) / 4;
        const int32_t value = (smooth - sum / (2 * NEIGHBOURS + 1)) * VALUE_STEPS / 16;
        values[i] = (int8_t)bslam_clamp(value, -VALUE_MAX, VALUE_MAX);
        sum += at[bslam_clamp(i + NEIGHBOURS + 1, 0, last)] - at[bslam_clamp(i - NEIGHBOURS, 0, last)];
    }
}

/// The pattern of a frame, into turns->now.
static void make_pattern(bslam_turns_t *turns, const bslam_turn_grid_t *grid, const uint16_t *half,
                         int32_t columns)
{
    int32_t *means = turns->brightness[0], *at = turns->brightness[1];
    for (int32_t band = 0; band < BANDS; band++) {
        column_means(half, columns, grid->row_px[band + 1], grid->row_px[band], means);
        for (int32_t i = 0; i < columns; i++) {
            const int32_t left = grid->at_px[i] >> 8, part = grid->at_px[i] & 255;
            at[i] = means[left] + (means[left + 1] - means[left]) * part / 256;
        }
        take_neighbours_off(at, columns, turns->now.values[band]);
    }
}

/// How near things are above a cell of the floor line: one over their distance, 1/m, and its noise.
typedef struct bslam_nearness {
    bslam_real_t per_m;
    bslam_real_t sd_per_m;
} nearness_t;

static nearness_t nearness_at(const bslam_turn_grid_t *grid, const bslam_front_end_t *vision, int32_t cell)
{
    const bslam_floor_line_t *line = &vision->floor_line;
    const bslam_real_t told_m = line->distance_m[cell];
    if (told_m > 0) {
        const bslam_real_t told_per_m = 1 / told_m;
        return (nearness_t){told_per_m < MOST_PER_M ? told_per_m : MOST_PER_M, TOLD_SD_PER_M};
    }
    if (line->edge_px[cell] >= vision->cameras[vision->camera].height_px - BSLAM_CELL_PX) {
        return (nearness_t){grid->in_front_per_m, grid->in_front_sd_per_m};
    }
    return (nearness_t){USUAL_PER_M, USUAL_SD_PER_M};
}

/// Where each column looks, and how near things are there.
static void look_along(const bslam_turn_grid_t *grid, const bslam_front_end_t *vision, int32_t count,
                       bslam_turn_column_t *columns)
{
    bslam_real_t sine, cosine, step_sine, step_cosine;
    bslam_sin_cos(vision->cameras[vision->camera].yaw_rad + grid->first_rad, &sine, &cosine);
    bslam_sin_cos(grid->step_rad, &step_sine, &step_cosine);
    for (int32_t i = 0; i < count; i++) {
        const nearness_t near = nearness_at(grid, vision, (grid->at_px[i] >> 8) * 2 / BSLAM_CELL_PX);
        columns[i].parallax_per_m = sine * near.per_m;
        columns[i].parallax_sd_per_m = sine * near.sd_per_m;
        const bslam_real_t next = sine * step_cosine - cosine * step_sine;  // one step to the right
        cosine = cosine * step_cosine + sine * step_sine;
        sine = next;
    }
}

/// What is thought of the way before a frame is looked at: that of the frame before, by about.
static void doubt_way(bslam_turn_way_t *way)
{
    way->variance_m2 += WAY_SD_M * WAY_SD_M;
    if (way->variance_m2 > WAY_SD_MOST_M * WAY_SD_MOST_M) {
        way->variance_m2 = WAY_SD_MOST_M * WAY_SD_MOST_M;
    }
}

static bool compare(bslam_turns_t *turns, const bslam_front_end_t *vision, bslam_turn_t *turn)
{
    const int32_t camera = vision->camera;
    const bslam_turn_grid_t *grid = &turns->grids[camera];
    const bslam_pattern_pair_t pair = {&turns->before[camera], &turns->now,
                                       vision->cameras[camera].width_px / 2, grid->step_rad};
    const bslam_pattern_match_t match = bslam_shift_search(&pair, &turns->squares);
    doubt_way(&turns->way);
    if (!(match.mismatch < MISMATCH_MAX)) {
        return false;
    }
    look_along(grid, vision, pair.columns, turns->columns);
    bslam_turn_t found;
    if (!bslam_shift_fit(&pair, &match, turns->columns, &turns->way, &found)) {
        return false;
    }
    found.turn_rad -= bslam_angle_wrap(pair.now->yaw_rad - pair.before->yaw_rad);
    *turn = found;
    return true;
}

bool bslam_turns_see(bslam_turns_t *turns, const bslam_front_end_t *vision, bslam_turn_t *turn)
{
    const bslam_camera_t *camera = &vision->cameras[vision->camera];
    bslam_turn_pattern_t *before = &turns->before[vision->camera];
    const bslam_vision_reason_t reason = vision->reason;
    turns->now.known = reason == BSLAM_VISION_SEEN || reason == BSLAM_VISION_NOTHING;
    bool found = false;
    if (turns->now.known) {
        turns->now.yaw_rad = camera->yaw_rad;
        make_pattern(turns, &turns->grids[vision->camera], vision->thumbnail.half, camera->width_px / 2);
        found = before->known && compare(turns, vision, turn);
    }
    *before = turns->now;
    return found;
}
