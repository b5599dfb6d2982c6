#include "kept_map.h"

#include "bslam/slam/fingerprint.h"
#include "bslam/store/guard.h"

static bslam_slam_t slam;
static bslam_slam_t copy;
static bslam_slam_t sealed;
static bslam_guard_t guard;

static int setup(void **state)
{
    kept_make(&slam, NULL, 3);
    guard = (bslam_guard_t){.copy = &copy};
    bslam_guard_seal(&guard, &slam);
    sealed = slam;
    return 0;
}

static void flip(bslam_slam_t *of, size_t byte, size_t bit)
{
    ((uint8_t *)of)[byte] ^= (uint8_t)(1u << bit);
}

/// What a step makes of a state.
static uint64_t step(bslam_slam_t *of)
{
    const int64_t time_us = (KEPT_VIEWS + 1) * KEPT_STEP_US;
    const bslam_odometry_reading_t reading = {
        .source = BSLAM_ODOMETRY_WHEELS, .time_us = time_us, .left_m = real(0.01), .right_m = real(0.02)};
    const bslam_sighting_t seen[] = {unit_polar(-1.5, 2.0, -1), unit_direction(2.4, -1)};
    assert_int_equal(bslam_slam_odometry(of, &reading), BSLAM_OK);
    assert_int_equal(bslam_slam_sightings(of, time_us, seen, 2), BSLAM_OK);
    return bslam_slam_fingerprint(of, BSLAM_FINGERPRINT_START);
}

static void test_guard_finds_any_flipped_bit_that_a_step_depends_on(void **state)
{
    const uint64_t expected = step(&slam);
    size_t found = 0;
    size_t tried = 0;
    for (size_t byte = 0; byte < sizeof slam; byte++) {
        for (size_t bit = 0; bit < 8; bit++) {
            slam = sealed;
            flip(&slam, byte, bit);
            if (bslam_guard_check(&guard, &slam) != BSLAM_OK) {
                found++;
            } else if ((byte + bit) % unit_every(8) == 0) {
                assert_true(step(&slam) == expected);
                tried++;
            }
        }
    }
    assert_true(found > 8 * 1500);
    print_message("bit flips: %zu found, %zu of %zu others tried, 0 with an effect\n", found, tried,
                  8 * sizeof slam - found);
    assert_int_equal(guard.counters.corrupt, found);
}

static void test_guard_without_a_flip_is_content(void **state)
{
    assert_int_equal(bslam_guard_check(&guard, &slam), BSLAM_OK);
    (void)step(&slam);
    assert_int_equal(bslam_guard_check(&guard, &slam), BSLAM_E_STATE);  // not sealed again
    bslam_guard_seal(&guard, &slam);
    assert_int_equal(bslam_guard_check(&guard, &slam), BSLAM_OK);
}

static void test_guard_restore_gives_the_sealed_state_back(void **state)
{
    flip(&slam, offsetof(bslam_slam_t, ekf) + 8, 6);
    assert_int_equal(bslam_guard_check(&guard, &slam), BSLAM_E_STATE);
    assert_int_equal(bslam_guard_restore(&guard, &slam), BSLAM_OK);
    assert_memory_equal(&slam, &sealed, sizeof slam);
    assert_int_equal(bslam_guard_check(&guard, &slam), BSLAM_OK);
    assert_int_equal(guard.counters.restored, 1);
}

static void test_guard_restore_of_a_damaged_copy_is_refused(void **state)
{
    static bslam_slam_t before;
    flip(&slam, offsetof(bslam_slam_t, ekf) + 8, 6);
    before = slam;
    flip(&copy, offsetof(bslam_slam_t, ekf) + 16, 1);
    assert_int_equal(bslam_guard_restore(&guard, &slam), BSLAM_E_STATE);
    assert_memory_equal(&slam, &before, sizeof slam);
    guard = (bslam_guard_t){.copy = &copy};
    assert_int_equal(bslam_guard_restore(&guard, &slam), BSLAM_E_STATE);  // nothing was sealed
    assert_memory_equal(&slam, &before, sizeof slam);
    guard = (bslam_guard_t){.copy = NULL};
    assert_int_equal(bslam_guard_check(&guard, &slam), BSLAM_E_STATE);
    bslam_guard_seal(&guard, &slam);
    assert_int_equal(bslam_guard_restore(&guard, &slam), BSLAM_E_STATE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_guard_finds_any_flipped_bit_that_a_step_depends_on, setup),
        cmocka_unit_test_setup(test_guard_without_a_flip_is_content, setup),
        cmocka_unit_test_setup(test_guard_restore_gives_the_sealed_state_back, setup),
        cmocka_unit_test_setup(test_guard_restore_of_a_damaged_copy_is_refused, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
