#include "bslam/appearance/appearance.h"

#include "base/bounds.h"
#include "base/logarithm.h"

#include <string.h>

static const bslam_beacon_appearance_t BLANK = {.classifier = BSLAM_NO_CLASSIFIER,
                                                .twin = BSLAM_NO_CLASSIFIER};
static const uint32_t MICROMETRES_PER_M = 1000000;

enum { SEEN_AS_MAX = 32 };
enum { SECTORS = BSLAM_APPEARANCE_SECTORS };
// Turned by one sector a beacon looks and stands as before; by four, a right angle, a wall's is out of sight.
enum { NEAR_SECTORS = 1, FAR_SECTORS = 4 };
// A beacon that was seen from one sector alone was seen in passing: whoever stands beside it was not noticed.
enum { KNOWN_SECTORS = 2 };

bslam_status_t bslam_appearance_init(bslam_appearance_t *appearance, const bslam_sample_t *seeds,
                                     int32_t seed_count)
{
    const bslam_status_t status = bslam_learner_init(&appearance->learner, seeds, seed_count);
    if (status == BSLAM_OK) {
        appearance->counters = (bslam_appearance_counters_t){0};
        appearance->left_rad = 0;
        appearance->right_rad = 0;
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

/// Takes a beacon's classifier away, and out of the learner if no other beacon has it.
static void release(bslam_appearance_t *appearance, int index, int count)
{
    const int16_t classifier = appearance->of[index].classifier;
    if (classifier == BSLAM_NO_CLASSIFIER) {
        return;
    }
    appearance->of[index].classifier = BSLAM_NO_CLASSIFIER;
    if (!has_other_owner(appearance, index, count, classifier) &&
        bslam_learner_remove(&appearance->learner, classifier) == BSLAM_OK) {
        for (int b = 0; b < count; b++) {
            if (appearance->of[b].twin == classifier) {
                appearance->of[b].twin = BSLAM_NO_CLASSIFIER;
                appearance->of[b].twin_count = 0;
            }
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

static bslam_opinion_t opinion_of(const bslam_appearance_t *appearance, const bslam_settings_t *settings,
                                  int32_t classifier, const bslam_sample_t *sample)
{
    bslam_opinion_t opinion = {0.0f, 0.0f};
    if (classifier != BSLAM_NO_CLASSIFIER && bslam_learner_knows(&appearance->learner, classifier)) {
        const float samples = (float)bslam_learner_samples(&appearance->learner, classifier);
        opinion.value = bslam_sample_decide(&appearance->learner.classifiers[classifier].weights, sample);
        opinion.weight = samples / (samples + (float)settings->appearance_samples);
    }
    return opinion;
}

bslam_opinion_t bslam_appearance_ask(const bslam_appearance_t *appearance, const bslam_settings_t *settings,
                                     int index, const bslam_sample_t *sample)
{
    const int16_t classifier = appearance->of[index].classifier;
    return opinion_of(appearance, settings, classifier, sample);
}

// ---- classes ----------------------------------------------------------------------------------------------

static bool is_evidence(uint8_t beacon_class)
{
    return beacon_class >= 1 && beacon_class <= BSLAM_APPEARANCE_CLASSES;
}

bslam_real_t bslam_appearance_class_odds(const bslam_appearance_t *appearance,
                                         const bslam_settings_t *settings, int index, uint8_t beacon_class)
{
    if (!is_evidence(beacon_class)) {
        return 0;
    }
    const uint8_t *seen_as = appearance->of[index].seen_as;
    int all = 0;
    for (int k = 0; k < BSLAM_APPEARANCE_CLASSES; k++) {
        all += seen_as[k];
    }
    const bslam_real_t doubt = settings->class_doubt;
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

// ---- viewpoints -------------------------------------------------------------------------------------------

/// How many sectors lie from one to the other, the shorter way round.
static int sectors_between(int one, int other)
{
    const int apart = one > other ? one - other : other - one;
    return apart < SECTORS - apart ? apart : SECTORS - apart;
}

bslam_real_t bslam_appearance_viewpoint_odds(const bslam_appearance_t *appearance,
                                             const bslam_settings_t *settings, int index, int sector)
{
    int known = 0, nearest = SECTORS;
    for (int k = 0; k < SECTORS; k++) {
        if (appearance->of[index].seen_from[k] > 0) {
            const int apart = sectors_between(k, sector);
            known++;
            nearest = apart < nearest ? apart : nearest;
        }
    }
    if (known == 0 || (nearest > 0 && nearest <= NEAR_SECTORS)) {
        return 0;
    }
    if (nearest == 0) {
        return known >= KNOWN_SECTORS ? settings->viewpoint_high : 0;
    }
    const int far = nearest < FAR_SECTORS ? nearest : FAR_SECTORS;
    return -settings->viewpoint_low * (bslam_real_t)(far - NEAR_SECTORS) / (FAR_SECTORS - NEAR_SECTORS);
}

// ---- delayed decisions ------------------------------------------------------------------------------------

/// How long matches with a beacon have waited; 0 if not, or if none did within the last decision_delay_us.
static uint32_t delayed_us(const bslam_beacon_appearance_t *known, const bslam_settings_t *settings,
                           int64_t time_us)
{
    const uint32_t pause_us = (uint32_t)time_us - known->last_delay_us;
    return known->delayed_us == 0 || pause_us > (uint32_t)settings->decision_delay_us
               ? 0
               : known->delayed_us + pause_us;
}

void bslam_appearance_note_delay(bslam_appearance_t *appearance, const bslam_settings_t *settings, int index,
                                 int64_t time_us)
{
    bslam_beacon_appearance_t *known = &appearance->of[index];
    const uint32_t so_far_us = delayed_us(known, settings, time_us);
    known->delayed_us = so_far_us > 0 ? so_far_us : 1;  // 0 says that none waits
    known->last_delay_us = (uint32_t)time_us;
}

bool bslam_appearance_is_due(const bslam_appearance_t *appearance, const bslam_settings_t *settings,
                             int index, int64_t time_us)
{
    return delayed_us(&appearance->of[index], settings, time_us) >= (uint32_t)settings->decision_delay_us;
}

// ---- learning ---------------------------------------------------------------------------------------------

/// Another classifier than `own` that takes a sample for its own, the surest; BSLAM_NO_CLASSIFIER if none
/// does.
static int16_t find_twin(const bslam_appearance_t *appearance, const bslam_settings_t *settings, int16_t own,
                         const bslam_sample_t *sample, float at_least)
{
    int16_t best = BSLAM_NO_CLASSIFIER;
    for (int16_t m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        if (m == own) {
            continue;
        }
        const bslam_opinion_t opinion = opinion_of(appearance, settings, m, sample);
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
static bool has_twin(const bslam_appearance_t *appearance, const bslam_settings_t *settings,
                     bslam_beacon_appearance_t *known, const bslam_sample_t *sample)
{
    const bslam_opinion_t own = opinion_of(appearance, settings, known->classifier, sample);
    const float least = (float)settings->share_value;
    const float at_least = own.weight > 0.0f && own.value > least ? own.value : least;
    const int16_t twin = find_twin(appearance, settings, known->classifier, sample, at_least);
    if (twin != BSLAM_NO_CLASSIFIER && twin != known->twin && known->twin_count == 0) {
        known->twin = twin;
    }
    const bool again = twin != BSLAM_NO_CLASSIFIER && twin == known->twin;
    return persists(&known->twin_count, again, settings->share_sightings);
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
static bool settle_classifier(bslam_appearance_t *appearance, const bslam_settings_t *settings, int index,
                              int count, const bslam_sample_t *sample)
{
    bslam_beacon_appearance_t *known = &appearance->of[index];
    const bool is_shared = known->classifier != BSLAM_NO_CLASSIFIER &&
                           has_other_owner(appearance, index, count, known->classifier);
    if (is_shared) {
        const bslam_opinion_t own = opinion_of(appearance, settings, known->classifier, sample);
        const bool refused = own.weight > 0.0f && own.value < 0.0f;
        if (persists(&known->disowned, refused, settings->share_sightings)) {
            known->disowned = 0;
            release(appearance, index, count);
            give_classifier(appearance, known);
            appearance->counters.parted++;
        }
        return known->classifier != BSLAM_NO_CLASSIFIER;
    }
    if (has_twin(appearance, settings, known, sample)) {
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

void bslam_appearance_train(bslam_appearance_t *appearance, const bslam_settings_t *settings, int index,
                            int count, uint32_t travelled_um, const bslam_sighting_t *sighting)
{
    bslam_beacon_appearance_t *known = &appearance->of[index];
    const uint32_t least_um = (uint32_t)(settings->learn_travel_m * (bslam_real_t)MICROMETRES_PER_M);
    bslam_sample_t sample;
    if (known->is_trained && travelled_um - known->trained_um < least_um) {
        return;
    }
    known->is_trained = true;
    known->trained_um = travelled_um;
    note_class(known, sighting->beacon_class);
    if (sighting->signature != NULL && bslam_sample_encode(sighting->signature, &sample) == BSLAM_OK &&
        settle_classifier(appearance, settings, index, count, &sample) &&
        bslam_learner_show(&appearance->learner, known->classifier, sighting->signature) == BSLAM_OK) {
        appearance->counters.trained++;
    }
}
