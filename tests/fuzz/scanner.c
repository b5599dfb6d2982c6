// A scanner's model with anything in it changed: counts, sides, tables left out, numbers. What the check
// refuses is refused by the front end with the same status; what it takes gives finite candidates of a
// picture.
#include <string.h>

#include "vision/internal.h"

#include "picture.h"

enum {
    CHANGES_MAX = 12,
    KINDS = 2,
    WINDOWS = 3,
    SIDE = 6,  // cells
    BLOCKS = BSLAM_WINDOW_SIDE_MAX / 2,
    WEIGHTS = BSLAM_WINDOW_SIDE_MAX * BSLAM_WINDOW_SIDE_MAX * BSLAM_CHANNELS
};

/// A model in memory that may be written to. Its tables are as long as those of the largest window: how long
/// a table is, a model does not say.
static struct {
    bslam_scanner_model_t model;
    bslam_scan_kind_t kinds[KINDS];
    bslam_window_t windows[WINDOWS];
    int8_t weights[WEIGHTS];
    int8_t coarse[BSLAM_COARSE_BYTES(BSLAM_WINDOW_SIDE_MAX, BSLAM_WINDOW_SIDE_MAX)];
    int8_t edges[BSLAM_EDGE_BYTES(BSLAM_WINDOW_SIDE_MAX, BSLAM_WINDOW_SIDE_MAX)];
    uint8_t order[BLOCKS];
    int32_t floors[BLOCKS];
    float edge_scale[4], edge_bias[4];
} made;

static void make_model(fuzz_input_t *input)
{
    memset(&made, 0, sizeof made);
    made.model = (bslam_scanner_model_t){
        .kind_count = KINDS, .kinds = made.kinds, .window_count = WINDOWS, .windows = made.windows};
    for (int32_t i = 0; i < KINDS; i++) {
        made.kinds[i] = (bslam_scan_kind_t){.name = "thing",
                                            .height_m = 0.5f,
                                            .width_m = 0.3f,
                                            .threshold = -1,
                                            .slope = 2,
                                            .middle_sd = 0.05f,
                                            .height_sd = 0.05f};
    }
    for (int32_t i = 0; i < WINDOWS; i++) {
        made.windows[i] = (bslam_window_t){.kind = (uint8_t)(i % KINDS),
                                           .columns = SIDE,
                                           .rows = (uint8_t)(SIDE - 2 * (i % 2)),
                                           .box_columns = SIDE - 2,
                                           .box_rows = 2,
                                           .weights = made.weights,
                                           .scale = 1e-3f,
                                           .coarse = made.coarse,
                                           .order = made.order,
                                           .floors = made.floors,
                                           .edges = made.edges,
                                           .edge_scale = made.edge_scale,
                                           .edge_bias = made.edge_bias};
    }
    const uint8_t step = fuzz_u8(input);
    for (int32_t i = 0; i < WEIGHTS; i++) {
        made.weights[i] = (int8_t)(i * step % 61 - 20);
        made.coarse[i % (int32_t)sizeof made.coarse] = made.weights[i];
        made.edges[i % (int32_t)sizeof made.edges] = made.weights[i];
    }
    for (int32_t i = 0; i < BLOCKS; i++) {
        made.order[i] = (uint8_t)i;
        made.floors[i] = -(1 << 24);
    }
    for (int32_t i = 0; i < 4; i++) {
        made.edge_scale[i] = 1e-5f;
    }
}

// ---- changes ----------------------------------------------------------------------------------------------

static void change_kind(fuzz_input_t *input, bslam_scan_kind_t *kind)
{
    float *const values[] = {&kind->height_m, &kind->width_m,   &kind->threshold, &kind->slope,
                             &kind->offset,   &kind->middle_sd, &kind->height_sd};
    const uint8_t which = fuzz_u8(input) % 8;
    if (which == 7) {
        kind->name = NULL;
    } else {
        *values[which] = (float)fuzz_real(input, -1, 11);
    }
}

static void leave_out(fuzz_input_t *input, bslam_window_t *window)
{
    const void **const tables[] = {(const void **)&window->weights,  (const void **)&window->coarse,
                                   (const void **)&window->order,    (const void **)&window->floors,
                                   (const void **)&window->edges,    (const void **)&window->edge_scale,
                                   (const void **)&window->edge_bias};
    *tables[fuzz_u8(input) % 7] = NULL;
}

static void change_window(fuzz_input_t *input, bslam_window_t *window)
{
    switch (fuzz_u8(input) % 9) {
    case 0:
        window->kind = fuzz_u8(input);
        break;
    case 1:
        window->columns = fuzz_u8(input);
        break;
    case 2:
        window->rows = fuzz_u8(input);
        break;
    case 3:
        window->box_columns = (float)fuzz_real(input, 0, 20);
        break;
    case 4:
        window->box_rows = (float)fuzz_real(input, 0, 20);
        break;
    case 5:
        window->scale = (float)fuzz_real(input, 0, 1);
        break;
    case 6:
        window->bias = (int32_t)fuzz_u32(input);
        break;
    case 7:
        window->coarse_bias = (int32_t)fuzz_u32(input);
        break;
    default:
        leave_out(input, window);
        break;
    }
}

static void change(fuzz_input_t *input)
{
    switch (fuzz_u8(input) % 9) {
    case 0:
        made.model.kind_count = (int32_t)(fuzz_u8(input) % (KINDS + 1));
        break;
    case 1:
        made.model.window_count = (int32_t)(fuzz_u8(input) % (WINDOWS + 1));
        break;
    case 2:
        change_kind(input, &made.kinds[fuzz_u8(input) % KINDS]);
        break;
    case 3:
        made.order[fuzz_u8(input) % BLOCKS] = fuzz_u8(input);
        break;
    case 4:
        made.floors[fuzz_u8(input) % BLOCKS] = (int32_t)fuzz_u32(input);
        break;
    case 5:
        made.edge_scale[fuzz_u8(input) % 4] = (float)fuzz_real(input, -1, 1);
        break;
    case 6:
        made.edge_bias[fuzz_u8(input) % 4] = (float)fuzz_real(input, -1, 1);
        break;
    case 7:
        made.weights[fuzz_u16(input) % WEIGHTS] = (int8_t)fuzz_u8(input);
        break;
    default:
        change_window(input, &made.windows[fuzz_u8(input) % WINDOWS]);
        break;
    }
}

// ---- what must hold ---------------------------------------------------------------------------------------

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static bslam_vision_t vision;
    fuzz_input_t input = {data, size};
    make_model(&input);
    for (int changes = 0; changes < CHANGES_MAX && input.left > 0; changes++) {
        change(&input);
    }
    const bslam_camera_t camera = fuzz_camera(BSLAM_LENS_PINHOLE);
    const bslam_status_t status = bslam_scanner_model_check(&made.model);
    memset(&vision, 0, sizeof vision);
    fuzz_require(bslam_vision_init_scanner(&vision, &made.model, &camera, 1) == status);
    if (status == BSLAM_OK) {
        fuzz_look_at_room(&vision);
    }
    return 0;
}
