// Joint compatibility branch and bound: the pairing of a frame that explains the most sightings together.
// MATH "Data association".
#include <string.h>

#include "bslam/association/association.h"
#include "bslam/association/conditional.h"
#include "bslam/association/association_internal.h"
#include "base/scalar.h"

/// A search through the pairings of up to BSLAM_CONDITIONAL_MAX sightings: level i chooses for the i-th of
/// them.
typedef struct pairing_search {
    bslam_conditional_t conditional;
    int32_t sightings[BSLAM_CONDITIONAL_MAX];
    int32_t next[BSLAM_CONDITIONAL_MAX];    ///< what a level tries next: a beacon, or none at all
    int32_t choice[BSLAM_CONDITIONAL_MAX];  ///< a beacon, or -1
    int32_t scalars[BSLAM_CONDITIONAL_MAX + 1];
    int32_t pairs[BSLAM_CONDITIONAL_MAX + 1];
    int32_t best[BSLAM_CONDITIONAL_MAX], count, best_pairs;
    bslam_real_t best_distance2;
} pairing_search_t;

/// The chi-squared value of `freedoms` that is exceeded as rarely as the normal deviation joint_sd
/// (Wilson and Hilferty).
static bslam_real_t joint_limit(const bslam_settings_t *settings, int32_t freedoms)
{
    const bslam_real_t n = (bslam_real_t)freedoms;
    const bslam_real_t spread = 2 / (9 * n);
    const bslam_real_t root = 1 - spread + settings->joint_sd * bslam_sqrt(spread);
    return n * root * root * root;
}

static bool is_free(const bslam_sighting_frame_t *frame, const bslam_record_t *records,
                    const pairing_search_t *search, int32_t level, int32_t beacon)
{
    for (int32_t i = 0; i < level; i++) {
        if (search->choice[i] == beacon) {
            return false;
        }
    }
    for (int i = 0; i < frame->count; i++) {
        if (records[i].match.verdict == BSLAM_VERDICT_MATCH && records[i].match.beacon == beacon) {
            return false;
        }
    }
    return true;
}

/// Pairs the sighting of a level with a beacon, if both alone and with the pairs before it that is possible.
static bool pair(const bslam_sighting_frame_t *frame, pairing_search_t *search, int32_t level, int32_t beacon)
{
    const bslam_sighting_t *sighting = &frame->sightings[search->sightings[level]];
    bslam_innovation_t innovation;
    bslam_real_t distance2;
    if (bslam_ekf_classes_differ(&frame->ekf->beacons[beacon], sighting) ||
        bslam_ekf_innovation(frame->ekf, frame->settings, frame->mount, sighting, beacon, &innovation) !=
            BSLAM_OK ||
        bslam_ekf_distance2(frame->ekf, &innovation, &distance2) != BSLAM_OK ||
        distance2 > frame->settings->match_d2 ||
        !bslam_conditional_add(frame->ekf, &search->conditional, &innovation)) {
        return false;
    }
    return bslam_conditional_distance2(&search->conditional) <=
           joint_limit(frame->settings, search->conditional.count);
}

/// Keeps the pairing at hand if it has more pairs than the best so far, or as many that fit better: one of
/// fewer does not come so far (try_next).
static void keep_if_better(pairing_search_t *search)
{
    const int32_t pairs = search->pairs[search->count];
    const bslam_real_t distance2 = bslam_conditional_distance2(&search->conditional);
    if (pairs > search->best_pairs || distance2 < search->best_distance2) {
        search->best_pairs = pairs;
        search->best_distance2 = distance2;
        memcpy(search->best, search->choice, sizeof search->best);
    }
}

/// Tries the next choice of a level. True if the search may go one level deeper.
static bool try_next(const bslam_sighting_frame_t *frame, const bslam_record_t *records,
                     pairing_search_t *search, int32_t level)
{
    const int32_t beacon = search->next[level]++;
    const int32_t left = search->count - level - 1;
    search->conditional.count = search->scalars[level];
    if (beacon == frame->ekf->beacon_count) {
        search->choice[level] = -1;
        search->pairs[level + 1] = search->pairs[level];
    } else {
        if (!is_free(frame, records, search, level, beacon) || !pair(frame, search, level, beacon)) {
            return false;
        }
        search->choice[level] = beacon;
        search->pairs[level + 1] = search->pairs[level] + 1;
    }
    search->scalars[level + 1] = search->conditional.count;
    return search->pairs[level + 1] + left >= search->best_pairs;
}

/// Depth first, until all is tried or joint_nodes choices were.
static void run(const bslam_sighting_frame_t *frame, const bslam_record_t *records, pairing_search_t *search)
{
    int32_t level = 0;
    search->next[0] = 0;
    for (int32_t node = 0; node < frame->settings->joint_nodes && level >= 0; node++) {
        if (search->next[level] > frame->ekf->beacon_count) {
            level--;
        } else if (try_next(frame, records, search, level)) {
            if (level + 1 == search->count) {
                keep_if_better(search);
            } else {
                level++;
                search->next[level] = 0;
            }
        }
    }
}

/// What becomes of a sighting that is in no pair: new far from every beacon, else it is left alone.
static void decide_rest(const bslam_sighting_frame_t *frame, int32_t i, bslam_match_t *match)
{
    for (int b = 0; b < frame->ekf->beacon_count; b++) {
        const bslam_real_t distance2 =
            bslam_ekf_sighting_distance2(frame->ekf, frame->settings, frame->mount, &frame->sightings[i], b);
        if (!bslam_ekf_classes_differ(&frame->ekf->beacons[b], &frame->sightings[i]) && distance2 >= 0 &&
            (match->distance2 < 0 || distance2 < match->distance2)) {
            match->distance2 = distance2;
        }
    }
    const bool is_new = match->distance2 < 0 || match->distance2 > frame->settings->new_d2;
    match->verdict = is_new ? BSLAM_VERDICT_NEW : BSLAM_VERDICT_REJECT;
    match->reason = is_new ? BSLAM_REASON_NONE : BSLAM_REASON_AMBIGUOUS;
}

/// Searches for the sightings that were gathered, and writes down what was found.
static void settle(const bslam_sighting_frame_t *frame, pairing_search_t *search, bslam_record_t *records)
{
    bslam_conditional_init(&search->conditional);
    search->scalars[0] = 0;
    search->pairs[0] = 0;
    search->best_pairs = 0;
    search->best_distance2 = 0;
    for (int32_t k = 0; k < BSLAM_CONDITIONAL_MAX; k++) {
        search->best[k] = -1;
    }
    run(frame, records, search);
    for (int32_t k = 0; k < search->count; k++) {
        bslam_match_t *match = &records[search->sightings[k]].match;
        match->beacon = search->best[k];
        if (match->beacon >= 0) {
            match->verdict = BSLAM_VERDICT_MATCH;
        } else {
            decide_rest(frame, search->sightings[k], match);
        }
    }
    search->count = 0;
}

void bslam_associate_joint(const bslam_sighting_frame_t *frame, bslam_record_t *records)
{
    pairing_search_t search;
    search.count = 0;
    for (int i = 0; i < frame->count; i++) {
        (void)bslam_is_mappable(&frame->sightings[i], &records[i].match);
    }
    for (int i = 0; i < frame->count; i++) {
        if (records[i].match.reason == BSLAM_REASON_CLASS) {
            continue;
        }
        search.sightings[search.count] = i;
        search.count++;
        if (search.count == BSLAM_CONDITIONAL_MAX) {
            settle(frame, &search, records);
        }
    }
    if (search.count > 0) {
        settle(frame, &search, records);
    }
}
