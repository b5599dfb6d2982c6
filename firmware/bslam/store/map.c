#include "bslam/store/map.h"

#include <string.h>

#include "base/crc32.h"
#include "bslam/store/classifiers.h"
#include "bslam/store/codec.h"
#include "base/scalar.h"

#define MAGIC 0x4d4c5342u  // "BSLM"
#define ORDER 0x0102u
#define ORDER_SWAPPED 0x0201u

enum { HEADER_BYTES = 28, REAL_BYTES = 4, CRC_BYTES = 4 };

/// What the values of a full map may hang on: two of the robot's, the sensor's, and the beacons'.
enum { COLUMNS_MAX = 2 + BSLAM_SENSOR_DIM + 2 * BSLAM_BEACONS_MAX + 2 * BSLAM_RAYS_MAX };

static const bslam_real_t VARIANCE_MAX = BSLAM_R(1e12);
// L may be large where a variance is small: what a load leaves of a map must be such that it can be saved.
static const bslam_real_t FACTOR_MAX = BSLAM_R(1e18);
static const bslam_real_t SCALE_MAX = BSLAM_R(100.0);
// A beacon may have moved away from where it began; no other value is as large.
static const bslam_real_t VALUE_MAX = 2 * BSLAM_PLACE_MAX_M;
// A beacon of a loaded map was last fused so long ago that its errors are no more alike.
static const uint32_t LONG_TRAVEL_UM = 1000000000u;

// ---- header -----------------------------------------------------------------------------------------------

typedef struct header {
    uint32_t length;
    uint32_t beacons;
    uint32_t values;   ///< state values of the beacons
    uint32_t columns;  ///< of the factor: those, and what else they hang on
    uint32_t classifiers;
    uint32_t next_uid;
} header_t;

static void move_header(bslam_codec_t *codec, header_t *header)
{
    const uint32_t magic = bslam_codec_whole(codec, MAGIC, 4);
    bslam_codec_require(codec, magic == MAGIC, BSLAM_MAP_NO_MAP);
    const uint32_t order = bslam_codec_whole(codec, ORDER, 2);
    bslam_codec_require(codec, order != ORDER_SWAPPED, BSLAM_MAP_BYTE_ORDER);
    bslam_codec_require(codec, order == ORDER, BSLAM_MAP_NO_MAP);
    const uint32_t version = bslam_codec_whole(codec, BSLAM_MAP_VERSION, 2);
    bslam_codec_require(codec, version == BSLAM_MAP_VERSION, BSLAM_MAP_OTHER_VERSION);
    header->length = bslam_codec_whole(codec, header->length, 4);
    header->beacons = bslam_codec_whole(codec, header->beacons, 2);
    header->values = bslam_codec_whole(codec, header->values, 2);
    header->classifiers = bslam_codec_whole(codec, header->classifiers, 2);
    const uint32_t features = bslam_codec_whole(codec, BSLAM_SAMPLE_FEATURES, 2);
    header->next_uid = bslam_codec_whole(codec, header->next_uid, 4);
    header->columns = bslam_codec_whole(codec, header->columns, 2);
    const uint32_t reserved = bslam_codec_whole(codec, 0, 2);
    bslam_codec_require(codec, header->beacons <= BSLAM_BEACONS_MAX, BSLAM_MAP_BEACONS);
    bslam_codec_require(codec, header->values <= header->columns, BSLAM_MAP_CONTENT);
    bslam_codec_require(codec, header->columns <= COLUMNS_MAX, BSLAM_MAP_BEACONS);
    bslam_codec_require(codec, header->classifiers <= BSLAM_LEARNER_SLOTS, BSLAM_MAP_CLASSIFIERS);
    bslam_codec_require(codec, features == BSLAM_SAMPLE_FEATURES, BSLAM_MAP_CLASSIFIERS);
    bslam_codec_require(codec, reserved == 0, BSLAM_MAP_CONTENT);
}

// ---- beacons ----------------------------------------------------------------------------------------------

/// What the blob has of a beacon. Its position is for who reads the map; where it has state values they
/// count.
typedef struct stored_beacon {
    bslam_beacon_t beacon;
    uint32_t classifier;
    uint32_t column;     ///< of its first state value
    bslam_real_t scale;  ///< 0: nobody knows
    bslam_real_t x_m, y_m;
    uint8_t seen_as[BSLAM_APPEARANCE_CLASSES];
} stored_beacon_t;

static bslam_real_t move_value(bslam_codec_t *codec, bslam_real_t value)
{
    const bslam_real_t moved = bslam_codec_real(codec, value);
    bslam_codec_require(codec, bslam_in_range(moved, -VALUE_MAX, VALUE_MAX), BSLAM_MAP_CONTENT);
    return moved;
}

static bslam_real_t move_factor(bslam_codec_t *codec, bslam_real_t value)
{
    const float rounded = (float)value;
    uint32_t bits;
    memcpy(&bits, &rounded, sizeof bits);
    const bslam_real_t moved = (bslam_real_t)bslam_codec_float_of(bslam_codec_whole(codec, bits, REAL_BYTES));
    bslam_codec_require(codec, bslam_in_range(moved, -FACTOR_MAX, FACTOR_MAX), BSLAM_MAP_NOT_FINITE);
    return moved;
}

static void move_record(bslam_codec_t *codec, stored_beacon_t *record)
{
    bslam_beacon_t *beacon = &record->beacon;
    beacon->uid = bslam_codec_whole(codec, beacon->uid, 4);
    const uint32_t label = bslam_codec_whole(codec, (uint32_t)beacon->label, 4);
    const uint32_t kind = bslam_codec_whole(codec, (uint32_t)beacon->kind, 1);
    beacon->beacon_class = (uint8_t)bslam_codec_whole(codec, beacon->beacon_class, 1);
    record->classifier = bslam_codec_whole(codec, record->classifier, 2);
    beacon->sightings = bslam_codec_whole(codec, beacon->sightings, 4);
    record->scale = bslam_codec_real(codec, record->scale);
    bslam_codec_require(codec, bslam_in_range(record->scale, 0, SCALE_MAX), BSLAM_MAP_CONTENT);
    record->x_m = move_value(codec, record->x_m);
    record->y_m = move_value(codec, record->y_m);
    bslam_codec_bytes(codec, record->seen_as, sizeof record->seen_as);
    record->column = bslam_codec_whole(codec, record->column, 2);
    bslam_codec_require(codec, label <= INT32_MAX || label == UINT32_MAX, BSLAM_MAP_CONTENT);
    bslam_codec_require(codec, kind <= BSLAM_BEACON_SIZED, BSLAM_MAP_CONTENT);
    beacon->label = label == UINT32_MAX ? BSLAM_LABEL_NONE : (int32_t)label;
    beacon->kind = kind <= BSLAM_BEACON_SIZED ? (bslam_beacon_kind_t)kind : BSLAM_BEACON_POINT;
}

/// Where the beacons being loaded go; NULL while checking.
typedef struct target {
    bslam_slam_t *slam;
    bslam_map_mode_t mode;
} target_t;

/// Which columns are a beacon's state values.
typedef struct columns {
    bool are_values[COLUMNS_MAX];
} columns_t;

/// A frozen map has no use for a beacon whose distance is not known.
static bool is_taken(const target_t *target, const bslam_beacon_t *beacon)
{
    return target != NULL && (target->mode == BSLAM_MAP_LIVING || beacon->kind != BSLAM_BEACON_RAY);
}

static void take_record(const target_t *target, const stored_beacon_t *record)
{
    bslam_ekf_t *ekf = &target->slam->ekf;
    const int index = ekf->beacon_count++;
    bslam_beacon_t *beacon = &ekf->beacons[index];
    *beacon = record->beacon;
    beacon->confirmed = true;
    beacon->class_lead = BSLAM_LEAD_MAX;
    beacon->distance_lead = BSLAM_LEAD_MAX;
    beacon->known_x_m = record->x_m;
    beacon->known_y_m = record->y_m;
    beacon->travelled_um = target->slam->travelled_um - LONG_TRAVEL_UM;
    if (target->mode == BSLAM_MAP_FROZEN) {
        beacon->kind = BSLAM_BEACON_KNOWN;
    }
    beacon->known_scale = beacon->kind == BSLAM_BEACON_KNOWN ? record->scale : 0;
    ekf->ray_count += beacon->kind == BSLAM_BEACON_RAY ? 1 : 0;
    ekf->sized_count += beacon->kind == BSLAM_BEACON_SIZED ? 1 : 0;
    beacon->at = beacon->kind == BSLAM_BEACON_KNOWN ? 0 : bslam_ekf_map_at(ekf) + (int32_t)record->column;
    if (bslam_slam_learns(target->slam)) {
        bslam_beacon_appearance_t *known = &target->slam->appearance->of[index];
        known->classifier =
            record->classifier != BSLAM_MAP_NO_CLASSIFIER ? (int16_t)record->classifier : known->classifier;
        memcpy(known->seen_as, record->seen_as, sizeof known->seen_as);
    }
}

/// A beacon's columns are its own, and there.
static void take_columns(bslam_codec_t *codec, const header_t *header, const stored_beacon_t *record,
                         columns_t *columns)
{
    const uint32_t count = (uint32_t)bslam_beacon_dim(record->beacon.kind);
    for (uint32_t k = 0; k < count; k++) {
        const uint32_t column = record->column + k;
        const bool is_there = column < header->columns && !columns->are_values[column];
        bslam_codec_require(codec, is_there, BSLAM_MAP_CONTENT);
        if (is_there) {
            columns->are_values[column] = true;
        }
    }
}

static void read_beacons(bslam_codec_t *codec, const header_t *header, const target_t *target,
                         columns_t *columns)
{
    uint32_t values = 0;
    uint32_t further = 0;  // beyond two a beacon
    uint32_t least_uid = 0;
    for (uint32_t b = 0; b < header->beacons && codec->fault == BSLAM_MAP_FINE; b++) {
        stored_beacon_t record = {.classifier = BSLAM_MAP_NO_CLASSIFIER};
        move_record(codec, &record);
        values += (uint32_t)bslam_beacon_dim(record.beacon.kind);
        further += record.beacon.kind == BSLAM_BEACON_RAY     ? 2u
                   : record.beacon.kind == BSLAM_BEACON_SIZED ? 1u
                                                              : 0u;
        const uint32_t uid = record.beacon.uid;
        bslam_codec_require(codec, uid >= least_uid && uid < header->next_uid, BSLAM_MAP_CONTENT);
        bslam_codec_require(
            codec, record.classifier == BSLAM_MAP_NO_CLASSIFIER || record.classifier < header->classifiers,
            BSLAM_MAP_CONTENT);
        bslam_codec_require(codec, values <= header->values, BSLAM_MAP_CONTENT);
        take_columns(codec, header, &record, columns);
        bslam_codec_require(codec, further <= 2 * BSLAM_RAYS_MAX, BSLAM_MAP_BEACONS);
        least_uid = uid + 1;
        if (codec->fault == BSLAM_MAP_FINE && is_taken(target, &record.beacon)) {
            take_record(target, &record);
        }
    }
    bslam_codec_require(codec, values == header->values, BSLAM_MAP_CONTENT);
}

// ---- mean and covariance ----------------------------------------------------------------------------------

/// A number of the factor's D, read out of turn.
static bslam_real_t d_at(bslam_codec_t *codec, uint32_t d_begins, uint32_t column)
{
    uint8_t bytes[4] = {0};
    const uint32_t at = d_begins + REAL_BYTES * column;
    if (codec->source->size < at + REAL_BYTES) {
        return 0;
    }
    bslam_codec_require(codec, codec->source->read(codec->source->context, at, bytes, REAL_BYTES),
                        BSLAM_MAP_UNREADABLE);
    return (bslam_real_t)bslam_codec_float_of((uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 |
                                              (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24);
}

/// D, and of each value its row of L: whatever they are, their product is a covariance, if none of its
/// variances is too large. ekf: where it goes, or NULL.
static void read_factor(bslam_codec_t *codec, const header_t *header, const columns_t *columns,
                        bslam_ekf_t *ekf)
{
    const uint32_t d_begins = codec->at;
    const int first = ekf != NULL ? bslam_ekf_map_at(ekf) - ekf->factor.tail_count : 0;
    for (uint32_t c = 0; c < header->columns; c++) {
        const bslam_real_t d = move_factor(codec, 0);
        bslam_codec_require(codec, d >= 0, BSLAM_MAP_COVARIANCE);
        if (ekf != NULL) {
            ekf->factor.d[first + (int)c] = d;
        }
    }
    for (uint32_t i = 0; i < header->columns && codec->fault == BSLAM_MAP_FINE; i++) {
        bslam_real_t variance = columns->are_values[i] ? d_at(codec, d_begins, i) : 0;
        for (uint32_t j = 0; columns->are_values[i] && j < i; j++) {
            const bslam_real_t value = move_factor(codec, 0);
            variance += d_at(codec, d_begins, j) * value * value;
            if (ekf != NULL) {
                *bslam_factor_element(&ekf->factor, first + (int)i, first + (int)j) = value;
            }
        }
        bslam_codec_require(codec, bslam_in_range(variance, 0, VARIANCE_MAX), BSLAM_MAP_COVARIANCE);
    }
}

/// What the values hang on that is no beacon's leaves.
static void drop_others(bslam_ekf_t *ekf, const header_t *header, const columns_t *columns)
{
    for (int c = (int)header->columns - 1; c >= 0; c--) {
        if (!columns->are_values[c]) {
            bslam_ekf_remove_value(ekf, bslam_ekf_map_at(ekf) + c);
        }
    }
}

/// The state values of the beacons, by column, and their covariance.
static void read_values(bslam_codec_t *codec, const header_t *header, const target_t *target,
                        const columns_t *columns)
{
    bslam_ekf_t *ekf = target != NULL && target->mode == BSLAM_MAP_LIVING ? &target->slam->ekf : NULL;
    if (ekf != NULL) {
        bslam_factor_widen(&ekf->factor, (int)header->columns);
        ekf->dim += (int32_t)header->columns;
    }
    for (uint32_t c = 0; c < header->columns; c++) {
        const bslam_real_t value = columns->are_values[c] ? move_value(codec, 0) : 0;
        if (ekf != NULL) {
            ekf->mean[bslam_ekf_map_at(ekf) + (int)c] = value;
        }
    }
    read_factor(codec, header, columns, ekf);
    if (ekf != NULL) {
        drop_others(ekf, header, columns);
    }
}

static void write_values(bslam_codec_t *codec, const bslam_ekf_t *ekf, const header_t *header,
                         const columns_t *columns)
{
    const bslam_factor_t *factor = &ekf->factor;
    const int tail = factor->tail_count;
    for (int c = 0; c < (int)header->columns; c++) {
        if (columns->are_values[c]) {
            (void)bslam_codec_real(codec, ekf->mean[c + tail]);
        }
    }
    for (int c = 0; c < (int)header->columns; c++) {
        (void)move_factor(codec, factor->d[c]);
    }
    for (int i = 0; i < (int)header->columns; i++) {
        const bslam_real_t *row = bslam_factor_row(factor, i);
        bslam_real_t variance = columns->are_values[i] ? (float)factor->d[i] : 0;
        for (int j = 0; columns->are_values[i] && j < i; j++) {
            const bslam_real_t value = move_factor(codec, row[4 * j]);
            variance += (float)factor->d[j] * value * value;
        }
        bslam_codec_require(codec, bslam_in_range(variance, 0, VARIANCE_MAX), BSLAM_MAP_COVARIANCE);
    }
}

/// What is known of a beacon's scale; 0: nothing, or nothing that can be.
static bslam_real_t scale_of(const bslam_ekf_t *ekf, const bslam_beacon_t *beacon)
{
    const bslam_real_t scale =
        beacon->kind == BSLAM_BEACON_SIZED ? ekf->mean[beacon->at + BSLAM_POINT_DIM] : beacon->known_scale;
    return bslam_in_range(scale, 0, SCALE_MAX) ? scale : 0;
}

/// Of a beacon's first state value.
static int column_of(const bslam_ekf_t *ekf, int index)
{
    return ekf->beacons[index].kind == BSLAM_BEACON_KNOWN ? 0 : bslam_ekf_place(ekf, ekf->beacons[index].at);
}

// ---- the whole --------------------------------------------------------------------------------------------

static void write_all(bslam_codec_t *codec, const bslam_slam_t *slam, uint32_t length)
{
    const bslam_ekf_t *ekf = &slam->ekf;
    header_t header = {
        .length = length, .columns = (uint32_t)ekf->factor.body_count, .next_uid = ekf->next_uid};
    columns_t columns = {{0}};
    for (int b = 0; b < ekf->beacon_count; b++) {
        const int count = bslam_beacon_dim(ekf->beacons[b].kind);
        for (int k = 0; bslam_map_saves(ekf, b) && k < count; k++) {
            columns.are_values[column_of(ekf, b) + k] = true;
        }
        header.beacons += bslam_map_saves(ekf, b) ? 1u : 0u;
        header.values += bslam_map_saves(ekf, b) ? (uint32_t)count : 0u;
    }
    for (int32_t slot = 0; bslam_slam_learns(slam) && slot < BSLAM_LEARNER_SLOTS; slot++) {
        header.classifiers += bslam_map_owns(slam, slot) ? 1u : 0u;
    }
    move_header(codec, &header);
    for (int b = 0; b < ekf->beacon_count; b++) {
        if (bslam_map_saves(ekf, b)) {
            stored_beacon_t record = {.beacon = ekf->beacons[b], .classifier = BSLAM_MAP_NO_CLASSIFIER};
            record.scale = scale_of(ekf, &ekf->beacons[b]);
            record.column = (uint32_t)column_of(ekf, b);
            if (bslam_slam_learns(slam)) {
                const bslam_beacon_appearance_t *known = &slam->appearance->of[b];
                record.classifier = bslam_map_classifier_number(slam, known->classifier);
                memcpy(record.seen_as, known->seen_as, sizeof record.seen_as);
            }
            bslam_ekf_beacon_position(ekf, b, &record.x_m, &record.y_m);
            move_record(codec, &record);
        }
    }
    write_values(codec, ekf, &header, &columns);
    for (int32_t slot = 0; bslam_slam_learns(slam) && slot < BSLAM_LEARNER_SLOTS; slot++) {
        if (bslam_map_owns(slam, slot)) {
            bslam_map_write_classifier(codec, slam, slot);
        }
    }
    (void)bslam_codec_whole(codec, ~codec->crc, CRC_BYTES);
}

uint32_t bslam_map_size(const bslam_slam_t *slam)
{
    bslam_codec_t codec = {.crc = BSLAM_CRC32_START};
    write_all(&codec, slam, 0);
    return codec.at;
}

bslam_status_t bslam_map_write(const bslam_slam_t *slam, const bslam_map_sink_t *sink,
                               bslam_map_fault_t *fault)
{
    bslam_codec_t codec = {.sink = sink, .crc = BSLAM_CRC32_START};
    write_all(&codec, slam, bslam_map_size(slam));
    *fault = codec.fault;
    return codec.fault == BSLAM_MAP_FINE ? BSLAM_OK : BSLAM_E_MAP;
}

/// All of a blob whose CRC was `crc` when its frame was checked. Flash that is worn, or a line, may read
/// otherwise now: nothing of this reading is to be believed before its own CRC is the same.
static void read_all(bslam_codec_t *codec, uint32_t crc, const target_t *target)
{
    header_t header = {0};
    columns_t columns = {{0}};
    move_header(codec, &header);
    read_beacons(codec, &header, target, &columns);
    if (codec->fault != BSLAM_MAP_FINE) {
        return;  // counts are not to be believed
    }
    read_values(codec, &header, target, &columns);
    const bool learns = target != NULL && bslam_slam_learns(target->slam);
    bslam_map_read_classifiers(codec, header.classifiers, learns ? &target->slam->appearance->learner : NULL);
    bslam_codec_require(codec, codec->at + CRC_BYTES == header.length, BSLAM_MAP_CONTENT);
    bslam_codec_require(codec, ~codec->crc == crc, BSLAM_MAP_UNREADABLE);
    if (target != NULL && codec->fault == BSLAM_MAP_FINE) {
        uint32_t *next_uid = &target->slam->ekf.next_uid;
        *next_uid = header.next_uid > *next_uid ? header.next_uid : *next_uid;
    }
}

/// The frame of a blob: it begins as a map, is as long as it says, and its CRC, *crc, is right. All else is
/// looked at only then, so that damage is called damage.
static bslam_map_fault_t check_frame(const bslam_map_source_t *source, uint32_t *crc)
{
    bslam_codec_t codec = {.source = source, .crc = BSLAM_CRC32_START};
    header_t header = {0};
    if (source->size < HEADER_BYTES + CRC_BYTES) {
        return BSLAM_MAP_TRUNCATED;
    }
    move_header(&codec, &header);
    const bool is_map = codec.fault == BSLAM_MAP_FINE || codec.fault >= BSLAM_MAP_BEACONS;
    if (!is_map || codec.fault == BSLAM_MAP_UNREADABLE) {
        return codec.fault;
    }
    if (header.length != source->size) {
        return source->size < header.length ? BSLAM_MAP_TRUNCATED : BSLAM_MAP_TOO_LONG;
    }
    codec = (bslam_codec_t){.source = source, .crc = BSLAM_CRC32_START};
    while (codec.at < header.length - CRC_BYTES && codec.fault == BSLAM_MAP_FINE) {
        uint8_t bytes[32];
        const uint32_t left = header.length - CRC_BYTES - codec.at;
        bslam_codec_bytes(&codec, bytes, left < sizeof bytes ? left : sizeof bytes);
    }
    *crc = ~codec.crc;
    bslam_codec_require(&codec, bslam_codec_whole(&codec, 0, CRC_BYTES) == *crc, BSLAM_MAP_BAD_CRC);
    return codec.fault;
}

static bslam_map_fault_t check(const bslam_map_source_t *source, uint32_t *crc)
{
    const bslam_map_fault_t fault = check_frame(source, crc);
    if (fault != BSLAM_MAP_FINE) {
        return fault;
    }
    bslam_codec_t codec = {.source = source, .crc = BSLAM_CRC32_START};
    read_all(&codec, *crc, NULL);
    return codec.fault;
}

bslam_map_fault_t bslam_map_check(const bslam_map_source_t *source)
{
    uint32_t crc;
    return check(source, &crc);
}

bslam_status_t bslam_map_load(bslam_slam_t *slam, const bslam_map_source_t *source, bslam_map_mode_t mode,
                              bslam_map_fault_t *fault)
{
    uint32_t crc;
    *fault = check(source, &crc);
    if (*fault != BSLAM_MAP_FINE) {
        return BSLAM_E_MAP;
    }
    bslam_slam_forget_map(slam);
    slam->is_frozen = mode == BSLAM_MAP_FROZEN;
    const target_t target = {slam, mode};
    bslam_codec_t codec = {.source = source, .crc = BSLAM_CRC32_START};
    read_all(&codec, crc, &target);
    *fault = codec.fault;
    if (*fault != BSLAM_MAP_FINE) {
        bslam_slam_forget_map(slam);
    }
    bslam_slam_lose_pose(slam);
    return *fault == BSLAM_MAP_FINE ? BSLAM_OK : BSLAM_E_MAP;
}
