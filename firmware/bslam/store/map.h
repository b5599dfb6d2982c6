/// A map as bytes: beacons with their covariance, and the classifiers with their samples. docs/MAP.md has
/// every byte. What is refused is refused whole: the pipeline is as it was, to the bit.
#ifndef BSLAM_STORE_MAP_H
#define BSLAM_STORE_MAP_H

#include "bslam/bslam.h"
#include "bslam/slam/slam.h"

#define BSLAM_MAP_VERSION 2

/// Frozen: nothing changes a beacon, and none is added. Living: the map goes on growing and improving.
typedef enum bslam_map_mode { BSLAM_MAP_LIVING = 0, BSLAM_MAP_FROZEN } bslam_map_mode_t;

/// Bytes that bslam_map_write would write. O(n² + samples).
uint32_t bslam_map_size(const bslam_slam_t *slam);

BSLAM_MUST_CHECK bslam_status_t bslam_map_write(const bslam_slam_t *slam, const bslam_map_sink_t *sink,
                                                bslam_map_fault_t *fault);

/// What bslam_map_load would say, but for what takes a pipeline's memory: of the covariance it looks at pairs
/// of values only, not whether all of them go together. O(n² + classifiers).
bslam_map_fault_t bslam_map_check(const bslam_map_source_t *source);

/// Whether the covariance is one is found where the pipeline keeps its own, behind the rows in use: they hold
/// nothing, and zeros after. There is room for what the robot can hold if it has no map, and beside a map for
/// less: as many points as it has points. Else BSLAM_MAP_NO_ROOM. One that rounding has left short of
/// positive semidefinite by up to 0.1 % of its variances is taken with variances larger by 0.1 %.
BSLAM_MUST_CHECK bslam_status_t bslam_map_load(bslam_slam_t *slam, const bslam_map_source_t *source,
                                               bslam_map_mode_t mode, bslam_map_fault_t *fault);

#endif
