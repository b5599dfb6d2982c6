/// What the beacons of a map look like: a classifier each that learns from their sightings, and which beacons
/// share one. MATH "Which beacon is it".
#ifndef BSLAM_APPEARANCE_APPEARANCE_H
#define BSLAM_APPEARANCE_APPEARANCE_H

#include "bslam/settings.h"
#include "base/types.h"
#include "bslam/appearance/learner.h"

#define BSLAM_NO_CLASSIFIER (-1)
/// Classes 1 to this many are evidence; what a detector calls higher ones is none.
#define BSLAM_APPEARANCE_CLASSES 8
/// Sectors around a beacon from which it may be seen; viewpoint.h says which is which.
#define BSLAM_APPEARANCE_SECTORS 16

/// What is known of a beacon's appearance.
typedef struct bslam_beacon_appearance {
    int16_t classifier;
    int16_t twin;        ///< the classifier that takes its sightings for its own, too
    uint8_t twin_count;  ///< how often, less how often it did not
    uint8_t disowned;    ///< how often its own classifier, a shared one, refused it, less how often not
    bool is_trained;
    uint32_t trained_um;                        ///< distance travelled when it was trained last
    uint8_t seen_as[BSLAM_APPEARANCE_CLASSES];  ///< how often as which class, from 1 on
    uint32_t viewed_us;  ///< when it was matched last, used or not: the clock's lower half
    uint32_t missed_um;  ///< distance travelled when it was seen last, or not expected
    uint8_t missed;      ///< from how many directions, since it was seen last
    uint8_t
        seen_from[BSLAM_APPEARANCE_SECTORS];  ///< how far off it was last, decimetres; 0: not seen from there
    uint8_t view_frames;  ///< in which it was matched since it came into view, as far as they count
    float view_looks;     ///< what appearance said for it, on the mean of them
} bslam_beacon_appearance_t;

/// What a sighting's appearance says of a beacon.
typedef struct bslam_opinion {
    float value;   ///< the classifier's decision value
    float weight;  ///< 0: it is not trained yet; towards 1 with the samples it keeps
} bslam_opinion_t;

typedef struct bslam_appearance {
    bslam_appearance_counters_t counters;
    bslam_beacon_appearance_t of[BSLAM_BEACONS_MAX];  ///< in the order of the map
    bslam_real_t left_rad;                            ///< how far to the left of the robot a beacon was seen
    bslam_real_t right_rad;                           ///< and to the right, below 0
    bool is_shared;                                   ///< by hypotheses: no classifier leaves
    bslam_learner_t learner;
} bslam_appearance_t;

/// Nothing known. Seeds and errors as bslam_learner_init has them.
BSLAM_MUST_CHECK bslam_status_t bslam_appearance_init(bslam_appearance_t *appearance,
                                                      const bslam_sample_t *seeds, int32_t seed_count);

/// Forgets all beacons, in time for another map.
void bslam_appearance_clear(bslam_appearance_t *appearance);

/// What the classifier of beacon `index` says of a sample.
bslam_opinion_t bslam_appearance_ask(const bslam_appearance_t *appearance, int index,
                                     const bslam_sample_t *sample);

/// Log odds that a sample shows beacon `index`, against any other thing: by the method that
/// settings->association names. 0: its classifier knows nothing yet. O(samples of the classifier). MATH (44).
bslam_real_t bslam_appearance_odds(const bslam_appearance_t *appearance, const bslam_settings_t *settings,
                                   int index, const bslam_sample_t *sample);

/// Log odds that beacon `index` is seen as this class, against an unknown one; 0: the class is no evidence.
bslam_real_t bslam_appearance_class_odds(const bslam_appearance_t *appearance, int index,
                                         uint8_t beacon_class);

/// The class that beacon `index` was surely seen as most often; BSLAM_CLASS_NONE: it never was.
uint8_t bslam_appearance_class(const bslam_appearance_t *appearance, int index);

/// A sighting that surely shows beacon `index` of the `count` there are. Its class is noted and its
/// classifier is shown it, unless the last one was a few centimetres ago. O(classifiers).
void bslam_appearance_train(bslam_appearance_t *appearance, int index, int count, uint32_t travelled_um,
                            const bslam_sighting_t *sighting);

/// While hypotheses share the classifiers none leaves; once no more do, those leave that no beacon has.
void bslam_appearance_share(bslam_appearance_t *appearance, bool is_shared);

/// Beacon `index` of `count` leaves the map; those behind it move up.
void bslam_appearance_forget(bslam_appearance_t *appearance, int index, int count);

#endif
