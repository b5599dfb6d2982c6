#include "link/crc16.h"

/// What four bits that leave at the top put back in: 32 bytes of table, two look-ups a byte.
static const uint16_t of_nibble[16] = {0x0000, 0x1021, 0x2042, 0x3063, 0x4084, 0x50a5, 0x60c6, 0x70e7,
                                       0x8108, 0x9129, 0xa14a, 0xb16b, 0xc18c, 0xd1ad, 0xe1ce, 0xf1ef};

uint16_t bslam_crc16_add(uint16_t crc, uint8_t byte)
{
    uint32_t c = crc;
    c = (c << 4 ^ of_nibble[(c >> 12 ^ byte >> 4) & 0xfu]) & 0xffffu;
    c = (c << 4 ^ of_nibble[(c >> 12 ^ byte) & 0xfu]) & 0xffffu;
    return (uint16_t)c;
}
