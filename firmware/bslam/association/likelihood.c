// One likelihood: how far from its place a beacon is seen, and what it looks like. MATH "Which beacon is it".
#include "base/logarithm.h"
#include "bslam/association/association.h"
#include "bslam/association/association_internal.h"
#include "bslam/association/conditional.h"

static const bslam_real_t LN_NINE = BSLAM_R(2.197224577);
// What was seen in the frame before is missed in this one 15 times in 1000.
static const bslam_real_t AGAIN_ODDS = BSLAM_R(4.2);
enum { AGAIN_US = 200000 };
// A choice that leads by this much stays, whatever else the frame shows.
static const bslam_real_t CLEAR_LEAD = 4;
// What a slip of the wheels does, which the filter knows nothing of: to the robot's place and its heading.
static const bslam_real_t SLIP_VAR_M2 = 1, SLIP_VAR_RAD2 = BSLAM_R(0.25);
// A classifier learns from no match that is farther off: it may be another's.
static const bslam_real_t SURE_D2 = 9;

/// A sighting against a beacon.
typedef struct candidate {
    bslam_real_t score;  ///< log odds of this beacon against one that is not in the map
    bslam_real_t distance2, log_density, looks;
    bool slipped;
} candidate_t;

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

static int64_t seen_ago_us(const bslam_sighting_frame_t *frame, int beacon)
{
    return frame->time_us - frame->ekf->beacons[beacon].last_seen_us;
}

/// What was in view a moment ago is in view: its sighting is this one or was missed.
static bslam_real_t again_odds(const bslam_sighting_frame_t *frame, const bslam_sighting_t *sighting,
                               int beacon)
{
    const int64_t ago_us = seen_ago_us(frame, beacon);
    const bool is_just = ago_us > 0 && ago_us <= AGAIN_US;
    return is_just && !bslam_ekf_classes_differ(&frame->ekf->beacons[beacon], sighting) ? AGAIN_ODDS : 0;
}

/// What its looks say for a beacon: the sample, where there is one, and the detector's class.
static bslam_real_t looks_of(const bslam_sighting_frame_t *frame, const bslam_sighting_t *sighting,
                             int beacon, const bslam_sample_t *sample)
{
    if (frame->appearance == NULL) {
        return 0;
    }
    const bslam_real_t odds =
        sample == NULL ? 0 : bslam_appearance_odds(frame->appearance, frame->settings, beacon, sample);
    return odds + bslam_appearance_class_odds(frame->appearance, beacon, sighting->beacon_class);
}

/// Whether a hypothesis may not take a sighting for a beacon; CHOICE_NEW: for a new one.
static bool is_barred(const bslam_sighting_frame_t *frame, int i, int beacon)
{
    const bslam_bar_t *bar = frame->bar;
    bool barred = false;
    for (int k = 0; bar != NULL && bar->sighting == i && k < bar->count; k++) {
        barred = barred || bar->choices[k] == beacon;
    }
    return barred;
}

/// The robot may be elsewhere by what a slip does.
static void doubt_place(const bslam_sighting_t *sighting, const bslam_settings_t *settings,
                        bslam_innovation_t *innovation)
{
    const bslam_real_t per_m =
        sighting->has_range ? 1 / sighting->range_m : settings->ray_inverse_distance_per_m;
    innovation->range_var_m2 += SLIP_VAR_M2;
    innovation->bearing_var_rad2 += SLIP_VAR_RAD2 + SLIP_VAR_M2 * per_m * per_m;
}

/// Weighs a sighting against a beacon, conditional on the matches so far. False if it is no candidate.
static bool weigh(const bslam_sighting_frame_t *frame, bslam_conditional_t *conditional, int i, int beacon,
                  const bslam_sample_t *sample, bool may_slip, candidate_t *found)
{
    const bslam_sighting_t *sighting = &frame->sightings[i];
    const bslam_beacon_t *other = &frame->ekf->beacons[beacon];
    const bslam_sighting_t taken = bslam_ekf_taken_as(other, sighting);
    bslam_innovation_t innovation;
    bslam_weight_t weight;
    const bool is_another = frame->appearance == NULL && bslam_ekf_classes_differ(other, sighting);
    if (is_another || is_barred(frame, i, beacon) ||
        bslam_ekf_innovation(frame->ekf, frame->settings, frame->mount, &taken, beacon, &innovation) !=
            BSLAM_OK) {
        return false;
    }
    if (bslam_conditional_weigh(frame->ekf, conditional, &innovation, &weight) != BSLAM_OK) {
        return false;
    }
    found->distance2 = weight.distance2;
    found->slipped = false;
    if (may_slip && other->confirmed && weight.distance2 > frame->settings->candidate_d2) {
        doubt_place(&taken, frame->settings, &innovation);
        found->slipped = bslam_conditional_weigh(frame->ekf, conditional, &innovation, &weight) == BSLAM_OK;
    }
    if (weight.distance2 > frame->settings->candidate_d2) {
        return false;
    }
    found->log_density = weight.log_density + log_lost(&taken, sighting);
    found->looks = looks_of(frame, sighting, beacon, sample);
    found->score = found->log_density - log_new(frame->settings, sighting) + found->looks +
                   again_odds(frame, sighting, beacon) - (found->slipped ? BSLAM_SLIP_NATS : 0);
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

static void choose(bslam_match_t *match, int beacon, const candidate_t *best)
{
    match->beacon = beacon;
    match->distance2 = best->distance2;
    match->log_density = best->log_density;
    match->looks = best->looks;
    match->slipped = best->slipped;
    match->score = best->score;
}

/// Finds the best beacon of a sighting among those that are not taken, and by how much it leads.
static void find_best(const bslam_sighting_frame_t *frame, bslam_conditional_t *conditional, int i,
                      bool may_slip, bslam_record_t *records)
{
    bslam_match_t *match = &records[i].match;
    bslam_sample_t buffer;
    const bslam_sample_t *sample = sample_of(frame, i, &buffer);
    bslam_real_t second = NO_SCORE;
    match->beacon = -1;
    match->score = NO_SCORE;
    for (int b = 0; b < frame->ekf->beacon_count; b++) {
        candidate_t one;
        if (is_taken(frame, records, b) || !weigh(frame, conditional, i, b, sample, may_slip, &one)) {
            continue;
        }
        if (one.score > match->score) {
            second = match->score;
            choose(match, b, &one);
        } else if (one.score > second) {
            second = one.score;
        }
    }
    // Against a new one, whose score is 0, too.
    const bool may_be_new = !is_barred(frame, i, BSLAM_CHOICE_NEW);
    const bslam_real_t rival = may_be_new && second < 0 ? 0 : second;
    match->lead = match->score - rival;
    match->is_match = match->beacon >= 0 && (match->score > 0 || !may_be_new);
}

static bool is_open(const bslam_match_t *match)
{
    return match->verdict == BSLAM_VERDICT_DEFER;
}

/// The open sighting whose choice is the clearest; -1: none matches.
static int next_to_settle(const bslam_record_t *records, int count)
{
    int next = -1;
    for (int i = 0; i < count; i++) {
        const bslam_match_t *match = &records[i].match;
        if (is_open(match) && match->is_match && (next < 0 || match->lead > records[next].match.lead)) {
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

/// Gives each beacon to one sighting at most, the clearest choice first. A choice that is not clear yet is
/// made anew, conditional on the matches so far.
static void settle(const bslam_sighting_frame_t *frame, bslam_conditional_t *conditional, bool may_slip,
                   bslam_record_t *records)
{
    for (int next = next_to_settle(records, frame->count); next >= 0;
         next = next_to_settle(records, frame->count)) {
        bslam_match_t *match = &records[next].match;
        match->verdict = BSLAM_VERDICT_MATCH;
        match->sure = match->distance2 <= SURE_D2 && match->lead >= CLEAR_LEAD && !match->slipped;
        condition_on(frame, conditional, next, match);
        for (int i = 0; i < frame->count; i++) {
            const bool is_clear = records[i].match.lead >= CLEAR_LEAD && !frame->is_exact;
            if (is_open(&records[i].match) && (!is_clear || records[i].match.beacon == match->beacon)) {
                find_best(frame, conditional, i, may_slip, records);
            }
        }
    }
}

/// Matches what is open, as far as there are beacons for it.
static void match_open(const bslam_sighting_frame_t *frame, bslam_conditional_t *conditional, bool may_slip,
                       bslam_record_t *records)
{
    for (int i = 0; i < frame->count; i++) {
        if (is_open(&records[i].match)) {
            find_best(frame, conditional, i, may_slip, records);
        }
    }
    settle(frame, conditional, may_slip, records);
}

/// Whether a match with a beacon that counts says that the robot is where the filter has it.
static bool is_held(const bslam_sighting_frame_t *frame, const bslam_record_t *records)
{
    for (int i = 0; i < frame->count; i++) {
        if (records[i].match.verdict == BSLAM_VERDICT_MATCH && records[i].match.distance2 <= SURE_D2 &&
            frame->ekf->beacons[records[i].match.beacon].confirmed) {
            return true;
        }
    }
    return false;
}

/// A sighting that matches no beacon is of a new one: two of a frame are two things.
static void take_for_new(const bslam_sighting_frame_t *frame, int i, bslam_match_t *match)
{
    match->verdict = BSLAM_VERDICT_NEW;
    match->lead = -match->score;
    match->log_density = log_new(frame->settings, &frame->sightings[i]);
    match->looks = 0;
    match->beacon = -1;
}

void bslam_associate_likely(const bslam_sighting_frame_t *frame, bslam_record_t *records)
{
    bslam_conditional_t conditional;
    bslam_conditional_init(&conditional);
    for (int i = 0; i < frame->count; i++) {
        if (bslam_is_mappable(&frame->sightings[i], &records[i].match)) {
            records[i].match.verdict = BSLAM_VERDICT_DEFER;
        }
    }
    match_open(frame, &conditional, false, records);
    if (frame->appearance != NULL && !is_held(frame, records)) {
        match_open(frame, &conditional, true, records);
    }
    for (int i = 0; i < frame->count; i++) {
        if (is_open(&records[i].match)) {
            take_for_new(frame, i, &records[i].match);
        }
    }
}
