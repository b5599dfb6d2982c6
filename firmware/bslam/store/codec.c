#include "bslam/store/codec.h"

#include <string.h>

#include "base/crc32.h"
#include "base/scalar.h"

void bslam_codec_require(bslam_codec_t *codec, bool holds, bslam_map_fault_t fault)
{
    codec->fault = holds || codec->fault != BSLAM_MAP_FINE ? codec->fault : fault;
}

void bslam_codec_bytes(bslam_codec_t *codec, void *bytes, uint32_t count)
{
    if (codec->fault == BSLAM_MAP_FINE) {
        bool moved = true;
        if (codec->source != NULL) {
            const bool is_there = count <= codec->source->size - codec->at;
            bslam_codec_require(codec, is_there, BSLAM_MAP_TRUNCATED);
            moved = is_there && codec->source->read(codec->source->context, codec->at, bytes, count);
        } else if (codec->sink != NULL) {
            moved = codec->sink->write(codec->sink->context, bytes, count);
        }
        bslam_codec_require(codec, moved, BSLAM_MAP_UNREADABLE);
    }
    if (codec->fault != BSLAM_MAP_FINE) {
        memset(bytes, 0, count);
        return;
    }
    codec->crc = bslam_crc32_add(codec->crc, bytes, count);
    codec->at += count;
}

uint32_t bslam_codec_whole(bslam_codec_t *codec, uint32_t value, uint32_t size)
{
    uint8_t bytes[4] = {(uint8_t)value, (uint8_t)(value >> 8), (uint8_t)(value >> 16),
                        (uint8_t)(value >> 24)};
    bslam_codec_bytes(codec, bytes, size);
    uint32_t moved = 0;
    for (uint32_t i = 0; i < size; i++) {
        moved |= (uint32_t)bytes[i] << 8 * i;
    }
    return moved;
}

float bslam_codec_float_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

float bslam_codec_float(bslam_codec_t *codec, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    const float moved = bslam_codec_float_of(bslam_codec_whole(codec, bits, 4));
    bslam_codec_require(codec, bslam_is_number((bslam_real_t)moved), BSLAM_MAP_NOT_FINITE);
    return moved;
}

bslam_real_t bslam_codec_real(bslam_codec_t *codec, bslam_real_t value)
{
    return (bslam_real_t)bslam_codec_float(codec, (float)value);
}
