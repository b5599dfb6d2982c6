#include <string.h>

#include "base/trig.h"
#include "bslam/slam/slam_internal.h"
#include "base/scalar.h"

static const bslam_real_t RANGE_MIN_M = BSLAM_R(1e-3);
static const bslam_real_t RANGE_MAX_M = BSLAM_R(1e4);
static const bslam_real_t BEARING_SD_MIN_RAD = BSLAM_R(1e-5);
static const bslam_real_t SCORE_MAX = BSLAM_R(1e6);

/// A standard deviation, or 0 where the detector gives none.
static bool is_noise(bslam_real_t sd, bslam_real_t low, bslam_real_t high)
{
    return sd == 0 || bslam_in_range(sd, low, high);
}

/// Set in the bits of every float from 2 on, of infinities and of NaN.
#define LARGE_FLOAT 0x40000000U

/// Values of signatures are small as a rule, and then no value sets that bit: two instructions each.
static bool signature_is_finite(const float *signature)
{
    if (signature == NULL) {
        return true;
    }
    uint32_t bits = 0;
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        uint32_t value;
        memcpy(&value, &signature[k], sizeof value);
        bits |= value;
    }
    bool is_finite = true;
    for (int k = 0; (bits & LARGE_FLOAT) != 0 && is_finite && k < BSLAM_SAMPLE_FEATURES; k++) {
        is_finite = bslam_is_number((bslam_real_t)signature[k]);
    }
    return is_finite;
}

static bool is_finite(const bslam_sighting_t *sighting)
{
    const bool direction = bslam_is_number(sighting->bearing_rad) &&
                           bslam_is_number(sighting->bearing_sd_rad) && bslam_is_number(sighting->score);
    const bool distance = bslam_is_number(sighting->range_m) && bslam_is_number(sighting->range_sd_m) &&
                          bslam_is_number(sighting->range_scale_sd);
    return direction && (distance || !sighting->has_range) && signature_is_finite(sighting->signature);
}

static bool distance_is_possible(const bslam_sighting_t *sighting)
{
    return bslam_in_range(sighting->range_m, RANGE_MIN_M, RANGE_MAX_M) &&
           is_noise(sighting->range_sd_m, RANGE_MIN_M, RANGE_MAX_M) &&
           bslam_in_range(sighting->range_scale_sd, 0, 1);
}

static bslam_status_t check_sighting(const bslam_sighting_t *sighting)
{
    const bool bearing_ok = bslam_in_range(sighting->bearing_rad, -2 * BSLAM_PI, 2 * BSLAM_PI) &&
                            is_noise(sighting->bearing_sd_rad, BEARING_SD_MIN_RAD, BSLAM_PI);
    const bool range_ok = !sighting->has_range || distance_is_possible(sighting);
    const bool score_ok = bslam_in_range(sighting->score, -SCORE_MAX, SCORE_MAX);
    // What is no number is in no range: what is wrong is asked only where something is.
    if (bearing_ok && range_ok && score_ok && sighting->label >= BSLAM_LABEL_NONE &&
        signature_is_finite(sighting->signature)) {
        return BSLAM_OK;
    }
    return is_finite(sighting) ? BSLAM_E_RANGE : BSLAM_E_NOT_FINITE;
}

/// Whether the filter has not passed a moment yet, or odometry tells the way back.
static bool is_remembered(const bslam_slam_t *slam, int64_t behind_us)
{
    const int64_t back_us = behind_us - slam->history.filter.behind_us;
    bslam_history_view_t unused;
    return back_us <= 0 ||
           bslam_history_look_back(&slam->history, &slam->settings, back_us, &unused) == BSLAM_OK;
}

// ---- frames that come again -------------------------------------------------------------------------------

static uint32_t add_word(uint32_t sum, uint32_t word)
{
    return (sum ^ word) * UINT32_C(16777619);  // FNV-1a
}

static uint32_t add_number(uint32_t sum, bslam_real_t number)
{
    uint32_t words[sizeof number / sizeof(uint32_t)];
    memcpy(words, &number, sizeof words);
    for (size_t w = 0; w < sizeof words / sizeof words[0]; w++) {
        sum = add_word(sum, words[w]);
    }
    return sum;
}

/// What tells a frame from others; 0: none does, it is empty.
static uint32_t sum_of(int64_t time_us, const bslam_sighting_t *sightings, int count)
{
    uint32_t sum = add_word(add_word(UINT32_C(2166136261), (uint32_t)time_us), (uint32_t)(time_us >> 32));
    for (int i = 0; i < count; i++) {
        sum = add_number(add_word(sum, (uint32_t)sightings[i].label), sightings[i].bearing_rad);
        sum = sightings[i].has_range ? add_number(sum, sightings[i].range_m) : sum;
    }
    return count > 0 ? sum : 0;
}

/// What is newer than all frames was not.
static bool was_taken(const bslam_slam_t *slam, int64_t behind_us, uint32_t sum)
{
    bool found = false;
    if (slam->elapsed_us - behind_us > slam->moment_us) {
        return found;
    }
    for (int f = 0; f < BSLAM_HISTORY_MAX; f++) {
        found = found || (sum != 0 && slam->frames[f] == sum);
    }
    return found;
}

void bslam_slam_note_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings, int count)
{
    const uint32_t sum = sum_of(time_us, sightings, count);
    if (sum != 0) {
        slam->frames[slam->next_frame] = sum;
        slam->next_frame = (slam->next_frame + 1) % BSLAM_HISTORY_MAX;
    }
}

// ---- the whole --------------------------------------------------------------------------------------------

bslam_status_t bslam_slam_check_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings,
                                      int count, int64_t *behind_us)
{
    slam->bad_sighting = -1;
    if (count < 0 || count > BSLAM_SIGHTINGS_MAX) {
        return BSLAM_E_COUNT;
    }
    if (time_us < 0 || time_us > INT64_MAX / 2) {
        return BSLAM_E_TIME;
    }
    for (int i = 0; i < count; i++) {
        const bslam_status_t status = check_sighting(&sightings[i]);
        if (status != BSLAM_OK) {
            slam->bad_sighting = i;
            return status;
        }
    }
    *behind_us = bslam_slam_behind_us(slam, time_us - slam->settings.sighting_delay_us);
    const bool in_reach = *behind_us >= -slam->settings.ahead_max_us && is_remembered(slam, *behind_us);
    return in_reach && !was_taken(slam, *behind_us, sum_of(time_us, sightings, count)) ? BSLAM_OK
                                                                                       : BSLAM_E_TIME;
}
