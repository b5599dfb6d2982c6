#include "bslam/recovery/conversion.h"

#include <stddef.h>

#include "bslam/math/trig.h"
#include "bslam/model/pose.h"

static const bslam_real_t QUARTER_RAD = BSLAM_PI / 2;

/// covariance += J D Jᵀ for one column of J: three derivatives by a value of variance `variance`.
static void add_column(bslam_real_t covariance[6], const bslam_real_t by[3], bslam_real_t variance)
{
    int k = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            covariance[k] += by[i] * by[j] * variance;
            k++;
        }
    }
}

static bool is_seen(const bslam_appearance_t *seen)
{
    const bslam_real_t positive[] = {seen->height_m,  seen->width_m,     seen->height_rad,
                                     seen->width_rad, seen->size_sd_rad, seen->bearing_sd_rad};
    bool good = seen->height_rad < QUARTER_RAD && seen->width_rad < QUARTER_RAD;
    for (size_t i = 0; i < sizeof positive / sizeof positive[0]; i++) {
        good = good && positive[i] > 0;
    }
    return good;
}

static bool is_finite(const bslam_appearance_t *seen)
{
    return bslam_is_number(seen->height_m) && bslam_is_number(seen->width_m) &&
           bslam_is_number(seen->height_rad) && bslam_is_number(seen->width_rad) &&
           bslam_is_number(seen->bearing_rad) && bslam_is_number(seen->size_sd_rad) &&
           bslam_is_number(seen->bearing_sd_rad);
}

/// Half the apparent size, as the tangent of half the angle: size / distance.
static bslam_real_t apparent(bslam_real_t angle_rad)
{
    bslam_real_t sine;
    bslam_real_t cosine;
    bslam_sin_cos(angle_rad / 2, &sine, &cosine);
    return 2 * sine / cosine;
}

bslam_status_t bslam_pose_in_beacon_frame(const bslam_appearance_t *seen, bslam_doubtful_pose_t *in_beacon)
{
    if (!is_finite(seen)) {
        return BSLAM_E_NOT_FINITE;
    }
    if (!is_seen(seen)) {
        return BSLAM_E_RANGE;
    }
    const bslam_real_t high = apparent(seen->height_rad);
    const bslam_real_t wide = apparent(seen->width_rad);
    const bslam_real_t range_m = seen->height_m / high;
    const bslam_real_t ratio = wide * seen->height_m / (high * seen->width_m);
    const bslam_real_t cosine = ratio < 1 ? ratio : 1;
    const bslam_real_t sine = bslam_sqrt((1 - cosine) * (1 + cosine));
    // d tan(a / 2) * 2 / d a = 1 + tan² (a / 2)
    const bslam_real_t high_var =
        seen->size_sd_rad * (1 + high * high / 4) * seen->size_sd_rad * (1 + high * high / 4);
    const bslam_real_t wide_var =
        seen->size_sd_rad * (1 + wide * wide / 4) * seen->size_sd_rad * (1 + wide * wide / 4);
    const bslam_real_t ratio_sd = ratio * bslam_sqrt(high_var / (high * high) + wide_var / (wide * wide));
    // Where the cosine is flat its error of the second order bounds the slope: sin >= sqrt(2 sd).
    const bslam_real_t flat = bslam_sqrt(2 * ratio_sd);
    const bslam_real_t slope = sine > flat ? sine : flat;
    const bslam_real_t sign = seen->from_left ? 1 : -1;
    const bslam_real_t angle_rad = sign * bslam_atan2(sine, cosine);
    const bslam_real_t x = range_m * cosine;
    const bslam_real_t y = range_m * sine * sign;
    in_beacon->pose = (bslam_pose_t){x, y, bslam_angle_wrap(angle_rad + BSLAM_PI - seen->bearing_rad)};
    // By the angle: with its derivatives by both apparent sizes; the distance hangs on the height alone.
    const bslam_real_t by_angle[3] = {-y, x, 1};
    const bslam_real_t angle_by_high = sign * ratio / (high * slope);
    const bslam_real_t angle_by_wide = -sign * ratio / (wide * slope);
    const bslam_real_t range_by_high = -range_m / high;
    const bslam_real_t by_high[3] = {range_by_high * cosine + by_angle[0] * angle_by_high,
                                     range_by_high * sine * sign + by_angle[1] * angle_by_high,
                                     angle_by_high};
    const bslam_real_t by_wide[3] = {by_angle[0] * angle_by_wide, by_angle[1] * angle_by_wide, angle_by_wide};
    const bslam_real_t by_bearing[3] = {0, 0, -1};
    for (int k = 0; k < 6; k++) {
        in_beacon->covariance[k] = 0;
    }
    add_column(in_beacon->covariance, by_high, high_var);
    add_column(in_beacon->covariance, by_wide, wide_var);
    add_column(in_beacon->covariance, by_bearing, seen->bearing_sd_rad * seen->bearing_sd_rad);
    return BSLAM_OK;
}

/// out += J m Jᵀ, all 3 x 3, symmetric ones as lower triangles.
static void add_turned(const bslam_real_t by[3][3], const bslam_real_t m[6], bslam_real_t out[6])
{
    static const int at[3][3] = {{0, 1, 3}, {1, 2, 4}, {3, 4, 5}};
    int k = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            for (int a = 0; a < 3; a++) {
                for (int b = 0; b < 3; b++) {
                    out[k] += by[i][a] * m[at[a][b]] * by[j][b];
                }
            }
            k++;
        }
    }
}

void bslam_pose_to_global(const bslam_doubtful_pose_t *beacon, const bslam_doubtful_pose_t *in_beacon,
                          bslam_doubtful_pose_t *global)
{
    bslam_real_t sine;
    bslam_real_t cosine;
    bslam_sin_cos(beacon->pose.theta_rad, &sine, &cosine);
    bslam_doubtful_pose_t result = {.pose = bslam_pose_compose(&beacon->pose, &in_beacon->pose)};
    const bslam_real_t by_beacon[3][3] = {
        {1, 0, beacon->pose.y_m - result.pose.y_m}, {0, 1, result.pose.x_m - beacon->pose.x_m}, {0, 0, 1}};
    const bslam_real_t by_inner[3][3] = {{cosine, -sine, 0}, {sine, cosine, 0}, {0, 0, 1}};
    add_turned(by_beacon, beacon->covariance, result.covariance);
    add_turned(by_inner, in_beacon->covariance, result.covariance);
    *global = result;
}
