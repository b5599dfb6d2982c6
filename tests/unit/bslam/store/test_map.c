#include "covariance.h"
#include "kept_map.h"

#include <math.h>

#include "bslam/model/noise.h"
#include "base/crc32.h"

static bslam_slam_t slam;
static bslam_appearance_t appearance;
static bslam_slam_t other;
static bslam_appearance_t other_appearance;
static uint8_t bytes[KEPT_BYTES_MAX];
static uint32_t size;

enum { BEACONS_AT = 28, BEACON_BYTES = 38 };

static int setup(void **state)
{
    kept_make(&slam, &appearance, 4);
    size = kept_write(&slam, bytes);
    kept_empty(&other, &other_appearance);
    return 0;
}

/// Where the state values begin: all beacons of this map are saved.
static uint32_t values_at(void)
{
    return BEACONS_AT + BEACON_BYTES * (uint32_t)slam.ekf.beacon_count;
}

/// Where D of a column stands, and element (row, column) of L: the first column is the heading's, which is no
/// saved value and has no row.
static uint32_t d_at(int column)
{
    return values_at() + 4u * (uint32_t)(slam.ekf.dim - slam.ekf.base_dim + column);
}

static uint32_t l_at(int row, int column)
{
    return d_at(slam.ekf.factor.body_count) + 4u * (uint32_t)(row * (row - 1) / 2 + column);
}

/// Where the first classifier stands in the blob, and its competitors.
static uint32_t machine_at(void)
{
    return l_at(slam.ekf.factor.body_count, 0);
}

static uint32_t rivals_at(void)
{
    const uint32_t classifier = machine_at();
    assert_true(bytes[classifier + 2] > 0);
    return classifier + 152 + 73u * bytes[classifier];
}

static void put_u32(uint32_t at, uint32_t value)
{
    for (int i = 0; i < 4; i++) {
        bytes[at + (uint32_t)i] = (uint8_t)(value >> 8 * i);
    }
}

static void put_float(uint32_t at, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_u32(at, bits);
}

/// Makes the CRC right, whatever else is wrong.
static void seal(void)
{
    put_u32(size - 4, ~bslam_crc32_add(BSLAM_CRC32_START, bytes, size - 4));
}

/// Refused for this by load, in both modes; nothing of the running state has changed.
static void assert_load_refuses(bslam_map_fault_t expected)
{
    static bslam_slam_t before;
    static bslam_appearance_t looks_before;
    memcpy(&before, &slam, sizeof slam);
    memcpy(&looks_before, &appearance, sizeof appearance);
    const bslam_map_source_t source = map_from_memory(bytes, size);
    for (int mode = BSLAM_MAP_LIVING; mode <= BSLAM_MAP_FROZEN; mode++) {
        bslam_map_fault_t fault = BSLAM_MAP_FINE;
        assert_int_equal(bslam_map_load(&slam, &source, (bslam_map_mode_t)mode, &fault), BSLAM_E_MAP);
        assert_int_equal(fault, expected);
        assert_memory_equal(&slam, &before, sizeof slam);
        assert_memory_equal(&appearance, &looks_before, sizeof appearance);
    }
}

static bslam_map_fault_t check(void)
{
    const bslam_map_source_t source = map_from_memory(bytes, size);
    return bslam_map_check(&source);
}

/// By check, too.
static void assert_refused(bslam_map_fault_t expected)
{
    assert_int_equal(check(), expected);
    assert_load_refuses(expected);
}

static void load(bslam_map_mode_t mode)
{
    const bslam_map_source_t source = map_from_memory(bytes, size);
    bslam_map_fault_t fault;
    assert_int_equal(bslam_map_load(&other, &source, mode, &fault), BSLAM_OK);
    assert_int_equal(fault, BSLAM_MAP_FINE);
}

// ---- what is kept -----------------------------------------------------------------------------------------

/// The state values of all saved beacons, in the order of these: where they stand. How many.
static int saved_values(const bslam_ekf_t *ekf, int at[DENSE_MAX])
{
    int count = 0;
    for (int b = 0; b < ekf->beacon_count; b++) {
        for (int k = 0; ekf->beacons[b].confirmed && k < bslam_beacon_dim(ekf->beacons[b].kind); k++) {
            at[count++] = ekf->beacons[b].at + k;
        }
    }
    return count;
}

/// What a loaded map has of a saved one: means as they were in float32; the covariance but for its rounding,
/// also of what is much surer than each value, the differences; and nothing in common with the robot.
static void assert_same_map(const bslam_ekf_t *saved, const bslam_ekf_t *loaded)
{
    int from[DENSE_MAX], to[DENSE_MAX];
    const int count = saved_values(saved, from);
    assert_int_equal(saved_values(loaded, to), count);
    assert_int_equal(loaded->dim, bslam_ekf_map_at(loaded) + count);
    const dense_t was = covariance_of(saved), is = covariance_of(loaded);
    for (int i = 0; i < count; i++) {
        assert_true((float)loaded->mean[to[i]] == (float)saved->mean[from[i]]);
        const double var = was.at[from[i]][from[i]];
        for (int j = 0; j <= i; j++) {
            const double between = was.at[from[i]][from[j]], other_var = was.at[from[j]][from[j]];
            assert_near(is.at[to[i]][to[j]], between, 1e-6 * sqrt(var * other_var));
            const double apart = var - 2 * between + other_var;
            const double apart_now = is.at[to[i]][to[i]] - 2 * is.at[to[i]][to[j]] + is.at[to[j]][to[j]];
            assert_near(apart_now, apart, 1e-4 * apart + 1e-10 * (var + other_var));
        }
        for (int k = 0; k < bslam_ekf_map_at(loaded); k++) {
            assert_true(is.at[to[i]][k] == 0);
        }
    }
    covariance_assert_sound(&loaded->factor);
}

static void test_map_load_living_gives_beacons_covariance_and_looks_back(void **state)
{
    load(BSLAM_MAP_LIVING);
    assert_int_equal(other.ekf.beacon_count, slam.ekf.beacon_count);
    for (int b = 0; b < slam.ekf.beacon_count; b++) {
        bslam_beacon_view_t was;
        bslam_beacon_view_t is;
        assert_int_equal(bslam_slam_beacon(&slam, b, &was), BSLAM_OK);
        assert_int_equal(bslam_slam_beacon(&other, b, &is), BSLAM_OK);
        assert_int_equal(is.uid, was.uid);
        assert_int_equal(is.kind, was.kind);
        assert_int_equal(is.sightings, was.sightings);
        assert_near(is.x_m, was.x_m, 1e-6);
        assert_near(is.y_m, was.y_m, 1e-6);
        assert_near(is.covariance_m2.xx, was.covariance_m2.xx, 1e-7 + 1e-6 * (double)was.covariance_m2.xx);
    }
    assert_same_map(&slam.ekf, &other.ekf);
    assert_int_equal(other.ekf.next_uid, slam.ekf.next_uid);
    for (int object = 0; object < 4; object++) {
        float signature[BSLAM_SAMPLE_FEATURES];
        bslam_sample_t sample;
        assert_int_equal(bslam_sample_encode(kept_signature(object, 50, signature), &sample), BSLAM_OK);
        for (int b = 0; b < 4; b++) {
            const bslam_opinion_t was = bslam_appearance_ask(&appearance, b, &sample);
            const bslam_opinion_t is = bslam_appearance_ask(&other_appearance, b, &sample);
            assert_near(is.value, was.value, BSLAM_SAMPLE_FLOAT ? 0.02 : 0);
            assert_near(is.weight, was.weight, 0);
        }
    }
}

/// What the saved values hung on besides leaves with the first load; from then on the map stays as it is.
static void test_map_write_of_a_map_that_was_loaded_twice_gives_the_same_bytes(void **state)
{
    static uint8_t again[KEPT_BYTES_MAX];
    load(BSLAM_MAP_LIVING);
    size = kept_write(&other, bytes);
    load(BSLAM_MAP_LIVING);
    assert_int_equal(kept_write(&other, again), size);
#if !BSLAM_SAMPLE_FLOAT
    assert_memory_equal(again, bytes, size);
#endif
}

static void test_map_load_leaves_the_robot_without_a_place(void **state)
{
    load(BSLAM_MAP_LIVING);
    bslam_real_t lower[6];
    bslam_slam_pose_covariance(&other, lower);
    assert_near(lower[0], 900, 1e-3);
    assert_near(lower[5], 10.24, 1e-5);
}

static void test_map_load_frozen_changes_no_beacon_and_adds_none(void **state)
{
    load(BSLAM_MAP_FROZEN);
    assert_int_equal(other.ekf.beacon_count, 4);  // the ray has no distance
    const bslam_pose_t origin = {0, 0, 0};
    assert_int_equal(bslam_slam_set_pose(&other, &origin, BSLAM_R(0.05), BSLAM_R(0.05)), BSLAM_OK);
    bslam_beacon_view_t before[4];
    for (int b = 0; b < 4; b++) {
        assert_int_equal(bslam_slam_beacon(&other, b, &before[b]), BSLAM_OK);
    }
    for (int view = 0; view < 30; view++) {
        float known[BSLAM_SAMPLE_FEATURES];
        float strange[BSLAM_SAMPLE_FEATURES];
        bslam_sighting_t seen[] = {unit_polar(-1.5, 2.05, -1), unit_polar(2.0, 5.0, -1)};
        seen[0].signature = kept_signature(0, 100 + view, known);
        seen[1].signature = kept_signature(5, 100 + view, strange);
        const int64_t now_us = 40000 * (view + 1);
        const bslam_odometry_reading_t still = {.source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us};
        assert_int_equal(bslam_slam_odometry(&other, &still), BSLAM_OK);
        assert_int_equal(bslam_slam_sightings(&other, now_us, seen, 2), BSLAM_OK);
    }
    assert_true(other.counters.matched > 20);
    assert_true(other.counters.frozen > 20);
    assert_int_equal(other.ekf.beacon_count, 4);
    for (int b = 0; b < 4; b++) {
        bslam_beacon_view_t after;
        assert_int_equal(bslam_slam_beacon(&other, b, &after), BSLAM_OK);
        assert_true(after.x_m == before[b].x_m && after.y_m == before[b].y_m);
    }
    assert_int_equal(other_appearance.counters.trained, 0);
}

static void test_map_write_leaves_out_tentative_beacons(void **state)
{
    float signature[BSLAM_SAMPLE_FEATURES];
    bslam_sighting_t seen = unit_polar(2.9, 6.0, -1);
    seen.signature = kept_signature(5, 1, signature);
    assert_int_equal(bslam_slam_sightings(&slam, 12 * 40000 + 1, &seen, 1), BSLAM_OK);
    assert_int_equal(slam.counters.added, 6);
    size = kept_write(&slam, bytes);
    load(BSLAM_MAP_LIVING);
    assert_int_equal(other.ekf.beacon_count, 5);
}

static void test_map_load_gives_the_counts_of_classes_back(void **state)
{
    for (int b = 0; b < 4; b++) {
        memset(appearance.of[b].seen_as, b + 1, sizeof appearance.of[b].seen_as);
    }
    size = kept_write(&slam, bytes);
    for (int mode = BSLAM_MAP_LIVING; mode <= BSLAM_MAP_FROZEN; mode++) {
        kept_empty(&other, &other_appearance);
        load((bslam_map_mode_t)mode);
        for (int b = 0; b < 4; b++) {
            assert_memory_equal(other_appearance.of[b].seen_as, appearance.of[b].seen_as,
                                sizeof appearance.of[b].seen_as);
        }
    }
}

static void test_map_load_frozen_keeps_the_scale_of_a_sized_beacon(void **state)
{
    bslam_settings_t settings = kept_settings();
    settings.range_scale_sd = BSLAM_R(0.2);
    settings.confirm_sightings = 1;
    int bad_id;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    const bslam_sighting_t seen = unit_polar(0.5, 4, -1);
    assert_int_equal(bslam_slam_sightings(&slam, 0, &seen, 1), BSLAM_OK);
    slam.ekf.mean[slam.ekf.beacons[0].at + 2] = BSLAM_R(1.25);  // its distances come out a quarter too long
    size = kept_write(&slam, bytes);
    other.settings.range_scale_sd = settings.range_scale_sd;
    load(BSLAM_MAP_FROZEN);
    const bslam_pose_t mount = {0, 0, 0};
    bslam_innovation_t innovation;
    assert_int_equal(bslam_ekf_innovation(&other.ekf, &other.settings, &mount, &seen, 0, &innovation),
                     BSLAM_OK);
    assert_near(innovation.range_m, 4 - 5, 1e-5);
    assert_near(innovation.range_var_m2, bslam_range_variance_m2(&settings, &seen, 5), 1e-6);
    static uint8_t again[KEPT_BYTES_MAX];
    const uint32_t second = kept_write(&other, again);
    const bslam_map_source_t source = map_from_memory(again, second);
    bslam_map_fault_t fault;
    assert_int_equal(bslam_map_load(&slam, &source, BSLAM_MAP_FROZEN, &fault), BSLAM_OK);
    assert_near(slam.ekf.beacons[0].known_scale, 1.25, 1e-6);
}

static void test_map_load_truncated_anywhere_is_refused(void **state)
{
    const uint32_t whole = size;
    for (size = 0; size < whole; size += size < 200 ? 1 : 37) {
        assert_refused(BSLAM_MAP_TRUNCATED);
    }
}

static void test_map_load_with_a_byte_too_many_is_refused(void **state)
{
    size++;
    assert_refused(BSLAM_MAP_TOO_LONG);
}

static void test_map_check_finds_every_flipped_bit(void **state)
{
    for (uint32_t bit = 0; bit < 8 * size; bit++) {
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        const bslam_map_source_t source = map_from_memory(bytes, size);
        assert_int_not_equal(bslam_map_check(&source), BSLAM_MAP_FINE);
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
}

/// A field that is wrong while the CRC is right.
typedef struct wrong {
    const char *what;
    uint32_t at;
    uint32_t value;
    bslam_map_fault_t fault;
} wrong_t;

static void test_map_load_of_wrong_content_with_a_right_crc_is_refused_by_name(void **state)
{
    const uint32_t v = values_at();
    const uint32_t first = BEACONS_AT;
    const uint32_t classifier = machine_at();
    const wrong_t cases[] = {
        {"magic", 0, 0x4d4c5343, BSLAM_MAP_NO_MAP},
        {"byte order", 4, 0x00010201, BSLAM_MAP_BYTE_ORDER},
        {"version 4", 4, 0x00040102, BSLAM_MAP_OTHER_VERSION},
        {"version 2", 4, 0x00020102, BSLAM_MAP_OTHER_VERSION},
        {"beacons", 12, BSLAM_BEACONS_MAX + 1, BSLAM_MAP_BEACONS},
        {"no beacons, but values", 12, 12u << 16, BSLAM_MAP_CONTENT},
        {"values", 12, 5 | 60000u << 16, BSLAM_MAP_CONTENT},
        {"columns", 24, 60000, BSLAM_MAP_BEACONS},
        {"fewer columns than values", 24, 11, BSLAM_MAP_CONTENT},
        {"classifiers", 16, (BSLAM_LEARNER_SLOTS + 1) | 71u << 16, BSLAM_MAP_CLASSIFIERS},
        {"features", 16, 4 | 70u << 16, BSLAM_MAP_CLASSIFIERS},
        {"next uid", 20, 2, BSLAM_MAP_CONTENT},
        {"reserved", 24, 13 | 1u << 16, BSLAM_MAP_CONTENT},
        {"column behind the last", first + 36, 13 | 1u << 16, BSLAM_MAP_CONTENT},
        {"columns that end behind the last", first + 36, 12 | 1u << 16, BSLAM_MAP_CONTENT},
        {"columns of another beacon", first + 36, 4 | 1u << 16, BSLAM_MAP_CONTENT},
        {"uid twice", first + BEACON_BYTES, 0, BSLAM_MAP_CONTENT},
        {"label", first + 4, 0x80000000, BSLAM_MAP_CONTENT},
        {"kind", first + 8, 3, BSLAM_MAP_CONTENT},
        {"classifier", first + 8, 4u << 16, BSLAM_MAP_CONTENT},
        {"scale NaN", first + 16, 0x7fc00000, BSLAM_MAP_NOT_FINITE},
        {"scale negative", first + 16, 0xbf800000, BSLAM_MAP_CONTENT},
        {"position NaN", first + 20, 0x7fc00000, BSLAM_MAP_NOT_FINITE},
        {"position far away", first + 20, 0x46a00000, BSLAM_MAP_CONTENT},
        {"state far away", v + 4, 0xc6a00000, BSLAM_MAP_CONTENT},
        {"state infinite", v + 4, 0x7f800000, BSLAM_MAP_NOT_FINITE},
        {"state huge", v + 4, 0x7f000000, BSLAM_MAP_NOT_FINITE},
        {"D NaN", d_at(1), 0xffc00001, BSLAM_MAP_NOT_FINITE},
        {"D negative", d_at(1), 0xbf800000, BSLAM_MAP_COVARIANCE},
        {"D negative, if ever so little", d_at(1), 0x80000001, BSLAM_MAP_COVARIANCE},
        {"D negative of what is no value", d_at(0), 0xbf800000, BSLAM_MAP_COVARIANCE},
        {"L infinite", l_at(3, 1), 0xff800000, BSLAM_MAP_NOT_FINITE},
        {"samples", classifier, 65, BSLAM_MAP_CLASSIFIERS},
        {"trained", classifier, 2u << 8, BSLAM_MAP_CONTENT},
        {"negatives", classifier, 0xffff0100, BSLAM_MAP_CLASSIFIERS},
        {"unit NaN", classifier + 4, 0x7fc00000, BSLAM_MAP_NOT_FINITE},
        {"unit negative", classifier + 4, 0xbf800000, BSLAM_MAP_CONTENT},
    };
    for (int i = 0; i < COUNT_OF(cases); i++) {
        setup(NULL);
        put_u32(cases[i].at, cases[i].value);
        seal();
        print_message("%s\n", cases[i].what);
        assert_refused(cases[i].fault);
    }
}

/// A beacon that moved to where no load would take it.
static void test_map_write_of_a_place_that_no_load_takes_says_so(void **state)
{
    setup(NULL);
    slam.ekf.mean[slam.ekf.beacons[0].at] = BSLAM_R(20001.0);
    map_memory_t memory = {bytes, KEPT_BYTES_MAX, 0};
    const bslam_map_sink_t sink = map_to_memory(&memory);
    bslam_map_fault_t fault;
    assert_int_equal(bslam_map_write(&slam, &sink, &fault), BSLAM_E_MAP);
    assert_int_equal(fault, BSLAM_MAP_CONTENT);
}

/// Neither what the map had nor what the robot had before it, whichever had more.
static void test_map_load_gives_no_uid_again(void **state)
{
    setup(NULL);
    const bslam_map_source_t source = map_from_memory(bytes, size);
    const uint32_t own[] = {0, 3, slam.ekf.next_uid, 1000, UINT32_MAX};
    for (int i = 0; i < COUNT_OF(own); i++) {
        bslam_map_fault_t fault;
        kept_empty(&other, &other_appearance);
        other.ekf.next_uid = own[i];
        assert_int_equal(bslam_map_load(&other, &source, BSLAM_MAP_LIVING, &fault), BSLAM_OK);
        assert_int_equal(other.ekf.next_uid, own[i] > slam.ekf.next_uid ? own[i] : slam.ekf.next_uid);
    }
}

static void test_map_load_with_a_negative_that_is_no_sample_is_refused(void **state)
{
    const uint32_t wrong[] = {0x00ff | 1u << 8, 0 | 4u << 8, (BSLAM_SEEDS_MAX) | 255u << 8};
    for (int i = 0; i < COUNT_OF(wrong); i++) {
        setup(NULL);
        put_u32(rivals_at(), wrong[i]);
        seal();
        assert_refused(BSLAM_MAP_CONTENT);
    }
}

static void test_map_load_by_a_robot_without_seeds_leaves_them_out(void **state)
{
    load(BSLAM_MAP_LIVING);
    const int negatives = other_appearance.learner.classifiers[0].negatives;
    put_u32(rivals_at(), 3 | 255u << 8);
    seal();
    load(BSLAM_MAP_LIVING);
    assert_int_equal(other_appearance.learner.classifiers[0].negatives, negatives - 1);
    static const bslam_sample_t seeds[4];
    other_appearance.learner.seeds = seeds;
    other_appearance.learner.seed_count = COUNT_OF(seeds);
    load(BSLAM_MAP_LIVING);
    assert_int_equal(other_appearance.learner.classifiers[0].negatives, negatives);
}

// ---- the covariance ---------------------------------------------------------------------------------------

static void test_map_load_of_a_variance_that_is_too_large_is_refused(void **state)
{
    put_float(d_at(1), 1e10f);
    put_float(l_at(2, 1), 9);  // 8.1e11, and 1e12 is allowed
    seal();
    load(BSLAM_MAP_LIVING);
    assert_true(bslam_ekf_is_sane(&other.ekf));
    assert_int_equal(kept_write(&other, bytes), size);
    put_float(l_at(2, 1), 11);
    seal();
    assert_refused(BSLAM_MAP_COVARIANCE);
    put_float(l_at(2, 1), 0);
    put_float(d_at(1), 1.1e12f);
    seal();
    assert_refused(BSLAM_MAP_COVARIANCE);
}

/// What a column that leaves had is the others' then: much of it, where they had hardly any.
static void test_map_load_of_a_factor_with_large_numbers_can_be_saved(void **state)
{
    put_float(d_at(0), 1e10f);
    put_float(d_at(1), 1e-24f);
    put_float(l_at(1, 0), 1e-9f);
    put_float(l_at(2, 0), 7);
    seal();
    load(BSLAM_MAP_LIVING);
    covariance_assert_sound(&other.ekf.factor);
    assert_near(bslam_ekf_covariance(&other.ekf, other.ekf.base_dim + 1, other.ekf.base_dim + 1), 49e10,
                49e4);
    size = kept_write(&other, bytes);
    load(BSLAM_MAP_LIVING);
}

/// What would not be loaded is not saved, so that the map saved before is kept.
static void test_map_write_of_a_variance_that_is_too_large_is_refused(void **state)
{
    static const double factors[][2] = {{1e6, 1001}, {1.1e12, 0}, {1e-30, 1.1e18}};
    for (int k = 0; k < COUNT_OF(factors); k++) {
        map_memory_t memory = {bytes, sizeof bytes, 0};
        const bslam_map_sink_t sink = map_to_memory(&memory);
        bslam_map_fault_t fault;
        kept_make(&slam, &appearance, 4);
        slam.ekf.factor.d[1] = real(factors[k][0]);
        *bslam_factor_element(&slam.ekf.factor, 2, 1) = real(factors[k][1]);
        assert_int_equal(bslam_map_write(&slam, &sink, &fault), BSLAM_E_MAP);
        assert_int_equal(fault, k < 2 ? BSLAM_MAP_COVARIANCE : BSLAM_MAP_NOT_FINITE);
    }
}

/// Whatever L is, with D >= 0 it is a covariance.
static void test_map_load_of_any_factor_gives_a_covariance(void **state)
{
    unit_random_t random = {31};
    const int columns = slam.ekf.factor.body_count;
    for (int round = 0; round < 30; round++) {
        for (int i = 0; i < columns; i++) {
            put_float(d_at(i), (float)pow(unit_random(&random, 0, 1), 8));
            for (int j = 0; i > 0 && j < i; j++) {
                put_float(l_at(i, j), (float)unit_random(&random, -3, 3));
            }
        }
        put_float(d_at((int)unit_random(&random, 0, columns)), 0);
        seal();
        load(BSLAM_MAP_LIVING);
        covariance_assert_sound(&other.ekf.factor);
    }
}

static bslam_settings_t plain_map_settings(void)
{
    bslam_settings_t settings = kept_settings();
    settings.association = 0;
    settings.confirm_sightings = 3;
    return settings;
}

static int64_t now_us;

/// Robots without appearance; how they differ is said.
static void begin_plain(const bslam_settings_t *saver, const bslam_settings_t *loader)
{
    int bad_id;
    slam.appearance = other.appearance = NULL;
    assert_int_equal(bslam_slam_init(&slam, saver, &bad_id), BSLAM_OK);
    assert_int_equal(bslam_slam_init(&other, loader, &bad_id), BSLAM_OK);
    now_us = 0;
}

static void drive(double left_m, double right_m)
{
    now_us += 40000;
    const bslam_odometry_reading_t reading = {
        .source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us, .left_m = real(left_m), .right_m = real(right_m)};
    assert_int_equal(bslam_slam_odometry(&slam, &reading), BSLAM_OK);
}

static void see(const bslam_sighting_t *sightings, int count)
{
    assert_int_equal(bslam_slam_sightings(&slam, now_us, sightings, count), BSLAM_OK);
}

/// Where beacon `label` is, on a ring about the start; seen from there.
static bslam_sighting_t on_ring(int label, bool has_range)
{
    const bslam_pose_t pose = bslam_slam_pose(&slam);
    const double dx = 4 * cos(2.4 * label) - (double)pose.x_m, dy = 4 * sin(2.4 * label) - (double)pose.y_m;
    const double bearing_rad = unit_angle_between(atan2(dy, dx), (double)pose.theta_rad);
    return has_range ? unit_polar(bearing_rad, hypot(dx, dy), label) : unit_direction(bearing_rad, label);
}

static void save_and_load(void)
{
    size = kept_write(&slam, bytes);
    load(BSLAM_MAP_LIVING);
    assert_same_map(&slam.ekf, &other.ekf);
}

/// Of these between the others, too, and of others that have gone.
static void test_map_load_beside_beacons_that_are_not_saved_is_exact(void **state)
{
    const bslam_settings_t settings = plain_map_settings();
    begin_plain(&settings, &settings);
    for (int b = 0; b < 8; b++) {
        for (int view = 0; view < (b % 3 == 1 ? 2 : 4); view++) {
            const bslam_sighting_t seen = on_ring(b, true);
            drive(0.01, 0.012);
            see(&seen, 1);
        }
    }
    assert_int_equal(slam.ekf.beacon_count, 8);
    save_and_load();
    assert_int_equal(other.ekf.beacon_count, 5);
    while (slam.ekf.beacon_count > 1) {
        assert_int_equal(bslam_slam_remove_beacon(&slam, slam.ekf.beacons[slam.ekf.beacon_count / 2].uid),
                         BSLAM_OK);
        save_and_load();
    }
}

/// Robots may have further states before the beacons, of which the other one knows nothing.
static void test_map_load_with_and_without_further_states_is_exact(void **state)
{
    for (int kind = 0; kind < 16; kind++) {
        bslam_settings_t saver = plain_map_settings(), loader = saver;
        saver.velocity_states = kind % 2;
        loader.velocity_states = kind / 2 % 2;
        saver.sensor_doubt = kind / 4 % 2 != 0 ? 1 : 0;
        loader.sensor_doubt = kind / 8 != 0 ? 1 : 0;
        begin_plain(&saver, &loader);
        for (int step = 0; step < 60; step++) {
            const bslam_sighting_t seen = on_ring(step % 5, step % 3 != 0);
            drive(0.02, 0.023);
            see(&seen, 1);
        }
        save_and_load();
        assert_int_equal(other.ekf.beacon_count, 5);
    }
}

/// Rays that became points stand behind younger beacons.
static void test_map_load_after_rays_settled_is_exact(void **state)
{
    bslam_settings_t settings = plain_map_settings();
    settings.ray_linear_limit = BSLAM_R(0.3);
    begin_plain(&settings, &settings);
    int out_of_order = 0;
    for (int step = 0; step < 240; step++) {
        bslam_sighting_t seen[4];
        drive(0.03, 0.034);
        for (int b = 0; b < 4; b++) {
            seen[b] = on_ring(b, b % 2 == 1);
        }
        see(seen, 4);
        for (int b = 1; step % 40 == 39 && b < slam.ekf.beacon_count; b++) {
            out_of_order += slam.ekf.beacons[b].at < slam.ekf.beacons[b - 1].at ? 1 : 0;
        }
        if (step % 40 == 39) {
            save_and_load();
        }
    }
    assert_true(out_of_order > 0);
    assert_int_equal(slam.ekf.ray_count, 0);
}

/// A robot that may be anywhere: what its beacons err by is common to all, but for centimetres.
static void test_map_load_of_a_doubt_of_30_m_keeps_the_centimetres(void **state)
{
    bslam_settings_t settings = plain_map_settings();
    settings.range_sd_floor_m = BSLAM_R(0.01);
    begin_plain(&settings, &settings);
    bslam_ekf_resume(&slam.ekf, &settings, 900, BSLAM_R(10.0));
    for (int view = 0; view < 20; view++) {
        bslam_sighting_t seen[6];
        drive(1e-4, 1e-4);
        for (int b = 0; b < 6; b++) {
            seen[b] = on_ring(b, true);
        }
        see(seen, 6);
    }
    assert_true(bslam_ekf_covariance(&slam.ekf, 3, 3) > 800);
    save_and_load();
}

/// A beacon that is where another one is, whose scale is known to nothing; a ray whose origin is known to the
/// last bit.
static void test_map_load_of_a_covariance_without_an_inverse_is_exact(void **state)
{
    const bslam_settings_t settings = plain_map_settings();
    begin_plain(&settings, &settings);
    for (int view = 0; view < 4; view++) {
        const bslam_sighting_t seen[] = {on_ring(0, true), on_ring(1, false), on_ring(2, true)};
        now_us += 40000;
        see(seen, 3);
    }
    bslam_ekf_t *ekf = &slam.ekf;
    const int at = ekf->beacons[0].at;
    const bslam_row_t same[2] = {{.other = {1, 0}, .at = (uint16_t)at, .dim = 2},
                                 {.other = {0, 1}, .at = (uint16_t)at, .dim = 2}};
    bslam_ekf_replace_point(ekf, 2, same);
    const dense_t p = covariance_of(ekf);
    const int copy = ekf->beacons[2].at, ray = ekf->beacons[1].at;
    assert_near(p.at[copy][copy] - 2 * p.at[copy][at] + p.at[at][at], 0, 1e-12);
    assert_true(p.at[ray][ray] == 0);
    save_and_load();
}

/// As many beacons as there may be, and rays.
static void make_largest_map(void)
{
    bslam_settings_t settings = plain_map_settings();
    settings.confirm_sightings = 1;
    begin_plain(&settings, &settings);
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        const double bearing_rad = -3 + 6.0 * b / BSLAM_BEACONS_MAX;
        for (int view = 1; view < 30; view++) {
            const bslam_sighting_t seen =
                b < BSLAM_RAYS_MAX ? unit_direction(bearing_rad, b) : unit_polar(bearing_rad, 3, b);
            drive(1e-4, 1e-4);
            see(&seen, 1);
        }
    }
}

static void test_map_load_of_the_largest_map_into_as_large_a_one_is_exact(void **state)
{
    make_largest_map();
    assert_int_equal(slam.ekf.dim, slam.ekf.base_dim + 2 * BSLAM_BEACONS_MAX + 2 * BSLAM_RAYS_MAX);
    save_and_load();
    // docs/MAP.md's sum has six columns beside the values.
    const int values = 2 * BSLAM_BEACONS_MAX + 2 * BSLAM_RAYS_MAX;
    const int fewer_columns = 6 - (slam.ekf.factor.body_count - values);
    assert_in_range(fewer_columns, 0, 6);
    assert_int_equal((int)size + 4 * fewer_columns * (1 + values),
                     56 + 38 * BSLAM_BEACONS_MAX + 30 * values + 2 * values * values);
    save_and_load();  // over what is there
    bslam_settings_t with_speeds = plain_map_settings();
    int bad_id;
    with_speeds.velocity_states = 1;
    assert_int_equal(bslam_slam_init(&other, &with_speeds, &bad_id), BSLAM_OK);
    save_and_load();
}

// ---- sources that fail ------------------------------------------------------------------------------------

/// Bytes of a map from a source that fails for good after so many reads.
static int reads_left;

static bool read_while_it_lasts(const void *context, uint32_t at, void *to, uint32_t count)
{
    const uint8_t *from = context;
    memcpy(to, &from[at], count);
    reads_left--;
    return reads_left >= 0;
}

/// How often a load reads until it has looked at all of it, and how often in all.
typedef struct reads {
    int looked;
    int all;
} reads_t;

static reads_t count_reads(void)
{
    const bslam_map_source_t source = {read_while_it_lasts, bytes, size};
    bslam_map_fault_t fault;
    reads_left = INT32_MAX;
    assert_int_equal(bslam_map_load(&other, &source, BSLAM_MAP_LIVING, &fault), BSLAM_OK);
    const int all = INT32_MAX - reads_left;
    bytes[size - 1] ^= 1;
    reads_left = INT32_MAX;
    assert_int_equal(bslam_map_check(&source), BSLAM_MAP_BAD_CRC);
    const int frame = INT32_MAX - reads_left;  // its beginning and its CRC; the rest is looked at, then taken
    bytes[size - 1] ^= 1;
    return (reads_t){frame + (all - frame) / 2, all};
}

static void test_map_load_where_the_source_fails_is_refused(void **state)
{
    static bslam_slam_t before;
    const bslam_map_source_t source = {read_while_it_lasts, bytes, size};
    const reads_t reads = count_reads();
    memcpy(&before, &slam, sizeof slam);
    for (int read = 0; read < reads.looked; read++) {
        bslam_map_fault_t fault = BSLAM_MAP_FINE;
        reads_left = read;
        assert_int_equal(bslam_map_load(&slam, &source, BSLAM_MAP_LIVING, &fault), BSLAM_E_MAP);
        assert_int_equal(fault, BSLAM_MAP_UNREADABLE);
        assert_memory_equal(&slam, &before, sizeof slam);
    }
}

/// What was whole when it was looked at, and cannot be read a moment later: there is no map then, rather than
/// half of one.
static void test_map_load_where_the_source_fails_after_the_check_leaves_no_map(void **state)
{
    const bslam_map_source_t source = {read_while_it_lasts, bytes, size};
    const reads_t reads = count_reads();
    for (int read = reads.looked; read < reads.all; read += 7) {
        setup(NULL);
        reads_left = read;
        bslam_map_fault_t fault;
        assert_int_equal(bslam_map_load(&slam, &source, BSLAM_MAP_LIVING, &fault), BSLAM_E_MAP);
        assert_int_equal(fault, BSLAM_MAP_UNREADABLE);
        assert_int_equal(slam.ekf.beacon_count, 0);
        assert_true(slam.is_lost);
    }
}

/// A source that reads otherwise in one of a load's passes over it, each of which begins at its beginning.
static int pass, changing_pass;
static uint32_t changing_at;
static uint8_t change;

static bool read_changing(const void *context, uint32_t at, void *to, uint32_t count)
{
    memcpy(to, (const uint8_t *)context + at, count);
    pass += at == 0 ? 1 : 0;
    if (pass == changing_pass && changing_at >= at && changing_at < at + count) {
        ((uint8_t *)to)[changing_at - at] ^= change;
    }
    return true;
}

/// The frame's header, its CRC, the look at all of it; then it is taken.
enum { LOOKS = 3, TAKES = 4 };

static bslam_status_t load_changing(int in_pass, bslam_map_mode_t mode)
{
    const bslam_map_source_t source = {read_changing, bytes, size};
    bslam_map_fault_t fault = BSLAM_MAP_FINE;
    pass = 0;
    changing_pass = in_pass;
    const bslam_status_t status = bslam_map_load(&other, &source, mode, &fault);
    assert_true((status == BSLAM_OK) == (fault == BSLAM_MAP_FINE));
    return status;
}

static void test_map_load_of_a_source_that_changes_takes_no_byte_of_it(void **state)
{
    static const uint8_t changes[] = {0x01, 0x80, 0xff};
    static bslam_slam_t before;
    memcpy(&before, &other, sizeof other);
    for (changing_at = 0; changing_at < size - 4; changing_at++) {
        const bslam_map_mode_t mode = changing_at % 2 == 0 ? BSLAM_MAP_LIVING : BSLAM_MAP_FROZEN;
        change = changes[changing_at % 3];
        assert_int_equal(load_changing(LOOKS, mode), BSLAM_E_MAP);
        assert_memory_equal(&other, &before, sizeof other);
        assert_int_equal(load_changing(TAKES, mode), BSLAM_E_MAP);
        assert_int_equal(other.ekf.beacon_count, 0);
        assert_int_equal(other.ekf.dim, other.ekf.base_dim);
        assert_int_equal(other.ekf.next_uid, before.ekf.next_uid);
        kept_empty(&other, &other_appearance);
    }
    load(BSLAM_MAP_LIVING);
}

static void test_map_write_into_too_little_room_says_so(void **state)
{
    map_memory_t memory = {bytes, size - 1, 0};
    const bslam_map_sink_t sink = map_to_memory(&memory);
    bslam_map_fault_t fault;
    assert_int_equal(bslam_map_write(&slam, &sink, &fault), BSLAM_E_MAP);
    assert_int_equal(fault, BSLAM_MAP_UNREADABLE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_map_load_living_gives_beacons_covariance_and_looks_back, setup),
        cmocka_unit_test_setup(test_map_write_of_a_map_that_was_loaded_twice_gives_the_same_bytes, setup),
        cmocka_unit_test_setup(test_map_load_leaves_the_robot_without_a_place, setup),
        cmocka_unit_test_setup(test_map_load_frozen_changes_no_beacon_and_adds_none, setup),
        cmocka_unit_test_setup(test_map_write_leaves_out_tentative_beacons, setup),
        cmocka_unit_test_setup(test_map_load_gives_the_counts_of_classes_back, setup),
        cmocka_unit_test_setup(test_map_load_frozen_keeps_the_scale_of_a_sized_beacon, setup),
        cmocka_unit_test_setup(test_map_load_truncated_anywhere_is_refused, setup),
        cmocka_unit_test_setup(test_map_load_with_a_byte_too_many_is_refused, setup),
        cmocka_unit_test_setup(test_map_check_finds_every_flipped_bit, setup),
        cmocka_unit_test_setup(test_map_load_of_wrong_content_with_a_right_crc_is_refused_by_name, setup),
        cmocka_unit_test(test_map_write_of_a_place_that_no_load_takes_says_so),
        cmocka_unit_test(test_map_load_gives_no_uid_again),
        cmocka_unit_test_setup(test_map_load_with_a_negative_that_is_no_sample_is_refused, setup),
        cmocka_unit_test_setup(test_map_load_by_a_robot_without_seeds_leaves_them_out, setup),
        cmocka_unit_test_setup(test_map_load_of_a_variance_that_is_too_large_is_refused, setup),
        cmocka_unit_test_setup(test_map_load_of_a_factor_with_large_numbers_can_be_saved, setup),
        cmocka_unit_test_setup(test_map_write_of_a_variance_that_is_too_large_is_refused, setup),
        cmocka_unit_test_setup(test_map_load_of_any_factor_gives_a_covariance, setup),
        cmocka_unit_test_setup(test_map_load_beside_beacons_that_are_not_saved_is_exact, setup),
        cmocka_unit_test_setup(test_map_load_with_and_without_further_states_is_exact, setup),
        cmocka_unit_test_setup(test_map_load_after_rays_settled_is_exact, setup),
        cmocka_unit_test_setup(test_map_load_of_a_doubt_of_30_m_keeps_the_centimetres, setup),
        cmocka_unit_test_setup(test_map_load_of_a_covariance_without_an_inverse_is_exact, setup),
        cmocka_unit_test_setup(test_map_load_of_the_largest_map_into_as_large_a_one_is_exact, setup),
        cmocka_unit_test_setup(test_map_load_where_the_source_fails_is_refused, setup),
        cmocka_unit_test_setup(test_map_load_where_the_source_fails_after_the_check_leaves_no_map, setup),
        cmocka_unit_test_setup(test_map_load_of_a_source_that_changes_takes_no_byte_of_it, setup),
        cmocka_unit_test_setup(test_map_write_into_too_little_room_says_so, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
