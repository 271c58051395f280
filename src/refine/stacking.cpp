#include "sila/refine/stacking.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "sila/core/kinematics.hpp"
#include "sila/refine/residual.hpp"

namespace sila {
namespace {

constexpr double kVelocityWindows_s[] = {0.4, 0.8, 1.6, 3.0};
constexpr int kGlobalResidualFeature = kKinematicFeatures;
constexpr int kResidualFeature = kPlaceFreeFeatures;
static_assert(kVelocityWindows_s[kConstantVelocityFeature] == kConstantVelocityWindow_s);
/// Before anything was fitted errors are believed to grow like this, with the weight of so many examples.
constexpr double kPriorAlong_mps = 0.35, kPriorAcross_mps = 0.25, kPriorPosition_m = 0.1, kPriorExamples = 4.0;

/// No error is believed to be smaller: people who all do the same would else make the covariances vanish.
constexpr double kLeastError_m = 1e-3;
/// A covariance thinner than this could not be told from a flat one.
constexpr double kThinnest = 1e-12;

/// Stacking before anything was fitted is this feature alone.
Eigen::Index unfitted_feature(Eigen::Index features) {
  return features > kPlaceFreeFeatures ? kResidualFeature : kGlobalResidualFeature;
}

double square(double x) {
  return x * x;
}

std::vector<Vector2> variances(const std::vector<ErrorMoments>& moments, int classes, double interval_s) {
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
                                   const std::vector<Vector2>& variances_m2, int classes, double interval_s,
                                   double ridge, Prior&& prior) {
  std::vector<Eigen::VectorXd> solved;
  for (std::size_t cell = 0; cell < moments.size(); ++cell) {
    const std::size_t step = cell / static_cast<std::size_t>(classes);
    const double seconds = static_cast<double>(step + 1) * interval_s;
    const double firmness = ridge * variances_m2[cell].mean() / (seconds * seconds);
    const Eigen::VectorXd towards = prior(cell);
    Eigen::MatrixXd matrix = moments[cell].features;
    matrix.diagonal().array() += firmness;
    const Eigen::VectorXd coefficients = matrix.ldlt().solve(moments[cell].products + firmness * towards);
    solved.push_back(moments[cell].weight > 0.0 && coefficients.allFinite() ? coefficients : towards);
  }
  return solved;
}

/// Without a roll-out: all speeds together, towards stacking before anything was fitted; then each class towards them.
std::vector<Eigen::VectorXd> solve_alone(const ErrorStatistics& error_statistics,
                                         const std::vector<Vector2>& variances_m2, const PredictConfig& config) {
  const auto together = over_classes(error_statistics.errors_without_map, error_statistics.classes);
  const std::vector<Eigen::VectorXd> every_speed =
      solve(over_classes(error_statistics.without_map, error_statistics.classes),
            variances(together, 1, error_statistics.interval_s), 1, error_statistics.interval_s, config.stacking_ridge,
            [](std::size_t) { return Eigen::VectorXd::Unit(kAloneFeatures, unfitted_feature(kAloneFeatures)); });
  return solve(error_statistics.without_map, variances_m2, error_statistics.classes, error_statistics.interval_s,
               config.stacking_class_ridge, [&](std::size_t cell) {
                 return every_speed[cell / static_cast<std::size_t>(error_statistics.classes)];
               });
}

/// With a roll-out: towards what is believed without one, so that roll-outs count as far as they were right.
std::vector<Eigen::VectorXd> solve_with_map(const ErrorStatistics& error_statistics,
                                            const std::vector<Vector2>& variances_m2,
                                            const std::vector<Eigen::VectorXd>& alone, const PredictConfig& config) {
  return solve(error_statistics.with_map, variances_m2, error_statistics.classes, error_statistics.interval_s,
               config.stacking_class_ridge, [&](std::size_t cell) {
                 Eigen::VectorXd towards = Eigen::VectorXd::Zero(kMapFeatures);
                 towards.head(kAloneFeatures) = alone[cell];
                 return towards;
               });
}

/// A person who hardly moves is believed, before more windows than these were seen, to stay, to go on half as fast, or
/// to do as any other.
constexpr double kLeastSlowWindows = 10.0;
constexpr std::array<SlowChoice, kSlowClasses> kUnfittedSlowChoices = {{{0.0, 0.0}, {0.5, 0.0}}};

std::array<SlowChoice, kSlowClasses> choices_of(const ErrorStatistics& error_statistics) {
  std::array<SlowChoice, kSlowClasses> choices = kUnfittedSlowChoices;
  for (std::size_t c = 0; c < error_statistics.slow.size(); ++c) {
    const SlowErrors& slow = error_statistics.slow[c];
    if (slow.weight < kLeastSlowWindows) continue;
    choices[c] = kSlowChoices[std::ranges::min_element(slow.errors_m) - slow.errors_m.begin()];
  }
  return choices;
}

}  // namespace

std::optional<std::size_t> slow_class(const CurbTrajectory& observed) {
  if (observed.positions.size() < 2) return std::nullopt;
  const Vector2 way = velocity_to_world(observed.frame, observed.positions.back() - observed.positions.front());
  const double net_mps = way.norm() / (observed.times_s.back() - observed.times_s.front());
  const auto limit = std::ranges::upper_bound(kSlowLimits_mps, net_mps);
  if (limit == std::end(kSlowLimits_mps)) return std::nullopt;
  return static_cast<std::size_t>(limit - std::begin(kSlowLimits_mps));
}

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

ObservedFeatures observed_features(const ResidualIndex& index, std::optional<int> site, std::span<const int> near,
                                   const CurbTrajectory& observed, Scratch& scratch) {
  ObservedFeatures seen{kinematic_features(observed),
                        predict_global_residual(index, site, observed, scratch),
                        predict_experts(index, near, observed, scratch),
                        {},
                        site,
                        speed_class(observed),
                        slow_class(observed)};
  seen.residuals = combine(index, observed, seen.experts, {}, scratch);
  return seen;
}

Features place_free_features(const ObservedFeatures& seen, std::size_t step, double interval_s) {
  Features features(2, kPlaceFreeFeatures);
  features.leftCols(kKinematicFeatures) = seen.kinematics;
  features.col(kGlobalResidualFeature) = seen.kinematics.col(kConstantVelocityFeature) +
                                         seen.global_residual.residual_mps(static_cast<double>(step + 1) * interval_s);
  return features;
}

Features alone_features(const ObservedFeatures& seen, const ResidualPrediction& residuals, std::size_t step,
                        double interval_s) {
  Features features(2, kAloneFeatures);
  features.leftCols(kPlaceFreeFeatures) = place_free_features(seen, step, interval_s);
  features.col(kResidualFeature) = seen.kinematics.col(kConstantVelocityFeature) +
                                   residuals.residual_mps(static_cast<double>(step + 1) * interval_s);
  return features;
}

Features map_features(const ObservedFeatures& seen, const Rollout& rollout, const ResidualPrediction& residuals,
                      const CurbTrajectory& observed, std::size_t step, double interval_s) {
  Features features(2, kMapFeatures);
  const Vector2& start = observed.positions.back();
  const double seconds = static_cast<double>(step + 1) * interval_s;
  features.leftCols(kAloneFeatures) = alone_features(seen, residuals, step, interval_s);
  features.col(kAloneFeatures) = velocity_to_world(observed.frame, rollout.path[step] - start) / seconds;
  features.col(kAloneFeatures + 1) = velocity_to_world(observed.frame, rollout.own_path[step] - start) / seconds;
  return features;
}

Stacking::Stacking(const ErrorStatistics& error_statistics, const PredictConfig& config) {
  if (!config.stacking || error_statistics.empty()) return;
  steps_ = error_statistics.steps;
  slow_choices_ = choices_of(error_statistics);
  const auto spread = [&](const std::vector<ErrorMoments>& residuals) {
    return variances(residuals, error_statistics.classes, error_statistics.interval_s);
  };
  place_free_ = {{}, spread(error_statistics.errors_place_free)};
  alone_.variances_m2 = spread(error_statistics.errors_without_map);
  alone_.coefficients = solve_alone(error_statistics, alone_.variances_m2, config);
  with_map_.variances_m2 = spread(error_statistics.errors_with_map);
  with_map_.coefficients = solve_with_map(error_statistics, with_map_.variances_m2, alone_.coefficients, config);
}

const Stacking::Table& Stacking::table(Eigen::Index features) const {
  return features == kMapFeatures ? with_map_ : features == kAloneFeatures ? alone_ : place_free_;
}

std::size_t Stacking::cell(std::size_t step, int speed_class) const {
  const std::size_t row = std::min(step, static_cast<std::size_t>(steps_ - 1));
  return row * kSpeedClasses + static_cast<std::size_t>(speed_class);
}

Vector2 Stacking::velocity_mps(const Features& features, std::size_t step, const ObservedFeatures& seen) const {
  const Vector2 stacked = stacked_mps(features, step, seen.speed);
  if (!seen.slow || !fitted()) return stacked;
  const SlowChoice& choice = slow_choices_[*seen.slow];
  return choice.constant_velocity * features.col(kConstantVelocityFeature) + choice.stacked * stacked;
}

Vector2 Stacking::stacked_mps(const Features& features, std::size_t step, int speed_class) const {
  const auto& coefficients = table(features.cols()).coefficients;
  if (coefficients.empty()) return features.col(unfitted_feature(features.cols()));
  return features.lazyProduct(coefficients[cell(step, speed_class)]);
}

Vector2 Stacking::error_variance_m2(std::size_t step, int speed_class, Eigen::Index features) const {
  const auto& variances_m2 = table(features).variances_m2;
  if (variances_m2.empty()) return Vector2::Zero();
  // Beyond what was fitted the error goes on growing as it did on average.
  const double growth = std::max(1.0, static_cast<double>(step + 1) / steps_);
  return variances_m2[cell(step, speed_class)] * growth * growth;
}

Matrix2 oriented_covariance(const Vector2& direction, const Vector2& along_across_m2) {
  const double length = direction.norm();
  if (length < 1e-9) return Matrix2::Identity() * along_across_m2.mean();
  const Vector2 along = direction / length, across(-along.y(), along.x());
  return along_across_m2.x() * along * along.transpose() + along_across_m2.y() * across * across.transpose();
}

}  // namespace sila
