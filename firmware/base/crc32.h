/// CRC-32 as in Ethernet, zip and PNG: polynomial 0x04c11db7 reflected, start and end inverted.
#ifndef BSLAM_BASE_CRC32_H
#define BSLAM_BASE_CRC32_H

#include <stddef.h>
#include <stdint.h>

#define BSLAM_CRC32_START 0xffffffffu

/// Goes on with a CRC that began with BSLAM_CRC32_START. Inverted (~) in the end it is the CRC: of
/// "123456789" 0xcbf43926. About 12 instructions a byte, and 64 bytes of table.
uint32_t bslam_crc32_add(uint32_t crc, const void *bytes, size_t count);

#endif
