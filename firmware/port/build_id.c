#include "port/port.h"

/// The linker's note: its header, its name, and the digest of the image.
typedef struct build_id_note {
    uint32_t name_bytes;
    uint32_t digest_bytes;
    uint32_t type;
    char name[4];
    uint8_t digest[PORT_BUILD_ID_BYTES];
} build_id_note_t;

extern const build_id_note_t start_build_id;

const uint8_t *port_build_id(void)
{
    return start_build_id.digest;
}
