// The board of examples/stm32 on this computer: its clock goes on by a millisecond each time it is asked.
#include <stdlib.h>

#include "../drive.h"

static int64_t now_us;
static char received[256];
static uint8_t received_count;

static inline void board_init(void)
{
}

static inline uint32_t left_ticks(void)
{
    return (uint32_t)drive_ticks(now_us, -1) & 0xffff;
}

static inline uint32_t right_ticks(void)
{
    return (uint32_t)drive_ticks(now_us, 1) & 0xffff;
}

static inline void hear(const char *text)
{
    for (; *text != '\0'; text++) {
        received[received_count++] = *text;
    }
}

static inline int64_t board_time_us(void)
{
    char text[256] = "";
    if (now_us >= DRIVE_US) {
        exit(0);
    }
    now_us += 1000;
    if (now_us % PICTURE_US == 0) {
        drive_lines(now_us, text, sizeof text);
        hear(text);
    }
    if (now_us == 7777000) {
        hear("40 1 2");  // a line that was cut short, and one that is noise
        hear("\n?\x7f\n");
    }
    return now_us;
}

static inline void board_write(const char *text)
{
    static int lines;
    if (++lines > 2000) {  // more than in the drive: it does not begin
        exit(2);
    }
    fputs(text, stdout);
}
