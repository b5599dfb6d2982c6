#include "bslam/slam/doubt.h"

#include <string.h>

#include "bslam/settings_internal.h"
#include "bslam/slam/slam_internal.h"

// Nats: another one that is so far ahead is taken, one that is so far behind is forgotten.
static const bslam_real_t SWITCH = 2, PRUNE = 9;

// ---- hypotheses -------------------------------------------------------------------------------------------

int bslam_slam_doubts(const bslam_slam_t *slam)
{
    return bslam_slam_can_doubt(slam) ? slam->doubts->count : 0;
}

void bslam_hypothesis_copy(const bslam_slam_t *slam, bslam_hypothesis_t *hypothesis)
{
    hypothesis->ekf = slam->ekf;
    hypothesis->misfit = slam->misfit;
    hypothesis->unseen_s = slam->unseen_s;
    hypothesis->bearing_noise = slam->bearing_noise;
    hypothesis->range_noise = slam->range_noise;
    if (bslam_slam_learns(slam)) {
        memcpy(hypothesis->of, slam->appearance->of, sizeof hypothesis->of);
    }
}

/// Bytes of two places that do not overlap, exchanged.
static void exchange_bytes(void *one, void *other, size_t size)
{
    unsigned char piece[64], *a = one, *b = other;
    for (size_t at = 0; at < size; at += sizeof piece) {
        const size_t left = size - at, count = left < sizeof piece ? left : sizeof piece;
        memcpy(piece, &a[at], count);
        memcpy(&a[at], &b[at], count);
        memcpy(&b[at], piece, count);
    }
}

#define EXCHANGE(one, other) exchange_bytes(&(one), &(other), sizeof(one))

void bslam_hypothesis_exchange(bslam_slam_t *slam, bslam_hypothesis_t *hypothesis)
{
    const uint32_t next_uid = slam->ekf.next_uid;
    EXCHANGE(slam->ekf, hypothesis->ekf);
    slam->ekf.next_uid = next_uid;
    EXCHANGE(slam->misfit, hypothesis->misfit);
    EXCHANGE(slam->unseen_s, hypothesis->unseen_s);
    EXCHANGE(slam->bearing_noise, hypothesis->bearing_noise);
    EXCHANGE(slam->range_noise, hypothesis->range_noise);
    if (bslam_slam_learns(slam)) {
        EXCHANGE(slam->appearance->of, hypothesis->of);
    }
}

void bslam_hypotheses_share(bslam_slam_t *slam)
{
    if (bslam_slam_learns(slam)) {
        bslam_appearance_share(slam->appearance, slam->doubts->count > 0);
    }
}

static void forget(bslam_slam_t *slam, int k)
{
    bslam_doubts_t *doubts = slam->doubts;
    doubts->count--;
    if (k < doubts->count) {
        doubts->others[k] = doubts->others[doubts->count];
    }
    if (doubts->count == 0) {
        bslam_hypotheses_share(slam);
    }
}

void bslam_slam_forget_worst(bslam_slam_t *slam, bslam_real_t behind)
{
    int worst = -1;
    for (int k = 0; k < slam->doubts->count; k++) {
        if (slam->doubts->others[k].behind > behind) {
            behind = slam->doubts->others[k].behind;
            worst = k;
        }
    }
    if (worst >= 0) {
        forget(slam, worst);
    }
}

void bslam_slam_end_doubt(bslam_slam_t *slam)
{
    if (bslam_slam_can_doubt(slam)) {
        slam->doubts->count = 0;
        bslam_hypotheses_share(slam);
    }
}

void bslam_slam_attach_doubts(bslam_slam_t *slam, bslam_doubts_t *doubts)
{
    const bool is_of_use = doubts != NULL && !bslam_slam_smooths(slam) && slam->settings.hypotheses > 1 &&
                           bslam_weighs_likelihood(&slam->settings);
    slam->doubts = is_of_use ? doubts : NULL;
    if (is_of_use) {
        doubts->count = 0;
    }
}

// ---- which one is right -----------------------------------------------------------------------------------

static void put_in_force(bslam_slam_t *slam, int k)
{
    bslam_doubts_t *doubts = slam->doubts;
    const bslam_real_t ahead = -doubts->others[k].behind;
    bslam_hypothesis_exchange(slam, &doubts->others[k]);
    for (int i = 0; i < doubts->count; i++) {
        doubts->others[i].behind += ahead;
    }
    doubts->others[k].behind = ahead;
}

/// The one that is the least behind.
static int best_other(const bslam_doubts_t *doubts)
{
    int best = 0;
    for (int k = 1; k < doubts->count; k++) {
        best = doubts->others[k].behind < doubts->others[best].behind ? k : best;
    }
    return best;
}

bslam_real_t bslam_slam_lead(const bslam_slam_t *slam)
{
    return bslam_slam_doubts(slam) > 0 ? slam->doubts->others[best_other(slam->doubts)].behind : 0;
}

void bslam_slam_settle_doubts(bslam_slam_t *slam, int64_t time_us)
{
    if (bslam_slam_doubts(slam) == 0) {
        return;
    }
    bslam_doubts_t *doubts = slam->doubts;
    const int best = best_other(doubts);
    if (doubts->others[best].behind < -SWITCH) {
        put_in_force(slam, best);
    }
    for (int k = doubts->count - 1; k >= 0; k--) {
        const bool is_over = time_us - doubts->others[k].since_us > slam->settings.doubt_us;
        if (is_over && doubts->others[k].behind < 0) {
            put_in_force(slam, k);
        }
        if (is_over || doubts->others[k].behind > PRUNE) {
            forget(slam, k);
        }
    }
}

// ---- time ------------------------------------------------------------------------------------------------

void bslam_slam_predict_others(bslam_slam_t *slam, const bslam_motion_t *motion)
{
    for (int k = 0; k < bslam_slam_doubts(slam); k++) {
        bslam_hypothesis_t *other = &slam->doubts->others[k];
        bslam_motion_t doubted = *motion, moved;
        bslam_slam_doubt_motion(other->misfit, other->unseen_s, &doubted);
        other->unseen_s += motion->dt_s;
        bslam_ekf_predict(&other->ekf, &slam->settings, &doubted, &moved);
    }
}
