#include "bslam/settings.h"

#include "base/scalar.h"
#include "bslam/settings_internal.h"

#if BSLAM_SETTING_MEANINGS
#define MEANING(text) text
#else
#define MEANING(text) ""
#endif
#define PLACE(name) (uint16_t)offsetof(bslam_settings_t, name)
#define INFO(group, name, value, low, high, meaning, is_integer) \
    {#name, MEANING(meaning), group, value, low, high, is_integer, PLACE(name)},
#define REAL_IN(group, name, value, low, high, meaning) \
    INFO(group, name, BSLAM_R(value), BSLAM_R(low), BSLAM_R(high), meaning, false)
#define INTEGER_IN(group, name, value, low, high, meaning) \
    INFO(group, name, (bslam_real_t)(value), (bslam_real_t)(low), (bslam_real_t)(high), meaning, true)
#define SETTINGS_REAL(...) REAL_IN("settings", __VA_ARGS__)
#define SETTINGS_INTEGER(...) INTEGER_IN("settings", __VA_ARGS__)
#define EXPERT_REAL(...) REAL_IN("expert", __VA_ARGS__)
#define EXPERT_INTEGER(...) INTEGER_IN("expert", __VA_ARGS__)
#define TUNING_REAL(...) REAL_IN("tuning", __VA_ARGS__)
#define TUNING_INTEGER(...) INTEGER_IN("tuning", __VA_ARGS__)
static const bslam_setting_info_t infos[] = {BSLAM_SETTINGS(SETTINGS_REAL, SETTINGS_INTEGER)  //
                                             BSLAM_EXPERT(EXPERT_REAL, EXPERT_INTEGER)        //
                                             BSLAM_TUNING(TUNING_REAL, TUNING_INTEGER)};

#define COUNT ((int)(sizeof infos / sizeof infos[0]))

const bslam_setting_info_t *bslam_settings_info(int id)
{
    return id >= 0 && id < COUNT ? &infos[id] : NULL;
}

int bslam_settings_count(void)
{
    return COUNT;
}

static const void *field(const bslam_settings_t *settings, int id)
{
    return (const unsigned char *)settings + infos[id].offset;
}

bslam_real_t bslam_settings_get(const bslam_settings_t *settings, int id)
{
    if (id < 0 || id >= COUNT) {
        return 0;
    }
    return infos[id].is_integer ? (bslam_real_t) * (const int32_t *)field(settings, id)
                                : *(const bslam_real_t *)field(settings, id);
}

bslam_status_t bslam_settings_set(bslam_settings_t *settings, int id, bslam_real_t value)
{
    if (id < 0 || id >= COUNT || !bslam_in_range(value, infos[id].low, infos[id].high)) {
        return BSLAM_E_PARAMETER;
    }
    void *target = (unsigned char *)settings + infos[id].offset;
    if (!infos[id].is_integer) {
        *(bslam_real_t *)target = value;
        return BSLAM_OK;
    }
    const int32_t whole = (int32_t)value;
    if ((bslam_real_t)whole != value) {
        return BSLAM_E_PARAMETER;
    }
    *(int32_t *)target = whole;
    return BSLAM_OK;
}

// ---- presets ----------------------------------------------------------------------------------------------

static void set_defaults(bslam_settings_t *settings)
{
#define DEFAULT_INTEGER(name, value, low, high, meaning) .name = (value),
#define DEFAULT_REAL(name, value, low, high, meaning) .name = BSLAM_R(value),
    static const bslam_settings_t defaults = {BSLAM_SETTINGS(DEFAULT_REAL, DEFAULT_INTEGER)  //
                                              BSLAM_EXPERT(DEFAULT_REAL, DEFAULT_INTEGER)    //
                                              BSLAM_TUNING(DEFAULT_REAL, DEFAULT_INTEGER)};
    *settings = defaults;
}

/// Equation (2) of the paper reads speeds, and its Section V lets the reading err.
static void set_paper(bslam_settings_t *settings)
{
    set_defaults(settings);
    settings->velocity_states = 1;
    settings->left_speed_sd_mps = BSLAM_R(0.3);
    settings->right_speed_sd_mps = BSLAM_R(0.3);
    settings->correlation_m = -1;  // as they show
}

/// A command leads the motion, and is not the driven speed: the scales are estimated, and the error grows
/// with travel and turn. Where wheels slip unmeasured, a gate would reject sightings for good; Huber weights
/// let the estimate come back. Sightings err by about .02 rad and .02 m + .035 r, but alike for many frames:
/// that counts as more noise for consistency, as less for association.
static void set_commanded(bslam_settings_t *settings)
{
    settings->scale_states = 1;
    settings->scale_sd = BSLAM_R(0.3);
    settings->scale_walk_sqrt_s = BSLAM_R(0.001);
    settings->left_speed_sd_mps = 0;
    settings->right_speed_sd_mps = 0;
    settings->forward_sd_per_sqrt_m = BSLAM_R(0.05);
    settings->turn_sd_per_sqrt_m = BSLAM_R(0.05);
    settings->turn_sd_per_sqrt_rad = BSLAM_R(0.25);
    settings->bearing_sd_rad = settings->filter == BSLAM_FILTER_SMOOTHER ? BSLAM_R(0.1) : BSLAM_R(0.05);
    settings->range_sd_floor_m = BSLAM_R(0.06);
    settings->range_sd_fraction = BSLAM_R(0.18);
    settings->range_sd_per_m = 0;
    settings->sighting_delay_us = 175000;
    settings->gate_d2 = 0;
    settings->huber_d = BSLAM_R(0.5);
    if (settings->association != BSLAM_ASSOCIATION_KNOWN) {
        settings->scale_sd = BSLAM_R(0.08);
        settings->turn_sd_per_sqrt_rad = BSLAM_R(0.1);
        settings->bearing_sd_rad = BSLAM_R(0.03);
        settings->range_sd_fraction = BSLAM_R(0.06);
        settings->huber_d = 1;
        settings->match_d2 = 12;
        settings->new_d2 = 100;
        settings->confirm_window_us = 3000000;
    }
}

/// What is partly hidden is measured as if it were whole: a few sightings in a hundred err by many times what
/// they say. Distances are so doubtful that position alone fits too much: appearance counts twice, and new
/// beacons are expected less.
static void set_camera(bslam_settings_t *settings)
{
    settings->huber_d = 1;
    settings->gate_d2 = 9;
    settings->new_per_m2 = BSLAM_R(0.003);
    if (settings->association != BSLAM_ASSOCIATION_KNOWN) {
        // The detector believes in things that are no beacon, mostly for a few metres of travel: a beacon
        // counts once it was seen from ten places, and nothing is thrown away.
        settings->confirm_sightings = 10;
        settings->confirm_travel_m = BSLAM_R(0.1);
        settings->confirm_window_us = 0;
        settings->duplicate_sd_m = BSLAM_R(0.3);
    }
}

/// A prior on the forward speed would tell the scale, which directions do not; one on the turn rate is free
/// of it. The smoother corrects what a pass has learned wrong, so a direction counts in full.
static void set_bearing_only(bslam_settings_t *settings)
{
    if (settings->filter == BSLAM_FILTER_SMOOTHER) {
        settings->velocity_walk_mps_sqrt_s = 30;
        settings->turn_rate_walk_radps_sqrt_s = 1;
        settings->turn_rate_decay_s = 1;
        settings->bearing_only_variance_factor = 1;
    }
}

void bslam_settings_preset(bslam_settings_t *settings, bslam_preset_t preset)
{
    static void (*const sets[BSLAM_PRESET_COUNT])(bslam_settings_t *) = {
        [BSLAM_PRESET_REAL_WHEELS] = set_defaults,      [BSLAM_PRESET_PAPER] = set_paper,
        [BSLAM_PRESET_COMMANDED] = set_commanded,       [BSLAM_PRESET_CAMERA] = set_camera,
        [BSLAM_PRESET_BEARING_ONLY] = set_bearing_only,
    };
    sets[preset < BSLAM_PRESET_COUNT ? preset : BSLAM_PRESET_REAL_WHEELS](settings);
}

// ---- checking ---------------------------------------------------------------------------------------------

/// A millimetre's, as the least noise that a sighting may bring; less, as the sum of squares is rounded.
static const bslam_real_t RANGE_VARIANCE_MIN_M2 = BSLAM_R(0.99e-6);
/// Of fewer counts none tells forward from back.
enum { COUNTER_MODULUS_MIN = 3 };

static bool is_allowed(const bslam_settings_t *settings, int id)
{
    if (infos[id].is_integer) {
        // As integers: a float does not hold every int32_t.
        const int32_t value = *(const int32_t *)field(settings, id);
        return value >= (int32_t)infos[id].low && value <= (int32_t)infos[id].high;
    }
    return bslam_in_range(*(const bslam_real_t *)field(settings, id), infos[id].low, infos[id].high);
}

int bslam_settings_at(size_t offset)
{
    int id = 0;
    while (infos[id].offset != offset) {
        id++;
    }
    return id;
}

/// The field that contradicts velocity states; negative: none does.
static int velocity_contradiction(const bslam_settings_t *settings)
{
    const size_t scale = offsetof(bslam_settings_t, scale_states);
    const size_t left = offsetof(bslam_settings_t, left_speed_sd_mps);
    const size_t right = offsetof(bslam_settings_t, right_speed_sd_mps);
    return settings->velocity_states == 0        ? -1
           : settings->scale_states != 0         ? bslam_settings_at(scale)
           : !(settings->left_speed_sd_mps > 0)  ? bslam_settings_at(left)
           : !(settings->right_speed_sd_mps > 0) ? bslam_settings_at(right)
                                                 : -1;
}

/// Variance of a distance of 1 m.
static bslam_real_t range_variance_at_1_m(const bslam_settings_t *settings)
{
    return settings->range_sd_floor_m * settings->range_sd_floor_m +
           settings->range_sd_fraction * settings->range_sd_fraction +
           settings->range_sd_per_m * settings->range_sd_per_m;
}

/// A field within its range that cannot be beside the others; negative: there is none.
static int contradiction(const bslam_settings_t *settings)
{
    if (range_variance_at_1_m(settings) < RANGE_VARIANCE_MIN_M2) {
        return bslam_settings_at(offsetof(bslam_settings_t, range_sd_floor_m));
    }
    if (settings->counter_modulus != 0 && settings->counter_modulus < COUNTER_MODULUS_MIN) {
        return bslam_settings_at(offsetof(bslam_settings_t, counter_modulus));
    }
    return velocity_contradiction(settings);
}

bslam_status_t bslam_settings_check(const bslam_settings_t *settings, int *bad_id)
{
    for (int id = 0; id < COUNT; id++) {
        if (!is_allowed(settings, id)) {
            *bad_id = id;
            return BSLAM_E_PARAMETER;
        }
    }
    const int bad = contradiction(settings);
    *bad_id = bad >= 0 ? bad : *bad_id;
    return bad >= 0 ? BSLAM_E_PARAMETER : BSLAM_OK;
}
