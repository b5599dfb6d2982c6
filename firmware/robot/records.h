/// The records of the link that several messages share, as docs/LINK.md has them, into a frame and out of it.
#ifndef ROBOT_RECORDS_H
#define ROBOT_RECORDS_H

#include "bslam/bslam.h"
#include "link/parser.h"
#include "robot/health.h"

/// STEP. ticks: what the last message took.
void record_put_step(bslam_link_writer_t *out, const bslam_t *slam, uint64_t fingerprint, uint32_t ticks);

/// How many, then an ACCOUNT for each sighting of the last frame.
void record_put_accounts(bslam_link_writer_t *out, const bslam_t *slam);

/// BEACON.
void record_put_beacon(bslam_link_writer_t *out, const bslam_beacon_view_t *beacon);

/// HEALTH.
void record_put_health(bslam_link_writer_t *out, const health_t *health, const bslam_settings_t *settings,
                       bslam_recovery_state_t state);

/// A struct of nothing but uint32_t.
void record_put_counters(bslam_link_writer_t *out, const void *counters, size_t size);

/// SIGHTING, and if asked for its signature.
void record_put_sighting(bslam_link_writer_t *out, const bslam_sighting_t *sighting, bool with_signature);

/// SIGHTING. `signature`: which it has if it says that it has one.
void record_get_sighting(bslam_link_reader_t *reader, const float *signature, bslam_sighting_t *sighting);

#endif
