// Whether what a smoother has in memory that nothing guards may be used.
#include "base/bounds.h"
#include "bslam/smoother/smoother_internal.h"

/// More frames, and more work, than there ever are.
enum { COUNT_MAX = 1000000000 };

/// The base holds the filter's beacons, and each where the filter has it.
static bool is_base_of(bslam_ekf_t *base, const bslam_ekf_t *ekf)
{
    if (base->dim != ekf->dim || base->base_dim != ekf->base_dim || base->beacon_count != ekf->beacon_count ||
        base->ray_count != ekf->ray_count || base->sized_count != ekf->sized_count ||
        base->pending_count != 0) {
        return false;
    }
    bslam_mend_flag(&base->has_correction);
    for (int b = 0; b < base->beacon_count; b++) {
        bslam_beacon_t *beacon = &base->beacons[b];
        if (beacon->kind != ekf->beacons[b].kind || beacon->at != ekf->beacons[b].at) {
            return false;
        }
        bslam_mend_flag(&beacon->confirmed);
        bslam_mend_flag(&beacon->has_scores);
    }
    return true;
}

/// The present phase's filter is the base's as it was when the phase began, or without its map.
static bool is_run_of(bslam_ekf_t *run, const bslam_ekf_t *base)
{
    const bool has_map = run->dim == base->dim;
    if ((!has_map && run->dim != base->base_dim) || run->base_dim != base->base_dim ||
        run->beacon_count != base->beacon_count || run->pending_count != 0) {
        return false;
    }
    bslam_mend_flag(&run->has_correction);
    for (int b = 0; b < run->beacon_count; b++) {
        bslam_beacon_t *beacon = &run->beacons[b];
        const bool is_known = beacon->kind == BSLAM_BEACON_KNOWN;
        const bool is_same = has_map && beacon->kind == base->beacons[b].kind;
        if ((!is_known && !is_same) || beacon->at != base->beacons[b].at) {
            return false;
        }
        bslam_mend_flag(&beacon->confirmed);
        bslam_mend_flag(&beacon->has_scores);
    }
    return true;
}

/// What was seen from a node: directions of beacons, and behind some of them a distance.
static bool is_seen(bslam_smoother_t *smoother, int first, int count)
{
    bool has_direction = false;
    for (int k = first; k < first + count; k++) {
        const int beacon = bslam_smoother_seen(smoother, k)->beacon;
        const bool is_range = beacon == BSLAM_SMOOTHER_RANGE;
        if (is_range ? !has_direction : beacon >= smoother->base.beacon_count) {
            return false;
        }
        has_direction = !is_range;
    }
    return true;
}

/// All nodes, what was seen from them, and where the phase stands.
static bool are_nodes(bslam_smoother_t *smoother)
{
    int seen = 0;
    for (int k = 0; k < smoother->node_count; k++) {
        const int count = bslam_smoother_node(smoother, k)->seen;
        if ((k == smoother->at && smoother->at_seen != seen) ||
            !bslam_is_count(count, smoother->seen_count - seen) || !is_seen(smoother, seen, count)) {
            return false;
        }
        seen += count;
    }
    return seen == smoother->seen_count && (smoother->at < smoother->node_count || smoother->at_seen == seen);
}

/// The oldest nodes are anchors, or else one that belongs to no level; the others stand in levels.
static bool are_levels(const bslam_smoother_t *smoother)
{
    int count = bslam_most(smoother->anchors, smoother->node_count > 0 ? 1 : 0);
    for (int l = 0; l < BSLAM_SMOOTHER_LEVELS; l++) {
        if (!bslam_is_count(smoother->levels[l], smoother->node_count)) {
            return false;
        }
        count += smoother->levels[l];
    }
    return count == smoother->node_count;
}

static bool are_lines(bslam_smoother_t *smoother)
{
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        bslam_smoother_line_t *line = &smoother->lines[b];
        bslam_mend_flag(&line->is_first);
        if (!bslam_is_count(line->count, COUNT_MAX) || !bslam_is_count(line->ranges, line->count)) {
            return false;
        }
    }
    return true;
}

static bool are_counts(const bslam_smoother_t *smoother)
{
    return bslam_is_count(smoother->first_node, BSLAM_SMOOTHER_NODES_MAX - 1) &&
           bslam_is_count(smoother->node_count, BSLAM_SMOOTHER_NODES_MAX) &&
           bslam_is_count(smoother->first_seen, BSLAM_SMOOTHER_SEEN_MAX - 1) &&
           bslam_is_count(smoother->seen_count, BSLAM_SMOOTHER_SEEN_MAX) &&
           bslam_is_count(smoother->anchors, smoother->node_count) &&
           bslam_is_count(smoother->anchors_to_come, BSLAM_SMOOTHER_ANCHORS) &&
           smoother->phase <= BSLAM_SMOOTHER_BACK && bslam_is_count(smoother->top, smoother->node_count) &&
           bslam_is_count(smoother->at,
                          smoother->phase == BSLAM_SMOOTHER_FORTH ? smoother->node_count : smoother->top) &&
           bslam_magnitude(bslam_most(smoother->work, -INT32_MAX)) < COUNT_MAX &&
           bslam_is_count(smoother->fitted, COUNT_MAX) && bslam_is_count(smoother->halvings, COUNT_MAX) &&
           bslam_is_count(smoother->unfilled, COUNT_MAX) && bslam_is_count(smoother->frames, COUNT_MAX);
}

void bslam_smoother_mend(bslam_smoother_t *smoother, const bslam_settings_t *settings, const bslam_ekf_t *ekf)
{
    bslam_mend_flag(&smoother->rested);
    if (!(is_base_of(&smoother->base, ekf) && is_run_of(&smoother->run, &smoother->base) &&
          are_counts(smoother) && are_levels(smoother) && are_nodes(smoother) && are_lines(smoother))) {
        bslam_smoother_restart(smoother, settings, ekf);
    }
}
