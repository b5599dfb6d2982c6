/// Every compile-time size of the vision library. How to override one: base/config.h.
#ifndef BSLAM_VISION_CONFIG_H
#define BSLAM_VISION_CONFIG_H

#include "base/config.h"

/// Largest frame that the vision front end takes, pixels; multiples of 4. RAM grows with the area: an
/// instance takes about 125 KB for QVGA and four cameras, 111 KB for one, 48 KB for QQVGA and one. A camera
/// with a zoom of 2 needs room for twice its width and height: 430 KB for QVGA and four.
#ifndef BSLAM_IMAGE_WIDTH_MAX
#define BSLAM_IMAGE_WIDTH_MAX 320
#endif
#if BSLAM_IMAGE_WIDTH_MAX < 32 || BSLAM_IMAGE_WIDTH_MAX > 640 || BSLAM_IMAGE_WIDTH_MAX % 4 != 0
#error "BSLAM_IMAGE_WIDTH_MAX is 32 to 640, a multiple of 4"
#endif
#ifndef BSLAM_IMAGE_HEIGHT_MAX
#define BSLAM_IMAGE_HEIGHT_MAX 240
#endif
#if BSLAM_IMAGE_HEIGHT_MAX < 32 || BSLAM_IMAGE_HEIGHT_MAX > 480 || BSLAM_IMAGE_HEIGHT_MAX % 4 != 0
#error "BSLAM_IMAGE_HEIGHT_MAX is 32 to 480, a multiple of 4"
#endif

/// Cameras on one robot: each has its own running colours of the room.
#ifndef BSLAM_CAMERAS_MAX
#define BSLAM_CAMERAS_MAX 4
#endif
#if BSLAM_CAMERAS_MAX < 1 || BSLAM_CAMERAS_MAX > 16
#error "BSLAM_CAMERAS_MAX is 1 to 16"
#endif

/// Boxes of one image that are looked at more closely, 28 bytes each. Rendered rooms gave 97 at most.
#ifndef BSLAM_PROPOSALS_MAX
#define BSLAM_PROPOSALS_MAX 112
#endif
#if BSLAM_PROPOSALS_MAX < 8 || BSLAM_PROPOSALS_MAX > 255
#error "BSLAM_PROPOSALS_MAX is 8 to 255"
#endif

/// Beacon candidates taken from one image.
#ifndef BSLAM_CANDIDATES_MAX
#define BSLAM_CANDIDATES_MAX 16
#endif
#if BSLAM_CANDIDATES_MAX < 1 || BSLAM_CANDIDATES_MAX > 64
#error "BSLAM_CANDIDATES_MAX is 1 to 64"
#endif

/// 1: the built-in kinds of beacons can be found, and turns between pictures. 0: only a user's own
/// (bslam_vision_init_scanner), in less flash and RAM: docs/SIZES.md, Images. Leave vision/built_in out then.
#ifndef BSLAM_VISION_BUILT_IN
#define BSLAM_VISION_BUILT_IN 1
#endif
#if BSLAM_VISION_BUILT_IN != 0 && BSLAM_VISION_BUILT_IN != 1
#error "BSLAM_VISION_BUILT_IN is 0 or 1"
#endif

/// 1: the front end tells how far the robot turned between two pictures (bslam_vision_turn). 4 KB of RAM with
/// one camera, 9 KB with four.
#ifndef BSLAM_VISION_TURNS
#define BSLAM_VISION_TURNS BSLAM_VISION_BUILT_IN
#endif
#if BSLAM_VISION_TURNS != 0 && BSLAM_VISION_TURNS != 1
#error "BSLAM_VISION_TURNS is 0 or 1"
#endif
#if BSLAM_VISION_TURNS && !BSLAM_VISION_BUILT_IN
#error "BSLAM_VISION_TURNS needs BSLAM_VISION_BUILT_IN"
#endif

#endif
