#include "bslam/association/looks.h"

#include "bslam/math/logarithm.h"

#include <string.h>

static const bslam_look_t BLANK = {.machine = BSLAM_NO_MACHINE, .twin = BSLAM_NO_MACHINE};
static const uint32_t MICROMETRES_PER_M = 1000000;

const bslam_looks_answers_t bslam_looks_answers = {bslam_looks_ask, bslam_looks_class_odds,
                                                   bslam_looks_side_odds, bslam_looks_has_waited};

enum { SEEN_AS_MAX = 32 };
enum { SECTORS = BSLAM_LOOKS_SECTORS };
// Turned by one sector a beacon looks and stands as before; by four, a right angle, a wall's is out of sight.
enum { NEAR_SECTORS = 1, FAR_SECTORS = 4 };
// A beacon that was seen from one sector alone was seen in passing: whoever stands beside it was not noticed.
enum { KNOWN_SECTORS = 2 };

bslam_status_t bslam_looks_init(bslam_looks_t *looks, const bslam_sample_t *seeds, int32_t seed_count)
{
    const bslam_status_t status = bslam_learner_init(&looks->learner, seeds, seed_count);
    if (status == BSLAM_OK) {
        looks->counters = (bslam_looks_counters_t){0};
        looks->left_rad = 0;
        looks->right_rad = 0;
        for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
            looks->of[b] = BLANK;
        }
    }
    return status;
}

/// True if a beacon other than `index` has this machine.
static bool has_other_owner(const bslam_looks_t *looks, int index, int count, int16_t machine)
{
    for (int b = 0; b < count; b++) {
        if (b != index && looks->of[b].machine == machine) {
            return true;
        }
    }
    return false;
}

/// Takes a beacon's machine away, and out of the learner if no other beacon has it.
static void release(bslam_looks_t *looks, int index, int count)
{
    const int16_t machine = looks->of[index].machine;
    if (machine == BSLAM_NO_MACHINE) {
        return;
    }
    looks->of[index].machine = BSLAM_NO_MACHINE;
    if (!has_other_owner(looks, index, count, machine) &&
        bslam_learner_remove(&looks->learner, machine) == BSLAM_OK) {
        for (int b = 0; b < count; b++) {
            if (looks->of[b].twin == machine) {
                looks->of[b].twin = BSLAM_NO_MACHINE;
                looks->of[b].twin_count = 0;
            }
        }
    }
}

void bslam_looks_clear(bslam_looks_t *looks)
{
    for (int b = 0; b < BSLAM_BEACONS_MAX; b++) {
        release(looks, b, BSLAM_BEACONS_MAX);
        looks->of[b] = BLANK;
    }
}

void bslam_looks_forget(bslam_looks_t *looks, int index, int count)
{
    release(looks, index, count);
    for (int b = index; b < count - 1; b++) {
        looks->of[b] = looks->of[b + 1];
    }
    looks->of[count - 1] = BLANK;
}

// ---- opinions ---------------------------------------------------------------------------------------------

static bslam_opinion_t opinion_of(const bslam_looks_t *looks, const bslam_params_t *params, int32_t machine,
                                  const bslam_sample_t *sample)
{
    bslam_opinion_t opinion = {0.0f, 0.0f};
    if (machine != BSLAM_NO_MACHINE && bslam_learner_knows(&looks->learner, machine)) {
        const float samples = (float)bslam_learner_samples(&looks->learner, machine);
        opinion.value = bslam_sample_decide(&looks->learner.machines[machine].weights, sample);
        opinion.weight = samples / (samples + (float)params->looks_samples);
    }
    return opinion;
}

bslam_opinion_t bslam_looks_ask(const bslam_looks_t *looks, const bslam_params_t *params, int index,
                                const bslam_sample_t *sample)
{
    const int16_t machine = looks->of[index].machine;
    return opinion_of(looks, params, machine, sample);
}

// ---- classes ----------------------------------------------------------------------------------------------

static bool is_evidence(uint8_t beacon_class)
{
    return beacon_class >= 1 && beacon_class <= BSLAM_LOOKS_CLASSES;
}

bslam_real_t bslam_looks_class_odds(const bslam_looks_t *looks, const bslam_params_t *params, int index,
                                    uint8_t beacon_class)
{
    if (!is_evidence(beacon_class)) {
        return 0;
    }
    const uint8_t *seen_as = looks->of[index].seen_as;
    int all = 0;
    for (int k = 0; k < BSLAM_LOOKS_CLASSES; k++) {
        all += seen_as[k];
    }
    const bslam_real_t doubt = params->class_doubt;
    const bslam_real_t as_this = (bslam_real_t)seen_as[beacon_class - 1] + doubt;
    return bslam_ln(BSLAM_LOOKS_CLASSES * as_this / ((bslam_real_t)all + BSLAM_LOOKS_CLASSES * doubt));
}

uint8_t bslam_looks_class(const bslam_looks_t *looks, int index)
{
    const uint8_t *seen_as = looks->of[index].seen_as;
    int most = 0;
    for (int k = 1; k < BSLAM_LOOKS_CLASSES; k++) {
        most = seen_as[k] > seen_as[most] ? k : most;
    }
    return seen_as[most] > 0 ? (uint8_t)(most + 1) : BSLAM_CLASS_NONE;
}

/// Counts; what was long ago counts less.
static void note_class(bslam_look_t *look, uint8_t beacon_class)
{
    if (!is_evidence(beacon_class)) {
        return;
    }
    if (look->seen_as[beacon_class - 1] == SEEN_AS_MAX) {
        for (int k = 0; k < BSLAM_LOOKS_CLASSES; k++) {
            look->seen_as[k] /= 2;
        }
    }
    look->seen_as[beacon_class - 1]++;
}

// ---- sides ------------------------------------------------------------------------------------------------

/// How many sectors lie from one to the other, the shorter way round.
static int sectors_between(int one, int other)
{
    const int apart = one > other ? one - other : other - one;
    return apart < SECTORS - apart ? apart : SECTORS - apart;
}

bslam_real_t bslam_looks_side_odds(const bslam_looks_t *looks, const bslam_params_t *params, int index,
                                   int sector)
{
    int known = 0, nearest = SECTORS;
    for (int k = 0; k < SECTORS; k++) {
        if (looks->of[index].seen_from[k] > 0) {
            const int apart = sectors_between(k, sector);
            known++;
            nearest = apart < nearest ? apart : nearest;
        }
    }
    if (known == 0 || (nearest > 0 && nearest <= NEAR_SECTORS)) {
        return 0;
    }
    if (nearest == 0) {
        return known >= KNOWN_SECTORS ? params->side_high : 0;
    }
    const int far = nearest < FAR_SECTORS ? nearest : FAR_SECTORS;
    return -params->side_low * (bslam_real_t)(far - NEAR_SECTORS) / (FAR_SECTORS - NEAR_SECTORS);
}

// ---- views ------------------------------------------------------------------------------------------------

void bslam_looks_note_view(bslam_looks_t *looks, int index, bslam_real_t view_score)
{
    looks->of[index].view_score = view_score;
}

// ---- waiting ----------------------------------------------------------------------------------------------

/// How long matches with a beacon have waited; 0 if not, or if none did within the last wait_us.
static uint32_t waited_us(const bslam_look_t *look, const bslam_params_t *params, int64_t time_us)
{
    const uint32_t pause_us = (uint32_t)time_us - look->waits_us;
    return look->waited_us == 0 || pause_us > (uint32_t)params->wait_us ? 0 : look->waited_us + pause_us;
}

void bslam_looks_note_wait(bslam_looks_t *looks, const bslam_params_t *params, int index, int64_t time_us)
{
    bslam_look_t *look = &looks->of[index];
    const uint32_t so_far_us = waited_us(look, params, time_us);
    look->waited_us = so_far_us > 0 ? so_far_us : 1;  // 0 says that none waits
    look->waits_us = (uint32_t)time_us;
}

bool bslam_looks_has_waited(const bslam_looks_t *looks, const bslam_params_t *params, int index,
                            int64_t time_us)
{
    return waited_us(&looks->of[index], params, time_us) >= (uint32_t)params->wait_us;
}

// ---- learning ---------------------------------------------------------------------------------------------

/// Another machine than `own` that takes a sample for its own, the surest; BSLAM_NO_MACHINE if none does.
static int16_t find_twin(const bslam_looks_t *looks, const bslam_params_t *params, int16_t own,
                         const bslam_sample_t *sample, float at_least)
{
    int16_t best = BSLAM_NO_MACHINE;
    for (int16_t m = 0; m < BSLAM_LEARNER_SLOTS; m++) {
        if (m == own) {
            continue;
        }
        const bslam_opinion_t opinion = opinion_of(looks, params, m, sample);
        if (opinion.weight >= 0.5f && opinion.value > at_least) {
            best = m;
            at_least = opinion.value;
        }
    }
    return best;
}

/// Counts up to a limit while something holds, and down to 0 while it does not. True at the limit.
static bool persists(uint8_t *count, bool holds, int32_t limit)
{
    if (holds) {
        *count = (uint8_t)(*count + (*count < limit ? 1 : 0));
    } else {
        *count = (uint8_t)(*count - (*count > 0 ? 1 : 0));
    }
    return *count >= limit;
}

/// Whether another machine takes this beacon for its own again and again, as surely as the beacon's machine
/// does: then they look alike, and two machines would be trained to contradict each other.
static bool has_twin(const bslam_looks_t *looks, const bslam_params_t *params, bslam_look_t *look,
                     const bslam_sample_t *sample)
{
    const bslam_opinion_t own = opinion_of(looks, params, look->machine, sample);
    const float least = (float)params->share_value;
    const float at_least = own.weight > 0.0f && own.value > least ? own.value : least;
    const int16_t twin = find_twin(looks, params, look->machine, sample, at_least);
    if (twin != BSLAM_NO_MACHINE && twin != look->twin && look->twin_count == 0) {
        look->twin = twin;
    }
    const bool again = twin != BSLAM_NO_MACHINE && twin == look->twin;
    return persists(&look->twin_count, again, params->share_sightings);
}

/// A machine of its own for a beacon, if there is one left.
static void give_machine(bslam_looks_t *looks, bslam_look_t *look)
{
    int32_t machine;
    if (bslam_learner_add(&looks->learner, &machine) == BSLAM_OK) {
        look->machine = (int16_t)machine;
    } else {
        looks->counters.no_slot++;
    }
}

/// Decides which machine a beacon has; false while that is open, when nothing is to be learned.
static bool settle_machine(bslam_looks_t *looks, const bslam_params_t *params, int index, int count,
                           const bslam_sample_t *sample)
{
    bslam_look_t *look = &looks->of[index];
    const bool is_shared =
        look->machine != BSLAM_NO_MACHINE && has_other_owner(looks, index, count, look->machine);
    if (is_shared) {
        const bslam_opinion_t own = opinion_of(looks, params, look->machine, sample);
        const bool refused = own.weight > 0.0f && own.value < 0.0f;
        if (persists(&look->disowned, refused, params->share_sightings)) {
            look->disowned = 0;
            release(looks, index, count);
            give_machine(looks, look);
            looks->counters.parted++;
        }
        return look->machine != BSLAM_NO_MACHINE;
    }
    if (has_twin(looks, params, look, sample)) {
        const int16_t twin = look->twin;
        look->twin = BSLAM_NO_MACHINE;
        look->twin_count = 0;
        release(looks, index, count);
        look->machine = twin;
        looks->counters.shared++;
    } else if (look->machine == BSLAM_NO_MACHINE && look->twin_count == 0) {
        give_machine(looks, look);
    }
    return look->machine != BSLAM_NO_MACHINE;
}

void bslam_looks_teach(bslam_looks_t *looks, const bslam_params_t *params, int index, int count,
                       uint32_t way_um, const bslam_sighting_t *sighting)
{
    bslam_look_t *look = &looks->of[index];
    const uint32_t least_um = (uint32_t)(params->learn_way_m * (bslam_real_t)MICROMETRES_PER_M);
    bslam_sample_t sample;
    if (look->is_taught && way_um - look->taught_um < least_um) {
        return;
    }
    look->is_taught = true;
    look->taught_um = way_um;
    note_class(look, sighting->beacon_class);
    if (sighting->signature != NULL && bslam_sample_encode(sighting->signature, &sample) == BSLAM_OK &&
        settle_machine(looks, params, index, count, &sample) &&
        bslam_learner_show(&looks->learner, look->machine, sighting->signature) == BSLAM_OK) {
        looks->counters.taught++;
    }
}
