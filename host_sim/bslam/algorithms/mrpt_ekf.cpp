// MRPT's range-bearing EKF-SLAM in the plane, as mrpt.py feeds it: numbers on standard input, answers on
// standard output, one line each.
//
//   first line   bearing_sd_rad mount_x_m mount_y_m mount_yaw_rad
//   s            a step: moved (0 or 1), x y theta of the move in the frame of its start, its covariance (xx
//                xy xt yy yt tt), sd of a distance, how many sightings, of each label (-1: none) bearing
//                range answer: x y theta of the pose and its covariance, nine numbers
//   m            the map; answer: how many landmarks, of each label (-1: none) x y
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservationBearingRange.h>
#include <mrpt/poses/CPosePDFGaussian.h>
#include <mrpt/slam/CRangeBearingKFSLAM2D.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <vector>

namespace
{
using mrpt::obs::CActionCollection;
using mrpt::obs::CActionRobotMovement2D;
using mrpt::obs::CObservationBearingRange;
using mrpt::obs::CSensoryFrame;

mrpt::slam::CRangeBearingKFSLAM2D filter;
mrpt::poses::CPose3D mount;

double number()
{
    double value = 0;
    if (std::scanf("%lf", &value) != 1) {
        (void)std::fprintf(stderr, "mrpt_ekf: a line is cut short\n");
        std::exit(1);
    }
    return value;
}

CActionCollection::Ptr read_action()
{
    auto action = CActionCollection::Create();
    const bool moved = number() != 0;
    auto move = std::make_shared<mrpt::poses::CPosePDFGaussian>();
    for (std::size_t i = 0; i < 3; i++) {
        move->mean[i] = number();
    }
    for (int row = 0; row < 3; row++) {
        for (int column = row; column < 3; column++) {
            move->cov(row, column) = move->cov(column, row) = number();
        }
    }
    if (moved) {
        CActionRobotMovement2D movement;
        movement.poseChange = move;
        movement.estimationMethod = CActionRobotMovement2D::emOdometry;
        action->insert(movement);
    }
    return action;
}

CSensoryFrame::Ptr read_frame()
{
    filter.options.std_sensor_range = static_cast<float>(number());
    auto seen = CObservationBearingRange::Create();
    seen->minSensorDistance = 0;
    seen->maxSensorDistance = 1000;
    seen->sensorLocationOnRobot = mount;
    const int count = static_cast<int>(number());
    for (int i = 0; i < count; i++) {
        CObservationBearingRange::TMeasurement one;
        const int label = static_cast<int>(number());
        one.landmarkID = label < 0 ? mrpt::obs::INVALID_LANDMARK_ID : label;
        one.yaw = static_cast<float>(number());
        one.range = static_cast<float>(number());
        one.pitch = 0;
        seen->sensedData.push_back(one);
    }
    auto frame = CSensoryFrame::Create();
    frame->insert(seen);
    return frame;
}

void step()
{
    auto action = read_action();
    auto frame = read_frame();
    filter.processActionObservation(action, frame);
    mrpt::poses::CPosePDFGaussian here;
    filter.getCurrentRobotPose(here);
    std::printf("%.17g %.17g %.17g", here.mean.x(), here.mean.y(), here.mean.phi());
    for (int i = 0; i < 9; i++) {
        std::printf(" %.17g", here.cov(i / 3, i % 3));
    }
    std::printf("\n");
}

void tell_map()
{
    mrpt::poses::CPosePDFGaussian pose;
    std::vector<mrpt::math::TPoint2D> places;
    std::map<unsigned int, mrpt::maps::CLandmark::TLandmarkID> labels;
    mrpt::math::CVectorDouble state;
    mrpt::math::CMatrixDouble covariance;
    filter.getCurrentState(pose, places, labels, state, covariance);
    std::printf("%zu", places.size());
    for (unsigned int i = 0; i < places.size(); i++) {
        const auto label = labels.find(i);
        std::printf(" %d %.17g %.17g", label == labels.end() ? -1 : static_cast<int>(label->second),
                    places[i].x, places[i].y);
    }
    std::printf("\n");
}
}  // namespace

int main()
{
    filter.setMinLoggingLevel(mrpt::system::LVL_ERROR);
    filter.KF_options.method = mrpt::bayes::kfEKFAlaDavison;
    filter.options.std_sensor_yaw = static_cast<float>(number());
    const double x_m = number(), y_m = number();
    mount = mrpt::poses::CPose3D(x_m, y_m, 0, number(), 0, 0);
    char word = 0;
    while (std::scanf(" %c", &word) == 1) {
        word == 's' ? step() : tell_map();
        (void)std::fflush(stdout);
    }
    return 0;
}
