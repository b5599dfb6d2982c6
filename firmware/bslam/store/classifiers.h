/// The classifiers of a map's blob: their weights, samples and competitors.
#ifndef BSLAM_STORE_CLASSIFIERS_H
#define BSLAM_STORE_CLASSIFIERS_H

#include "bslam/slam/slam.h"
#include "bslam/store/codec.h"

#define BSLAM_MAP_NO_CLASSIFIER 0xffffu

/// Whether a beacon goes into the blob.
static inline bool bslam_map_saves(const bslam_ekf_t *ekf, int index)
{
    return ekf->beacons[index].confirmed;
}

/// Whether a classifier's slot is that of a beacon that goes into the blob.
bool bslam_map_owns(const bslam_slam_t *slam, int32_t slot);

/// The number that a classifier has in the blob, by its slot: saved ones in order. BSLAM_MAP_NO_CLASSIFIER:
/// it is not saved.
uint32_t bslam_map_classifier_number(const bslam_slam_t *slam, int32_t slot);

void bslam_map_write_classifier(bslam_codec_t *codec, const bslam_slam_t *slam, int32_t slot);

/// Reads as many classifiers; into no learner (NULL) they are only checked.
void bslam_map_read_classifiers(bslam_codec_t *codec, uint32_t classifiers, bslam_learner_t *learner);

#endif
