#include "bslam/recovery/resection.h"

#include "bslam/linalg/smallmat.h"
#include "base/trig.h"
#include "bslam/model/observation.h"
#include "bslam/model/pose.h"
#include "base/scalar.h"

// A clue agrees with a pose up to this squared distance: of two values one in 3000 does not.
static const bslam_real_t AGREE_D2 = BSLAM_R(16.0);
// A sighting of several beacons is unambiguous if by any other all that agree are so much farther off.
static const bslam_real_t AMBIGUOUS_D2 = BSLAM_R(9.0);
// Beacons closer together give no heading.
static const bslam_real_t BASE_MIN_M = BSLAM_R(0.3);
static const bslam_real_t SINE_MIN = BSLAM_R(0.02);
static const bslam_real_t PIVOT_MIN = BSLAM_R(1e-6);

enum { REFINEMENTS = 4, WITHOUT_RANGE_MIN = 3, WITH_RANGE_MIN = 2 };

/// A clue against a pose.
typedef struct residual {
    bslam_observation_t seen;
    bslam_real_t bearing_rad;  ///< measured less predicted
    bslam_real_t range_m, distance2;
} residual_t;

static bool compare(const bslam_clue_t *clue, const bslam_pose_t *pose, residual_t *residual)
{
    if (bslam_observe_point(pose, &clue->sensor, clue->x_m, clue->y_m, &residual->seen) != BSLAM_OK) {
        return false;
    }
    residual->bearing_rad = bslam_angle_wrap(clue->bearing_rad - residual->seen.bearing_rad);
    residual->range_m = clue->has_range ? clue->range_m - residual->seen.range_m : 0;
    residual->distance2 = residual->bearing_rad * residual->bearing_rad / clue->bearing_var_rad2;
    if (clue->has_range) {
        residual->distance2 += residual->range_m * residual->range_m / clue->range_var_m2;
    }
    return true;
}

/// The first clue of the sighting after that of clue `i`.
static int next_sighting(const bslam_clue_t *clues, int count, int i)
{
    do {
        i++;
    } while (i < count && clues[i].is_other);
    return i;
}

/// Of the clues of one sighting the one that is nearest to what a pose says, if that agrees; else -1.
static int agreeing_clue(const bslam_clue_t *clues, int first, int end, const bslam_pose_t *pose,
                         residual_t *residual)
{
    int nearest = -1;
    for (int i = first; i < end; i++) {
        residual_t one;
        if (compare(&clues[i], pose, &one) && one.distance2 <= AGREE_D2 &&
            (nearest < 0 || one.distance2 < residual->distance2)) {
            nearest = i;
            *residual = one;
        }
    }
    return nearest;
}

/// Agreement of all sightings with a pose.
typedef struct vote {
    int32_t agreeing, beacons;
    int32_t with_range;  ///< beacons
    bslam_real_t distance2;
    uint32_t who;  ///< a bit for each clue by which one agrees
} vote_t;

/// Whether a clue shows what a clue before it does that agrees, too; with_range: one that has a distance.
static bool is_again(const bslam_clue_t *clues, uint32_t who, int i, bool with_range)
{
    for (int j = 0; j < i; j++) {
        const bool agrees = (who >> (unsigned)j & 1u) != 0;
        if (agrees && clues[j].beacon == clues[i].beacon && (clues[j].has_range || !with_range)) {
            return true;
        }
    }
    return false;
}

static vote_t vote_on(const bslam_clue_t *clues, int count, const bslam_pose_t *pose)
{
    vote_t vote = {0};
    int end;
    for (int first = 0; first < count; first = end) {
        end = next_sighting(clues, count, first);
        residual_t residual;
        const int i = agreeing_clue(clues, first, end, pose, &residual);
        if (i >= 0) {
            vote.agreeing++;
            vote.beacons += is_again(clues, vote.who, i, false) ? 0 : 1;
            vote.with_range += !clues[i].has_range || is_again(clues, vote.who, i, true) ? 0 : 1;
            vote.distance2 += residual.distance2;
            vote.who |= 1u << (unsigned)i;
        }
    }
    return vote;
}

static bool is_better(const vote_t *a, const vote_t *b)
{
    if (a->beacons != b->beacons) {
        return a->beacons > b->beacons;
    }
    return a->agreeing > b->agreeing || (a->agreeing == b->agreeing && a->distance2 < b->distance2);
}

// ---- poses to try -----------------------------------------------------------------------------------------

/// The point that a clue with a distance shows, in the robot's frame.
static void point_of(const bslam_clue_t *clue, bslam_real_t *x, bslam_real_t *y)
{
    bslam_real_t sine, cosine;
    bslam_sin_cos(clue->sensor.theta_rad + clue->bearing_rad, &sine, &cosine);
    *x = clue->sensor.x_m + clue->range_m * cosine;
    *y = clue->sensor.y_m + clue->range_m * sine;
}

/// The motion that brings two points of the robot's frame to two beacons: turn, then meet in the middle.
static bool pose_of_two(const bslam_clue_t *a, const bslam_clue_t *b, bslam_pose_t *pose)
{
    bslam_real_t ax, ay, bx, by;
    point_of(a, &ax, &ay);
    point_of(b, &bx, &by);
    const bslam_real_t map_x = b->x_m - a->x_m, map_y = b->y_m - a->y_m;
    if (map_x * map_x + map_y * map_y < BASE_MIN_M * BASE_MIN_M) {
        return false;
    }
    pose->theta_rad = bslam_angle_wrap(bslam_atan2(map_y, map_x) - bslam_atan2(by - ay, bx - ax));
    bslam_real_t sine, cosine;
    bslam_sin_cos(pose->theta_rad, &sine, &cosine);
    const bslam_real_t x = (ax + bx) / 2, y = (ay + by) / 2;
    pose->x_m = (a->x_m + b->x_m) / 2 - cosine * x + sine * y;
    pose->y_m = (a->y_m + b->y_m) / 2 - sine * x - cosine * y;
    return true;
}

static bslam_real_t direction_of(const bslam_clue_t *clue)
{
    return clue->sensor.theta_rad + clue->bearing_rad;
}

static bool cotangent(bslam_real_t angle_rad, bslam_real_t *value)
{
    bslam_real_t sine, cosine;
    bslam_sin_cos(bslam_angle_wrap(angle_rad), &sine, &cosine);
    *value = cosine / sine;
    return bslam_abs(sine) > SINE_MIN;
}

/// Resection from three directions, as if all were taken from where the robot is now (ToTal, Pierlot and Van
/// Droogenbroeck 2014).
static bool pose_of_three(const bslam_clue_t *a, const bslam_clue_t *b, const bslam_clue_t *c,
                          bslam_pose_t *pose)
{
    bslam_real_t t12, t23;
    if (!cotangent(direction_of(b) - direction_of(a), &t12) ||
        !cotangent(direction_of(c) - direction_of(b), &t23) || bslam_abs(t12 + t23) < SINE_MIN) {
        return false;
    }
    const bslam_real_t t31 = (1 - t12 * t23) / (t12 + t23);
    const bslam_real_t x1 = a->x_m - b->x_m, y1 = a->y_m - b->y_m;
    const bslam_real_t x3 = c->x_m - b->x_m, y3 = c->y_m - b->y_m;
    const bslam_real_t x12 = x1 + t12 * y1;
    const bslam_real_t y12 = y1 - t12 * x1;
    const bslam_real_t x23 = x3 - t23 * y3;
    const bslam_real_t y23 = y3 + t23 * x3;
    const bslam_real_t x31 = x3 + x1 + t31 * (y3 - y1);
    const bslam_real_t y31 = y3 + y1 - t31 * (x3 - x1);
    const bslam_real_t k31 = x1 * x3 + y1 * y3 + t31 * (x1 * y3 - x3 * y1);
    const bslam_real_t d = (x12 - x23) * (y23 - y31) - (y12 - y23) * (x23 - x31);
    if (bslam_abs(d) < PIVOT_MIN) {
        return false;
    }
    pose->x_m = b->x_m + k31 * (y12 - y23) / d;
    pose->y_m = b->y_m + k31 * (x23 - x12) / d;
    if (!bslam_is_number(pose->x_m) || !bslam_is_number(pose->y_m)) {
        return false;
    }
    pose->theta_rad = bslam_angle_wrap(bslam_atan2(a->y_m - pose->y_m, a->x_m - pose->x_m) - direction_of(a));
    return true;
}

// ---- refining ---------------------------------------------------------------------------------------------

/// The normal equations of all clues that agree: lower triangle xx, yx, yy, tx, ty, tt, and the right side.
typedef struct normal {
    bslam_real_t n[6], g[3];
} normal_t;

static void add_scalar(normal_t *normal, const bslam_real_t by[3], bslam_real_t error, bslam_real_t variance)
{
    int k = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            normal->n[k] += by[i] * by[j] / variance;
            k++;
        }
        normal->g[i] += by[i] * error / variance;
    }
}

static normal_t normal_at(const bslam_clue_t *clues, int count, const bslam_pose_t *pose)
{
    normal_t normal = {{0}, {0}};
    int end;
    for (int first = 0; first < count; first = end) {
        end = next_sighting(clues, count, first);
        residual_t residual;
        const int i = agreeing_clue(clues, first, end, pose, &residual);
        if (i >= 0) {
            add_scalar(&normal, residual.seen.bearing_by_pose, residual.bearing_rad,
                       clues[i].bearing_var_rad2);
            if (clues[i].has_range) {
                add_scalar(&normal, residual.seen.range_by_pose, residual.range_m, clues[i].range_var_m2);
            }
        }
    }
    return normal;
}

/// The inverse of the 3 x 3 matrix, by its cofactors; false: it has none.
static bool invert(const bslam_real_t n[6], bslam_real_t inverse[6])
{
    const bslam_real_t xx = n[2] * n[5] - n[4] * n[4];
    const bslam_real_t yx = n[4] * n[3] - n[1] * n[5];
    const bslam_real_t tx = n[1] * n[4] - n[2] * n[3];
    const bslam_real_t det = n[0] * xx + n[1] * yx + n[3] * tx;
    if (!(det > PIVOT_MIN * n[0] * n[2] * n[5]) || !bslam_is_number(1 / det)) {
        return false;
    }
    inverse[0] = xx / det;
    inverse[1] = yx / det;
    inverse[2] = (n[0] * n[5] - n[3] * n[3]) / det;
    inverse[3] = tx / det;
    inverse[4] = (n[1] * n[3] - n[0] * n[4]) / det;
    inverse[5] = (n[0] * n[2] - n[1] * n[1]) / det;
    return true;
}

/// One Gauss-Newton step; the covariance at the pose before it.
static bool step(const bslam_clue_t *clues, int count, bslam_pose_t *pose, bslam_real_t covariance[6])
{
    const normal_t normal = normal_at(clues, count, pose);
    if (!invert(normal.n, covariance)) {
        return false;
    }
    const bslam_real_t *c = covariance;
    const bslam_real_t *g = normal.g;
    pose->x_m += c[0] * g[0] + c[1] * g[1] + c[3] * g[2];
    pose->y_m += c[1] * g[0] + c[2] * g[1] + c[4] * g[2];
    const bslam_real_t theta_rad = pose->theta_rad + c[3] * g[0] + c[4] * g[1] + c[5] * g[2];
    // No angle to wrap where one of the three is no number.
    if (!bslam_is_number(bslam_abs(pose->x_m) + bslam_abs(pose->y_m) + bslam_abs(theta_rad))) {
        return false;
    }
    pose->theta_rad = bslam_angle_wrap(theta_rad);
    return true;
}

static bool refine(const bslam_clue_t *clues, int count, bslam_fix_t *fix)
{
    bslam_real_t covariance[6];
    for (int i = 0; i < REFINEMENTS; i++) {
        if (!step(clues, count, &fix->pose, covariance)) {
            return false;
        }
    }
    const bslam_real_t middle = (covariance[0] + covariance[2]) / 2;
    const bslam_real_t half = (covariance[0] - covariance[2]) / 2;
    fix->position_sd_m = bslam_sqrt(middle + bslam_sqrt(half * half + covariance[1] * covariance[1]));
    fix->heading_sd_rad = bslam_sqrt(covariance[5]);
    return true;
}

// ---- the best ---------------------------------------------------------------------------------------------

typedef struct pose_search {
    const bslam_clue_t *clues;
    int count;
    bslam_pose_t best;
    vote_t vote;
    vote_t competitor;  ///< the best by other beacons
} pose_search_t;

static void try_pose(pose_search_t *search, const bslam_pose_t *pose)
{
    const vote_t vote = vote_on(search->clues, search->count, pose);
    const bool is_best = is_better(&vote, &search->vote);
    const vote_t second = is_best ? search->vote : vote;
    if (is_best) {
        search->competitor = search->competitor.who == vote.who ? (vote_t){0} : search->competitor;
        search->vote = vote;
        search->best = *pose;
    }
    if (second.who != search->vote.who && is_better(&second, &search->competitor)) {
        search->competitor = second;
    }
}

static void try_all(pose_search_t *search)
{
    const bslam_clue_t *clues = search->clues;
    const int count = search->count;
    for (int a = 0; a < count; a++) {
        for (int b = next_sighting(clues, count, a); b < count; b++) {
            bslam_pose_t pose;
            if (clues[a].has_range && clues[b].has_range && pose_of_two(&clues[a], &clues[b], &pose)) {
                try_pose(search, &pose);
            }
            for (int c = next_sighting(clues, count, b); c < count; c++) {
                const int ranges = clues[a].has_range + clues[b].has_range + clues[c].has_range;
                if (ranges < WITH_RANGE_MIN && pose_of_three(&clues[a], &clues[b], &clues[c], &pose)) {
                    try_pose(search, &pose);
                }
            }
        }
    }
}

/// Whether no pose by other beacons is about as good.
static bool is_unambiguous(const pose_search_t *search)
{
    return search->competitor.beacons < search->vote.beacons ||
           search->competitor.agreeing < search->vote.agreeing ||
           search->competitor.distance2 > search->vote.distance2 + AMBIGUOUS_D2;
}

static bool is_enough(const vote_t *vote)
{
    return vote->beacons >= WITHOUT_RANGE_MIN || vote->with_range >= WITH_RANGE_MIN;
}

bool bslam_relocate(const bslam_clue_t *clues, int count, bslam_fix_t *fix)
{
    pose_search_t search = {.clues = clues, .count = count};
    try_all(&search);
    bslam_fix_t found = {.pose = search.best};
    if (!is_enough(&search.vote) || !is_unambiguous(&search) || !refine(clues, count, &found)) {
        return false;
    }
    const vote_t vote = vote_on(clues, count, &found.pose);
    if (!is_enough(&vote)) {
        return false;
    }
    found.agreeing = vote.agreeing;
    found.beacons = vote.beacons;
    found.with_range = vote.with_range;
    found.dissenting = -vote.agreeing;
    for (int i = 0; i < count; i++) {
        found.dissenting += clues[i].is_other ? 0 : 1;
    }
    *fix = found;
    return true;
}

int32_t bslam_relocate_agreeing(const bslam_clue_t *clues, int count, const bslam_pose_t *pose)
{
    return vote_on(clues, count, pose).beacons;
}
