// MRPT's range-bearing EKF-SLAM in the plane, the class that its kf-slam program runs. Words of the command
// line: davison (one number at a time) or naive (its default), and jcbb for joint compatibility in place of
// its nearest neighbour where nobody gives identities. It knows one sd for all distances: that at the drive's
// mean distance.
#include "peer.h"

#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservationBearingRange.h>
#include <mrpt/poses/CPosePDFGaussian.h>
#include <mrpt/slam/CRangeBearingKFSLAM2D.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

namespace
{
using mrpt::obs::CActionCollection;
using mrpt::obs::CActionRobotMovement2D;
using mrpt::obs::CObservationBearingRange;
using mrpt::obs::CSensoryFrame;

std::unique_ptr<mrpt::slam::CRangeBearingKFSLAM2D> filter;
std::vector<CActionCollection::Ptr> actions;
std::vector<CSensoryFrame::Ptr> frames;

// An arc, with the covariance that the wheels' noise gives its end in the frame of its start.
CActionCollection::Ptr action_of(const bench_model_t &model, const bench_step_t &step)
{
    const double travelled_m = 0.5 * (step.left_m + step.right_m);
    const double turn_rad = (step.right_m - step.left_m) / model.wheelbase_m;
    const double course_rad = 0.5 * turn_rad;
    mrpt::poses::CPosePDFGaussian move;
    move.mean = {travelled_m * std::cos(course_rad), travelled_m * std::sin(course_rad), turn_rad};
    mrpt::math::CMatrixDouble by_wheels(3, 2);
    const double along[2] = {std::cos(course_rad), std::sin(course_rad)};
    const double across[2] = {-0.5 * travelled_m * along[1], 0.5 * travelled_m * along[0]};
    for (int wheel = 0; wheel < 2; wheel++) {
        const double turned = (wheel == 0 ? -1.0 : 1.0) / model.wheelbase_m;
        by_wheels(0, wheel) = 0.5 * along[0] + turned * across[0];
        by_wheels(1, wheel) = 0.5 * along[1] + turned * across[1];
        by_wheels(2, wheel) = turned;
    }
    const double variance_m2 = model.wheel_sd_m * model.wheel_sd_m;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            move.cov(i, j) =
                variance_m2 * (by_wheels(i, 0) * by_wheels(j, 0) + by_wheels(i, 1) * by_wheels(j, 1));
        }
    }
    CActionRobotMovement2D movement;
    movement.poseChange = std::make_shared<mrpt::poses::CPosePDFGaussian>(move);
    movement.estimationMethod = CActionRobotMovement2D::emOdometry;
    auto action = CActionCollection::Create();
    action->insert(movement);
    return action;
}

CSensoryFrame::Ptr frame_of(const bench_step_t &step)
{
    auto seen = CObservationBearingRange::Create();
    seen->minSensorDistance = 0;
    seen->maxSensorDistance = 1000;
    for (int i = 0; i < step.count; i++) {
        CObservationBearingRange::TMeasurement one;
        one.range = static_cast<float>(step.sightings[i].range_m);
        one.yaw = static_cast<float>(step.sightings[i].bearing_rad);
        one.pitch = 0;
        one.landmarkID =
            step.sightings[i].label < 0 ? mrpt::obs::INVALID_LANDMARK_ID : step.sightings[i].label;
        seen->sensedData.push_back(one);
    }
    auto frame = CSensoryFrame::Create();
    frame->insert(seen);
    return frame;
}

double mean_range_m(const bench_step_t *steps, int count)
{
    double sum_m = 0;
    int sightings = 0;
    for (int number = 0; number < count; number++) {
        for (int i = 0; i < steps[number].count; i++, sightings++) {
            sum_m += steps[number].sightings[i].range_m;
        }
    }
    return sum_m / std::max(sightings, 1);
}
}  // namespace

void peer_begin(const bench_model_t *model, const bench_step_t *steps, int count, int words, char **word)
{
    filter = std::make_unique<mrpt::slam::CRangeBearingKFSLAM2D>();
    filter->setMinLoggingLevel(mrpt::system::LVL_ERROR);
    filter->KF_options.method = mrpt::bayes::kfEKFNaive;
    for (int i = 1; i < words; i++) {
        if (std::strcmp(word[i], "davison") == 0) {
            filter->KF_options.method = mrpt::bayes::kfEKFAlaDavison;
        } else if (std::strcmp(word[i], "jcbb") == 0) {
            filter->options.data_assoc_method = mrpt::slam::assocJCBB;
        }
    }
    filter->options.std_sensor_yaw = static_cast<float>(model->bearing_sd_rad);
    filter->options.std_sensor_range =
        static_cast<float>(std::sqrt(bench_range_variance_m2(model, mean_range_m(steps, count))));
    for (int number = 0; number < count; number++) {
        actions.push_back(number == 0 ? CActionCollection::Create() : action_of(*model, steps[number]));
        frames.push_back(frame_of(steps[number]));
    }
}

void peer_step(const bench_step_t *, int number)
{
    const auto at = static_cast<std::size_t>(number);
    filter->processActionObservation(actions[at], frames[at]);
}

void peer_pose(double pose[3])
{
    mrpt::poses::CPosePDFGaussian here;
    filter->getCurrentRobotPose(here);
    for (int i = 0; i < 3; i++) {
        pose[i] = here.mean[static_cast<std::size_t>(i)];
    }
}

int peer_landmarks(void)
{
    return static_cast<int>(filter->getNumberOfLandmarksInTheMap());
}

size_t peer_static_bytes(void)
{
    return sizeof *filter;
}
