/// Tells, on the board itself, whether the library computes there what it should: golden vectors from an
/// independent implementation (tests/vectors), known values, refusals. Writes TAP (testanything.org) over the
/// serial line, then ends with status 0 if all passed.
#include <string.h>

#include "bench/text.h"
#include "bslam/internal.h"
#include "link/crc16.h"
#include "port/port.h"

/// One step: what the wheels report, how many sightings follow, and the size of the state after it.
typedef struct vector_step {
    int64_t time_us;
    float left_m;
    float right_m;
    int sighting_count;
    int dim;
} vector_step_t;

/// range_m is 0 where it is seen in direction only.
typedef struct vector_sighting {
    int32_t label;
    float bearing_rad;
    float range_m;
} vector_sighting_t;

// The vectors are written in double: on the board they are rounded to float when they are compiled.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wfloat-conversion"
#pragma GCC diagnostic ignored "-Wunsuffixed-float-constants"
#define double float
#include "../../tests/vectors/filter_runs.h"
#include "base/scalar.h"
#undef double
#pragma GCC diagnostic pop

/// In standard deviations, which count as at least DEVIATION_MIN: as tests/unit/slam/test_vectors.c has it
/// for float.
#define TOLERANCE 1e-3f
#define DEVIATION_MIN 1e-3f
#define COUNT_OF(array) ((int)(sizeof(array) / sizeof((array)[0])))

typedef struct run {
    const vector_step_t *steps;
    int step_count;
    const vector_sighting_t *sightings;
    const float *means;
    const float *covariances;
} run_t;

static bslam_slam_t slam;

// ---- the report -------------------------------------------------------------------------------------------

static bool report(uint32_t number, const char *name, bool good)
{
    text_put(good ? "ok " : "not ok ");
    text_put_number(number);
    text_put(" - ");
    text_put(name);
    text_put("\n");
    return good;
}

// ---- golden vectors ---------------------------------------------------------------------------------------

static float deviation(const float *lower, int i)
{
    const float variance = lower[i * (i + 1) / 2 + i];
    return variance > DEVIATION_MIN * DEVIATION_MIN ? bslam_sqrt(variance) : DEVIATION_MIN;
}

static bool is_near(float value, float expected, float scale)
{
    return bslam_abs(value - expected) <= TOLERANCE * scale;
}

static bool is_near_mean(float value, float expected, float scale)
{
    // An angle may be a turn off.
    const float turn_rad = 6.2831855f;
    return is_near(value, expected, scale) || is_near(value + turn_rad, expected, scale) ||
           is_near(value - turn_rad, expected, scale);
}

static bool state_is(const bslam_ekf_t *ekf, const float *mean, const float *lower)
{
    for (int i = 0; i < ekf->dim; i++) {
        const float scale = deviation(lower, i);
        if (!is_near_mean(ekf->mean[i], mean[i], scale)) {
            return false;
        }
        for (int j = 0; j <= i; j++) {
            const float expected = lower[i * (i + 1) / 2 + j];
            if (!is_near(bslam_ekf_covariance(ekf, i, j), expected, scale * deviation(lower, j))) {
                return false;
            }
        }
    }
    return true;
}

static bool take_step(const vector_step_t *step, const vector_sighting_t *sightings)
{
    const bslam_odometry_reading_t reading = {.time_us = step->time_us,
                                              .source = BSLAM_ODOMETRY_WHEELS,
                                              .left_m = step->left_m,
                                              .right_m = step->right_m};
    bslam_sighting_t seen[8] = {0};
    if (step->sighting_count > COUNT_OF(seen) || bslam_slam_odometry(&slam, &reading) != BSLAM_OK) {
        return false;
    }
    for (int i = 0; i < step->sighting_count; i++) {
        seen[i].bearing_rad = sightings[i].bearing_rad;
        seen[i].range_m = sightings[i].range_m;
        seen[i].has_range = sightings[i].range_m > 0;
        seen[i].label = sightings[i].label;
    }
    return bslam_slam_sightings(&slam, step->time_us, seen, step->sighting_count) == BSLAM_OK;
}

static bool run_is_the_references(const bslam_settings_t *settings, run_t run)
{
    int bad_id = -1;
    if (bslam_slam_init(&slam, settings, &bad_id) != BSLAM_OK) {
        return false;
    }
    for (int k = 0; k < run.step_count; k++) {
        const vector_step_t *step = &run.steps[k];
        if (!take_step(step, run.sightings) || slam.ekf.dim != step->dim ||
            !state_is(&slam.ekf, run.means, run.covariances)) {
            return false;
        }
        run.sightings += step->sighting_count;
        run.means += step->dim;
        run.covariances += step->dim * (step->dim + 1) / 2;
    }
    return true;
}

#define RUN(name) \
    (run_t) \
    { \
        name##_steps, COUNT_OF(name##_steps), name##_sightings, name##_means, name##_covariances \
    }

static bool test_standard_filter(void)
{
    bslam_settings_t settings;
    standard_params(&settings);
    return run_is_the_references(&settings, RUN(standard));
}

static bool test_invariant_filter(void)
{
    bslam_settings_t settings;
    invariant_params(&settings);
    return run_is_the_references(&settings, RUN(invariant));
}

// ---- known values and refusals ----------------------------------------------------------------------------

static bool bits_are(float value, uint32_t expected)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits == expected;
}

/// IEEE 754 fixes these to the bit; volatile, so that the board computes them and not the compiler.
static bool test_arithmetic(void)
{
    const volatile float two = 2.0f;
    const volatile float three = 3.0f;
    const volatile float tiny = 1.17549435e-38f;
    return bits_are(bslam_sqrt(two), 0x3fb504f3u) && bits_are(two / three, 0x3f2aaaabu) &&
           bits_are(fmodf(1e6f * three, two * three - 0.5f), 0x40400000u) &&
           bits_are(tiny / two, 0x00400000u);  // a denormal is not flushed to zero
}

static bool test_link_crc(void)
{
    uint16_t crc = BSLAM_CRC16_START;
    for (int digit = '1'; digit <= '9'; digit++) {
        crc = bslam_crc16_add(crc, (uint8_t)digit);
    }
    return bslam_crc16_end(crc) == 0xd64e;
}

static bool test_refusal_changes_nothing(void)
{
    const volatile float zero = 0.0f;
    const uint64_t before = bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START);
    const bslam_odometry_reading_t bad = {
        .time_us = INT64_C(100000000), .source = BSLAM_ODOMETRY_WHEELS, .left_m = zero / zero};
    const bslam_sighting_t far = {.bearing_rad = 0, .range_m = 1e9f, .has_range = true, .label = 1};
    return bslam_slam_odometry(&slam, &bad) != BSLAM_OK &&
           bslam_slam_sightings(&slam, INT64_C(100000000), &far, 1) != BSLAM_OK &&
           bslam_slam_fingerprint(&slam, BSLAM_FINGERPRINT_START) == before;
}

int main(void)
{
    static const struct {
        const char *name;
        bool (*passes)(void);
    } tests[] = {
        {"arithmetic is IEEE 754's", test_arithmetic},
        {"standard filter is the reference's", test_standard_filter},
        {"invariant filter is the reference's", test_invariant_filter},
        {"a refusal changes nothing", test_refusal_changes_nothing},
        {"CRC of the link", test_link_crc},
    };
    uint32_t failed = 0;
    port_init();
    text_put("\nTAP version 14\n1..");
    text_put_number(COUNT_OF(tests));
    text_put("\n");
    for (uint32_t i = 0; i < COUNT_OF(tests); i++) {
        failed += report(i + 1, tests[i].name, tests[i].passes()) ? 0 : 1;
    }
    port_exit(failed == 0 ? 0 : 1);
}
