#include "refine/motion_change.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "model/parts.hpp"
#include "refine/fourier_features.hpp"

namespace sila {
namespace {

/// Added to speeds and times before their logarithm is taken.
constexpr double kLeastSpeed_mps = 0.05, kLeastStill_s = 0.3;
/// Ridge towards the coefficients to begin with. It is weaker for the intercept, which differs most between sites.
constexpr double kHazardRidge = 10.0, kInterceptRidge = 3.0;
/// Newton steps of an episode. With one the first episodes stay near the coefficients to begin with (decision 0134).
constexpr int kNewtonSteps = 2;
constexpr double kNominalInterval_s = 0.2;
/// Longest step of one example in log odds: where a hazard is far too low Newton's step is far too long.
constexpr double kLongestStep = 3.0;

/// Order of the features of motion: 1; logarithms of five velocities, the mean speed and the time stood still; log time
/// ahead, its square, and its products with the log velocities of the last 0.4 s and of the prediction; the squares and
/// the product of these two. Those of the place follow.
constexpr Eigen::Index kRecent = 1, kPredicted = 5, kAhead = 8, kProducts = 12;

/// Fitted to vru, students03, zara01 and the simulator together, for steps of 0.2 s; 0 for the others.
constexpr double kStarting[kProducts] = {0.19, 0.82, 0.11, -0.16, -0.11, 0.46, 0.17, -0.71, -0.31, -0.94, -0.35, -0.31};
constexpr double kStopping[kProducts] = {-5.18, -1.01, -1.03, 0.28, 0.68, -1.97, -0.39, -0.8, 0.5, -0.4, 1.98, -0.04};

/// Length scale of the kernel of positions. Positions are rounded to a lattice, so that a sum over one window reveals
/// no coordinate.
constexpr double kHazardPlaceScale_m = 2.0, kHazardLattice_m = 0.5;
/// Factor of the features of the place: their ridge is that of the others divided by its square.
constexpr double kHazardPlaceAmplitude = 0.6;

double log_speed(double speed_mps) {
  return std::log(speed_mps + kLeastSpeed_mps);
}

/// The features of a step are this times (1, a, a^2), where a is the logarithm of the time ahead.
Eigen::Matrix<double, kHazardFeatures, 3> by_power(const HazardFeatures& features) {
  Eigen::Matrix<double, kHazardFeatures, 3> result = Eigen::Matrix<double, kHazardFeatures, 3>::Zero();
  result.col(0) = features;
  result.col(1).segment<kProducts - kAhead>(kAhead) << 1.0, 0.0, features(kRecent), features(kPredicted);
  result(kAhead + 1, 2) = 1.0;
  return result;
}

/// So that no hazard reaches 0 or 1.
double limited(double log_odds) {
  return std::clamp(log_odds, -8.0, 4.0);
}

double logistic(double log_odds) {
  return 1.0 / (1.0 + std::exp(-log_odds));
}

}  // namespace

HazardFeatures hazard_features(const PastVelocities& past_mps, const Vector2& predicted_mps, double mean_speed_mps,
                               double still_s, const Vector2& position_m) {
  const Vector2 v04 = past_mps.col(0), v08 = past_mps.col(1), v16 = past_mps.col(2), v_all = past_mps.col(3);
  static const FourierBasis<kHazardPlaceFeatures, 2> basis(0, 1.0);
  const double recent = log_speed(v04.norm()), predicted = log_speed(predicted_mps.norm());
  const Vector2 place = (position_m / kHazardLattice_m).array().round() * (kHazardLattice_m / kHazardPlaceScale_m);
  HazardFeatures features;
  features << 1.0, recent, log_speed(v08.norm()), log_speed(v16.norm()), log_speed(v_all.norm()), predicted,
      log_speed(mean_speed_mps), std::log(still_s + kLeastStill_s), Eigen::Vector4d::Zero(), recent * recent,
      predicted * predicted, recent * predicted,
      kHazardPlaceAmplitude *
          (basis.amplitudes.array() * (basis.frequencies * place + basis.phases).array().cos()).matrix();
  return features;
}

std::optional<std::size_t> change_step(std::size_t state, std::span<const Vector2> past_m,
                                       std::span<const Vector2> future_m, double interval_s) {
  const auto lag = static_cast<std::size_t>(std::max(1L, std::lround(kConstantVelocityWindow_s / interval_s)));
  const double stopped_m = kSpeedClassLimits_mps[0] * static_cast<double>(lag) * interval_s;
  for (std::size_t j = 0; j < future_m.size(); ++j) {
    if (state == kStanding) {
      if ((future_m[j] - past_m.back()).norm() > kStandingReach_m) return j;
    } else if (j + past_m.size() >= lag) {
      const Vector2& before_m = j >= lag ? future_m[j - lag] : past_m[j + past_m.size() - lag];
      if ((future_m[j] - before_m).norm() < stopped_m) return j;
    }
  }
  return std::nullopt;
}

MotionChange::MotionChange(const RegressionMoments& moments, std::size_t state, double interval_s)
    : interval_s_(interval_s), coefficients_(HazardFeatures::Zero()) {
  std::ranges::copy(state == kStanding ? kStarting : kStopping, coefficients_.begin());
  coefficients_(0) += std::log(interval_s / kNominalInterval_s);
  HazardFeatures ridge = HazardFeatures::Constant(kHazardRidge);
  ridge(0) = kInterceptRidge;
  known_ = {0.0, ridge.asDiagonal(), ridge.cwiseProduct(coefficients_)};
  if (moments.weight <= 0.0) return;
  add_sums(known_, moments);
  solve(known_);
}

void MotionChange::solve(const RegressionMoments& moments) {
  const Eigen::MatrixXd solved = moments.features.ldlt().solve(moments.products);
  if (solved.allFinite()) coefficients_ = solved;
}

Eigen::Vector3d MotionChange::powers_of(std::size_t step) const {
  const double ahead = std::log(static_cast<double>(step + 1) * interval_s_);
  return {1.0, ahead, ahead * ahead};
}

void MotionChange::probabilities(const HazardFeatures& features, std::span<double> by_step) const {
  const Eigen::Vector3d log_odds = by_power(features).transpose() * coefficients_;
  double unchanged = 1.0;
  for (std::size_t j = 0; j < by_step.size(); ++j) {
    unchanged *= 1.0 - logistic(limited(log_odds.dot(powers_of(j))));
    by_step[j] = 1.0 - unchanged;
  }
}

RegressionMoments MotionChange::moments_of(std::span<const ChangeWindow> windows) const {
  MotionChange estimate = *this;
  RegressionMoments moments = estimate.moments_here(windows);
  for (int step = 0; step < kNewtonSteps && !windows.empty(); ++step) {
    add_sums(moments, known_);
    estimate.solve(moments);
    moments = estimate.moments_here(windows);
  }
  return moments;
}

RegressionMoments MotionChange::moments_here(std::span<const ChangeWindow> windows) const {
  RegressionMoments moments{0.0, Eigen::MatrixXd::Zero(kHazardFeatures, kHazardFeatures), HazardFeatures::Zero()};
  for (const ChangeWindow& window : windows) add_window(moments, window);
  return moments;
}

void MotionChange::add_window(RegressionMoments& moments, const ChangeWindow& window) const {
  const auto& [features, change, steps] = window;
  const Eigen::Matrix<double, kHazardFeatures, 3> design = by_power(features);
  const Eigen::Vector3d log_odds_by_power = design.transpose() * coefficients_;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  for (std::size_t j = 0; j < std::min(steps, change.value_or(steps) + 1); ++j) {
    const Eigen::Vector3d powers = powers_of(j);
    const double log_odds = limited(log_odds_by_power.dot(powers));
    const double p = logistic(log_odds), error = (change == j ? 1.0 : 0.0) - p;
    const double weight = std::max(p * (1.0 - p), std::abs(error) / kLongestStep);
    moments.weight += 1.0;
    information += weight * powers * powers.transpose();
    target += (weight * log_odds + error) * powers;
  }
  moments.features.triangularView<Eigen::Lower>() += design * information * design.transpose();
  moments.products += design * target;
}

}  // namespace sila
