// What the sketch uses of Arduino's core.
#ifndef ARDUINO_H
#define ARDUINO_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { INPUT_PULLUP = 2, CHANGE = 1 };
#ifdef ESP32
#define IRAM_ATTR
enum { SERIAL_8N1 = 0x800001c };
#endif

void pinMode(int pin, int mode);
int digitalRead(int pin);
int digitalPinToInterrupt(int pin);
void attachInterrupt(int interrupt, void (*handler)(), int mode);
void interrupts();
void noInterrupts();
unsigned long micros();
void delay(unsigned long ms);

struct SerialPort {
    void begin(unsigned long baud);
#ifdef ESP32
    void begin(unsigned long baud, uint32_t config, int8_t rx_pin, int8_t tx_pin = -1);
#endif
    int available();
    int read();
    void println(const char *text);
};

extern SerialPort Serial, Serial1;

void setup();
void loop();

#endif
