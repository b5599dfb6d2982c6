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

enum { BEACONS_AT = 28, BEACON_BYTES = 36 };

static int setup(void **state)
{
    kept_make(&slam, &appearance, 4);
    size = kept_write(&slam, bytes);
    kept_empty(&other, &other_appearance);
    return 0;
}

/// Where the state values begin, and their covariance.
static uint32_t values_at(void)
{
    return BEACONS_AT + BEACON_BYTES * (uint32_t)slam.ekf.beacon_count;
}

static uint32_t covariance_at(void)
{
    return values_at() + 4u * (uint32_t)(slam.ekf.dim - slam.ekf.base_dim);
}

/// Where the first classifier stands in the blob, and its competitors.
static uint32_t machine_at(void)
{
    return covariance_at() + 4u * (uint32_t)((slam.ekf.dim - 3) * (slam.ekf.dim - 2) / 2);
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
    const int base = slam.ekf.base_dim;
    for (int i = base; i < slam.ekf.dim; i++) {
        for (int j = base; j <= i; j++) {
            const double was = (double)bslam_symmat_get(slam.ekf.covariance, i, j);
            assert_near(bslam_symmat_get(other.ekf.covariance, i, j), was, 1e-9 + 1e-6 * fabs(was));
        }
        for (int j = 0; j < base; j++) {
            assert_true(bslam_symmat_get(other.ekf.covariance, i, j) == 0);
        }
    }
    assert_int_equal(other.ekf.next_uid, slam.ekf.next_uid);
    for (int object = 0; object < 4; object++) {
        float signature[BSLAM_SAMPLE_FEATURES];
        bslam_sample_t sample;
        assert_int_equal(bslam_sample_encode(kept_signature(object, 50, signature), &sample), BSLAM_OK);
        for (int b = 0; b < 4; b++) {
            const bslam_opinion_t was = bslam_appearance_ask(&appearance, &slam.settings, b, &sample);
            const bslam_opinion_t is = bslam_appearance_ask(&other_appearance, &other.settings, b, &sample);
            assert_near(is.value, was.value, BSLAM_SAMPLE_FLOAT ? 0.02 : 0);
            assert_near(is.weight, was.weight, 0);
        }
    }
}

static void test_map_write_of_a_loaded_map_gives_the_same_bytes(void **state)
{
    static uint8_t again[KEPT_BYTES_MAX];
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
    const uint32_t p = covariance_at();
    const uint32_t first = BEACONS_AT;
    const uint32_t classifier = machine_at();
    const wrong_t cases[] = {
        {"magic", 0, 0x4d4c5343, BSLAM_MAP_NO_MAP},
        {"byte order", 4, 0x00010201, BSLAM_MAP_BYTE_ORDER},
        {"version 3", 4, 0x00030102, BSLAM_MAP_OTHER_VERSION},
        {"version 1", 4, 0x00010102, BSLAM_MAP_OTHER_VERSION},
        {"beacons", 12, BSLAM_BEACONS_MAX + 1, BSLAM_MAP_BEACONS},
        {"no beacons, but values", 12, 12u << 16, BSLAM_MAP_CONTENT},
        {"values", 12, 5 | 60000u << 16, BSLAM_MAP_BEACONS},
        {"classifiers", 16, (BSLAM_LEARNER_SLOTS + 1) | 71u << 16, BSLAM_MAP_CLASSIFIERS},
        {"features", 16, 4 | 70u << 16, BSLAM_MAP_CLASSIFIERS},
        {"next uid", 20, 2, BSLAM_MAP_CONTENT},
        {"reserved", 24, 1, BSLAM_MAP_CONTENT},
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
        {"covariance NaN", p + 4, 0xffc00001, BSLAM_MAP_NOT_FINITE},
        {"variance too small for its correlations", p, 0, BSLAM_MAP_COVARIANCE},
        {"variance negative", p + 8, 0xbf800000, BSLAM_MAP_COVARIANCE},
        {"correlation", p + 4, 0x41200000, BSLAM_MAP_COVARIANCE},
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

// ---- the covariance as a whole ----------------------------------------------------------------------------

/// Puts a covariance into the blob of which the first three values go together by these correlations, and all
/// others by none.
static void put_correlations(float second_first, float third_first, float third_second)
{
    const uint32_t p = covariance_at();
    const int values = slam.ekf.dim - slam.ekf.base_dim;
    uint32_t at = p;
    for (int i = 0; i < values; i++) {
        for (int j = 0; j <= i; j++) {
            put_float(at, j == i ? 0.25f : 0.0f);
            at += 4;
        }
    }
    put_float(p + 4, 0.25f * second_first);
    put_float(p + 12, 0.25f * third_first);
    put_float(p + 16, 0.25f * third_second);
    seal();
}

static void test_map_load_of_values_that_fit_by_pairs_only_is_refused(void **state)
{
    put_correlations(-0.9f, -0.9f, -0.9f);
    assert_int_equal(check(), BSLAM_MAP_FINE);  // which has no room for more
    assert_load_refuses(BSLAM_MAP_COVARIANCE);
    put_correlations(-0.49f, -0.49f, -0.49f);
    load(BSLAM_MAP_LIVING);
}

/// Rounding may leave it a little short of a covariance: what is taken is one.
static void test_map_load_of_a_covariance_short_by_rounding_raises_its_variances(void **state)
{
    put_correlations(-0.5f, -0.5f, -0.5004f);  // the least eigenvalue is 0.00013 of a variance below 0
    assert_int_equal(check(), BSLAM_MAP_FINE);
    load(BSLAM_MAP_LIVING);
    const int base = other.ekf.base_dim;
    for (int i = base; i < other.ekf.dim; i++) {
        assert_near(bslam_symmat_get(other.ekf.covariance, i, i), 0.25 * 1.001, 1e-6);
    }
    assert_near(bslam_symmat_get(other.ekf.covariance, base + 2, base + 1), 0.25 * -0.5004, 1e-7);
    size = kept_write(&other, bytes);
    load(BSLAM_MAP_LIVING);  // and saved it is whole: nothing is raised again
    assert_near(bslam_symmat_get(other.ekf.covariance, base, base), 0.25 * 1.001, 1e-6);
    size = kept_write(&slam, bytes);
    put_correlations(-0.5f, -0.5f, -0.505f);  // 0.0017 is more than that
    assert_load_refuses(BSLAM_MAP_COVARIANCE);
}

/// A beacon whose place is known to the last bit, as the first ray's origin is.
static void test_map_load_of_a_value_without_variance_asks_that_it_goes_with_no_other(void **state)
{
    put_correlations(0, 0.5f, 0);
    put_float(covariance_at() + 8, 0);
    seal();
    load(BSLAM_MAP_LIVING);
    assert_true(bslam_symmat_get(other.ekf.covariance, other.ekf.base_dim + 1, other.ekf.base_dim + 1) == 0);
    put_correlations(0, 0.5f, 1e-3f);
    put_float(covariance_at() + 8, 0);
    seal();
    assert_refused(BSLAM_MAP_COVARIANCE);
}

/// Twenty beacons, six of them with four values each: more than the robot's memory holds twice.
static void make_largest_map(void)
{
    bslam_settings_t settings = kept_settings();
    settings.association = 0;
    settings.confirm_sightings = 1;
    int bad_id;
    slam.appearance = NULL;
    assert_int_equal(bslam_slam_init(&slam, &settings, &bad_id), BSLAM_OK);
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        const double bearing_rad = -3 + 6.0 * b / BSLAM_BEACONS_MAX;
        const bslam_sighting_t seen =
            b < BSLAM_RAYS_MAX ? unit_direction(bearing_rad, b) : unit_polar(bearing_rad, 3, b);
        for (int time = 1; time < 30; time++) {
            const int64_t now_us = 40000 * (30 * b + time);
            const bslam_odometry_reading_t reading = {.source = BSLAM_ODOMETRY_WHEELS,
                                                      .time_us = now_us,
                                                      .left_m = real(1e-4),
                                                      .right_m = real(1e-4)};
            assert_int_equal(bslam_slam_odometry(&slam, &reading), BSLAM_OK);
            assert_int_equal(bslam_slam_sightings(&slam, now_us, &seen, 1), BSLAM_OK);
        }
    }
    kept_clear_unused(&slam);
}

static void test_map_load_beside_a_map_that_leaves_no_room_asks_to_forget_it(void **state)
{
    make_largest_map();
    assert_int_equal(slam.ekf.dim, slam.ekf.base_dim + 2 * BSLAM_BEACONS_MAX + 2 * BSLAM_RAYS_MAX);
    size = kept_write(&slam, bytes);
    load(BSLAM_MAP_LIVING);
    assert_int_equal(check(), BSLAM_MAP_FINE);
    assert_load_refuses(BSLAM_MAP_NO_ROOM);
    put_u32(size - 8, 0xbf800000);  // what else is wrong is said first
    seal();
    assert_refused(BSLAM_MAP_COVARIANCE);
    size = kept_write(&slam, bytes);
    bslam_slam_forget_map(&slam);
    const bslam_map_source_t source = map_from_memory(bytes, size);
    bslam_map_fault_t fault;
    assert_int_equal(bslam_map_load(&slam, &source, BSLAM_MAP_LIVING, &fault), BSLAM_OK);
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
        if (load_changing(LOOKS, mode) == BSLAM_OK) {
            // A covariance that seemed none was looked at once more, as a whole.
            assert_int_equal(pass, 2 * LOOKS + 1);
            kept_empty(&other, &other_appearance);
        }
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
        cmocka_unit_test_setup(test_map_write_of_a_loaded_map_gives_the_same_bytes, setup),
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
        cmocka_unit_test_setup(test_map_load_of_values_that_fit_by_pairs_only_is_refused, setup),
        cmocka_unit_test_setup(test_map_load_of_a_covariance_short_by_rounding_raises_its_variances, setup),
        cmocka_unit_test_setup(test_map_load_of_a_value_without_variance_asks_that_it_goes_with_no_other,
                               setup),
        cmocka_unit_test_setup(test_map_load_beside_a_map_that_leaves_no_room_asks_to_forget_it, setup),
        cmocka_unit_test_setup(test_map_load_where_the_source_fails_is_refused, setup),
        cmocka_unit_test_setup(test_map_load_where_the_source_fails_after_the_check_leaves_no_map, setup),
        cmocka_unit_test_setup(test_map_load_of_a_source_that_changes_takes_no_byte_of_it, setup),
        cmocka_unit_test_setup(test_map_write_into_too_little_room_says_so, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
