#include "bslam/recovery/identity.h"

// A classifier recognises what it puts this far above 0, and above what the next one says.
static const float RECOGNISE_WEIGHT = 0.8f;
static const float RECOGNISE_VALUE = 0.3f;
static const float RECOGNISE_LEAD = 0.5f;

enum { FINDABLE_MIN = 2 };

static int find_label(const bslam_ekf_t *ekf, int32_t label)
{
    for (int b = 0; b < ekf->beacon_count && label != BSLAM_LABEL_NONE; b++) {
        if (ekf->beacons[b].label == label && ekf->beacons[b].confirmed) {  // not one of its competitors
            return b;
        }
    }
    return BSLAM_NOBODY;
}

static bool share_classifier(const bslam_slam_t *slam, int a, int b)
{
    return slam->appearance->of[a].classifier == slam->appearance->of[b].classifier;
}

/// The first beacon of the classifier that takes a sample for its own, if no other one comes near.
static int find_classifier(const bslam_slam_t *slam, const bslam_sample_t *sample)
{
    int best = BSLAM_NOBODY;
    float best_value = RECOGNISE_VALUE;
    float next_value = RECOGNISE_VALUE - RECOGNISE_LEAD;
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        const bslam_opinion_t opinion = bslam_appearance_ask(slam->appearance, b, sample);
        if (opinion.weight < RECOGNISE_WEIGHT || (best >= 0 && share_classifier(slam, b, best))) {
            continue;
        }
        if (opinion.value > best_value) {
            next_value = best >= 0 ? best_value : next_value;
            best = b;
            best_value = opinion.value;
        } else if (opinion.value > next_value) {
            next_value = opinion.value;
        }
    }
    return best_value - next_value >= RECOGNISE_LEAD ? best : BSLAM_NOBODY;
}

static int find_by_appearance(const bslam_slam_t *slam, const float *signature)
{
    bslam_sample_t sample;
    if (!bslam_slam_learns(slam) || signature == NULL ||
        bslam_sample_encode(signature, &sample) != BSLAM_OK) {
        return BSLAM_NOBODY;
    }
    const int best = find_classifier(slam, &sample);
    for (int b = best; b >= 0 && b < slam->ekf.beacon_count; b++) {
        if (slam->ekf.beacons[b].confirmed && share_classifier(slam, b, best)) {
            return b;
        }
    }
    return BSLAM_NOBODY;
}

static int find(const bslam_slam_t *slam, const bslam_sighting_t *sighting)
{
    if (sighting->beacon_class == BSLAM_CLASS_NOT_MAPPABLE) {
        return BSLAM_NOBODY;
    }
    return slam->settings.association == BSLAM_ASSOCIATION_KNOWN
               ? find_label(&slam->ekf, sighting->label)
               : find_by_appearance(slam, sighting->signature);
}

static bool is_seen_once(const int *who, int count, int i)
{
    for (int j = 0; j < count; j++) {
        if (j != i && who[j] == who[i]) {
            return false;
        }
    }
    return true;
}

void bslam_identify(const bslam_slam_t *slam, const bslam_sighting_t *sightings, int count, int *who)
{
    int first[BSLAM_SIGHTINGS_MAX];
    for (int i = 0; i < count; i++) {
        first[i] = find(slam, &sightings[i]);
    }
    for (int i = 0; i < count; i++) {
        who[i] = is_seen_once(first, count, i) ? first[i] : BSLAM_NOBODY;
    }
}

bool bslam_may_be(const bslam_slam_t *slam, int who, int beacon)
{
    const bool by_appearance =
        slam->settings.association != BSLAM_ASSOCIATION_KNOWN && bslam_slam_learns(slam);
    return beacon == who ||
           (by_appearance && slam->ekf.beacons[beacon].confirmed && share_classifier(slam, beacon, who));
}

static bool is_known(const bslam_slam_t *slam, int beacon)
{
    static const bslam_sample_t ANY = {{0}};
    return slam->settings.association == BSLAM_ASSOCIATION_KNOWN ||
           (bslam_slam_learns(slam) &&
            bslam_appearance_ask(slam->appearance, beacon, &ANY).weight >= RECOGNISE_WEIGHT);
}

bool bslam_is_findable(const bslam_slam_t *slam)
{
    int known = 0;
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        known += slam->ekf.beacons[b].confirmed && is_known(slam, b) ? 1 : 0;
    }
    return known >= FINDABLE_MIN;
}
