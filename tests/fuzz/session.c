// The whole application behind its serial line: any bytes, or messages that the input makes up in good
// frames. Whatever comes, the pipeline stays sound, every answer is a good frame, and no message is answered
// twice.
#include "robot/own_sensors.h"

#include <string.h>

#include "map_memory.h"
#include "picture.h"
#include "port/port.h"

enum { MESSAGES_MAX = 40, STORE_BYTES = 1024, MAP_BYTES = 4096, PIECE_BYTES = 400 };

/// One above the last message there is.
enum { TYPES = SESSION_MAP_LOAD + 1 };

static robot_t robot;
static session_t session;
static bslam_link_parser_t answers;
static uint8_t store[STORE_BYTES];
static size_t stored;
static uint32_t clock_us;
static bslam_camera_t own_camera;
static int own_cameras;
static uint32_t left_ticks, right_ticks;
static bool has_gyro;
static float gyro_radps;

// ---- a board of nothing but memory -----------------------------------------------------------------------

/// What comes, messages and pictures, the target gives itself.
int port_read(void)
{
    return -1;
}

bool port_camera_row(port_row_t *row)
{
    (void)row;
    return false;
}

void port_write(const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        (void)bslam_link_push(&answers, bytes[i]);
    }
}

int64_t port_time_us(void)
{
    return clock_us;
}

uint32_t port_ticks(void)
{
    return clock_us;
}

uint32_t port_ticks_hz(void)
{
    return 1000000;
}

const uint8_t *port_build_id(void)
{
    static const uint8_t none[PORT_BUILD_ID_BYTES];
    return none;
}

bool port_save(const uint8_t *bytes, size_t count)
{
    fuzz_require(count <= STORE_BYTES);
    memcpy(store, bytes, count);
    stored = count;
    return true;
}

bool port_load(uint8_t *bytes, size_t count)
{
    if (stored != count) {
        return false;
    }
    memcpy(bytes, store, count);
    return true;
}

bool port_encoders(int64_t *time_us, uint32_t *left, uint32_t *right)
{
    *time_us = clock_us;
    *left = left_ticks;
    *right = right_ticks;
    return true;
}

bool port_gyro(float *rate_radps)
{
    *rate_radps = gyro_radps;
    return has_gyro;
}

const struct bslam_flash *port_map_flash(void)
{
    return NULL;
}

const struct bslam_camera *port_cameras(int *count)
{
    *count = own_cameras;
    return &own_camera;
}

// ---- the host ---------------------------------------------------------------------------------------------

static void require_good_answers(uint32_t most)
{
    const bslam_link_counters_t *counters = &answers.counters;
    fuzz_require(counters->bad_crc + counters->truncated + counters->too_long + counters->bad_version == 0);
    fuzz_require(counters->frames <= most);
}

/// Whether a reading waits for its picture: what ends the wait has it reported before it is answered itself.
static uint32_t reports_due(void)
{
    return robot.gyro_wait.is_waiting ? 1 : 0;
}

static void take(uint8_t byte)
{
    const uint32_t due = reports_due();
    const uint32_t asked = session.parser.counters.frames;
    const uint32_t answered = answers.counters.frames;
    session_take(&session, byte);
    require_good_answers(answered + due + (session.parser.counters.frames - asked));
}

/// Payload bytes of a message that is as long as it should be, where that is a fixed number.
static unsigned size_of(unsigned type)
{
    static const uint8_t sizes[TYPES] = {
        [SESSION_HELLO] = 5,         [SESSION_RESUME] = 8,    [SESSION_KNOWN_BEACON] = 12,
        [SESSION_REMOVE_BEACON] = 4, [SESSION_PARAM_GET] = 2, [SESSION_MAP] = 1,
        [SESSION_SET_POSE] = 20,     [SESSION_MAP_READ] = 4,  [SESSION_IMAGE] = 2,
        [SESSION_LOOK] = 1,          [SESSION_SEEN] = 1};
    return type < sizeof sizes ? sizes[type] : 0;
}

static void put_reals(bslam_link_writer_t *writer, fuzz_input_t *input, int count, double high)
{
    for (; count > 0; count--) {
        bslam_link_put_real(writer, fuzz_real(input, -high, high));
    }
}

/// Whether a signature came before, or a distance, is for the last byte to say.
static void put_sighting(bslam_link_writer_t *writer, fuzz_input_t *input)
{
    const unsigned flags = fuzz_u8(input);
    put_reals(writer, input, 1, 3.2);
    bslam_link_put_real(writer, fuzz_real(input, 0.1, 10));
    for (int i = 0; i < 3; i++) {
        bslam_link_put_real(writer, (flags & 4u) != 0 ? fuzz_real(input, 0, 0.2) : 0);
    }
    bslam_link_put_i32(writer, (int32_t)(flags >> 3 & 7u) - 1);
    bslam_link_put_u8(writer, (flags & 64u) != 0 ? fuzz_u8(input) : 0);
    bslam_link_put_u8(writer, (uint8_t)flags);
}

/// A piece of the robot's own map, as a host gives back what it has read, perhaps with a byte changed.
static void put_map_piece(bslam_link_writer_t *writer, fuzz_input_t *input, unsigned piece)
{
    static uint8_t bytes[MAP_BYTES];
    map_memory_t memory = {bytes, MAP_BYTES, 0};
    const bslam_map_sink_t sink = map_to_memory(&memory);
    uint32_t size;
    fuzz_require(bslam_save_map(&robot.slam, &sink, &size) == BSLAM_OK);
    const unsigned change = fuzz_u8(input);
    if (change < 64) {
        bytes[fuzz_u16(input) % memory.count] ^= (uint8_t)(change + 1);
    }
    const uint32_t at = piece * PIECE_BYTES;
    bslam_link_put_u32(writer, at);
    for (uint32_t i = at; i < memory.count && i < at + PIECE_BYTES; i++) {
        bslam_link_put_u8(writer, bytes[i]);
    }
}

static uint32_t map_size(void)
{
    uint32_t size;
    fuzz_require(bslam_save_map(&robot.slam, NULL, &size) == BSLAM_OK);
    return size;
}

/// Messages whose length hangs on what they say, and those that need a number to make sense.
static void put_payload(bslam_link_writer_t *writer, fuzz_input_t *input, unsigned type)
{
    const unsigned count = fuzz_u8(input) % (BSLAM_SIGHTINGS_MAX + 2);
    switch (type) {
    case SESSION_SIGHTINGS:
        bslam_link_put_u8(writer, (uint8_t)count);
        for (unsigned i = 0; i < count; i++) {
            put_sighting(writer, input);
        }
        break;
    case SESSION_MAP_WRITE:
        put_map_piece(writer, input, count);
        break;
    case SESSION_MAP_LOAD:
        bslam_link_put_u32(writer, map_size() + (count == 0 ? fuzz_u8(input) : 0));
        bslam_link_put_u8(writer, (uint8_t)(count % 2));
        break;
    case SESSION_SIGNATURES:
    case SESSION_SEEDS:
        bslam_link_put_u8(writer, fuzz_u8(input) % 4);
        bslam_link_put_u8(writer, count == 0 ? fuzz_u8(input) : 1);
        for (unsigned k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
            bslam_link_put_real(writer, k < 4 ? fuzz_real(input, -1, 1) : BSLAM_R(0.1));
        }
        break;
    case SESSION_ODOMETRY:
        bslam_link_put_u8(writer, (uint8_t)(count % 4));
        bslam_link_put_u8(writer, fuzz_u8(input) & 1u);
        put_reals(writer, input, 3, 0.2);
        break;
    case SESSION_PARAM_SET:
        bslam_link_put_u16(writer, fuzz_u8(input));
        put_reals(writer, input, 1, 5);
        break;
    case SESSION_PIXELS:
        for (unsigned i = 32 * count; i > 0; i--) {
            bslam_link_put_u8(writer, i % 32 == 0 ? fuzz_u8(input) : (uint8_t)i);
        }
        break;
    case SESSION_CAMERA:
        bslam_link_put_u8(writer, (uint8_t)(count % 3));
        bslam_link_put_u8(writer, fuzz_u8(input) % 3);
        bslam_link_put_u16(writer, (uint16_t)(4 * (fuzz_u8(input) % 18)));
        bslam_link_put_u16(writer, (uint16_t)(4 * (fuzz_u8(input) % 10)));
        put_reals(writer, input, 4, 60);
        put_reals(writer, input, 5, 1);
        break;
    default:
        for (unsigned i = size_of(type); i > 0; i--) {
            bslam_link_put_u8(writer, fuzz_u8(input));
        }
        break;
    }
}

/// A message as a host would send it, but for what the input has otherwise: its number, its length.
static void send_message(fuzz_input_t *input, uint16_t *sequence, int64_t *now_us)
{
    uint8_t frame[BSLAM_LINK_FRAME_MAX];
    const unsigned type = fuzz_u8(input);
    const unsigned odd = fuzz_u8(input);
    *sequence = (uint16_t)(*sequence + (odd < 16 ? odd - 8 : 1));
    *now_us += odd < 32 ? 10000 * (int64_t)odd - 150000 : 40000;
    const bslam_link_header_t header = {.type = type < 224 ? (uint8_t)(type % TYPES) : (uint8_t)type,
                                        .sequence = *sequence,
                                        .time_us = *now_us};
    bslam_link_writer_t writer;
    bslam_link_begin(&writer, frame, sizeof frame, &header);
    put_payload(&writer, input, header.type);
    if (odd >= 240) {
        bslam_link_put_u8(&writer, fuzz_u8(input));
    }
    const size_t length = bslam_link_end(&writer);
    for (size_t i = 0; i < length; i++) {
        take(frame[i]);
    }
}

/// A picture of the robot's own camera: a room, changed by the input, and perhaps without its first rows.
static void show_picture(fuzz_input_t *input)
{
    uint8_t rgb[FUZZ_ROW_BYTES];
    uint16_t pixels[BSLAM_IMAGE_WIDTH_MAX] = {0};
    const int32_t first = fuzz_u8(input) < 240 ? 0 : 3;
    for (int32_t y = first; y < own_camera.height_px; y++) {
        fuzz_room_row(y, rgb);
        for (int32_t x = 0; x < own_camera.width_px; x++) {
            pixels[x] =
                (uint16_t)((rgb[3 * x] >> 3) << 11 | (rgb[3 * x + 1] >> 2) << 5 | rgb[3 * x + 2] >> 3);
        }
        pixels[fuzz_u8(input) % BSLAM_IMAGE_WIDTH_MAX] = fuzz_u16(input);
        const port_row_t row = {.pixels = pixels,
                                .time_us = clock_us,
                                .is_first = y == 0,
                                .is_last = y == own_camera.height_px - 1};
        own_sensors_take_row(&robot, &session, &row);
    }
}

/// Wheels and gyro, as a robot's main loop reads them; a gyro may say what none should.
static void take_reading(fuzz_input_t *input)
{
    bslam_odometry_reading_t reading;
    left_ticks = fuzz_u16(input);
    right_ticks = fuzz_u16(input);
    has_gyro = left_ticks % 2 != 0;
    gyro_radps = has_gyro ? (float)fuzz_real(input, -4, 4) : 0;
    fuzz_require(own_sensors_read(&reading));
    own_sensors_take_reading(&robot, &session, &reading);
}

static void talk(fuzz_input_t *input)
{
    uint16_t sequence = 0;
    int64_t now_us = 0;
    for (int i = 0; i < MESSAGES_MAX && input->left > 0; i++) {
        clock_us += 1000;
        const unsigned choice = fuzz_u8(input);
        if (choice < 4 && own_cameras > 0) {
            show_picture(input);
        } else if (choice < 16) {
            take_reading(input);
        } else {
            send_message(input, &sequence, &now_us);
        }
        fuzz_require_sound(&bslam_instance(&robot.slam)->slam);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_input_t input = {data, size};
    const unsigned choice = fuzz_u8(&input);
    memset(&answers, 0, sizeof answers);
    clock_us = 0;
    stored = 0;
    own_camera = fuzz_camera(BSLAM_LENS_PINHOLE);
    own_cameras = (choice & 4u) != 0 ? 1 : 0;
    memset(&robot, 0, sizeof robot);
    session_start(&session, &robot);
    require_good_answers(1);
    if ((choice & 1u) != 0) {
        talk(&input);
    } else {
        while (input.left > 0) {
            take(fuzz_u8(&input));
        }
    }
    if ((choice & 2u) != 0) {
        session_start(&session, &robot);  // a restart: with what was stored, or guarded
    }
    fuzz_require_sound(&bslam_instance(&robot.slam)->slam);
    return 0;
}
