// EKF-SLAM as in a textbook (Thrun, Burgard, Fox: Probabilistic Robotics, table 10.1), on Eigen in float:
// every matrix of the whole state's size, identities given. So are most filters that are written by hand.
#include "peer.h"

#include <Eigen/Dense>
#include <cmath>
#include <vector>

namespace
{
using Matrix = Eigen::MatrixXf;
using Vector = Eigen::VectorXf;

bench_model_t model;
Vector mean;  // x, y, theta, then x, y of each landmark
Matrix covariance;
std::vector<int> place_of;  // of a label: its landmark, -1: none yet

float wrapped(float angle_rad)
{
    return std::remainder(angle_rad, 2.0F * static_cast<float>(M_PI));
}

Eigen::Matrix2f noise(float range_m)
{
    Eigen::Matrix2f q = Eigen::Matrix2f::Zero();
    q(0, 0) = static_cast<float>(bench_range_variance_m2(&model, range_m));
    q(1, 1) = static_cast<float>(model.bearing_sd_rad * model.bearing_sd_rad);
    return q;
}

void predict(float left_m, float right_m)
{
    const float travelled_m = 0.5F * (left_m + right_m);
    const float turn_rad = (right_m - left_m) / static_cast<float>(model.wheelbase_m);
    const float course_rad = mean(2) + 0.5F * turn_rad;
    Matrix g = Matrix::Identity(mean.size(), mean.size());
    g(0, 2) = -travelled_m * std::sin(course_rad);
    g(1, 2) = travelled_m * std::cos(course_rad);
    Matrix v = Matrix::Zero(mean.size(), 2);  // by the way and the turn
    v.topRows<3>() << std::cos(course_rad), -0.5F * travelled_m * std::sin(course_rad), std::sin(course_rad),
        0.5F * travelled_m * std::cos(course_rad), 0.0F, 1.0F;
    const auto wheel = static_cast<float>(model.wheel_sd_m * model.wheel_sd_m);
    Eigen::Matrix2f m = Eigen::Matrix2f::Zero();
    m(0, 0) = 0.5F * wheel;
    m(1, 1) = 2.0F * wheel / static_cast<float>(model.wheelbase_m * model.wheelbase_m);
    mean(0) += travelled_m * std::cos(course_rad);
    mean(1) += travelled_m * std::sin(course_rad);
    mean(2) = wrapped(mean(2) + turn_rad);
    covariance = g * covariance * g.transpose() + v * m * v.transpose();
}

void add(int label, float range_m, float bearing_rad)
{
    const auto size = mean.size();
    const float course_rad = mean(2) + bearing_rad;
    const float c = std::cos(course_rad);
    const float s = std::sin(course_rad);
    Matrix by_pose(2, 3);
    Eigen::Matrix2f by_sighting;
    by_pose << 1, 0, -range_m * s, 0, 1, range_m * c;
    by_sighting << c, -range_m * s, s, range_m * c;
    Matrix grown = Matrix::Zero(size + 2, size + 2);
    grown.topLeftCorner(size, size) = covariance;
    grown.bottomLeftCorner(2, size) = by_pose * covariance.topRows(3);
    grown.topRightCorner(size, 2) = grown.bottomLeftCorner(2, size).transpose();
    grown.bottomRightCorner(2, 2) = by_pose * covariance.topLeftCorner(3, 3) * by_pose.transpose() +
                                    by_sighting * noise(range_m) * by_sighting.transpose();
    covariance = grown;
    mean.conservativeResize(size + 2);
    mean(size) = mean(0) + range_m * c;
    mean(size + 1) = mean(1) + range_m * s;
    place_of.resize(std::max<std::size_t>(place_of.size(), static_cast<std::size_t>(label) + 1), -1);
    place_of[static_cast<std::size_t>(label)] = static_cast<int>(size);
}

void correct(int place, float range_m, float bearing_rad)
{
    const Eigen::Vector2f delta = mean.segment<2>(place) - mean.head<2>();
    const float q = delta.squaredNorm();
    const float root = std::sqrt(q);
    Matrix h = Matrix::Zero(2, mean.size());
    h.leftCols<3>() << -root * delta(0) / q, -root * delta(1) / q, 0, delta(1) / q, -delta(0) / q, -1;
    h.middleCols<2>(place) << root * delta(0) / q, root * delta(1) / q, -delta(1) / q, delta(0) / q;
    const Eigen::Matrix2f s = h * covariance * h.transpose() + noise(root);
    const Matrix gain = covariance * h.transpose() * s.inverse();
    const Eigen::Vector2f innovation(range_m - root,
                                     wrapped(bearing_rad - std::atan2(delta(1), delta(0)) + mean(2)));
    mean += gain * innovation;
    mean(2) = wrapped(mean(2));
    covariance = (Matrix::Identity(mean.size(), mean.size()) - gain * h) * covariance;
}
}  // namespace

void peer_begin(const bench_model_t *given, const bench_step_t *, int, int, char **)
{
    model = *given;
    mean = Vector::Zero(3);
    covariance = Matrix::Zero(3, 3);
}

void peer_step(const bench_step_t *step, int number)
{
    if (number > 0) {
        predict(static_cast<float>(step->left_m), static_cast<float>(step->right_m));
    }
    for (int i = 0; i < step->count; i++) {
        const bench_sighting_t &one = step->sightings[i];
        const auto label = static_cast<std::size_t>(one.label);
        const auto range_m = static_cast<float>(one.range_m);
        const auto bearing_rad = static_cast<float>(one.bearing_rad);
        if (label < place_of.size() && place_of[label] >= 0) {
            correct(place_of[label], range_m, bearing_rad);
        } else {
            add(one.label, range_m, bearing_rad);
        }
    }
}

void peer_pose(double pose[3])
{
    for (int i = 0; i < 3; i++) {
        pose[i] = static_cast<double>(mean(i));
    }
}

int peer_landmarks(void)
{
    return static_cast<int>((mean.size() - 3) / 2);
}

size_t peer_static_bytes(void)
{
    return 0;
}
