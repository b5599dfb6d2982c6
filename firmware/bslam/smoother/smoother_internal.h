/// What the smoother's files share.
#ifndef BSLAM_SMOOTHER_SMOOTHER_INTERNAL_H
#define BSLAM_SMOOTHER_SMOOTHER_INTERNAL_H

#include "bslam/smoother/smoother.h"

#define BSLAM_SMOOTHER_BEARING_RAD BSLAM_R(9.58737992e-5)  ///< of a bslam_smoother_seen_t's units
#define BSLAM_SMOOTHER_SD BSLAM_R(1e-6)  ///< of a standard deviation as it is held, rad or m
#define BSLAM_SMOOTHER_RANGE_M BSLAM_R(5e-3)
#define BSLAM_SMOOTHER_BEND BSLAM_R(5e-5)
#define BSLAM_SMOOTHER_MOVED BSLAM_R(1e-3)
#define BSLAM_SMOOTHER_UNITS_MAX BSLAM_R(65535.0)

/// What a direction errs by besides, each time that it is brought to another moment or joined: by the unit of
/// 0.1 mrad, and by a path that is not known to better than a millimetre.
#define BSLAM_SMOOTHER_CARRIED_SD_RAD BSLAM_R(1e-3)

/// Nearer than this a direction says nothing of a distance, nor a distance of a direction.
#define BSLAM_SMOOTHER_RANGE_MIN_M BSLAM_R(1e-3)

/// A block lasts no longer, nor does a node's motion where nothing is seen.
#define BSLAM_SMOOTHER_BLOCK_MAX_S BSLAM_R(0.2)
/// How a joined node's path was driven is known as well as when it was joined; where the robot turned on the
/// spot, hardly at all. A filter that took it for certain would shrink the map until it fits.
#define BSLAM_SMOOTHER_JOINED_DOUBT BSLAM_R(0.5)
/// The path within a block is an arc, as far as the points are right that it leads to.
#define BSLAM_SMOOTHER_BLOCK_DOUBT BSLAM_R(0.2)

/// Node k, counted from the oldest.
static inline bslam_smoother_node_t *bslam_smoother_node(bslam_smoother_t *smoother, int k)
{
    return &smoother->nodes[(smoother->first_node + k) % BSLAM_SMOOTHER_NODES_MAX];
}

/// Direction or distance k, counted from the oldest.
static inline bslam_smoother_seen_t *bslam_smoother_seen(bslam_smoother_t *smoother, int k)
{
    return &smoother->seen[(smoother->first_seen + k) % BSLAM_SMOOTHER_SEEN_MAX];
}

static inline bslam_real_t bslam_smoother_bearing_rad(const bslam_smoother_seen_t *direction)
{
    return (int16_t)direction->value * BSLAM_SMOOTHER_BEARING_RAD;
}

static inline bslam_bend_t bslam_smoother_bend(const bslam_smoother_node_t *node)
{
    return (bslam_bend_t){
        .turned_rad = node->turned * BSLAM_SMOOTHER_BEND,
        .stretch = 1 + node->stretched * BSLAM_SMOOTHER_BEND,
        .doubt_of_miss = node->motion.dt_s > BSLAM_SMOOTHER_BLOCK_MAX_S ? BSLAM_SMOOTHER_JOINED_DOUBT
                                                                        : BSLAM_SMOOTHER_BLOCK_DOUBT,
    };
}

/// A standard deviation as a node has it.
static inline bslam_real_t bslam_smoother_sd(uint8_t weight)
{
    return (bslam_real_t)((16 + (weight & 15)) << (weight >> 4)) * BSLAM_SMOOTHER_SD;
}

static inline bslam_real_t bslam_smoother_sd_rad(const bslam_smoother_seen_t *direction)
{
    return bslam_smoother_sd(direction->weight);
}

// ---- linearise.c

/// The base is linear about the map's places of now, in each beacon's bearing and the logarithm of its
/// distance from the base's robot, which is what directions are nearly linear in. O(n²).
void bslam_smoother_linearise_base(bslam_smoother_t *smoother);

// ---- stand.c

/// The base's robot stands where the newest node's did if it is still there, else where it is.
void bslam_smoother_begin_stand(bslam_smoother_t *smoother);

/// Along a pass or into the base: where what a node sees is linearised from.
void bslam_smoother_follow(bslam_smoother_stand_t *stand, const bslam_smoother_node_t *node);

/// Whether the newest node, which has just come, is where the robot stood before.
void bslam_smoother_reach_newest(bslam_smoother_t *smoother);

/// Where the robot stood, by the path of now. O(what is kept).
void bslam_smoother_find_stands(bslam_smoother_t *smoother);

// ---- nodes.c

/// sum += share * motion, which goes on from it or leads to it.
void bslam_smoother_add_motion(bslam_motion_t *sum, const bslam_motion_t *motion, bslam_real_t share);

/// The nearest whole number, 65535 at most.
int32_t bslam_smoother_units(bslam_real_t value);

/// A standard deviation as a node has it.
uint8_t bslam_smoother_weight(bslam_real_t sd);

/// That of a direction brought to a node, whose variance is this where it comes from.
uint8_t bslam_smoother_carried(bslam_real_t variance_rad2);

/// What was read and seen at a node, into a filter that stands there, linear as from a stand. What does not
/// fit is left out.
void bslam_smoother_take_node(bslam_smoother_t *smoother, bslam_ekf_t *ekf,
                              const bslam_smoother_stand_t *stand, const bslam_smoother_node_t *node,
                              int first_seen);

/// A filter that stands at the node before goes on to this one.
void bslam_smoother_pass_node(bslam_smoother_t *smoother, bslam_ekf_t *ekf, bslam_smoother_stand_t *stand,
                              const bslam_smoother_node_t *node, int first_seen);

/// The oldest node leaves, into the base. The cycle must be begun anew.
void bslam_smoother_drop_oldest(bslam_smoother_t *smoother);

// ---- thin.c

/// Of nodes beyond so many, the oldest two of a level become one of the next, whose room is used up first; at
/// the last level the oldest leaves, into the base. The cycle must be begun anew. O(what is kept).
void bslam_smoother_thin(bslam_smoother_t *smoother, int nodes_max);

// ---- passes.c

/// Begins a cycle: what is too old leaves first, into the base.
void bslam_smoother_begin(bslam_smoother_t *smoother);

/// Does so much work; a node of one phase, in the mean, is a unit. `is_whole`: the newest node is as new as
/// it can be, so that a cycle may end. True if it did: then smoother->run is the filter at the newest node.
bool bslam_smoother_work(bslam_smoother_t *smoother, int units, bool is_whole);

/// After that: the map that came of it is what the models are linearised about, and the robot goes up.
void bslam_smoother_turn(bslam_smoother_t *smoother);

#endif
