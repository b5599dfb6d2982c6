// A map blob: any bytes, or a good map that was changed in places and given a right CRC again. What is
// refused leaves pipeline and machines as they were, to the bit; what is taken is sound, works on, and is
// written again.
#include "fuzz.h"

#include <string.h>

#include "map_memory.h"
#include "base/crc32.h"
#include "bslam/store/map.h"

enum { BLOB_MAX = 4096, LENGTH_AT = 8 };

typedef struct robot {
    bslam_slam_t slam;
    bslam_appearance_t appearance;
} robot_t;

static robot_t start;  ///< what each input begins with
static uint8_t good[2][BLOB_MAX];
static uint32_t good_size[2];  ///< of the same map without machines, and with them

static uint32_t write_map(const bslam_slam_t *slam, uint8_t bytes[BLOB_MAX])
{
    map_memory_t memory = {bytes, BLOB_MAX, 0};
    const bslam_map_sink_t sink = map_to_memory(&memory);
    bslam_map_fault_t fault;
    fuzz_require(bslam_map_write(slam, &sink, &fault) == BSLAM_OK && fault == BSLAM_MAP_FINE);
    fuzz_require(memory.count == bslam_map_size(slam));
    return memory.count;
}

static void prepare(void)
{
    fuzz_make_map(&start.slam, NULL);
    good_size[0] = write_map(&start.slam, good[0]);
    fuzz_make_map(&start.slam, &start.appearance);
    good_size[1] = write_map(&start.slam, good[1]);
}

static void put_u32(uint8_t *to, uint32_t value)
{
    for (int i = 0; i < 4; i++) {
        to[i] = (uint8_t)(value >> 8 * i);
    }
}

/// A good map with some of its bytes exchanged, perhaps longer or shorter.
static uint32_t patch(fuzz_input_t *input, unsigned which, uint8_t blob[BLOB_MAX])
{
    const uint32_t size = good_size[which];
    memcpy(blob, good[which], size);
    const uint32_t kept = size + (fuzz_u8(input) ^ 128u) - 128u;
    while (input->left > 2) {
        const unsigned at = fuzz_u16(input);
        blob[at % size] = fuzz_u8(input);
    }
    return kept < BLOB_MAX ? kept : size;
}

/// So that what stands between is looked at.
static void set_length_and_crc(uint8_t *blob, uint32_t size)
{
    if (size >= LENGTH_AT + 8) {
        put_u32(&blob[LENGTH_AT], size);
        put_u32(&blob[size - 4], ~bslam_crc32_add(BSLAM_CRC32_START, blob, size - 4));
    }
}

/// A step in the map that was loaded.
static void go_on(bslam_slam_t *slam)
{
    const bslam_pose_t origin = {0, 0, 0};
    const bslam_odometry_reading_t reading = {
        .time_us = 450000, .left_m = BSLAM_R(0.02), .right_m = BSLAM_R(0.03)};
    const bslam_sighting_t seen[2] = {
        {.bearing_rad = BSLAM_R(0.3), .range_m = 2, .has_range = true, .label = 1},
        {.bearing_rad = BSLAM_R(-0.9), .label = -1}};
    fuzz_require(bslam_slam_set_pose(slam, &origin, BSLAM_R(0.3), BSLAM_R(0.2)) == BSLAM_OK);
    fuzz_require(bslam_slam_odometry(slam, &reading) == BSLAM_OK);
    fuzz_require(bslam_slam_sightings(slam, reading.time_us, seen, 2) == BSLAM_OK);
    fuzz_require_sound(slam);
}

/// A map that was taken is written as one that is taken, beside itself.
static void write_again(const bslam_slam_t *slam)
{
    static robot_t other;
    uint8_t blob[BLOB_MAX];
    const uint32_t size = write_map(slam, blob);
    const bslam_map_source_t source = map_from_memory(blob, size);
    fuzz_require(bslam_map_check(&source) == BSLAM_MAP_FINE);
    bslam_map_fault_t fault;
    memcpy(&other.slam, slam, sizeof other.slam);
    other.slam.appearance = NULL;
    fuzz_require(bslam_map_load(&other.slam, &source, BSLAM_MAP_LIVING, &fault) == BSLAM_OK);
}

static void load(const uint8_t *blob, uint32_t size, bslam_map_mode_t mode, bool with_looks)
{
    static robot_t robot;
    const bslam_map_source_t source = map_from_memory(blob, size);
    memcpy(&robot, &start, sizeof robot);
    robot.slam.appearance = with_looks ? &robot.appearance : NULL;
    const bslam_slam_t *before = &start.slam;
    bslam_map_fault_t fault;
    const bslam_map_fault_t expected = bslam_map_check(&source);
    const bslam_status_t status = bslam_map_load(&robot.slam, &source, mode, &fault);
    fuzz_require(fault == expected);
    fuzz_require((status == BSLAM_OK) == (fault == BSLAM_MAP_FINE));
    if (status != BSLAM_OK) {
        robot.slam.appearance = before->appearance;
        fuzz_require(memcmp(&robot, &start, sizeof robot) == 0);
        return;
    }
    fuzz_require_sound(&robot.slam);
    if (mode == BSLAM_MAP_LIVING) {
        write_again(&robot.slam);
    }
    go_on(&robot.slam);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static uint8_t blob[BLOB_MAX];
    if (good_size[1] == 0) {
        prepare();
    }
    fuzz_input_t input = {data, size};
    const unsigned choice = fuzz_u8(&input);
    uint32_t length;
    if ((choice & 1u) != 0) {
        length = patch(&input, choice >> 1 & 1u, blob);
    } else {
        length = input.left < BLOB_MAX ? (uint32_t)input.left : BLOB_MAX;
        memcpy(blob, input.bytes, length);
    }
    if ((choice & 4u) != 0) {
        set_length_and_crc(blob, length);
    }
    load(blob, length, (choice & 8u) != 0 ? BSLAM_MAP_FROZEN : BSLAM_MAP_LIVING, (choice & 16u) != 0);
    return 0;
}
