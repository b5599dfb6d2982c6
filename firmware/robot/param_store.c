#include "robot/param_store.h"

#include <string.h>

#include "link/crc16.h"
#include "port/port.h"

int param_store_count(void)
{
    int count = 0;
    while (bslam_settings_info(count) != NULL) {
        count++;
    }
    return count;
}

bslam_real_t param_store_get(const bslam_settings_t *settings, int id)
{
    const bslam_setting_info_t *info = bslam_settings_info(id);
    if (info == NULL) {
        return 0;
    }
    const uint8_t *field = (const uint8_t *)settings + info->offset;
    bslam_real_t value;
    int32_t whole;
    if (info->is_integer) {
        memcpy(&whole, field, sizeof whole);
        return (bslam_real_t)whole;
    }
    memcpy(&value, field, sizeof value);
    return value;
}

uint16_t param_store_names_crc(void)
{
    uint16_t crc = BSLAM_CRC16_START;
    for (int id = 0; id < param_store_count(); id++) {
        const char *name = bslam_settings_info(id)->name;
        for (size_t i = 0; i <= strlen(name); i++) {
            crc = bslam_crc16_add(crc, (uint8_t)name[i]);
        }
    }
    return bslam_crc16_end(crc);
}

/// What is stored: every parameter in the order of the table, as float32, which holds all that the link can
/// set, then stored_names_crc and a CRC over all before.
#define STORED_BYTES_MAX (4 * 128 + 4)

static uint16_t crc_of(const uint8_t *bytes, size_t count)
{
    uint16_t crc = BSLAM_CRC16_START;
    for (size_t i = 0; i < count; i++) {
        crc = bslam_crc16_add(crc, bytes[i]);
    }
    return bslam_crc16_end(crc);
}

static size_t param_store_size(void)
{
    return 4 * (size_t)param_store_count() + 4;
}

bool param_store_save(const bslam_settings_t *settings)
{
    uint8_t bytes[STORED_BYTES_MAX];
    const size_t size = param_store_size();
    if (size > sizeof bytes) {
        return false;
    }
    for (int id = 0; id < param_store_count(); id++) {
        const float value = (float)param_store_get(settings, id);
        memcpy(&bytes[4 * id], &value, sizeof value);
    }
    const uint16_t names = param_store_names_crc();
    memcpy(&bytes[size - 4], &names, sizeof names);
    const uint16_t crc = crc_of(bytes, size - 2);
    memcpy(&bytes[size - 2], &crc, sizeof crc);
    return port_save(bytes, size);
}

bool param_store_load(bslam_settings_t *settings)
{
    uint8_t bytes[STORED_BYTES_MAX];
    const size_t size = param_store_size();
    uint16_t names = 0;
    uint16_t crc = 0;
    bslam_settings_preset(settings, BSLAM_PRESET_REAL_WHEELS);
    if (size > sizeof bytes || !port_load(bytes, size)) {
        return false;
    }
    memcpy(&names, &bytes[size - 4], sizeof names);
    memcpy(&crc, &bytes[size - 2], sizeof crc);
    bool good = names == param_store_names_crc() && crc == crc_of(bytes, size - 2);
    for (int id = 0; id < param_store_count() && good; id++) {
        float value;
        memcpy(&value, &bytes[4 * id], sizeof value);
        good = bslam_settings_set(settings, id, value) == BSLAM_OK;
    }
    if (!good) {
        bslam_settings_preset(settings, BSLAM_PRESET_REAL_WHEELS);
    }
    return good;
}
