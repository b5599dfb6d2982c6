// Position selects candidates, appearance decides: paper Section IV. MATH "Position and appearance".
#include "bslam/association/association.h"
#include "bslam/association/conditional.h"
#include "bslam/association/association_internal.h"
#include "bslam/association/viewpoint.h"
#include "base/logarithm.h"
#include "bslam/model/noise.h"

static const bslam_real_t LN_NINE = BSLAM_R(2.197224577);
// Sightings of one view err together, but not in all: the best of them says so many times what it scores.
static const bslam_real_t VIEW_WORTH = 2;

/// A sighting against a beacon.
typedef struct candidate {
    bslam_real_t score;  ///< log odds of this beacon against a new one
    bslam_real_t view_score, distance2;
    bslam_opinion_t opinion;
} candidate_t;

static bslam_real_t clip(bslam_real_t x, bslam_real_t low, bslam_real_t high)
{
    return x < low ? low : x > high ? high : x;
}

/// Log density of beacons that are not in the map, in the units of a sighting: 1/(m rad), or 1/rad.
static bslam_real_t log_new(const bslam_settings_t *settings, const bslam_sighting_t *sighting)
{
    return bslam_ln(sighting->has_range ? settings->new_per_m2 * sighting->range_m : settings->new_per_rad);
}

/// Log density, in 1/m, of a distance that says nothing because the thing is taken for another kind: between
/// a third and three times of what it is.
static bslam_real_t log_lost(const bslam_sighting_t *taken, const bslam_sighting_t *sighting)
{
    return sighting->has_range && !taken->has_range ? -bslam_ln(LN_NINE * sighting->range_m) : 0;
}

/// What appearance adds to the score.
static bslam_real_t appearance_score(const bslam_settings_t *settings, const bslam_opinion_t *opinion)
{
    const bslam_real_t odds =
        settings->appearance_slope * (bslam_real_t)opinion->value + settings->appearance_offset;
    return settings->appearance_weight * (bslam_real_t)opinion->weight *
           clip(odds, -settings->appearance_low, settings->appearance_high);
}

/// What the detector's class adds to the score.
static bslam_real_t class_odds(const bslam_sighting_frame_t *frame, const bslam_sighting_t *sighting,
                               int beacon)
{
    return frame->appearance == NULL ? 0
                                     : bslam_appearance_class_odds(frame->appearance, frame->settings, beacon,
                                                                   sighting->beacon_class);
}

/// What the viewpoint adds to the score, where it is known.
static bslam_real_t viewpoint_odds(const bslam_sighting_frame_t *frame, int beacon)
{
    if (frame->appearance == NULL || !bslam_has_viewpoint(&frame->ekf->beacons[beacon])) {
        return 0;
    }
    const bslam_viewpoint_t viewpoint = bslam_viewpoint_of(frame->ekf, beacon);
    return viewpoint.is_sure
               ? bslam_appearance_viewpoint_odds(frame->appearance, frame->settings, beacon, viewpoint.sector)
               : 0;
}

static int64_t seen_ago_us(const bslam_sighting_frame_t *frame, int beacon)
{
    return frame->time_us - frame->ekf->beacons[beacon].last_seen_us;
}

/// Whether a beacon does not count, and was not seen for a while.
static bool is_old(const bslam_sighting_frame_t *frame, int beacon)
{
    return !frame->ekf->beacons[beacon].confirmed &&
           seen_ago_us(frame, beacon) > frame->settings->decision_delay_us;
}

/// The best score without again_odds since a beacon came into view, where its next one is this.
static bslam_real_t view_score(const bslam_sighting_frame_t *frame, int beacon, bslam_real_t score)
{
    const bool is_in_view =
        frame->appearance != NULL && seen_ago_us(frame, beacon) <= frame->settings->decision_delay_us;
    return is_in_view && frame->appearance->of[beacon].view_score > score
               ? frame->appearance->of[beacon].view_score
               : score;
}

/// What was in view a moment ago is in view: its sighting is this one or was missed. Whether it was in view
/// at all is no surer than the best that spoke for it.
static bslam_real_t again_odds(const bslam_sighting_frame_t *frame, const bslam_sighting_t *sighting,
                               int beacon)
{
    const int64_t ago_us = seen_ago_us(frame, beacon);
    const bool is_just = ago_us > 0 && ago_us <= frame->settings->again_us;
    if (!is_just || bslam_ekf_classes_differ(&frame->ekf->beacons[beacon], sighting)) {
        return 0;
    }
    const bslam_real_t odds = frame->settings->again_odds;
    return frame->appearance == NULL ? odds
                                     : clip(VIEW_WORTH * frame->appearance->of[beacon].view_score, 0, odds);
}

/// Whether a sighting is called something else than a beacon, and that says enough. The map hardly knows
/// where an old unconfirmed one stands, and its classifier knows little: what has a place and another class
/// is another.
static bool is_another_kind(const bslam_sighting_frame_t *frame, const bslam_sighting_t *sighting, int beacon)
{
    const bslam_beacon_t *other = &frame->ekf->beacons[beacon];
    return bslam_ekf_classes_differ(other, sighting) &&
           (frame->appearance == NULL || (sighting->has_range && is_old(frame, beacon)));
}

/// Weighs a sighting against a beacon, conditional on the matches so far. False if it cannot be that one.
static bool weigh(const bslam_sighting_frame_t *frame, bslam_conditional_t *conditional, int i, int beacon,
                  const bslam_sample_t *sample, candidate_t *found)
{
    const bslam_sighting_t *sighting = &frame->sightings[i];
    const bslam_beacon_t *other = &frame->ekf->beacons[beacon];
    const bslam_sighting_t taken = bslam_ekf_taken_as(other, sighting);
    bslam_innovation_t innovation;
    bslam_weight_t weight;
    if (is_another_kind(frame, sighting, beacon) ||
        bslam_ekf_innovation(frame->ekf, frame->settings, frame->mount, &taken, beacon, &innovation) !=
            BSLAM_OK ||
        bslam_conditional_weigh(frame->ekf, conditional, &innovation, &weight) != BSLAM_OK) {
        return false;
    }
    found->distance2 = weight.distance2;
    found->opinion = (bslam_opinion_t){0.0f, 0.0f};
    if (sample != NULL) {
        found->opinion = bslam_appearance_ask(frame->appearance, frame->settings, beacon, sample);
    }
    found->score = weight.log_density + log_lost(&taken, sighting) - log_new(frame->settings, sighting) +
                   appearance_score(frame->settings, &found->opinion) + class_odds(frame, sighting, beacon);
    if (weight.distance2 <= frame->settings->candidate_d2) {  // beyond, nobody asks the score
        found->score += viewpoint_odds(frame, beacon);
    }
    found->view_score = view_score(frame, beacon, found->score);
    found->score += again_odds(frame, sighting, beacon);
    return true;
}

static bool is_taken(const bslam_sighting_frame_t *frame, const bslam_record_t *records, int beacon)
{
    for (int i = 0; i < frame->count; i++) {
        if (records[i].match.verdict == BSLAM_VERDICT_MATCH && records[i].match.beacon == beacon) {
            return true;
        }
    }
    return false;
}

/// The sample of a sighting, where there is an appearance to compare it with; else NULL.
static const bslam_sample_t *sample_of(const bslam_sighting_frame_t *frame, int i, bslam_sample_t *sample)
{
    const float *signature = frame->sightings[i].signature;
    if (frame->appearance == NULL || signature == NULL ||
        bslam_sample_encode(signature, sample) != BSLAM_OK) {
        return NULL;
    }
    return sample;
}

/// Whether a classifier may learn from a match: it is near, unrivalled, and alike where that is known.
static bool is_sure(const bslam_settings_t *settings, const candidate_t *best, bslam_real_t lead)
{
    const bool is_alike =
        best->opinion.weight < 0.5f || (bslam_real_t)best->opinion.value >= settings->learn_margin;
    return best->distance2 <= settings->learn_d2 && lead >= settings->learn_lead && is_alike;
}

/// Whether a classifier of few samples is against a match. It may be another beacon that stands near, which
/// shows once both are in view; or the classifier does not know this viewpoint yet.
static bool is_doubted(const bslam_sighting_frame_t *frame, const candidate_t *best)
{
    return best->opinion.weight < 0.5f && best->score < frame->settings->learn_lead &&
           appearance_score(frame->settings, &best->opinion) < 0;
}

/// Whether a match that little speaks for can be delayed: another beacon in view holds the robot in its
/// place.
static bool can_be_delayed(const bslam_sighting_frame_t *frame, int beacon, const candidate_t *best)
{
    return frame->appearance != NULL && best->score < frame->settings->decision_delay_score &&
           bslam_is_placed(frame->ekf, frame->settings->again_us, beacon, frame->time_us);
}

/// Whether a match is delayed. Not one with a beacon in view: that it was seen just now says more.
static bool is_delayed(const bslam_sighting_frame_t *frame, int beacon, const candidate_t *best)
{
    return best->score > 0 && seen_ago_us(frame, beacon) > frame->settings->decision_delay_us &&
           (is_doubted(frame, best) || can_be_delayed(frame, beacon, best)) &&
           !bslam_appearance_is_due(frame->appearance, frame->settings, beacon, frame->time_us);
}

/// Finds the best beacon of a sighting among those that are not taken.
static void find_best(const bslam_sighting_frame_t *frame, bslam_conditional_t *conditional, int i,
                      bslam_record_t *records)
{
    bslam_match_t *match = &records[i].match;
    bslam_sample_t buffer;
    const bslam_sample_t *sample = sample_of(frame, i, &buffer);
    candidate_t best = {.distance2 = -1};
    bslam_real_t second = 0;
    bool has_second = false;
    match->beacon = -1;
    for (int b = 0; b < frame->ekf->beacon_count; b++) {
        candidate_t one;
        if (!weigh(frame, conditional, i, b, sample, &one) || one.distance2 > frame->settings->candidate_d2) {
            continue;
        }
        if (is_taken(frame, records, b)) {
            match->reason = one.score > 0 ? BSLAM_REASON_DUPLICATE : match->reason;
        } else if (match->beacon < 0 || one.score > best.score) {
            second = best.score;
            has_second = match->beacon >= 0;
            best = one;
            match->beacon = b;
        } else if (!has_second || one.score > second) {
            second = one.score;
            has_second = true;
        }
    }
    match->distance2 = best.distance2;
    match->score = best.score;
    match->view_score = best.view_score;
    // Another beacon, or a new one, whose score is 0.
    match->lead = best.score - (has_second && second > 0 ? second : 0);
    match->sure = match->beacon >= 0 && is_sure(frame->settings, &best, match->lead);
    match->delayed_for = match->beacon >= 0 && is_delayed(frame, match->beacon, &best) ? match->beacon : -1;
}

static bool is_open(const bslam_match_t *match)
{
    return match->verdict == BSLAM_VERDICT_DEFER && match->reason != BSLAM_REASON_AMBIGUOUS;
}

/// The open sighting whose choice is the clearest; -1: none has a score above 0, or it is delayed.
static int next_to_settle(const bslam_record_t *records, int count)
{
    int next = -1;
    for (int i = 0; i < count; i++) {
        const bool fits =
            is_open(&records[i].match) && records[i].match.score > 0 && records[i].match.delayed_for < 0;
        if (fits && (next < 0 || records[i].match.lead > records[next].match.lead)) {
            next = i;
        }
    }
    return next;
}

/// The other matches are conditional on this one from now on.
static void condition_on(const bslam_sighting_frame_t *frame, bslam_conditional_t *conditional, int i,
                         const bslam_match_t *match)
{
    const bslam_sighting_t taken =
        bslam_ekf_taken_as(&frame->ekf->beacons[match->beacon], &frame->sightings[i]);
    bslam_innovation_t innovation;
    if (bslam_ekf_innovation(frame->ekf, frame->settings, frame->mount, &taken, match->beacon, &innovation) ==
        BSLAM_OK) {
        (void)bslam_conditional_add(frame->ekf, conditional, &innovation);
    }
}

static void leave_open(bslam_match_t *match)
{
    match->reason = BSLAM_REASON_AMBIGUOUS;
    match->beacon = -1;
    match->sure = false;
}

/// Where another sighting wants the same beacon, and about as much, neither gets it. True if so.
static bool is_contested(const bslam_sighting_frame_t *frame, bslam_record_t *records, int next)
{
    bool contested = false;
    for (int i = 0; i < frame->count; i++) {
        if (i != next && is_open(&records[i].match) &&
            records[i].match.beacon == records[next].match.beacon &&
            records[i].match.score > records[next].match.score - frame->settings->competitor_lead) {
            leave_open(&records[i].match);
            contested = true;
        }
    }
    if (contested) {
        leave_open(&records[next].match);
    }
    return contested;
}

/// Gives each beacon to one sighting at most, the clearest choice first. A choice that is not clear yet is
/// made anew, conditional on the matches so far.
static void settle(const bslam_sighting_frame_t *frame, bslam_conditional_t *conditional,
                   bslam_record_t *records)
{
    for (int next = next_to_settle(records, frame->count); next >= 0;
         next = next_to_settle(records, frame->count)) {
        if (is_contested(frame, records, next)) {
            continue;
        }
        records[next].match.verdict = BSLAM_VERDICT_MATCH;
        condition_on(frame, conditional, next, &records[next].match);
        for (int i = 0; i < frame->count; i++) {
            const bool is_clear = records[i].match.lead >= frame->settings->learn_lead;
            if (is_open(&records[i].match) &&
                (!is_clear || records[i].match.beacon == records[next].match.beacon)) {
                find_best(frame, conditional, i, records);
            }
        }
    }
}

/// A beacon that a sighting clearly resembles, that is not seen in this frame and could be here, though it is
/// no candidate; -1: none. Then the map has it in the wrong place, rather than that there is a new one: for a
/// while, if the robot is right. What is still elsewhere then is another.
static int resembles_another(const bslam_sighting_frame_t *frame, bslam_conditional_t *conditional, int i,
                             const bslam_record_t *records)
{
    bslam_sample_t buffer;
    const bslam_sample_t *sample = sample_of(frame, i, &buffer);
    for (int b = 0; sample != NULL && b < frame->ekf->beacon_count; b++) {
        candidate_t one;
        if (!is_taken(frame, records, b) && weigh(frame, conditional, i, b, sample, &one) &&
            one.distance2 <= frame->settings->far_d2 && one.opinion.weight >= 0.5f &&
            class_odds(frame, &frame->sightings[i], b) >= 0 &&
            appearance_score(frame->settings, &one.opinion) >= 0.5f * frame->settings->appearance_high &&
            !(bslam_is_placed(frame->ekf, frame->settings->decision_delay_us, b, frame->time_us) &&
              bslam_appearance_is_due(frame->appearance, frame->settings, b, frame->time_us))) {
            return b;
        }
    }
    return -1;
}

/// Whether a sighting is too near to the beacon that fits it best to be new. Of one seen a few times long ago
/// the map hardly knows where it stands: what has a distance, and so a place, is new there if that is
/// likelier.
static bool is_near(const bslam_sighting_frame_t *frame, const bslam_sighting_t *sighting,
                    const bslam_match_t *match)
{
    if (match->beacon < 0) {
        return false;
    }
    const bool may_be_new = sighting->has_range && is_old(frame, match->beacon);
    return match->score > (may_be_new ? 0 : -frame->settings->defer_score);
}

/// What becomes of a sighting that matches no beacon.
static void decide_rest(const bslam_sighting_frame_t *frame, bslam_conditional_t *conditional, int i,
                        bslam_record_t *records)
{
    bslam_match_t *match = &records[i].match;
    const bool is_duplicate = match->reason == BSLAM_REASON_DUPLICATE;
    const bool waits = is_near(frame, &frame->sightings[i], match);
    leave_open(match);
    if (is_duplicate) {
        match->verdict = BSLAM_VERDICT_REJECT;
        match->reason = BSLAM_REASON_DUPLICATE;
    } else if (!waits) {
        match->delayed_for = resembles_another(frame, conditional, i, records);
        match->verdict = match->delayed_for < 0 ? BSLAM_VERDICT_NEW : BSLAM_VERDICT_DEFER;
        match->reason = match->delayed_for < 0 ? BSLAM_REASON_NONE : BSLAM_REASON_APPEARANCE;
    }
}

void bslam_associate_svm(const bslam_sighting_frame_t *frame, bslam_record_t *records)
{
    bslam_conditional_t conditional;
    bslam_conditional_init(&conditional);
    for (int i = 0; i < frame->count; i++) {
        if (bslam_is_mappable(&frame->sightings[i], &records[i].match)) {
            records[i].match.verdict = BSLAM_VERDICT_DEFER;
        }
    }
    for (int i = 0; i < frame->count; i++) {
        if (is_open(&records[i].match)) {
            find_best(frame, &conditional, i, records);
        }
    }
    settle(frame, &conditional, records);
    for (int i = 0; i < frame->count; i++) {
        if (is_open(&records[i].match)) {
            decide_rest(frame, &conditional, i, records);
        } else if (records[i].match.verdict == BSLAM_VERDICT_MATCH) {
            records[i].match.reason = BSLAM_REASON_NONE;
        }
    }
}
