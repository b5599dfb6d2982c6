#include "bslam/settings.h"

#include <stddef.h>

#if BSLAM_SETTING_MEANINGS
#define MEANING(text) text
#else
#define MEANING(text) ""
#endif
#define INFO_REAL(name, value, low, high, meaning) \
    {#name, MEANING(meaning), BSLAM_R(value), BSLAM_R(low), BSLAM_R(high), false},
#define INFO_INTEGER(name, value, low, high, meaning) \
    {#name, MEANING(meaning), (bslam_real_t)(value), (bslam_real_t)(low), (bslam_real_t)(high), true},
static const bslam_setting_info_t infos[] = {BSLAM_SETTINGS(INFO_REAL, INFO_INTEGER)};

/// What checking needs: tables of their own, so that a linker drops the names where nobody asks for them.
/// Limits are a few numbers again and again, so each stands once, and a limit is a byte: its place among
/// them, which the compiler finds. Where a field stands in the struct is a multiple of 4: an odd number for
/// an integer.
// clang-format off
#define BOUNDS(BOUND, x) \
    BOUND(x, 0, 0.0) BOUND(x, 1, 1.0) BOUND(x, 2, 2.0) BOUND(x, 3, 4.0) BOUND(x, 4, 32.0) \
    BOUND(x, 5, 1e-9) BOUND(x, 6, 1e-6) BOUND(x, 7, 1e-4) BOUND(x, 8, 1e-3) BOUND(x, 9, 0.1) \
    BOUND(x, 10, 3.2) BOUND(x, 11, -3.2) BOUND(x, 12, 10.0) BOUND(x, 13, 100.0) BOUND(x, 14, -100.0) \
    BOUND(x, 15, 250.0) BOUND(x, 16, 1e3) BOUND(x, 17, 1024.0) BOUND(x, 18, 1e6) BOUND(x, 19, -1e6) \
    BOUND(x, 20, 4e6) BOUND(x, 21, 1e7) BOUND(x, 22, 1e9) BOUND(x, 23, 3.0)
// clang-format on
#define NUMBER(x, place, bound) [place] = BSLAM_R(bound),
#define PLACE_IF(x, place, bound) (bslam_real_t)(x) == (bslam_real_t)BSLAM_R(bound) ? (place):
static const bslam_real_t bounds[] = {BOUNDS(NUMBER, )};
#define BOUND_AT(x) (uint8_t)(BOUNDS(PLACE_IF, x) UINT8_MAX)

typedef struct limits {
    uint8_t low, high;
} limits_t;
#define LIMITS_REAL(name, value, low, high, meaning) {BOUND_AT(BSLAM_R(low)), BOUND_AT(BSLAM_R(high))},
#define LIMITS_INTEGER(name, value, low, high, meaning) {BOUND_AT(low), BOUND_AT(high)},
static const limits_t limits[] = {BSLAM_SETTINGS(LIMITS_REAL, LIMITS_INTEGER)};
#define PLACE_REAL(name, value, low, high, meaning) (uint16_t)offsetof(bslam_settings_t, name),
#define PLACE_INTEGER(name, value, low, high, meaning) (uint16_t)(offsetof(bslam_settings_t, name) + 1),
static const uint16_t places[] = {BSLAM_SETTINGS(PLACE_REAL, PLACE_INTEGER)};

static bool is_integer(int id)
{
    return places[id] % 2 != 0;
}

static size_t offset_of(int id)
{
    return places[id] / 2 * (size_t)2;
}

static bslam_real_t low_of(int id)
{
    return bounds[limits[id].low];
}

static bslam_real_t high_of(int id)
{
    return bounds[limits[id].high];
}

#define PARAMS_COUNT ((int)(sizeof limits / sizeof limits[0]))

int bslam_settings_count(void)
{
    return PARAMS_COUNT;
}

const bslam_setting_info_t *bslam_settings_info(int id)
{
    return id >= 0 && id < PARAMS_COUNT ? &infos[id] : NULL;
}

void bslam_settings_default(bslam_settings_t *settings)
{
#define DEFAULT_INTEGER(name, value, low, high, meaning) .name = (value),
#define DEFAULT_REAL(name, value, low, high, meaning) .name = BSLAM_R(value),
    static const bslam_settings_t defaults = {BSLAM_SETTINGS(DEFAULT_REAL, DEFAULT_INTEGER)};
    *settings = defaults;
}

/// The field at a table line, as bytes of the struct.
static const void *field(const bslam_settings_t *settings, int id)
{
    return (const unsigned char *)settings + offset_of(id);
}

bslam_real_t bslam_settings_get(const bslam_settings_t *settings, int id)
{
    if (id < 0 || id >= PARAMS_COUNT) {
        return 0;
    }
    if (is_integer(id)) {
        return (bslam_real_t) * (const int32_t *)field(settings, id);
    }
    return *(const bslam_real_t *)field(settings, id);
}

bslam_status_t bslam_settings_set(bslam_settings_t *settings, int id, bslam_real_t value)
{
    if (id < 0 || id >= PARAMS_COUNT || !bslam_in_range(value, low_of(id), high_of(id))) {
        return BSLAM_E_PARAMETER;
    }
    void *target = (unsigned char *)settings + offset_of(id);
    if (!is_integer(id)) {
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

/// The table line of a field.
static int id_at(size_t offset)
{
    int id = 0;
    while (offset_of(id) != offset) {
        id++;
    }
    return id;
}

static bool is_allowed(const bslam_settings_t *settings, int id)
{
    const bslam_real_t low = low_of(id), high = high_of(id);
    if (is_integer(id)) {
        // As integers: a float does not hold every int32_t.
        const int32_t value = *(const int32_t *)field(settings, id);
        return value >= (int32_t)low && value <= (int32_t)high;
    }
    return bslam_in_range(*(const bslam_real_t *)field(settings, id), low, high);
}

bslam_status_t bslam_settings_check(const bslam_settings_t *settings, int *bad_id)
{
    for (int id = 0; id < PARAMS_COUNT; id++) {
        if (!is_allowed(settings, id)) {
            *bad_id = id;
            return BSLAM_E_PARAMETER;
        }
    }
    if (settings->velocity_states != 0) {
        if (settings->scale_states != 0) {
            *bad_id = id_at(offsetof(bslam_settings_t, scale_states));
            return BSLAM_E_PARAMETER;
        }
        if (!(settings->left_speed_sd_mps > 0)) {
            *bad_id = id_at(offsetof(bslam_settings_t, left_speed_sd_mps));
            return BSLAM_E_PARAMETER;
        }
        if (!(settings->right_speed_sd_mps > 0)) {
            *bad_id = id_at(offsetof(bslam_settings_t, right_speed_sd_mps));
            return BSLAM_E_PARAMETER;
        }
    }
    return BSLAM_OK;
}
