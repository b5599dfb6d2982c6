// What the sketch uses of Arduino's core.
#ifndef ARDUINO_H
#define ARDUINO_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { INPUT_PULLUP = 2, CHANGE = 1 };

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
    int available();
    int read();
    void println(const char *text);
};

extern SerialPort Serial, Serial1;

void setup();
void loop();

#endif
