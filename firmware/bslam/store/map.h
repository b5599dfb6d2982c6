/// A map as bytes: beacons with their covariance, and the classifiers with their samples. docs/MAP.md has
/// every byte. What is refused is refused whole: the pipeline is as it was, to the bit.
#ifndef BSLAM_STORE_MAP_H
#define BSLAM_STORE_MAP_H

#include "bslam/bslam.h"
#include "bslam/slam/slam.h"

#define BSLAM_MAP_VERSION 3

/// Frozen: nothing changes a beacon, and none is added. Living: the map goes on growing and improving.
typedef enum bslam_map_mode { BSLAM_MAP_LIVING = 0, BSLAM_MAP_FROZEN } bslam_map_mode_t;

/// Bytes that bslam_map_write would write. O(n² + samples).
uint32_t bslam_map_size(const bslam_slam_t *slam);

BSLAM_MUST_CHECK bslam_status_t bslam_map_write(const bslam_slam_t *slam, const bslam_map_sink_t *sink,
                                                bslam_map_fault_t *fault);

/// What bslam_map_load would say. O(n² + classifiers).
bslam_map_fault_t bslam_map_check(const bslam_map_source_t *source);

/// O(n²), and once more for each value that the saved ones hung on and that is not saved itself.
BSLAM_MUST_CHECK bslam_status_t bslam_map_load(bslam_slam_t *slam, const bslam_map_source_t *source,
                                               bslam_map_mode_t mode, bslam_map_fault_t *fault);

#endif
