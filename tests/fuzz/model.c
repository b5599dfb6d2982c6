// A trained model with anything in it changed: counts, sizes, tables left out, numbers. What the check
// refuses is refused by the front end with the same status; what it takes gives finite candidates of a
// picture.
#include <string.h>

#include "vision/internal.h"

#include "models/beacons.h"
#include "picture.h"

enum {
    CHANGES_MAX = 12,
    KNOTS = BSLAM_BLOB_FEATURES * BSLAM_KNOTS,
    ROWS = BSLAM_CLASSES_MAX + 2,
    FUSED = BSLAM_CLASSES_MAX + 4  // of the verdict; the fusion has one less
};

/// A model in memory that may be written to. Tables are as long as the counts of any model that the check
/// takes may ask for: how long a table is, a model does not say.
static struct {
    bslam_beacon_model_t model;
    bslam_beacon_class_t classes[BSLAM_CLASSES_MAX];
    float cell_weights[BSLAM_CELL_FEATURES];
    float cell_bias[1];
    float offset[BSLAM_BLOB_FEATURES];
    float scale[BSLAM_BLOB_FEATURES];
    float knots[KNOTS];
    float byte_scale[ROWS];
    float bias[ROWS];
    uint8_t crossed[BSLAM_CROSSED_MAX];
    uint8_t close_knots[BSLAM_CLOSE_FEATURES];
    float close_scale[ROWS];
    float close_bias[ROWS];
} made, whole;
static int8_t kinds_bytes[BSLAM_ADDITIVE_BYTES(ROWS, BSLAM_BLOB_FEATURES, BSLAM_CROSSED_MAX)];
static float fusion_weights[BSLAM_SVM_WEIGHTS(FUSED, true)];
static int8_t close_bytes[BSLAM_HINGED_BYTES(ROWS, BSLAM_CLOSE_FEATURES)];
static float verdict_weights[BSLAM_SVM_WEIGHTS(FUSED, true)];

static void prepare(void)
{
    const bslam_detector_model_t *from = &bslam_beacons_model.pinhole;
    const size_t rows = (size_t)from->kinds.rows;
    whole.model = bslam_beacons_model;
    memcpy(whole.classes, bslam_beacons_model.classes,
           (size_t)bslam_beacons_model.class_count * sizeof whole.classes[0]);
    memcpy(whole.cell_weights, from->cell.weights, sizeof whole.cell_weights);
    memcpy(whole.cell_bias, from->cell.bias, sizeof whole.cell_bias);
    memcpy(whole.offset, from->blob_offset, sizeof whole.offset);
    memcpy(whole.scale, from->blob_scale, sizeof whole.scale);
    memcpy(whole.knots, from->kinds.knots, sizeof whole.knots);
    memcpy(whole.byte_scale, from->kinds.byte_scale, rows * sizeof whole.byte_scale[0]);
    memcpy(whole.bias, from->kinds.bias, rows * sizeof whole.bias[0]);
    memcpy(whole.crossed, from->kinds.crossed, (size_t)from->kinds.crossed_count);
    memcpy(kinds_bytes, from->kinds.bytes,
           (size_t)BSLAM_ADDITIVE_BYTES(from->kinds.rows, BSLAM_BLOB_FEATURES, from->kinds.crossed_count));
    memcpy(fusion_weights, from->fusion.weights,
           (size_t)BSLAM_SVM_WEIGHTS(from->fusion.features, from->fusion.quadratic) *
               sizeof fusion_weights[0]);
    memcpy(verdict_weights, from->verdict.weights,
           (size_t)BSLAM_SVM_WEIGHTS(from->verdict.features, from->verdict.quadratic) *
               sizeof verdict_weights[0]);
    memcpy(close_bytes, from->close.bytes,
           (size_t)BSLAM_HINGED_BYTES(from->close.rows, BSLAM_CLOSE_FEATURES));
    memcpy(whole.close_knots, from->close.knots, sizeof whole.close_knots);
    memcpy(whole.close_scale, from->close.byte_scale, rows * sizeof whole.close_scale[0]);
    memcpy(whole.close_bias, from->close.bias, rows * sizeof whole.close_bias[0]);
    bslam_detector_model_t *detector = &whole.model.pinhole;
    whole.model.classes = made.classes;
    detector->cell.weights = made.cell_weights;
    detector->cell.bias = made.cell_bias;
    detector->blob_offset = made.offset;
    detector->blob_scale = made.scale;
    detector->kinds.knots = made.knots;
    detector->kinds.byte_scale = made.byte_scale;
    detector->kinds.bias = made.bias;
    detector->kinds.crossed = made.crossed;
    detector->kinds.bytes = kinds_bytes;
    detector->fusion.weights = fusion_weights;
    detector->close.bytes = close_bytes;
    detector->close.knots = made.close_knots;
    detector->close.byte_scale = made.close_scale;
    detector->close.bias = made.close_bias;
    detector->verdict.weights = verdict_weights;
}

// ---- changes ----------------------------------------------------------------------------------------------

static float fuzz_float(fuzz_input_t *input)
{
    return (float)fuzz_real(input, -100, 100);
}

static void change_class(fuzz_input_t *input, bslam_beacon_class_t *of)
{
    float *const values[] = {&of->height_m,   &of->depth_m,  &of->top_low_m,
                             &of->top_high_m, &of->looks_sd, &of->width_m};
    *values[fuzz_u8(input) % 6] = (float)fuzz_real(input, -1, 11);
}

static void change_svm(fuzz_input_t *input, bslam_svm_t *svm)
{
    switch (fuzz_u8(input) % 6) {
    case 0:
        svm->rows = (int32_t)fuzz_u8(input) - 1;
        break;
    case 1:
        svm->features = (int32_t)fuzz_u8(input);
        break;
    case 2:
        svm->quadratic = !svm->quadratic;
        break;
    case 3:
        svm->weights = NULL;
        break;
    case 4:
        svm->bias = NULL;
        break;
    default:
        svm->bytes = kinds_bytes;
        break;
    }
}

static void change_additive(fuzz_input_t *input, bslam_additive_t *classifier)
{
    switch (fuzz_u8(input) % 9) {
    case 0:
        classifier->rows = (int32_t)fuzz_u8(input) - 1;
        break;
    case 1:
        classifier->features = (int32_t)fuzz_u8(input);
        break;
    case 2:
        classifier->crossed_count = (int32_t)fuzz_u8(input) - 1;
        break;
    case 3:
        classifier->knots = NULL;
        break;
    case 4:
        classifier->bytes = NULL;
        break;
    case 5:
        classifier->byte_scale = NULL;
        break;
    case 6:
        classifier->bias = NULL;
        break;
    case 7:
        classifier->crossed = NULL;
        break;
    default:
        made.crossed[fuzz_u8(input) % BSLAM_CROSSED_MAX] = fuzz_u8(input);
        break;
    }
}

static void change_hinged(fuzz_input_t *input, bslam_hinged_t *classifier)
{
    switch (fuzz_u8(input) % 7) {
    case 0:
        classifier->rows = (int32_t)fuzz_u8(input) - 1;
        break;
    case 1:
        classifier->features = (int32_t)fuzz_u16(input);
        break;
    case 2:
        classifier->knots = NULL;
        break;
    case 3:
        classifier->bytes = NULL;
        break;
    case 4:
        classifier->byte_scale = NULL;
        break;
    case 5:
        classifier->bias = NULL;
        break;
    default:
        made.close_knots[fuzz_u16(input) % BSLAM_CLOSE_FEATURES] = fuzz_u8(input);
        break;
    }
}

static void change_table(fuzz_input_t *input)
{
    const struct {
        float *values;
        unsigned count;
    } tables[] = {
        {made.cell_weights, BSLAM_CELL_FEATURES},
        {made.cell_bias, 1},
        {made.offset, BSLAM_BLOB_FEATURES},
        {made.scale, BSLAM_BLOB_FEATURES},
        {made.knots, KNOTS},
        {made.byte_scale, (unsigned)bslam_beacons_model.class_count + 2},
        {&made.model.pinhole.screen_threshold, 1},
        {&made.model.pinhole.any_threshold, 1},
        {&made.model.pinhole.threshold, 1},
        {&made.model.pinhole.glance_threshold, 1},
        {&made.model.pinhole.fusion_threshold, 1},
        {made.close_scale, (unsigned)bslam_beacons_model.class_count + 2},
        {made.close_bias, (unsigned)bslam_beacons_model.class_count + 2},
    };
    const unsigned which = fuzz_u8(input) % (sizeof tables / sizeof tables[0]);
    const unsigned at = fuzz_u16(input) % tables[which].count;
    tables[which].values[at] = fuzz_float(input);
}

static void change(fuzz_input_t *input)
{
    bslam_detector_model_t *detector = &made.model.pinhole;
    switch (fuzz_u8(input) % 11) {
    case 0:
        made.model.class_count = (int32_t)fuzz_u8(input) - 1;
        break;
    case 1:
        change_class(input, &made.classes[fuzz_u8(input) % BSLAM_CLASSES_MAX]);
        break;
    case 2:
        change_svm(input, &detector->cell);
        break;
    case 3:
        change_svm(input, &detector->screen);
        break;
    case 4:
        change_svm(input, &detector->fusion);
        break;
    case 5:
        change_additive(input, &detector->kinds);
        break;
    case 6:
        change_svm(input, &detector->glance);
        break;
    case 7:
        change_svm(input, &detector->verdict);
        break;
    case 8:
        change_hinged(input, &detector->close);
        break;
    default:
        change_table(input);
        break;
    }
}

// ---- what must hold ---------------------------------------------------------------------------------------

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static bslam_vision_t vision;
    if (whole.model.class_count == 0) {
        prepare();
    }
    fuzz_input_t input = {data, size};
    memcpy(&made, &whole, sizeof made);
    for (int changes = 0; changes < CHANGES_MAX && input.left > 0; changes++) {
        change(&input);
    }
    const bslam_camera_t camera = fuzz_camera(BSLAM_LENS_PINHOLE);
    const bslam_status_t status = bslam_beacon_model_check(&made.model);
    bslam_front_end_t *inside = &bslam_vision_instance(&vision)->front_end;
    inside->model = NULL;
    fuzz_require(bslam_vision_init(&vision, &made.model, &camera, 1) == status);
    fuzz_require((inside->model == NULL) == (status != BSLAM_OK));
    if (status == BSLAM_OK) {
        fuzz_look_at_room(&vision);
    }
    return 0;
}
