#include "bslam/association/duplicates.h"

#include "bslam/association/viewpoint.h"

// So many duplicates of one beacon leave before it is that one that leaves.
enum { OUSTED_MAX = 3 };

// What was not seen for so long is not in view.
enum { SEEN_NOW_US = 1000000 };

// Things of two classes are two, unless their middles are nearer to each other than any two hang or stand.
static const bslam_real_t TWO_CLASSES_M = BSLAM_R(0.2);

// Two of them no farther apart than this may be one, if their places differ by no more than this squared
// Mahalanobis distance.
static const bslam_real_t APART_M = 1, APART_D2 = 9;
// So many frames show one of them without the other.
enum { ALONE_MAX = 25 };

static bool is_seen(const bslam_ekf_t *ekf, int index, int64_t time_us)
{
    return ekf->beacons[index].last_seen_us == time_us;
}

/// Whether two beacons may stand in the same place, as far as the map knows; no farther apart than so far.
static bool is_one_place(const bslam_ekf_t *ekf, const bslam_settings_t *settings, int a, int b,
                         bslam_real_t apart_m)
{
    const int at = ekf->beacons[a].at, bt = ekf->beacons[b].at;
    if (!bslam_has_viewpoint(&ekf->beacons[a]) || !bslam_has_viewpoint(&ekf->beacons[b])) {
        return false;
    }
    const bslam_real_t dx = ekf->mean[at] - ekf->mean[bt];
    const bslam_real_t dy = ekf->mean[at + 1] - ekf->mean[bt + 1];
    if (dx * dx + dy * dy > apart_m * apart_m) {
        return false;
    }
    const bslam_real_t floor_m2 = settings->duplicate_sd_m * settings->duplicate_sd_m;
    const bslam_real_t xx = floor_m2 + bslam_ekf_covariance(ekf, at, at) + bslam_ekf_covariance(ekf, bt, bt) -
                            2 * bslam_ekf_covariance(ekf, at, bt);
    const bslam_real_t yy = floor_m2 + bslam_ekf_covariance(ekf, at + 1, at + 1) +
                            bslam_ekf_covariance(ekf, bt + 1, bt + 1) -
                            2 * bslam_ekf_covariance(ekf, at + 1, bt + 1);
    const bslam_real_t xy = bslam_ekf_covariance(ekf, at + 1, at) + bslam_ekf_covariance(ekf, bt + 1, bt) -
                            bslam_ekf_covariance(ekf, at + 1, bt) - bslam_ekf_covariance(ekf, bt + 1, at);
    const bslam_real_t det = xx * yy - xy * xy;
    return dx * dx * yy - 2 * dx * dy * xy + dy * dy * xx <= APART_D2 * det;
}

/// A door and the sign beside it are two, however little the map knows of where they stand.
static bool are_of_two_classes(const bslam_ekf_t *ekf, int a, int b)
{
    const uint8_t one = ekf->beacons[a].beacon_class, other = ekf->beacons[b].beacon_class;
    return one != BSLAM_CLASS_NONE && other != BSLAM_CLASS_NONE && one != other;
}

/// Of a pair in one place, what the frame adds. True if one of them must leave.
static bool count_pair(bslam_beacon_t *younger, uint32_t older_uid, bool together)
{
    if (younger->near_uid != older_uid || together) {
        younger->near_uid = older_uid;
        younger->alone = 0;
    }
    younger->alone = (uint8_t)(younger->alone + (together ? 0 : 1));
    return younger->alone >= ALONE_MAX;
}

/// Which of two leaves: the one with fewer sightings, unless several have left for being in the place of one
/// that was not seen: then what was there is there no longer.
static int who_leaves(bslam_ekf_t *ekf, int a, int b, int64_t time_us)
{
    const int less = ekf->beacons[a].sightings < ekf->beacons[b].sightings ? a : b;
    const int more = less == a ? b : a;
    bslam_beacon_t *old = &ekf->beacons[more];
    const bool is_ousted = time_us - old->last_seen_us > SEEN_NOW_US;
    old->ousted = (uint8_t)(old->ousted + (is_ousted ? 1 : 0));
    return is_ousted && old->ousted >= OUSTED_MAX ? more : less;
}

/// The oldest other beacon in whose place beacon `index` is; BSLAM_NO_DUPLICATE: none.
static int find_other(const bslam_ekf_t *ekf, const bslam_settings_t *settings, int index)
{
    for (int b = 0; b < ekf->beacon_count; b++) {
        const bslam_real_t apart_m = are_of_two_classes(ekf, index, b) ? TWO_CLASSES_M : APART_M;
        if (b != index && is_one_place(ekf, settings, index, b, apart_m)) {
            return b;
        }
    }
    return BSLAM_NO_DUPLICATE;
}

int bslam_duplicates_settle(bslam_ekf_t *ekf, const bslam_settings_t *settings, int64_t time_us)
{
    for (int b = 0; b < ekf->beacon_count; b++) {
        const int other = is_seen(ekf, b, time_us) ? find_other(ekf, settings, b) : BSLAM_NO_DUPLICATE;
        if (other == BSLAM_NO_DUPLICATE) {
            continue;
        }
        bslam_beacon_t *one = &ekf->beacons[b], *two = &ekf->beacons[other];
        bslam_beacon_t *younger = two->uid > one->uid ? two : one;
        const bslam_beacon_t *older = younger == one ? two : one;
        if (count_pair(younger, older->uid, is_seen(ekf, other, time_us))) {
            younger->alone = 0;
            return who_leaves(ekf, b, other, time_us);
        }
    }
    return BSLAM_NO_DUPLICATE;
}
