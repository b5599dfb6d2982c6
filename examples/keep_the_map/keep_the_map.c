// Keep the map, load it, find oneself. The first run drives through a room and saves its map; each later run
// loads it, starts somewhere in the room, does not know where, and finds out.
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "bslam/bslam.h"

static bslam_t robot;
static const char *const states[] = {"following", "doubting", "lost"};  // bslam_recovery_state_t

// ---- the room, in place of your robot's sensors: a circle of 1 m among five tags, a left wheel that slips
// -----

static const float tags[5][2] = {{2.2f, 0.5f}, {1.2f, 2.8f}, {-2.1f, 1.6f}, {-1.0f, -1.4f}, {1.5f, -1.2f}};

static bslam_pose_t true_pose(int64_t time_us)
{
    const float turned_rad = 0.3e-6f * (float)time_us;
    return (bslam_pose_t){sinf(turned_rad), 1 - cosf(turned_rad), remainderf(turned_rad, 6.2831853f)};
}

static bslam_status_t drive_a_step(int64_t time_us)
{
    const bslam_odometry_reading_t wheels = {
        .time_us = time_us, .source = BSLAM_ODOMETRY_WHEELS, .left_m = 0.0109f, .right_m = 0.0132f};
    const bslam_pose_t at = true_pose(time_us);
    bslam_sighting_t seen[5];
    int count = 0;
    for (int i = 0; i < 5; i++) {
        const float dx_m = tags[i][0] - at.x_m, dy_m = tags[i][1] - at.y_m;
        const float bearing_rad = remainderf(atan2f(dy_m, dx_m) - at.theta_rad, 6.2831853f);
        if (fabsf(bearing_rad) < 0.7f) {  // in the camera's view
            seen[count++] = (bslam_sighting_t){
                .label = i, .bearing_rad = bearing_rad, .range_m = hypotf(dx_m, dy_m), .has_range = true};
        }
    }
    const bslam_status_t status = bslam_odometry(&robot, &wheels);
    return status != BSLAM_OK ? status : bslam_sightings(&robot, time_us, seen, count);
}

// ---- the map in a file; in flash: bslam_save_to_flash, which a power cut does not harm
// -----------------------

static bool write_file(void *file, const void *bytes, uint32_t count)
{
    return fwrite(bytes, 1, count, file) == count;
}

static bool read_file(const void *file, uint32_t at, void *bytes, uint32_t count)
{
    return fseek((FILE *)file, (long)at, SEEK_SET) == 0 && fread(bytes, 1, count, (FILE *)file) == count;
}

/// In the file beside the old map, and in its place once it is whole.
static bool save(FILE *file, const char *beside, const char *path)
{
    uint32_t bytes = 0;
    const bslam_map_sink_t sink = {write_file, file};
    const bslam_status_t status = bslam_save_map(&robot, &sink, &bytes);
    const bool is_closed = fclose(file) == 0;
    if (status != BSLAM_OK || !is_closed || rename(beside, path) != 0) {
        printf("%s: not saved: %s\n", path, status != BSLAM_OK ? bslam_status_name(status) : strerror(errno));
        remove(beside);
        return false;
    }
    printf("%s: saved, %d beacons, %u bytes\n", path, (int)bslam_health(&robot).beacons, (unsigned)bytes);
    return true;
}

static bool load(FILE *file, const char *path)
{
    fseek(file, 0, SEEK_END);
    const bslam_map_source_t source = {read_file, file, (uint32_t)ftell(file)};
    bslam_map_fault_t fault = BSLAM_MAP_FINE;
    const bslam_status_t status = bslam_load_map(&robot, &source, &fault);
    printf("%s: %s, bslam_map_fault_t %d, %d beacons\n", path, bslam_status_name(status), (int)fault,
           (int)bslam_health(&robot).beacons);
    fclose(file);
    return status == BSLAM_OK;
}

int main(int argc, char **argv)
{
    const char *path = argc > 1 ? argv[1] : "room.bslam";
    bslam_settings_t settings;
    int bad_setting = -1;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    settings.wheelbase_m = 0.2f;
    settings.recovery = 1;  // to notice that the robot is lost, and to find it again
    const bslam_status_t begun = bslam_init(&robot, &settings, &bad_setting);
    if (begun != BSLAM_OK) {  // one status names a setting
        printf("%s %s\n", bslam_status_name(begun),
               begun == BSLAM_E_PARAMETER ? bslam_settings_info(bad_setting)->name : "");
        return 1;
    }
    FILE *file = fopen(path, "rb");
    if (file == NULL && errno != ENOENT) {  // a map that is there and cannot be read must not be overwritten
        printf("%s: %s\n", path, strerror(errno));
        return 1;
    }
    const bool has_map = file != NULL;
    if (has_map && !load(file, path)) {
        return 1;  // a damaged map is refused as a whole, and the fault says why
    }
    char beside[512];
    snprintf(beside, sizeof beside, "%s.new", path);
    FILE *beside_file = fopen(beside, "wb");
    if (beside_file == NULL) {  // said before the drive, not after it
        printf("%s: %s\n", beside, strerror(errno));
        return 1;
    }
    const int64_t start_us = has_map ? 7000000 : 0;  // elsewhere on the circle
    bslam_recovery_state_t before = bslam_health(&robot).state;
    printf("at the start: %s\n", states[before]);
    for (int64_t time_us = start_us + 40000; time_us <= start_us + 30000000; time_us += 40000) {
        const bslam_status_t status = drive_a_step(time_us);
        const bslam_recovery_state_t state = bslam_health(&robot).state;
        if (status != BSLAM_OK) {
            printf("%s\n", bslam_status_name(status));
        } else if (state != before) {
            printf("after %.2f s: %s\n", 1e-6 * (double)(time_us - start_us), states[state]);
        }
        before = state;
    }
    const bslam_pose_t pose = bslam_pose(&robot), truth = true_pose(start_us + 30000000);
    printf("at x %.2f m, y %.2f m, %.2f rad; in truth at x %.2f m, y %.2f m, %.2f rad\n", pose.x_m, pose.y_m,
           pose.theta_rad, truth.x_m, truth.y_m, truth.theta_rad);
    return save(beside_file, beside, path) ? 0 : 1;
}
