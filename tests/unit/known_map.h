/// Maps, and classifiers that know their beacons, for tests of association to decide in.
#ifndef UNIT_KNOWN_MAP_H
#define UNIT_KNOWN_MAP_H

#include "bslam/association/association.h"

/// Robot at the origin, which it knows exactly; beacons with deviations of 0.1 m in each coordinate.
bslam_ekf_t unit_map_of(const bslam_settings_t *settings, const double (*places)[2], int count);

/// A classifier for beacon `index` that has learned from `samples` (16 at most), and answers value * first
/// feature.
void unit_give_machine(bslam_appearance_t *appearance, int index, double value, int samples);

void unit_assert_decided(const bslam_match_t *match, bslam_verdict_t verdict, bslam_reason_t reason,
                         int beacon);

#endif
