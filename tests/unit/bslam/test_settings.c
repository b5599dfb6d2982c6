#include "support.h"
#include "bslam/settings_internal.h"
#include "plain_settings.h"

#include <math.h>

/// The table line of a name; fails if there is none.
static int id_of(const char *name)
{
    for (int id = 0; id < bslam_settings_count(); id++) {
        if (strcmp(bslam_settings_info(id)->name, name) == 0) {
            return id;
        }
    }
    fail_msg("no parameter %s", name);
    return -1;
}

/// The next number of the scalar type above (up) or below x.
static bslam_real_t neighbour(bslam_real_t x, bool up)
{
#if BSLAM_REAL_DOUBLE
    return nextafter(x, up ? INFINITY : -INFINITY);
#else
    return nextafterf(x, up ? INFINITY : -INFINITY);
#endif
}

static void assert_check_blames(const bslam_settings_t *settings, const char *name)
{
    int bad_id = -1;
    assert_int_equal(bslam_settings_check(settings, &bad_id), BSLAM_E_PARAMETER);
    assert_int_equal(bad_id, id_of(name));
}

// ---- the table --------------------------------------------------------------------------------------------

static void test_info_every_line_has_name_meaning_and_default_in_range(void **state)
{
    assert_true(bslam_settings_count() > 0);
    for (int id = 0; id < bslam_settings_count(); id++) {
        const bslam_setting_info_t *info = bslam_settings_info(id);
        assert_non_null(info);
        assert_true(strlen(info->name) > 0);
        assert_true(strlen(info->meaning) > 0);
        assert_true(info->low < info->high);
        assert_true(info->initial >= info->low && info->initial <= info->high);
    }
}

static void test_info_names_are_unique(void **state)
{
    for (int id = 0; id < bslam_settings_count(); id++) {
        assert_int_equal(id_of(bslam_settings_info(id)->name), id);
    }
}

static void test_info_outside_the_table_is_null(void **state)
{
    assert_null(bslam_settings_info(-1));
    assert_null(bslam_settings_info(bslam_settings_count()));
    assert_null(bslam_settings_info(INT32_MAX));
    assert_null(bslam_settings_info(INT32_MIN));
}

static void test_default_every_field_is_the_tables_and_passes_the_check(void **state)
{
    bslam_settings_t settings;
    memset(&settings, 0xa5, sizeof settings);
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
#define ASSERT_DEFAULT(field, value, low, high, meaning) \
    assert_near(settings.field, value, UNIT_ROUNDING *fabs((double)(value)));
    BSLAM_SETTINGS(ASSERT_DEFAULT, ASSERT_DEFAULT)
    BSLAM_EXPERT(ASSERT_DEFAULT, ASSERT_DEFAULT)
    BSLAM_TUNING(ASSERT_DEFAULT, ASSERT_DEFAULT)
    int bad_id = 7;
    assert_int_equal(bslam_settings_check(&settings, &bad_id), BSLAM_OK);
    assert_int_equal(bad_id, 7);
}

// ---- get and set ------------------------------------------------------------------------------------------

static void test_get_every_field_is_the_structs(void **state)
{
    bslam_settings_t settings;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    int id = 0;
#define ASSERT_GET(field, value, low, high, meaning) \
    settings.field = (high); \
    assert_true(bslam_settings_get(&settings, id) == settings.field); \
    id++;
#define ASSERT_GET_REAL(field, value, low, high, meaning) \
    ASSERT_GET(field, value, low, BSLAM_R(high), meaning)
    BSLAM_SETTINGS(ASSERT_GET_REAL, ASSERT_GET)
    BSLAM_EXPERT(ASSERT_GET_REAL, ASSERT_GET)
    BSLAM_TUNING(ASSERT_GET_REAL, ASSERT_GET)
    assert_int_equal(id, bslam_settings_count());
}

static void test_get_no_such_field_is_zero(void **state)
{
    bslam_settings_t settings;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    assert_true(bslam_settings_get(&settings, -1) == 0);
    assert_true(bslam_settings_get(&settings, bslam_settings_count()) == 0);
}

static void test_set_both_limits_are_taken_and_read_back(void **state)
{
    bslam_settings_t settings;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    for (int id = 0; id < bslam_settings_count(); id++) {
        const bslam_setting_info_t *info = bslam_settings_info(id);
        assert_int_equal(bslam_settings_set(&settings, id, info->low), BSLAM_OK);
        assert_true(bslam_settings_get(&settings, id) == info->low);
        assert_int_equal(bslam_settings_set(&settings, id, info->high), BSLAM_OK);
        assert_true(bslam_settings_get(&settings, id) == info->high);
    }
}

static void test_set_touches_no_other_field(void **state)
{
    for (int id = 0; id < bslam_settings_count(); id++) {
        bslam_settings_t settings;
        bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
        assert_int_equal(bslam_settings_set(&settings, id, bslam_settings_info(id)->high), BSLAM_OK);
        for (int other = 0; other < bslam_settings_count(); other++) {
            if (other != id) {
                assert_true(bslam_settings_get(&settings, other) == bslam_settings_info(other)->initial);
            }
        }
    }
}

static void test_set_outside_the_range_is_refused_and_changes_nothing(void **state)
{
    for (int id = 0; id < bslam_settings_count(); id++) {
        const bslam_setting_info_t *info = bslam_settings_info(id);
        const bslam_real_t wrong[] = {neighbour(info->low, false), neighbour(info->high, true), NAN, INFINITY,
                                      -INFINITY};
        for (int i = 0; i < COUNT_OF(wrong); i++) {
            bslam_settings_t settings;
            bslam_settings_t before;
            memset(&settings, 0, sizeof settings);
            bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
            memcpy(&before, &settings, sizeof settings);
            assert_int_equal(bslam_settings_set(&settings, id, wrong[i]), BSLAM_E_PARAMETER);
            assert_memory_equal(&settings, &before, sizeof settings);
        }
    }
}

static void test_set_fraction_for_an_integer_is_refused(void **state)
{
    bslam_settings_t settings;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    for (int id = 0; id < bslam_settings_count(); id++) {
        const bslam_setting_info_t *info = bslam_settings_info(id);
        if (info->is_integer) {
            assert_int_equal(bslam_settings_set(&settings, id, info->low + BSLAM_R(0.5)), BSLAM_E_PARAMETER);
            assert_true(bslam_settings_get(&settings, id) == info->initial);
        }
    }
}

static void test_set_no_such_field_is_refused(void **state)
{
    bslam_settings_t settings;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    assert_int_equal(bslam_settings_set(&settings, -1, 0), BSLAM_E_PARAMETER);
    assert_int_equal(bslam_settings_set(&settings, bslam_settings_count(), 0), BSLAM_E_PARAMETER);
}

// ---- check ------------------------------------------------------------------------------------------------

/// One field of otherwise good settings is set to `value`: the check must blame it.
#define ASSERT_BLAMED(field, value) \
    do { \
        bslam_settings_t settings = unit_settings(); \
        settings.field = (value); \
        assert_check_blames(&settings, #field); \
    } while (0)

static void test_check_every_real_field_outside_its_range_is_blamed(void **state)
{
#define ASSERT_BLAMED_REAL(field, value, low, high, meaning) \
    ASSERT_BLAMED(field, neighbour(BSLAM_R(low), false)); \
    ASSERT_BLAMED(field, neighbour(BSLAM_R(high), true)); \
    ASSERT_BLAMED(field, (bslam_real_t)NAN); \
    ASSERT_BLAMED(field, (bslam_real_t)INFINITY);
#define IGNORE(field, value, low, high, meaning)
    BSLAM_SETTINGS(ASSERT_BLAMED_REAL, IGNORE)
}

static void test_check_every_integer_field_outside_its_range_is_blamed(void **state)
{
#define ASSERT_BLAMED_INTEGER(field, value, low, high, meaning) \
    ASSERT_BLAMED(field, (low) - 1); \
    ASSERT_BLAMED(field, (high) + 1); \
    ASSERT_BLAMED(field, INT32_MAX); \
    ASSERT_BLAMED(field, INT32_MIN);
    BSLAM_SETTINGS(IGNORE, ASSERT_BLAMED_INTEGER)
}

static void test_check_both_limits_of_every_field_are_taken(void **state)
{
    for (int id = 0; id < bslam_settings_count(); id++) {
        bslam_settings_t settings = unit_settings();
        // A field that the contradictions below are about keeps its value.
        if (strstr(bslam_settings_info(id)->name, "_states") != NULL) {
            continue;
        }
        int bad_id = -1;
        assert_int_equal(bslam_settings_set(&settings, id, bslam_settings_info(id)->low), BSLAM_OK);
        assert_int_equal(bslam_settings_check(&settings, &bad_id), BSLAM_OK);
        assert_int_equal(bslam_settings_set(&settings, id, bslam_settings_info(id)->high), BSLAM_OK);
        assert_int_equal(bslam_settings_check(&settings, &bad_id), BSLAM_OK);
    }
}

static void test_check_velocity_and_scale_states_together_are_refused(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 1;
    settings.scale_states = 1;
    assert_check_blames(&settings, "scale_states");
}

static void test_check_velocity_states_need_noise_of_both_wheels(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.velocity_states = 1;
    settings.left_speed_sd_mps = 0;
    assert_check_blames(&settings, "left_speed_sd_mps");
    settings.left_speed_sd_mps = 1;
    settings.right_speed_sd_mps = 0;
    assert_check_blames(&settings, "right_speed_sd_mps");
    settings.right_speed_sd_mps = 1;
    int bad_id = -1;
    assert_int_equal(bslam_settings_check(&settings, &bad_id), BSLAM_OK);
}

/// Distances without noise make a filter that believes them to every digit.
static void test_check_distances_need_a_millimetre_of_noise_at_a_metre(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.range_sd_floor_m = settings.range_sd_fraction = settings.range_sd_per_m = 0;
    assert_check_blames(&settings, "range_sd_floor_m");
    static const double too_little[] = {9e-4, 1e-6, 1e-20, 1e-38};
    for (int i = 0; i < COUNT_OF(too_little); i++) {
        settings.range_sd_floor_m = real(too_little[i]);
        assert_check_blames(&settings, "range_sd_floor_m");
    }
    bslam_real_t *const parts[] = {&settings.range_sd_floor_m, &settings.range_sd_fraction,
                                   &settings.range_sd_per_m};
    for (int i = 0; i < COUNT_OF(parts); i++) {
        int bad_id = -1;
        settings.range_sd_floor_m = settings.range_sd_fraction = settings.range_sd_per_m = 0;
        *parts[i] = BSLAM_R(1e-3);
        assert_int_equal(bslam_settings_check(&settings, &bad_id), BSLAM_OK);
    }
}

static void test_check_directions_need_noise(void **state)
{
    bslam_settings_t settings = unit_settings();
    settings.bearing_sd_rad = 0;
    assert_check_blames(&settings, "bearing_sd_rad");
}

static void test_check_modulus_of_a_counter_that_tells_no_direction_is_refused(void **state)
{
    bslam_settings_t settings = unit_settings();
    for (int32_t modulus = 1; modulus < 3; modulus++) {
        settings.counter_modulus = modulus;
        assert_check_blames(&settings, "counter_modulus");
    }
    int bad_id = -1;
    settings.counter_modulus = 3;
    assert_int_equal(bslam_settings_check(&settings, &bad_id), BSLAM_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_info_every_line_has_name_meaning_and_default_in_range),
        cmocka_unit_test(test_info_names_are_unique),
        cmocka_unit_test(test_info_outside_the_table_is_null),
        cmocka_unit_test(test_default_every_field_is_the_tables_and_passes_the_check),

        cmocka_unit_test(test_get_every_field_is_the_structs),
        cmocka_unit_test(test_get_no_such_field_is_zero),
        cmocka_unit_test(test_set_both_limits_are_taken_and_read_back),
        cmocka_unit_test(test_set_touches_no_other_field),
        cmocka_unit_test(test_set_outside_the_range_is_refused_and_changes_nothing),
        cmocka_unit_test(test_set_fraction_for_an_integer_is_refused),
        cmocka_unit_test(test_set_no_such_field_is_refused),

        cmocka_unit_test(test_check_every_real_field_outside_its_range_is_blamed),
        cmocka_unit_test(test_check_every_integer_field_outside_its_range_is_blamed),
        cmocka_unit_test(test_check_both_limits_of_every_field_are_taken),
        cmocka_unit_test(test_check_velocity_and_scale_states_together_are_refused),
        cmocka_unit_test(test_check_velocity_states_need_noise_of_both_wheels),
        cmocka_unit_test(test_check_distances_need_a_millimetre_of_noise_at_a_metre),
        cmocka_unit_test(test_check_directions_need_noise),
        cmocka_unit_test(test_check_modulus_of_a_counter_that_tells_no_direction_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
