/// Memory as a stored map's sink and source.
#ifndef UNIT_MAP_MEMORY_H
#define UNIT_MAP_MEMORY_H

#include <string.h>

#include "bslam/bslam.h"

/// Bytes to be written to, of which `count` are.
typedef struct map_memory {
    uint8_t *bytes;
    uint32_t capacity;
    uint32_t count;
} map_memory_t;

static inline bool map_memory_write(void *context, const void *bytes, uint32_t count)
{
    map_memory_t *memory = context;
    if (count > memory->capacity - memory->count) {
        return false;
    }
    memcpy(&memory->bytes[memory->count], bytes, count);
    memory->count += count;
    return true;
}

static inline bool map_memory_read(const void *context, uint32_t at, void *bytes, uint32_t count)
{
    const uint8_t *from = context;
    memcpy(bytes, &from[at], count);
    return true;
}

static inline bslam_map_sink_t map_to_memory(map_memory_t *memory)
{
    return (bslam_map_sink_t){map_memory_write, memory};
}

static inline bslam_map_source_t map_from_memory(const uint8_t *bytes, uint32_t size)
{
    return (bslam_map_source_t){map_memory_read, bytes, size};
}

#endif
