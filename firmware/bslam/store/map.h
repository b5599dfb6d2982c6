/// A map as bytes: beacons with their covariance, and the machines with their samples, to come back to
/// tomorrow or to carry to another robot. Every byte is in docs/MAP.md.
///
/// The same bytes load into a float build, a double build, and builds of other sizes as long as there is
/// room. What is refused is refused whole: the pipeline is as it was, to the bit, and the fault says why.
///
/// A CRC is no signature: whoever can write the blob is trusted.
#ifndef BSLAM_STORE_MAP_H
#define BSLAM_STORE_MAP_H

#include "bslam/bslam.h"
#include "bslam/slam/slam.h"

/// What is written. Version 1, without class counts and scales, is read, too.
#define BSLAM_MAP_VERSION 2

/// The name of a fault, "bad crc" say. Never NULL.
const char *bslam_map_fault_name(bslam_map_fault_t fault);

/// Bytes in memory to be written to, of which `count` are.
typedef struct bslam_map_memory {
    uint8_t *bytes;
    uint32_t capacity;
    uint32_t count;
} bslam_map_memory_t;

/// Memory as a sink, which cannot beyond its capacity; and as a source, mapped flash say.
bslam_map_sink_t bslam_map_to_memory(bslam_map_memory_t *memory);
bslam_map_source_t bslam_map_from_memory(const uint8_t *bytes, uint32_t size);

/// Frozen: nothing changes a beacon, and none is added. Living: the map goes on growing and improving.
typedef enum bslam_map_mode { BSLAM_MAP_LIVING = 0, BSLAM_MAP_FROZEN } bslam_map_mode_t;

/// Bytes that bslam_map_write would write. O(n² + machines).
uint32_t bslam_map_size(const bslam_slam_t *slam);

/// Writes the confirmed beacons, their covariance, and the machines that tell them apart. BSLAM_E_MAP with
/// *fault BSLAM_MAP_UNREADABLE: the sink failed. O(n² + machines), twice.
BSLAM_MUST_CHECK bslam_status_t bslam_map_write(const bslam_slam_t *slam, const bslam_map_sink_t *sink,
                                                bslam_map_fault_t *fault);

/// What bslam_map_load would say to this blob, but for what takes a pipeline's memory: of the covariance it
/// looks at pairs of values only, not whether all of them go together. O(n² + machines).
bslam_map_fault_t bslam_map_check(const bslam_map_source_t *source);

/// Takes the map in place of the pipeline's own. The robot is lost in it (bslam_slam_lose_pose): give it a
/// pose (bslam_slam_set_pose) or let it find one (recovery/recovery.h). Parameters, clock and counters stay.
/// BSLAM_E_MAP with *fault: refused, nothing has changed (but if a source that was whole when it was checked
/// can no longer be read, there is no map). Machines are taken where looks are attached.
///
/// Whether the covariance is one is found where the pipeline keeps its own, behind the rows in use: they hold
/// nothing, and zeros after. There is room for what the robot can hold if it has no map, and beside a map for
/// less: as many points as it has points. Else BSLAM_MAP_NO_ROOM: bslam_slam_forget_map, and load again. One
/// that rounding has left short of positive semidefinite by up to 0.1 % of its variances is taken with
/// variances larger by 0.1 %.
/// O(n³ / 6 + machines); beside it O(n² + machines), twice.
BSLAM_MUST_CHECK bslam_status_t bslam_map_load(bslam_slam_t *slam, const bslam_map_source_t *source,
                                               bslam_map_mode_t mode, bslam_map_fault_t *fault);

#endif
