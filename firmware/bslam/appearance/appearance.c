#include "bslam/appearance/appearance.h"

#include "base/bounds.h"
#include "base/logarithm.h"
#include "base/scalar.h"
#include "bslam/appearance/calibration.h"

#include <string.h>

static const bslam_beacon_appearance_t BLANK = {.classifier = BSLAM_NO_CLASSIFIER,
                                                .twin = BSLAM_NO_CLASSIFIER};
// A classifier learns once the robot has gone so far: what is seen from one place looks the same.
static const uint32_t LEARN_TRAVEL_UM = 100000;
// A beacon counts as seen so often as each class from the start.
static const bslam_real_t CLASS_DOUBT = BSLAM_R(0.1);
// A decision value above which a beacon resembles another one, and how often it must before it shares that
// one's classifier, or refuse a shared one before it leaves it.
static const float SHARE_VALUE = 0.8f;
enum { SHARE_SIGHTINGS = 12 };

enum { SEEN_AS_MAX = 32 };
// A classifier's weight is a half when it keeps so many.
static const float HALF_WEIGHT_SAMPLES = 3.0f;
// Beyond it the fit of the coefficients has no examples.
static const bslam_real_t ODDS_MAX = 8;

bslam_status_t bslam_appearance_init(bslam_appearance_t *appearance, const bslam_sample_t *seeds,
                                     int32_t seed_count)
{
    const bslam_status_t status = bslam_learner_init(&appearance->learner, seeds, seed_count);
    if (status == BSLAM_OK) {
        appearance->counters = (bslam_appearance_counters_t){0};
        appearance->left_rad = 0;
        appearance->right_rad = 0;
        appearance->is_shared = false;
        for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
            appearance->of[b] = BLANK;
        }
    }
    return status;
}

/// True if a beacon other than `index` has this classifier.
static bool has_other_owner(const bslam_appearance_t *appearance, int index, int count, int16_t classifier)
{
    for (int b = 0; b < count; b++) {
        if (b != index && appearance->of[b].classifier == classifier) {
            return true;
        }
    }
    return false;
}

/// Takes a classifier that no beacon has out of the learner.
static void discard(bslam_appearance_t *appearance, int16_t classifier)
{
    if (bslam_learner_remove(&appearance->learner, classifier) != BSLAM_OK) {
        return;
    }
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        if (appearance->of[b].twin == classifier) {
            appearance->of[b].twin = BSLAM_NO_CLASSIFIER;
            appearance->of[b].twin_count = 0;
        }
    }
}

/// Takes a beacon's classifier away, and out of the learner if nothing else has it.
static void release(bslam_appearance_t *appearance, int index, int count)
{
    const int16_t classifier = appearance->of[index].classifier;
    appearance->of[index].classifier = BSLAM_NO_CLASSIFIER;
    if (classifier != BSLAM_NO_CLASSIFIER && !appearance->is_shared &&
        !has_other_owner(appearance, index, count, classifier)) {
        discard(appearance, classifier);
    }
}

void bslam_appearance_share(bslam_appearance_t *appearance, bool is_shared)
{
    appearance->is_shared = is_shared;
    for (int16_t m = 0; m < BSLAM_LEARNER_SLOTS && !is_shared; m++) {
        if (appearance->learner.classifiers[m].used &&
            !has_other_owner(appearance, -1, BSLAM_BEACONS_MAX, m)) {
            discard(appearance, m);
        }
    }
}

void bslam_appearance_clear(bslam_appearance_t *appearance)
{
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        release(appearance, b, BSLAM_BEACONS_MAX);
        appearance->of[b] = BLANK;
    }
}

void bslam_appearance_forget(bslam_appearance_t *appearance, int index, int count)
{
    release(appearance, index, count);
    for (int b = index; b < count - 1; b++) {
        appearance->of[b] = appearance->of[b + 1];
    }
    appearance->of[count - 1] = BLANK;
}

// ---- opinions ---------------------------------------------------------------------------------------------

static bslam_opinion_t opinion_of(const bslam_appearance_t *appearance, int32_t classifier,
                                  const bslam_sample_t *sample)
{
    bslam_opinion_t opinion = {0.0f, 0.0f};
    if (classifier != BSLAM_NO_CLASSIFIER && bslam_learner_knows(&appearance->learner, classifier)) {
        const float samples = (float)bslam_learner_samples(&appearance->learner, classifier);
        opinion.value = bslam_sample_decide(&appearance->learner.classifiers[classifier].weights, sample);
        opinion.weight = samples / (samples + HALF_WEIGHT_SAMPLES);
    }
    return opinion;
}

bslam_opinion_t bslam_appearance_ask(const bslam_appearance_t *appearance, int index,
                                     const bslam_sample_t *sample)
{
    const int16_t classifier = appearance->of[index].classifier;
    return opinion_of(appearance, classifier, sample);
}

/// How far a sample is from what a classifier keeps of its beacon, as its values are: from the nearest of
/// these, or from their middle.
static float distance_to_kept(const bslam_learner_t *learner, int32_t classifier, bool to_middle,
                              const bslam_sample_t *sample)
{
    const int32_t count = learner->classifiers[classifier].samples;
    const bslam_sample_t *kept = &learner->samples[classifier * BSLAM_SAMPLES_PER_CLASSIFIER];
    float distance2 = to_middle ? bslam_sample_middle_distance2(kept, count, sample)
                                : bslam_sample_distance2(&kept[0], sample);
    for (int32_t i = 1; i < count && !to_middle; i++) {
        const float next2 = bslam_sample_distance2(&kept[i], sample);
        distance2 = next2 < distance2 ? next2 : distance2;
    }
    return BSLAM_SAMPLE_UNIT * (float)bslam_sqrt((bslam_real_t)distance2);
}

bslam_real_t bslam_appearance_odds(const bslam_appearance_t *appearance, const bslam_settings_t *settings,
                                   int index, const bslam_sample_t *sample)
{
    const bslam_learner_t *learner = &appearance->learner;
    const int32_t classifier = appearance->of[index].classifier;
    if (classifier == BSLAM_NO_CLASSIFIER || !bslam_learner_knows(learner, classifier)) {
        return 0;
    }
    const bslam_calibration_t *by = bslam_calibration_of(settings->association);
    const bool looks_at_kept = by->distance != 0.0f;
    const float distance =
        looks_at_kept ? distance_to_kept(learner, classifier, by->to_middle, sample) : 0.0f;
    const float value = bslam_sample_decide(&learner->classifiers[classifier].weights, sample);
    const float more = (float)bslam_ln((bslam_real_t)bslam_learner_samples(learner, classifier));
    const bslam_real_t odds =
        (bslam_real_t)(by->offset + by->distance * distance + by->value * value +
                       more * (by->more + by->more_distance * distance + by->more_value * value));
    return odds < -ODDS_MAX ? -ODDS_MAX : odds > ODDS_MAX ? ODDS_MAX : odds;
}

// ---- classes ----------------------------------------------------------------------------------------------

static bool is_evidence(uint8_t beacon_class)
{
    return beacon_class >= 1 && beacon_class <= BSLAM_APPEARANCE_CLASSES;
}

bslam_real_t bslam_appearance_class_odds(const bslam_appearance_t *appearance, int index,
                                         uint8_t beacon_class)
{
    if (!is_evidence(beacon_class)) {
        return 0;
    }
    const uint8_t *seen_as = appearance->of[index].seen_as;
    int all = 0;
    for (int k = 0; k < BSLAM_APPEARANCE_CLASSES; k++) {
        all += seen_as[k];
    }
    const bslam_real_t doubt = CLASS_DOUBT;
    const bslam_real_t as_this = (bslam_real_t)seen_as[beacon_class - 1] + doubt;
    return bslam_ln(BSLAM_APPEARANCE_CLASSES * as_this /
                    ((bslam_real_t)all + BSLAM_APPEARANCE_CLASSES * doubt));
}

uint8_t bslam_appearance_class(const bslam_appearance_t *appearance, int index)
{
    const uint8_t *seen_as = appearance->of[index].seen_as;
    int most = 0;
    for (int k = 1; k < BSLAM_APPEARANCE_CLASSES; k++) {
        most = seen_as[k] > seen_as[most] ? k : most;
    }
    return seen_as[most] > 0 ? (uint8_t)(most + 1) : BSLAM_CLASS_NONE;
}

/// Counts; what was long ago counts less.
static void note_class(bslam_beacon_appearance_t *known, uint8_t beacon_class)
{
    if (!is_evidence(beacon_class)) {
        return;
    }
    if (known->seen_as[beacon_class - 1] >= SEEN_AS_MAX) {  // a loaded map may have more
        for (int k = 0; k < BSLAM_APPEARANCE_CLASSES; k++) {
            known->seen_as[k] /= 2;
        }
    }
    known->seen_as[beacon_class - 1]++;
}

// ---- learning ---------------------------------------------------------------------------------------------

/// Another classifier than `own` that takes a sample for its own, the surest; BSLAM_NO_CLASSIFIER if none
/// does.
static int16_t find_twin(const bslam_appearance_t *appearance, int16_t own, const bslam_sample_t *sample,
                         float at_least)
{
    int16_t best = BSLAM_NO_CLASSIFIER;
    for (int16_t m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        if (m == own) {
            continue;
        }
        const bslam_opinion_t opinion = opinion_of(appearance, m, sample);
        if (opinion.weight >= 0.5f && opinion.value > at_least) {
            best = m;
            at_least = opinion.value;
        }
    }
    return best;
}

/// Counts up to a limit while something holds, and down to 0 while it does not. True at the limit.
static bool persists(uint8_t *count, bool holds, int32_t limit)
{
    if (holds) {
        *count = (uint8_t)(*count + (*count < limit ? 1 : 0));
    } else {
        *count = (uint8_t)(*count - (*count > 0 ? 1 : 0));
    }
    return *count >= limit;
}

/// Whether another classifier takes this beacon for its own again and again, as surely as the beacon's
/// classifier does: then they look alike, and two classifiers would be trained to contradict each other.
static bool has_twin(const bslam_appearance_t *appearance, bslam_beacon_appearance_t *known,
                     const bslam_sample_t *sample)
{
    const bslam_opinion_t own = opinion_of(appearance, known->classifier, sample);
    const float least = SHARE_VALUE;
    const float at_least = own.weight > 0.0f && own.value > least ? own.value : least;
    const int16_t twin = find_twin(appearance, known->classifier, sample, at_least);
    if (twin != BSLAM_NO_CLASSIFIER && twin != known->twin && known->twin_count == 0) {
        known->twin = twin;
    }
    const bool again = twin != BSLAM_NO_CLASSIFIER && twin == known->twin;
    return persists(&known->twin_count, again, SHARE_SIGHTINGS);
}

/// A classifier of its own for a beacon, if there is one left.
static void give_classifier(bslam_appearance_t *appearance, bslam_beacon_appearance_t *known)
{
    int32_t classifier;
    if (bslam_learner_add(&appearance->learner, &classifier) == BSLAM_OK) {
        known->classifier = (int16_t)classifier;
    } else {
        appearance->counters.no_slot++;
    }
}

/// Decides which classifier a beacon has; false while that is open, when nothing is to be learned.
static bool settle_classifier(bslam_appearance_t *appearance, int index, int count,
                              const bslam_sample_t *sample)
{
    bslam_beacon_appearance_t *known = &appearance->of[index];
    const bool is_shared = known->classifier != BSLAM_NO_CLASSIFIER &&
                           has_other_owner(appearance, index, count, known->classifier);
    if (is_shared) {
        const bslam_opinion_t own = opinion_of(appearance, known->classifier, sample);
        const bool refused = own.weight > 0.0f && own.value < 0.0f;
        if (persists(&known->disowned, refused, SHARE_SIGHTINGS)) {
            known->disowned = 0;
            release(appearance, index, count);
            give_classifier(appearance, known);
            appearance->counters.parted++;
        }
        return known->classifier != BSLAM_NO_CLASSIFIER;
    }
    if (has_twin(appearance, known, sample)) {
        const int16_t twin = known->twin;
        known->twin = BSLAM_NO_CLASSIFIER;
        known->twin_count = 0;
        release(appearance, index, count);
        known->classifier = twin;
        appearance->counters.shared++;
    } else if (known->classifier == BSLAM_NO_CLASSIFIER && known->twin_count == 0) {
        give_classifier(appearance, known);
    }
    return known->classifier != BSLAM_NO_CLASSIFIER;
}

void bslam_appearance_train(bslam_appearance_t *appearance, int index, int count, uint32_t travelled_um,
                            const bslam_sighting_t *sighting)
{
    bslam_beacon_appearance_t *known = &appearance->of[index];
    bslam_sample_t sample;
    if (known->is_trained && travelled_um - known->trained_um < LEARN_TRAVEL_UM) {
        return;
    }
    known->is_trained = true;
    known->trained_um = travelled_um;
    note_class(known, sighting->beacon_class);
    if (sighting->signature != NULL && bslam_sample_encode(sighting->signature, &sample) == BSLAM_OK &&
        settle_classifier(appearance, index, count, &sample) &&
        bslam_learner_show(&appearance->learner, known->classifier, sighting->signature) == BSLAM_OK) {
        appearance->counters.trained++;
    }
}
