// A made-up drive for the examples' robots: a circle of 0.8 m at 0.3 m/s among five tags, a left wheel that
// slips by one part in a hundred, and a detector that tells of each picture 40 ms late, ten times a second,
// in lines that end either way, some with a blank before. Two are too long: one ends as a sighting does, one
// begins so. Blank lines come, too. With DRIVE_METRE: a metre straight ahead without slip, a tag 2 m ahead
// of the camera.
#ifndef DRIVE_H
#define DRIVE_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>

#ifdef DRIVE_METRE
#define DRIVE_US 6000000  // in the middle four of them it moves
static const double drive_tags[5][2] = {{2.05, 0.0}, {-1.0, 0.0}, {-1.0, 1.0}, {-2.0, 0.0}, {-2.0, 1.0}};
#else
#define DRIVE_US 42000000  // two and a half rounds
static const double drive_tags[5][2] = {{2.0, 0.5}, {1.0, 2.5}, {-2.0, 1.5}, {-1.0, -1.5}, {1.5, -1.2}};
#endif
#define PICTURE_US 100000
#define AGE_US 40000
#define NOISE_US 7700000
#ifndef NOISE
#define NOISE \
    "63 letters, after which the examples have no room for any more:40 9 0 2000\n\n\r\n \n" \
    "                                                    40 9 0 20005\n"
#endif

/// Where the robot is: x, y, heading.
static inline void drive_pose(int64_t time_us, double pose[3])
{
    const double turned_rad = 0.3 / 0.8 * 1e-6 * (double)time_us;
    pose[0] = 0.8 * sin(turned_rad);
    pose[1] = 0.8 * (1.0 - cos(turned_rad));
    pose[2] = turned_rad;
#ifdef DRIVE_METRE
    pose[0] = fmin(fmax(0.25e-6 * (double)(time_us - 1000000), 0.0), 1.0);
    pose[1] = pose[2] = 0.0;
#endif
}

/// Encoder counts of a wheel on the `side` of the robot, -1 left, 1 right: 1440 a turn, wheels 0.2 m apart.
static inline long drive_ticks(int64_t time_us, int side)
{
#ifdef DRIVE_METRE
    double pose[3];
    drive_pose(time_us, pose);
    const double travel_m = pose[0] + 0.0 * side;
#else
    const double travel_m = 0.3 / 0.8 * (0.8 + 0.1 * side) * (side < 0 ? 1.01 : 1.0) * 1e-6 * (double)time_us;
#endif
    return (long)floor(travel_m * 1440.0 / (2.0 * 3.14159265358979 * 0.033));
}

/// The detector's lines of the picture that it tells of at `time_us`; the camera is 5 cm ahead of the axle.
static inline int drive_lines(int64_t time_us, char *text, size_t room)
{
    double pose[3];
    int length = time_us == NOISE_US ? snprintf(text, room, "%s", NOISE) : 0;
    drive_pose(time_us - AGE_US, pose);
    for (int i = 0; i < 5; i++) {
        const double dx = drive_tags[i][0] - pose[0] - 0.05 * cos(pose[2]);
        const double dy = drive_tags[i][1] - pose[1] - 0.05 * sin(pose[2]);
        const double bearing_rad = remainder(atan2(dy, dx) - pose[2], 2.0 * 3.14159265358979);
        if (fabs(bearing_rad) < 0.6) {
            length += snprintf(text + length, room - (size_t)length, "%d %d %d %d%s", AGE_US / 1000, i + 1,
                               (int)lround(1e3 * bearing_rad), (int)lround(1e3 * hypot(dx, dy)),
                               i % 2 == 0 ? "\n" : " \r\n");
        }
    }
    return length;
}

#endif
