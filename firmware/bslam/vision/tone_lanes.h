/// Tones of sixteen cells at a time. Inside of background.c and cells.c.
#ifndef BSLAM_VISION_TONE_LANES_H
#define BSLAM_VISION_TONE_LANES_H

#include "bslam/math/lanes.h"
#include "bslam/vision/background.h"

#if BSLAM_HAS_LANES

/// The values of sixteen tones; chromas are 128 more.
typedef struct bslam_tone_lanes {
    bslam_lanes_t light, reddish, bluish;
} bslam_tone_lanes_t;

/// The tones of the cells from the i-th on.
static inline bslam_tone_lanes_t bslam_tone_lanes_at(const bslam_tones_t *tones, int32_t i)
{
    const bslam_lanes_t tops = bslam_lanes_of(BSLAM_TOP_BITS);
    return (bslam_tone_lanes_t){bslam_lanes_at(tones->light + i), bslam_lanes_at(tones->reddish + i) ^ tops,
                                bslam_lanes_at(tones->bluish + i) ^ tops};
}

/// The same tone sixteen times.
static inline bslam_tone_lanes_t bslam_tone_lanes_of(bslam_tone_t tone)
{
    const uint32_t all = 0x01010101U;
    return (bslam_tone_lanes_t){bslam_lanes_of(tone.light * all),
                                bslam_lanes_of((uint8_t)tone.reddish * all ^ BSLAM_TOP_BITS),
                                bslam_lanes_of((uint8_t)tone.bluish * all ^ BSLAM_TOP_BITS)};
}

/// The same of eight tones in halves, without a table: a twelfth; an eighth of each chroma, rounded towards
/// 0.
static inline bslam_lanes_t bslam_bins_of_eight(bslam_lanes_t light, bslam_lanes_t reddish,
                                                bslam_lanes_t bluish)
{
    const bslam_lanes_t middle = bslam_lanes_of(4U | 4U << 16);
    const bslam_lanes_t lights =
        bslam_halves_within(bslam_halves_down(bslam_halves_times(light, 171), 11), 0, 15);
    const bslam_lanes_t reds =
        bslam_halves_add(bslam_halves_within(bslam_halves_shifted_to_zero(reddish, 3), -4, 3), middle);
    const bslam_lanes_t blues =
        bslam_halves_add(bslam_halves_within(bslam_halves_shifted_to_zero(bluish, 3), -4, 3), middle);
    return bslam_halves_up(lights, 6) | bslam_halves_up(reds, 3) | blues;
}

/// Of all sixteen.
static inline void bslam_tone_bins(const bslam_tone_lanes_t *tones, uint16_t bins[BSLAM_CELL_STEP])
{
    const bslam_lanes_t zero = bslam_lanes_zero(), tops = bslam_lanes_of(BSLAM_TOP_BITS);
    const bslam_lanes_t light = tones->light, reddish = tones->reddish ^ tops, bluish = tones->bluish ^ tops;
    bslam_lanes_put(bins,
                    bslam_bins_of_eight(bslam_bytes_lower_in_turn(light, zero),
                                        bslam_bytes_signed_lower(reddish), bslam_bytes_signed_lower(bluish)));
    bslam_lanes_put(bins + 8,
                    bslam_bins_of_eight(bslam_bytes_upper_in_turn(light, zero),
                                        bslam_bytes_signed_upper(reddish), bslam_bytes_signed_upper(bluish)));
}

#endif

#endif
