// The public calls.
#include "vision/vision.h"

#include <string.h>

#include "vision/instance.h"

_Static_assert(sizeof(bslam_candidate_t) <= BSLAM_VISION_SIZE_CANDIDATE, "size.h: a candidate");
_Static_assert(sizeof(bslam_rig_scanner_t) <= BSLAM_VISION_SIZE_RIG_SCANNER, "size.h: the scanner of a rig");
_Static_assert(sizeof(bslam_vision_instance_t) <= sizeof(bslam_vision_t), "size.h: the sum");

#if BSLAM_VISION_BUILT_IN
_Static_assert(sizeof(bslam_run_t) * BSLAM_RUNS_MAX <= BSLAM_VISION_SIZE_RUNS, "size.h: runs of cells");
_Static_assert(sizeof(bslam_thumbnail_t) <= BSLAM_VISION_SIZE_THUMBNAIL, "size.h: the picture");
_Static_assert(sizeof(bslam_proposals_t) <= BSLAM_VISION_SIZE_PROPOSALS, "size.h: boxes");
_Static_assert(sizeof(bslam_front_end_t) <= BSLAM_VISION_SIZE_FRONT_END, "size.h: the front end");

bslam_status_t bslam_vision_init_sized(bslam_vision_t *vision, size_t vision_bytes, uint32_t sizes_hash,
                                       const bslam_beacon_model_t *model, const bslam_camera_t *cameras,
                                       int32_t camera_count)
{
    if (vision_bytes != sizeof *vision || sizes_hash != BSLAM_VISION_HASH) {
        return BSLAM_E_SIZE;
    }
    bslam_vision_instance_t *instance = bslam_vision_instance(vision);
    const bslam_status_t status = bslam_front_end_init(&instance->front_end, model, cameras, camera_count);
    if (status == BSLAM_OK) {
        instance->scans = false;
#if BSLAM_VISION_TURNS
        bslam_turns_init(&instance->turns, &instance->front_end);
#endif
    }
    return status;
}
#endif

bslam_status_t bslam_vision_init_scanner_sized(bslam_vision_t *vision, size_t vision_bytes,
                                               uint32_t sizes_hash, const bslam_scanner_model_t *model,
                                               const bslam_camera_t *cameras, int32_t camera_count)
{
    if (vision_bytes != sizeof *vision || sizes_hash != BSLAM_VISION_HASH) {
        return BSLAM_E_SIZE;
    }
    bslam_vision_instance_t *instance = bslam_vision_instance(vision);
    const bslam_status_t status = bslam_rig_scanner_init(&instance->scanner, model, cameras, camera_count);
    if (status == BSLAM_OK) {
        instance->scans = true;
    }
    return status;
}

bslam_status_t bslam_vision_begin(bslam_vision_t *vision, int32_t camera, bslam_pixel_format_t format,
                                  int32_t width_px, int32_t height_px)
{
    bslam_vision_instance_t *instance = bslam_vision_instance(vision);
#if BSLAM_VISION_BUILT_IN
    if (!instance->scans) {
        return bslam_front_end_begin(&instance->front_end, camera, format, width_px, height_px);
    }
#endif
    return bslam_rig_scanner_begin(&instance->scanner, camera, format, width_px, height_px);
}

bslam_status_t bslam_vision_row(bslam_vision_t *vision, const void *pixels)
{
    bslam_vision_instance_t *instance = bslam_vision_instance(vision);
#if BSLAM_VISION_BUILT_IN
    if (!instance->scans) {
        return bslam_front_end_row(&instance->front_end, pixels);
    }
#endif
    return bslam_rig_scanner_row(&instance->scanner, pixels);
}

bslam_status_t bslam_vision_end(bslam_vision_t *vision, bool robot_moved)
{
    bslam_vision_instance_t *instance = bslam_vision_instance(vision);
#if BSLAM_VISION_BUILT_IN
    if (!instance->scans) {
        return bslam_front_end_end(&instance->front_end, robot_moved);
    }
#endif
    (void)robot_moved;  // a scanner remembers nothing
    return bslam_rig_scanner_end(&instance->scanner);
}

bslam_status_t bslam_vision_point(bslam_vision_t *vision, int32_t camera, bslam_real_t yaw_rad)
{
    bslam_vision_instance_t *instance = bslam_vision_instance(vision);
#if BSLAM_VISION_BUILT_IN
    if (!instance->scans) {
        return bslam_front_end_point(&instance->front_end, camera, yaw_rad);
    }
#endif
    return bslam_rig_scanner_point(&instance->scanner, camera, yaw_rad);
}

// ---- what is seen -----------------------------------------------------------------------------------------

bslam_vision_reason_t bslam_vision_reason(const bslam_vision_t *vision)
{
    const bslam_vision_instance_t *instance = bslam_const_vision_instance(vision);
#if BSLAM_VISION_BUILT_IN
    if (!instance->scans) {
        return instance->front_end.reason;
    }
#endif
    return instance->scanner.reason;
}

static const char *const reason_names[BSLAM_VISION_REASON_COUNT] = {
    [BSLAM_VISION_SEEN] = "seen",
    [BSLAM_VISION_NOTHING] = "nothing",
    [BSLAM_VISION_UNFINISHED] = "unfinished",
    [BSLAM_VISION_BLACK] = "black",
    [BSLAM_VISION_OVEREXPOSED] = "overexposed",
    [BSLAM_VISION_FLAT] = "flat",
};

const char *bslam_vision_reason_name(bslam_vision_reason_t reason)
{
    const unsigned number = (unsigned)reason;
    return number < BSLAM_VISION_REASON_COUNT ? reason_names[number] : "unknown reason";
}

const bslam_candidate_t *bslam_vision_candidates(const bslam_vision_t *vision, int32_t *count)
{
    const bslam_vision_instance_t *instance = bslam_const_vision_instance(vision);
#if BSLAM_VISION_BUILT_IN
    if (!instance->scans) {
        *count = instance->front_end.candidate_count;
        return instance->front_end.candidates;
    }
#endif
    *count = instance->scanner.candidate_count;
    return instance->scanner.candidates;
}

int32_t bslam_vision_sightings(const bslam_vision_t *vision, bslam_sighting_t sightings[BSLAM_CANDIDATES_MAX])
{
    int32_t candidates = 0, count = 0;
    const bslam_candidate_t *found = bslam_vision_candidates(vision, &candidates);
    for (int32_t i = 0; i < candidates; i++) {
        if (found[i].has_bearing) {
            sightings[count++] = bslam_sighting_of(&found[i]);
        }
    }
    return count;
}

bslam_vision_counters_t bslam_vision_counters(const bslam_vision_t *vision)
{
    const bslam_vision_instance_t *instance = bslam_const_vision_instance(vision);
    bslam_vision_counters_t counters = {0};
#if BSLAM_VISION_BUILT_IN
    if (!instance->scans) {
        const bslam_front_end_t *front_end = &instance->front_end;
        counters.candidates_dropped = front_end->candidates_dropped;
        counters.boxes_dropped = front_end->proposals.boxes_dropped;
        counters.runs_dropped = front_end->proposals.runs_dropped;
        memcpy(counters.frames, front_end->frames, sizeof counters.frames);
        return counters;
    }
#endif
    counters.candidates_dropped = instance->scanner.candidates_dropped;
    memcpy(counters.frames, instance->scanner.frames, sizeof counters.frames);
    return counters;
}

#if BSLAM_VISION_TURNS
bool bslam_vision_turn(bslam_vision_t *vision, bslam_turn_t *turn)
{
    bslam_vision_instance_t *instance = bslam_vision_instance(vision);
    return !instance->scans && bslam_turns_see(&instance->turns, &instance->front_end, turn);
}

void bslam_vision_forget_turns(bslam_vision_t *vision)
{
    bslam_vision_instance_t *instance = bslam_vision_instance(vision);
    if (!instance->scans) {
        bslam_turns_init(&instance->turns, &instance->front_end);
    }
}
#endif
