#include "robot/records.h"

#include <string.h>

#define FLAG_BEACON 1u
#define FLAG_CONFIRMED 1u
#define FLAG_RANGE 1u
#define FLAG_SIGNATURE 2u
#define FLAG_RECOVERS 1u
#define FLAG_GUARDS 2u

static void put_pose(bslam_link_writer_t *out, const bslam_t *slam)
{
    const bslam_pose_t pose = bslam_pose(slam);
    bslam_real_t lower[6];
    bslam_pose_covariance(slam, lower);
    bslam_link_put_real(out, pose.x_m);
    bslam_link_put_real(out, pose.y_m);
    bslam_link_put_real(out, pose.theta_rad);
    for (int i = 0; i < 6; i++) {
        bslam_link_put_real(out, lower[i]);
    }
}

void record_put_step(bslam_link_writer_t *out, const bslam_t *slam, uint64_t fingerprint, uint32_t ticks)
{
    put_pose(out, slam);
    bslam_link_put_u64(out, fingerprint);
    bslam_link_put_u32(out, ticks);
}

static void put_account(bslam_link_writer_t *out, const bslam_account_t *account)
{
    bslam_link_put_u8(out, (uint8_t)account->outcome);
    bslam_link_put_u8(out, (uint8_t)account->reason);
    bslam_link_put_u8(out, account->has_beacon ? FLAG_BEACON : 0);
    bslam_link_put_u32(out, account->beacon_uid);
    bslam_link_put_real(out, account->test_ratio);
    bslam_link_put_real(out, account->weight);
}

void record_put_accounts(bslam_link_writer_t *out, const bslam_t *slam)
{
    int count = 0;
    const bslam_account_t *accounts = bslam_results(slam, &count);
    bslam_link_put_u8(out, (uint8_t)count);
    for (int i = 0; i < count; i++) {
        put_account(out, &accounts[i]);
    }
}

void record_put_beacon(bslam_link_writer_t *out, const bslam_beacon_view_t *beacon)
{
    bslam_link_put_u32(out, beacon->uid);
    bslam_link_put_i32(out, beacon->label);
    bslam_link_put_u8(out, (uint8_t)beacon->kind);
    bslam_link_put_u8(out, beacon->confirmed ? FLAG_CONFIRMED : 0);
    bslam_link_put_u8(out, beacon->beacon_class);
    bslam_link_put_u32(out, beacon->sightings);
    bslam_link_put_real(out, beacon->x_m);
    bslam_link_put_real(out, beacon->y_m);
    bslam_link_put_real(out, beacon->covariance_m2.xx);
    bslam_link_put_real(out, beacon->covariance_m2.xy);
    bslam_link_put_real(out, beacon->covariance_m2.yy);
    bslam_link_put_real(out, beacon->range_m);
    bslam_link_put_real(out, beacon->phi_rad);
}

void record_put_counters(bslam_link_writer_t *out, const void *counters, size_t size)
{
    const uint8_t *bytes = counters;
    for (size_t at = 0; at < size; at += sizeof(uint32_t)) {
        uint32_t value;
        memcpy(&value, &bytes[at], sizeof value);
        bslam_link_put_u32(out, value);
    }
}

void record_put_health(bslam_link_writer_t *out, const health_t *health, const bslam_settings_t *settings,
                       bslam_recovery_state_t state)
{
    bslam_link_put_u8(out, (settings->recovery != 0 ? FLAG_RECOVERS : 0u) |
                               (settings->guard != 0 ? FLAG_GUARDS : 0u));
    bslam_link_put_u8(out, (uint8_t)state);
    bslam_link_put_u8(out, (uint8_t)health->trouble);
    bslam_link_put_u64(out, (uint64_t)health->trouble_us);
    record_put_counters(out, &health->counts, sizeof health->counts);
}

void record_put_sighting(bslam_link_writer_t *out, const bslam_sighting_t *sighting, bool with_signature)
{
    bslam_link_put_real(out, sighting->bearing_rad);
    bslam_link_put_real(out, sighting->range_m);
    bslam_link_put_real(out, sighting->bearing_sd_rad);
    bslam_link_put_real(out, sighting->range_sd_m);
    bslam_link_put_real(out, sighting->range_scale_sd);
    bslam_link_put_real(out, sighting->score);
    bslam_link_put_i32(out, sighting->label);
    bslam_link_put_u8(out, sighting->beacon_class);
    bslam_link_put_u8(out, (sighting->has_range ? FLAG_RANGE : 0) | (with_signature ? FLAG_SIGNATURE : 0));
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES && with_signature; k++) {
        bslam_link_put_real(out, sighting->signature[k]);
    }
}

void record_get_sighting(bslam_link_reader_t *reader, const float *signature, bslam_sighting_t *sighting)
{
    sighting->bearing_rad = bslam_link_get_real(reader);
    sighting->range_m = bslam_link_get_real(reader);
    sighting->bearing_sd_rad = bslam_link_get_real(reader);
    sighting->range_sd_m = bslam_link_get_real(reader);
    sighting->range_scale_sd = bslam_link_get_real(reader);
    sighting->score = bslam_link_get_real(reader);
    sighting->label = bslam_link_get_i32(reader);
    sighting->beacon_class = bslam_link_get_u8(reader);
    const uint8_t flags = bslam_link_get_u8(reader);
    sighting->has_range = (flags & FLAG_RANGE) != 0;
    sighting->signature = (flags & FLAG_SIGNATURE) != 0 ? signature : NULL;
}
