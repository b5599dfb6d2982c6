/// The sizes that more than one library goes by, and where an application sets its own.
///
/// Every size has its default in its library's config.h. Override it with -D, or in a header of your own that
/// BSLAM_CONFIG_HEADER names: -DBSLAM_CONFIG_HEADER='"my_sizes.h"'. Library and application must agree.
#ifndef BSLAM_BASE_CONFIG_H
#define BSLAM_BASE_CONFIG_H

#ifdef BSLAM_CONFIG_HEADER
#include BSLAM_CONFIG_HEADER
#endif

/// 0: bslam_real_t is float (the target). 1: double, which tests compare with.
#ifndef BSLAM_REAL_DOUBLE
#define BSLAM_REAL_DOUBLE 0
#endif
#if BSLAM_REAL_DOUBLE != 0 && BSLAM_REAL_DOUBLE != 1
#error "BSLAM_REAL_DOUBLE is 0 or 1"
#endif

/// Sightings taken from one image.
#ifndef BSLAM_SIGHTINGS_MAX
#define BSLAM_SIGHTINGS_MAX 16
#endif
#if BSLAM_SIGHTINGS_MAX < 1 || BSLAM_SIGHTINGS_MAX > 250
#error "BSLAM_SIGHTINGS_MAX is 1 to 250"
#endif

#endif
