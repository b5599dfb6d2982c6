#include "bslam/store/passage.h"

#include <string.h>

#include "bslam/store/crc32.h"

static void blame(bslam_passage_t *passage, bslam_map_fault_t fault)
{
    if (passage->fault == BSLAM_MAP_FINE) {
        passage->fault = fault;
    }
}

void bslam_passage_require(bslam_passage_t *passage, bool holds, bslam_map_fault_t fault)
{
    if (!holds) {
        blame(passage, fault);
    }
}

static bool is_reading(const bslam_passage_t *passage)
{
    return passage->source != NULL;
}

void bslam_passage_bytes(bslam_passage_t *passage, void *bytes, uint32_t count)
{
    if (passage->fault == BSLAM_MAP_FINE) {
        bool moved = true;
        if (is_reading(passage)) {
            if (count > passage->source->size - passage->at) {
                blame(passage, BSLAM_MAP_TRUNCATED);
            } else {
                moved = passage->source->read(passage->source->context, passage->at, bytes, count);
            }
        } else if (passage->sink != NULL) {
            moved = passage->sink->write(passage->sink->context, bytes, count);
        }
        bslam_passage_require(passage, moved, BSLAM_MAP_UNREADABLE);
    }
    if (passage->fault != BSLAM_MAP_FINE) {
        memset(bytes, 0, count);
        return;
    }
    passage->crc = bslam_crc32_add(passage->crc, bytes, count);
    passage->at += count;
}

uint32_t bslam_passage_whole(bslam_passage_t *passage, uint32_t value, uint32_t size)
{
    uint8_t bytes[4] = {(uint8_t)value, (uint8_t)(value >> 8), (uint8_t)(value >> 16),
                        (uint8_t)(value >> 24)};
    bslam_passage_bytes(passage, bytes, size);
    uint32_t moved = 0;
    for (uint32_t i = 0; i < size; i++) {
        moved |= (uint32_t)bytes[i] << 8 * i;
    }
    return moved;
}

float bslam_passage_float_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

float bslam_passage_float(bslam_passage_t *passage, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    const float moved = bslam_passage_float_of(bslam_passage_whole(passage, bits, 4));
    bslam_passage_require(passage, bslam_is_number((bslam_real_t)moved), BSLAM_MAP_NOT_FINITE);
    return moved;
}

bslam_real_t bslam_passage_real(bslam_passage_t *passage, bslam_real_t value)
{
    return (bslam_real_t)bslam_passage_float(passage, (float)value);
}
