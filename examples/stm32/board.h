// The board: an STM32F411 as it comes out of reset, at 16 MHz, its registers by their addresses (ST's
// RM0383).
#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define TIMER_LEFT 0x40000000u   // TIM2, PA0 and PA1
#define TIMER_RIGHT 0x40000400u  // TIM3, PA6 and PA7
#define TIMER_CLOCK 0x40000c00u  // TIM5
#define USART2 0x40004400u       // PA2 and PA3

// ---- to fill in: what the encoders have counted, up where the wheel goes ahead; counters may roll over
// ----------

static uint32_t left_ticks(void)
{
    return REGISTER(TIMER_LEFT + 0x24);
}

static uint32_t right_ticks(void)
{
    return REGISTER(TIMER_RIGHT + 0x24);
}

// ---- the rest, which a project of CubeMX has of its own
// ---------------------------------------------------------

static void start_encoder(uint32_t timer)
{
    REGISTER(timer + 0x18) = 0x0101;  // both channels are inputs
    REGISTER(timer + 0x08) = 3;       // all edges count
    REGISTER(timer + 0x2c) = 0xffff;  // 16 bits, as `counter_bits` in main.c
    REGISTER(timer) = 1;
}

static void board_init(void)
{
    REGISTER(0x40023830) |= 1;             // clocks of GPIOA,
    REGISTER(0x40023840) |= 1 << 17 | 11;  // USART2, TIM2, TIM3, TIM5
    REGISTER(0x40020000) |= 0xa0aa;        // whose the six pins are
    REGISTER(0x40020020) = 0x22007711;
    REGISTER(0x4002000c) |= 0x5005;  // pull-ups, for encoders with open collectors
    start_encoder(TIMER_LEFT);
    start_encoder(TIMER_RIGHT);
    REGISTER(TIMER_CLOCK + 0x28) = 16 - 1;  // microseconds, from the update below on
    REGISTER(TIMER_CLOCK + 0x14) = 1;
    REGISTER(TIMER_CLOCK) = 1;
    REGISTER(USART2 + 0x08) = 16000000 / 115200;
    REGISTER(USART2 + 0x0c) = 0x202c;       // both directions, an interrupt for each byte
    REGISTER(0xe000e104) = 1 << (38 - 32);  // which is number 38
}

/// Longer than the timer, which begins again after 71 minutes.
static int64_t board_time_us(void)
{
    static int64_t now_us;
    return now_us += (uint32_t)(REGISTER(TIMER_CLOCK + 0x24) - (uint32_t)now_us);
}

// The detector's bytes, by the interrupt: none is lost while the filter works.
static volatile char received[256];
static volatile uint8_t received_count;

void usart2_interrupt(void)  // in startup.s
{
    const uint32_t status = REGISTER(USART2);  // reading it first ends an overrun
    received[received_count] = (char)REGISTER(USART2 + 0x04);
    received_count += status >> 5 & 1;  // there was a byte
}

static void board_write(const char *text)
{
    for (; *text != '\0'; text++) {
        while ((REGISTER(USART2) & 1 << 7) == 0) {
        }
        REGISTER(USART2 + 0x04) = (uint8_t)*text;
    }
}
