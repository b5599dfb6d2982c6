#include "bslam/association/duplicates.h"

#include "bslam/association/viewpoint.h"

// So many duplicates of one beacon leave before it is that one that leaves.
enum { OUSTED_MAX = 3 };

// Things of two classes are two, unless their middles are nearer to each other than any two hang or stand.
static const bslam_real_t TWO_CLASSES_M = BSLAM_R(0.2);

// Two sightings of one thing: their directions differ by less than three of the difference's deviations, and
// neither is twice as far off as the other.
static const bslam_real_t ONE_DIRECTION_SD = BSLAM_R(4.24), FARTHER2 = 4;

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
    return dx * dx * yy - 2 * dx * dy * xy + dy * dy * xx <= settings->duplicate_d2 * det;
}

/// Whether two beacons stand one behind the other, as the robot sees it, and one of them was hardly ever
/// seen: two distances of one far thing. By the sine of the angle between them, since all pairs are asked in
/// every frame.
static bool is_one_direction(const bslam_ekf_t *ekf, const bslam_settings_t *settings, int a, int b)
{
    const uint32_t few = (uint32_t)settings->doubt_sightings;
    if (ekf->beacons[a].sightings >= few && ekf->beacons[b].sightings >= few) {
        return false;
    }
    const bslam_pose_t robot = bslam_ekf_pose(ekf);
    bslam_real_t ax, ay, bx, by;
    bslam_ekf_beacon_position(ekf, a, &ax, &ay);
    bslam_ekf_beacon_position(ekf, b, &bx, &by);
    ax -= robot.x_m;
    ay -= robot.y_m;
    bx -= robot.x_m;
    by -= robot.y_m;
    const bslam_real_t a2 = ax * ax + ay * ay, b2 = bx * bx + by * by;
    const bslam_real_t cross = ax * by - ay * bx, apart = ONE_DIRECTION_SD * settings->bearing_sd_rad;
    return ax * bx + ay * by > 0 && cross * cross <= apart * apart * a2 * b2 && a2 < FARTHER2 * b2 &&
           b2 < FARTHER2 * a2;
}

/// A door and the sign beside it are two, however little the map knows of where they stand.
static bool are_of_two_classes(const bslam_appearance_t *appearance, int a, int b)
{
    const uint8_t one = bslam_appearance_class(appearance, a), other = bslam_appearance_class(appearance, b);
    return one != BSLAM_CLASS_NONE && other != BSLAM_CLASS_NONE && one != other;
}

/// Of a pair in one place, what the frame adds. True if one of them must leave.
static bool count_pair(bslam_beacon_appearance_t *younger, uint32_t older_uid, bool together, int32_t limit)
{
    if (younger->near_uid != older_uid || together) {
        younger->near_uid = older_uid;
        younger->alone = 0;
    }
    younger->alone = (uint8_t)(younger->alone + (together ? 0 : 1));
    return younger->alone >= limit;
}

/// Which of two leaves: the one with fewer sightings, unless several have left for being in the place of one
/// that was not seen: then what was there is there no longer.
static int who_leaves(bslam_appearance_t *appearance, const bslam_ekf_t *ekf,
                      const bslam_settings_t *settings, int a, int b, bool in_place, int64_t time_us)
{
    const int less = ekf->beacons[a].sightings < ekf->beacons[b].sightings ? a : b;
    const int more = less == a ? b : a;
    const bool is_ousted =
        in_place && time_us - ekf->beacons[more].last_seen_us > settings->decision_delay_us;
    appearance->of[more].ousted = (uint8_t)(appearance->of[more].ousted + (is_ousted ? 1 : 0));
    return is_ousted && appearance->of[more].ousted >= OUSTED_MAX ? more : less;
}

/// The oldest other beacon that beacon `index` may be: in its place, or else in its direction;
/// BSLAM_NO_DUPLICATE: none.
static int find_other(const bslam_appearance_t *appearance, const bslam_ekf_t *ekf,
                      const bslam_settings_t *settings, int index, bool *in_place)
{
    int in_direction = BSLAM_NO_DUPLICATE;
    for (int b = 0; b < ekf->beacon_count; b++) {
        if (b == index) {
            continue;
        }
        const bool are_two = are_of_two_classes(appearance, index, b);
        const bslam_real_t apart_m =
            are_two && TWO_CLASSES_M < settings->duplicate_m ? TWO_CLASSES_M : settings->duplicate_m;
        *in_place = is_one_place(ekf, settings, index, b, apart_m);
        if (*in_place) {
            return b;
        }
        if (in_direction == BSLAM_NO_DUPLICATE && !are_two && is_one_direction(ekf, settings, index, b)) {
            in_direction = b;
        }
    }
    return in_direction;
}

int bslam_duplicates_settle(bslam_appearance_t *appearance, const bslam_ekf_t *ekf,
                            const bslam_settings_t *settings, int64_t time_us)
{
    for (int b = 0; b < ekf->beacon_count; b++) {
        bool in_place = false;
        const int other = is_seen(ekf, b, time_us) ? find_other(appearance, ekf, settings, b, &in_place)
                                                   : BSLAM_NO_DUPLICATE;
        if (other == BSLAM_NO_DUPLICATE) {
            continue;
        }
        const int younger = ekf->beacons[other].uid > ekf->beacons[b].uid ? other : b;
        const int older = younger == b ? other : b;
        if (count_pair(&appearance->of[younger], ekf->beacons[older].uid, is_seen(ekf, other, time_us),
                       settings->doubt_sightings)) {
            appearance->of[younger].alone = 0;
            appearance->counters.retired++;
            return who_leaves(appearance, ekf, settings, b, other, in_place, time_us);
        }
    }
    return BSLAM_NO_DUPLICATE;
}
