/// What the methods share. Not for users of the library.
#ifndef BSLAM_ASSOCIATION_INTERNAL_H
#define BSLAM_ASSOCIATION_INTERNAL_H

#include "bslam/association/association.h"

/// Fills in a match that says nothing yet. False if the sighting is of no beacon at all.
bool bslam_is_mappable(const bslam_sighting_t *sighting, bslam_match_t *match);

/// True if a sighting and a beacon have classes, and not the same.
bool bslam_classes_differ(const bslam_sighting_t *sighting, const bslam_beacon_t *beacon);

#endif
