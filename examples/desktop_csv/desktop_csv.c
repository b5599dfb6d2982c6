// Reads a log folder's odometry.csv and sightings.csv (docs/LOG-FORMAT.md) and runs the filter on them:
//
//     desktop_csv FOLDER [SETTING=VALUE ...] > path.tum
//
// The path goes to standard output, a row for each of odometry's: time_s x y 0 0 0 qz qw, the TUM format. The
// map goes to standard error. Exit status 1: the filter refused something, or the path cannot be written;
// 2: it could not begin, or a file is bad.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bslam/bslam.h"

static bslam_t robot;
static int refused;  // rows and frames that the filter did not take

/// A table of numbers, read row by row.
static struct table {
    char path[512], header[512], row[512];
    int64_t time_us;  // of the row; INT64_MAX behind the last one
    FILE *file;
} odometry, sightings;

static void require(bool is_fine, const char *where, const char *what, const char *why)
{
    if (!is_fine) {
        fprintf(stderr, "desktop_csv: %s: %s: %s\n", where, what, why);
        exit(2);
    }
}

/// What stands under a title, up to a comma or the line's end; NULL: there is no such title, or no field.
static const char *field_of(const char *titles, const char *row, const char *title)
{
    if (strcspn(titles, ",\r\n") == strlen(title) && strncmp(titles, title, strlen(title)) == 0) {
        return row;
    }
    const char *more = strchr(titles, ','), *rest = strchr(row, ',');
    return more == NULL || rest == NULL ? NULL : field_of(more + 1, rest + 1, title);
}

/// A number of the row, a whole one but of metres and radians; `otherwise` where there is no such column, or
/// nothing in it.
static double value(const struct table *table, const char *title, double otherwise)
{
    const char *field = field_of(table->header, table->row, title), *end = NULL;
    const double number = field == NULL ? otherwise : strtod(field, (char **)&end);
    const bool is_fine = strstr(title, "_m") || strstr(title, "_rad") || number == trunc(number);
    require(end == NULL || (strchr(",\r\n", *end) && is_fine), table->path, title, table->row);
    return end == field ? otherwise : number;
}

static void read_row(struct table *table)
{
    const bool is_row = fgets(table->row, sizeof table->row, table->file) != NULL;
    table->time_us = is_row ? (int64_t)value(table, "time_us", -1) : INT64_MAX;
}

/// With columns as in "allowed: time_us,left_m" and no others.
static void open_table(struct table *table, const char *folder, const char *name, const char *columns)
{
    snprintf(table->path, sizeof table->path, "%s/%s", folder, name);
    table->file = fopen(table->path, "r");
    require(table->file != NULL && fgets(table->header, sizeof table->header, table->file) != NULL,
            table->path, "its header", "the file does not exist, or cannot be read");
    strcpy(table->row, table->header);
    for (char *title = strtok(table->row, ",\r\n"); title != NULL; title = strtok(NULL, ",\r\n")) {
        require(field_of(strchr(columns, ' ') + 1, columns, title) != NULL, table->path, title, columns);
    }
    read_row(table);
}

static void set(bslam_settings_t *settings, const char *word)
{
    char name[64] = "", more;
    float number;
    int id;
    const bool is_whole = sscanf(word, "%63[^=]=%f%c", name, &number, &more) == 2;
    for (id = 0; bslam_settings_info(id) != NULL && strcmp(bslam_settings_info(id)->name, name) != 0; id++) {
    }
    require(is_whole && bslam_settings_set(settings, id, number) == BSLAM_OK, "setting", word,
            "allowed: NAME=VALUE, names and ranges as in docs/TUNING.md");
}

/// Up to a moment. Rows of one stamp are one frame.
static void take_frames(struct table *table, int64_t last_us)
{
    bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX];
    while (table->time_us <= last_us) {
        const int64_t time_us = table->time_us;
        int count = 0;
        for (; table->time_us == time_us && count < BSLAM_SIGHTINGS_MAX; count++) {
            seen[count] = (bslam_sighting_t){
                .bearing_rad = (float)value(table, "bearing_rad", NAN),
                .range_m = (float)value(table, "range_m", NAN),
                .has_range = !isnan(value(table, "range_m", NAN)),
                .bearing_sd_rad = (float)value(table, "bearing_sd_rad", 0),
                .range_sd_m = (float)value(table, "range_sd_m", 0),
                .label = (int32_t)value(table, "beacon_id", BSLAM_LABEL_NONE),
                .beacon_class = value(table, "mappable", 1) ? BSLAM_CLASS_NONE : BSLAM_CLASS_NOT_MAPPABLE};
            read_row(table);
        }
        refused += bslam_sightings(&robot, time_us, seen, count) != BSLAM_OK;
    }
}

int main(int argc, char **argv)
{
    bslam_settings_t settings;
    bslam_beacon_view_t beacon;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    for (int i = 2; i < argc; i++) {
        set(&settings, argv[i]);
    }
    require(argc >= 2, "arguments", "allowed", "FOLDER [SETTING=VALUE ...]");
    const bslam_status_t status = bslam_init(&robot, &settings, &(int){-1});
    require(status == BSLAM_OK, "settings", bslam_status_name(status), "as docs/C-API.md explains");
    open_table(&odometry, argv[1], "odometry.csv", "allowed: time_us,left_m,right_m,left_ticks,right_ticks");
    open_table(&sightings, argv[1], "sightings.csv",
               "allowed: time_us,beacon_id,bearing_rad,range_m,bearing_sd_rad,range_sd_m,mappable");
    // Frames before the first travel start the clock; each other goes in after the reading that covers it.
    take_frames(&sightings, strstr(odometry.header, "left_m") != NULL ? odometry.time_us - 1 : INT64_MIN);
    while (odometry.time_us < INT64_MAX) {
        const bslam_odometry_reading_t reading = {
            .time_us = odometry.time_us,
            .source = strstr(odometry.header, "left_ticks") ? BSLAM_ODOMETRY_TICKS : BSLAM_ODOMETRY_WHEELS,
            .left_ticks = (uint32_t)(int64_t)value(&odometry, "left_ticks", 0),
            .right_ticks = (uint32_t)(int64_t)value(&odometry, "right_ticks", 0),
            .left_m = (float)value(&odometry, "left_m", NAN),
            .right_m = (float)value(&odometry, "right_m", NAN)};
        refused += bslam_odometry(&robot, &reading) != BSLAM_OK;
        read_row(&odometry);  // behind the last one come all frames that are left
        take_frames(&sightings, odometry.time_us < INT64_MAX ? reading.time_us : INT64_MAX - 1);
        const bslam_pose_t pose = bslam_pose(&robot);
        printf("%.6f %.6f %.6f 0 0 0 %.9f %.9f\n", 1e-6 * (double)reading.time_us, pose.x_m, pose.y_m,
               sin(0.5 * pose.theta_rad), cos(0.5 * pose.theta_rad));
    }
    for (int i = 0; bslam_beacon(&robot, i, &beacon) == BSLAM_OK; i++) {
        fprintf(stderr, "beacon %d: x %.9g m, y %.9g m\n", (int)beacon.label, beacon.x_m, beacon.y_m);
    }
    fprintf(stderr, "%d rows and frames refused%s\n", refused, fflush(stdout) ? "; path cut short" : "");
    return refused > 0 || ferror(stdout) ? 1 : 0;
}
