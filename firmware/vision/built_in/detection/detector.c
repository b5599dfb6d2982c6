#include "vision/built_in/detection/detector.h"

#include <math.h>

#include <stddef.h>
#include <string.h>

#include "base/types.h"
#include "vision/built_in/detection/prefilter.h"

/// Of two candidates that overlap more than this, or of which one lies this much within the other, the surer
/// one stays.
#define OVERLAP_MAX BSLAM_R(0.3)
#define WITHIN_MAX BSLAM_R(0.7)
/// A box gets no closer look where the fusion is surer by so much of another one in its place.
#define SURER_BY 0.7f
/// What a kind's value loses where the box is not as high as the kind: so much for each unit of the natural
/// logarithm beyond SIZE_FREE, SIZE_LOSS_MAX at most, since the floor line errs too. tools/training takes off
/// the same before it fits the fusion.
#define SIZE_FREE 0.2f
#define SIZE_LOSS 1.5f
#define SIZE_LOSS_MAX 1.0f

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
        const float value = (x[i] - offset[i]) * scale[i];
        // Most are within: one comparison.
        x[i] = fabsf(value) <= BSLAM_FEATURE_LIMIT ? value : clamped(value, BSLAM_FEATURE_LIMIT);
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

/// Whether the floor line tells how high the box is: a box at the upper or lower edge of the frame may be the
/// part of something.
static bool has_height(const bslam_view_t *view, const bslam_box_t *box, float per_metre)
{
    const bslam_real_t cell_px = BSLAM_CELL_PX, frame_px = (bslam_real_t)view->frame->height_px;
    return per_metre > 0 && box->top_px >= cell_px && box->bottom_px <= frame_px - cell_px;
}

/// What is red and square looks like a sign in all but its size; no sum of curves says "but": this does.
static void take_off_misfits(const bslam_beacon_class_t *classes, int32_t class_count, float log_height,
                             float *kinds)
{
    for (int32_t c = 0; c < class_count; c++) {
        const float height_m = classes[c].height_m;
        const float excess = height_m > 0 ? log_height - bslam_log(height_m) : 0.0f;
        const float loss = SIZE_LOSS * ((excess < 0 ? -excess : excess) - SIZE_FREE);
        kinds[c] -= loss < 0 ? 0.0f : loss < SIZE_LOSS_MAX ? loss : SIZE_LOSS_MAX;
    }
}

/// False if a first glance tells that it is no beacon.
static bool is_worth_a_look(const bslam_detector_model_t *model, const bslam_view_t *view,
                            const bslam_proposal_t *proposal)
{
    float glance[BSLAM_GLANCE_FEATURES];
    float value = 0;
    bslam_box_prefilter(view, proposal, glance);
    bslam_svm_decide(&model->glance, glance, &value);
    return value >= model->glance_threshold;
}

/// The additive machines' values; false if the first one refuses it. Not to be inlined: the sample's place
/// takes a kilobyte of stack.
__attribute__((noinline)) static bool ask_additive(const bslam_detector_model_t *model, const float *features,
                                                   float *values)
{
    bslam_additive_place_t place;
    bslam_additive_locate(&model->kinds, features, &place);
    bslam_additive_decide(&model->kinds, &place, 0, 2, values);  // two rows cost as much as one
    if (!(values[0] >= model->any_threshold)) {
        return false;
    }
    bslam_additive_decide(&model->kinds, &place, 2, model->kinds.rows, values + 2);
    return true;
}

void bslam_detector_tell(const float normalised[BSLAM_BLOB_FEATURES], uint8_t told[BSLAM_BLOB_FEATURES])
{
    for (int32_t i = 0; i < BSLAM_BLOB_FEATURES; i++) {
        told[i] = (uint8_t)(normalised[i] * BSLAM_CLOSE_STEPS + 128.5f);
    }
}

/// False if a machine refuses it. Not to be inlined: its kilobyte of stack is then free for what follows.
__attribute__((noinline)) static bool ask_machines(const bslam_detector_model_t *model,
                                                   const bslam_beacon_class_t *classes, int32_t class_count,
                                                   const bslam_view_t *view, const bslam_proposal_t *proposal,
                                                   bslam_box_opinion_t *opinion)
{
    float features[BSLAM_BLOB_FEATURES];
    float *values = opinion->values;
    bslam_blob_features(view, proposal, features);
    const float log_height = features[BSLAM_BLOB_LOG_HEIGHT], per_metre = features[BSLAM_BLOB_PER_METRE];
    bslam_detector_normalise(model, features);
    float *screen = &values[class_count + 2];
    bslam_svm_decide(&model->screen, features, screen);
    if (!(*screen >= model->screen_threshold)) {
        return false;
    }
    if (!ask_additive(model, features, values)) {
        return false;
    }
    if (has_height(view, &proposal->box, per_metre)) {
        take_off_misfits(classes, class_count, log_height, values + 1);
    }
    clamp_all(values, class_count + 3, BSLAM_FUSION_LIMIT);
    bslam_svm_decide(&model->fusion, values, &opinion->score);
    opinion->proposal = proposal;
    bslam_detector_tell(features, opinion->told);
    return opinion->score >= model->fusion_threshold;
}

/// Holds an opinion; where there is no room, in place of the least sure. Returns how many there are then.
static int32_t hold(bslam_box_opinion_t *opinions, int32_t count, const bslam_box_opinion_t *opinion,
                    uint32_t *dropped)
{
    if (count < BSLAM_OPINIONS_MAX) {
        opinions[count] = *opinion;
        return count + 1;
    }
    int32_t least = 0;
    for (int32_t i = 1; i < count; i++) {
        least = opinions[i].score < opinions[least].score ? i : least;
    }
    if (opinion->score > opinions[least].score) {
        opinions[least] = *opinion;
    }
    (*dropped)++;
    return count;
}

/// What all proposals are, as far as their cells tell. Returns how many may be beacons.
static int32_t look(const bslam_detector_model_t *model, const bslam_beacon_class_t *classes,
                    int32_t class_count, const bslam_view_t *view, const bslam_proposals_t *proposals,
                    bslam_box_opinion_t *opinions, uint32_t *dropped)
{
    int32_t held = 0;
    for (int32_t i = 0; i < proposals->count; i++) {
        const bslam_proposal_t *proposal = &proposals->items[i];
        bslam_box_opinion_t opinion;
        if (is_worth_a_look(model, view, proposal) &&
            ask_machines(model, classes, class_count, view, proposal, &opinion)) {
            held = hold(opinions, held, &opinion, dropped);
        }
    }
    return held;
}

/// The verdict on an opinion by what the pixels show; kinds' values become the mean of both looks. Not to be
/// inlined: what the pixels show takes a kilobyte of stack.
__attribute__((noinline)) static float look_closer(const bslam_detector_model_t *model, int32_t class_count,
                                                   const bslam_frame_t *frame, bslam_box_opinion_t *opinion)
{
    uint8_t told[BSLAM_CLOSE_FEATURES];
    float inputs[BSLAM_CLASSES_MAX + 4], verdict = 0;
    float *seen = inputs + 2;
    bslam_patch_features(frame, &opinion->proposal->box, told);
    memcpy(told + BSLAM_PATCH_FEATURES, opinion->told, BSLAM_BLOB_FEATURES);
    bslam_hinged_decide(&model->close, told, seen);
    inputs[0] = opinion->score;
    inputs[1] = opinion->values[0];
    clamp_all(inputs, class_count + 4, BSLAM_FUSION_LIMIT);
    bslam_svm_decide(&model->verdict, inputs, &verdict);
    for (int32_t c = 1; c <= class_count; c++) {
        opinion->values[c] = 0.5f * (opinion->values[c] + seen[c]);
    }
    return verdict;
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

/// Whether one in its place is so much surer that no closer look will turn them round.
static bool is_beaten(const bslam_box_opinion_t *opinions, int32_t count, const bslam_box_opinion_t *opinion)
{
    for (int32_t i = 0; i < count; i++) {
        if (opinions[i].score > opinion->score + SURER_BY &&
            is_same_thing(&opinions[i].proposal->box, &opinion->proposal->box)) {
            return true;
        }
    }
    return false;
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
                             const bslam_proposals_t *proposals,
                             bslam_box_opinion_t opinions[BSLAM_OPINIONS_MAX], bslam_candidate_t *candidates,
                             uint32_t *dropped)
{
    const int32_t held = look(model, classes, class_count, view, proposals, opinions, dropped);
    int32_t count = 0;
    for (int32_t i = 0; i < held; i++) {
        bslam_box_opinion_t *opinion = &opinions[i];
        if (is_beaten(opinions, held, opinion)) {
            continue;
        }
        const float verdict = look_closer(model, class_count, view->frame, opinion);
        if (verdict >= model->threshold) {
            bslam_candidate_t candidate = {.outline = opinion->proposal->box, .score = verdict};
            choose_class(opinion->values + 1, class_count, &candidate);
            count = insert(candidates, count, &candidate, dropped);
        }
    }
    return count;
}
