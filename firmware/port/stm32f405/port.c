/// STM32F405: the core at 168 MHz from an 8 MHz crystal, USART1 on PA9 and PA10 at 115200 baud, wheel
/// encoders on TIM3 (PA6, PA7) and TIM4 (PB6, PB7), the independent watchdog. Registers as ST's RM0090 has
/// them.
///
/// QEMU's netduinoplus2 runs the same image. It has neither clock tree nor encoders; that its clock control
/// reads as zero, which a real one never does, tells it. Its robot is then a film in flash.
#include "port/cortex_m/semihosting.h"
#include "port/cortex_m/systick.h"
#include "port/film.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))

#define RCC_CR REGISTER(0x40023800u)
#define RCC_PLLCFGR REGISTER(0x40023804u)
#define RCC_CFGR REGISTER(0x40023808u)
#define RCC_AHB1ENR REGISTER(0x40023830u)
#define RCC_APB1ENR REGISTER(0x40023840u)
#define RCC_APB2ENR REGISTER(0x40023844u)
#define FLASH_ACR REGISTER(0x40023c00u)
#define GPIOA_MODER REGISTER(0x40020000u)
#define GPIOA_AFRL REGISTER(0x40020020u)
#define GPIOA_AFRH REGISTER(0x40020024u)
#define GPIOB_MODER REGISTER(0x40020400u)
#define GPIOB_AFRL REGISTER(0x40020420u)
#define USART1_SR REGISTER(0x40011000u)
#define USART1_DR REGISTER(0x40011004u)
#define USART1_BRR REGISTER(0x40011008u)
#define USART1_CR1 REGISTER(0x4001100cu)
#define TIM3 0x40000400u
#define TIM4 0x40000800u
#define IWDG_KR REGISTER(0x40003000u)
#define IWDG_PR REGISTER(0x40003004u)
#define NVIC_ISER1 REGISTER(0xe000e104u)
#define SCB_AIRCR REGISTER(0xe000ed0cu)

#define APB2_HZ 84000000u
#define BAUD 115200u
#define STEP_US 40000

/// What came while the main loop was at work: two of the longest frames of default size. A power of two.
#define RECEIVED_MAX 1024u
static volatile uint8_t received[RECEIVED_MAX];
static volatile uint32_t received_count;
static uint32_t read_count;

static bool is_emulated;
static int64_t next_step_us;

void port_interrupt(void);

static void start_clock(void)
{
    RCC_CR |= 1u << 16;  // the crystal
    while ((RCC_CR & 1u << 17) == 0) {
    }
    FLASH_ACR = 0x705u;                                  // 5 wait states, caches, prefetch
    RCC_PLLCFGR = 8u | 336u << 6 | 1u << 22 | 7u << 24;  // 8 MHz / 8 * 336 / 2
    RCC_CR |= 1u << 24;
    while ((RCC_CR & 1u << 25) == 0) {
    }
    RCC_CFGR = 5u << 10 | 4u << 13 | 2u;  // APB1 at a quarter, APB2 at half, the core from the PLL
    while ((RCC_CFGR & 0xcu) != 8u) {
    }
}

/// A timer that counts both edges of both channels of an encoder, 16 bits.
static void start_encoder(uint32_t timer)
{
    REGISTER(timer + 0x08u) = 3u;
    REGISTER(timer + 0x18u) = 0x0101u;
    REGISTER(timer + 0x2cu) = 0xffffu;
    REGISTER(timer) = 1u;
}

static void start_pins(void)
{
    RCC_AHB1ENR |= 3u;                                         // ports A, B
    GPIOA_MODER |= 2u << 12 | 2u << 14 | 2u << 18 | 2u << 20;  // PA6, PA7, PA9, PA10: alternate functions
    GPIOA_AFRL |= 2u << 24 | 2u << 28;                         // PA6, PA7: TIM3
    GPIOA_AFRH |= 7u << 4 | 7u << 8;                           // PA9, PA10: USART1
    GPIOB_MODER |= 2u << 12 | 2u << 14;                        // PB6, PB7
    GPIOB_AFRL |= 2u << 24 | 2u << 28;                         // TIM4
}

static void start_serial(void)
{
    USART1_BRR = APB2_HZ / BAUD;
    USART1_CR1 = 1u << 13 | 1u << 5 | 1u << 3 | 1u << 2;  // on, interrupt on receipt, send, receive
    NVIC_ISER1 = 1u << (37 - 32);
}

void port_init(void)
{
    is_emulated = RCC_CR == 0;
    RCC_APB1ENR |= 3u << 1;  // TIM3, TIM4
    RCC_APB2ENR |= 1u << 4;  // USART1
    if (!is_emulated) {
        start_clock();
        start_pins();
        start_encoder(TIM3);
        start_encoder(TIM4);
        IWDG_KR = 0x5555u;
        IWDG_PR = 4u;  // 32 kHz / 64, 4096 of these: 8 s
        IWDG_KR = 0xccccu;
    } else {
        film_start((const film_t *)FILM_ADDRESS);
    }
    start_serial();
    systick_start();
}

/// Of all interrupts only the USART's is enabled.
void port_interrupt(void)
{
    if ((USART1_SR & 1u << 5) != 0) {
        const uint32_t count = received_count;
        received[count % RECEIVED_MAX] = (uint8_t)USART1_DR;
        received_count = count + 1;
    }
}

int port_read(void)
{
    const uint32_t waiting = received_count - read_count;
    if (waiting == 0) {
        return -1;
    }
    if (waiting > RECEIVED_MAX) {
        read_count = received_count - RECEIVED_MAX;  // the oldest are overwritten: the frame's CRC will tell
    }
    const uint8_t byte = received[read_count % RECEIVED_MAX];
    read_count++;
    return byte;
}

void port_write(const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        while ((USART1_SR & 1u << 7) == 0) {
        }
        USART1_DR = bytes[i];
    }
}

void port_watchdog(void)
{
    if (!is_emulated) {
        IWDG_KR = 0xaaaau;
    }
}

bool port_encoders(int64_t *time_us, uint32_t *left_ticks, uint32_t *right_ticks)
{
    *time_us = port_time_us();
    if (is_emulated) {
        return film_encoders(*time_us, time_us, left_ticks, right_ticks);
    }
    if (*time_us < next_step_us) {
        return false;
    }
    next_step_us += STEP_US;
    *left_ticks = REGISTER(TIM3 + 0x24u) & 0xffffu;
    *right_ticks = REGISTER(TIM4 + 0x24u) & 0xffffu;
    return true;
}

void port_exit(int status)
{
    if (is_emulated) {
        semihosting_exit(status);
    }
    SCB_AIRCR = 0x05fa0004u;  // reset
    for (;;) {
    }
}
