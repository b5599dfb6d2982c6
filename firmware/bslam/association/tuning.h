/// What association by appearance weighs by, with the values that it was tuned to. Internal: not for users,
/// and not stable. `--set NAME=VALUE` reaches it, for experiments.
#ifndef BSLAM_ASSOCIATION_TUNING_H
#define BSLAM_ASSOCIATION_TUNING_H

// clang-format off
/// REAL(name, default, low, high, meaning) and INTEGER(the same); a score is a log odds ratio.
#define BSLAM_TUNING(REAL, INTEGER) \
    REAL(candidate_d2, 30.0, 1e-3, 1e6, "beacons nearer than this are candidates") \
    REAL(new_per_m2, 0.02, 1e-9, 1e3, "density of beacons not yet in the map") \
    REAL(new_per_rad, 0.3, 1e-9, 1e3, "the same, bearing-only") \
    REAL(defer_score, 4.0, 0.0, 1e3, "a best score between 0 and minus this is left undecided") \
    REAL(competitor_lead, 2.0, 0.0, 1e3, \
         "of two sightings of one beacon the better one's lead, or both wait") \
    REAL(again_odds, 4.2, 0.0, 100.0, "log odds that a beacon is seen again (4.2: missed 15 times in 1000)") \
    INTEGER(again_us, 200000, 0, 1000000000, "just now is so long ago") \
    INTEGER(decision_delay_us, 1000000, 0, 1000000000, \
         "a match that a classifier of few samples is against is delayed so long, 0: not") \
    REAL(decision_delay_score, 3.0, 0.0, 100.0, \
         "so is one that scores less, another in view; or leads by less, no distance, none in view") \
    REAL(appearance_weight, 1.0, 0.0, 100.0, "what appearance counts against position (0: nothing)") \
    REAL(appearance_samples, 3.0, 0.0, 1e3, "appearance counts half when a classifier keeps so many") \
    REAL(appearance_slope, 4.0, 0.0, 1e3, "log odds of a decision value") \
    REAL(appearance_offset, -0.5, -100.0, 100.0, "log odds of the decision value 0") \
    REAL(appearance_low, 8.0, 0.0, 100.0, "appearance speaks against a match by this at most") \
    REAL(appearance_high, 4.0, 0.0, 100.0, "and for one by this much") \
    REAL(viewpoint_low, 3.0, 0.0, 100.0, "log odds against a beacon seen a right angle off its viewpoints") \
    REAL(viewpoint_high, 1.0, 0.0, 100.0, "and for one seen from a known viewpoint, if it has two at least") \
    REAL(class_doubt, 0.1, 1e-3, 1e3, "a beacon counts as seen so often as each class from the start") \
    REAL(duplicate_m, 1.0, 0.0, 1e3, "two beacons nearer than this may be one") \
    REAL(duplicate_sd_m, 0.1, 0.0, 1e3, "whose two places differ by about this") \
    REAL(duplicate_d2, 9.0, 0.0, 1e3, "and by no more than this squared Mahalanobis distance") \
    REAL(far_d2, 300.0, 0.0, 1e6, \
         "a sighting that clearly resembles a beacon up to here, though no candidate, is not new") \
    REAL(learn_d2, 9.0, 0.0, 1e6, "a classifier learns from matches nearer than this") \
    REAL(learn_lead, 4.0, 0.0, 1e3, "whose score is ahead of the next beacon's by this") \
    REAL(learn_margin, 0.0, -100.0, 100.0, "and above this decision value, if appearance counts half") \
    REAL(learn_travel_m, 0.1, 0.0, 100.0, "and since whose last one the robot went this far") \
    REAL(share_value, 0.8, -100.0, 100.0, "decision value above which a beacon resembles another one") \
    INTEGER(share_sightings, 12, 1, 250, "so often before it shares that classifier, or leaves one") \
    INTEGER(doubt_sightings, 25, 1, 250, "of two beacons in one place, seen so often alone, one leaves") \
    INTEGER(missed_views, 3, 0, 32, "one missed from so many known viewpoints is removed (0: never)") \
    REAL(existence_score, 0.5, -100.0, 100.0, "a detector's score above this is evidence of existence") \
    REAL(existence_sum, 6.5, 0.0, 1e6, "a beacon is neither confirmed nor used below this evidence") \
    REAL(existence_first_sum, 3.0, 0.0, 1e6, "used from this on") \
    INTEGER(existence_beacons, 4, 0, 250, "while fewer than so many are confirmed")
// clang-format on

#endif
