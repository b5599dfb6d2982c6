/// What the methods share.
#ifndef BSLAM_ASSOCIATION_ASSOCIATION_INTERNAL_H
#define BSLAM_ASSOCIATION_ASSOCIATION_INTERNAL_H

#include "bslam/association/association.h"

/// The score of nothing.
#define NO_SCORE BSLAM_R(-1e9)

/// Fills in a match that says nothing yet. False if the sighting is of no beacon at all.
bool bslam_is_mappable(const bslam_sighting_t *sighting, bslam_match_t *match);

#endif
