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

/// Ridge regression towards the untaught blend, as firm as the errors are large: what is noisy, or was seen a few times
/// only, moves little.
std::vector<Eigen::VectorXd> solve(const std::vector<RegressionMoments>& moments,
                                   const std::vector<Vector2>& residuals_m2, const Lessons& lessons, int features,
                                   double ridge) {
  const Eigen::VectorXd prior = Eigen::VectorXd::Unit(features, untaught_feature(features));
  std::vector<Eigen::VectorXd> solved;
  for (std::size_t cell = 0; cell < moments.size(); ++cell) {
    const std::size_t step = cell / static_cast<std::size_t>(lessons.classes);
    const double seconds = static_cast<double>(step + 1) * lessons.interval_s;
    const double firmness = ridge * residuals_m2[cell].mean() / (seconds * seconds);
    Eigen::MatrixXd matrix = moments[cell].features;
    matrix.diagonal().array() += firmness;
    const Eigen::VectorXd coefficients = matrix.ldlt().solve(moments[cell].products + firmness * prior);
    solved.push_back(moments[cell].weight > 0.0 && coefficients.allFinite() ? coefficients : prior);
  }
  return solved;
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

Observation observation_of(const FieldMap& map, const CurbTrajectory& observed, Scratch& scratch) {
  Observation observation{kinematic_features(observed),
                          consult_gait(map, observed, scratch),
                          ask_outlooks(map, observed, scratch),
                          {},
                          map.knows(observed.frame),
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
  const auto taught_by = [&](const std::vector<RegressionMoments>& moments,
                             const std::vector<ResidualMoments>& residuals, int features) {
    Table table{{}, variances(residuals, lessons.classes, lessons.interval_s)};
    table.coefficients = solve(moments, table.residuals_m2, lessons, features, config.blend_ridge);
    return table;
  };
  place_free_ = {{}, variances(lessons.residuals_place_free, lessons.classes, lessons.interval_s)};
  alone_ = taught_by(lessons.without_map, lessons.residuals_without_map, kAloneFeatures);
  with_map_ = taught_by(lessons.with_map, lessons.residuals_with_map, kMapFeatures);
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
