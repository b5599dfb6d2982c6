#include "kept_map.h"
#include "plain_settings.h"

bslam_settings_t kept_settings(void)
{
    bslam_settings_t settings = unit_settings();
    settings.association = 3;
    settings.left_speed_sd_mps = BSLAM_R(1e-3);
    settings.right_speed_sd_mps = BSLAM_R(1e-3);
    settings.learn_budget = 2000;
    return settings;
}

const float *kept_signature(int object, int view, float signature[BSLAM_SAMPLE_FEATURES])
{
    unit_random_t random = {(uint64_t)(1 + 997 * object + 31 * view)};
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        signature[k] = (float)unit_random(&random, 0, 0.1);
    }
    signature[3 * object] += 0.7f;
    signature[3 * object + 1] += 0.6f;
    return signature;
}

void kept_empty(bslam_slam_t *slam, bslam_appearance_t *appearance)
{
    const bslam_settings_t settings = kept_settings();
    int bad_id;
    memset(slam, 0, sizeof *slam);
    assert_int_equal(bslam_slam_init(slam, &settings, &bad_id), BSLAM_OK);
    if (appearance != NULL) {
        memset(appearance, 0, sizeof *appearance);
        assert_int_equal(bslam_appearance_init(appearance, NULL, 0), BSLAM_OK);
        bslam_slam_attach_appearance(slam, appearance);
    }
}

void kept_make(bslam_slam_t *slam, bslam_appearance_t *appearance, int objects)
{
    kept_empty(slam, appearance);
    for (int view = 1; view <= KEPT_VIEWS; view++) {
        const int64_t now_us = (int64_t)view * KEPT_STEP_US;
        const bslam_odometry_reading_t reading = {
            .source = BSLAM_ODOMETRY_WHEELS, .time_us = now_us, .left_m = real(1e-4), .right_m = real(1e-4)};
        float signatures[6][BSLAM_SAMPLE_FEATURES];
        bslam_sighting_t seen[7];
        for (int i = 0; i < objects; i++) {
            seen[i] = unit_polar(-1.5 + 0.6 * i, 2.0 + 0.4 * i, -1);
            seen[i].signature = kept_signature(i, view, signatures[i]);
        }
        seen[objects] = unit_direction(2.5, -1);
        assert_int_equal(bslam_slam_odometry(slam, &reading), BSLAM_OK);
        slam->travelled_um += 100000;  // as far as a classifier wants to learn again
        assert_int_equal(bslam_slam_sightings(slam, now_us, seen, objects + 1), BSLAM_OK);
    }
    assert_int_equal(slam->ekf.beacon_count, objects + 1);
}

uint32_t kept_write(const bslam_slam_t *slam, uint8_t bytes[KEPT_BYTES_MAX])
{
    map_memory_t memory = {bytes, KEPT_BYTES_MAX, 0};
    const bslam_map_sink_t sink = map_to_memory(&memory);
    bslam_map_fault_t fault;
    assert_int_equal(bslam_map_write(slam, &sink, &fault), BSLAM_OK);
    assert_int_equal(fault, BSLAM_MAP_FINE);
    assert_int_equal(memory.count, bslam_map_size(slam));
    return memory.count;
}

static uint32_t slot_bytes_of(const kept_flash_t *flash)
{
    return flash->slot_bytes < sizeof flash->slots[0] ? flash->slot_bytes : sizeof flash->slots[0];
}

/// True if there is power for one byte more.
static bool spend(kept_flash_t *flash)
{
    if (flash->left == 0) {
        return false;
    }
    flash->left--;
    flash->used++;
    return true;
}

static bool erase_slot(void *context, int slot)
{
    kept_flash_t *flash = context;
    for (size_t i = 0; i < slot_bytes_of(flash); i++) {
        if (!spend(flash)) {
            flash->slots[slot][i] ^= (uint8_t)(0x5a + i);
            return false;
        }
        flash->slots[slot][i] = 0xff;
    }
    return true;
}

static bool write_slot(void *context, int slot, uint32_t at, const void *bytes, uint32_t count)
{
    kept_flash_t *flash = context;
    const uint8_t *from = bytes;
    assert_true(at % BSLAM_FLASH_PIECE == 0 && count % BSLAM_FLASH_PIECE == 0);
    for (uint32_t i = 0; i < count; i++) {
        if (!spend(flash)) {
            return false;
        }
        assert_int_equal(flash->slots[slot][at + i], 0xff);
        flash->slots[slot][at + i] = from[i];
    }
    return true;
}

static bool read_slot(void *context, int slot, uint32_t at, void *bytes, uint32_t count)
{
    const kept_flash_t *flash = context;
    assert_true(at + count <= sizeof flash->slots[slot]);
    memcpy(bytes, &flash->slots[slot][at], count);
    return true;
}

bslam_flash_t kept_flash(kept_flash_t *flash)
{
    return (bslam_flash_t){erase_slot, write_slot, read_slot, flash, slot_bytes_of(flash)};
}
