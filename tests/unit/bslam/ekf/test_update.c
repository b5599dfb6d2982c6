#include "covariance.h"
#include "support.h"
#include "twin.h"
#include "plain_settings.h"

#include <math.h>

/// In double the finite differences of the expected rows limit the comparison. In float some hundred
/// roundings of numbers of order 1, times the condition of S: prior variances of 0.3 against measurement
/// variances of 4e-4.
#define TOLERANCE (BSLAM_REAL_DOUBLE ? 1e-8 : 3e-4)

static const bslam_pose_t mount = {BSLAM_R(0.2), BSLAM_R(-0.1), BSLAM_R(0.4)};

/// One sighting in a test: of which beacon, with or without a distance, and how far off the prediction.
typedef struct plan {
    int beacon;
    bool has_range;
    double range_off_m;
    double bearing_off_rad;
} plan_t;

#define SIGHTINGS_MAX 8

static plan_t random_plan(unit_random_t *random, int beacon, bool has_range)
{
    return (plan_t){beacon, has_range, unit_random(random, -0.3, 0.3), unit_random(random, -0.05, 0.05)};
}

/// The sighting that a plan makes in the present state.
static bslam_sighting_t sighting_of(const bslam_ekf_t *ekf, const plan_t *plan)
{
    double state[DENSE_MAX];
    double range_m;
    double bearing_rad;
    twin_values(ekf, state);
    twin_observe(ekf, &mount, plan->beacon, state, &range_m, &bearing_rad);
    const double bearing = bearing_rad + plan->bearing_off_rad;
    return plan->has_range ? unit_polar(bearing, range_m + plan->range_off_m, 0) : unit_direction(bearing, 0);
}

/// The same sighting as a textbook has it: rows of H, innovation, diagonal of R.
typedef struct measurement {
    dense_t h;
    dense_t y;
    dense_t r;
} measurement_t;

static void append(measurement_t *m, const dense_t *rows, int row, double y, double variance)
{
    const int at = m->h.rows;
    m->h.rows = m->y.rows = m->r.rows = m->r.columns = at + 1;
    m->h.columns = rows->columns;
    m->y.columns = 1;
    memcpy(m->h.at[at], rows->at[row], sizeof m->h.at[at]);
    memset(m->r.at[at], 0, sizeof m->r.at[at]);
    for (int i = 0; i < at; i++) {
        m->r.at[i][at] = 0;
    }
    m->y.at[at][0] = y;
    m->r.at[at][at] = variance;
}

/// What a heading in doubt adds to the noise of a sighting with a distance: of that, and of the direction.
typedef struct bent {
    double range_var_m2, bearing_var_rad2;
} bent_t;

static bent_t bent_by_heading(const bslam_ekf_t *ekf, const dense_t *rows, double range_m)
{
    const dense_t covariance = twin_of(ekf).covariance, with = dense_product(rows, &covariance);
    const double variance = covariance.at[BSLAM_STATE_THETA][BSLAM_STATE_THETA];
    if (variance < 0.0027) {
        return (bent_t){0, 0};
    }
    const double turn = with.at[1][BSLAM_STATE_THETA] / variance;
    const double along_m = range_m * with.at[1][BSLAM_STATE_THETA] * (1 + turn);
    const double across_rad = with.at[0][BSLAM_STATE_THETA] / range_m * (1 + 2 * turn);
    return (bent_t){0.75 * along_m * along_m, 0.75 * across_rad * across_rad};
}

/// Adds a sighting's rows. `weight` divides its noise.
static void measure(const bslam_ekf_t *ekf, const bslam_settings_t *settings, const plan_t *plan,
                    const bslam_sighting_t *sighting, double weight, measurement_t *m)
{
    const dense_t rows = twin_rows(ekf, &mount, plan->beacon);
    double state[DENSE_MAX];
    double range_m;
    double bearing_rad;
    twin_values(ekf, state);
    twin_observe(ekf, &mount, plan->beacon, state, &range_m, &bearing_rad);
    const double bearing_sd = (double)settings->bearing_sd_rad;
    const double factor = plan->has_range ? 1 : (double)settings->bearing_only_variance_factor;
    double sensor[3], scale;
    twin_sensor(ekf, &mount, state, sensor, &scale);
    const bool bends = plan->has_range && settings->filter != BSLAM_FILTER_STANDARD;
    const bent_t bent = bends ? bent_by_heading(ekf, &rows, range_m / scale) : (bent_t){0, 0};
    append(m, &rows, 1, unit_angle_between((double)sighting->bearing_rad, bearing_rad),
           (bearing_sd * bearing_sd * factor + bent.bearing_var_rad2) / weight);
    if (plan->has_range) {
        const double floor_m = (double)settings->range_sd_floor_m;
        const double fraction_m = (double)settings->range_sd_fraction * range_m;
        const double quadratic_m = (double)settings->range_sd_per_m * range_m * range_m;
        const bool is_sized = ekf->beacons[plan->beacon].kind == BSLAM_BEACON_SIZED;
        const double common_m = is_sized ? 0 : (double)settings->range_scale_sd * range_m;
        const double white_m2 = floor_m * floor_m + fraction_m * fraction_m + quadratic_m * quadratic_m;
        append(m, &rows, 0, (double)sighting->range_m - range_m,
               (white_m2 + common_m * common_m + bent.range_var_m2) / weight);
    }
}

static bslam_innovation_t innovation_of(const bslam_ekf_t *ekf, const bslam_settings_t *settings, int beacon,
                                        const bslam_sighting_t *sighting)
{
    bslam_innovation_t innovation;
    assert_int_equal(bslam_ekf_innovation(ekf, settings, &mount, sighting, beacon, &innovation), BSLAM_OK);
    return innovation;
}

static bslam_status_t fuse(bslam_ekf_t *ekf, const bslam_settings_t *settings, int beacon,
                           const bslam_sighting_t *sighting, bslam_fusion_t *fusion)
{
    const bslam_innovation_t innovation = innovation_of(ekf, settings, beacon, sighting);
    return bslam_ekf_fuse(ekf, settings, &innovation, fusion);
}

/// Fuses all plans in one frame, in C and as one batch of the textbook, and compares. The innovations are
/// taken before the first is fused.
static void assert_frame_is_the_textbooks(bslam_ekf_t *ekf, const bslam_settings_t *settings,
                                          const plan_t *plans, int count)
{
    measurement_t m = {0};
    bslam_innovation_t innovations[SIGHTINGS_MAX];
    for (int i = 0; i < count; i++) {
        const bslam_sighting_t sighting = sighting_of(ekf, &plans[i]);
        measure(ekf, settings, &plans[i], &sighting, 1, &m);
        innovations[i] = innovation_of(ekf, settings, plans[i].beacon, &sighting);
    }
    twin_t expected = twin_of(ekf);
    twin_update(ekf, settings->filter, &m.h, &m.y, &m.r, &expected);
    for (int i = 0; i < count; i++) {
        bslam_fusion_t fusion;
        assert_int_equal(bslam_ekf_fuse(ekf, settings, &innovations[i], &fusion), BSLAM_OK);
        assert_true(fusion.weight == 1);
    }
    bslam_ekf_correct(ekf, settings);
    twin_assert(ekf, &expected, TOLERANCE);
}

/// A random filter with three points and two rays.
static bslam_ekf_t random_filter(const bslam_settings_t *settings, unit_random_t *random)
{
    bslam_ekf_t ekf;
    twin_randomise(&ekf, settings, random, 3, 2);
    return ekf;
}

static bslam_settings_t params_of(int filter, bool velocity)
{
    bslam_settings_t settings = unit_settings();
    settings.filter = filter;
    settings.velocity_states = velocity ? 1 : 0;
    return settings;
}

// ---- one frame --------------------------------------------------------------------------------------------

static void assert_every_count_is_the_textbooks(int filter, bool velocity)
{
    // From 1 to 7 sightings, 1 to 11 scalars wait: below, at and beyond what one pass over the triangle
    // takes.
    const bslam_settings_t settings = params_of(filter, velocity);
    unit_random_t random = {1};
    for (int round = 0; round < 5; round++) {
        for (int count = 1; count <= 7; count++) {
            bslam_ekf_t ekf = random_filter(&settings, &random);
            plan_t plans[SIGHTINGS_MAX];
            for (int i = 0; i < count; i++) {
                plans[i] = random_plan(&random, i % 5, i % 5 < 3 && (i + round) % 3 != 0);
            }
            assert_frame_is_the_textbooks(&ekf, &settings, plans, count);
        }
    }
}

static void test_fuse_standard_any_number_of_sightings_is_the_batch_update(void **state)
{
    assert_every_count_is_the_textbooks(0, false);
}

static void test_fuse_standard_with_velocity_states_is_the_batch_update(void **state)
{
    assert_every_count_is_the_textbooks(0, true);
}

static void test_fuse_invariant_any_number_of_sightings_is_the_batch_update(void **state)
{
    assert_every_count_is_the_textbooks(1, false);
}

static void test_fuse_invariant_with_velocity_states_is_the_batch_update(void **state)
{
    assert_every_count_is_the_textbooks(1, true);
}

static void test_fuse_distance_of_a_ray_is_the_batch_update(void **state)
{
    for (int filter = 0; filter <= 1; filter++) {
        const bslam_settings_t settings = params_of(filter, false);
        unit_random_t random = {2};
        bslam_ekf_t ekf = random_filter(&settings, &random);
        const plan_t plans[] = {random_plan(&random, 3, true), random_plan(&random, 4, true)};
        assert_frame_is_the_textbooks(&ekf, &settings, plans, COUNT_OF(plans));
    }
}

static void test_fuse_sized_beacons_among_rays_is_the_batch_update(void **state)
{
    for (int filter = 0; filter <= 1; filter++) {
        bslam_settings_t settings = params_of(filter, true);
        settings.range_scale_sd = BSLAM_R(0.1);
        unit_random_t random = {2};
        bslam_ekf_t ekf = random_filter(&settings, &random);
        assert_int_equal(ekf.beacons[1].kind, BSLAM_BEACON_SIZED);
        for (int frame = 0; frame < 5; frame++) {
            const plan_t plans[] = {random_plan(&random, 0, true), random_plan(&random, 1, false),
                                    random_plan(&random, 2, true), random_plan(&random, 3, true)};
            assert_frame_is_the_textbooks(&ekf, &settings, plans, COUNT_OF(plans));
        }
    }
}

static void test_fuse_with_sensor_states_is_the_batch_update(void **state)
{
    unit_random_t random = {23};
    for (int kind = 0; kind < 8; kind++) {
        bslam_settings_t settings = params_of(kind % 2, kind / 2 % 2 != 0);
        settings.sensor_doubt = 1;
        settings.range_scale_sd = kind / 4 != 0 ? BSLAM_R(0.1) : 0;
        bslam_ekf_t ekf = random_filter(&settings, &random);
        int known;
        assert_int_equal(ekf.sensor_dim, BSLAM_SENSOR_DIM);
        assert_int_equal(bslam_ekf_add_known(&ekf, ekf.mean[0] + 3, ekf.mean[1] - 2, &known), BSLAM_OK);
        for (int frame = 0; frame < 5; frame++) {
            const plan_t plans[] = {random_plan(&random, 0, true), random_plan(&random, 1, false),
                                    random_plan(&random, known, true), random_plan(&random, 3, true),
                                    random_plan(&random, 4, false)};
            assert_frame_is_the_textbooks(&ekf, &settings, plans, COUNT_OF(plans));
        }
    }
}

static void test_fuse_frames_in_a_row_are_the_textbooks(void **state)
{
    for (int filter = 0; filter <= 1; filter++) {
        const bslam_settings_t settings = params_of(filter, true);
        unit_random_t random = {3};
        bslam_ekf_t ekf = random_filter(&settings, &random);
        for (int frame = 0; frame < 10; frame++) {
            const plan_t plans[] = {random_plan(&random, frame % 3, true), random_plan(&random, 3, false)};
            assert_frame_is_the_textbooks(&ekf, &settings, plans, COUNT_OF(plans));
        }
    }
}

static void test_fuse_order_within_a_frame_does_not_matter(void **state)
{
    const bslam_settings_t settings = params_of(1, true);
    unit_random_t random = {4};
    bslam_ekf_t forwards = random_filter(&settings, &random);
    bslam_ekf_t backwards = forwards;
    bslam_innovation_t innovations[5];
    for (int i = 0; i < 5; i++) {
        const plan_t plan = random_plan(&random, i, i < 3);
        const bslam_sighting_t sighting = sighting_of(&forwards, &plan);
        innovations[i] = innovation_of(&forwards, &settings, i, &sighting);
    }
    for (int i = 0; i < 5; i++) {
        bslam_fusion_t fusion;
        assert_int_equal(bslam_ekf_fuse(&forwards, &settings, &innovations[i], &fusion), BSLAM_OK);
        assert_int_equal(bslam_ekf_fuse(&backwards, &settings, &innovations[4 - i], &fusion), BSLAM_OK);
    }
    bslam_ekf_correct(&forwards, &settings);
    bslam_ekf_correct(&backwards, &settings);
    const twin_t expected = twin_of(&forwards);
    twin_assert(&backwards, &expected, BSLAM_REAL_DOUBLE ? 1e-12 : 3e-4);
}

static void test_fuse_known_beacon_corrects_the_robot_and_stays(void **state)
{
    for (int filter = 0; filter <= 1; filter++) {
        const bslam_settings_t settings = params_of(filter, false);
        unit_random_t random = {5};
        bslam_ekf_t ekf;
        twin_randomise(&ekf, &settings, &random, 2, 0);
        int index;
        const bslam_real_t x = ekf.mean[BSLAM_STATE_X] + 4;
        const bslam_real_t y = ekf.mean[BSLAM_STATE_Y] - 3;
        assert_int_equal(bslam_ekf_add_known(&ekf, x, y, &index), BSLAM_OK);
        for (int frame = 0; frame < 5; frame++) {
            const plan_t plans[] = {random_plan(&random, index, true), random_plan(&random, 0, true)};
            assert_frame_is_the_textbooks(&ekf, &settings, plans, COUNT_OF(plans));
        }
        bslam_real_t known_x;
        bslam_real_t known_y;
        bslam_ekf_beacon_position(&ekf, index, &known_x, &known_y);
        assert_true(known_x == x && known_y == y);
        const bslam_sym2_t none = bslam_ekf_beacon_covariance(&ekf, index);
        assert_true(none.xx == 0 && none.xy == 0 && none.yy == 0);
    }
}

static void test_fuse_leaves_mean_alone_until_correct(void **state)
{
    const bslam_settings_t settings = params_of(1, true);
    unit_random_t random = {6};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    bslam_real_t before[BSLAM_STATE_PADDED];
    memcpy(before, ekf.mean, sizeof before);
    const plan_t plan = random_plan(&random, 0, true);
    const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
    for (int i = 0; i < 6; i++) {
        bslam_fusion_t fusion;
        assert_int_equal(fuse(&ekf, &settings, 0, &sighting, &fusion), BSLAM_OK);
        assert_memory_equal(before, ekf.mean, sizeof before);
    }
}

static void test_correct_without_a_sighting_changes_no_bit(void **state)
{
    for (int filter = 0; filter <= 1; filter++) {
        const bslam_settings_t settings = params_of(filter, true);
        unit_random_t random = {7};
        bslam_ekf_t ekf = random_filter(&settings, &random);
        bslam_ekf_t before;
        memcpy(&before, &ekf, sizeof ekf);
        bslam_ekf_correct(&ekf, &settings);
        assert_memory_equal(&ekf, &before, sizeof ekf);
    }
}

// ---- distance, gate, Huber --------------------------------------------------------------------------------

/// Squared Mahalanobis distance yᵀ S⁻¹ y of a measurement in a state.
static double distance2_of(const measurement_t *m, const dense_t *covariance)
{
    const dense_t hph = dense_sandwich(&m->h, covariance);
    const dense_t s = dense_sum(&hph, &m->r);
    const dense_t inverse = dense_inverse(&s);
    const dense_t y_t = dense_transposed(&m->y);
    return dense_sandwich(&y_t, &inverse).at[0][0];
}

static void test_distance2_is_the_textbooks(void **state)
{
    const bslam_settings_t settings = params_of(0, true);
    unit_random_t random = {8};
    for (int i = 0; i < 50; i++) {
        bslam_ekf_t ekf = random_filter(&settings, &random);
        const plan_t plan = random_plan(&random, i % 5, i % 2 == 0);
        const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
        measurement_t m = {0};
        measure(&ekf, &settings, &plan, &sighting, 1, &m);
        const bslam_innovation_t innovation = innovation_of(&ekf, &settings, plan.beacon, &sighting);
        bslam_real_t distance2;
        assert_int_equal(bslam_ekf_distance2(&ekf, &innovation, &distance2), BSLAM_OK);
        const twin_t twin = twin_of(&ekf);
        const double expected = distance2_of(&m, &twin.covariance);
        assert_near(distance2, expected, TOLERANCE * (1 + expected));
    }
}

static void test_row_covariances_of_any_two_sightings_is_the_textbooks(void **state)
{
    bslam_settings_t settings = params_of(0, true);
    settings.sensor_doubt = 1;
    unit_random_t random = {20};
    const bslam_ekf_t ekf = random_filter(&settings, &random);
    const twin_t twin = twin_of(&ekf);
    for (int i = 0; i < 5; i++) {
        for (int j = 0; j < 5; j++) {
            const plan_t plans[] = {random_plan(&random, i, true), random_plan(&random, j, true)};
            const bslam_sighting_t seen[] = {sighting_of(&ekf, &plans[0]), sighting_of(&ekf, &plans[1])};
            const bslam_innovation_t a = innovation_of(&ekf, &settings, i, &seen[0]);
            const bslam_innovation_t b = innovation_of(&ekf, &settings, j, &seen[1]);
            const dense_t rows = twin_rows(&ekf, &mount, i), others = twin_rows(&ekf, &mount, j);
            const dense_t columns = dense_transposed(&others);
            const dense_t p = dense_product(&rows, &twin.covariance), all = dense_product(&p, &columns);
            const bslam_row_t of[] = {b.range_row, b.bearing_row, a.bearing_row};
            bslam_real_t covariances[COUNT_OF(of)];
            bslam_ekf_row_covariances(&ekf, &a.range_row, of, COUNT_OF(of), covariances);
            assert_near(covariances[0], all.at[0][0], TOLERANCE);
            assert_near(covariances[1], all.at[0][1], TOLERANCE);
            bslam_ekf_row_covariances(&ekf, &a.bearing_row, of, COUNT_OF(of), covariances);
            assert_near(covariances[0], all.at[1][0], TOLERANCE);
            assert_near(covariances[1], all.at[1][1], TOLERANCE);
        }
    }
}

static void test_fuse_distance2_is_conditional_on_what_was_fused_before(void **state)
{
    const bslam_settings_t settings = params_of(0, false);
    unit_random_t random = {9};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    const plan_t plans[] = {random_plan(&random, 0, true), random_plan(&random, 1, true)};
    const bslam_sighting_t sightings[] = {sighting_of(&ekf, &plans[0]), sighting_of(&ekf, &plans[1])};
    measurement_t first = {0};
    measurement_t both = {0};
    measure(&ekf, &settings, &plans[0], &sightings[0], 1, &first);
    measure(&ekf, &settings, &plans[0], &sightings[0], 1, &both);
    measure(&ekf, &settings, &plans[1], &sightings[1], 1, &both);
    const twin_t twin = twin_of(&ekf);
    const bslam_innovation_t second = innovation_of(&ekf, &settings, 1, &sightings[1]);
    bslam_fusion_t fusion;
    assert_int_equal(fuse(&ekf, &settings, 0, &sightings[0], &fusion), BSLAM_OK);
    const double first_d2 = distance2_of(&first, &twin.covariance);
    assert_near(fusion.distance2, first_d2, TOLERANCE * (1 + first_d2));
    assert_int_equal(bslam_ekf_fuse(&ekf, &settings, &second, &fusion), BSLAM_OK);
    // The chain rule: d2 of both = d2 of the first + d2 of the second given the first.
    const double both_d2 = distance2_of(&both, &twin.covariance);
    assert_near(fusion.distance2, both_d2 - first_d2, TOLERANCE * (1 + both_d2));
}

static void test_fuse_distance2_without_a_distance_is_that_of_the_direction(void **state)
{
    const bslam_settings_t settings = params_of(0, false);
    unit_random_t random = {19};
    for (int i = 0; i < 10; i++) {
        bslam_ekf_t ekf = random_filter(&settings, &random);
        const plan_t plan = random_plan(&random, i % 5, false);
        const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
        measurement_t m = {0};
        measure(&ekf, &settings, &plan, &sighting, 1, &m);
        const twin_t twin = twin_of(&ekf);
        bslam_fusion_t fusion;
        assert_int_equal(fuse(&ekf, &settings, plan.beacon, &sighting, &fusion), BSLAM_OK);
        assert_near(fusion.distance2, distance2_of(&m, &twin.covariance), TOLERANCE);
    }
}

static void test_fuse_just_inside_and_outside_the_gate(void **state)
{
    bslam_settings_t settings = params_of(1, false);
    unit_random_t random = {10};
    const bslam_ekf_t ekf = random_filter(&settings, &random);
    const plan_t plan = random_plan(&random, 0, true);
    const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
    bslam_ekf_t copy = ekf;
    bslam_fusion_t fusion;
    assert_int_equal(fuse(&copy, &settings, 0, &sighting, &fusion), BSLAM_OK);
    const bslam_real_t distance2 = fusion.distance2;

    copy = ekf;
    settings.gate_d2 = distance2;
    assert_int_equal(fuse(&copy, &settings, 0, &sighting, &fusion), BSLAM_OK);
    assert_true(fusion.weight == 1);

    copy = ekf;
    settings.gate_d2 = distance2 * real(0.999);
    assert_int_equal(fuse(&copy, &settings, 0, &sighting, &fusion), BSLAM_E_RANGE);
    assert_true(fusion.weight == 0 && fusion.distance2 == distance2);
    bslam_ekf_correct(&copy, &settings);
    assert_memory_equal(copy.mean, ekf.mean, sizeof ekf.mean);
    assert_memory_equal(&copy.factor, &ekf.factor, sizeof ekf.factor);
}

static void test_fuse_gated_sighting_between_others_has_no_effect(void **state)
{
    for (int filter = 0; filter <= 1; filter++) {
        // However many columns wait when it comes.
        for (int before = 1; before <= 4; before++) {
            bslam_settings_t settings = params_of(filter, false);
            unit_random_t random = {11};
            bslam_ekf_t ekf = random_filter(&settings, &random);
            bslam_ekf_t without = ekf;
            const plan_t outlier = {0, true, 3, 0.5};
            const bslam_sighting_t wrong = sighting_of(&ekf, &outlier);
            bslam_fusion_t fusion;
            for (int i = 0; i < before; i++) {
                const plan_t plan = {i, i < 3, 0.01, 0.001};
                const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
                assert_int_equal(fuse(&ekf, &settings, i, &sighting, &fusion), BSLAM_OK);
                assert_int_equal(fuse(&without, &settings, i, &sighting, &fusion), BSLAM_OK);
            }
            settings.gate_d2 = 9;
            assert_int_equal(fuse(&ekf, &settings, 0, &wrong, &fusion), BSLAM_E_RANGE);
            bslam_ekf_correct(&ekf, &settings);
            bslam_ekf_correct(&without, &settings);
            const twin_t expected = twin_of(&without);
            // Whether the down-dates were flushed before or after changes the last bits.
            twin_assert(&ekf, &expected, 16 * UNIT_ROUNDING * 8);
        }
    }
}

static void test_fuse_beyond_huber_counts_less(void **state)
{
    for (int filter = 0; filter <= 1; filter++) {
        bslam_settings_t settings = params_of(filter, false);
        unit_random_t random = {12};
        bslam_ekf_t ekf = random_filter(&settings, &random);
        const plan_t plan = {0, true, 0.4, 0.1};
        const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
        measurement_t plain = {0};
        measure(&ekf, &settings, &plan, &sighting, 1, &plain);
        twin_t expected = twin_of(&ekf);
        const double d = sqrt(distance2_of(&plain, &expected.covariance));

        settings.huber_d = real(d / 4);
        measurement_t weighted = {0};
        measure(&ekf, &settings, &plan, &sighting, 0.25, &weighted);
        twin_update(&ekf, filter, &weighted.h, &weighted.y, &weighted.r, &expected);
        bslam_fusion_t fusion;
        assert_int_equal(fuse(&ekf, &settings, 0, &sighting, &fusion), BSLAM_OK);
        assert_near(fusion.weight, 0.25, TOLERANCE);
        assert_near(fusion.distance2, d * d, TOLERANCE * (1 + d * d));
        bslam_ekf_correct(&ekf, &settings);
        twin_assert(&ekf, &expected, TOLERANCE);
    }
}

static void test_fuse_within_huber_has_full_weight(void **state)
{
    bslam_settings_t settings = params_of(0, false);
    unit_random_t random = {13};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    const plan_t plan = {0, true, 0.4, 0.1};
    const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
    settings.huber_d = 1000;
    bslam_fusion_t fusion;
    assert_int_equal(fuse(&ekf, &settings, 0, &sighting, &fusion), BSLAM_OK);
    assert_true(fusion.weight == 1);
}

// ---- the bend of a direction's model ----------------------------------------------------------------------

/// What beacon 0's direction adds to its variance by the bend of its model, the textbook's way: half the
/// trace of (Hessian P)², with the Hessian by differences of the gradient.
static double bend_by_hessian(const bslam_ekf_t *ekf, int beacon)
{
    const double step = 1e-3;
    dense_t hessian = dense_zero(ekf->dim, ekf->dim);
    for (int i = 0; i < ekf->dim; i++) {
        dense_t gradients[2];
        for (int side = 0; side < 2; side++) {
            bslam_ekf_t moved = *ekf;
            moved.mean[i] += real(side == 0 ? -step : step);
            gradients[side] = twin_rows(&moved, &mount, beacon);
        }
        for (int j = 0; j < ekf->dim; j++) {
            hessian.at[i][j] = (gradients[1].at[1][j] - gradients[0].at[1][j]) / (2 * step);
        }
    }
    const twin_t twin = twin_of(ekf);
    const dense_t hp = dense_product(&hessian, &twin.covariance);
    const dense_t hphp = dense_product(&hp, &hp);
    double trace = 0;
    for (int i = 0; i < ekf->dim; i++) {
        trace += hphp.at[i][i];
    }
    return trace / 2;
}

static void forget_heading(bslam_ekf_t *ekf)
{
    covariance_forget(ekf, BSLAM_STATE_THETA, 0);
}

static void test_innovation_of_a_points_direction_grows_by_the_bend_of_its_model(void **state)
{
    // With the heading known: where it is not, the bend depends on the coordinates of the error.
    bslam_settings_t settings = params_of(0, false);
    settings.bearing_only_curvature_factor = 3;
    unit_random_t random = {16};
    for (int i = 0; i < 20; i++) {
        bslam_ekf_t ekf = random_filter(&settings, &random);
        forget_heading(&ekf);
        const plan_t plan = random_plan(&random, i % 3, false);
        const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
        const bslam_innovation_t innovation = innovation_of(&ekf, &settings, plan.beacon, &sighting);
        const double expected = 0.02 * 0.02 * 2 + 3 * bend_by_hessian(&ekf, plan.beacon);
        // Differences of gradients: step² in double; in float the mean's own rounding over the step.
        assert_near(innovation.bearing_var_rad2, expected, expected * (BSLAM_REAL_DOUBLE ? 1e-4 : 1e-2));
    }
}

static void test_innovation_bearing_only_grows_with_doubt_of_length_and_direction(void **state)
{
    // MATH "Bearing-only": e P eᵀ b P bᵀ + (e P bᵀ)², where b is the direction's row of H and e the
    // gradient of the log of the length: a point's distance, a ray's |g|, g = inverse (anchor - sensor) +
    // direction.
    bslam_settings_t settings = params_of(0, false);
    settings.bearing_only_curvature_factor = 3;
    unit_random_t random = {17};
    for (int i = 0; i < 50; i++) {
        const bslam_ekf_t ekf = random_filter(&settings, &random);
        const int beacon = i % 5;
        const plan_t plan = random_plan(&random, beacon, false);
        const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
        const bslam_innovation_t innovation = innovation_of(&ekf, &settings, beacon, &sighting);
        double values[DENSE_MAX];
        double range_m;
        double bearing_rad;
        twin_values(&ekf, values);
        twin_observe(&ekf, &mount, beacon, values, &range_m, &bearing_rad);
        dense_t rows = twin_rows(&ekf, &mount, beacon);
        for (int k = 0; k < ekf.dim; k++) {
            rows.at[0][k] /= range_m;
        }
        if (ekf.beacons[beacon].kind == BSLAM_BEACON_RAY) {
            const int at = ekf.beacons[beacon].at + 3;
            rows.at[0][at] += 1 / values[at];
        }
        const twin_t twin = twin_of(&ekf);
        const dense_t p = dense_sandwich(&rows, &twin.covariance);
        const double bend = p.at[0][0] * p.at[1][1] + p.at[0][1] * p.at[0][1];
        assert_near(innovation.bearing_var_rad2, 0.02 * 0.02 * 2 + 3 * bend, TOLERANCE);
    }
}

static void test_innovation_with_a_distance_has_no_bend_of_directions(void **state)
{
    bslam_settings_t settings = params_of(0, false);
    settings.bearing_only_curvature_factor = 3;
    unit_random_t random = {18};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    forget_heading(&ekf);
    const plan_t plan = random_plan(&random, 0, true);
    const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
    const bslam_innovation_t innovation = innovation_of(&ekf, &settings, 0, &sighting);
    assert_near(innovation.bearing_var_rad2, 0.02 * 0.02, UNIT_ROUNDING * 1e-3);
}

/// What a heading of this variance adds, to a robot that has gone 2 m since and looks at a beacon 4 m ahead,
/// or 4 m to its left.
static bent_t bent_at(double heading_var_rad2, bool is_ahead)
{
    const bslam_settings_t settings = params_of(BSLAM_FILTER_INVARIANT, false);
    const bslam_pose_t origin = {0, 0, 0};
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    int index;
    assert_int_equal(bslam_ekf_add_known(&ekf, is_ahead ? 4 : 0, is_ahead ? 0 : 4, &index), BSLAM_OK);
    dense_t p = dense_zero(3, 3);
    p.at[BSLAM_STATE_THETA][BSLAM_STATE_THETA] = heading_var_rad2;
    p.at[BSLAM_STATE_Y][BSLAM_STATE_THETA] = p.at[BSLAM_STATE_THETA][BSLAM_STATE_Y] = 2 * heading_var_rad2;
    p.at[BSLAM_STATE_Y][BSLAM_STATE_Y] = 4 * heading_var_rad2 + 0.01;
    covariance_set(&ekf, &p);
    const bslam_sighting_t sighting = unit_polar(is_ahead ? 0 : 1.570796, 4, 0);
    bslam_innovation_t innovation;
    assert_int_equal(bslam_ekf_innovation(&ekf, &settings, &origin, &sighting, index, &innovation), BSLAM_OK);
    const double floor_m = 0.01, fraction_m = 0.08, quadratic_m = 0.16;
    const double white_m2 = floor_m * floor_m + fraction_m * fraction_m + quadratic_m * quadratic_m;
    return (bent_t){(double)innovation.range_var_m2 - white_m2,
                    (double)innovation.bearing_var_rad2 - 0.02 * 0.02};
}

/// On the arc on which it may stand the robot is farther from what is ahead than on the tangent, by 3/2 of
/// the squared error of its heading; and to a side of what is aside, by a quarter of it.
static void test_innovation_with_a_distance_grows_by_the_bend_of_a_heading_in_doubt(void **state)
{
    const double tolerance = UNIT_ROUNDING;
    const bent_t ahead = bent_at(0.04, true), aside = bent_at(0.04, false), little = bent_at(0.0026, true);
    assert_near(ahead.range_var_m2, 0.75 * 0.12 * 0.12, tolerance);
    assert_near(ahead.bearing_var_rad2, 0, tolerance);
    assert_near(aside.range_var_m2, 0, tolerance);
    assert_near(aside.bearing_var_rad2, 0.75 * 0.02 * 0.02, tolerance);
    assert_near(little.range_var_m2, 0, tolerance);
    assert_near(bent_at(0.0028, true).range_var_m2, 0.75 * 0.0084 * 0.0084, tolerance);
}

// ---- refusals ---------------------------------------------------------------------------------------------

static void test_innovation_of_a_beacon_at_the_sensor_is_singular(void **state)
{
    const bslam_settings_t settings = params_of(0, false);
    const bslam_pose_t at_origin = {0, 0, 0};
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, &settings);
    int index;
    assert_int_equal(bslam_ekf_add_known(&ekf, 0, 0, &index), BSLAM_OK);
    const bslam_sighting_t sighting = unit_polar(0, 1, 0);
    bslam_innovation_t innovation;
    assert_int_equal(bslam_ekf_innovation(&ekf, &settings, &at_origin, &sighting, index, &innovation),
                     BSLAM_E_SINGULAR);
}

static void test_innovation_of_a_distance_to_a_ray_at_infinity_is_singular(void **state)
{
    const bslam_settings_t settings = params_of(0, false);
    unit_random_t random = {14};
    bslam_ekf_t ekf = random_filter(&settings, &random);
    const bslam_sighting_t direction = unit_direction(0.1, 0);
    const bslam_sighting_t polar = unit_polar(0.1, 3, 0);
    static const double inverses[] = {0, -0.1};
    for (int i = 0; i < COUNT_OF(inverses); i++) {
        ekf.mean[ekf.beacons[3].at + 3] = real(inverses[i]);
        bslam_innovation_t innovation;
        assert_int_equal(bslam_ekf_innovation(&ekf, &settings, &mount, &direction, 3, &innovation), BSLAM_OK);
        assert_int_equal(bslam_ekf_innovation(&ekf, &settings, &mount, &polar, 3, &innovation),
                         BSLAM_E_SINGULAR);
    }
}

/// A filter whose S is not positive definite for beacon 0.
static bslam_ekf_t broken_filter(const bslam_settings_t *settings, unit_random_t *random)
{
    bslam_ekf_t ekf = random_filter(settings, random);
    covariance_break(&ekf, 0, ekf.dim);
    return ekf;
}

static void test_fuse_and_distance2_of_an_indefinite_state_are_singular(void **state)
{
    const bslam_settings_t settings = params_of(1, false);
    unit_random_t random = {15};
    const plan_t plans[] = {{0, true, 0, 0}, {0, false, 0, 0}};
    for (int i = 0; i < COUNT_OF(plans); i++) {
        bslam_ekf_t ekf = broken_filter(&settings, &random);
        const bslam_ekf_t before = ekf;
        const bslam_sighting_t sighting = sighting_of(&ekf, &plans[i]);
        const bslam_innovation_t innovation = innovation_of(&ekf, &settings, 0, &sighting);
        bslam_real_t distance2;
        bslam_fusion_t fusion;
        assert_int_equal(bslam_ekf_distance2(&ekf, &innovation, &distance2), BSLAM_E_SINGULAR);
        assert_int_equal(bslam_ekf_fuse(&ekf, &settings, &innovation, &fusion), BSLAM_E_SINGULAR);
        bslam_ekf_correct(&ekf, &settings);
        assert_memory_equal(ekf.mean, before.mean, sizeof before.mean);
        assert_memory_equal(&ekf.factor, &before.factor, sizeof before.factor);
    }
}

// ---- after a great doubt ----------------------------------------------------------------------------------

/// The largest |P_ij| / sqrt(P_ii P_jj) of all pairs of state values.
static double largest_correlation(const bslam_ekf_t *ekf)
{
    double largest = 0;
    for (int i = 0; i < ekf->dim; i++) {
        for (int j = 0; j < i; j++) {
            const double pii = (double)bslam_ekf_covariance(ekf, i, i);
            const double pjj = (double)bslam_ekf_covariance(ekf, j, j);
            const double pij = (double)bslam_ekf_covariance(ekf, i, j);
            const double correlation = pii > 0 && pjj > 0 ? fabs(pij) / sqrt(pii * pjj) : INFINITY;
            largest = fmax(largest, correlation);
        }
    }
    return largest;
}

static void assert_one_accurate_sighting_leaves_correlations_possible(int filter, double range_sd_m,
                                                                      double bearing_sd_rad)
{
    const bslam_settings_t settings = params_of(filter, false);
    unit_random_t random = {21};
    for (int round = 0; round < 2000; round++) {
        bslam_ekf_t ekf = random_filter(&settings, &random);
        if (round % 2 == 0) {
            bslam_ekf_resume(&ekf, &settings, 400, BSLAM_R(0.01));
        } else {
            const bslam_pose_t pose = bslam_ekf_pose(&ekf);
            bslam_ekf_set_pose(&ekf, &pose, 400, BSLAM_R(0.01));
        }
        const plan_t plan = {round % 3, true, 0, 0};
        bslam_sighting_t sighting = sighting_of(&ekf, &plan);
        sighting.range_sd_m = (bslam_real_t)range_sd_m;
        sighting.bearing_sd_rad = (bslam_real_t)bearing_sd_rad;
        const bslam_innovation_t innovation = innovation_of(&ekf, &settings, plan.beacon, &sighting);
        bslam_fusion_t fusion;
        assert_int_equal(bslam_ekf_fuse(&ekf, &settings, &innovation, &fusion), BSLAM_OK);
        bslam_ekf_correct(&ekf, &settings);
        assert_true(bslam_ekf_is_sane(&ekf));
        assert_true(largest_correlation(&ekf) <= 1);
    }
}

static void test_fuse_after_a_doubt_of_20_m_leaves_correlations_possible(void **state)
{
    for (int filter = 0; filter <= 1; filter++) {
        assert_one_accurate_sighting_leaves_correlations_possible(filter, 0.05, 0.02);
        assert_one_accurate_sighting_leaves_correlations_possible(filter, 0.001, 0.0005);
    }
}

/// A robot in great doubt of where it is starts two beacons a few millimetres from its sensor and moves by as
/// much: of what the rows look at, each value is in doubt by metres, and all have the same doubt.
static bslam_ekf_t filter_close_by(const bslam_settings_t *settings, unit_random_t *random)
{
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, settings);
    const bslam_real_t doubt_m2 = (bslam_real_t)unit_random(random, 1, 400);
    bslam_ekf_resume(&ekf, settings, doubt_m2, (bslam_real_t)unit_random(random, 0.01, 10));
    for (int b = 0; b < 2; b++) {
        int index;
        const double range_m = unit_random(random, 0.001, 0.01);
        const bslam_sighting_t sighting = unit_polar(unit_random(random, -3, 3), range_m, b);
        assert_int_equal(bslam_ekf_add(&ekf, settings, &mount, &sighting, &index), BSLAM_OK);
    }
    const bslam_motion_t motion = {.forward_m = (bslam_real_t)unit_random(random, -0.005, 0.005),
                                   .turn_rad = (bslam_real_t)unit_random(random, -0.02, 0.02),
                                   .forward_var_m2 = BSLAM_R(1e-4),
                                   .turn_var_rad2 = BSLAM_R(1e-4),
                                   .dt_s = BSLAM_R(0.04)};
    bslam_motion_t moved;
    bslam_ekf_predict(&ekf, settings, &motion, &moved);
    return ekf;
}

/// By how much |P_ij| exceeds sqrt(P_ii P_jj) at most, as part of what that was before.
static double largest_excess(const bslam_ekf_t *ekf, const bslam_ekf_t *before)
{
    double largest = 0;
    for (int i = 0; i < ekf->dim; i++) {
        for (int j = 0; j < i; j++) {
            const double pii = (double)bslam_ekf_covariance(ekf, i, i);
            const double pjj = (double)bslam_ekf_covariance(ekf, j, j);
            const double excess = fabs((double)bslam_ekf_covariance(ekf, i, j)) - sqrt(pii * pjj);
            const double was_ii = (double)bslam_ekf_covariance(before, i, i);
            const double was_jj = (double)bslam_ekf_covariance(before, j, j);
            largest = fmax(largest, excess / sqrt(was_ii * was_jj));
        }
    }
    return largest;
}

/// Fuses sightings of the first `count` beacons, those whose direction and distance float can still tell.
/// Returns how many.
static int see_close_by(bslam_ekf_t *ekf, const bslam_settings_t *settings, int count, bool has_range)
{
    int fused = 0;
    for (int b = 0; b < count; b++) {
        const plan_t plan = {b, has_range, 0, 0};
        const bslam_sighting_t sighting = sighting_of(ekf, &plan);
        bslam_innovation_t innovation;
        bslam_fusion_t fusion;
        if (bslam_ekf_innovation(ekf, settings, &mount, &sighting, b, &innovation) == BSLAM_OK &&
            bslam_ekf_fuse(ekf, settings, &innovation, &fusion) == BSLAM_OK) {
            fused++;
        }
    }
    bslam_ekf_correct(ekf, settings);
    return fused;
}

/// set_pose: in between the robot is put where it is for sure, and the beacons alone share the doubt.
static void assert_close_by_leaves_correlations_possible(int filter, bool velocity, bool set_pose)
{
    const bslam_settings_t settings = params_of(filter, velocity);
    unit_random_t random = {22};
    int fused = 0;
    for (int round = 0; round < 2000; round++) {
        bslam_ekf_t ekf = filter_close_by(&settings, &random);
        if (set_pose) {
            const bslam_pose_t pose = bslam_ekf_pose(&ekf);
            bslam_ekf_set_pose(&ekf, &pose, BSLAM_R(1e-6), BSLAM_R(1e-6));
        }
        const bslam_ekf_t before = ekf;
        fused += see_close_by(&ekf, &settings, 1 + round % 2, round % 3 != 0);
        assert_true(bslam_ekf_is_sane(&ekf));
        assert_true(largest_excess(&ekf, &before) <= 2 * (double)BSLAM_REAL_EPSILON);  // four roundings
    }
    assert_true(fused > 2000);
}

static void test_fuse_in_a_doubt_shared_with_beacons_close_by_leaves_correlations_possible(void **state)
{
    for (int k = 0; k < 8; k++) {
        assert_close_by_leaves_correlations_possible(k % 2, k / 2 % 2 != 0, k / 4 != 0);
    }
}

// ---- a step of the way ------------------------------------------------------------------------------------

/// The covariance becomes so much of itself that a beacon's predicted direction has this variance. Returns
/// H P Hᵀ.
static dense_t doubt_direction(bslam_ekf_t *ekf, int beacon, double variance_rad2)
{
    const dense_t rows = twin_rows(ekf, &mount, beacon);
    dense_t covariance = covariance_of(ekf);
    const double share = variance_rad2 / dense_sandwich(&rows, &covariance).at[1][1];
    for (int i = 0; i < covariance.rows; i++) {
        for (int j = 0; j < covariance.columns; j++) {
            covariance.at[i][j] *= share;
        }
    }
    covariance_set(ekf, &covariance);
    return dense_sandwich(&rows, &covariance);
}

static void
test_soften_adds_a_quarter_of_the_directions_doubt_and_as_many_times_the_distances_noise(void **state)
{
    static const double variances_rad2[] = {0.001, 0.0299, 0.0301, 0.5};
    bslam_settings_t settings = params_of(1, true);
    settings.sensor_doubt = 1;
    unit_random_t random = {24};
    for (int i = 0; i < 10 * COUNT_OF(variances_rad2); i++) {
        const double variance_rad2 = variances_rad2[i % COUNT_OF(variances_rad2)];
        bslam_ekf_t ekf = random_filter(&settings, &random);
        const plan_t plan = random_plan(&random, i % 5, true);
        const dense_t hph = doubt_direction(&ekf, plan.beacon, variance_rad2);
        const bslam_sighting_t sighting = sighting_of(&ekf, &plan);
        bslam_innovation_t innovation = innovation_of(&ekf, &settings, plan.beacon, &sighting), before;
        memcpy(&before, &innovation, sizeof before);
        assert_int_equal(bslam_ekf_soften(&ekf, &innovation), variance_rad2 > 0.03);
        if (variance_rad2 > 0.03) {
            const double bearing_rad2 = hph.at[1][1] / 4;
            const double range_m2 = before.range_var_m2 * bearing_rad2 / before.bearing_var_rad2;
            assert_near(innovation.range_var_m2 - before.range_var_m2, range_m2, TOLERANCE * range_m2);
            assert_near(innovation.bearing_var_rad2 - before.bearing_var_rad2, bearing_rad2,
                        TOLERANCE * bearing_rad2);
            innovation.range_var_m2 = before.range_var_m2;
            innovation.bearing_var_rad2 = before.bearing_var_rad2;
        }
        assert_memory_equal(&innovation, &before, sizeof before);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fuse_standard_any_number_of_sightings_is_the_batch_update),
        cmocka_unit_test(test_fuse_standard_with_velocity_states_is_the_batch_update),
        cmocka_unit_test(test_fuse_invariant_any_number_of_sightings_is_the_batch_update),
        cmocka_unit_test(test_fuse_invariant_with_velocity_states_is_the_batch_update),
        cmocka_unit_test(test_fuse_distance_of_a_ray_is_the_batch_update),
        cmocka_unit_test(test_fuse_sized_beacons_among_rays_is_the_batch_update),
        cmocka_unit_test(test_fuse_with_sensor_states_is_the_batch_update),
        cmocka_unit_test(test_fuse_frames_in_a_row_are_the_textbooks),
        cmocka_unit_test(test_fuse_order_within_a_frame_does_not_matter),
        cmocka_unit_test(test_fuse_known_beacon_corrects_the_robot_and_stays),
        cmocka_unit_test(test_fuse_leaves_mean_alone_until_correct),
        cmocka_unit_test(test_correct_without_a_sighting_changes_no_bit),

        cmocka_unit_test(test_distance2_is_the_textbooks),
        cmocka_unit_test(test_row_covariances_of_any_two_sightings_is_the_textbooks),
        cmocka_unit_test(test_fuse_distance2_is_conditional_on_what_was_fused_before),
        cmocka_unit_test(test_fuse_distance2_without_a_distance_is_that_of_the_direction),
        cmocka_unit_test(test_fuse_just_inside_and_outside_the_gate),
        cmocka_unit_test(test_fuse_gated_sighting_between_others_has_no_effect),
        cmocka_unit_test(test_fuse_beyond_huber_counts_less),
        cmocka_unit_test(test_fuse_within_huber_has_full_weight),

        cmocka_unit_test(test_innovation_of_a_points_direction_grows_by_the_bend_of_its_model),
        cmocka_unit_test(test_innovation_bearing_only_grows_with_doubt_of_length_and_direction),
        cmocka_unit_test(test_innovation_with_a_distance_has_no_bend_of_directions),
        cmocka_unit_test(test_innovation_with_a_distance_grows_by_the_bend_of_a_heading_in_doubt),

        cmocka_unit_test(test_innovation_of_a_beacon_at_the_sensor_is_singular),
        cmocka_unit_test(test_innovation_of_a_distance_to_a_ray_at_infinity_is_singular),
        cmocka_unit_test(test_fuse_and_distance2_of_an_indefinite_state_are_singular),

        cmocka_unit_test(
            test_soften_adds_a_quarter_of_the_directions_doubt_and_as_many_times_the_distances_noise),

        cmocka_unit_test(test_fuse_after_a_doubt_of_20_m_leaves_correlations_possible),
        cmocka_unit_test(test_fuse_in_a_doubt_shared_with_beacons_close_by_leaves_correlations_possible),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
