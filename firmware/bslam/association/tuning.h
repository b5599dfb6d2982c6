/// What association by appearance weighs by, with the values that it was tuned to. Internal: not for users,
/// and not stable. `--set NAME=VALUE` reaches it, for experiments.
#ifndef BSLAM_ASSOCIATION_TUNING_H
#define BSLAM_ASSOCIATION_TUNING_H

// clang-format off
/// REAL(name, default, low, high, meaning) and INTEGER(the same); a score is a log odds ratio.
#define BSLAM_TUNING(REAL, INTEGER) \
    REAL(candidate_d2, 30.0, 1e-3, 1e6, "beacons nearer than this are candidates") \
    REAL(new_per_m2, 0.002, 1e-9, 1e3, "density of beacons not yet in the map") \
    REAL(new_per_rad, 0.3, 1e-9, 1e3, "the same, bearing-only") \
    REAL(duplicate_sd_m, 0.1, 0.0, 1e3, "the places of two beacons that are one differ by about this") \
    INTEGER(hypotheses, 2, 1, 8, "that are followed at most while it is in doubt which beacon is seen") \
    INTEGER(doubt_us, 5000000, 0, 60000000, "for so long a doubt lasts at most") \
    REAL(doubt_nats, 6.0, 0.0, 100.0, "a choice that leads by less begins one") \
    INTEGER(missed_views, 3, 0, 32, "one missed from so many known viewpoints is removed (0: never)") \
    REAL(existence_score, 0.5, -100.0, 100.0, "a detector's score above this is evidence of existence") \
    REAL(existence_sum, 6.5, 0.0, 1e6, "a beacon is neither confirmed nor used below this evidence")
// clang-format on

#endif
