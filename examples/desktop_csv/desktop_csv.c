// Reads a log folder's odometry.csv and sightings.csv (docs/LOG-FORMAT.md) and runs the filter on them:
//
//     desktop_csv FOLDER [SETTING=VALUE ...] > path.tum
//
// The path goes to standard output, a row for each of odometry's: time_s x y 0 0 0 qz qw, the TUM format. The
// map goes to standard error.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bslam/bslam.h"

static bslam_t robot;
static int refused;  // rows and frames that the filter did not take

/// A table of numbers, read row by row.
typedef struct table {
    char path[512], header[512], row[512];
    FILE *file;
} table_t;

static void stop(const char *where, const char *what, const char *why)
{
    fprintf(stderr, "desktop_csv: %s: %s: %s\n", where, what, why);
    exit(2);
}

static bool read_row(table_t *table)
{
    return fgets(table->row, sizeof table->row, table->file) != NULL;
}

static void open_table(table_t *table, const char *folder, const char *name)
{
    snprintf(table->path, sizeof table->path, "%s/%s", folder, name);
    table->file = fopen(table->path, "r");
    if (table->file == NULL || !read_row(table)) {
        stop(table->path, "its header", "cannot be read");
    }
    strcpy(table->header, table->row);
}

/// A number of the row; `otherwise` where there is no such column, or nothing in it.
static double value(table_t *table, const char *name, double otherwise)
{
    const size_t length = strlen(name);
    char *title = table->header, *field = table->row, *end;
    for (; strncmp(title, name, length) != 0 || strchr(",\r\n", title[length]) == NULL; title++, field++) {
        title = strchr(title, ',');
        field = strchr(field, ',');
        if (title == NULL || field == NULL) {
            return otherwise;
        }
    }
    const double number = strtod(field, &end);
    if (strchr(",\r\n", *end) == NULL) {
        stop(table->path, name, table->row);  // which has no number there
    }
    return end == field ? otherwise : number;
}

static void set(bslam_settings_t *settings, const char *word)
{
    char name[64];
    float number;
    for (int id = 0; sscanf(word, "%63[^=]=%f", name, &number) == 2 && bslam_settings_info(id) != NULL;
         id++) {
        if (strcmp(bslam_settings_info(id)->name, name) == 0 &&
            bslam_settings_set(settings, id, number) == BSLAM_OK) {
            return;
        }
    }
    stop("setting", word, "allowed: NAME=VALUE, names and ranges as in docs/TUNING.md");
}

/// Rows of one stamp are one frame. Returns whether there is another row.
static bool take_frame(table_t *table)
{
    bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX];
    const double time_us = value(table, "time_us", -1);
    int count = 0;
    bool is_more = true;
    for (; is_more && count < BSLAM_SIGHTINGS_MAX && value(table, "time_us", -1) == time_us; count++) {
        seen[count] = (bslam_sighting_t){
            .bearing_rad = (float)value(table, "bearing_rad", NAN),
            .range_m = (float)value(table, "range_m", NAN),
            .has_range = !isnan(value(table, "range_m", NAN)),
            .bearing_sd_rad = (float)value(table, "bearing_sd_rad", 0),
            .range_sd_m = (float)value(table, "range_sd_m", 0),
            .label = (int32_t)value(table, "beacon_id", BSLAM_LABEL_NONE),
            .beacon_class = value(table, "mappable", 1) == 0 ? BSLAM_CLASS_NOT_MAPPABLE : BSLAM_CLASS_NONE};
        is_more = read_row(table);
    }
    refused += bslam_sightings(&robot, (int64_t)time_us, seen, count) != BSLAM_OK;
    return is_more;
}

int main(int argc, char **argv)
{
    static table_t odometry, sightings;
    bslam_settings_t settings;
    bslam_beacon_view_t beacon;
    int bad_setting;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    for (int i = 2; i < argc; i++) {
        set(&settings, argv[i]);
    }
    if (argc < 2 || bslam_init(&robot, &settings, &bad_setting) != BSLAM_OK) {
        stop("arguments", "allowed", "FOLDER [SETTING=VALUE ...], settings that go together");
    }
    open_table(&odometry, argv[1], "odometry.csv");
    open_table(&sightings, argv[1], "sightings.csv");
    bool is_more = read_row(&sightings);
    for (bool is_first = strstr(odometry.header, "left_m") != NULL; read_row(&odometry); is_first = false) {
        const bslam_odometry_reading_t reading = {
            .time_us = (int64_t)value(&odometry, "time_us", -1),
            .source = strstr(odometry.header, "left_ticks") ? BSLAM_ODOMETRY_TICKS : BSLAM_ODOMETRY_WHEELS,
            .left_ticks = (uint32_t)(int64_t)value(&odometry, "left_ticks", 0),
            .right_ticks = (uint32_t)(int64_t)value(&odometry, "right_ticks", 0),
            .left_m = (float)value(&odometry, "left_m", NAN),
            .right_m = (float)value(&odometry, "right_m", NAN)};
        // A frame goes in after the reading that covers it; one before the first travel starts the clock.
        while (is_first && is_more && value(&sightings, "time_us", -1) < (double)reading.time_us) {
            is_more = take_frame(&sightings);
        }
        refused += bslam_odometry(&robot, &reading) != BSLAM_OK;
        while (is_more && value(&sightings, "time_us", -1) <= (double)reading.time_us) {
            is_more = take_frame(&sightings);
        }
        const bslam_pose_t pose = bslam_pose(&robot);
        printf("%.6f %.6f %.6f 0 0 0 %.9f %.9f\n", 1e-6 * (double)reading.time_us, pose.x_m, pose.y_m,
               sin(0.5 * pose.theta_rad), cos(0.5 * pose.theta_rad));
    }
    for (int i = 0; bslam_beacon(&robot, i, &beacon) == BSLAM_OK; i++) {
        fprintf(stderr, "beacon %d: x %.9g m, y %.9g m\n", (int)beacon.label, beacon.x_m, beacon.y_m);
    }
    fprintf(stderr, "%d rows and frames refused\n", refused);
}
