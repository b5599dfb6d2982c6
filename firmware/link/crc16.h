/// CRC-16/GENIBUS: polynomial 0x1021, start 0xffff, inverted at the end. It finds every burst of up to 16
/// bits and every odd number of wrong bits; and, since it is inverted, a zero byte too many at the end. It is
/// no protection against a sender who means harm.
#ifndef BSLAM_LINK_CRC16_H
#define BSLAM_LINK_CRC16_H

#include <stdint.h>

#define BSLAM_CRC16_START 0xffffu
/// Where the CRC stands behind data and then their CRC, high byte first.
#define BSLAM_CRC16_GOOD 0x1d0fu

/// The CRC's state after the bytes so far and one more. O(1).
uint16_t bslam_crc16_add(uint16_t crc, uint8_t byte);

/// What is sent behind the bytes.
static inline uint16_t bslam_crc16_end(uint16_t crc)
{
    return (uint16_t)(crc ^ 0xffffu);
}

#endif
