/// What the fuzz targets share: values out of an input's bytes, and what must hold whatever they are.
///
/// A target is one function, LLVMFuzzerTestOneInput, that ends the process where something does not hold.
/// libFuzzer calls it with inputs that it makes up (`make fuzz`), replay.c with those that are kept.
#ifndef FUZZ_FUZZ_H
#define FUZZ_FUZZ_H

#include <stddef.h>

#include "bslam/internal.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/// Ends the process, and says where, unless the condition holds.
#define fuzz_require(condition) \
    do { \
        if (!(condition)) { \
            fuzz_fail(#condition, __FILE__, __LINE__); \
        } \
    } while (0)

_Noreturn void fuzz_fail(const char *what, const char *file, int line);

/// The input, from its beginning. What stands behind its end is 0.
typedef struct fuzz_input {
    const uint8_t *bytes;
    size_t left;
} fuzz_input_t;

uint8_t fuzz_u8(fuzz_input_t *input);
uint16_t fuzz_u16(fuzz_input_t *input);
uint32_t fuzz_u32(fuzz_input_t *input);

/// Mostly a number in [low, high], in steps of a 65535th; else one that no sensor should give: not finite,
/// denormal, huge, zero, or any bits at all.
bslam_real_t fuzz_real(fuzz_input_t *input, double low, double high);

/// A signature, of two bytes.
void fuzz_signature(fuzz_input_t *input, float signature[BSLAM_SAMPLE_FEATURES]);

/// A sighting; its signature, if it has one, goes to the given place.
bslam_sighting_t fuzz_sighting(fuzz_input_t *input, float signature[BSLAM_SAMPLE_FEATURES]);

/// An odometry reading, `later_us` after some moment or, if the input says so, at any time.
bslam_odometry_reading_t fuzz_reading(fuzz_input_t *input, int64_t now_us);

/// A moment near now_us or, if the input says so, any.
int64_t fuzz_time(fuzz_input_t *input, int64_t now_us);

/// Holds of every pipeline after every call: all of state and covariance is finite, angles are within
/// (-pi, pi], the factor is that of a covariance; counts and places of beacons fit each other; pose, map and
/// accounts can be read.
void fuzz_require_sound(const bslam_slam_t *slam);

/// Holds too, and takes longer: no eigenvalue of the correlations is negative, in double. The map can be
/// kept: what is saved loads, says the same of the beacons, and is saved as the same bytes from then on.
/// False: it has a number beyond those of a map, and was refused.
bool fuzz_require_kept(const bslam_slam_t *slam);

/// A pipeline that has a map of three beacons, one of them in direction only, and, where looks are given,
/// machines that know them. Always the same.
void fuzz_make_map(bslam_slam_t *slam, bslam_appearance_t *appearance);

#endif
