#include "known_map.h"

#include "covariance.h"
#include "support.h"

static const bslam_pose_t on_axle = {0, 0, 0};

bslam_ekf_t unit_map_of(const bslam_settings_t *settings, const double (*places)[2], int count)
{
    bslam_ekf_t ekf;
    bslam_ekf_init(&ekf, settings);
    for (int i = 0; i < count; i++) {
        const bslam_sighting_t sighting = unit_polar(0, 1, -1);
        int index;
        assert_int_equal(bslam_ekf_add(&ekf, settings, &on_axle, &sighting, &index), BSLAM_OK);
        const int at = ekf.beacons[index].at;
        for (int k = 0; k < 2; k++) {
            ekf.mean[at + k] = real(places[i][k]);
            covariance_forget(&ekf, at + k, 0.01);
        }
    }
    return ekf;
}

void unit_give_machine(bslam_appearance_t *appearance, int index, double value, int samples)
{
    int32_t classifier;
    assert_int_equal(bslam_learner_add(&appearance->learner, &classifier), BSLAM_OK);
    appearance->of[index].classifier = (int16_t)classifier;
    bslam_classifier_t *made = &appearance->learner.classifiers[classifier];
    made->trained = true;
    made->negatives = 1;
    made->samples = (uint8_t)samples;
    float weights[BSLAM_SAMPLE_SIZE] = {0};
    weights[0] = (float)value * BSLAM_SAMPLE_UNIT;
    bslam_weights_round(weights, &made->weights);
}

void unit_assert_decided(const bslam_match_t *match, bslam_verdict_t verdict, bslam_reason_t reason,
                         int beacon)
{
    assert_int_equal(match->verdict, verdict);
    assert_int_equal(match->reason, reason);
    assert_int_equal(match->beacon, beacon);
}
