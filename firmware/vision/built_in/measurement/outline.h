/// Where exactly an object's four sides are: a rough box in, an upright trapezoid out, to a fraction of a
/// pixel. MATH-CAMERA "Outline".
///
/// Sides are described in a plane that stands upright at unit distance before the camera and faces the
/// object, so that neither the lens nor the camera's pitch bends them: upright edges of things in the room
/// are upright lines there, and level ones straight lines whose slope tells how obliquely they are seen.
#ifndef BSLAM_VISION_BUILT_IN_MEASUREMENT_OUTLINE_H
#define BSLAM_VISION_BUILT_IN_MEASUREMENT_OUTLINE_H

#include "base/status.h"
#include "vision/frame.h"
#include "vision/camera/lens.h"

/// A part of the frame between two upright lines; its upper and lower ends may slope. Whole-frame pixels,
/// edges as in bslam_box_t.
typedef struct bslam_quad {
    bslam_real_t left_px;
    bslam_real_t right_px;
    bslam_real_t top_left_px;
    bslam_real_t bottom_left_px;
    bslam_real_t top_right_px;
    bslam_real_t bottom_right_px;
} bslam_quad_t;

/// The sides in the facing plane, tangents: across is y/x (positive to the left), up is z/x, in axes whose x
/// looks in the direction facing_rad.
typedef struct bslam_outline {
    bslam_real_t facing_rad;  ///< bearing of the plane's centre, in the robot's frame
    bslam_real_t left;        ///< across; left > right
    bslam_real_t right;
    bslam_real_t body_left;  ///< across: its outermost upright sides, of the front or of a flank
    bslam_real_t body_right;
    bslam_real_t top;  ///< up, at across = 0
    bslam_real_t bottom;
    bslam_real_t left_var;  ///< their variances: large where several lines may be the side
    bslam_real_t right_var;
    bslam_real_t top_var;
    bslam_real_t bottom_var;
    bslam_real_t turn;      ///< up at a place across is up (1 + turn across): tangent of the slant
    bslam_real_t turn_var;  ///< its variance
    bslam_real_t middle;    ///< across, of the point half way between the two sides in plan
    bslam_real_t middle_var;
    bslam_real_t ends_var;  ///< of the middle, for what is open which lines its upright sides are; 0 as found
    bslam_real_t pixel;     ///< size of a frame pixel in these units, at the centre
    bslam_quad_t quad;      ///< the same corners in the frame
} bslam_outline_t;

/// What is known of an object's size; 0: not known, of the depth: it is flat.
typedef struct bslam_front {
    bslam_real_t height_m;
    bslam_real_t depth_m;   ///< how far it stands out from the wall, 2 heights at the most
    bslam_real_t narrow_m;  ///< its front is so wide at least,
    bslam_real_t wide_m;    ///< and at most
} bslam_front_t;

/// Finds the outline near a rough box, which may be 4 pixels off on each side. A body that stands out from
/// the wall shows a flank as well as its front: the outline is then the front's. How wide that is tells turns
/// apart. BSLAM_E_RANGE, and *outline unchanged, if the box is empty, lies outside the frame, or the lens
/// sees no upright plane there, or a size is none.
BSLAM_MUST_CHECK bslam_status_t bslam_outline_find(const bslam_frame_t *frame, const bslam_camera_t *camera,
                                                   const bslam_box_t *rough, const bslam_front_t *front,
                                                   bslam_outline_t *outline);

#endif
