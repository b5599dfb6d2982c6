/// Pictures of things that stand upright in a room, drawn ray by ray: what the vision modules see in the
/// tests.
#ifndef UNIT_PICTURE_H
#define UNIT_PICTURE_H

#include "vision/frame.h"
#include "vision/camera/lens.h"
#include "base/scalar.h"

#define UNIT_PICTURE_WIDTH 320
#define UNIT_PICTURE_HEIGHT 240

/// An upright rectangle: from (x0, y0) to (x1, y1) in plan, in the robot's axes with the camera over the
/// origin, between two heights above the floor; of one colour, 0 to 255.
typedef struct unit_panel {
    double x0_m, y0_m, x1_m, y1_m;
    double low_m, high_m;
    double red, green, blue;
} unit_panel_t;

/// A finished frame; `frame` points into the rest.
typedef struct unit_picture {
    bslam_frame_t frame;
    bslam_surroundings_t surroundings;
    uint16_t half[UNIT_PICTURE_HEIGHT / 2 * (UNIT_PICTURE_WIDTH / 2)];
} unit_picture_t;

/// 60 degrees wide, looking ahead from a height of 0.5 m; and 180 degrees.
bslam_camera_t unit_pinhole(void);
bslam_camera_t unit_equidistant(void);

/// One colour everywhere, which is also the wall's.
void unit_picture_fill(unit_picture_t *picture, double red, double green, double blue);

/// Draws panels before a wall of one colour; of two in one ray the nearer is seen. A pixel of the
/// half-resolution copy is the mean of 16 rays.
void unit_picture_draw(unit_picture_t *picture, const bslam_camera_t *camera, const double wall[3],
                       const unit_panel_t *panels, int count);

/// Sets a pixel of the half-resolution copy.
void unit_picture_set(unit_picture_t *picture, int x, int y, double red, double green, double blue);

#endif
