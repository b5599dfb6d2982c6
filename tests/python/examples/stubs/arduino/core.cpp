// Arduino's core on this computer: the drive's wheels call the sketch's interrupts, edge for edge, and its
// clock begins again amid the drive, as micros() does.
#include "Arduino.h"

#include <stdlib.h>

#include "../drive.h"

static const uint32_t FIRST_MICROS = 4284967296u;  // 10 s before it begins again
static int64_t time_us = 0;
static void (*handlers[64])() = {};
static int levels[64] = {}, pins[4] = {}, pin_count = 0;  // A and B of the left wheel, then of the right one
static long done[2] = {};
static bool masked = false;
static char heard[512];
static size_t heard_length = 0, heard_read = 0;

SerialPort Serial, Serial1;

void pinMode(int pin, int)
{
    pins[pin_count++] = pin;
}

int digitalRead(int pin)
{
    return levels[pin];
}

int digitalPinToInterrupt(int pin)
{
    return pin;
}

void attachInterrupt(int interrupt, void (*handler)(), int)
{
    handlers[interrupt] = handler;
}

void interrupts()
{
    masked = false;
}

void noInterrupts()
{
    masked = true;
}

/// Channel B leads by a quarter of a period where the wheel goes ahead: at an edge of A they differ.
static void turn(int wheel)
{
    const int a = pins[2 * wheel], b = pins[2 * wheel + 1];
    for (; done[wheel] < drive_ticks(time_us, wheel == 0 ? -1 : 1); done[wheel]++) {
        levels[a] = !levels[a];
        levels[b] = !levels[a];
        handlers[a]();
    }
}

unsigned long micros()
{
    if (time_us >= DRIVE_US) {
        exit(masked ? 1 : 0);
    }
    time_us += 500;
    turn(0);
    turn(1);
    if (time_us % PICTURE_US == 0) {
        heard_read = 0;
        heard_length = (size_t)drive_lines(time_us, heard, sizeof heard);
    }
    return (uint32_t)(FIRST_MICROS + (uint64_t)time_us);
}

void delay(unsigned long)
{
    exit(2);
}

void SerialPort::begin(unsigned long)
{
}

#ifdef ESP32
void SerialPort::begin(unsigned long, uint32_t, int8_t, int8_t)
{
}
#endif

int SerialPort::available()
{
    return (int)(heard_length - heard_read);
}

int SerialPort::read()
{
    return heard[heard_read++];
}

void SerialPort::println(const char *text)
{
    puts(text);
}

int main()
{
    setup();
    for (;;) {
        loop();
    }
}
