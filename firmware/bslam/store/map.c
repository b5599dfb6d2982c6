// One description of the format serves writing, checking and loading: each field passes through a move_
// function, which takes it from where it is to where it goes. docs/MAP.md has the same, byte by byte.
#include "bslam/store/map.h"

#include <string.h>

#include "bslam/store/crc32.h"

#define MAGIC 0x4d4c5342u  // "BSLM"
#define ORDER 0x0102u
#define ORDER_SWAPPED 0x0201u
#define NO_MACHINE 0xffffu
#define SEED 0xffu

enum { HEADER_BYTES = 28, REAL_BYTES = 4, CRC_BYTES = 4 };

// A covariance that was rounded to float32 may show a correlation a little beyond 1.
static const bslam_real_t CORRELATION2_MAX = BSLAM_R(1.001);
static const bslam_real_t SCALE_MAX = BSLAM_R(100.0);
// A beacon of a loaded map was last fused so long ago that its errors are no more alike.
static const uint32_t LONG_WAY_UM = 1000000000u;

const char *bslam_map_fault_name(bslam_map_fault_t fault)
{
    static const char *const names[BSLAM_MAP_FAULT_COUNT] = {
        "fine",    "truncated", "too long",   "no map",  "other byte order", "other version", "bad crc",
        "beacons", "machines",  "not finite", "content", "covariance",       "unreadable",
    };
    return (unsigned)fault < (unsigned)BSLAM_MAP_FAULT_COUNT ? names[fault] : "unknown fault";
}

// ---- memory -----------------------------------------------------------------------------------------------

static bool write_memory(void *context, const void *bytes, uint32_t count)
{
    bslam_map_memory_t *memory = context;
    if (count > memory->capacity - memory->count) {
        return false;
    }
    memcpy(&memory->bytes[memory->count], bytes, count);
    memory->count += count;
    return true;
}

static bool read_memory(const void *context, uint32_t at, void *bytes, uint32_t count)
{
    const uint8_t *from = context;
    memcpy(bytes, &from[at], count);
    return true;
}

bslam_map_sink_t bslam_map_to_memory(bslam_map_memory_t *memory)
{
    return (bslam_map_sink_t){write_memory, memory};
}

bslam_map_source_t bslam_map_from_memory(const uint8_t *bytes, uint32_t size)
{
    return (bslam_map_source_t){read_memory, bytes, size};
}

// ---- bytes ------------------------------------------------------------------------------------------------

/// Where the passage through a blob stands. The sink is NULL while reading; both are while measuring.
typedef struct passage {
    const bslam_map_sink_t *sink;
    const bslam_map_source_t *source;
    uint32_t at;
    uint32_t crc;
    uint32_t version;
    bslam_map_fault_t fault;  ///< the first that was found; nothing moves after it
} passage_t;

static void blame(passage_t *passage, bslam_map_fault_t fault)
{
    if (passage->fault == BSLAM_MAP_FINE) {
        passage->fault = fault;
    }
}

static void require(passage_t *passage, bool holds, bslam_map_fault_t fault)
{
    if (!holds) {
        blame(passage, fault);
    }
}

static bool is_reading(const passage_t *passage)
{
    return passage->source != NULL;
}

static void move_bytes(passage_t *passage, void *bytes, uint32_t count)
{
    if (passage->fault == BSLAM_MAP_FINE) {
        bool moved = true;
        if (is_reading(passage)) {
            if (count > passage->source->size - passage->at) {
                blame(passage, BSLAM_MAP_TRUNCATED);
            } else {
                moved = passage->source->read(passage->source->context, passage->at, bytes, count);
            }
        } else if (passage->sink != NULL) {
            moved = passage->sink->write(passage->sink->context, bytes, count);
        }
        require(passage, moved, BSLAM_MAP_UNREADABLE);
    }
    if (passage->fault != BSLAM_MAP_FINE) {
        memset(bytes, 0, count);
        return;
    }
    passage->crc = bslam_crc32_add(passage->crc, bytes, count);
    passage->at += count;
}

/// A whole number of `size` bytes, low byte first.
static uint32_t move_whole(passage_t *passage, uint32_t value, uint32_t size)
{
    uint8_t bytes[4] = {(uint8_t)value, (uint8_t)(value >> 8), (uint8_t)(value >> 16),
                        (uint8_t)(value >> 24)};
    move_bytes(passage, bytes, size);
    uint32_t moved = 0;
    for (uint32_t i = 0; i < size; i++) {
        moved |= (uint32_t)bytes[i] << 8 * i;
    }
    return moved;
}

static float float_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static float move_float(passage_t *passage, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    const float moved = float_of(move_whole(passage, bits, 4));
    require(passage, bslam_is_number((bslam_real_t)moved), BSLAM_MAP_NOT_FINITE);
    return moved;
}

static bslam_real_t move_real(passage_t *passage, bslam_real_t value)
{
    return (bslam_real_t)move_float(passage, (float)value);
}

// ---- header -----------------------------------------------------------------------------------------------

typedef struct header {
    uint32_t length;
    uint32_t beacons;
    uint32_t values;
    uint32_t machines;
    uint32_t next_uid;
} header_t;

static void move_header(passage_t *passage, header_t *header)
{
    const uint32_t magic = move_whole(passage, MAGIC, 4);
    require(passage, magic == MAGIC, BSLAM_MAP_NO_MAP);
    const uint32_t order = move_whole(passage, ORDER, 2);
    require(passage, order != ORDER_SWAPPED, BSLAM_MAP_BYTE_ORDER);
    require(passage, order == ORDER, BSLAM_MAP_NO_MAP);
    passage->version = move_whole(passage, BSLAM_MAP_VERSION, 2);
    require(passage, passage->version >= 1 && passage->version <= BSLAM_MAP_VERSION, BSLAM_MAP_OTHER_VERSION);
    header->length = move_whole(passage, header->length, 4);
    header->beacons = move_whole(passage, header->beacons, 2);
    header->values = move_whole(passage, header->values, 2);
    header->machines = move_whole(passage, header->machines, 2);
    const uint32_t features = move_whole(passage, BSLAM_SAMPLE_FEATURES, 2);
    header->next_uid = move_whole(passage, header->next_uid, 4);
    const uint32_t reserved = move_whole(passage, 0, 4);
    require(passage, header->beacons <= BSLAM_BEACONS_MAX, BSLAM_MAP_BEACONS);
    require(passage, header->values <= BSLAM_STATE_MAX - BSLAM_ROBOT_DIM_MAX, BSLAM_MAP_BEACONS);
    require(passage, header->machines <= BSLAM_LEARNER_SLOTS, BSLAM_MAP_MACHINES);
    require(passage, features == BSLAM_SAMPLE_FEATURES, BSLAM_MAP_MACHINES);
    require(passage, reserved == 0, BSLAM_MAP_CONTENT);
}

// ---- beacons ----------------------------------------------------------------------------------------------

/// What the blob has of a beacon. Its position is for who reads the map; where it has state values they
/// count.
typedef struct record {
    bslam_beacon_t beacon;
    uint32_t machine;
    bslam_real_t scale;  ///< 0: nobody knows
    bslam_real_t x_m;
    bslam_real_t y_m;
    uint8_t seen_as[BSLAM_LOOKS_CLASSES];
} record_t;

static void move_record(passage_t *passage, record_t *record)
{
    bslam_beacon_t *beacon = &record->beacon;
    beacon->uid = move_whole(passage, beacon->uid, 4);
    const uint32_t label = move_whole(passage, (uint32_t)beacon->label, 4);
    const uint32_t kind = move_whole(passage, (uint32_t)beacon->kind, 1);
    beacon->beacon_class = (uint8_t)move_whole(passage, beacon->beacon_class, 1);
    record->machine = move_whole(passage, record->machine, 2);
    beacon->sightings = move_whole(passage, beacon->sightings, 4);
    record->scale = move_real(passage, record->scale);
    require(passage, bslam_in_range(record->scale, 0, SCALE_MAX), BSLAM_MAP_CONTENT);
    record->x_m = move_real(passage, record->x_m);
    record->y_m = move_real(passage, record->y_m);
    if (passage->version >= 2) {
        move_bytes(passage, record->seen_as, sizeof record->seen_as);
    } else {  // version 1 knew neither
        require(passage, record->scale == 0, BSLAM_MAP_CONTENT);
    }
    require(passage, label <= INT32_MAX || label == UINT32_MAX, BSLAM_MAP_CONTENT);
    require(passage, kind <= BSLAM_BEACON_SIZED, BSLAM_MAP_CONTENT);
    beacon->label = label == UINT32_MAX ? BSLAM_LABEL_NONE : (int32_t)label;
    beacon->kind = kind <= BSLAM_BEACON_SIZED ? (bslam_beacon_kind_t)kind : BSLAM_BEACON_POINT;
}

/// Where the beacons being loaded go; NULL while checking.
typedef struct target {
    bslam_slam_t *slam;
    bslam_map_mode_t mode;
} target_t;

/// A frozen map has no use for a beacon whose distance is not known.
static bool is_taken(const target_t *target, const bslam_beacon_t *beacon)
{
    return target != NULL && (target->mode == BSLAM_MAP_LIVING || beacon->kind != BSLAM_BEACON_RAY);
}

static void take_record(const target_t *target, const record_t *record)
{
    bslam_ekf_t *ekf = &target->slam->ekf;
    const int index = ekf->beacon_count++;
    bslam_beacon_t *beacon = &ekf->beacons[index];
    *beacon = record->beacon;
    beacon->confirmed = true;
    beacon->known_x_m = record->x_m;
    beacon->known_y_m = record->y_m;
    beacon->way_um = target->slam->way_um - LONG_WAY_UM;
    if (target->mode == BSLAM_MAP_FROZEN) {
        beacon->kind = BSLAM_BEACON_KNOWN;
    }
    beacon->known_scale = beacon->kind == BSLAM_BEACON_KNOWN ? record->scale : 0;
    ekf->ray_count += beacon->kind == BSLAM_BEACON_RAY ? 1 : 0;
    ekf->sized_count += beacon->kind == BSLAM_BEACON_SIZED ? 1 : 0;
    beacon->at = beacon->kind == BSLAM_BEACON_KNOWN ? 0 : ekf->dim;
    ekf->dim += bslam_beacon_dim(beacon->kind);
    if (target->slam->looks != NULL) {
        bslam_look_t *look = &target->slam->looks->of[index];
        look->machine = record->machine != NO_MACHINE ? (int16_t)record->machine : look->machine;
        memcpy(look->seen_as, record->seen_as, sizeof look->seen_as);
    }
}

static void read_beacons(passage_t *passage, const header_t *header, const target_t *target)
{
    uint32_t values = 0;
    uint32_t further = 0;  // beyond two a beacon
    uint32_t least_uid = 0;
    for (uint32_t b = 0; b < header->beacons && passage->fault == BSLAM_MAP_FINE; b++) {
        record_t record = {.machine = NO_MACHINE};
        move_record(passage, &record);
        values += (uint32_t)bslam_beacon_dim(record.beacon.kind);
        further += record.beacon.kind == BSLAM_BEACON_RAY     ? 2u
                   : record.beacon.kind == BSLAM_BEACON_SIZED ? 1u
                                                              : 0u;
        const uint32_t uid = record.beacon.uid;
        require(passage, uid >= least_uid && uid < header->next_uid, BSLAM_MAP_CONTENT);
        require(passage, record.machine == NO_MACHINE || record.machine < header->machines,
                BSLAM_MAP_CONTENT);
        least_uid = uid + 1;
        if (is_taken(target, &record.beacon)) {
            take_record(target, &record);
        }
    }
    require(passage, values == header->values, BSLAM_MAP_CONTENT);
    require(passage, further <= 2 * BSLAM_RAYS_MAX, BSLAM_MAP_BEACONS);
}

// ---- mean and covariance ----------------------------------------------------------------------------------

/// A value of the covariance, read out of turn: the diagonal.
static bslam_real_t variance_at(const passage_t *passage, uint32_t covariance_at, uint32_t i)
{
    uint8_t bytes[4] = {0};
    const uint32_t at = covariance_at + REAL_BYTES * (i * (i + 1) / 2 + i);
    if (passage->source->size < at + REAL_BYTES ||
        !passage->source->read(passage->source->context, at, bytes, REAL_BYTES)) {
        return 0;
    }
    return (bslam_real_t)float_of((uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
                                  (uint32_t)bytes[3] << 24);
}

/// The state values of the beacons, and the lower triangle of their covariance, row by row.
static void read_values(passage_t *passage, const header_t *header, const target_t *target)
{
    bslam_ekf_t *ekf = target != NULL && target->mode == BSLAM_MAP_LIVING ? &target->slam->ekf : NULL;
    const int base = ekf != NULL ? ekf->base_dim : 0;
    for (uint32_t i = 0; i < header->values; i++) {
        const bslam_real_t value = move_real(passage, 0);
        if (ekf != NULL) {
            ekf->mean[base + (int)i] = value;
        }
    }
    const uint32_t covariance_at = passage->at;
    for (uint32_t i = 0; i < header->values && passage->fault == BSLAM_MAP_FINE; i++) {
        const bslam_real_t own = variance_at(passage, covariance_at, i);
        for (int k = 0; k < base; k++) {
            bslam_symmat_set(ekf->covariance, base + (int)i, k, 0);
        }
        for (uint32_t j = 0; j <= i; j++) {
            const bslam_real_t value = move_real(passage, 0);
            if (ekf != NULL) {
                bslam_symmat_set(ekf->covariance, base + (int)i, base + (int)j, value);
            } else {
                const bslam_real_t other = j == i ? 1 : variance_at(passage, covariance_at, j);
                const bool fits = j == i ? value >= 0 : value * value <= CORRELATION2_MAX * own * other;
                require(passage, fits, BSLAM_MAP_COVARIANCE);
            }
        }
    }
}

/// Saved values in their order: the next state value after `place` of a saved beacon.
typedef struct place {
    int beacon;
    int value;
} place_t;

static bool is_saved(const bslam_ekf_t *ekf, int index)
{
    return ekf->beacons[index].confirmed;
}

/// Moves on to the next saved state value; false: there is none.
static bool next_value(const bslam_ekf_t *ekf, place_t *place)
{
    place->value++;
    while (place->beacon < ekf->beacon_count &&
           (!is_saved(ekf, place->beacon) ||
            place->value >= bslam_beacon_dim(ekf->beacons[place->beacon].kind))) {
        place->beacon++;
        place->value = 0;
    }
    return place->beacon < ekf->beacon_count;
}

static int state_at(const bslam_ekf_t *ekf, const place_t *place)
{
    return ekf->beacons[place->beacon].at + place->value;
}

static void write_values(passage_t *passage, const bslam_ekf_t *ekf)
{
    for (place_t i = {0, -1}; next_value(ekf, &i);) {
        (void)move_real(passage, ekf->mean[state_at(ekf, &i)]);
    }
    for (place_t i = {0, -1}; next_value(ekf, &i);) {
        place_t j = {0, -1};
        do {
            (void)next_value(ekf, &j);
            (void)move_real(passage, bslam_symmat_get(ekf->covariance, state_at(ekf, &i), state_at(ekf, &j)));
        } while (i.beacon != j.beacon || i.value != j.value);
    }
}

// ---- machines ---------------------------------------------------------------------------------------------

/// 8-bit samples and 16-bit weights, whatever this build keeps.
static int8_t to_byte(bslam_stored_t q)
{
    const float scaled = (float)q * (BSLAM_SAMPLE_UNIT * 127.0f);
    return (int8_t)(scaled + (scaled < 0.0f ? -0.5f : 0.5f));
}

static bslam_stored_t from_byte(int8_t byte)
{
    return (bslam_stored_t)((float)byte / (BSLAM_SAMPLE_UNIT * 127.0f));
}

static void move_sample(passage_t *passage, bslam_sample_t *sample)
{
    int8_t bytes[BSLAM_SAMPLE_FEATURES];
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        bytes[k] = to_byte(sample->q[k]);
    }
    move_bytes(passage, bytes, sizeof bytes);
    *sample = (bslam_sample_t){{0}};
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        sample->q[k] = from_byte(bytes[k]);
        require(passage, bytes[k] >= -127, BSLAM_MAP_CONTENT);
    }
    sample->q[BSLAM_SAMPLE_FEATURES] = from_byte(127);
}

#if BSLAM_SAMPLE_FLOAT
/// The unit and the 16-bit weights that come nearest, for samples in units of 1/127.
static float weights_to_words(const bslam_weights_t *weights, int16_t words[BSLAM_SAMPLE_USED])
{
    float largest = 0.0f;
    for (int k = 0; k < BSLAM_SAMPLE_USED; k++) {
        const float size = weights->w[k] < 0.0f ? -weights->w[k] : weights->w[k];
        largest = size > largest ? size : largest;
    }
    const float per_unit = largest > 0.0f ? 32767.0f / largest : 0.0f;
    for (int k = 0; k < BSLAM_SAMPLE_USED; k++) {
        const float w = weights->w[k] * per_unit;
        words[k] = (int16_t)(w + (w < 0.0f ? -0.5f : 0.5f));
    }
    return weights->unit * largest / (32767.0f * 127.0f);
}
static void words_to_weights(float unit, const int16_t words[BSLAM_SAMPLE_USED], bslam_weights_t *weights)
{
    *weights = (bslam_weights_t){.unit = 1.0f};
    for (int k = 0; k < BSLAM_SAMPLE_USED; k++) {
        weights->w[k] = unit * 127.0f * (float)words[k];
    }
}
#else
static float weights_to_words(const bslam_weights_t *weights, int16_t words[BSLAM_SAMPLE_USED])
{
    memcpy(words, weights->w, BSLAM_SAMPLE_USED * sizeof words[0]);
    return weights->unit;
}
static void words_to_weights(float unit, const int16_t words[BSLAM_SAMPLE_USED], bslam_weights_t *weights)
{
    *weights = (bslam_weights_t){.unit = unit};
    memcpy(weights->w, words, BSLAM_SAMPLE_USED * sizeof words[0]);
}
#endif

static void move_weights(passage_t *passage, bslam_weights_t *weights)
{
    int16_t words[BSLAM_SAMPLE_USED];
    const float unit = move_float(passage, weights_to_words(weights, words));
    for (int k = 0; k < BSLAM_SAMPLE_USED; k++) {
        words[k] = (int16_t)(uint16_t)move_whole(passage, (uint16_t)words[k], 2);
    }
    require(passage, unit >= 0.0f, BSLAM_MAP_CONTENT);
    words_to_weights(unit, words, weights);
}

static bool owns(const bslam_slam_t *slam, int32_t slot)
{
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        if (is_saved(&slam->ekf, b) && slam->looks->of[b].machine == slot) {
            return true;
        }
    }
    return false;
}

/// The number that a machine has in the blob, by its slot: saved ones in order.
static uint32_t machine_number(const bslam_slam_t *slam, int32_t slot)
{
    if (slam->looks == NULL || slot < 0 || slot >= BSLAM_LEARNER_SLOTS || !owns(slam, slot)) {
        return NO_MACHINE;
    }
    uint32_t number = 0;
    for (int32_t s = 0; s < slot; s++) {
        number += owns(slam, s) ? 1u : 0u;
    }
    return number;
}

/// A rival as the blob names it: machine << 8 | sample, or SEED << 8 | seed. False: it is not saved.
static bool name_rival(const bslam_slam_t *slam, uint16_t sample, uint32_t *name)
{
    const int32_t own = BSLAM_LEARNER_SLOTS * BSLAM_SAMPLES_PER_MACHINE;
    if (sample >= own) {
        *name = SEED << 8 | (uint32_t)(sample - own);
        return true;
    }
    const uint32_t machine = machine_number(slam, sample / BSLAM_SAMPLES_PER_MACHINE);
    *name = machine << 8 | (uint32_t)(sample % BSLAM_SAMPLES_PER_MACHINE);
    return machine != NO_MACHINE;
}

static uint32_t saved_rivals(const bslam_slam_t *slam, const bslam_machine_t *machine)
{
    uint32_t count = 0;
    uint32_t unused;
    for (int r = 0; r < machine->rivals; r++) {
        count += name_rival(slam, machine->rival[r], &unused) ? 1u : 0u;
    }
    return count;
}

static void write_machine(passage_t *passage, const bslam_slam_t *slam, int32_t slot)
{
    const bslam_learner_t *learner = &slam->looks->learner;
    const bslam_machine_t *machine = &learner->machines[slot];
    (void)move_whole(passage, machine->samples, 1);
    (void)move_whole(passage, machine->trained ? 1 : 0, 1);
    (void)move_whole(passage, saved_rivals(slam, machine), 2);
    bslam_weights_t weights = machine->weights;
    move_weights(passage, &weights);
    for (int s = 0; s < machine->samples; s++) {
        bslam_sample_t sample = learner->samples[slot * BSLAM_SAMPLES_PER_MACHINE + s];
        move_sample(passage, &sample);
        (void)move_whole(passage, machine->own_alpha[s], 2);
    }
    for (int r = 0; r < machine->rivals; r++) {
        uint32_t name;
        if (name_rival(slam, machine->rival[r], &name)) {
            (void)move_whole(passage, name, 2);
            (void)move_whole(passage, machine->rival_alpha[r], 2);
        }
    }
}

/// Samples that each machine has, and the first that nobody may name, to be held against each other.
typedef struct named {
    uint8_t samples[BSLAM_LEARNER_SLOTS];
    uint8_t end[BSLAM_LEARNER_SLOTS];
} named_t;

static void read_rival(passage_t *passage, const header_t *header, named_t *named, bslam_learner_t *learner,
                       bslam_machine_t *machine)
{
    const uint32_t name = move_whole(passage, 0, 2);
    const uint32_t alpha = move_whole(passage, 0, 2);
    const uint32_t owner = name >> 8;
    const uint32_t place = name & 0xffu;
    const bool is_seed = owner == SEED;
    require(passage, is_seed ? place < BSLAM_SEEDS_MAX : owner < header->machines && place < UINT8_MAX,
            BSLAM_MAP_CONTENT);
    if (passage->fault != BSLAM_MAP_FINE) {
        return;
    }
    if (!is_seed && place >= named->end[owner]) {
        named->end[owner] = (uint8_t)(place + 1);
    }
    // A robot with fewer seeds trains without those it does not have.
    if (machine != NULL && (!is_seed || (int32_t)place < learner->seed_count)) {
        const uint32_t first = is_seed ? BSLAM_LEARNER_SLOTS : owner;
        machine->rival[machine->rivals] = (uint16_t)(first * BSLAM_SAMPLES_PER_MACHINE + place);
        machine->rival_alpha[machine->rivals] = (uint16_t)alpha;
        machine->rivals++;
    }
}

static void read_machine(passage_t *passage, const header_t *header, named_t *named, uint32_t slot,
                         bslam_learner_t *learner)
{
    bslam_machine_t *machine = learner != NULL ? &learner->machines[slot] : NULL;
    const uint32_t samples = move_whole(passage, 0, 1);
    const uint32_t trained = move_whole(passage, 0, 1);
    const uint32_t rivals = move_whole(passage, 0, 2);
    require(passage, samples <= BSLAM_SAMPLES_PER_MACHINE && rivals <= BSLAM_RIVALS_MAX, BSLAM_MAP_MACHINES);
    require(passage, trained <= 1, BSLAM_MAP_CONTENT);
    bslam_weights_t weights = {0};
    move_weights(passage, &weights);
    named->samples[slot] = (uint8_t)samples;
    if (machine != NULL) {
        machine->used = true;
        machine->trained = trained != 0;
        machine->samples = (uint8_t)samples;
        machine->weights = weights;
    }
    for (uint32_t s = 0; s < samples && passage->fault == BSLAM_MAP_FINE; s++) {
        bslam_sample_t sample = {{0}};
        move_sample(passage, &sample);
        const uint32_t alpha = move_whole(passage, 0, 2);
        if (machine != NULL) {
            learner->samples[slot * BSLAM_SAMPLES_PER_MACHINE + s] = sample;
            machine->own_alpha[s] = (uint16_t)alpha;
        }
    }
    for (uint32_t r = 0; r < rivals && passage->fault == BSLAM_MAP_FINE; r++) {
        read_rival(passage, header, named, learner, machine);
    }
}

static void read_machines(passage_t *passage, const header_t *header, bslam_learner_t *learner)
{
    named_t named = {{0}, {0}};
    for (uint32_t m = 0; m < header->machines && passage->fault == BSLAM_MAP_FINE; m++) {
        read_machine(passage, header, &named, m, learner);
    }
    for (uint32_t m = 0; m < header->machines && passage->fault == BSLAM_MAP_FINE; m++) {
        require(passage, named.end[m] <= named.samples[m], BSLAM_MAP_CONTENT);
    }
}

/// What is known of a beacon's scale; 0: nothing, or nothing that can be.
static bslam_real_t scale_of(const bslam_ekf_t *ekf, const bslam_beacon_t *beacon)
{
    const bslam_real_t scale =
        beacon->kind == BSLAM_BEACON_SIZED ? ekf->mean[beacon->at + BSLAM_POINT_DIM] : beacon->known_scale;
    return bslam_in_range(scale, 0, SCALE_MAX) ? scale : 0;
}

// ---- the whole --------------------------------------------------------------------------------------------

static void write_all(passage_t *passage, const bslam_slam_t *slam, uint32_t length)
{
    const bslam_ekf_t *ekf = &slam->ekf;
    header_t header = {.length = length, .next_uid = ekf->next_uid};
    for (int b = 0; b < ekf->beacon_count; b++) {
        if (is_saved(ekf, b)) {
            header.beacons++;
            header.values += (uint32_t)bslam_beacon_dim(ekf->beacons[b].kind);
        }
    }
    for (int32_t slot = 0; slam->looks != NULL && slot < BSLAM_LEARNER_SLOTS; slot++) {
        header.machines += owns(slam, slot) ? 1u : 0u;
    }
    move_header(passage, &header);
    for (int b = 0; b < ekf->beacon_count; b++) {
        if (is_saved(ekf, b)) {
            record_t record = {.beacon = ekf->beacons[b], .machine = NO_MACHINE};
            record.scale = scale_of(ekf, &ekf->beacons[b]);
            if (slam->looks != NULL) {
                const bslam_look_t *look = &slam->looks->of[b];
                record.machine = machine_number(slam, look->machine);
                memcpy(record.seen_as, look->seen_as, sizeof record.seen_as);
            }
            bslam_ekf_beacon_position(ekf, b, &record.x_m, &record.y_m);
            move_record(passage, &record);
        }
    }
    write_values(passage, ekf);
    for (int32_t slot = 0; slam->looks != NULL && slot < BSLAM_LEARNER_SLOTS; slot++) {
        if (owns(slam, slot)) {
            write_machine(passage, slam, slot);
        }
    }
    (void)move_whole(passage, ~passage->crc, CRC_BYTES);
}

uint32_t bslam_map_size(const bslam_slam_t *slam)
{
    passage_t passage = {.crc = BSLAM_CRC32_START};
    write_all(&passage, slam, 0);
    return passage.at;
}

bslam_status_t bslam_map_write(const bslam_slam_t *slam, const bslam_map_sink_t *sink,
                               bslam_map_fault_t *fault)
{
    passage_t passage = {.sink = sink, .crc = BSLAM_CRC32_START};
    write_all(&passage, slam, bslam_map_size(slam));
    *fault = passage.fault;
    return passage.fault == BSLAM_MAP_FINE ? BSLAM_OK : BSLAM_E_MAP;
}

static void read_all(passage_t *passage, const target_t *target)
{
    header_t header = {0};
    move_header(passage, &header);
    if (target != NULL) {
        target->slam->ekf.next_uid = header.next_uid;
    }
    read_beacons(passage, &header, target);
    read_values(passage, &header, target);
    const bool learns = target != NULL && target->slam->looks != NULL;
    read_machines(passage, &header, learns ? &target->slam->looks->learner : NULL);
    const uint32_t body = passage->at;
    (void)move_whole(passage, 0, CRC_BYTES);
    require(passage, body + CRC_BYTES == header.length, BSLAM_MAP_CONTENT);
}

/// The frame of a blob: it begins as a map, is as long as it says, and its CRC is right. All else is looked
/// at only then, so that damage is called damage.
static bslam_map_fault_t check_frame(const bslam_map_source_t *source)
{
    passage_t passage = {.source = source, .crc = BSLAM_CRC32_START};
    header_t header = {0};
    if (source->size < HEADER_BYTES + CRC_BYTES) {
        return BSLAM_MAP_TRUNCATED;
    }
    move_header(&passage, &header);
    const bool is_map = passage.fault == BSLAM_MAP_FINE || passage.fault >= BSLAM_MAP_BEACONS;
    if (!is_map || passage.fault == BSLAM_MAP_UNREADABLE) {
        return passage.fault;
    }
    if (header.length != source->size) {
        return source->size < header.length ? BSLAM_MAP_TRUNCATED : BSLAM_MAP_TOO_LONG;
    }
    passage = (passage_t){.source = source, .crc = BSLAM_CRC32_START};
    while (passage.at < header.length - CRC_BYTES && passage.fault == BSLAM_MAP_FINE) {
        uint8_t bytes[32];
        const uint32_t left = header.length - CRC_BYTES - passage.at;
        move_bytes(&passage, bytes, left < sizeof bytes ? left : sizeof bytes);
    }
    const uint32_t crc = ~passage.crc;
    require(&passage, move_whole(&passage, 0, CRC_BYTES) == crc, BSLAM_MAP_BAD_CRC);
    return passage.fault;
}

bslam_map_fault_t bslam_map_check(const bslam_map_source_t *source)
{
    const bslam_map_fault_t fault = check_frame(source);
    if (fault != BSLAM_MAP_FINE) {
        return fault;
    }
    passage_t passage = {.source = source, .crc = BSLAM_CRC32_START};
    read_all(&passage, NULL);
    return passage.fault;
}

bslam_status_t bslam_map_load(bslam_slam_t *slam, const bslam_map_source_t *source, bslam_map_mode_t mode,
                              bslam_map_fault_t *fault)
{
    *fault = bslam_map_check(source);
    if (*fault != BSLAM_MAP_FINE) {
        return BSLAM_E_MAP;
    }
    bslam_slam_forget_map(slam);
    slam->is_frozen = mode == BSLAM_MAP_FROZEN;
    const target_t target = {slam, mode};
    passage_t passage = {.source = source, .crc = BSLAM_CRC32_START};
    read_all(&passage, &target);
    *fault = passage.fault;
    if (*fault != BSLAM_MAP_FINE) {
        bslam_slam_forget_map(slam);
    }
    bslam_slam_lose_pose(slam);
    return *fault == BSLAM_MAP_FINE ? BSLAM_OK : BSLAM_E_MAP;
}
