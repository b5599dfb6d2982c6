// An application that was compiled with other sizes than the library: the first call refuses it, and not a
// byte of the instance is written, nor beside it; no setting is to blame.
#include <stdio.h>
#include <string.h>

#include "bslam/bslam.h"

static struct memory {
    bslam_t robot;
    unsigned char neighbour[8192];
} memory;

int main(void)
{
    bslam_settings_t settings;
    int bad_setting = -7;
    memset(&memory, 0x5a, sizeof memory);
    bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
    const bslam_status_t status = bslam_init(&memory.robot, &settings, &bad_setting);
    unsigned lost = 0;
    for (size_t i = 0; i < sizeof memory; i++) {
        lost += ((const unsigned char *)&memory)[i] != 0x5a;
    }
    printf("%s, %u bytes written, setting %d\n", bslam_status_name(status), lost, bad_setting);
    return status == BSLAM_E_SIZE && lost == 0 && bad_setting == -1 ? 0 : 1;
}
