#include "sila/predict/blend.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "sila/core/kinematics.hpp"
#include "sila/model/outlook.hpp"

namespace sila {
namespace {

constexpr double kVelocityWindows_s[] = {0.4, 0.8, 1.6, 3.0};
constexpr int kConstantVelocityFeature = 1;
constexpr int kGaitFeature = kKinematicFeatures;
constexpr int kOutlookFeature = kPlaceFreeFeatures;
static_assert(kVelocityWindows_s[kConstantVelocityFeature] == kConstantVelocityWindow_s);
/// Before anything was taught errors are believed to grow like this, with the weight of so many examples.
constexpr double kPriorAlong_mps = 0.35, kPriorAcross_mps = 0.25, kPriorPosition_m = 0.1, kPriorExamples = 4.0;

/// No error is believed to be smaller: people who all do the same would else make the covariances vanish.
constexpr double kLeastError_m = 1e-3;
/// A covariance thinner than this could not be told from a flat one.
constexpr double kThinnest = 1e-12;

/// The blend before anything was taught is this feature alone.
Eigen::Index untaught_feature(Eigen::Index features) {
  return features > kPlaceFreeFeatures ? kOutlookFeature : kGaitFeature;
}

double square(double x) {
  return x * x;
}

std::vector<Vector2> variances(const std::vector<ResidualMoments>& moments, int classes, double interval_s) {
  std::vector<Vector2> result;
  for (std::size_t cell = 0; cell < moments.size(); ++cell) {
    const std::size_t step = cell / static_cast<std::size_t>(classes);
    const double t = static_cast<double>(step + 1) * interval_s;
    const Vector2 prior(square(kPriorPosition_m + kPriorAlong_mps * t),
                        square(kPriorPosition_m + kPriorAcross_mps * t));
    const Vector2 sum(moments[cell].along_m2, moments[cell].across_m2);
    const Vector2 variance = (sum + kPriorExamples * prior) / (moments[cell].weight + kPriorExamples);
    result.emplace_back(variance.cwiseMax(std::max(square(kLeastError_m), kThinnest * variance.maxCoeff())));
  }
  return result;
}

/// The classes of each step together.
template <class Moments>
std::vector<Moments> over_classes(const std::vector<Moments>& moments, int classes) {
  std::vector<Moments> sums;
  for (std::size_t cell = 0; cell < moments.size(); ++cell) {
    if (cell % static_cast<std::size_t>(classes) == 0)
      sums.push_back(moments[cell]);
    else
      sums.back() += moments[cell];
  }
  return sums;
}

/// Ridge regression in every cell towards `prior(cell)`, as firm as the errors are large: what is noisy, or was seen a
/// few times only, moves little.
template <class Prior>
std::vector<Eigen::VectorXd> solve(const std::vector<RegressionMoments>& moments,
                                   const std::vector<Vector2>& residuals_m2, int classes, double interval_s,
                                   double ridge, Prior&& prior) {
  std::vector<Eigen::VectorXd> solved;
  for (std::size_t cell = 0; cell < moments.size(); ++cell) {
    const std::size_t step = cell / static_cast<std::size_t>(classes);
    const double seconds = static_cast<double>(step + 1) * interval_s;
    const double firmness = ridge * residuals_m2[cell].mean() / (seconds * seconds);
    const Eigen::VectorXd towards = prior(cell);
    Eigen::MatrixXd matrix = moments[cell].features;
    matrix.diagonal().array() += firmness;
    const Eigen::VectorXd coefficients = matrix.ldlt().solve(moments[cell].products + firmness * towards);
    solved.push_back(moments[cell].weight > 0.0 && coefficients.allFinite() ? coefficients : towards);
  }
  return solved;
}

/// Without a roll-out: all speeds together, towards the blend before anything was taught; then each class towards them.
std::vector<Eigen::VectorXd> solve_alone(const Lessons& lessons, const std::vector<Vector2>& residuals_m2,
                                         const PredictConfig& config) {
  const auto together = over_classes(lessons.residuals_without_map, lessons.classes);
  const std::vector<Eigen::VectorXd> every_speed =
      solve(over_classes(lessons.without_map, lessons.classes), variances(together, 1, lessons.interval_s), 1,
            lessons.interval_s, config.blend_ridge,
            [](std::size_t) { return Eigen::VectorXd::Unit(kAloneFeatures, untaught_feature(kAloneFeatures)); });
  return solve(lessons.without_map, residuals_m2, lessons.classes, lessons.interval_s, config.blend_class_ridge,
               [&](std::size_t cell) { return every_speed[cell / static_cast<std::size_t>(lessons.classes)]; });
}

/// With a roll-out: towards what is believed without one, so that roll-outs count as far as they were right.
std::vector<Eigen::VectorXd> solve_with_map(const Lessons& lessons, const std::vector<Vector2>& residuals_m2,
                                            const std::vector<Eigen::VectorXd>& alone, const PredictConfig& config) {
  return solve(lessons.with_map, residuals_m2, lessons.classes, lessons.interval_s, config.blend_class_ridge,
               [&](std::size_t cell) {
                 Eigen::VectorXd towards = Eigen::VectorXd::Zero(kMapFeatures);
                 towards.head(kAloneFeatures) = alone[cell];
                 return towards;
               });
}

}  // namespace

int speed_class(const CurbTrajectory& observed) {
  const double mean_mps = mean_speed_mps(observed);
  int speed = 0;
  for (double limit_mps : kSpeedClassLimits_mps) speed += mean_mps >= limit_mps ? 1 : 0;
  return speed;
}

KinematicFeatures kinematic_features(const CurbTrajectory& observed) {
  KinematicFeatures features;
  Eigen::Index column = 0;
  for (double window_s : kVelocityWindows_s) features.col(column++) = mean_velocity_mps(observed, window_s);
  features.col(column) = velocity_to_world(observed.frame, observed.velocities.back());
  return features;
}

Observation observation_of(const FieldMap& map, std::span<const int> near, const CurbTrajectory& observed,
                           Scratch& scratch) {
  const bool known_place = map.knows(observed.frame);
  Observation observation{kinematic_features(observed),
                          consult_gait(map, known_place, observed, scratch),
                          ask_outlooks(map, near, observed, scratch),
                          {},
                          known_place,
                          speed_class(observed)};
  observation.outlooks = combine(map, observed, observation.opinions, {}, scratch);
  return observation;
}

Features place_free_features(const Observation& observation, std::size_t step, double interval_s) {
  Features features(2, kPlaceFreeFeatures);
  features.leftCols(kKinematicFeatures) = observation.kinematics;
  features.col(kGaitFeature) = observation.kinematics.col(kConstantVelocityFeature) +
                               observation.gait.parting_mps(static_cast<double>(step + 1) * interval_s);
  return features;
}

Features alone_features(const Observation& observation, const Foresight& outlooks, std::size_t step,
                        double interval_s) {
  Features features(2, kAloneFeatures);
  features.leftCols(kPlaceFreeFeatures) = place_free_features(observation, step, interval_s);
  features.col(kOutlookFeature) = observation.kinematics.col(kConstantVelocityFeature) +
                                  outlooks.parting_mps(static_cast<double>(step + 1) * interval_s);
  return features;
}

Features map_features(const Observation& observation, const Rollout& rollout, const CurbTrajectory& observed,
                      std::size_t step, double interval_s) {
  Features features(2, kMapFeatures);
  const Vector2& start = observed.positions.back();
  const double seconds = static_cast<double>(step + 1) * interval_s;
  features.leftCols(kAloneFeatures) = alone_features(observation, rollout.outlooks, step, interval_s);
  features.col(kAloneFeatures) = velocity_to_world(observed.frame, rollout.path[step] - start) / seconds;
  features.col(kAloneFeatures + 1) = velocity_to_world(observed.frame, rollout.own_path[step] - start) / seconds;
  return features;
}

Blend::Blend(const Lessons& lessons, const PredictConfig& config) {
  if (!config.blend || lessons.empty()) return;
  steps_ = lessons.steps;
  const auto spread = [&](const std::vector<ResidualMoments>& residuals) {
    return variances(residuals, lessons.classes, lessons.interval_s);
  };
  place_free_ = {{}, spread(lessons.residuals_place_free)};
  alone_.residuals_m2 = spread(lessons.residuals_without_map);
  alone_.coefficients = solve_alone(lessons, alone_.residuals_m2, config);
  with_map_.residuals_m2 = spread(lessons.residuals_with_map);
  with_map_.coefficients = solve_with_map(lessons, with_map_.residuals_m2, alone_.coefficients, config);
}

const Blend::Table& Blend::table(Eigen::Index features) const {
  return features == kMapFeatures ? with_map_ : features == kAloneFeatures ? alone_ : place_free_;
}

std::size_t Blend::cell(std::size_t step, int speed_class) const {
  const std::size_t row = std::min(step, static_cast<std::size_t>(steps_ - 1));
  return row * kSpeedClasses + static_cast<std::size_t>(speed_class);
}

Vector2 Blend::velocity_mps(const Features& features, std::size_t step, int speed_class) const {
  const auto& coefficients = table(features.cols()).coefficients;
  if (coefficients.empty()) return features.col(untaught_feature(features.cols()));
  return features.lazyProduct(coefficients[cell(step, speed_class)]);
}

Vector2 Blend::residual_m2(std::size_t step, int speed_class, Eigen::Index features) const {
  const auto& residuals_m2 = table(features).residuals_m2;
  if (residuals_m2.empty()) return Vector2::Zero();
  // Beyond what was taught the error goes on growing as it did on average.
  const double growth = std::max(1.0, static_cast<double>(step + 1) / steps_);
  return residuals_m2[cell(step, speed_class)] * growth * growth;
}

Matrix2 oriented_covariance(const Vector2& direction, const Vector2& along_across_m2) {
  const double length = direction.norm();
  if (length < 1e-9) return Matrix2::Identity() * along_across_m2.mean();
  const Vector2 along = direction / length, across(-along.y(), along.x());
  return along_across_m2.x() * along * along.transpose() + along_across_m2.y() * across * across.transpose();
}

}  // namespace sila
