/// Sizes of the fuzzed build: so small that a few bytes of input fill the map, the history and the machines.
#ifndef FUZZ_SIZES_H
#define FUZZ_SIZES_H

#define BSLAM_BEACONS_MAX 4
#define BSLAM_RAYS_MAX 2
#define BSLAM_SIGHTINGS_MAX 3
#define BSLAM_HISTORY_MAX 3
#define BSLAM_SMOOTHER_NODES_MAX 8
#define BSLAM_SMOOTHER_SEEN_MAX 20
#define BSLAM_IMAGE_WIDTH_MAX 64
#define BSLAM_IMAGE_HEIGHT_MAX 36
#define BSLAM_CAMERAS_MAX 2
#define BSLAM_PROPOSALS_MAX 8
#define BSLAM_CANDIDATES_MAX 3
#define BSLAM_LEARNER_SLOTS 3
#define BSLAM_SAMPLES_PER_CLASSIFIER 2
#define BSLAM_NEGATIVES_MAX 8

#endif
