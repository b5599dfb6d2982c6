/// A fixed-lag smoother: the filter, led through the last drive again and again, about better points each
/// time. MATH "The smoother".
///
/// A filter linearises each sighting once, at what it holds true then. Bearing-only that is wrong: a beacon's
/// distance is unknown for half a minute, and a wrong one enters every Jacobian. So the last
/// BSLAM_SMOOTHER_NODES_MAX nodes are kept with what was read and seen there, and the filter before them, the
/// *base*. A node is the middle of three frames, farther back of 6, 12 and 24. A cycle is
///
///     forth   from the base through all nodes, linear about their poses and the beacons' places: ends as the
///             filter of now
///     up      from the base again, in the map that came of it: the robot alone
///     back    through the nodes in reverse: the poses that fit all readings best are the next ones to
///             linearise at. They lie on a path as smooth as robots drive
///
/// Then as many nodes as came in meanwhile are joined with their neighbours, or leave into the base. Work is
/// bounded a frame. All of it is the filter's own code (ekf/ekf.h) with its models, gate and Huber's rule.
#ifndef BSLAM_SMOOTHER_SMOOTHER_H
#define BSLAM_SMOOTHER_SMOOTHER_H

#include "bslam/ekf/ekf.h"

/// Frames of a node.
#define BSLAM_SMOOTHER_FRAMES 3
/// Nodes of one of the parts in which the pass back is gone.
#define BSLAM_SMOOTHER_PART 20
#define BSLAM_SMOOTHER_PARTS ((BSLAM_SMOOTHER_NODES_MAX + BSLAM_SMOOTHER_PART - 1) / BSLAM_SMOOTHER_PART)

/// So many of the first frames are nodes of their own, and are not joined. Only there is the heading known
/// without any beacon, so what is seen there tells how the map lies.
#define BSLAM_SMOOTHER_ANCHORS 12

/// Two nodes of a level become one of the next: 1, 2, 4 and 8 times so many frames.
#define BSLAM_SMOOTHER_LEVELS 4

/// Where what is seen is linearised from. It stays as long as the robot stands, as far as one can tell.
typedef struct bslam_smoother_stand {
    bslam_real_t x_m, y_m;
    bslam_real_t doubt_m2;       ///< of this place: variances of x and y
    bslam_real_t travel_var_m2;  ///< of what odometry went since
    bslam_real_t lasts_s;
} bslam_smoother_stand_t;

/// In place of a number of distances: none, and nothing was known of the beacon before.
#define BSLAM_SMOOTHER_FIRST 255
/// In place of a beacon: this is the distance that belongs to the direction before it.
#define BSLAM_SMOOTHER_RANGE 255

/// What was seen of a beacon around a node, brought to its moment: its direction, and behind that its
/// distance, if there is one. 4 bytes each.
typedef struct bslam_smoother_seen {
    uint16_t
        value;  ///< bearing as an int16_t in 1/65536 of a turn: 0.1 mrad; or range in 5 mm, 327 m at most
    uint8_t weight;  ///< sd of the bearing, (16 + low half) 2^(high half) urad: within 3 %, 1 rad at most; or
                     ///< how many distances `value` is the mean of, or BSLAM_SMOOTHER_FIRST
    uint8_t beacon;  ///< its place in the map, or BSLAM_SMOOTHER_RANGE
} bslam_smoother_seen_t;

typedef struct bslam_smoother_node {
    bslam_real_t at[BSLAM_ROBOT_DIM_MAX];  ///< the robot's values: where its models are linearised
    bslam_motion_t motion;                 ///< odometry since the node before, or since the base
    int16_t seen;                          ///< directions and distances
    int16_t turned;                        ///< how its path differs from an arc: bslam_bend_t, in units of
    int16_t stretched;                     ///< BSLAM_SMOOTHER_BEND, the latter less 1
    int16_t
        moved[BSLAM_ROBOT_DIM_MAX];  ///< what the last pass back changed, in units of BSLAM_SMOOTHER_MOVED
    uint8_t doubt;                   ///< of the position, as weights are: sqrt(sd² of x + sd² of y) in um
    bool stands;                     ///< where the robot has stood since the node before, or longer
} bslam_smoother_node_t;

/// Sightings of a beacon in the open block, for a line of bearing over time.
typedef struct bslam_smoother_line {
    bslam_real_t first_rad;
    bslam_real_t weight;          ///< sum of w
    bslam_real_t mean_s, mean_y;  ///< time and bearing, the latter less the first
    bslam_real_t tt, ty;          ///< sums of w t² and w t y, with t and y less these means
    bslam_real_t range_m;         ///< sum
    int32_t ranges, count;
    bool is_first;  ///< nothing was known of the beacon before
} bslam_smoother_line_t;

/// What the pass back needs of a node.
typedef struct bslam_smoother_step {
    bslam_real_t gain[BSLAM_ROBOT_DIM_MAX][BSLAM_ROBOT_DIM_MAX];
    bslam_real_t here[BSLAM_ROBOT_DIM_MAX];  ///< correction by all that was read until the node
    bslam_real_t next[BSLAM_ROBOT_DIM_MAX];  ///< what that makes of the next node's
} bslam_smoother_step_t;

/// The robot on the pass up, where a part begins.
typedef struct bslam_smoother_mark {
    bslam_smoother_stand_t stand;
    bslam_real_t correction[BSLAM_ROBOT_DIM_MAX];
    bslam_real_t factor[BSLAM_ROBOT_DIM_MAX * (BSLAM_ROBOT_DIM_MAX + 1) / 2];  ///< rows of L, each with its D
} bslam_smoother_mark_t;

typedef enum bslam_smoother_phase {
    BSLAM_SMOOTHER_FORTH = 0,
    BSLAM_SMOOTHER_UP = 1,
    BSLAM_SMOOTHER_BACK = 2
} bslam_smoother_phase_t;

typedef struct bslam_smoother {
    bslam_settings_t model;                        ///< the pipeline's, without gate and with Huber's rule
    bslam_real_t free_walk;                        ///< of v: what the estimate rests on
    bslam_real_t path_walk;                        ///< of v: where the models are linearised
    bslam_ekf_t base;                              ///< before the first node, a correction about its mean
    bslam_ekf_t run;                               ///< the present phase's
    bslam_smoother_stand_t base_stand;             ///< of the base
    bslam_smoother_stand_t run_stand;              ///< of the present phase
    bslam_smoother_stand_t last_stand;             ///< of the newest node
    bslam_real_t place[BSLAM_STATE_PADDED];        ///< the map's values that the models are linearised about
    bslam_real_t place_moved[BSLAM_STATE_PADDED];  ///< what the last cycle changed of them
    bslam_smoother_node_t nodes[BSLAM_SMOOTHER_NODES_MAX];
    bslam_smoother_seen_t seen[BSLAM_SMOOTHER_SEEN_MAX];
    int32_t first_node;  ///< rings: where the oldest stands, and how many
    int32_t node_count;
    int32_t anchors;                        ///< the oldest nodes that are one of the first frames each
    int32_t anchors_to_come;                ///< frames that will be such nodes yet
    int32_t levels[BSLAM_SMOOTHER_LEVELS];  ///< nodes of each behind these, the newest ones' first
    int32_t first_seen, seen_count;
    bslam_smoother_phase_t phase;
    int32_t at;       ///< the next node of the phase
    int32_t at_seen;  ///< its first beacon, counted from the oldest
    int32_t top;      ///< nodes that go up and back
    int32_t work;     ///< what the frame may still do; below 0: what the next ones do less
    bslam_smoother_mark_t marks[BSLAM_SMOOTHER_PARTS];
    bslam_smoother_step_t steps[BSLAM_SMOOTHER_PART];
    bslam_smoother_seen_t joined[2 * BSLAM_BEACONS_MAX];  ///< scratch: too much for a stack
    bslam_real_t nearest_m2[BSLAM_BEACONS_MAX];  ///< of the pass forth: squares of how near it was seen from
    bslam_real_t misfit;  ///< of the phase: sum of d² over its sightings, by Huber's rule
    int32_t fitted;       ///< and how many these are
    bslam_real_t fit;     ///< mean of d² on the last pass forth that was taken; 0 before the first
    int32_t halvings;     ///< in a row, of the last cycle's changes
    // The open block.
    bslam_smoother_line_t lines[BSLAM_BEACONS_MAX];
    bslam_motion_t to_middle;    ///< from the newest node to the block's middle
    bslam_motion_t from_middle;  ///< and on to now
    bslam_real_t middle[BSLAM_ROBOT_DIM_MAX];
    bslam_real_t middle_s;  ///< since the block's first frame
    bslam_real_t block_s;
    bslam_real_t gap_s;  ///< since the frame before
    int32_t unfilled;    ///< blocks in a row that held fewer frames than a node is made of
    int32_t frames;
    bslam_real_t idle_s;  ///< odometry since the last frame, or since it worked without one
    bool rested;          ///< it worked at the latest odometry
    uint32_t cycles;      ///< that took the filter's place
    uint32_t insane;      ///< that did not: not finite, or beyond BSLAM_PLACE_MAX_M
    uint32_t halved;      ///< passes forth that were gone again, about points half as far from the old ones
    uint32_t left_out;    ///< sightings that a phase could not use, each time it met them
} bslam_smoother_t;

/// Starts anew from what the filter knows now: it becomes the base, and all nodes are forgotten.
void bslam_smoother_restart(bslam_smoother_t *smoother, const bslam_settings_t *settings,
                            const bslam_ekf_t *ekf);

/// The filter has gone through this motion (as odometry reported it, before any scale). O(1).
void bslam_smoother_move(bslam_smoother_t *smoother, const bslam_ekf_t *ekf, const bslam_motion_t *motion);

/// Odometry was read over so much time. Where no frame has come for a while, works as bslam_smoother_frame
/// does.
void bslam_smoother_rest(bslam_smoother_t *smoother, const bslam_settings_t *settings, bslam_ekf_t *ekf,
                         bslam_real_t dt_s);

/// A sighting of the present frame was taken for beacon `index` of the filter. O(1).
void bslam_smoother_see(bslam_smoother_t *smoother, const bslam_sighting_t *sighting, int index);

/// In place of bslam_ekf_add, for the filter and the base: a guess of the place, a few metres doubtful. The
/// sighting is to be seen then, too. BSLAM_E_MAP_FULL. O(n).
BSLAM_MUST_CHECK bslam_status_t bslam_smoother_add(bslam_smoother_t *smoother, bslam_ekf_t *ekf,
                                                   const bslam_pose_t *mount,
                                                   const bslam_sighting_t *sighting, int *index);

/// The robot is elsewhere: no stand of before goes on.
void bslam_smoother_leave_stand(bslam_smoother_t *smoother);

/// Beacon `index` of the filter is about to be taken out. O(n² + what is kept).
void bslam_smoother_remove(bslam_smoother_t *smoother, int index);

/// The present frame is over: at the end of a block makes a node. Does a bounded piece of work; where a cycle
/// ends, the filter is replaced by what came of it.
void bslam_smoother_frame(bslam_smoother_t *smoother, const bslam_settings_t *settings, bslam_ekf_t *ekf);

#endif
