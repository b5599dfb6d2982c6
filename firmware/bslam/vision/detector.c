#include "bslam/vision/detector.h"

#include <stddef.h>
#include <string.h>

#include "bslam/base/types.h"

/// Of two candidates that overlap more than this, or of which one lies this much within the other, the surer
/// one stays.
#define OVERLAP_MAX BSLAM_R(0.3)
#define WITHIN_MAX BSLAM_R(0.7)
/// Natural logarithm of how many times too high or too low a candidate may be; the floor line errs too.
#define LOG_SIZE_MAX 1.0f

static float clamped(float value, float limit)
{
    const float high = value < limit ? value : limit;
    return high > -limit ? high : -limit;
}

static void clamp_all(float *values, int32_t count, float limit)
{
    for (int32_t i = 0; i < count; i++) {
        values[i] = clamped(values[i], limit);
    }
}

void bslam_detector_normalise(const bslam_detector_model_t *model, float features[BSLAM_BLOB_FEATURES])
{
    const float *restrict offset = model->blob_offset, *restrict scale = model->blob_scale;
    float *restrict x = features;
    for (int32_t i = 0; i < BSLAM_BLOB_FEATURES; i++) {
        x[i] = clamped((x[i] - offset[i]) * scale[i], BSLAM_FEATURE_LIMIT);
    }
}

/// The kind whose machine is surest, and by how much.
static void choose_class(const float *kinds, int32_t class_count, bslam_candidate_t *candidate)
{
    int32_t best = 0;
    int32_t next = -1;
    for (int32_t c = 1; c < class_count; c++) {
        if (kinds[c] > kinds[best]) {
            next = best;
            best = c;
        } else if (next < 0 || kinds[c] > kinds[next]) {
            next = c;
        }
    }
    candidate->beacon_class = (uint8_t)(best + 1);
    candidate->second_class = (uint8_t)(next + 1);
    candidate->class_margin = kinds[best] - (next < 0 ? -BSLAM_FUSION_LIMIT : kinds[next]);
}

/// True if the box is far from as high as its kind is, where the floor line tells; a box at the upper or
/// lower edge of the frame may be the part of something.
static bool is_of_another_size(const bslam_view_t *view, const bslam_proposal_t *proposal, float log_height,
                               float per_metre, float height_m)
{
    if (view->camera->lens != BSLAM_LENS_PINHOLE || !(per_metre > 0) || !(height_m > 0) ||
        proposal->top <= 0 || proposal->bottom >= view->frame->rows) {
        return false;
    }
    const float excess = log_height - bslam_log(height_m);
    return excess > LOG_SIZE_MAX || excess < -LOG_SIZE_MAX;
}

/// What the machines say of a proposal: the score, and of the size what is_of_another_size needs.
typedef struct opinion {
    float values[BSLAM_CLASSES_MAX + 3];
    float score;
    float log_height;
    float per_metre;
} opinion_t;

/// False if a machine refuses it. Not to be inlined: its kilobyte of stack is then free for what follows.
__attribute__((noinline)) static bool ask_machines(const bslam_detector_model_t *model, int32_t class_count,
                                                   const bslam_view_t *view, const bslam_proposal_t *proposal,
                                                   opinion_t *opinion)
{
    float features[BSLAM_BLOB_FEATURES];
    float *values = opinion->values;
    bslam_blob_features(view, proposal, features);
    opinion->log_height = features[BSLAM_BLOB_LOG_HEIGHT];
    opinion->per_metre = features[BSLAM_BLOB_PER_METRE];
    bslam_detector_normalise(model, features);
    float *screen = &values[class_count + 2];
    bslam_svm_decide(&model->screen, features, screen);
    if (!(*screen >= model->screen_threshold)) {
        return false;
    }
    bslam_additive_place_t place;
    bslam_additive_locate(&model->kinds, features, &place);
    bslam_additive_decide(&model->kinds, &place, 0, 1, values);
    if (!(values[0] >= model->any_threshold)) {
        return false;
    }
    bslam_additive_decide(&model->kinds, &place, 1, model->kinds.rows, values + 1);
    clamp_all(values, class_count + 3, BSLAM_FUSION_LIMIT);
    bslam_svm_decide(&model->fusion, values, &opinion->score);
    return opinion->score >= model->threshold;
}

/// True if the proposal is a candidate: its score, class and outline are then written.
static bool judge_one(const bslam_detector_model_t *model, const bslam_beacon_class_t *classes,
                      int32_t class_count, const bslam_view_t *view, const bslam_proposal_t *proposal,
                      bslam_candidate_t *candidate)
{
    opinion_t opinion;
    if (!ask_machines(model, class_count, view, proposal, &opinion)) {
        return false;
    }
    memset(candidate, 0, sizeof *candidate);
    candidate->outline = proposal->box;
    candidate->score = opinion.score;
    choose_class(opinion.values + 1, class_count, candidate);
    const float height_m = classes[candidate->beacon_class - 1].height_m;
    return !is_of_another_size(view, proposal, opinion.log_height, opinion.per_metre, height_m);
}

static bslam_real_t area_px2(const bslam_box_t *box)
{
    return (box->right_px - box->left_px) * (box->bottom_px - box->top_px);
}

static bool is_same_thing(const bslam_box_t *a, const bslam_box_t *b)
{
    const bslam_real_t overlap = bslam_box_overlap(a, b);
    const bslam_real_t area_a = area_px2(a), area_b = area_px2(b);
    const bslam_real_t smaller = area_a < area_b ? area_a : area_b;
    const bslam_real_t both = overlap * (area_a + area_b) / (1 + overlap);
    return overlap > OVERLAP_MAX || both > WITHIN_MAX * smaller;
}

/// Puts a candidate among those known, surest first, unless a surer one stands in its place; takes out those
/// it beats. Returns how many there are then.
static int32_t insert(bslam_candidate_t *candidates, int32_t count, const bslam_candidate_t *candidate,
                      uint32_t *dropped)
{
    int32_t at = 0;
    while (at < count && candidates[at].score >= candidate->score) {
        if (is_same_thing(&candidates[at].outline, &candidate->outline)) {
            return count;
        }
        at++;
    }
    int32_t kept = at;
    for (int32_t i = at; i < count; i++) {
        if (!is_same_thing(&candidates[i].outline, &candidate->outline)) {
            candidates[kept++] = candidates[i];
        }
    }
    if (at == BSLAM_CANDIDATES_MAX || kept == BSLAM_CANDIDATES_MAX) {
        (*dropped)++;
        kept = at == BSLAM_CANDIDATES_MAX ? kept : kept - 1;
    }
    if (at < BSLAM_CANDIDATES_MAX) {
        memmove(&candidates[at + 1], &candidates[at], (size_t)(kept - at) * sizeof candidates[0]);
        candidates[at] = *candidate;
        kept++;
    }
    return kept;
}

int32_t bslam_detector_judge(const bslam_detector_model_t *model, const bslam_beacon_class_t *classes,
                             int32_t class_count, const bslam_view_t *view,
                             const bslam_proposals_t *proposals, bslam_candidate_t *candidates,
                             uint32_t *dropped)
{
    int32_t count = 0;
    for (int32_t i = 0; i < proposals->count; i++) {
        bslam_candidate_t candidate;
        if (judge_one(model, classes, class_count, view, &proposals->items[i], &candidate)) {
            count = insert(candidates, count, &candidate, dropped);
        }
    }
    return count;
}
