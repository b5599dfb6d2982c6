#include "bslam/smoother/smoother.h"

#include <string.h>

#include "base/trig.h"
#include "bslam/model/noise.h"
#include "bslam/smoother/smoother_internal.h"
#include "base/scalar.h"

/// So many blocks in a row that held fewer frames than a node is made of: frames are rare. One alone is the
/// last moment before nothing is in view.
enum { UNFILLED_MIN = 5 };
/// Where nothing is seen a node ends after so long: odometry alone is not to fill the window. Speeds that are
/// states are read once a node, and no such node lasts longer than a block.
static const bslam_real_t UNSEEN_MAX_S = BSLAM_R(0.6);
/// How a bearing changes besides by the turn that the filter has, rad/s: by the travel, and by an error of
/// that.
static const bslam_real_t SLOPE_SD_RADPS = BSLAM_R(0.5);
/// A bearing-only beacon is first thought to be so far away.
static const bslam_real_t FIRST_RANGE_M = BSLAM_R(4.0);
static const bslam_real_t FIRST_SD_M = BSLAM_R(2.5);
/// The same where all sightings will be gone through again.
static const bslam_real_t UNSEEN_SD_M = BSLAM_R(20.0);
/// Passes are wanted most while the map is young. In nodes a frame: at first, and less by one for each so
/// many nodes.
enum { UNITS_FIRST = 64, NODES_A_UNIT_LESS = BSLAM_SMOOTHER_NODES_MAX / 15 + 1 };
static const bslam_real_t HUBER_D = BSLAM_R(3.0);

static void clear_block(bslam_smoother_t *smoother)
{
    memset(smoother->lines, 0, sizeof smoother->lines);
    smoother->frames = 0;
    smoother->middle_s = 0;
    smoother->block_s = 0;
}

void bslam_smoother_restart(bslam_smoother_t *smoother, const bslam_settings_t *settings,
                            const bslam_ekf_t *ekf)
{
    smoother->model = *settings;
    smoother->model.filter = BSLAM_FILTER_STANDARD;
    smoother->free_walk = settings->velocity_walk_mps_sqrt_s;
    smoother->path_walk = settings->path_walk_mps_sqrt_s;
    smoother->model.bearing_only_variance_factor = 1;
    smoother->model.bearing_only_curvature_factor = 0;
    // A model without a gate rests on Huber's rule, and keeps its own.
    smoother->model.huber_d = settings->gate_d2 > 0 || settings->huber_d <= 0 ? HUBER_D : settings->huber_d;
    smoother->model.gate_d2 = 0;
    smoother->base = *ekf;
    bslam_smoother_begin_stand(smoother);
    memset(smoother->base.correction, 0, sizeof smoother->base.correction);
    smoother->base.has_correction = true;
    memcpy(smoother->place, ekf->mean, sizeof smoother->place);
    memset(smoother->place_moved, 0, sizeof smoother->place_moved);
    smoother->fit = 0;
    smoother->halvings = 0;
    smoother->first_node = 0;
    smoother->node_count = 0;
    smoother->anchors = 0;
    smoother->anchors_to_come = BSLAM_SMOOTHER_ANCHORS;
    memset(smoother->levels, 0, sizeof smoother->levels);
    smoother->first_seen = 0;
    smoother->seen_count = 0;
    smoother->to_middle = (bslam_motion_t){0};
    smoother->from_middle = (bslam_motion_t){0};
    smoother->gap_s = 0;
    smoother->unfilled = 0;
    smoother->idle_s = 0;
    smoother->rested = false;
    clear_block(smoother);
    bslam_smoother_begin(smoother);
}

// ---- nodes ------------------------------------------------------------------------------------------------

static bslam_real_t mean_range_m(const bslam_smoother_line_t *line)
{
    return line->range_m / (bslam_real_t)line->ranges;
}

/// There is more to say of the beacon than its direction.
static bool has_range(const bslam_smoother_line_t *line)
{
    return line->ranges > 0 ? mean_range_m(line) < BSLAM_SMOOTHER_UNITS_MAX * BSLAM_SMOOTHER_RANGE_M
                            : line->is_first;
}

static bslam_smoother_seen_t range_of(const bslam_smoother_line_t *line)
{
    return (bslam_smoother_seen_t){
        .value =
            (uint16_t)(line->ranges > 0 ? bslam_smoother_units(mean_range_m(line) / BSLAM_SMOOTHER_RANGE_M)
                                        : 0),
        .weight = (uint8_t)(line->ranges > 0 ? line->ranges : BSLAM_SMOOTHER_FIRST),
        .beacon = BSLAM_SMOOTHER_RANGE,
    };
}

/// The line through a beacon's bearings, at the block's middle. Its slope is about that of the turn.
static bslam_smoother_seen_t fit(const bslam_smoother_t *smoother, int beacon)
{
    const bslam_smoother_line_t *line = &smoother->lines[beacon];
    const bslam_real_t turn = smoother->model.velocity_states != 0 ? smoother->middle[BSLAM_STATE_TURN] : 0;
    const bslam_real_t sloped = line->tt + 1 / (SLOPE_SD_RADPS * SLOPE_SD_RADPS);
    const bslam_real_t t = smoother->middle_s - line->mean_s;
    const bslam_real_t slope = (line->ty + turn * line->tt) / sloped - turn;
    const bslam_real_t bearing_rad = line->first_rad + line->mean_y + slope * t;
    return (bslam_smoother_seen_t){
        // Half a turn to the left is half a turn to the right.
        .value = (uint16_t)bslam_smoother_units(bslam_angle_wrap(bearing_rad) / BSLAM_SMOOTHER_BEARING_RAD),
        .weight = bslam_smoother_carried(1 / line->weight + t * t / sloped),
        .beacon = (uint8_t)beacon,
    };
}

/// How many directions and distances the open block has.
static int seen_of_block(const bslam_smoother_t *smoother)
{
    int count = 0;
    for (int b = 0; b < smoother->base.beacon_count; b++) {
        const bslam_smoother_line_t *line = &smoother->lines[b];
        count += line->count > 0 ? 1 + (has_range(line) ? 1 : 0) : 0;
    }
    return count;
}

static void push_seen(bslam_smoother_t *smoother, bslam_smoother_seen_t seen)
{
    *bslam_smoother_seen(smoother, smoother->seen_count) = seen;
    smoother->seen_count++;
}

static void make_room(bslam_smoother_t *smoother, int seen)
{
    bool dropped = false;
    while (smoother->node_count == BSLAM_SMOOTHER_NODES_MAX ||
           smoother->seen_count + seen > BSLAM_SMOOTHER_SEEN_MAX) {
        bslam_smoother_drop_oldest(smoother);
        dropped = true;
    }
    if (dropped) {
        bslam_smoother_begin(smoother);
    }
}

/// How many frames the open block is to hold.
static int frames_wanted(const bslam_smoother_t *smoother)
{
    return smoother->anchors_to_come > 0 ? 1 : BSLAM_SMOOTHER_FRAMES;
}

/// A node has come at the new end. The oldest one belongs to no level.
static void count_node(bslam_smoother_t *smoother)
{
    if (smoother->anchors_to_come > 0) {
        smoother->anchors_to_come--;
        smoother->anchors++;
    } else {
        smoother->levels[0] += smoother->node_count > 0 ? 1 : 0;
    }
    smoother->node_count++;
}

/// The open block becomes a node.
static void close_block(bslam_smoother_t *smoother)
{
    if (smoother->frames > 0) {
        smoother->unfilled = smoother->frames == frames_wanted(smoother) ? 0 : smoother->unfilled + 1;
    }
    const int seen = seen_of_block(smoother);
    make_room(smoother, seen);
    bslam_smoother_node_t *node = bslam_smoother_node(smoother, smoother->node_count);
    memcpy(node->at, smoother->middle, sizeof node->at);
    memset(node->moved, 0, sizeof node->moved);
    node->motion = smoother->to_middle;
    node->seen = (int16_t)seen;
    node->doubt =
        smoother->node_count > 0 ? bslam_smoother_node(smoother, smoother->node_count - 1)->doubt : 0;
    node->turned = 0;
    node->stretched = 0;
    for (int b = 0; b < smoother->base.beacon_count; b++) {
        const bslam_smoother_line_t *line = &smoother->lines[b];
        if (line->count > 0) {
            push_seen(smoother, fit(smoother, b));
        }
        if (line->count > 0 && has_range(line)) {
            push_seen(smoother, range_of(line));
        }
    }
    count_node(smoother);
    bslam_smoother_reach_newest(smoother);
    smoother->to_middle = (bslam_motion_t){0};
    clear_block(smoother);
}

/// The middle of the block is now, as far as one knows.
static void set_middle(bslam_smoother_t *smoother, const bslam_ekf_t *ekf)
{
    bslam_smoother_add_motion(&smoother->to_middle, &smoother->from_middle, 1);
    smoother->from_middle = (bslam_motion_t){0};
    smoother->middle_s = smoother->block_s;
    memcpy(smoother->middle, ekf->mean, (size_t)ekf->base_dim * sizeof smoother->middle[0]);
}

// ---- sightings and beacons --------------------------------------------------------------------------------

void bslam_smoother_see(bslam_smoother_t *smoother, const bslam_sighting_t *sighting, int index)
{
    bslam_smoother_line_t *line = &smoother->lines[index];
    const bslam_real_t sd_rad =
        sighting->bearing_sd_rad > 0 ? sighting->bearing_sd_rad : smoother->model.bearing_sd_rad;
    const bslam_real_t weight = 1 / (sd_rad * sd_rad);
    if (line->count == 0) {
        line->first_rad = sighting->bearing_rad;
    }
    const bslam_real_t t = smoother->block_s - line->mean_s;
    const bslam_real_t y = bslam_angle_wrap(sighting->bearing_rad - line->first_rad) - line->mean_y;
    line->weight += weight;
    const bslam_real_t share = weight / line->weight;
    line->mean_s += share * t;
    line->mean_y += share * y;
    line->tt += weight * t * (t - share * t);
    line->ty += weight * t * (y - share * y);
    line->count++;
    if (sighting->has_range) {
        line->range_m += sighting->range_m;
        line->ranges++;
    }
}

bslam_status_t bslam_smoother_add(bslam_smoother_t *smoother, bslam_ekf_t *ekf, const bslam_pose_t *mount,
                                  const bslam_sighting_t *sighting, int *index)
{
    const bslam_pose_t pose = bslam_ekf_pose(ekf);
    const bslam_real_t range_m = sighting->has_range ? sighting->range_m : FIRST_RANGE_M;
    const bslam_sighted_point_t point = bslam_locate_point(&pose, mount, range_m, sighting->bearing_rad);
    bslam_status_t status = bslam_ekf_add_guess(ekf, point.x_m, point.y_m, FIRST_SD_M, index);
    if (status != BSLAM_OK) {
        return status;
    }
    const int at = smoother->base.dim;
    smoother->place[at] = point.x_m;
    smoother->place[at + 1] = point.y_m;
    smoother->place_moved[at] = 0;
    smoother->place_moved[at + 1] = 0;
    int same;
    smoother->lines[*index].is_first = true;
    smoother->base.correction[at] = 0;
    smoother->base.correction[at + 1] = 0;
    status = bslam_ekf_add_guess(&smoother->base, point.x_m, point.y_m, UNSEEN_SD_M, &same);
    if (status == BSLAM_OK && smoother->phase == BSLAM_SMOOTHER_FORTH) {
        smoother->run.correction[at] = 0;
        smoother->run.correction[at + 1] = 0;
        status = bslam_ekf_add_guess(&smoother->run, point.x_m, point.y_m, UNSEEN_SD_M, &same);
    }
    return status;
}

/// What was seen of a beacon is forgotten, and those behind it move up.
static void forget_seen(bslam_smoother_t *smoother, int index)
{
    int from = 0, to = 0;
    bool is_gone = false;  // the direction last met
    for (int n = 0; n < smoother->node_count; n++) {
        bslam_smoother_node_t *node = bslam_smoother_node(smoother, n);
        const int end = from + node->seen;
        for (; from < end; from++) {
            bslam_smoother_seen_t seen = *bslam_smoother_seen(smoother, from);
            is_gone = seen.beacon == BSLAM_SMOOTHER_RANGE ? is_gone : seen.beacon == index;
            if (is_gone) {
                node->seen--;
                continue;
            }
            if (seen.beacon != BSLAM_SMOOTHER_RANGE && seen.beacon > index) {
                seen.beacon--;
            }
            *bslam_smoother_seen(smoother, to) = seen;
            to++;
        }
    }
    smoother->seen_count = to;
}

void bslam_smoother_remove(bslam_smoother_t *smoother, int index)
{
    const bslam_beacon_t *beacon = &smoother->base.beacons[index];
    const int dim = bslam_beacon_dim(beacon->kind);
    const int at = beacon->at;
    if (dim > 0) {
        const size_t behind = (size_t)(smoother->base.dim - at - dim) * sizeof smoother->place[0];
        memmove(&smoother->place[at], &smoother->place[at + dim], behind);
        memmove(&smoother->place_moved[at], &smoother->place_moved[at + dim], behind);
        memmove(&smoother->base.correction[at], &smoother->base.correction[at + dim], behind);
    }
    memmove(&smoother->lines[index], &smoother->lines[index + 1],
            (size_t)(smoother->base.beacon_count - index - 1) * sizeof smoother->lines[0]);
    memset(&smoother->lines[smoother->base.beacon_count - 1], 0, sizeof smoother->lines[0]);
    forget_seen(smoother, index);
    bslam_ekf_remove(&smoother->base, index);
    bslam_smoother_begin(smoother);
}

// ---- as time goes on --------------------------------------------------------------------------------------

/// The filter becomes what a cycle has made of it, and goes on to now.
static void take_over(bslam_smoother_t *smoother, const bslam_settings_t *settings, bslam_ekf_t *ekf)
{
    const bslam_ekf_t *run = &smoother->run;
    memcpy(ekf->mean, run->mean, sizeof ekf->mean);
    ekf->factor = run->factor;
    for (int b = 0; b < ekf->beacon_count; b++) {
        ekf->beacons[b].at = run->beacons[b].at;
    }
    if (smoother->from_middle.dt_s > 0) {
        bslam_motion_t moved;
        bslam_ekf_predict(ekf, settings, &smoother->from_middle, &moved);
    }
    smoother->cycles++;
}

/// Frames have come so rarely for a while that the block will not hold the next one. Cycles end with a block.
static bool is_last_of_block(const bslam_smoother_t *smoother)
{
    return smoother->unfilled >= UNFILLED_MIN &&
           smoother->block_s + smoother->gap_s > BSLAM_SMOOTHER_BLOCK_MAX_S;
}

static bslam_real_t unseen_max_s(const bslam_smoother_t *smoother)
{
    return smoother->model.velocity_states != 0 ? BSLAM_SMOOTHER_BLOCK_MAX_S : UNSEEN_MAX_S;
}

/// Whether what a cycle has made can be. After a long way in doubt one may begin about points so far off that
/// it ends anywhere.
static bool can_be(const bslam_ekf_t *run)
{
    return bslam_ekf_is_sane(run) && bslam_abs(run->mean[BSLAM_STATE_X]) <= BSLAM_PLACE_MAX_M &&
           bslam_abs(run->mean[BSLAM_STATE_Y]) <= BSLAM_PLACE_MAX_M;
}

/// Does a bounded piece of work. Where a cycle ends, the filter is replaced by what came of it.
static void work(bslam_smoother_t *smoother, const bslam_settings_t *settings, bslam_ekf_t *ekf,
                 bool is_whole)
{
    const int units = UNITS_FIRST - smoother->node_count / NODES_A_UNIT_LESS;
    if (!bslam_smoother_work(smoother, units, is_whole)) {
        return;
    }
    if (can_be(&smoother->run)) {
        take_over(smoother, settings, ekf);
        bslam_smoother_turn(smoother);
    } else {
        smoother->insane++;
        bslam_smoother_restart(smoother, settings, ekf);
    }
}

void bslam_smoother_move(bslam_smoother_t *smoother, const bslam_ekf_t *ekf, const bslam_motion_t *motion)
{
    if (smoother->frames > 0 && smoother->block_s + motion->dt_s > BSLAM_SMOOTHER_BLOCK_MAX_S) {
        close_block(smoother);
    }
    bslam_smoother_add_motion(&smoother->from_middle, motion, 1);
    smoother->gap_s += motion->dt_s;
    if (smoother->frames > 0) {
        smoother->block_s += motion->dt_s;
    } else if (smoother->from_middle.dt_s >= unseen_max_s(smoother)) {
        set_middle(smoother, ekf);
        close_block(smoother);
    }
}

void bslam_smoother_rest(bslam_smoother_t *smoother, const bslam_settings_t *settings, bslam_ekf_t *ekf,
                         bslam_real_t dt_s)
{
    smoother->idle_s += dt_s;
    smoother->rested = smoother->idle_s >= BSLAM_SMOOTHER_BLOCK_MAX_S;
    if (smoother->rested) {
        smoother->idle_s = 0;
        if (smoother->frames > 0) {
            close_block(smoother);
        }
        work(smoother, settings, ekf, true);
    }
}

void bslam_smoother_frame(bslam_smoother_t *smoother, const bslam_settings_t *settings, bslam_ekf_t *ekf)
{
    smoother->frames++;
    if (smoother->frames <= BSLAM_SMOOTHER_FRAMES / 2 + 1) {
        set_middle(smoother, ekf);
    }
    const bool is_whole = smoother->frames == frames_wanted(smoother) || is_last_of_block(smoother);
    smoother->gap_s = 0;
    if (is_whole) {
        close_block(smoother);
    }
    if (!smoother->rested) {  // else this step of the robot's has done its work
        work(smoother, settings, ekf, is_whole);
    }
    smoother->rested = false;
    smoother->idle_s = 0;
}
