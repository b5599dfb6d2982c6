/// One side of an object in the half-resolution copy: which line in the frame it is, and how sure that is.
/// Inside of outline.c; MATH-CAMERA "Outline".
///
/// A side is crossed by scan lines: rows for an upright side, columns for a level one. Boundary p of a scan
/// line lies between pixels p - 1 and p of the half-resolution copy, at 2 p - 0.5 in the whole frame. On each
/// line a window of boundaries is looked at, around where the rough box has the side; places are counted
/// inwards in it.
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_SIDE_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_SIDE_H

#include "vision/frame.h"
#include "vision/camera/lens.h"

enum {
    BSLAM_SIDE_SCANS = 7,      ///< scan lines across a side, at most
    BSLAM_SIDE_PLACES = 24,    ///< boundaries looked at on each, at most,
    BSLAM_SIDE_REACH_OUT = 6,  ///< and how many of them lie outside the rough box
};

typedef enum bslam_side_name {
    BSLAM_SIDE_LEFT,
    BSLAM_SIDE_RIGHT,
    BSLAM_SIDE_TOP,
    BSLAM_SIDE_BOTTOM
} bslam_side_name_t;

/// A plane that stands upright at unit distance before the camera and faces a bearing.
typedef struct bslam_facing {
    const bslam_camera_t *camera;
    bslam_mounting_t mounting;  ///< the camera's
    bslam_real_t sine;          ///< of the bearing
    bslam_real_t cosine;
} bslam_facing_t;

/// A point of it, tangents: across is y/x (positive to the left), up is z/x, in axes whose x looks in the
/// bearing.
typedef struct bslam_plane_point {
    bslam_real_t across;
    bslam_real_t up;
} bslam_plane_point_t;

/// Where the plane is met by what a point of the frame sees; false if that is not before it.
bool bslam_facing_from_frame(const bslam_facing_t *facing, bslam_real_t u_px, bslam_real_t v_px,
                             bslam_plane_point_t *point);

/// The reverse; false if the lens does not see the point within some frames' width.
bool bslam_facing_to_frame(const bslam_facing_t *facing, bslam_plane_point_t point, bslam_real_t *u_px,
                           bslam_real_t *v_px);

/// How a body stands: the tangent of its turn, positive if its left is nearer, and between which places
/// across its front is seen. Beyond them are its flanks, at right angles to the front.
typedef struct bslam_stance {
    float turn;
    float left;
    float right;
} bslam_stance_t;

/// Of what is flat and faces the eye: no flank at either end.
static const bslam_stance_t BSLAM_FLAT = {0.0f, 1e9f, -1e9f};

typedef struct bslam_side {
    const uint16_t *half;
    int32_t across;  ///< elements of `half` from a pixel to the next along a scan line
    int32_t along;   ///< and to the next scan line
    int32_t places;  ///< boundaries looked at on each line
    int32_t size;    ///< pixels of a scan line
    int32_t lines;   ///< scan lines of the frame
    bool level;      ///< an upper or lower side: scan lines are columns
    bool backwards;  ///< inwards is towards smaller coordinates
    float reach;     ///< places by which a level side is farther inwards where it is nearer by all of itself
    float rough_cost;  ///< of a line, by the square of its places away from the rough side
    int32_t count;
    int16_t scan[BSLAM_SIDE_SCANS];   ///< coordinate of each line,
    int16_t first[BSLAM_SIDE_SCANS];  ///< of its boundary at place 0,
    float at[BSLAM_SIDE_SCANS];       ///< where it is across the facing plane,
    float base[BSLAM_SIDE_SCANS];     ///< place of the rough side on it
    uint8_t steps[BSLAM_SIDE_SCANS][BSLAM_SIDE_PLACES];
} bslam_side_t;

/// Lays scan lines over a side: an upright one at `at` across, between the heights `from` and `to`, or a
/// level one at `at` up, between two places across. `pixel` is a frame pixel's size in the plane. The lines
/// keep off the side's ends; where it is short there are fewer of them. False if the lens does not see the
/// side.
bool bslam_side_scan(bslam_side_t *side, const bslam_frame_t *frame, const bslam_facing_t *facing,
                     bslam_side_name_t name, bslam_real_t at, bslam_real_t from, bslam_real_t to,
                     bslam_real_t pixel);

/// A line that lies `shift` places inwards of the rough side.
typedef struct bslam_line {
    float shift;
    float offset;    ///< mean shift of all lines, by their probabilities, less this one's,
    float variance;  ///< and these shifts' variance, 0 if no other edge comes into question
} bslam_line_t;

/// Mean contrast along a level side of a body that stands so, between two places across, as a share: 0 none,
/// to
/// 1. `at`: its height at the place 0. Below 0 if the lens or the frame shows nothing of it.
float bslam_side_contrast(const bslam_frame_t *frame, const bslam_facing_t *facing, bslam_side_name_t name,
                          bslam_real_t at, bslam_real_t from, bslam_real_t to, const bslam_stance_t *stance);

/// How likely the likeliest line of a stance is: the logarithm of its odds, but for a constant.
float bslam_side_score(const bslam_side_t *side, const bslam_stance_t *stance);

/// That line.
bslam_line_t bslam_side_line(const bslam_side_t *side, const bslam_stance_t *stance);

/// Points of the plane on an edge.
typedef struct bslam_edge {
    int32_t count;
    bslam_plane_point_t points[BSLAM_SIDE_SCANS];
    bslam_real_t offset;  ///< as of the line; half-resolution pixels
    bslam_real_t variance;
} bslam_edge_t;

/// The edge along a line, to a fraction of a pixel: on each scan line the centroid of the change of colour.
void bslam_side_trace(const bslam_side_t *side, const bslam_facing_t *facing, const bslam_line_t *line,
                      const bslam_stance_t *stance, bslam_edge_t *edge);

#endif
