/// What the room itself looks like, learned while the robot moves: tones of wall, floor and ceiling, and
/// where the floor ends.
///
/// A tone is a logarithmic colour, so that more light shifts it and does not stretch it. Each camera has a
/// decaying histogram of tones for each of three zones of its frame (upper rows, rows above the horizon,
/// lower rows): a cell whose tone is frequent there is probably no beacon. The histograms advance only while
/// the robot moves: one that stands would otherwise learn the beacon before it.
#ifndef BSLAM_VISION_BUILT_IN_PIXELS_BACKGROUND_H
#define BSLAM_VISION_BUILT_IN_PIXELS_BACKGROUND_H

#include "vision/frame.h"
#include "vision/camera/lens.h"

#define BSLAM_COLUMNS_MAX (BSLAM_IMAGE_WIDTH_MAX / BSLAM_CELL_PX)

/// Steps of a tone in an octave of brightness.
#define BSLAM_TONE_OCTAVE 32

/// A cell's colour in steps of 1/BSLAM_TONE_OCTAVE octave.
typedef struct bslam_tone {
    uint8_t light;   ///< (log red + 2 log green + log blue) / 4: 0 to 192
    int8_t reddish;  ///< log red - log green, within +-127
    int8_t bluish;   ///< log blue - log green
    uint8_t spread;  ///< the cell's spread as a part of its brightness: 128 is all of it
} bslam_tone_t;

/// The tones of a frame's cells, as the cells themselves.
typedef struct bslam_tones {
    uint8_t light[BSLAM_CELLS_ROOM];
    int8_t reddish[BSLAM_CELLS_ROOM];
    int8_t bluish[BSLAM_CELLS_ROOM];
    uint8_t spread[BSLAM_CELLS_ROOM];
} bslam_tones_t;

static inline bslam_tone_t bslam_tone_at(const bslam_tones_t *tones, int32_t i)
{
    return (bslam_tone_t){tones->light[i], tones->reddish[i], tones->bluish[i], tones->spread[i]};
}

typedef enum bslam_zone {
    BSLAM_ZONE_WALL = 0,
    BSLAM_ZONE_FLOOR = 1,
    BSLAM_ZONE_CEILING = 2,
    BSLAM_ZONE_COUNT = 3
} bslam_zone_t;

/// Histogram bins: 16 of light, 8 of each chroma.
#define BSLAM_TONE_BINS 1024

/// Rows of cells that a zone covers: [first, end).
typedef struct bslam_zone_rows {
    int32_t first;
    int32_t end;
} bslam_zone_rows_t;

/// One camera's memory of the room.
typedef struct bslam_background {
    bslam_surroundings_t surroundings;
    bslam_tone_t tone[BSLAM_ZONE_COUNT];
    uint8_t counts[BSLAM_ZONE_COUNT][BSLAM_TONE_BINS];
} bslam_background_t;

/// Where the floor ends in each column of cells, and how far away that is.
typedef struct bslam_floor_line {
    int16_t edge_px[BSLAM_COLUMNS_MAX];          ///< the uppermost pixel row of the floor
    int16_t row[BSLAM_COLUMNS_MAX];              ///< the lowest row of cells that is not floor
    bslam_real_t distance_m[BSLAM_COLUMNS_MAX];  ///< horizontal, from the camera; 0 where it cannot be told
} bslam_floor_line_t;

/// Forgets everything.
void bslam_background_init(bslam_background_t *background);

/// The tones of a frame's cells.
void bslam_background_tones(const bslam_frame_t *frame, bslam_tones_t *tones);

/// The row of cells that the horizon runs through in the middle of the frame; it may lie outside.
int32_t bslam_horizon_row(const bslam_camera_t *camera);

/// The same in pixels.
bslam_real_t bslam_horizon_px(const bslam_camera_t *camera);

/// Learns from a frame. Called for the first frame, and for those taken since the robot moved.
void bslam_background_learn(bslam_background_t *background, const bslam_frame_t *frame,
                            const bslam_camera_t *camera, const bslam_tones_t *tones);

/// Histogram bin of a tone: 16 of light, 12 steps each; 8 of each chroma, 8 steps each but for the middle
/// one, which has the greys on both sides of 0, and those at the ends, which are open. By tables, since all
/// that looks at tones asks for it.
extern const uint8_t bslam_light_bins[256];
extern const uint8_t bslam_chroma_bins[256];  ///< [(uint8_t)chroma]

static inline int32_t bslam_tone_bin(bslam_tone_t tone)
{
    return bslam_light_bins[tone.light] << 6 | bslam_chroma_bins[(uint8_t)tone.reddish] << 3 |
           bslam_chroma_bins[(uint8_t)tone.bluish];
}

/// Distance of two tones: chroma counts twice.
static inline int32_t bslam_tone_distance(bslam_tone_t a, bslam_tone_t b)
{
    const int32_t light = a.light - b.light, reddish = a.reddish - b.reddish, bluish = a.bluish - b.bluish;
    return (light < 0 ? -light : light) + 2 * (reddish < 0 ? -reddish : reddish) +
           2 * (bluish < 0 ? -bluish : bluish);
}

/// Follows each column from below for as long as it looks like floor.
void bslam_background_floor_line(const bslam_background_t *background, const bslam_frame_t *frame,
                                 const bslam_camera_t *camera, const bslam_tones_t *tones,
                                 bslam_floor_line_t *line);

#endif
