/// Four neighbouring numbers at once: one register where a processor has such, else four. Each number is
/// computed the same way everywhere, so the bits are the same.
#ifndef BSLAM_LINALG_FOUR_H
#define BSLAM_LINALG_FOUR_H

#include "base/real.h"

#pragma GCC diagnostic ignored "-Wpsabi"  // how such are passed does not matter: no call of one is left
typedef bslam_real_t bslam_four_t __attribute__((vector_size(4 * sizeof(bslam_real_t))));
/// The same in an array, at any place.
typedef bslam_four_t bslam_four_at_t __attribute__((aligned(sizeof(bslam_real_t)), may_alias));

static inline bslam_four_t bslam_four(const bslam_real_t *from)
{
    return *(const bslam_four_at_t *)from;
}

#endif
