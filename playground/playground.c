// The estimator as the page calls it: one robot, flat functions, numbers that come back in one array.
#include "bslam/bslam.h"

/// For the linker: the page calls it.
#define PAGE(name) __attribute__((export_name(#name))) name

enum { NUMBERS_MAX = 16 };

static bslam_t robot;
static bslam_settings_t settings;
static int bad_setting;
static bslam_sighting_t frame[BSLAM_SIGHTINGS_MAX];
static int frame_count;
static double numbers[NUMBERS_MAX];

/// Where the answers of several numbers stand.
const double *PAGE(page_numbers)(void)
{
    return numbers;
}

const char *PAGE(page_status_name)(int status)
{
    return bslam_status_name((bslam_status_t)status);
}

// ---- settings ---------------------------------------------------------------------------------------------

/// NULL behind the last one.
const char *PAGE(page_setting_name)(int id)
{
    const bslam_setting_info_t *info = bslam_settings_info(id);
    return info == NULL ? NULL : info->name;
}

/// Its limits: low, high, and 1 for a whole number.
void PAGE(page_setting_limits)(int id)
{
    const bslam_setting_info_t *info = bslam_settings_info(id);
    numbers[0] = info->low;
    numbers[1] = info->high;
    numbers[2] = info->is_integer;
}

void PAGE(page_preset)(int preset)
{
    bslam_settings_preset(&settings, (bslam_preset_t)preset);
}

static void *field_of(const bslam_setting_info_t *info)
{
    return (unsigned char *)&settings + info->offset;
}

double PAGE(page_get)(int id)
{
    const bslam_setting_info_t *info = bslam_settings_info(id);
    return info->is_integer ? (double)*(const int32_t *)field_of(info)
                            : (double)*(const bslam_real_t *)field_of(info);
}

/// Within its limits, which the page has looked at.
void PAGE(page_set)(int id, double value)
{
    const bslam_setting_info_t *info = bslam_settings_info(id);
    if (info->is_integer) {
        *(int32_t *)field_of(info) = (int32_t)value;
    } else {
        *(bslam_real_t *)field_of(info) = (bslam_real_t)value;
    }
}

/// A robot at the origin of an empty map, by the settings as they stand.
int PAGE(page_begin)(void)
{
    bad_setting = -1;
    frame_count = 0;
    return (int)bslam_init(&robot, &settings, &bad_setting);
}

/// Which setting page_begin did not take; -1: none in particular.
int PAGE(page_bad_setting)(void)
{
    return bad_setting;
}

// ---- what the robot measures ------------------------------------------------------------------------------

/// a, b: by the source, left and right or forward speed and turn rate. gyro_radps NaN: none.
int PAGE(page_odometry)(int source, double time_us, double a, double b, double gyro_radps,
                        double gyro_sd_radps)
{
    const bool has_gyro = gyro_radps == gyro_radps;
    bslam_odometry_reading_t reading = {.time_us = (int64_t)time_us,
                                        .source = (bslam_odometry_source_t)source,
                                        .has_gyro = has_gyro,
                                        .gyro_radps = has_gyro ? (bslam_real_t)gyro_radps : 0,
                                        .gyro_sd_radps = (bslam_real_t)gyro_sd_radps};
    switch (reading.source) {
    case BSLAM_ODOMETRY_WHEELS:
        reading.left_m = (bslam_real_t)a;
        reading.right_m = (bslam_real_t)b;
        break;
    case BSLAM_ODOMETRY_TICKS:
        reading.left_ticks = (uint32_t)a;
        reading.right_ticks = (uint32_t)b;
        break;
    case BSLAM_ODOMETRY_VELOCITY:
        reading.v_mps = (bslam_real_t)a;
        reading.omega_radps = (bslam_real_t)b;
        break;
    }
    return (int)bslam_odometry(&robot, &reading);
}

int PAGE(page_resume_odometry)(double position_sd_m, double heading_sd_rad)
{
    return (int)bslam_resume_odometry(&robot, (bslam_real_t)position_sd_m, (bslam_real_t)heading_sd_rad);
}

/// One more sighting of the frame to come. range_m NaN: none.
int PAGE(page_sighting)(double bearing_rad, double range_m, int label, int beacon_class,
                        double bearing_sd_rad, double range_sd_m, double range_scale_sd, double score)
{
    if (frame_count == BSLAM_SIGHTINGS_MAX) {
        return (int)BSLAM_E_COUNT;
    }
    const bool has_range = range_m == range_m;
    frame[frame_count++] = (bslam_sighting_t){.bearing_rad = (bslam_real_t)bearing_rad,
                                              .range_m = has_range ? (bslam_real_t)range_m : 0,
                                              .has_range = has_range,
                                              .label = label,
                                              .beacon_class = (uint8_t)beacon_class,
                                              .bearing_sd_rad = (bslam_real_t)bearing_sd_rad,
                                              .range_sd_m = (bslam_real_t)range_sd_m,
                                              .range_scale_sd = (bslam_real_t)range_scale_sd,
                                              .score = (bslam_real_t)score};
    return (int)BSLAM_OK;
}

/// Gives the frame, and begins another.
int PAGE(page_frame)(double time_us)
{
    const int count = frame_count;
    frame_count = 0;
    return (int)bslam_sightings(&robot, (int64_t)time_us, frame, count);
}

// ---- what it says -----------------------------------------------------------------------------------------

/// x, y, theta; then the lower triangle of their covariance.
void PAGE(page_pose)(void)
{
    const bslam_pose_t pose = bslam_pose(&robot);
    bslam_real_t lower[6];
    bslam_pose_covariance(&robot, lower);
    numbers[0] = pose.x_m;
    numbers[1] = pose.y_m;
    numbers[2] = pose.theta_rad;
    for (int i = 0; i < 6; i++) {
        numbers[3 + i] = lower[i];
    }
}

/// As page_pose, without the covariance, at another time.
int PAGE(page_pose_at)(double time_us)
{
    bslam_pose_t pose;
    const bslam_status_t status = bslam_pose_at(&robot, (int64_t)time_us, &pose);
    if (status == BSLAM_OK) {
        numbers[0] = pose.x_m;
        numbers[1] = pose.y_m;
        numbers[2] = pose.theta_rad;
    }
    return (int)status;
}

/// Recovery state, beacons in the map, hypotheses.
void PAGE(page_health)(void)
{
    const bslam_health_t health = bslam_health(&robot);
    numbers[0] = (double)health.state;
    numbers[1] = health.beacons;
    numbers[2] = health.hypotheses;
}

/// Of a sighting of the last frame: outcome, reason, uid or -1, test ratio, weight.
void PAGE(page_account)(int index)
{
    int count;
    const bslam_account_t *account = &bslam_results(&robot, &count)[index];
    numbers[0] = (double)account->outcome;
    numbers[1] = (double)account->reason;
    numbers[2] = account->has_beacon ? (double)account->beacon_uid : -1;
    numbers[3] = account->test_ratio;
    numbers[4] = account->weight;
}

/// uid, label, kind, confirmed, sightings, x, y, xx, xy, yy.
int PAGE(page_beacon)(int index)
{
    bslam_beacon_view_t view;
    const bslam_status_t status = bslam_beacon(&robot, index, &view);
    if (status == BSLAM_OK) {
        const double found[] = {
            view.uid, view.label, (double)view.kind,     view.confirmed,        view.sightings,
            view.x_m, view.y_m,   view.covariance_m2.xx, view.covariance_m2.xy, view.covariance_m2.yy};
        for (int i = 0; i < (int)(sizeof found / sizeof found[0]); i++) {
            numbers[i] = found[i];
        }
    }
    return (int)status;
}

/// Goes on with a chain of fingerprints; 0: starts one.
uint64_t PAGE(page_fingerprint)(uint64_t before)
{
    return bslam_fingerprint(&robot, before == 0 ? BSLAM_FINGERPRINT_START : before);
}
